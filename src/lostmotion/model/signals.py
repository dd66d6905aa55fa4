"""Commands and disturbances as functions of time: piecewise linear plus sines."""

from __future__ import annotations

import bisect
import itertools
import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar

import numpy as np
from pydantic import Field, model_validator

from .. import _core
from ..inputs import core_parameters
from ..inputs.breakpoints import check_rising
from ..inputs.core_parameters import V
from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Angle,
    Force,
    Frequency,
    LinearSpeed,
    NotNegative,
    Number,
    Positive,
    Speed,
    Time,
    Torque,
    Whole,
)
from ..recorded_numbers import real
from ..reproducible import sin, total
from ..units.scalars import is_number, scalar
from .wind import Davenport, Kaimal, VonKarman, WindOfTable

N = TypeVar("N", float, np.ndarray)

Breakpoint = tuple[float, ...]
"""from a time [s] on: value, slope and, of what is not made of straight lines, the second and third derivative"""


class Sine(core_parameters.SineFields[V], Generic[V]):
    """``amplitude * sin(2 pi frequency t + phase)``."""


class Step(Part, Generic[V]):
    """Adds `height` from `time` on."""

    height: V  #: height that it adds
    time: Annotated[Time, NotNegative] = 0.0  #: instant from which it adds its height

    def breakpoints(self) -> list[Breakpoint]:
        return [(self.time, real(self.height), 0.0)]


class Ramp(Part, Generic[V]):
    """Rises by `rise` in a straight line within `duration`, from `begin` on, and stays there."""

    rise: V  #: height that it adds from its end on
    duration: Annotated[Time, Positive]  #: time that it takes
    begin: Annotated[Time, NotNegative] = 0.0  #: instant at which it begins

    def breakpoints(self) -> list[Breakpoint]:
        rise = real(self.rise)
        return [(self.begin, 0.0, rise / self.duration), (self.begin + self.duration, rise, 0.0)]


class Chirp(Part, Generic[V]):
    """Sine whose frequency runs in a straight line from one value to another, drawn with straight lines.

    The chords depart from the sine by at most ``amplitude * (pi / points_per_period)**2 / 2`` where the frequency is
    highest: 0.12 % with 64 points.
    """

    amplitude: V  #: amplitude of the sine
    begin_frequency: Annotated[Frequency, Positive]  #: frequency at its start
    end_frequency: Annotated[Frequency, Positive]  #: frequency at its end
    duration: Annotated[Time, Positive]  #: time from its begin to its end
    begin: Annotated[Time, NotNegative] = 0.0  #: instant at which it begins
    points_per_period: Annotated[Whole, Field(ge=8, le=1000)] = 64  #: straight lines in the shortest period

    def breakpoints(self) -> list[Breakpoint]:
        fastest = max(self.begin_frequency, self.end_frequency)
        n = max(2, math.ceil(self.duration * fastest * self.points_per_period))
        rate = (self.end_frequency - self.begin_frequency) / self.duration
        amplitude = real(self.amplitude)
        times = [self.duration * k / n for k in range(n + 1)]
        values = [amplitude * sin(2.0 * math.pi * (self.begin_frequency + 0.5 * rate * t) * t) for t in times]
        lines = _polyline([self.begin + t for t in times], values)
        return [*lines[:-1], (self.begin + self.duration, 0.0, 0.0)]


class Samples(Part, Generic[V]):
    """Straight lines through the points given; before the first and after the last the value stays.

    In a scenario file, `file = "points.csv"` may stand for both keys: two columns, time [s] and value. A heading such as
    ``time [ms],torque [Nm]`` gives other units.
    """

    times: tuple[Time, ...]  #: instants, rising from 0 or later
    values: tuple[V, ...]  #: value at each instant

    @rule
    def _fit_together(self) -> Iterator[str]:
        if len(self.times) != len(self.values):
            yield f"has {len(self.times)} times and {len(self.values)} values; give as many of each"
        if len(self.times) < 2:
            yield "has fewer than two points; give at least two, or use mean"
        if self.times[0] < 0.0:
            yield f"begins at {self.times[0]} s; times must not be negative"
        yield from check_rising(self.times, "times")

    def breakpoints(self) -> list[Breakpoint]:
        values = [float(v) for v in self.values]  # type: ignore[arg-type]
        return self._held(_polyline(self.times, values))

    def _held(self, points: list[Breakpoint]) -> list[Breakpoint]:
        """The points with the first value from 0 on."""
        return points if self.times[0] == 0.0 else [(0.0, points[0][1], 0.0), *points]


