"""Formulas by which the numbers of a scenario follow from the values in its file; the core computes them without Python."""

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.named_elements import Named
from ..inputs.part import Part
from ..inputs.quantities import Limit
from ..recorded_numbers import Tape
from ..simulation.forms.set_by_dotted_key import CHANGES_OTHERS
from ..simulation.scenario.scenario import Scenario
from ..simulation.scenario.units_of_keys import limit_in, meaning_in, unit_for

Numbers = Callable[[Scenario], np.ndarray]

# Not of the motion: when it is read, and what was asked of the drive.
_OTHERS = ("simulation", "task", "title")
# Of paths of targets and of instants of steps, which are found in arrays, and so record nothing.
_IN_ARRAYS = re.compile(r"(^|\.)(reference\.target|stepping\.(reference|travel))\.")
FROM_ZERO = 0.25  # what a value of 0 is changed to, to see whether it may be another alone


@dataclass(frozen=True)
class Parameter:
    """A value of a scenario that can be changed in its numbers."""

    key: str
    unit: str
    value: float
    limit: Limit  # the range of its value in scenario files
    meaning: str = ""

    def core(self) -> dict[str, Any]:
        """Parameters as `write_description` of the core takes them."""
        limit = self.limit
        bounds = {"above": limit.gt, "at_least": limit.ge, "at_most": limit.le}
        return {"key": self.key, "unit": self.unit, "value": self.value, **bounds}


@dataclass(frozen=True)
class Derivation:
    """The parameters of a scenario, and the formulas by which its numbers follow from them."""

    parameters: tuple[Parameter, ...] = ()
    formulas: tuple[tuple[str, int, int, float], ...] = ()  # law, formulas or parameter that it takes, constant
    conditions: tuple[tuple[str, int, int, bool], ...] = ()
    """comparison of two formulas, and its outcome, for which the formulas hold"""
    results: tuple[tuple[int, int], ...] = ()  # place among the numbers, and formula

    def core(self) -> dict[str, list[dict[str, Any]]]:
        """The formulas as `write_description` of the core takes them."""
        keys = {
            "formulas": ("law", "one", "other", "value"),
            "conditions": ("comparison", "one", "other", "holds"),
            "results": ("place", "formula"),
        }
        return {
            name: [dict(zip(names, row, strict=True)) for row in getattr(self, name)] for name, names in keys.items()
        }


def derivation_of(scenario: Scenario, numbers: Numbers, without: Callable[[str], bool] | None = None) -> Derivation:
    """The values of a scenario that can be changed in its numbers, and what follows from them.

    numbers: gives the derivation of a scenario.
    without: whether a key is to be left out.
    """
    values = {
        key: value
        for key, value in values_of(scenario.written)
        if not (CHANGES_OTHERS.fullmatch(key) or _IN_ARRAYS.search(key) or (without and without(key)))
        and unit_for(scenario, key) is not None
        and (value or _free(scenario, key))
    }
    made = scenario.kept_values()
    what = derivation_of, numbers, tuple(values)
    if what not in made:
        recording = _Recording(scenario, numbers)
        # Where two do not fit together, such as a backlash that is 0 and a damping that is 0, that which is not 0 comes first.
        found = set(recording.recordable(sorted(values, key=lambda key: values[key] == 0.0)))
        places = recording.of([key for key in values if key in found])
        assert places is not None
        made[what] = recording.derivation(places)
    derivation: Derivation = made[what]
    return derivation


def values_of(node: Any, key: str = "") -> Iterator[tuple[str, float]]:
    """Dotted keys and values of all numbers with a fraction; lists of numbers are left out."""
    for name, inner in _entries(node):
        if key or name not in _OTHERS:
            yield from values_of(inner, f"{key}.{name}" if key else name)
    if type(node) is float:
        yield key, node


