"""References that a controller follows: position, speed or torque over time, with exact derivatives for feedforward."""

import itertools
import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..inputs.core_parameters import V
from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Acceleration,
    Angle,
    Jerk,
    Length,
    LinearAcceleration,
    LinearJerk,
    LinearSpeed,
    NotNegative,
    Positive,
    Speed,
    Time,
    Torque,
)
from ..inputs.refusal_messages import shown
from ..model.signals import Breakpoint, Samples, TimeFunction, taylor
from ..recorded_numbers import real
from ..reproducible import cbrt, cos, cubic_spline, sin, sqrt
from ..units.practical import printed
from .cam_laws import peaks, timed
from .pointing_targets import Circle, FlyBy, Star, Track, Weave
from .profiles import Segment, segments
from .satellites import Satellite

S = TypeVar("S")  # the rate of a value, with its unit
A = TypeVar("A")  # its second derivative
J = TypeVar("J")  # its third derivative
M = TypeVar("M")  # one move of a reference

SHORTEST = 1e-6  # share of a move that the rounding of its instants may be

Piece = tuple[float, float, float, float, float]
"""from a time [s] on: value, and its first, second and third derivative"""


class Series(Samples[V], Generic[V]):
    """A curve through the points given; before the first and after the last the value stays.

    In a scenario file, `file = "points.csv"` may stand for times and values, as in a signal.
    """

    interpolation: Literal["linear", "cubic"] = "linear"
    """straight lines, or a cubic spline: first and second derivative are continuous between the first and the last point"""

    def breakpoints(self) -> list[Breakpoint]:
        if self.interpolation == "linear":
            return super().breakpoints()
        values = [float(v) for v in self.values]  # type: ignore[arg-type]
        factors = np.array([[1.0], [1.0], [2.0], [6.0]])  # of derivatives: value, first, second, third
        with np.errstate(all="ignore"):
            pieces = factors * cubic_spline(self.times, np.array(values))
        if not np.isfinite(pieces).all():
            raise ValueError(
                "has samples that overflow as a cubic spline; lay their times further apart or more evenly, "
                "or check the values"
            )
        curve = zip(self.times, *pieces.tolist(), strict=False)
        return self._held([*curve, (self.times[-1], values[-1], 0.0)])


