"""`lostmotion study`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .arguments import FiguresOption, argument, count, flag, option
from .output_files import pictures_of, try_directory, writing
from .terminal import busy, conclude, fail, progress
from .workers import workers

if TYPE_CHECKING:
    from ..studies.study.study_definition import Study


OutputOption = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="DIR", help="Directory of the runs, made if missing; required.")
]
ThreadsOption = Annotated[
    int | None, typer.Option("--threads", metavar="N", parser=count, help="In the core; all cores by default.")
]
ProcessesOption = Annotated[
    int | None, typer.Option("--processes", metavar="N", parser=count, help="Worker processes in place of threads.")
]
SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", metavar="tcp://HOST:PORT", help="Dask scheduler of a cluster.")
]


def study(
    what: str = argument(
        "STUDY.toml | show | resume", "Study file; or `show` or `resume` and a directory.", default=...
    ),
    shown: Path | None = argument("[DIR]", "With `show` and `resume`: the directory of a study."),
    output: OutputOption = None,
    threads: ThreadsOption = None,
    processes: ProcessesOption = None,
    scheduler: SchedulerOption = None,
    best: str | None = option("COLUMN[:largest]", "With `show`: the ten runs with the least, or largest."),
    repair: bool = flag("Make damaged parts of the directory again.", "--repair"),
    figures: FiguresOption = None,
) -> None:
    """To see what tolerances do: run many variants of a scenario.

    \b
    lostmotion study examples/tolerance.toml -o tolerance
    lostmotion study show tolerance --best peak_load_speed -o report
    lostmotion study resume tolerance --repair

    The directory given by -o holds Parquet files, one row a run, that pandas, DuckDB and polars open directly. Prints a summary.
    Failed runs have their reasons in the column error, and the exit code is 1. A study with a table [select] has a verdict. `show` prints the summary of a directory; with -o,
    it writes study.html (one page) and its tables into another one.
    """
    from ..errors import InputError

    if what in ("show", "resume") and shown is None:
        raise InputError(f"study {what}: name the directory of a study, as in `lostmotion study {what} DIR`")
    if what == "show" and shown is not None:
        _show(shown, best, output, figures)
        return
    if what == "resume" and shown is not None:
        from ..studies.runs.run_study import restore_note, study_of

        if repair:
            restore_note(shown)
        loaded = study_of(shown)
        compute(loaded, shown, threads, processes, scheduler, "Runs", repair=repair)
        print_outcome(shown, loaded.total)
        return
    if shown is not None:
        raise InputError(f"study {what} {shown}: too many names; the directory is given by -o")
    from ..studies.study.study_files import load_study

    loaded = load_study(what)
    directory = runs_directory(output, f"study {what}", what)
    compute(loaded, directory, threads, processes, scheduler, "Runs", repair=repair)
    print_outcome(directory, loaded.total)


def runs_directory(output: Path | None, command: str, file: str) -> Path:
    """The directory of the runs, which must be given, since an interrupted command resumes there."""
    from ..errors import InputError

    if output is None:
        raise InputError(f"{command}: name the directory of the runs, as in `-o {Path(file).stem}`")
    return output


def compute(
    loaded: Study,
    directory: Path,
    threads: int | None,
    processes: int | None,
    scheduler: str | None,
    unit: str,
    *,
    repair: bool = False,
) -> None:
    """Runs a study with a progress bar, or resumes it."""
    from contextlib import ExitStack

    from ..studies.runs.run_study import study as work

    try_directory(directory)
    with ExitStack() as stack:
        executor = stack.enter_context(workers(processes, scheduler)) if processes or scheduler else None
        report = stack.enter_context(progress(loaded.total, unit))
        try:
            with writing(directory, "; what is written stays"):
                work(loaded, directory, threads=threads, executor=executor, progress=report, repair=repair)
        except KeyboardInterrupt:
            fail(f"interrupted; what is in {directory} stays, and the same command resumes it", 130)


def _show(directory: Path, best: str | None, output: Path | None, figures: str | None) -> None:
    from ..reports.study import best_lines, summary, write_study

    pictures = pictures_of(figures, output)
    found = best_lines(directory, best) if best is not None else []
    lines, verdict = summary(directory)
    print("\n".join([*lines, *found]))
    if output is None:
        print(f"All charts on a page: lostmotion study show {directory} -o {directory.resolve().name}-report")
    else:
        with writing(output), busy("Writing"):
            page = write_study(directory, output, pictures)
        print(f"Report written to {page}")
        print(f"The same in the terminal: lostmotion study show {directory}")
    conclude(verdict)


def print_outcome(directory: Path, total: int) -> None:
    """Print the summary, the directory of the runs, and the failed ones; if runs are selected, the exit code follows the verdict."""
    from ..reports.study import summary
    from ..studies.runs.read_table import failures
    from ..units.practical import counted

    lines, verdict = summary(directory)
    print("\n".join(lines))
    print(
        f"{counted(total, 'run')} written to {directory}\nAll charts on a page: lostmotion study show {directory} -o {directory.resolve().name}-report"
    )
    failed = failures(directory)
    if failed:
        fail(
            f"{len(failed)} of {counted(total, 'run')} failed, such as: {failed[0]}; the column `error` has all reasons"
        )
    conclude(verdict)
