"""Springs between a shaft and the frame: counterbalances, flexure pivots, cables that are wound up, end stops."""

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import Field

from ..inputs.core_parameters import SpringFields
from .torsion import LinearStiffness, TorsionCurve


class Spring(SpringFields):
    """A spring between a shaft and the frame: the torque ``-P(phi - rest_angle)`` on the shaft.

    With `backlash`, a torsion curve leaves the shaft free between two elastic end stops.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Spring(shaft="joint", stiffness={"kind": "linear", "stiffness": "20 N*m/rad"}).shaft
    'joint'
    """

    shaft: str
    """on which it acts"""
    stiffness: Annotated[TorsionCurve | LinearStiffness, Field(discriminator="kind")]
    """P over the angle from the rest angle on"""

    @property
    def is_linear(self) -> bool:
        """Whether it has one linear regime."""
        return self.stiffness.is_linear

    def over_angle(self) -> Callable[[float], float]:
        """Its torque [N·m] on the shaft over the angle [rad]."""
        curve, rest = self.stiffness.core(), self.rest_angle
        return lambda angle: -curve.torque(angle - rest)

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return super().core_fields() | {"curve": self.stiffness.core()}
