"""A scenario as one motor, one gearbox and one load, for what is defined for these alone."""

from __future__ import annotations

from typing import Any

from ..control.controller import Controller
from ..errors import InputError
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.motor import Motor
from ..model.shaft import Shaft
from ..model.signals import TorqueSignal
from ..model.train import TrainElements
from .aliases import GEARBOX, LOAD, MOTOR
from .drive_tables import DriveTables, Initial, LoadTable
from .scenario import Scenario

OTHERS = tuple(table for table in TrainElements.model_fields if table not in ("motors", "gears"))


def as_drive(scenario: Scenario, function: str) -> Scenario:
    """The scenario with the tables `motor`, `gearbox` and `load`.

    Raises
    ------
    InputError
        It is more than one motor, one gearbox and one load.
    """
    if isinstance(scenario.written, DriveTables):
        return scenario
    if (why := _more(scenario)) is not None:
        raise InputError(f"{function}: is for one motor that turns one load through one gearbox, and here {why}")
    train, tables = scenario.train(), scenario.tables
    ((name, motor),), ((gear_name, gear),) = train.motors.items(), train.gears.items()
    names = {gear.input: MOTOR, gear.output: LOAD}
    inertia = gear.inertia + train.shafts[gear.input].inertia  # of all but the rotor, which has its own limits
    load = train.shafts[gear.output]
    controller: Any = tables.controllers.get(name)
    changes: dict[str, Any] = {"command": tables.command.get(name)} if name in tables.command else {}
    if controller is not None:
        changes["controller"] = _on_shafts(controller, names)
    return Scenario.of(
        DriveTables(
            title=tables.title,
            motor=Motor.like(motor),
            gearbox=Gearbox(**{key: getattr(gear, key) for key in Gearbox.model_fields} | {"inertia": inertia}),
            load=LoadTable(
                inertia=load.inertia,
                viscous_friction=load.viscous_friction,
                friction_torque=load.friction_torque,
                torque=scenario.loads().get(gear.output, TorqueSignal()),
            ),
            initial=Initial.of_state(tables.initial, gear.input, gear.output, name, gear_name),
            task=tables.task,
            simulation=tables.simulation,
            **changes,
        )
    )


def drive_keys(scenario: Scenario) -> dict[str, str]:
    """Keys of a motor, a gear and its output shaft in the long form, and what a drive calls them."""
    train = scenario.train()
    ((motor, _),), ((gear, between),) = train.motors.items(), train.gears.items()
    found = {f"shafts.{between.output}": LOAD, f"gears.{gear}": GEARBOX, f"motors.{motor}": MOTOR}
    return found | {f"command.{motor}": "command"}


def is_drive(scenario: Scenario) -> bool:
    """Whether it is one motor that turns one load through one gearbox."""
    return isinstance(scenario.written, DriveTables) or _more(scenario) is None


def _more(scenario: Scenario) -> str | None:
    """Reason why it is more than one motor, one gearbox and one load."""
    train = scenario.train()
    if len(train.motors) != 1:
        return f"{len(train.motors)} motors turn it" if train.motors else "no motor turns it"
    if others := [f"{table}.{name}" for table in OTHERS for name in getattr(train, table)]:
        return f"{others[0]} acts too"
    if scenario.slides:
        return f"it moves the slide {next(iter(scenario.slides))}"
    if len(train.gears) != 1 or len(train.shafts) != 2:
        return f"it has {len(train.gears)} gears between {len(train.shafts)} shafts"
    ((motor_name, motor),), ((name, gear),) = train.motors.items(), train.gears.items()
    if motor.shaft != gear.input:
        return f"the motor {motor_name} is on the output of the gear {name}"
    if scenario.given():
        return f"{scenario.given_key(scenario.given()[0])} gives a motion"
    if not isinstance(scenario.controllers.get(motor_name), Controller | None):
        return f"controllers.{motor_name} is continuous"
    return _of_gear(name, gear) or _of_shafts(scenario, gear)


def _of_gear(name: str, gear: Gear) -> str | None:
    if gear.housing is not None:
        return f"the housing of {name} turns"
    for key in ("rated_input_speed", "rated_output_torque"):
        if getattr(gear, key) is None:
            return f"gears.{name}.{key} is not known"
    if gear.losses.kind not in ("map", "constant_efficiency"):
        return f"gears.{name}.losses are of kind {gear.losses.kind!r}"
    return f"gears.{name} has a transmission error" if gear.transmission_error is not None else None


def _of_shafts(scenario: Scenario, gear: Gear) -> str | None:
    shafts, plain = scenario.train().shafts, ("inertia", "viscous_friction", "friction_torque")
    for shaft, taken in ((gear.input, plain[:1]), (gear.output, plain)):
        default = Shaft().model_copy(update={key: getattr(shafts[shaft], key) for key in taken})
        if Shaft.like(shafts[shaft]) != default or (shaft == gear.input and shaft in scenario.loads()):
            return f"shafts.{shaft} has more than {', '.join(taken)}"
    return None


def _on_shafts(controller: Controller, names: dict[str, str]) -> Controller:
    """The controller with the names that the shafts have in a drive."""
    changes: dict[str, Any] = {}
    if controller.shaft is not None:
        changes["shaft"] = names[controller.shaft]
    for key in ("encoder", "position_encoder"):
        encoder = getattr(controller, key)
        if encoder is not None and encoder.shaft is not None:
            changes[key] = encoder.model_copy(update={"shaft": names[encoder.shaft]})
    return controller.model_copy(update=changes)
