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
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...errors import InputError, prefixed
from ...inputs.argument_checks import checked
from ...verdict import Point as Answer
from ...verdict import State, Verdict
from ..candidate_models import grown, is_rough
from ..fit.input_courses import as_recorded, nearer_ways
from ..fit.intervals import bootstrap
from ..fit.least_squares import Fit, FitProblem, problem_of, search
from ..preparation.recorder_pauses import split_at_pauses
from ..preparation.usable_logs import gathered
from ..prepared_log import Prepared
from ..rig.residuals import Engine, ParameterPoint, start_point
from ..rig.rig_scenario import Rig
from ..task.file_formulas import number
from ..task.free_parameters import FreeParameter
from ..task.identification_file import Identification, free_on, load_identification
from ..verdicts.disagreeing_logs import ODD
from ..verdicts.residual_tests import LARGE, explained, hidden, misfits
from .trends import RESIDUAL, LogEstimate, Watched, watched

ITERATIONS = 15
TOLD = 0.5  # of the prior's deviation, which is the size of the value: up to here a log tells a value
FIRST = 3  # logs of the baseline by which the course of the inputs is decided
Notify = Callable[[str, int, int], None]


@dataclass
class MonitorResult:
    """The life of a drive by its logs."""

    task: Identification
    logs: list[LogEstimate]  #: in their order
    watched: dict[str, Watched]  #: by parameter, and ``residual``: how well the model describes the logs
    reference: dict[str, float]  #: medians of the baseline, from which each log was estimated, SI
    left_out: dict[str, str] = field(default_factory=dict)  #: by log that cannot be used: why
    noise: dict[str, tuple[float, str]] = field(default_factory=dict)
    """by channel without a stated deviation: the deviation of the baseline's residuals, with its SI unit"""
    inputs: list[str] = field(default_factory=list)
    """course of inputs between samples, if the task leaves it open, with the reason"""

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

    def _fits(self) -> str:
        """The watched changes that have not happened."""
        watches = list(self.task.monitor.watch.values())
        one_way = any(w.direction != "both" for w in watches)
        limited = any(w.min is not None or w.max is not None for w in watches)
        changed = f"no watched value has changed{' in a direction that is watched' if one_way else ''}"
        return f"{changed}, and none is beyond its limits" if limited else changed

    @property
    def verdict(self) -> Verdict:
        """Changes and limits, what is not decided, and logs that are not used."""
        points = []
        for w in self.watched.values():
            state: State = "does not fit" if w.alarm else "fits" if w.decided else "not decided"
            points.append(Answer(state, w.text.replace(": not decided; ", ": ")))
        if unused := {e.log: e.why for e in self.logs if e.why} | self.left_out:
            name, why = next(iter(unused.items()))
            text = f"no change, but {len(unused)} of {len(self.logs) + len(self.left_out)} logs are not used; {name}: {why}"
            points.append(Answer("fits with a reservation", text))
        verdict = Verdict.of(points)
        if verdict.state == "fits":
            return Verdict("fits", (self._fits(),))
        more = [p.sentence for p in points if p.state == verdict.state and p.sentence != verdict.lines[0]]
        return replace(
            verdict, lines=(*verdict.lines, *more[:1], *([f"{len(more) - 1} more below"] if more[1:] else []))
        )

    def lines(self) -> list[str]:
        """The answer as text."""
        m = self.task.monitor
        used = sum(not e.why for e in self.logs)
        baseline = sum(not e.why for e in self.logs[: m.baseline])
        found = [
            f"{used} logs, {baseline} of them as the baseline; the probability of a false alarm is at most "
            f"{m.false_alarms:.2g} within {m.within} logs"
        ]
        noise = [
            f"{name}: noise of {value:.4g}{f' {unit}' if unit else ''}, estimated from the residuals of the baseline, since measured.{name}.deviation is not given"
            for name, (value, unit) in self.noise.items()
        ]
        return [*found, *(f"  {text}" for text in [*(w.text for w in self.watched.values()), *noise, *self.inputs])]


LEAST = 1e-9  # residual relative to the baseline: a smaller one is rounding, and the trend is a trend of logarithms


