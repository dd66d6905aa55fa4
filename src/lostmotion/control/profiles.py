"""Moves from rest to rest in the shortest time that limits of speed, acceleration and jerk permit.

The profile has up to seven segments: the jerk is +j, 0, -j while it speeds up, 0 at constant speed, and -j, 0, +j
while it slows down. It is symmetric about its middle. For these moves the closed form below is exact also if a limit
is not reached. It takes arrays of moves and needs no library. The tests compare it with Ruckig, which solves the
general case: any speed and acceleration at both ends, several axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..reproducible import cbrt

SEGMENTS = 8  # the last is rest
JERK_SIGNS = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0)


def segment_durations(distance: Any, speed: Any, acceleration: Any, jerk: Any) -> tuple[Any, Any, Any, Any]:
    """Durations of a move's segments with jerk, with constant acceleration, and with constant speed [s];
    the largest acceleration that it reaches [rad/s^2].

    The arguments may be arrays; limits are above 0. An infinite jerk gives the trapezoidal speed, with segments with jerk of no
    duration.

    Derivation, with D the distance and v, a, j the limits. Let t be the duration of a segment with jerk and A = j t
    the acceleration reached. Let x = t + (duration of constant acceleration). Then the speed reached is A x, and a
    move without constant speed covers A x (x + t). A move without constant acceleration either has x = t and covers 2
    j t^3. So t is the least of (D/(2 j))^(1/3), sqrt(v/j) and a/j. If it is a/j, x is the lesser of v/A and the root
    of x^2 + t x = D/A.
    """
    D, v, a, j = np.broadcast_arrays(*(np.asarray(x, float) for x in (distance, speed, acceleration, jerk)))
    D = np.abs(D)
    by_distance, by_speed, by_acceleration = cbrt(0.5 * D) / cbrt(j), np.sqrt(v) / np.sqrt(j), a / j
    t = np.minimum(np.minimum(by_distance, by_speed), by_acceleration)
    reached = by_acceleration <= t  # the limit of acceleration
    with np.errstate(all="ignore"):  # of the branches not taken, and of a move of no length
        A = np.where(reached, a, j * t)
        root = 0.5 * (np.sqrt(t * t + 4.0 * D / A) - t)
        x = np.where(reached, np.minimum(v / A, root), t)
        at_limit = np.where(reached, v / A < root, by_speed < by_distance)  # of speed
        constant = np.where(at_limit, np.maximum(D / v - x - t, 0.0), 0.0)
    return t, np.maximum(x - t, 0.0), constant, A


def segments(distance: Any, speed: Any, acceleration: Any, jerk: Any = np.inf) -> np.ndarray:
    """The segments of a move, and rest after them.

    Parameters
    ----------
    distance
        With its sign [rad].
    speed, acceleration, jerk
        Limits, above 0 [rad/s, rad/s^2, rad/s^3]. Without a limit of the jerk the speed is trapezoidal.

    Returns
    -------
    Array of shape (5, 8, ...): time [s], position, speed, acceleration and jerk at the beginning of each segment; behind them the
    shape of the arguments. A segment that a move does not have begins when the next one does.
    """
    t, c, s, A = segment_durations(distance, speed, acceleration, jerk)
    j = np.where(np.isinf(jerk), 0.0, jerk)
    p1, v1 = A * t * t / 6.0, 0.5 * A * t
    p2, v2 = p1 + (v1 + 0.5 * A * c) * c, v1 + A * c
    V = A * (t + c)
    D, zero = np.abs(distance) + 0.0 * t, 0.0 * t
    p3 = 0.5 * (D - V * s)
    times = np.cumsum([zero, t, c, t, s, t, c, t], axis=0)
    positions = np.array([zero, p1, p2, p3, D - p3, D - p2, D - p1, D])  # symmetric about the middle
    speeds = np.array([zero, v1, v2, V, V, v2, v1, zero])
    accelerations = np.array([zero, A, A, zero, zero, -A, -A, zero])
    jerks = np.multiply.outer(JERK_SIGNS, j + zero)
    return np.array([times, *(np.sign(distance) * x for x in (positions, speeds, accelerations, jerks))])
