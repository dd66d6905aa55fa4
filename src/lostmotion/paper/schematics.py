"""The schematics of the paper, its figures 1 to 4 and 6."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .sketch import Sketch

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILL, GEAR = "metal", "gear"  # colours of the style sheet
SHAFT = 0.0  # height of the shafts


def sketches() -> list[Sketch]:
    """The five schematics."""
    first = Sketch("Figure 1. Comparison of the models", 24.0, 3.1)
    _comparison(first)
    titles = {
        "Figure 2. Parameters of the drive": _general,
        "Figure 3. 2-DOF-L": _two_degrees,
        "Figure 4. 1-DOF-L": _one_degree,
        "Figure 6. Measurement of a gearbox": _rig,
    }
    others = [Sketch(title, 12.0, 2.0) for title in titles]
    for sketch, fill in zip(others, titles.values(), strict=True):
        fill(sketch)
    return [first, *others]


def draw() -> Figure:
    """The five schematics, each in its own axes."""
    from ..reports import plots

    figure = plots.Picture(figsize=(10.0, 6.9), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(1.25, 1.0, 1.0))
    places = (grid[0, :], grid[1, 0], grid[1, 1], grid[2, 0], grid[2, 1])
    for sketch, place in zip(sketches(), places, strict=True):
        sketch.on(figure.add_subplot(place))
    return figure


def _box(
    s: Sketch, x: float, text: str, y: float = SHAFT, size: tuple[float, float] = (2.0, 1.6), fill: str = FILL
) -> None:
    """A box around a point."""
    width, height = size
    s.boxes.append((x - 0.5 * width, y - 0.5 * height, width, height, fill))
    s.text(x, y, text)


def _shaft(s: Sketch, begin: float, end: float) -> None:
    s.line([begin, end], [SHAFT, SHAFT], linewidth=2.4)


def _arrow(s: Sketch, begin: tuple[float, float], end: tuple[float, float], text: str = "", above: float = 0.4) -> None:
    s.arrows.append((begin, end))
    s.text(0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]) + above, text)


def _bearing(s: Sketch, x: float, text: str) -> None:
    """Friction of a shaft on the frame: two hatched pads."""
    for side in (1.0, -1.0):
        y = SHAFT + 0.22 * side
        s.line([x - 0.4, x + 0.4], [y, y], linewidth=1.0)
        for start in np.linspace(x - 0.4, x + 0.25, 4):
            s.line([start, start + 0.18], [y, y + 0.26 * side], linewidth=0.7)
    s.text(x, SHAFT - 0.95, text)


def _spring(s: Sketch, begin: float, end: float, text: str) -> None:
    inner = np.linspace(begin + 0.15, end - 0.15, 11)
    x: Sequence[float] = np.concatenate([[begin], inner, [end]]).tolist()
    y: Sequence[float] = (SHAFT + np.concatenate([[0.0, 0.0], np.tile([0.35, -0.35], 5)[:9], [0.0, 0.0]])).tolist()
    s.line(x, y)
    s.text(0.5 * (begin + end), SHAFT + 0.85, text)


def _comparison(s: Sketch) -> None:
    """Each model of the gearbox between a motor and a load of the same data."""
    s.text(0.6, 0.4, "$E_C$")
    _arrow(s, (0.0, 0.0), (1.2, 0.0))
    _box(s, 2.5, "servo\namplifier\n$K_A$", size=(2.6, 2.0))
    s.line([3.8, 5.0], [0.0, 0.0])
    s.text(4.4, 0.4, "$E_Z$")
    models = (
        "1-DOF-L\nrigid, $\\eta_C$",
        "2-DOF-L\n$k_{20}$, $\\eta_C$",
        "2-DOF-NL\n$k_2(\\Delta\\varphi_2)$, $\\eta_H$, $m_{2B}$",
    )
    for text, y in zip(models, (2.1, 0.0, -2.1), strict=True):
        s.line([5.0, 5.0], [0.0, y])
        _arrow(s, (5.0, y), (6.0, y))
        _box(s, 7.2, "DC motor\n(2)", y, (2.4, 1.5))
        _arrow(s, (8.4, y), (9.9, y), "$M_D$")
        _box(s, 11.9, text, y, (4.0, 1.5), GEAR)
        _arrow(s, (13.9, y), (15.4, y), "$T_2$")
        _box(s, 16.7, "load\n$J_Z$, $b_{ZR}$", y, (2.6, 1.5))
        _arrow(s, (18.0, y), (19.6, y), "$\\omega$")
        s.line([19.6, 19.6], [0.0, y])
    _arrow(s, (19.6, 0.0), (20.6, 0.0))
    _box(s, 22.2, "compared:\n$\\omega$, $t_2$, $\\eta$,\n$g(f)$, $\\varphi(f)$", size=(3.2, 2.2))


def _general(s: Sketch) -> None:
    """Equations (3) and (4)."""
    _shaft(s, 1.2, 10.8)
    _arrow(s, (0.1, 1.25), (1.9, 1.25), "$M_D$, $\\dot\\varphi_M$")
    _box(s, 1.2, "$J_{MR}$", size=(1.2, 1.8))
    _bearing(s, 2.9, "$b_{MR}$, $T_{10}$")
    _box(s, 5.9, "gearbox\n$i_C$", size=(2.2, 1.9), fill=GEAR)
    s.text(4.3, 0.5, "$T_1$")
    s.text(7.5, 0.5, "$T_2$")
    s.text(5.9, -1.6, "$\\Delta\\varphi_2 = \\varphi_M/i_C - \\varphi$")
    _bearing(s, 8.9, "$b_{ZR}$")
    _box(s, 10.8, "$J_Z$", size=(1.2, 1.8))
    _arrow(s, (11.9, 1.25), (10.1, 1.25), "$M_Z$, $\\dot\\varphi$")


def _two_degrees(s: Sketch) -> None:
    """Equations (5) and (6): a constant efficiency and one spring."""
    _shaft(s, 1.2, 6.3)
    _shaft(s, 8.3, 10.8)
    _box(s, 1.2, "$J_{MR}$", size=(1.2, 1.8))
    _bearing(s, 2.9, "$b_{MR}$, $T_{10}$")
    _box(s, 5.1, "$i_C$, $\\eta_C$", size=(1.8, 1.4), fill=GEAR)
    _spring(s, 6.3, 8.3, "$k_{20} = 0.65\\,k_{2max}$")
    _bearing(s, 9.3, "$b_{ZR}$")
    _box(s, 10.8, "$J_Z$", size=(1.2, 1.8))
    s.text(6.0, -1.7, "$T_2 = k_{20}\\,\\Delta\\varphi_2$,  $T_1 = T_2/(i_C\\,\\eta_C)$")


def _one_degree(s: Sketch) -> None:
    """Equations (7) and (8): the load on the input shaft."""
    _shaft(s, 1.2, 10.8)
    _box(s, 1.2, "$J_{MR}$", size=(1.2, 1.8))
    _bearing(s, 2.9, "$b_{MR}$, $T_{10}$")
    _box(s, 5.9, "$i_C$, $\\eta_C$\nrigid", size=(2.2, 1.6), fill=GEAR)
    _bearing(s, 8.9, "$b_{ZR}$")
    _box(s, 10.8, "$J_Z$", size=(1.2, 1.8))
    text = "$\\varphi = \\varphi_M/i_C$,  $J_{RC} = J_{MR} + J_Z/(i_C^2\\,\\eta_C) = j_{RC}\\,J_M$"
    s.text(6.0, -1.7, text)


def _rig(s: Sketch) -> None:
    """Steady speed, torques measured on both sides."""
    _shaft(s, 1.1, 10.9)
    _box(s, 1.1, "motor\n$n_1$", size=(1.8, 1.8))
    _box(s, 3.5, "$T_1$, $\\omega_1$", size=(1.5, 1.0), fill="surface")
    _box(s, 6.0, "gearbox\n$i_C$", size=(2.0, 1.9), fill=GEAR)
    _box(s, 8.5, "$T_2$, $\\omega_2$", size=(1.5, 1.0), fill="surface")
    _box(s, 10.9, "brake", size=(1.8, 1.8))
    text = "$\\eta = T_2/(i_C\\,T_1)$,  $m_{2B} = (i_C\\,T_1 - T_2)/T_{2R}$"
    s.text(6.0, -1.7, text)
