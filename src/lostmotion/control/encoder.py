"""Encoders: what a controller reads of an angle."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from .. import _core
from ..inputs.part import Part
from ..inputs.quantities import Angle, NotNegative, Positive, Switch, Whole

RESOLUTION_KEYS = ("lines", "bits", "resolution")


class Encoder(Part):
    """A rotary encoder on a shaft: ``q floor(angle/q + 1/2) + error sin(periods angle + phase)``.

    Its resolution q is that of an incremental encoder of so many `lines`, 2 pi/(4 lines); of an absolute one of so many
    `bits` in a turn, 2 pi/2**bits; with `lines` and `bits` of one with sine and cosine, 2 pi/(lines 2**bits).
    """

    shaft: str | None = None
    """that it is on; left out, that of the motor"""
    lines: Annotated[Whole, Field(ge=1, le=1 << 24)] | None = None
    """signal periods in a turn"""
    bits: Annotated[Whole, Field(ge=1, le=40)] | None = None
    """of a turn, or, with lines, of a signal period"""
    resolution: Annotated[Angle, Positive] | None = None
    """q itself"""
    ideal: Switch = False
    """no resolution at all, for theory"""
    error: Annotated[Angle, NotNegative] = 0.0
    """amplitude of the error within a period"""
    error_periods: Annotated[Whole, Field(ge=1, le=1 << 24)] | None = None
    """in a turn; left out, lines"""
    error_phase: Angle = 0.0
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
        if self.ideal:
            return 0.0
        if self.resolution is not None:
            return self.resolution
        turn = 2.0 * math.pi
        if self.lines is None:
            return math.ldexp(turn, -(self.bits or 0))
        return turn / (self.lines * math.ldexp(1.0, 2 if self.bits is None else self.bits))

    def core(self, scale: float, ticks: int) -> _core.Sensor:
        """The solver's encoder: turns of what is controlled for one of its shaft, and base ticks in a sample time."""
        sensor = _core.Sensor()
        sensor.scale = scale
        sensor.encoder.resolution = self.step
        sensor.encoder.error = self.error
        sensor.encoder.periods = float(self.error_periods or self.lines or 0)
        sensor.encoder.phase = self.error_phase
        sensor.encoder.delay.ticks = self.delay * ticks
        return sensor
