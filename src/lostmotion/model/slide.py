"""Slides: parts that move along a straight line, and their friction."""

import math
from collections.abc import Iterator
from typing import Annotated

from ..inputs import core_parameters
from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, Limit, Mass, NotNegative
from ..reproducible import sin
from ..units.conversion import Unit
from .angle_torques import STANDARD_GRAVITY
from .end_stops import EndStops
from .shaft import FrictionCurve, Shaft, check_friction, check_points


class ForceCurve(core_parameters.ForceCurveFields):
    """Dry friction force over the magnitude of the speed: straight lines through the points, constant beyond the last."""

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        yield from check_points(self.speeds, self.forces, "forces")


class Movable(Part):
    """A mass that moves along a straight line, without its friction."""

    mass: Annotated[Mass, NotNegative] = 0.0  #: mass of all that moves, without masses of linear motors
    viscous_friction: Annotated[float, Unit("N*s/m"), NotNegative] = 0.0  #: against the frame
    inclination: Annotated[Angle, Limit(ge=-0.5 * math.pi, le=0.5 * math.pi)] = 0.0
    """inclination of the positive direction above the horizontal; 90 deg: vertical, positive upwards. The weight's share along the slide acts against it"""
    end_stops: EndStops | None = None  #: stops at both ends of the travel


class Slide(core_parameters.SlideFrictionFields, Movable):
    """A mass that moves along a straight line: a table, a carriage, a ram. Masses of linear motors on it are added.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Slide(mass="20 kg", friction_force="30 N", inclination="90 deg").weight()
    196.13299999999998
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.mass:.4g} kg)"

    @rule
    def _friction_is_clear(self) -> Iterator[str]:
        yield from check_friction(self, "force", "N")

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
