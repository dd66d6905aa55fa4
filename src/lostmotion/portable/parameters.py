"""Values of a scenario that can be changed in its numbers alone, and the rules by which these follow from them."""

from __future__ import annotations

import itertools
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.doubts import trusted
from ..inputs.quantities import Limit
from ..simulation.scenario import Scenario
from ..simulation.units_of_keys import limit_in, meaning_in, unit_for

Numbers = Callable[[Scenario], np.ndarray]

ROUNDING = 1e-12
"""relative, of a number that follows from a value"""
STEPS = (0.25, 0.04, 0.003)
"""by which a value is changed, relative, until it can be used; one of 0 by as much in SI"""
CHECKS = (0.6, 0.3, 0.15, -0.8, -0.35)
"""shares of the step at which a law is checked; three places must be allowed"""


@dataclass(frozen=True)
class Effect:
    """A number of a scenario: offset + slope * value, or offset + slope/value."""

    place: int
    reciprocal: bool
    offset: float
    slope: float

    def at(self, value: float) -> float:
        return self.offset + (self.slope / value if self.reciprocal else self.slope * value)


@dataclass(frozen=True)
class Parameter:
    """A value of a scenario that can be changed in its numbers."""

    key: str
    unit: str
    value: float
    effects: tuple[Effect, ...]
    limit: Limit
    """the range of its value in scenario files"""
    meaning: str = ""

    def core(self) -> dict[str, Any]:
        """Parameters as `write_description` of the core takes them."""
        limit = self.limit
        effects = [
            {
                "place": e.place,
                "law": "reciprocal" if e.reciprocal else "proportional",
                "offset": e.offset,
                "slope": e.slope,
            }
            for e in self.effects
        ]
        bounds = {"above": limit.gt, "at_least": limit.ge, "at_most": limit.le}
        return {"key": self.key, "unit": self.unit, "value": self.value, **bounds, "effects": effects}


@dataclass(frozen=True)
class Parameters:
    """Dependence of the numbers on the values of a scenario."""

    parameters: tuple[Parameter, ...]
    refused: dict[str, str]
    """keys of the others, and why they cannot be changed"""


def parameters_of(scenario: Scenario, numbers: Numbers) -> Parameters:
    """The values of a scenario that can be changed in its numbers.

    Parameters
    ----------
    numbers
        Gives those of a scenario.
    """
    base = numbers(scenario)
    found: list[Parameter] = []
    refused: dict[str, str] = {}
    for key, value in values_of(scenario.model_dump(exclude_none=True)):
        unit = unit_for(scenario, key)
        if unit is None:
            continue
        law = _law(scenario, key, value, base, numbers)
        if isinstance(law, str):
            refused[key] = law
        elif law:
            form = type(scenario.written)
            found.append(Parameter(key, unit or "1", value, law, limit_in(form, key), meaning_in(form, key)))
    return _together(scenario, found, refused, base, numbers)


def seconds_for(scenario: Scenario, numbers: Numbers) -> float:
    """Estimate of the processor time of `parameters_of` [s], which grows with the square of the size of a train."""
    values = list(values_of(scenario.model_dump(exclude_none=True)))
    begin = time.process_time()
    _changed(scenario, dict(values[:1]), numbers)
    return (1 + len(CHECKS)) * len(values) * (time.process_time() - begin)


# Not of the motion: when it is read, and what was asked of the drive. Tables of numbers are no single values.
_OTHERS = ("simulation", "task", "title")


def values_of(node: Any, key: str = "") -> Iterator[tuple[str, float]]:
    """Dotted keys and values of all numbers with a fraction, those of lists of numbers left out."""
    if isinstance(node, Mapping):
        for name, inner in node.items():
            if key or name not in _OTHERS:
                yield from values_of(inner, f"{key}.{name}" if key else name)
    elif isinstance(node, list | tuple) and not any(isinstance(inner, int | float) for inner in node):
        for k, inner in enumerate(node):
            yield from values_of(inner, f"{key}.{k}")
    elif isinstance(node, float) and not key.rpartition(".")[2].isdecimal():
        yield key, node


def _changed(scenario: Scenario, changes: Mapping[str, float], numbers: Numbers) -> np.ndarray | None:
    """The numbers with other values; None where these cannot be used."""
    try:
        with trusted():
            return numbers(scenario.replace(**changes))
    except (InputError, ValueError):
        return None


