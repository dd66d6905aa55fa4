"""A scenario: a drive, what acts on it and what is wanted of it, in the words of its file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import model_validator

from .. import _core
from ..control.axis import NO_LAWS, Bound, core_control
from ..control.continuous import ContinuousController
from ..control.controller import Controller
from ..control.law import Law
from ..data_sheets.components import ACCESSORIES
from ..inputs.kept import kept
from ..inputs.part import Part
from ..inputs.quantities import Positive, Time
from ..model.gearbox import Transmission
from ..model.linear_train import LinearElements
from ..model.signals import Signal
from ..model.train import DriveTrain
from .variables import Variable

MAX_SAMPLES = 100_000_000
LONG_TABLES = ("shafts", "slides", *LinearElements.model_fields)  # of which one makes a scenario one in the long form

# In the JSON Schema of files, beside what a scenario has.
BASE = {"type": "string", "description": "scenario file that this one changes"}
RECORD_NAME = {"type": "string", "description": "name of a record of the catalogue, or a file with one (.toml)"}


def with_accessories(schema: dict[str, Any]) -> dict[str, Any]:
    """A JSON Schema in which brake and amplifier of a task may name a record."""
    from_record = {"type": "object", "properties": {"from": RECORD_NAME}, "required": ["from"]}
    for task in ("Task", "TrainTask"):
        properties = schema["$defs"].get(task, {}).get("properties", {})
        for key in ACCESSORIES:
            if key in properties:
                properties[key]["anyOf"] += [RECORD_NAME, from_record]
    return schema


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
            import_module(".train_scenario" if long else ".drive_scenario", __package__)  # which import this module
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


def is_train(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a scenario are in the long form."""
    return any(table in tables for table in LONG_TABLES)
