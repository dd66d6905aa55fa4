"""Targets that a pointing axis follows: their paths in space, and the angles under which they are seen.

Coordinates refer to the station: x to the right of the bearing 0, y along it, z up. Angles: traverse A = atan2(x, y), to the
right; elevation E = atan2(z, sqrt(x^2 + y^2)). All derivatives are derivatives of the path itself, by truncated Taylor series.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, Frequency, Length, LinearSpeed, NotNegative, Positive, Speed, Time
from ..reproducible import arctan2, cos, cubic_spline, sin

ORDER = 4  # coefficients of the series: value to third derivative
TOLERANCE = 1e-13  # [rad], of a piece of third degree between two instants
MAX_PIECES = 2_000_000

Jet = np.ndarray  # (4, n): Taylor coefficients of a function of time at n instants, value, rate, second/2, third/6


def product(a: Jet, b: Jet) -> Jet:
    """Product of two series."""
    return np.array([sum(a[j] * b[k - j] for j in range(k + 1)) for k in range(len(a))])


def quotient(a: Jet, b: Jet) -> Jet:
    """Quotient of two series."""
    out: list[np.ndarray] = []
    for k in range(len(a)):
        out.append((a[k] - sum((out[j] * b[k - j] for j in range(k)), np.zeros_like(a[0]))) / b[0])
    return np.array(out)


def root(a: Jet) -> Jet:
    """Square root of a series."""
    out = [np.sqrt(a[0])]
    for k in range(1, len(a)):
        inner = sum((out[j] * out[k - j] for j in range(1, k)), np.zeros_like(a[0]))
        out.append((a[k] - inner) / (2.0 * out[0]))
    return np.array(out)


def angle_of(y: Jet, x: Jet) -> Jet:
    """atan2(y, x) of two series, without jumps of a turn from instant to instant."""
    k = np.arange(1, ORDER)[:, None]
    rate = quotient(
        product(k * y[1:], x[:-1]) - product(y[:-1], k * x[1:]), product(x[:-1], x[:-1]) + product(y[:-1], y[:-1])
    )
    return np.vstack([np.unwrap(arctan2(y[0], x[0]))[None], rate / k])


def sine_and_cosine(angle: np.ndarray, rate: float) -> tuple[Jet, Jet]:
    """Series of sine and cosine of an angle that grows at a constant rate [rad/s]."""
    factors = np.array([1.0, rate, rate * rate / 2.0, rate * rate * rate / 6.0])[:, None]
    s, c = sin(angle), cos(angle)
    return factors * np.array([s, c, -s, -c]), factors * np.array([c, -s, -c, s])


def straight(start: np.ndarray | float, rate: float, t: np.ndarray) -> Jet:
    """start + rate t."""
    out = np.zeros((ORDER, t.size))
    out[0], out[1] = start + rate * t, rate
    return out


class TargetPath(Part):
    """Path of a target over time, and the axis that follows it."""

    axis: Literal["traverse", "elevation"]  #: axis that follows the target
    bearing: Angle = 0.0  #: bearing of the direction y, in which the path is given; it adds to the traverse
    duration: Annotated[Time, Positive] = 60.0  #: time for which the axis follows; after it the reference stays

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        """x, y and z [m] at instants [s]."""
        raise NotImplementedError

    def angles(self, t: np.ndarray) -> Jet:
        """Series of the angle of this axis [rad] at instants [s]."""
        x, y, z = self.position(t)
        if self.axis == "traverse":
            out = angle_of(x, y)
            out[0] += self.bearing
            return out
        return angle_of(z, root(product(x, x) + product(y, y)))

    def at(self, time: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Angle [rad] and its first, second and third derivative at instants [s]."""
        value, rate, second, third = self.angles(np.atleast_1d(np.asarray(time, float)))
        return value, rate, 2.0 * second, 6.0 * third

    def breakpoints(self) -> list[tuple[float, ...]]:
        """(time, angle, first, second, third derivative): pieces of third degree from exact values, 1e-13 rad apart at their ends."""
        n = 1000
        while True:
            t = np.linspace(0.0, self.duration, n + 1)
            found = np.array(self.at(t))
            step = self.duration / n
            # The fourth derivative from the third ones.
            remainder = np.abs(np.diff(found[3])).max() * step * step * step / 24.0
            if remainder <= TOLERANCE:
                break
            wanted = 1.1 * n * max(1.0, math.sqrt(math.sqrt(remainder / TOLERANCE)))
            if not (np.isfinite(found).all() and wanted <= MAX_PIECES):  # before memory is taken for them
                raise ValueError(
                    f"passes too near to the station or too fast: its angle needs more than {MAX_PIECES} pieces over "
                    f"{self.duration:g} s; lower its speed or its duration, or take it farther away"
                )
            n = math.ceil(wanted)
        last = (self.duration, float(found[0, -1]), 0.0, 0.0, 0.0)
        return [*map(tuple, np.vstack([t, found])[:, :-1].T.tolist()), last]


