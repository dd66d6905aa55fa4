"""Candidate models: each is fitted from the values of the one before, and the one with the least held-out error is chosen.

A rung is the index of a candidate model in the `ladder` of the file. Each has the free parameters of those before and more.
"""

import itertools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from .fit.intervals import CHI_SQUARE
from .fit.least_squares import NORMAL, Fit, FitProblem, problem_of, search
from .fit.log_errors import LogError, log_errors
from .fit.saved_progress import Models
from .prepared_log import Prepared
from .rig.measured_motion import windows
from .rig.residuals import Engine, ParameterPoint
from .rig.rig_scenario import Rig
from .task.identification_file import Identification, free_on
from .verdicts.identifiability import Undetermined, undetermined
from .verdicts.residual_tests import explained

ROUGH = re.compile(
    r"(^|\.)(backlash|breaks|breakaway_(torque|force)|stribeck_speed|friction_curve)(\.|$)"
)  # keys on which a motion does not depend smoothly
SCAN = 9  # values of such a parameter at which the cost is computed
SPAN = 8.0  # from an eighth of the value found to eight times it
PARTS = (1 / 16, 1 / 8, 1 / 4, 1 / 2)  # of the logs, to which a fit is made before that to the whole
LEAST = 50  # samples of the first
LOWER = 0.02  # of the cost, by which another minimum must be lower: less is where a search happens to end
TRIED = 2  # of the minima of the scan, from which a fit begins
GAIN = 0.01  # of the held-out error, by which a later model must be better to be chosen
GAIN_UNDETERMINED = 0.05  # the same, where its parameters leave more directions undetermined
Notify = Callable[[str, int, float], None]


@dataclass
class RungResult:
    """One candidate model with its fit and its errors."""

    name: str
    fit: Fit
    errors: list[LogError]
    train: float  #: mean absolute error in units of the deviations, or SI of the only channel
    held_out: float  #: the same of the logs held out that have a run; NaN without such
    failed: dict[str, str]  #: reason by log held out, where it has no run with the values of this model
    undetermined: list[Undetermined]  #: unidentifiable parameters of this model
    minima: list[ParameterPoint] = field(default_factory=list)
    """other minima of the cost that these logs do not tell from the one found"""

    @property
    def error(self) -> float:
        """Error by which models are compared: the error of the held-out logs, or else of the fitted ones."""
        return self.train if math.isnan(self.held_out) else self.held_out

    @property
    def loose(self) -> int:
        """Number of directions that the logs do not determine."""
        return sum(u.directions for u in self.undetermined)


def several(logs: Sequence[Prepared], count: int) -> list[Prepared]:
    """Some of the logs, spread evenly over their list as sorted by their conditions."""
    if len(logs) <= count:
        return list(logs)
    ordered = sorted(
        logs,
        key=lambda log: repr(sorted((k, v) for k, v in log.log.header.items() if isinstance(v, int | float | str))),
    )
    return [ordered[round(k * (len(ordered) - 1) / (count - 1))] for k in range(count)] if count > 1 else ordered[:1]


def begun_with(task: Identification, train: Sequence[Prepared]) -> list[Prepared]:
    """The logs with which a search begins."""
    return [log for log in train if log.first] or several(train, task.fit.first_logs)


def climb(
    engine: Engine, logs: Sequence[Prepared], start: ParameterPoint, notify: Notify, models: Models
) -> list[RungResult]:
    """Fit all candidate models, one after the other.

    models: the models that an interrupted identification has fitted: the search goes on from their values.
    """
    task = engine.rig.task
    train = [log for log in logs if not log.held_out]
    if not train:
        raise InputError(
            "holds for every log, so that none is left to fit; make the condition narrower", "logs.held_out"
        )
    found: list[RungResult] = []
    point = start
    for rung, entry in enumerate(task.rungs()):
        problem, kept = problem_of(engine, train, rung), models.fitted(entry.name)
        if kept is not None:
            best, minima = search(problem, kept[0]), kept[1]
        else:
            best, minima = _rung(problem, point, found[-1].fit if found else None, notify)
            models.keep(entry.name, best.point, minima)
        best.point = point = with_own(engine, logs, best.point, rung)
        errors = log_errors(logs, engine.residuals(logs, point, rung))
        means, failed = mean_errors(task, errors, best), engine.failed
        found.append(RungResult(entry.name, best, errors, *means, failed, undetermined(problem, best), minima))
    return found


