"""Encoders: what a controller reads of an angle."""

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from .. import _core
from ..errors import InputError
from ..inputs.core_parameters import EncoderFields
from ..inputs.part import rule
from ..inputs.quantities import Whole

RESOLUTION_KEYS = ("lines", "bits", "grating_period", "resolution")


class Encoder(EncoderFields):
    """A rotary encoder on a shaft: ``q floor(angle/q + 1/2) + error sin(periods angle + phase)``.

    Its resolution q is 2 pi/(4 lines) for an incremental encoder, which has `lines`. For an absolute encoder, which
    has `bits` in a turn, it is 2 pi/2**bits. For an encoder with sine and cosine, which has both, it is 2 pi/(lines
    2**bits). A linear scale on a slide has a `grating_period` p: p/4, or with `bits` p/2**bits.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.control.Encoder(shaft="motor", bits=20).bits
    20
    """

    delay: Annotated[Whole, Field(ge=0, le=1000)] = 0
    """sample times from the reading until the controller has it"""
    shaft: str | None = None
    """shaft with the encoder; default: the motor's shaft"""

    @rule
    def _has_a_resolution(self) -> Iterator[str]:
        given = [key for key in RESOLUTION_KEYS if getattr(self, key) is not None]
        if self.ideal and given:
            yield f"is ideal and has {given[0]}; leave one of them out"
        if not self.ideal and not given:
            yield "has no resolution; give lines, bits or resolution as the data sheet does, or ideal = true for an encoder without steps"
        if self.resolution is not None and len(given) > 1:
            yield f"has resolution and {given[0]}, which says the same; give one of them"
        if self.grating_period is not None and self.lines is not None:
            yield "has lines and grating_period; lines are of a turn, so leave one of them out"
        if self.error > 0.0 and self.error_periods is None and self.lines is None and self.grating_period is None:
            yield "has an error but no error_periods; add how many of its periods a turn has"

    def check_shaft(self, *, slides: bool) -> None:
        """Refuse what a turn has on a slide, and a grating on a shaft."""
        if not slides and self.grating_period is not None:
            raise InputError(
                "is that of a linear scale, and this encoder is on a shaft; give lines or bits", "grating_period"
            )
        if slides:
            keys = ("lines", "error_periods", *(() if self.grating_period is not None else ("bits",)))
            for key in keys:
                if getattr(self, key) is not None:
                    raise InputError(
                        "counts a turn, and this encoder is on a slide; give grating_period, or resolution", key
                    )
            if self.error > 0.0 and self.grating_period is None:
                raise InputError("has no period; give grating_period in place of resolution", "error")

    @property
    def step(self) -> float:
        """q [rad], of a linear scale [m]; 0 for an ideal one."""
        return _core.encoder_step(self.core_fields())