def _entries(node: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(node, Part):
        yield from ((name, getattr(node, name)) for name in type(node).model_fields)
    elif isinstance(node, Mapping):
        yield from node.items()
    elif isinstance(node, tuple) and not any(isinstance(inner, int | float) for inner in node):
        yield from ((str(k), inner) for k, inner in enumerate(node))


def _free(scenario: Scenario, key: str) -> bool:
    """Whether a value of 0 may be another, where no other one changes."""
    try:
        _with(scenario.written, {key: FROM_ZERO}, checked=True)
    except (InputError, ValueError):
        return False
    return True


class _Recording:
    """A scenario that is made with values that record what is computed of them."""

    def __init__(self, scenario: Scenario, numbers: Numbers) -> None:
        self._scenario, self._base, self._numbers = scenario, numbers(scenario), numbers
        self._values = dict(values_of(scenario.written))
        self._tape, self._keys = Tape(), list[str]()

    def recordable(self, keys: Sequence[str], beside: Sequence[str] = ()) -> list[str]:
        """Keys, with the keys beside them; all values that follow from them are recorded; where not all fit together, the first."""
        if not keys or self.of([*beside, *keys]) is not None:
            return [*beside, *keys]
        if len(keys) == 1:
            return list(beside)
        half = len(keys) // 2
        return self.recordable(keys[half:], self.recordable(keys[:half], beside))

    def of(self, keys: Sequence[str]) -> dict[int, int] | None:
        """The formulas of all places that follow from keys; None if one of these follows in a way that is not recorded."""
        self._tape, self._keys = Tape(), list(keys)
        recorded = {key: self._tape.parameter(k, self._values[key]) for k, key in enumerate(keys)}
        try:
            made = Scenario.of(_with(self._scenario.written, recorded), self._scenario.form, checked=False)
            made.train().check(made.core())
            numbers = self._numbers(made)
        except (InputError, ValueError, ArithmeticError):
            return None
        if numbers.shape != self._base.shape:
            return None
        places = {}
        for place in np.flatnonzero(numbers.view(np.int64) != self._base.view(np.int64)).tolist():
            number = self._tape.marked.get(float(numbers[place]))
            if number is None or number.value != self._base[place]:
                return None
            places[place] = number.formula
        return places

    def derivation(self, places: Mapping[int, int]) -> Derivation:
        """The formulas that the places need; parameters from which nothing follows are constants."""
        formulas, conditions = self._tape.formulas, self._tape.conditions
        of_places = self._used(places.values())
        given = sorted(one for law, one, *_ in (formulas[k] for k in of_places) if law == "parameter")
        number = {k: n for n, k in enumerate(given)}
        kept = sorted(of_places | self._used([k for _, *pair in conditions for k in pair]))
        new = {k: n for n, k in enumerate(kept)}

        def renumbered(law: str, one: int, other: int, value: float) -> tuple[str, int, int, float]:
            if law == "parameter" and one in number:
                return law, number[one], number[one], 0.0
            if law in ("parameter", "constant"):
                return "constant", 0, 0, self._values[self._keys[one]] if law == "parameter" else value
            return law, new[one], new[other], 0.0

        return Derivation(
            tuple(self._parameter(self._keys[k]) for k in given),
            tuple(renumbered(*formulas[k]) for k in kept),
            tuple((law, new[one], new[other], holds) for (law, one, other), holds in conditions.items()),
            tuple((place, new[formula]) for place, formula in sorted(places.items())),
        )

    def _used(self, formulas: Collection[int]) -> set[int]:
        """Formulas, and the formulas that they take."""
        used, waiting = set(formulas), list(formulas)
        while waiting:
            law, *operands, _ = self._tape.formulas[waiting.pop()]
            new = set() if law in ("parameter", "constant") else set(operands) - used
            used |= new
            waiting += new
        return used

    def _parameter(self, key: str) -> Parameter:
        form, unit = type(self._scenario.written), unit_for(self._scenario, key) or "1"
        return Parameter(key, unit, self._values[key], limit_in(form, key), meaning_in(form, key))


def _with(node: Any, values: Mapping[str, float], key: str = "", *, checked: bool = False) -> Any:
    """The same tables with other values; checked: the parts that change must still fit together."""
    if type(node) is float:
        return values.get(key, node)
    old = dict(_entries(node))
    made = {name: _with(v, values, f"{key}.{name}" if key else name, checked=checked) for name, v in old.items()}
    changed = {name: new for name, new in made.items() if new is not old[name]}
    if not changed:
        return node
    if isinstance(node, Part):
        return type(node).of_parts(**made) if checked else node.unchecked(**changed)
    return Named(made) if isinstance(node, Mapping) else tuple(made.values())
