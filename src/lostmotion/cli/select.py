"""`lostmotion select`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import FiguresOption
from .study import OutputOption, ProcessesOption, SchedulerOption, ThreadsOption, compute, print_outcome
from .terminal import busy


def select(
    task: Annotated[str, typer.Argument(metavar="TASK.toml", help="What the axis has to do.")],
    output: OutputOption = None,
    threads: ThreadsOption = None,
    processes: ProcessesOption = None,
    scheduler: SchedulerOption = None,
    figures: FiguresOption = None,
) -> None:
    """Choose motor and gearbox for a task: judge each pair by the manufacturers' rules, tune and simulate those that pass.

    The task file has the motion, the load and what is wanted; motors and gearboxes are all of the catalogue, or those that it
    names. Ranks the pairs, says why the others do not fit, and writes a page with the Pareto front. Interrupted, it resumes.

    \b
    lostmotion select examples/select-axis.toml -o axis
    """
    from ..reports.pictures import endings
    from ..reports.study import show
    from ..studies.task_file import load_task

    pictures = endings(figures)
    loaded = load_task(task)
    directory = output or Path(Path(task).stem)
    compute(loaded, directory, threads, processes, scheduler, "Pairs")
    with busy("Writing"):
        lines = show(directory, pictures)
    print("\n".join(lines))
    print_outcome(directory, loaded.total)
