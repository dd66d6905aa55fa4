"""`lostmotion steps`."""

from pathlib import Path

from ..errors import InputError
from .arguments import Overrides, SourceArgument, again, load_scenario, option
from .grids import parse_grid
from .output_files import try_file
from .run import PICTURES
from .terminal import about, busy


def steps(
    scenario: SourceArgument,
    rates: str = option(
        "LIST", "Full steps a second [Hz]: 200.0,1000.0 or 100..5000:12 by ratios.", default="100..5000:10"
    ),
    motor: str | None = option("NAME", "Stepper. Default: the only one."),
    overrides: Overrides = None,
    output: Path | None = option("FILE", "File of the curves: .csv.", "-o", "--output"),
    plot: Path | None = option("FILE", "Figure of the curves: .png, .svg or .pdf."),
) -> None:
    """To see how fast a stepper may step: torques over the step rate.

    \b
    lostmotion steps stepper-belt-axis --rates 200.0,1000.0
    lostmotion steps printer.toml --rates 100..10000:20 -o curves.csv --plot curves.png

    Pull-out and pull-in torque follow from the data, and from runs with the axis as it is. The swing of the rotor in its field shows
    the step rates at which steps meet a resonance.
    """
    from ..atomic_writer import write_bytes, write_whole
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
        write_bytes(output, as_csv(curves).encode())
        print(f"Curves written to {output}")
    if plot is not None:
        from ..reports.plots import draw

        write_whole(plot, draw(charts(curves), 1, (7.0, 7.0)).savefig)
        print(f"Figure written to {plot}")
    print(f"Next: lostmotion run {again(scenario, overrides)} --plot run.png")
