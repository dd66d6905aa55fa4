"""Figures. The same model has the same colour and line everywhere; all are readable in grey."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from . import bar_and_matrix_plots as others
from .contours import Contour, edges
from .figure_style import COLOURS, INK, MATPLOTLIB, MUTED, SMALLEST, map_colours
from .panels import Chart, Curve, Ground, Group, Mark, Matrix, Panel
from .run_charts import figure_charts, run_charts
from .thinning import thinned

if TYPE_CHECKING:
    import xarray

HALO = (withStroke(linewidth=2.0, foreground=COLOURS["surface"]),)  # so that text is read over lines
KEY_LINE = 0.18  # height of a line of a key [inch]
MAX_NAMES = 24  # along an axis; of more, every second, third, ...
LEGEND_ROWS = 2  # of a legend above a panel; a longer one is in the panel
MOST_LABELS = 12  # in a legend; of more, every second, third, ...
DEGREES = 60.0  # from which on an axis in degrees has ticks at parts of a right angle

# Decorates what makes or draws figures; the looks of the user's figures stay as they are.
in_our_looks = mpl.rc_context(MATPLOTLIB)


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
    names = sum(len(c.names) for chart in charts if isinstance(chart, Panel) for c in chart.curves if c.numbered)
    figure = Picture(figsize=(size[0], size[1] + KEY_LINE * names))
    rows = -(-len(charts) // columns)
    every = [figure.add_subplot(rows, columns, k + 1) for k in range(len(charts))]
    for axes, chart in zip(every, charts, strict=True):
        if isinstance(chart, Panel):
            _panel(axes, chart)
        else:
            others.draw(axes, chart)
        axes.set_title(chart.title if "_" in chart.title else chart.title[:1].upper() + chart.title[1:])
    _legends(figure, every)
    if note:
        figure.supxlabel(note, fontsize=SMALLEST, color=MUTED)
    return figure


def _legends(figure: Figure, every: list[Any]) -> None:
    """One legend above the figure where one panel has the curves of all panels; else one in each panel."""
    entries = [_some(dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))) for axes in every]
    longest = max(entries, key=len)
    if len(every) > 1 and len(longest) > 1 and all(labels.keys() <= longest.keys() for labels in entries):
        columns = len(longest) if len(longest) <= 4 else 3
        figure.legend(list(longest.values()), list(longest), loc="outside upper center", ncols=columns)
        return
    rows = [_legend_above(axes, labels) for axes, labels in zip(every, entries, strict=True)]
    for axes in every:  # titles beside each other are at one height
        beside = (n for other, n in zip(every, rows, strict=True) if _row(other) == _row(axes))
        axes.set_title(axes.get_title(), pad=6.0 + 14.0 * max(beside))


def _some(labels: dict[str, Any]) -> dict[str, Any]:
    """The labels that a legend has room for, at equal distances: a train of 40 shafts has a curve for each."""
    return dict(list(labels.items())[:: -(-len(labels) // MOST_LABELS) or 1])


def _row(axes: Any) -> int:
    return int(axes.get_subplotspec().rowspan.start)


def _legend_above(axes: Any, labels: Mapping[str, Any]) -> int:
    """The legend of a panel between its title and its curves, and its rows; inside, where it is long."""
    if len(labels) < 2:
        return 0
    room = axes.figure.get_figwidth() / axes.get_gridspec().ncols - 0.95  # inch, beside the labels of y
    lengths = list(map(len, labels))
    for rows in range(1, LEGEND_ROWS + 1):
        columns = -(-len(labels) // rows)
        longest = [max(lengths[k * rows : (k + 1) * rows], default=0) for k in range(columns)]
        if sum(0.55 + 0.068 * n for n in longest) <= room:
            break
    else:
        axes.legend(list(labels.values()), list(labels), loc="best", ncols=1 + len(labels) // 8)
        return 0
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2, "borderpad": 0.1}
    legend = axes.legend(list(labels.values()), list(labels), ncols=columns, columnspacing=1.2, **place)
    legend.set_in_layout(False)  # the title above makes the room
    return rows


def draw_group(group: Group) -> Figure:
    """The picture of a group of charts."""
    columns = min(group.columns, len(group.charts))
    rows = -(-len(group.charts) // columns)
    names = max((len(chart.names) for chart in group.charts if isinstance(chart, Matrix)), default=0)
    width, height = max(6.0, min(4.2 * columns, 12.0)), max(2.7, 1.2 + 0.5 * names)
    return draw(group.charts, columns, (max(width, 2.5 + 0.55 * names), 0.6 + height * rows))


def _panel(axes: Any, panel: Panel) -> None:
    for low, high in panel.shaded:
        axes.axvspan(low, high, color=COLOURS["grid"], linewidth=0)
    if (ground := panel.ground) is not None:
        _contours(axes, panel, ground)
    if panel.level is not None:
        axes.axhline(panel.level, color=MUTED, linestyle="--", linewidth=0.9)
    for curve in panel.curves:
        axes.plot(*thinned(curve.x, curve.y), label=curve.shown, **curve.style)
        if curve.numbered:
            _numbers(axes, curve)
    for mark in panel.marks:
        axes.plot([mark.x, mark.x], [mark.y, mark.y if mark.to is None else mark.to], color=mark.style["color"])
        axes.plot([mark.x], [mark.y], ".", color=mark.style["color"])
    if panel.log_x:
        axes.set_xscale("log")
    if panel.log_y and (panel.ground or any(np.any(np.asarray(curve.y) > 0.0) for curve in panel.curves)):
        axes.set_yscale("log")
    axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
    if "[deg" in panel.y_label and not panel.log_y and abs(np.subtract(*axes.get_ylim())) > DEGREES:
        axes.yaxis.set_major_locator(MaxNLocator(steps=[1, 1.5, 3, 4.5, 9, 10]))
    if panel.whole_x:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if panel.x_names:
        shown = range(0, len(panel.x_names), -(-len(panel.x_names) // MAX_NAMES))
        names = [panel.x_names[k] for k in shown]
        axes.set_xticks(shown, names, rotation=45, ha="right", fontsize=SMALLEST)
    if panel.x_range is not None:
        axes.set_xlim(*panel.x_range)
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    elif panel.x_range is not None and panel.curves:
        axes.set_ylim(*_range_within(panel.curves, panel.x_range))
    _texts_of_marks(axes, panel.marks)


def _texts_of_marks(axes: Any, marks: Iterable[Mark]) -> None:
    """Texts beside the marks, as far as they do not cover each other: above, else below, as on pages."""
    to_axes = axes.transData + axes.transAxes.inverted()
    grid, (width, height) = axes.get_gridspec(), axes.figure.get_size_inches()
    room = 72.0 * width / grid.ncols - 60.0, 72.0 * height / grid.nrows - 65.0  # of the axes [pt], about
    written: list[tuple[float, float, float]] = []
    for mark in {mark.text: mark for mark in marks}.values():
        x, y = (share * size for share, size in zip(to_axes.transform((mark.x, mark.y)), room, strict=True))
        end = x + 4.0 + 0.55 * SMALLEST * len(mark.text)
        free = (up for up in (4.0, -12.0, 16.0, -24.0) if all(
            x > b or end < a or abs(y + up - other) > SMALLEST + 2.0 for a, b, other in written))  # fmt: skip
        if (up := next(free, None)) is not None:
            written.append((x, end, y + up))
            text = axes.annotate(mark.text, (mark.x, mark.y), (4, up), textcoords="offset points", fontsize=SMALLEST)
            text.set_path_effects(HALO)


def _numbers(axes: Any, curve: Curve) -> None:
    """The points with their numbers, and a key of their names."""
    for k, point in enumerate(zip(curve.x, curve.y, strict=True), 1):
        beside = (4, 5) if k % 2 else (4, -13)  # neighbours do not cover each other
        text = axes.annotate(str(k), point, textcoords="offset points", xytext=beside, fontsize=SMALLEST, zorder=5)
        text.set_path_effects(HALO)
    axes.margins(0.1)  # room for them
    names = "\n".join(f"{k}  {name}" for k, name in enumerate(curve.names, 1))
    axes.figure.supxlabel(names, x=0.02, ha="left", fontsize=SMALLEST)


def _contours(axes: Any, panel: Panel, ground: Ground) -> None:
    shown = np.ma.masked_invalid(ground.values)
    axes.grid(visible=False)
    if shown.count() == 0 or float(np.ptp(shown.compressed())) == 0.0:
        axes.text(0.5, 0.5, "no values, or all are the same", transform=axes.transAxes, ha="center", color=MUTED)
        return
    if shown.count() == shown.size:
        mesh = axes.pcolormesh(ground.x, ground.y, shown, cmap=map_colours(), shading="gouraud")
    else:
        sides = (edges(ground.x, logarithmic=panel.log_x), edges(ground.y, logarithmic=panel.log_y))
        mesh = axes.pcolormesh(*sides, shown, cmap=map_colours())
    mesh.set_rasterized(True)
    axes.figure.colorbar(mesh, ax=axes, label=ground.label)
    draw_contours(axes, panel.contours())


def draw_contours(axes: Any, lines: Iterable[Contour]) -> None:
    """Contours with their values."""
    for contour in lines:
        axes.plot(contour.x, contour.y, color=INK, linewidth=0.6)
        text = axes.annotate(contour.text, contour.label, ha="center", va="center", fontsize=SMALLEST)
        text.set_path_effects(HALO)


def _range_within(curves: Iterable[Curve], x_range: tuple[float, float]) -> tuple[float, float]:
    """Limits that hold all points within a range of x, with a margin."""
    inside = [np.asarray(c.y)[(np.asarray(c.x) >= x_range[0]) & (np.asarray(c.x) <= x_range[1])] for c in curves]
    low, high = min(float(np.nanmin(y)) for y in inside), max(float(np.nanmax(y)) for y in inside)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def overview(result: xarray.Dataset, figure: str | None = None) -> Figure:
    """A run at a glance: controlled axes with their following errors, commands, speeds, torques, twists, contacts as bars.

    figure: a single panel: motion, losses, contacts or energy.

    Raises InputError: the dataset lacks what is shown.
    """
    charts = run_charts(result) if figure is None else figure_charts(result, figure)
    columns = min(2, len(charts))
    note = result.attrs.get("warning", "") or result.attrs.get("note", "")
    rows = -(-len(charts) // columns)
    drawn = draw(charts, columns, (10.0, 2.7 * rows if figure is None else max(4.5, 2.7 * rows)), note=note)
    if result.attrs.get("title"):
        drawn.suptitle(result.attrs["title"])
    return drawn
