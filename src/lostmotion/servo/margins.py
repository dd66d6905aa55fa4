"""Bandwidths and margins of a sampled loop, from its exact frequency response."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError, MissingLibraryError
from .linear_regimes import Axis, Regime, regimes
from .linear_sampled_loop import LinearLoop

Response = Callable[[Any], np.ndarray]
LOWEST, POINTS = 1e-4, 500  # of the frequencies below half the sampling frequency
SMALLEST = 1e-300  # gain, in place of 0 where its logarithm is taken
NOTHING = 1e-9  # gain of what rounding makes of none
STABLE = 1.0 + 1e-6  # magnitude of an eigenvalue, with what rounding makes of several at 1


@dataclass(frozen=True)
class Margins:
    """Margins of a loop; NaN where a curve does not cross."""

    stable: bool
    """the closed loop with those around it open: all eigenvalues over one sample time within the unit circle"""
    gain_margin: float
    """least factor above 1 by which the gain may rise"""
    gain_margin_frequency: float
    """[Hz]"""
    lower_gain_margin: float
    """greatest factor below 1 to which the gain may fall"""
    phase_margin: float
    """least distance of the phase from -180 degrees where the gain is 1 [rad]"""
    crossover: float
    """frequency of the phase margin [Hz]"""
    sensitivity_peak: float
    """greatest absolute value of 1/(1 + L)"""
    sensitivity_peak_frequency: float
    """[Hz]"""

    @property
    def delay_margin(self) -> float:
        """Further delay that the phase margin allows [s]."""
        return self.phase_margin / (2.0 * math.pi * self.crossover)


@dataclass(frozen=True)
class Bandwidth:
    """Bandwidth of a closed loop; NaN beyond half its sampling frequency."""

    three_decibels: float
    """frequency at which the gain first falls below -3 dB [Hz]"""
    ninety_degrees: float
    """frequency at which the phase first falls through -90 degrees [Hz]"""
    resonance_peak: float
    """greatest gain"""


@dataclass(frozen=True)
class Instability:
    """A pole of the complete sampled loop outside the unit circle."""

    loop: str
    """loop whose closing causes it: without this loop and those around it all poles are within"""
    regime: str
    magnitude: float
    """magnitude of the pole, over the sample time of the outermost loop"""
    frequency: float
    """[Hz]"""
    growth: float
    """rate at which its motion grows [1/s]"""

    def __str__(self) -> str:
        return (
            f"{self.loop} ({self.regime}): a pole of magnitude {self.magnitude:.6g} at {self.frequency:.4g} Hz, caused by the "
            f"{self.loop} loop, grows with {self.growth:.3g} 1/s"
        )


def instability(axis: Axis, regime: Regime) -> Instability | None:
    """Unstable pole with all loops of an axis closed; None if there is none."""
    found = None
    for loop in reversed(axis.loops):
        closed = LinearLoop(axis, regime, loop, False)
        values = np.linalg.eigvals(closed.transition)
        pole = complex(values[np.argmax(np.abs(values))])
        if abs(pole) < STABLE:
            break
        frequency = abs(float(np.angle(pole))) / (2.0 * math.pi * closed.sample_time)
        growth = math.log(abs(pole)) / closed.sample_time
        outer = found or Instability(loop, regime.name, abs(pole), frequency, growth)
        found = replace(outer, loop=loop)
    return found


def unstable_pole(axis: Axis) -> str:
    """First pole outside the unit circle of an axis with all loops closed; empty if none is found, or no regime is linear."""
    try:
        found = [instability(axis, regime) for regime in regimes(axis)]
    except (InputError, MissingLibraryError):
        return ""
    return next((str(pole) for pole in found if pole is not None), "")


def frequencies(*loops: LinearLoop) -> np.ndarray:
    """Frequencies [Hz] that show all of some loops: even on a logarithmic scale, and dense about each eigenvalue."""
    highest = min(0.5 / loop.sample_time for loop in loops)
    out = [np.geomspace(LOWEST * highest, highest, POINTS, endpoint=False)]
    for loop in loops:
        values = np.linalg.eigvals(loop.transition)
        logs = np.log(values[(values.imag > 0.0) & (np.abs(values) > 1e-6)]) / loop.sample_time
        for s in logs:
            f, width = s.imag / (2.0 * math.pi), max(abs(s.real) / (2.0 * math.pi), 1e-6 * s.imag)
            out.append(f + width * np.sinh(np.linspace(-4.0, 4.0, 33)) / 4.0)
    every = np.unique(np.concatenate(out))
    return every[(every >= LOWEST * highest) & (every < highest)]


def roots(curve: np.ndarray, f: np.ndarray, exact: Callable[[float], float], falling: bool = False) -> list[float]:
    """Frequencies at which a curve over f passes through 0; those where it jumps are left out."""
    from scipy.optimize import brentq

    out = []
    for k in np.flatnonzero(
        (curve[:-1] > 0.0) & (curve[1:] <= 0.0) | (not falling) & (curve[:-1] <= 0.0) & (curve[1:] > 0.0)
    ):
        if abs(curve[k + 1] - curve[k]) < 3.0 and exact(f[k]) * exact(f[k + 1]) < 0.0:
            out.append(float(brentq(exact, f[k], f[k + 1], xtol=1e-14, rtol=1e-13)))
    return out


def margins(cut: LinearLoop, closed: LinearLoop) -> Margins:
    """Margins of a loop, cut and closed."""
    from scipy.optimize import minimize_scalar

    f = frequencies(cut, closed)
    L = cut.open_loop(f)
    stable = bool(np.abs(np.linalg.eigvals(closed.transition)).max() < STABLE)
    magnitude = np.maximum(np.abs(L), SMALLEST)
    if magnitude.max() < NOTHING:
        return Margins(stable, *[math.nan] * 7)

    def at(x: float) -> complex:
        return complex(cut.open_loop(x)[0])

    # Where L is real and negative, the imaginary part passes through 0; scaled, so that it does not jump.
    def turned(x: float) -> float:
        y = at(x)
        return float(y.imag / abs(y))

    crossings = [x for x in roots(L.imag / magnitude, f, turned) if at(x).real < 0.0]
    gains = [(1.0 / abs(at(x)), x) for x in crossings]
    above = min((g for g in gains if g[0] > 1.0), default=(math.nan, math.nan))
    below = max((g[0] for g in gains if g[0] < 1.0), default=math.nan)
    ones = roots(np.clip(np.log(magnitude), -1.0, 1.0), f, lambda x: math.log(abs(at(x))))
    phases = [(abs(float(np.angle(-at(x)))), x) for x in ones]
    phase = min(phases, default=(math.nan, math.nan))
    S = 1.0 / np.abs(1.0 + L)
    k = int(np.argmax(S))
    low, high = f[max(k - 1, 0)], f[min(k + 1, len(f) - 1)]
    peak = minimize_scalar(
        lambda x: -1.0 / abs(1.0 + at(x)), bounds=(low, high), method="bounded", options={"xatol": 1e-9 * high}
    )
    best = max((float(-peak.fun), float(peak.x)), (float(S[k]), float(f[k])))
    return Margins(stable, above[0], above[1], below, phase[0], phase[1], best[0], best[1])


def bandwidth_of(f: np.ndarray, response: Response) -> Bandwidth:
    """Bandwidth of a closed loop, from its frequency response as a function of [Hz]."""
    T = response(f)
    magnitude = np.maximum(np.abs(T), SMALLEST)
    if magnitude.max() < NOTHING:  # what is measured does not move, as behind an open gap
        return Bandwidth(math.nan, math.nan, 0.0)
    level = math.sqrt(0.5)
    phase = np.unwrap(np.angle(T)) + 0.5 * math.pi

    def phase_at(x: float) -> float:
        k = int(np.searchsorted(f, x)) - 1
        near = phase[max(k, 0)] - 0.5 * math.pi
        angle = float(np.angle(response(x)[0]))
        return float(angle + 2.0 * math.pi * round((near - angle) / (2.0 * math.pi)) + 0.5 * math.pi)

    gain = roots(
        np.log(magnitude / level), f, lambda x: math.log(max(abs(response(x)[0]), SMALLEST) / level), falling=True
    )
    turn = roots(phase, f, phase_at, falling=True)
    first = [(found or [math.nan])[0] for found in (gain, turn)]
    return Bandwidth(first[0], first[1], float(np.abs(T).max()))
