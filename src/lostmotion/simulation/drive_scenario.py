"""A scenario in the short form: a drive of a motor, a gearbox and a load, with what acts on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Self

from pydantic import ConfigDict, model_validator

from .. import _core
from ..control.axis import check_torques, driven
from ..control.continuous import ContinuousController
from ..control.controller import Controller
from ..data_sheets.components import Conditions, use_records
from ..errors import InputError
from ..inputs import described
from ..inputs.kept import kept, kept_while_used
from ..model.drive import Drive
from ..model.gearbox import Gearbox, Transmission
from ..model.load import Load
from ..model.motor import Motor
from ..model.shaft import Shaft
from ..model.signals import CommandSignal, Signal, TorqueSignal
from ..model.task import Task
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from .keys import set_values
from .scenario import BASE, RECORD_NAME, Scenario, SimulationTable, check_on_reference, with_accessories
from .variables import STATES, VARIABLES, Variable, add_efficiency


class LoadTable(Load):
    """The driven body and the disturbance torque on it."""

    torque: TorqueSignal = TorqueSignal()
    """M_Z"""


class Initial(described.InitialFields):
    """State of a drive at t = 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Initial(motor_speed="3000 rpm", load_speed="30 rpm").load_speed
    3.141592653589793
    """

    def at_rest(self) -> Initial:
        """The same without motion and twist."""
        return Initial()


def state_of(initial: Initial) -> dict[str, float]:
    """The state by the names of its variables."""
    return {name: getattr(initial, name) for name in STATES}


def capacities_of(initial: Initial) -> dict[str, float]:
    """Hysteresis capacities [N·m] by gear."""
    return {"gearbox": initial.hysteresis_capacity}


class DriveScenario(Scenario):
    """A scenario in the short form: a drive with its inputs, controller, task and the duration of its run.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.load("paper-2dof-nl-small").replace(**{"load.inertia": "3 kg*m^2"}).load.inertia
    3.0
    """

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

    @model_validator(mode="before")
    @classmethod
    def _sampled(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        controller, load = data.get("controller"), data.get("load")
        for key in ("speed", "motion"):
            if isinstance(load, Mapping) and key in load:
                raise InputError(
                    "a given motion requires a drive train; read the file by lm.load, or make a TrainScenario with "
                    'shafts={"load": ...}',
                    keys=(f"load.{key}",),
                )
        if isinstance(controller, ContinuousController) or (
            isinstance(controller, Mapping) and controller.get("kind") == "continuous"
        ):
            raise InputError(
                "a continuous controller requires a drive train; read the file by lm.load, or make a "
                'TrainScenario with controllers={"motor": ...}',
                keys=("controller.kind",),
            )
        return data

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self.check()
        return self

    def check(self) -> None:
        """Refuse parts that do not fit together.

        Raises
        ------
        ValueError
        """
        drive = self.drive()
        check_on_reference(self.initial, self.axes(), ("load_angle", "load_speed", "motor_speed"))
        start = self.begin()
        if isinstance(drive.gearbox.stiffness, Rigid):
            if start.twist != 0.0:
                raise ValueError(f"has initial.twist = {start.twist} rad, but the gearbox is rigid; leave it out")
            if abs(start.motor_speed / drive.gearbox.ratio - start.load_speed) > 1e-12 * abs(start.load_speed):
                raise ValueError(
                    f"has initial.motor_speed = {start.motor_speed} rad/s and initial.load_speed = {start.load_speed} "
                    "rad/s, but the gearbox is rigid; their quotient must be its ratio"
                )
        if drive.motor.kind == "torque_source" and start.motor_torque != 0.0:
            raise ValueError("has initial.motor_torque, but a torque source has no such state; use command")
        if self.controller is not None and self.command != CommandSignal():
            raise InputError(
                "both turn the motor; leave one of them out",
                keys=("command", "controller"),
            )
        check_torques(self.axes(), {"motor": start.motor_torque}, "initial.motor_torque")
        self.control()

    def axes(self) -> dict[str, Controller]:
        return {} if self.controller is None else {"motor": self.controller}

    def prefix(self, motor: str) -> str:  # noqa: ARG002
        return ""

    def controller_key(self, motor: str) -> str:  # noqa: ARG002
        return "controller"

    def with_axes(self, axes: Mapping[str, Controller]) -> DriveScenario:
        return self.model_copy(update={"controller": axes["motor"]})

    def without_controllers(self) -> DriveScenario:
        return self.replace(controller=None)

    def given(self) -> list[str]:
        return []

    def input_key(self, name: str) -> str:
        return {"load_torque": "load.torque", "reference": "controller.reference"}.get(name, name)

    def gear_key(self, name: str) -> str:
        return name

    def gears_by_key(self) -> dict[str, Transmission]:
        return {"gearbox": self.gearbox}

    def motor_key(self, name: str) -> str:
        return name

    def with_gears(self, gears: Mapping[str, Any]) -> DriveScenario:
        return self.model_copy(update=dict(gears))

    def record_keys(self) -> Iterator[str]:
        yield from ("gearbox", "motor", *(f"gearbox.{name}" for name in Conditions.model_fields))

    def input_keys(self) -> dict[str, str]:
        return {"command": "command", "load_torque": "load.torque"}

    def attributes(self) -> dict[str, float]:
        return {"gear_ratio": self.gearbox.ratio}

    def ambient_temperature(self) -> float:
        return self.task.ambient_temperature

    def variables(self) -> tuple[Variable, ...]:
        return VARIABLES

    def derive(self, data: dict[str, Any], time: Any) -> None:  # noqa: ARG002
        add_efficiency(data, self.gearbox.ratio)

    def sliding(self) -> dict[str, tuple[bool, bool]]:
        return {}

    def note(self) -> str:
        return " ".join(filter(None, [self.gearbox.note, self.motor.note]))

    def continuous(self) -> dict[str, ContinuousController]:
        """The continuous controllers: a drive in the short form has none."""
        return {}

    def start(self, initial: Initial | None = None) -> dict[str, float]:
        return state_of(self.begin() if initial is None else initial)

    def capacities(self, initial: Initial | None = None) -> dict[str, float]:
        return capacities_of(initial or self.initial)

    def signals(self) -> dict[str, Signal[Any]]:
        """All that acts on the drive, by the name of its result variable."""
        return {"command": self.command, "load_torque": self.load.torque}

    @kept
    def begin(self) -> Initial:
        if not self.initial.on_reference or self.controller is None:
            return self.initial
        angle, speed = (float(value) for value in self.controller.reference.at(0.0)[:2])
        if self.controller.shaft == "motor":
            angle, speed = angle / self.gearbox.ratio - self.initial.twist, speed / self.gearbox.ratio
        found = {"load_angle": angle, "load_speed": speed, "motor_speed": speed * self.gearbox.ratio}
        return self.initial.model_copy(update=found)

    def core(self, *, sampled: bool = True) -> _core.Train:
        return self._own_core() if sampled else self.drive().core()

    @kept_while_used
    def _own_core(self) -> _core.Train:
        return self.drive().core(None if self.controller is None else driven(self.controller))

    @kept
    def train(self) -> DriveTrain:
        """The drive as a train: shafts `motor` and `load`, joined by the gear `gearbox`, and on the first the motor `motor`."""
        return self.drive().train()

    @kept
    def named_train(self) -> DriveTrain:
        return self.drive().named_train()

    def long(self) -> Scenario:
        """The scenario in the long form: shafts `motor` and `load`, gear `gearbox`, motor `motor`."""
        train, start = self.train(), self.initial
        load = {key: getattr(train.shafts["load"], key) for key in Shaft.model_fields}
        initial: dict[str, Any] = {
            "speeds": {} if start.on_reference else {"motor": start.motor_speed, "load": start.load_speed},
            "angles": {} if start.on_reference else {"load": start.load_angle},
            "twists": {"gearbox": start.twist} if start.twist else {},
            "motor_torques": {"motor": start.motor_torque} if start.motor_torque else {},
            "hysteresis_capacities": {"gearbox": start.hysteresis_capacity} if start.hysteresis_capacity else {},
            "on_reference": start.on_reference,
        }
        tables: dict[str, Any] = {
            "title": self.title,
            "shafts": {"motor": {}, "load": {**load, "torque": self.load.torque}},
            "motors": train.motors,
            "gears": train.gears,
            "command": {} if self.controller is not None else {"motor": self.command},
            "controllers": self.axes(),
            "initial": initial,
            "simulation": self.simulation,
        }
        return Scenario(**tables)

    def _with_inputs(self, given: Mapping[str, Any]) -> DriveScenario:
        return with_surroundings(dict(self), **given)

    @kept
    def drive(self) -> Drive:
        """The drive without its surroundings."""
        load = Load(**{name: getattr(self.load, name) for name in Load.model_fields})
        return Drive(motor=self.motor, gearbox=self.gearbox, load=load)

    def __repr__(self) -> str:
        title = f"{self.title!r}, " if self.title else ""
        return f"Scenario({title}{self.drive()!r}, {self.simulation.duration:.4g} s, {self.simulation.samples} samples)"

    def replace(self, **changes: Any) -> DriveScenario:
        data = self.model_dump()
        set_values(data, changes.items())
        use_records(data)
        return DriveScenario(**data)

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return json_schema()


Scenario.forms[False] = DriveScenario


def with_surroundings(tables: Mapping[str, Any], **given: Any) -> DriveScenario:
    """The scenario of such tables with the inputs and times that `simulate` is given."""
    changes = dict(tables)
    if times := {key: given[key] for key in SimulationTable.model_fields if key in given}:
        changes["simulation"] = SimulationTable(**dict(changes.get("simulation", ())) | times)
    if "command" in given:
        changes["command"] = _signal(given["command"], CommandSignal)
    if "load_torque" in given:
        changes["load"] = LoadTable(**dict(changes["load"]) | {"torque": _signal(given["load_torque"], TorqueSignal)})
    if "initial" in given:
        changes["initial"] = given["initial"]
    return DriveScenario(**changes)


def of_drive(drive: Drive, **changes: Any) -> DriveScenario:
    """The scenario of a drive alone, with the inputs and times that `simulate` is given."""
    if changes.get("duration") is None or changes.get("sample_interval") is None:
        raise InputError("a drive alone needs duration and sample_interval [s]")
    given = {name: value for name, value in changes.items() if value is not None}
    load = LoadTable(**dict(drive.load))
    return with_surroundings({"motor": drive.motor, "gearbox": drive.gearbox, "load": load}, **given)


def _signal(value: Any, kind: Any) -> Any:
    return kind(mean=value) if isinstance(value, int | float) else value


def drive_of(what: DriveScenario | Drive) -> Drive:
    """The drive of a scenario, or a drive as it is."""
    return what if isinstance(what, Drive) else what.drive()


def short_form(scenario: Scenario, function: str) -> DriveScenario:
    """The scenario, for what is defined for one motor, one gearbox and one load.

    Raises
    ------
    InputError
        It is in the long form.
    """
    if isinstance(scenario, DriveScenario):
        return scenario
    raise InputError(
        f"{function}: is a drive train ([shafts]), which can be run; this takes a drive of [motor], [gearbox] and [load]"
    )


def from_tables(tables: Mapping[str, Any]) -> DriveScenario:
    """The scenario of such tables.

    Raises
    ------
    InputError
        A record is unknown or lacks what a run needs; a value cannot be used.
    """
    data = dict(tables)
    use_records(data)
    return DriveScenario(**data)


def json_schema() -> dict[str, Any]:
    """JSON Schema of scenario files, for editors."""
    schema = with_accessories(DriveScenario.model_json_schema())
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
