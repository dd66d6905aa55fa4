"""The driven body."""

from typing import Annotated

from ..inputs.part import Part
from ..inputs.quantities import Inertia, NotNegative, Positive, Torque, ViscousFriction


class Load(Part):
    """Inertia, friction and torque at the output of the gearbox (3b).

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Load(inertia="2 kg*m^2", friction_torque="0.5 N*m").friction_torque
    0.5
    """

    inertia: Annotated[Inertia, Positive]
    """J_Z"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    """b_ZR"""
    friction_torque: Annotated[Torque, NotNegative] = 0.0
    """dry friction of the bearing"""

    def __repr__(self) -> str:
        return f"Load({self.inertia:.4g} kg·m²)"
