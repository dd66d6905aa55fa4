"""A shaft of a drive train: inertia, friction and drag."""

import itertools
from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field

from .. import _core
from ..inputs import core_parameters
from ..inputs.breakpoints import check_apart, check_rising
from ..inputs.part import Part, rule
from ..inputs.quantities import NotNegative, Number, Positive, Speed, Torque
from .end_stops import ShaftEndStops

SHARE = _core.USUAL_ERROR


def check_points(speeds: tuple[float, ...], torques: tuple[float, ...], what: str = "torques") -> Iterator[str]:
    """Refuse points that are no curve over speed."""
    if len(speeds) != len(torques):
        yield f"has {len(speeds)} speeds and {len(torques)} {what}; give as many of each"
    if speeds[0] != 0.0:
        yield f"has speeds that begin at {speeds[0]}; the first must be 0"
    yield from check_rising(speeds, "speeds")
    check_apart(speeds, "speeds")


def check_friction(part: Any, force: str, unit: str) -> Iterator[str]:
    """Refuse dry friction that is stated twice or rises when a shaft or slide breaks away.

    force: in the keys of the part: `torque` or `force`, in the unit given.
    """
    slipping, breakaway = getattr(part, f"friction_{force}"), getattr(part, f"breakaway_{force}")
    if part.friction_curve is not None:
        for key in (f"friction_{force}", "stribeck_speed"):
            if getattr(part, key):
                yield f"has {key} and friction_curve, which say the same; give one"
        slipping = getattr(part.friction_curve, f"{force}s")[0]
    if breakaway is not None and breakaway < slipping:
        yield (
            f"has breakaway_{force} = {breakaway} {unit}, less than its friction in motion, {slipping} {unit}; "
            "give at least that, or leave it out"
        )
    if part.stribeck_speed is not None and not (breakaway or 0.0) > slipping:
        yield f"has a stribeck_speed, which needs a breakaway_{force} above friction_{force}; give it"
    if part.friction_error is not None and part.stribeck_speed is None:
        yield "has a friction_error, which belongs to stribeck_speed; leave it out"


class FrictionCurve(core_parameters.FrictionCurveFields):
    """Dry friction torque over the magnitude of the speed: straight lines through the points, constant beyond the last."""

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        yield from check_points(self.speeds, self.torques)


class DragCurve(Part):
    """Torque against the motion over the magnitude of the speed: straight lines through points."""

    speeds: Annotated[tuple[Annotated[Speed, NotNegative], ...], Field(min_length=2, max_length=100)]
    """rising from 0"""
    torques: tuple[Annotated[Torque, NotNegative], ...]
    """the first is 0: what holds at rest is friction"""
    beyond: Literal["extend", "hold"] = "extend"
    """beyond the last point: the last line goes on, or the last torque stays"""
    backward: Annotated[Number, Positive] = 1.0
    """torque at negative speeds over that at positive ones"""
    kind: Literal["curve"] = "curve"

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        yield from check_points(self.speeds, self.torques)
        if self.torques[0] != 0.0:
            yield f"has a torque of {self.torques[0]} N*m at rest; what holds at rest is friction_torque"
        if self.beyond == "extend" and self.torques[-1] < self.torques[-2]:
            yield 'falls at its end, so that it would drive at high speed; add a point, or give beyond = "hold", which keeps the last torque'
        if not any(self.torques):
            yield "has no torque at any speed; leave drag out"

    def core(self) -> _core.TorsionCurve:
        points = list(zip(self.speeds, self.torques, strict=True))
        slopes = [(T2 - T1) / (w2 - w1) for (w1, T1), (w2, T2) in itertools.pairwise(points)]
        speeds = list(self.speeds[1:-1])
        if self.beyond == "hold":
            speeds, slopes = list(self.speeds[1:]), [*slopes, 0.0]
        if self.backward == 1.0:
            return _core.TorsionCurve(speeds, slopes)
        return _core.TorsionCurve({"slopes": slopes, "breaks": speeds, "backward": self.backward})


class QuadraticDrag(core_parameters.QuadraticDragFields):
    """Torque ``coefficient * w * |w|`` of a fan or a pump, by straight lines up to `max_speed`; beyond, the last goes on."""

    kind: Literal["quadratic"] = "quadratic"

    def core(self) -> _core.TorsionCurve:
        return _core.quadratic_drag(self.fields_of(type(self)))


