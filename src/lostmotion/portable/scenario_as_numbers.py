"""A scenario as numbers that the C interface reads, with its parameters by their keys in scenario files."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..control.axis import OPEN_LOOP
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..simulation.runs.core_runs import core_case
from ..simulation.scenario.requirements import need_ideal_current
from ..simulation.scenario.scenario import Scenario
from .derivation import Derivation, derivation_of


def kernel_of(scenario: Scenario) -> str:
    """The kernel of the core that a scenario takes: ``"drive"``, or the smallest that holds its train."""
    return scenario.core().kernel()


@checked
def description(scenario: Scenario, *, parameters: bool = True) -> np.ndarray:
    """Return a scenario as the numbers that `lm_scenario_read` of the C interface takes.

    Parameters
    ----------
    scenario : Scenario
        The scenario with its signals, controllers and references, its state at t = 0, duration and sample interval.
    parameters : bool
        Whether the numbers also state how they follow from the values of the scenario, so that these can be changed without
        Python.

    Returns
    -------
    numpy.ndarray
        Float64 numbers, shape (n,).

    Raises
    ------
    InputError
        A controller has your own law, which only Python can call.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.portable.description(lm.load("paper-1dof-l-small"), parameters=False).dtype
    dtype('float64')
    """
    return described(scenario)[0] if parameters else written(scenario, Derivation())


def described(scenario: Scenario) -> tuple[np.ndarray, list[tuple[str, float]]]:
    """The description with its parameters, and their keys and values."""
    found = derivation_of(scenario, numbers_of)
    return written(scenario, found), [(p.key, p.value) for p in found.parameters]


def written(scenario: Scenario, derivation: Derivation, case: _core.Case | None = None) -> np.ndarray:
    """The description with these parameters, or the description of another case with the controllers of the scenario."""
    return np.array(
        _core.write_description(
            numbers_of(scenario, case).tolist(), [p.core() for p in derivation.parameters], derivation.core()
        )
    )


def numbers_of(scenario: Scenario, case: _core.Case | None = None) -> np.ndarray:
    """The numbers of a scenario alone."""
    if own := [name for name, controller in scenario.axes().items() if controller.law]:
        raise InputError(
            f"controller of {own[0]}: has a law of your own, which only Python can call; describe the scenario without it, and turn "
            "the motor by its command"
        )
    need_ideal_current(scenario, "description")
    table = scenario.tables.simulation
    times = {"duration": table.duration, "sample_interval": table.sample_interval}
    control = scenario.control() if scenario.axes() else OPEN_LOOP
    return np.array(_core.describe(case or core_case(scenario), title=scenario.tables.title, **times, control=control))
