"""`lostmotion scenarios`, `lostmotion new` and `lostmotion schema`."""

from pathlib import Path

from .arguments import SourceArgument, option


def scenarios() -> None:
    """To find a scenario to start from: list the shipped scenarios.

    \b
    lostmotion scenarios

    All commands take their names in place of a file.
    """
    from ..inputs.toml_files import read_toml
    from ..simulation.scenario.shipped_scenarios import shipped_scenarios

    found = shipped_scenarios()
    width = max(map(len, found))
    for name, path in found.items():
        print(f"{name:<{width}}  {read_toml(path, 'a scenario')['title']}")
    print(
        "Next: lostmotion run position-axis --plot run.png, or lostmotion new position-axis -o my.toml for a copy to change"
    )


def new(
    scenario: SourceArgument, output: Path = option("FILE.toml", "The copy.", "-o", "--output", default=...)
) -> None:
    """To start a file of your own: copy a shipped one with comments.

    \b
    lostmotion new position-axis -o my.toml
    """
    from ..atomic_writer import write_bytes
    from ..errors import InputError, need
    from ..simulation.scenario.scenario_files import find_scenario
    from ..simulation.scenario.scenario_writer import changed_text

    need("tomlkit", "A copy with its comments", "control")
    for path in (Path(scenario), output):
        if path.suffix != ".toml" and (path.suffix or path is output):
            raise InputError(f"{path}: a scenario is a TOML file; its name must end in .toml")
    if output.exists():
        raise InputError(f"{output}: exists; name another file")
    write_bytes(output, changed_text(find_scenario(scenario), {}, output, []).encode())
    print(f"Scenario written to {output}")
    print(f"Next: lostmotion run {output}")


def schema() -> None:
    """To let an editor check scenarios: print their JSON Schema.

    \b
    lostmotion schema > scenario.schema.json

    Editors complete and check scenario files of drives and of drive trains with it.
    """
    import json

    from ..simulation.forms.axis_form import file_schema

    print(json.dumps(file_schema(), indent=2))