class EddyCurrentDrag(Part):
    """Torque ``2 peak_torque s/(1 + s^2)`` of an eddy-current brake with ``s = w/critical_speed``, by straight lines; beyond `max_speed` the
    last torque stays.
    """

    peak_torque: Annotated[Torque, Positive]
    """at the critical speed"""
    critical_speed: Annotated[Speed, Positive]
    """speed of the largest torque"""
    max_speed: Annotated[Speed, Positive]
    """up to which the straight lines follow the law"""
    error: Annotated[Torque, Positive] | None = None
    """by which they depart from it at most; left out, 0.1 % of the peak torque"""
    kind: Literal["eddy_current"]

    @rule
    def _takes_few_lines(self) -> Iterator[str]:
        if len(self._ends()) > MOST_POINTS:
            yield f"has an error of {self._error():g} N*m, which takes more than {MOST_POINTS} straight lines; give a larger one"

    def _error(self) -> float:
        return SHARE * self.peak_torque if self.error is None else self.error

    def _ends(self) -> tuple[float, ...]:
        # The largest departure of a chord is found at 32 places.
        return _chord_ends(0.99 * self._error() / self.peak_torque, self.max_speed / self.critical_speed)

    def core(self) -> _core.TorsionCurve:
        ends = self._ends()
        speeds = [self.critical_speed * s for s in ends]
        torques = [self.peak_torque * (2.0 * s / (1.0 + s * s)) for s in ends]
        return DragCurve(speeds=tuple(speeds), torques=tuple(torques), beyond="hold").core()


MOST_POINTS = 100


@lru_cache(maxsize=64)
def _chord_ends(share: float, top: float) -> tuple[float, ...]:
    """Ends of straight lines along ``2 s/(1 + s^2)`` from 0 to `top`, one too many where these are not enough."""
    points = [0.0]
    while points[-1] < top and len(points) <= MOST_POINTS:
        s = _chord_end(points[-1], share)
        # A short last chord would be another piece for nothing.
        points.append(top if s > top - 0.1 * (s - points[-1]) else s)
    return tuple(points)


def _chord_end(begin: float, error: float) -> float:
    """End of a chord of ``2 s/(1 + s^2)`` that begins at a value of s and departs from the curve by an error."""
    low, high = begin, begin + 1.0
    while _departure(begin, high) < error and high < 1e9:
        high = begin + 2.0 * (high - begin)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _departure(begin, middle) < error else (low, middle)
    return low


def _departure(a: float, b: float) -> float:
    """Largest distance of ``2 s/(1 + s^2)`` from its chord from a to b, at 32 places between."""
    f = [2.0 * s / (1.0 + s * s) for s in (a + (b - a) * k / 32.0 for k in range(33))]
    return max(abs(f[k] - (f[0] + (f[-1] - f[0]) * k / 32.0)) for k in range(33))


class WithDrag(Part):
    """Base of the elements that a drag acts on."""

    drag: Annotated[DragCurve | QuadraticDrag | EddyCurrentDrag, Field(discriminator="kind")] | None = None
    """torque over speed against the motion, of dampers over the slip"""

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return super().core_fields() | ({} if self.drag is None else {"drag": self.drag.core()})  # type: ignore[misc, no-any-return]


class Stopped(Part):
    """A shaft that end stops hold."""

    end_stops: ShaftEndStops | None = None  #: stops at both ends of the travel


class Shaft(WithDrag, core_parameters.DryFrictionFields, Stopped, core_parameters.ShaftFields):
    """A shaft of a drive train. Rotors of motors and inertias of gears on it are added to it.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Shaft(inertia="2 kg*m^2", friction_torque="1 N*m").inertia
    2.0
    """

    domain: Literal["rotation", "translation"] = "rotation"
    """translation: a slide, which scenarios have in the table `slides`; its numbers are in kg, m and N"""

    def __repr__(self) -> str:
        unit = "kg" if self.domain == "translation" else "kg·m²"
        return f"{type(self).__name__}({self.inertia:.4g} {unit})"

    @rule
    def _friction_is_clear(self) -> Iterator[str]:
        yield from check_friction(self, "torque", "N*m")

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return super().core_fields() | {"friction": self.friction(), "domain": self.domain}

    def friction(self) -> dict[str, Any]:
        """Dry friction by its fields in the core: torque and breakaway_torque [N·m], speeds [rad/s] and torques of a curve."""
        return _core.dry_friction(self.fields_of(core_parameters.DryFrictionFields))
