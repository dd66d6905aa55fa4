"""`lostmotion reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .targets import try_directory, writing
from .terminal import progress


def reproduce(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Directory, made if missing.")] = Path(
        "out"
    ),
) -> None:
    """Reproduce the paper "Simplified dynamic model of the transmission": figures, data and a report.

    Writes PNG, SVG and CSV of its figures, the constants as constants.csv, and report.html, a single self-contained page.
    """
    from ..errors import need

    try_directory(output)
    need("jinja2", "The report", "report")
    from ..paper.reproduce import WORK
    from ..paper.reproduce import reproduce as work

    with writing(output), progress(WORK, "Reproducing") as step:
        report = work(output, step)
    print(f"The report is at {report}")
