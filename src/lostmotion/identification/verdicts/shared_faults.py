"""Faults that several logs share: what these logs have in common, and the limit or filter of an input that would explain them.

A delay, an offset or a wrong rate of the clock in one log is a fault of its record. In several logs of one kind it is rather
an effect that the model lacks. For example, a firmware that limits the rate of its goal shows as a delay of the logs with
large steps. Such logs stay in the fit.
"""

import copy
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..prepared_log import Prepared
from ..rig.residuals import Engine, ParameterPoint
from ..rig.rig_scenario import Rig
from .disagreeing_logs import OddLog

FEW = 2  # logs that share a fault
ALONE = 3  # logs, from which on a fault is shared even if nothing else tells these logs from the others
KIND = 0.75  # F-score of a property, from which on it tells logs from the others
CHANCE = (
    0.01  # probability that logs which are drawn at random are all of a few kinds, below which these tell something
)
MANY = 12  # values of a key of the header, up to which each is a kind of log
TRIED = 12  # logs with which candidates are tried
GRID = 10  # values of a candidate
BETTER = 0.6  # of the residuals, up to which a candidate is proposed
MODEL = (" ms late", " ms early", "clock runs", "has an offset")  # faults that a model which lacks something shows, too


@dataclass(frozen=True)
class SharedFault:
    """A fault of several logs, taken to be the model's."""

    logs: tuple[str, ...]  #: names
    total: int  #: number of all logs
    fault: str  #: the fault, with the range of its size
    common: str  #: property that tells these logs from the others; empty if nothing does
    candidate: str  #: limit or filter of an input that explains them; empty if none does

    @property
    def text(self) -> str:
        """One sentence."""
        names = ", ".join(self.logs[:3]) + (f" and {len(self.logs) - 3} more" if len(self.logs) > 3 else "")
        common = (
            f"in common: {self.common}"
            if self.common
            else "nothing in their headers or inputs tells them from the others"
        )
        candidate = f"; candidate: {self.candidate}" if self.candidate else ""
        rest = "a fault that logs share is the model's, so that they stay in the fit"
        return f"{len(self.logs)} of {self.total} logs ({names}): {self.fault}; {common}; {rest}{candidate}"


@dataclass(frozen=True)
class KindError:
    """Error of the logs of one kind, by a key of the header."""

    key: str
    value: str
    logs: int
    mae: float  #: mean absolute error of the first measured channel, SI
    odd: int  #: logs among them that disagree with the others


def family(fault: str) -> str:
    """Kind of a fault that may be the model's; ``unexplained`` of a log that no fault explains; empty of a fault of the record."""
    return next((words for words in MODEL if words in fault), "") if fault else "unexplained"


def shared_faults(
    engine: Engine, logs: Sequence[Prepared], odd: Sequence[OddLog], point: ParameterPoint, rung: int
) -> list[SharedFault]:
    """Faults of the model's kind that several logs share.

    logs: all logs, with the logs that disagree with the others.
    point: values with which candidates are tried.
    """
    found = []
    of_family: dict[str, list[OddLog]] = {}
    for o in odd:
        if name := family(o.fault):
            of_family.setdefault(name, []).append(o)
    facts = {log.name: _facts(engine.rig, log) for log in logs}
    for members in of_family.values():
        names = tuple(o.log for o in members)
        if len(names) < FEW:
            continue
        common, score = _common(facts, set(names))
        if len(names) < ALONE and score < KIND:
            continue
        own = [log for log in logs if log.name in names]
        rest = [log for log in logs if log.name not in names]
        candidate = _candidate(engine, own, rest, point, rung)
        common = common if score >= KIND else _kinds_of(facts, set(names))
        found.append(SharedFault(names, len(logs), _ranged(members), common, candidate))
    return found


