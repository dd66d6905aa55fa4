"""`lostmotion response`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .arguments import FiguresOption, Overrides, ReportOption, SourceArgument, again, load_scenario, number, option
from .output_files import pictures_of, writing
from .terminal import about, announce_response, busy, progress

if TYPE_CHECKING:
    from ..simulation.scenario.scenario import Scenario


def response(
    scenario: SourceArgument,
    amplitudes: str = option(
        "LIST",
        "0.025,0.1,1 or, with equal ratios, 0.01..1:8 (first, last, how many). Commas separate; two whole numbers, which may be "
        "a decimal comma, are written 1.0,5.0.",
        default="0.02..1:6",
    ),
    frequencies: str = option("LIST", "[Hz], written as the amplitudes.", default="0.1..100:60"),
    source: str | None = option(
        "NAME",
        "Input that is a sine: command, reference (with a controller) or load_torque; in a train <motor>_command, <motor>_reference, "
        "<shaft>_load_torque ... Default: command or reference of the only motor.",
        "--input",
    ),
    variable: str | None = option(
        "NAME",
        "Variable of the response. Default: load_speed, in a train the speed of its last shaft, with a controller the measured "
        "value of its outermost loop.",
    ),
    refine: float | None = option("DB", "Add frequencies where a curve bends by more.", parser=number()),
    compare: list[str] | None = option("OTHER", "Overlay the drive or train of another scenario."),
    overrides: Overrides = None,
    output: ReportOption = None,
    figures: FiguresOption = None,
) -> None:
    """To see bandwidth and dead zone over the amplitude of motion.

    \b
    lostmotion response paper-2dof-nl-small --amplitudes 0.025,1 --frequencies 1..30:12 --refine 0.2 -o bode
    lostmotion response drive.toml --compare linear.toml --refine 0.5 -o bode

    Each point is computed from a periodic motion, on all cores.

    The scenario gives the drive or train, its controllers and the constant parts of the inputs. Prints bandwidth and dead zone. With
    -o, writes response.html (gain and phase, maps of gain, phase, efficiency and distortion over amplitude and frequency) and all
    numbers (bode.csv, response.csv, characteristics.csv, and response.nc where NetCDF is installed).
    """
    pictures = pictures_of(figures, output)
    files = _titles(scenario, compare or ())
    name = next(iter(files))
    loaded = {title: load_scenario(file, overrides if title == name else None) for title, file in files.items()}
    unit, variable = _known(loaded, files, source, variable)
    from ..response.harmonic import frequency_response
    from .grids import parse_grid

    wanted = parse_grid(amplitudes, "amplitudes", unit)
    grid = parse_grid(frequencies, "frequencies", "Hz")
    responses = {}
    for s in loaded.values():
        announce_response(s.long().train(), len(wanted) * len(grid))
    with progress(len(loaded) * len(wanted) * len(grid), "Response") as step:
        for title, s in loaded.items():
            with about(files[title]):
                responses[title] = frequency_response(s, grid, wanted, source=source, refine=refine, progress=step)
    first = loaded[name]
    from ..reports.response import amplitude_lines, motion_lines
    from ..response.crossovers import characteristics

    found = characteristics(responses[name], first, variable)
    print(first.title or name)
    lines = motion_lines(responses[name])
    more = max(0, sum(line.startswith("not found") for line in lines) - 3)
    print(*(f"  {line}" for line in (*amplitude_lines(found), *lines[: len(lines) - more])), sep="\n")
    if more:
        print(f"  {more} more reasons are in response.csv")
    if output is None:
        print(f"All charts on a page: lostmotion response {again(scenario, overrides)} -o response")
        return
    with writing(output), busy("Writing"):
        from ..reports.response import write_response

        page = write_response(output, responses, first, variable, pictures)
    print(f"Report written to {page}")
    if not (output / "response.nc").exists():
        print('response.nc is left out: it needs h5netcdf; install it: pip install "lostmotion[netcdf]"')
    print(f"Next: lostmotion run {again(scenario, overrides)} --plot run.png")


def _titles(scenario: str, others: Iterable[str]) -> dict[str, str]:
    """Name in the legends -> source. Of two sources of one name the second has its path."""
    from ..errors import InputError

    files = {Path(scenario).stem: scenario}
    for other in others:
        free = [title for title in (Path(other).stem, other, f"{other} without --set") if title not in files]
        if not free or other in list(files.values())[1:]:
            raise InputError(f"--compare {other}: is given twice; leave one out")
        files[free[0]] = other
    return files


def _known(
    loaded: Mapping[str, Scenario], files: Mapping[str, str], source: str | None, variable: str | None
) -> tuple[str, str]:
    """The unit of the input, and the name of the variable, which all of the scenarios must have."""
    from ..errors import prefixed
    from ..response.plant import plant_or_loop

    units: list[str] = []
    variables: list[str] = []
    for title, scenario in loaded.items():
        with about(files[title]):
            plant = plant_or_loop(scenario)
        with prefixed(f"--input{f' {source}' if source else ''}"):
            units.append(plant.unit(plant.known_source(source)))
        with prefixed(f"--variable {variable or ''.join(variables[:1])}"):
            variables.append(plant.known_output(variables[0] if variables else variable))
    return "" if units[0] == "1" else units[0], variables[0]
