"""`lostmotion reproduce`."""

from .arguments import FiguresOption, ReportOption
from .output_files import pictures_of, writing
from .terminal import progress


def reproduce(output: ReportOption = None, figures: FiguresOption = None) -> None:
    """To check the solver against the paper: figures and deviations.

    \b
    lostmotion reproduce -o out

    The paper is "Simplified dynamic model of the transmission".

    Prints the main results. With -o, writes report.html (a single self-contained page), the data of its figures as CSV, and the
    constants as constants.csv.
    """
    from ..errors import need

    pictures = pictures_of(figures, output)
    if output is None:
        _print_results()
        return
    need("jinja2", "The report", "report")
    from ..paper.reproduce import WORK
    from ..paper.reproduce import reproduce as work

    with writing(output), progress(WORK, "Reproducing") as step:
        report = work(output, step, pictures)
    print(f"Report written to {report}")
    print("Next: lostmotion run paper-2dof-nl-small --plot run.png")


def _print_results() -> None:
    """The verdict of the report, without its figures."""
    from ..paper.quoted_numbers import facts
    from ..paper.report import TITLE, agreement
    from ..paper.runs import WORK, compute

    with progress(WORK, "Reproducing") as step:
        found = facts(compute(step))
    print(TITLE)
    print(*(f"  {line}" for line in agreement(found)), sep="\n")
    print("All figures on a page: lostmotion reproduce -o out")
