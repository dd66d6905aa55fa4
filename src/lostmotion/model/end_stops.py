"""Stops at both ends of the travel of a shaft or a slide."""

from typing import Any, Self

from pydantic import model_validator

from ..inputs import core_parameters

END_STOP = "_end_stop"  # behind the name of a shaft or slide: the name of its stops in the core


def _check(stops: Any, unit: str) -> None:
    """Refuse stops that exchange places, or do not say what they are."""
    if stops.upper <= stops.lower:
        raise ValueError(
            f"has upper = {stops.upper} {unit}, which is not above lower = {stops.lower} {unit}; exchange them"
        )
    if (stops.stiffness is None) == (stops.restitution is None):
        has = "neither a stiffness nor a restitution" if stops.stiffness is None else "a stiffness and a restitution"
        raise ValueError(f"has {has}; give elastic stops a stiffness, rigid ones their restitution, 0 to 1")
    if stops.damping and stops.stiffness is None:
        raise ValueError("has a damping, which is that of elastic stops; give them a stiffness, or leave it out")


class ShaftEndStops(core_parameters.ShaftEndStopsFields):
    """Stops of a shaft: elastic ones with a stiffness, and damping perhaps, or rigid ones with a restitution.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.ShaftEndStops(lower="-90 deg", upper="90 deg", restitution=0.4).restitution
    0.4
    """

    @model_validator(mode="after")
    def _say_what_they_are(self) -> Self:
        _check(self, "rad")
        return self

    def torque(self, angle: float, speed: float = 0.0) -> float:
        """Torque [N·m] of elastic stops on the shaft at an angle [rad] and a speed [rad/s]; the torque of rigid stops is a reaction."""
        for way, end in ((1.0, self.upper), (-1.0, self.lower)):
            if (beyond := way * (angle - end)) > 0.0:
                return -way * max(0.0, (self.stiffness or 0.0) * beyond + self.damping * way * speed)
        return 0.0


class EndStops(core_parameters.EndStopsFields):
    """Stops of a slide: elastic ones with a stiffness, and damping perhaps, or rigid ones with a restitution.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.EndStops(lower="0 m", upper="1 m", stiffness="5 N/um").stiffness
    5000000.0
    """

    @model_validator(mode="after")
    def _say_what_they_are(self) -> Self:
        _check(self, "m")
        return self

    def of_shaft(self) -> ShaftEndStops:
        """The same as end stops of a shaft in the equations, in units of translation."""
        return ShaftEndStops.like(self)
