"""Pieces of the set of states at the start of a slip, over which the state is an affine function.

A start has two unknowns: the angle ``x`` within the encoder step, and the torque ``w`` as a share of its rise over the
sample time. A piece is a trapezium of the (w, x) plane: a strip of ``w`` between two straight lines of ``x``. The state
is ``centre + slope w``, its angle also ``+ x``, up to ``radius``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .state_boxes import Boxes
from .state_sets import Sets

ROUNDING = 1e-9  # of an encoder step, and of torque and speed, by which pieces overlap


@dataclass
class Pieces(Sets):
    """Pieces of the states of slips, all after the same number of samples."""

    slope: np.ndarray  # change of the state with w, (piece, state)
    radius: np.ndarray  # bound of the deviation from the affine function
    strip: np.ndarray  # least and largest w, (piece, 2)
    below: np.ndarray  # least x at both values of w
    above: np.ndarray  # largest x at both values of w

    def ends(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values of an output that does not depend on x at both values of w, (piece, 2), and the radius."""
        values = (self.centre @ row)[:, None] + (self.slope @ row)[:, None] * self.strip
        return values, self.radius @ np.abs(row), np.maximum(*np.abs(values.T))

    def range_of(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest values of such an output."""
        values, radius, size = self.ends(row)
        radius = radius + ROUNDING * size
        return np.minimum(*values.T) - radius, np.maximum(*values.T) + radius

    def angles(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest angles of the contact's shaft."""
        values = self.centre[:, :1] + self.slope[:, :1] * self.strip
        least, most = np.minimum(*(values + self.below).T), np.maximum(*(values + self.above).T)
        return least - self.radius[:, 0], most + self.radius[:, 0]

    def boxes(self) -> Boxes:
        """Boxes around the pieces. The unknowns of a box are x, w, and one for each entry of the radius."""
        middle, half = self.strip.mean(axis=1), 0.5 * (self.strip[:, 1] - self.strip[:, 0])
        centre = self.centre + self.slope * middle[:, None]
        low, high = np.minimum(*self.below.T), np.maximum(*self.above.T)
        out = Boxes.around(centre - self.radius, centre + self.radius, self.came, self.read)
        out.centre[:, 0] += 0.5 * (low + high)
        out.spread[:, 0, 0], out.spread[:, :, 1] = 0.5 * (high - low), self.slope * half[:, None]
        out.mode = self.mode.copy()
        return out

    def moved(self, matrix: np.ndarray, add: np.ndarray | None = None) -> Pieces:
        """Pieces after a linear map of the state. Strips and lines are shared with the pieces before."""
        centre, slope = self.centre @ matrix.T, self.slope @ matrix.T
        radius = self.radius @ np.abs(matrix).T if self.radius.any() else self.radius
        return replace(self, centre=centre if add is None else centre + add, slope=slope, radius=radius)

    def widen(self, state: int, low: np.ndarray, high: np.ndarray) -> None:
        """Add an unknown between two values to a state."""
        self.centre[:, state] += 0.5 * (low + high)
        self.radius[:, state] += 0.5 * (high - low)

    def between(self, low: np.ndarray, high: np.ndarray) -> Pieces:
        """The parts with w between two values; empty ones are left out."""
        low, high = np.maximum(low, self.strip[:, 0]), np.minimum(high, self.strip[:, 1])
        kept = np.flatnonzero(low <= high)
        out = self.take(kept)
        width = self.strip[kept, 1] - self.strip[kept, 0]
        strip = np.stack([low[kept], high[kept]], axis=1)
        share = np.where(
            width[:, None] > 0.0, (strip - self.strip[kept, :1]) / np.where(width > 0.0, width, 1.0)[:, None], 0.0
        )
        for name in ("below", "above"):
            ends = getattr(self, name)[kept]
            setattr(out, name, ends[:, :1] * (1.0 - share) + ends[:, 1:] * share)
        out.strip = strip
        return out

    def where(self, row: np.ndarray, bound: np.ndarray, side: np.ndarray) -> Pieces:
        """The parts where an output that does not depend on x may be above (1) or below (-1) a bound."""
        values, radius, size = self.ends(row)
        over = (
            side[:, None] * (values - bound[:, None]) + (radius + ROUNDING * np.maximum(size, np.abs(bound)))[:, None]
        )
        first, last = over[:, 0], over[:, 1]
        rise = last - first
        crossing = self.strip[:, 0] - first * (self.strip[:, 1] - self.strip[:, 0]) / np.where(rise == 0.0, 1.0, rise)
        none = math.inf
        low = np.where(first >= 0.0, -none, np.where(last >= 0.0, crossing, none))
        high = np.where(last >= 0.0, none, np.where(first >= 0.0, crossing, -none))
        return self.between(low, high)


def _zero_between(values: np.ndarray, strip: np.ndarray) -> np.ndarray:
    """Zero of a line with these values at both ends of a strip, or the nearer end."""
    change = values[:, 1] - values[:, 0]
    share = np.where(change == 0.0, 0.0, -values[:, 0] / np.where(change == 0.0, 1.0, change))
    return np.asarray(strip[:, 0] + np.clip(share, 0.0, 1.0) * (strip[:, 1] - strip[:, 0]))


def kept_beside(pieces: Pieces, bound: np.ndarray, side: float) -> tuple[Pieces, np.ndarray]:
    """The parts with x below (1) or above (-1) a line, given at both values of w, and which piece each comes from.

    Where the line crosses both lower and upper edge, the part consists of up to three pieces between the crossings.
    """
    if side > 0:
        inner, outer = pieces.below, pieces.above
    else:
        inner, outer = pieces.above, pieces.below
    reach, over = (
        side * (bound - inner),
        side * (bound - outer),
    )  # positive where part of a piece, and where the whole piece, is kept
    w, width = pieces.strip, pieces.strip[:, 1] - pieces.strip[:, 0]
    some, whole = _zero_between(reach, w), _zero_between(over, w)
    none = math.inf
    # w for which something is kept
    low = np.where(reach[:, 0] >= 0.0, -none, np.where(reach[:, 1] >= 0.0, some, none))
    high = np.where(reach[:, 1] >= 0.0, none, np.where(reach[:, 0] >= 0.0, some, -none))
    # w for which all is kept
    all_low = np.where(over[:, 0] >= 0.0, -none, np.where(over[:, 1] >= 0.0, whole, none))
    all_high = np.where(over[:, 1] >= 0.0, none, np.where(over[:, 0] >= 0.0, whole, -none))
    index = np.arange(len(pieces))
    parts, origins = [], []

    def add(a: np.ndarray, b: np.ndarray, *, cut: bool) -> None:
        lower, upper = np.maximum(a, w[:, 0]), np.minimum(b, w[:, 1])
        kept = (lower <= upper) & ((upper > lower) | (width == 0.0))
        here = index[kept]
        part = pieces.take(here).between(a[kept], b[kept])
        if cut:
            share = np.where(
                width[here, None] > 0.0,
                (part.strip - w[here, :1]) / np.where(width[here] > 0.0, width[here], 1.0)[:, None],
                0.0,
            )
            line = bound[here, :1] * (1.0 - share) + bound[here, 1:] * share
            if side > 0:
                part.above = np.maximum(line, part.below)
            else:
                part.below = np.minimum(line, part.above)
        parts.append(part)
        origins.append(here)

    add(all_low, all_high, cut=False)
    none_whole = all_low > all_high
    add(
        np.where(none_whole, low, np.where(all_low == -none, none, low)),
        np.where(none_whole, high, np.minimum(high, all_low)),
        cut=True,
    )
    add(
        np.where(none_whole, none, np.maximum(low, all_high)),
        np.where(none_whole, -none, np.where(all_high == none, -none, high)),
        cut=True,
    )
    return Pieces.joined(parts), np.concatenate(origins)
