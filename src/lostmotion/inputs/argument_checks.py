"""Checks of the arguments of public functions by their annotations: any wrong object ends in one `InputError`."""

import inspect
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sized
from functools import cache, wraps
from numbers import Integral
from typing import Any, ParamSpec, TypeAlias, TypeVar, get_args

from ..errors import ArgumentError, InputError
from ..units.conversion import Unit
from ..units.scalars import is_number, is_several, objection, scalar
from . import quantities
from .quantities import argument
from .refusal_messages import did_you_mean, shown

P = ParamSpec("P")
R = TypeVar("R")

RecordName: TypeAlias = str
ScenarioName: TypeAlias = str

# What is wanted, by the name in the annotation; of a class that is not listed its name.
WANTED = {
    "str": "text",
    "Path": "the name of a file or directory",
    "bool": "a Boolean",
    "Count": "a whole number above 0",
    "int": "a whole number",
    "float": "a number, or text with a number and its unit",
    "SolverName": 'the name of a solver, "exact" or "dormand-prince"',
    "OutputName": 'the form of a result, "dataset" or "arrays"',
    "RecordName": "the name of a record, or of a file with one",
    "ScenarioName": "the name of a scenario, or of a file with a scenario or a result",
    "Callable": "a function",
    "Executor": "an executor, such as a ProcessPoolExecutor",
    "Mapping": "a mapping of names to values",
    "xarray.Dataset": "a dataset, such as simulate returns",
    "Drive": "a Drive",
    "DriveTrain": "a DriveTrain, such as scenario.train() returns",
    "Gear": "a Gear of a drive train",
    "Gearbox": 'a Gearbox, such as gearbox("schaeffler-rt1-h-20-100") returns',
    "GearboxSheet": "a GearboxSheet, such as catalogue() lists",
    "ScrewData": 'a Screw, such as Screw(input="motor", output="table", lead="10 mm")',
    "ScrewSheet": "a ScrewSheet, such as catalogue() lists",
    "Initial": "a state, such as Initial(motor_speed=100)",
    "Scenario": "a Scenario, such as load(path) returns",
    "Simulation": "a Simulation",
    "TrainInitial": 'a state of a train, such as TrainInitial(speeds={"motor": 100})',
    "Study": "a Study, such as load_study(path) returns",
}
SILENT = ("None", "RunArrays")  # accepted, and not asked for


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """The function, with its arguments checked by their annotations before it runs.

    An annotation that is a quantity of `quantities`, such as ``Speed``, also reads text with a unit; a plain ``float`` leaves
    that to the function. ``Any`` is not checked. A wrong number of arguments or an unknown name is an `ArgumentError`.
    """
    signature = inspect.signature(function)
    wanted = {p.name: p.annotation for p in signature.parameters.values() if p.annotation is not p.empty}
    if evaluated := [name for name, annotation in wanted.items() if not isinstance(annotation, str)]:
        raise TypeError(
            f"{function.__module__}: {evaluated[0]} is checked by the name of its annotation; import annotations from __future__"
        )
    wanted = {name: annotation for name, annotation in wanted.items() if annotation != "Any"}
    known = function.__globals__

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError:
            raise misfit(
                function.__qualname__, signature.parameters, kwargs, _reason(signature, args, kwargs)
            ) from None
        for name, annotation in wanted.items():
            if name in bound.arguments:
                bound.arguments[name] = _read(name, bound.arguments[name], annotation, known)
        return function(*bound.args, **bound.kwargs)

    return call


def misfit(function: str, parameters: Iterable[str], given: Iterable[str], problem: str) -> ArgumentError:
    """Error in the names or the number of the arguments of a call.

    parameters: names of the arguments that the function has.
    given: names of the arguments given by name.
    problem: what is wrong with the call if all names are known.
    """
    known = [name for name in parameters if name != "self"]
    where = f"{function.removesuffix('.__init__')}()"
    if unknown := [name for name in given if name not in known]:
        meant = did_you_mean(unknown[0], known, f"its arguments are {', '.join(known)}" if known else "it has none")
        return ArgumentError(f"{where} has no argument {unknown[0]}; {meant}")
    return ArgumentError(f"{where} {problem}")


