"""The fields of steppers, as their drivers turn them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...control.command import CommandSignal, CurrentLevel, FieldAngle, Stepping
from ...inputs.quantities import Number
from ...inputs.refusal_messages import did_you_mean, shown
from ...model.shaft_ratio import turns
from ...model.signals import Signal
from .initial_state import angles_at_start

if TYPE_CHECKING:
    from .train_tables import TrainTables


def acting(tables: TrainTables, name: str) -> Signal[Number]:
    """The command of a motor, brake or clutch as it acts; of a stepper the angle of its field [rad].

    Raises ValueError: a brake, a clutch or the driver of a stepper cannot follow it.
    """
    command = tables.command.get(name, CommandSignal())
    return tables.acting(name) if command.stepping is None else _field(tables, name, command.stepping)


def currents(tables: TrainTables) -> dict[str, Signal[Number]]:
    """Current levels of the steppers whose current is reduced at rest: 1 in motion, 0 at rest."""
    found: dict[str, Signal[Number]] = {}
    for name, motor in tables.motors.items():
        if motor.kind == "stepper" and motor.standstill_current not in (None, 1.0):
            field = acting(tables, name)
            found[name] = CurrentLevel(field=field) if isinstance(field, FieldAngle) else CommandSignal(mean=1.0)
    return found


def _field(tables: TrainTables, name: str, stepping: Stepping) -> FieldAngle:
    train, motor = tables.train(), tables.motors.get(name)
    if motor is None or motor.kind != "stepper":
        raise ValueError('has stepping, which only a motor of kind "stepper" follows; leave it out')
    shaft = stepping.shaft or list(train.shafts)[-1]
    if shaft not in train.shafts:
        meant = did_you_mean(shaft, train.shafts, f"the shafts are {', '.join(train.shafts)}")
        raise ValueError(f"has stepping.shaft = {shown(shaft)}, which is no shaft; {meant}")
    if stepping.pulses is None and train.is_slide(shaft) != (stepping.travel is not None):
        what, wanted = ("slide", "travel") if train.is_slide(shaft) else ("shaft", "reference")
        raise ValueError(f"has a stepping for the {what} {shaft}; give stepping.{wanted}")
    ratio = 1.0 if stepping.pulses is not None else turns(train, motor.shaft, shaft)
    if ratio is None:
        raise ValueError(
            f"has a stepping for {shaft}, which no gears join to {motor.shaft}; give another stepping.shaft"
        )
    state = tables.initial.of_train()
    angles = angles_at_start(train, state.of_all("angles"), state.of_all("twists"), tables.given())
    until = tables.simulation.duration
    field: FieldAngle = FieldAngle(stepping=stepping, turns=ratio, step=motor.full_step, start=0.0, until=until)
    field = field.unchecked(start=angles[motor.shaft])  # as it is recorded
    field.instants()  # which refuses what the driver cannot give
    return field
