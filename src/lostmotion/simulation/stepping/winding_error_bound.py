"""The error bound of field-oriented control step by step: a second simulation with coarser exchanges is taken along."""

from collections.abc import Mapping
from typing import Any

from ..scenario.field_oriented_motors import bounds_of

State = tuple[Any, dict[str, float], dict[str, float]]
"""of the second simulation, and the largest values and differences so far"""


class StepBound:
    """Largest distance of two simulations at the ends of the steps.

    coarse: the `Simulation` with one exchange of torque and speed in each tick.
    names: the variables that are compared, as of `windings.bounded`.
    """

    def __init__(self, coarse: Any, names: Mapping[str, str]) -> None:
        self.coarse, self._names = coarse, names
        self.forget()

    def forget(self) -> None:
        """Start again at t = 0."""
        self._largest = dict.fromkeys(self._names, 0.0)
        self._apart = dict.fromkeys(self._names, 0.0)

    def see(self, fine: Any) -> None:
        """Both at the end of a step."""
        names = tuple(self._names)
        for name, here, there in zip(names, fine[names].tolist(), self.coarse[names].tolist(), strict=True):
            self._largest[name] = max(self._largest[name], abs(here))
            self._apart[name] = max(self._apart[name], abs(here - there))

    def bounds(self) -> dict[str, float]:
        """The bounds by variable."""
        return bounds_of(self._names, self._largest, self._apart)

    @property
    def state(self) -> State:
        """The whole bound."""
        return self.coarse.state, dict(self._largest), dict(self._apart)

    @state.setter
    def state(self, state: State) -> None:
        self.coarse.state = state[0]
        self._largest, self._apart = dict(state[1]), dict(state[2])
