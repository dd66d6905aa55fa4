"""Trains that are one axis: a motor that moves one load, through gears, a screw, a rack or a belt in a chain."""

from __future__ import annotations

from dataclasses import dataclass

from ...model.gear import Gear
from ...model.gearbox import Gearbox
from ...model.gears_in_series import DIRECT, in_series
from ...model.shaft_ratio import turns
from ...model.torsion import Rigid
from ...model.train import DriveTrain
from .scenario import Scenario


@dataclass(frozen=True)
class OneAxis:
    """A train that is one axis, as a motor and a gearbox with a load behind it; a slide in units of translation."""

    motor: str
    whole: Gearbox  # all gears and shafts between the motor and the load as one gear
    load: float  # inertia of the load [kg·m²], or mass of the slide [kg]
    slides: bool

    @classmethod
    def of(cls, scenario: Scenario) -> OneAxis | str:
        """The axis of a train, or why it is none."""
        train = scenario.train()
        if len(train.motors) != 1:
            return f"{len(train.motors) or 'no'} motors turn it"
        ((name, motor),) = train.motors.items()
        if (tied := tied_together(train)) is not None:
            return tied
        whole, shaft = DIRECT, motor.shaft
        rated = motor.rated_torque if motor.holding_torque is None else motor.holding_torque
        left, inertia = dict(train.gears), train.shafts[shaft].inertia
        while following := [key for key, gear in left.items() if gear.input == shaft]:
            gear = left.pop(following[0])
            whole, rated = _in_chain(whole, inertia, gear), gear.rated_output_torque or rated * abs(gear.ratio)
            shaft = gear.output
            inertia = train.shafts[shaft].inertia
        if left or len(train.shafts) != len(train.gears) + 1:
            return "its shafts are no chain from the motor to one load"
        if not inertia > 0.0 and train.gears:
            return f"the load {shaft} has no inertia"
        return cls(name, whole.model_copy(update={"rated_output_torque": rated}), inertia, train.is_slide(shaft))


def tied_together(train: DriveTrain) -> str | None:
    """Reason why not all shafts of a train turn in fixed ratios to each other, each with an inertia of its own."""
    if train.mass_matrices:
        return (
            f"{', '.join(next(iter(train.mass_matrices.values())).shafts)} move with a mass matrix; linearize the train"
        )
    first, *others = train.shafts
    loose = next((shaft for shaft in others if turns(train, shaft, first) is None), None)
    return None if loose is None else f"no fixed ratio leads from {first} to {loose}"


def _in_chain(before: Gearbox, inertia: float, gear: Gear) -> Gearbox:
    """Gears and the next one behind them, with the inertia of the shaft between, as one gear without losses."""
    whole = before.model_copy(
        update={
            "ratio": before.ratio * abs(gear.ratio),
            "inertia": before.inertia + (inertia + gear.inertia) / (before.ratio * before.ratio),
            "stiffness": gear.stiffness
            if before.stiffness == Rigid()
            else in_series(before, gear.stiffness, abs(gear.ratio)),
            "mesh_damping": gear.mesh_damping,
            "hysteresis": gear.hysteresis or before.hysteresis,
        }
    )
    return Gearbox.model_validate(whole.model_dump())