class TimeFunction(Part, Generic[V]):
    """The sum of all that is given; a bare number is a constant."""

    mean: V = 0.0  # type: ignore[assignment]
    """constant part"""
    amplitude: V | None = None  #: amplitude of one sine, with frequency and phase
    frequency: Annotated[Frequency, Positive] | None = None  #: frequency of that sine
    phase: Angle = 0.0  #: phase of that sine at t = 0
    sines: tuple[Sine[V], ...] = ()  #: more sines
    steps: tuple[Step[V], ...] = ()  #: steps, each from an instant on
    ramps: tuple[Ramp[V], ...] = ()  #: straight lines in time, each with a begin and an end
    derivatives: ClassVar[int] = 1
    """derivatives, beside the value, that change at breakpoints; all higher ones are 0 between them"""

    @model_validator(mode="before")
    @classmethod
    def _from_constant(cls, data: Any) -> Any:
        data = scalar(data)
        return {"mean": data} if isinstance(data, str) or is_number(data) else data

    @rule
    def _amplitude_and_frequency(self) -> Iterator[str]:
        if (self.amplitude is None) != (self.frequency is None):
            missing = "frequency" if self.frequency is None else "amplitude"
            yield f"lacks {missing}; amplitude and frequency belong together"
        if self.phase != 0.0 and self.amplitude is None:
            yield "has a phase but no sine; give amplitude and frequency too"

    def sine_list(self) -> list[tuple[float, float, float]]:
        """(amplitude, frequency [Hz], phase [rad]) of each sine."""
        own = [] if self.amplitude is None else [(self.amplitude, self.frequency, self.phase)]
        return [*own, *((s.amplitude, s.frequency, s.phase) for s in self.sines)]  # type: ignore[list-item]

    def breakpoint_list(self) -> list[Breakpoint]:
        """The segments of all but the sines, from t = 0 on."""
        pieces = self._pieces()
        orders = range(1, self.derivatives + 1)
        mean = real(self.mean)
        breakpoints = []
        waiting = deque(sorted(pieces, key=lambda piece: piece[0][0]))
        active: list[list[Breakpoint]] = []
        final = 0.0  # sum of the pieces that are past their last breakpoint and constant from there on
        for time in sorted(dict.fromkeys((0.0, *(point[0] for piece in pieces for point in piece)))):
            while waiting and waiting[0][0][0] <= time:
                active.append(waiting.popleft())
            here = [_at(piece, time, self.derivatives) for piece in active]
            value = mean + total((d[0] for d in here), final)
            breakpoints.append((time, value, *(total(d[k] for d in here) for k in orders)))
            final += total(d[0] for piece, d in zip(active, here, strict=True) if time >= piece[-1][0])
            active = [piece for piece in active if time < piece[-1][0]]
        return breakpoints

    def _pieces(self) -> list[list[Breakpoint]]:
        """The breakpoints of each part; from the last one on a part is constant."""
        return [*(step.breakpoints() for step in self.steps), *(ramp.breakpoints() for ramp in self.ramps)]

    def __reduce__(self) -> tuple[Any, ...]:
        # The classes of the parts are generic, and as such have no name by which they could be pickled.
        return type(self).model_validate, (self.model_dump(exclude_unset=True),)


