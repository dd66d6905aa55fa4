"""Charts as SVG inside a page: what is read and printed without JavaScript, in the colours of the style sheet."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np

from ..units.practical import part_of_whole
from .contours import edges, ticks
from .packed import colour_name, dashes
from .panels import Bars, Chart, Contacts, Curve, Drawing, Ground, Histogram, Panel
from .thinning import simplified, thinned

WIDTH, HEIGHT = 460.0, 220.0  # small enough for two in a row on paper
NARROW = 380.0  # width of bars and histograms, about the width of a card in three columns and on a telephone
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 10.0, 36.0
POINTS = 1200  # of a curve, before those are dropped that no one sees
CONSTANT = 1e-9  # relative differences up to which are rounding
LETTER = 5.7  # width of one in the name of a bar
NAMES = 8  # along an axis
DOTS = 600  # of a cloud
SHADES = 16  # of a map
APART = (34.0, 13.0)  # width and height of a value at a contour
SEEN = 0.3  # from a line between others, in units of the picture
Scale = Callable[[Any], Any]


def svg_of(chart: Chart) -> str:
    """The picture of a chart; empty where a table says the same."""
    if isinstance(chart, Panel):
        return _panel(chart)
    if isinstance(chart, Drawing):
        return chart.svg
    if isinstance(chart, Bars):
        return _bars(chart)
    if isinstance(chart, Histogram):
        return _histogram(chart)
    return _contacts(chart) if isinstance(chart, Contacts) else ""


def swatch(curve: Curve) -> str:
    """The entry of a curve in a legend."""
    style, name = curve.style, colour_name(curve.style)
    dash = " ".join(f"{v:g}" for v in dashes(style.get("linestyle", "-")))
    line = f'<line x1="0" x2="26" y1="4" y2="4" stroke="var(--{name})" stroke-width="{style.get("linewidth", 1.5):g}"'
    line += f' stroke-dasharray="{dash}"/>' if dash else "/>"
    dot = f'<circle cx="13" cy="4" r="3" fill="var(--{name})"/>' if style.get("marker") else ""
    shown = "" if style.get("linestyle") == "none" else line
    return f'<span class="swatch" aria-hidden="true"><svg viewBox="0 0 26 8">{shown}{dot}</svg></span>'


def _logarithmic_ticks(low: float, high: float) -> list[float]:
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    factors = (1,) if high / low > 300.0 else (1, 2, 5)
    found = [f * 10.0**e for e in exponents for f in factors if low * (1 - 1e-9) <= f * 10.0**e <= high * (1 + 1e-9)]
    return found[:: max(1, math.ceil(len(found) / 9))]


def _shown(value: float) -> str:
    return f"{value:.6g}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e").replace("-", "−")


def extent(values: Iterable[Any], logarithmic: bool, share: float) -> tuple[float, float]:
    """Limits of an axis that hold all values, with room at both ends."""
    every = np.concatenate([np.asarray(v, float).ravel() for v in values] or [np.zeros(1)])
    every = every[np.isfinite(every) & ((every > 0.0) | (not logarithmic))]
    if len(every) == 0:
        return (1.0, 10.0) if logarithmic else (0.0, 1.0)
    low, high = float(every.min()), float(every.max())
    if logarithmic:
        return (low / 1.05, high * 1.05) if share else (low, high) if high > low else (low / 2.0, high * 2.0)
    room = share * (high - low) if high - low > CONSTANT * max(abs(low), abs(high)) else abs(high) or 1.0
    return low - room, high + room


def _scale(limits: tuple[float, float], begin: float, end: float, logarithmic: bool) -> Scale:
    low, high = map(math.log10, limits) if logarithmic else limits

    def to(value: Any) -> Any:
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.log10(value) if logarithmic else np.asarray(value, float)
        return begin + (end - begin) * (share - low) / (high - low)

    return to


def _frame(
    panel: Panel,
    x: tuple[float, float],
    y: tuple[float, float],
    to_x: Scale,
    to_y: Scale,
    log_y: bool,
    width: float = WIDTH,
) -> str:
    """Grid, ticks and labels."""
    lines, texts = [], []
    for v in _logarithmic_ticks(*y) if log_y else ticks(*y, 5, "[deg" in panel.y_label):
        at = f"{float(to_y(v)):.1f}"
        lines.append(f"M{LEFT} {at}H{width - RIGHT}")
        texts.append(f'<text class="tick end" x="{LEFT - 5}" y="{at}" dy="4">{_shown(v)}</text>')
    places = [float(k) for k in range(len(panel.x_names))] if len(panel.x_names) <= NAMES else []
    for v in (
        places
        if panel.x_names
        else (_logarithmic_ticks(*x) if panel.log_x else ticks(*x, 6 if width == WIDTH else 4, whole=panel.whole_x))
    ):
        at = f"{float(to_x(v)):.1f}"
        lines.append(f"M{at} {TOP}V{HEIGHT - BOTTOM}")
        name = panel.x_names[int(v)] if panel.x_names else _shown(v)
        texts.append(f'<text class="tick" x="{at}" y="{HEIGHT - BOTTOM + 14}">{escape(name)}</text>')
    texts.append(f'<text class="tick end" x="{width - RIGHT}" y="{HEIGHT - 4}">{escape(panel.x_label)}</text>')
    texts.append(f'<text class="tick end" transform="translate(11 {TOP}) rotate(-90)">{escape(panel.y_label)}</text>')
    return f'<path class="axis" d="{"".join(lines)}" fill="none"/>{"".join(texts)}'


def _panel(panel: Panel) -> str:
    log_y = panel.log_y and any(np.any(np.asarray(c.y) > 0.0) for c in panel.curves)
    ground = panel.ground
    log_y = log_y or (panel.log_y and ground is not None)
    across, along = ([], []) if ground is None else ([ground.x], [ground.y])
    x = panel.x_range or extent(
        [*(c.x for c in panel.curves), *across], panel.log_x, 0.0 if panel.log_x or ground else 0.02
    )
    marked = [v for m in panel.marks for v in (m.y, m.y if m.to is None else m.to)]
    seen = [np.asarray(c.y)[(np.asarray(c.x) >= x[0]) & (np.asarray(c.x) <= x[1])] for c in panel.curves]
    y = panel.y_range or extent([*seen, marked, *along], log_y, 0.0 if ground else 0.06)
    to_x = _scale(x, LEFT, WIDTH - RIGHT, panel.log_x)
    to_y = _scale(y, HEIGHT - BOTTOM, TOP, log_y)
    parts = [_frame(panel, x, y, to_x, to_y, log_y)]
    parts += [] if ground is None else [_ground(ground, to_x, to_y), _contours(panel, to_x, to_y)]
    for low, high in panel.shaded:
        a, b = (float(np.clip(to_x(v), LEFT, WIDTH - RIGHT)) for v in (low, high))
        parts.append(
            f'<rect x="{a:.1f}" y="{TOP}" width="{b - a:.1f}" height="{HEIGHT - TOP - BOTTOM}" fill="var(--grid)"/>'
        )
    if panel.level is not None:
        at = float(to_y(panel.level))
        parts.append(f'<path d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}" stroke="var(--edge)" stroke-dasharray="4 3"/>')
    inside = f'x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}"'
    box = f"{LEFT} {TOP} {WIDTH - LEFT - RIGHT} {HEIGHT - TOP - BOTTOM}"
    curves = "".join(_curve(curve, to_x, to_y) for curve in panel.curves)
    parts.append(f'<svg {inside} viewBox="{box}">{curves}</svg>')  # which shows nothing outside
    for mark in panel.marks:
        a, b = float(to_x(mark.x)), float(to_y(mark.y))
        if not (LEFT <= a <= WIDTH - RIGHT and math.isfinite(b)):
            continue
        colour = colour_name(mark.style)
        if mark.to is not None:
            parts.append(
                f'<path d="M{a:.1f} {b:.1f}V{float(to_y(mark.to)):.1f}" stroke="var(--{colour})" stroke-width="2"/>'
            )
        parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.5" fill="var(--{colour})"/>')
        parts.append(_beside(a, b, mark.text))
    for curve in (c for c in panel.curves if c.numbered):
        places = zip(to_x(np.asarray(curve.x, float)).tolist(), to_y(np.asarray(curve.y, float)).tolist(), strict=True)
        parts += [_beside(a, b, str(k)) for k, (a, b) in enumerate(places, 1)]
    return _svg(panel.title, HEIGHT, parts)


def _beside(x: float, y: float, text: str) -> str:
    """A text beside a point, within the picture."""
    right = x + 8.0 + 6.2 * len(text) < WIDTH - RIGHT
    place = f'class="mark-text {"start" if right else "end"}" x="{x + (6.0 if right else -6.0):.1f}"'
    return f'<text {place} y="{y - 6.0:.1f}">{escape(text)}</text>' if text else ""


def _ground(ground: Ground, to_x: Scale, to_y: Scale) -> str:
    """A map as cells in a few shades."""
    across, along = (edges(to(np.asarray(v, float))).tolist() for to, v in ((to_x, ground.x), (to_y, ground.y)))
    values = np.asarray(ground.values, float)
    low, high = extent([values], False, 0.0)
    with np.errstate(invalid="ignore"):
        levels = np.where(np.isfinite(values), np.round(SHADES * (values - low) / ((high - low) or 1.0)), -1.0)
    cells: dict[int, list[str]] = {}
    for j, row in enumerate(levels.astype(int).tolist()):
        ends = [0, *(k for k in range(1, len(row)) if row[k] != row[k - 1]), len(row)]
        for a, b in pairwise(ends):
            box = f"M{across[a]:.1f} {along[j]:.1f}H{across[b]:.1f}V{along[j + 1]:.1f}H{across[a]:.1f}z"
            cells.setdefault(row[a], []).append(box)
    shades = {level: 0.08 + 0.42 * level / SHADES for level in cells if level >= 0}
    return "".join(
        f'<path fill="var(--text)" fill-opacity="{s:.3f}" d="{"".join(cells[n])}"/>' for n, s in shades.items()
    )


def _contours(panel: Panel, to_x: Scale, to_y: Scale) -> str:
    """Contours of a map with their values, where these do not cover each other."""
    lines, texts, written = [], [], list[tuple[float, float]]()
    for contour in panel.contours():
        lines.append(_path(np.column_stack([to_x(contour.x), to_y(contour.y)])))
        x, y = float(to_x(contour.label[0])), float(to_y(contour.label[1]))
        if all(abs(x - a) > APART[0] or abs(y - b) > APART[1] for a, b in written):
            texts.append(f'<text class="tick contour" x="{x:.1f}" y="{y + 4:.1f}">{contour.text}</text>')
            written.append((x, y))
    return f'<path class="contour" d="{"".join(lines)}"/>{"".join(texts)}'


def _svg(title: str, height: float, parts: Iterable[str], width: float = WIDTH) -> str:
    label = f' aria-label="{escape(title)}"' if title else ""
    narrow = f' style="max-width: {1.2 * width:g}px"' if width < WIDTH else ""
    return f'<svg role="img"{label}{narrow} viewBox="0 0 {width:g} {height:g}">{"".join(parts)}</svg>'


def _curve(curve: Curve, to_x: Scale, to_y: Scale) -> str:
    x, y = thinned(np.asarray(curve.x, float), np.asarray(curve.y, float), POINTS)
    points = np.column_stack([to_x(x), to_y(y)])
    colour, style = colour_name(curve.style), curve.style
    out = ""
    if style.get("linestyle", "-") not in ("none", ""):
        dash = " ".join(f"{v:g}" for v in dashes(style.get("linestyle", "-")))
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        out = f'<path fill="none" stroke="var(--{colour})" stroke-width="{style.get("linewidth", 1.5):g}"{dashed} d="{_path(points)}"/>'
    if style.get("marker"):
        seen = points[np.isfinite(points).all(axis=1)]
        seen = seen[:: max(1, len(seen) // DOTS)]
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in seen.tolist())
        size = style.get("markersize", 5.0)
        out += f'<path stroke="var(--{colour})" stroke-width="{size:g}" stroke-linecap="round" d="{dots}"/>'
    return out


def _path(points: np.ndarray) -> str:
    """Lines between points, but for points that are not finite; far points are kept near the picture."""
    there = np.isfinite(points).all(axis=1)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(int)))
    words = []
    for begin, end in ends.reshape(-1, 2).tolist():
        near = np.clip(points[begin:end], -2.0 * HEIGHT, 2.0 * WIDTH)
        words.append("M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in near[simplified(near, SEEN)].tolist()))
    return "".join(words)


def _bars(bars: Bars) -> str:
    """The longest bar first."""
    order = sorted(bars.values, key=lambda name: -max(map(abs, bars.values[name])))
    limits = bars.x_range or extent([*bars.values.values(), [0.0]], False, 0.0)
    left = min(0.62 * NARROW, 14.0 + LETTER * max(map(len, order), default=0))
    fits = int((left - 14.0) / LETTER)
    to_x = _scale(limits, left, NARROW - RIGHT, False)
    row = 24.0
    height = TOP + row * len(order) + BOTTOM
    parts = []
    for v in ticks(*limits, 4):
        at = float(to_x(v))
        parts.append(f'<path class="axis" d="M{at:.1f} {TOP}V{height - BOTTOM}"/>')
        parts.append(f'<text class="tick" x="{at:.1f}" y="{height - BOTTOM + 14}">{_shown(v)}</text>')
    for k, name in enumerate(order):
        top = TOP + row * k
        parts.append(f'<text class="tick end" x="{left - 6:.1f}" y="{top + 15:.1f}">{escape(_cut(name, fits))}</text>')
        thick = 16.0 / len(bars.values[name])
        for n, value in enumerate(bars.values[name]):
            cut = bars.limit is not None and value > limits[1]  # its length would flatten all others
            a, b = sorted((float(to_x(0.0)), float(to_x(limits[1] if cut else value))))
            colour = "warning" if bars.limit is not None and value > bars.limit else ("first", "second")[n % 2]
            box = f'x="{a:.1f}" y="{top + 4 + n * thick:.1f}" width="{b - a:.1f}" height="{thick - 1:.1f}"'
            parts.append(f'<rect {box} fill="var(--{colour})"><title>{escape(name)}: {_shown(value)}</title></rect>')
            if cut:
                end = f'x="{b - 6:.1f}" y="{top + 15:.1f}"'
                parts.append(f'<text class="tick end" {end} style="fill: var(--surface)">{value:.4g} →</text>')
    if bars.limit is not None:
        end = f"{float(to_x(bars.limit)):.1f}"
        parts.append(f'<path d="M{end} {TOP}V{height - BOTTOM}" stroke="var(--text)" stroke-dasharray="4 3"/>')
    parts.append(f'<text class="tick end" x="{NARROW - RIGHT}" y="{height - 4:g}">{escape(bars.label)}</text>')
    return _svg(bars.title, height, parts, NARROW)


def _cut(name: str, letters: int) -> str:
    """A name of so many letters at most; the bar beside it has all of it."""
    return name if len(name) <= letters else f"{name[: letters - 1]}…"


def _histogram(chart: Histogram) -> str:
    """Bars of equal width, and lines at the quantiles."""
    values = np.asarray(chart.values, float)
    counts, edges = np.histogram(values, bins=min(60, max(5, round(len(values) ** 0.5))))
    x, y = (float(edges[0]), float(edges[-1])), (0.0, 1.05 * float(counts.max()) or 1.0)
    to_x, to_y = _scale(x, LEFT, NARROW - RIGHT, False), _scale(y, HEIGHT - BOTTOM, TOP, False)
    parts = [_frame(Panel("", chart.label, "runs", ()), x, y, to_x, to_y, False, NARROW)]
    for count, (a, b) in zip(counts.tolist(), pairwise(to_x(edges).tolist()), strict=True):
        at = float(to_y(count))
        box = f'x="{a:.1f}" y="{at:.1f}" width="{max(0.5, b - a - 0.7):.1f}" height="{HEIGHT - BOTTOM - at:.1f}"'
        parts.append(f'<rect {box} fill="var(--first)"/>')
    for quantile in chart.quantiles:
        value = float(np.quantile(values, quantile))
        line = f'd="M{float(to_x(value)):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="var(--second)" stroke-width="1.5"'
        parts.append(f"<path {line}><title>{100 * quantile:g} %: {_shown(value)}</title></path>")
    return _svg(chart.title, HEIGHT, parts, NARROW)


def _contacts(chart: Contacts) -> str:
    """Stuck: full height; forward: the upper half; backward: the lower half."""
    row, bar = 34.0, 14.0
    width = WIDTH - LEFT - RIGHT
    parts = []
    for k, (label, modes) in enumerate(chart.modes.items()):
        m = np.asarray(modes)[:-1]
        top = row * k + 18.0
        edges = np.concatenate([[0], np.flatnonzero(np.diff(m)) + 1, [len(m)]])
        share = f"{label}: stuck {part_of_whole(float(np.mean(m == 0)))}"
        parts.append(f'<text class="tick start" x="{LEFT}" y="{top - 4}">{escape(share)}</text>')
        boxes: dict[int, list[str]] = {-1: [], 0: [], 1: []}
        for a, b in pairwise(edges.tolist()):
            mode = int(m[a])
            y = top + (bar / 2.0 if mode < 0 else 0.0)
            begin, length = LEFT + width * a / len(m), max(0.3, width * (b - a) / len(m))
            boxes[mode].append(f"M{begin:.1f} {y:g}h{length:.1f}v{bar if mode == 0 else bar / 2:g}h{-length:.1f}z")
        parts += [
            f'<path fill="var(--{"slips" if mode else "stuck"})" d="{"".join(d)}"/>' for mode, d in boxes.items() if d
        ]
    return _svg(chart.title, row * len(chart.modes) + 4.0, parts)
