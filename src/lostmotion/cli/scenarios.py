"""`lostmotion scenarios` and `lostmotion schema`."""

from __future__ import annotations


def scenarios() -> None:
    """List the shipped scenarios.

    All commands take their names in place of a file.

    \b
    lostmotion scenarios
    """
    from ..inputs.toml_files import read_toml
    from ..simulation.shipped import shipped_scenarios

    found = shipped_scenarios()
    width = max(map(len, found))
    for name, path in found.items():
        print(f"{name:<{width}}  {read_toml(path, 'a scenario')['title']}")
    print("Next: lostmotion run position-axis --plot run.png")


def schema() -> None:
    """Print the JSON Schema of scenario files.

    Editors complete and check scenario files of drives and of drive trains with it.

    \b
    lostmotion schema > scenario.schema.json
    """
    import json

    from ..simulation.axis_form import file_schema

    print(json.dumps(file_schema(), indent=2))
