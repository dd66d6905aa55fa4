"""Tables of a scenario in the long form that a train alone has not: its shafts and slides with loads, and its start."""

from __future__ import annotations

from ..control.references import MovesReference  # noqa: F401
from ..inputs import described
from ..model.shaft import Shaft
from ..model.slide import Slide


class ShaftTable(described.ShaftTableFields, Shaft):
    """A shaft, the load torque on it, and its motion where that is given."""


class SlideTable(described.SlideTableFields, Slide):
    """A slide and the load force on it."""


class TrainInitial(described.TrainInitialFields):
    """State of a drive train at t = 0; missing values are 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.TrainInitial(speeds={"motor": "100 rpm"}).speeds["motor"]
    10.471975511965978
    """

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