def lacks(name: str) -> str:
    """Problem of a call without an argument that is needed."""
    return f"lacks the argument {name}; add it"


def _reason(signature: inspect.Signature, args: Sized, given: Collection[str]) -> str:
    """Problem of a call whose arguments all have known names."""
    parameters = signature.parameters.values()
    places = [p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    taken = [name for name in places if name != "self"]
    if (excess := len(args) - len(places)) > 0:
        count = f"at most {len(taken)} value{'s' * (len(taken) != 1)}" if taken else "no value"
        rest = "; give the others by name" if len(parameters) > len(places) else ""
        return f"takes {count} without a name, not {len(taken) + excess}{rest}"
    by_place = places[: len(args)]
    if twice := [name for name in by_place if name in given]:
        return f"has the argument {twice[0]} twice, by its position and by its name; leave one out"
    needed = [p.name for p in parameters if p.default is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    missing = (name for name in needed if name not in by_place and name not in given)
    return lacks(next(missing, ""))


def _read(name: str, value: Any, annotation: str, known: Mapping[str, Any]) -> Any:
    options = _options(annotation)
    value = scalar(value)
    for option in options:
        if _fits(value, option, known):
            return _converted(name, value, option, known)
    refused = getattr(type(value), "refused_as", {})
    if reason := next((refused[option] for option in options if option in refused), None):
        raise InputError(f"{name}: {shown(value)} {reason}")
    if reason := objection(value):
        raise InputError(f"{name}: {shown(value)} {reason}")
    asked = dict.fromkeys(_wording(option) for option in options if option not in SILENT)
    raise InputError(f"{name}: {shown(value)} must be {', or '.join(asked)}")


@cache
def _options(annotation: str) -> tuple[str, ...]:
    """The parts of a union; a bar within brackets separates no parts."""
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
    """Element type of a list."""
    head, bracket, inner = option.partition("[")
    return inner.removesuffix("]") if bracket and head in ("Sequence", "Iterable", "list", "tuple") else None


def _fits(value: Any, option: str, known: Mapping[str, Any]) -> bool:
    if _several(option) is not None:
        return is_several(value) and not isinstance(value, Mapping) and not _fits(value, "xarray.Dataset", known)
    if _unit(option) is not None or option == "float":
        return is_number(value) or isinstance(value, str)
    match option.partition("[")[0]:
        case "None":
            return value is None
        case "Count":
            return isinstance(value, Integral) and is_number(value) and 0 < int(value) < 2**31
        case "int":
            return isinstance(value, Integral) and is_number(value)
        case "str" | "SolverName" | "OutputName" | "RecordName" | "ScenarioName":
            return isinstance(value, str)
        case "bool":
            return isinstance(value, bool)
        case "Callable":
            return callable(value)
        case "Executor":
            return callable(getattr(value, "submit", None))
        case "Mapping":
            return isinstance(value, Mapping) and all(isinstance(key, str) for key in value)
        case kind if "." in kind:
            library, _, name = kind.partition(".")  # who has one of its objects has imported it
            loaded = sys.modules.get(library)
            return loaded is not None and isinstance(value, getattr(loaded, name))
        case kind:
            return isinstance(value, known[kind])


def _converted(name: str, value: Any, option: str, known: Mapping[str, Any]) -> Any:
    if (entry := _several(option)) is not None:
        return value if entry == "Any" else [_read(name, x, entry, known) for x in value]
    if option == "float" and not isinstance(value, str):
        return argument(name, value, "")
    unit = _unit(option)
    return value if unit is None else argument(name, value, unit)


def _wording(option: str) -> str:
    if (entry := _several(option)) is not None:
        return f"a list, each entry of which is {_wording(entry)}"
    if unit := _unit(option):
        return f"a number in {unit}, or text with its unit"
    kind = option.partition("[")[0]
    return "a number" if unit == "" else WANTED.get(kind, f"a {kind}")
