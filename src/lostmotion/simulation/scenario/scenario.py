"""A scenario: a drive, what acts on it, and its task, in the words of its file."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any, ClassVar, Self

import numpy as np
from pydantic_core import core_schema

from ... import _core
from ...control.axis import NO_LAWS, BoundController, core_control, motor_laws
from ...control.continuous import ContinuousController
from ...control.controller import Controller
from ...control.custom_controller import Law
from ...data_sheets.components import use_records
from ...data_sheets.train_components import use_train_records
from ...errors import InputError
from ...inputs.cached_values import kept, kept_while_used
from ...inputs.implausible_values import doubt_all
from ...inputs.named_elements import Named
from ...inputs.refusal_messages import did_you_mean, shown
from ...model.drive import Drive, DriveOfOneGear
from ...model.gear import Gear
from ...model.gearbox import Gearbox
from ...model.linear_train import LinearElements
from ...model.motor import Motor
from ...model.shaft_ratio import turns
from ...model.signals import Signal
from ...model.train import DriveTrain
from ...recorded_numbers import may_differ
from ..forms import axis_form, drive_form, stepper_fields
from ..forms.common_tables import SimulationTable
from ..forms.drive_tables import DriveTables, Initial, LoadTable
from ..forms.initial_state import angles_at_start, given_speeds, start_values
from ..forms.key_aliases import AXIS, DRIVE, TRAIN, TRAIN_OF_DRIVE, Form
from ..forms.set_by_dotted_key import set_values
from ..forms.train_checks import check_train
from ..forms.train_tables import LINEAR_INITIAL, ShaftTable, TrainInitial, TrainTables, core_train
from ..variables import Variable, variables_of_core

LONG_TABLES = ("shafts", "slides", *LinearElements.model_fields)  # keys; one of them puts a scenario into the long form


class Scenario:
    """Drive or drive train, what acts on it, and its task.

    It is written in one of three forms: the tables ``motor``, ``gearbox`` and ``load``; the table ``axis``; or shafts and what
    joins them. Each becomes a drive train. What is written can be read as attributes, in every form also ``shafts``, ``motors``,
    ``gears`` and the other tables of the train.

    Parameters
    ----------
    **tables
        As in a file. Names of records, and text with units, are read.

    Raises
    ------
    InputError
        A record is unknown or lacks what a run needs; a value cannot be used.

    Examples
    --------
    >>> import lostmotion as lm
    >>> scenario = lm.load("paper-2dof-nl-small").replace(**{"load.inertia": "3 kg*m^2"})
    >>> scenario.load.inertia, scenario.shafts["load"].inertia
    (3.0, 3.0)
    >>> list(lm.load("two-motors-one-ring").motors)
    ['first_motor', 'second_motor']
    """

    __slots__ = ("__weakref__", "_made", "form", "tables")

    tables: TrainTables
    """the tables in the long form"""
    form: Form
    """names of their keys in its file"""

    # Attributes of the tables, found by `__getattr__`.
    title: str
    motor: Motor
    gearbox: Gearbox
    load: LoadTable
    controller: Controller | None
    simulation: SimulationTable

    # Why it is refused where another object is wanted, and what to use.
    refused_as: ClassVar[Mapping[str, str]] = {
        "Gearbox": 'is a scenario, and the test rig measures one gear; give one, such as scenario.gears["NAME"]'
    }

    def __init__(self, /, *nameless: Any, **tables: Any) -> None:
        if nameless:
            raise InputError(f"the scenario takes its values by name, such as title=...; not {shown(nameless[0])}")
        if "axis" in tables:
            with _in_keys(AXIS.in_file):
                self._set(_in_long_form(axis_form.long_form(tables), AXIS.in_file), AXIS)
        elif is_train(tables):
            self._set(_in_long_form(tables), TRAIN)
        else:
            data = dict(tables)
            use_records(data)
            if drive_form.is_short(data):
                self._set(DriveTables(**data).long(), DRIVE)
            else:
                with _in_keys(TRAIN_OF_DRIVE.in_file):
                    self._set(TrainTables(**drive_form.long_form(data)), TRAIN_OF_DRIVE)

    def _set(self, tables: TrainTables, form: Form, *, checked: bool = True) -> None:
        for name, value in (("tables", tables), ("form", form), ("_made", {})):
            object.__setattr__(self, name, value)
        if checked:
            self.check()

    def check(self) -> None:
        """Refuse tables that contradict each other."""
        try:
            with _in_keys(self.key_in_file):
                check_train(self)
        except InputError:
            raise
        except ValueError as problem:
            raise InputError(f"the scenario {problem}") from None

    @classmethod
    def of(cls, written: DriveTables | TrainTables, form: Form = TRAIN, *, checked: bool = True) -> Self:
        """The scenario of its tables.

        Parameters
        ----------
        checked
            Whether to refuse tables that contradict each other, which has not been done yet.
        """
        made = cls.__new__(cls)
        if isinstance(written, DriveTables):
            made._set(written.long(), DRIVE, checked=checked)
        else:
            made._set(written, form, checked=checked)
        return made

    def _with(self, tables: Mapping[str, Any]) -> Self:
        """The same scenario with other tables of the long form, checked anew."""
        with _in_keys(self.key_in_file):
            changed = self.tables.model_copy(update=tables)
        return self.of(changed, self.form)

    @classmethod
    def of_drive(cls, drive: Drive, **given: Any) -> Self:
        """The scenario of a drive alone, with the inputs and times that `simulate` is given.

        Raises
        ------
        InputError
            There is no duration or no sample interval.
        """
        if given.get("duration") is None or given.get("sample_interval") is None:
            raise InputError("a drive alone needs duration and sample_interval [s]")
        times = SimulationTable(**{name: given.pop(name) for name in SimulationTable.model_fields})
        load = LoadTable(**dict(drive.load))
        tables = DriveTables(motor=drive.motor, gearbox=drive.gearbox, load=load, simulation=times)
        return cls.of(tables).with_inputs(**given)

    @classmethod
    def of_any(cls, what: Drive | DriveTrain | Scenario) -> Scenario:
        """A scenario as it is, or the scenario of a drive or a train alone, whose times have no use."""
        if isinstance(what, Scenario):
            return what
        if isinstance(what, Drive):
            return cls.of_drive(what, duration=1.0, sample_interval=1e-3)
        shafts = Named({name: ShaftTable.like(shaft) for name, shaft in what.shafts.items()})
        times = SimulationTable(duration=1.0, sample_interval=1e-3)
        return cls.of(TrainTables.like(what, shafts=shafts, simulation=times), checked=False)

    @classmethod
    def model_validate(cls, obj: Any) -> Self:
        """Make the scenario from its tables, as the constructor does."""
        if isinstance(obj, cls):
            return obj
        if not isinstance(obj, Mapping) or not all(isinstance(key, str) for key in obj):
            DriveTables.model_validate(obj)  # refuses it
        return cls(**obj)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Make the scenario from JSON that `to_json` returned."""
        tables = None
        with suppress(TypeError, ValueError, RecursionError):  # which reading it as a form reports
            tables = json.loads(text)
        return cls(**tables) if isinstance(tables, dict) else cls.of(DriveTables.model_validate_json(text))

    @classmethod
    def model_json_schema(cls) -> dict[str, Any]:
        """JSON Schema of scenario files in all their forms."""
        return axis_form.file_schema()

    @property
    def written(self) -> DriveTables | TrainTables:
        """The tables as files have them; an axis is in the long form."""
        return self._written()

    @kept
    def _written(self) -> DriveTables | TrainTables:
        return DriveTables.of_long(self.tables) if self.form == DRIVE else self.tables

    def __getattr__(self, name: str) -> Any:
        for tables in () if name.startswith("_") else (self.written, self.tables):
            with suppress(AttributeError):
                return getattr(tables, name)
        raise AttributeError(f"the scenario has no {name}")

    def __setattr__(self, name: str, value: Any) -> None:
        raise InputError(f"the scenario is frozen; make a changed one instead of setting {name}")

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        return iter(self.written)

    def __eq__(self, other: object) -> bool:
        same = (
            isinstance(other, Scenario)
            and self.tables == other.tables
            and (self.form == DRIVE) == (other.form == DRIVE)
        )
        return same if isinstance(other, Scenario) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.tables)

    def __reduce__(self) -> tuple[Any, ...]:
        return _made_again, (self.tables, self.form)

    def __repr__(self) -> str:
        title = f"{self.title!r}, " if self.title else ""
        time = f"{self.simulation.duration:.4g} s, {self.simulation.samples} samples"
        return f"Scenario({title}{self.alone()!r}, {time})"

    def _repr_html_(self) -> str:
        """All values with their units, for notebooks."""
        return self.written._repr_html_()

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: Any) -> core_schema.CoreSchema:
        """Values of parts are scenarios or their tables."""

        def written(scenario: Scenario, info: core_schema.SerializationInfo) -> dict[str, Any]:
            if info.mode == "json":
                return json.loads(scenario.to_json())  # type: ignore[no-any-return]
            return scenario.written.model_dump(exclude_none=info.exclude_none)

        return core_schema.no_info_plain_validator_function(
            cls.model_validate,
            serialization=core_schema.plain_serializer_function_ser_schema(written, info_arg=True),
            json_schema_input_schema=core_schema.dict_schema(),
        )

    def kept_values(self) -> dict[Any, Any]:
        """Values that `inputs.cached_values.kept` keeps with this object."""
        return self._made  # type: ignore[no-any-return]

    @kept
    def to_json(self) -> str:
        """All values in SI, as JSON that `from_json` reads."""
        if self.form == AXIS:
            return json.dumps(axis_form.short_form(self.tables.model_dump(mode="json", exclude_none=True)))
        return self.written.model_dump_json(exclude_none=True)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other tables, which are checked as in the constructor."""
        return self.of(self.written.model_copy(update=update, deep=deep), self.form, checked=bool(update))

    def unchecked(self, **tables: Any) -> Self:
        """The same with other tables, which `check` has still to see."""
        return self.of(self.written.unchecked(**tables), self.form, checked=False)

    def replace(self, **changes: Any) -> Self:
        """The same scenario with changes by dotted key, such as ``**{"load.inertia": 0.1}``, checked anew.

        Keys are keys of its file, or of the long form.
        """
        doubt_all(changes, "replace")
        data = self.written.model_dump()
        set_values(data, [(self.key_of_tables(key), value) for key, value in changes.items()])
        if self.form == AXIS:
            axis_form.on_slide(data)
        with _in_keys(self.key_in_file):
            made = type(self)(**data)
        return made if self.form == DRIVE else self.of(made.tables, self.form, checked=False)

    def with_inputs(self, **changes: Any) -> Self:
        """The same scenario with the inputs and times that `simulate` is given; None leaves a value as it is."""
        given = {name: value for name, value in changes.items() if value is not None}
        return self._with(self.tables.of_inputs(given)) if given else self

    def with_gears(self, gears: Mapping[str, Gear]) -> Self:
        """The same scenario with other gears, by their keys."""
        names = {self.own_key(self.tables.key_of("gears", name)): name for name in self.tables.gears}
        return self._with({"gears": {**self.tables.gears, **{names[key]: gear for key, gear in gears.items()}}})

    def with_axes(self, axes: Mapping[str, Controller | ContinuousController]) -> Self:
        """The same scenario with other controllers, by the names of their motors, which have no command then; the others stay."""
        return self._with(self.tables.of_axes(axes))

    def with_inertia(self, shaft: str, inertia: float) -> Self:
        """The same scenario with another inertia of a shaft."""
        return self._with(self.tables.of_inertia(shaft, inertia))

    def without_controllers(self) -> Self:
        """The same scenario with the motors of its controllers turned by commands of 0."""
        return self._with(self.tables.open_loop())

    def key_in_file(self, key: str) -> str:
        """A dotted key of the long form as the file of the scenario has it."""
        return self.form.in_file(key)

    def key_of_tables(self, key: str) -> str:
        """A dotted key of the file or of the long form as the tables that are kept have it."""
        return self.form.in_tables(key)

    def own_key(self, key: str) -> str:
        """A key of the long form as the tables that are kept have it."""
        return self.form.in_file(key) if self.form == DRIVE else key

    def controller_key(self, motor: str) -> str:
        """Key of the table of a motor's controller."""
        return self.own_key(f"controllers.{motor}")

    def gears_by_key(self) -> dict[str, Gear]:
        """The gears by the keys that the tables that are kept have for them."""
        return {self.own_key(self.tables.key_of("gears", name)): gear for name, gear in self.train().gears.items()}

    def gear_key(self, name: str) -> str:
        """Key of the table of a gear in its file."""
        return self.key_in_file(self.tables.key_of("gears", name))

    def motor_key(self, name: str) -> str:
        """Key of the table of a motor in its file."""
        return self.key_in_file(self.tables.key_of("motors", name))

    def record_keys(self) -> Iterator[str]:
        """Keys that take names of records, and the conditions of their use."""
        return map(self.own_key, self.tables.record_keys())

    def input_key(self, name: str) -> str:
        """Key of the signal or reference that an input stands for."""
        train, tables = self.train(), self.tables
        if shaft := train.shaft_of(name, "load_torque"):
            weighs = train.is_slide(shaft) and tables.slides[shaft].weight(1.0) != 0.0
            return self.load_key(shaft) + (" and the weight" if weighs else "")
        if shaft := train.shaft_of(name, "given_speed", "given_acceleration", "given_angle"):
            return self.own_key(tables.given_key(shaft))
        for motor in tables.controllers:
            if name == train.variable(motor, "reference"):
                return f"{self.controller_key(motor)}.reference"
        names = (
            n for n in train.commanded() if name in (train.variable(n, "command"), train.variable(n, "current_command"))
        )
        return self.own_key(f"command.{next(names)}")

    def inertia_key(self, shaft: str) -> str:
        """Key of the inertia of a shaft, or of the mass of a slide."""
        return self.own_key(f"slides.{shaft}.mass" if shaft in self.tables.slides else f"shafts.{shaft}.inertia")

    def load_key(self, shaft: str) -> str:
        """Key of the load torque on a shaft, or of the load force on a slide."""
        return self.own_key(f"slides.{shaft}.force" if shaft in self.tables.slides else f"shafts.{shaft}.torque")

    def input_keys(self) -> dict[str, str]:
        """Keys of the signals of its inputs, by their names."""
        train = self.train()
        keys = {train.variable(name, "command"): self.own_key(f"command.{name}") for name in train.commanded()}
        return keys | {train.variable(name, "load_torque"): self.load_key(name) for name in self.tables.movers()}

    def prefix(self, motor: str) -> str:
        """Prefix of the names of the variables of a motor's controller."""
        return self.train().shown(f"{motor}_")

    def alone(self) -> Drive | DriveTrain:
        """The drive or the train without its surroundings."""
        written = self.written
        return written.drive() if isinstance(written, DriveTables) else self.train()

    @kept
    def long(self) -> Scenario:
        """The scenario in the long form; of a drive with shafts `motor` and `load`, gear `gearbox`, motor `motor`."""
        return self.of(self.tables, checked=False) if self.form == DRIVE else self

    def train(self) -> DriveTrain:
        """The drive train without its surroundings, with the names that variables have in results of this scenario."""
        return self._drive_of_one_gear() if self.form == DRIVE else self.tables.train()

    @kept
    def _drive_of_one_gear(self) -> DriveOfOneGear:
        return DriveOfOneGear.like(self.tables.train())

    def commanded(self) -> list[str]:
        """Names of what has a command: motors, brakes and friction clutches."""
        return self.train().commanded()

    def variables(self) -> tuple[Variable, ...]:
        """The variables of a result, without the variables of controllers."""
        return variables_of_core(self.core().variables())

    def derive(self, data: dict[str, Any], time: Any) -> None:
        """Add the variables that follow from the solver's variables; a channel that is not there counts as 0."""
        core = self.core()
        following = [v.name for v in self.variables() if v.derived]
        if following:
            nothing = np.zeros_like(time)
            channels = np.array([data.get(name, nothing) for name, *_ in core.channels()], dtype=float)
            data |= zip(following, core.derive(channels), strict=True)

    def axes(self) -> dict[str, Controller]:
        """The sampled controllers by the names of their motors."""
        return {name: c for name, c in self.tables.controllers.items() if isinstance(c, Controller)}

    def continuous(self) -> dict[str, ContinuousController]:
        """The continuous controllers by the names of their motors."""
        return {name: c for name, c in self.tables.controllers.items() if isinstance(c, ContinuousController)}

    def by_prefix(self) -> dict[str, Controller]:
        """The sampled controllers, by what the names of their variables begin with."""
        return {self.prefix(name): c for name, c in self.axes().items()}

    def sliding(self) -> dict[str, tuple[bool, bool]]:
        """Whether the motor of a controller moves a slide, and whether its position is the position of a slide, by the prefix of its variables."""
        train, tables = self.train(), self.tables
        return {
            self.prefix(name): (train.is_slide(train.motors[name].shaft), train.is_slide(tables.controlled(name)))
            for name in self.axes()
        }

    def core(
        self, *, sampled: bool = True, loaded: Collection[str] | None = None, given: Collection[str] | None = None
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
        whole = sampled and loaded is None and given is None
        return self._own_core() if whole else self._core_with(loaded, given, sampled=sampled)

    @kept_while_used
    def _own_core(self) -> _core.Train:
        return self._core_with(None, None, sampled=True)

    def _core_with(
        self, loaded: Collection[str] | None, given: Collection[str] | None, *, sampled: bool
    ) -> _core.Train:
        continuous = self.continuous()
        return core_train(
            self.train(),
            tuple(self.tables.loaded() if loaded is None else loaded),
            tuple(self.tables.given() if given is None else given),
            tuple(motor_laws(self.tables.controllers if sampled else continuous).items()),
            tuple(continuous.items()),
        )

    def control(self, laws: Mapping[str, Law] = NO_LAWS) -> BoundController:
        """The solver's controllers, kept if there are no laws: change copies of them alone (`control.axis.own`)."""
        return self._bound(laws) if laws else self._control()

    @kept
    def _control(self) -> BoundController:
        return self._bound(NO_LAWS)

    def _bound(self, laws: Mapping[str, Law]) -> BoundController:
        with _in_keys(self.own_key):
            return core_control(self.train(), self.axes(), laws)

    def signals(self) -> dict[str, Signal[Any]]:
        """Signals that act on the train, after delays of brakes and clutches, by the name of the result variable."""
        train, controllers = self.train(), self.continuous()
        commands = {
            train.variable(name, "command"): stepper_fields.acting(self.tables, name)
            for name in self.commanded()
            if name not in controllers
        }
        torques = {train.variable(name, "load_torque"): load for name, load in self.tables.loads().items()}
        references = {name: s for motor, c in controllers.items() for name, s in c.signals(motor).items()}
        motions: dict[str, Signal[Any]] = {}
        for name, (speed, acceleration) in self.tables.motions().items():
            motions[train.variable(name, "given_speed")] = speed
            motions[train.variable(name, "given_acceleration")] = acceleration
        currents = {
            train.variable(name, "current_command"): level
            for name, level in stepper_fields.currents(self.tables).items()
        }
        return {**commands, **currents, **torques, **motions, **references}

    @kept
    def begin(self) -> TrainInitial:
        """State at t = 0, with the values that the references give."""
        written, train, tables = self.tables.initial, self.train(), self.tables
        speeds = given_speeds(train, tables.motions())
        angles = {name: float(s.motion.at(0.0)[0]) for name, s in tables.movers().items() if s.motion is not None}
        if not written.on_reference:
            given: dict[str, Any] = {}
            for key, values in (("angles", angles), ("speeds", speeds)):
                for name, value in values.items():
                    own = LINEAR_INITIAL[key] if train.is_slide(name) else key
                    given.setdefault(own, dict(getattr(written, own)))[name] = value
            return written.model_copy(update={key: Named(values) for key, values in given.items()})
        for name, controller in self.axes().items():
            if controller.reference.kind == "position":
                shaft = tables.controlled(name)
                angles[shaft], speed = (float(value) for value in controller.reference.at(0.0)[:2])
                ratios = {other: turns(train, other, shaft) for other in train.shafts}
                speeds |= {other: i * speed for other, i in ratios.items() if i is not None}
        found: dict[str, Any] = {}
        for key, values in (("angles", angles), ("speeds", speeds)):
            found[key] = Named({name: v for name, v in values.items() if not train.is_slide(name)})
            found[LINEAR_INITIAL[key]] = Named({name: v for name, v in values.items() if train.is_slide(name)})
        return written.model_copy(update=found)

    def start(
        self, initial: Initial | TrainInitial | None = None, given: Collection[str] | None = None
    ) -> dict[str, float]:
        """State at t = 0 by the names of its variables.

        Parameters
        ----------
        initial
            State in place of the initial state of the scenario.
        given
            Names of the shafts whose motion is given, if others than those of the scenario.
        """
        train = self.train()
        state = self.begin() if initial is None else initial.of_train()
        driven = self.tables.given() if given is None else given
        values = start_values(train, state, self.core(), driven)
        angles = angles_at_start(train, state.of_all("angles"), state.of_all("twists"), driven)
        known = []
        for name, controller in self.continuous().items():
            shaft = self.tables.controlled(name)
            position = controller.reference.kind == "position"
            measured = angles[shaft] if position else values.get(train.variable(shaft, "speed"), 0.0)
            values |= controller.start(name, measured)
            known += [f"{name}_{variable}" for variable in controller.system().states]
        for name in state.controller_states:
            if name not in known:
                meant = did_you_mean(name, known, f"they are {', '.join(known) or 'none'}")
                raise InputError(
                    f"is no state of a controller of this train; {meant}", f"initial.controller_states.{name}"
                )
        return values | state.controller_states

    def capacities(self, initial: Initial | TrainInitial | None = None) -> dict[str, float]:
        """Hysteresis capacities at t = 0 [N·m] by gear; what is not among them is 0."""
        state = self.tables.initial if initial is None else initial.of_train()
        return {name: h for name, h in state.of_all("hysteresis_capacities").items() if may_differ(h)}


@contextmanager
def _in_keys(written: Any) -> Iterator[None]:
    """Errors that name keys as they are written."""
    try:
        yield
    except InputError as error:
        raise error.with_keys(written) from None


def _in_long_form(tables: Mapping[str, Any], written: Any = str) -> TrainTables:
    data = dict(tables)
    use_train_records(data, written)
    made = TrainTables(**data)
    for name in (name for name, shaft in made.shafts.items() if shaft.domain != "rotation"):
        raise InputError(f"is translation; write the slide as [slides.{name}], with its mass", f"shafts.{name}.domain")
    return made


def _made_again(tables: TrainTables, form: Form) -> Scenario:
    return Scenario.of(tables, form, checked=False)


def is_train(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a scenario are in the long form."""
    return any(table in tables for table in LONG_TABLES)