class Crossing(TargetPath):
    """A straight level path that crosses the bearing at a right angle."""

    distance: Annotated[Length, Positive]  #: R_0, horizontal, of the point next to the station
    height: Length = 0.0  #: above the station
    speed: Annotated[LinearSpeed, Positive]  #: speed along the path
    crossing_time: Annotated[Time, NotNegative]  #: instant at which it is next to the station
    heading: Literal["right", "left"] = "right"  #: side to which it flies, as seen from the station

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        rate = self.speed if self.heading == "right" else -self.speed
        along = straight(-rate * self.crossing_time, rate, t)
        return along, straight(self.distance, 0.0, t), straight(self.height, 0.0, t)


class FlyBy(Crossing):
    """A straight level path past the station."""

    path: Literal["fly_by"]


class Weave(Crossing):
    """A path past the station that swings to and fro across its course."""

    width: Annotated[Length, Positive]  #: amplitude of the swing
    frequency: Annotated[Frequency, Positive]  #: swings in a second
    path: Literal["weave"]

    @rule
    def _stays_in_front(self) -> Iterator[str]:
        if self.width >= self.distance:
            yield f"has width = {self.width:g} m, not less than its distance, {self.distance:g} m; take less"

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        x, y, z = super().position(t)
        omega = 2.0 * math.pi * self.frequency
        return x, y + self.width * sine_and_cosine(omega * t, omega)[0], z


class Circle(TargetPath):
    """A level circle at constant speed."""

    distance: Annotated[Length, NotNegative]  #: distance of its centre, horizontal, along the bearing
    radius: Annotated[Length, Positive]
    height: Length = 0.0  #: above the station
    speed: Annotated[LinearSpeed, Positive]  #: speed along the circle
    start: Angle = 0.0
    """starting point on the circle, as an angle from the point farthest along the bearing, to the right"""
    path: Literal["circle"]

    @rule
    def _misses_the_station(self) -> Iterator[str]:
        if self.radius == self.distance:
            yield "passes over the station, where its traverse jumps; change its radius or its distance"

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        omega = self.speed / self.radius
        s, c = sine_and_cosine(self.start + omega * t, omega)
        return self.radius * s, straight(self.distance, 0.0, t) + self.radius * c, straight(self.height, 0.0, t)


class Track(TargetPath):
    """A measured path: a cubic spline through its points, or straight lines."""

    times: Annotated[tuple[Annotated[Time, NotNegative], ...], Field(min_length=4)]
    """instants, rising, from 0 to the duration at least"""
    x: tuple[Length, ...]  #: to the right of the bearing, at each instant
    y: tuple[Length, ...]  #: along the bearing, at each instant
    z: tuple[Length, ...]  #: up, at each instant
    path: Literal["track"]

    @rule
    def _fits_together(self) -> Iterator[str]:
        lengths = {key: len(getattr(self, key)) for key in ("times", "x", "y", "z")}
        if len(set(lengths.values())) > 1:
            yield f"has lists of different length, {lengths}; give one position for each time"
        if np.any(np.diff(self.times) <= 0.0):
            yield "has times that do not rise; sort them, and give each once"
        if self.times[0] > 0.0 or self.times[-1] < self.duration:
            yield f"has times from {self.times[0]:g} s to {self.times[-1]:g} s, which must cover 0 to duration = {self.duration:g} s"

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        pieces = cubic_spline(self.times, np.array([self.x, self.y, self.z]).T)
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        s = (t - np.array(self.times)[k])[:, None]
        value, rate, half, sixth = pieces[:, k]
        here = [value + s * (rate + s * (half + s * sixth)), rate + s * (2.0 * half + 3.0 * s * sixth)]
        x, y, z = np.array([*here, half + 3.0 * s * sixth, sixth + 0.0 * s]).transpose(2, 0, 1)
        return x, y, z


class Star(TargetPath):
    """A direction fixed among the stars, as the earth turns: without refraction. Traverse is the azimuth less the bearing of y."""

    declination: Angle  #: angle above the plane of the equator
    hour_angle: Angle  #: at the start, west of the meridian
    latitude: Angle  #: latitude of the station, north of the equator
    rate: Speed = 7.292115e-05  #: rate at which the hour angle grows; for the sun 7.2722e-5 rad/s
    path: Literal["star"]

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        s, c = sine_and_cosine(self.hour_angle + self.rate * t, self.rate)
        sd, cd, sl, cl = (f(v) for v in (self.declination, self.latitude) for f in (sin, cos))
        one = straight(1.0, 0.0, t)
        # East, north, up.
        return -cd * s, cl * sd * one - sl * cd * c, sl * sd * one + cl * cd * c
