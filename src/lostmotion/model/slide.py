"""Slides: parts that move along a straight line, their friction and end stops."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from ..inputs.part import Part
from ..inputs.quantities import (
    Angle,
    AxialStiffness,
    Force,
    Length,
    Limit,
    LinearSpeed,
    LinearViscousFriction,
    Mass,
    NotNegative,
    Positive,
)
from ..reproducible import sin
from .angle_torques import STANDARD_GRAVITY
from .shaft import FrictionCurve, Shaft, check_points
from .springs import Spring
from .torsion import TorsionCurve


class ForceCurve(Part):
    """Dry friction force over the magnitude of the speed: straight lines through the points, constant beyond the last."""

    speeds: tuple[Annotated[LinearSpeed, NotNegative], ...] = Field(min_length=2, max_length=100)
    """rising from 0"""
    forces: tuple[Annotated[Force, NotNegative], ...]

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        check_points(self.speeds, self.forces, "forces")
        return self


class EndStops(Part):
    """Elastic stops at both ends of the travel: free between them, a spring beyond."""

    lower: Length
    upper: Length
    stiffness: Annotated[AxialStiffness, Positive]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.upper <= self.lower:
            raise ValueError(f"has upper = {self.upper} m, which is not above lower = {self.lower} m; exchange them")
        return self

    def spring(self, slide: str) -> Spring:
        """The same as a spring on the slide."""
        curve = TorsionCurve(slopes=(self.stiffness,), backlash=self.upper - self.lower)
        return Spring(shaft=slide, stiffness=curve, rest_angle=0.5 * (self.lower + self.upper))


class Slide(Part):
    """A mass that moves along a straight line: a table, a carriage, a ram. Masses of linear motors on it are added.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Slide(mass="20 kg", friction_force="30 N", inclination="90 deg").weight()
    196.13299999999998
    """

    mass: Annotated[Mass, NotNegative] = 0.0
    viscous_friction: Annotated[LinearViscousFriction, NotNegative] = 0.0
    friction_force: Annotated[Force, NotNegative] = 0.0
    """dry friction while it slips"""
    breakaway_force: Annotated[Force, NotNegative] | None = None
    """dry friction at rest; left out, the same"""
    stribeck_speed: Annotated[LinearSpeed, Positive] | None = None
    """v_S: the friction falls from breakaway_force to friction_force by ``exp(-(v/v_S)^2)``; left out, at once"""
    friction_error: Annotated[Force, Positive] | None = None
    """by which straight lines depart from that curve at most; left out, 0.1 % of the difference of both forces"""
    friction_curve: ForceCurve | None = None
    """dry friction over speed, in place of friction_force and stribeck_speed"""
    inclination: Annotated[Angle, Limit(ge=-0.5 * math.pi, le=0.5 * math.pi)] = 0.0
    """inclination of the positive direction above the horizontal; 90 deg: vertical, positive upwards. The weight's share along the slide acts
    against it"""
    end_stops: EndStops | None = None

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.mass:.4g} kg)"

    @model_validator(mode="after")
    def _friction_is_clear(self) -> Self:
        slipping = self.friction_force
        if self.friction_curve is not None:
            for key in ("friction_force", "stribeck_speed"):
                if getattr(self, key):
                    raise ValueError(f"has {key} and friction_curve, which say the same; give one")
            slipping = self.friction_curve.forces[0]
        if self.breakaway_force is not None and self.breakaway_force < slipping:
            raise ValueError(
                f"has breakaway_force = {self.breakaway_force} N, less than its friction in motion, {slipping} N; "
                "give at least that, or leave it out"
            )
        if self.stribeck_speed is not None and not (self.breakaway_force or 0.0) > slipping:
            raise ValueError("has a stribeck_speed, which needs a breakaway_force above friction_force; give it")
        if self.friction_error is not None and self.stribeck_speed is None:
            raise ValueError("has a friction_error, which belongs to stribeck_speed; leave it out")
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
        )
