"""A camera on the axis, and the filter that makes angle, rate and acceleration of a target from its frames."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from .. import _core
from ..inputs.part import Part
from ..inputs.quantities import Angle, Limit, NotNegative, Number, Positive, Switch, Time, Whole
from .sample_times import whole_multiple

MAX_SEED = 2**53  # up to which every whole number is one of double precision, as studies vary them


class Camera(Part):
    """Measures how far the target is beside the line of sight of the shaft that the reference is of, on which it sits.

    Frame n, at n ``sample_time``: ``p floor((o + noise N_n)/p + 1/2)`` of the offset o while ``|o| <= field/2``, added to what the encoder of
    the position says then; N_n are standard normal, p is ``pixel/pixel_parts``.
    """

    sample_time: Annotated[Time, Positive]
    """from frame to frame; a whole multiple of that of the controller"""
    latency: Annotated[Time, NotNegative] = 0.0
    """from the exposure of a frame until the controller has what it shows; a whole multiple, too"""
    noise: Annotated[Angle, NotNegative] = 0.0
    """standard deviation of the measured offset"""
    pixel: Annotated[Angle, Positive] | None = None
    """angle of one; left out, offsets have no steps"""
    pixel_parts: Annotated[Whole, Field(ge=1, le=1000)] = 1
    """into which the place of the target on the picture is resolved"""
    field: Annotated[Angle, Positive] | None = None
    """whole angle of view of this axis; a frame shows no target beyond it; left out, all do"""
    seed: Annotated[Whole, Field(ge=0, le=MAX_SEED)] = 0
    """of the noise, which follows from it and the name of the motor alone"""

    @model_validator(mode="after")
    def _sees_a_pixel(self) -> Self:
        if self.pixel is None and self.pixel_parts != 1:
            raise ValueError("has pixel_parts but no pixel; add its angle")
        if self.pixel is not None and self.field is not None and self.pixel > self.field:
            raise ValueError(f"has pixel = {self.pixel:g} rad, more than its field, {self.field:g} rad; check both")
        return self


class Tracker(Part):
    """Follows the target by the frames of the camera; the loops follow what it expects for the present.

    With the expected x, v, a at a frame and r = measured - x: ``x += alpha r``, ``v += (beta/T) r``, ``a += (gamma/(2 T^2)) r`` (Kalata 1984).
    """

    alpha: Annotated[Number, Limit(gt=0.0)] | None = None
    beta: Annotated[Number, NotNegative] | None = None
    gamma: Annotated[Number, NotNegative] = 0.0
    """0: the target is taken to move at constant speed"""
    tracking_index: Annotated[Number, Positive] | None = None
    """in the place of alpha and beta: T^2 times the deviation of the target's acceleration over that of the noise, for which
    alpha and beta are best (Kalata 1984)"""
    prediction: Switch = True
    """whether the angle goes on at the expected rate from the exposure of the last frame; without, it stays"""

    @model_validator(mode="after")
    def _has_its_gains(self) -> Self:
        if self.tracking_index is not None:
            given = [key for key in ("alpha", "beta") if getattr(self, key) is not None] + ["gamma"] * (
                self.gamma > 0.0
            )
            if given:
                raise ValueError(f"has tracking_index and {given[0]}, which follows from it; give one of them")
            return self
        lacking = [key for key in ("alpha", "beta") if getattr(self, key) is None]
        if lacking:
            raise ValueError(f"lacks {lacking[0]}; give alpha and beta, or tracking_index")
        alpha, beta, gamma = self.gains()
        stable = 2.0 * alpha + beta < 4.0 and alpha < 2.0
        if gamma > 0.0:
            stable = stable and 4.0 * alpha * beta + alpha * gamma - 2.0 * gamma > 0.0
        if not stable:
            raise ValueError(
                f"has alpha = {alpha:g}, beta = {beta:g}, gamma = {gamma:g}, with which its errors grow; keep alpha < 2, 2 alpha + beta < 4 and "
                "gamma (2 - alpha) < 4 alpha beta"
            )
        return self

    def gains(self) -> tuple[float, float, float]:
        """alpha, beta and gamma."""
        if self.tracking_index is None:
            assert self.alpha is not None
            assert self.beta is not None
            return self.alpha, self.beta, self.gamma
        # beta^2 = index^2 (1 - alpha) and beta = 2 (2 - alpha) - 4 sqrt(1 - alpha), by r = sqrt(1 - alpha).
        index = self.tracking_index
        r = (4.0 + index - math.sqrt(8.0 * index + index * index)) / 4.0
        return 1.0 - r * r, index * r, 0.0


def core_camera(camera: Camera, sample_time: float, ticks: int, stream: int) -> _core.Camera:
    """The solver's camera.

    Parameters
    ----------
    sample_time
        Of the controller [s], which is so many `ticks`.
    stream
        Of the seed.

    Raises
    ------
    InputError
        Its times are no whole multiples of that.
    """
    out = _core.Camera()
    out.present = True
    out.every = whole_multiple(camera.sample_time, sample_time, "camera.sample_time") * ticks
    if camera.latency > 0.0:
        out.latency = whole_multiple(camera.latency, sample_time, "camera.latency") * ticks
    out.noise = camera.noise
    out.step = 0.0 if camera.pixel is None else camera.pixel / camera.pixel_parts
    out.half_field = math.inf if camera.field is None else 0.5 * camera.field
    out.seed, out.stream = camera.seed, stream
    return out


def core_tracker(tracker: Tracker, frame_time: float) -> _core.Tracker:
    """The solver's tracker, for frames so far apart [s]."""
    out = _core.Tracker()
    out.alpha, out.beta, out.gamma = tracker.gains()
    out.frame_time = frame_time
    out.predicts = tracker.prediction
    return out
