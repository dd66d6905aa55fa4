"""Inverse dynamics: the torque that is missing at a measured shaft if the rig moves as a log shows.

All shafts turn with the measured one by fixed ratios n, so that with its speed w and acceleration a

    r = sum n (J n a + b n w + T_C sign(n w) + M_Z - M(n phi) - T)

over shafts, with the motors' torques T and those over the angle M. At the right values r is 0 but for noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from ...errors import InputError
from ...model.angle_torques import STANDARD_GRAVITY, Gravity, PositionHarmonic, TorqueHarmonic
from ...model.losses import ConstantEfficiency, MeshEfficiency
from ...model.motor import ShaftMotor
from ...model.shaft_ratio import turns
from ...simulation.scenario.scenario import Scenario
from ..prepared_log import Prepared
from .log_inputs import DELAY, course_of_input, numbers_of_input
from .measured_motion import ShownMotion, measured_course
from .rig_scenario import Rig

PAUSE = 3.0  # times the sample interval: there the samples are taken as two pieces


@dataclass(frozen=True)
class Stretch:
    """A piece of a log in one phase, at equal distances in time, with filtered derivatives."""

    log: Prepared
    phase: int
    time: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    blocks: np.ndarray  # samples of each piece in which the shaft turns in one direction: blocks x samples


def stretches(rig: Rig, log: Prepared, known: Mapping[str, Any], shown: ShownMotion, width: int) -> list[Stretch]:
    """The stretches of a log that are long enough.

    width: samples of the filter, cubics by least squares (Savitzky and Golay 1964), and of a block; odd.
    """
    at, x = measured_course(rig, log, shown.channel, known)
    h, found = log.log.interval, []
    for segment in log.segments:
        samples = slice(segment.begin, segment.end)
        there = np.isfinite(x[samples])
        own, values = at[samples][there], x[samples][there]
        for piece in np.split(np.arange(len(own)), np.flatnonzero(np.diff(own) > PAUSE * h) + 1):
            if len(piece) < 3 * width:
                continue
            t = np.arange(own[piece[0]], own[piece[-1]], h)
            if len(t) < 3 * width:
                continue
            even = np.interp(t, own[piece], values[piece])
            q, w, a = (savgol_filter(even, width, 3, deriv=d, delta=h)[width // 2 : -(width // 2)] for d in (0, 1, 2))
            if shown.is_speed:  # no torque depends on the angle then
                q, w, a = np.zeros(len(q)), q, w
            blocks = np.arange(len(q) // width * width).reshape(-1, width)
            blocks = blocks[np.all(w[blocks] > 0.0, axis=1) | np.all(w[blocks] < 0.0, axis=1)]
            if len(blocks):
                found.append(Stretch(log, segment.phase, t[width // 2 : -(width // 2)], q, w, a, blocks))
    return found


def missing_torque(rig: Rig, s: Stretch, known: Mapping[str, Any], rung: int, shown: ShownMotion) -> np.ndarray:
    """r of each block [N·m]."""
    scenario = rig.built(rig.changes(known, rung, s.phase)).scenario
    _check(scenario)
    train = scenario.train()
    ratios: dict[str, float] = {}
    for name in train.shafts:
        n = turns(train, name, shown.shaft)
        if n is None:
            raise InputError(f"shaft {name} does not turn with {shown.shaft} by a fixed ratio")
        ratios[name] = n
    inertia, viscous, dry = 0.0, 0.0, np.zeros(len(s.time))
    other = np.zeros(len(s.time))
    for name, shaft in train.shafts.items():
        n = ratios[name]
        inertia, viscous = inertia + n**2 * train.inertia_of(name), viscous + n**2 * shaft.viscous_friction
        law = shaft.friction()
        dry += abs(n) * np.interp(np.abs(n * s.speed), law["speeds"] or [0.0], law["torques"] or [law["torque"]])
        if name in scenario.loads():
            other += n * _acting(rig, s, known, scenario, train.variable(name, "load_torque"))
        if (stops := shaft.end_stops) is not None:
            motion = zip((n * s.angle).tolist(), (n * s.speed).tolist(), strict=True)
            other -= n * np.array([stops.torque(phi, w) for phi, w in motion])
    for one, other_shaft, coupling in train.inertia_couplings():
        inertia += 2.0 * ratios[one] * ratios[other_shaft] * coupling
    for gear in train.gears.values():
        n = ratios[gear.input]
        inertia, viscous = inertia + n**2 * gear.inertia, viscous + n**2 * gear.viscous_friction
    for _, damper in train.couplings():  # couplings that hold are refused
        viscous += (ratios[damper.input] - ratios[damper.output]) ** 2 * damper.viscous_friction  # type: ignore[attr-defined]
    for name, motor in train.motors.items():
        n = ratios[motor.shaft]
        inertia += n**2 * motor.rotor_inertia
        dry += abs(n) * motor.friction_torque
        other -= n * _motor_torque(rig, s, known, scenario, name, motor)
    for _, element in train.on_shafts():
        n = ratios[element.shaft]
        other -= n * _over_angle(element, n * s.angle)
    r = inertia * s.acceleration + viscous * s.speed + dry * np.sign(s.speed) + other
    return np.asarray(r[s.blocks].mean(axis=1))


def _over_angle(t: Any, angle: np.ndarray) -> np.ndarray:
    """A torque over the angle; sines as such, since the number of their straight lines may depend on the parameters."""
    if isinstance(t, Gravity):
        return np.asarray(-t.mass * STANDARD_GRAVITY * t.radius * np.sin(angle + t.angle))
    if isinstance(t, TorqueHarmonic):
        return np.asarray(t.amplitude * np.sin(t.order * angle + t.phase))
    if isinstance(t, PositionHarmonic):
        return np.asarray(t.amplitude * np.sin(2.0 * np.pi / t.period * angle))
    curve = t.over_angle()
    return np.array([curve(phi) for phi in angle.tolist()])


def _check(scenario: Scenario) -> None:
    """Whether its torques follow the formula above."""
    train = scenario.train()
    holding = [key for key, coupling in train.couplings() if coupling.holds]
    if holding := [*holding, *(key for key, element in train.on_shafts() if not hasattr(element, "over_angle"))]:
        raise InputError(f"{holding[0]} has a torque that depends on the contact state; this is not supported")
    for name, gear in train.gears.items():
        losses = gear.losses
        lossless = (isinstance(losses, ConstantEfficiency) and losses.efficiency == 1.0) or (
            isinstance(losses, MeshEfficiency) and losses.efficiencies() == (1.0, 1.0)
        )
        if not lossless or gear.transmission_error is not None:
            raise InputError(f"{scenario.kind_of(name)}s.{name} has losses over the load or a transmission error")
    shafts = ((f"shafts.{name}", shaft) for name, shaft in train.shafts.items())
    for key, part in (*shafts, *train.couplings()):
        if getattr(part, "drag", None) is not None:
            raise InputError(f"{key} has a drag over the speed")


def _motor_torque(
    rig: Rig, s: Stretch, known: Mapping[str, Any], scenario: Scenario, name: str, motor: ShaftMotor
) -> np.ndarray:
    """Measured, or of the command of a torque source."""
    for channel, m in rig.task.measured.items():
        if m.variable == scenario.train().variable(name, "torque") and m.filter_time == 0.0:
            at, torque = measured_course(rig, s.log, channel, known)
            there = np.isfinite(torque)
            return np.asarray(np.interp(s.time, at[there], torque[there]))
    if name in scenario.controllers:
        raise InputError(f"{scenario.motor_key(name)} is under its controller, and no channel shows its torque")
    if motor.kind != "torque_source":
        what = "the angle of its field" if motor.kind == "stepper" else "a voltage"
        raise InputError(f"motors.{name} has {what} as its command, and no channel shows its torque")
    torque = motor.rated_torque * _acting(rig, s, known, scenario, scenario.train().variable(name, "command"))
    limit = np.inf if motor.torque_limit is None else motor.torque_limit
    return np.asarray(np.clip(torque, -limit, limit))


def _acting(rig: Rig, s: Stretch, known: Mapping[str, Any], scenario: Scenario, name: str) -> np.ndarray:
    """An input of the log, or a constant of the scenario."""
    channel = rig.task.inputs.get(name)
    if channel is None:
        signal = scenario.signals()[name]
        points = signal.breakpoint_list()
        if signal.sine_list() or len(points) > 1 or any(points[0][2:]):
            raise InputError(f"{name} changes with time, and is not among the inputs")
        return np.full(len(s.time), points[0][1])
    numbers = numbers_of_input(rig.task, name, known)
    at, values, held, _ = course_of_input(rig.task, s.log, name, numbers)
    at = at + numbers[DELAY]
    if not held:
        return np.asarray(np.interp(s.time, at, values))
    return np.asarray(values[np.maximum(np.searchsorted(at, s.time, side="right") - 1, 0)])
