"""Trend of each watched value over the estimates of logs: changes, present values, limits."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...units.practical import counted, printed
from ..fit.intervals import Interval
from ..task.free_parameters import FreeParameter, in_unit
from ..task.identification_file import Identification
from ..task.monitor_table import Watch
from ..verdicts.residual_tests import LARGE
from .change_detection import CONFIRMED, RECENT, Change, find_change

FEWEST = 5  # logs of the baseline that tell a value
RESIDUAL = "residual"
NONE_AFTER = "there is no log after the baseline"


@dataclass(frozen=True)
class LogEstimate:
    """Parameter values of one log, with their intervals."""

    log: str  #: name of the log
    at: float  #: place in the order: its number, or the value of ``monitor.order``
    values: Mapping[str, float]  #: SI, by parameter
    deviations: Mapping[str, float]  #: standard deviations of the values by the residuals of this log alone, SI
    intervals: Mapping[str, Interval]  #: 95 % intervals of the values, widened by what structured residuals may hide
    residual: float  #: root mean square of the residuals, relative to the baseline; NaN of a log that cannot be used
    conditions: tuple[float, ...] = ()  #: values of ``monitor.conditions``
    told: frozenset[str] = frozenset()  #: parameters that influence the motion of this log
    why: str = ""  #: why the log is not used; empty if it is


@dataclass(frozen=True)
class Watched:
    """The series of one parameter, and what it comes to."""

    name: str
    unit: str  #: in which values are shown
    logs: tuple[int, ...]  #: numbers of the logs that determine it
    change: Change | None  #: None if too few baseline logs determine it
    begins: int | None  #: number of the log at which the change most likely began
    level: Interval | None  #: 95 % interval of the present value, SI; None without a log after the baseline
    before: float  #: level of the baseline, SI; NaN if too few baseline logs determine it
    now: float  #: present value, of logs after the baseline alone, SI; NaN without one
    beyond: bool | None  #: whether the present value is beyond a limit; None if that is not decided
    decided: bool  #: whether the logs decide about changes and limits
    text: str  #: one sentence: change, present value, limits

    @property
    def alarm(self) -> bool:
        """Whether the value has changed or is beyond a limit."""
        return bool(self.beyond) or (self.change is not None and self.change.alarm is not None)


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


CHANGES = {"up": "rise", "down": "fall", "both": "change"}


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
        self.least = FEWEST + self.conditions.shape[1]
        enough = self.count >= self.least
        self.variances = _variances(values, deviations, self.count) if enough else np.ones(len(logs))

    def change(self, direction: str, rate: float) -> Change | None:
        """Change of the series; None if the baseline is too short."""
        if self.count < self.least:
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

    def _undecided(self, name: str, unit: str, change: Change | None, why: str) -> Watched:
        """No present value, and why."""
        before = math.nan if change is None else change.before
        text = f"{name}: not decided; {why}"
        return Watched(name, unit, tuple(self.logs), None, None, None, before, math.nan, None, False, text)

    def _lacking(self, change: Change | None) -> str:
        """Why nothing is said of a series; empty if it has a present value."""
        many = min(self.task.monitor.baseline, len(self.estimates))
        if change is None:
            return f"{self.count} of the {many} baseline logs determine it, {self.least} are needed"
        later = self.estimates[self.task.monitor.baseline :]
        if not change.present:
            first = next((f"; {e.log}: {e.why}" for e in later if e.why), "")
            return f"none of the {len(later)} logs after the baseline determines it{first}" if later else NONE_AFTER
        return ""

    def watched(self, name: str, p: FreeParameter, watch: Watch, rate: float) -> Watched:
        """Adds the sentence on a parameter."""
        change = self.change(watch.direction, rate)
        if change is None or (lacking := self._lacking(change)):
            return self._undecided(name, p.unit, change, self._lacking(change) if change is None else lacking)
        levels = [Interval(x.low, x.high, "logs") for x in change.present]
        now, level = change.present[0].value, levels[0]
        beyond, limits = _against_limits(name, p, watch, levels)
        unit = f" {printed(p.unit)}" if p.unit else ""
        shown = f"{p.shown(now)}{unit} ({p.shown(level.low)} to {p.shown(level.high)})"
        after = len(self.logs) - self.count
        enough = math.isfinite(change.detectable)
        if change.alarm is not None:
            words = f"{self._since(change)} from {p.shown(change.before)} to {shown}"
        elif enough:
            found = f"a step of {p.shown(change.detectable)}{unit} over the last {counted(min(RECENT, after), 'log')} would have been found with 90 %"
            words = f"{shown}, no {CHANGES[watch.direction]}; {found}"
        else:
            few = f"{counted(after, 'log')} after the baseline determine{'s' if after == 1 else ''} it, {change.needed} are needed"
            words = f"{shown} after {p.shown(change.before)}, not decided whether changed: {few}"
        decided = beyond is not None and (enough or change.alarm is not None)
        first = self._first(change)
        text = f"{name}: {words}{limits}"
        return Watched(name, p.unit, tuple(self.logs), change, first, level, change.before, now, beyond, decided, text)

    def residual(self, rate: float) -> Watched:
        """Adds the sentence on the residuals, whose series is the series of their logarithms."""
        change = self.change("up", rate)
        if change is None or (lacking := self._lacking(change)):
            return self._undecided(RESIDUAL, "", change, self._lacking(change) if change is None else lacking)
        last = change.present[0]
        now, before = math.exp(last.value), math.exp(change.before)
        level = Interval(math.exp(last.low), math.exp(last.high), "logs")
        decided = True
        if change.alarm is not None and level.low > LARGE * before:
            text = f"{RESIDUAL}: {self._since(change)}: the model does not describe the drive any more"
        else:
            change = replace(change, alarm=None)
            decided = now <= LARGE * before
            words = (
                "the model describes the drive as it did" if decided else "not decided whether the model has changed"
            )
            text = f"{RESIDUAL}: {now / before:.3g} times that of the baseline; {words}"
        first = self._first(change)
        return Watched(RESIDUAL, "", tuple(self.logs), change, first, level, before, now, False, decided, text)

    def _first(self, change: Change) -> int | None:
        return None if change.alarm is None or change.begins is None else self.logs[change.begins[0]]

    def _since(self, change: Change) -> str:
        assert change.begins is not None
        assert change.alarm is not None
        at, low, high = (self.estimates[self.logs[k]].log for k in change.begins)
        kind, between = "changed" if change.ramp == 1 else "drifts", "" if low == high else f"{low} to {high}, "
        return f"{kind} since {at} ({between}seen with {self.estimates[self.logs[change.alarm]].log})"


def _variances(values: np.ndarray, deviations: np.ndarray, count: int) -> np.ndarray:
    """Relative variances: the variances of the logs, and the variance of their values beyond them (DerSimonian and Laird 1986)."""
    s2 = deviations**2
    if not np.all(s2 > 0.0):
        return np.ones(len(values))
    w = 1.0 / s2[:count]
    mean = np.average(values[:count], weights=w)
    beyond = float(np.sum(w * (values[:count] - mean) ** 2)) - (count - 1)
    between = max(0.0, beyond / float(w.sum() - np.sum(w**2) / w.sum()))
    found = s2 + between
    return np.asarray(found / np.median(found[:count]))


def _against_limits(name: str, p: FreeParameter, watch: Watch, levels: list[Interval]) -> tuple[bool | None, str]:
    """(whether the present value is beyond a limit, words on it).

    Within needs the whole interval within; beyond needs it beyond at the last two logs, so that one bad log makes no alarm.
    """
    states: list[bool | None] = []
    words = ""
    for end, sign, side in (("min", -1.0, "least"), ("max", 1.0, "largest")):
        limit = in_unit(getattr(watch, end), p.unit, f"monitor.watch.{name}.{end}")
        if limit is None:
            continue
        past = [sign * ((i.low if sign > 0.0 else i.high) - limit) > 0.0 for i in levels]
        inside = sign * ((levels[0].high if sign > 0.0 else levels[0].low) - limit) < 0.0
        shown = f"the {side} permitted value {p.shown(limit)}{f' {printed(p.unit)}' if p.unit else ''}"
        if len(past) == CONFIRMED and all(past):
            states.append(True)
            words += f"; beyond {shown}"
        elif inside:
            states.append(False)
            words += f"; {'above' if sign < 0.0 else 'below'} {shown}"
        else:
            states.append(None)
            one = f": one log is, {CONFIRMED} in a row are needed" if past[0] else ""
            words += f"; not decided whether beyond {shown}{one}"
    beyond = True if True in states else None if None in states else False
    return beyond, words
