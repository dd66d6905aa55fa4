"""`lostmotion reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import FiguresOption
from .targets import try_directory, writing
from .terminal import progress


def reproduce(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "out"
    ),
    figures: FiguresOption = None,
) -> None:
    """Reproduce the paper "Simplified dynamic model of the transmission": figures, data and a report.

    Writes report.html, a single self-contained page, the data of its figures as CSV, and the constants as constants.csv. `--figures png,svg` draws each figure, too.

    \b
    lostmotion reproduce -o out
    """
    from ..errors import need
    from ..reports.pictures import endings

    pictures = endings(figures)
    try_directory(output)
    need("jinja2", "The report", "report")
    from ..paper.reproduce import WORK
    from ..paper.reproduce import reproduce as work

    with writing(output), progress(WORK, "Reproducing") as step:
        report = work(output, step, pictures)
    print(f"The report is at {report}")
