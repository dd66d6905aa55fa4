"""Springs between a shaft and the frame: counterbalances, flexure pivots, cables that are wound up, end stops."""

from typing import Annotated, Any

from pydantic import Field

from ..inputs.part import Part
from ..inputs.quantities import Angle
from .torsion import LinearStiffness, TorsionCurve


class Spring(Part):
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
    rest_angle: Angle = 0.0
    """angle of the shaft at which the spring has no torque"""

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return {"curve": self.stiffness.core(), "rest_angle": self.rest_angle}
