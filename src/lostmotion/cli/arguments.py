"""Arguments and options that several commands share: how they are read and completed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import typer


def number(unit: str = "") -> Callable[[str], float]:
    """Reads the value of an option: a bare number in `unit`, or one with a unit, as in a scenario."""

    def read(text: str) -> float:
        from ..inputs.validation import shown
        from ..units.conversion import si_value

        try:
            return si_value(text, unit)
        except ValueError as error:
            raise typer.BadParameter(f"{shown(text)} {error}") from None

    return read


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
