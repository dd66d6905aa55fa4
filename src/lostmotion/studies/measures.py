"""What is known of a value in a study's expression before anything runs: its unit, and whether it has a value for each instant."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..units.conversion import registry


class Measure(NamedTuple):
    """Of one value."""

    unit: Any = None
    """a unit of the registry; None where it cannot be determined, as of a number that may be a factor or a change of unit"""
    over_time: bool = False
    """a value for each instant, not one for each run"""
    boolean: bool = False
    """the outcome of a comparison"""


def measure(unit: str, *, over_time: bool = False) -> Measure:
    """That of a value with a unit; ``"1"`` for a plain number."""
    return Measure(registry().Unit("" if unit == "1" else unit), over_time)


def plain(*parts: Measure, boolean: bool = False) -> Measure:
    """A plain number, or the outcome of a comparison, made of others."""
    return Measure(registry().Unit(""), _any_over_time(*parts), boolean)


def total(a: Measure, b: Measure) -> Measure:
    """Of a sum or difference."""
    fit = a.unit is not None and b.unit is not None and a.unit.is_compatible_with(b.unit)
    return Measure(a.unit if fit else None, _any_over_time(a, b))


def product(a: Measure, b: Measure, power: int = 1) -> Measure:
    """Of a product, or with power -1 of a quotient."""
    known = a.unit is not None and b.unit is not None
    return Measure(a.unit * b.unit**power if known else None, _any_over_time(a, b))


def power(a: Measure, exponent: float | None, *parts: Measure) -> Measure:
    """Of a power; None: the exponent is no written number."""
    known = a.unit is not None and exponent is not None
    return Measure(a.unit**exponent if known else None, _any_over_time(a, *parts))


def one_of(a: Measure, *others: Measure) -> Measure:
    """Of a value that may come from each of several; a written number has the unit of the rest."""
    unit = a.unit if all(o.unit in (None, a.unit) for o in others) else None
    return Measure(unit, _any_over_time(a, *others))


def reduced(a: Measure, exponent: int = 1) -> Measure:
    """Of a reduction over time that gives a value of the same kind, or its square."""
    return Measure(None if a.unit is None else a.unit**exponent)


def text_of(a: Measure, known: tuple[str, ...]) -> str:
    """The unit as text, like one of `known` where it is the same; ``"1"`` for a plain number, empty if it cannot be determined."""
    if a.unit is None:
        return ""
    for text in known:
        if measure(text).unit == a.unit:
            return text
    return f"{a.unit:~C}".replace("**", "^")


def _any_over_time(*parts: Measure) -> bool:
    return any(p.over_time for p in parts)
