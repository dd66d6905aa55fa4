"""`lostmotion select`."""

from .arguments import argument
from .study import OutputOption, ProcessesOption, SchedulerOption, ThreadsOption, compute, print_outcome, runs_directory


def select(
    task: str = argument("TASK.toml", "Task file: the motion, the load and the requirements of the axis.", default=...),
    output: OutputOption = None,
    threads: ThreadsOption = None,
    processes: ProcessesOption = None,
    scheduler: SchedulerOption = None,
) -> None:
    """To choose motor and gearbox for a task.

    \b
    lostmotion select examples/select-axis.toml -o axis

    Judges each pair by the manufacturers' rules, and tunes and simulates the pairs that pass.

    The task file has the motion, the load and what is wanted; motors and gearboxes are all of the catalogue, or the
    named ones. Prints the ranking and the reasons for refusal. The runs are kept in the directory given by -o, and an interrupted
    command resumes there. `lostmotion study show DIR -o REPORT` writes a page with the Pareto front.
    """
    from ..studies.selection.task_file import load_task

    loaded = load_task(task)
    directory = runs_directory(output, f"select {task}", task)
    compute(loaded, directory, threads, processes, scheduler, "Pairs")
    print_outcome(directory, loaded.total)
