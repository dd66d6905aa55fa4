"""Figures. The same model has the same colour and line everywhere; all are readable in grey."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from . import other_plots as others
from .panels import Chart, Curve, Ground, Group, Panel
from .run_charts import figure_charts, run_charts
from .thinning import thinned

if TYPE_CHECKING:
    import xarray

LOOKS: Any = {
    "figure.constrained_layout.use": True,
    "figure.dpi": 110,
    "savefig.dpi": 150,
    "font.size": 9.5,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.hashsalt": "lostmotion",
    "svg.fonttype": "path",
}


MAX_NAMES = 12  # of the points of a line

# Decorates what makes or draws figures; the looks of the user's figures stay as they are.
in_our_looks = mpl.rc_context(LOOKS)


class Picture(Figure):
    """A figure that is drawn in the looks of this package, and shown by notebooks."""

    @in_our_looks
    def draw(self, renderer: Any) -> None:
        super().draw(renderer)

    @in_our_looks
    def savefig(self, fname: Any, **options: Any) -> None:
        super().savefig(fname, **options)

    def _repr_png_(self) -> bytes:
        png = io.BytesIO()
        self.savefig(png, format="png", dpi=self.dpi)
        return png.getvalue()


@in_our_looks
def draw(charts: Iterable[Chart], columns: int, size: tuple[float, float], note: str = "") -> Figure:
    """Charts in rows of `columns`, `size` [inch] in all; `note` stands below."""
    charts = list(charts)
    figure = Picture(figsize=size)
    rows = -(-len(charts) // columns)
    for k, chart in enumerate(charts):
        axes = figure.add_subplot(rows, columns, k + 1)
        if isinstance(chart, Panel):
            _panel(axes, chart)
        else:
            others.draw(axes, chart)
        axes.set_title(chart.title)
        axes.title.set_fontsize(10)
    labels = [[c.shown for c in chart.curves] if isinstance(chart, Panel) else [] for chart in charts]
    if len(labels[0]) > 1 and all(names == labels[0] for names in labels):
        columns = len(labels[0]) if len(labels[0]) <= 4 else 3
        handles = figure.axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside upper center", ncols=columns, fontsize=8.5)
    else:
        for axes, names in zip(figure.axes, labels, strict=False):
            if len(names) > 1:
                axes.legend(fontsize=8, loc="best")
    if note:
        figure.supxlabel(note, fontsize=8, color="0.35")
    return figure


def draw_group(group: Group) -> Figure:
    """The picture of a group of charts."""
    columns = min(group.columns, len(group.charts))
    rows = -(-len(group.charts) // columns)
    return draw(group.charts, columns, (max(6.0, min(4.2 * columns, 12.0)), 0.6 + 2.7 * rows))


def _panel(axes: Any, panel: Panel) -> None:
    for low, high in panel.shaded:
        axes.axvspan(low, high, color="0.88", linewidth=0)
    if (ground := panel.ground) is not None:
        _contours(axes, ground)
    if panel.level is not None:
        axes.axhline(panel.level, color="0.45", linestyle="--", linewidth=0.9)
    for curve in panel.curves:
        axes.plot(*thinned(curve.x, curve.y), label=curve.shown, **curve.style)
        if curve.names and curve.style.get("linestyle") != "none":
            _names(axes, curve)
    for mark in panel.marks:
        axes.plot([mark.x, mark.x], [mark.y, mark.y if mark.to is None else mark.to], color=mark.style["color"])
        axes.plot([mark.x], [mark.y], ".", color=mark.style["color"])
        axes.annotate(mark.text, (mark.x, mark.y), (4, 4), textcoords="offset points", fontsize=7)
    if panel.log_x:
        axes.set_xscale("log")
    if panel.log_y and (panel.ground or any(np.any(np.asarray(curve.y) > 0.0) for curve in panel.curves)):
        axes.set_yscale("log")
    axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
    if panel.x_names:
        axes.set_xticks(range(len(panel.x_names)), panel.x_names, rotation=45, ha="right", fontsize=7)
    if panel.x_range is not None:
        axes.set_xlim(*panel.x_range)
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    elif panel.x_range is not None and panel.curves:
        axes.set_ylim(*_range_within(panel.curves, panel.x_range))


def _names(axes: Any, curve: Curve) -> None:
    """The first points of a line with their names, and room for that of the last."""
    for name, *point in zip(curve.names[:MAX_NAMES], curve.x, curve.y, strict=False):
        axes.annotate(name, point, textcoords="offset points", xytext=(4, 4), fontsize=6)
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + 0.25 * (high - low))


def _contours(axes: Any, ground: Ground) -> None:
    shown = np.ma.masked_invalid(ground.values)
    axes.grid(visible=False)
    if shown.count() == 0 or float(np.ptp(shown.compressed())) == 0.0:
        axes.text(0.5, 0.5, "nothing to show", transform=axes.transAxes, ha="center", color="0.35")
        return
    filled = axes.contourf(ground.x, ground.y, shown, levels=14, cmap="cividis")
    axes.figure.colorbar(filled, ax=axes, label=ground.label)
    axes.contour(ground.x, ground.y, shown, levels=14, colors="0.15", linewidths=0.4)


def _range_within(curves: Iterable[Curve], x_range: tuple[float, float]) -> tuple[float, float]:
    """Limits that hold all points within a range of x, with a margin."""
    inside = [np.asarray(c.y)[(np.asarray(c.x) >= x_range[0]) & (np.asarray(c.x) <= x_range[1])] for c in curves]
    low, high = min(float(np.nanmin(y)) for y in inside), max(float(np.nanmax(y)) for y in inside)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def overview(result: xarray.Dataset, figure: str | None = None) -> Figure:
    """A run at a glance: controlled axes with their following errors, commands, speeds, torques, twists, contacts as bars.

    Parameters
    ----------
    figure
        A part of it alone: motion, losses, contacts or energy.

    Raises
    ------
    InputError
        The dataset lacks what is shown.
    """
    charts = run_charts(result) if figure is None else figure_charts(result, figure)
    columns = min(2, len(charts))
    note = result.attrs.get("warning", "") or result.attrs.get("note", "")
    rows = -(-len(charts) // columns)
    drawn = draw(charts, columns, (10.0, 2.7 * rows if figure is None else max(4.5, 2.7 * rows)), note=note)
    if result.attrs.get("title"):
        drawn.suptitle(result.attrs["title"])
    return drawn


@in_our_looks
def loss_map(speeds: Any, loads: Any, values: Any, note: str = "") -> Figure:
    """Figure 5: the loss coefficient as a surface and as curves. values[load, speed], driving side only."""
    figure = Picture(figsize=(10.0, 4.2))
    surface: Any = figure.add_subplot(1, 2, 1, projection="3d")
    v, mu = np.meshgrid(speeds, loads)
    surface.plot_surface(v, mu, values, cmap="cividis", edgecolor="0.25", linewidth=0.4, alpha=0.95)
    surface.set(xlabel="relative speed v [-]", ylabel="relative load µ [-]", zlabel="$m_{2B}$ [-]")
    surface.tick_params(labelsize=7.5, pad=0)
    surface.view_init(elev=24, azim=-125)
    surface.set_box_aspect(None, zoom=0.88)
    curves = figure.add_subplot(1, 2, 2)
    shades = mpl.colormaps["cividis"](np.linspace(0.0, 0.85, len(loads)))
    for row, load, colour in zip(values, loads, shades, strict=True):
        curves.plot(speeds, row, color=colour, marker="o", markersize=3, label=f"µ = {load:g}")
    curves.set(xlabel="relative speed v [-]", ylabel="loss coefficient $m_{2B}$ [-]", ylim=(0.0, None))
    curves.legend(fontsize=8, ncols=2)
    if note:
        figure.supxlabel(note, fontsize=8, color="0.35")
    return figure
