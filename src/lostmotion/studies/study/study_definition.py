"""A study: a base scenario, what is varied and how, and what is kept of each run."""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from ...data_sheets.components import built_in_brake
from ...data_sheets.records import Sheet, find
from ...errors import InputError
from ...inputs.part import Part
from ...inputs.quantities import Whole
from ...inputs.refusal_messages import did_you_mean, listed
from ...model.gearbox import Gearbox
from ...model.motor import Motor
from ...model.process_loads import HoldingBrake
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.units_of_keys import unit_in, unit_of_key
from ...sizing.axis_task.axis_task import FEWEST, ONE_WAY, AxisTask, reference_of, turns_back
from ...sizing.axis_task.candidate_scenario import axis_scenario, with_scale_alone
from ...sizing.axis_task.cycle_demands import COLUMNS as AXIS_COLUMNS
from ...sizing.axis_task.cycle_demands import unit_of_column
from ...sizing.linear_stage_demands import stage_of, together
from ...sizing.whole_drives import LINEAR, WHOLE, whole_drive
from ..expressions.expressions import Expression, read_expression
from ..expressions.vocabulary import Vocabulary, vocabulary_of
from .drive_check_columns import ESTIMATED
from .random_designs import unit_cube
from .records_that_vary import is_condition, kind_of_record, name_key, names_a_record, owner_of, with_records
from .select_table import SHARES, TASK_SHARES, USE, Selection, check_bounds
from .stepper_candidates import stepper_of
from .task_keys import COMMON, with_value
from .vary import Vary, base_value, check_key, check_spelling, scaled, with_keys_of_tables

MAX_RUNS = 100_000_000
MAX_BASES = 100  # with other records, that are kept
T = TypeVar("T")
OWN_COLUMNS = ("run", "error", "switchings", "violated", "why", "not judged", ESTIMATED)


class Trajectories(Part):
    """Samples to keep, beside the scalars."""

    variables: tuple[str, ...] = Field(min_length=1)
    every: Annotated[Whole, Field(ge=1)] = 1  #: one of so many samples


