"""Elements that depend on the angle of a shaft: gravity, cogging, ripple, and the transmission error of a gear."""

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from .. import _core
from ..inputs import core_parameters
from ..inputs.breakpoints import check_apart, check_rising
from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, Length, Mass, NotNegative, Positive, Torque

STANDARD_GRAVITY = 9.80665  # [m/s^2]


class Harmonic(core_parameters.HarmonicFields):
    """``amplitude * sin(order * phi + phase)``, by straight lines."""

    kind: Literal["sine"] = "sine"

    if TYPE_CHECKING:
        amplitude: Any  # in which unit, each of them says
        error: Any

    def core(self) -> _core.PeriodicCurve:
        return _core.harmonic({key: getattr(self, key) for key in ("amplitude", "order", "phase", "error")})


class AngleCurve(Part):
    """Straight lines through points over one period; the last leads back to the first."""

    of_value: ClassVar[str] = "errors"  #: key of the values

    period: Annotated[Angle, Positive] = 2.0 * math.pi  #: left out, one turn of the shaft
    angles: Annotated[tuple[Annotated[Angle, NotNegative], ...], Field(min_length=2, max_length=1000)]
    """rising from 0, below the period"""
    kind: Literal["curve"] = "curve"

    def values(self) -> tuple[float, ...]:
        """Value at each angle."""
        found: tuple[float, ...] = getattr(self, self.of_value)
        return found

    def core(self) -> _core.PeriodicCurve:
        return _core.PeriodicCurve(self.period, self.angles, self.values())

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        values = self.values()
        if len(self.angles) != len(values):
            yield f"has {len(self.angles)} angles and {len(values)} values; give as many of each"
        if self.angles[0] != 0.0:
            yield f"has angles that begin at {self.angles[0]}; the first must be 0"
        yield from check_rising(self.angles, "angles")
        check_apart((*self.angles, self.period), "angles")
        if self.angles[-1] >= self.period:
            yield f"has angles that end at {self.angles[-1]}; the last must be below the period {self.period}, where the first value comes again"


class PeriodicTorque:
    """Base of the torques on a shaft over its angle."""

    table_of_core: ClassVar[str] = "angle_torques"

    if TYPE_CHECKING:

        def core(self) -> _core.PeriodicCurve: ...

    def over_angle(self) -> Callable[[float], float]:
        """Its torque [N·m] on the shaft over the angle [rad], as the solver has it."""
        return self.core()

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return {"torque": self.core()}


class TorqueHarmonic(PeriodicTorque, core_parameters.TorqueHarmonicFields, Harmonic):
    """A torque on the shaft ``amplitude * sin(order * phi + phase)``, by straight lines: cogging, ripple, unbalance."""

    shaft: str
    """on which it acts, in the direction of its angle"""


class TorqueCurve(PeriodicTorque, AngleCurve):
    """A torque on the shaft over its angle: straight lines through points over one period."""

    of_value: ClassVar[str] = "torques"
    torques: tuple[Torque, ...]
    """torque at each angle"""
    shaft: str
    """on which it acts, in the direction of its angle"""


class PositionHarmonic(PeriodicTorque, Part):
    """A force on a slide ``amplitude * sin(2 pi x / period)`` over its position, by straight lines."""

    shaft: str
    amplitude: float
    period: float
    error: float | None = None

    def core(self) -> _core.PeriodicCurve:
        return _core.harmonic({key: getattr(self, key) for key in ("amplitude", "period", "error")})


class ErrorHarmonic(core_parameters.ErrorHarmonicFields, Harmonic):
    """A transmission error ``amplitude * sin(order * phi + phase)`` over the angle of the input shaft, by straight lines."""


class ErrorCurve(AngleCurve):
    """A transmission error over the angle of the input shaft: straight lines through points over one period."""

    errors: tuple[Angle, ...]
    """at the output"""


class Gravity(PeriodicTorque, Part):
    """A mass off the axis of a horizontal shaft: the torque ``-m g r sin(phi + angle)``, by straight lines."""

    mass: Annotated[Mass, Positive]
    """mass off the axis"""
    radius: Annotated[Length, Positive]
    """distance of the centre of mass from the axis"""
    angle: Angle = 0.0
    """angle of the mass when the shaft's angle is 0; 0: it hangs straight down, positive in the direction of the shaft's angle"""
    error: Annotated[Torque, Positive] | None = None
    """by which the straight lines depart from the sine at most; left out, 0.1 % of m g r"""
    shaft: str
    """shaft that carries the mass"""

    def core(self) -> _core.PeriodicCurve:
        amplitude = self.mass * STANDARD_GRAVITY * self.radius
        return _core.harmonic({"amplitude": -amplitude, "phase": self.angle, "error": self.error})


AngleTorque = Annotated[TorqueHarmonic | TorqueCurve, Field(discriminator="kind")]
TransmissionError = Annotated[ErrorHarmonic | ErrorCurve, Field(discriminator="kind")]
