"""Measured motion as an input: the speed of a shaft from a channel of its speed or its angle, without jumps."""

import numpy as np

from ...errors import InputError
from ...simulation.scenario.scenario import Scenario
from ..prepared_log import Prepared
from ..task.identification_file import Identification

GIVEN_SPEED = "_given_speed"
GIVEN_ACCELERATION = "_given_acceleration"
LEAST = 5  # samples of a local cubic
ANGLES = ("rad", "m")


def speed_of(name: str) -> str:
    """Name of the given speed whose rate an input is; empty if it is none."""
    return name.removesuffix(GIVEN_ACCELERATION) + GIVEN_SPEED if name.endswith(GIVEN_ACCELERATION) else ""


def given_speed(task: Identification, log: Prepared, name: str) -> np.ndarray:
    """Speed of the shaft at the samples of a log, SI: smoothed, and the derivative if the channel is an angle or a position."""
    key = ("speed", name)
    if key not in log.cache:
        log.cache[key] = _speed(task, log, name)
    return log.cache[key]  # type: ignore[no-any-return]


def _speed(task: Identification, log: Prepared, name: str) -> np.ndarray:
    from scipy.signal import savgol_filter

    entry, x, h = task.inputs[name], log.inputs[name], log.log.interval
    is_angle = log.log.channels[entry.channel].unit in ANGLES
    if entry.smoothing == 0.0 and not is_angle:
        return x
    if entry.smoothing == 0.0:
        raise InputError(f'the channel {entry.channel} is an angle; give smoothing, such as "20 ms"', f"inputs.{name}")
    width = 2 * round(0.5 * entry.smoothing / h) + 1
    if not LEAST <= width <= len(x):
        raise InputError(
            f"{entry.smoothing:g} s has {width} samples of {log.name}; "
            f"give {LEAST} or more, and not more than the {len(x)} of the log",
            f"inputs.{name}.smoothing",
        )
    even = np.linspace(log.time[0], log.time[-1], len(x))
    found = savgol_filter(np.interp(even, log.time, x), width, 3, deriv=int(is_angle), delta=even[1] - even[0])
    return np.asarray(np.interp(log.time, even, found))


def rates_of(points: np.ndarray) -> np.ndarray:
    """Rate of a speed in straight lines, itself in straight lines.

    At a point of the speed it is the mean of the slopes on both sides. That of one side would be half a sample early, and the inertia
    would look like friction.

    points: array (points, 3) of time, speed and slope.

    Returns array (points, 3): time, acceleration and its slope.
    """
    t, slope = points[:, 0], points[:, 2].copy()
    if len(t) > 1:
        slope[-1] = slope[-2]
    rate = slope.copy()
    rate[1:] = 0.5 * (slope[:-1] + slope[1:])
    change = np.zeros(len(t))
    if len(t) > 1:
        change[:-1] = np.diff(rate) / np.diff(t)
    return np.column_stack([t, rate, change])


def refuse_given_motion(scenario: Scenario) -> None:
    """Refuse a rig with a shaft whose motion is given, which begins at no measured state."""
    for name, shaft in scenario.shafts.items():
        if shaft.speed is not None:
            raise InputError(f"the motion of shafts.{name} is given")
