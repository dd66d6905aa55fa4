"""Wind on a load: a torque with the spectrum of the gusts, seeded, so that it is the same each time."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Frequency,
    Length,
    Limit,
    LinearSpeed,
    NotNegative,
    Number,
    Positive,
    Time,
    UpToOne,
    Whole,
)
from ..reproducible import cbrt, cos, exp, fourier_sum, interpolate, log, sin
from ..units.conversion import Unit

MAX_POINTS = 2**17
KARMAN = 0.4


class Wind(Part):
    """Random torque of a given one-sided spectrum S, made of sines: ``sum of sqrt(2 S(f_k)/D) cos(2 pi f_k t + phase_k)``, f_k = k/D.

    The phases are uniform, from the seed (Shinozuka and Deodatis 1991). It repeats after the duration D; the variance
    equals the variance of the spectrum's lines up to ``max_frequency``, in every realisation. Between its points,
    ``1/(points_per_period max_frequency)`` apart, it is straight.
    """

    duration: Annotated[Time, Positive]  #: D, after which it is constant; its lowest frequency is 1/D
    max_frequency: Annotated[Frequency, Positive]  #: highest frequency of its lines
    points_per_period: Annotated[Whole, Field(ge=4, le=100)] = 16  #: straight lines in the shortest period
    seed: Annotated[Whole, Field(ge=0, le=2**53)] = 0  #: number of the realisation

    def spectrum(self, frequency: np.ndarray) -> np.ndarray:
        """S, one-sided [(N m)^2/Hz], at frequencies above 0 [Hz]."""
        raise NotImplementedError

    def mean(self) -> float:
        """Torque [N·m] that the gusts are about."""
        return 0.0

    @rule
    def _has_lines(self) -> Iterator[str]:
        points = self.duration * self.max_frequency * self.points_per_period
        if points > MAX_POINTS:
            yield f"asks for {points:.3g} points, more than {MAX_POINTS}; lower max_frequency or the duration"
        if self.lines().size == 0:
            yield "has no line of the spectrum up to max_frequency; raise it to 1/duration at least"

    def lines(self) -> np.ndarray:
        """Frequencies f_k [Hz]."""
        return np.arange(1, math.floor(self.duration * self.max_frequency * (1.0 + 1e-12)) + 1) / self.duration

    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Instants [s] from 0 to the duration, and the torque there [N·m]."""
        f = self.lines()
        n = f.size * self.points_per_period
        # Raw bits of a counter-based generator, in the order of the frequencies: a longer spectrum keeps the phases.
        phase = 2.0 * math.pi * (np.random.Philox(key=self.seed).random_raw(f.size) >> np.uint64(11)) * 2.0**-53
        amplitude = np.sqrt(2.0 * self.spectrum(f) / self.duration)
        real, imaginary = np.zeros((2, n))
        real[1 : f.size + 1], imaginary[1 : f.size + 1] = amplitude * cos(phase), amplitude * sin(phase)
        gusts, _ = fourier_sum(real, imaginary)
        return self.duration / n * np.arange(n + 1), self.mean() + np.append(gusts, gusts[0])

    def breakpoints(self) -> list[tuple[float, ...]]:
        """(time, value, slope) of each line between two points."""
        time, torque = self.samples()
        slopes = np.append(np.diff(torque) / np.diff(time), 0.0)
        return list(map(tuple, np.column_stack([time, torque, slopes]).tolist()))


class WindOfTable(Wind):
    """A measured spectrum, linear in the logarithms of frequency and density between its points, zero outside."""

    frequencies: Annotated[tuple[Annotated[Frequency, Positive], ...], Field(min_length=2)]  #: rising
    densities: tuple[Annotated[float, Unit("N^2*m^2/Hz"), Positive], ...]  #: one-sided [(N·m)²/Hz], at each frequency
    kind: Literal["table"]

    @rule
    def _fits_together(self) -> Iterator[str]:
        if len(self.frequencies) != len(self.densities):
            yield f"has {len(self.frequencies)} frequencies and {len(self.densities)} densities; give as many of each"
        if np.any(np.diff(self.frequencies) <= 0.0):
            yield "has frequencies that do not rise; sort them, and give each once"

    def spectrum(self, frequency: np.ndarray) -> np.ndarray:
        inside = (frequency >= self.frequencies[0]) & (frequency <= self.frequencies[-1])
        points, densities = log(np.array(self.frequencies)), log(np.array(self.densities))
        return np.where(inside, exp(interpolate(log(frequency), points, densities)), 0.0)


