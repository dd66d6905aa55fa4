"""The driven body."""

from typing import Annotated

from ..inputs.part import Part
from ..inputs.quantities import (
    Inertia,
    NotNegative,
    Positive,
    Torque,
    ViscousFriction,
)


class Load(Part):
    """The driven body (3b)."""

    def __repr__(self) -> str:
        return f"Load({self.inertia:.4g} kg·m²)"

    inertia: Annotated[Inertia, Positive]
    """J_Z"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    """b_ZR"""
    friction_torque: Annotated[Torque, NotNegative] = 0.0
    """dry friction of the bearing"""