class Signal(TimeFunction[V], Generic[V]):
    """The sum of all that is given; a bare number is a constant."""

    chirp: Chirp[V] | None = None  #: sine whose frequency runs from one value to another
    samples: Samples[V] | None = None  #: straight lines through points

    def _pieces(self) -> list[list[Breakpoint]]:
        parts: list[Chirp[V] | Samples[V] | None] = [self.chirp, self.samples]
        return [*super()._pieces(), *(part.breakpoints() for part in parts if part is not None)]

    def core(self) -> _core.Signal:
        """The solver's signal; made once for equal signals."""
        return _core_signal(self)

    def delayed(self, up: float, down: float) -> Self:
        """The same signal whose steps up act later by `up` [s], those down by `down` [s].

        Raises ValueError: it is not made of a mean and steps, or a step would act before the one that precedes it.
        """
        if up == 0.0 == down:
            return self
        if self.sine_list() or self.ramps or self.chirp or self.samples:
            raise ValueError("is not made of steps; with an engagement or release delay, give mean and steps alone")
        heights: dict[float, float] = {}
        for step in sorted(self.steps, key=lambda step: step.time):
            heights[step.time] = heights.get(step.time, 0.0) + real(step.height)
        steps = [Step[V](time=t, height=h) for t, h in heights.items()]  # type: ignore[arg-type]
        later = [Step[V](time=t + (up if h > 0.0 else down), height=h) for t, h in heights.items()]  # type: ignore[arg-type]
        for (a, b), (first, second) in zip(itertools.pairwise(steps), itertools.pairwise(later), strict=True):
            if second.time < first.time:
                raise ValueError(
                    f"steps at {a.time:g} s and at {b.time:g} s, which after the delays would act in reverse order; leave more "
                    "time between them"
                )
        return self.model_copy(update={"steps": tuple(later)})

    def at_start(self) -> float:
        """Its value at t = 0."""
        return total((a * sin(phase) for a, _, phase in self.sine_list()), self.breakpoint_list()[0][1])

    def upper_bound(self) -> float:
        """Upper bound of the signal: the largest value without the sines, plus the amplitudes of the sines."""
        lines = self.breakpoint_list()
        values = [value for _, value, _ in lines]
        values += [value + slope * (end - begin) for (begin, value, slope), (end, *_) in itertools.pairwise(lines)]
        return max(values) + total(abs(amplitude) for amplitude, *_ in self.sine_list())

    def mirrored(self) -> Self:
        """The same signal with the other sign."""
        return self.scaled(-1.0)

    def scaled(self, factor: float) -> Self:
        """All values times `factor`."""

        def scale(data: Any, keys: tuple[str, ...]) -> Any:
            return {
                k: ([factor * x for x in v] if isinstance(v, list | tuple) else factor * v)
                if k in keys and v is not None
                else v
                for k, v in data.items()
            }

        data = scale(self.model_dump(), ("mean", "amplitude"))
        data["sines"] = [scale(s, ("amplitude",)) for s in data["sines"]]
        data["steps"] = [scale(s, ("height",)) for s in data["steps"]]
        data["ramps"] = [scale(s, ("rise",)) for s in data["ramps"]]
        for key, inner in (("chirp", ("amplitude",)), ("samples", ("values",))):
            if data[key] is not None:
                data[key] = scale(data[key], inner)
        return type(self)(**data)


@lru_cache(maxsize=256)
def _core_signal(signal: Signal[Any]) -> _core.Signal:
    return core_signal(signal.breakpoint_list(), signal.sine_list())


def core_signal(breakpoints: Iterable[Sequence[float]], sines: Iterable[Sequence[float]] = ()) -> _core.Signal:
    """The solver's signal of breakpoints and sines as `breakpoint_list` and `sine_list` have them."""
    lines = columns(("time", "value", "slope"), breakpoints)
    return _core.Signal({"breakpoints": lines, "sines": columns(("amplitude", "frequency", "phase"), sines)})


def columns(keys: tuple[str, ...], rows: Iterable[Sequence[float]]) -> dict[str, tuple[float, ...]]:
    """A list of each number of an entry, by its key in the core."""
    return dict(zip(keys, zip(*rows, strict=True), strict=False))


