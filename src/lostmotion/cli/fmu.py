"""`lostmotion fmu`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Overrides, SourceArgument
from .targets import try_file
from .terminal import busy


def fmu(
    scenario: SourceArgument,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.fmu", help="The FMU.")],
    overrides: Overrides = None,
    controllers: Annotated[
        bool,
        typer.Option(
            "--controllers/--no-controllers",
            help="With the controllers of the scenario inside, or motors turned by commands.",
        ),
    ] = True,
    libraries: Annotated[
        Path | None,
        typer.Option(
            "--libraries", metavar="DIRECTORY", help="Libraries of the platforms, if others than the installed ones."
        ),
    ] = None,
) -> None:
    """Write a scenario as an FMU (FMI 2.0, Co-Simulation) for Simulink, Modelica tools and others.

    Inputs are commands, load torques and references of continuous controllers; outputs are the result variables; parameters have the keys of the scenario file.

    \b
    lostmotion fmu drive.toml -o drive.fmu
    lostmotion fmu position-axis -o axis.fmu --set load.inertia="3 kg*m^2"
    """
    from ..errors import InputError
    from ..portable.fmu import export_fmu
    from ..simulation.sources import load

    if output.suffix != ".fmu":
        raise InputError(f"{output}: must end in .fmu")
    try_file(output)
    loaded = load(scenario, overrides or ())
    with busy("Finding out what its parameters change"):
        export_fmu(loaded, output, controllers=controllers, libraries=libraries)
    print(f"{output}")