def kinds(logs: Sequence[Prepared], errors: dict[str, float], odd: Sequence[OddLog]) -> list[KindError]:
    """Mean absolute errors by the values of each key of the header that takes a few.

    errors: mean absolute error of the first channel by log.
    """
    names = {o.log for o in odd}
    able = [log for log in logs if math.isfinite(errors.get(log.name, math.nan))]
    found = []
    for key in dict.fromkeys(k for log in able for k in _header(log)):
        values: dict[str, list[str]] = {}
        for log in able:
            if key in log.facts:
                values.setdefault(_shown(log.facts[key]), []).append(log.name)
        if 1 < len(values) <= min(MANY, len(able) - 1):
            for value, own in values.items():
                mean = float(np.mean([errors[n] for n in own]))
                found.append(KindError(key, value, len(own), mean, len(names & set(own))))
    return found


def _header(log: Prepared) -> list[str]:
    """Keys that tell kinds of logs."""
    own = [key for key, value in log.log.header.items() if isinstance(value, int | float | str)]
    return [*own, *(["folder"] if "folder" in log.facts and "folder" not in own else [])]


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _facts(rig: Rig, log: Prepared) -> dict[str, Any]:
    """Properties of a log: its header, and the sizes of its inputs."""
    found = {key: log.facts[key] for key in _header(log)}
    for name, x in log.inputs.items():
        channel = rig.task.inputs[name].channel
        if np.isfinite(x).all():
            found[f"largest step of {channel}"] = float(np.max(np.abs(np.diff(x)), initial=0.0))
            found[f"largest {channel}"] = float(np.max(np.abs(x)))
    return found


def _common(facts: dict[str, dict[str, Any]], names: set[str]) -> tuple[str, float]:
    """(property, or two of them, that tells logs best from the others, its F-score)."""
    single = [_scored(facts, names, *condition) for condition in _conditions(facts, names)]
    pairs = [
        _scored(facts, names, f"{a[0]} and {b[0]}", _both(a[1], b[1]))
        for a, b in combinations(sorted(single, key=lambda s: -s[2])[:6], 2)
    ]
    best = max(single, key=lambda s: s[2], default=None)
    both = max(pairs, key=lambda s: s[2], default=None)
    if both is not None and best is not None and both[2] > best[2] + 0.05:
        best = both
    if best is None:
        return "", 0.0
    such = [name for name, f in facts.items() if best[1](f)]
    return f"{best[0]} ({len(names & set(such))} of {len(such)} such logs)", best[2]


def _kinds_of(facts: dict[str, dict[str, Any]], names: set[str]) -> str:
    """Values of a key that all of some logs have, and at most half of all logs; empty if there are none, or by chance.

    Such logs are of few kinds, though not all logs of these kinds have the fault.
    """
    found = []
    for key in dict.fromkeys(k for f in facts.values() for k in f):
        own = [facts[n].get(key) for n in names]
        several = len({repr(f.get(key)) for f in facts.values()}) <= MANY and not key.startswith("largest ")
        such = [n for n, f in facts.items() if f.get(key) in own]
        if several and None not in own and (len(such) / len(facts)) ** len(names) < CHANCE:
            values = " or ".join(sorted({_shown(value) for value in own}))
            found.append((len(such), f"{key} = {values} ({len(names)} of {len(such)} such logs)"))
    return min(found, default=(0, ""))[1]


Test = Callable[[dict[str, Any]], bool]


def _conditions(facts: dict[str, dict[str, Any]], names: set[str]) -> Iterator[tuple[str, Test]]:
    """Values and thresholds by which logs may differ."""
    for key in dict.fromkeys(k for f in facts.values() for k in f):
        own = [facts[n][key] for n in names if key in facts[n]]
        every = {repr(f[key]) for f in facts.values() if key in f}
        if len(every) < 2 or not own:
            continue
        if len(every) <= MANY and not key.startswith("largest "):
            for value in dict.fromkeys(own):
                yield f"{key} = {_shown(value)}", _is(key, value)
        if all(isinstance(value, int | float) for value in own):
            few = len(own) // 4 + 1
            for low in sorted(set(own))[:few]:
                yield f"{key} of {_shown(low)} or more", _within(key, low, math.inf)
            for high in sorted(set(own), reverse=True)[:few]:
                yield f"{key} of {_shown(high)} or less", _within(key, -math.inf, high)


def _is(key: str, value: Any) -> Test:
    return lambda f: bool(f.get(key) == value)


