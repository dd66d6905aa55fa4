"""Commands of motors, brakes and clutches; commands of steppers are made of the steps of a driver."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from ..inputs.part import Part, rule
from ..inputs.quantities import Frequency, Limit, Number, Positive, Time, Whole
from ..model.signals import Breakpoint, Samples, Signal, taylor
from ..recorded_numbers import real
from ..reproducible import sin
from .references import PositionReference, Reference, SlideReference

MAX_STEPS = 4_000_000  # microsteps of a run
HALVINGS = 60  # of an interval in which a microstep is: an instant to the last digit
MOST_MICROSTEPS = 4096
POINTS_PER_PERIOD = 32  # of a sine, between which it is taken to turn once at most

Side = Literal["left", "right"]


class Stepping(Part):
    """Driver of a stepper, which turns a position into steps.

    The field stands at a whole number of microsteps. The field advances by one microstep where the reference is half
    a microstep ahead, and starts where the rotor is at t = 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> stepping = lm.control.Stepping(reference={"moves": [{"to": "1 rad"}], "speed": 2.0, "acceleration": 10.0})
    >>> stepping.microsteps
    1
    """

    reference: PositionReference | None = None
    """angle of `shaft` over time, with the ramps of its moves"""
    travel: SlideReference | None = None
    """position of a slide over time, in place of `reference`"""
    pulses: Samples[Number] | None = None
    """log of a step/direction interface, in place of a reference: instants of the pulses, and the direction of each, 1 or -1"""
    shaft: str | None = None
    """shaft or slide of the reference; left out, the last one"""
    microsteps: Annotated[Whole, Field(ge=1, le=MOST_MICROSTEPS)] = 1
    """parts of a full step that the driver resolves"""
    table_error: Annotated[Number, Limit(ge=0.0, le=0.5)] = 0.0
    """largest error of the driver's sine table, as a share of a full step: a sine over each full step"""
    max_step_rate: Annotated[Frequency, Positive] | None = None
    """microsteps a second that the driver can give; a reference that asks for more is refused"""
    standstill_delay: Annotated[Time, Positive] = 0.1
    """time after the last microstep after which the current falls to the motor's `standstill_current`"""

    @rule
    def _has_one_source(self) -> Iterator[str]:
        given = [key for key in ("reference", "travel", "pulses") if getattr(self, key) is not None]
        if len(given) != 1:
            yield f"has {' and '.join(given) or 'no reference'}; give one of reference, travel and pulses"
        if self.pulses is not None and any(abs(d) != 1.0 for d in self.pulses.values):
            yield "has pulses whose directions are not all 1 or -1; values are the direction of each pulse"

    def steps(self, turns: float, step: float, until: float) -> tuple[np.ndarray, np.ndarray]:
        """Instants [s] at which the field moves, and its number of microsteps from there on, from 0 at t = 0.

        Parameters
        ----------
        turns
            Turns of the motor to a turn of the reference; to one of a slide, radians to a metre.
        step
            A full step [rad].
        until
            End of the run [s].

        Raises
        ------
        ValueError
            There are too many, or they come faster than the driver can give them.
        """
        if self.pulses is not None:
            times, counts = np.array(self.pulses.times), np.cumsum(self.pulses.values)
        else:
            reference = self.reference if self.travel is None else self.travel
            assert reference is not None
            times, counts = _crossings(reference, turns / step * self.microsteps, until)
        if self.max_step_rate is not None and times.size > 1:
            apart = np.diff(times)
            fastest = int(np.argmin(apart))
            if apart[fastest] * self.max_step_rate < 1.0 - 1e-9:
                rate = math.inf if apart[fastest] == 0.0 else 1.0 / apart[fastest]
                raise ValueError(
                    f"asks for {rate:.4g} microsteps a second at {times[fastest]:.6g} s, more than max_step_rate, "
                    f"{self.max_step_rate:g} Hz; lower the speed or microsteps"
                )
        return times, counts

    def table(self, counts: np.ndarray) -> np.ndarray:
        """Positions of the field at numbers of microsteps, in full steps, with the error of the table."""
        exact: np.ndarray = counts / self.microsteps
        if self.table_error == 0.0:
            return exact
        within: np.ndarray = sin(2.0 * math.pi * (np.mod(counts, self.microsteps) / self.microsteps))
        return exact + self.table_error * within


class CommandSignal(Signal[Number]):
    """A command E_C over time: the sum of all that is given. That of a stepper is the angle of its field [rad].

    Examples
    --------
    >>> import lostmotion as lm
    >>> signal = lm.CommandSignal(mean=0.1, amplitude=0.5, frequency="2 Hz")
    >>> signal.mean
    0.1
    """

    stepping: Stepping | None = None
    """steps of the driver of a stepper, in place of all else"""

    @rule
    def _steps_alone(self) -> Iterator[str]:
        others = [key for key in self.model_fields_set - {"stepping"} if getattr(self, key) not in (None, 0.0, ())]
        if self.stepping is not None and others:
            yield f"has stepping and {sorted(others)[0]}, which both turn the field; leave one out"


class FieldAngle(Signal[Number]):
    """The angle of a stepper's field [rad], as its driver turns it."""

    stepping: Stepping
    turns: float  #: of the motor, to one of the reference
    step: float  #: full step [rad]
    start: float  #: angle at t = 0 [rad]
    until: float  #: end of the run [s]

    def instants(self) -> tuple[np.ndarray, np.ndarray]:
        """Instants at which the field moves, and its number of microsteps from there on."""
        return _steps(self.stepping, self.turns, self.step, self.until)

    def breakpoint_list(self) -> list[Breakpoint]:
        times, counts = self.instants()
        turned = (self.step * self.stepping.table(counts)).tolist()
        start = real(self.start)  # number by number: it may be one that is recorded
        return _held(start, times, [start + angle for angle in turned])


