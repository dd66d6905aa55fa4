"""`lostmotion scenarios` and `lostmotion schema`."""

from __future__ import annotations


def scenarios() -> None:
    """List the scenarios that come with the package; `run`, `response` and `drive check` take their names.

    \b
    lostmotion scenarios
    """
    from ..inputs.toml_files import read_toml
    from ..simulation.shipped import shipped_scenarios

    found = shipped_scenarios()
    width = max(map(len, found))
    for name, path in found.items():
        print(f"{name:<{width}}  {read_toml(path, 'a scenario')['title']}")


def schema() -> None:
    """Print the JSON Schema of scenario files, of drives and of drive trains.

    Editors complete and check scenario files with it.

    \b
    lostmotion schema > scenario.schema.json
    """
    import json

    from ..simulation.axis_form import file_schema

    print(json.dumps(file_schema(), indent=2))
