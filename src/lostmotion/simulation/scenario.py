"""A scenario: a drive, what acts on it and what is wanted of it, in the words of its file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import ConfigDict, model_validator

from .. import _core
from ..control.axis import NO_LAWS, Bound, check_torques, core_control, driven
from ..control.continuous import ContinuousController
from ..control.controller import Controller
from ..control.law import Law
from ..data_sheets.components import Conditions, use_records
from ..errors import InputError
from ..inputs.kept import kept, kept_while_used
from ..inputs.part import Part
from ..inputs.quantities import Angle, NotNegative, Positive, Speed, Switch, Time, Torque
from ..model.drive import Drive
from ..model.gearbox import Gearbox, Transmission
from ..model.linear_train import LinearElements
from ..model.load import Load
from ..model.motor import Motor
from ..model.shaft import Shaft
from ..model.signals import CommandSignal, Signal, TorqueSignal
from ..model.task import Task
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from .keys import set_values
from .variables import STATES, VARIABLES, Variable, add_efficiency

MAX_SAMPLES = 100_000_000
LONG_TABLES = ("shafts", "slides", *LinearElements.model_fields)  # of which one makes a scenario one in the long form

# In the JSON Schema of files, beside what a scenario has.
BASE = {"type": "string", "description": "scenario file that this one changes"}
RECORD_NAME = {"type": "string", "description": "name of a record of the catalogue, or a file with one (.toml)"}


class LoadTable(Load):
    """The driven body and the disturbance torque on it."""

    torque: TorqueSignal = TorqueSignal()
    """M_Z"""


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
    """angle and speeds are those of the controller's reference at t = 0"""

    def at_rest(self) -> Initial:
        """The same without motion and twist."""
        return Initial()


def state_of(initial: Initial) -> dict[str, float]:
    """The state by the names of its variables."""
    return {name: getattr(initial, name) for name in STATES}


def capacities_of(initial: Initial) -> dict[str, float]:
    """Hysteresis capacities [N·m] by gear."""
    return {"gearbox": initial.hysteresis_capacity}


def check_on_reference(initial: Any, controllers: Mapping[str, Controller], keys: Sequence[str]) -> None:
    """Refuses `on_reference` where no reference says where an axis is, or where one of the keys says so, too.

    Raises
    ------
    ValueError
    """
    if not initial.on_reference:
        return
    if not any(c.reference.kind == "position" for c in controllers.values()):
        raise ValueError("has initial.on_reference but no controller with a reference of the position; leave it out")
    if given := [key for key in keys if getattr(initial, key)]:
        raise ValueError(
            f"has initial.on_reference and initial.{given[0]}, which follows from it; leave one of them out"
        )


class SimulationTable(Part):
    """Duration and instants of the result. Neither affects the motion."""

    duration: Annotated[Time, Positive]
    sample_interval: Annotated[Time, Positive]

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        if self.sample_interval > self.duration:
            raise ValueError(f"has a sample_interval of {self.sample_interval} s, longer than its duration")
        if self.duration / self.sample_interval > MAX_SAMPLES:
            raise ValueError(f"asks for more than {MAX_SAMPLES:.0e} samples; lengthen sample_interval")
        return self

    @property
    def samples(self) -> int:
        """Number of instants 0, sample_interval, ... up to the duration."""
        return int(self.duration / self.sample_interval * (1.0 + 1e-12)) + 1