def _both(a: Test, b: Test) -> Test:
    return lambda f: a(f) and b(f)


def _within(key: str, low: float, high: float) -> Test:
    return lambda f: isinstance(f.get(key), int | float) and low <= f[key] <= high


def _scored(facts: dict[str, dict[str, Any]], names: set[str], words: str, test: Test) -> tuple[str, Test, float]:
    such = {name for name, f in facts.items() if test(f)}
    return words, test, 2.0 * len(such & names) / max(1, len(such) + len(names))


def _ranged(members: Sequence[OddLog]) -> str:
    """The fault of all, with the range of its sizes."""
    if not members[0].fault:
        low, high = min(o.ratio for o in members), max(o.ratio for o in members)
        return f"residuals are {low:.3g} to {high:.3g} times those of the other logs, and no fault of a record explains them"
    first = members[0].fault.partition(", or ")[0]
    number = next((word for word in first.split() if _is_number(word)), "")
    sizes = sorted(float(w) for o in members for w in o.fault.partition(", or ")[0].split() if _is_number(w))
    return first.replace(number, f"{sizes[0]:g} to {sizes[-1]:g}", 1) if number and sizes[0] < sizes[-1] else first


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _candidate(
    engine: Engine, own: Sequence[Prepared], rest: Sequence[Prepared], point: ParameterPoint, rung: int
) -> str:
    """Limit of the rate, or filter, of an input that makes the residuals of some logs far smaller and no others larger."""
    rig, some, others = engine.rig, own[:TRIED], rest[:TRIED]
    best: tuple[float, str] = (BETTER, "")
    before, before_others = (_size(engine, x, point, rung) for x in (some, others))
    if not before > 0.0:
        return ""
    for name, key, values in _grids(rig, some):

        def size_with(value: float, logs: Sequence[Prepared], name: str = name, key: str = key) -> float:
            return _size(Engine(_with(rig, name, key, value), engine.threads), logs, point, rung)

        near = min(values, key=lambda value: size_with(value, some))
        size, value = min((size_with(x, some), x) for x in (near, *(near * np.geomspace(0.7, 1.4, 7)).tolist()))
        if size / before < best[0] and (not others or size_with(value, others) <= 1.5 * before_others):
            unit = "s" if key == "filter_time" else f"{rig.units.get(name, '')}/s".replace("rad/s/s", "rad/s^2")
            words = f"inputs.{name}.{key} near {value:.3g} {unit}, with which their residuals are {size / before:.2g} of what they are"
            best = size / before, words
    return best[1]


def _grids(rig: Rig, logs: Sequence[Prepared]) -> Iterator[tuple[str, str, list[float]]]:
    """Candidates: (input, key, values)."""
    interval = float(np.median([log.log.interval for log in logs]))
    for name, entry in rig.task.inputs.items():
        heights = [float(np.ptp(log.inputs[name])) for log in logs]
        height, duration = float(np.median(heights)), float(np.median([log.log.duration for log in logs]))
        if height > 0.0 and not name.endswith("_given_speed"):
            if entry.rate_limit is None:
                yield name, "rate_limit", np.geomspace(2.0 * height / duration, height / interval, GRID).tolist()
            if entry.filter_time == 0.0:
                yield name, "filter_time", np.geomspace(interval, duration / 10.0, GRID).tolist()


def _with(rig: Rig, name: str, key: str, value: float) -> Rig:
    other = copy.copy(rig)
    inputs = {**rig.task.inputs, name: rig.task.inputs[name].model_copy(update={key: value})}
    other.task = rig.task.model_copy(update={"inputs": inputs})
    return other


def _size(engine: Engine, logs: Sequence[Prepared], point: ParameterPoint, rung: int) -> float:
    """Median of the root mean squares of logs."""
    if not logs:
        return 0.0
    logs = [replace(log, cache={}) for log in logs]
    sizes = [
        math.sqrt(float(np.mean((r / log.weight) ** 2)))
        for log, r in zip(logs, engine.residuals(logs, point, rung), strict=True)
    ]
    return float(np.nan_to_num(np.median(sizes), nan=math.inf))
