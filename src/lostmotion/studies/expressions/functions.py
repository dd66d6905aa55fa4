"""The functions and methods that a study's expressions may use, each with its parameters, its values and its measure.

Nothing else can be called: an expression is read into entries of these tables, never run as Python.
"""

import warnings
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from ... import _core
from ...simulation.runs.sample_means import last_share, weights
from .measures import Measure, measure, one_of, plain, power, product, reduced

REDUCTIONS = tuple(_core.reductions())  # of a variable over time, as the core knows them

Kind = Literal["series", "value", "of a run", "condition", "share", "index", "instant", "time", "nearest"]
"""what a parameter takes: a variable over time; that or one value; one value for each run; a comparison; a written number
from 0 to 1; a written whole number; a written instant; the text 'time'; the text 'nearest'"""


class FunctionParameter(NamedTuple):
    """Parameter of a function or method."""

    name: str
    kind: Kind = "series"
    needed: bool = True


class Function(NamedTuple):
    """Function of values (arrays of xarray over run and time) and of measures, both in the order of its parameters."""

    parameters: tuple[FunctionParameter, ...]
    of_values: Callable[..., Any]
    of_measures: Callable[..., Measure]


# --- reductions ---


def _reduced(name: str, careful: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A reduction by the core, so that a chunk that the core has reduced has the same bits.

    careful
        Of an array of xarray, without NaN. Most variables have none, and it is the search for them that takes long.
    """
    how = REDUCTIONS.index(name)

    def by_core(values: np.ndarray, axis: int, last: float) -> np.ndarray:
        along = np.moveaxis(values, axis, -1)
        rows = np.ascontiguousarray(along, dtype=float).reshape(-1, along.shape[-1])
        return _core.reduce_rows(how, rows, last).reshape(along.shape[:-1])

    def reduce(x: Any) -> Any:
        found = x.reduce(by_core, "time", last=last_share(x["time"].values))
        return found if np.isfinite(found.values).all() else careful(x)

    return reduce


def _weighted(x: Any) -> Any:
    """The same with the weight that its last sample has in a mean."""
    weight = weights(x["time"].values)
    return x if weight is None else x.weighted(x["time"].copy(data=weight))


_rms = _reduced("rms", lambda x: _weighted(x**2).mean("time") ** 0.5)


def _dead_time(x: Any, share: float = 0.01) -> Any:
    """First instant [s] at which the variable is more than `share` of its peak away from its start; NaN if never."""
    return x["time"].where(abs(x - x.isel(time=0)) > share * abs(x).max("time")).min("time")


def _quantile(x: Any, q: float) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a run without any value has none
        return x.quantile(q, "time").drop_vars("quantile")


# --- what of_measures says ---


def _same(x: Measure) -> Measure:
    return reduced(x)


def _seconds(*_: Measure) -> Measure:
    return measure("s")


X, VALUE, TIME = FunctionParameter("x"), FunctionParameter("x", "value"), FunctionParameter("dim", "time", needed=False)


def _reduction(of_values: Callable[..., Any], of_measures: Callable[..., Measure] = _same) -> Function:
    return Function((X, TIME), of_values, of_measures)


FUNCTIONS = {
    "peak": Function((X,), _reduced("peak", lambda x: abs(x).max("time")), _same),
    "rms": Function((X,), _rms, _same),
    "mean": Function((X,), _reduced("mean", lambda x: _weighted(x).mean("time")), _same),
    "final": Function((X,), lambda x: x.isel(time=-1), _same),
    "least": Function((X,), _reduced("least", lambda x: x.min("time")), _same),
    "largest": Function((X,), _reduced("largest", lambda x: x.max("time")), _same),
    "dead_time": Function((X, FunctionParameter("share", "share", needed=False)), _dead_time, _seconds),
    "tracking_error": Function(  # root mean square of the distance from a reference
        (X, FunctionParameter("reference", "value")),
        lambda x, reference: _rms(x - reference),
        lambda x, reference: reduced(one_of(x, reference)),
    ),
    "abs": Function((VALUE,), abs, lambda x: x),
    "sqrt": Function((VALUE,), np.sqrt, lambda x: power(x, 0.5)),
    "exp": Function((VALUE,), np.exp, plain),
    "log": Function((VALUE,), np.log, plain),
    "sign": Function((VALUE,), np.sign, plain),
}
"""functions, of variables and of what is made of them"""

METHODS = {
    "mean": _reduction(lambda x: _weighted(x).mean("time")),
    "max": _reduction(lambda x: x.max("time")),
    "min": _reduction(lambda x: x.min("time")),
    "sum": _reduction(lambda x: x.sum("time")),
    "median": _reduction(lambda x: x.median("time")),
    "std": _reduction(lambda x: _weighted(x).std("time")),
    "var": _reduction(lambda x: _weighted(x).var("time"), lambda x: reduced(x, 2)),
    "quantile": Function((X, FunctionParameter("q", "share"), TIME), _quantile, lambda x, q: reduced(x)),  # noqa: ARG005
    "integrate": Function(
        (X, FunctionParameter("coord", "time", needed=False)),
        lambda x: x.integrate("time"),
        lambda x: product(reduced(x), measure("s")),
    ),
    "differentiate": Function(
        (X, FunctionParameter("coord", "time", needed=False)),
        lambda x: x.differentiate("time"),
        lambda x: product(x, measure("s"), -1),
    ),
    "idxmax": _reduction(lambda x: x.idxmax("time"), _seconds),
    "idxmin": _reduction(lambda x: x.idxmin("time"), _seconds),
    "count": _reduction(lambda x: x.count("time"), lambda x: plain(reduced(x))),
    "any": Function((FunctionParameter("x", "condition"), TIME), lambda x: x.any("time"), lambda x: plain(reduced(x))),
    "all": Function((FunctionParameter("x", "condition"), TIME), lambda x: x.all("time"), lambda x: plain(reduced(x))),
    "where": Function(
        (X, FunctionParameter("cond", "condition"), FunctionParameter("other", "value", needed=False)),
        lambda x, cond, *other: x.where(cond, *other),
        lambda x, cond, *other: one_of(x, *other),  # noqa: ARG005
    ),
    "fillna": Function((X, FunctionParameter("value", "value")), lambda x, value: x.fillna(value), one_of),
    "clip": Function(
        (X, FunctionParameter("min", "value", needed=False), FunctionParameter("max", "value", needed=False)),
        lambda x, *bounds: x.clip(*bounds),
        one_of,
    ),
    "isnull": Function((X,), lambda x: x.isnull(), lambda x: plain(x, boolean=True)),
    "notnull": Function((X,), lambda x: x.notnull(), lambda x: plain(x, boolean=True)),
    "isel": Function(
        (X, FunctionParameter("time", "index")),
        lambda x, time: x.isel(time=time),
        lambda x, time: reduced(x),  # noqa: ARG005
    ),
    "sel": Function(
        (X, FunctionParameter("time", "instant"), FunctionParameter("method", "nearest", needed=False)),
        lambda x, time: x.sel(time=time, method="nearest"),
        lambda x, time: reduced(x),  # noqa: ARG005
    ),
}
"""methods of a variable over time, under the names that xarray gives them"""

BANDWIDTH = (FunctionParameter("amplitude", "of a run", needed=False),)
"""parameters of `bandwidth`, whose values come from the runs"""
