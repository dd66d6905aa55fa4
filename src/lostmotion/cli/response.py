"""`lostmotion response`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .arguments import Overrides, SourceArgument, number
from .targets import try_directory, writing
from .terminal import busy, progress

if TYPE_CHECKING:
    import xarray

    from ..simulation.scenario import Scenario
    from ..simulation.train_scenario import TrainScenario


def response(
    scenario: SourceArgument,
    amplitudes: Annotated[
        str,
        typer.Option(
            "--amplitudes",
            metavar="LIST",
            help="0.025,0.1,1 or, with equal ratios, 0.01..1:8 (first, last, how many). Commas separate; two whole numbers, which may be "
            "a decimal comma, are written 1.0,5.0.",
        ),
    ] = "0.02..1:6",
    frequencies: Annotated[
        str, typer.Option("--frequencies", metavar="LIST", help="[Hz], written as the amplitudes.")
    ] = "0.1..100:60",
    source: Annotated[
        str | None,
        typer.Option(
            "--input",
            metavar="NAME",
            help="What is a sine: command, with a controller reference, or load_torque; of a train <motor>_command, <motor>_reference, "
            "<shaft>_load_torque ... Left out, command or reference of the only motor.",
        ),
    ] = None,
    variable: Annotated[
        str | None,
        typer.Option(
            "--variable",
            metavar="NAME",
            help="Which variable's response to draw; left out, load_speed, of a train the speed of its last shaft, with a controller what "
            "its outermost loop measures.",
        ),
    ] = None,
    refine: Annotated[
        float | None,
        typer.Option("--refine", metavar="DB", parser=number(), help="Add frequencies where a curve bends by more."),
    ] = None,
    compare: Annotated[
        list[str] | None,
        typer.Option("--compare", metavar="OTHER", help="Overlay the drive or train of another scenario."),
    ] = None,
    overrides: Overrides = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "response"
    ),
) -> None:
    """Frequency response over amplitude: each point from a periodic motion, on all cores.

    Of the scenario the drive or train, its controllers and the constant parts of the inputs are taken. Writes Bode figures (bode.png, .svg, .csv), maps of gain, phase, efficiency and distortion over amplitude and
    frequency (maps.png, .svg), and all numbers (response.csv, characteristics.csv, and response.nc where NetCDF is
    installed).

    \b
    lostmotion response drive.toml --amplitudes 0.025,1 --frequencies 0.1..100:60
    lostmotion response drive.toml --compare linear.toml --refine 0.5 -o bode
    """
    from ..simulation.sources import load

    name = Path(scenario).stem
    loaded = {name: load(scenario, overrides or ())} | {Path(other).stem: load(other) for other in compare or ()}
    unit, variable = _known(loaded, source, variable)
    from ..response.harmonic import frequency_response
    from .grids import parse_grid

    wanted = parse_grid(amplitudes, "amplitudes", unit)
    grid = parse_grid(frequencies, "frequencies", "Hz")
    try_directory(output)
    responses = {}
    with progress(len(loaded) * len(wanted) * len(grid), "Response") as step:
        for title, s in loaded.items():
            responses[title] = frequency_response(s, grid, wanted, source=source, refine=refine, progress=step)
    first = loaded[name]
    with writing(output), busy("Drawing"):
        from ..reports.response import write_response

        figure, found = write_response(output, responses, first, variable)
    print(first.title or name)
    _print_characteristics(found)
    _print_reasons(responses[name])
    print(f"Figures and tables are in {figure.parent}")
    if not (output / "response.nc").exists():
        print('response.nc is left out: it needs h5netcdf; install it: pip install "lostmotion[netcdf]"')


def _known(loaded: Mapping[str, Scenario | TrainScenario], source: str | None, variable: str | None) -> tuple[str, str]:
    """The unit of the input, and the name of the variable, which all of the scenarios must have."""
    from ..errors import InputError
    from ..response.plant import plant_or_loop

    units: list[str] = []
    variables: list[str] = []
    for scenario in loaded.values():
        plant = plant_or_loop(scenario)
        try:
            units.append(plant.unit(plant.known_source(source)))
        except InputError as error:
            raise InputError(f"--input{f' {source}' if source else ''}: {error}") from None
        try:
            variables.append(plant.known_output(variables[0] if variables else variable))
        except InputError as error:
            raise InputError(f"--variable {variable or variables[0]}: {error}") from None
    return "" if units[0] == "1" else units[0], variables[0]


def _print_characteristics(found: xarray.Dataset) -> None:
    for a in found["amplitude"].values:
        band, cross = (float(found[k].sel(amplitude=a)) for k in ("bandwidth", "phase_crossover"))
        text = [f"-3 dB at {band:.4g} Hz" if math.isfinite(band) else "-3 dB outside the frequencies, or no motion"]
        text += [f"-180 degrees at {cross:.4g} Hz"] if math.isfinite(cross) else []
        print(f"  amplitude {a:g}: {', '.join(text)}")
    if "dead_zone_forward" in found.attrs:
        print(
            f"  dead zone: from rest the load moves above a constant command of {found.attrs['dead_zone_forward']:.4g} and "
            f"below {found.attrs['dead_zone_backward']:.4g}"
        )


def _print_reasons(result: xarray.Dataset) -> None:
    """How many points were found, and why others were not."""
    reasons = [r for r in result["reason"].values.ravel() if r]
    found_points = result["reason"].size - len(reasons)
    repeating = (result["reason"] == "") & ~(result["spread"] > 0.0 if "spread" in result else False)
    worst = float(result["residual"].where(repeating).max())
    within = f", repeating within {worst:.1e} of their magnitude" if repeating.any() else ""
    print(f"  {found_points} of {result['reason'].size} motions found{within}")
    if "spread" in result:
        _print_closed_loop(result)
    different = list(dict.fromkeys(reasons))
    for reason in different[:3]:
        print(f"  not found at {reasons.count(reason)} point(s): {reason}")
    if len(different) > 3:
        print(f"  {len(different) - 3} more reasons are in response.csv")


def _print_closed_loop(result: xarray.Dataset) -> None:
    """Which frequencies had to fit the sample times, and which motions do not repeat."""
    f, asked = result["frequency"].values, result["asked_frequency"].values
    off = abs(f / asked - 1.0)
    if off.max() > 1e-9:
        print(
            f"  {(off > 1e-9).sum()} of {len(f)} frequencies moved to the nearest that fits the sample times, by {off.max():.1%} at most"
        )
    spread = result["spread"].values
    if (spread > 0.0).any():
        print(
            f"  {(spread > 0.0).sum()} motions do not repeat, as the encoder has steps: means over many periods, whose first harmonics "
            f"vary by {spread[spread > 0.0].max():.2g} of their mean at most"
        )
