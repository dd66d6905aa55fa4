"""Contours of a quantity over a grid at round values, for pages and pictures alike."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

LINES = 6  # about so many contours of a map


@dataclass(frozen=True)
class Contour:
    """The places where the quantity has one value."""

    text: str
    x: np.ndarray  # points of lines, with NaN between two lines
    y: np.ndarray
    label: tuple[float, float]  # point at which the value is written


def edges(middles: Any, *, logarithmic: bool = False) -> np.ndarray:
    """Limits of cells about their middles, the outermost at the ends."""
    m = np.log(middles) if logarithmic else np.asarray(middles, float)
    limits = np.concatenate([m[:1], 0.5 * (m[1:] + m[:-1]), m[-1:]])
    return np.asarray(np.exp(limits) if logarithmic else limits)


def ticks(low: float, high: float, count: float, degrees: bool = False, whole: bool = False) -> list[float]:
    """Round values within an interval, about so many of them; of angles in degrees, parts and multiples of a right angle.

    Whole values, where what is counted has no halves.
    """
    span = high - low
    if not (span > 0.0 and math.isfinite(span)):
        return [low]
    power = 10.0 ** math.floor(math.log10(span / count))
    steps = (15.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0) if degrees and span > 12 * count else ()
    width = next(f for f in (*steps, *(g * power for g in (1, 2, 5, 10))) if f >= 0.75 * span / count)
    width = max(width, 1.0) if whole else width
    return [
        float(f"{k * width:.12g}") for k in range(math.ceil(low / width - 1e-9), math.floor(high / width + 1e-9) + 1)
    ]


def contours(x: Any, y: Any, values: Any, *, log_x: bool, log_y: bool, degrees: bool = False) -> list[Contour]:
    """Contours at round values; within a cell of the grid they are straight over the axes as they are drawn.

    x, y: values along the axes, rising.
    values: the quantity, shape (y, x); NaN where there is none.
    log_x, log_y: whether an axis is logarithmic.
    degrees: whether the quantity is an angle in degrees.
    """
    from contourpy import LineType, contour_generator

    u, v = (np.log(a) if log else np.asarray(a, float) for a, log in ((x, log_x), (y, log_y)))
    z = np.ma.masked_invalid(values)
    if z.count() == 0 or float(np.ptp(z.compressed())) <= 1e-9 * float(np.abs(z).max()):
        return []
    lines = contour_generator(u, v, z, corner_mask=True, line_type=LineType.ChunkCombinedNan).lines
    size = np.array([np.ptp(u) or 1.0, np.ptp(v) or 1.0])
    to_x, to_y = (np.exp if log else np.asarray for log in (log_x, log_y))
    out = []
    for level in ticks(float(z.min()), float(z.max()), LINES, degrees):
        line = lines(level)[0][0]
        if line is None or not z.min() < level < z.max():
            continue
        middle = 0.5 * (line[1:] + line[:-1])
        at = middle[np.nanargmin((((middle - [u.mean(), v.mean()]) / size) ** 2).sum(axis=1))]
        place = float(to_x(at[0])), float(to_y(at[1]))
        out.append(Contour(f"{level:g}".replace("-", "−"), to_x(line[:, 0]), to_y(line[:, 1]), place))
    return out
