"""`lostmotion run`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from .arguments import Overrides, SourceArgument, again, flag, load_scenario, number, option, print_timed_moves
from .output_files import try_file, try_page
from .terminal import about, busy, conclude, simulating

if TYPE_CHECKING:
    from ..simulation.runs.results import RunArrays
    from ..simulation.scenario.scenario import Scenario

PICTURES = (".png", ".svg", ".pdf")


def run(
    scenario: SourceArgument,
    overrides: Overrides = None,
    output: Path | None = option("FILE", "Result file: .nc, .csv or .parquet.", "-o", "--output"),
    plot: Path | None = option("FILE", "Figure of the run: .png, .svg or .pdf."),
    figure: str | None = option("NAME", "Part that --plot shows: motion, losses, contacts or energy. Default: all."),
    spectrum: bool = flag(
        "Periodic error at constant speed, by the order of each shaft's revolution, and the part that causes it.",
        "--spectrum",
    ),
    report: Path | None = option("FILE", "Page of the run with all charts and its data: .html."),
    explain: float | None = option(
        "TIME",
        "Print which contacts are stuck at this instant [s], what they hold, and what would free them.",
        parser=number("s", "--explain"),
    ),
    solver: str | None = option(
        "NAME", "exact, or dormand-prince as a second opinion, which a stepper with a winding needs."
    ),
    tolerance: float | None = option(
        "VALUE", "Relative tolerance of dormand-prince, 1e-15 to 1e-3 (1e-8).", parser=number()
    ),
) -> None:
    """To see how a drive moves: run it, plot it, explain it.

    \b
    lostmotion run paper-2dof-nl-small --plot small.png
    lostmotion run drive.toml
    lostmotion run paper-2dof-nl-small --plot energy.png --figure energy
    lostmotion run position-axis --report axis.html
    lostmotion run drive.toml --set command.amplitude=0.1 -o result.csv --plot result.png
    lostmotion run result.csv --explain 0.25

    With a controller the summary has the following error, true and as it is measured. A loop does not fit if it is
    unstable: its error grows, or it has a pole outside the unit circle. Swings of a stable loop are a reservation.
    """
    from ..errors import InputError

    _try_files(output, plot, report)
    _check_figure(figure, plot)
    loaded = load_scenario(scenario, overrides)
    if explain is not None and not 0.0 <= explain <= loaded.simulation.duration:
        raise InputError(
            f"--explain {explain}: must lie between 0 and simulation.duration, {loaded.simulation.duration} s"
        )
    _check_solver(loaded, solver, tolerance)
    with about(scenario):
        result = _simulated(loaded, solver, tolerance)
    from ..reports.run import summary, verdict_of

    print(summary(result))
    print_timed_moves(loaded)
    if explain is not None:
        from ..simulation.runs.stuck_contacts import explain as explain_instant

        print(explain_instant(loaded, explain))
    if spectrum:
        _print_spectrum(loaded)
    if output is not None:
        from ..simulation.runs.result_files import save

        with busy("Writing"):
            save(result.dataset(), output)
        print(f"Result written to {output}")
    if plot is not None:
        _draw(plot, result, figure)
    if report is not None:
        with busy("Writing"):
            from ..reports.page import write_page
            from ..reports.run import run_report

            write_page(report, run_report(Path(scenario).stem, result.dataset()))
        print(f"Report written to {report}")
        print(f"Next: lostmotion live {again(scenario, overrides)}")
    else:
        print(f"All charts on a page: lostmotion run {again(scenario, overrides)} --report {Path(scenario).stem}.html")
    verdict = verdict_of(result)
    if verdict is not None:
        print(f"Verdict: {verdict}")
    conclude(verdict)


def _simulated(loaded: Scenario, solver: str | None, tolerance: float | None) -> RunArrays:
    """The run; where it leaves the range of numbers, an error that names the loop that is unstable."""
    from .._core import SolverError
    from ..errors import InputError
    from ..simulation.runs.run import TOLERANCE
    from ..simulation.runs.run import run as work

    try:
        with simulating("Simulating", loaded, (tolerance or TOLERANCE) if _is_adaptive(loaded, solver) else 0.0):
            return work(loaded, solver=solver, relative_tolerance=tolerance)  # type: ignore[arg-type]
    except SolverError as error:
        from ..reports.run_loops import unstable_loops

        raise InputError(unstable_loops(loaded, error)) from None


def _draw(plot: Path, result: RunArrays, figure: str | None) -> None:
    from ..atomic_writer import write_whole
    from ..reports.plots import overview

    with busy("Drawing"):
        write_whole(plot, overview(result.dataset(), figure).savefig)
    print(f"Figure written to {plot}")


def _print_spectrum(scenario: Scenario) -> None:
    from ..response.spectrum import spectrum

    with busy("Spectrum"):
        found = spectrum(scenario)
    print(found)


def _try_files(output: Path | None, plot: Path | None, report: Path | None) -> None:
    """See, before the work, that the files can be written."""
    from ..errors import InputError
    from ..simulation.runs.result_files import check_output

    if output is not None:
        try_file(check_output(output))
    if plot is not None:
        if plot.suffix not in PICTURES:
            raise InputError(
                f"{plot}: the ending {plot.suffix or '(none)'} is not known; it must be one of {', '.join(PICTURES)}"
            )
        try_file(plot)
    if report is not None:
        try_page(report)


def _check_figure(figure: str | None, plot: Path | None) -> None:
    from ..errors import InputError

    if figure is not None and plot is None:
        raise InputError(f"--figure {figure}: says what --plot shows; add --plot FILE")
    if figure is not None:
        from ..reports.run_charts import FIGURES

        if figure not in FIGURES:
            raise InputError(f"--figure {figure}: is not known; take one of {', '.join(FIGURES)}")


def _is_adaptive(loaded: Scenario, solver: str | None) -> bool:
    """Whether the run is one of dormand-prince, which a stepper with a winding takes by itself."""
    from ..simulation.scenario.requirements import wound

    return solver == "dormand-prince" or (solver is None and any(wound(loaded)))


def _check_solver(loaded: Scenario, solver: str | None, tolerance: float | None) -> None:
    from ..errors import InputError
    from ..simulation.runs.run import TOLERANCES

    if solver not in (None, "exact", "dormand-prince"):
        raise InputError(f"--solver {solver}: must be exact or dormand-prince")
    if tolerance is not None and not _is_adaptive(loaded, solver):
        raise InputError(
            f"--tolerance {tolerance:g}: the exact solver has none; leave it out, or add --solver dormand-prince"
        )
    if tolerance is not None and not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise InputError(f"--tolerance {tolerance:g}: must lie between {TOLERANCES[0]:g} and {TOLERANCES[1]:g}")
