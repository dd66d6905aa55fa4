"""Schematics as data: boxes, lines, arrows and texts, drawn as SVG for pages and by matplotlib for pictures."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

from ..reports.looks import COLOURS, INK, SMALLEST

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SCALE = 40.0  # pixels of a unit
SYMBOLS = {"eta": "η", "varphi": "φ", "omega": "ω", "Delta": "Δ", "dot": "", ",": " "}
Point = tuple[float, float]


@dataclass
class Sketch:
    """A drawing of a width and half a height, whose middle line is at 0."""

    title: str
    width: float
    half_height: float
    boxes: list[tuple[float, float, float, float, str]] = field(default_factory=list)
    """left, lower, width, height, name of a colour of the style sheet"""
    lines: list[tuple[list[Point], float]] = field(default_factory=list)
    arrows: list[tuple[Point, Point]] = field(default_factory=list)
    texts: list[tuple[Point, str]] = field(default_factory=list)

    def text(self, x: float, y: float, text: str) -> None:
        """A text about a point."""
        if text:
            self.texts.append(((x, y), text))

    def line(self, x: Sequence[float], y: Sequence[float], linewidth: float = 1.2) -> None:
        """A line through points."""
        self.lines.append(([(float(a), float(b)) for a, b in zip(x, y, strict=True)], linewidth))

    def on(self, axes: Axes) -> None:
        """Draws on axes of matplotlib."""
        from matplotlib.patches import Rectangle

        axes.set(xlim=(0.0, self.width), ylim=(-self.half_height, self.half_height), aspect="equal")
        axes.set_axis_off()
        axes.set_title(self.title, loc="left")
        for left, lower, width, height, fill in self.boxes:
            box: Any = {"facecolor": COLOURS[fill], "edgecolor": INK, "linewidth": 1.0, "zorder": 2}
            axes.add_patch(Rectangle((left, lower), width, height, **box))
        for points, linewidth in self.lines:
            axes.plot(*zip(*points, strict=True), color=INK, zorder=1, linewidth=linewidth)
        for begin, end in self.arrows:
            axes.annotate("", end, begin, arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.0})
        for (x, y), text in self.texts:
            axes.text(x, y, text, ha="center", va="center", fontsize=SMALLEST, zorder=3)

    def svg(self) -> str:
        """Sketch as SVG, in the colours of the page."""
        parts = []
        for points, linewidth in self.lines:
            path = "L".join(f"{a:.1f} {b:.1f}" for a, b in map(self._place, points))
            parts.append(f'<path fill="none" stroke="var(--text)" stroke-width="{1.1 * linewidth:.1f}" d="M{path}"/>')
        for begin, end in self.arrows:
            parts.append(self._arrow(self._place(begin), self._place(end)))
        for left, lower, width, height, fill in self.boxes:
            a, b = self._place((left, lower + height))
            box = f'x="{a:.1f}" y="{b:.1f}" width="{SCALE * width:.1f}" height="{SCALE * height:.1f}"'
            parts.append(f'<rect {box} fill="var(--{fill})" stroke="var(--edge)"/>')
        parts += [self._text(point, text) for point, text in self.texts]
        size = f"{SCALE * self.width:g} {2.0 * SCALE * self.half_height:g}"
        return f'<svg role="img" aria-label="{escape(self.title)}" viewBox="0 0 {size}">{"".join(parts)}</svg>'

    def _place(self, point: Point) -> Point:
        return SCALE * point[0], SCALE * (self.half_height - point[1])

    @staticmethod
    def _arrow(begin: Point, end: Point) -> str:
        """Level arrows only."""
        way = 1.0 if end[0] > begin[0] else -1.0
        x, y = end
        head = f"M{x:.1f} {y:.1f}l{-8 * way:g} -4v8z"
        return f'<path stroke="var(--text)" fill="var(--text)" d="M{begin[0]:.1f} {y:.1f}H{x - 7 * way:.1f}{head}"/>'

    def _text(self, point: Point, text: str) -> str:
        x, y = self._place(point)
        rows = text.split("\n")
        first = y + 4.5 - 8.0 * (len(rows) - 1)
        lines = [f'<tspan x="{x:.1f}" y="{first + 16.0 * k:.1f}">{_written(row)}</tspan>' for k, row in enumerate(rows)]
        return f"<text>{''.join(lines)}</text>"


def _written(text: str) -> str:
    """TeX of the few kinds that schematics have, as SVG with lower and raised parts."""
    text = re.sub(r"\\dot\\varphi", "φ̇", text.replace("$", ""))
    text = re.sub(r"\\([A-Za-z]+|,)", lambda found: SYMBOLS[found.group(1)], text)
    parts = re.split(r"([_^](?:\{[^}]*\}|.))", escape(text))
    out = []
    for part in parts:
        if part[:1] in ("_", "^"):
            shift = 4 if part[0] == "_" else -5
            inner = part[1:].strip("{}")
            out.append(f'<tspan dy="{shift}" font-size="10">{inner}</tspan><tspan dy="{-shift}">\u200b</tspan>')
        else:
            out.append(part)
    return "".join(out)
