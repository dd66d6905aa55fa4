"""Monitoring of a drive over its life: one estimate for each operation log, and the changes of these estimates.

Each log is estimated alone by the least squares of an identification, with the exact Jacobian. The logs of the
baseline begin from the start values, all others from the medians of the baseline. Parameters that a log says nothing
of are held by a wide prior around these values, and are marked. The scatter of the estimates of the baseline is the
scatter without a change. It includes noise, and the errors of the model as far as these differ from log to log.
`changes` finds what is beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..errors import InputError, prefixed
from ..inputs.arguments import checked
from .changes import Change, find_change
from .engine import Engine, Point
from .fit import Fit, Problem, search
from .formulas import number
from .gather import gathered
from .intervals import Interval, bootstrap
from .ladder import free_on, grown, is_rough, problem_of, start_point
from .misfit import LARGE, explained, hidden, misfits
from .monitor_task import Watch
from .odd_logs import ODD
from .parameters import FreeParameter, in_unit
from .pauses import split_at_pauses
from .prepare import Prepared
from .rig import Rig
from .task import Identification, load_identification

ITERATIONS = 15
TOLD = 0.5  # of the prior's deviation, which is the size of the value: up to here a log tells a value
FEWEST = 5  # logs of the baseline that tell a value
RECENT = 10  # logs at the end, of which the present level is the mean
RESIDUAL = "residual"
Notify = Callable[[str, int, int], None]


@dataclass(frozen=True)
class LogEstimate:
    """Parameter values of one log, with their intervals."""

    log: str
    """name of the log"""
    at: float
    """place in the order: its number, or the value of ``monitor.order``"""
    values: Mapping[str, float]
    """SI, by parameter"""
    deviations: Mapping[str, float]
    """standard deviations of the values by the residuals of this log alone, SI"""
    intervals: Mapping[str, Interval]
    """95 % intervals of the values, widened by what structured residuals may hide"""
    residual: float
    """root mean square of the residuals, in those of the baseline; NaN of a log that cannot be used"""
    conditions: tuple[float, ...] = ()
    """values of ``monitor.conditions``"""
    told: frozenset[str] = frozenset()
    """parameters of which the motion of this log says something"""
    why: str = ""
    """why the log is not used; empty if it is"""


@dataclass(frozen=True)
class Watched:
    """The series of one parameter, and what it comes to."""

    name: str
    unit: str
    """in which values are shown"""
    logs: tuple[int, ...]
    """numbers of the logs that determine it"""
    change: Change | None
    """None if too few baseline logs determine it"""
    begins: int | None
    """number of the log at which the change most likely began"""
    level: Interval | None
    """95 % interval of the present value, SI"""
    before: float
    """mean of the baseline, SI; NaN if too few baseline logs determine it"""
    now: float
    """mean of the last logs, SI"""
    beyond: bool | None
    """whether the present value is beyond a limit; None if its interval contains the limit"""
    text: str
    """one sentence: change, present value, limits"""

    @property
    def alarm(self) -> bool:
        """Whether the value has changed or is beyond a limit."""
        return bool(self.beyond) or (self.change is not None and self.change.alarm is not None)

    @property
    def decided(self) -> bool:
        """Whether the logs decide about changes and limits."""
        return self.change is not None and self.beyond is not None


@dataclass
class MonitorResult:
    """The life of a drive by its logs."""

    task: Identification
    logs: list[LogEstimate]
    """in their order"""
    watched: dict[str, Watched]
    """by parameter, and ``residual``: how well the model describes the logs"""
    reference: dict[str, float]
    """medians of the baseline, from which each log was estimated, SI"""
    left_out: dict[str, str] = field(default_factory=dict)
    """by log that cannot be used: why"""

    @property
    def alarms(self) -> list[Watched]:
        """Values that have changed or exceed a limit."""
        return [w for w in self.watched.values() if w.alarm]

    def series(self, name: str) -> dict[str, np.ndarray]:
        """Arrays of one parameter, one element for each log: ``at``, ``value``, ``low``, ``high`` [SI], and ``told``.

        Parameters
        ----------
        name
            Of the parameter.

        Raises
        ------
        InputError
            It is not estimated.
        """
        if name not in self.watched or name == RESIDUAL:
            raise InputError(f"series: {name!r} is not watched; watched are {', '.join(self.estimated())}")
        used = [e for e in self.logs if name in e.values]
        return {
            "at": np.array([e.at for e in used]),
            "value": np.array([e.values[name] for e in used]),
            "low": np.array([e.intervals[name].low for e in used]),
            "high": np.array([e.intervals[name].high for e in used]),
            "told": np.array([name in e.told for e in used]),
        }

    def estimated(self) -> list[str]:
        """Watched parameters."""
        return [name for name in self.watched if name != RESIDUAL]

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """The answer as text."""
        m = self.task.monitor
        used = sum(not e.why for e in self.logs)
        found = [
            f"{used} logs, {min(m.baseline, used)} of them as the baseline; the probability of a false alarm is at most "
            f"{m.false_alarms:.2g} within {m.within} logs"
        ]
        return [*found, *(f"  {w.text}" for w in self.watched.values())]


@checked
def monitor(
    source: str | Path,
    logs: Sequence[str | Path] = (),
    *,
    progress: Callable[[str, int, int], None] | None = None,
) -> MonitorResult:
    """Follow the parameters of a drive over its life, log by log.

    Parameters
    ----------
    source : str or Path
        The identification file (TOML). Its table ``monitor`` names the watched values.
    logs : sequence of str or Path
        Files, patterns or directories, relative to the working directory. Default: the files of ``logs.files``.
    progress : callable, optional
        Called with the name of each log, its number and the number of logs.

    Returns
    -------
    MonitorResult
        Trends with intervals, estimates of each log, changes, and the state of each limit.

    Raises
    ------
    InputError
        The file, a log or the rig cannot be used. The message names file, key, value and remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> result = lm.monitor("examples/cycloidal/baseline.toml")
    >>> result.watched["friction"].text
    'friction: not decided; 3 of the 3 baseline logs determine it, 5 are needed'
    """
    task, directory = load_identification(source)
    if logs:
        files = tuple(str(Path(log).absolute()) for log in logs)
        task = task.model_copy(update={"logs": task.logs.model_copy(update={"files": files})})
    with prefixed(source):
        rig = Rig(task, directory)
        prepared, left_out = gathered(rig, directory)
        result = monitor_logs(rig, prepared, notify=progress)
    result.left_out = {**left_out, **result.left_out}
    return result


def monitor_logs(rig: Rig, logs: Sequence[Prepared], *, notify: Notify | None = None) -> MonitorResult:
    """Monitor prepared logs, as `monitor` does."""
    order = _in_order(rig.task, logs)
    count = rig.task.monitor.baseline
    rig, parts, left_out = split_at_pauses(rig, [log for log, _ in order])
    estimator = _Estimator(_at_start(rig))
    estimates: list[LogEstimate] = []

    def estimate(k: int) -> LogEstimate:
        log, at = order[k]
        if log.name in left_out:
            return LogEstimate(log.name, at, {}, {}, {}, math.nan, why=left_out[log.name])
        own = [part for part in parts if part.name == log.name or part.name.startswith(f"{log.name} from ")]
        return estimator.estimate(log, at, own)

    for k in range(len(order)):
        if notify is not None:
            notify(order[k][0].name, k + 1, len(order))
        estimates.append(estimate(k))
        if k + 1 == min(count, len(order)):
            estimator = estimator.of_baseline()
            for i in estimator.far_off(estimates):  # the start values were worse than the medians are
                estimates[i] = estimate(i)
    estimates = _in_units_of_baseline(estimates, count)
    free = list(estimator.reference.free)
    return MonitorResult(
        rig.task, estimates, watched(rig.task, estimates, free), dict(estimator.reference.values), left_out
    )


def _in_order(task: Identification, logs: Sequence[Prepared]) -> list[tuple[Prepared, float]]:
    """The logs in their order, each with its place."""
    if not task.monitor.order:
        return [(log, float(k)) for k, log in enumerate(logs)]
    places = []
    for log in logs:
        try:
            places.append(number(task.monitor.order, log.facts, "monitor.order"))
        except InputError as error:
            raise InputError(f"{error}", where=log.name) from None
    return sorted(zip(logs, places, strict=True), key=lambda pair: pair[1])


@dataclass(frozen=True)
class _Reference:
    """Values from which each log is estimated."""

    rig: Rig
    rung: int
    values: Mapping[str, float]
    free: Mapping[str, FreeParameter]
    deviations: np.ndarray | None
    """deviations of the residuals of the measured channels, SI; None: by those of the log"""


def _at_start(rig: Rig) -> _Reference:
    """The start values."""
    task, names = rig.task, [rung.name for rung in rig.rungs()]
    rung = names.index(task.monitor.model) if task.monitor.model else len(names) - 1
    sought = free_on(task, rung)
    for name in task.monitor.watch:
        if name not in sought:
            raise InputError(
                f'is not free in the model "{names[rung]}"; name another monitor.model', f"monitor.watch.{name}"
            )
    values = {n: p.start if n in sought or p.fixed or p.off is None else p.off for n, p in task.parameters.items()}
    return _Reference(
        rig, rung, values, _with_priors(task, rung, values), problem_of(rig, Engine(rig, 1), [], rung).given
    )


def _with_priors(task: Identification, rung: int, values: Mapping[str, float]) -> dict[str, FreeParameter]:
    """Parameters that each log estimates, with a prior as wide as their values."""
    found = {}
    for name, p in free_on(task, rung).items():
        if name not in task.monitor.constant:
            size = max(abs(values[name]), p.step)
            found[name] = p.model_copy(update={"start": values[name], "tolerance": 1.96 * size})
    if not found:
        raise InputError("names all parameters, so that none is left to be watched; leave some out", "monitor.constant")
    return found


class _Estimator:
    """Estimates of logs, one after the other."""

    def __init__(self, reference: _Reference) -> None:
        self.reference = reference
        self._engine = Engine(reference.rig, 1)
        self._rough = any(is_rough(reference.rig, name, reference.rung) for name in reference.free)
        self._told: list[dict[str, float]] = []
        self._deviations: list[np.ndarray] = []
        self._smallest = math.inf

    def of_baseline(self) -> _Estimator:
        """From the medians of the logs so far."""
        r = self.reference
        values = {name: self._median(name) for name in r.free}
        of_logs = (
            r.deviations if r.deviations is not None or not self._deviations else np.median(self._deviations, axis=0)
        )
        again = _Estimator(
            replace(
                r,
                values={**r.values, **values},
                free=_with_priors(r.rig.task, r.rung, {**r.values, **values}),
                deviations=of_logs,
            )
        )
        again._smallest = self._smallest
        return again

    def far_off(self, estimates: Sequence[LogEstimate]) -> list[int]:
        """Numbers of the logs whose residuals are far beyond the smallest."""
        return [k for k, e in enumerate(estimates) if e.residual > LARGE * self._smallest]

    def _median(self, name: str) -> float:
        found = [told[name] for told in self._told if name in told]
        return float(np.median(found)) if found else self.reference.values[name]

    def estimate(self, log: Prepared, at: float, parts: Sequence[Prepared]) -> LogEstimate:
        """Estimate from one log in its parts between pauses."""
        task, free = self.reference.rig.task, self.reference.free
        try:
            conditions = tuple(number(text, log.facts, "monitor.conditions") for text in task.monitor.conditions)
            problem = self._problem(parts)
            fit, residuals = self._fit(problem)
        except InputError as refused:
            return LogEstimate(log.name, at, {}, {}, {}, math.nan, why=str(refused))
        own = bootstrap(problem, fit)
        found = misfits(problem, residuals)
        wide = bootstrap(problem, fit, hidden=hidden(problem, residuals, found, fit.correlation))
        deviations = {name: (i.high - i.low) / (2.0 * 1.96) for name, i in own.items()}
        told = {name for name, s in deviations.items() if s <= TOLD * (free[name].deviation or math.inf)}
        values = {name: fit.point.values[name] for name in free}
        residual = _size(problem, fit, residuals)
        if residual < ODD * self._smallest:
            self._told.append({name: values[name] for name in told})
            self._deviations.append(fit.deviations)
        self._smallest = min(self._smallest, residual)
        return LogEstimate(log.name, at, values, deviations, wide, residual, conditions, frozenset(told))

    def _problem(self, parts: Sequence[Prepared]) -> Problem:
        r = self.reference
        problem = problem_of(r.rig, self._engine, [replace(part, held_out=False) for part in parts], r.rung)
        return replace(problem, parameters=r.free, given=r.deviations)

    def _fit(self, problem: Problem) -> tuple[Fit, list[np.ndarray]]:
        """From the median of the logs so far; where that ends in residuals that are no noise, from other values too."""
        own = start_point(self.reference.rig.task, problem.logs).nuisance
        near = {name: self._median(name) for name in self.reference.free}
        start = Point({**self.reference.values, **near}, own)
        best = self._searched(problem, start)
        if not self._rough or self._as_before(problem, best):
            return best
        last = self._told[-1] if self._told else {}
        for there in (replace(start, values=start.values | last), grown(problem, start)):
            again = self._searched(problem, there)
            if _size(problem, *again) < _size(problem, *best):
                best = again
            if self._as_before(problem, best):
                break
        return best

    def _searched(self, problem: Problem, start: Point) -> tuple[Fit, list[np.ndarray]]:
        fit = search(problem, start, iterations=ITERATIONS)
        return fit, self._engine.residuals(problem.logs, fit.point, problem.rung)

    def _as_before(self, problem: Problem, found: tuple[Fit, list[np.ndarray]]) -> bool:
        """Whether the residuals are noise, or as small as those of other logs."""
        return _size(problem, *found) < LARGE * self._smallest or explained(problem, found[1])


def _size(problem: Problem, fit: Fit, residuals: Sequence[np.ndarray]) -> float:
    """Root mean square of the residuals, in their deviations if these are given, else in SI."""
    unit = np.ones(len(fit.deviations)) if problem.given is None else fit.deviations
    scaled = [(r / unit[:, None]).ravel() for r in problem.compared(residuals)]
    return math.sqrt(np.nanmean(np.concatenate(scaled) ** 2))


def _in_units_of_baseline(estimates: list[LogEstimate], baseline: int) -> list[LogEstimate]:
    """With residuals in those of the baseline; logs far beyond these are marked, and take no part in the series of values."""
    sizes = [e.residual for e in estimates[:baseline] if math.isfinite(e.residual)]
    if not sizes:
        first = next((e for e in estimates if e.why), None)
        why = f": {first.log}: {first.why}" if first else ""
        raise InputError(f"no log of the baseline can be used{why}")
    usual = float(np.median(sizes))
    found = []
    for e in estimates:
        ratio = e.residual / usual
        odd = not e.why and ratio > ODD
        why = f"residuals are {ratio:.3g} times those of the baseline" if odd else e.why
        found.append(replace(e, residual=ratio, why=why))
    return found


def watched(task: Identification, estimates: list[LogEstimate], free: list[str]) -> dict[str, Watched]:
    """Trend and alarms of each watched value over the estimates of logs, in their order."""
    names = [name for name in free if not task.monitor.watch or name in task.monitor.watch]
    rate = task.monitor.false_alarms / (len(names) + 1)
    found = {}
    for name in names:
        p, watch = task.parameters[name], task.monitor.watch.get(name, Watch())
        logs = [k for k, e in enumerate(estimates) if name in e.told and not e.why]
        values = np.array([estimates[k].values[name] for k in logs])
        deviations = np.array([estimates[k].deviations[name] for k in logs])
        series = _Series(task, estimates, logs, values, deviations)
        found[name] = series.watched(name, p, watch, rate)
    logs = [k for k, e in enumerate(estimates) if math.isfinite(e.residual)]
    values = np.log([estimates[k].residual for k in logs])
    series = _Series(task, estimates, logs, values, np.zeros(len(logs)))
    found[RESIDUAL] = series.residual(rate)
    return found


class _Series:
    """Estimates of one value over the logs that determine it."""

    def __init__(
        self,
        task: Identification,
        estimates: list[LogEstimate],
        logs: list[int],
        values: np.ndarray,
        deviations: np.ndarray,
    ) -> None:
        self.task, self.estimates, self.logs, self.values = task, estimates, logs, values
        self.count = sum(k < task.monitor.baseline for k in logs)
        self.conditions = np.array([estimates[k].conditions for k in logs]).reshape(len(logs), -1)
        self.enough = self.count >= FEWEST + self.conditions.shape[1]
        self.variances = _variances(values, deviations, self.count) if self.enough else np.ones(len(logs))

    def change(self, direction: str, rate: float) -> Change | None:
        """Change of the series; None if the baseline is too short."""
        if not self.enough:
            return None
        return find_change(
            self.values,
            self.variances,
            self.conditions,
            self.count,
            direction=direction,  # type: ignore[arg-type]
            false_alarms=rate,
            within=self.task.monitor.within,
        )

    def levels(self, change: Change) -> tuple[float, float, float]:
        """(level of the baseline, present level, half its 95 % interval by the scatter of the logs)."""
        from scipy.special import stdtrit

        steady = len(self.values) if change.begins is None else max(self.count, change.begins[1])
        centre = self.conditions[: self.count].mean(axis=0)
        A = np.column_stack([np.ones(steady), self.conditions[:steady] - centre])
        w = 1.0 / np.sqrt(self.variances[:steady])
        effect = np.linalg.lstsq(A * w[:, None], self.values[:steady] * w, rcond=None)[0]
        values = self.values - (self.conditions - centre) @ effect[1:]
        weights = 1.0 / self.variances
        first = change.begins[0] if change.begins is not None and change.ramp == 1 else 0
        last = slice(max(first, len(values) - RECENT), None)
        before = float(np.average(values[: self.count], weights=weights[: self.count]))
        now = float(np.average(values[last], weights=weights[last]))
        t = float(stdtrit(self.count - A.shape[1], 0.975))
        return before, now, t * change.deviation / math.sqrt(float(weights[last].sum()))

    def watched(self, name: str, p: FreeParameter, watch: Watch, rate: float) -> Watched:
        """With the sentence on a parameter."""
        change = self.change(watch.direction, rate)
        if change is None:
            many = min(self.task.monitor.baseline, len(self.estimates))
            text = f"{name}: not decided; {self.count} of the {many} baseline logs determine it, {FEWEST} are needed"
            return Watched(name, p.unit, tuple(self.logs), None, None, None, math.nan, math.nan, None, text)
        before, now, half = self.levels(change)
        level = Interval(now - half, now + half, "logs")
        beyond, limits = _against_limits(name, p, watch, level)
        unit = f" {p.unit}" if p.unit else ""
        shown = f"{p.shown(now)}{unit} ({p.shown(level.low)} to {p.shown(level.high)})"
        if change.alarm is None:
            step = p.shown(change.detectable)
            words = f"{shown}, no change; a step of {step}{unit} over the last {RECENT} logs would have been found with 90 %"
        else:
            words = f"{self._since(change)} from {p.shown(before)} to {shown}"
        return Watched(
            name,
            p.unit,
            tuple(self.logs),
            change,
            self._first(change),
            level,
            before,
            now,
            beyond,
            f"{name}: {words}{limits}",
        )

    def residual(self, rate: float) -> Watched:
        """With the sentence on the residuals."""
        change = self.change("up", rate)
        if change is None:
            text = f"{RESIDUAL}: not decided; {self.count} baseline logs can be used, {FEWEST} are needed"
            return Watched(RESIDUAL, "", tuple(self.logs), None, None, None, math.nan, math.nan, None, text)
        before, now, half = (float(x) for x in self.levels(change))
        level = Interval(math.exp(now - half), math.exp(now + half), "logs")
        now = math.exp(now)
        if change.alarm is not None and level.low > LARGE * math.exp(before):
            text = f"{RESIDUAL}: {self._since(change)}: the model does not describe the drive any more"
        else:
            change = replace(change, alarm=None)
            text = f"{RESIDUAL}: {now:.3g} times that of the baseline; the model describes the drive as it did"
        first = self._first(change)
        return Watched(RESIDUAL, "", tuple(self.logs), change, first, level, math.exp(before), now, False, text)

    def _first(self, change: Change) -> int | None:
        return None if change.alarm is None or change.begins is None else self.logs[change.begins[0]]

    def _since(self, change: Change) -> str:
        assert change.begins is not None
        assert change.alarm is not None
        at, low, high = (self.estimates[self.logs[k]].log for k in change.begins)
        kind = "changed" if change.ramp == 1 else "drifts"
        return f"{kind} since {at} ({low} to {high}, seen with {self.estimates[self.logs[change.alarm]].log})"


def _variances(values: np.ndarray, deviations: np.ndarray, count: int) -> np.ndarray:
    """Relative variances: those of the logs, and the one that their values have beyond these (DerSimonian and Laird 1986)."""
    s2 = deviations**2
    if not np.all(s2 > 0.0):
        return np.ones(len(values))
    w = 1.0 / s2[:count]
    mean = np.average(values[:count], weights=w)
    beyond = float(np.sum(w * (values[:count] - mean) ** 2)) - (count - 1)
    between = max(0.0, beyond / float(w.sum() - np.sum(w**2) / w.sum()))
    found = s2 + between
    return np.asarray(found / np.median(found[:count]))


def _against_limits(name: str, p: FreeParameter, watch: Watch, level: Interval) -> tuple[bool | None, str]:
    """(whether the level is beyond a limit, words on it)."""
    states: list[bool | None] = []
    words = ""
    for end, sign, side in (("min", -1.0, "least"), ("max", 1.0, "largest")):
        limit = in_unit(getattr(watch, end), p.unit, f"monitor.watch.{name}.{end}")
        if limit is None:
            continue
        inner, outer = (level.low, level.high) if sign > 0.0 else (level.high, level.low)
        shown = f"the {side} permitted value {p.shown(limit)}{f' {p.unit}' if p.unit else ''}"
        if sign * (inner - limit) > 0.0:
            states.append(True)
            words += f"; beyond {shown}"
        elif sign * (outer - limit) < 0.0:
            states.append(False)
            words += f"; within {shown}"
        else:
            states.append(None)
            words += f"; not decided whether beyond {shown}"
    beyond = True if True in states else None if None in states else False
    return beyond, words
