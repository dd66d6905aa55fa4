"""Linear motors: a force on a slide, from the data of the motor."""

import math
from typing import Self

from pydantic import field_validator, model_validator

from ..inputs import described
from .angle_torques import PositionHarmonic
from .motor import MotorLimits, ShaftMotor
from .notes import NO_NOTE, Note, note_is_about


class LinearMotorData(described.LinearMotorDataFields):
    """A linear motor alone, as a data sheet has it: a source of force.

    Examples
    --------
    >>> LinearMotorData(force_constant="50 N/A", rated_current="4 A", peak_current="12 A").forces()
    (200.0, 600.0)
    """

    note: Note = NO_NOTE
    """for readers of the results: text, or by the key that it is about"""

    _note_is_about_a_key = field_validator("note")(classmethod(note_is_about))

    @model_validator(mode="after")
    def _is_a_motor(self) -> Self:
        for name in ("rated", "peak"):
            force, current = f"{name}_force", f"{name}_current"
            if getattr(self, current) is not None and self.force_constant is None:
                raise ValueError(f"has {current} without force_constant; add it, or give {force}")
            if getattr(self, force) is not None and getattr(self, current) is not None:
                raise ValueError(f"has {force} and {current}, which with force_constant say the same; give one")
        rated, peak = self.forces()
        if peak < rated:
            raise ValueError(
                f"has a peak force of {peak:g} N, less than the rated one, {rated:g} N; give at least that"
            )
        if (self.cogging_force is None) != (self.pole_pitch is None):
            raise ValueError("has one of cogging_force and pole_pitch; the cogging needs both")
        if self.cogging_error is not None and self.cogging_force is None:
            raise ValueError("has a cogging_error without cogging_force; add it, or leave the error out")
        return self

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
