"""Estimate of the time of a run, by runs of its first parts."""

from __future__ import annotations

import math
import time
from typing import Any, NamedTuple

from .core_runs import core_result
from .run import MAX_SWITCHINGS
from .scenario import Scenario
from .train_scenario import TrainScenario
from .windings import oriented

SHARES = tuple(math.ldexp(1.0, -3 * k) for k in range(6, 1, -1))  # of the duration, that are tried one after the other
ENOUGH = 0.1  # [s] after which no longer part is tried


class Forecast(NamedTuple):
    """Estimated time of a run if it continues as it begins."""

    seconds: float
    """[s] of processor time"""
    part: float
    """[s] of motion, by which it was estimated"""
    switchings: int
    """in that part"""


def forecast(scenario: Scenario | TrainScenario, tolerance: float = 0.0) -> Forecast:
    """Estimate the length of a run. That takes a fiftieth of its time, or a tenth of a second.

    Parameters
    ----------
    tolerance
        Relative one of the adaptive solver; 0: the exact solver.

    Raises
    ------
    SolverError
        The motion has no continuation.
    """
    duration, control = scenario.simulation.duration, scenario.control({})
    taken: list[float] = []
    for share in SHARES:
        begin = time.process_time()
        part = share * duration
        options: tuple[Any, ...] = (part, part, 2, tolerance == 0.0, tolerance, MAX_SWITCHINGS)
        switchings = core_result(scenario, options, control)[1]["switching_count"]
        taken.append(time.process_time() - begin)
        if len(taken) > 1 and taken[-1] > ENOUGH:
            break
    last = len(taken) - 1
    rate = (taken[last] - taken[last - 1]) / (SHARES[last] - SHARES[last - 1])  # without what every run begins with
    if rate <= 0.0:  # too short to tell the two apart
        rate = taken[last] / SHARES[last]
    runs = 2.0 if any(oriented(scenario)) else 1.0  # with coarser exchanges, for the error bound
    return Forecast(runs * rate, part, switchings)
