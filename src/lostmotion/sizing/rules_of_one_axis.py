"""Rules for a train that is one axis: a motor that moves one load, through gears, a screw, a rack or a belt in a chain."""

from ..model.gears_in_series import DIRECT
from ..model.shaft_ratio import turns
from ..simulation.runs.results import RunArrays
from ..simulation.runs.stuck_contacts import smallest_commands
from ..simulation.scenario.one_axis import OneAxis, tied_together
from ..simulation.scenario.scenario import Scenario
from .finding import Finding, not_judged
from .gearbox_check import lost_motion
from .motion_check import inertia_ratio, resonance


def axis_rules(scenario: Scenario, axis: OneAxis | str, result: RunArrays) -> list[Finding]:
    """Ratio of inertias, resonance, dead zone and lost motion; of a train that has none of them the reason why."""
    train, found = scenario.train(), list[Finding]()
    if not isinstance(axis, str) and train.is_slide(train.motors[axis.motor].shaft):
        return [dead_zone(scenario, result)]  # a linear motor has neither a ratio of inertias nor a gear
    if isinstance(axis, str):
        found = [not_judged(rule, axis) for rule in ("resonance", "lost_motion")]
    else:
        motor = train.motors[axis.motor]
        found = [
            *resonance(motor, axis.whole, axis.load, scenario.tables.command.get(axis.motor)),
            lost_motion(axis.whole, scenario.task.max_lost_motion, slides=axis.slides),
        ]
    return [_inertias(scenario), *found, dead_zone(scenario, result)]


def _inertias(scenario: Scenario) -> Finding:
    """Ratio of the inertia of all parts that move with the one motor to the inertia of its rotor."""
    train = scenario.train()
    why = f"{len(train.motors) or 'no'} motors turn it" if len(train.motors) != 1 else tied_together(train)
    if why is not None:
        return not_judged("inertia_ratio", why)
    ((name, motor),) = train.motors.items()
    if not motor.rotor_inertia > 0.0:
        return not_judged("inertia_ratio", "the motor has no rotor_inertia")
    of_shafts = (shaft.inertia * (turns(train, name, motor.shaft) or 0.0) ** 2 for name, shaft in train.shafts.items())
    of_gears = (gear.inertia * (turns(train, gear.input, motor.shaft) or 0.0) ** 2 for gear in train.gears.values())
    key = scenario.motor_key(name)
    return inertia_ratio(motor, DIRECT, sum(of_shafts) + sum(of_gears), key=key)


def depends_on_angles(scenario: Scenario) -> bool:
    """Whether torques act that depend on the angles of shafts."""
    return bool(scenario.gravity or scenario.springs or scenario.angle_torques)


def dead_zone(scenario: Scenario, result: RunArrays) -> Finding:
    """The commands that move the load from rest."""
    train = scenario.train()
    if len(train.motors) != 1:
        return not_judged("dead_zone", f"{len(train.motors)} motors turn the train; judge each axis apart")
    if given := scenario.given():
        return not_judged("dead_zone", f"{scenario.key_in_file(scenario.given_key(given[0]))} gives a motion")
    if depends_on_angles(scenario):
        return not_judged("dead_zone", "a load that depends on the angle acts")
    if scenario.continuous():
        return not_judged("dead_zone", "a continuous controller turns the motor, which sees the smallest error")
    ((name, motor),) = train.motors.items()
    if motor.kind == "stepper":
        return not_judged("dead_zone", "the command of a stepper is an angle, which moves the load in steps")
    inputs = scenario.core(sampled=False).input_names()
    others = {n: float(result[n][0]) for n in inputs if n != train.variable(name, "command")}
    forward, backward = smallest_commands(scenario, others)
    peak = float(abs(result[train.variable(name, "command")]).max())
    value = f"the load moves above a command of {forward + 0.0:.4g} and below {backward + 0.0:.4g}"  # where it is -0.0
    moves = bool((result[train.variable(motor.shaft, "speed")] != 0.0).any())
    if peak == 0.0:
        return Finding("dead_zone", "dead zone", value, "ok", "the command is 0 throughout")
    if peak <= min(forward, -backward) and not moves:
        remark = f"the command never exceeds {peak:.4g}: the load does not move"
        return Finding("dead_zone", "dead zone", value, "warning", remark)
    small = peak < 3.0 * max(forward, -backward)
    remark = f"a large part of the command, which reaches {peak:.4g}" if small else ""
    return Finding("dead_zone", "dead zone", value, "caution" if small else "ok", remark)
