"""Encoders: what a controller reads of an angle."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from .. import _core
from ..inputs.quantities import Whole
from .described import EncoderFields

RESOLUTION_KEYS = ("lines", "bits", "resolution")


class Encoder(EncoderFields):
    """A rotary encoder on a shaft: ``q floor(angle/q + 1/2) + error sin(periods angle + phase)``.

    Its resolution q is that of an incremental encoder of so many `lines`, 2 pi/(4 lines); of an absolute one of so many
    `bits` in a turn, 2 pi/2**bits; with `lines` and `bits` of one with sine and cosine, 2 pi/(lines 2**bits).
    """

    shaft: str | None = None
    """that it is on; left out, that of the motor"""
    delay: Annotated[Whole, Field(ge=0, le=1000)] = 0
    """sample times from the reading until the controller has it"""

    @model_validator(mode="after")
    def _has_a_resolution(self) -> Self:
        given = [key for key in RESOLUTION_KEYS if getattr(self, key) is not None]
        if self.ideal and given:
            raise ValueError(f"is ideal and has {given[0]}; leave one of them out")
        if not self.ideal and not given:
            raise ValueError(
                "has no resolution; give lines, bits or resolution as the data sheet does, or ideal = true for an encoder without steps"
            )
        if self.resolution is not None and len(given) > 1:
            raise ValueError(f"has resolution and {given[0]}, which says the same; give one of them")
        if self.error > 0.0 and self.error_periods is None and self.lines is None:
            raise ValueError("has an error but no error_periods; add how many of its periods a turn has")
        return self

    @property
    def step(self) -> float:
        """q [rad]; 0 for an ideal one."""
        return _core.encoder_step(self.core_fields())
