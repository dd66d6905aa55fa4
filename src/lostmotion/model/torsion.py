"""The torsion of a gearbox: stiffness, backlash and hysteresis."""

import itertools
import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from .. import _core
from ..inputs.breakpoints import check_apart
from ..inputs.part import Part
from ..inputs.quantities import (
    Angle,
    Limit,
    NotNegative,
    Number,
    Positive,
    Stiffness,
    Torque,
    argument,
)

MAX_PIECES = 100  # of a torsion curve, on each side


def check_segments(slopes: tuple[float, ...], breaks: tuple[float, ...], what: str) -> None:
    """Refuse segments that are no curve of a torque or a force."""
    if len(breaks) != len(slopes) - 1:
        raise ValueError(f"has {len(slopes)} slopes and {len(breaks)} breaks; it needs one break fewer")
    for k, (a, b) in enumerate(itertools.pairwise(breaks)):
        if b <= a:
            raise ValueError(f"breaks must rise, but breaks[{k + 1}] = {b} follows {a}")
    check_apart((0.0, *breaks), "breaks")
    if slopes[-1] <= 0.0:
        raise ValueError(f"ends with slope 0; the last segment must carry {what}")


class TorsionCurve(Part):
    """Torque against twist (eq. 14): odd, continuous, piecewise linear.

    `backlash` (total gap at the output) and `preload` change the given segments. A gap of half the backlash comes
    before the first segment. Segments below the preload torque are left out, since two flanks are pressed together
    there.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.TorsionCurve(slopes=["1e4 N*m/rad", "2e4 N*m/rad"], breaks=["1 mrad"]).slopes
    (10000.0, 20000.0)
    """

    kind: Literal["curve"] = "curve"
    slopes: tuple[Annotated[Stiffness, NotNegative], ...] = Field(min_length=1, max_length=MAX_PIECES)
    """slopes of the segments, from twist 0 outwards"""
    breaks: tuple[Annotated[Angle, Positive], ...] = ()
    """breakpoints: twists at which the slope changes; one fewer than slopes"""
    backlash: Annotated[Angle, NotNegative] = 0.0
    preload: Annotated[Torque, NotNegative] = 0.0

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        check_segments(self.slopes, self.breaks, "torque")
        if self.backlash > 0.0 and self.preload > 0.0:
            raise ValueError("has backlash and preload; a preload removes the backlash, so give only one")
        return self

    def pieces(self) -> tuple[list[float], list[float]]:
        """(breaks [rad], slopes [N·m/rad]) with backlash and preload worked in."""
        breaks, slopes = list(self.breaks), list(self.slopes)
        if self.backlash > 0.0:
            gap = 0.5 * self.backlash
            return [gap, *(gap + b for b in breaks)], [0.0, *slopes]
        if self.preload > 0.0:
            torque, previous = 0.0, 0.0
            for k, b in enumerate([*breaks, math.inf]):
                rise = slopes[k] * (b - previous)
                if torque + rise >= self.preload:
                    start = previous + (self.preload - torque) / slopes[k] if slopes[k] > 0.0 else b
                    return [x - start for x in breaks[k:] if x > start], slopes[k if b > start else k + 1 :]
                torque, previous = torque + rise, b
        return breaks, slopes

    def core(self) -> _core.TorsionCurve:
        return _core.TorsionCurve(*self.pieces())

    def torque(self, twist: float) -> float:
        """P(d) [N·m] at the twist [rad]."""
        return self.core().torque(argument("twist", twist, "rad"))


class LinearStiffness(Part):
    """One stiffness for all twists (5a)."""

    kind: Literal["linear"] = "linear"
    stiffness: Annotated[Stiffness, Positive]

    def pieces(self) -> tuple[list[float], list[float]]:
        """(breaks [rad], slopes [N·m/rad]): no break, one slope."""
        return [], [self.stiffness]

    def core(self) -> _core.TorsionCurve:
        return _core.TorsionCurve(*self.pieces())


class Rigid(Part):
    """No twist at all (7), or rigid flanks that strike at the ends of a backlash.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.Rigid(backlash="1 mrad", restitution=0.5).strikes
    True
    """

    kind: Literal["rigid"] = "rigid"
    backlash: Annotated[Angle, NotNegative] = 0.0
    """total gap at the output"""
    restitution: Annotated[Number, Limit(ge=0.0, le=1.0)] | None = None
    """speed at which the flanks part over that at which they strike; needed with backlash"""

    @property
    def strikes(self) -> bool:
        """Whether it has backlash."""
        return self.backlash > 0.0

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.strikes and self.restitution is None:
            raise ValueError("has rigid flanks with backlash; give their restitution, 0 to 1, or a stiffness")
        if not self.strikes and self.restitution is not None:
            raise ValueError("has a restitution but no backlash; give both or none")
        return self


class Hysteresis(Part):
    """Turning-point hysteresis (16)."""

    efficiency: Annotated[Number, Limit(gt=0.0, le=1.0)]
    """eta_H, average efficiency of the hysteresis process; 1: none"""
