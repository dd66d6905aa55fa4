"""The short form of a scenario: the tables of a motor, a gearbox and a load, with what acts on them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict

from ...control.command import CommandSignal
from ...control.controller import Controller
from ...data_sheets.components import Conditions
from ...errors import InputError
from ...inputs.cached_values import kept
from ...inputs.named_elements import Named
from ...inputs.part import Part
from ...inputs.quantities import Angle, NotNegative, Speed, Switch, Torque
from ...model.drive import Drive
from ...model.gearbox import Gearbox
from ...model.load import Load
from ...model.motor import Motor
from ...model.signals import TorqueSignal
from ...model.task import Task
from ...recorded_numbers import may_differ
from .common_tables import BASE, RECORD_NAME, ScenarioTables, SimulationTable, with_accessories
from .key_aliases import GEARBOX, LOAD, MOTOR
from .train_tables import ShaftTable, TrainInitial, TrainTables


class LoadTable(Load):
    """The driven body and the disturbance torque on it."""

    torque: TorqueSignal = TorqueSignal()  #: M_Z


class Initial(Part):
    """State of a drive at t = 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Initial(motor_speed="3000 rpm", load_speed="30 rpm").load_speed
    3.141592653589793
    """

    motor_torque: Torque = 0.0
    motor_speed: Speed = 0.0
    load_speed: Speed = 0.0
    twist: Angle = 0.0
    load_angle: Angle = 0.0
    hysteresis_capacity: Annotated[Torque, NotNegative] = 0.0
    """h, which the last turning point before t = 0 left behind"""
    on_reference: Switch = False
    """angle and speeds equal the controller's reference at t = 0"""

    @kept
    def of_train(self) -> TrainInitial:
        """The same state of the drive as a train; what is 0 is left out."""
        values = {
            "speeds": {MOTOR: self.motor_speed, LOAD: self.load_speed},
            "angles": {LOAD: self.load_angle},
            "twists": {GEARBOX: self.twist},
            "motor_torques": {MOTOR: self.motor_torque},
            "hysteresis_capacities": {GEARBOX: self.hysteresis_capacity},
        }
        found = {key: Named({name: x for name, x in named.items() if may_differ(x)}) for key, named in values.items()}
        made: TrainInitial = TrainInitial(on_reference=self.on_reference).unchecked(**found)
        return made

    @classmethod
    def of_state(cls, state: TrainInitial) -> Initial:
        """The state of a drive from the state of its train.

        Raises
        ------
        InputError
            It has a value that a drive does not have.
        """
        keys = {
            ("speeds", MOTOR): "motor_speed",
            ("speeds", LOAD): "load_speed",
            ("angles", LOAD): "load_angle",
            ("twists", GEARBOX): "twist",
            ("motor_torques", MOTOR): "motor_torque",
            ("hysteresis_capacities", GEARBOX): "hysteresis_capacity",
        }
        given = {(key, name): x for key, values in state if isinstance(values, dict) for name, x in values.items()}
        if unknown := [f"initial.{key}.{name}" for key, name in given if (key, name) not in keys]:
            raise InputError("is no state of a motor, a gearbox and a load; leave it out", *unknown)
        return cls(**{keys[place]: x for place, x in given.items()}, on_reference=state.on_reference)


class DriveTables(ScenarioTables):
    """Tables of a scenario in the short form: a drive with its inputs, controller, task and the duration of its run."""

    model_config = ConfigDict(title="Scenario")

    title: str = ""
    command: CommandSignal = CommandSignal()
    """E_C: 1 is rated voltage, or with a torque source rated torque"""
    controller: Controller | None = None
    """controller of the motor, which then has no command; its shafts are `motor` and `load`"""
    motor: Motor
    gearbox: Gearbox
    load: LoadTable
    initial: Initial = Initial()
    task: Task = Task()
    simulation: SimulationTable

    @kept
    def drive(self) -> Drive:
        """The drive without its surroundings."""
        return Drive.of_parts(motor=self.motor, gearbox=self.gearbox, load=Load.like(self.load))

    @kept
    def long(self) -> TrainTables:
        """The same in the long form.

        Raises
        ------
        InputError
            A motor, a gearbox and a load of these values cannot move, or two of them turn the motor.
        """
        if self.controller is not None and self.command != CommandSignal():
            raise InputError("both turn the motor; leave one of them out", "command", "controller")
        train = self.drive().train()  # whose parts are checked
        load = ShaftTable.like(train.shafts[LOAD], torque=self.load.torque)
        return TrainTables.like(
            train,
            title=self.title,
            shafts=Named({MOTOR: ShaftTable.like(train.shafts[MOTOR]), LOAD: load}),
            command=Named({MOTOR: self.command} if self.controller is None else {}),
            controllers=Named({} if self.controller is None else {MOTOR: self.controller}),
            initial=self.initial.of_train(),
            task=self.task,
            simulation=self.simulation,
        )

    @classmethod
    def of_long(cls, tables: TrainTables) -> DriveTables:
        """The tables of a motor, a gearbox and a load that are written in the long form, with the names that `long` gives."""
        return cls.like(
            tables,
            motor=Motor.like(tables.motors[MOTOR]),
            gearbox=Gearbox.like(tables.gears[GEARBOX]),
            load=LoadTable.like(tables.shafts[LOAD], torque=tables.shafts[LOAD].torque or TorqueSignal()),
            command=tables.command.get(MOTOR, CommandSignal()),
            controller=tables.controllers.get(MOTOR),
            initial=Initial.of_state(tables.initial),
        )

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return drive_schema()


def drive_schema() -> dict[str, Any]:
    """JSON Schema of scenario files in the short form, for editors."""
    schema = with_accessories(DriveTables.model_json_schema())
    schema["properties"]["base"] = BASE
    schema["required"] = []  # with a base, none
    for table in ("gearbox", "motor"):
        whole = schema["properties"][table]
        conditions = Conditions.model_json_schema()["properties"] if table == "gearbox" else {}
        from_record = {
            "type": "object",
            "properties": {"from": RECORD_NAME} | conditions,
            "required": ["from"],
            "description": f"A {table} of the catalogue, or of a sheet file; other keys take the place of its values. A table "
            "that says its kind takes the place of the whole one, any other changes the keys that it gives.",
        }
        schema["properties"][table] = {"anyOf": [whole, RECORD_NAME, from_record]}
    return schema
