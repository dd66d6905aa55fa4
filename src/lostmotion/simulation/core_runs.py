"""Runs of the core: what they take of a scenario, and what they give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .. import _core
from ..control.axis import OPEN_LOOP, Bound
from ..inputs.kept import kept
from ..worker_threads import thread_pool
from .scenario import Scenario
from .train_parts import SIDE_BY_SIDE, control_of_part, joined_results, parts_of

Case = tuple[_core.Train, Sequence[_core.Signal], Mapping[str, float], Mapping[str, float]]
"""train, inputs, state and hysteresis capacities by name"""


def core_case(scenario: Scenario) -> Case:
    """Initial part of every run of the core."""
    return scenario.core(), *_around(scenario)


@kept
def _around(scenario: Scenario) -> tuple[list[_core.Signal], dict[str, float], dict[str, float]]:
    signals = scenario.signals()
    inputs = [signals[name].core() for name in scenario.core().input_names()]
    return inputs, scenario.start(), scenario.capacities()


def core_run(case: Case, options: tuple[Any, ...], control: Bound = OPEN_LOOP) -> dict[str, Any]:
    """One run of the core, with options as of `core_result`."""
    core, inputs, start, capacities = case
    return _core.run(core, inputs, start, capacities, *(*options, control))


def core_result(scenario: Scenario, options: tuple[Any, ...], control: Bound) -> tuple[_core.Train, dict[str, Any]]:
    """The solver's train, and what the solver gave for it. Parts that nothing joins are solved apart; under controllers side by
    side, unless one of these is a function in Python.

    Parameters
    ----------
    options
        Duration [s], sample interval [s], samples, whether to keep the energy ledger, relative tolerance (0: exact), and how
        many switchings are kept.
    """
    parts = parts_of(scenario)
    if len(parts) == 1:
        case = core_case(scenario)
        return case[0], core_run(case, options, control)
    whole = scenario.long()

    def solved(part: Scenario) -> dict[str, Any]:
        core, result = core_result(part, options, control_of_part(control, whole, part))
        names = {"channels": [name for name, *_ in core.channels()], "contacts": core.contact_names()}
        return result | names

    if not control[1] or any(c.law for c in scenario.axes().values()) or options[0] > SIDE_BY_SIDE * control[0]:
        results = list(map(solved, parts))
    else:
        with thread_pool(len(parts) - 1) as beside:
            others = [beside.submit(solved, part) for part in parts[1:]]
            results = [solved(parts[0]), *(other.result() for other in others)]
    return scenario.core(), joined_results(whole, parts, results, options[-1])
