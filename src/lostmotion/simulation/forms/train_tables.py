"""The long form of a scenario: the tables of a drive train, with what acts on it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cache, lru_cache
from typing import Annotated, Any

from pydantic import ConfigDict, Field, model_validator

from ... import _core
from ...control.command import CommandSignal
from ...control.continuous import ContinuousController
from ...control.controller import AnyController
from ...control.references import PositionReference, SlideReference
from ...data_sheets.train_components import CONDITIONS, RECORDS
from ...errors import inside
from ...inputs.cached_values import kept
from ...inputs.named_elements import Elements, Named, nothing
from ...inputs.part import Part
from ...inputs.quantities import Angle, Force, Length, LinearSpeed, NotNegative, Number, Speed, Switch, Torque
from ...model.linear_train import LinearElements
from ...model.motor import MotorLaw
from ...model.shaft import Shaft
from ...model.signals import ForceSignal, GivenSpeedSignal, Signal, SlideSpeedSignal, TorqueSignal, constant_or
from ...model.slide import Slide
from ...model.task import Task
from ...model.train import DriveTrain
from ..variables_of_trains import only_input
from .common_tables import BASE, RECORD_NAME, ScenarioTables, SimulationTable, with_accessories
from .given_motion import MotionDerivative
from .slide_units import in_si


class ShaftTable(Shaft):
    """A shaft, the load torque on it, and its motion where that is given."""

    torque: TorqueSignal | None = None
    """M_Z, against its motion; left out, none can act on it"""
    speed: GivenSpeedSignal | None = None
    """speed that it has whatever acts on it; the torque that this takes is the variable ``NAME_drive_torque``; left out, it moves as the torques let it"""
    motion: PositionReference | None = None
    """angle that it has whatever acts on it, such as moves, in place of speed"""


class SlideTable(Slide):
    """A slide and the load force on it."""

    force: ForceSignal | None = None
    """against its motion, beside its weight; left out, none can act on it unless it is inclined"""
    speed: SlideSpeedSignal | None = None
    """speed that it has whatever acts on it; the force that this takes is the variable ``NAME_drive_force``; left out, it moves as the forces let it"""
    motion: SlideReference | None = None
    """position that it has whatever acts on it, such as moves, in place of speed"""


class TrainInitial(Part):
    """State of a drive train at t = 0; missing values are 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.TrainInitial(speeds={"motor": "100 rpm"}).speeds["motor"]
    10.471975511965978
    """

    speeds: Elements[Speed] = Field(default_factory=nothing)
    """speeds of shafts"""
    angles: Elements[Angle] = Field(default_factory=nothing)
    """angles of shafts; angles of the others follow through the gears"""
    twists: Elements[Angle] = Field(default_factory=nothing)
    """twists of gears with a stiffness"""
    positions: Elements[Length] = Field(default_factory=nothing)
    """positions of slides"""
    slide_speeds: Elements[LinearSpeed] = Field(default_factory=nothing)
    """slide speeds of slides"""
    deflections: Elements[Length] = Field(default_factory=nothing)
    """deflections of screws, racks and belts with a stiffness"""
    motor_torques: Elements[Torque] = Field(default_factory=nothing)
    """motor torques of DC motors"""
    controller_states: Elements[Number] = Field(default_factory=nothing)
    """states of continuous controllers, by their result variables (SI), such as ``MOTOR_integral``; the filter of a derivative that is left out has settled"""
    hysteresis_capacities: Elements[Annotated[Torque, NotNegative]] = Field(default_factory=nothing)
    """capacities of gears with hysteresis after the last turning point before t = 0"""
    hysteresis_forces: Elements[Annotated[Force, NotNegative]] = Field(default_factory=nothing)
    """the same of screws, racks and belts"""
    on_reference: Switch = False
    """angles of the shafts of controllers, and the speeds of all that turns with them, equal their references at t = 0"""

    def of_train(self) -> TrainInitial:
        """The state of a drive train: this one."""
        return self

    def at_rest(self) -> TrainInitial:
        """The same without motion, with its angles and twists."""
        return TrainInitial(angles=self.of_all("angles"), twists=self.of_all("twists"))

    def of_all(self, key: str) -> dict[str, float]:
        """The values of a key, with the values of slides or what moves them."""
        return {**getattr(self, key), **getattr(self, LINEAR_INITIAL[key])}


# Keys of `initial` for shafts and gears, with the keys of the same quantity for slides and what moves them.
LINEAR_INITIAL = {
    "angles": "positions",
    "speeds": "slide_speeds",
    "twists": "deflections",
    "hysteresis_capacities": "hysteresis_forces",
}


class TrainTables(ScenarioTables, LinearElements):
    """Tables of a scenario in the long form: a drive train with its inputs, controllers, task and the duration of its run."""

    model_config = ConfigDict(title="Drive train")

    title: str = ""
    shafts: Elements[ShaftTable] = Field(default_factory=nothing)
    slides: Elements[SlideTable] = Field(default_factory=nothing)
    """parts that move along a straight line; they follow the shafts in the order of results"""
    command: Elements[CommandSignal] = Field(default_factory=nothing)
    """command of each motor (1 is rated voltage, or with a torque source rated torque; left out, 0), brake and friction clutch (0: open, 1: the full torque)"""
    controllers: Elements[AnyController] = Field(default_factory=nothing)
    """controllers of motors, which then have no command"""
    initial: TrainInitial = TrainInitial()
    task: Task = Task()
    simulation: SimulationTable

    @model_validator(mode="before")
    @classmethod
    def _units_of_slides(cls, data: Any) -> Any:
        return in_si(data, _train_schema) if isinstance(data, Mapping) else data

    @kept
    def train(self) -> DriveTrain:
        return DriveTrain.of_tables(shafts=Named(self.plain_shafts()), **self.elements())

    def own_shafts(self) -> dict[str, Shaft]:
        """The shafts as they are written, without the torques on them."""
        return {name: Shaft.like(shaft) for name, shaft in self.shafts.items()}

    def plain_shafts(self) -> dict[str, Shaft]:
        """The shafts and slides without what acts on them."""
        return self.with_drag(self.own_shafts()) | {name: slide.shaft() for name, slide in self.slides.items()}

    def elements(self) -> dict[str, Any]:
        """The tables of all else that makes the train."""
        return self.plain_elements()

    def movers(self) -> dict[str, ShaftTable | SlideTable]:
        """Shafts and slides."""
        return {**self.shafts, **self.slides}

    def controlled(self, motor: str) -> str:
        """The shaft or slide that the reference of a motor's controller is for."""
        return self.controllers[motor].shaft or list(self.train().shafts)[-1]

    def initial_key(self, key: str, shaft: str) -> str:
        """The dotted key of the state at t = 0 of a shaft or a slide, such as ``initial.positions.table`` for angles."""
        return f"initial.{LINEAR_INITIAL[key] if shaft in self.slides else key}.{shaft}"

    def loaded(self) -> list[str]:
        """Names of the shafts and slides that a load acts on."""
        return list(self.loads())

    def loads(self) -> dict[str, Signal[Any]]:
        """The load torques of shafts and load forces of slides, with the weight of inclined ones."""
        found: dict[str, Signal[Any]] = {n: s.torque for n, s in self.shafts.items() if s.torque is not None}
        for name, slide in self.slides.items():
            weight = slide.weight(slide.mass + sum(m.mass for m in self.linear_motors.values() if m.slide == name))
            if slide.force is not None or weight != 0.0:
                force = ForceSignal() if slide.force is None else slide.force
                found[name] = force.model_copy(update={"mean": force.mean + weight}) if weight != 0.0 else force
        return found

    def given(self) -> list[str]:
        """Names of the shafts and slides whose motion is given."""
        return [name for name, s in self.movers().items() if s.speed is not None or s.motion is not None]

    def given_key(self, shaft: str) -> str:
        """Dotted key that gives the motion of a shaft or a slide."""
        key = "speed" if self.movers()[shaft].motion is None else "motion"
        return f"{'slides' if shaft in self.slides else 'shafts'}.{shaft}.{key}"

    def motions(self) -> dict[str, tuple[Signal[Any], Signal[Any]]]:
        """Speed and acceleration of the shafts and slides whose motion is given."""
        found: dict[str, tuple[Signal[Any], Signal[Any]]] = {}
        for name, s in self.movers().items():
            if s.motion is not None:
                found[name] = (
                    MotionDerivative(reference=s.motion, order=1),
                    MotionDerivative(reference=s.motion, order=2),
                )
            elif s.speed is not None:
                found[name] = s.speed, s.speed.acceleration()
        return found

    def acting(self, name: str) -> Signal[Number]:
        """The command of a motor, brake or clutch after its delays."""
        command = self.command.get(name, CommandSignal())
        element = self.brakes.get(name) or self.clutches.get(name)
        return command if element is None else element.acting(command)

    def record_keys(self) -> Iterator[str]:
        """Keys that take names of records, and the conditions of their use."""
        for table, (key, _) in RECORDS.items():
            beside = CONDITIONS[table].model_fields if table in CONDITIONS else ()
            for name in getattr(self, table):
                yield from (f"{table}.{name}.{key}" for key in (key, *beside))

    def note(self) -> str:
        """Notes of the sheets of gears and motors."""
        notes = {name: part.note for name, part in self.train().gears.items()}
        notes |= {name: part.note for name, part in self.motors.items()}
        notes |= {name: part.note for name, part in self.linear_motors.items()}
        told = {name: note for name, note in notes.items() if note}
        return " ".join(f"{name}: {note}" if len(told) > 1 else str(note) for name, note in told.items())

    def of_inertia(self, shaft: str, inertia: float) -> dict[str, Any]:
        """The tables that change with another inertia of a shaft, or another mass of a slide."""
        if shaft in self.slides:
            return {"slides": {**self.slides, shaft: self.slides[shaft].model_copy(update={"mass": inertia})}}
        return {"shafts": {**self.shafts, shaft: self.shafts[shaft].model_copy(update={"inertia": inertia})}}

    def of_axes(self, axes: Mapping[str, AnyController]) -> dict[str, Any]:
        """The tables that change with other controllers, by the names of their motors."""
        command = {name: signal for name, signal in self.command.items() if name not in axes}
        return {"controllers": {**self.controllers, **axes}, "command": command}

    def of_inputs(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """The tables that change where `simulate` is given inputs and times."""
        times = {name: value for name, value in given.items() if name in SimulationTable.model_fields}
        changes: dict[str, Any] = {"simulation": SimulationTable(**{**dict(self.simulation), **times})}
        if "initial" in given:
            changes["initial"] = given["initial"].of_train()
        train, movers = self.train(), self.movers()
        if "command" in given:
            names = {train.variable(name, "command"): name for name in train.commanded()}
            name = names[only_input(train, "command", names)]
            changes["command"] = {**self.command, name: constant_or(given["command"], CommandSignal)}
        if "load_torque" in given:
            names = {train.variable(name, "load_torque"): name for name in self.loaded()}
            name = names[only_input(train, "load_torque", names)]
            table, key, kind = (
                ("slides", "force", ForceSignal) if name in self.slides else ("shafts", "torque", TorqueSignal)
            )
            changed = movers[name].model_copy(update={key: constant_or(given["load_torque"], kind)})
            changes[table] = {**getattr(self, table), name: changed}
        return changes

    def open_loop(self) -> dict[str, Any]:
        """The tables that change where commands of 0 take the place of all controllers."""
        commands = {name: CommandSignal() for name in self.controllers}
        return {"controllers": {}, "command": {**self.command, **commands}}

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return train_schema()


@lru_cache(maxsize=16)  # each keeps the regimes of its runs, a few megabytes
def core_train(
    train: DriveTrain,
    loaded: tuple[str, ...],
    given: tuple[str, ...],
    laws: tuple[tuple[str, MotorLaw | None], ...],
    continuous: tuple[tuple[str, ContinuousController], ...],
) -> _core.Train:
    """The solver's train, its motors as current loops make them, with continuous controllers."""
    core = train.core(loaded, dict(laws), given)
    for name, controller in continuous:
        with inside(f"controllers.{name}"):
            controller.add_to(core, train, name)
    return core


def train_schema() -> dict[str, Any]:
    """JSON Schema of scenario files in the long form, for editors."""
    schema: dict[str, Any] = json.loads(json.dumps(_train_schema()))  # which others change
    return schema


@cache
def _train_schema() -> dict[str, Any]:
    schema = with_accessories(TrainTables.model_json_schema())
    schema["properties"] = {key: schema["properties"][key] for key in ("title", "shafts", "slides")} | schema[
        "properties"
    ]
    schema["properties"]["base"] = BASE
    schema["required"] = []  # with a base, none
    for table, (key, own) in RECORDS.items():
        elements = schema["properties"][table]
        whole = elements["additionalProperties"]
        conditions = CONDITIONS[table].model_json_schema()["properties"] if table in CONDITIONS else {}
        part = schema["$defs"][whole["$ref"].rsplit("/", 1)[1]]
        from_record = {
            "type": "object",
            "properties": {key: RECORD_NAME} | conditions | {name: part["properties"][name] for name in own},
            "required": [key, *(name for name in own if name in part["required"])],
            "description": f"As {part['title']}, with the values of a record of the catalogue, or of a sheet file; other keys take the "
            "place of its values.",
        }
        elements["additionalProperties"] = {"anyOf": [whole, from_record]}
    return schema