def _at(piece: list[Breakpoint], time: float, derivatives: int) -> list[float]:
    """Value and so many derivatives at `time` (right limit); 0 before the first breakpoint."""
    k = bisect.bisect_right(piece, time, key=lambda point: point[0]) - 1
    if k < 0:
        return [0.0] * (derivatives + 1)
    begin, *given = piece[k]
    given += [0.0] * (derivatives + 1 - len(given))
    return given if begin is time else taylor(given, time - begin)


def taylor(derivatives: Sequence[N], time: N) -> list[N]:
    """Value and derivatives of a polynomial a time [s] after the instant at which they are given; numbers or arrays."""
    found = []
    for order in range(len(derivatives)):
        total = derivatives[-1]
        for k in range(len(derivatives) - 2, order - 1, -1):
            total = derivatives[k] + total * time / (k - order + 1)
        found.append(total)
    return found


def _polyline(times: Any, values: list[float]) -> list[Breakpoint]:
    points = list(zip(times, values, strict=True))
    lines = [(t0, v0, (v1 - v0) / (t1 - t0)) for (t0, v0), (t1, v1) in itertools.pairwise(points)]
    return [*lines, (times[-1], values[-1], 0.0)]


class ForceSignal(Signal[Force]):
    """A force [N] over time: the sum of all that is given."""


class GivenSpeed(Signal[V], Generic[V]):
    """A speed over time: the sum of all that is given, without jumps."""

    unit: ClassVar[str] = "rad/s"

    @rule
    def _is_continuous(self) -> Iterator[str]:
        lines = self.breakpoint_list()
        for (begin, value, slope), (end, after, _) in itertools.pairwise(lines):
            before = value + slope * (end - begin)
            if not math.isclose(before, after, rel_tol=1e-9, abs_tol=1e-9 * max(abs(v) for _, v, _ in lines)):
                yield f"jumps at {end:g} s from {before:.6g} to {after:.6g} {self.unit}, which takes an infinite acceleration; give ramps"

    def acceleration(self) -> AccelerationSignal:
        """Its time derivative [rad/s²]."""
        return AccelerationSignal(speed=self)  # type: ignore[arg-type]


class GivenSpeedSignal(GivenSpeed[Speed]):
    """A speed [rad/s] over time: the sum of all that is given, without jumps."""


class SlideSpeedSignal(GivenSpeed[LinearSpeed]):
    """A speed [m/s] over time: the sum of all that is given, without jumps."""

    unit: ClassVar[str] = "m/s"


class AccelerationSignal(Signal[Number]):
    """The time derivative of a speed."""

    speed: GivenSpeedSignal | SlideSpeedSignal

    def sine_list(self) -> list[tuple[float, float, float]]:
        return [(2.0 * math.pi * f * a, f, phase + 0.5 * math.pi) for a, f, phase in self.speed.sine_list()]

    def breakpoint_list(self) -> list[Breakpoint]:
        return [(time, slope, 0.0) for time, _, slope in self.speed.breakpoint_list()]


class TorqueSignal(Signal[Torque]):
    """A torque [N·m] over time: the sum of all that is given.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.TorqueSignal(mean="5 N*m").mean
    5.0
    """

    wind: Annotated[WindOfTable | Davenport | VonKarman | Kaimal, Field(discriminator="kind")] | None = None
    """random torque with the spectrum of gusts"""

    def _pieces(self) -> list[list[Breakpoint]]:
        return [*super()._pieces(), *([] if self.wind is None else [self.wind.breakpoints()])]

    def scaled(self, factor: float) -> Self:
        """All values times `factor`; a wind as the samples that it is made of."""
        if self.wind is None:
            return super().scaled(factor)
        time, torque = (tuple(row.tolist()) for row in self.wind.samples())
        if self.samples is not None:
            raise ValueError("has wind and samples, which cannot be scaled together; give one of them")
        plain = self.model_copy(update={"wind": None, "samples": Samples[Torque](times=time, values=torque)})
        return super(TorqueSignal, plain).scaled(factor)


def constant_or(value: Any, kind: Any) -> Any:
    """A number as a constant signal of a kind; a signal as it is."""
    return kind(mean=value) if isinstance(value, int | float) else value
