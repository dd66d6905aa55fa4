"""What public functions are given, checked by their annotations: whatever object comes, the error is one `InputError`."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache, wraps
from numbers import Integral, Real
from typing import Any, ParamSpec, TypeVar, get_args

from ..errors import InputError
from ..units.conversion import Unit
from . import quantities
from .quantities import argument
from .validation import shown

P = ParamSpec("P")
R = TypeVar("R")

# What is wanted, by the name in the annotation; of a class that is not listed its name.
WANTED = {
    "str": "text",
    "Path": "the name of a file or directory",
    "bool": "a Boolean",
    "Count": "a whole number above 0",
    "float": "a number, or text with a number and its unit",
    "SolverName": 'the name of a solver, "exact" or "dormand-prince"',
    "Callable": "a function",
    "Executor": "an executor, such as a ProcessPoolExecutor",
    "Mapping": "a mapping of names to values",
    "xarray.Dataset": "a dataset, such as simulate returns",
    "Drive": "a Drive",
    "Gearbox": 'a Gearbox, such as gearbox("schaeffler-rt1-h-20-100") returns',
    "GearboxSheet": "a GearboxSheet, such as catalogue() lists",
    "Initial": "a state, such as Initial(motor_speed=100)",
    "Scenario": "a Scenario, such as load(path) returns",
    "Simulation": "a Simulation",
    "TrainInitial": 'a state of a train, such as TrainInitial(speeds={"motor": 100})',
    "TrainScenario": "a TrainScenario, such as load(path) returns",
    "Study": "a Study, such as load_study(path) returns",
}
SILENT = ("None", "RawResult")  # accepted, and not asked for


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """The function, with its arguments checked by their annotations before it runs.

    An annotation that is a quantity of `quantities`, such as ``Speed``, also reads text with a unit; a plain ``float`` leaves
    that to the function. ``Any`` is not checked. A wrong number of arguments or an unknown name stays a `TypeError`.
    """
    signature = inspect.signature(function)
    wanted = {p.name: str(p.annotation) for p in signature.parameters.values() if p.annotation is not p.empty}
    wanted = {name: annotation for name, annotation in wanted.items() if annotation != "Any"}
    known = function.__globals__

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError as error:
            raise TypeError(f"{function.__qualname__}() {error}") from None
        for name, annotation in wanted.items():
            if name in bound.arguments:
                bound.arguments[name] = _read(name, bound.arguments[name], annotation, known)
        return function(*bound.args, **bound.kwargs)

    return call


def _read(name: str, value: Any, annotation: str, known: Mapping[str, Any]) -> Any:
    options = _options(annotation)
    for option in options:
        if _fits(value, option, known):
            return _converted(name, value, option, known)
    asked = dict.fromkeys(_wording(option) for option in options if option not in SILENT)
    raise InputError(f"{name}: {shown(value)} must be {', or '.join(asked)}")


@cache
def _options(annotation: str) -> tuple[str, ...]:
    """The parts of a union; what stands in brackets is no part of it."""
    parts, depth, begin = [], 0, 0
    for k, c in enumerate(annotation):
        depth += {"[": 1, "]": -1}.get(c, 0)
        if c == "|" and depth == 0:
            parts.append(annotation[begin:k].strip())
            begin = k + 1
    return (*parts, annotation[begin:].strip())


@cache
def _unit(option: str) -> str | None:
    """The unit of a quantity; None for anything else."""
    return next((x.unit for x in get_args(getattr(quantities, option, None)) if isinstance(x, Unit)), None)


def _several(option: str) -> str | None:
    """Of what a list is."""
    head, bracket, inner = option.partition("[")
    return inner.removesuffix("]") if bracket and head in ("Sequence", "Iterable", "list", "tuple") else None


def _fits(value: Any, option: str, known: Mapping[str, Any]) -> bool:
    if _several(option) is not None:
        return isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping) and not _is_dataset(value)
    if _unit(option) is not None or option == "float":
        return isinstance(value, Real | str) and not isinstance(value, bool)
    match option.partition("[")[0]:
        case "None":
            return value is None
        case "xarray.Dataset":
            return _is_dataset(value)
        case "Count":
            return isinstance(value, Integral) and not isinstance(value, bool) and 0 < int(value) < 2**31
        case "str" | "SolverName":
            return isinstance(value, str)
        case "bool":
            return isinstance(value, bool)
        case "Callable":
            return callable(value)
        case "Executor":
            return callable(getattr(value, "submit", None))
        case "Mapping":
            return isinstance(value, Mapping) and all(isinstance(key, str) for key in value)
        case kind:
            return isinstance(value, known[kind])


def _is_dataset(value: Any) -> bool:
    library = sys.modules.get("xarray")  # who has a dataset has imported it
    return library is not None and isinstance(value, library.Dataset)


def _converted(name: str, value: Any, option: str, known: Mapping[str, Any]) -> Any:
    if (entry := _several(option)) is not None:
        return value if entry == "Any" else [_read(name, x, entry, known) for x in value]
    unit = _unit(option)
    return value if unit is None else argument(name, value, unit)


def _wording(option: str) -> str:
    if (entry := _several(option)) is not None:
        return f"a list, each entry of which is {_wording(entry)}"
    if unit := _unit(option):
        return f"a number in {unit}, or text with its unit"
    kind = option.partition("[")[0]
    return "a number" if unit == "" else WANTED.get(kind, f"a {kind}")
