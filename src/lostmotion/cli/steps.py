"""`lostmotion steps`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .arguments import Overrides, SourceArgument, again, load_scenario
from .grids import parse_grid
from .run import PICTURES
from .targets import try_file
from .terminal import about, busy


def steps(
    scenario: SourceArgument,
    rates: Annotated[
        str,
        typer.Option(
            "--rates", metavar="LIST", help="Full steps a second [Hz]: 200.0,1000.0 or 100..5000:12 by ratios."
        ),
    ] = "100..5000:10",
    motor: Annotated[
        str | None, typer.Option("--motor", metavar="NAME", help="Stepper. Default: the only one.")
    ] = None,
    overrides: Overrides = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="File of the curves: .csv.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Figure of the curves: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """To see how fast a stepper may step: torques over the step rate.

    \b
    lostmotion steps stepper-belt-axis --rates 200.0,1000.0
    lostmotion steps printer.toml --rates 100..10000:20 -o curves.csv --plot curves.png

    Pull-out and pull-in torque follow from the data, and from runs with the axis as it is. The swing of the rotor in its field shows
    the step rates at which steps meet a resonance.
    """
    from ..atomic_writer import write_whole
    from ..reports.stepper_curves import as_csv, charts, table
    from ..sizing.pull_out_curves import stepper_curves

    for path, endings in ((output, (".csv",)), (plot, PICTURES)):
        if path is not None and path.suffix not in endings:
            raise InputError(f"{path}: the ending {path.suffix or '(none)'} is not known; take {', '.join(endings)}")
        if path is not None:
            try_file(path)
    values = parse_grid(rates, "rates", "Hz")
    loaded = load_scenario(scenario, overrides)
    with about(scenario), busy("Stepping"):
        curves = stepper_curves(loaded, values, motor=motor)
    print("\n".join(table(curves)))
    if output is not None:

        def write(path: Path) -> None:
            path.write_text(as_csv(curves), encoding="utf-8")

        write_whole(output, write)
        print(f"Curves written to {output}")
    if plot is not None:
        from ..reports.plots import draw

        write_whole(plot, draw(charts(curves), 1, (7.0, 7.0)).savefig)
        print(f"Figure written to {plot}")
    print(f"Next: lostmotion run {again(scenario, overrides)} --plot run.png")