class WindOnArea(Wind):
    """Drag on an area with a lever: M = rho c A r (V + v)^2/2, linear in the gusts v, so that S_M = (rho c A r V)^2 S_v.

    The gusts over the area are taken as one.
    """

    speed: Annotated[LinearSpeed, Positive]  #: V, mean over ten minutes, at the height of the load
    drag_coefficient: Annotated[Number, Positive]  #: c of the area
    area: Annotated[float, Unit("m^2"), Positive]  #: A on which the wind presses
    lever: Length  #: r of the centre of pressure from the axis, against the motion forward
    density: Annotated[float, Unit("kg/m^3"), Positive] = 1.225  #: rho of the air

    def gusts(self, frequency: np.ndarray) -> np.ndarray:
        """S_v, one-sided [(m/s)²/Hz]."""
        raise NotImplementedError

    def mean(self) -> float:
        return 0.5 * self.density * self.drag_coefficient * self.area * self.lever * self.speed * self.speed

    def spectrum(self, frequency: np.ndarray) -> np.ndarray:
        per_speed = 2.0 * self.mean() / self.speed
        return per_speed * per_speed * self.gusts(frequency)


class Davenport(WindOnArea):
    """f S_v/u*^2 = 4 x^2/(1 + x^2)^(4/3), x = 1200 m f/V_10 (Davenport 1961)."""

    surface_drag: Annotated[Number, Limit(gt=0.0, le=0.1)] = 0.005
    """K = u*^2/V_10^2; 0.005 open country, 0.015 suburbs, 0.05 cities"""
    speed_at_10_m: Annotated[LinearSpeed, Positive] | None = None  #: V_10; default: the value at the load
    kind: Literal["davenport"]

    def gusts(self, frequency: np.ndarray) -> np.ndarray:
        V = self.speed if self.speed_at_10_m is None else self.speed_at_10_m
        x = 1200.0 * frequency / V
        root = cbrt(1.0 + x * x)
        return np.asarray(4.0 * self.surface_drag * V * V * x * x / ((1.0 + x * x) * root) / frequency)


class VonKarman(WindOnArea):
    """f S_v/sigma^2 = 4 x/(1 + 70.8 x^2)^(5/6), x = f L/V (von Karman 1948)."""

    turbulence: Annotated[Number, UpToOne]  #: sigma/V
    length_scale: Annotated[Length, Positive]  #: L, along the wind
    kind: Literal["von_karman"]

    def gusts(self, frequency: np.ndarray) -> np.ndarray:
        x = frequency * self.length_scale / self.speed
        deviation = self.turbulence * self.speed
        base = 1.0 + 70.8 * x * x
        power = base / np.sqrt(cbrt(base))  # base^(5/6)
        return np.asarray(4.0 * deviation * deviation * x / power / frequency)


class Kaimal(WindOnArea):
    """f S_v/u*^2 = 105 x/(1 + 33 x)^(5/3), x = f z/V, u* = 0.4 V/log(z/z_0) (Kaimal et al. 1972)."""

    height: Annotated[Length, Positive]  #: z above ground
    roughness_length: Annotated[Length, NotNegative] = 0.03  #: z_0; 0.03 m open country
    kind: Literal["kaimal"]

    @rule
    def _above_the_roughness(self) -> Iterator[str]:
        if not 0.0 < self.roughness_length < self.height:
            yield f"has roughness_length = {self.roughness_length:g} m, which must lie between 0 and its height, {self.height:g} m"

    def gusts(self, frequency: np.ndarray) -> np.ndarray:
        friction = KARMAN * self.speed / log(self.height / self.roughness_length)
        x = frequency * self.height / self.speed
        base = 1.0 + 33.0 * x
        root = cbrt(base)
        return np.asarray(105.0 * friction * friction * x / (base * root * root) / frequency)
