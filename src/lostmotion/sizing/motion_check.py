"""The check of the motion of a drive: inertia ratio, resonance, end stops."""

import math

import numpy as np

from ..control.command import CommandSignal
from ..model.gearbox import Gearbox
from ..model.motor import Motor
from ..model.torsion import Rigid
from .finding import Finding, Judgement

INERTIA_RATIO = 10.0  # beyond it a load is usually called hard to control
NEAR_RESONANCE = 1.5  # a command within this factor of a resonance excites it


def ratio_of_inertias(motor: Motor, gearbox: Gearbox, load_inertia: float) -> float:
    """Inertia of all that the rotor moves, at the motor, over the inertia of the rotor with its brake.

    The limits of manufacturers are for this ratio: screw, coupling, pulleys and gearbox belong to the load.
    Source: Yaskawa, selection examples of servo motors, J_L = J_table + J_screw + J_coupling + J_gear.
    """
    return (load_inertia / gearbox.ratio**2 + gearbox.inertia) / motor.rotor_inertia


def inertia_ratio(
    motor: Motor, gearbox: Gearbox, load_inertia: float, wanted: float | None = None, key: str = "motor"
) -> Finding:
    """The same, of parts, with the largest permissible ratio: the one that is wanted, and the limit of the manufacturer.

    Without either, 10 is the rule of thumb, and beyond it is a reservation. `key` is the motor's table.
    """
    ratio = ratio_of_inertias(motor, gearbox, load_inertia)
    printed = None if motor.limits is None else motor.limits.max_inertia_ratio
    stated = [limit for limit in (wanted, printed) if limit is not None]
    largest = min(stated, default=INERTIA_RATIO)
    far = ratio > largest
    beyond: Judgement = "warning" if stated else "caution"
    if largest == printed:
        remark = f"at most {largest:g}, the limit of the motor's manufacturer"
    elif stated:
        remark = f"at most {largest:g}: a load beyond is hard to control from the motor"
    else:
        remark = f"recommended at most {largest:g}: a load beyond is usually hard to control; {key}.limits.max_inertia_ratio states the motor's own limit"
    return Finding(
        "inertia_ratio",
        "inertia ratio",
        f"{ratio:.3g}",
        beyond if far else "ok",
        remark if far else "",
        ratio / largest,
    )


def resonances(motor: Motor, g: Gearbox, load_inertia: float) -> list[tuple[str, float, float]]:
    """(segment, resonance, anti-resonance) [Hz] of the softest and the stiffest segment of the torsion curve.

    None where nothing before the gear has inertia.
    """
    J_1 = g.ratio**2 * (motor.rotor_inertia + g.inertia)
    slopes = [] if isinstance(g.stiffness, Rigid) or J_1 == 0.0 else [k for k in g.stiffness.all_slopes() if k > 0.0]
    pieces = {"softest": min(slopes, default=0.0), "stiffest": max(slopes, default=0.0)}
    return [
        (name, math.sqrt(k / J_1 + k / load_inertia) / (2.0 * math.pi), math.sqrt(k / load_inertia) / (2.0 * math.pi))
        for name, k in pieces.items()
        if k > 0.0 and not (name == "stiffest" and k == pieces["softest"])
    ]


def resonance(motor: Motor, g: Gearbox, load_inertia: float, command: CommandSignal | None) -> list[Finding]:
    """Whether a sine of the command excites one."""
    excited = [] if command is None else [frequency for _, frequency, _ in command.sine_list()]
    out = []
    for name, f_r, f_a in resonances(motor, g, load_inertia):
        near = [f for f in excited if f_a / NEAR_RESONANCE < f < f_r * NEAR_RESONANCE]
        value = f"{f_r:.4g} Hz, anti-resonance {f_a:.4g} Hz"
        remark = f"the command has {near[0]:g} Hz" if near else ""
        verdict: Judgement = "caution" if near else "ok"
        out.append(Finding("resonance", f"resonance on the {name} segment", value, verdict, remark))
    return out


def end_stop(shaft: str, torque: np.ndarray, *, slides: bool) -> Finding:
    """Whether the run presses a shaft or a slide on an end stop, and the largest torque [N·m], of a slide force [N], there."""
    largest = float(np.abs(torque).max())
    what = f"end stops of {shaft}"
    if largest == 0.0:
        return Finding("end_stop", what, "not touched", "ok")
    value = f"pressed with up to {largest:.4g} {'N' if slides else 'N·m'}"
    return Finding("end_stop", what, value, "caution", "the travel of the motion ends at a stop")
