"""A scenario in the long form: a drive train, what acts on it and what is wanted of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache, cached_property, lru_cache
from typing import Any, ClassVar, Self, cast

from pydantic import Field, model_validator

from .. import _core
from ..control.axis import motor_laws
from ..control.continuous import ContinuousController
from ..control.controller import AnyController, Controller
from ..control.turning import turns
from ..data_sheets.train_components import CONDITIONS, RECORDS, use_train_records
from ..errors import InputError
from ..inputs.kept import kept, kept_while_used
from ..inputs.named import Elements, Named, nothing
from ..inputs.validation import did_you_mean
from ..model.motor import MotorLaw
from ..model.shaft import Shaft
from ..model.signals import CommandSignal, ForceSignal, Signal
from ..model.task import TrainTask
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from .given_motion import MotionDerivative
from .keys import set_values
from .linear_units import in_si
from .scenario import BASE, RECORD_NAME, Scenario, SimulationTable, check_on_reference, with_accessories
from .train_checks import TrainChecks
from .train_state import angles_at_start, start_values
from .train_tables import LINEAR_INITIAL, ShaftTable, SlideTable, TrainInitial
from .train_variables import add_angles, check_names, train_variables
from .variables import Variable


class TrainScenario(TrainChecks):
    """A scenario in the long form: a drive train with its inputs, controllers, task and the duration of its run.

    Examples
    --------
    >>> import lostmotion as lm
    >>> list(lm.load("two-motors-one-ring").motors)
    ['first_motor', 'second_motor']
    """

    # Why it is refused where another object is wanted, and what to use.
    refused_as: ClassVar[Mapping[str, str]] = {
        "DriveScenario": "is a drive train, and this is defined for one motor, one gearbox and one load; give a scenario with [motor], "
        "[gearbox] and [load], or take simulate, check_drive or self_locking of the train",
        "Gearbox": 'is a drive train, and the test rig measures one gear; give one, such as scenario.gears["NAME"]',
    }

    title: str = ""
    shafts: Elements[ShaftTable] = Field(default_factory=nothing)
    slides: Elements[SlideTable] = Field(default_factory=nothing)
    """parts that move along a straight line; they follow the shafts in the order of results"""
    command: Elements[CommandSignal] = Field(default_factory=nothing)
    """command of each motor (1 is rated voltage, or with a torque source rated torque; left out, 0), brake and friction clutch (0: open, 1: the full torque)"""
    controllers: Elements[AnyController] = Field(default_factory=nothing)
    """controllers of motors, which then have no command"""
    initial: TrainInitial = TrainInitial()
    task: TrainTask = TrainTask()
    simulation: SimulationTable

    @model_validator(mode="before")
    @classmethod
    def _units_of_slides(cls, data: Any) -> Any:
        return in_si(data, train_schema) if isinstance(data, Mapping) else data

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_shafts()
        train = self.train()
        self.check(train.core(self.loaded(), given=self.given()))
        self._check_given()
        self._check_controllers()
        check_on_reference(self.initial, self.axes(), ("angles", "speeds", "positions", "slide_speeds"))
        core = self.core()
        self._check_massless(core.massless_shafts())
        if self.continuous():
            self.check(core)
        check_names(train, core, self.axes(), self)
        known = self.commanded()
        for name in self.command:
            if name not in known:
                meant = did_you_mean(name, known, f"those with a command are {', '.join(known) or 'none'}")
                raise InputError(
                    f"is no motor, brake or friction clutch of this train; {meant}", keys=(f"command.{name}",)
                )
        idle = [f"command.{name}" for name in known if name not in self.command and name not in train.motors]
        if idle:
            verb = "is" if len(idle) == 1 else "are"
            reason = f"{verb} missing; add a number from 0 (open) to 1 (full torque), or a signal"
            raise InputError(reason, keys=tuple(idle))
        for name in known:
            try:
                self._acting(name)
            except ValueError as problem:
                raise InputError(str(problem), keys=(f"command.{name}",)) from None
        self.start()
        self.control()
        return self

    def axes(self) -> dict[str, Controller]:
        return {name: c for name, c in self.controllers.items() if isinstance(c, Controller)}

    def continuous(self) -> dict[str, ContinuousController]:
        return {name: c for name, c in self.controllers.items() if isinstance(c, ContinuousController)}

    def sliding(self) -> dict[str, tuple[bool, bool]]:
        train = self.train()
        return {
            self.prefix(name): (train.is_slide(train.motors[name].shaft), train.is_slide(self.controlled(name)))
            for name in self.axes()
        }

    def initial_key(self, key: str, shaft: str) -> str:
        """The dotted key of the state at t = 0 of a shaft or a slide, such as ``initial.positions.table`` for angles."""
        return f"initial.{LINEAR_INITIAL[key] if shaft in self.slides else key}.{shaft}"

    def controlled(self, motor: str) -> str:
        """The shaft or slide that the reference of a motor's controller is for."""
        return self.controllers[motor].shaft or list(self.train().shafts)[-1]

    def commanded(self) -> list[str]:
        """Names of what has a command: motors, brakes and friction clutches."""
        return self.train().commanded()

    def note(self) -> str:
        notes = {name: part.note for name, part in self.train().gears.items()}
        notes |= {name: part.note for name, part in self.motors.items()}
        notes |= {name: part.note for name, part in self.linear_motors.items()}
        return " ".join(f"{name}: {note}" for name, note in notes.items() if note)

    def prefix(self, motor: str) -> str:
        return f"{motor}_"

    def controller_key(self, motor: str) -> str:
        return f"controllers.{motor}"

    def with_axes(self, axes: Mapping[str, Controller]) -> TrainScenario:
        return self.model_copy(update={"controllers": {**self.controllers, **axes}})

    def without_controllers(self) -> TrainScenario:
        commands = {name: CommandSignal() for name in self.controllers}
        return self.replace(controllers={}, command={**self.command, **commands})

    def input_key(self, name: str) -> str:
        if name.endswith("_load_force"):
            slide = name.removesuffix("_load_force")
            inclined = self.slides[slide].weight(1.0) != 0.0
            return f"slides.{slide}.force" + (" and the weight" if inclined else "")
        for suffix in ("_given_speed", "_given_acceleration", "_given_angle", "_given_position"):
            if name.endswith(suffix):
                return self.given_key(name.removesuffix(suffix))
        for suffix, key in (
            ("_load_torque", "shafts.{}.torque"),
            ("_reference", "controllers.{}.reference"),
        ):
            if name.endswith(suffix):
                return key.format(name.removesuffix(suffix))
        return f"command.{name.removesuffix('_command')}"

    def gear_key(self, name: str) -> str:
        return f"{self.kind_of(name)}s.{name}"

    def as_axis(self) -> Self:
        """The same, marked as written in the short form of a linear axis."""
        self.__dict__["is_axis"] = True  # no field: an axis equals its long form
        return self

    @cached_property
    def is_axis(self) -> bool:
        """Whether it was written in the short form of a linear axis."""
        return False

    def motor_key(self, name: str) -> str:
        return f"{'linear_motors' if name in self.linear_motors else 'motors'}.{name}"

    def with_gears(self, gears: Mapping[str, Any]) -> TrainScenario:
        others = {key.removeprefix("gears."): gear for key, gear in gears.items()}
        return self.model_copy(update={"gears": {**self.gears, **others}})

    def record_keys(self) -> Iterator[str]:
        for table, (key, _) in RECORDS.items():
            beside = CONDITIONS[table].model_fields if table in CONDITIONS else ()
            for name in getattr(self, table):
                yield from (f"{table}.{name}.{key}" for key in (key, *beside))

    def input_keys(self) -> dict[str, str]:
        keys = {f"{name}_command": f"command.{name}" for name in self.commanded()}
        train = self.train()
        return keys | {
            train.load_torque_of(name): f"slides.{name}.force" if train.is_slide(name) else f"shafts.{name}.torque"
            for name in train.shafts
        }

    def ambient_temperature(self) -> float:
        return self.task.ambient_temperature

    def variables(self) -> tuple[Variable, ...]:
        return train_variables(self.train(), self.core())

    def derive(self, data: dict[str, Any], time: Any) -> None:
        add_angles(self.train(), data, time)

    def named_train(self) -> DriveTrain:
        return self.train()

    def long(self) -> TrainScenario:
        return self

    def _with_inputs(self, given: Mapping[str, Any]) -> TrainScenario:
        if others := [name for name in given if name not in SimulationTable.model_fields]:
            raise InputError(
                f"{others[0]}: a drive train has several; give them in its scenario, such as scenario.replace(**{{'command.NAME': 0.5}})"
            )
        return self.replace(**{f"simulation.{name}": value for name, value in given.items()})

    def capacities(self, initial: TrainInitial | None = None) -> dict[str, float]:
        """Hysteresis capacities at t = 0 [N·m] by gear; what is not among them is 0."""
        given = (initial or self.initial).of_all("hysteresis_capacities")
        return {name: h for name, h in given.items() if h}

    def core(
        self,
        *,
        sampled: bool = True,
        loaded: Collection[str] | None = None,
        given: Collection[str] | None = None,
    ) -> _core.Train:
        """The solver's train with its continuous controllers, its motors as the current loops make them.

        Parameters
        ----------
        sampled
            Also those of sampled controllers.
        loaded
            Names of the shafts that a load torque acts on, if others than those of the scenario.
        given
            Names of the shafts whose motion is given, if others than those of the scenario.
        """
        if sampled and loaded is None and given is None:
            return self._own_core()
        return self._core_with(sampled=sampled, loaded=loaded, given=given)

    @kept_while_used
    def _own_core(self) -> _core.Train:
        return self._core_with()

    def _core_with(
        self,
        *,
        sampled: bool = True,
        loaded: Collection[str] | None = None,
        given: Collection[str] | None = None,
    ) -> _core.Train:
        continuous = self.continuous()
        laws = motor_laws(self.controllers if sampled else continuous)
        shafts = self.loaded() if loaded is None else loaded
        moved = self.given() if given is None else given
        return _core_train(self.train(), tuple(shafts), tuple(moved), tuple(laws.items()), tuple(continuous.items()))

    def start(self, initial: TrainInitial | None = None) -> dict[str, float]:
        train = self.train()
        initial = self.begin() if initial is None else initial
        values = start_values(train, initial)
        angles = angles_at_start(train, initial.of_all("angles"), initial.of_all("twists"))
        known = []
        for name, controller in self.continuous().items():
            shaft = controller.shaft or list(train.shafts)[-1]
            measured = (
                angles[shaft] if controller.reference.kind == "position" else initial.of_all("speeds").get(shaft, 0.0)
            )
            values |= controller.start(name, measured)
            known += [f"{name}_{state}" for state in controller.system().states]
        for name in initial.controller_states:
            if name not in known:
                meant = did_you_mean(name, known, f"they are {', '.join(known) or 'none'}")
                raise InputError(
                    f"is no state of a controller of this train; {meant}", keys=(f"initial.controller_states.{name}",)
                )
        return values | initial.controller_states

    @kept
    def begin(self) -> TrainInitial:
        speeds = self._given_speeds()
        angles = {name: float(s.motion.at(0.0)[0]) for name, s in self._tables().items() if s.motion is not None}
        train = self.train()
        if not self.initial.on_reference:
            given: dict[str, Any] = {}
            for key, values in (("angles", angles), ("speeds", speeds)):
                for name, value in values.items():
                    own = LINEAR_INITIAL[key] if train.is_slide(name) else key
                    given.setdefault(own, dict(getattr(self.initial, own)))[name] = value
            return self.initial.model_copy(update={key: Named(values) for key, values in given.items()})
        for controller in self.axes().values():
            if controller.reference.kind == "position":
                shaft = controller.shaft or list(train.shafts)[-1]
                angles[shaft], speed = (float(value) for value in controller.reference.at(0.0)[:2])
                ratios = {other: turns(train, other, shaft) for other in train.shafts}
                speeds |= {other: i * speed for other, i in ratios.items() if i is not None}
        found: dict[str, Any] = {}
        for key, values in (("angles", angles), ("speeds", speeds)):
            found[key] = Named({name: v for name, v in values.items() if not train.is_slide(name)})
            found[LINEAR_INITIAL[key]] = Named({name: v for name, v in values.items() if train.is_slide(name)})
        return self.initial.model_copy(update=found)

    def _given_speeds(self) -> dict[str, float]:
        """Speeds at t = 0 [rad/s, m/s] of shafts and slides with a given motion, and of others that rigid gears tie to them."""
        rigid = [
            (g.input, g.output, g.ratio) for g in self.train().fixed_gears().values() if isinstance(g.stiffness, Rigid)
        ]
        speeds = {name: speed.at_start() for name, (speed, _) in self._motions().items()}
        waiting = list(speeds)
        while waiting:
            shaft = waiting.pop()
            for one, other, ratio in rigid:
                found = {one: (other, 1.0 / ratio), other: (one, ratio)}.get(shaft)
                if found is not None and found[0] not in speeds:
                    speeds[found[0]] = speeds[shaft] * found[1]
                    waiting.append(found[0])
        return speeds

    @kept
    def train(self) -> DriveTrain:
        return DriveTrain(shafts=self.plain_shafts(), **self.elements())

    def own_shafts(self) -> dict[str, Shaft]:
        """The shafts as they are written, without the torques on them."""
        return {name: Shaft(**{key: getattr(s, key) for key in Shaft.model_fields}) for name, s in self.shafts.items()}

    def plain_shafts(self) -> dict[str, Shaft]:
        """The shafts and slides without what acts on them."""
        return self.with_drag(self.own_shafts()) | {name: slide.shaft() for name, slide in self.slides.items()}

    def elements(self) -> dict[str, Any]:
        """The tables of all else that makes the train."""
        return self.plain_elements(self.slides)

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
        return [name for name, s in self._tables().items() if s.speed is not None or s.motion is not None]

    def given_key(self, shaft: str) -> str:
        key = "speed" if self._tables()[shaft].motion is None else "motion"
        return f"{'slides' if shaft in self.slides else 'shafts'}.{shaft}.{key}"

    def _tables(self) -> dict[str, ShaftTable | SlideTable]:
        return {**self.shafts, **self.slides}

    def _kind(self, shaft: str) -> str:
        return "slide" if shaft in self.slides else "shaft"

    def _motions(self) -> dict[str, tuple[Signal[Any], Signal[Any]]]:
        """Speed and acceleration of the shafts and slides whose motion is given."""
        found: dict[str, tuple[Signal[Any], Signal[Any]]] = {}
        for name, s in self._tables().items():
            if s.motion is not None:
                found[name] = (
                    MotionDerivative(reference=s.motion, order=1),
                    MotionDerivative(reference=s.motion, order=2),
                )
            elif s.speed is not None:
                found[name] = s.speed, s.speed.acceleration()
        return found

    def signals(self) -> dict[str, Signal[Any]]:
        """All that acts on the train, after delays of brakes and clutches, by the name of its result variable."""
        controllers = self.continuous()
        commands = {f"{name}_command": self._acting(name) for name in self.commanded() if name not in controllers}
        torques = {self.train().load_torque_of(name): load for name, load in self.loads().items()}
        references = {name: s for motor, c in controllers.items() for name, s in c.signals(motor).items()}
        motions: dict[str, Signal[Any]] = {}
        for name, (speed, acceleration) in self._motions().items():
            motions |= {f"{name}_given_speed": speed, f"{name}_given_acceleration": acceleration}
        return {**commands, **torques, **motions, **references}

    def _acting(self, name: str) -> CommandSignal:
        """The command of a motor, brake or clutch after its delays."""
        command = self.command.get(name, CommandSignal())
        element = self.brakes.get(name) or self.clutches.get(name)
        return command if element is None else element.acting(command)

    def __repr__(self) -> str:
        title = f"{self.title!r}, " if self.title else ""
        time = f"{self.simulation.duration:.4g} s, {self.simulation.samples} samples"
        return f"TrainScenario({title}{self.train()!r}, {time})"

    def replace(self, **changes: Any) -> TrainScenario:
        data = self.model_dump()
        set_values(data, changes.items())
        use_train_records(data)
        return TrainScenario(**data)

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return train_schema()


