"""The torsion of a gearbox: stiffness, backlash and hysteresis."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from .. import _core
from ..errors import InputError
from ..inputs.breakpoints import check_apart, check_rising
from ..inputs.core_parameters import TorsionCurveFields
from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, NotNegative, Number, Positive, Share, Stiffness, UpToOne, argument


def check_segments(slopes: tuple[float, ...], breaks: tuple[float, ...], what: str) -> Iterator[str]:
    """Refuse segments that are no curve of a torque or a force."""
    if len(breaks) != len(slopes) - 1:
        yield f"has {len(slopes)} slopes and {len(breaks)} breaks; it needs one break fewer"
    yield from check_rising(breaks, "breaks")
    check_apart((0.0, *breaks), "breaks")
    if slopes[-1] <= 0.0:
        yield f"ends with slope 0; the last segment must carry {what}"


class Elastic(Part):
    """Base of stiffnesses: a torque over the twist."""

    def core(self) -> _core.TorsionCurve:
        """The curve of the solver."""
        raise NotImplementedError

    def torque(self, twist: float) -> float:
        """P(d) [N·m] at the twist [rad]."""
        return self.core().torque(argument("twist", twist, "rad"))

    @property
    def has_gap(self) -> bool:
        """Whether it has no torque about twist 0."""
        return self.core().side(forward=True)[1][0] == 0.0

    @property
    def is_linear(self) -> bool:
        """Whether one stiffness holds for all twists."""
        return self.core().pieces == 1

    def all_slopes(self) -> list[float]:
        """Slopes of the segments [N·m/rad], at positive twists outwards, then at negative ones."""
        curve = self.core()
        return [slope for forward in (True, False) for slope in curve.side(forward)[1]]

    def pieces(self) -> tuple[list[float], list[float]]:
        """(breaks [rad], slopes [N·m/rad]) of one direction, for what takes both as the same.

        Raises InputError: they are not.
        """
        curve = self.core()
        if not curve.odd:
            raise InputError(
                "differs between the two directions of twist, and here one curve is taken for both; make them the same",
                "stiffness",
            )
        return curve.side(forward=True)


class TorsionCurve(TorsionCurveFields, Elastic):
    """Torque against twist (eq. 14): continuous, piecewise linear.

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

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        yield from check_segments(self.slopes, self.breaks, "torque")
        if self.backlash > 0.0 and self.preload > 0.0:
            yield "has backlash and preload; a preload removes the backlash, so give only one"

    def core(self) -> _core.TorsionCurve:
        """The curve of the solver."""
        return _core.TorsionCurve(self.core_fields())

    def closed(self) -> Self:
        """The same without its gap."""
        first = next(k for k, slope in enumerate(self.slopes) if slope > 0.0)
        gap = self.breaks[first - 1] if first else 0.0
        own = {"slopes": self.slopes[first:], "breaks": tuple(b - gap for b in self.breaks[first:]), "backlash": 0.0}
        return self.model_copy(update=own)


class LinearStiffness(Elastic):
    """One stiffness for all twists (5a)."""

    stiffness: Annotated[Stiffness, Positive]
    """torque to the twist"""
    kind: Literal["linear"] = "linear"

    def core(self) -> _core.TorsionCurve:
        """The curve of the solver."""
        return _core.TorsionCurve([], [self.stiffness])


class Rigid(Part):
    """No twist at all (7), or rigid flanks that strike at the ends of a backlash.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.Rigid(backlash="1 mrad", restitution=0.5).strikes
    True
    """

    backlash: Annotated[Angle, NotNegative] = 0.0
    """total gap at the output"""
    restitution: Annotated[Number, Share] | None = None
    """speed at which the flanks part over that at which they strike; needed with backlash"""
    kind: Literal["rigid"] = "rigid"

    @property
    def strikes(self) -> bool:
        """Whether it has backlash."""
        return self.backlash > 0.0

    @rule
    def _is_whole(self) -> Iterator[str]:
        if self.strikes and self.restitution is None:
            yield "has rigid flanks with backlash; give their restitution, 0 to 1, or a stiffness"
        if not self.strikes and self.restitution is not None:
            yield "has a restitution but no backlash; give both or none"


class Hysteresis(Part):
    """Turning-point hysteresis (16)."""

    efficiency: Annotated[Number, UpToOne]
    """eta_H, average efficiency of the hysteresis process; 1: none"""
