"""Pictures of the charts that are not made of lines: bars, histograms, matrices, contacts, energy."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from .figure_style import COLOURS, INK, PALETTE, SMALLEST
from .panels import Bars, Chart, Contacts, Flows, Histogram, Matrix

FIRST, SECOND = PALETTE["first"], PALETTE["second"]

MAX_CONTACTS = 20  # that have room for a name; of more, every second, third, ...


def draw(axes: Any, chart: Chart) -> None:
    """One chart on its axes."""
    drawn: dict[type, Callable[[Any, Any], None]] = {
        Bars: _bars,
        Histogram: _histogram,
        Matrix: _matrix,
        Contacts: _contacts,
        Flows: _flows,
    }
    drawn[type(chart)](axes, chart)


def _bars(axes: Any, chart: Bars) -> None:
    order = sorted(chart.values, key=lambda name: max(map(abs, chart.values[name])))
    count = len(chart.series) or 1
    y = np.arange(len(order))
    for n, colour in zip(range(count), (FIRST, SECOND), strict=False):
        values = [chart.values[name][n] for name in order]
        label = chart.series[n] if chart.series else None
        axes.barh(y + (0.5 * (count - 1) - n) * 0.4, values, 0.8 / count, color=colour, label=label)
    axes.set_yticks(y, order)
    axes.axvline(0.0 if chart.limit is None else chart.limit, color=INK, linewidth=0.8)
    axes.set(xlabel=chart.label, xlim=chart.x_range)


def _histogram(axes: Any, chart: Histogram) -> None:
    values = np.asarray(chart.values)
    axes.hist(values, bins=min(60, max(5, round(len(values) ** 0.5))), color=FIRST)
    label = f"{', '.join(f'{100.0 * q:g}' for q in chart.quantiles)} % of the runs lie below"
    axes.plot([], [], color=FIRST, label="number of runs")
    for k, value in enumerate(np.quantile(values, chart.quantiles)):
        axes.axvline(value, color=SECOND, linewidth=1.2, label="_" if k else label)
    axes.set(xlabel=chart.label, ylabel="runs")


def _matrix(axes: Any, chart: Matrix) -> None:
    """The number in each cell gives the sign in grey too."""
    n = len(chart.names)
    axes.grid(visible=False)
    image = axes.imshow(
        chart.values,
        cmap=LinearSegmentedColormap.from_list("signs", [FIRST, COLOURS["surface"], SECOND]),
        vmin=-1.0,
        vmax=1.0,
    )
    axes.set_xticks(range(n), chart.names, rotation=45, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(n), chart.names)
    for i, j in np.ndindex(n, n):
        ink = COLOURS["surface"] if abs(chart.values[i, j]) > 0.6 else INK
        axes.text(j, i, f"{chart.values[i, j]:+.2f}", ha="center", va="center", fontsize=SMALLEST, color=ink)
    axes.figure.colorbar(image, ax=axes, shrink=0.8)


def _contacts(axes: Any, chart: Contacts) -> None:
    """Stuck: full height; forward: the upper half; backward: the lower half."""
    time = np.asarray(chart.time)
    for k, modes in enumerate(chart.modes.values()):
        m = np.asarray(modes)[:-1]
        edges = np.concatenate([[0], np.flatnonzero(np.diff(m)) + 1, [len(m)]])
        for mode, (low, high) in {0: (-0.35, 0.7), 1: (0.0, 0.35), -1: (-0.35, 0.35)}.items():
            spans = [(time[a], time[b] - time[a]) for a, b in pairwise(edges.tolist()) if m[a] == mode]
            axes.broken_barh(spans, (low - k, high), facecolor=COLOURS["slips" if mode else "stuck"])
    for name, text in {"stuck": "stuck", "slips": "slips (up forward, down reverse)"}.items():
        axes.broken_barh([], (0.0, 0.0), facecolor=COLOURS[name], label=text)
    named = slice(None, None, -(-len(chart.modes) // MAX_CONTACTS) or 1)
    axes.set_yticks([-k for k in range(len(chart.modes))][named], list(chart.modes)[named])
    axes.set(xlabel="time [s]")


def _flows(axes: Any, chart: Flows) -> None:
    _bars(axes, Bars("", "energy [J]", {name: (e,) for name, e in chart.shown.items()}))
