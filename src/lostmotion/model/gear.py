"""A gear of a drive train: a stage between two shafts."""

from collections.abc import Iterator
from typing import Annotated, Any, Self

from pydantic import Field

from ..errors import InputError
from ..inputs.cached_values import kept
from ..inputs.part import rule
from .angle_torques import TransmissionError
from .couplings import BetweenShafts
from .gearbox import Gearbox, Transmission
from .losses import ConstantEfficiency, LossMap, MeshEfficiency, WormMesh, efficiency_map
from .torsion import LinearStiffness, Rigid, TorsionCurve


class Gear(Transmission, BetweenShafts):
    """A stage between two shafts: a gearbox, a belt, a worm, or, with the ratio 1, a coupling.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Gear(input="motor", output="table", ratio=10, stiffness={"kind": "linear", "stiffness": "5e4 N*m/rad"}).ratio
    10.0
    """

    housing: str | None = None
    """shaft that carries the housing, or the ring of a planetary gear from its sun to its carrier: input speed - housing speed =
    ratio * (output speed - housing speed); left out, the frame"""
    stiffness: Annotated[TorsionCurve | LinearStiffness | Rigid, Field(discriminator="kind")] = Rigid()
    """left out, rigid"""
    losses: Annotated[ConstantEfficiency | LossMap | MeshEfficiency | WormMesh, Field(discriminator="kind")] = (
        ConstantEfficiency(efficiency=1.0)
    )
    """left out, none"""
    transmission_error: TransmissionError | None = None
    """e over the angle of the input shaft, at the output: twist = input angle/ratio - output angle - e"""

    def __repr__(self) -> str:
        laws = f"stiffness {self.stiffness.kind}, losses {self.losses.kind}"
        housing = "" if self.housing is None else f" on {self.housing}"
        return f"Gear({self.input} -> {self.output}{housing}, {self.ratio:g}:1, {laws})"

    @rule
    def _complete(self) -> Iterator[str]:
        if isinstance(self.losses, LossMap):
            for key in ("rated_input_speed", "rated_output_torque"):
                if getattr(self, key) is None:
                    yield f"lacks {key}, by which the loss map is scaled; add it"

    @kept
    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units, without the fields that are None."""
        error = self.transmission_error
        return super().core_fields() | self.losses.core_fields() | {"transmission_error": error and error.core()}

    def gearbox(self) -> Gearbox:
        """The same gear alone, as the test rig takes it: without transmission error, its losses as a map. One that
        reverses is taken as one that does not: its values are the same.

        Raises
        ------
        InputError
            It has no rated speed or torque.
        """
        lacking = [key for key in ("rated_input_speed", "rated_output_torque") if getattr(self, key) is None]
        if lacking:
            raise InputError(
                f"the gear lacks {' and '.join(lacking)}, by which the test rig chooses what it measures; add it"
            )
        losses = self.losses
        if isinstance(losses, MeshEfficiency | WormMesh):
            losses = efficiency_map(*losses.efficiencies())
        return Gearbox(**{name: getattr(self, name) for name in Gearbox.model_fields} | {"losses": losses}).forward()

    @classmethod
    def of(cls, gearbox: Gearbox, *, input: str, output: str) -> Self:
        """The gearbox between two shafts."""
        return cls.like(gearbox, input=input, output=output)
