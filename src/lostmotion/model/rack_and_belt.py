"""Racks with their pinions, and belts with their pulleys."""

import math
from collections.abc import Iterator
from typing import Annotated, Self

from pydantic import Field, model_validator

from ..inputs.part import rule
from ..inputs.quantities import Angle, Force, Length, Limit, Positive, Whole
from ..reproducible import cos
from .screw import LinearDrive, Placed, one_way


class RackData(LinearDrive):
    """A rack and its pinion alone, as a data sheet has them.

    Examples
    --------
    >>> RackData(module="2 mm", teeth=20).travel()
    0.12566370614359174
    """

    module: Annotated[Length, Positive] | None = None  #: normal module
    teeth: Annotated[Whole, Field(ge=4, le=1000)] | None = None  #: teeth of the pinion
    helix_angle: Annotated[Angle, Limit(ge=0.0, le=0.25 * math.pi)] | None = None  #: left out, 0: straight teeth
    travel_per_turn: Annotated[Length, Positive] | None = None  #: in place of module and teeth

    @model_validator(mode="after")
    def _is_a_rack(self) -> Self:
        ways = {"teeth": ("module", "teeth", "helix_angle"), "travel": ("travel_per_turn",)}
        one_way(self, ways, ("helix_angle",))
        return self

    def travel(self) -> float:
        if self.travel_per_turn is not None:
            return self.travel_per_turn
        assert self.module is not None and self.teeth is not None  # noqa: PT018
        return math.pi * self.module * self.teeth / cos(self.helix_angle or 0.0)


class RatedRack(RackData):
    """A rack and its pinion alone, with the ratings by which its force is judged.

    Examples
    --------
    >>> RatedRack(module="2 mm", teeth=20, rated_force="8 kN").rated_force
    8000.0
    """

    rated_force: Annotated[Force, Positive] | None = None  #: along the rack, continuous
    peak_force: Annotated[Force, Positive] | None = None


class BeltData(LinearDrive):
    """A toothed belt and its pulley alone, as a data sheet has them.

    Examples
    --------
    >>> BeltData(teeth=20, pitch="5 mm", specific_stiffness="1e6 N", free_lengths=["0.5 m", "1.5 m"]).gear("m", "s").stiffness.stiffness
    2666666.6666666665
    """

    pulley_diameter: Annotated[Length, Positive] | None = None  #: at the belt's pitch line
    teeth: Annotated[Whole, Field(ge=4, le=1000)] | None = None  #: teeth of the pulley
    pitch: Annotated[Length, Positive] | None = None  #: pitch of the belt
    travel_per_turn: Annotated[Length, Positive] | None = None  #: in place of both
    specific_stiffness: Annotated[Force, Positive] | None = None
    """c_sp, force to unit strain: with free_lengths, in place of stiffness"""
    free_lengths: Annotated[tuple[Annotated[Length, Positive], ...], Field(min_length=1, max_length=10)] | None = None
    """lengths of the strands between pulley and slide that carry together: stiffness = c_sp (1/L_1 + 1/L_2 ...)"""

    @rule
    def _is_a_belt(self) -> Iterator[str]:
        ways = {"diameter": ("pulley_diameter",), "teeth": ("teeth", "pitch"), "travel": ("travel_per_turn",)}
        one_way(self, ways)
        if (self.specific_stiffness is None) != (self.free_lengths is None):
            yield "has one of specific_stiffness and free_lengths; the stiffness of the belt needs both"
        for key in ("stiffness", "stiffness_curve"):
            if self.free_lengths is not None and getattr(self, key) is not None:
                yield f"has {key} and specific_stiffness, which say the same; give one"
        if self._goes_slack() and (len(lengths := self.free_lengths or ()) != 2 or lengths[0] != lengths[1]):
            yield (
                f"has a preload and free_lengths {list(lengths)}; a preload takes two strands of the same length, one of which goes "
                "slack; give them, or a stiffness_curve"
            )

    def _goes_slack(self) -> bool:
        return self.preload > 0.0 and self.free_lengths is not None

    def _curve(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        if not self._goes_slack():
            return super()._curve()
        # Both strands carry until the deflection takes the preload from one of them; the other goes on alone.
        both = self._stiffness() or 0.0
        return (both, 0.5 * both), (2.0 * self.preload / both,)

    def travel(self) -> float:
        if self.travel_per_turn is not None:
            return self.travel_per_turn
        if self.pulley_diameter is not None:
            return math.pi * self.pulley_diameter
        assert self.teeth is not None and self.pitch is not None  # noqa: PT018
        return self.teeth * self.pitch

    def _stiffness(self) -> float | None:
        if self.specific_stiffness is None or self.free_lengths is None:
            return super()._stiffness()
        stiffness = 0.0
        for length in self.free_lengths:
            stiffness += self.specific_stiffness / length
        return stiffness


class RatedBelt(BeltData):
    """A toothed belt and its pulley alone, with the ratings by which its force is judged.

    Examples
    --------
    >>> belt = RatedBelt(teeth=20, pitch="5 mm", stiffness="1 N/um", profile="AT5", width="16 mm")
    >>> belt.meshing()
    10
    """

    profile: str = ""
    """such as AT5, GT2 or HTD; with width, ratings that are not given come from manufacturers"""
    width: Annotated[Length, Positive] | None = None
    rated_force: Annotated[Force, Positive] | None = None
    """largest force of the tension members in operation"""
    tooth_force: Annotated[Force, Positive] | None = None
    """tooth force of one tooth in mesh, at standstill"""
    pretension: Annotated[Force, Positive] | None = None
    """force of a strand at rest; left out, the largest circumferential force, so that no strand is slack"""
    teeth_in_mesh: Annotated[Whole, Field(ge=1, le=1000)] | None = None
    """left out, half the teeth of the pulley"""

    def meshing(self) -> int | None:
        """Teeth in mesh; None where neither they nor the pulley's teeth are known."""
        if self.teeth_in_mesh is not None:
            return self.teeth_in_mesh
        return None if self.teeth is None else self.teeth // 2


class Rack(RatedRack, Placed):
    """A pinion on a shaft and its rack on a slide, or the other way round.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.Rack(input="pinion", output="carriage", module="2 mm", teeth=20).ratio()
    49.99999999999999
    """


class Belt(RatedBelt, Placed):
    """A toothed belt from a pulley on a shaft to a slide.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.Belt(input="motor", output="carriage", teeth=20, pitch="5 mm").travel()
    0.1
    """