class Reference(TimeFunction[V], Generic[V]):
    """The sum of all that is given; a bare number is a constant."""

    samples: Series[V] | None = None  #: curve through points
    derivatives: ClassVar[int] = 3

    @rule
    def _representable(self) -> Iterator[str]:
        self._check()
        with np.errstate(all="ignore"):
            finite = np.isfinite(self.pieces()).all()
        if not finite:
            yield "has a value or a derivative beyond the range of numbers; check its times and values"

    def _check(self) -> None:
        """Refuses what does not fit together, with a `ValueError`."""

    def _pieces(self) -> list[list[Breakpoint]]:
        return [*super()._pieces(), *([] if self.samples is None else [self.samples.breakpoints()])]

    def pieces(self) -> list[Piece]:
        """(time [s], value, first, second, third derivative) of each segment of all but the sines, the first from 0 on.

        Within a piece the value is ``value + rate s + acceleration s**2/2 + jerk s**3/6``, s seconds after its time.
        """
        return _pieces_of(self)

    def at(self, time: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Value, and its first, second and third derivative over time; where they jump, the value after the jump.

        time: one instant or an array of them [s], from 0 on.

        Raises InputError: a time is negative or no number.
        """
        try:
            if np.iscomplexobj(time):
                raise TypeError
            t = np.asarray(time, float)
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"time: {shown(time)} must be a number of seconds, or an array of them") from None
        if not np.all((t >= 0.0) & np.isfinite(t)):
            raise InputError(f"time: {shown(time)} must be finite and not negative; a reference begins at 0")
        begin, *given = _table(self)
        k = np.searchsorted(begin, t, side="right") - 1
        found = taylor([d[k] for d in given], t - begin[k])
        for amplitude, frequency, phase in self.sine_list():
            omega = 2.0 * math.pi * frequency
            angle = omega * t + phase
            sine, cosine = sin(angle), cos(angle)
            factor = amplitude
            for n, wave in enumerate((sine, cosine, -sine, -cosine)):
                found[n] = found[n] + factor * wave
                factor *= omega
        value, rate, acceleration, jerk = found
        return value, rate, acceleration, jerk

    @property
    def duration(self) -> float:
        """Time after which the reference is constant, but for its sines [s]."""
        return max([0.0, *(piece[-1][0] for piece in self._pieces())])


@lru_cache(maxsize=64)
def _pieces_of(reference: Reference[Any]) -> list[Piece]:
    return [(t, value, rate, acceleration, jerk) for t, value, rate, acceleration, jerk in reference.breakpoint_list()]


@lru_cache(maxsize=64)
def _table(reference: Reference[Any]) -> np.ndarray:
    return np.array(reference.pieces()).T


Law = Literal[
    "parabola",
    "least_jerk",
    "harmonic",
    "cycloidal",
    "fifth_order",
    "seventh_order",
    "modified_sine",
    "modified_trapezoid",
]
"""laws of `cam_laws`"""


class LimitedMove(Part, Generic[V, S, A, J]):
    """A move from rest at one position to rest at another, in the shortest time that its limits permit.

    Without a limit of the jerk the speed is trapezoidal. With a duration it takes that long, by its law, and must keep its limits.
    """

    to: V  #: position at its end
    speed: Annotated[S, Positive] | None = None  #: limit; default: the value for all moves
    acceleration: Annotated[A, Positive] | None = None
    """limit, also while it slows down; default: the value for all moves"""
    jerk: Annotated[J, Positive] | None = None  #: limit; default: the value for all moves
    dwell: Annotated[Time, NotNegative] | None = None  #: rest after the move; default: the value for all moves
    duration: Annotated[Time, Positive] | None = None
    """time of the move, by its law; default: the shortest that its limits permit"""
    law: Law | None = None  #: law of VDI 2143 for a move with a duration; default: the law of all moves


class Move(LimitedMove[Angle, Speed, Acceleration, Jerk]):
    """A move from rest at one position to rest at another, in the shortest time that its limits permit.

    Without a limit of the jerk the speed is trapezoidal.
    """


class SlideMove(LimitedMove[Length, LinearSpeed, LinearAcceleration, LinearJerk]):
    """A move from rest at one position of a slide to rest at another, in the shortest time that its limits permit.

    Without a limit of the jerk the speed is trapezoidal.
    """


class MovesReference(Reference[V], Generic[V, S, A, J, M]):
    """A position over time: the sum of all that is given, or a list of moves."""

    unit: ClassVar[str] = "rad"
    start: V = 0.0  # type: ignore[assignment]
    """position before the first move"""
    begin: Annotated[Time, NotNegative] = 0.0  #: instant at which the first move begins
    speed: Annotated[S, Positive] | None = None  #: limit of all moves that have none of their own
    acceleration: Annotated[A, Positive] | None = None  #: limit of all moves that have none of their own
    jerk: Annotated[J, Positive] | None = None
    """limit of all moves that have none of their own; without any, their speed is trapezoidal"""
    dwell: Annotated[Time, NotNegative] = 0.0  #: rest after each move that has none of its own
    moves: tuple[M, ...] = ()  #: moves, each from rest to rest
    kind: Literal["position"] = "position"
    law: Law | None = None  #: law of VDI 2143 for all moves with a duration that have none of their own

    def _check(self) -> None:
        limits = [key for key in ("speed", "acceleration", "jerk") if getattr(self, key) is not None]
        if self.steps and (limits or self.moves):
            raise ValueError(
                "has steps, jumps of position that exceed every limit of speed; give moves = [{ to = 1.0 }] in their place"
            )
        if not self.moves:
            given = limits + [key for key in ("start", "begin", "dwell") if getattr(self, key) != 0.0]
            given += [] if self.law is None else ["law"]
            if given:
                raise ValueError(f"has {given[0]} but no moves; add moves = [{{ to = 1.0 }}], or leave it out")
            return
        if self.mean != 0.0:
            raise ValueError(f"has mean = {self.mean:g} and moves between positions; give start in place of mean")
        moves: tuple[Any, ...] = self.moves
        for k, move in enumerate(moves):
            needed = ("speed", "acceleration") if move.duration is None else ("law",)
            lacking = [key for key in needed if self._of(move, key) is None]
            if lacking:
                such = '; such as "modified_sine"' if lacking[0] == "law" else ""
                text = f"lacks {lacking[0]} of moves[{k}]; give it there, or beside moves for all of them{such}"
                raise ValueError(text)
        positions = [self.start, *(move.to for move in moves)]
        for k, (begin, end) in enumerate(self.intervals()):
            resolved = math.ulp(end) <= SHORTEST * (end - begin) < math.inf
            if not resolved and positions[k] != positions[k + 1]:
                raise ValueError(
                    f"has moves[{k}] from {begin:g} s to {end:g} s, an interval that numbers cannot resolve; check its limits"
                )

    def _of(self, move: Any, key: str) -> Any:
        """Limits of one move, or of all moves."""
        own = getattr(move, key)
        return getattr(self, key) if own is None else own

    def _segments(self) -> list[list[Segment]]:
        """The segments of each move."""
        found: list[list[Segment]] = []
        moves: tuple[Any, ...] = self.moves
        time, origin = self.begin, real(self.start)
        for k, move in enumerate(moves):
            speed, acceleration, jerk, dwell = (
                self._of(move, key) for key in ("speed", "acceleration", "jerk", "dwell")
            )
            if move.duration is not None:
                own = timed(move.to - origin, move.duration, self._of(move, "law"))
                self._keep_limits(k, own)
            else:
                own = segments(move.to - origin, speed, acceleration, math.inf if jerk is None else jerk)
            found.append([(time + t, origin + position, *of_it) for t, position, *of_it in own])  # type: ignore[misc]
            found[-1][-1] = (found[-1][-1][0], move.to, *found[-1][-1][2:])
            time, origin = time + (own[-1][0] + dwell), move.to
        return found

    def _keep_limits(self, k: int, own: list[Segment]) -> None:
        """Refuse a duration that is too short for the limits of its move."""
        moves: tuple[Any, ...] = self.moves
        limits = [self._of(moves[k], key) for key in ("speed", "acceleration", "jerk")]
        if limits == [None, None, None]:
            return
        uses = [0.0 if limit is None else peak / limit for peak, limit in zip(peaks(own), limits, strict=True)]
        least = max(uses[0], sqrt(uses[1]), cbrt(uses[2])) * moves[k].duration
        if max(uses) > 1.0 + SHORTEST:
            n = uses.index(max(uses))
            key, peak = ("speed", "acceleration", "jerk")[n], uses[n] * limits[n]
            unit = printed(f"{self.unit}/s^{n + 1}" if n else f"{self.unit}/s")
            raise ValueError(
                f"has moves[{k}] with a peak {key} of {peak:.5g} {unit}, above its limit of {limits[n]:.5g} {unit}; "
                f"give a duration of at least {least:.4g} s, or leave the limit out"
            )

    def timed_moves(self) -> list[str]:
        """A line for each move with a duration: its law, and its largest speed and acceleration."""
        moves: tuple[Any, ...] = self.moves
        return [
            f"moves[{k}] in {move.duration:g} s, {self._of(move, 'law')}: peak speed {speed:.4g} {self.unit}/s, "
            f"acceleration {acceleration:.4g} {self.unit}/s²"
            for k, (move, own) in enumerate(zip(moves, self._segments(), strict=True))
            if move.duration is not None
            for speed, acceleration, _ in [peaks(own)]
        ]

    def _pieces(self) -> list[list[Breakpoint]]:
        if not self.moves:
            return super()._pieces()
        points = list(itertools.chain(*self._segments()))
        lasting = [p for p, q in itertools.pairwise(points) if p[0] < q[0]]
        return [*super()._pieces(), [(0.0, real(self.start)), *lasting, points[-1]]]

    def intervals(self) -> list[tuple[float, float]]:
        """(begin, end) of each move, without its dwell [s]."""
        return [(own[0][0], own[-1][0]) for own in self._segments()]

    @property
    def duration(self) -> float:
        """Time after which the reference is constant, but for its sines [s]; with moves, the end of the last dwell at least."""
        ends = [end + float(self._of(self.moves[-1], "dwell")) for _, end in self.intervals()[-1:]]
        return max([super().duration, *ends])


class PositionReference(MovesReference[Angle, Speed, Acceleration, Jerk, Move]):
    """A position [rad] over time: the sum of all that is given, or a list of moves.

    Examples
    --------
    >>> import lostmotion as lm
    >>> reference = lm.PositionReference(moves=[{"to": "90 deg"}], speed="1 rad/s", acceleration="5 rad/s^2")
    >>> [round(value, 3) for value in reference.at(0.1)]
    [np.float64(0.025), np.float64(0.5), np.float64(5.0), np.float64(0.0)]
    """

    target: Annotated[FlyBy | Weave | Circle | Track | Star | Satellite, Field(discriminator="path")] | None = None
    """the angle under which a target in space is seen"""

    def _check(self) -> None:
        if self.target is not None and self.moves:
            raise ValueError("has a target and moves; give one of them")
        super()._check()

    def _pieces(self) -> list[list[Breakpoint]]:
        if self.target is not None:
            return [*Reference._pieces(self), list(self.target.breakpoints())]
        return super()._pieces()


class SlideReference(MovesReference[Length, LinearSpeed, LinearAcceleration, LinearJerk, SlideMove]):
    """A position [m] of a slide over time: the sum of all that is given, or a list of moves.

    Examples
    --------
    >>> import lostmotion as lm
    >>> reference = lm.control.SlideReference(moves=[{"to": "100 mm"}], speed="0.5 m/s", acceleration="5 m/s^2")
    >>> float(reference.at(1.0)[0])
    0.1
    """

    unit: ClassVar[str] = "m"


class SpeedReference(Reference[Speed]):
    """A speed [rad/s] over time: the sum of all that is given."""

    kind: Literal["speed"] = "speed"


class TorqueReference(Reference[Torque]):
    """A torque [N·m] over time: the sum of all that is given."""

    kind: Literal["torque"] = "torque"
