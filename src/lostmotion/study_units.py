"""Units in studies: of the keys of a scenario, and of what an expression of the result variables gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

from .quantities import unit_in_schema
from .scenario import Scenario
from .units import registry, si_number, to_si
from .variables import VARIABLES


@cache
def _schema() -> dict[str, Any]:
    return Scenario.model_json_schema()


def _options(node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A node of a JSON Schema, or what it may be instead."""
    if "$ref" in node:
        yield from _options(_schema()["$defs"][node["$ref"].rsplit("/", 1)[1]])
    elif any(key in node for key in ("anyOf", "oneOf", "allOf")) and "x-unit" not in node:
        for key in ("anyOf", "oneOf", "allOf"):
            for option in node.get(key, []):
                yield from _options(option)
    else:
        yield node


@cache
def unit_of_key(key: str) -> str | None:
    """SI unit of a dotted key of the scenario; empty for a plain number, None if it is no quantity or not known."""
    nodes = [_schema()]
    for part in key.split("."):
        nodes = [
            option
            for node in nodes
            if part in node.get("properties", {})
            for option in _options(node["properties"][part])
        ]
    return next((unit for node in nodes if (unit := unit_in_schema(node)) is not None), None)


def in_si(value: Any, unit: str | None) -> Any:
    """Strings with a unit as numbers, in lists and tables too; anything else as it is.

    Raises
    ------
    ValueError
        A string is no number with a unit, or has the unit of something else.
    """
    if isinstance(value, str):
        return si_number(value) if unit is None else to_si(value, unit)
    if isinstance(value, list | tuple):
        return [in_si(x, unit) for x in value]
    return {k: in_si(x, unit) for k, x in value.items()} if isinstance(value, dict) else value


class _Measure:
    """Stands for a variable in an expression and knows its unit alone."""

    def __init__(self, unit: Any) -> None:
        self.unit = unit

    def _same(self, other: Any) -> _Measure:
        if not isinstance(other, _Measure) or not other.unit.is_compatible_with(self.unit):
            raise ValueError("they do not add up")
        return self

    def _plain(self, *_: Any, **__: Any) -> _Measure:
        return _measure("")

    def _by(self, other: Any, power: int) -> _Measure:
        if not isinstance(other, _Measure):
            raise ValueError("a number may be a factor or a change of unit, which cannot be told")
        return _Measure(self.unit * other.unit**power)

    def _itself(self, *_: Any) -> _Measure:
        return self

    __add__ = __sub__ = _same
    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __and__ = __or__ = __invert__ = _plain  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]
    __neg__ = __abs__ = __getitem__ = _itself

    def __mul__(self, other: Any) -> _Measure:
        return self._by(other, 1)

    def __truediv__(self, other: Any) -> _Measure:
        return self._by(other, -1)

    def __pow__(self, power: float) -> _Measure:
        return _Measure(self.unit**power)

    def __getattr__(self, name: str) -> Callable[..., _Measure]:
        """Methods of xarray."""
        second, plain = registry().Unit("s"), registry().Unit("")
        units = {"integrate": self.unit * second, "differentiate": self.unit / second, "var": self.unit**2}
        units |= dict.fromkeys(("idxmax", "idxmin"), second)
        units |= dict.fromkeys(("argmax", "argmin", "count", "all", "any", "isnull", "notnull"), plain)
        return lambda *_, **__: _Measure(units.get(name, self.unit))


class _Energy:
    """Stands for the ledger."""

    def __getattr__(self, _: str) -> _Measure:
        return _measure("J")


def _measure(unit: str) -> _Measure:
    return _Measure(registry().Unit("" if unit == "1" else unit))


def _first(x: _Measure, *_: Any) -> _Measure:
    return x


def _always(unit: str) -> Callable[..., _Measure]:
    return lambda *_, **__: _measure(unit)


def unit_of_expression(text: str) -> str:
    """Unit of what an expression of a study gives, ``"1"`` for a plain number; empty where it cannot be told."""
    names: dict[str, Any] = {v.name: _measure(v.unit) for v in VARIABLES}
    names |= {"energy": _Energy(), "ideal_speed": _measure("rad/s"), "time": _measure("s")}
    names |= dict.fromkeys(("peak", "rms", "mean", "final", "least", "largest", "tracking_error", "abs"), _first)
    names |= dict.fromkeys(("exp", "log", "sign"), _always(""))
    names |= {"sqrt": lambda x: x**0.5, "dead_time": _always("s"), "bandwidth": _always("Hz")}
    try:
        value = eval(compile(text, text, "eval"), {"__builtins__": {}}, names)
    except (ValueError, TypeError, AttributeError):
        return ""
    if not isinstance(value, _Measure):
        return ""
    for known in ("1", *{v.unit: None for v in VARIABLES}, "J", "Hz", "N*m/rad"):
        if _measure(known).unit == value.unit:
            return known
    return f"{value.unit:~C}".replace("**", "^")
