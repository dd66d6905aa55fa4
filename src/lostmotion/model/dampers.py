"""Dampers between two shafts: viscous and fluid couplings, eddy-current couplings, torsional vibration dampers."""

from collections.abc import Iterator
from typing import ClassVar

from ..inputs.core_parameters import DamperFields
from ..inputs.part import rule
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

    @rule
    def _has_a_torque(self) -> Iterator[str]:
        if self.drag is None and not self.viscous_friction:
            yield "has no torque at any slip; give viscous_friction or drag"
