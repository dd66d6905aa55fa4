"""A camera on the axis, and the filter that makes angle, rate and acceleration of a target from its frames."""

from collections.abc import Iterator
from typing import Annotated

from .. import _core
from ..inputs.core_parameters import CameraFields, TrackerFields
from ..inputs.part import rule
from ..inputs.quantities import NotNegative, Positive, Time


class Camera(CameraFields):
    """Camera on the shaft of the reference, which measures the angle between the target and the line of sight.

    Frame n, at n ``sample_time``: ``p floor((o + noise N_n)/p + 1/2)`` of the offset o while ``|o| <= field/2``,
    added to the reading of the position encoder. N_n are standard normal, p is ``pixel/pixel_parts``.
    """

    sample_time: Annotated[Time, Positive]
    """time from frame to frame; a whole multiple of the controller's sample time"""
    latency: Annotated[Time, NotNegative] = 0.0
    """from the exposure of a frame until the controller has what it shows; a whole multiple, too"""

    @rule
    def _sees_a_pixel(self) -> Iterator[str]:
        if self.pixel is None and self.pixel_parts != 1:
            yield "has pixel_parts but no pixel; add its angle"
        if self.pixel is not None and self.field is not None and self.pixel > self.field:
            yield f"has pixel = {self.pixel:g} rad, more than its field, {self.field:g} rad; check both"


class Tracker(TrackerFields):
    """Filter of the camera's frames that predicts the position of the target for the loops.

    With the expected x, v, a at a frame and r = measured - x: ``x += alpha r``, ``v += (beta/T) r``, ``a += (gamma/(2 T^2)) r`` (Kalata 1984).
    """

    @rule
    def _has_its_gains(self) -> Iterator[str]:
        if self.tracking_index is not None:
            given = [key for key in ("alpha", "beta") if getattr(self, key) is not None] + ["gamma"] * (
                self.gamma > 0.0
            )
            if given:
                yield f"has tracking_index and {given[0]}, which follows from it; give one of them"
            return
        lacking = [key for key in ("alpha", "beta") if getattr(self, key) is None]
        if lacking:
            yield f"lacks {lacking[0]}; give alpha and beta, or tracking_index"
        alpha, beta, gamma = self.gains()
        stable = 2.0 * alpha + beta < 4.0 and alpha < 2.0
        if gamma > 0.0:
            stable = stable and 4.0 * alpha * beta + alpha * gamma - 2.0 * gamma > 0.0
        if not stable:
            yield (
                f"has alpha = {alpha:g}, beta = {beta:g}, gamma = {gamma:g}, with which its errors grow; keep alpha < 2, 2 alpha + beta < 4 and "
                "gamma (2 - alpha) < 4 alpha beta"
            )

    def gains(self) -> tuple[float, float, float]:
        """alpha, beta and gamma."""
        return _core.tracker_gains(self.core_fields())