class Scenario(Part):
    """Drive or drive train, what acts on it and what is wanted of it, in the short form or in the long form.

    A scenario in the short form (`DriveScenario`) has the tables ``motor``, ``gearbox`` and ``load``; one in the long form
    (`TrainScenario`) has shafts and what joins them. The constructor, `model_validate` and `from_json` read either form.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.load("paper-2dof-nl-small").replace(**{"load.inertia": "3 kg*m^2"}).load.inertia
    3.0
    """

    if TYPE_CHECKING:
        title: str
        initial: Any
        simulation: SimulationTable

    # The classes of both forms: whether it is the long one.
    forms: ClassVar[dict[bool, type[Any]]] = {}

    def __new__(cls, /, *_: Any, **tables: Any) -> Self:
        return super().__new__(cls._form(tables))

    @classmethod
    def _form(cls, tables: Any) -> type[Self]:
        if cls is not Scenario:
            return cls
        long = isinstance(tables, Mapping) and is_train(tables)
        if long not in cls.forms:
            import_module(".train_scenario", __package__)  # which imports this module
        return cls.forms[long]

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """Make the scenario from its tables, as the constructor does."""
        if cls is Scenario and not isinstance(obj, Scenario):
            return cls._form(obj).model_validate(obj, **options)
        return super().model_validate(obj, **options)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Make the scenario from JSON that `to_json` returned."""
        tables = None
        if cls is Scenario:
            with suppress(TypeError, ValueError, RecursionError):  # which reading it as a form reports
                tables = json.loads(text)
        return cls._form(tables).model_validate_json(text)

    def train(self) -> DriveTrain:
        """The drive train without its surroundings."""
        raise NotImplementedError

    def named_train(self) -> DriveTrain:
        """The same, with the names that variables have in results of this scenario."""
        raise NotImplementedError

    def long(self) -> Scenario:
        """The scenario in the long form."""
        raise NotImplementedError

    def variables(self) -> tuple[Variable, ...]:
        """The variables that a result has, without those of controllers."""
        raise NotImplementedError

    def derive(self, data: dict[str, Any], time: Any) -> None:
        """Add the variables that follow from those of the solver."""
        raise NotImplementedError

    def attributes(self) -> dict[str, float]:
        """Attributes of what is computed of it, beside those of a run."""
        return {}

    def ambient_temperature(self) -> float:
        """Temperature [°C] of the task."""
        raise NotImplementedError

    def with_inputs(self, **changes: Any) -> Self:
        """The same scenario with the inputs and times that `simulate` is given; None leaves a value as it is."""
        given = {name: value for name, value in changes.items() if value is not None}
        return self._with_inputs(given) if given else self

    def _with_inputs(self, given: Mapping[str, Any]) -> Self:
        raise NotImplementedError

    def with_gears(self, gears: Mapping[str, Any]) -> Self:
        """The same scenario with other gears, by their keys."""
        raise NotImplementedError

    def record_keys(self) -> Iterator[str]:
        """Keys that take names of records, and the conditions of their use."""
        raise NotImplementedError

    def input_keys(self) -> dict[str, str]:
        """Keys of the signals of its inputs, by their names."""
        raise NotImplementedError

    def gear_key(self, name: str) -> str:
        """Key of the table of a gear."""
        raise NotImplementedError

    def motor_key(self, name: str) -> str:
        """Key of the table of a motor."""
        raise NotImplementedError

    def core(self, *, sampled: bool = True) -> _core.Train:
        """The solver's train, its motors as current loops make them.

        Parameters
        ----------
        sampled
            Also those of sampled controllers.
        """
        raise NotImplementedError

    def axes(self) -> dict[str, Controller]:
        """The sampled controllers by the names of their motors."""
        raise NotImplementedError

    def continuous(self) -> dict[str, ContinuousController]:
        """The continuous controllers by the names of their motors."""
        raise NotImplementedError

    def with_axes(self, axes: Mapping[str, Controller]) -> Self:
        """The same scenario with other sampled controllers, by the names of their motors; the others stay."""
        raise NotImplementedError

    def without_controllers(self) -> Self:
        """The same scenario with the motors of its controllers turned by commands of 0."""
        raise NotImplementedError

    def prefix(self, motor: str) -> str:
        """Prefix of the names of the variables of a motor's controller."""
        raise NotImplementedError

    def controller_key(self, motor: str) -> str:
        """Key of the table of a motor's controller."""
        raise NotImplementedError

    def input_key(self, name: str) -> str:
        """Key of the signal or reference that an input of the core stands for."""
        raise NotImplementedError

    def sliding(self) -> dict[str, tuple[bool, bool]]:
        """Whether the motor of a controller moves a slide, and whether its position is that of one, by the prefix of its variables."""
        raise NotImplementedError

    def given(self) -> list[str]:
        """Names of the shafts and slides whose motion is given."""
        raise NotImplementedError

    def given_key(self, shaft: str) -> str:
        """Dotted key that gives the motion of a shaft or a slide."""
        raise NotImplementedError

    def note(self) -> str:
        """Notes of the sheets of gears and motors."""
        raise NotImplementedError

    def signals(self) -> dict[str, Signal[Any]]:
        """All that acts on the train, by the name of its result variable."""
        raise NotImplementedError

    def begin(self) -> Any:
        """State at t = 0, with what the references say of it."""
        raise NotImplementedError

    def start(self, initial: Any = None) -> dict[str, float]:
        """State at t = 0 by the names of its variables.

        Parameters
        ----------
        initial
            State in place of the initial state of the scenario.
        """
        raise NotImplementedError

    def capacities(self, initial: Any = None) -> dict[str, float]:
        """Hysteresis capacities at t = 0 [N·m] by gear."""
        raise NotImplementedError

    def replace(self, **changes: Any) -> Self:
        """The same scenario with changes by dotted key, such as ``**{"load.inertia": 0.1}``, checked anew."""
        raise NotImplementedError

    def gears_by_key(self) -> dict[str, Transmission]:
        """The gears by the keys of their tables."""
        return {self.gear_key(name): gear for name, gear in self.train().gears.items()}

    def by_prefix(self) -> dict[str, Controller]:
        """The sampled controllers, by what the names of their variables begin with."""
        return {self.prefix(name): c for name, c in self.axes().items()}

    def control(self, laws: Mapping[str, Law] = NO_LAWS) -> Bound:
        """The solver's controllers, kept if there are no laws: change copies of them alone (`control.axis.own`)."""
        return self._bound(laws) if laws else self._control()

    @kept
    def _control(self) -> Bound:
        return self._bound(NO_LAWS)

    def _bound(self, laws: Mapping[str, Law]) -> Bound:
        return core_control(self.train(), self.axes(), self.controller_key("{}") + ".", laws)

    @kept
    def to_json(self) -> str:
        """All values in SI, as JSON that `from_json` reads."""
        return self.model_dump_json(exclude_none=True)


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
                    f"key load.{key}: a given motion requires a drive train; read the file by lm.load, or make a TrainScenario with "
                    f'shafts={{"load": ...}}'
                )
        if isinstance(controller, ContinuousController) or (
            isinstance(controller, Mapping) and controller.get("kind") == "continuous"
        ):
            raise InputError(
                "key controller.kind: a continuous controller requires a drive train; read the file by lm.load, or make a "
                'TrainScenario with controllers={"motor": ...}'
            )
        return data

    @model_validator(mode="after")
    def _consistent(self) -> Self:
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
            raise InputError("keys command, controller: both turn the motor; leave one of them out")
        check_torques(self.axes(), {"motor": start.motor_torque}, "initial.motor_torque")
        self.control()
        return self

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


def is_train(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a scenario are in the long form."""
    return any(table in tables for table in LONG_TABLES)


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
    schema = DriveScenario.model_json_schema()
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
