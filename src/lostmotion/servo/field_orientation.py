"""The field-oriented current controller at a tick, linear about a steady motion: core/lostmotion/control/field_orientation.hpp without
its limits."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .rows import Row, Tick
from .winding import QUARTER, OrientedWinding, turn

CURRENTS = ("i_d", "i_q")
"""states beside those of the plant"""
ASKED = ("asked_d", "asked_q", "stator_angle")
"""what goes to the inverter: a voltage in the coordinates that were read, and the angle of the stator that it is meant for"""
LOOPS = ("direct current", "current")
"""of i_d and of i_q, the other one closed"""


def states(winding: OrientedWinding) -> list[str]:
    """Names of what the controller remembers."""
    delays = [f"{name}_delay_{k}" for name in ASKED for k in range(winding.delay)]
    return ["integral_d", "integral_q", "weakening", "asked_square", *ASKED, *delays]


def control(
    tick: Tick, winding: OrientedWinding, angles: tuple[Row, Row], loop: str, measured: Callable[[str, Row], Row]
) -> None:
    """A sample of the currents.

    Parameters
    ----------
    tick
        With the torque that is asked for and the speed as it is measured.
    angles
        Of the rotor: as it is, and as it is read.
    loop
        That is looked at.
    measured
        What the controller of a loop takes for a measured value.
    """
    m, motion, setting = winding.phase, winding.steady, winding.loop
    p, w_e, speed = m.pole_pairs, winding.electrical_speed, tick["measured_speed"]
    rotor, read = angles
    seen = turn(winding.lag) @ np.array([tick[name] for name in CURRENTS])
    seen = seen + np.outer(QUARTER @ motion.wanted, p * (rotor - read))
    i_d, i_q = (measured(name, row) for name, row in zip(LOOPS, seen, strict=True))
    wanted_d, wanted_q = _currents(tick, winding, loop)
    e_d, e_q = wanted_d - i_d, wanted_q - i_q
    gain_d, gain_q = (
        -setting.gain * m.resistance / math.expm1(-m.resistance * winding.sample_time / L)
        for L in (m.inductance_d, m.inductance_q)
    )
    d = gain_d * e_d + tick["integral_d"]
    d = d - setting.decoupling * m.inductance_q * (w_e * i_q + p * motion.wanted[1] * speed)
    q = gain_q * e_q + tick["integral_q"] + setting.back_emf * m.flux_linkage * p * speed
    q = q + setting.decoupling * m.inductance_d * (w_e * i_d + p * motion.wanted[0] * speed)
    for name, e in (("integral_d", e_d), ("integral_q", e_q)):
        tick[name] = tick[name] + setting.gain * m.resistance * e
    tick["asked_square"] = 2.0 * (motion.asked[0] * d + motion.asked[1] * q)
    for name, row in zip(ASKED, (d, q, p * (read + winding.ahead * speed)), strict=True):
        tick[name] = row


def _currents(tick: Tick, winding: OrientedWinding, loop: str) -> tuple[Row, Row]:
    """i_d* and i_q*. The field is weakened by a loop around those of the currents."""
    if loop in LOOPS:
        return tuple(tick["reference"] if loop == name else tick.zero for name in LOOPS)  # type: ignore[return-value]
    m, motion, setting = winding.phase, winding.steady, winding.loop
    base = max(abs(winding.electrical_speed), winding.largest_voltage / m.flux_linkage)
    if motion.weakening < 0.0:
        share = setting.field_weakening / (2.0 * base**2 * m.inductance_d * m.flux_linkage)
        tick["weakening"] = tick["weakening"] - share * tick["asked_square"]
    else:
        tick["weakening"] = tick.zero
    torque, constant = tick["torque_reference"], winding.constant(motion.wanted[0])
    i_d = tick.zero
    if motion.wanted[0] > winding.least_direct:
        i_d = winding.least_current(motion.torque_reference)[1] * torque + tick["weakening"]
    by_field = 1.5 * m.pole_pairs * winding.saliency * motion.wanted[1] / constant
    return i_d, torque / constant - by_field * i_d


def acting(tick: Tick, winding: OrientedWinding, rotor: Row, since: int) -> np.ndarray:
    """The voltage (u_d, u_q) at the beginning of a tick, so many ticks after the sample of the currents: two rows.

    Parameters
    ----------
    rotor
        Angle of the rotor.
    """
    d, q, angle = (tick.delayed(f"{name}_delay_", tick[name], winding.delay) for name in ASKED)
    u = turn(winding.placed(since)) @ np.array([d, q])
    turned = angle - winding.phase.pole_pairs * rotor
    return np.asarray(u + np.outer(QUARTER @ winding.voltage(since), turned))
