"""The command `lostmotion`."""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from .terminal import busy, count, fail, number, progress, try_directory, try_file, workers, writing

PICTURES = (".png", ".svg", ".pdf")
UsageError: type[Exception] = typer.BadParameter.__mro__[1]  # of the parser that typer brings along

app = typer.Typer(
    name="lostmotion",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly.",
    epilog="Exit code 0 only if all went well; errors are one line on stderr.",
)


def main() -> None:
    """Entry point: known errors end in one line and exit code 1, Ctrl-C in 130."""
    from ..errors import InputError, MissingLibraryError

    try:
        code = app(standalone_mode=False)
    except (InputError, MissingLibraryError) as error:
        fail(str(error))
    except UsageError as error:
        _explain_usage(error)
    except KeyboardInterrupt:
        fail("interrupted; nothing was written", 130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except (RuntimeError, ValueError) as error:
        # What a solver or a check of a whole scenario reports is a result for the user; anything else is our defect.
        fail(" ".join(str(error).split()))
    else:
        if code == 130:  # typer turns Ctrl-C into this code
            fail("interrupted; nothing was written", 130)
        sys.exit(code)


def _explain_usage(error: Any) -> NoReturn:
    """One line for a command that cannot be read, and exit code 2; the help where a command has no arguments at all."""
    text = str(error.format_message())
    if "\n" in text:
        print(text, file=sys.stderr)
        sys.exit(2)
    command = error.ctx.command_path if error.ctx else "lostmotion"
    text = re.sub("^Invalid value for '([^']*)'", r"\1", text).rstrip(".")
    fail(f"{text}; see `{command.replace('python -m ', '')} --help`", 2)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(version("lostmotion"))
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly."""


# --- what several commands share ---


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


def complete_gearbox(incomplete: str) -> list[str]:
    """Gearboxes of the catalogue and files."""
    from ..data_sheets.records import catalogue as records
    from ..data_sheets.sheets import GearboxSheet

    names = [r.name for r in records() if isinstance(r, GearboxSheet)]
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


@app.command()
def reproduce(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "out"
    ),
) -> None:
    """Reproduce the paper "Simplified dynamic model of the transmission": figures, data and a report.

    Writes PNG, SVG and CSV for each of the figures 5 and 9 to 18, the constants as constants.csv, and report.html, a single
    self-contained page.
    """
    from ..errors import need

    try_directory(output)
    need("jinja2", "The report", "report")
    from ..paper.reproduce import WORK
    from ..paper.reproduce import reproduce as work

    with writing(output), progress(WORK, "Reproducing") as step:
        report = work(output, step)
    print(f"The report is at {report}")


@app.command()
def run(
    scenario: SourceArgument,
    overrides: Overrides = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Result file: .nc, .csv or .parquet.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Figure of the run: .png, .svg or .pdf.")
    ] = None,
    explain: Annotated[
        float | None,
        typer.Option(
            "--explain", metavar="TIME", parser=number("s"), help="Say what each contact holds at this instant [s]."
        ),
    ] = None,
    solver: Annotated[
        str, typer.Option("--solver", metavar="NAME", help="exact, or dormand-prince as a second opinion.")
    ] = "exact",
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance",
            metavar="VALUE",
            parser=number(),
            help="Relative tolerance of dormand-prince, 1e-15 to 1e-3 (1e-8).",
        ),
    ] = None,
) -> None:
    """Run a scenario: print, save, draw, explain.

    \b
    lostmotion run drive.toml
    lostmotion run paper-2dof-nl-small --plot small.png
    lostmotion run drive.toml --set command.amplitude=0.1 -o result.csv --plot result.png
    lostmotion run result.csv --explain 0.25
    """
    from ..errors import InputError
    from ..simulation.results import check_output, save, write_whole
    from ..simulation.sources import load

    if output is not None:
        try_file(check_output(output))
    if plot is not None:
        if plot.suffix not in PICTURES:
            raise InputError(
                f"{plot}: the ending {plot.suffix or '(none)'} is not known; it must be one of {', '.join(PICTURES)}"
            )
        try_file(plot)
    loaded = load(scenario, overrides or ())
    if explain is not None and not 0.0 <= explain <= loaded.simulation.duration:
        raise InputError(
            f"--explain {explain}: must lie between 0 and simulation.duration, {loaded.simulation.duration} s"
        )
    from ..simulation.run import TOLERANCES
    from ..simulation.run import run as work

    if solver not in ("exact", "dormand-prince"):
        raise InputError(f"--solver {solver}: must be exact or dormand-prince")
    if tolerance is not None and solver == "exact":
        raise InputError(
            f"--tolerance {tolerance:g}: the exact solver has none; leave it out, or add --solver dormand-prince"
        )
    if tolerance is not None and not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise InputError(f"--tolerance {tolerance:g}: must lie between {TOLERANCES[0]:g} and {TOLERANCES[1]:g}")
    try:
        with busy("Simulating"):
            result = work(loaded, solver=solver, relative_tolerance=tolerance)  # type: ignore[arg-type]
    except RuntimeError as error:
        raise InputError(f"{scenario}: {error}") from None
    from ..reports.run import summary

    print(summary(result))
    if explain is not None:
        from ..simulation.explanation import explain as explain_instant

        print(explain_instant(loaded, explain))
    if output is not None:
        with busy("Writing"):
            save(result.dataset(), output)
        print(f"Result written to {output}")
    if plot is not None:
        with busy("Drawing"):
            from ..reports.plots import overview

            write_whole(plot, overview(result.dataset()).savefig)
        print(f"Figure written to {plot}")


@app.command()
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
        str, typer.Option("--input", metavar="NAME", help="command or load_torque: what is a sine.")
    ] = "command",
    variable: Annotated[
        str, typer.Option("--variable", metavar="NAME", help="Which variable's response to draw.")
    ] = "load_speed",
    refine: Annotated[
        float | None,
        typer.Option("--refine", metavar="DB", parser=number(), help="Add frequencies where a curve bends by more."),
    ] = None,
    compare: Annotated[
        list[str] | None,
        typer.Option("--compare", metavar="OTHER", help="Overlay the drive of another scenario."),
    ] = None,
    overrides: Overrides = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "response"
    ),
) -> None:
    """Frequency response over amplitude: each point from a periodic motion, on all cores.

    Of the scenario the drive and the constant parts of command and load torque are taken. Writes Bode figures (bode.png, .svg, .csv), maps of gain, phase, efficiency and distortion over amplitude and
    frequency (maps.png, .svg), and all numbers (response.csv, characteristics.csv, and response.nc where NetCDF is
    installed).

    \b
    lostmotion response drive.toml --amplitudes 0.025,1 --frequencies 0.1..100:60
    lostmotion response drive.toml --compare linear.toml --refine 0.5 -o bode
    """
    from ..errors import InputError
    from ..simulation.sources import load
    from ..simulation.variables import CHANNEL_NAMES
    from .grids import parse_grid

    if source not in ("command", "load_torque"):
        raise InputError(f"--input {source}: must be command or load_torque")
    wanted = parse_grid(amplitudes, "amplitudes", "" if source == "command" else "N*m")
    grid = parse_grid(frequencies, "frequencies", "Hz")
    if variable not in CHANNEL_NAMES:
        raise InputError(f"--variable {variable}: must be one of {', '.join(CHANNEL_NAMES)}")
    try_directory(output)
    name = Path(scenario).stem
    loaded = {name: load(scenario, overrides or ())} | {Path(other).stem: load(other) for other in compare or ()}
    from ..response.harmonic import Source, frequency_response

    responses = {}
    with progress(len(loaded) * len(wanted) * len(grid), "Response") as step:
        for title, s in loaded.items():
            kind: Source = "command" if source == "command" else "load_torque"
            responses[title] = frequency_response(s, grid, wanted, source=kind, refine=refine, progress=step)
    first = loaded[name]
    with writing(output), busy("Drawing"):
        from ..reports.response import write_response

        figure, found = write_response(output, responses, first.drive(), variable)
    result = responses[name]
    print(first.title or name)
    for a in found["amplitude"].values:
        band, cross = (float(found[k].sel(amplitude=a)) for k in ("bandwidth", "phase_crossover"))
        text = [f"-3 dB at {band:.4g} Hz" if math.isfinite(band) else "-3 dB outside the frequencies, or no motion"]
        text += [f"-180 degrees at {cross:.4g} Hz"] if math.isfinite(cross) else []
        print(f"  amplitude {a:g}: {', '.join(text)}")
    print(
        f"  dead zone: from rest the load moves above a constant command of {found.attrs['dead_zone_forward']:.4g} and "
        f"below {found.attrs['dead_zone_backward']:.4g}"
    )
    reasons = [r for r in result["reason"].values.ravel() if r]
    found_points = result["reason"].size - len(reasons)
    worst = float(result["residual"].where(result["reason"] == "").max())
    within = f", repeating within {worst:.1e} of their size" if found_points else ""
    print(f"  {found_points} of {result['reason'].size} motions found{within}")
    different = list(dict.fromkeys(reasons))
    for reason in different[:3]:
        print(f"  not found at {reasons.count(reason)} point(s): {reason}")
    if len(different) > 3:
        print(f"  {len(different) - 3} more reasons are in response.csv")
    print(f"Figures and tables are in {figure.parent}")
    if not (output / "response.nc").exists():
        print('response.nc is left out: it needs h5netcdf; install it: pip install "lostmotion[netcdf]"')


@app.command()
def rig(
    gearbox: Annotated[
        str,
        typer.Argument(
            metavar="GEARBOX",
            help="Name in the catalogue, or a file with one record (.toml).",
            autocompletion=complete_gearbox,
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "rig"
    ),
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help='Change or add a value, e.g. --set temperature="40 degC".'),
    ] = None,
) -> None:
    """Measure a gearbox on the virtual test rig and compare with its data sheet.

    Writes rig.html (a page like one of a catalogue), the figures as PNG and SVG, and the measurements as CSV.

    \b
    lostmotion rig schaeffler-rt1-h-20-100
    lostmotion rig my-gearbox.toml -o sheet --set loss_factor=1.3
    """
    from ..data_sheets.records import find
    from ..data_sheets.sheets import GearboxSheet
    from ..errors import need
    from ..simulation.scenario import gearbox_from_record

    try_directory(output)
    need("jinja2", "The page of the rig", "report")

    sheet = find(gearbox, "gearbox")
    assert isinstance(sheet, GearboxSheet)
    part, notes = gearbox_from_record(gearbox, overrides or ())
    from ..test_rig.rig import WORK, measure

    with progress(WORK, "Measuring") as step:
        report = measure(part, sheet, notes, step)
    with writing(output), busy("Drawing"):
        from ..reports.rig import summary_rows, write_sheet

        page = write_sheet(output, sheet.name, report, sheet, notes)
    print(sheet.title or sheet.name)
    for c in report.comparisons:
        unit = "" if c.unit == "1" else f" {c.unit}"
        remark = f"  ({c.remark})" if c.remark else ""
        print(f"  {c.figure:<44} {c.catalogue:>10.5g} {c.rig:>10.5g} {c.difference:>+9.1e}{unit}{remark}")
    for what, value in summary_rows(report):
        print(f"  {what}: {value}")
    for note in notes:
        print(f"  note: {note}")
    print(f"The data sheet is at {page}")


@app.command()
def catalogue(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME | new]", help="Show one record; `new`: a template for your own.")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind", metavar="KIND", help="gearbox, motor, or a kind of gearbox: strain_wave, planetary, worm, ..."
        ),
    ] = None,
    ratio: Annotated[str | None, typer.Option("--ratio", metavar="MIN..MAX", help="Gear ratio.")] = None,
    torque: Annotated[str | None, typer.Option("--torque", metavar="MIN..MAX", help="Rated torque [N·m].")] = None,
    complete: Annotated[bool, typer.Option("--complete", help="Only records that can be simulated.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE", help="With `new`: the file.")] = None,
) -> None:
    """List the components, show one with its sources and gaps, or start your own data sheet.

    The list says of each record whether it is a gearbox or a motor, and what it lacks for a simulation.

    \b
    lostmotion catalogue --kind strain_wave --ratio 50..120 --torque 20..100
    lostmotion catalogue schaeffler-rt1-h-20-100
    lostmotion catalogue new -o my-gearbox.toml
    lostmotion catalogue new --kind motor -o my-motor.toml
    """
    from ..reports.listing import list_records, record_text, template

    if name == "new":
        text = template(kind)
        if output is None:
            print(text, end="")
            return
        from ..errors import InputError
        from ..reports.pages import write_text

        if output.exists():
            raise InputError(f"{output}: exists; name another file")
        write_text(output, text)
        print(f"Template written to {output}; fill in what your data sheet says and delete the rest")
    elif name is not None:
        print(record_text(name))
    else:
        print(list_records(kind, ratio, torque, complete))


@app.command()
def scenarios() -> None:
    """List the scenarios that come with the package; `run`, `response` and `drive check` take their names."""
    from ..simulation.scenario import load, shipped_scenarios

    found = shipped_scenarios()
    width = max(map(len, found))
    for name in found:
        print(f"{name:<{width}}  {load(name).title}")


@app.command()
def study(
    what: Annotated[str, typer.Argument(metavar="STUDY.toml | show", help="Study file; or `show` and a directory.")],
    shown: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="With `show`: the directory of a study.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Directory; by default the file's name.")
    ] = None,
    threads: Annotated[
        int | None, typer.Option("--threads", metavar="N", parser=count, help="In the core; all cores by default.")
    ] = None,
    processes: Annotated[
        int | None, typer.Option("--processes", metavar="N", parser=count, help="Worker processes in place of threads.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="tcp://HOST:PORT", help="Dask scheduler of a cluster.")
    ] = None,
    best: Annotated[
        str | None,
        typer.Option(
            "--best", metavar="COLUMN[:largest]", help="With `show`: the ten runs with the least, or largest."
        ),
    ] = None,
) -> None:
    """Many runs: vary parameters, store selected results, resume after an interruption.

    Writes a directory of Parquet files, one row a run, that pandas, DuckDB and polars open directly. If runs failed, their rows
    say why, all others are there, and the exit code is 1.

    \b
    lostmotion study tolerance.toml -o tolerance
    lostmotion study show tolerance --best peak_twist
    """
    from ..errors import InputError

    if what == "show":
        if shown is None:
            raise InputError("study show: name the directory of a study, as in `lostmotion study show DIR`")
        from ..reports.study import best_lines, show

        found = best_lines(shown, best) if best is not None else []
        with busy("Drawing"):
            lines = show(shown)
        print("\n".join([*lines, *found]))
        return
    if shown is not None:
        raise InputError(f"study {what} {shown}: too many names; the directory is given by -o")
    from contextlib import ExitStack

    from ..studies.engine import study as work
    from ..studies.file import load_study

    loaded = load_study(what)
    directory = output or Path(Path(what).stem)
    try_directory(directory)
    with ExitStack() as stack:
        executor = stack.enter_context(workers(processes, scheduler)) if processes or scheduler else None
        report = stack.enter_context(progress(loaded.total, "Runs"))
        try:
            with writing(directory, "; what is written stays"):
                work(loaded, directory, threads=threads, executor=executor, progress=report)
        except KeyboardInterrupt:
            fail(f"interrupted; what is in {directory} stays, and the same command resumes it", 130)
    from ..studies.table import failures

    print(f"{loaded.total} runs are in {directory}; `lostmotion study show {directory}` shows them")
    failed = failures(directory)
    if failed:
        fail(f"{len(failed)} of {loaded.total} runs failed, such as: {failed[0]}; the column `error` has all reasons")


drive_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Check a drive against its task.")
app.add_typer(drive_app, name="drive")


@drive_app.command()
def check(
    scenario: SourceArgument,
    overrides: Overrides = None,
) -> None:
    """Torques, speeds, voltage, current, heat, inertia ratio, resonance, dead zone, lost motion and holding.

    Each point names its rule and the source of the rule. The table [task] of the scenario gives the duty cycle and requirements.

    \b
    lostmotion drive check drive.toml --set task.cycle="2 s"
    """
    from ..errors import InputError
    from ..simulation.sources import load
    from ..sizing.drive_check import check_drive

    loaded = load(scenario, overrides or ())
    try:
        with busy("Checking"):
            findings = check_drive(loaded)
    except (InputError, RuntimeError) as error:
        raise InputError(f"{scenario}: {error}") from None
    print(loaded.title or scenario)
    for finding in findings:
        print(f"  {finding}")
    warnings, unknown = (sum(f.verdict == verdict for f in findings) for verdict in ("warning", "unknown"))
    counted = "No warnings." if warnings == 0 else f"{warnings} warning{'s' if warnings > 1 else ''}."
    print(f"{counted} {unknown} not judged (?)." if unknown else counted)


@app.command()
def schema() -> None:
    """Print the JSON Schema of scenario files.

    Editors complete and check scenario files with it.

    \b
    lostmotion schema > scenario.schema.json
    """
    import json

    from ..simulation.scenario import json_schema

    print(json.dumps(json_schema(), indent=2))
