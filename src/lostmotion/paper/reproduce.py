"""The paper reproduced: its figures, their data, its constants, and a report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..reports.pages import save_figure, table_csv, write_text
from . import runs
from .drive import Constant, constants
from .facts import facts
from .figures import FIGURES, draw, figure_csv, figure_specs
from .report import render

WORK = runs.WORK + FIGURES  # units of work for the progress bar


def reproduce(directory: Path, progress: Callable[[], None] = lambda: None) -> Path:
    """Write figures (PNG, SVG), their data (CSV), the constants (CSV) and ``report.html`` into a directory.

    Parameters
    ----------
    progress
        Called `WORK` times.

    Returns
    -------
    Path
        Of the report. It links to ``live.html`` where that lies in the directory.
    """
    directory.mkdir(parents=True, exist_ok=True)
    results = runs.compute(progress)
    table = constants()
    write_text(directory / "constants.csv", constants_csv(table))
    images = {}
    found = facts(results)
    specs = figure_specs(results, found)
    for spec in specs:
        figure = draw(spec)
        name = f"figure-{spec.number}"
        images[spec.number] = save_figure(figure, directory, name)
        if (data := figure_csv(spec)) is not None:
            write_text(directory / f"{name}.csv", data)
        progress()
    report = directory / "report.html"
    write_text(report, render(specs, images, table, found, live=(directory / "live.html").is_file()))
    return report


def constants_csv(table: list[Constant]) -> str:
    """The constants table, one row each."""
    return table_csv(
        ["constant", "unit", "printed", "recomputed", "from printed t_m0 and T_RC", "remark"],
        ([c.name, c.unit, c.printed, f"{c.recomputed:.5g}", f"{c.from_printed:.5g}", c.remark] for c in table),
    )
