"""The measured motion of a rig: which shaft a log shows, its angle or speed, and the derivatives by local cubics."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...model.shaft_ratio import turns
from ...model.train import DriveTrain
from ..prepared_log import Prepared, Segment
from ..task.file_formulas import names_in
from ..task.identification_file import FormulaText
from .measured_motion_input import refuse_given_motion
from .measurement_model import numbers_of
from .residuals import ParameterPoint
from .rig_scenario import Rig

LEAST = 5  # samples of a cubic


@dataclass(frozen=True)
class ShownMotion:
    """A measured channel that shows the motion of a shaft."""

    channel: str
    shaft: str
    is_speed: bool  # whether it shows the speed; else the angle


def shown_motion(rig: Rig) -> ShownMotion:
    """The first measured channel that shows an angle, or if none does and no torque depends on the angle, a speed."""
    refuse_given_motion(rig.scenario)
    train = rig.scenario.train()
    plain = {name: m.variable for name, m in rig.task.measured.items() if m.filter_time == 0.0}
    by_variable = {train.variable(s, "angle"): s for s in train.shafts}
    for name, variable in plain.items():
        if variable in by_variable:
            return ShownMotion(name, by_variable[variable], is_speed=False)
    by_speed = {train.variable(s, "speed"): s for s in train.shafts}
    for name, variable in plain.items():
        if variable in by_speed and not depends_on_angle(train):
            return ShownMotion(name, by_speed[variable], is_speed=True)
    if any(variable in by_speed for variable in plain.values()):
        raise InputError("no measured channel shows the angle of a shaft without a filter, on which torques depend")
    raise InputError("no measured channel is the angle or the speed of a shaft without a filter")


def depends_on_angle(train: DriveTrain) -> bool:
    """Whether a torque of a train depends on an angle."""
    stopped = any(shaft.end_stops is not None for shaft in train.shafts.values())
    by_angle = any(hasattr(element, "over_angle") for _, element in train.on_shafts())
    gears = train.gears.values()
    return (
        stopped
        or by_angle
        or any(gear.transmission_error is not None or gear.mesh_stiffness is not None for gear in gears)
    )


def measured_course(rig: Rig, log: Prepared, channel: str, known: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(instants [s], values SI) of the variable that a channel shows, NaN where it has none: without its scale, offset and delay."""
    numbers = numbers_of(rig.task.measured[channel], known)
    return log.time - numbers["delay"], (log.measured[channel] - numbers["offset"]) / numbers["scale"]


def names_of_channel(rig: Rig, channel: str) -> frozenset[str]:
    """Names in the scale, the offset and the delay of a measured channel."""
    m = rig.task.measured[channel]
    return names_in([m.scale, m.offset, m.delay])


def windows(rig: Rig, logs: Sequence[Prepared], point: ParameterPoint, rung: int, length: float) -> list[Prepared]:
    """Logs in windows. Each run begins at the angle and the speed that were measured there, or at the speed alone.

    length: of a window [s].
    """
    try:
        shown = shown_motion(rig)
    except InputError as problem:
        raise InputError(
            f"{problem}, and windows begin at a measured state; leave fit.horizon out", "fit.horizon"
        ) from None
    return [_in_windows(rig, log, point, rung, length, shown) for log in logs]


def _in_windows(
    rig: Rig, log: Prepared, point: ParameterPoint, rung: int, length: float, shown: ShownMotion
) -> Prepared:
    known = {**log.facts, **point.of(log)}
    built = rig.built(rig.changes(known, rung, log.segments[0].phase))
    scenario = built.scenario
    if scenario.axes() or built.remembers or any(scenario.train().couplings()):
        raise InputError(
            "the rig has a controller with states of its own, a clutch or a damper, whose state no channel shows; "
            "leave fit.horizon out",
            "fit.horizon",
        )
    time, course = measured_course(rig, log, shown.channel, known)
    starts = np.unique(np.searchsorted(log.time, np.arange(0.0, log.time[-1], length)))
    starts = starts[len(log.time) - starts >= LEAST]
    if length < LEAST * log.log.interval:
        raise InputError(f"{length:g} s has fewer than {LEAST} samples of {log.name}; give longer ones", "fit.horizon")
    train = scenario.train()
    ratios = {s: turns(train, s, shown.shaft) for s in train.shafts}
    begins: dict[int, dict[str, FormulaText]] = {}
    for k in starts[1:]:
        x, slope = _cubic(time, course, int(k), max(2, round(length / log.log.interval / 8)))
        if np.isnan(slope):
            continue
        v = x if shown.is_speed else slope
        begins[int(k)] = {scenario.initial_key("speeds", s): n * v for s, n in ratios.items() if n is not None}
        if not shown.is_speed:
            begins[int(k)][scenario.initial_key("angles", shown.shaft)] = x
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