class Study(Part):
    """Many runs of one scenario, of a drive or of a drive train."""

    title: str = ""
    scenario: Scenario  #: the base, with all values
    written: dict[str, Any] = Field(default={})
    """the base as its file has it, with the names of records; empty if made in Python"""
    design: Literal["grid", "list", "latin_hypercube", "sobol", "random", "saltelli"] = "grid"
    """grid: every combination; list: the first value of each, then the second, ...; saltelli: for Sobol indices"""
    runs: Annotated[Whole, Field(ge=1, le=MAX_RUNS)] | None = None
    """number of runs of a random design; for saltelli the base samples, a power of two"""
    seed: Annotated[Whole, Field(ge=0)] = 0
    vary: tuple[Vary, ...] = ()
    keep: dict[str, str] = Field(default={})
    """column = expression of the result variables, such as peak(load_speed) or energy.gear_losses"""
    trajectories: Trajectories | None = None
    select: Selection | None = None  #: criteria of the runs that fit the task, and of the best of these
    axis: AxisTask | None = None
    """each run is a cycle of this task, under gains by rule; it keeps the columns of `axis_columns.COLUMNS`"""
    task_tables: dict[str, Any] = Field(default={})  #: tables of the task, where keys of its own vary

    of_tables: ClassVar[Callable[[dict[str, Any]], "Study"]]
    """makes the study of the tables of a task; set by `task_file`, which knows them"""
    _bases: dict[tuple[Any, ...], Scenario] = PrivateAttr(default_factory=dict)
    _kept: dict[Any, Any] = PrivateAttr(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _read_scenario(cls, data: Any) -> Any:
        base = data.get("scenario") if isinstance(data, dict) else None
        if isinstance(base, dict):
            base = Scenario.model_validate(base)
            data = data | {"scenario": base}
        if isinstance(base, Scenario):
            vary = with_keys_of_tables(base, data.get("vary"), data.get("axis") is not None)
            check_spelling(base, vary)
            data = data | {"vary": vary}
        return data

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if not self.vary and self.axis is None:
            raise ValueError("lacks [[vary]], which says what differs from run to run; add one")
        self._check_names()
        self._check_keys()
        self._check_design()
        for name, text in self.keep.items():
            try:
                self._check_kept(read_expression(text, self.vocabulary))
            except ValueError as error:
                raise ValueError(f"keep.{name}: {error}") from None
        self._check_trajectories()
        if self.axis is not None:
            self._check_axis(self.axis)
        elif not self.keep:
            raise ValueError(
                'lacks keep, what is kept of each run; add a column such as peak_load_speed = "peak(load_speed)"'
            )
        if self.select is not None:
            self._check_selection(self.select)
        return self

    def _check_axis(self, task: AxisTask) -> None:
        if self.keep or self.trajectories is not None:
            raise ValueError("has keep or trajectories, but a task keeps columns of its own; leave them out")
        task.check(self.scenario)

    def _is_own(self, key: str) -> bool:
        """Whether it is a key of a task, and none of its motor or gearbox."""
        return self.axis is not None and key.split(".", maxsplit=1)[0] not in ("gearbox", "motor")

    def at(self, row: np.ndarray) -> tuple["Study", np.ndarray]:
        """The study with the values of a row at keys that are none of motor or gearbox, and the row without these.

        Raises InputError: there is no such task.
        """
        own = [k for k, v in enumerate(self.vary) if v.unit_of_values is not None]
        if not own:
            return self, row
        values = [(k, float(row[k])) for k in own if not math.isnan(row[k])]

        def made() -> Study:
            tables = self.task_tables
            for k, value in values:
                tables = with_value(tables, self.vary[k].model_dump(), value)
            entries = [v for k, v in enumerate(tables["vary"]) if k not in own]
            return type(self).of_tables({**tables, "vary": entries})

        return self.once(("at", *values), made), np.delete(row, own)

    def _check_names(self) -> None:
        titles = [v.title for v in self.vary]
        keys = [k for v in self.vary for k in v.all_keys]
        for name, values in (("name", titles), ("key", keys)):
            twice = [x for x in values if values.count(x) > 1]
            if twice:
                raise ValueError(f"has the {name} {twice[0]} twice in vary")
        for kind in ("gearbox", "motor"):
            if kind in keys and f"{kind}.from" in keys:
                raise ValueError(f"has {kind} and {kind}.from in vary, which are the same; keep one")
        for key in keys:
            if key.split(".", maxsplit=1)[0] == "simulation":
                raise ValueError(f"varies {key}; all runs must have the same samples")
        for name in self.keep:
            if name in {*titles, *OWN_COLUMNS} or name.startswith(USE):
                raise ValueError(f"keeps {name!r}, a name that is taken; choose another")

    def _check_design(self) -> None:
        for v in self.vary:
            if v.levels() is None and self.design in ("grid", "list"):
                raise ValueError(
                    f"has design {self.design}, for which {v.title} needs values or grid, not a distribution"
                )
        if self.design in ("grid", "list"):
            if self.runs is not None:
                raise ValueError(f"has runs, but with design {self.design} their number follows; leave it out")
        elif self.runs is None:
            raise ValueError(f"lacks runs, which design {self.design} needs")
        if self.design == "list" and len({len(v.levels()) for v in self.vary}) > 1:  # type: ignore[arg-type]
            raise ValueError("has design list, but vary has lists of different lengths")
        if self.design == "saltelli" and self.runs is not None and self.runs & (self.runs - 1):
            raise ValueError(f"has runs = {self.runs}; saltelli needs a power of two")
        if self.total > MAX_RUNS:
            raise ValueError(f"has {self.total} runs, more than {MAX_RUNS}")

    def _check_kept(self, expression: Expression) -> None:
        table = self.scenario.simulation
        if any(not -table.samples <= k < table.samples for k in expression.indices):
            raise ValueError(f"{expression.text!r} reads a sample that a run of {table.samples} does not have")
        if any(not 0.0 <= t <= table.duration for t in expression.instants):
            raise ValueError(f"{expression.text!r} reads an instant outside the {table.duration} s of a run")
        if "ideal_speed" not in expression.names:  # which expressions of trains do not know
            return
        motor_varies = any(kind_of_record(key) == "motor" for v in self.vary for key in v.all_keys)
        if any(m.kind == "torque_source" for m in self.scenario.train().motors.values()) and not motor_varies:
            raise ValueError(
                "ideal_speed needs a motor of kind dc or synchronous; a torque source has no speed of its own"
            )

    def _check_trajectories(self) -> None:
        known = [name for name, _ in self.vocabulary.variables]
        for name in self.trajectories.variables if self.trajectories else ():
            if name not in known:
                raise ValueError(
                    f"trajectories: has the variable {name!r}, which is none; they are {listed(sorted(known))}"
                )

    def _check_keys(self) -> None:
        """Sees that the keys are there to be varied: in the base, or where records vary, with one that can be run."""
        keys = [(key, v.relative) for v in self.vary for key in v.all_keys if not self._is_own(key)]
        owners = {owner_of(key) for key, _ in keys if kind_of_record(key)}
        for key, _ in keys:
            if kind_of_record(key) or is_condition(key):
                base_value(self.scenario, owner_of(key))  # so that it is there
        scenario = self._with_first_records() if owners else self.scenario
        for key, relative in keys:
            if kind_of_record(key) or (self.axis is not None and self.axis.of_stepper(key)):
                continue
            if is_condition(key):
                owner = owner_of(key)
                if owner not in owners and not names_a_record(self.tables, owner):
                    raise ValueError(
                        f"varies {key}, which belongs beside `{name_key(owner)}`, but the {owner} of the base scenario is written "
                        "out; name a record there, or vary its own keys, such as losses.values with relative = true"
                    )
            check_key(scenario, key, relative=relative)
            if unit_in(type(scenario.written), key) != unit_of_key(key):
                raise ValueError(f"varies {key}, which is a key of the short form, too; rename that element")

    def _with_first_records(self) -> Scenario:
        """The base with the first of the varied records that can be run."""
        named = {v.all_keys[0]: v.names for v in self.vary if v.names is not None and not self._is_own(v.all_keys[0])}
        for names in itertools.islice(itertools.product(*named.values()), 1000):
            try:
                return with_records(self.tables, dict(zip(named, names, strict=True)))
            except ValueError:
                continue
        return self.scenario

    def _check_selection(self, select: Selection) -> None:
        numbers = {v.title: v.unit for v in self.vary if v.names is None}
        units = numbers | self.kept_units
        if select.drive_check:
            units |= {f"{USE}{rule}": "1" for rule in (SHARES if self.axis is None else TASK_SHARES)}
        for column in select.named():
            if column not in units:
                near = did_you_mean(column, units, f"they are {', '.join(units)}")
                raise InputError(f"{column!r} is no column of numbers; {near}", "select")
        check_bounds(select, units)
        if self.axis is not None:
            reference = reference_of(self.scenario)
            if "reversal_error" in select.named() and not turns_back(reference):
                raise InputError(f"reversal_error {ONE_WAY}; leave it out", "select")
            if "settling_time" in select.named() and (self.axis.settling_window is None or not reference.moves):
                raise InputError(
                    "settling_time needs task.settling_window, and moves; add them, or leave it out", "select"
                )

    @property
    def _task(self) -> AxisTask:
        assert self.axis is not None
        return self.axis

    @property
    def tables(self) -> dict[str, Any]:
        """The base as tables of a scenario file."""
        return self.written or self.scenario.model_dump()

    @property
    def vocabulary(self) -> Vocabulary:
        """Names that its expressions may use."""
        return self.once(("vocabulary",), lambda: vocabulary_of(self.scenario))

    def scenario_at(self, row: np.ndarray) -> Scenario:
        """The scenario of one run, by its row of `parameters`; of a task under gains by rule.

        Raises InputError: there is no such scenario.
        """
        return self.scenario_with(dict(enumerate(row))) if self.axis is None else self.axis_at(row, FEWEST)

    def axis_at(self, row: np.ndarray, cycles: int) -> Scenario:
        """The scenario of one pair of a task over so many cycles.

        Raises InputError: there is no such scenario.
        """
        one, row = self.at(row)
        if one is not self:
            return one.axis_at(row, cycles)
        motor, gearbox_alone = self.part("motor", row), self.part("gearbox", row)
        gearbox = gearbox_alone
        if self._task.linear is not None and not self.slides_itself(row):
            keys = self.part_key("gearbox", row), self.part_key(str(self._task.stage_kind), row)
            gearbox = self.once(keys, lambda: together(gearbox_alone, self.part("stage", row)))
        return axis_scenario(self.base_of(row), motor, gearbox, self._task, cycles)

    def base_of(self, row: np.ndarray) -> Scenario:
        """The base of a row of a task: of a linear motor with the scale alone, and the weight of its coils on the guide."""
        if not self.slides_itself(row):
            return self.scenario

        def made() -> Scenario:
            assert self._task.linear is not None
            base, coils = with_scale_alone(self.scenario), float(self.part("motor", row).rotor_inertia)
            return base.model_copy(update={"load": self._task.linear.carrying(base.load, coils)})

        return self.once(("base", self.part_key("motor", row)), made)

    def whole_drive(self, row: np.ndarray) -> tuple[str, int] | None:
        """Key and place in `vary` of the whole drive of a row of a task; None of a pair of motor and gearbox."""
        found = ((v.all_keys[0], k) for k, v in enumerate(self.vary) if v.all_keys[0] in WHOLE)
        return next(((key, k) for key, k in found if not math.isnan(row[k])), None)

    def slides_itself(self, row: np.ndarray) -> bool:
        """Whether the drive of a row of a task is a linear motor, which needs no stage."""
        whole = self.whole_drive(row)
        return whole is not None and whole[0] in LINEAR

    def part_key(self, kind: str, row: np.ndarray) -> tuple[Any, ...]:
        """Column of a row that determines its ``"gearbox"`` or its ``"motor"``."""
        whole = self.whole_drive(row) if kind in ("gearbox", "motor") else None
        if whole is not None:
            return (kind, (whole[1], float(row[whole[1]])))
        return (kind, *((k, float(row[k])) for k, v in enumerate(self.vary) if v.all_keys[0].split(".")[0] == kind))

    def part(self, kind: str, row: np.ndarray) -> Any:
        """The ``"gearbox"``, the ``"motor"`` or the ``"stage"`` of a row of a task, made once.

        Raises InputError: there is none.
        """
        linear = None if self.axis is None else self.axis.linear
        key = self.part_key(linear.kind if kind == "stage" and linear is not None and linear.kind else kind, row)
        return self.once(key, lambda: self._made(kind, key[1:], row))

    def _made(self, kind: str, parameters: tuple[tuple[int, float], ...], row: np.ndarray) -> Any:
        task = self.axis
        if kind in ("gearbox", "motor") and (whole := self.whole_drive(row)) is not None:
            motor, gearbox = self.once(("whole", *parameters), lambda: self._whole(*whole, row))
            return motor if kind == "motor" else gearbox
        if kind == "stage":
            assert task is not None
            assert task.linear is not None
            assert task.linear.kind is not None
            names = [self.vary[k].value(number) for k, number in parameters]
            return stage_of(task.linear.kind, {"from": names[0], **task.linear.stage} if names else task.linear.stage)
        if kind == "motor" and task is not None:
            stepper = self._stepper(parameters)
            return (
                task.fed(stepper, self.brake(row))
                if stepper is not None
                else self._under(task, self._varied(kind, parameters), self.brake(row))
            )
        return self._varied(kind, parameters)

    def _varied(self, kind: str, parameters: tuple[tuple[int, float], ...]) -> Any:
        return getattr(self.scenario_with(dict(parameters)), kind)

    def _stepper(self, parameters: tuple[tuple[int, float], ...]) -> Motor | None:
        """The stepper of a row of a task; None of another motor."""
        steppers = self._task.steppers
        return stepper_of(steppers, [(self.vary[k], number) for k, number in parameters]) if steppers else None

    def brake(self, row: np.ndarray) -> HoldingBrake | None:
        """The holding brake of a row of a task.

        Raises InputError: the task wants the brake of the motor, and the catalogue has none.
        """
        brake = self._task.brake
        if brake is None or not brake.of_the_motor:
            return brake
        record = next((r for kind, r in self.records(row).items() if kind in ("motor", *WHOLE)), None)
        if record is None:
            raise InputError('"of the motor" needs the record of a motor; give torque and inertia', "task.brake")
        return HoldingBrake(**built_in_brake(record.name))

    def _whole(self, kind: str, k: int, row: np.ndarray) -> tuple[Motor, Gearbox]:
        """Motor and gearbox of a whole drive."""
        task = self._task
        beside, friction = task.whole.get(kind, {}), 0.0 if task.linear is None else task.linear.guide_friction
        motor, gearbox = whole_drive(kind, str(self.vary[k].value(row[k])), beside, friction or 0.0)
        return task.fed(motor, None if kind == "linear_motor" else self.brake(row)), gearbox

    def _under(self, task: AxisTask, motor: Motor, brake: HoldingBrake | None) -> Motor:
        """A motor as the supply of a task feeds it."""
        if task.current is not None and motor.kind != "torque_source":
            values = {"motor": motor.model_dump(), "controller.current": task.current.model_dump()}
            self.scenario.replace(**values)
        return task.fed(motor, brake)

    def records(self, row: np.ndarray) -> dict[str, Sheet]:
        """Data sheets of the parts of a row of a task that are records, by their kinds.

        Raises InputError: a file of them cannot be read.
        """
        linear, found = self._task.linear, dict[str, Sheet]()
        motor = self._task.steppers or self.tables.get("motor", {})
        tables = {"motor": motor, "gearbox": self.tables.get("gearbox", {})}
        if (whole := self.whole_drive(row)) is not None:
            kind, k = whole
            found[kind], tables = find(str(self.vary[k].value(row[k])), kind), {}
        if linear is not None and linear.kind is not None and not self.slides_itself(row):
            tables[linear.kind] = linear.stage
        for kind, table in tables.items():
            varied = [self.vary[k].value(number) for k, number in self.part_key(kind, row)[1:] if self.vary[k].names]
            name = varied[0] if varied else table.get("from")
            if name is not None:
                found[kind] = find(str(name), kind)
        return found

    def scenario_with(self, numbers: Mapping[int, float]) -> Scenario:
        """The base with some of the parameters, by their places in `vary`.

        Raises InputError: there is no such scenario.
        """
        varied = [(self.vary[k], number) for k, number in numbers.items()]
        values = {key: (v, v.value(number)) for v, number in varied for key in v.all_keys}
        records = {key: value for key, (_, value) in values.items() if kind_of_record(key) or is_condition(key)}
        base = self._with_records(records) if records else self.scenario
        changes = {
            key: scaled(base_value(base, key), float(value)) if v.relative else value
            for key, (v, value) in values.items()
            if key not in records
        }
        return base.replace(**changes) if changes else base

    def _with_records(self, records: dict[str, Any]) -> Scenario:
        """The base with other records; the last ones are kept, since other parameters may vary beside them."""
        key = tuple(sorted(records.items()))
        found = self._bases.get(key)
        if found is None:
            found = with_records(self.tables, records)
            if len(self._bases) >= MAX_BASES:
                self._bases.clear()
            self._bases[key] = found
        return found

    @property
    def kept(self) -> dict[Any, Any]:
        """Common values of its runs, made once."""
        return self._kept

    def once(self, key: tuple[Any, ...], make: Callable[[], T]) -> T:
        """Value that is made at most once, or the error in its place."""
        if key not in self._kept:
            try:
                self._kept[key] = make()
            except InputError as error:
                self._kept[key] = error
        found = self._kept[key]
        if isinstance(found, InputError):
            raise found.with_traceback(None)
        return found  # type: ignore[no-any-return]

    @property
    def kept_units(self) -> dict[str, str]:
        """The columns of numbers that it keeps, each with its unit."""
        if self.axis is not None:
            slides = self.axis.linear is not None
            return {name: unit_of_column(name, slides=slides) for name in AXIS_COLUMNS}
        return {name: e.unit for name, e in self.expressions.items()}

    @property
    def expressions(self) -> dict[str, Expression]:
        """Expressions to keep, parsed."""
        return {name: read_expression(text, self.vocabulary) for name, text in self.keep.items()}

    def _grids(self) -> list[list[int]]:
        """Places in `vary` that are combined with each other: all, or for a task the keys of pairs, then each kind of whole drive."""
        places = {k: v.all_keys[0] for k, v in enumerate(self.vary)}
        if self.axis is None:
            return [list(places)]
        table = {k: key.split(".")[0] for k, key in places.items()}
        pairs = [k for k in places if table[k] not in WHOLE]
        stages = [k for k in places if table[k] == self.axis.stage_kind]
        whole = [
            [
                *(k for k in places if table[k] in COMMON or (table[k] == key and k != place)),
                *(() if key in LINEAR else stages),
                place,
            ]
            for place, key in places.items()
            if key in WHOLE
        ]
        return ([pairs] if self.axis.pairs else []) + whole

    def _size(self, grid: list[int]) -> int:
        """Number of combinations of a grid."""
        sizes: list[int] = [len(self.vary[k].levels()) for k in grid]  # type: ignore[arg-type]
        return math.prod(sizes)

    @property
    def total(self) -> int:
        """Number of runs."""
        if self.design == "grid":
            return sum(self._size(grid) for grid in self._grids())
        if self.design == "list":
            return len(self.vary[0].levels())  # type: ignore[arg-type]
        assert self.runs is not None
        return self.runs * (2 * len(self.vary) + 2) if self.design == "saltelli" else self.runs

    def parameters(self, first: int, last: int) -> np.ndarray:
        """Values of the runs first .. last - 1, one row each. A row depends on the study alone."""
        p = len(self.vary)
        index = np.arange(first, last)
        if self.design == "grid":
            levels = [v.levels() for v in self.vary]
            out, begin = np.full((len(index), p), math.nan), 0
            for grid in self._grids():
                end = begin + self._size(grid)
                here = (index >= begin) & (index < end)
                rest, begin = index[here] - begin, end
                for k in reversed(grid):
                    values = levels[k]
                    assert values is not None
                    out[here, k] = values[rest % len(values)]
                    rest = rest // len(values)
            return out
        if self.design == "list":
            return np.stack([v.levels()[first:last] for v in self.vary], axis=1)  # type: ignore[index]
        u = unit_cube(self.design, len(self.vary), self.total, self.seed, first, last)
        return np.stack([v.quantile(u[:, k]) for k, v in enumerate(self.vary)], axis=1)
