"""The check of a stepper: lost steps, torque against the pull-out curve, resonance."""

import math

import numpy as np

from ..model.motor import Motor
from ..model.stepper import ELECTRIC, pull_out_torque
from ..simulation.runs.lost_steps import PERIOD, found_in
from ..simulation.runs.results import RunArrays
from ..simulation.scenario.scenario import Scenario
from ..units.practical import RPM
from .finding import Finding, Judgement
from .motor_check import largest_speed

SAFETY = 1.5  # of the pull-out torque over the torque of a run, the smaller end of the range that manufacturers give
NEAR = 1.5  # ratio of two frequencies that are near each other
DWELL = 0.02  # share of a run in which a step rate near the resonance counts
COARSE = 2  # microsteps from which on a step excites little


def stepper_rules(scenario: Scenario, name: str, result: RunArrays) -> list[Finding]:
    """Findings of one stepper of a run."""
    train = scenario.train()
    motor, where = train.motors[name], scenario.motor_key(name)
    torque, speed = (
        np.abs(result[key]) for key in (train.variable(name, "torque"), train.variable(motor.shaft, "speed"))
    )
    lost = next(found for found in found_in(scenario, result) if found.motor == name)
    verdict: Judgement = "warning" if lost.times else "ok"
    value = f"{lost.lost} full steps" if lost.times else "none"
    lag = (
        f"the rotor slips first at {lost.times[0]:.4g} s"
        if lost.times
        else f"largest lag {lost.largest_lag:.3g} of {PERIOD // 2} full steps"
    )
    return [
        Finding("lost_steps", "lost steps", value, verdict, lag, 0.5 * lost.largest_lag),
        torque_reserve(motor, torque, speed, where),
        step_resonance(motor, train.shafts[motor.shaft].inertia, speed, microsteps_of(scenario, name)),
    ]


def speed_of_stepper(motor: Motor, speed: float, where: str = "motor") -> list[Finding]:
    """Largest speed [rad/s] and the limit of the data sheet; nothing where none is given, as the pull-out curve then judges."""
    limited = motor.limits is not None and motor.limits.max_speed is not None
    return [largest_speed(motor, speed, where)] if limited else []


def microsteps_of(scenario: Scenario, name: str) -> int:
    """Parts of a full step in which the driver of a stepper turns its field."""
    command = scenario.tables.command.get(name)
    return 1 if command is None or command.stepping is None else command.stepping.microsteps


def torque_reserve(motor: Motor, torque: np.ndarray, speed: np.ndarray, where: str = "motor") -> Finding:
    """Largest share of the pull-out torque at the speed at which it is needed.

    torque, speed: magnitudes of the motor's torque and speed over a motion [N·m, rad/s].
    where: table of the motor, for missing keys.
    """
    missing = [f"{where}.{key}" for key in ELECTRIC if getattr(motor, key) is None]
    assert motor.holding_torque is not None
    limit = np.full_like(torque, motor.holding_torque) if missing else pull_out_torque(motor, speed)
    with np.errstate(divide="ignore", invalid="ignore"):
        use = np.where(torque > 0.0, torque / limit, 0.0)
    k = int(np.argmax(use))
    what = "torque, largest share of the pull-out torque"
    value = f"{torque[k]:.4g} of {limit[k]:.4g} N·m at {RPM * speed[k]:.4g} rpm"
    share = float(use[k])
    if missing and share <= 1.0:
        remark = f"of the holding torque, which falls with the speed; give {', '.join(missing)}"
        return Finding("stepper_torque", what, value, "unknown", remark)
    verdict: Judgement = "ok" if share <= 1.0 / SAFETY else "caution" if share <= 1.0 else "warning"
    remark = (
        "beyond what the winding gives at that speed: the rotor falls out of step"
        if verdict == "warning"
        else f"safety {1.0 / share:.3g}, wanted {SAFETY:g}"
        if share > 0.0
        else ""
    )
    return Finding("stepper_torque", what, value, verdict, remark, share * SAFETY)


def step_resonance(motor: Motor, inertia: float, speed: np.ndarray, microsteps: int) -> Finding:
    """Whether a motion keeps full steps at the frequency at which the rotor swings in its field.

    inertia: inertia that is fixed to the rotor [kg·m²].
    speed: magnitude of the rotor's speed at even instants [rad/s].
    microsteps: microsteps of the driver to a full step.
    """
    assert motor.steps_per_revolution is not None
    assert motor.holding_torque is not None
    inertia = motor.rotor_inertia + inertia
    frequency = math.sqrt(0.25 * motor.steps_per_revolution * motor.holding_torque / inertia) / (2.0 * math.pi)
    rate = speed * motor.steps_per_revolution / (2.0 * math.pi)
    share = float(np.mean((rate > frequency / NEAR) & (rate < frequency * NEAR)))
    value = f"{frequency:.4g} Hz of the rotor in its field"
    if share <= DWELL:
        return Finding("step_resonance", "resonance of steps", value, "ok", "no full steps at that rate for long")
    remark = f"{100.0 * share:.2g} % of the run have full steps within a factor of {NEAR:g} of it"
    if microsteps > COARSE:
        return Finding(
            "step_resonance", "resonance of steps", value, "ok", f"{remark}, in {microsteps} microsteps each"
        )
    return Finding(
        "step_resonance", "resonance of steps", value, "caution", f"{remark}; take more microsteps or another speed"
    )
