"""Gearboxes: parameters and ratings."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from ..inputs.part import Part
from ..inputs.quantities import (
    Inertia,
    NotNegative,
    Number,
    Positive,
    Speed,
    Torque,
    ViscousFriction,
)
from ..units.practical import practical
from .losses import ConstantEfficiency, LossMap
from .torsion import Hysteresis, LinearStiffness, Rigid, TorsionCurve


class GearboxLimits(Part):
    """What a gearbox can stand. No run depends on it; the drive check compares with it."""

    average_output_torque: Annotated[Torque, Positive] | None = None
    peak_output_torque: Annotated[Torque, Positive] | None = None
    """repeated, as in acceleration"""
    momentary_output_torque: Annotated[Torque, Positive] | None = None
    """in an emergency stop"""
    average_input_speed: Annotated[Speed, Positive] | None = None
    """for the mean over a duty cycle; left out, the rated speed stands in for it"""
    max_input_speed: Annotated[Speed, Positive] | None = None


class Transmission(Part):
    """What gearboxes and gears of a drive train have in common: ratio, inertia, compliance."""

    ratio: Number
    """i_C, input speed / output speed; below 0, the output turns against the input"""
    inertia: Annotated[Inertia, NotNegative] = 0.0
    """J_R, on the input shaft"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    """b_MR, on the input shaft"""
    rated_input_speed: Annotated[Speed, Positive] | None = None
    """n_1R"""
    rated_output_torque: Annotated[Torque, Positive] | None = None
    """T_2R"""
    stiffness: Annotated[TorsionCurve | LinearStiffness | Rigid, Field(discriminator="kind")]
    hysteresis: Hysteresis | None = None
    limits: GearboxLimits | None = None
    note: str = ""
    """what a reader of the results must know, such as that a loss table is a stand-in"""

    @model_validator(mode="after")
    def _hysteresis_needs_compliance(self) -> Self:
        if self.hysteresis is not None and self.hysteresis.efficiency < 1.0 and isinstance(self.stiffness, Rigid):
            raise ValueError("has hysteresis but is rigid; leave hysteresis out or give it a stiffness")
        return self


class Gearbox(Transmission):
    """A compliance and a loss law, each chosen freely."""

    ratio: Annotated[Number, Positive]
    """i_C, input speed / output speed"""
    rated_input_speed: Annotated[Speed, Positive]
    """n_1R"""
    rated_output_torque: Annotated[Torque, Positive]
    """T_2R"""
    losses: Annotated[ConstantEfficiency | LossMap, Field(discriminator="kind")]

    def __repr__(self) -> str:
        laws = f"stiffness {self.stiffness.kind}, losses {self.losses.kind}"
        rated = f"{self.rated_output_torque:.4g} N·m at {practical(self.rated_input_speed, 'rad/s', 4)}"
        return f"Gearbox({self.ratio:g}:1, {rated}, {laws})"
