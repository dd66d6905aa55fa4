"""The pointing sheet: figures, tables as CSV, and an HTML page."""

from __future__ import annotations

from pathlib import Path

from ..pointing.budget import PointingBudget, PointingError
from . import plots
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .panels import Curve, Panel

STYLE = {"color": "#0b3c5d", "linewidth": 1.2}
HEADER = (
    "axis",
    "run",
    "rms [mrad]",
    "peak [mrad]",
    "probable error [mrad]",
    "mean [mrad]",
    "encoder less load, rms [mrad]",
)


def budget_rows(budget: PointingBudget) -> list[list[str]]:
    """The table of all runs, as text."""
    runs = [("as it is", budget.whole)]
    runs += [(f"without {name}", found) for name, found in budget.without.items()]
    runs += [(f"{name} alone", found) for name, found in budget.alone.items()]
    runs += [("none of these", budget.ideal), *budget.variants.items()]
    return [[axis, name, *_numbers(found[axis])] for axis in budget.whole for name, found in runs]


def _numbers(e: PointingError) -> list[str]:
    return [f"{1e3 * value:.4g}" for value in (e.rms, e.peak, e.probable, e.mean, e.measured_rms)]


def view_line(budget: PointingBudget) -> str:
    """How long the target is in view, or nothing."""
    if budget.view is None:
        return ""
    return f"in view {100.0 * budget.view.share:.4g} % of the time, with probability {100.0 * budget.view.probability:.6g} %"


def error_panels(budget: PointingBudget) -> list[Panel]:
    """Of each axis its error over time."""
    return [
        Panel(
            f"{axis}: reference less load",
            "time [s]",
            "error [mrad]",
            (Curve("error", budget.time, 1e3 * error, STYLE),),
        )
        for axis, error in budget.errors.items()
    ]


def write_pointing(directory: Path, name: str, budget: PointingBudget) -> Path:
    """Figure (PNG, SVG), table and data (CSV) and ``track.html`` in a directory, made if missing.

    Returns
    -------
    Path
        Of the page.
    """
    directory.mkdir(parents=True, exist_ok=True)
    panels = error_panels(budget)
    png = save_figure(plots.draw(panels, len(panels), (5.0 * len(panels) + 2.0, 3.6)), directory, "errors")
    write_text(directory / "errors.csv", panels_csv(panels))
    rows = budget_rows(budget)
    write_text(directory / "budget.csv", table_csv(HEADER, rows))
    page = directory / "track.html"
    title = budget.scenario.title or name
    caption = "Error of the true direction over the run."
    write_text(
        page,
        render_page(
            "reports/pointing.html.jinja",
            name=name,
            title=title,
            header=HEADER,
            rows=rows,
            after=budget.after,
            view=view_line(budget),
            figures=[embed(png, "Errors over time", caption, "errors")],
        ),
    )
    return page
