"""The controller of a motor: reference, encoders, loops and their sample times."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from ..inputs.core_parameters import ReferenceBlocks
from ..inputs.part import rule
from ..inputs.quantities import NotNegative, Positive, Switch, Time, Whole
from ..recorded_numbers import real
from .camera import Camera, Tracker
from .continuous import ContinuousController
from .encoder import Encoder
from .firmware import Firmware
from .inverse_model import InverseModel
from .loops import (
    CurrentLoop,
    Feedforward,
    FieldOriented,
    FirstOrderCurrent,
    IdealCurrent,
    PositionLoop,
    SpeedLoop,
    VoltageCommand,
)
from .references import PositionReference, SpeedReference, TorqueReference
from .sample_times import whole_multiple

AnyReference = Annotated[PositionReference | SpeedReference | TorqueReference, Field(discriminator="kind")]
AnyCurrent = Annotated[
    IdealCurrent | FirstOrderCurrent | CurrentLoop | FieldOriented | VoltageCommand, Field(discriminator="kind")
]


class Controller(ReferenceBlocks):
    """Cascade of position, speed and current loop, each at its own sample time; what is left out is not there.

    At each sample instant the encoders are read, the loops that are due are computed, the outermost first, and what the innermost
    one gives acts `delay` sample times later.

    Examples
    --------
    >>> import lostmotion as lm
    >>> controller = lm.load("position-axis").controller
    >>> controller.sample_time, controller.position.gain
    (0.000125, 10.0)
    """

    sample_time: Annotated[Time, Positive]
    """sample time of the innermost loop, and of loops without their own"""
    delay: Annotated[Whole, Field(ge=0, le=1)] = 1
    """sample times from reading the encoders until the result acts"""
    blend_time: Annotated[Time, Positive] | None = None
    """time constant of the low pass through which the position encoder corrects the encoder of the speed loop; left out, the position encoder counts alone"""
    law: Switch = False
    """the loops are a function of your own, which `simulate(..., law=function)` gives"""
    phase: Annotated[Time, NotNegative] = 0.0
    """by which the samples of the position loop come after the samples of the other loops"""
    kind: Literal["sampled"] = "sampled"
    reference: AnyReference
    """reference of the position, the speed or the torque, which the outermost loop follows; with a camera, the path of the target"""
    shaft: str | None = None
    """shaft of the position and the speed of the reference; left out, the last one"""
    encoder: Encoder | None = None
    """encoder of the speed loop, and of the position loop unless that has its own"""
    position_encoder: Encoder | None = None
    """encoder of the position loop, such as one on the load"""
    position: PositionLoop | None = None
    speed: SpeedLoop | None = None
    firmware: Firmware | None = None
    """position control of a hobby servo, in place of position and speed loop"""
    current: AnyCurrent = IdealCurrent()
    feedforward: Feedforward = Feedforward()
    inverse_model: InverseModel | None = None
    """feedforward by the model of the drive, with adaptation; in place of `feedforward`"""
    camera: Camera | None = None
    """on the shaft of the reference: the loops then know of the target what it shows"""
    tracker: Tracker | None = None
    """filter of the frames of the camera"""

    @rule
    def _loops_fit_the_reference(self) -> Iterator[str]:
        wanted = {"position": ("position", "speed"), "speed": ("speed",), "torque": ()}[self.reference.kind]
        if self.firmware is not None:
            wanted = ()
            yield from self._check_firmware()
        if self.law:
            wanted = ()
            if isinstance(self.current, CurrentLoop):
                yield 'has law = true and a current loop of kind "pi"; with a law of one\'s own, take "ideal", "first_order", "voltage" or "field_oriented"'
        elif isinstance(self.current, VoltageCommand):
            yield 'has current.kind = "voltage", which needs law = true; take "pi", "field_oriented", "first_order" or "ideal"'
        for loop in ("position", "speed"):
            present = getattr(self, loop) is not None
            if present and loop not in wanted:
                why = (
                    "law = true"
                    if self.law
                    else "a firmware"
                    if self.firmware
                    else f"a reference of the {self.reference.kind}"
                )
                yield f"has the loop {loop}, which has no use with {why}; leave it out"
            if not present and loop in wanted:
                yield f"lacks {loop}, the loop that follows a reference of the {self.reference.kind}; add its gain"
        if self.encoder is None and (self.law or self.firmware is not None or self.speed is not None):
            yield "lacks encoder; give its lines, bits or resolution, or ideal = true"
        if self.position_encoder is not None and self.position is None and self.firmware is None and not self.law:
            yield "has a position_encoder but no position loop; leave it out"
        if self.blend_time is not None and self.position_encoder is None:
            yield "has a blend_time but no position_encoder to blend; leave it out"
        if self.feedforward != Feedforward() and self.speed is None:
            yield "has a feedforward, which the speed loop adds, but no speed loop; leave it out"
        yield from self._check_camera()
        blocks = [key for key in ReferenceBlocks.model_fields if getattr(self, key) is not None]
        if blocks and self.position is not None and self.position.reference_delay > 0.0:
            yield f"has {blocks[0]} and position.reference_delay, which takes the reference as it is given; leave one out"
        if self.inverse_model is not None:
            if self.speed is None:
                yield "has an inverse_model, which the speed loop adds, but no speed loop; leave it out"
            if self.feedforward != Feedforward():
                yield "has feedforward and inverse_model, which both add the torque that is known; give one"

    def _check_firmware(self) -> Iterator[str]:
        if self.law:
            yield "has firmware and law = true, which both are the loops; give one of them"
        if self.reference.kind != "position":
            yield f'has a firmware and a reference of the {self.reference.kind}; a firmware follows reference.kind = "position"'
        if not isinstance(self.current, IdealCurrent | FirstOrderCurrent):
            yield f'has a firmware, which commands the voltage, and current.kind = "{self.current.kind}"; take "ideal" or "first_order"'

    def _check_camera(self) -> Iterator[str]:
        if (self.camera is None) != (self.tracker is None):
            has, lacks = ("tracker", "camera") if self.camera is None else ("camera", "tracker")
            yield f"has a {has} but no {lacks}; camera and tracker belong together"
        if self.camera is not None and self.reference.kind != "position":
            yield f'has a camera and a reference of the {self.reference.kind}; with a camera take reference.kind = "position", the direction of the target'

    def schedules(self) -> Iterator[tuple[str, float, int]]:
        """Name, sample time [s] and multiple of the controller's sample time for each loop.

        Raises
        ------
        ValueError
            One of them is no whole multiple of the controller's.
        """
        for name in ("position", "speed", "current"):
            time = self.loop_time(name)
            yield name, time, whole_multiple(time, self.sample_time, f"{name}.sample_time")

    def loop_time(self, loop: str) -> float:
        """Sample time of a loop [s]."""
        own = getattr(getattr(self, loop), "sample_time", None)
        return self.sample_time if own is None else real(own)


def _kind(value: Any) -> str:
    return str(value.get("kind", "sampled") if isinstance(value, Mapping) else getattr(value, "kind", "sampled"))


AnyController = Annotated[
    Annotated[Controller, Tag("sampled")] | Annotated[ContinuousController, Tag("continuous")], Discriminator(_kind)
]
