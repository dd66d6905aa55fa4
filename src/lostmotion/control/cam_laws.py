"""Laws of motion of VDI 2143: moves from rest to rest in a given duration.

A law is the shape of its acceleration over the first half of a move; the second half mirrors it. The shape is linear between
`PIECES` + 1 instants, so that a move consists of pieces of constant jerk. Its acceleration differs from the law's
acceleration by less than a thousandth of the peak.
"""

import itertools
from collections.abc import Callable
from functools import cache

import numpy as np

from ..recorded_numbers import value_of
from ..reproducible import cos, sin
from .profiles import Segment

PIECES = 256  # of a whole move; a multiple of 8, so that laws of several parts change at an instant of their own


def _modified_sine(t: np.ndarray) -> np.ndarray:
    return np.where(t < 0.125, sin(4.0 * np.pi * t), sin(np.pi * (1.0 + 4.0 * t) / 3.0))


def _modified_trapezoid(t: np.ndarray) -> np.ndarray:
    return np.where(t < 0.125, sin(4.0 * np.pi * t), np.where(t < 0.375, 1.0, sin(np.pi * (4.0 * t - 1.0))))


LAWS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "parabola": np.ones_like,
    "least_jerk": lambda t: np.minimum(t, 0.5 - t),
    "harmonic": lambda t: cos(np.pi * t),
    "cycloidal": lambda t: sin(2.0 * np.pi * t),
    "fifth_order": lambda t: t * (1.0 - t) * (1.0 - 2.0 * t),
    "seventh_order": lambda t: t * t * (1.0 - t) * (1.0 - t) * (1.0 - 2.0 * t),
    "modified_sine": _modified_sine,
    "modified_trapezoid": _modified_trapezoid,
}
"""acceleration, of any size, over time as a share of the duration, up to a half"""


@cache
def unit_move(law: str) -> tuple[Segment, ...]:
    """Pieces of a move by 1 in a time of 1, and rest after them."""
    step = 1.0 / PIECES
    shape = [float(a) for a in LAWS[law](np.arange(PIECES // 2 + 1) * step)]
    position, speed, half = 0.0, 0.0, [(0.0, 0.0)]
    for one, other in itertools.pairwise(shape):
        position += (speed + (2.0 * one + other) * step / 6.0) * step
        speed += 0.5 * (one + other) * step
        half.append((position, speed))
    scale = 0.5 / position
    pieces = [
        (k * step, scale * p, scale * v, scale * a, scale * (b - a) * PIECES)
        for k, ((p, v), (a, b)) in enumerate(zip(half[:-1], itertools.pairwise(shape), strict=True))
    ]
    ends = [*pieces[1:], (0.5, 0.5, scale * speed, scale * shape[-1], 0.0)]
    mirrored = [
        (1.0 - end[0], 1.0 - end[1], end[2], -scale * after, piece[4])
        for piece, end, after in zip(pieces, ends, shape[1:], strict=True)
    ]
    return (*pieces, *reversed(mirrored), (1.0, 1.0, 0.0, 0.0, 0.0))


def timed(distance: float, duration: float, law: str) -> list[Segment]:
    """The segments of a move by a law, and rest after them."""
    by_speed = distance / duration
    by_acceleration = by_speed / duration
    by_jerk = by_acceleration / duration
    return [
        (t * duration, p * distance, v * by_speed, a * by_acceleration, j * by_jerk) for t, p, v, a, j in unit_move(law)
    ]


def peaks(segments: list[Segment]) -> tuple[float, float, float]:
    """Largest speed, acceleration and jerk of a move."""
    return tuple(max(abs(value_of(s[k])) for s in segments) for k in (2, 3, 4))  # type: ignore[return-value]
