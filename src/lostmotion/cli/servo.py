"""`lostmotion servo`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .arguments import FiguresOption, Overrides, SourceArgument, number
from .targets import try_directory, writing
from .terminal import busy, console, fail, progress

if TYPE_CHECKING:
    from ..servo.commission import ServoReport


def servo(
    scenario: SourceArgument,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "servo"
    ),
    motor: Annotated[
        str | None,
        typer.Option("--motor", metavar="NAME", help="Whose controller; may be left out where there is one."),
    ] = None,
    window: Annotated[
        float | None,
        typer.Option(
            "--window",
            metavar="ANGLE",
            parser=number("rad"),
            help='Within which a move has settled, e.g. "1 arcmin"; left out, four encoder steps at the reference\'s shaft, at least a '
            "thousandth of the reference's range.",
        ),
    ] = None,
    rule: Annotated[
        str | None,
        typer.Option(
            "--tune",
            metavar="RULE",
            help="Tune first: suited, symmetrical_optimum, identical_damping, identical_radius, identical_real_part, margins or search.",
        ),
    ] = None,
    overrides: Overrides = None,
    figures: FiguresOption = None,
) -> None:
    """Commission a servo axis: margins, bandwidths, steps, following, settling, stiffness, limit cycle.

    Writes servo.html (one page), the data of its charts and the margins as CSV. Exit code 1 if the complete loop is unstable
    in one of its regimes; the page is written all the same.

    \b
    lostmotion servo position-axis
    lostmotion servo axis.toml --tune margins --window "1 arcmin" -o sheet
    """
    from ..reports.pictures import endings
    from ..simulation.sources import load

    pictures = endings(figures)
    loaded = load(scenario, overrides or ())
    try_directory(output)
    from ..servo.commission import commission, work

    total = work(loaded, motor)
    if rule is not None:
        from ..servo.tuning import tune

        with busy("Tuning"):
            tuned = tune(loaded, rule=rule, motor=motor)
        loaded = tuned.scenario
        print(tuned)
    with progress(total, "Commissioning") as step:
        report = commission(loaded, motor=motor, window=window, progress=step)
    with writing(output), busy("Writing"):
        from ..reports.servo import write_servo

        page = write_servo(output, Path(scenario).stem, report, pictures)
    _print_summary(loaded.title or Path(scenario).stem, report)
    print(f"The sheet is at {page}")
    if not report.stable:
        fail(f"unstable: {'; '.join(map(str, report.instabilities()))}")


def _print_summary(title: str, report: ServoReport) -> None:
    from rich.table import Table

    from ..reports.servo import loop_rows, step_rows

    print(title)
    table = Table(box=None, pad_edge=False)
    for name in ("loop", "regime", "stable"):
        table.add_column(name)
    for name in ("-3 dB", "-90°", "gain margin", "phase margin", "crossover", "sensitivity"):
        table.add_column(name, justify="right")
    for row in loop_rows(report):
        units = zip((3, 4, 6, 8, 9, 10), (" Hz", " Hz", " dB", "°", " Hz", ""), strict=True)
        table.add_row(*row[:3], *(f"{row[k]}{unit}" if row[k] else "-" for k, unit in units))
    console(sys.stdout, 120).print(table)
    for what, value in [*step_rows(report), *report.motion_rows()]:
        print(f"  {what}: {value}")
