"""What a study keeps of each run: expressions of the result variables, their values and their units."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cached_property, lru_cache
from types import CodeType
from typing import Any, NamedTuple

import numpy as np

from . import _core
from .errors import InputError
from .results import ENERGY
from .units import registry
from .variables import CHANNEL_NAMES, VARIABLES

# --- units ---


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


# --- functions ---


REDUCTIONS = tuple(_core.reductions())
"""of a variable over time, as the core knows them"""


def _final(x: Any) -> Any:
    return x.isel(time=-1)


def _over_time(plain: Callable[..., Any], careful: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A reduction of xarray that leaves out NaN. Most variables have none, and it is the search for them that takes long.

    plain
        Of values and axis; may pass over NaN, or give NaN.
    careful
        Of an array of xarray, where the plain one has met NaN.
    """

    def reduce(x: Any) -> Any:
        found = x.reduce(plain, "time")
        return found if np.isfinite(found.values).all() else careful(x)

    return reduce


def _reduced(name: str, careful: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A reduction by the core, so that a chunk that the core has reduced has the same bits."""
    how = REDUCTIONS.index(name)

    def plain(values: np.ndarray, axis: int) -> np.ndarray:
        along = np.moveaxis(values, axis, -1)
        rows = np.ascontiguousarray(along, dtype=float).reshape(-1, along.shape[-1])
        return _core.reduce_rows(how, rows).reshape(along.shape[:-1])

    return _over_time(plain, careful)


_rms = _reduced("rms", lambda x: (x**2).mean("time") ** 0.5)


class Function(NamedTuple):
    """A function that expressions may use, of values and of units."""

    of_values: Callable[..., Any]
    of_units: Callable[..., _Measure]


FUNCTIONS = {
    "peak": Function(_reduced("peak", lambda x: abs(x).max("time")), _first),
    "rms": Function(_rms, _first),
    "mean": Function(_reduced("mean", lambda x: x.mean("time")), _first),
    "final": Function(_final, _first),
    "least": Function(_reduced("least", lambda x: x.min("time")), _first),
    "largest": Function(_reduced("largest", lambda x: x.max("time")), _first),
    # First instant [s] at which the variable is more than `share` of its peak away from its start; NaN if never.
    "dead_time": Function(
        lambda x, share=0.01: x["time"].where(abs(x - x.isel(time=0)) > share * abs(x).max("time")).min("time"),
        _always("s"),
    ),
    # Root mean square of the distance from a reference.
    "tracking_error": Function(lambda x, reference: _rms(x - reference), _first),
    "abs": Function(abs, _first),
    "sqrt": Function(np.sqrt, lambda x: x**0.5),
    "exp": Function(np.exp, _always("")),
    "log": Function(np.log, _always("")),
    "sign": Function(np.sign, _always("")),
}
"""what an expression may use, beside the methods of xarray"""

OF_THE_RUN: dict[str, Callable[[], Any]] = {
    "energy": _Energy,
    "time": lambda: _measure("s"),
    "ideal_speed": lambda: _measure("rad/s"),
    "bandwidth": lambda: _always("Hz"),
}
"""further names, and what stands for their units: the ledger; the instants; the load speed of a rigid drive without inertia,
friction and load under the same command; the bandwidth [Hz] of the load speed, a function of the command's amplitude (left
out: the run's own)"""


# --- expressions ---


class Expression:
    """An expression of the result variables, as `keep` has it.

    Raises
    ------
    ValueError
        It cannot be read, or uses a name that is unknown.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            tree = ast.parse(text, mode="eval")
        except SyntaxError as error:
            raise ValueError(f"{text!r} cannot be read as an expression ({error.msg})") from None
        self.names = frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))
        """all that it names"""
        known = {v.name for v in VARIABLES}
        for name in sorted(self.names - FUNCTIONS.keys() - OF_THE_RUN.keys() - known):
            choice = ", ".join((*FUNCTIONS, *OF_THE_RUN))
            raise ValueError(f"{name!r} in {text!r} is neither a result variable nor one of {choice}")
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute):
                if node.attr.startswith("_"):
                    raise ValueError(f"{text!r} must not use {node.attr}")
                if isinstance(node.value, ast.Name) and node.value.id == "energy" and node.attr not in ENERGY:
                    raise ValueError(f"energy.{node.attr} is none of {', '.join(ENERGY)}")
        self.variables = (self.names & known) | ({"command"} if "ideal_speed" in self.names else frozenset())
        """the result variables that it needs"""
        self.reduction: tuple[str, str] | None = None
        """reduction and variable, if it is nothing else, so that the core can do it"""
        match tree.body:
            case ast.Call(ast.Name(reduction), [ast.Name(variable)], []):
                if reduction in REDUCTIONS and variable in CHANNEL_NAMES:
                    self.reduction = reduction, variable

    @cached_property
    def _code(self) -> CodeType:
        return compile(self.text, self.text, "eval")

    def _value(self, names: dict[str, Any]) -> Any:
        return eval(self._code, {"__builtins__": {}}, names)

    def values(self, names: dict[str, Any], runs: int) -> np.ndarray:
        """For each run of several, shape (runs,), from variables (run, time) and what is of the run alone.

        Raises
        ------
        InputError
            It leaves a value for each instant.
        """
        with np.errstate(all="ignore"):
            value = self._value({name: f.of_values for name, f in FUNCTIONS.items()} | names)
        if "time" in getattr(value, "dims", ()):
            raise InputError(f"keep: {self.text!r} leaves a value for each instant; reduce it, as in peak({self.text})")
        return np.broadcast_to(np.asarray(value, dtype=float), (runs,))

    @cached_property
    def unit(self) -> str:
        """Unit of the values, ``"1"`` for a plain number; empty where it cannot be told."""
        names: dict[str, Any] = {v.name: _measure(v.unit) for v in VARIABLES}
        names |= {name: stand_in() for name, stand_in in OF_THE_RUN.items()}
        names |= {name: f.of_units for name, f in FUNCTIONS.items()}
        try:
            value = self._value(names)
        except (ValueError, TypeError, AttributeError):
            return ""
        if not isinstance(value, _Measure):
            return ""
        for known in ("1", *{v.unit: None for v in VARIABLES}, "J", "Hz", "N*m/rad"):
            if _measure(known).unit == value.unit:
                return known
        return f"{value.unit:~C}".replace("**", "^")


@lru_cache(maxsize=1000)
def read_expression(text: str) -> Expression:
    """The expression of a text; each is read once."""
    return Expression(text)
