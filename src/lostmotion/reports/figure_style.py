"""Looks of all figures: the colours of ``style.css``, line styles that differ in grey too, and settings of matplotlib.

Pages, pictures and figures of the documentation take all colours from here.
"""

import re
from importlib.resources import files
from typing import Any


def _light_colours() -> dict[str, str]:
    """Colours of the style sheet by their names, in its light theme."""
    sheet = files("lostmotion").joinpath("reports/style.css").read_text(encoding="utf-8")
    return dict(re.findall(r"--(\w+): (#\w+);", sheet.partition('[data-theme="dark"]')[0]))


COLOURS = _light_colours()  # all colours by their names in the style sheet, where each has a dark one too
PALETTE = {name: COLOURS[name] for name in ("first", "second", "third", "fourth")}
"""colours of curves that are told apart"""
STEPS = tuple(COLOURS[f"step{k}"] for k in range(8))  # colours of an ordered series: step0, step1, ...
MUTED, INK, GRID = COLOURS["muted"], COLOURS["text"], COLOURS["grid"]

# Line styles and widths differ, so that curves differ in grey too.
LOOKS: tuple[dict[str, Any], ...] = tuple(
    {"color": colour, "linestyle": line, "linewidth": width}
    for colour, line, width in zip(PALETTE.values(), ("-", "--", "-.", ":"), (1.6, 1.9, 1.7, 1.9), strict=True)
)
FIRST, SECOND, THIRD, FOURTH = LOOKS
FAINT: dict[str, Any] = {"color": MUTED, "linestyle": ":", "linewidth": 1.3}  # a command, or a curve to compare with
LEVEL: dict[str, Any] = {"color": MUTED, "linestyle": "-", "linewidth": 0.8}  # a limit or a level
MEASURED: dict[str, Any] = {"color": MUTED, "linestyle": "-", "linewidth": 1.3}


def dots(color: str, size: float, marker: str = "o", **more: Any) -> dict[str, Any]:
    """Style of points without a line."""
    return {"color": color, "linestyle": "none", "marker": marker, "markersize": size, **more}


DOTS = dots(PALETTE["second"], 7)
POINTS = dots(INK, 4.5, markerfacecolor="none")  # values of a second method over a line
OTHERS = dots(MUTED, 4, "x", alpha=0.6)  # points that are shown beside the ones that matter
# The models of the paper.
STYLES: dict[str, dict[str, Any]] = {
    "2-DOF-NL": {"color": PALETTE["first"], "linestyle": "-", "linewidth": 1.7},
    "2-DOF-L": {"color": PALETTE["second"], "linestyle": "--", "linewidth": 1.3},
    "1-DOF-L": {"color": PALETTE["third"], "linestyle": "-.", "linewidth": 1.3},
}

SMALLEST = 9.0  # size of the smallest text of a picture [pt], which is read at half the size of the picture too
MATPLOTLIB: Any = {
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.w_pad": 0.07,
    "figure.dpi": 110,
    "savefig.dpi": 150,
    "font.size": 10.5,
    "text.color": INK,
    "axes.titlesize": 11.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": COLOURS["edge"],
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "legend.frameon": True,
    "legend.framealpha": 0.75,
    "legend.edgecolor": "none",
    "legend.fontsize": 9.5,
    "hatch.color": INK,
    "hatch.linewidth": 0.6,
    "svg.hashsalt": "lostmotion",
    "svg.fonttype": "path",
}


def look(k: int) -> dict[str, Any]:
    """Style of the k-th curve of a panel."""
    return LOOKS[k % len(LOOKS)]


def step(k: int, count: int) -> dict[str, Any]:
    """Style of the k-th curve of an ordered series."""
    return {"color": STEPS[round((len(STEPS) - 1) * k / max(1, count - 1))], "linestyle": "-", "linewidth": 1.5}


def map_colours() -> Any:
    """Colour map of matplotlib for a quantity over a plane, whose contours have labels: the darker, the higher, as on pages."""
    from matplotlib.colors import LinearSegmentedColormap, to_rgb

    light, dark = to_rgb(COLOURS["surface"]), to_rgb(INK)
    ends = [tuple(a + share * (b - a) for a, b in zip(light, dark, strict=True)) for share in (0.08, 0.5)]
    return LinearSegmentedColormap.from_list("lostmotion", ends)
