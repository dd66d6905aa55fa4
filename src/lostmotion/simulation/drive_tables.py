"""The short form of a scenario: the tables of a motor, a gearbox and a load, with what acts on them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ConfigDict

from ..control.axis import check_torques
from ..control.controller import Controller
from ..data_sheets.components import Conditions
from ..errors import InputError
from ..inputs import described
from ..inputs.kept import kept
from ..inputs.named import Named
from ..model.drive import Drive
from ..model.gearbox import Gearbox, Transmission
from ..model.load import Load
from ..model.motor import Motor
from ..model.signals import CommandSignal, TorqueSignal, constant_or
from ..model.task import Task
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from .aliases import DRIVE, GEARBOX, LOAD, MOTOR
from .keys import renamed
from .tables import BASE, RECORD_NAME, ScenarioTables, SimulationTable, Whole, check_on_reference, with_accessories
from .train_tables import ShaftTable, TrainInitial, TrainTables


class LoadTable(described.LoadTableFields, Load):
    """The driven body and the disturbance torque on it."""


class Initial(described.InitialFields):
    """State of a drive at t = 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Initial(motor_speed="3000 rpm", load_speed="30 rpm").load_speed
    3.141592653589793
    """

    @kept
    def of_train(self) -> TrainInitial:
        """The same state of the drive as a train; what follows from a reference, or is 0, is left out."""
        of_shafts = {
            "speeds": {MOTOR: self.motor_speed, LOAD: self.load_speed},
            "angles": {LOAD: self.load_angle},
        }
        values = ({} if self.on_reference else of_shafts) | {
            "twists": {GEARBOX: self.twist},
            "motor_torques": {MOTOR: self.motor_torque},
            "hysteresis_capacities": {GEARBOX: self.hysteresis_capacity},
        }
        found = {key: {name: x for name, x in named.items() if x} for key, named in values.items()}
        return TrainInitial(**found, on_reference=self.on_reference)

    @classmethod
    def of_state(
        cls, state: TrainInitial, shaft: str = MOTOR, load: str = LOAD, motor: str = MOTOR, gear: str = GEARBOX
    ) -> Initial:
        """The state of a drive from that of its train, whose shafts, motor and gear have these names.

        Raises
        ------
        InputError
            It has a value that a drive does not have.
        """
        keys = {
            ("speeds", shaft): "motor_speed",
            ("speeds", load): "load_speed",
            ("angles", load): "load_angle",
            ("twists", gear): "twist",
            ("motor_torques", motor): "motor_torque",
            ("hysteresis_capacities", gear): "hysteresis_capacity",
        }
        given = {(key, name): x for key, values in state if isinstance(values, dict) for name, x in values.items()}
        if unknown := [f"initial.{key}.{name}" for key, name in given if (key, name) not in keys]:
            raise InputError("is no state of a motor, a gearbox and a load; leave it out", *unknown)
        return cls(**{keys[place]: x for place, x in given.items()}, on_reference=state.on_reference)

    def at_rest(self) -> Initial:
        """The same without motion and twist."""
        return Initial()


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

    def train(self) -> DriveTrain:
        return self.drive().named_train()

    @kept
    def long(self) -> TrainTables:
        train = self.train()  # whose parts are checked
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

    def prefix(self, motor: str) -> str:  # noqa: ARG002
        return ""

    def gears_by_key(self) -> Mapping[str, Transmission]:
        return {GEARBOX: self.gearbox}

    def own_key(self, key: str) -> str:
        return renamed(key, DRIVE)

    def input_key(self, name: str) -> str:
        return {"load_torque": "load.torque", "reference": "controller.reference"}.get(name, name)

    def input_keys(self) -> dict[str, str]:
        return {"command": "command", "load_torque": "load.torque"}

    def record_keys(self) -> Iterator[str]:
        yield from ("gearbox", "motor", *(f"gearbox.{name}" for name in Conditions.model_fields))

    def note(self) -> str:
        return " ".join(filter(None, map(str, (self.gearbox.note, self.motor.note))))

    def attributes(self) -> dict[str, float]:
        return {"gear_ratio": self.gearbox.ratio}

    def alone(self) -> Drive:
        return self.drive()

    def of_inertia(self, shaft: str, inertia: float) -> dict[str, Any]:
        return {shaft: getattr(self, shaft).model_copy(update={"inertia": inertia})}

    def of_axes(self, axes: Mapping[str, Controller]) -> dict[str, Any]:
        return {"controller": axes[MOTOR], "command": CommandSignal()}

    def of_gears(self, gears: Mapping[str, Transmission]) -> dict[str, Any]:
        return dict(gears)

    def of_inputs(self, given: Mapping[str, Any]) -> dict[str, Any]:
        return of_inputs(self.load, self.simulation, given)

    def open_loop(self) -> dict[str, Any]:
        return {"controller": None}

    def told(self) -> str:
        return repr(self.drive())

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return drive_schema()


def check_drive(scenario: Whole, written: DriveTables) -> None:
    """Refuse what contradicts itself in the tables of a scenario in the short form.

    Raises
    ------
    InputError, ValueError
    """
    written.drive()
    check_on_reference(written.initial, scenario.axes(), ("load_angle", "load_speed", "motor_speed"))
    speeds, motor = scenario.begin().speeds, written.motor
    if isinstance(written.gearbox.stiffness, Rigid):
        if written.initial.twist != 0.0:
            raise ValueError(f"has initial.twist = {written.initial.twist} rad, but the gearbox is rigid; leave it out")
        speed, load_speed = (speeds.get(name) for name in (MOTOR, LOAD))  # one alone says the other
        if None not in (speed, load_speed) and abs(speed / written.gearbox.ratio - load_speed) > 1e-12 * abs(
            load_speed
        ):
            raise ValueError(
                f"has initial.motor_speed = {speed} rad/s and initial.load_speed = {load_speed} rad/s, but the gearbox is "
                "rigid; their quotient must be its ratio"
            )
    if motor.kind == "torque_source" and written.initial.motor_torque != 0.0:
        raise ValueError("has initial.motor_torque, but a torque source has no such state; use command")
    if written.controller is not None and written.command != CommandSignal():
        raise InputError("both turn the motor; leave one of them out", "command", "controller")
    check_torques(scenario.axes(), {MOTOR: written.initial.motor_torque}, "initial.motor_torque")
    scenario.control()


def of_inputs(load: Load, simulation: SimulationTable | None, given: Mapping[str, Any]) -> dict[str, Any]:
    """The tables that change where `simulate` is given inputs and times."""
    changes: dict[str, Any] = {}
    if "initial" in given:
        start = given["initial"]
        changes["initial"] = start if isinstance(start, Initial) else Initial.of_state(start)
    if times := {key: given[key] for key in SimulationTable.model_fields if key in given}:
        changes["simulation"] = SimulationTable(**dict(simulation or ()) | times)
    if "command" in given:
        changes["command"] = constant_or(given["command"], CommandSignal)
    if "load_torque" in given:
        changes["load"] = LoadTable(**dict(load) | {"torque": constant_or(given["load_torque"], TorqueSignal)})
    return changes


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
