"""The measured motion of a rig: which shaft a log shows, its angle, and its derivatives by local cubics."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..control.axis import turns
from ..errors import InputError
from .engine import Point
from .formulas import names_in
from .measuring import numbers_of
from .prepare import Prepared, Segment
from .rig import Rig
from .task import FormulaText

LEAST = 5  # samples of a cubic


@dataclass(frozen=True)
class Position:
    """A measured channel that shows the angle of a shaft."""

    channel: str
    shaft: str


def position_of(rig: Rig) -> Position:
    """The first measured channel that shows an angle.

    Raises
    ------
    InputError
        None does.
    """
    for name, m in rig.task.measured.items():
        train = rig.scenario.train()
        shaft = next((s for s in train.shafts if train.angle_of(s) == m.variable), None)
        if shaft is not None and m.filter_time == 0.0:
            return Position(name, shaft)
    raise InputError("no measured channel is the angle of a shaft without a filter")


def measured_course(rig: Rig, log: Prepared, channel: str, known: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(instants [s], values SI) of the variable that a channel shows, NaN where it has none: without its scale, offset and delay."""
    numbers = numbers_of(rig.task.measured[channel], known)
    return log.time - numbers["delay"], (log.measured[channel] - numbers["offset"]) / numbers["scale"]


def names_of_channel(rig: Rig, channel: str) -> frozenset[str]:
    """What the scale, the offset and the delay of a measured channel name."""
    m = rig.task.measured[channel]
    return names_in(m.scale) | names_in(m.offset) | names_in(m.delay)


def windows(rig: Rig, logs: Sequence[Prepared], point: Point, rung: int, length: float) -> list[Prepared]:
    """Logs in windows, each run of which begins at the angle and the speed that were measured there.

    Parameters
    ----------
    length
        Of a window [s].

    Raises
    ------
    InputError
        The state of the rig is not that of a measured angle, or a window has too few samples.
    """
    try:
        position = position_of(rig)
    except InputError as problem:
        raise InputError(
            f"key fit.horizon: {problem}, and windows begin at a measured angle; leave fit.horizon out"
        ) from None
    return [_in_windows(rig, log, point, rung, length, position) for log in logs]


def _in_windows(rig: Rig, log: Prepared, point: Point, rung: int, length: float, position: Position) -> Prepared:
    known = {**log.facts, **point.of(log)}
    built = rig.built(rig.changes(known, rung, log.segments[0].phase))
    scenario = built.scenario
    if scenario.axes() or built.remembers or scenario.clutches or scenario.freewheels or scenario.dampers:
        raise InputError(
            "key fit.horizon: the rig has a controller with states of its own, a clutch or a damper, whose state no angle shows; "
            "leave fit.horizon out"
        )
    time, angle = measured_course(rig, log, position.channel, known)
    starts = np.unique(np.searchsorted(log.time, np.arange(0.0, log.time[-1], length)))
    starts = starts[len(log.time) - starts >= LEAST]
    if length < LEAST * log.log.interval:
        raise InputError(
            f"key fit.horizon: {length:g} s has fewer than {LEAST} samples of {log.name}; give longer ones"
        )
    train = scenario.train()
    ratios = {s: turns(train, s, position.shaft) for s in train.shafts}
    begins: dict[int, dict[str, FormulaText]] = {}
    for k in starts[1:]:
        x, v = _cubic(time, angle, int(k), max(2, round(length / log.log.interval / 8)))
        if np.isnan(v):
            continue
        begins[int(k)] = {scenario.initial_key("speeds", s): n * v for s, n in ratios.items() if n is not None}
        begins[int(k)][scenario.initial_key("angles", position.shaft)] = x
    segments = []
    for segment in log.segments:
        edges = [segment.begin, *(k for k in begins if segment.begin < k < segment.end), segment.end]
        segments += [Segment(a, b, segment.phase, begins.get(a, segment.initial)) for a, b in itertools.pairwise(edges)]
    return replace(log, segments=tuple(segments), cache={})


def _cubic(time: np.ndarray, x: np.ndarray, k: int, half: int) -> tuple[float, float]:
    """Value and slope at a sample by the cubic of least squares through those beside it; NaN where they are too few."""
    near = np.arange(max(0, k - half), min(len(x), k + half + 1))
    near = near[np.isfinite(x[near])]
    if len(near) < LEAST:
        return np.nan, np.nan
    *_, slope, value = np.polyfit(time[near] - time[k], x[near], 3)
    return float(value), float(slope)
