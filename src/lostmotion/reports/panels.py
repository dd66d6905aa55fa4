"""Content of a figure before it is drawn. Pages carry it as data (`packed`, `svg_charts`); `plots` draws them as pictures."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .contours import Contour, contours


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
    names: tuple[str, ...] = ()  # of the points, shown on demand
    numbered: bool = False  # the points have numbers, and a key lists their names

    @property
    def shown(self) -> str:
        return self.label if self.legend is None else self.legend


@dataclass(frozen=True)
class Mark:
    """A point of a panel that is named, with a line from it to another y."""

    x: float
    y: float
    text: str
    style: Mapping[str, Any]
    to: float | None = None


@dataclass(frozen=True)
class Ground:
    """A quantity over the whole panel, the darker the higher."""

    x: Any
    y: Any
    values: Any  # [y, x]; NaN where there is none
    label: str


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
    marks: tuple[Mark, ...] = ()
    level: float | None = None  # y of a line across the panel
    ground: Ground | None = None
    x_names: tuple[str, ...] = ()  # of the values 0, 1, 2, ... of x
    max_points: int = 4_000  # of a curve on a page; longer ones as the extremes of their neighbours

    @property
    def whole_x(self) -> bool:
        """Whether x is the number of a log, which has no halves."""
        return self.x_label == "log"

    def contours(self) -> list[Contour]:
        """Contours of the map."""
        if (g := self.ground) is None:
            return []
        return contours(g.x, g.y, g.values, log_x=self.log_x, log_y=self.log_y, degrees="[deg" in g.label)


@dataclass(frozen=True)
class Bars:
    """Horizontal bars by name, of one or two values each."""

    title: str
    label: str  # label of the values
    values: Mapping[str, tuple[float, ...]]
    series: tuple[str, ...] = ()  # names of the values of a bar, where there are two
    x_range: tuple[float, float] | None = None
    limit: float | None = None  # beyond which a bar stands out


@dataclass(frozen=True)
class Histogram:
    """Histogram of a quantity."""

    title: str
    label: str
    values: Any
    quantiles: tuple[float, ...] = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Matrix:
    """Numbers from -1 to 1 of pairs of names."""

    title: str
    names: tuple[str, ...]
    values: Any


@dataclass(frozen=True)
class Contacts:
    """Stuck contacts, and the direction of slipping ones: -1, 0, +1 at equidistant instants."""

    title: str
    time: Any
    modes: Mapping[str, Any]


def shown_energies(energies: Mapping[str, float]) -> dict[str, float]:
    """Entries of a ledger that are not 0, in words, without its residual and the energy that was turned over."""
    apart = ("residual", "turned_over")
    return {name.replace("_", " "): e for name, e in energies.items() if e and name not in apart}


@dataclass(frozen=True)
class Flows:
    """Energy flows of a run [J]: sources and sinks of the ledger."""

    title: str
    energies: Mapping[str, float]

    @property
    def shown(self) -> dict[str, float]:
        """Sources and sinks that take part, in words."""
        return shown_energies(self.energies)


@dataclass(frozen=True)
class Drawing:
    """A drawing as SVG, without data."""

    title: str
    svg: str
    wide: bool = False


Chart = Panel | Bars | Histogram | Matrix | Contacts | Flows | Drawing


@dataclass(frozen=True)
class Group:
    """Charts that belong together; `--figures` draws them as one picture of this name."""

    name: str
    title: str
    caption: str
    charts: tuple[Chart, ...]
    columns: int = 2
