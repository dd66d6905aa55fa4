"""Derivatives of runs with respect to values of their scenarios.

The core propagates them exactly. The core needs the derivatives of its own numbers by a parameter. These numbers
follow from the scenario by smooth formulas, whose derivatives are found by differences of fourth order.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...control.axis import BoundController
from ...errors import InputError
from ...inputs.implausible_values import trusted
from ...inputs.refusal_messages import shortened, shown
from ..forms.set_by_dotted_key import list_index
from ..scenario.key_suggestions import near_key
from ..scenario.requirements import need_free_motion
from ..scenario.scenario import Scenario
from ..variables_of_trains import named_signals
from .core_runs import core_case

if TYPE_CHECKING:
    import xarray

STEP = 2.0**-11  # of a value, relative: h^4 and the rounding of a difference over h are about 1e-12 of the value
STEP_AT_ZERO = 2.0**-11  # in SI units
# Multiples of the step, and the weights of f(p + k h) - f(p), over h.
CENTRAL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
ONE_SIDED = ((1, 4.0), (2, -3.0), (3, 4 / 3), (4, -1 / 4))

SUFFIX = "_sensitivity"
ENDS_AT, ENDS_BY = "sensitivities_end_at", "sensitivities_end_by"


@dataclass(frozen=True)
class Neighbour:
    """A scenario at another value of a parameter."""

    offset: float  # offset of the value [SI unit]
    weight: float  # df/dp = sum of weight (f - f at the value itself)
    scenario: Scenario


def value_at(scenario: Scenario, key: str, function: str = "sensitivities") -> float:
    """The number under a dotted key; 0 where a start or a command is left out.

    function: that needs it, for messages.

    Raises InputError: there is not a number.
    """
    value = _entry_at(scenario, key)
    if value is None and key.partition(".")[0] in ("initial", "command"):
        return 0.0
    if not _is_a_number(value):
        near = near_key(scenario, key) if value is None else ""
        has = "nothing of that name" if value is None else f"{shown(value)} there, and a number is needed"
        meant = near if near and _is_a_number(_entry_at(scenario, near)) else ""
        remedy = f"did you mean {meant}?" if meant else "give the key of a number"
        raise InputError(f"{shortened(key)}: the scenario has {has}; {remedy}", where=function)
    return float(value)


def _is_a_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _entry_at(scenario: Scenario, key: str) -> Any:
    """Entry of a scenario under a dotted key, of a signal its mean; None where there is nothing."""
    node: Any = scenario.model_dump()
    for part in scenario.key_of_tables(key).split("."):
        try:
            node = node[list_index(node, part)] if isinstance(node, list | tuple) else node[part]
        except (KeyError, TypeError, ValueError):
            return None
    return node["mean"] if isinstance(node, Mapping) and "mean" in node else node


def neighbours(scenario: Scenario, key: str) -> list[Neighbour]:
    """Scenarios beside a value: on both sides of the value or, at an end of its range, on one side.

    Raises InputError: there are none.
    """
    value = value_at(scenario, key)
    step = STEP * abs(value) or STEP_AT_ZERO
    name = f"{key}.mean" if _is_signal(scenario, key) else key
    problem: InputError | None = None
    for sign, stencil in ((1, CENTRAL), (1, ONE_SIDED), (-1, ONE_SIDED)):
        h = sign * step
        try:
            with trusted():
                return [
                    Neighbour(k * h, weight / h, scenario.replace(**{name: value + k * h})) for k, weight in stencil
                ]
        except InputError as error:
            problem = problem or error
    raise InputError(f"{key}: cannot be varied about its value {value:g}: {problem}", where="sensitivities")


def _is_signal(scenario: Scenario, key: str) -> bool:
    node: Any = scenario.model_dump()
    for part in scenario.key_of_tables(key).split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    return isinstance(node, Mapping) and "mean" in node


_INPUT = re.compile(r"(command|(load|shafts\.[^.]+)\.torque)(\..*)?")


def core_variation(scenario: Scenario, key: str, beside: Sequence[Neighbour]) -> tuple[str, list[Any]]:
    """A parameter as the core takes it: of its neighbours what may differ from the scenario itself."""
    own = scenario.key_of_tables(key)
    of_start, of_inputs = own.startswith("initial."), _INPUT.fullmatch(own) is not None
    out = []
    for n in beside:
        other = n.scenario
        differs: dict[str, Any] = {"start": (other.start(), other.capacities())}
        if not of_start:
            differs["inputs"] = core_case(other).inputs
        if not (of_start or of_inputs):
            differs |= {"train": other.core(), "control": other.control() if scenario.axes() else None}
        out.append({"offset": n.offset, "weight": n.weight, **differs})
    return key, out


def sensitive_case(scenario: Scenario, variations: Sequence[Any], control: BoundController) -> _core.SensitiveRun:
    """A run as the core takes it."""
    grid = scenario.simulation.grid()
    return _core.SensitiveRun(core_case(scenario), variations=variations, control=control, **grid)


def channels_of(core: _core.Train) -> list[str]:
    """Names of the channels that have a derivative: all but the modes of the contacts and the loss coefficient."""
    without = {*core.shown_contacts(), "loss_coefficient"}
    return [name for name, *_ in core.channels() if name not in without]


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of the result variables of a run."""

    parameters: tuple[str, ...]
    values: dict[str, np.ndarray]  # by result variable: parameters x instants
    ends_at: float  # from when on they do not exist [s]; infinite if they do throughout
    ends_by: str

    def add_to(self, result: xarray.Dataset) -> xarray.Dataset:
        """The dataset with a variable NAME_sensitivity over parameter and time for each of its variables."""
        new = {
            f"{name}{SUFFIX}": (
                ("parameter", "time"),
                rows,
                {
                    "units": f"{result[name].attrs.get('units', '1')} per SI unit of the parameter",
                    "long_name": f"derivative of {name} with respect to each parameter",
                },
            )
            for name, rows in self.values.items()
        }
        out = result.assign(new).assign_coords(parameter=("parameter", list(self.parameters)))
        if self.ends_by:
            out.attrs |= {ENDS_AT: self.ends_at, ENDS_BY: self.ends_by}
        return out


