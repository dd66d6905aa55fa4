"""Elements that depend on the angle of a shaft: gravity, cogging, ripple, and the transmission error of a gear."""

import itertools
import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from .. import _core
from ..inputs.breakpoints import check_apart
from ..inputs.part import Part
from ..inputs.quantities import Angle, Length, Mass, NotNegative, Positive, Torque, Whole
from .shaft import SHARE

STANDARD_GRAVITY = 9.80665  # [m/s^2]


class Harmonic(Part):
    """``amplitude * sin(order * phi + phase)``, by straight lines."""

    kind: Literal["sine"] = "sine"
    order: Annotated[Whole, Field(ge=1, le=10_000)] = 1
    """periods in one turn of the shaft"""
    phase: Angle = 0.0

    def _core_curve(self, amplitude: float, error: float | None) -> _core.PeriodicCurve:
        return _core.PeriodicCurve.sine(
            amplitude, self.order, self.phase, SHARE * abs(amplitude) if error is None else error
        )


class AngleCurve(Part):
    """Straight lines through points over one period; the last leads back to the first."""

    kind: Literal["curve"] = "curve"
    period: Annotated[Angle, Positive] = 2.0 * math.pi
    """left out, one turn of the shaft"""
    angles: tuple[Annotated[Angle, NotNegative], ...] = Field(min_length=2, max_length=1000)
    """rising from 0, below the period"""

    def _check_points(self, values: tuple[float, ...]) -> None:
        if len(self.angles) != len(values):
            raise ValueError(f"has {len(self.angles)} angles and {len(values)} values; give as many of each")
        if self.angles[0] != 0.0:
            raise ValueError(f"has angles that begin at {self.angles[0]}; the first must be 0")
        for k, (a, b) in enumerate(itertools.pairwise(self.angles)):
            if b <= a:
                raise ValueError(f"angles must rise, but angles[{k + 1}] = {b} follows {a}")
        check_apart((*self.angles, self.period), "angles")
        if self.angles[-1] >= self.period:
            raise ValueError(
                f"has angles that end at {self.angles[-1]}; the last must be below the period {self.period}, where the first value comes again"
            )


class PeriodicTorque:
    """Base of the torques on a shaft over its angle."""

    table_of_core: ClassVar[str] = "angle_torques"

    def core(self) -> _core.PeriodicCurve:
        raise NotImplementedError

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return {"torque": self.core()}


class TorqueHarmonic(PeriodicTorque, Harmonic):
    """A torque on the shaft ``amplitude * sin(order * phi + phase)``, by straight lines: cogging, ripple, unbalance."""

    shaft: str
    """on which it acts, in the direction of its angle"""
    amplitude: Annotated[Torque, Positive]
    error: Annotated[Torque, Positive] | None = None
    """by which the straight lines depart from the sine at most; left out, 0.1 % of the amplitude"""

    def core(self) -> _core.PeriodicCurve:
        return self._core_curve(self.amplitude, self.error)


class TorqueCurve(PeriodicTorque, AngleCurve):
    """A torque on the shaft over its angle: straight lines through points over one period."""

    shaft: str
    """on which it acts, in the direction of its angle"""
    torques: tuple[Torque, ...]

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        self._check_points(self.torques)
        return self

    def core(self) -> _core.PeriodicCurve:
        return _core.PeriodicCurve(self.period, list(self.angles), list(self.torques))


class ErrorHarmonic(Harmonic):
    """A transmission error ``amplitude * sin(order * phi + phase)`` over the angle of the input shaft, by straight lines."""

    amplitude: Annotated[Angle, Positive]
    """at the output"""
    error: Annotated[Angle, Positive] | None = None
    """by which the straight lines depart from the sine at most; left out, 0.1 % of the amplitude"""

    def core(self) -> _core.PeriodicCurve:
        return self._core_curve(self.amplitude, self.error)


class ErrorCurve(AngleCurve):
    """A transmission error over the angle of the input shaft: straight lines through points over one period."""

    errors: tuple[Angle, ...]
    """at the output"""

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        self._check_points(self.errors)
        return self

    def core(self) -> _core.PeriodicCurve:
        return _core.PeriodicCurve(self.period, list(self.angles), list(self.errors))


class Gravity(PeriodicTorque, Part):
    """A mass off the axis of a horizontal shaft: the torque ``-m g r sin(phi + angle)``, by straight lines."""

    shaft: str
    """shaft that carries the mass"""
    mass: Annotated[Mass, Positive]
    radius: Annotated[Length, Positive]
    """distance of the centre of mass from the axis"""
    angle: Angle = 0.0
    """angle of the mass when the shaft's angle is 0; 0: it hangs straight down, positive in the direction of the shaft's angle"""
    error: Annotated[Torque, Positive] | None = None
    """by which the straight lines depart from the sine at most; left out, 0.1 % of m g r"""

    def core(self) -> _core.PeriodicCurve:
        amplitude = self.mass * STANDARD_GRAVITY * self.radius
        return _core.PeriodicCurve.sine(
            -amplitude, 1, self.angle, SHARE * amplitude if self.error is None else self.error
        )


AngleTorque = Annotated[TorqueHarmonic | TorqueCurve, Field(discriminator="kind")]
TransmissionError = Annotated[ErrorHarmonic | ErrorCurve, Field(discriminator="kind")]
