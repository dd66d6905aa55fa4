"""Elements that hold a shaft or join two at the same speed: brakes, clutches, freewheels, torque limiters, ratchets."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from ..inputs import core_parameters
from ..inputs.core_parameters import CommandedFields
from ..inputs.part import Part, rule
from ..inputs.quantities import NotNegative, Number, Time
from .signals import Signal

FULL_COMMAND = 1.0 + 1e-9
"""Greatest command of a brake or clutch: the full torque, up to the rounding of a sum of signals."""


class BetweenShafts(Part):
    """Base of the elements that join two shafts."""

    holds: ClassVar[bool] = True  #: whether it may hold them at one speed
    strikes: ClassVar[bool] = False  #: whether its parts strike each other
    input: str  #: shaft
    output: str  #: shaft


class Commanded(CommandedFields):
    """Dry friction with a capacity that its command applies, with the delays of a data sheet."""

    engagement_delay: Annotated[Time, NotNegative] = 0.0  #: from a step up of the command until it acts
    release_delay: Annotated[Time, NotNegative] = 0.0  #: from a step down of the command until it acts

    def acting(self, command: Signal[Number]) -> Signal[Number]:
        """The command as it acts, after the delays.

        Raises ValueError: it exceeds 1. With delays, the command is not made of steps, or a step would act before the
            one that precedes it.
        """
        if (greatest := command.upper_bound()) > FULL_COMMAND:
            raise ValueError(f"may reach {greatest:.6g}; it is a share, and 1 is the full torque, {self.torque:g} N*m")
        return command.delayed(self.engagement_delay, self.release_delay)

    @rule
    def _holds_at_least_its_torque(self) -> Iterator[str]:
        if self.breakaway_torque is not None and self.breakaway_torque < self.torque:
            yield (
                f"has breakaway_torque = {self.breakaway_torque} N*m, less than its torque in motion, {self.torque} N*m; "
                "give at least that, or leave it out"
            )

    def holding(self) -> float:
        """Capacity at rest [N·m]."""
        return self.torque if self.breakaway_torque is None else self.breakaway_torque


class Brake(Commanded):
    """A holding brake: dry friction between a shaft and the frame.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Brake(shaft="motor", torque="2 N*m").torque
    2.0
    """

    shaft: str
    """shaft that the brake holds"""


class Clutch(Commanded, BetweenShafts):
    """Dry friction between two shafts.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Clutch(input="engine", output="drum", torque="30 N*m").torque
    30.0
    """

    kind: Literal["friction", "safety"] = "friction"
    """`friction`: engaged by its command; `safety`: always engaged, slips at its torque"""

    @rule
    def _only_commanded_clutches_have_delays(self) -> Iterator[str]:
        if self.kind == "safety" and (self.engagement_delay or self.release_delay):
            yield "is a safety clutch, which has no command; remove engagement_delay and release_delay"

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units."""
        return super().core_fields() | {"safety": self.kind == "safety"}


class Freewheel(BetweenShafts):
    """A one-way clutch: it drives the output forward and never backward.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Freewheel(input="motor", output="drum").input
    'motor'
    """

    output: str
    """shaft, which may run ahead"""

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core: none."""
        return {}


class TorqueLimiter(core_parameters.TorqueLimiterFields, BetweenShafts):
    """Holds two shafts together up to `release_torque`, then slips at `slip_torque` until it engages again.

    It engages where it slips slower than `engaging_speed`: at once or, with `pockets`, at the next of these.

    Examples
    --------
    >>> import lostmotion as lm
    >>> limiter = lm.model.TorqueLimiter(input="motor", output="drum", release_torque="30 N*m", slip_torque="5 N*m")
    >>> limiter.release_torque
    30.0
    """

    @rule
    def _slips_at_less(self) -> Iterator[str]:
        if self.slip_torque > self.release_torque:
            yield (
                f"has slip_torque = {self.slip_torque} N*m, more than release_torque = {self.release_torque} N*m; "
                "give at most that"
            )


class Ratchet(core_parameters.RatchetFields, BetweenShafts):
    """Drives the output forward by the teeth of a wheel; backward it runs free, and holds again at the next tooth.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.Ratchet(input="handle", output="drum", teeth=24).teeth
    24
    """

    strikes: ClassVar[bool] = True
