"""Readings of slow loadings and of ramps until something breaks loose, of gearboxes and screws alike."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..simulation.runs.results import RunArrays
from ..simulation.runs.switchings import names_in, unpacked


def segment(twist: Any, torque: Any, low: float, high: float) -> tuple[float, float]:
    """(slope, torque at twist 0) of a loading between two torques, from its middle 80 %; NaN of fewer than three samples."""
    margin = 0.1 * (high - low)
    inside = (torque > low + margin) & (torque < high - margin)
    if np.count_nonzero(inside) < 3:
        return np.nan, np.nan
    slope, offset = np.polyfit(twist[inside], torque[inside], 1)
    return float(slope), float(offset)


def gap(twist: Any, torque: Any, up_to: float) -> float:
    """Total gap: twice where the first segment, loaded up to a torque, meets zero torque."""
    slope, offset = segment(twist, torque, 0.0, up_to)
    return -2.0 * offset / slope


def break_away(result: RunArrays) -> dict[str, float] | None:
    """The switching at which the input shaft first starts to turn, by the names of its columns; None: it never does."""
    switchings = dict(zip(names_in(result.attrs), unpacked(result.attrs).T, strict=True))
    events = np.flatnonzero((switchings["input_contact_before"] == 0) & (switchings["input_contact_after"] != 0))
    return {name: float(column[events[0]]) for name, column in switchings.items()} if len(events) else None


@dataclass(frozen=True)
class Loop:
    """One closed torsion loop: twist [rad] and torque [N·m] over a slow cycle between -amplitude and amplitude."""

    amplitude: float
    twist: Any
    torque: Any

    @property
    def width(self) -> float:
        """Twist between the branches where the torque has just gone to zero, backlash included [rad]."""
        half = len(self.torque) // 2
        return abs(self._end(slice(0, half + 1), +1.0) - self._end(slice(half, None), -1.0))

    def _end(self, branch: slice, sign: float) -> float:
        """Zero of a branch that unloads from this sign, by its last two points before."""
        twist, torque = self.twist[branch], sign * self.torque[branch]
        k = np.flatnonzero(torque > 1e-3 * self.amplitude)
        run = k[: np.argmax(np.diff(k, append=len(twist) + 1) > 1) + 1][-2:] if len(k) > 2 else k
        (d0, d1), (T0, T1) = twist[run], torque[run]
        return float(d1 - T1 * (d1 - d0) / (T1 - T0))

    @property
    def area(self) -> float:
        """Energy lost in one cycle [J]."""
        return abs(float(np.trapezoid(self.torque, self.twist)))
