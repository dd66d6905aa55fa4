"""A scenario: a drive, what acts on it and what is wanted of it, in the words of its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self

from pydantic import model_validator

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
from ..model.load import Load
from ..model.motor import Motor
from ..model.signals import CommandSignal, Signal, TorqueSignal
from ..model.task import Task
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from .keys import set_values
from .variables import STATES

MAX_SAMPLES = 100_000_000

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
    """A drive with its inputs, controller, task and the duration of its run.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.load("paper-2dof-nl-small").replace(**{"load.inertia": "3 kg*m^2"}).load.inertia
    3.0
    """

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
        controller = data.get("controller") if isinstance(data, Mapping) else None
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
        """The controller by the name of its motor, if there is one."""
        return {} if self.controller is None else {"motor": self.controller}

    def by_prefix(self) -> dict[str, Controller]:
        """The controller, by what the names of its variables begin with."""
        return {} if self.controller is None else {"": self.controller}

    def prefix(self, motor: str) -> str:  # noqa: ARG002
        """Prefix of the names of the variables of a motor's controller."""
        return ""

    def controller_key(self, motor: str) -> str:  # noqa: ARG002
        """Key of the table of a motor's controller."""
        return "controller"

    def with_axes(self, axes: Mapping[str, Controller]) -> Scenario:
        """The same scenario with other sampled controllers, by the names of their motors."""
        return self.model_copy(update={"controller": axes["motor"]})

    def without_controllers(self) -> Scenario:
        """The same scenario with its motor turned by a command of 0."""
        return self.replace(controller=None)

    def given(self) -> list[str]:
        """Names of the shafts whose motion is given: none."""
        return []

    def input_key(self, name: str) -> str:
        """Key of the signal or reference that an input of the core stands for."""
        return {"load_torque": "load.torque", "reference": "controller.reference"}.get(name, name)

    def gears_by_key(self) -> dict[str, Transmission]:
        """The gear by the key of its table."""
        return {"gearbox": self.gearbox}

    def sliding(self) -> dict[str, tuple[bool, bool]]:
        """Controllers that move slides: none."""
        return {}

    def note(self) -> str:
        """Notes of the sheets of gearbox and motor."""
        return " ".join(filter(None, [self.gearbox.note, self.motor.note]))

    def continuous(self) -> dict[str, ContinuousController]:
        """The continuous controllers: a drive in the short form has none."""
        return {}

    def start(self, initial: Initial | None = None) -> dict[str, float]:
        """State at t = 0 by the names of its variables.

        Parameters
        ----------
        initial
            In place of that of the scenario.
        """
        return state_of(self.begin() if initial is None else initial)

    def capacities(self, initial: Initial | None = None) -> dict[str, float]:
        """Hysteresis capacities at t = 0 [N·m] by gear."""
        return capacities_of(initial or self.initial)

    def signals(self) -> dict[str, Signal[Any]]:
        """All that acts on the drive, by the name of its result variable."""
        return {"command": self.command, "load_torque": self.load.torque}

    @kept
    def begin(self) -> Initial:
        """State at t = 0, with what the reference says of it."""
        if not self.initial.on_reference or self.controller is None:
            return self.initial
        angle, speed = (float(value) for value in self.controller.reference.at(0.0)[:2])
        if self.controller.shaft == "motor":
            angle, speed = angle / self.gearbox.ratio - self.initial.twist, speed / self.gearbox.ratio
        found = {"load_angle": angle, "load_speed": speed, "motor_speed": speed * self.gearbox.ratio}
        return self.initial.model_copy(update=found)

    def control(self, laws: Mapping[str, Law] = NO_LAWS) -> Bound:
        """The solver's controllers, kept if there are no laws: change copies of them alone (`control.axis.own`)."""
        return core_control(self.train(), self.axes(), "controller.", laws) if laws else self._control()

    @kept
    def _control(self) -> Bound:
        return core_control(self.train(), self.axes(), "controller.")

    def core(self, *, sampled: bool = True) -> _core.Train:
        """The solver's train, its motor as the current loop makes it.

        Parameters
        ----------
        sampled
            Whether with that of a sampled controller.
        """
        return self._own_core() if sampled else self.drive().core()

    @kept_while_used
    def _own_core(self) -> _core.Train:
        return self.drive().core(None if self.controller is None else driven(self.controller))

    @kept
    def train(self) -> DriveTrain:
        """The drive as a train: shafts `motor` and `load`, joined by the gear `gearbox`, and on the first the motor `motor`."""
        return self.drive().train()

    @kept
    def drive(self) -> Drive:
        """The drive without its surroundings."""
        load = Load(**{name: getattr(self.load, name) for name in Load.model_fields})
        return Drive(motor=self.motor, gearbox=self.gearbox, load=load)

    def __repr__(self) -> str:
        title = f"{self.title!r}, " if self.title else ""
        return f"Scenario({title}{self.drive()!r}, {self.simulation.duration:.4g} s, {self.simulation.samples} samples)"

    def replace(self, **changes: Any) -> Scenario:
        """The same scenario with changes by dotted key, such as ``**{"command.amplitude": 0.1}``, checked anew."""
        data = self.model_dump()
        set_values(data, changes.items())
        use_records(data)
        return Scenario(**data)

    @kept
    def to_json(self) -> str:
        """All values in SI, as JSON that `from_json` reads."""
        return self.model_dump_json(exclude_none=True)

    @classmethod
    def from_json(cls, text: str) -> Scenario:
        return cls.model_validate_json(text)

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return json_schema()


def drive_of(what: Scenario | Drive) -> Drive:
    """The drive of a scenario, or a drive as it is."""
    return what if isinstance(what, Drive) else what.drive()


def mean_inputs(
    what: Scenario | Drive, command: float | None = None, load_torque: float | None = None
) -> tuple[float, float]:
    """Constant parts of E_C [-] and M_Z [N·m]: as given, else those of the scenario, else 0."""
    known = (what.command.mean, what.load.torque.mean) if isinstance(what, Scenario) else (0.0, 0.0)
    return known[0] if command is None else command, known[1] if load_torque is None else load_torque


def from_tables(tables: Mapping[str, Any]) -> Scenario:
    """The scenario of such tables.

    Raises
    ------
    InputError
        A record is unknown or lacks what a run needs; a value cannot be used.
    """
    data = dict(tables)
    use_records(data)
    return Scenario(**data)


def json_schema() -> dict[str, Any]:
    """JSON Schema of scenario files, for editors."""
    schema = Scenario.model_json_schema()
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