@dataclass(frozen=True)
class CoreDerivatives:
    """Derivatives of one run from the core."""

    error: str  # why the motion has no continuation; then there are no values
    values: np.ndarray  # channels x instants
    derivatives: np.ndarray  # parameters x channels x instants
    signals: np.ndarray  # axes x signals x instants, of the controllers
    signal_derivatives: np.ndarray  # parameters x axes x signals x instants
    end_state: dict[str, float]  # by name
    ends_at: float  # [s] from when on there are no derivatives; infinite if there are throughout
    ends_by: str


def run_cases(
    cases: Sequence[_core.SensitiveRun], channels: Sequence[str], threads: int = 1, *, signals: bool = True
) -> list[CoreDerivatives]:
    """Runs with their derivatives, each as `sensitive_case` gives it, on several threads.

    signals: also of what the controllers show; then the instants are the multiples of an interval.

    Raises InputError: what one of them asks for has no derivative.
    """
    out = []
    for row in _core.run_sensitive_trains(cases, channels, signals=signals, threads=threads):
        parameter, reason = row.pop("problem")
        if reason:
            raise InputError(reason, *((parameter,) if parameter else ()), where="sensitivities")
        out.append(CoreDerivatives(**row))
    return out


def run_sensitivities(scenario: Scenario, keys: Sequence[str]) -> Sensitivities:
    """The derivatives of all result variables of a run with respect to values of its scenario.

    Raises InputError: a key names no number that can be varied, or the scenario has what has no derivative.
    Raises SolverError: the motion has no continuation.
    """
    need_free_motion(scenario, "sensitivities")
    keys = list(keys)
    if not keys or len(set(keys)) < len(keys):
        raise InputError(
            f"{shown(keys)}; give keys of the scenario, such as load.inertia, each once", where="sensitivities"
        )
    beside = {key: neighbours(scenario, key) for key in keys}
    variations = [core_variation(scenario, key, beside[key]) for key in keys]
    channels = channels_of(scenario.core())
    (found,) = run_cases([sensitive_case(scenario, variations, scenario.control())], channels)
    if found.error:
        raise _core.SolverError(found.error)
    data = dict(zip(channels, found.values, strict=True))
    derivatives = {name: found.derivatives[:, k, :] for k, name in enumerate(channels)}
    data |= named_signals(scenario.by_prefix(), found.signals)
    derivatives |= _of_signals(scenario, found.signal_derivatives)
    _add_derived(scenario, data, derivatives, [beside[key] for key in keys])
    return Sensitivities(tuple(keys), derivatives, found.ends_at, found.ends_by)


def _of_signals(scenario: Scenario, signals: np.ndarray) -> dict[str, np.ndarray]:
    rows = [named_signals(scenario.by_prefix(), of_parameter) for of_parameter in signals]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _add_derived(
    scenario: Scenario,
    data: dict[str, np.ndarray],
    derivatives: dict[str, np.ndarray],
    beside: Sequence[Sequence[Neighbour]],
) -> None:
    """Adds the variables that follow from the solver's variables, by differences along their derivatives."""
    read = dict(derivatives)
    here = _derived(scenario, data)
    for name, values in here.items():
        derivatives[name] = np.zeros((len(beside), len(values)))
    for p, all_beside in enumerate(beside):
        for n in all_beside:
            there = _derived(n.scenario, {name: v + n.offset * read[name][p] for name, v in data.items()})
            for name, values in here.items():
                derivatives[name][p] += n.weight * (there[name] - values)


def _derived(scenario: Scenario, data: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Derived variables alone."""
    out = dict(data)
    scenario.derive(out, next(iter(data.values())))
    return {name: v for name, v in out.items() if name not in data}
