"""Runs of the core: what they take of a scenario, and what they give."""

from typing import Any

from ... import _core
from ...control.axis import BoundController
from ...inputs.cached_values import kept
from ...interruptible_threads import thread_pool
from ..scenario.scenario import Scenario
from .separate_trains import SIDE_BY_SIDE, control_of_part, joined_results, parts_of

Options = dict[str, Any]
"""duration and sample_interval [s], samples; energy: keep the ledger; tolerance: relative, 0: exact; max_switchings that are kept"""


@kept
def core_case(scenario: Scenario) -> _core.Case:
    """Train, inputs and start of every run of the core."""
    core, signals = scenario.core(), scenario.signals()
    inputs = [signals[name].core() for name in core.input_names()]
    return _core.Case(core, inputs=inputs, start=scenario.start(), hysteresis_capacities=scenario.capacities())


def core_result(scenario: Scenario, control: BoundController, options: Options) -> dict[str, Any]:
    """One run of the core. Parts of a train that nothing joins are solved apart; under controllers side by side, unless one of
    these is a function in Python.
    """
    parts = parts_of(scenario)
    if len(parts) == 1:
        return _core.run(core_case(scenario), control=control, **options)
    whole = scenario.long()

    def solved(part: Scenario) -> dict[str, Any]:
        result, core = core_result(part, control_of_part(control, whole, part), options), part.core()
        names = {"channels": [name for name, *_ in core.channels()], "contacts": core.contact_names()}
        return result | names

    if (
        not control[1]
        or any(c.law for c in scenario.axes().values())
        or options["duration"] > SIDE_BY_SIDE * control[0]
    ):
        results = list(map(solved, parts))
    else:
        with thread_pool(len(parts) - 1) as beside:
            others = [beside.submit(solved, part) for part in parts[1:]]
            results = [solved(parts[0]), *(other.result() for other in others)]
    return joined_results(whole, parts, results, options["max_switchings"])
