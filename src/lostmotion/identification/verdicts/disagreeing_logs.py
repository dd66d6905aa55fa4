"""Logs that disagree with the others, and the fault that explains each.

A log whose residuals are several times the residuals of the other logs is set aside, and the model is fitted to the rest.
Common faults are then undone one by one: signs, units, delays, clocks of another rate, counters that wrap, frozen and slow
channels. A fault explains a log if undoing it brings its residuals down to the residuals of the other logs. Such a log is
left out of the fit; one that no fault explains stays in it, since the model may be what is wrong.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...units.practical import OF_ERRORS
from ..fit.least_squares import Fit, problem_of, search
from ..preparation.screening import MOTION, frozen_stretches, wrapped_by
from ..prepared_log import Prepared
from ..rig.residuals import Engine, ParameterPoint
from ..rig.rig_scenario import Rig
from .residual_tests import explained

SUSPECT = 3.0  # times the median residual of the other logs, from which on the faults are tried
ODD = 6.0  # the same, from which on a log that no fault explains is reported
MENDED = 2.0  # times the median residual, up to which a log agrees with the others
FEWEST = 3  # least number of logs, so that one can disagree with the others
FEW = 8  # logs, up to which each is left out in turn if the residuals are not noise
SHARE = 3  # at most one of as many logs is set aside at once
ROUNDS = 3
ALIKE = 1.02  # times the smallest residuals, up to which faults explain a log alike: all of them are named
TRIED = 3  # faults whose nuisances are fitted, from the one with the smallest residuals on
SHIFTS = 100  # sample intervals, by which a channel may be late or early
SEARCHED = 12  # logs, from the worst on, for which delays of the inputs and rates of the clock are searched
RATES = (1e-2, 1e-3, 1e-4)  # steps of the grids in which the rate of a clock is sought
NAMED_FACTORS = {
    1e-3: "1000 times too large, as mm read as m",
    1e3: "1000 times too small, as m read as mm",
    2.0 * math.pi / 60.0: "in rpm, read as rad/s",
    60.0 / (2.0 * math.pi): "in rad/s, read as rpm",
    math.pi / 180.0: "in degrees, read as rad",
    180.0 / math.pi: "in rad, read as degrees",
}


@dataclass(frozen=True)
class OddLog:
    """A log that disagrees with the others."""

    log: str  # name of the log
    channel: str  # measured channel with the largest residuals
    unit: str  # SI unit of the channel
    rms: float  # root mean square of the residuals of the channel, SI
    ratio: float  # ratio of these residuals to the median of the other logs
    fault: str  # fault that explains the log; empty if none of those tried does
    mended: float  # residuals with the fault undone, SI; NaN without a fault
    held_out: bool  # whether the log was held out of the fit anyway
    shared: bool = False  # whether other logs have the same fault, so that it is the model's

    @property
    def left_out(self) -> bool:
        """Whether the log is left out of the fit."""
        return bool(self.fault) and not self.held_out and not self.shared

    @property
    def text(self) -> str:
        """One sentence: how far the log is off, and why."""
        name, factor = OF_ERRORS.get(self.unit, (self.unit, 1.0))
        unit = f" {name}".rstrip()
        size = f"residuals of {factor * self.rms:.3g}{unit}" if math.isfinite(self.rms) else "no run"
        many = f" are {self.ratio:.3g} times those of the other logs" if math.isfinite(self.ratio) else ""
        why = f"{self.fault}: with that undone {factor * self.mended:.3g}{unit}" if self.fault else UNEXPLAINED
        return f"{self.log}: {self.channel}: {size}{many}; {why}"


UNEXPLAINED = "no sign, unit, delay, clock, wrap, frozen or slow channel explains it, so that it stays in the fit"


def odd_logs(
    engine: Engine, logs: Sequence[Prepared], start: ParameterPoint, fit: Fit, rung: int
) -> tuple[list[OddLog], ParameterPoint]:
    """Logs that disagree with the others, those fitted and those held out, and the point that fits the others.

    logs: all that were fitted or held out.
    start: where the search began.
    fit: where it ended, with this candidate model.

    Returns list of OddLog: empty if all logs agree, or if fewer than three were fitted.
    Returns Point
    """
    rig, train = engine.rig, [log for log in logs if not log.held_out]
    if len(train) < FEWEST:
        return [], fit.point
    agreeing, point = _agreeing(engine, train, start, fit, rung)
    sizes = _Sizes(engine, agreeing, point, rung)
    found = []
    seen = sizes.of_each(logs)
    worst = sorted((ratio for _, ratio in seen), reverse=True)[:SEARCHED]
    for log, (rows, ratio) in zip(logs, seen, strict=True):
        if not ratio > SUSPECT:
            continue
        fault, mended = _explained(rig, log, sizes, search_times=ratio >= worst[-1])
        if fault or ratio > ODD:
            k = int(np.argmax(np.nan_to_num(rows / sizes.median, nan=np.inf)))
            channel = list(rig.task.measured)[k]
            unit = log.log.channels[rig.task.measured[channel].channel].unit
            own = float(mended[k]) if fault else math.nan
            found.append(OddLog(log.name, channel, unit, float(rows[k]), ratio, fault, own, log.held_out))
    return found, point


class _Sizes:
    """Residuals of logs at a point, relative to the residuals of logs that agree."""

    def __init__(self, engine: Engine, logs: Sequence[Prepared], point: ParameterPoint, rung: int) -> None:
        self.engine, self.point, self.rung = engine, point, rung
        problem = problem_of(engine, logs, rung)
        floor = problem.resolution / math.sqrt(12.0)
        if problem.given is not None:
            floor = np.maximum(floor, problem.given)
        rows = self.all_of(logs)
        relative = rows / np.array([_spread(log) for log in logs])
        self.median = np.maximum(np.maximum(np.median(rows, axis=0), floor), 1e-300)
        self.relative = np.maximum(np.median(relative, axis=0), 1e-300)

    def of(self, log: Prepared) -> tuple[np.ndarray, float]:
        """(residuals of each measured channel [SI], ratio to the residuals of the other logs)."""
        return self.of_each([log])[0]

    def of_each(self, logs: Sequence[Prepared]) -> list[tuple[np.ndarray, float]]:
        """The same of several logs, whose runs are made together."""
        return [(rows, self._ratio(log, rows)) for log, rows in zip(logs, self.all_of(logs), strict=True)]

    def several(self, logs: Sequence[Prepared]) -> list[float]:
        """Ratios of logs, with nuisances as they are; one run each, all at once."""
        residuals = self.engine.residuals(logs, self.point, self.rung)
        return [self._ratio(log, _rms(log, r)) for log, r in zip(logs, residuals, strict=True)]

    def all_of(self, logs: Sequence[Prepared]) -> np.ndarray:
        """Residuals of logs [SI], one row for each log, each with nuisances of its own."""
        point = self.point
        if self.engine.rig.task.nuisance:
            residuals = self.engine.residuals(logs, point, self.rung)
            able = [log for log in logs if log.name not in self.engine.failed]  # without a run the residuals are NaN
            own = replace(problem_of(self.engine, able, self.rung), parameters={})
            if own.given is None:  # the size of most logs, so that one that is far off does not weaken the others
                rows = np.array([_rms(log, r) for log, r in zip(logs, residuals, strict=True)])
                own = replace(own, given=np.maximum(np.nanmedian(rows, axis=0), 1e-12))
            point = search(own, point, iterations=10).point if able else point
        residuals = self.engine.residuals(logs, point, self.rung)
        return np.array([_rms(log, r) for log, r in zip(logs, residuals, strict=True)])

    def _ratio(self, log: Prepared, rows: np.ndarray) -> float:
        # A large motion has large residuals and a small one is covered by noise: both measures must be unusual.
        ratios = np.minimum(rows / self.median, rows / _spread(log) / self.relative)
        return float(np.max(np.nan_to_num(ratios, nan=np.inf)))


def _rms(log: Prepared, residuals: np.ndarray) -> np.ndarray:
    """Root mean square of each channel [SI], without the weights of samples; NaN where there is no run."""
    rows = np.where(log.valid, residuals / log.weight, 0.0)
    return np.asarray(np.sqrt(np.sum(rows**2, axis=1) / np.maximum(log.valid.sum(axis=1), 1)))


def _spread(log: Prepared) -> np.ndarray:
    """Standard deviation of each measured channel."""
    return np.array([max(float(np.nanstd(x)) if np.isfinite(x).any() else 0.0, 1e-300) for x in log.measured.values()])


def _agreeing(
    engine: Engine, train: list[Prepared], start: ParameterPoint, fit: Fit, rung: int
) -> tuple[list[Prepared], ParameterPoint]:
    """(logs that agree with each other, the point that fits them)."""
    point, kept = fit.point, train
    most = max(1, len(train) // SHARE)
    for _ in range(ROUNDS):
        sizes = _Sizes(engine, kept, point, rung)
        ratios = [ratio for _, ratio in sizes.of_each(train)]
        worst = sorted(range(len(train)), key=lambda k: -ratios[k])[:most]
        aside = {k for k in worst if ratios[k] > SUSPECT}
        if not aside and len(kept) == len(train):
            return _leave_one_out(engine, train, start, fit, rung)
        rest = [log for k, log in enumerate(train) if k not in aside]
        if rest == kept:
            break
        kept, point = rest, _fitted(engine, rest, [start, point], rung)
    return kept, point


def _leave_one_out(
    engine: Engine, train: list[Prepared], start: ParameterPoint, fit: Fit, rung: int
) -> tuple[list[Prepared], ParameterPoint]:
    """The same for few logs: one of them may have spoiled the fit so that it does not stand out."""
    problem = problem_of(engine, train, rung)
    if len(train) > FEW or explained(problem, engine.residuals(train, fit.point, rung)):
        return train, fit.point
    best: tuple[float, list[Prepared], ParameterPoint] = (SUSPECT, train, fit.point)
    for k, log in enumerate(train):
        rest = [*train[:k], *train[k + 1 :]]
        point = _fitted(engine, rest, [start], rung)
        ratio = _Sizes(engine, rest, point, rung).of(log)[1]
        if ratio > best[0]:
            best = (ratio, rest, point)
    return best[1:]


def _fitted(engine: Engine, logs: Sequence[Prepared], starts: Sequence[ParameterPoint], rung: int) -> ParameterPoint:
    """The best point of searches from some starts; the last start if none of them has a run."""
    problem = problem_of(engine, logs, rung)
    best, least = starts[-1], math.inf
    for start in starts:
        try:
            fit = search(problem, start)
        except InputError:
            continue
        size = float(np.nanmedian([np.mean(np.abs(r)) for r in engine.residuals(logs, fit.point, rung)]))
        if size < least:
            best, least = fit.point, size
    return best


def _explained(rig: Rig, log: Prepared, sizes: _Sizes, *, search_times: bool) -> tuple[str, np.ndarray]:
    """(the fault that explains a log, its residuals without it); no fault if none of those tried does.

    Late inputs and clocks take a run for each delay and rate, so that they are tried last, and only if no fault of another
    kind explains the log.
    """
    nothing = "", np.array([])
    if any(segment.initial for segment in log.segments):  # its start was taken from the values in question
        return nothing
    before = sizes.of(log)[1]
    runs = _runs(rig, log, sizes)
    other = list(_faults(rig, log, sizes, runs))
    late_channels = (one for channel, run in runs.items() for one in _late(rig, log, channel, run))
    tried = [*other, *late_channels]  # late inputs may explain the latter better
    if not tried:
        return nothing
    ratios = sizes.several([mended for _, mended in tried])
    if search_times and not any(r < MENDED for r in ratios[: len(other)]):
        late = [*_late_inputs(rig, log), *_other_rate(rig, log, sizes)]
        tried, ratios = tried + late, ratios + sizes.several([mended for _, mended in late])
    order = sorted(range(len(tried)), key=lambda k: ratios[k])[:TRIED]
    found = []
    for k in order:
        fault, mended = tried[k]
        rows, ratio = sizes.of(mended)
        if ratio < min(MENDED, before / SUSPECT):
            found.append((ratio, fault, rows))
    if not found:
        return nothing
    least, _, rows = min(found, key=lambda f: f[0])
    return ", or ".join(fault for ratio, fault, _ in found if ratio < ALIKE * least), rows


def _faults(rig: Rig, log: Prepared, sizes: _Sizes, runs: Mapping[str, np.ndarray]) -> Iterator[tuple[str, Prepared]]:
    """(fault, the log with it undone), but for what is late or early."""
    task = rig.task
    measured = [m.channel for m in task.measured.values()]
    inputs = [i.channel for i in task.inputs.values()]
    factors = {**NAMED_FACTORS, **_ratios(rig, log, sizes)}
    for channel in dict.fromkeys([*measured, *inputs]):
        x = log.log.values(channel)
        if not np.nanmax(np.abs(x)) > 0.0:
            continue
        yield f"{channel} has the opposite sign", log.changed(task, {channel: -x})
        for factor, words in factors.items():
            yield f"{channel} is {words}", log.changed(task, {channel: factor * x})
    for factor, words in ((1e-3, "in ms, read as s"), (1e3, "in s, read as ms")):
        yield f"times are {words}", log.changed(task, {}, time=factor * log.log.time)
    for channel in dict.fromkeys(measured):
        yield from _recording_faults(rig, log, channel)
        if channel in runs:
            yield from _displaced(rig, log, channel, runs[channel])


def _ratios(rig: Rig, log: Prepared, sizes: _Sizes) -> Mapping[float, str]:
    """Factors between the shafts of the rig."""
    found: dict[float, str] = {}
    for name, gear in rig.scenario_at(log, sizes.point.of(log), sizes.rung).gears.items():
        ratio = abs(float(gear.ratio))
        if abs(ratio - 1.0) > 0.01:
            found[ratio] = f"measured on the other side of gear {name} (a factor of {ratio:.6g} too small)"
            found[1.0 / ratio] = f"measured on the other side of gear {name} (a factor of {ratio:.6g} too large)"
    return found


def _recording_faults(rig: Rig, log: Prepared, channel: str) -> Iterator[tuple[str, Prepared]]:
    """Faults of a measured channel that its own samples show."""
    x = log.log.values(channel)
    others = [log.log.channels[m.channel] for m in rig.task.measured.values() if m.channel != channel]
    if stretches := frozen_stretches(x, [c.values for c in others if c.unit in MOTION]):
        masked = x.copy()
        for begin, end in stretches:
            masked[begin + 1 : end] = np.nan
        begin, end = max(stretches, key=lambda s: s[1] - s[0])
        text = f"{channel} is frozen from {log.time[begin]:.4g} to {log.time[end - 1]:.4g} s"
        yield text, log.changed(rig.task, {channel: masked})
    fresh = np.concatenate([[True], np.diff(x) != 0.0])
    if 10 <= fresh.sum() < 0.5 * len(x):
        text = f"{channel} changes in {np.mean(fresh):.0%} of its samples only"
        yield text, log.changed(rig.task, {channel: np.where(fresh, x, np.nan)})


def _runs(rig: Rig, log: Prepared, sizes: _Sizes) -> dict[str, np.ndarray]:
    """Measured channels as the model has them, those with a run and enough samples."""
    found = {}
    residuals = sizes.engine.residuals([log], sizes.point, sizes.rung)[0] / log.weight
    for m, row in zip(rig.task.measured.values(), residuals, strict=True):
        x = log.log.values(m.channel)
        if np.isfinite(row).all() and np.isfinite(x).sum() >= 10:
            found[m.channel] = np.asarray(x - row)
    return found


def _displaced(rig: Rig, log: Prepared, channel: str, run: np.ndarray) -> Iterator[tuple[str, Prepared]]:
    """A measured channel with an offset, or by a counter that wraps."""
    x = log.log.values(channel)
    there = np.isfinite(x)
    offset = float(np.mean((x - run)[there]))
    yield f"{channel} has an offset of {offset:.4g}", log.changed(rig.task, {channel: x - offset})
    if (period := wrapped_by(x)) is not None:
        whole = np.full(len(x), np.nan)
        whole[there] = np.unwrap(x[there], period=period)
        whole += period * np.round(np.nanmean(run - whole) / period)
        yield f"{channel} jumps by {period:.6g}, as a counter that wraps", log.changed(rig.task, {channel: whole})


def _late(rig: Rig, log: Prepared, channel: str, run: np.ndarray) -> Iterator[tuple[str, Prepared]]:
    """A measured channel late or early, and all of them by as much, by the time with the smallest residuals."""
    step, x = log.log.interval, log.log.values(channel)
    most = min(SHIFTS, len(x) // 4)

    def size(shift: float) -> float:
        return float(np.sqrt(np.nanmean((_later(log.time, x, shift) - run) ** 2)))

    coarse = min((step * k for k in range(-most, most + 1)), key=size)
    shift = float(min(coarse + step * np.linspace(-1.0, 1.0, 41), key=size))
    if abs(shift) < 0.5 * step:
        return
    words = f"{1e3 * abs(shift):.3g} ms {'late' if shift > 0.0 else 'early'}"
    yield f"{channel} is {words}", log.changed(rig.task, {channel: _later(log.time, x, shift)})
    if len(rig.task.measured) > 1:
        all_of = {m.channel: _later(log.time, log.log.values(m.channel), shift) for m in rig.task.measured.values()}
        yield f"all measured channels are {words} against the inputs", log.changed(rig.task, all_of)


def _late_inputs(rig: Rig, log: Prepared) -> Iterator[tuple[str, Prepared]]:
    """Inputs that are late by whole sample intervals: each changes the motion, so that each takes a run."""
    for late in log.log.interval * np.arange(1, SHIFTS + 1):
        moved = {i.channel: _later(log.time, log.log.values(i.channel), late) for i in rig.task.inputs.values()}
        kept = {name: np.where(np.isfinite(x), x, log.log.values(name)) for name, x in moved.items()}
        yield f"the inputs are {1e3 * late:.3g} ms late", log.changed(rig.task, kept)


def _other_rate(rig: Rig, log: Prepared, sizes: _Sizes) -> Iterator[tuple[str, Prepared]]:
    """The log by a clock that runs faster or slower: the best rate of a search on grids that become finer."""
    rate = 1.0
    for step in RATES:
        rates = [rate + step * k for k in range(-10, 11)]
        ratios = sizes.several([log.changed(rig.task, {}, time=x * log.log.time) for x in rates])
        rate = rates[int(np.argmin(ratios))]
    if abs(rate - 1.0) > RATES[-1]:
        words = f"its clock runs {abs(100.0 * (1.0 / rate - 1.0)):.2g} % too {'fast' if rate < 1.0 else 'slow'}"
        yield words, log.changed(rig.task, {}, time=rate * log.log.time)


def _later(time: np.ndarray, x: np.ndarray, shift: float) -> np.ndarray:
    """Values of a channel a time later; NaN where it has none."""
    there = np.isfinite(x)
    later = np.interp(time + shift, time[there], x[there], left=np.nan, right=np.nan)
    return np.asarray(np.where(there, later, np.nan))
