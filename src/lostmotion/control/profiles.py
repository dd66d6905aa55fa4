"""Moves from rest to rest in the shortest time that limits of speed, acceleration and jerk permit.

The profile has up to seven segments: the jerk is +j, 0, -j while it speeds up, 0 at constant speed, and -j, 0, +j
while it slows down. It is symmetric about its middle. For these moves the closed form below is exact also if a limit
is not reached, and needs no library. The tests compare it with Ruckig, which solves the general case: any speed and
acceleration at both ends, several axes.
"""

import itertools
import math

from ..reproducible import cbrt, sqrt

JERK_SIGNS = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0)  # of the segments; the last is rest

Segment = tuple[float, float, float, float, float]  # time [s], position, speed, acceleration and jerk at its beginning


def segment_durations(
    distance: float, speed: float, acceleration: float, jerk: float
) -> tuple[float, float, float, float]:
    """Durations of a move's segments with jerk, with constant acceleration, and with constant speed [s];
    the largest acceleration that it reaches [rad/s^2].

    Limits are above 0. An infinite jerk gives the trapezoidal speed, with segments with jerk of no duration.

    Derivation, with D the distance and v, a, j the limits. Let t be the duration of a segment with jerk and A = j t
    the acceleration reached. Let x = t + (duration of constant acceleration). Then the speed reached is A x, and a
    move without constant speed covers A x (x + t). A move without constant acceleration either has x = t and covers 2
    j t^3. So t is the least of (D/(2 j))^(1/3), sqrt(v/j) and a/j. If it is a/j, x is the lesser of v/A and the root
    of x^2 + t x = D/A.
    """
    D, v, a, j = abs(distance), speed, acceleration, jerk
    by_distance, by_speed, by_acceleration = cbrt(0.5 * D) / cbrt(j), sqrt(v) / sqrt(j), a / j
    t = min(by_distance, by_speed, by_acceleration)
    if by_acceleration <= t:  # the limit of acceleration
        root = 0.5 * (sqrt(t * t + 4.0 * D / a) - t)
        A, x, at_limit = a, min(v / a, root), v / a < root
    else:
        A, x, at_limit = j * t, t, by_speed < by_distance
    return t, max(x - t, 0.0), max(D / v - x - t, 0.0) if at_limit else 0.0, A


def segments(distance: float, speed: float, acceleration: float, jerk: float = math.inf) -> list[Segment]:
    """The segments of a move, and rest after them. A segment that it does not have begins when the next one does.

    distance: with its sign [rad].
    speed, acceleration, jerk: limits, above 0 [rad/s, rad/s^2, rad/s^3]. Without a limit of the jerk the speed is trapezoidal.
    """
    t, c, s, A = segment_durations(distance, speed, acceleration, jerk)
    j = 0.0 if math.isinf(jerk) else jerk
    p1, v1 = A * t * t / 6.0, 0.5 * A * t
    p2, v2 = p1 + (v1 + 0.5 * A * c) * c, v1 + A * c
    V, D = A * (t + c), abs(distance)
    p3 = 0.5 * (D - V * s)
    columns = (
        list(itertools.accumulate((t, c, t, s, t, c, t), initial=0.0)),
        (0.0, p1, p2, p3, D - p3, D - p2, D - p1, D),  # symmetric about the middle
        (0.0, v1, v2, V, V, v2, v1, 0.0),
        (0.0, A, A, 0.0, 0.0, -A, -A, 0.0),
        [sign * j for sign in JERK_SIGNS],
    )
    way = (distance > 0.0) - (distance < 0.0)
    return [(time, way * p, way * v, way * a, way * d) for time, p, v, a, d in zip(*columns, strict=True)]
