"""The schematics of the paper, its figures 1 to 4 and 6: SVG files, which pages include and matplotlib draws as pictures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from ..reports.figure_style import COLOURS, INK, SMALLEST
from ..reports.panels import Drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = sorted((Path(__file__).parent / "drawings").glob("*.svg"))
XMLNS = ' xmlns="http://www.w3.org/2000/svg"'  # which a page does not need
SCRIPTS = {"4": "_", "-5": "^"}  # vertical shifts of lower and raised parts of a text, and their signs in TeX


def drawings() -> tuple[Drawing, ...]:
    """The five schematics, the first across the page."""
    texts = [path.read_text(encoding="utf-8").replace(XMLNS, "").replace("\n", "") for path in FILES]
    titles = [re.findall('aria-label="(.*?)"', text)[0] for text in texts]
    return tuple(Drawing(title, svg, k == 0) for k, (title, svg) in enumerate(zip(titles, texts, strict=True)))


def draw() -> Figure:
    """The five schematics, each in its own axes."""
    from ..reports import plots

    figure = plots.Picture(figsize=(10.0, 6.9), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(1.25, 1.0, 1.0))
    places = (grid[0, :], grid[1, 0], grid[1, 1], grid[2, 0], grid[2, 1])
    for drawing, place in zip(drawings(), places, strict=True):
        _draw(figure.add_subplot(place), drawing)
    return figure


def _draw(axes: Any, drawing: Drawing) -> None:
    """The rectangles, paths of M, L, H, l, v and z, and texts of a schematic."""
    from matplotlib.patches import Rectangle

    root = ElementTree.fromstring(drawing.svg)
    _, _, width, height = map(float, root.get("viewBox", "").split())
    axes.set(xlim=(0.0, width), ylim=(height, 0.0), aspect="equal")
    axes.set_axis_off()
    axes.set_title(drawing.title, loc="left")
    for one in root:
        if one.tag == "rect":
            left, top, wide, high = (float(one.get(key, "")) for key in ("x", "y", "width", "height"))
            fill = COLOURS[one.get("fill", "").removeprefix("var(--").removesuffix(")")]
            axes.add_patch(Rectangle((left, top), wide, high, facecolor=fill, edgecolor=INK, zorder=2))
        elif one.tag == "path":
            for part in one.get("d", "").removeprefix("M").split("M"):
                x, y = zip(*_points(part), strict=True)
                linewidth = float(one.get("stroke-width", "1")) / 1.1
                axes.fill(x, y, color=INK) if part.endswith("z") else axes.plot(x, y, color=INK, linewidth=linewidth)
        else:
            rows = ["".join([row.text or "", *map(_script, row)]) for row in one]
            middle = sum(float(row.get("y", "")) for row in one) / len(rows) - 4.5
            axes.text(
                float(one[0].get("x", "")),
                middle,
                "\n".join(rows),
                ha="center",
                va="center",
                fontsize=SMALLEST,
                zorder=3,
            )


def _points(path: str) -> list[tuple[float, float]]:
    points: list[tuple[float, float]] = []
    for command, text in re.findall("([LHlv]|^)([^LHlvz]*)", path):
        x, y = points[-1] if points else (0.0, 0.0)
        numbers = [float(word) for word in text.split()]
        match command:
            case "H":
                points.append((numbers[0], y))
            case "v":
                points.append((x, y + numbers[0]))
            case "l":
                points.append((x + numbers[0], y + numbers[1]))
            case _:
                points.append((numbers[0], numbers[1]))
    return points


def _script(part: ElementTree.Element) -> str:
    """A lower or raised part of a text in TeX, and what follows it."""
    sign = SCRIPTS.get(part.get("dy", ""))
    return (f"${sign}{{{part.text}}}$" if sign else "") + (part.tail or "")
