"""The pointing sheet: figures, tables as CSV, and an HTML page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..pointing.budget import Errors, PointingBudget, PointingError
from . import plots
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .panels import Curve, Panel

DARK = {"color": "#0b3c5d", "linewidth": 1.2}
LIGHT = {"color": "#d9730d", "linewidth": 0.9, "linestyle": "--"}
POINTS = {"color": "#0b3c5d", "linewidth": 1.3, "marker": "o", "markersize": 4.0}
NUMBERS = ("rms", "peak", "probable", "mean", "measured, rms")


def header(budget: PointingBudget) -> list[str]:
    """Of the table; in pixels too where there are any."""
    units = [f"{name} [mrad]" for name in NUMBERS]
    return ["axis", "run", *units, *(["rms [px]", "peak [px]"] if budget.pixels else [])]


def budget_rows(budget: PointingBudget) -> list[list[str]]:
    """The table of all runs but those at other speeds, as text."""
    runs = [("as it is", budget.whole)]
    runs += [(f"without {name}", found) for name, found in budget.without.items()]
    runs += [(f"{name} alone", found) for name, found in budget.alone.items()]
    runs += [("none of these", budget.ideal), *budget.variants.items(), *budget.robustness.items()]
    return [[axis, name, *_numbers(budget, axis, found)] for axis in budget.whole for name, found in runs]


def _numbers(budget: PointingBudget, axis: str, found: Errors) -> list[str]:
    e = found[axis]
    numbers = [f"{1e3 * value:.4g}" for value in (e.rms, e.peak, e.probable, e.mean, e.measured_rms)]
    if budget.pixels:
        pixel = budget.pixels.get(axis)
        numbers += [f"{value / pixel:.3g}" if pixel else "" for value in (e.rms, e.peak)]
    return numbers


CONTRIBUTIONS = ("axis", "taken away", "mean square falls by [µrad²]", "share [%]", "rms that is left [mrad]")


def contribution_rows(budget: PointingBudget) -> list[list[str]]:
    """What each cause takes away as all are taken away one after another; the sum is what they make together."""
    rows = []
    for axis, whole in budget.whole.items():
        total = whole.rms**2 - budget.ideal[axis].rms ** 2
        for name, part in budget.contributions(axis).items():
            left = budget.successive[name][axis].rms
            rows.append([axis, name, *_share(part, whole), f"{1e3 * left:.4g}"])
        rows.append([axis, "all of these", *_share(total, whole), f"{1e3 * budget.ideal[axis].rms:.4g}"])
    return rows


def _share(part: float, whole: PointingError) -> list[str]:
    return [f"{1e12 * part:.4g}", f"{100.0 * part / whole.rms**2:.3g}" if whole.rms > 0.0 else ""]


def view_line(budget: PointingBudget) -> str:
    """How long the target is in view, or nothing."""
    if budget.view is None:
        return ""
    return f"in view {100.0 * budget.view.share:.4g} % of the time, with probability {100.0 * budget.view.probability:.6g} %"


def error_panels(budget: PointingBudget) -> list[Panel]:
    """Of each axis its error and that of the measured direction over time, from when on they count."""
    kept = budget.time >= budget.after
    time = budget.time[kept]
    return [
        Panel(
            axis,
            "time [s]",
            "error [mrad]",
            (
                Curve("true direction: reference less load", time, 1e3 * error[kept], DARK, "true direction"),
                Curve("measured direction", time, 1e3 * budget.measured[axis][kept], LIGHT),
            ),
        )
        for axis, error in budget.errors.items()
    ]


def speed_panels(budget: PointingBudget) -> list[Panel]:
    """Error over the speed of the targets; none where they have no speed."""
    if not budget.speeds:
        return []
    factors = np.array(list(budget.speeds))

    def curve(axis: str, name: str, style: dict[str, object]) -> Curve:
        values = np.array([1e3 * getattr(found[axis], name) for found in budget.speeds.values()])
        return Curve(name, factors, values, style)

    return [
        Panel(
            axis,
            "speed of the target, times that of the scenario",
            "error [mrad]",
            (curve(axis, "rms", POINTS), curve(axis, "peak", LIGHT | {"marker": "s", "markersize": 4.0})),
            y_range=(0.0, 1.1e3 * max(found[axis].peak for found in budget.speeds.values()) or 1.0),
        )
        for axis in budget.whole
    ]


def robustness_panels(budget: PointingBudget) -> list[Panel]:
    """Rms error over wrong losses, temperature and wear, of all axes."""
    kinds: Mapping[str, tuple[str, str, float]] = {
        "losses in the controller": ("losses in the controller", "factor", 1.0),
        " K": ("temperature", "change of temperature [K]", 0.0),
        "wear": ("wear", "added backlash [arcmin]", 0.0),
    }
    styles = (
        POINTS,
        LIGHT | {"marker": "s", "markersize": 4.0},
        {"color": "#7fae3f", "marker": "^"},
        {"color": "0.45"},
    )
    panels = []
    for sign, (title, label, nominal) in kinds.items():
        found = {_number(name): errors for name, errors in budget.robustness.items() if sign in name}
        if found:
            points = dict(sorted((found | {nominal: budget.whole}).items()))
            curves = tuple(
                Curve(axis, np.array(list(points)), np.array([1e3 * e[axis].rms for e in points.values()]), style)
                for axis, style in zip(budget.whole, styles * len(budget.whole), strict=False)
            )
            top = 1.1 * max(float(c.y.max()) for c in curves) or 1.0
            panels.append(Panel(title, label, "rms error [mrad]", curves, y_range=(0.0, top)))
    return panels


def _number(name: str) -> float:
    """The one that the name of a run has."""
    return next(float(word) for word in name.split() if word.lstrip("+-").replace(".", "").isdigit())


def write_pointing(directory: Path, name: str, budget: PointingBudget) -> Path:
    """Figures (PNG, SVG), tables and data (CSV) and ``track.html`` in a directory, made if missing.

    Returns
    -------
    Path
        Of the page.
    """
    directory.mkdir(parents=True, exist_ok=True)
    figures = []
    for what, title, caption, panels in (
        ("errors", "Errors over time", "Errors of the true and of the measured direction.", error_panels(budget)),
        ("speed", "Error over target speed", "Error over the speed of the target.", speed_panels(budget)),
        (
            "robustness",
            "Robustness",
            "Error with losses that the controller takes for others, at other temperatures, and with wear.",
            robustness_panels(budget),
        ),
    ):
        if panels:
            png = save_figure(
                plots.draw(panels, len(panels), (max(9.0, 4.0 * len(panels) + 1.5), 3.6)), directory, what
            )
            write_text(directory / f"{what}.csv", panels_csv(panels))
            figures.append(embed(png, title, caption, what))
    rows, parts = budget_rows(budget), contribution_rows(budget)
    write_text(directory / "budget.csv", table_csv(header(budget), rows))
    write_text(directory / "contributions.csv", table_csv(CONTRIBUTIONS, parts))
    page = directory / "track.html"
    write_text(
        page,
        render_page(
            "reports/pointing.html.jinja",
            name=name,
            title=budget.scenario.title or name,
            header=header(budget),
            rows=rows,
            parts_header=CONTRIBUTIONS,
            parts=parts,
            after=budget.after_line,
            view=view_line(budget),
            figures=figures,
        ),
    )
    return page
