"""Tables of a scenario in the long form that a train alone has not: its shafts and slides with loads, and its start."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ..control.references import PositionReference, SlideReference
from ..inputs.named import nothing
from ..inputs.part import Part
from ..inputs.quantities import Angle, Force, Length, LinearSpeed, NotNegative, Number, Speed, Switch, Torque
from ..model.shaft import Shaft
from ..model.signals import ForceSignal, SlideSpeedSignal, SpeedSignal, TorqueSignal
from ..model.slide import Slide
from ..model.train import Elements


class ShaftTable(Shaft):
    """A shaft, the load torque on it, and its motion where that is given."""

    torque: TorqueSignal | None = None
    """M_Z, against its motion; left out, none can act on it"""
    speed: SpeedSignal | None = None
    """speed that it has whatever acts on it; the torque that this takes is the variable ``NAME_drive_torque``; left out, it moves
    as the torques let it"""
    motion: PositionReference | None = None
    """angle that it has whatever acts on it, such as moves, in place of speed"""


class SlideTable(Slide):
    """A slide and the load force on it."""

    force: ForceSignal | None = None
    """against its motion, beside its weight; left out, none can act on it unless it is inclined"""
    speed: SlideSpeedSignal | None = None
    """speed that it has whatever acts on it; the force that this takes is the variable ``NAME_drive_force``; left out, it moves
    as the forces let it"""
    motion: SlideReference | None = None
    """position that it has whatever acts on it, such as moves, in place of speed"""


class TrainInitial(Part):
    """State of a drive train at t = 0; missing values are 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.TrainInitial(speeds={"motor": "100 rpm"}).speeds["motor"]
    10.471975511965978
    """

    speeds: Elements[Speed] = Field(default_factory=nothing)
    """speeds of shafts"""
    angles: Elements[Angle] = Field(default_factory=nothing)
    """angles of shafts; those of others follow through the gears"""
    twists: Elements[Angle] = Field(default_factory=nothing)
    """twists of gears with a stiffness"""
    positions: Elements[Length] = Field(default_factory=nothing)
    """positions of slides"""
    slide_speeds: Elements[LinearSpeed] = Field(default_factory=nothing)
    """slide speeds of slides"""
    deflections: Elements[Length] = Field(default_factory=nothing)
    """deflections of screws, racks and belts with a stiffness"""
    motor_torques: Elements[Torque] = Field(default_factory=nothing)
    """motor torques of DC motors"""
    controller_states: Elements[Number] = Field(default_factory=nothing)
    """states of continuous controllers, by their result variables (SI), such as ``MOTOR_integral``; the filter of a derivative that is
    left out has settled"""
    hysteresis_capacities: Elements[Annotated[Torque, NotNegative]] = Field(default_factory=nothing)
    """capacities of gears with hysteresis after the last turning point before t = 0"""
    hysteresis_forces: Elements[Annotated[Force, NotNegative]] = Field(default_factory=nothing)
    """the same of screws, racks and belts"""
    on_reference: Switch = False
    """angles of the shafts of controllers, and the speeds of all that turns with them, are those of their references at t = 0"""

    def at_rest(self) -> TrainInitial:
        """The same without motion, with its angles and twists."""
        return TrainInitial(angles=self.of_all("angles"), twists=self.of_all("twists"))

    def of_all(self, key: str) -> dict[str, float]:
        """The values of a key with those of slides or what moves them."""
        return {**getattr(self, key), **getattr(self, LINEAR_INITIAL[key])}


# Keys of `initial` for shafts and gears, and those of the same quantity for slides and what moves them.
LINEAR_INITIAL = {
    "angles": "positions",
    "speeds": "slide_speeds",
    "twists": "deflections",
    "hysteresis_capacities": "hysteresis_forces",
}
