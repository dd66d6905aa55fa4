"""Properties of a value in a study's expression before any run: its unit, and whether it has a value for each instant."""

from typing import NamedTuple

from ...units.grammar import PREFIXED, read_si
from ...units.unit_table import dimension_of

Powers = dict[str, float]  # unit of the table: its power
NAMES = {symbol: name for symbol, (name, _) in PREFIXED.items()} | {"J": "joule"}


class Measure(NamedTuple):
    """Measure of one value."""

    unit: Powers | None = None
    """None where it cannot be determined, as of a number that may be a factor or a change of unit"""
    over_time: bool = False  # a value for each instant, not one for each run
    boolean: bool = False  # the outcome of a comparison


def measure(unit: str, *, over_time: bool = False) -> Measure:
    """Measure of a value with a unit; ``"1"`` for a plain number."""
    return Measure(dict(read_si(unit)), over_time)


def plain(*parts: Measure, boolean: bool = False) -> Measure:
    """A plain number, or the outcome of a comparison, made of others."""
    return Measure({}, _any_over_time(*parts), boolean)


def total(a: Measure, b: Measure) -> Measure:
    """Measure of a sum or difference."""
    fit = a.unit is not None and b.unit is not None and dimension_of(a.unit) == dimension_of(b.unit)
    return Measure(a.unit if fit else None, _any_over_time(a, b))


def product(a: Measure, b: Measure, power: int = 1) -> Measure:
    """Measure of a product, or with power -1 of a quotient."""
    unit = None if a.unit is None or b.unit is None else _times(a.unit, b.unit, power)
    return Measure(unit, _any_over_time(a, b))


def power(a: Measure, exponent: float | None, *parts: Measure) -> Measure:
    """Measure of a power; None: the exponent is not a written number."""
    unit = None if a.unit is None or exponent is None else _times({}, a.unit, exponent)
    return Measure(unit, _any_over_time(a, *parts))


def one_of(a: Measure, *others: Measure) -> Measure:
    """Measure of a value that may come from each of several; a written number has the unit of the rest."""
    unit = a.unit if all(o.unit in (None, a.unit) for o in others) else None
    return Measure(unit, _any_over_time(a, *others))


def reduced(a: Measure, exponent: int = 1) -> Measure:
    """Measure of a reduction over time that gives a value of the same kind, or its square."""
    return Measure(None if a.unit is None else _times({}, a.unit, exponent))


def text_of(a: Measure, known: tuple[str, ...]) -> str:
    """The unit as text, like one of `known` where it is the same; ``"1"`` for a plain number, empty if it cannot be determined."""
    if a.unit is None:
        return ""
    for text in known:
        if measure(text).unit == a.unit:
            return text
    return (_side(a.unit, 1).removeprefix("*") or "1") + _side(a.unit, -1)


def _side(unit: Powers, sign: int) -> str:
    """The factors of a unit above or below the fraction bar, each behind the sign of its operation."""
    symbols = {name: symbol for symbol, name in NAMES.items()}
    factors = ((symbols[name], sign * n) for name, n in sorted(unit.items()) if sign * n > 0)
    return "".join(("*" if sign > 0 else "/") + symbol + ("" if n == 1 else f"^{n:g}") for symbol, n in factors)


def _times(a: Powers, b: Powers, power: float) -> Powers:
    """The first to the power of 1, times the second to a power."""
    found = {name: a.get(name, 0.0) + power * b.get(name, 0.0) for name in {**a, **b}}
    return {name: n for name, n in found.items() if n}


def _any_over_time(*parts: Measure) -> bool:
    return any(p.over_time for p in parts)
