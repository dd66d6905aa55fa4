"""Nearest misses: candidates that almost fit, what each lacks, and how much slower the cycle would have to be."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...control.references import PositionReference
from ...errors import InputError
from ...sizing.axis_task.axis_task import AxisTask, reference_of
from ...sizing.axis_task.mass_and_price import CHOICE
from ...units.practical import excess, told_apart
from ..runs.candidate_rows import Axes
from ..study.drive_check_columns import NO_DATA, UNSTABLE
from ..study.study_definition import Study
from .ranking import WINDOW, RankedCandidate

SLOWEST = 10.0  # times as long as the cycle of the task, the longest that is tried
STEPS = 12  # halvings: what the factor is beyond 1 is found to 0.4 % of itself
NUMBER = re.compile(r"\d[\d.]*(e[+-]?\d+)?")  # in a text
FITS = "fits if"  # begins what is said of a cycle that fits
AT_ANY_TIME = (*CHOICE, "inertia_ratio", "lost_motion", "output_bearing", "holding_brake", "amplifier_voltage")
"""limits of what does not depend on the time of the cycle"""
TRIES = (1.02, 1.05, 1.1, 1.2, 1.5, 2.0, 3.0)  # factors for a candidate whose run violates a limit
NEAR = (0.5, 1.0, 2.0, 5.0)  # times the share by which it is violated: the first factors for one that is nearly kept
LEAST = 1e-5  # by which a longer cycle is longer


@dataclass(frozen=True)
class Miss:
    """A candidate that does not fit, with what it lacks."""

    candidate: RankedCandidate
    lacks: dict[str, float]  # by rule or column: by how much its limit is exceeded, as a share of the limit
    slower: float | None
    """a cycle so many times as long passes the rules, by evaluation; None: none up to `SLOWEST` does, or it was not tried"""
    then: str = ""  # result of the rules and the run for that cycle

    @property
    def worst(self) -> float:
        """The largest of what it lacks."""
        return max(self.lacks.values(), default=math.inf)

    def __str__(self) -> str:
        short = ", ".join(f"{name} {excess(x)} over its limit" for name, x in self.lacks.items())
        if short and self.candidate.why.startswith(UNSTABLE):
            short = f"{UNSTABLE}, with {short}"
        return f"{short or self.candidate.why}{'; ' if self.then else ''}{self.then}"


def misses(study: Study, ranked: list[RankedCandidate], count: int) -> list[Miss]:
    """Find the candidates of a task that come nearest to fitting, the nearest first: the largest excess over a limit ranks them.

    study: the task.
    ranked: from `candidates`.
    count: how many of them; for these a slower cycle is sought, and tried by rules and run.
    """
    found = [Miss(c, lacks, None) for c in ranked if not c.fits and (lacks := _lacks(c))]
    found.sort(key=lambda miss: (miss.worst, miss.candidate.run))
    return [_tried(study, miss) for miss in found[:count]]


def _lacks(candidate: RankedCandidate) -> dict[str, float]:
    """Excess of each exceeded limit; empty if one of these is not a number."""
    never = WINDOW in candidate.over
    limits = [WINDOW if never and limit == "settling_time" else limit for limit in candidate.violated]
    return {x: candidate.over[x] for x in limits} if all(x in candidate.over for x in limits) else {}


def slowed(study: Study, factor: float) -> Study:
    """The task with a cycle that takes so many times as long: moves, rests, payloads and process alike.

    Its loads over time are stretched; torques of a process and of the load keep their values.
    """
    task, base = study.axis, study.scenario
    assert task is not None
    assert base.controller is not None
    reference = _slowed_reference(reference_of(base), factor)
    torque = _slowed_signal(base.load.torque, factor)
    step = base.controller.sample_time
    changes = {
        "cycle": step * math.ceil(factor * task.cycle / step * (1.0 - 1e-12)),  # a whole number of sample times
        "payload": tuple(p.model_copy(update={"begin": factor * p.begin, "end": factor * p.end}) for p in task.payload),
        "process": tuple(
            p if p.times is None else p.model_copy(update={"times": tuple(factor * t for t in p.times)})
            for p in task.process
        ),
    }
    new: AxisTask = task.model_copy(update=changes)
    scenario = base.model_copy(
        update={
            "controller": base.controller.model_copy(update={"reference": reference}),
            "load": base.load.model_copy(update={"torque": torque}),
        }
    )
    out = study.model_copy(update={"axis": new, "scenario": scenario})
    out._kept = {
        key: part for key, part in study.kept.items() if key[0] in ("gearbox", "motor", "screw", "rack", "belt")
    }
    return out


def _slowed_reference(reference: PositionReference, factor: float) -> PositionReference:
    if reference.target is not None:
        raise InputError("controller.reference.target: cannot be stretched")
    rates = {"speed": 1, "acceleration": 2, "jerk": 3, "dwell": -1, "begin": -1}

    def scaled(part: Any) -> dict[str, Any]:
        values = ((key, power, getattr(part, key, None)) for key, power in rates.items())
        return {key: value / factor**power for key, power, value in values if value is not None}

    moves = tuple(move.model_copy(update=scaled(move)) for move in reference.moves)
    own = scaled(reference) if reference.moves else {}
    found: PositionReference = _slowed_signal(reference.model_copy(update={**own, "moves": moves}), factor)
    return found


def _slowed_signal(signal: Any, factor: float) -> Any:
    """A signal over time whose instants are so many times as late."""
    changes: dict[str, Any] = {}
    if signal.frequency is not None:
        changes["frequency"] = signal.frequency / factor
    changes["sines"] = tuple(s.model_copy(update={"frequency": s.frequency / factor}) for s in signal.sines)
    if signal.samples is not None:
        times = tuple(factor * t for t in signal.samples.times)
        changes["samples"] = signal.samples.model_copy(update={"times": times})
    return signal.model_copy(update=changes)


def _tried(study: Study, miss: Miss) -> Miss:
    """The miss with the least factor by which the cycle has to be longer, if there is one, and the findings of rules and run with it."""
    if same := dict.fromkeys("its parts" if limit in CHOICE else limit for limit in miss.lacks if limit in AT_ANY_TIME):
        return replace(miss, then=f"a slower cycle does not change {', '.join(same)}")
    try:
        study, row = study.at(study.parameters(miss.candidate.run, miss.candidate.run + 1)[0])
        if miss.candidate.ran:
            return _run_slower(study, miss, row)
        factor = least_factor(study, row)
        if factor is None:
            return replace(miss, then=f"no cycle up to {SLOWEST:g} times as long passes the rules")
        said = _said(study, slowed(study, factor), row, factor)
        by_rules = replace(miss, slower=factor, then=said)
        slower = by_rules if said.startswith(FITS) else _run_slower(study, miss, row, factor)
        return by_rules if slower.slower is None else slower
    except (InputError, RuntimeError) as error:
        return replace(miss, then=f"a slower cycle was not tried: {error}")


def _run_slower(study: Study, miss: Miss, row: np.ndarray, least: float = 1.0) -> Miss:
    """The miss with the first of some factors above the `least` whose run fits: errors of runs need not fall steadily
    with the time, so that none is sought between."""
    near = (
        [1.0 + share * miss.worst for share in NEAR if share * miss.worst < TRIES[0] - 1.0]
        if miss.candidate.ran
        else []
    )
    for factor in (_rounded_up(least * share) for share in (*near, *TRIES)):
        slower = slowed(study, factor)
        if Axes(slower).refused(row) is None and (said := _said(study, slower, row, factor)).startswith(FITS):
            return replace(miss, slower=factor, then=said)
    return replace(
        miss, then=f"its run violates a limit in all cycles tried, up to {least * TRIES[-1]:.3g} times as long"
    )


def least_factor(study: Study, row: np.ndarray) -> float | None:
    """The least factor by which the cycle has to be longer, so that the rules pass; None if none up to `SLOWEST` does.

    Its excess over 1 has two digits.
    """

    def passes(factor: float) -> bool:
        return Axes(slowed(study, factor)).refused(row) is None

    if not passes(SLOWEST):
        return None
    low, high = LEAST, SLOWEST - 1.0  # beyond 1
    for _ in range(STEPS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if passes(1.0 + middle) else (middle, high)
    factor = _rounded_up(1.0 + high)
    return factor if passes(factor) else 1.0 + high


def _rounded_up(factor: float) -> float:
    """A factor whose part beyond 1 has two digits, hundredths at most."""
    digits = max(2, 1 - math.floor(math.log10(factor - 1.0)))
    return 1.0 + math.ceil(10.0**digits * (factor - 1.0) * (1.0 - 1e-9)) / 10.0**digits


def _said(study: Study, slower: Study, row: np.ndarray, factor: float) -> str:
    """Result of the rules and the run of the slower cycle, with the times of cycle and longest move."""
    before, after = study.axis, slower.axis
    assert before is not None
    assert after is not None
    moves = reference_of(study.scenario).intervals()
    longest = max((b - a for a, b in moves), default=0.0)
    slow, now = told_apart(factor * longest, longest)
    what = f", its longest move {slow} s instead of {now} s" if longest else ""
    slow, now = told_apart(after.cycle, before.cycle)
    times = f"the cycle takes {slow} s instead of {now} s{what}"
    axes = Axes(slower)
    measured = axes.measured(row)[0]
    if over := axes.over(measured):
        unstable = f"{UNSTABLE}, and " if str(measured["why"]).startswith(UNSTABLE) else ""
        return f"keeps the rules if {times}, but {unstable}its run then violates {', '.join(over)}"
    return f"{FITS} {times}"


@dataclass(frozen=True)
class Lacking:
    """Candidates that cannot be judged, by the reason; its numbers are those of the first candidate."""

    datum: str
    candidates: tuple[str, ...]


def not_judged(ranked: list[RankedCandidate]) -> list[Lacking]:
    """Data that records lack for a run, with the candidates that this concerns."""
    return _by_datum(c for c in ranked if NO_DATA in c.violated)


def rules_not_judged(ranked: list[RankedCandidate]) -> list[Lacking]:
    """The rules that are not judged, grouped by the datum that is missing, with the candidates that this concerns."""
    return _by_datum(c for c in ranked if NO_DATA not in c.violated)


def _by_datum(found: Iterable[RankedCandidate]) -> list[Lacking]:
    groups: dict[
        str, tuple[str, list[str]]
    ] = {}  # by the text without its numbers, which differ from candidate to candidate
    for c in found:
        for text in c.missing:
            groups.setdefault(NUMBER.sub("", text), (text, []))[1].append(c.name)
    return [Lacking(text, tuple(names)) for text, names in sorted(groups.values(), key=lambda pair: -len(pair[1]))]
