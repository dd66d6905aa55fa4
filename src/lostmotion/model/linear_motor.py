"""Linear motors: a force on a slide, from the data of the motor."""

import math
from collections.abc import Iterator
from typing import Annotated

from pydantic import field_validator

from ..inputs.part import Part, rule
from ..inputs.quantities import Current, Force, Length, Mass, NotNegative, Positive
from ..units.conversion import Unit
from .angle_torques import PositionHarmonic
from .motor import MotorLimits, ShaftMotor
from .notes import NO_NOTE, Note, note_is_about


class LinearMotorData(Part):
    """A linear motor alone, as a data sheet has it: a source of force.

    Examples
    --------
    >>> LinearMotorData(force_constant="50 N/A", rated_current="4 A", peak_current="12 A").forces()
    (200.0, 600.0)
    """

    mass: Annotated[Mass, NotNegative] = 0.0  #: mass of the part that moves
    rated_force: Annotated[Force, Positive] | None = None  #: force at command 1
    peak_force: Annotated[Force, Positive] | None = None  #: at which the force ends; left out, without limit
    force_constant: Annotated[float, Unit("N/A"), Positive] | None = None
    """force to one ampere, rms or amplitude as the currents beside it"""
    rated_current: Annotated[Current, Positive] | None = None  #: with force_constant, in place of rated_force
    peak_current: Annotated[Current, Positive] | None = None  #: with force_constant, in place of peak_force
    friction_force: Annotated[Force, NotNegative] = 0.0  #: dry friction
    cogging_force: Annotated[Force, Positive] | None = None  #: amplitude, over the position with the period pole_pitch
    cogging_error: Annotated[Force, Positive] | None = None
    """by which the straight lines depart from the sine of the cogging at most; left out, 0.1 % of cogging_force"""
    pole_pitch: Annotated[Length, Positive] | None = None
    """tau, from a north pole to the next south pole: half a magnetic period"""
    note: Note = NO_NOTE  #: for readers of the results: text, or by the key that it is about

    _note_is_about_a_key = field_validator("note")(classmethod(note_is_about))

    @rule
    def _is_a_motor(self) -> Iterator[str]:
        for name in ("rated", "peak"):
            force, current = f"{name}_force", f"{name}_current"
            if getattr(self, current) is not None and self.force_constant is None:
                yield f"has {current} without force_constant; add it, or give {force}"
            if getattr(self, force) is not None and getattr(self, current) is not None:
                yield f"has {force} and {current}, which with force_constant say the same; give one"
        rated, peak = self.forces()
        if peak < rated:
            yield f"has a peak force of {peak:g} N, less than the rated one, {rated:g} N; give at least that"
        if (self.cogging_force is None) != (self.pole_pitch is None):
            yield "has one of cogging_force and pole_pitch; the cogging needs both"
        if self.cogging_error is not None and self.cogging_force is None:
            yield "has a cogging_error without cogging_force; add it, or leave the error out"

    def forces(self) -> tuple[float, float]:
        """(rated, peak) [N]; infinite without a limit."""
        rated, peak = self.rated_force, self.peak_force
        if rated is None:
            if self.rated_current is None or self.force_constant is None:
                raise ValueError("lacks rated_force, or force_constant and rated_current; add it")
            rated = self.force_constant * self.rated_current
        if peak is None and self.peak_current is not None and self.force_constant is not None:
            peak = self.force_constant * self.peak_current
        return rated, math.inf if peak is None else peak


class LinearMotor(LinearMotorData):
    """A linear motor that moves a slide: its command times the rated force acts without delay.

    Examples
    --------
    >>> import lostmotion as lm
    >>> motor = lm.model.LinearMotor(slide="table", rated_force="200 N", peak_force="600 N", mass="2.5 kg")
    >>> motor.motor().torque_limit
    600.0
    """

    slide: str

    def motor(self) -> ShaftMotor:
        """The source of torque with the same equations."""
        rated, peak = self.forces()
        limit = None if math.isinf(peak) else peak
        return ShaftMotor(
            kind="torque_source",
            shaft=self.slide,
            rotor_inertia=self.mass,
            friction_torque=self.friction_force,
            rated_torque=rated,
            torque_limit=limit,
            limits=MotorLimits(continuous_torque=rated, peak_torque=limit),
        )

    def cogging(self) -> PositionHarmonic | None:
        """Its cogging as a force over the position; None without."""
        if self.cogging_force is None or self.pole_pitch is None:
            return None
        return PositionHarmonic(
            shaft=self.slide, amplitude=self.cogging_force, period=self.pole_pitch, error=self.cogging_error
        )
