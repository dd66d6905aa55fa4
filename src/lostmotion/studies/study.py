"""A study: a base scenario, what is varied and how, and what is kept of each run."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from ..inputs.part import Part
from ..simulation.scenario import Scenario
from ..simulation.variables import VARIABLES
from .design import unit_cube
from .expressions import Expression, read_expression
from .records import CONDITIONS, TABLE_OF, with_records
from .select import SHARES, USE, Selection, check_bounds
from .vary import Vary, base_value, check_key, scaled

MAX_RUNS = 100_000_000


MAX_BASES = 100  # with other records, that are kept


OWN_COLUMNS = ("run", "error", "switchings", "violated", "why", "not judged")


class Trajectories(Part):
    """Samples to keep, beside the scalars."""

    variables: tuple[str, ...] = Field(min_length=1)
    every: Annotated[int, Field(ge=1)] = 1
    """one of so many samples"""

    @model_validator(mode="after")
    def _known(self) -> Self:
        names = {v.name for v in VARIABLES}
        for v in self.variables:
            if v not in names:
                raise ValueError(f"has the variable {v!r}, which is none; they are {', '.join(sorted(names))}")
        return self


class Study(Part):
    """Many runs of one scenario."""

    title: str = ""
    scenario: Scenario
    """the base, with all values"""
    written: dict[str, Any] = Field(default={})
    """the base as its file has it, with `from` where it names a record; empty if made in Python"""
    design: Literal["grid", "list", "latin_hypercube", "sobol", "random", "saltelli"] = "grid"
    """grid: every combination; list: the first value of each, then the second, ...; saltelli: for Sobol indices"""
    runs: Annotated[int, Field(ge=1, le=MAX_RUNS)] | None = None
    """of a random design; of saltelli the base samples, a power of two"""
    seed: Annotated[int, Field(ge=0)] = 0
    vary: tuple[Vary, ...] = Field(min_length=1)
    keep: dict[str, str] = Field(min_length=1)
    """column = expression of the result variables, such as peak(load_speed) or energy.gear_losses"""
    trajectories: Trajectories | None = None
    select: Selection | None = None
    """which runs fit the task, and which of these are best"""

    _bases: dict[tuple[Any, ...], Scenario] = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self._check_names()
        self._check_keys()
        self._check_design()
        for name, text in self.keep.items():
            try:
                self._check_kept(read_expression(text))
            except ValueError as error:
                raise ValueError(f"keep.{name}: {error}") from None
        if self.select is not None:
            self._check_selection(self.select)
        return self

    def _check_names(self) -> None:
        titles = [v.title for v in self.vary]
        keys = [k for v in self.vary for k in v.all_keys]
        for name, values in (("name", titles), ("key", keys)):
            twice = [x for x in values if values.count(x) > 1]
            if twice:
                raise ValueError(f"has the {name} {twice[0]} twice in vary")
        for table in ("gearbox", "motor"):
            if table in keys and f"{table}.from" in keys:
                raise ValueError(f"has {table} and {table}.from in vary, which are the same; keep one")
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
        motor_varies = any(TABLE_OF.get(key) == "motor" for v in self.vary for key in v.all_keys)
        if "ideal_speed" in expression.names and self.scenario.motor.kind != "dc" and not motor_varies:
            raise ValueError("ideal_speed needs a motor of kind dc; a torque source has no speed of its own")

    def _check_keys(self) -> None:
        """Sees that the keys are there to be varied: in the base, or where records vary, with one that can be run."""
        scenario = self.scenario
        named = [v for v in self.vary if v.names is not None]
        if named:
            for names in itertools.islice(itertools.product(*(v.names or () for v in named)), 1000):
                try:
                    changes = {v.all_keys[0]: name for v, name in zip(named, names, strict=True)}
                    scenario = with_records(self.tables, changes)
                    break
                except ValueError:
                    continue
        from_record = isinstance(self.tables.get("gearbox"), str) or "from" in self.tables.get("gearbox", {})
        for v in self.vary:
            for key in v.all_keys:
                if key in TABLE_OF:
                    continue
                if key in CONDITIONS and not (
                    from_record or any(TABLE_OF.get(n.all_keys[0]) == "gearbox" for n in named)
                ):
                    raise ValueError(
                        f"varies {key}, which belongs beside `from`, but the gearbox of the base scenario is written out; "
                        "name a record there, or vary gearbox too"
                    )
                check_key(scenario, key, relative=v.relative)

    def _check_selection(self, select: Selection) -> None:
        numbers = {v.title: v.unit for v in self.vary if v.names is None}
        units = numbers | {name: e.unit for name, e in self.expressions.items()}
        if select.drive_check:
            units |= {f"{USE}{rule}": "1" for rule in SHARES}
        for column in select.named():
            if column not in units:
                raise ValueError(f"select: {column!r} is no column of numbers; they are {', '.join(units)}")
        check_bounds(select, units)

    @property
    def tables(self) -> dict[str, Any]:
        """The base as tables of a scenario file."""
        return self.written or self.scenario.model_dump()

    def scenario_at(self, row: np.ndarray) -> Scenario:
        """The scenario of one run, by its row of `parameters`.

        Raises
        ------
        InputError
            There is no such scenario.
        """
        values = {key: (v, v.value(number)) for v, number in zip(self.vary, row, strict=True) for key in v.all_keys}
        records = {key: value for key, (_, value) in values.items() if key in TABLE_OF or key in CONDITIONS}
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
            # The names first, so that the conditions find them.
            order = sorted(records, key=lambda k: k not in TABLE_OF)
            found = with_records(self.tables, {k: records[k] for k in order})
            if len(self._bases) >= MAX_BASES:
                self._bases.clear()
            self._bases[key] = found
        return found

    @property
    def expressions(self) -> dict[str, Expression]:
        """What to keep, read."""
        return {name: read_expression(text) for name, text in self.keep.items()}

    @property
    def total(self) -> int:
        """Number of runs."""
        if self.design == "grid":
            counts = [len(v.levels()) for v in self.vary]  # type: ignore[arg-type]
            return math.prod(counts)
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
            out, rest = np.empty((len(index), p)), index.copy()
            for k in range(p - 1, -1, -1):
                values = levels[k]
                assert values is not None
                out[:, k] = values[rest % len(values)]
                rest //= len(values)
            return out
        if self.design == "list":
            return np.stack([v.levels()[first:last] for v in self.vary], axis=1)  # type: ignore[index]
        u = unit_cube(self.design, len(self.vary), self.total, self.seed, first, last)
        return np.stack([v.quantile(u[:, k]) for k, v in enumerate(self.vary)], axis=1)
