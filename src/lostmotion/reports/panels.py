"""What a figure shows, before it is drawn: curves and panels. Drawing them is up to `plots`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..simulation.variables import VARIABLES

# Dark to light as nonlinear to simple, so that they differ in grey too.
STYLES: dict[str, dict[str, Any]] = {
    "2-DOF-NL": {"color": "#0b3c5d", "linestyle": "-", "linewidth": 1.7},
    "2-DOF-L": {"color": "#d9730d", "linestyle": "--", "linewidth": 1.3},
    "1-DOF-L": {"color": "#7fae3f", "linestyle": "-.", "linewidth": 1.3},
}
COMMAND_STYLE: dict[str, Any] = {"color": "0.45", "linestyle": ":", "linewidth": 1.3}

LABELS = {v.name: v for v in VARIABLES}


def scientific(value: float) -> str:
    """Two digits and a power of ten, as text."""
    if value <= 0.0:
        return "0"
    exponent = math.floor(math.log10(value))
    return f"{value / 10.0**exponent:.1f}·10^{exponent}"


@dataclass(frozen=True)
class Curve:
    """One line of a figure, with the names its data get in the figure's CSV."""

    label: str
    x: Any
    y: Any
    style: Mapping[str, Any]
    legend: str | None = None  # in the figure, if not the label; "_": none

    @property
    def shown(self) -> str:
        return self.label if self.legend is None else self.legend


@dataclass(frozen=True)
class Panel:
    """One pair of axes."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    log_x: bool = False
    log_y: bool = False
    shaded: tuple[tuple[float, float], ...] = ()  # intervals of x
