"""Rules for a train that is one axis: a motor and a gear with a load; or a screw, a rack or a belt that moves one slide."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..control.turning import turns
from ..model.gearbox import Gearbox
from ..model.losses import ConstantEfficiency
from ..simulation.results import RunArrays
from ..simulation.scenario import Scenario
from .axis_rules import SLIDE_BRAKE, brake_of_a_run, held_by
from .finding import Finding
from .gearbox_check import lost_motion
from .motion_check import inertia_ratio, resonance
from .stages import DIRECT, together

NOT_JUDGED = ("inertia_ratio", "resonance", "lost_motion")
"""rules that need one motor and one load"""
HOLDING = "holding without power"


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


def axis_rules(scenario: Scenario, result: RunArrays) -> list[Finding]:
    """Ratio of inertias, resonance, lost motion, holding and the brake of a train.

    A train that is more than one axis has the physical reason with what is not judged.
    """
    found = OneAxis.of(scenario)
    if isinstance(found, str):
        findings = [_not_judged(rule, found) for rule in NOT_JUDGED]
    else:
        motor = scenario.train().motors[found.motor]
        command = scenario.command.get(found.motor)
        findings = [
            inertia_ratio(motor, found.whole, found.load),
            *resonance(motor, found.whole, found.load, command),
            replace(
                lost_motion(found.whole, None, slides=found.slides), remark="the task of a train has no limit for it"
            )
            if found.rated
            else _not_judged("lost_motion", "the gear has no rated_output_torque"),
        ]
    controlled = "the command comes from a controller" if scenario.axes() else "it is judged in the short form alone"
    return [*findings, _not_judged("dead_zone", controlled), *_held(scenario, result)]


def _not_judged(rule: str, why: str) -> Finding:
    return Finding(rule, rule.replace("_", " "), "not judged of this train", "unknown", why)


def _held(scenario: Scenario, result: RunArrays) -> list[Finding]:
    """The brake against the loads of the run without friction, and whether it is what holds them without power."""
    brake, train = scenario.task.brake, scenario.train()
    asked = ["holding", *([] if brake is None else ["holding_brake"])]
    loads = {shaft: result[train.load_torque_of(shaft)] for shaft in scenario.loads()}
    shares = {s: turns(train, s, m.shaft) for m in train.motors.values() for s in loads}
    if len(train.motors) != 1 or None in shares.values() or train.fixed_gears() != train.gears:
        why = "the share of each motor in the loads follows from the motion; judge each axis apart"
        return [_not_judged(rule, why) for rule in asked]
    if scenario.gravity or scenario.springs or scenario.angle_torques:
        return [_not_judged(rule, "a load that depends on the angle acts beside the load of the run") for rule in asked]
    (motor,) = train.motors.values()
    need = _largest([(shares[shaft] or 0.0) * torque for shaft, torque in loads.items()])
    nothing = Finding("holding", HOLDING, "no load acts", "ok")
    if brake is None:
        return [
            nothing
            if need == 0.0
            else _not_judged("holding", f"the load takes {need:.4g} N·m at the motor; give task.brake")
        ]
    if brake.force is None and not train.is_slide(motor.shaft):
        found = brake_of_a_run(brake, need)
    else:
        force = _largest([torque for shaft, torque in loads.items() if train.is_slide(shaft)])
        found = held_by(brake.force, SLIDE_BRAKE, force, "N", "force")
    return [nothing if need == 0.0 else Finding("holding", HOLDING, "by the brake", found.verdict), found]


def _largest(torques: list[np.ndarray]) -> float:
    """Largest magnitude of a sum over time."""
    return float(np.abs(np.sum(torques, axis=0)).max()) if torques else 0.0
