"""Mean and variance of a motor's torque over intervals of the exact run, whatever the samples of a result are.

Between switchings, input breakpoints and sample instants of controllers the torque is analytic. There its square is integrated by the
Gauss-Kronrod pair of 3 and 7 points, at instants that a run of their own records. Where both rules differ, the piece is halved.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..control.axis import BoundController
from ..simulation.runs.core_runs import core_case
from ..simulation.runs.run import MAX_SWITCHINGS, check_memory
from ..simulation.runs.separate_trains import control_of_part, parts_of
from ..simulation.scenario.scenario import Scenario

# Kronrod, Nodes and weights of quadrature formulas (1965); every second node is one of Gauss.
INNER, MIDDLE, OUTER = 0.4342437493468025580, math.sqrt(0.6), 0.9604912687080202834
NODES = np.array([-OUTER, -MIDDLE, -INNER, 0.0, INNER, MIDDLE, OUTER])
KRONROD = np.array([0.1046562260264672652, 0.2684880898683334407, 0.4013974147759622229, 0.4509165386584741423])
KRONROD = 0.5 * np.concatenate([KRONROD, KRONROD[2::-1]])
GAUSS = np.array([5.0, 8.0, 5.0]) / 18.0
AGREEMENT = 1e-7  # of both rules, relative to the mean of the square; the finer one is six degrees better
HALVINGS = 40
PERIODS = 0.25  # of the fastest sine, the longest piece


@dataclass(frozen=True)
class Squares:
    """A torque over intervals."""

    duration: np.ndarray  # [s]
    mean: np.ndarray  # [N·m]
    variance: np.ndarray  # mean of the square of the deviation from the mean [(N·m)²]
    error: float  # bound on the error of the integral of the square, of all intervals together [(N·m)² s]

    @property
    def square(self) -> np.ndarray:
        """Mean of the square [(N·m)²]."""
        return np.asarray(self.mean**2 + self.variance)

    @property
    def rms(self) -> float:
        """Root mean square over all intervals [N·m]."""
        return math.sqrt(float(self.square @ self.duration) / float(self.duration.sum()))

    @property
    def lead(self) -> float:
        """Bound on the integral from the start of an interval of the square less its mean [(N·m)² s], and of the error.

        With M = m + d, the mean of d is 0 and the mean of d² is v. Cauchy and Schwarz bound the integral of d over a part of the
        interval h by h sqrt(v)/2. So the integral of M² - m² - v = 2 m d + d² - v is at most h (|m| sqrt(v) + v).
        """
        within = self.duration * (np.abs(self.mean) * np.sqrt(self.variance) + self.variance)
        return float(within.max(initial=0.0)) + self.error


def squares_of(scenario: Scenario, motor: str, time: np.ndarray) -> Squares:
    """The torque of a motor of a scenario between instants [s]. Raises SolverError: as `simulate`."""
    parts = parts_of(scenario)
    part = next(p for p in parts if motor in p.train().motors)
    control = scenario.control() if len(parts) == 1 else control_of_part(scenario.control(), scenario.long(), part)
    signals = part.signals().values()
    breaks = [t for signal in signals for t, *_ in signal.breakpoint_list()]
    fastest = max((f for signal in signals for _, f, _ in signal.sine_list()), default=0.0)
    channel = part.train().variable(motor, "torque")
    return squares(core_case(part), channel, time, control=control, breaks=breaks, fastest=fastest)


def squares(
    case: _core.Case,
    channel: str,
    time: np.ndarray,
    *,
    control: BoundController = (1.0, []),
    breaks: Iterable[float] = (),
    fastest: float = 0.0,
) -> Squares:
    """A channel of a run of the core between instants [s].

    breaks: instants at which inputs jump or bend [s].
    fastest: frequency of their fastest sine [Hz].
    """
    end = float(time[-1])
    grid: dict[str, Any] = {"duration": end, "sample_interval": end}
    switched = _core.run(case, **grid, samples=2, control=control, max_switchings=MAX_SWITCHINGS)["switchings"]
    found = [np.asarray(time), np.asarray(switched)[:, 0], np.array(list(breaks))]
    tick, axes = control
    if axes:
        found.append(np.arange(0.0, end, tick))
    if fastest > 0.0:
        found.append(np.linspace(0.0, end, math.ceil(end * fastest / PERIODS) + 1))
    edges = np.unique(np.concatenate(found))

    def at(instants: np.ndarray) -> np.ndarray:
        one = _core.SensitiveRun(case, variations=[], control=control, **grid, instants=instants.tolist())
        (run,) = _core.run_sensitive_trains([one], [channel], signals=False, threads=1)
        if run["error"]:
            raise _core.SolverError(run["error"])
        return np.asarray(run["values"][0])

    return over_pieces(at, np.asarray(time), edges[(edges >= time[0]) & (edges <= end)])


def over_pieces(at: Callable[[np.ndarray], np.ndarray], time: np.ndarray, edges: np.ndarray) -> Squares:
    """A function of time [s] over the intervals between instants, which are among the edges of pieces.

    Raises InputError: the pieces do not fit into the memory.
    """
    pieces = np.column_stack([edges[:-1], edges[1:]])
    done: list[tuple[np.ndarray, ...]] = []
    error, size = 0.0, 0.0
    for halving in itertools.count():
        check_memory(pieces.size * len(NODES), 16.0)
        begin, length = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
        value = at((begin[:, None] + 0.5 * length[:, None] * (1.0 + NODES)).ravel()).reshape(-1, len(NODES))
        mean = value @ KRONROD
        apart = np.abs(value**2 @ KRONROD - value[:, 1::2] ** 2 @ GAUSS)
        size = max(size, float((value**2 @ KRONROD) @ length / (time[-1] - time[0])))
        good = (apart <= AGREEMENT * size) | (halving == HALVINGS)
        variance = (value - mean[:, None]) ** 2 @ KRONROD
        done.append((begin[good], length[good], mean[good], variance[good]))
        error += float(apart[good] @ length[good])
        if good.all():
            break
        middle = begin + 0.5 * length
        pieces = np.stack([begin, middle, middle, begin + length], axis=1)[~good].reshape(-1, 2)
    begin, length, mean, variance = (np.concatenate(columns) for columns in zip(*done, strict=True))
    step_of_piece = np.clip(np.searchsorted(time, begin, side="right") - 1, 0, len(time) - 2)
    steps = np.diff(time)

    def averaged(values: np.ndarray) -> np.ndarray:
        return np.bincount(step_of_piece, values * length, len(steps)) / steps

    whole = averaged(mean)
    return Squares(steps, whole, averaged(variance + (mean - whole[step_of_piece]) ** 2), error)
