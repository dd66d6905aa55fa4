"""The winding of a stepper: its pull-out torque over the speed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.refusal_messages import shown
from .motor import Motor

ELECTRIC = ("rated_current", "resistance_phase", "inductance_phase", "supply_voltage")


@checked
def pull_out_torque(motor: Motor, speed: Any) -> np.ndarray:
    """Return the largest torque that a stepper gives in step at a constant speed.

    The circuit has two phases a quarter of a period apart, with the resistance R, the inductance L and the induced voltage K w. Rated current
    in both phases is a current of ``sqrt(2) rated_current`` in the direction of the field, so that ``K = holding_torque/(sqrt(2) rated_current)``.
    The driver holds that current at most, and the amplitude of a phase voltage is at most `supply_voltage`. In coordinates of
    the rotor, ``u_d = R i_d - n w L i_q`` and ``u_q = R i_q + n w L i_d + K w``. The torque ``K i_q`` is largest within both limits.

    Parameters
    ----------
    motor : Motor
        Stepper with rated current, resistance, inductance and supply voltage.
    speed : float or array_like
        Speeds of the rotor [rad/s].

    Returns
    -------
    ndarray
        Torque [N·m] at each speed, without friction and detents; 0 where the induced voltage exceeds the supply.

    Raises
    ------
    InputError
        The motor is no stepper, or lacks one of these values.

    Examples
    --------
    >>> import lostmotion as lm
    >>> motor = lm.Motor(
    ...     kind="stepper", rotor_inertia="54 g cm^2", steps_per_revolution=200, holding_torque="0.44 N m", rated_current="1.7 A",
    ...     resistance_phase="1.5 ohm", inductance_phase="2.8 mH", supply_voltage="24 V",
    ... )
    >>> [round(float(torque), 3) for torque in lm.sizing.pull_out_torque(motor, [0.0, 30.0, 100.0])]
    [0.44, 0.44, 0.287]
    """
    if motor.kind != "stepper":
        raise InputError('the motor is no stepper; only kind = "stepper" has a pull-out torque')
    if missing := [key for key in ELECTRIC if getattr(motor, key) is None]:
        raise InputError("missing; the pull-out torque over the speed needs it", *missing)
    R, L, U = motor.resistance_phase, motor.inductance_phase, motor.supply_voltage
    assert R is not None and L is not None and U is not None  # noqa: PT018
    assert motor.rated_current is not None
    assert motor.steps_per_revolution is not None
    assert motor.holding_torque is not None
    try:
        if isinstance(speed, bool | str) or np.iscomplexobj(speed):
            raise TypeError
        w = np.abs(np.asarray(speed, float))
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"speed: {shown(speed)} must be a number [rad/s], or an array of them") from None
    if not np.all(np.isfinite(w)):
        raise InputError(f"speed: {shown(speed)} must be finite")
    largest = math.sqrt(2.0) * motor.rated_current
    K = motor.holding_torque / largest
    X = 0.25 * motor.steps_per_revolution * w * L
    square = R * R + X * X
    radius = U / np.sqrt(square)  # of the circle of currents at the full voltage, about (d, q)
    d, q = -K * w * X / square, -K * w * R / square
    apart = np.sqrt(d * d + q * q)
    with np.errstate(all="ignore"):
        # Where both circles meet, at the larger q.
        along = (largest * largest - radius * radius + apart * apart) / (2.0 * apart)
        across = np.sqrt(np.maximum(largest * largest - along * along, 0.0))
        met = (along * q - across * d) / apart
    within = (R * largest + K * w) * (R * largest + K * w) + X * largest * (X * largest) <= U * U  # i_d = 0
    at_voltage = d * d + (q + radius) * (q + radius) <= largest * largest
    found = np.where(within, largest, np.where(at_voltage, q + radius, np.where(along <= largest, met, 0.0)))
    return np.asarray(K * np.maximum(found, 0.0))