Scenario.forms[True] = TrainScenario


@lru_cache(maxsize=16)  # each keeps the regimes of its runs, a few megabytes
def _core_train(
    train: DriveTrain,
    loaded: tuple[str, ...],
    given: tuple[str, ...],
    laws: tuple[tuple[str, MotorLaw | None], ...],
    continuous: tuple[tuple[str, ContinuousController], ...],
) -> _core.Train:
    core = train.core(loaded, dict(laws), given)
    for name, controller in continuous:
        try:
            controller.add_to(core, train, name)
        except InputError as problem:
            raise problem.inside(f"controllers.{name}") from None
    return core


def train_from_tables(tables: Mapping[str, Any], written: Callable[[str], str] = str) -> TrainScenario:
    """The scenario of such tables.

    Parameters
    ----------
    written
        Key in the file for a key of the tables, for messages.

    Raises
    ------
    InputError
        A record is unknown or lacks what a run needs; a value cannot be used.
    """
    data = dict(tables)
    use_train_records(data, written)
    try:
        return TrainScenario(**data)
    except InputError as error:
        raise error.with_keys(written) from None


@cache
def _train_schema() -> str:
    return json.dumps(_make_train_schema())


def train_schema() -> dict[str, Any]:
    """JSON Schema of scenario files in the long form, for editors."""
    schema: dict[str, Any] = json.loads(_train_schema())
    return schema


def _make_train_schema() -> dict[str, Any]:
    schema = with_accessories(TrainScenario.model_json_schema())
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


def in_long_form(scenario: Scenario) -> TrainScenario:
    """The scenario in the long form; from the short form: shafts `motor` and `load`, gear `gearbox`, motor `motor`."""
    return cast("TrainScenario", scenario.long())
