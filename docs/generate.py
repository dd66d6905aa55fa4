"""Writes the pages of the documentation that are made from the code: keys, variables, commands, functions, gallery.

`python docs/generate.py` writes them into `docs/reference`, and draws pictures of the gallery that are missing. With
`--pictures` it also draws all pictures again, which takes ten minutes and needs MuJoCo. `make docs` calls it.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import api_pages
import control_figures
import identification_figures
import limit_cycles_figures
import motors_figures
import reference_figures
import robots_figures
import self_locking_figures
import servo_figures
import tracking_figures
import two_motors_figures
from figure_files import smaller
from typer.main import get_command

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.control import references
from lostmotion.inputs.schema import options, unit_in_schema
from lostmotion.model import signals
from lostmotion.simulation.forms.drive_tables import drive_schema
from lostmotion.simulation.forms.train_tables import train_schema
from lostmotion.simulation.variables import VARIABLES
from lostmotion.units.grammar import PREFIXED
from lostmotion.units.unit_table import UNITS

OUT = Path(__file__).parent / "reference"
IMAGES = Path(__file__).parent / "images"
WRITERS = (
    reference_figures,
    self_locking_figures,
    servo_figures,
    tracking_figures,
    two_motors_figures,
    motors_figures,
    control_figures,
    limit_cycles_figures,
    identification_figures,
    robots_figures,
)


def purpose_of(table: Mapping[str, Any]) -> str:
    """First paragraph of the docstring of the part that a table is read into."""
    name = table.get("title", "").split("[")[0]
    generic = getattr(signals, name, getattr(references, name, None))  # a generic class keeps its docstring
    text = table.get("description") or (generic.__doc__ if generic else "") or ""
    return text.split("\n\n")[0].replace("\n", " ").replace("``", "`")


def unit_of(node: dict[str, Any]) -> str:
    unit = unit_in_schema(node)
    return "" if unit is None else unit.replace("*", "·") or "1"


def limits_of(node: dict[str, Any]) -> str:
    signs = {"exclusiveMinimum": "> ", "minimum": "≥ ", "exclusiveMaximum": "< ", "maximum": "≤ "}
    found = [sign + f"{node[key]:g}" for key, sign in signs.items() if key in node]
    for key in ("anyOf", "oneOf", "allOf"):
        for option in node.get(key, []):
            if isinstance(option, dict) and (inner := limits_of(option)):
                found.append(inner)
    return ", ".join(dict.fromkeys(found))


ELEMENTS = ("additionalProperties",)  # tables by name, such as [gears.NAME]


def has_elements(node: Mapping[str, Any]) -> bool:
    """Whether a key holds tables by name."""
    return any(isinstance(node.get(key), dict) for key in ELEMENTS)


def tables_in(node: dict[str, Any], schema: dict[str, Any]) -> list[Mapping[str, Any]]:
    """The tables that a key may hold."""
    places = list(options(schema, node))
    entries = [place[key] for place in places for key in ("items", *ELEMENTS) if isinstance(place.get(key), dict)]
    found = [table for place in (node, *entries) for table in options(schema, place)]
    return [table for table in found if "properties" in table]


def write_table(
    title: str, table: Mapping[str, Any], schema: dict[str, Any], lines: list[str], done: set[str], heading: str = ""
) -> None:
    lines += [f"## `{heading}`" if heading else "## The whole file", "", purpose_of(table), ""]
    lines += ["| key | unit | range | default | meaning |", "|---|---|---|---|---|"]
    later = []
    for key, node in table["properties"].items():
        inner = tables_in(node, schema)
        default = "needed" if key in table.get("required", []) else repr(node.get("default", "")).strip("'")
        default = {"None": "", "()": ""}.get(default, default if len(default) < 20 else "")
        if "const" in node:
            default = f'"{node["const"]}"'
        meaning = (node.get("description") or (purpose_of(inner[0]) if inner else "")).replace("\n", " ")
        kind = "table" if inner else unit_of(node)
        lines.append(f"| `{key}` | {kind} | {limits_of(node)} | {default} | {meaning.replace('|', chr(92) + '|')} |")
        place = f"{key}.NAME" if has_elements(node) else key
        later += [(f"{title}.{place}" if title != "top level" else place, t) for t in inner]
    lines.append("")
    for name, inner in later:
        identity = f"{name}:{inner.get('title', '')}"
        if identity not in done:
            done.add(identity)
            kind = inner["properties"].get("kind", {}).get("const")
            heading = f'[{name}] kind = "{kind}"' if kind else f"[{name}]"
            write_table(name, inner, schema, lines, done, heading)


def scenario_reference() -> str:
    schema = drive_schema()
    lines = [
        "# Scenario files",
        "",
        "This page is for those who write scenarios. It lists every key of the short form, with unit, range and default.",
        "",
        'A scenario is a TOML file. Numbers are SI and radians; strings carry a unit, such as `"3300 rpm"`, `"0.6 mrad"` or',
        '`"23 N*m/arcmin"` ([all units](#numbers-and-units)). An unknown key, a missing one, a wrong unit or a value out of range ends',
        "in one line that names all of them.",
        'With `base = "other.toml"` a file contains only the differences from another one. A signal (`command`, `load.torque`) is the',
        "sum of all its parts; a bare number is a constant. This page is made from the schema that `lostmotion schema` prints.",
        "",
    ]
    write_table("top level", schema, schema, lines, set())
    lines += changes()
    lines += units()
    return "\n".join(lines)


def train_reference() -> str:
    """The long form."""
    schema = train_schema()
    lines = [
        "# Scenario files of drive trains",
        "",
        "This page is for those who write drive trains. It lists every key of the long form, with unit, range and default.",
        "",
        "In the long form of a [scenario](scenario.md), shafts, slides, gears, motors, brakes and clutches replace `[motor]`, `[gearbox]` and",
        "`[load]`. Each has a NAME: letters, digits and `_`. Result variables are called after the names.",
        "[Drive trains](../drive-trains.md) introduces it. Numbers, units, signals, `base` and `--set` are as in the short form.",
        "",
    ]
    write_table("top level", schema, schema, lines, set())
    return "\n".join(lines)


def changes() -> list[str]:
    """What a change of one key does to a part that is otherwise given."""
    return [
        "## Changes to a motor or gearbox",
        "",
        "A key beside `from`, over a `base`, by `--set` or in a study replaces one value. A change that could have no effect",
        "is refused. Values that depend on each other change together:",
        "",
        "- `motor.rated_voltage`: the same motor, whose command 1 is now another voltage. Stall torque and no-load speed are proportional to the",
        "  voltage, so that `armature_voltage_constant` and `rated_speed` follow, unless they are given too. Rated torque and time constant stay.",
        "  Half the command at twice the rated voltage is the same motion. A voltage at which the motor does not reach its rated torque is refused.",
        "- `motor.rated_torque`, `motor.rated_speed` and `motor.armature_voltage_constant` define the speed-torque line. A change of one of them",
        "  gives another motor. Its stall torque is the product of the first and the last.",
        '- `motor.kind = "torque_source"`: rotor, friction and rated torque stay. Values that only a DC motor has are dropped.',
        "- `motor.limits` and `gearbox.limits` are the limits of the manufacturer. They change no motion, only the verdicts of `lostmotion check`,",
        "  and no other key changes them.",
        "- `gearbox.ratio`, `inertia`, `viscous_friction`, `rated_input_speed` and `rated_output_torque` beside `from` replace values of the record.",
        "  The loss map is computed from them. Stiffness and hysteresis stay as printed.",
        "",
    ]


def units() -> list[str]:
    """What a string may hold, with the units of the closed list."""
    rows = [f"| `{symbol}` | {', '.join(f'`{p}{symbol}`' for p in p.split())} |" for symbol, (_, p) in PREFIXED.items()]
    others = [" ".join(f"`{s}`" for s in spellings.split()) for _, _, spellings in UNITS.values() if spellings]
    return [
        "## Numbers and units",
        "",
        "A string is one number and one unit. The number has a decimal point, no separators between thousands and no arithmetic:",
        '`"1,2 kg*m^2"`, `"1 000 N*m"` and `"2**3 N*m"` are refused, and the message shows the right spelling. A unit is a product of',
        "the symbols below, with `*`, `·`, a space or a hyphen between them. `/` divides by the next symbol alone. Brackets are allowed,",
        "and powers as `^2`, `**2`, `²` or `2`. Usual spellings without a sign are known: `Nm`, `mNm`, `Ncm`, `kgcm2`, `gcm2`, `ozin`, `lbft`, `Nms`.",
        "",
        "The meaning of a unit depends on the quantity:",
        "",
        "- A speed of rotation in `rpm`, `1/min`, `min^-1` or `rev/s` is in turns. `1/s` and `Hz` may mean turns or radians there, and are",
        "  refused; a frequency in `rpm` or `rad/s` is refused as well.",
        "- `lb` and `oz` are forces in a torque or a stiffness and masses in a moment of inertia; with `s^2`, as in `lb*in*s^2`, forces again.",
        "  `kg` and `g` are always masses, `kgf` and `gf` forces.",
        "- A stiffness needs its angle (`N*m/rad`, `N*m/arcmin`); in `N*m*s` the radian may be left out.",
        "- In a product, `degC` is a difference of temperatures (`degC/W` is `K/W`); alone, a temperature.",
        "- A plain number may be given in `%`.",
        "",
        "The same holds for data sheets, studies, `--set` and the constructors in Python.",
        "",
        "| unit | with prefixes |",
        "|---|---|",
        *rows,
        "",
        "| other units, each with all its spellings |",
        "|---|",
        *(f"| {other} |" for other in (*others, "`rpm` `krpm` `rps`")),
        "",
        "Case matters only if two units differ by it (`mNm`, `MNm`). `u` may be written `µ`.",
        "",
    ]


def variables() -> str:
    lines = ["# Result variables", ""]
    lines += [
        "This page is for those who evaluate results. It lists the variables of a result, over the coordinate `time` [s].",
        "",
    ]
    lines += ["| variable | symbol | unit | meaning |", "|---|---|---|---|"]
    lines += [
        f"| `{v.name}` | {v.symbol} | {v.unit.replace('*', '·')} | {v.meaning.replace('|', chr(92) + '|')} |"
        for v in VARIABLES
    ]
    lines += [
        "",
        "The variables of a [drive train](../drive-trains.md) are called after its elements:",
        "",
        "| element | variables |",
        "|---|---|",
        "| shaft | `<shaft>_speed`, `<shaft>_angle`, `<shaft>_load_torque` |",
        "| gear | `<gear>_twist`, `<gear>_output_torque`, `<gear>_input_torque` |",
        "| motor | `<motor>_torque`, `<motor>_command` |",
        "| dry contact | its mode: `<shaft>_contact`, `<gear>_twist_contact`, `<clutch>_contact`; its torque: the same with `_torque` |",
        "| [slide](../linear.md) | `<slide>_position`, `<slide>_load_force` |",
        "| screw, rack, belt, linear motor | `<screw>_deflection`, `<screw>_output_force`, `<motor>_force` |",
        "",
        "`lm.switchings_of(result)` gives the switchings as a dataset: their instants, the cause of each, the modes of the contacts before",
        "and after, and both limits of the output torque. In a NetCDF file they are the group `switchings`.",
        "",
        "Attributes are `scenario` (all values, can be run again), `energy`, `end_state`, `solver` and `switching_count`. `mode_trials` counts the",
        "combinations of contact modes that were tried, `mode_fallbacks` the restarts of their search. `note` and `warning` are there if they apply.",
        "",
    ]
    return "\n".join(lines)


def commands() -> str:
    """The reference of the command line, from the commands themselves."""
    lines = [
        "# Command line",
        "",
        "This page is for users of the command line. It lists every command with its arguments and options.",
        "",
        "Every command takes `-h` or `--help`. A command that judges ends with one verdict. Its exit code is 0 for what fits, with or without a reservation, 1 for what does not fit and for errors, 3 for what is not decided. Errors are one line on the standard error.",
        "`lostmotion --install-completion` installs the completion of commands, options, scenarios and gearboxes for your shell.",
        "",
    ]
    for name, command in _commands_of(get_command(app), "lostmotion"):
        lines += _command_section(name, command)
    return "\n".join(lines)


def _commands_of(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands_of(command, f"{prefix} {name}")
        else:
            yield f"{prefix} {name}", command


def _command_section(name: str, command: Any) -> list[str]:
    text, _, examples = inspect.cleandoc(command.help or "").partition("\b\n")
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and "--help" not in p.opts]
    usage = " ".join([name, *["[OPTIONS]"] * bool(options), *(p.metavar for p in arguments)])
    lines = [f"## `{name}`", "", text.strip(), "", "```text", usage, "```", ""]
    if examples:
        lines += ["For example:", "", "```sh", examples.strip(), "```", ""]
    rows = [(f"`{p.metavar}`", "", p.help) for p in arguments]
    for p in options:
        value = f" {p.metavar}" if p.metavar else ""
        default = "" if p.default in (None, False) else f"`{p.default}`"
        rows.append((", ".join(f"`{o}{value}`" for o in p.opts), default, p.help))
    if rows:
        lines += ["| argument, option | default | meaning |", "|---|---|---|"]
        lines += [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows]
    return [*lines, ""]


# The shipped scenarios by topic: a heading of the gallery, and the beginnings of the names below it.
TOPICS = {
    "The drive of the paper": ("paper-",),
    "Backlash, friction and losses": (
        "backlash-",
        "catalogue-",
        "lossy-",
        "overrunning-",
        "step-to-",
        "voltage-",
        "worm-",
    ),
    "Servo axes": ("position-axis", "speed-axis", "joint-", "field-weakening", "hobby-servo"),
    "Linear axes": ("ball-screw-", "gantry-", "rack-", "vertical-"),
    "Steppers": ("stepper-",),
    "Limit cycles": ("hunting-",),
    "Tracking and pointing": ("tracking-", "direction-finder"),
    "Drive trains": ("belt-", "bevel-", "conveyor-", "thruster-", "two-motors-", "two-link-", "given-motion"),
}


def topic_of(name: str) -> str:
    """Heading of the gallery for a scenario."""
    found = [topic for topic, beginnings in TOPICS.items() if name.startswith(beginnings)]
    if len(found) != 1:
        raise ValueError(
            f"scenario {name}: {len(found)} topics of the gallery have it; add it to TOPICS of docs/generate.py"
        )
    return found[0]


def gallery() -> str:
    """The page with a picture of each shipped scenario, by topic."""
    lines = [
        "# Gallery of scenarios",
        "",
        "This page is for those who look for a scenario to start from. It shows each scenario that is shipped, by topic.",
        "",
        "Run a scenario by its name (`lostmotion run NAME --plot run.png`), change it with `--set`, copy it by `lostmotion new NAME`, or name it",
        "as the `base` of your own file. Those called paper-... are the runs of [the paper](../citing.md#the-paper).",
        "",
    ]
    scenarios = lm.shipped_scenarios()
    for topic in TOPICS:
        names = [name for name in scenarios if topic_of(name) == topic]
        lines += [f"## {topic}", "", "| run | scenario |", "|---|---|"] if names else []
        for name in names:
            title, file = lm.load(name).title, f"../../scenarios/{name}.toml"
            shown = f"[`{name}`]({file}): **{title}.** {introduction(scenarios[name])}".replace("|", "\\|")
            lines.append(f"| ![{title}](../images/gallery/{name}.png) | {shown} |")
        lines += [""] if names else []
    return "\n".join(lines)


def draw_gallery(out: Path, again: bool) -> None:
    """The pictures of the gallery, those that are missing or all of them."""
    out.mkdir(exist_ok=True)
    for name in lm.shipped_scenarios():
        if again or not (out / f"{name}.png").exists():
            lm.simulate(lm.load(name)).lm.plot().savefig(out / f"{name}.png", dpi=45, metadata={"Software": None})
            smaller(out / f"{name}.png")


def introduction(path: Path) -> str:
    """The first comment of a scenario file."""
    block: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            block.append(line.lstrip("# "))
        elif block:
            break
    return " ".join(block)


def collect(writers: Iterable[Any], out: Path) -> None:
    """The files that modules write, in one directory; two modules with the same file name end in an error."""
    made: dict[str, str] = {}
    for writer in writers:
        with TemporaryDirectory(dir=out) as own:
            writer.write(Path(own))
            for path in sorted(Path(own).iterdir()):
                if path.name in made:
                    raise FileExistsError(
                        f"{path.name}: written by {made[path.name]} and by {writer.__name__}; rename one"
                    )
                made[path.name] = writer.__name__
                if path.suffix == ".png":
                    smaller(path)
                path.replace(out / path.name)


def pages() -> Iterator[tuple[str, str]]:
    """All pages, each with its place in `docs/reference`."""
    yield "scenario.md", scenario_reference()
    yield "train.md", train_reference()
    yield "variables.md", variables()
    yield "commands.md", commands()
    yield "gallery.md", gallery()
    yield "worm-gears.md", self_locking_figures.worm_page()
    yield from ((f"api/{space}.md", text) for space, text in api_pages.pages())


if __name__ == "__main__":
    (OUT / "api").mkdir(parents=True, exist_ok=True)
    for name, text in pages():
        (OUT / name).write_text(text, encoding="utf-8")
    if "--pictures" in sys.argv:
        collect(WRITERS, IMAGES)
    draw_gallery(IMAGES / "gallery", "--pictures" in sys.argv)
