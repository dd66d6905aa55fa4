"""The check of a drive without power: whether the loads of a run move it, and whether the brake holds them."""

import math

import numpy as np

from .. import _core
from ..model.shaft_ratio import turns
from ..simulation.runs.results import RunArrays
from ..simulation.scenario.scenario import Scenario
from ..test_rig.virtual_rig import TestRig
from .axis_rules import BRAKE, SLIDE_BRAKE, against, brake_of_a_run, held_by
from .finding import Finding, not_judged
from .holding import holding
from .rules_of_one_axis import depends_on_angles

HOLDING = "holding with command 0"


def holdings(scenario: Scenario, result: RunArrays) -> list[Finding]:
    """Whether the drive bears the loads of the run with command 0, and the brake of its task against them."""
    train, brake = scenario.train(), scenario.task.brake
    loads = {shaft: result[train.variable(shaft, "load_torque")] for shaft in scenario.loads()}
    if (why := _many_ways(scenario)) is not None:
        return [not_judged(rule, why) for rule in ("holding", *(() if brake is None else ("holding_brake",)))]
    (motor,) = train.motors.values()
    if motor.kind == "stepper" and brake is None:
        return [not_judged("holding", "a stepper holds by its current, or without it by its detents")]
    at_motor = [(turns(train, shaft, motor.shaft) or 0.0) * torque for shaft, torque in loads.items()]
    held: list[Finding] = []
    if brake is not None and brake.force is None and not train.is_slide(motor.shaft):
        held = [brake_of_a_run(brake, _largest(at_motor))]
    elif brake is not None:
        slides = [torque for shaft, torque in loads.items() if train.is_slide(shaft)]
        held = [held_by(brake.force, SLIDE_BRAKE, _largest(slides), "N", "force")]
    on_motor = {name: b for name, b in train.brakes.items() if b.shaft == motor.shaft}
    if not held and len(on_motor) == 1:
        ((name, own),) = on_motor.items()
        held = [
            against(
                "holding_brake",
                BRAKE,
                _largest(at_motor),
                own.breakaway_torque or own.torque,
                "N·m",
                "torque of the brake",
                scenario.key_in_file(f"brakes.{name}.torque"),
            )
        ]
    acting = {shaft: torque for shaft, torque in loads.items() if torque.any()}
    if not acting:
        return [Finding("holding", HOLDING, "no load acts", "ok", _static_holding(scenario)), *held]
    return [*_by_runs(scenario, result, acting, held), *held]


def _many_ways(scenario: Scenario) -> str | None:
    """Why what a load does at the motor is not known."""
    train = scenario.train()
    motors = [motor.shaft for motor in train.motors.values()]
    if len(motors) != 1 or train.fixed_gears() != train.gears:
        return "the share of each motor in the loads follows from the motion; judge each axis apart"
    if unreached := [shaft for shaft in scenario.loads() if turns(train, shaft, motors[0]) is None]:
        return f"no gear joins {unreached[0]} to the motor"
    return "a load that depends on the angle acts" if depends_on_angles(scenario) else None


def _by_runs(
    scenario: Scenario, result: RunArrays, acting: dict[str, np.ndarray], held: list[Finding]
) -> list[Finding]:
    """One finding for the largest and one for the least load."""
    train, why = scenario.train(), None
    switched = [*train.switched().values()]
    if len(acting) > 1:
        why = f"loads act on {' and '.join(acting)}"
    elif scenario.given():
        why = f"{scenario.key_in_file(scenario.given_key(scenario.given()[0]))} gives a motion"
    elif switched:
        why = f"{switched[0]} holds as its command says"
    if why is not None:
        if held:
            return [Finding("holding", HOLDING, "by the brake", held[0].verdict)]
        return [not_judged("holding", f"{why}; give task.brake")]
    ((shaft, torque),) = acting.items()
    fastest = float(abs(result[train.variable(shaft, "speed")]).max())
    extremes = sorted({float(torque.max()), float(torque.min())} - {0.0})
    return [_held(scenario, shaft, load, fastest, held) for load in extremes]


def _held(scenario: Scenario, shaft: str, load: float, speed: float, held: list[Finding]) -> Finding:
    train = scenario.train()
    what = f"holding {load:.4g} {'N' if train.is_slide(shaft) else 'N·m'} with command 0"
    try:
        found = holding(scenario, load, speed, shaft)
    except _core.SolverError as error:
        return Finding("holding", what, "cannot be determined", "unknown", str(error))
    unit = train.speed_unit(shaft)
    if found.holds:
        value = f"the load stays at rest, and comes to rest if the power fails at {abs(found.begin):.3g} {unit}"
        return Finding("holding", what, value, "ok")
    if found.from_rest != 0.0:
        word = "force" if train.is_slide(shaft) else "torque"
        value = f"the load {word} drives the load {_at(found.from_rest, unit)}"
    else:
        value = f"at rest only: if the power fails at {abs(found.begin):.3g} {unit}, the load goes on {_at(found.from_motion, unit)}"
    if held:
        return Finding("holding", what, value, held[0].verdict, "the brake has to hold the load")
    if not scenario.task.hold_without_power:
        return Finding("holding", what, value, "ok", "not required by the task")
    remedy = "it needs a brake, task.brake, or a motor under control, task.hold_without_power = false"
    return Finding("holding", what, value, "warning", "; ".join(filter(None, [remedy, _static_holding(scenario)])))


def _at(speed: float, unit: str) -> str:
    return f"at {speed:.3g} {unit}" if math.isfinite(speed) else "ever faster"


def _largest(torques: list[np.ndarray]) -> float:
    """Largest magnitude of a sum over time."""
    return float(np.abs(np.sum(torques, axis=0)).max()) if torques else 0.0


def _static_holding(scenario: Scenario) -> str:
    """Torque that the one gear alone holds at rest."""
    gears = scenario.train().gears
    if len(gears) != 1 or scenario.slides:
        return ""
    (gear,) = gears.values()
    if gear.losses.kind != "map" or gear.stiffness.kind == "rigid":
        return "the gearbox alone holds 0 N·m at rest"
    back = TestRig(gear.gearbox()).backdriving_torque()
    if back is None:
        return "the gearbox alone holds more than three times rated torque at rest"
    return f"the gearbox alone holds {back:.4g} N·m at rest"
