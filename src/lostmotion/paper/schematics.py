"""The schematics of the paper, its figures 1 to 4 and 6, as one drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#1c1c1c"
FILL = "#e8eef3"
GEAR = "#f7e4d2"
SHAFT = 0.0  # height of the shafts


def draw() -> Figure:
    """The five schematics, each in its own axes."""
    from ..reports import plots

    figure = plots.Picture(figsize=(10.0, 6.9), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(1.25, 1.0, 1.0))
    _comparison(_axes(figure, grid[0, :], "Figure 1. Comparison of the models", 24.0, 3.1))
    _general(_axes(figure, grid[1, 0], "Figure 2. Parameters of the drive", 12.0, 2.0))
    _two_degrees(_axes(figure, grid[1, 1], "Figure 3. 2-DOF-L", 12.0, 2.0))
    _one_degree(_axes(figure, grid[2, 0], "Figure 4. 1-DOF-L", 12.0, 2.0))
    _rig(_axes(figure, grid[2, 1], "Figure 6. Measurement of a gearbox", 12.0, 2.0))
    return figure


def _axes(figure: Figure, place: Any, title: str, width: float, half_height: float) -> Axes:
    axes = figure.add_subplot(place)
    axes.set(xlim=(0.0, width), ylim=(-half_height, half_height), aspect="equal")
    axes.set_axis_off()
    axes.set_title(title, loc="left", fontsize=9.5)
    return axes


def _box(
    axes: Axes, x: float, text: str, y: float = SHAFT, size: tuple[float, float] = (2.0, 1.6), fill: str = FILL
) -> None:
    """A box around a point."""
    from matplotlib.patches import Rectangle

    width, height = size
    corner = (x - 0.5 * width, y - 0.5 * height)
    axes.add_patch(Rectangle(corner, width, height, facecolor=fill, edgecolor=INK, linewidth=1.0, zorder=2))
    axes.text(x, y, text, ha="center", va="center", fontsize=8, zorder=3)


def _line(axes: Axes, x: Any, y: Any, linewidth: float = 1.2) -> None:
    axes.plot(x, y, color=INK, zorder=1, linewidth=linewidth)


def _shaft(axes: Axes, begin: float, end: float) -> None:
    _line(axes, [begin, end], [SHAFT, SHAFT], linewidth=2.4)


def _arrow(
    axes: Axes, begin: tuple[float, float], end: tuple[float, float], text: str = "", above: float = 0.4
) -> None:
    axes.annotate("", end, begin, arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.0})
    middle = 0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]) + above
    axes.text(*middle, text, ha="center", va="center", fontsize=8)


def _bearing(axes: Axes, x: float, text: str) -> None:
    """Friction of a shaft on the frame: two hatched pads."""
    for side in (1.0, -1.0):
        y = SHAFT + 0.22 * side
        _line(axes, [x - 0.4, x + 0.4], [y, y], linewidth=1.0)
        for start in np.linspace(x - 0.4, x + 0.25, 4):
            _line(axes, [start, start + 0.18], [y, y + 0.26 * side], linewidth=0.7)
    axes.text(x, SHAFT - 0.95, text, ha="center", va="center", fontsize=8)


def _spring(axes: Axes, begin: float, end: float, text: str) -> None:
    inner = np.linspace(begin + 0.15, end - 0.15, 11)
    x = np.concatenate([[begin], inner, [end]])
    y = SHAFT + np.concatenate([[0.0, 0.0], np.tile([0.35, -0.35], 5)[:9], [0.0, 0.0]])
    _line(axes, x, y)
    axes.text(0.5 * (begin + end), SHAFT + 0.85, text, ha="center", va="center", fontsize=8)


def _comparison(axes: Axes) -> None:
    """Each model of the gearbox between a motor and a load of the same data."""
    axes.text(0.6, 0.4, "$E_C$", ha="center", va="center", fontsize=8)
    _arrow(axes, (0.0, 0.0), (1.2, 0.0))
    _box(axes, 2.5, "servo\namplifier\n$K_A$", size=(2.6, 2.0))
    _line(axes, [3.8, 5.0], [0.0, 0.0])
    axes.text(4.4, 0.4, "$E_Z$", ha="center", va="center", fontsize=8)
    models = (
        "1-DOF-L\nrigid, $\\eta_C$",
        "2-DOF-L\n$k_{20}$, $\\eta_C$",
        "2-DOF-NL\n$k_2(\\Delta\\varphi_2)$, $\\eta_H$, $m_{2B}$",
    )
    for text, y in zip(models, (2.1, 0.0, -2.1), strict=True):
        _line(axes, [5.0, 5.0], [0.0, y])
        _arrow(axes, (5.0, y), (6.0, y))
        _box(axes, 7.2, "DC motor\n(2)", y, (2.4, 1.5))
        _arrow(axes, (8.4, y), (9.9, y), "$M_D$")
        _box(axes, 11.9, text, y, (4.0, 1.5), GEAR)
        _arrow(axes, (13.9, y), (15.4, y), "$T_2$")
        _box(axes, 16.7, "load\n$J_Z$, $b_{ZR}$", y, (2.6, 1.5))
        _arrow(axes, (18.0, y), (19.6, y), "$\\omega$")
        _line(axes, [19.6, 19.6], [0.0, y])
    _arrow(axes, (19.6, 0.0), (20.6, 0.0))
    _box(axes, 22.2, "compared:\n$\\omega$, $t_2$, $\\eta$,\n$g(f)$, $\\varphi(f)$", size=(3.2, 2.2))


def _general(axes: Axes) -> None:
    """Equations (3) and (4)."""
    _shaft(axes, 1.2, 10.8)
    _arrow(axes, (0.1, 1.25), (1.9, 1.25), "$M_D$, $\\dot\\varphi_M$")
    _box(axes, 1.2, "$J_{MR}$", size=(1.2, 1.8))
    _bearing(axes, 2.9, "$b_{MR}$, $T_{10}$")
    _box(axes, 5.9, "gearbox\n$i_C$", size=(2.2, 1.9), fill=GEAR)
    axes.text(4.3, 0.5, "$T_1$", ha="center", va="center", fontsize=8)
    axes.text(7.5, 0.5, "$T_2$", ha="center", va="center", fontsize=8)
    axes.text(5.9, -1.6, "$\\Delta\\varphi_2 = \\varphi_M/i_C - \\varphi$", ha="center", va="center", fontsize=8)
    _bearing(axes, 8.9, "$b_{ZR}$")
    _box(axes, 10.8, "$J_Z$", size=(1.2, 1.8))
    _arrow(axes, (11.9, 1.25), (10.1, 1.25), "$M_Z$, $\\dot\\varphi$")


def _two_degrees(axes: Axes) -> None:
    """Equations (5) and (6): a constant efficiency and one spring."""
    _shaft(axes, 1.2, 6.3)
    _shaft(axes, 8.3, 10.8)
    _box(axes, 1.2, "$J_{MR}$", size=(1.2, 1.8))
    _bearing(axes, 2.9, "$b_{MR}$, $T_{10}$")
    _box(axes, 5.1, "$i_C$, $\\eta_C$", size=(1.8, 1.4), fill=GEAR)
    _spring(axes, 6.3, 8.3, "$k_{20} = 0.65\\,k_{2max}$")
    _bearing(axes, 9.3, "$b_{ZR}$")
    _box(axes, 10.8, "$J_Z$", size=(1.2, 1.8))
    axes.text(
        6.0,
        -1.7,
        "$T_2 = k_{20}\\,\\Delta\\varphi_2$,  $T_1 = T_2/(i_C\\,\\eta_C)$",
        ha="center",
        va="center",
        fontsize=8,
    )


def _one_degree(axes: Axes) -> None:
    """Equations (7) and (8): the load on the input shaft."""
    _shaft(axes, 1.2, 10.8)
    _box(axes, 1.2, "$J_{MR}$", size=(1.2, 1.8))
    _bearing(axes, 2.9, "$b_{MR}$, $T_{10}$")
    _box(axes, 5.9, "$i_C$, $\\eta_C$\nrigid", size=(2.2, 1.6), fill=GEAR)
    _bearing(axes, 8.9, "$b_{ZR}$")
    _box(axes, 10.8, "$J_Z$", size=(1.2, 1.8))
    text = "$\\varphi = \\varphi_M/i_C$,  $J_{RC} = J_{MR} + J_Z/(i_C^2\\,\\eta_C) = j_{RC}\\,J_M$"
    axes.text(6.0, -1.7, text, ha="center", va="center", fontsize=8)


def _rig(axes: Axes) -> None:
    """Steady speed, torques measured on both sides."""
    _shaft(axes, 1.1, 10.9)
    _box(axes, 1.1, "motor\n$n_1$", size=(1.8, 1.8))
    _box(axes, 3.5, "$T_1$, $\\omega_1$", size=(1.5, 1.0), fill="white")
    _box(axes, 6.0, "gearbox\n$i_C$", size=(2.0, 1.9), fill=GEAR)
    _box(axes, 8.5, "$T_2$, $\\omega_2$", size=(1.5, 1.0), fill="white")
    _box(axes, 10.9, "brake", size=(1.8, 1.8))
    text = "$\\eta = T_2/(i_C\\,T_1)$,  $m_{2B} = (i_C\\,T_1 - T_2)/T_{2R}$"
    axes.text(6.0, -1.7, text, ha="center", va="center", fontsize=8)
