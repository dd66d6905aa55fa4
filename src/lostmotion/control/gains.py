"""Gains of a servo cascade by the rule that suits a drive: identical damping of both pole pairs, else the symmetrical optimum."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .tuning import TwoInertias, identical_damping, symmetrical_optimum

DAMPING = 0.7
DELAYS = 1.5  # sample times: one until a result acts, and half of one since it is held


@dataclass(frozen=True)
class Gains:
    """Of position and speed loop."""

    rule: str
    speed: float
    """K_p [N·m·s/rad], at the motor"""
    speed_integral: float
    """K_i [N·m/rad]"""
    position: float
    """K_v [1/s]"""


def gains_by_rule(
    motor_inertia: float, load_inertia: float, stiffness: float, lag: float, sample_time: float, position_time: float
) -> Gains:
    """Gains for a motor that turns a load through a stiffness.

    Where load and motor are so far apart that both pole pairs can be damped alike, they are, with 0.7; where they are not, or
    where that takes more gain than the sampling allows since the drive is as good as rigid, the symmetrical optimum with
    a = 2. The position loop gets half of the reciprocal of the speed loop's equivalent time.

    Parameters
    ----------
    motor_inertia, load_inertia
        Of both sides, at the motor [kg·m²].
    stiffness
        Between them, at the motor [N·m/rad]; infinite for a rigid drive.
    lag
        Of the current loop [s].
    sample_time, position_time
        Of speed and position loop [s].
    """
    delay = lag + DELAYS * sample_time
    optimum = symmetrical_optimum(motor_inertia + load_inertia, delay)
    drive = TwoInertias(motor_inertia, load_inertia, stiffness)
    if math.isfinite(stiffness) and drive.inertia_ratio >= 4.0 * DAMPING**2:
        alike = identical_damping(drive, DAMPING)
        if alike.gain <= optimum.gain:
            w_a, both = drive.antiresonance, alike.gain / (2.0 * DAMPING * motor_inertia)  # w_1 w_2 = w_a^2, w_1 + w_2
            slow = 2.0 * w_a**2 / (both + math.sqrt(both**2 - 4.0 * w_a**2))
            wait = 2.0 * DAMPING / slow + DELAYS * position_time
            return Gains("identical damping", alike.gain, alike.integral_gain, 0.5 / wait)
    wait = optimum.filter_time + DELAYS * position_time
    return Gains("symmetrical optimum", optimum.gain, optimum.integral_gain, 0.5 / wait)
