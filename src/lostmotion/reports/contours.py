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
    x: np.ndarray  # ends of straight segments, with NaN between two segments
    y: np.ndarray
    label: tuple[float, float]  # point at which the value is written


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
    """Contours at round values.

    Each cell of the grid is cut into two triangles, on which the quantity is linear over the axes as they are drawn.

    x, y: values along the axes, rising.
    values: the quantity, shape (y, x); NaN where there is none.
    log_x, log_y: whether an axis is logarithmic.
    degrees: whether the quantity is an angle in degrees.
    """
    u, v = (np.log(a) if log else np.asarray(a, float) for a, log in ((x, log_x), (y, log_y)))
    z = np.asarray(values, float)
    found = z[np.isfinite(z)]
    if len(found) == 0 or float(np.ptp(found)) <= 1e-9 * float(np.abs(found).max()):
        return []
    a, b = np.meshgrid(u, v)
    nodes = np.stack([a, b, z], axis=-1)
    corners = (nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1])
    triangles = np.concatenate(
        [np.stack([corners[k] for k in ks], axis=-2).reshape(-1, 3, 3) for ks in ((0, 1, 2), (0, 2, 3))]
    )
    triangles = triangles[np.isfinite(triangles).all(axis=(1, 2))]
    out = []
    to_x, to_y = (np.exp if log else np.asarray for log in (log_x, log_y))
    low, high = float(found.min()), float(found.max())
    for level in ticks(low, high, LINES, degrees):
        if not low < level < high or len(ends := _cut(triangles, level)) == 0:
            continue
        middle = ends.mean(axis=1)
        size = np.array([np.ptp(u) or 1.0, np.ptp(v) or 1.0])
        at = middle[np.argmin((((middle - [u.mean(), v.mean()]) / size) ** 2).sum(axis=1))]
        line = np.concatenate([ends, np.full((len(ends), 1, 2), np.nan)], axis=1).reshape(-1, 2)
        place = float(to_x(at[0])), float(to_y(at[1]))
        out.append(Contour(f"{level:g}".replace("-", "−"), to_x(line[:, 0]), to_y(line[:, 1]), place))
    return out


def _cut(triangles: np.ndarray, level: float) -> np.ndarray:
    """Both ends of the line across each triangle on which its corners have the value: shape (segments, 2, 2)."""
    above = triangles[:, :, 2] > level
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    crossed = (above.sum(axis=1) % 3) != 0
    t, alone = triangles[crossed], alone[crossed]
    rows = np.arange(len(t))
    apex = t[rows, alone]
    ends = []
    for k in (1, 2):
        other = t[rows, (alone + k) % 3]
        share = (level - apex[:, 2]) / (other[:, 2] - apex[:, 2])
        ends.append(apex[:, :2] + share[:, None] * (other[:, :2] - apex[:, :2]))
    return np.stack(ends, axis=1)