def _law(scenario: Scenario, key: str, value: float, base: np.ndarray, numbers: Numbers) -> tuple[Effect, ...] | str:
    """The numbers that follow from a value, or why there is no law; nothing if none follows."""
    unit = abs(value) or 1.0
    for step, sign in itertools.product(STEPS, (1.0, -1.0)):
        there = value + sign * step * unit
        first = _changed(scenario, {key: there}, numbers)
        if first is None:
            continue
        if first.shape != base.shape:
            return "changes what the scenario consists of"
        places = np.flatnonzero(first != base)
        if not places.size:
            return ()
        at = [there, *(value + sign * step * unit * share for share in CHECKS)]
        seen = [first, *(_changed(scenario, {key: v}, numbers) for v in at[1:])]
        tried = [(v, b) for v, b in zip(at, seen, strict=True) if b is not None]
        if len(tried) < 4 or any(b.shape != base.shape for _, b in tried):
            return "can only be changed together with others"
        changed = np.flatnonzero(np.any([b != base for _, b in tried], axis=0))
        effects = []
        for place in changed:
            effect = _effect(int(place), value, base[place], [(v, b[place]) for v, b in tried])
            if effect is None:
                return "is neither linear in the numbers nor reciprocal"
            effects.append(effect)
        return tuple(effects)
    return "can only be changed together with others"


def _effect(place: int, value: float, here: float, seen: Sequence[tuple[float, float]]) -> Effect | None:
    """The law of one number, if all values that were seen follow it."""
    size = max(abs(here), *(abs(n) for _, n in seen))
    there, far = seen[0]
    for reciprocal in (False, True):
        if reciprocal and (value == 0.0 or there == 0.0):
            continue
        a, b = (1.0 / value, 1.0 / there) if reciprocal else (value, there)
        slope = (far - here) / (b - a)
        offset = here - slope * a
        if value != 0.0 and abs(offset) <= ROUNDING * abs(here):  # in proportion, which can be told without rounding
            slope, offset = here * value if reciprocal else here / value, 0.0
        effect = Effect(place, reciprocal, float(offset), float(slope))
        if np.isfinite(size) and all(abs(effect.at(v) - n) <= ROUNDING * size for v, n in seen):
            return effect
    return None


def _together(
    scenario: Scenario, found: list[Parameter], refused: dict[str, str], base: np.ndarray, numbers: Numbers
) -> Parameters:
    """Leaves out parameters whose common effect on a number is not what the laws say."""
    by_place = defaultdict(list)
    for p in found:
        for e in p.effects:
            by_place[e.place].append(p.key)
    pairs = {pair for keys in by_place.values() for pair in itertools.combinations(keys, 2)}
    by_key = {p.key: p for p in found}
    for one, other in sorted(pairs, key=lambda pair: [list(by_key).index(key) for key in pair]):
        if one in refused or other in refused:
            continue
        for step in STEPS:
            values = {key: by_key[key].value + step * (abs(by_key[key].value) or 1.0) for key in (one, other)}
            seen = _changed(scenario, values, numbers)
            if seen is not None:
                break
        else:
            continue
        told = predicted(base, by_key.values(), values)
        size = np.maximum(np.abs(base), np.abs(told))
        with np.errstate(invalid="ignore"):
            apart = (told != seen) & ~(np.abs(told - seen) <= 10.0 * ROUNDING * size)
        if seen.shape != base.shape or np.any(apart):
            refused[other] = f"acts together with {one} in a way that the numbers do not follow"
    return Parameters(tuple(p for p in found if p.key not in refused), refused)


def predicted(base: np.ndarray, parameters: Iterable[Parameter], values: Mapping[str, float]) -> np.ndarray:
    """The numbers of a scenario with other values of parameters, as the C interface makes them.

    A number that depends on several parameters is their product in terms of its present value, if that is not 0 and
    no parameter has an offset. Otherwise it is the sum of their changes.
    """
    effects = defaultdict(list)
    for p in parameters:
        for e in p.effects:
            effects[e.place].append((e, p.value, values.get(p.key, p.value)))
    out = base.copy()
    for place, all_of in effects.items():
        moved = [(e.at(before), e.at(now)) for e, before, now in all_of if now != before]
        if len(all_of) > 1 and base[place] != 0.0 and all(e.offset == 0.0 for e, _, _ in all_of):
            for before, now in moved:
                out[place] *= now / before
        elif len(all_of) > 1:
            out[place] += sum(now - before for before, now in moved)
        elif moved:
            out[place] = moved[0][1]
    return out
