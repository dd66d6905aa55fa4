"""Identification: from an identification file to its result."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import prefixed
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count
from .candidate_models import Notify, RungResult, begun_with, chosen, climb, first_fit, is_rough
from .fit.input_courses import Way, as_recorded, nearer_ways
from .fit.intervals import Interval, bootstrap, profile, widest
from .fit.least_squares import Fit, FitProblem, linearised, problem_of, search
from .fit.saved_progress import Progress
from .fit.start_values import Regression, regressed
from .left_out_conditions import left_out_errors
from .preparation.prepare import alike
from .preparation.recorder_pauses import split_at_pauses
from .preparation.usable_logs import gathered
from .prepared_log import Prepared
from .result import IdentificationResult
from .rig.residuals import Engine, ParameterPoint, start_point
from .rig.rig_runs import run_logs
from .rig.rig_scenario import Rig
from .task.identification_file import Identification, free_on, load_identification
from .verdicts.disagreeing_logs import OddLog, odd_logs
from .verdicts.identifiability import Undetermined, at_bounds, resting_on
from .verdicts.residual_tests import Misfit, explained, hidden, misfits, with_shapes
from .verdicts.shared_faults import SharedFault, family, kinds, shared_faults

MANY = 10  # fitted logs for one that is left out: as many keep the models near to what they were


def _no_notice(what: str, iteration: int, cost: float) -> None:
    """Nobody asks."""


@checked
def identify(
    source: str | Path,
    *,
    threads: Count | None = None,
    profiles: bool = False,
    progress: Callable[[str, int, float], None] | None = None,
    resume: str | Path | None = None,
) -> IdentificationResult:
    """Identify the values of a rig from measured logs.

    Parameters
    ----------
    source : str or Path
        The identification file (TOML).
    threads : int, optional
        Number of runs at the same time. Default: the number of processors.
    profiles : bool
        Whether to compute intervals by the profile of the likelihood, too. They take as long as the fit for each parameter.
    progress : callable, optional
        Called with the name of the model, the iteration and the cost.
    resume : str or Path, optional
        File that keeps the models fitted so far. A call that was interrupted continues with the next model. The file is removed at the end.

    Returns
    -------
    IdentificationResult
        Values with intervals, errors of each log, the models that were tried, and the unidentifiable parameters.

    Raises
    ------
    InputError
        The file, a log or the rig cannot be used. The message names file, key, value and remedy.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> gearbox = lm.gearbox("schaeffler-rt1-h-20-100")
    >>> with TemporaryDirectory() as folder:
    ...     result = lm.identify(lm.identification.write_campaign(folder, gearbox))
    >>> len(result.logs), len(result.intervals) > 0
    (6, True)
    """
    task, directory = load_identification(source)
    with prefixed(source):
        return identify_task(
            task, directory, threads=threads, profiles=profiles, notify=progress or _no_notice, resume=resume
        )


def identify_task(
    task: Identification,
    directory: Path,
    *,
    threads: int | None = None,
    profiles: bool = False,
    notify: Notify = _no_notice,
    resume: str | Path | None = None,
) -> IdentificationResult:
    """Identify the values of a task that has been read, as `identify` does."""
    rig = Rig(task, directory)
    logs, left_out = gathered(rig, directory)
    kept = Progress(None if resume is None else Path(resume))
    result = identify_logs(rig, logs, threads=threads, profiles=profiles, notify=notify, progress=kept)
    kept.finish()
    result.left_out = {**left_out, **result.left_out}
    return result


def identify_logs(
    rig: Rig,
    logs: list[Prepared],
    *,
    threads: int | None = None,
    profiles: bool = False,
    notify: Notify = _no_notice,
    progress: Progress | None = None,
) -> IdentificationResult:
    """Identify the values from prepared logs, as `identify` does."""
    kept = progress or Progress(None)
    rig, logs, left_out = split_at_pauses(rig, logs)
    every = {log.name: log for log in logs}
    odd: dict[str, OddLog] = {}
    of_model: set[str] = set()  # families of faults that logs share
    shared: list[SharedFault] = []
    gone: set[str] = set()
    found: _Climbed | None = None
    while True:
        found = _climbed(rig, logs, threads, notify, kept, found)
        odd = {**{n: o for n, o in odd.items() if n in gone}, **{o.log: o for o in found.odd}}
        shared = shared_faults(found.engine, list(every.values()), list(odd.values()), found.agreed, found.best)
        of_model |= {family(odd[s.logs[0]].fault) for s in shared}
        odd = {n: replace(o, shared=family(o.fault) in of_model) for n, o in odd.items()}
        drop = {n for n, o in odd.items() if o.left_out}
        if drop == gone:
            break
        gone = drop
        logs = [log for log in every.values() if log.name not in gone]
    result = _answer(found, profiles)
    result.left_out = left_out | {name: odd[name].text for name in every if name in gone}
    result.odd, result.shared = list(odd.values()), shared
    errors = {e.log: e.mae for e in result.errors if e.channel == next(iter(rig.task.measured))}
    result.kinds = kinds(result.logs, errors, result.odd)
    engine = Engine(result.rig or rig, threads)
    result.conditions = left_out_errors(engine, result.logs, result.fit, result.chosen, notify)
    return result


@dataclass(frozen=True)
class _Climbed:
    """The models that were fitted to some logs, and the logs that disagree with the others."""

    engine: Engine
    logs: list[Prepared]
    start: Regression
    ways: dict[str, str]
    rungs: list[RungResult]
    best: int
    odd: list[OddLog]
    agreed: ParameterPoint  # values that fit the logs which agree with each other


def _climbed(
    rig: Rig, logs: list[Prepared], threads: int | None, notify: Notify, progress: Progress, before: _Climbed | None
) -> _Climbed:
    """Fits all models to the logs; the intervals wait until no further log is left out.

    Models are compared under one course of inputs between samples. If the model that is taken turns an input to the other course,
    all models are fitted again, each from its own start. Without a few of many logs the models continue from the values that they
    had before, under the same course.
    """
    near = before is not None and len(logs) >= MANY * (len(before.logs) - len(logs))
    rig, point, start, ways, undecided = _begun(rig, logs, threads, notify)
    kept: dict[str, tuple[ParameterPoint, list[ParameterPoint]]] = {}
    if before is not None and near:
        kept = {rung.name: (rung.fit.point, rung.minima) for rung in before.rungs}
        rig, ways, undecided = before.engine.rig, before.ways, ()
    logs = [replace(log, cache={}) for log in logs]
    while True:
        engine = Engine(rig, threads)
        rungs = climb(engine, logs, point, notify, progress.of(rig.task, logs, kept))
        best = chosen(rungs)
        turned = _turned(engine, logs, rungs[best].fit, best, undecided)
        if turned is None:
            break
        rig, words = turned
        ways, undecided = ways | words, ()
        logs = [replace(log, cache={}) for log in logs]
        point, start = _start(rig, logs, threads)
    odd, agreed = odd_logs(engine, logs, point, rungs[best].fit, best)
    return _Climbed(engine, logs, start, ways, rungs, best, odd, agreed)


def _turned(
    engine: Engine, logs: list[Prepared], fit: Fit, rung: int, undecided: Collection[str]
) -> tuple[Rig, dict[str, str]] | None:
    """(rig, words) if inputs go the other way between their samples, seen from the values of a fit.

    The way was chosen at the first values, which may be so far off that the residuals of both ways say nothing.
    """
    rig, train = engine.rig, [log for log in logs if not log.held_out]
    if not undecided or explained(problem_of(engine, train, rung), engine.residuals(train, fit.point, rung)):
        return None
    ways: dict[str, Way] = {name: rig.task.inputs[name].interpolation or "hold" for name in undecided}

    def fitted(other: Rig, some: list[Prepared], point: ParameterPoint) -> Fit:
        return search(problem_of(Engine(other, engine.threads), some, rung), point)

    other, _, words = nearer_ways(rig, train, ways, fit.point, fitted)
    return None if other is rig else (other, words)


def _answer(found_by: _Climbed, profiles: bool) -> IdentificationResult:
    """Answer of the fitted models, with intervals."""
    engine, logs, rungs, best = found_by.engine, found_by.logs, found_by.rungs, found_by.best
    rig, task = engine.rig, engine.rig.task
    fit, free = rungs[best].fit, free_on(task, best)
    train = [log for log in logs if not log.held_out]
    problem = problem_of(engine, train, best)
    residuals = engine.residuals(train, fit.point, best)
    misfit = with_shapes(problem, fit.point, residuals, misfits(problem, residuals))
    intervals, found = _intervals(problem, fit, misfit, rungs[best].minima, profiles)
    intervals = _with_model_error(intervals, misfit, rungs, best)
    first = logs[0]
    return IdentificationResult(
        task,
        rungs,
        best,
        intervals,
        [*rungs[best].undetermined, *_resting(problem, fit)],
        at_bounds(fit, free),
        _notes(logs),
        rig.scenario_at(first, fit.point.of(first), best),
        found,
        engine.by_differences,
        {log.name: engine.touching[log.name] for log in train if log.name in engine.touching},
        found_by.start,
        rig,
        logs,
        inputs=list(found_by.ways.values()),
        misfits=[m for m in misfit if m.large or m.structured],
    )


def _begun(
    rig: Rig, logs: list[Prepared], threads: int | None, notify: Notify
) -> tuple[Rig, ParameterPoint, Regression, dict[str, str], Collection[str]]:
    """(rig with a way for each input, where the search begins, why there, words on the inputs, the inputs that runs decide)."""
    rig, ways, undecided = as_recorded(rig, logs)
    point, start = _start(rig, logs, threads)
    train = [log for log in logs if not log.held_out]
    if undecided and train:

        def fitted(rig: Rig, logs: list[Prepared], start: ParameterPoint) -> Fit:
            return first_fit(Engine(rig, threads), logs, start, notify)

        rig, point, more = nearer_ways(rig, begun_with(rig.task, train), undecided, point, fitted)
        ways |= more
    return rig, point, start, ways, undecided if train else ()


def _start(rig: Rig, logs: list[Prepared], threads: int | None) -> tuple[ParameterPoint, Regression]:
    """Start of the lowest model, with the parameters of the others off: by regression, where the task wants it."""
    point, train = start_point(rig.task, logs), [log for log in logs if not log.held_out]
    if not rig.task.fit.regression or not train:
        return point, Regression()
    return regressed(Engine(rig, threads), begun_with(rig.task, train), point, free_on(rig.task, 0))


def _intervals(
    problem: FitProblem, fit: Fit, misfit: list[Misfit], minima: list[ParameterPoint], profiles: bool
) -> tuple[dict[str, Interval], dict[str, list[tuple[float, float]]]]:
    """(intervals, profiles), wide enough for residuals that no noise explains, and for other minima."""
    residuals = problem.engine.residuals(problem.logs, fit.point, problem.rung)
    intervals = bootstrap(problem, fit, hidden=hidden(problem, residuals, misfit, fit.correlation))
    for point in minima:
        intervals = {n: widest(i, Interval(point.values[n], point.values[n], i.method)) for n, i in intervals.items()}
    found = {}
    for name in problem.parameters if profiles else ():
        profiled, found[name] = profile(problem, fit, name)
        intervals[name] = widest(profiled, intervals[name]) if any(m.large for m in misfit) else profiled
    if any(m.large and m.structured for m in misfit):
        for name, p in problem.parameters.items():
            if is_rough(problem.engine.rig, name, problem.rung):
                intervals[name] = Interval(p.min, p.max, "bounds")
    return intervals, found


def _with_model_error(
    intervals: dict[str, Interval], misfit: list[Misfit], rungs: list[RungResult], best: int
) -> dict[str, Interval]:
    """Flagged where residuals have a structure, and wide enough for the values of the model next to the one that is taken."""
    structured = [m for m in misfit if m.structured]
    if not structured:
        return intervals
    shapes = dict.fromkeys(name for m in structured for name, _ in m.shapes)
    over = f" over {' and '.join(shapes)}" if shapes else ""
    flag = f"may miss the value: structured residuals{over}"
    found = {name: replace(i, flag=flag) for name, i in intervals.items()}
    if len(rungs) > 1:
        other = rungs[best - 1] if best > 0 else rungs[best + 1]
        loose = {name for u in other.undetermined for name in u.changes}
        for name in set(other.fit.free) & found.keys() - loose:
            value = other.fit.point.values[name]
            found[name] = widest(found[name], Interval(value, value, found[name].method))
    return found


def _notes(logs: list[Prepared]) -> dict[str, tuple[str, ...]]:
    """Notes by log; a note that several logs share is given once, with their number and the numbers of the first."""
    takers: dict[str, list[tuple[str, str]]] = {}
    for log in logs:
        for note in log.log.notes:
            takers.setdefault(alike(note), []).append((log.name, note))
    found: dict[str, tuple[str, ...]] = {}
    for same in takers.values():
        name, note = same[0]
        where = name if len(same) == 1 else f"{name} and {len({n for n, _ in same}) - 1} more"
        found[where] = (*found.get(where, ()), note)
    return found


def _resting(problem: FitProblem, fit: Fit) -> list[Undetermined]:
    """Parameters of higher models on which the values depend and which the logs do not determine."""
    rig, rung = problem.engine.rig, problem.rung
    above = free_on(rig.task, len(rig.rungs()) - 1)
    found = []
    for name, p in above.items():
        phases = range(-1, len(rig.task.phases))
        if name in problem.parameters or not any(rig.keys_of(name, rung, phase) for phase in phases):
            continue
        wider = replace(problem, parameters={**problem.parameters, name: p})
        residuals = wider.engine.residuals(wider.logs, fit.point, rung)
        normal = linearised(wider, fit.point, residuals, fit.deviations, fit.correlation).normal
        found += resting_on(rig, fit, wider.parameters, normal, name)
    return found


def residual_table(
    result: IdentificationResult, variables: tuple[str, ...] = (), logs: Sequence[str] | None = None
) -> dict[str, dict[str, np.ndarray]]:
    """Time, measured and computed channels, and variables of the rig along the run, by log; NaN for a log without a run.

    logs: names of the logs; left out, all.
    """
    assert result.rig is not None
    shown = [log for log in result.logs if logs is None or log.name in logs]
    requests = [(log, result.values_for(log.name)) for log in shown]
    seen = run_logs(result.rig, requests, result.chosen, extra=variables, threads=os.cpu_count() or 1)
    out = {}
    for log, run in zip(shown, seen, strict=True):
        own = dict(zip(log.measured, run.values, strict=True)) | run.extra
        if run.error is not None:
            own = {name: np.full(len(log.time), np.nan) for name in (*log.measured, *variables)}
        out[log.name] = {"time": log.time, **{f"measured {n}": v for n, v in log.measured.items()}, **own}
    return out
