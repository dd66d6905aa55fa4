"""The check of the motion of a drive: inertia ratio, resonance, dead zone, holding."""

from __future__ import annotations

import math

from .. import _core
from ..model.gearbox import Gearbox
from ..model.motor import Motor
from ..model.signals import CommandSignal
from ..model.torsion import Rigid
from ..simulation.explanation import smallest_commands
from ..simulation.results import RunArrays
from ..simulation.scenario import Scenario
from ..test_rig.rig import TestRig
from .finding import Finding, Judgement
from .holding import holding

INERTIA_RATIO = 10.0  # beyond it a load is usually called hard to control
NEAR_RESONANCE = 1.5  # a command within this factor of a resonance excites it


def load_torques(result: RunArrays) -> list[float]:
    """The largest and the least load torque of a run, but not 0 [N·m]."""
    torque = result["load_torque"]
    return sorted({float(torque.max()), float(torque.min())} - {0.0})


def inertia(scenario: Scenario) -> Finding:
    """Inertia of the load relative to the inertia of the rotor."""
    return inertia_ratio(scenario.motor, scenario.gearbox, scenario.load.inertia)


def ratio_of_inertias(motor: Motor, gearbox: Gearbox, load_inertia: float) -> float:
    """Inertia of all that the rotor moves, at the motor, over the inertia of the rotor with its brake.

    The limits of manufacturers are for this ratio: screw, coupling, pulleys and gearbox belong to the load.
    Source: Yaskawa, selection examples of servo motors, J_L = J_table + J_screw + J_coupling + J_gear.
    """
    return (load_inertia / gearbox.ratio**2 + gearbox.inertia) / motor.rotor_inertia


def inertia_ratio(motor: Motor, gearbox: Gearbox, load_inertia: float, wanted: float | None = None) -> Finding:
    """The same, of parts, with the largest permissible ratio: the one that is wanted, and the limit of the manufacturer.

    Without either, 10 is the rule of thumb, and beyond it is a reservation.
    """
    ratio = ratio_of_inertias(motor, gearbox, load_inertia)
    printed = None if motor.limits is None else motor.limits.max_inertia_ratio
    stated = [limit for limit in (wanted, printed) if limit is not None]
    largest = min(stated, default=INERTIA_RATIO)
    far = ratio > largest
    beyond: Judgement = "warning" if stated else "caution"
    if largest == printed:
        remark = f"above {largest:g}, the limit of the motor's manufacturer"
    elif stated:
        remark = f"above {largest:g} the load is hard to control from the motor"
    else:
        remark = f"above {largest:g} a load is usually hard to control; motor.limits.max_inertia_ratio states the motor's own limit"
    return Finding(
        "inertia_ratio",
        "inertia of load and gearbox / of the rotor",
        f"{ratio:.3g}",
        beyond if far else "ok",
        remark if far else "",
        ratio / largest,
    )


def resonances(motor: Motor, g: Gearbox, load_inertia: float) -> list[tuple[str, float, float]]:
    """(segment, resonance, anti-resonance) [Hz] of the softest and the stiffest segment of the torsion curve."""
    J_1 = g.ratio**2 * (motor.rotor_inertia + g.inertia)
    slopes = [] if isinstance(g.stiffness, Rigid) else [k for k in g.stiffness.all_slopes() if k > 0.0]
    pieces = {"softest": min(slopes, default=0.0), "stiffest": max(slopes, default=0.0)}
    return [
        (
            name,
            math.sqrt(k / J_1 + k / load_inertia) / (2.0 * math.pi),
            math.sqrt(k / load_inertia) / (2.0 * math.pi),
        )
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


def dead_zone(scenario: Scenario, result: RunArrays) -> Finding:
    """The commands that move the load from rest."""
    forward, backward = smallest_commands(scenario, {"load_torque": float(result["load_torque"][0])})
    peak = float(abs(result["command"]).max())
    value = f"the load moves above a command of {forward:.4g} and below {backward:.4g}"
    moves = bool((result["motor_speed"] != 0.0).any())
    if peak == 0.0:
        return Finding("dead_zone", "dead zone", value, "ok", "the command is 0 throughout")
    if peak <= min(forward, -backward) and not moves:
        remark = f"the command never exceeds {peak:.4g}: the load does not move"
        return Finding("dead_zone", "dead zone", value, "warning", remark)
    small = peak < 3.0 * max(forward, -backward)
    remark = f"a large part of the command, which reaches {peak:.4g}" if small else ""
    return Finding("dead_zone", "dead zone", value, "caution" if small else "ok", remark)


def holdings(scenario: Scenario, result: RunArrays) -> list[Finding]:
    """Whether the drive bears the load torques of the run with command 0."""
    loads = load_torques(result)
    if not loads:
        return [
            Finding("holding", "holding with command 0", "no load torque acts", "ok", _static_holding(scenario.gearbox))
        ]
    return [_held(scenario, load, float(abs(result["load_speed"]).max())) for load in loads]


def _held(scenario: Scenario, load_torque: float, speed: float) -> Finding:
    what = f"holding {load_torque:.4g} N·m with command 0"
    try:
        found = holding(scenario, load_torque, speed)
    except _core.SolverError as error:
        return Finding("holding", what, "cannot be determined", "unknown", str(error))
    if found.holds:
        value = f"the load stays at rest, and comes to rest if the power fails at {abs(found.begin):.3g} rad/s"
        return Finding("holding", what, value, "ok")
    if found.from_rest != 0.0:
        value = f"the load torque drives the load {_at(found.from_rest)}"
    else:
        value = f"at rest only: if the power fails at {abs(found.begin):.3g} rad/s, the load goes on {_at(found.from_motion)}"
    if scenario.task.brake is not None:
        return Finding("holding", what, value, "ok", "the brake holds the load")
    if not scenario.task.hold_without_power:
        return Finding("holding", what, value, "ok", "not required by the task")
    remedy = "it needs a brake, task.brake, or a motor under control, task.hold_without_power = false"
    return Finding("holding", what, value, "warning", f"{remedy}; {_static_holding(scenario.gearbox)}")


def _at(speed: float) -> str:
    return f"at {speed:.3g} rad/s" if math.isfinite(speed) else "ever faster"


def _static_holding(g: Gearbox) -> str:
    """Torque that the gearbox alone holds at rest."""
    back = TestRig(g).backdriving_torque() if g.losses.kind == "map" and not isinstance(g.stiffness, Rigid) else 0.0
    if back is None:
        return "the gearbox alone holds more than three times rated torque at rest"
    return f"the gearbox alone holds {back:.4g} N·m at rest"
