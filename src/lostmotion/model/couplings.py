"""What holds a shaft or joins two at the same speed: brakes, clutches, freewheels."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import model_validator

from ..inputs.part import Part
from ..inputs.quantities import NotNegative, Positive, Time, Torque
from .signals import CommandSignal


class Commanded(Part):
    """What its command engages, with the delays of a data sheet."""

    engagement_delay: Annotated[Time, NotNegative] = 0.0
    """from a step up of the command until it acts"""
    release_delay: Annotated[Time, NotNegative] = 0.0
    """from a step down of the command until it acts"""

    def acting(self, command: CommandSignal) -> CommandSignal:
        """The command as it acts, after the delays.

        Raises
        ------
        ValueError
            With delays, the command is not made of steps, or a step would act before the one that precedes it.
        """
        return command.delayed(self.engagement_delay, self.release_delay)


class Brake(Commanded):
    """A holding brake: dry friction between a shaft and the frame, with a capacity that its command applies."""

    shaft: str
    """that it holds"""
    torque: Annotated[Torque, Positive]
    """capacity at command 1; between 0 (open) and 1 in proportion"""


class Clutch(Commanded):
    """Dry friction between two shafts."""

    kind: Literal["friction", "safety"] = "friction"
    """`friction`: engaged by its command; `safety`: always engaged, slips at its torque"""
    input: str
    """shaft"""
    output: str
    """shaft"""
    torque: Annotated[Torque, Positive]
    """capacity; of a friction clutch at command 1, between 0 (open) and 1 in proportion"""

    @model_validator(mode="after")
    def _only_commanded_clutches_have_delays(self) -> Self:
        if self.kind == "safety" and (self.engagement_delay or self.release_delay):
            raise ValueError("is a safety clutch, which has no command; remove engagement_delay and release_delay")
        return self


class Freewheel(Part):
    """A one-way clutch: it drives the output forward and never backward."""

    input: str
    """shaft"""
    output: str
    """shaft, which may run ahead"""
