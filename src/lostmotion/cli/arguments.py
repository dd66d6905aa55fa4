"""Arguments and options that several commands share: how they are read and completed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from ..simulation.scenario.scenario import Scenario


def option(
    metavar: str, about: str, *names: str, default: Any = None, parser: Callable[[str], Any] | None = None
) -> Any:
    """An option of a command with a value; without names it is called as its parameter."""
    return typer.Option(default, *names, metavar=metavar, help=about, parser=parser)


def flag(about: str, *names: str, default: bool = False) -> Any:
    """An option of a command without a value; without names there is one for yes and one for no."""
    return typer.Option(default, *names, help=about)


def argument(
    metavar: str, about: str, default: Any = None, autocompletion: Callable[[str], list[str]] | None = None
) -> Any:
    """An argument of a command; `...` as the default: it is required."""
    return typer.Argument(default, metavar=metavar, help=about, autocompletion=autocompletion)


def number(unit: str = "", option: str = "") -> Callable[[str], float]:
    """Reads the value of an option: a bare number in `unit`, which is printed back, or one with a unit, as in a scenario."""

    def read(text: str) -> float:
        from ..inputs.refusal_messages import shown
        from ..units.conversion import si_value

        try:
            value = si_value(text, unit)
        except ValueError as error:
            raise typer.BadParameter(f"{shown(text)} {error}") from None
        print_bare(option, text, unit)
        return value

    return read


def as_number(text: str) -> float | None:
    """The value of a bare number; None of any other text."""
    try:
        return float(text)
    except ValueError:
        return None


def print_bare(what: str, text: str, unit: str | None) -> None:
    """Print a bare number of an option with the unit in which it is read; nothing of text with a unit, or of a plain number."""
    from ..inputs.implausible_values import read_as

    value = as_number(text)
    if unit and value is not None:
        print(f"{what}: {read_as(value, unit)}; a bare number is read in SI units")


def decibels(text: str) -> float:
    """Reads a gain in dB as a factor."""
    return float(10.0 ** (number()(text.strip().removesuffix("dB")) / 20.0))


def load_scenario(source: str, overrides: list[str] | None, missing: list[str] | None = None) -> Scenario:
    """The scenario of a command, bare numbers of `--set` printed with the unit in which they are read. With a list for their keys
    its gains may be missing."""
    from ..simulation.forms.set_by_dotted_key import key_and_value
    from ..simulation.scenario.units_of_keys import unit_for

    if missing is None:
        from ..simulation.runs.loading import load

        loaded = load(source, overrides or ())
    else:
        from ..servo.tuning_result import load_untuned

        loaded = load_untuned(source, overrides or (), missing)
    for text in overrides or ():
        for key, value in _numbers_of(*key_and_value(text)):
            print_bare(key, value, unit_for(loaded, key))
    return loaded


def again(scenario: str, overrides: list[str] | None) -> str:
    """Scenario and changes as a command line that is suggested names them."""
    from shlex import join

    return join([scenario, *(part for text in overrides or () for part in ("--set", text))])


def _numbers_of(key: str, value: Any) -> Iterator[tuple[str, str]]:
    """The bare numbers of a value, as text, with their dotted keys: numbers in lists and tables too."""
    if isinstance(value, dict | list):
        for name, entry in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers_of(f"{key}.{name}", entry)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield key, str(value)


def print_timed_moves(scenario: Scenario) -> None:
    """Print law and peaks of the moves with a duration."""
    from ..control.references import MovesReference

    for controller in (scenario.axes() | scenario.continuous()).values():
        reference = controller.reference
        for line in reference.timed_moves() if isinstance(reference, MovesReference) else ():
            print(f"  {line}")


def count(text: str) -> int:
    """Reads the value of an option that counts something."""
    if not (text.isascii() and text.isdecimal() and int(text) > 0):
        raise typer.BadParameter(f'"{text}" must be a whole number above 0')
    return int(text)


def _files(incomplete: str) -> Iterator[str]:
    """Names of files and directories, for the completion of the shell."""
    from glob import escape, glob

    for name in sorted(glob(f"{escape(incomplete)}*")):
        yield f"{name}/" if Path(name).is_dir() else name


def complete_scenario(incomplete: str) -> list[str]:
    """Shipped scenarios and files."""
    from importlib.resources import files

    names = sorted(f.name.removesuffix(".toml") for f in (files("lostmotion") / "scenarios").iterdir())
    return [*(n for n in names if n.startswith(incomplete)), *_files(incomplete)]


def complete_on_rig(incomplete: str) -> list[str]:
    """Gearboxes and screws of the catalogue, and files."""
    from ..data_sheets.records import catalogue, table_of

    names = [r.name for r in catalogue() if table_of(r) in ("gearbox", "screw")]
    return [*(n for n in names if n.startswith(incomplete)), *_files(incomplete)]


SourceArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Scenario file (.toml), name of a shipped scenario, or saved result (.nc, .csv, .parquet), which is run again.",
        autocompletion=complete_scenario,
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Change a value, e.g. --set command.amplitude=0.1 or "load.inertia=1 kg*m^2".',
    ),
]
ReportOption = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", metavar="DIR", help="Directory of the report, made if missing; else none is written."
    ),
]
FiguresOption = Annotated[
    str | None,
    typer.Option(
        "--figures", metavar="png,svg,pdf", help="Also draw the charts of the page as pictures of these kinds."
    ),
]
