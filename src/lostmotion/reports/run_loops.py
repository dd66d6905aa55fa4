"""Loops of a run: true and measured following error, overshoot, and whether the error swings at the end."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..model.shaft_ratio import turns
from ..servo.hunting.hunting_decision import moving_input, rises_of
from ..simulation.runs.results import RunArrays
from ..simulation.scenario.scenario import Scenario
from ..units.practical import practical
from ..verdict import Point

if TYPE_CHECKING:
    import xarray

PARTS = 4  # of the time in which the reference is at rest
SWINGS = 2  # periods at least in the last half of that time
GROWS = 1.2  # from one part to the next, at least, of a swing that grows
LASTS = 0.75  # the same of one that does not die out
SEEN = 0.001  # of the range of the reference: the least swing that is reported
DEGREES = 0.1  # [rad], from which on an angle is in degrees
REST = 0.1  # of the run: the least time at rest that is looked at
BEYOND = "left the range"  # of numbers, in the error of a run
DIVERGES = 2.0  # from one part of a run to the next, at least, of an error that diverges


@dataclass(frozen=True)
class LoopErrors:
    """Errors of one controlled axis over a run."""

    name: str
    quantity: str  # position or speed
    shaft: str  # shaft of the reference
    unit: str
    true: np.ndarray  # reference less the true value at its shaft
    measured: np.ndarray | None
    """reference less the value that the loop reads, both at the shaft of the reference; None of a continuous controller, which reads
    the true value"""
    encoder: str  # shaft with the encoder that is read
    overshoot: float  # by which the true value leaves the range of its reference
    range: float  # range of the reference, from the first true value on
    swing: float  # half of what the error swings by at the end, if that does not die out; else 0
    frequency: float  # [Hz]
    grows: bool  # whether that swing grows, or the error diverges
    pole: str  # pole outside the unit circle of the sampled loops of the axis; empty if there is none, or none is known

    def lines(self) -> Iterator[str]:
        """Lines of a summary."""
        subject = f"{self.name.replace('_', ' ')} {self.quantity}".strip()
        yield f"{subject} error, true (reference less {self.shaft}): {_ends(self.true, self.unit)}"
        if self.measured is not None:
            ends = _ends(self.measured, self.unit)
            yield f"{subject} error, measured (reference less encoder on {self.encoder}): {ends}"
        if self.overshoot > SEEN * self.range:
            beyond = _shown(self.overshoot, self.unit, 4)
            yield f"{subject} leaves the range of its reference by {beyond}"

    def points(self) -> Iterator[Point]:
        """Answer to whether the loop is stable, if it is not, or if it swings. A swing that lasts by itself misses no requirement.

        The motor of an unstable axis may swing within its backlash, while friction holds what the error is of.
        """
        subject = f"the {self.quantity} error{f' of {self.name}' if self.name else ''}"
        if self.grows and self.swing == 0.0:
            yield Point("does not fit", f"unstable: {subject} diverges, up to {_shown(_peak(self.true), self.unit, 3)}")
        elif self.swing > 0.0:
            swing = f"±{_shown(self.swing, self.unit, 3)} at {self.frequency:.3g} Hz"
            unstable, how = self.grows or bool(self.pole), "grows" if self.grows else "does not die out"
            yield Point(
                "does not fit" if unstable else "fits with a reservation",
                f"{'unstable: ' if unstable else ''}{subject} swings by {swing} at the end, which {how}"
                f"{f'; {self.pole}' if self.pole else ''}",
            )
        elif self.pole:
            yield Point("does not fit", f"unstable: {f'{self.name}, ' if self.name else ''}{self.pole}")


def _shown(value: float, unit: str, digits: int) -> str:
    """A value with its unit: a large angle in degrees."""
    if unit == "rad" and abs(value) >= DEGREES:
        return f"{np.degrees(value):.{digits}g} deg"
    return practical(value, unit, digits)


def _ends(error: np.ndarray, unit: str) -> str:
    return f"at most {_shown(_peak(error), unit, 4)}, at the end {_shown(float(error[-1]), unit, 4)}"


def _peak(error: np.ndarray) -> float:
    return float(np.abs(error).max())


def loop_errors(result: xarray.Dataset | RunArrays) -> list[LoopErrors]:
    """Errors of all controlled axes of a run."""
    scenario = Scenario.from_json(result.attrs["scenario"])
    found = (_of_axis(result, scenario, motor) for motor in (*scenario.axes(), *scenario.continuous()))
    return [errors for errors in found if errors is not None]


def _of_axis(result: Any, scenario: Scenario, motor: str) -> LoopErrors | None:
    train, time = scenario.train(), np.asarray(result["time"])
    sampled = scenario.axes().get(motor)
    c: Any = sampled or scenario.continuous()[motor]
    shaft, kind = c.shaft or list(train.shafts)[-1], c.reference.kind
    value = train.variable(shaft, "angle") if kind == "position" else train.variable(shaft, "speed")
    prefix = scenario.prefix(motor)
    names = [
        train.variable(motor, x) for x in ((f"{kind}_reference", f"measured_{kind}") if sampled else ("reference",))
    ]
    if kind == "torque" or any(name not in result for name in (value, *names)):
        return None
    unit = train.angle_unit(shaft) if kind == "position" else train.speed_unit(shaft)
    actual = np.asarray(result[value])
    reference = c.reference.at(time)[0] if sampled else np.asarray(result[names[0]])
    own = train.motors[motor].shaft
    position, speed = getattr(c, "position_encoder", None), getattr(c, "encoder", None)
    encoder = (position if position is not None and kind == "position" else speed) if sampled else None
    read = (encoder.shaft if encoder is not None else None) or own
    error = reference - actual
    low, high = min(reference.min(), actual[0]), max(reference.max(), actual[0])
    begin = c.reference.duration if sampled else _last_change(time, reference)
    begin = max([begin, *(signal.breakpoint_list()[-1][0] for signal in scenario.signals().values())])
    swing, frequency, grows = _swings(time, error, begin, float(high - low))
    pole = _pole(scenario, motor) if sampled else ""
    if not grows and not pole and moving_input(scenario):
        swing = 0.0  # of the input, which never comes to rest
    measured = np.asarray(result[names[0]]) - np.asarray(result[names[1]]) if sampled else None
    if measured is not None and kind == "speed":
        measured = measured / (turns(train, own, shaft) or 1.0)
    return LoopErrors(
        motor if prefix or not sampled else "",
        kind,
        shaft,
        unit,
        error,
        measured,
        read,
        max(float(actual.max()) - high, low - float(actual.min()), 0.0),
        float(high - low),
        swing,
        frequency,
        grows,
        pole,
    )


def _pole(scenario: Scenario, motor: str) -> str:
    """Pole outside the unit circle of an axis in one of its regimes; empty where none is found."""
    from ..servo.linear_regimes import axis_of
    from ..servo.margins import unstable_pole

    try:
        return unstable_pole(axis_of(scenario, motor))
    except InputError:  # loops that are no axis of servo: the growth alone decides
        return ""


def unstable_loops(scenario: Scenario, error: Exception) -> str:
    """Why a run with sampled controllers left the range of numbers, by poles outside the unit circle; otherwise the error itself."""
    poles = "; ".join(filter(None, (_pole(scenario, motor) for motor in scenario.axes())))
    return f"unstable: {poles}" if poles and BEYOND in str(error) else str(error)


def _last_change(time: np.ndarray, reference: np.ndarray) -> float:
    changes = np.flatnonzero(np.diff(reference))
    return float(time[changes[-1] + 1]) if len(changes) else 0.0


def _swings(time: np.ndarray, error: np.ndarray, begin: float, size: float) -> tuple[float, float, bool]:
    """Half of what the error swings by at the end [SI], its frequency [Hz], and whether it grows; zeros if it dies out."""
    rests = time >= begin
    if time[-1] - begin < REST * time[-1] or rests.sum() < PARTS:
        return 0.0, 0.0, _diverges(error, size)
    late, value = time[rests], error[rests]
    swings = [float(np.ptp(part)) for part in np.array_split(value, PARTS)]
    half = len(value) // 2
    rises = rises_of(late[half:], value[half:])
    if len(rises) < SWINGS or 0.5 * swings[-1] <= SEEN * size or swings[-1] < LASTS * swings[-2]:
        return 0.0, 0.0, _diverges(error, size)
    frequency = (len(rises) - 1) / (rises[-1] - rises[0])
    grows = all(b > GROWS * a for a, b in itertools.pairwise(swings))
    return 0.5 * swings[-1], float(frequency), grows


def _diverges(error: np.ndarray, size: float) -> bool:
    """Whether the error of a reference that moves on grows from part to part, beyond all that is asked."""
    peaks = [_peak(part) for part in np.array_split(error, PARTS) if len(part)]
    return peaks[-1] > size and all(b > DIVERGES * a for a, b in itertools.pairwise(peaks))


def points_of(found: list[LoopErrors]) -> list[Point]:
    """Points of all loops that do not work."""
    return [point for errors in found for point in errors.points()]


def lines_of(found: list[LoopErrors]) -> list[str]:
    """Lines of a summary, failing loops first."""
    return [*(point.sentence for point in points_of(found)), *(line for errors in found for line in errors.lines())]
