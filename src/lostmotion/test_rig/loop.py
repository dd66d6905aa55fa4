"""A torsion loop, and what is read off it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    pass


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