def _rung(
    problem: FitProblem, point: ParameterPoint, below: Fit | None, notify: Notify
) -> tuple[Fit, list[ParameterPoint]]:
    """(fit of a candidate model, other minima), begun at the values of the model before."""
    engine, rung = problem.engine, problem.rung
    rig, entry = engine.rig, engine.rig.rungs()[rung]
    added = {n: p for n, p in problem.parameters.items() if rung == 0 or n not in free_on(rig.task, rung - 1)}
    if rung > 0:
        point = replace(point, values=point.values | {n: p.start for n, p in added.items()})
    best: Fit | None = None
    for tried in itertools.product(*entry.multi_start.values()):
        values = point.values | dict(zip(entry.multi_start, tried, strict=True))
        fit = _one(problem, replace(point, values=values), notify)
        if best is None or _cost(problem, fit, best) < best.cost:
            best = fit
    assert best is not None
    if below is not None and _cost(problem_of(engine, problem.logs, rung - 1), below, best) < best.cost * (1.0 - 1e-9):
        # The model contains the one before: begin there, with the new parameters switched off.
        off = {n: p.off if p.off is not None else p.start for n, p in added.items()}
        again = _one(problem, replace(below.point, values=below.point.values | off), notify)
        if _cost(problem, again, best) < best.cost:
            best = again
    rough = [name for name in added if name not in entry.multi_start and is_rough(rig, name, rung)]
    return _other_minima(problem, point, best, rough, notify)


def is_rough(rig: Rig, name: str, rung: int) -> bool:
    """Whether the motion does not depend smoothly on a parameter: it enters a gap, a break of a law or sticking."""
    phases = range(-1, len(rig.task.phases))
    return any(ROUGH.search(key) for phase in phases for key in rig.leaves_of(name, rung, phase))


def _other_minima(
    problem: FitProblem, first: ParameterPoint, best: Fit, names: Sequence[str], notify: Notify
) -> tuple[Fit, list[ParameterPoint]]:
    """(best fit, points of other minima that are as good) from several values of parameters on which the motion does not depend smoothly.

    Nothing is tried where the residuals of the fit are the noise that the task states.
    """

    def is_explained() -> bool:
        return explained(problem, problem.engine.residuals(problem.logs, best.point, problem.rung))

    if not names or is_explained():
        return best, []
    others: list[Fit] = []

    def starts() -> Iterator[ParameterPoint]:
        yield grown(problem, first)
        for name in names:
            for value in _promising(problem, best, name):
                yield grown(problem, replace(best.point, values=best.point.values | {name: value}))

    for start in starts():
        others.append(_one(problem, start, notify))
        if _cost(problem, others[-1], best) < best.cost * (1.0 - LOWER):
            others[-1], best = best, others[-1]
        if is_explained():
            break
    scale = 1.0 if problem.given is None else max(1.0, (NORMAL * best.mae) ** 2)  # errors above those stated
    return best, [fit.point for fit in others if _cost(problem, fit, best) - best.cost < CHI_SQUARE * scale]


def grown(problem: FitProblem, start: ParameterPoint) -> ParameterPoint:
    """Results of fits to growing first parts of the logs: there are few impacts in the first."""
    for share in PARTS:
        logs = [log.part(0, max(LEAST, round(share * len(log.time)))) for log in problem.logs]
        if all(log.valid.any(axis=1).all() for log in logs):
            start = search(replace(problem, logs=logs), start).point
    return start