class CurrentLevel(Signal[Number]):
    """Level of a stepper's current: 1 while it moves and for a delay after it; else 0."""

    field: FieldAngle

    def breakpoint_list(self) -> list[Breakpoint]:
        times, _ = self.field.instants()
        delay = self.field.stepping.standstill_delay
        rises = [t for before, t in itertools.pairwise([-math.inf, *times.tolist()]) if t > before + delay]
        falls = [t + delay for t, after in itertools.pairwise([*times.tolist(), math.inf]) if after > t + delay]
        points: list[Breakpoint] = [(0.0, 0.0, 0.0)] if not rises or rises[0] > 0.0 else []
        for rise, fall in zip(rises, falls, strict=True):
            points += [(rise, 1.0, 0.0), (fall, 0.0, 0.0)]
        return points


def _held(start: float, times: np.ndarray, values: list[float]) -> list[Breakpoint]:
    """Values that are held from their instants on; of several at one instant the last."""
    last = np.append(times[1:] > times[:-1], True) if times.size else np.zeros(0, bool)
    held = zip(times.tolist(), values, last, strict=True)
    points: list[Breakpoint] = [(t, v, 0.0) for t, v, keep in held if keep]
    return points if points and points[0][0] == 0.0 else [(0.0, start, 0.0), *points]


@lru_cache(maxsize=16)
def _steps(stepping: Stepping, turns: float, step: float, until: float) -> tuple[np.ndarray, np.ndarray]:
    return stepping.steps(turns, step, until)


def _crossings(reference: Reference[Any], scale: float, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants at which a reference, `scale` microsteps to its unit, has moved on by one more than half of one, and their number then."""
    grid = _monotone(reference, until)
    origin = scale * float(_value(reference, grid[:1])[0])

    def position(t: np.ndarray, side: Side = "right") -> np.ndarray:
        return scale * _value(reference, t, side) - origin

    begins, ends = position(grid[:-1]), position(grid[1:], "left")
    asked = float(np.sum(np.abs(ends - begins)))
    if asked > MAX_STEPS:
        raise ValueError(f"asks for {asked:.3g} microsteps, more than {MAX_STEPS}; shorten the run or lower microsteps")
    times, counts, current = [], [], 0
    for a, b, first, last in zip(grid[:-1], grid[1:], begins.tolist(), ends.tolist(), strict=True):
        for value, jumps in ((first, True), (last, False)):  # a reference may jump where an interval begins
            wanted = _passed(current, value)
            if wanted == current:
                continue
            way = 1 if wanted > current else -1
            passed = np.arange(current + way, wanted + way, way)
            times.append(np.full(passed.size, a) if jumps else _instants(position, a, b, passed - 0.5 * way, way))
            counts.append(passed)
            current = wanted
    if not times:
        return np.zeros(0), np.zeros(0)
    return np.concatenate(times), np.concatenate(counts).astype(float)


def _passed(current: int, value: float) -> int:
    """The whole number that is held at a value, which is left where it is half a unit away."""
    if value >= current + 0.5:
        return math.floor(value + 0.5)
    return math.ceil(value - 0.5) if value <= current - 0.5 else current


def _instants(position: Callable[..., np.ndarray], a: float, b: float, levels: np.ndarray, way: int) -> np.ndarray:
    """First instants in (a, b] at which a monotone position is at each level."""
    low, high = np.full(levels.size, a), np.full(levels.size, b)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        reached = way * (position(middle, "left") - levels) >= 0.0
        low, high = np.where(reached, low, middle), np.where(reached, middle, high)
    return high


def _value(reference: Reference[Any], t: np.ndarray, side: Side = "right", order: int = 0) -> np.ndarray:
    """Value or rate of a reference; "left": before it jumps."""
    begin, *given = np.array(reference.pieces()).T
    k = np.maximum(np.searchsorted(begin, t, side=side) - 1, 0)
    found: np.ndarray = taylor([d[k] for d in given], t - begin[k])[order]
    for amplitude, frequency, phase in reference.sine_list():
        omega = 2.0 * math.pi * frequency
        factor = amplitude if order == 0 else amplitude * omega
        found = found + factor * sin(omega * t + phase + 0.5 * math.pi * order)
    return found


def _monotone(reference: Reference[Any], until: float) -> np.ndarray:
    """Instants up to `until` between which a reference rises or falls."""
    points = {0.0, until}
    for begin, _, v, a, j in reference.pieces():  # where the rate v + a s + j s^2/2 of a piece is zero
        roots = [0.0]
        if j == 0.0 and a != 0.0:
            roots.append(-v / a)
        if j != 0.0 and (square := a * a - 2.0 * j * v) >= 0.0:
            roots += [(-a + math.sqrt(square)) / j, (-a - math.sqrt(square)) / j]
        points |= {begin + s for s in roots if s >= 0.0}
    if sines := reference.sine_list():
        apart = 1.0 / (POINTS_PER_PERIOD * max(frequency for _, frequency, _ in sines))
        points |= set((apart * np.arange(math.ceil(until / apart))).tolist())
    grid = np.array(sorted(t for t in points if t <= until))
    if not sines:
        return grid
    low, high = grid[:-1].copy(), grid[1:].copy()
    way = np.sign(_value(reference, low, order=1))
    turns = way * _value(reference, high, "left", 1) < 0.0
    low, high, way = low[turns], high[turns], way[turns]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same = way * _value(reference, middle, order=1) > 0.0
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.union1d(grid, high)
