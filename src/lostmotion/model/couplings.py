"""What holds a shaft or joins two at the same speed: brakes, clutches, freewheels."""

from __future__ import annotations

from typing import Annotated, Literal

from ..inputs.part import Part
from ..inputs.quantities import Positive, Torque


class Brake(Part):
    """A holding brake: dry friction between a shaft and the frame, with a capacity that its command applies."""

    shaft: str
    """that it holds"""
    torque: Annotated[Torque, Positive]
    """capacity at command 1; between 0 (open) and 1 in proportion"""


class Clutch(Part):
    """Dry friction between two shafts."""

    kind: Literal["friction", "safety"] = "friction"
    """`friction`: engaged by its command; `safety`: always engaged, slips at its torque"""
    input: str
    """shaft"""
    output: str
    """shaft"""
    torque: Annotated[Torque, Positive]
    """capacity; of a friction clutch at command 1, between 0 (open) and 1 in proportion"""


class Freewheel(Part):
    """A one-way clutch: it drives the output forward and never backward."""

    input: str
    """shaft"""
    output: str
    """shaft, which may run ahead"""
