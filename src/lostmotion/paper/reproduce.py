"""The paper reproduced: its figures, their data, its constants, and a report."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ..reports.pictures import save, side_by_side
from ..reports.written_files import table_csv, write_text
from . import runs
from .figures import FIGURES, FigureSpec, draw, figure_csv, figure_specs
from .published_drive import Constant, constants
from .quoted_numbers import facts
from .report import render

WORK = runs.WORK + FIGURES  # units of work for the progress bar


def reproduce(directory: Path, progress: Callable[[], None] = lambda: None, pictures: Sequence[str] = ()) -> Path:
    """Write ``report.html``, the data of its figures (CSV) and the constants (CSV) into a directory.

    progress: called `WORK` times.
    pictures: endings of the files in which matplotlib draws each figure of the paper: png, svg, pdf.

    Returns the path of the report. It links to ``live.html`` where that lies in the directory.
    """
    directory.mkdir(parents=True, exist_ok=True)
    results = runs.compute(progress)
    table = constants()
    write_text(directory / "constants.csv", constants_csv(table))
    found = facts(results)
    specs = figure_specs(results, found)
    for spec in specs:
        if (data := figure_csv(spec)) is not None:
            write_text(directory / f"figure-{spec.number}.csv", data)
        progress()
    if pictures:
        side_by_side(_draw, [(directory, spec, tuple(pictures)) for spec in specs])
    report = directory / "report.html"
    write_text(report, render(specs, table, found, live=(directory / "live.html").is_file()))
    return report


def _draw(directory: Path, spec: FigureSpec, kinds: tuple[str, ...]) -> None:
    save(draw(spec), directory, f"figure-{spec.number}", kinds)


def constants_csv(table: list[Constant]) -> str:
    """The constants table, one row each."""
    return table_csv(
        ["constant", "unit", "printed", "recomputed", "from printed t_m0 and T_RC", "remark"],
        ([c.name, c.unit, c.printed, f"{c.recomputed:.5g}", f"{c.from_printed:.5g}", c.remark] for c in table),
    )
