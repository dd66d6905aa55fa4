"""Checks of a scenario in the long form that involve several of its tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...control.axis import check_torques
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, shown
from ..variables_of_trains import check_names
from .common_tables import Whole
from .given_motion import check_continuous
from .stepper_fields import acting
from .train_tables import LINEAR_INITIAL

if TYPE_CHECKING:
    from .train_tables import TrainTables


def check_train(scenario: Whole) -> None:
    """Refuse what contradicts itself in the tables of a scenario in the long form. Raises InputError, ValueError."""
    tables = scenario.tables
    _check_shafts(tables)
    train = scenario.train()
    tables.check(train.core(tables.loaded(), given=tables.given()))
    _check_given(tables)
    _check_controllers(scenario)
    _check_on_reference(scenario)
    core = scenario.core()
    _check_massless(scenario)
    if scenario.continuous():
        tables.check(core)
    check_names(train, core, scenario.axes(), tables)
    _check_commands(scenario)
    scenario.start()
    scenario.control()


def _check_shafts(tables: TrainTables) -> None:
    if not tables.shafts and not tables.slides:
        raise InputError("there is neither a shaft nor a slide; add [shafts.NAME] or [slides.NAME]", "shafts")
    tables.check_places(tables.shafts, tables.slides)
    for name, mass in tables.mass_matrices.items():
        for slide in mass.shafts:
            if slide in tables.slides and tables.slides[slide].inclination != 0.0:
                raise InputError(
                    "the weight of a slide follows from its mass, "
                    "which the matrix holds; leave the inclination out and give the weight in slides."
                    f"{slide}.force",
                    f"mass_matrices.{name}",
                    f"slides.{slide}.inclination",
                )
    for key, linear in LINEAR_INITIAL.items():
        of_slides = tables.linear_drives() if key in ("twists", "hysteresis_capacities") else tables.slides
        for given, other in ((key, linear), (linear, key)):
            for name in getattr(tables.initial, given):
                if (name in of_slides) == (given == key):
                    what = "moves along a straight line" if given == key else "is none that moves along a straight line"
                    raise InputError(f"{shown(name)} {what}; give initial.{other}.{name}", f"initial.{given}.{name}")


def _check_on_reference(scenario: Whole) -> None:
    """Refuses `initial.on_reference` where no reference says where an axis is, or where another key says so, too."""
    initial = scenario.tables.initial
    if not initial.on_reference:
        return
    if not any(c.reference.kind == "position" for c in scenario.axes().values()):
        raise ValueError("has initial.on_reference but no controller with a reference of the position; leave it out")
    for table in ("angles", "speeds", "positions", "slide_speeds"):
        for name in getattr(initial, table):
            key = scenario.own_key(f"initial.{table}.{name}")
            raise ValueError(f"has initial.on_reference and {key}, which follows from it; leave one of them out")


def _check_given(tables: TrainTables) -> None:
    for name in tables.given():
        key, shaft = tables.given_key(name), tables.movers()[name]
        if shaft.speed is not None and shaft.motion is not None:
            raise InputError("both give the motion; leave one out", f"{key.removesuffix('.motion')}.speed", key)
        if name in tables.initial.of_all("speeds"):
            how = "moves" if name in tables.slides else "turns"
            raise InputError(
                f"both say how fast the {_kind(tables, name)} {how} at t = 0; leave the initial speed out",
                key,
                tables.initial_key("speeds", name),
            )
        if shaft.motion is None:
            continue
        if name in tables.initial.of_all("angles"):
            raise InputError(
                f"both say where the {_kind(tables, name)} is at t = 0; leave the initial one out",
                key,
                tables.initial_key("angles", name),
            )
        try:
            check_continuous(shaft.motion, "m" if name in tables.slides else "rad")
        except ValueError as problem:
            raise InputError(problem, key) from None


def _check_massless(scenario: Whole) -> None:
    tables, train, massless = scenario.tables, scenario.train(), scenario.core().massless_shafts()
    for key in ("speeds", "slide_speeds"):
        for name in getattr(tables.initial, key):
            if name in massless:
                raise InputError(
                    f"{name} has no inertia, and its speed follows from the torques on it; leave "
                    "it out, or give an inertia",
                    f"initial.{key}.{name}",
                )
    for motor, controller in scenario.axes().items():
        encoders = [e.shaft for e in (controller.encoder, controller.position_encoder) if e is not None]
        for name in {train.motors[motor].shaft, tables.controlled(motor), *filter(None, encoders)}:
            if name in massless:
                raise InputError(f"measures or turns {name}, which has no inertia; give it one", f"controllers.{motor}")


def _check_controllers(scenario: Whole) -> None:
    tables = scenario.tables
    motors = scenario.train().motors
    for name in tables.controllers:
        if name not in motors:
            meant = did_you_mean(name, motors, f"the motors are {', '.join(motors) or 'none'}")
            raise InputError(f"is no motor of this train; {meant}", f"controllers.{name}")
        if motors[name].kind == "stepper":
            raise InputError(
                f"controls a stepper, which is turned without a loop; give command.{name}.stepping in its place",
                f"controllers.{name}",
            )
        if name in tables.command:
            raise InputError(
                "both turn the same motor; leave one of them out", f"command.{name}", f"controllers.{name}"
            )
    check_torques(scenario.axes(), tables.initial.motor_torques, "initial.motor_torques.{}")


def _kind(tables: TrainTables, shaft: str) -> str:
    return "slide" if shaft in tables.slides else "shaft"


def _check_commands(scenario: Whole) -> None:
    tables, train, known = scenario.tables, scenario.train(), scenario.commanded()
    for name in tables.command:
        if name not in known:
            meant = did_you_mean(name, known, f"those with a command are {', '.join(known) or 'none'}")
            raise InputError(f"is no motor, brake or friction clutch of this train; {meant}", f"command.{name}")
    idle = [f"command.{name}" for name in known if name not in tables.command and name not in train.motors]
    if idle:
        verb = "is" if len(idle) == 1 else "are"
        reason = f"{verb} missing; add a number from 0 (open) to 1 (full torque), or a signal"
        raise InputError(reason, *idle)
    for name in known:
        try:
            acting(tables, name)
        except ValueError as problem:
            raise InputError(problem, f"command.{name}") from None
