"""Goal shaping by the firmware of a servo: a filter, and limits of rate and acceleration.

The goal does not depend on the motion, so its course is computed beforehand. The grid is finer than the samples of
the log, with straight lines between its points.
"""

import math

import numpy as np

GRID = 5e-3  # [s], at most, between two points of the course


def shaped(
    time: np.ndarray, goal: np.ndarray, *, held: bool, rate: float, acceleration: float, filter_time: float
) -> tuple[np.ndarray, np.ndarray, int]:
    """Course of a goal that is filtered, then limited in its rate and its acceleration.

    time: instants of the samples [s].
    goal: values there.
    held: whether the goal keeps its value between two samples; else it goes in straight lines.
    rate: largest rate of the course, infinite without a limit.
    acceleration: largest rate of that rate, infinite without a limit. The course begins to brake so that it ends on the goal.
    filter_time: time constant of a first-order filter of the goal [s]; 0 without one.

    Returns tuple: instants [s], values there, and how many of them there are for one sample.

    Examples
    --------
    A step of 1 rad, limited to 4 rad/s, takes 0.25 s:

    >>> import numpy as np
    >>> time, course, _ = shaped(
    ...     np.array([0.0, 0.1, 0.5]), np.array([0.0, 1.0, 1.0]),
    ...     held=True, rate=4.0, acceleration=np.inf, filter_time=0.0)
    >>> float(time[np.argmax(course >= 1.0 - 1e-9)])
    0.35
    """
    step = np.diff(time)
    count = max(1, math.ceil(float(np.median(step)) / GRID - 1e-9)) if len(step) else 1
    share = np.arange(count) / count
    fine = np.append((time[:-1, None] + np.outer(step, share)).ravel(), time[-1])
    if held:
        before = np.repeat(goal[:-1], count)  # in the interval that begins at a point of the grid
        after = before
    else:
        values = np.append((goal[:-1, None] + np.outer(np.diff(goal), share)).ravel(), goal[-1])
        before, after = values[:-1], values[1:]
    if math.isinf(acceleration) and filter_time <= 0.0:
        return fine, _ramps(float(goal[0]), after, rate * np.diff(fine)), count
    course = np.empty(len(fine))
    course[0] = filtered = y = float(goal[0])
    speed = 0.0
    for k, (h, x, x_1) in enumerate(zip(np.diff(fine).tolist(), before.tolist(), after.tolist(), strict=True)):
        filtered = _filtered(filtered, x, x_1, h, filter_time)
        speed = _limited(filtered - y, speed, h, rate, acceleration)
        y += h * speed
        course[k + 1] = y
    return fine, course, count


def _ramps(start: float, goals: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Course that moves to the goal of each step by the largest change of that step, at most."""
    course, y = [start], start
    for goal, change in zip(goals.tolist(), most.tolist(), strict=True):
        distance = goal - y
        y = goal if -change <= distance <= change else y + math.copysign(change, distance)
        course.append(y)
    return np.array(course)


def _filtered(state: float, x: float, x_1: float, h: float, filter_time: float) -> float:
    """First-order filter over a time h, in which its input goes from x to x_1 in a straight line: exact."""
    if filter_time <= 0.0:
        return x_1
    slope = (x_1 - x) / h
    return x_1 - slope * filter_time + (state - x + slope * filter_time) * math.exp(-h / filter_time)


def _limited(distance: float, speed: float, h: float, rate: float, acceleration: float) -> float:
    """Mean rate over a time h that leads over a distance, at most `rate`; and so that the acceleration suffices to stop there."""
    if math.isinf(acceleration):
        return min(max(distance / h, -rate), rate)
    # From n h a on, braking by h a at each step covers h^2 a n (n + 1)/2.
    braking = h * acceleration * (math.sqrt(0.25 + 2.0 * abs(distance) / (h * h * acceleration)) - 0.5)
    wanted = math.copysign(min(braking, rate, abs(distance) / h), distance)
    return min(max(wanted, speed - h * acceleration), speed + h * acceleration)
