"""One parameter that a study varies: its key, its values or their distribution, and what they do to a scenario."""

import math
import re
from collections.abc import Iterator, Mapping
from statistics import NormalDist
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field, model_validator

from ...data_sheets.train_components import RECORDS
from ...errors import InputError
from ...inputs.cached_values import kept
from ...inputs.named_elements import Named
from ...inputs.part import Part, rule
from ...inputs.quantities import Switch
from ...inputs.refusal_messages import shown
from ...model.signals import Signal
from ...reproducible import exp, log
from ...simulation.forms.set_by_dotted_key import list_index
from ...simulation.scenario.key_suggestions import near_key
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.units_of_keys import in_si, unit_in, unit_of_key
from .records_that_vary import check_names, is_condition, kind_of_record, names_of, names_that_fit

MAX_LEVELS = 1_000_000  # of one parameter
TAKING_NAMES = ("gearbox", "motor", *(f"{table}.NAME.{key}" for table, (key, _) in RECORDS.items()))
WAYS = ("values", "grid", "uniform", "log_uniform", "normal", "triangular")


class Normal(Part):
    """Normal distribution."""

    mean: float
    deviation: Annotated[float, Field(gt=0.0)]  #: standard deviation


class Vary(Part):
    """One parameter, or several that go together.

    Values are SI, or strings with a unit of what the key measures; of the keys `gearbox` and `motor`, and of trains
    `gears.NAME.gearbox` and `motors.NAME.from`, names of records.
    """

    key: str = ""  #: dotted key of the scenario, such as load.inertia
    keys: tuple[str, ...] = ()  #: several keys that all get the value
    name: str = ""  #: column in the result; the first key if left out
    relative: Switch = False  #: the value multiplies what the base scenario has (of a list, each entry)
    unit_of_values: str | None = None  #: SI unit of the values, where the key alone does not say it; of a task
    values: tuple[float | str, ...] | None = None
    """values as they are, or names of records; in a random design each is equally likely"""
    grid: tuple[float, float, int] | None = None  #: first, last, how many
    uniform: tuple[float, float] | None = None
    log_uniform: tuple[float, float] | None = None
    normal: Normal | None = None
    triangular: tuple[float, float, float] | None = None  #: minimum, mode, maximum

    @model_validator(mode="before")
    @classmethod
    def _read_units(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        key = str(data.get("key") or next(iter(data.get("keys") or ()), ""))
        unit = "" if data.get("relative") else data.get("unit_of_values") or unit_of_key(key)
        try:
            if (kind := kind_of_record(key)) is not None:
                return _with_names(data, kind)
            if "catalogue" in data:
                raise ValueError(f"has a catalogue filter, which only {', '.join(TAKING_NAMES)} take")
            return data | {way: in_si(data[way], unit) for way in WAYS if way in data}
        except ValueError as error:
            raise ValueError(f"of {key}: {error}") from None

    @rule
    def _one_way(self) -> Iterator[str]:
        ways = [w for w in WAYS if getattr(self, w) is not None]
        if bool(self.key) == bool(self.keys):
            yield "needs key or keys, one of the two"
        if len(ways) != 1:
            more = ", catalogue" if kind_of_record(self.all_keys[0]) else ""
            yield f"of {self.title}: needs one of {', '.join(WAYS)}{more}"
        if any(kind_of_record(key) for key in self.all_keys) and (self.names is None or self.keys or self.relative):
            yield f"of {self.title}: names of records need a key of their own, and values or catalogue"
        if self.names is None and any(isinstance(x, str) for x in self.values or ()):
            yield f"of {self.title}: has values that are no numbers"
        pair = self.uniform or self.log_uniform
        if pair is not None and not pair[0] < pair[1]:
            yield f"of {self.title}: {pair[0]} must be below {pair[1]}"
        if self.log_uniform is not None and self.log_uniform[0] <= 0.0:
            yield f"of {self.title}: log_uniform needs positive bounds"
        if self.grid is not None and not 1 <= self.grid[2] <= MAX_LEVELS:
            yield f"of {self.title}: grid needs 1 to {MAX_LEVELS} values, not {self.grid[2]}"
        if self.values is not None and not self.values:
            yield f"of {self.title}: values is empty"
        if self.triangular is not None and not self.triangular[0] <= self.triangular[1] <= self.triangular[2]:
            yield f"of {self.title}: triangular must rise"

    @property
    def all_keys(self) -> tuple[str, ...]:
        return self.keys or (self.key,)

    @property
    @kept
    def names(self) -> tuple[str, ...] | None:
        """The names of records, where it varies these; else None."""
        if not self.values or kind_of_record(self.all_keys[0]) is None:
            return None
        return tuple(str(name) for name in self.values)

    @property
    def title(self) -> str:
        return self.name or self.all_keys[0]

    @property
    def unit(self) -> str:
        """Unit of the values."""
        if self.unit_of_values is not None and not self.relative:
            return self.unit_of_values
        return (unit_of_key(self.all_keys[0]) if not self.relative else None) or "1"

    def value(self, number: float) -> float | str:
        """Value of a number of `levels` or `quantile`: itself, or the name at this index, none for NaN."""
        if self.names is None:
            return float(number)
        return "" if math.isnan(number) else self.names[int(number)]

    def levels(self) -> np.ndarray | None:
        """Values of a grid or list, of names their places in it; None for a distribution."""
        if self.names is not None:
            return np.arange(len(self.names), dtype=float)
        if self.values is not None:
            return np.array(self.values, dtype=float)
        return None if self.grid is None else np.linspace(self.grid[0], self.grid[1], self.grid[2])

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Values at probabilities 0 < u < 1."""
        levels = self.levels()
        if levels is not None:
            out: Any = levels[np.minimum((u * len(levels)).astype(int), len(levels) - 1)]
        elif self.uniform is not None:
            out = self.uniform[0] + u * (self.uniform[1] - self.uniform[0])
        elif self.log_uniform is not None:
            a, b = (log(x) for x in self.log_uniform)
            out = exp(a + u * (b - a))
        elif self.normal is not None:
            out = np.vectorize(NormalDist(self.normal.mean, self.normal.deviation).inv_cdf, otypes=[float])(u)
        else:
            assert self.triangular is not None
            low, mode, high = self.triangular
            rising = low + np.sqrt(u * (high - low) * (mode - low))
            falling = high - np.sqrt((1.0 - u) * (high - low) * (high - mode))
            out = np.where(u * (high - low) < mode - low, rising, falling)
        return np.asarray(out, dtype=float)


def _with_names(data: Mapping[str, Any], table: str) -> dict[str, Any]:
    """A filter of the catalogue in place of the names that it lets through."""
    out = dict(data)
    if "catalogue" in out:
        if "values" in out:
            raise ValueError("has values and catalogue; give one of the two")
        wanted = out.pop("catalogue")
        if not isinstance(wanted, dict):
            raise ValueError(f'has catalogue = {shown(wanted)}; it must be a table, such as {{ kind = "strain_wave" }}')
        out["values"] = names_that_fit(table, wanted)
    elif "values" in out:
        out["values"] = names_of(table, out["values"])
    check_names(table, out.get("values") or ())
    return out


def base_value(scenario: Scenario, key: str) -> Any:
    """Value of a scenario at a dotted key. Raises ValueError: there is nothing of that name."""
    node: Any = scenario.written
    for part in key.split("."):
        try:
            if isinstance(node, tuple | list):
                node = node[list_index(node, part)]
            elif isinstance(node, BaseModel) and part in type(node).model_fields:
                node = getattr(node, part)
            elif isinstance(node, Named) and part in node:
                node = node[part]
            elif isinstance(node, Named) and _may_be_left_out(scenario, key):
                return None
            else:
                raise ValueError(f"there is no {part}")
        except ValueError as error:
            hint = f"; did you mean {near}?" if (near := near_key(scenario, key)) else ""
            raise ValueError(f"varies {key}, which the base scenario does not know ({error}){hint}") from None
    return node


def _may_be_left_out(scenario: Scenario, key: str) -> bool:
    """Whether a value at the start, or a command, is 0 where a train does not give it, and may be given."""
    if not re.fullmatch(r"initial\.[^.]+\.[^.]+|command\.[^.]+", key):
        return False
    try:
        scenario.replace(**{key: 0.0})
    except InputError as error:
        raise ValueError(str(error)) from None
    return True


def with_keys_of_tables(scenario: Scenario, entries: Any, of_task: bool) -> Any:
    """Entries of `vary` whose keys are keys of the scenario's tables; columns keep the names that were written."""
    if of_task or not isinstance(entries, list | tuple):
        return entries
    out = []
    for entry in entries:
        changed = entry
        if isinstance(entry, dict):
            keys = [k for k in (entry.get("key"), *(entry.get("keys") or ())) if isinstance(k, str) and k]
            found = {key: scenario.key_of_tables(key) for key in keys}
            if any(key != own for key, own in found.items()):
                own = {
                    "key": found.get(entry.get("key") or "", ""),
                    "keys": [found[k] for k in entry.get("keys") or ()],
                }
                changed = {"name": keys[0]} | entry | own
        out.append(changed)
    return out


def check_spelling(scenario: Scenario, entries: Any) -> None:
    """Sees, before the units of their values are asked for, that the keys of a study are known."""
    for entry in entries if isinstance(entries, list | tuple) else ():
        for key in [entry.get("key"), *(entry.get("keys") or ())] if isinstance(entry, dict) else ():
            if (
                isinstance(key, str)
                and key
                and entry.get("unit_of_values") is None
                and unit_of_key(key) is None
                and not (kind_of_record(key) or is_condition(key))
            ):
                base_value(scenario, key)


def check_key(scenario: Scenario, key: str, *, relative: bool) -> None:
    """Sees that a number, or with `relative` a factor, can take the place of what a scenario has under a key."""
    if is_condition(key):
        if relative:
            raise ValueError(f"varies {key} with relative, but it is itself no datum of the record; give its values")
        return
    value = base_value(scenario, key)
    if isinstance(value, BaseModel | Named):
        if isinstance(value, Signal) and not relative:
            return  # a bare number is a constant
        names = value if isinstance(value, Named) else type(value).model_fields
        inner = ", ".join(f"{key}.{name}" for name in names if name != "kind") or "it has none"
        raise ValueError(f"varies {key}, which is a table; vary one of its keys: {inner}")
    if value is None:
        if relative:
            raise ValueError(f"varies {key} with relative, but the base scenario has no value there to multiply")
        if unit_in(type(scenario.written), key) is None:
            raise ValueError(f"varies {key}, which the base scenario does not have; give it there first")
    elif isinstance(value, str | bool):
        raise ValueError(f"varies {key}, which is {shown(value)} and no number")
    elif isinstance(value, tuple) and not (relative and value and _is_numbers(value)):
        raise ValueError(f"varies {key}, which is a list; vary its entries, such as {key}.0, or numbers with relative")


def _is_numbers(value: Any) -> bool:
    if isinstance(value, tuple | list):
        return all(_is_numbers(x) for x in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def scaled(value: Any, factor: float) -> Any:
    """A number, or each of a list, times a factor."""
    return [scaled(x, factor) for x in value] if isinstance(value, tuple | list) else factor * float(value)