@checked
def monitor(
    source: str | Path, logs: Sequence[str | Path] = (), *, progress: Callable[[str, int, int], None] | None = None
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
    >>> result = lm.monitor("examples/wear/monitor.toml")
    >>> [(w.name, result.logs[w.begins].log) for w in result.alarms]
    [('friction', '13.csv')]
    >>> result.verdict.state
    'does not fit'
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
    rig, courses = _with_courses(rig, parts)
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
    reference, trends = estimator.reference, watched(rig.task, estimates, list(estimator.reference.free))
    noise: dict[str, tuple[float, str]] = {}
    if not reference.given and reference.deviations is not None:
        for (name, m), value in zip(rig.task.measured.items(), reference.deviations.tolist(), strict=True):
            noise[name] = value, rig.units.get(m.variable, "")
    return MonitorResult(rig.task, estimates, trends, dict(reference.values), left_out, noise, courses)


def _with_courses(rig: Rig, parts: Sequence[Prepared]) -> tuple[Rig, list[str]]:
    """(rig with a course of each input between samples, words on the inputs that the task leaves open), by the first logs."""
    rig, words, undecided = as_recorded(rig, parts)
    if undecided:
        reference, some = _at_start(rig), [replace(part, held_out=False) for part in parts[:FIRST]]

        def fitted(other: Rig, logs: list[Prepared], point: ParameterPoint) -> Fit:
            problem = problem_of(Engine(other, 1), logs, reference.rung)
            return search(replace(problem, parameters=reference.free), point, iterations=ITERATIONS)

        with suppress(InputError):  # a log without a run: it is named with its estimate
            start = ParameterPoint(dict(reference.values), start_point(rig.task, some).nuisance)
            rig, _, more = nearer_ways(rig, some, undecided, start, fitted)
            words |= more
    return rig, list(words.values())


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
    deviations: np.ndarray | None  # deviations of the residuals of the measured channels, SI; None: the log's
    given: bool  # whether the task states them, so that residuals are in units of them


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
    deviations = problem_of(Engine(rig, 1), [], rung).given
    return _Reference(rig, rung, values, _with_priors(task, rung, values), deviations, deviations is not None)


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
        """The estimator that starts from the medians of the logs so far."""
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
        residual = self._size(problem, residuals)
        if residual < ODD * self._smallest:
            self._told.append({name: values[name] for name in told})
            self._deviations.append(fit.deviations)
        self._smallest = min(self._smallest, residual)
        return LogEstimate(log.name, at, values, deviations, wide, residual, conditions, frozenset(told))

    def _problem(self, parts: Sequence[Prepared]) -> FitProblem:
        r = self.reference
        problem = problem_of(self._engine, [replace(part, held_out=False) for part in parts], r.rung)
        return replace(problem, parameters=r.free, given=r.deviations)

    def _fit(self, problem: FitProblem) -> tuple[Fit, list[np.ndarray]]:
        """The fit from the median of the logs so far; if it leaves residuals that are not noise, from other values too."""
        own = start_point(self.reference.rig.task, problem.logs).nuisance
        near = {name: self._median(name) for name in self.reference.free}
        start = ParameterPoint({**self.reference.values, **near}, own)
        best = self._searched(problem, start)
        if not self._rough or self._as_before(problem, best):
            return best
        last = self._told[-1] if self._told else {}
        for there in (replace(start, values=start.values | last), grown(problem, start)):
            again = self._searched(problem, there)
            if self._size(problem, again[1]) < self._size(problem, best[1]):
                best = again
            if self._as_before(problem, best):
                break
        return best

    def _searched(self, problem: FitProblem, start: ParameterPoint) -> tuple[Fit, list[np.ndarray]]:
        fit = search(problem, start, iterations=ITERATIONS)
        return fit, self._engine.residuals(problem.logs, fit.point, problem.rung)

    def _as_before(self, problem: FitProblem, found: tuple[Fit, list[np.ndarray]]) -> bool:
        """Whether the residuals are noise, or as small as the residuals of other logs."""
        return self._size(problem, found[1]) < LARGE * self._smallest or explained(problem, found[1])

    def _size(self, problem: FitProblem, residuals: Sequence[np.ndarray]) -> float:
        """Root mean square of the residuals: in SI, or in the deviations that the task states, of all logs alike."""
        deviations = self.reference.deviations if self.reference.given else None
        unit = np.ones((len(residuals[0]), 1)) if deviations is None else deviations[:, None]
        return math.sqrt(np.nanmean(np.concatenate([(r / unit).ravel() for r in problem.compared(residuals)]) ** 2))


def _in_units_of_baseline(estimates: list[LogEstimate], baseline: int) -> list[LogEstimate]:
    """Residuals relative to the residuals of the baseline; logs far beyond these are marked, and take no part in the series of values."""
    sizes = [e.residual for e in estimates[:baseline] if math.isfinite(e.residual)]
    if not sizes:
        first = next((e for e in estimates if e.why), None)
        why = f": {first.log}: {first.why}" if first else ""
        raise InputError(f"no log of the baseline can be used{why}")
    usual = float(np.median(sizes))
    found = []
    for e in estimates:
        ratio = e.residual / usual if usual > 0.0 else math.inf if e.residual > 0.0 else 1.0  # of exact logs it is 0
        ratio = max(ratio, LEAST)
        odd = not e.why and ratio > ODD
        why = f"residuals are {ratio:.3g} times those of the baseline" if odd else e.why
        found.append(replace(e, residual=ratio, why=why))
    return found
