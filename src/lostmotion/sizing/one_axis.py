"""Rules for a train that is one axis: a motor and a gear with a load; or a screw, a rack or a belt that moves one slide."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ..model.gearbox import Gearbox
from ..model.losses import ConstantEfficiency
from ..simulation.explanation import smallest_commands
from ..simulation.results import RunArrays
from ..simulation.scenario import Scenario
from .finding import Finding
from .gearbox_check import lost_motion
from .motion_check import inertia_ratio, resonance
from .stages import DIRECT, together


@dataclass(frozen=True)
class OneAxis:
    """A train that is one axis, as a motor and a gearbox with a load behind it; a slide in units of translation."""

    motor: str
    whole: Gearbox
    """gearbox, shafts and stage as one gear"""
    load: float
    """inertia of the load [kg·m²], or mass of the slide [kg]"""
    slides: bool
    rated: bool
    """whether a torque at the load is known, to which its lost motion is a share"""

    @classmethod
    def of(cls, scenario: Scenario) -> OneAxis | str:
        """The axis of a train, or why it is none."""
        train, stages = scenario.train(), scenario.linear_drives()
        between = [name for name in train.gears if name not in stages]
        if not stages and not scenario.slides:
            return cls._turning(scenario)
        if len(train.motors) != 1 or len(stages) != 1 or len(between) > 1 or len(scenario.slides) != 1:
            return "it needs one motor, at most one gear, and one screw, rack or belt that moves one slide"
        ((name, motor),), ((stage_name, stage),) = train.motors.items(), stages.items()
        gear = train.gears[between[0]] if between else None
        first = train.gears[stage_name].input if gear is None else gear.input
        chained = gear is None or (gear.housing is None and gear.output == train.gears[stage_name].input)
        if motor.shaft != first or not chained or not train.is_slide(train.gears[stage_name].output):
            return "the motor, the gear and what moves the slide must follow each other in a chain"
        if len(train.shafts) != 2 + len(between) or scenario.mass_matrices:
            return "further shafts or masses move with the slide; linearize the train"
        g = DIRECT.model_copy(update={"rated_output_torque": motor.rated_torque}) if gear is None else _gearbox(gear)
        inertia = g.inertia + train.shafts[first].inertia
        if gear is not None:
            inertia += train.shafts[gear.output].inertia / gear.ratio**2
        whole = together(g.model_copy(update={"inertia": inertia}), stage)
        return cls(name, whole, next(iter(scenario.slides.values())).mass, True, True)

    @classmethod
    def _turning(cls, scenario: Scenario) -> OneAxis | str:
        train = scenario.train()
        if len(train.motors) != 1 or len(train.gears) != 1 or len(train.shafts) != 2 or scenario.mass_matrices:
            return "it needs one motor and one gear between two shafts, or a screw, rack or belt that moves one slide"
        ((name, motor),), (gear,) = train.motors.items(), train.gears.values()
        if motor.shaft != gear.input or gear.housing is not None or not train.shafts[gear.output].inertia > 0.0:
            return "the motor must turn a load with an inertia through the gear"
        g = _gearbox(gear)
        whole = g.model_copy(update={"inertia": g.inertia + train.shafts[gear.input].inertia})
        return cls(name, whole, train.shafts[gear.output].inertia, False, gear.rated_output_torque is not None)


def _gearbox(gear: Any) -> Gearbox:
    """A gear of a train as a gearbox without losses; one without a rated torque has the rated torque of `DIRECT`."""
    known = {key: value for key in Gearbox.model_fields if (value := getattr(gear, key, None)) is not None}
    own = DIRECT.model_dump(include={"rated_input_speed", "rated_output_torque"})
    lossless = {"losses": ConstantEfficiency(efficiency=1.0), "loss_range": None}
    return Gearbox(**{**own, **known, **lossless})


def axis_rules(scenario: Scenario, axis: OneAxis | str, result: RunArrays) -> list[Finding]:
    """Ratio of inertias, resonance, dead zone and lost motion of a train that is one axis; of another the reason why not."""
    if isinstance(axis, str):
        found = [not_judged(rule, axis) for rule in ("inertia_ratio", "resonance", "lost_motion")]
    else:
        motor = scenario.train().motors[axis.motor]
        found = [
            inertia_ratio(motor, axis.whole, axis.load),
            *resonance(motor, axis.whole, axis.load, scenario.tables.command.get(axis.motor)),
            _lost_motion(axis, scenario.task.max_lost_motion),
        ]
    return [*found, dead_zone(scenario, result)]


def not_judged(rule: str, why: str) -> Finding:
    """A rule that a train gives no answer to."""
    return Finding(rule, rule.replace("_", " "), "not judged", "unknown", why)


def _lost_motion(axis: OneAxis, limit: float | None) -> Finding:
    if not axis.rated:
        return not_judged("lost_motion", "the gear has no rated_output_torque")
    if axis.slides and limit is not None:
        return not_judged("lost_motion", "task.max_lost_motion is an angle, and that of a slide is a length")
    found = lost_motion(axis.whole, limit, slides=axis.slides)
    return replace(found, remark="there is no limit for that of a slide") if axis.slides else found


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
    inputs = scenario.core(sampled=False).input_names()
    others = {n: float(result[n][0]) for n in inputs if n != train.command_of(name)}
    forward, backward = smallest_commands(scenario, others)
    peak = float(abs(result[train.command_of(name)]).max())
    value = f"the load moves above a command of {forward:.4g} and below {backward:.4g}"
    moves = bool((result[train.speed_of(motor.shaft)] != 0.0).any())
    if peak == 0.0:
        return Finding("dead_zone", "dead zone", value, "ok", "the command is 0 throughout")
    if peak <= min(forward, -backward) and not moves:
        remark = f"the command never exceeds {peak:.4g}: the load does not move"
        return Finding("dead_zone", "dead zone", value, "warning", remark)
    small = peak < 3.0 * max(forward, -backward)
    remark = f"a large part of the command, which reaches {peak:.4g}" if small else ""
    return Finding("dead_zone", "dead zone", value, "caution" if small else "ok", remark)