def _promising(problem: FitProblem, fit: Fit, name: str) -> list[float]:
    """Values of a parameter at which a scan, all others as found, has its lowest other minima of the cost."""
    p, value = problem.parameters[name], fit.point.values[name]
    low, high = max(p.min, value / SPAN), min(p.max, SPAN * max(value, p.step))
    grid = np.geomspace(low, high, SCAN) if low > 0.0 else np.linspace(low, high, SCAN)
    grid = np.unique(np.append(grid, value))
    costs = []
    for x in grid.tolist():
        point = replace(fit.point, values=fit.point.values | {name: x})
        residuals = problem.engine.residuals(problem.logs, point, problem.rung)
        costs.append(problem.cost(residuals, fit.deviations, point, fit.correlation))
    c = np.nan_to_num(np.array(costs), nan=np.inf)
    own = int(np.flatnonzero(grid == value)[0])
    walls = np.pad(c, 1, constant_values=np.inf)
    minima = np.flatnonzero((c < walls[:-2]) & (c < walls[2:]))
    minima = minima[minima != own]
    far = minima if len(minima) else np.array([max(0, own // 2), (own + len(grid)) // 2])  # no minimum: both sides
    return [float(x) for x in grid[far[np.argsort(c[far])]][:TRIED] if x != value]


def _cost(problem: FitProblem, fit: Fit, other: Fit) -> float:
    """The cost of a fit in the units of another, so that the two can be compared: each has found deviations of its own."""
    residuals = problem.engine.residuals(problem.logs, fit.point, problem.rung)
    return problem.cost(residuals, other.deviations, fit.point, other.correlation)


def with_own(engine: Engine, logs: Sequence[Prepared], point: ParameterPoint, rung: int) -> ParameterPoint:
    """Fit the nuisances of a held-out log, such as its zero; the parameters stay."""
    held_out = [log for log in logs if log.held_out]
    if not engine.rig.task.nuisance or not held_out:
        return point
    engine.residuals(held_out, point, rung)
    able = [log for log in held_out if log.name not in engine.failed]
    return search(replace(problem_of(engine, able, rung), parameters={}), point, iterations=10).point if able else point


def _one(problem: FitProblem, start: ParameterPoint, notify: Notify) -> Fit:
    """Some logs first, in windows that become longer where the task says so, then all."""
    rig = problem.engine.rig
    name, few = rig.rungs()[problem.rung].name, begun_with(rig.task, problem.logs)

    def tell(iteration: int, cost: float) -> None:
        notify(name, iteration, cost)

    for length in problem.options.horizon:
        cut = windows(rig, few, start, problem.rung, length)
        start = search(replace(problem, logs=cut), start, notify=tell).point
    fit = search(replace(problem, logs=few), start, notify=tell)
    return fit if len(few) == len(problem.logs) else search(problem, fit.point, notify=tell)


def first_fit(engine: Engine, few: Sequence[Prepared], start: ParameterPoint, notify: Notify) -> Fit:
    """Fit of the first candidate model to the logs with which a search begins."""
    return _one(problem_of(engine, few, 0), start, notify)


def mean_errors(task: Identification, errors: list[LogError], fit: Fit) -> tuple[float, float]:
    """Mean absolute errors of the logs fitted and held out, over all channels."""
    units = dict(zip(task.measured, fit.deviations if len(task.measured) > 1 else np.ones(1), strict=True))
    means = []
    for held_out in (False, True):
        own = [e for e in errors if e.held_out == held_out and not math.isnan(e.mae)]
        n = sum(e.samples for e in own)
        means.append(sum(e.mae / units[e.channel] * e.samples for e in own) / n if n else math.nan)
    return means[0], means[1]


def chosen(rungs: Sequence[RungResult]) -> int:
    """Index of the first model that no later one betters by more than `GAIN` of the held-out error, or else of the error.

    One that leaves more directions undetermined has to gain `GAIN_UNDETERMINED`: its error says little of values that the logs do
    not tell. One with which fewer of the logs held out have no run is better, whatever its error.
    """
    taken = 0
    for k, rung in enumerate(rungs):
        best = rungs[taken]
        less = len(rung.failed) - len(best.failed)
        gain = GAIN_UNDETERMINED if rung.loose > best.loose else GAIN
        if less < 0 or (less == 0 and rung.error < best.error * (1.0 - gain)):
            taken = k
    return taken
