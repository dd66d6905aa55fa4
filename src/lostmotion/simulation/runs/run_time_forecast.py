"""Estimate of the time of a run, by runs of its first part and of the parts after a change of its inputs."""

import itertools
import math
import time
from typing import NamedTuple

from ..scenario.field_oriented_motors import oriented
from ..scenario.requirements import wound
from ..scenario.scenario import Scenario
from .core_runs import core_result
from .run import MAX_SWITCHINGS, TOLERANCE_OF_WINDINGS

SHARES = tuple(math.ldexp(1.0, -3 * k) for k in range(6, 1, -1))  # of a stretch, that are tried one after the other
ENOUGH = 0.1  # [s] after which no longer part is tried
LONG = 0.2  # of the duration: stretches without a change of the inputs that are tried by themselves


class Forecast(NamedTuple):
    """Estimated time of a run if it continues as it begins."""

    seconds: float  # [s] of processor time
    part: float  # [s] of motion up to the last part that was tried
    switchings: int  # in that time


def forecast(scenario: Scenario, tolerance: float = 0.0) -> Forecast:
    """Estimate the length of a run. That takes a fiftieth of its time, or some tenths of a second.

    tolerance: relative tolerance of the adaptive solver; 0: the default tolerance of the run.

    Raises SolverError: the motion has no continuation.
    """
    control = scenario.control({})
    tolerance = tolerance or (TOLERANCE_OF_WINDINGS if any(wound(scenario)) else 0.0)

    def taken(end: float) -> tuple[float, int]:
        """Processor time of the run up to a time [s], and its switchings."""
        begin = time.process_time()
        times = {"duration": end, "sample_interval": end, "samples": 2}
        how = {"energy": tolerance == 0.0, "tolerance": tolerance, "max_switchings": MAX_SWITCHINGS}
        switchings = int(core_result(scenario, control, times | how)["switching_count"])
        return time.process_time() - begin, switchings

    seconds, part, switchings, rate = 0.0, 0.0, 0, 0.0
    for begin, end in itertools.pairwise(_changes(scenario)):
        # A run that is at rest up to a change of its inputs takes little time, and may move from there on.
        if seconds <= ENOUGH:
            before = taken(begin)[0] if begin > 0.0 else 0.0
            found: list[tuple[float, float]] = []
            for share in SHARES if begin == 0.0 else SHARES[-2:]:
                part = begin + share * (end - begin)
                spent, switchings = taken(part)
                found.append((share, spent))
                if len(found) > 1 and spent - before > ENOUGH:
                    break
            (low, less), (high, more) = found[-2:]
            rate = (more - less) / ((high - low) * (end - begin))  # without what every run begins with
            if rate <= 0.0:  # too short to tell the two apart
                rate = more / (high * (end - begin)) if begin == 0.0 else 0.0
        seconds += rate * (end - begin)
    runs = 2.0 if any(oriented(scenario)) else 1.0  # with coarser exchanges, for the error bound
    return Forecast(runs * seconds, part, switchings)


def _changes(scenario: Scenario) -> list[float]:
    """Begin and end of a run, and between them the instants that begin long stretches without a change of inputs."""
    end = scenario.simulation.duration
    found = {point[0] for signal in scenario.signals().values() for point in signal.breakpoint_list()}
    found |= {piece[0] for axis in scenario.axes().values() for piece in axis.reference.pieces()}
    instants = [*sorted(t for t in found if 0.0 < t < end), end]
    return [0.0, *(a for a, b in itertools.pairwise(instants) if b - a > LONG * end), end]
