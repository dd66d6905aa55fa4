"""Slides: parts that move along a straight line, and their friction."""

from typing import Self

from pydantic import model_validator

from ..inputs import described
from ..reproducible import sin
from .angle_torques import STANDARD_GRAVITY
from .end_stops import EndStops  # noqa: F401
from .shaft import FrictionCurve, Shaft, check_friction, check_points


class ForceCurve(described.ForceCurveFields):
    """Dry friction force over the magnitude of the speed: straight lines through the points, constant beyond the last."""

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        check_points(self.speeds, self.forces, "forces")
        return self


class Slide(described.SlideFrictionFields, described.SlideFields):
    """A mass that moves along a straight line: a table, a carriage, a ram. Masses of linear motors on it are added.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Slide(mass="20 kg", friction_force="30 N", inclination="90 deg").weight()
    196.13299999999998
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.mass:.4g} kg)"

    @model_validator(mode="after")
    def _friction_is_clear(self) -> Self:
        check_friction(self, "force", "N")
        return self

    def weight(self, mass: float | None = None) -> float:
        """Force of gravity against the positive direction [N], of its own mass or of another one [kg]."""
        return (self.mass if mass is None else mass) * STANDARD_GRAVITY * sin(self.inclination)

    def shaft(self) -> Shaft:
        """The same as a shaft of the equations, in units of translation."""
        curve = self.friction_curve
        return Shaft(
            domain="translation",
            inertia=self.mass,
            viscous_friction=self.viscous_friction,
            friction_torque=self.friction_force,
            breakaway_torque=self.breakaway_force,
            stribeck_speed=self.stribeck_speed,
            friction_error=self.friction_error,
            friction_curve=None if curve is None else FrictionCurve(speeds=curve.speeds, torques=curve.forces),
            end_stops=None if self.end_stops is None else self.end_stops.of_shaft(),
        )
