"""Dampers between two shafts: viscous and fluid couplings, eddy-current couplings, torsional vibration dampers."""

from typing import ClassVar, Self

from pydantic import model_validator

from ..inputs.core_parameters import DamperFields
from .couplings import BetweenShafts
from .shaft import WithDrag


class Damper(WithDrag, DamperFields, BetweenShafts):
    """A torque over the slip, which is the speed of the input minus the speed of the output: it drives the output and brakes the
    input.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Damper(input="motor", output="ring", viscous_friction="0.1 N*m*s").viscous_friction
    0.1
    """

    holds: ClassVar[bool] = False

    @property
    def is_linear(self) -> bool:
        """Whether it has one linear regime."""
        return self.drag is None

    @model_validator(mode="after")
    def _has_a_torque(self) -> Self:
        if self.drag is None and not self.viscous_friction:
            raise ValueError("has no torque at any slip; give viscous_friction or drag")
        return self
