"""Gearboxes: parameters and ratings."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, field_validator

from ..inputs import core_parameters
from ..inputs.core_parameters import TransmissionFields
from ..inputs.part import Part, rule
from ..inputs.quantities import Force, Number, Positive, Speed, Time, Torque
from ..units.practical import practical
from .losses import ConstantEfficiency, LossMap
from .mesh_stiffness import MeshStiffness
from .notes import NO_NOTE, Note, note_is_about
from .torsion import Hysteresis, LinearStiffness, Rigid, TorsionCurve


class GearboxLoads(Part):
    """Torques and speeds that a gearbox may have."""

    average_output_torque: Annotated[Torque, Positive] | None = None  #: for the mean over a duty cycle
    peak_output_torque: Annotated[Torque, Positive] | None = None  #: repeated, as in acceleration
    momentary_output_torque: Annotated[Torque, Positive] | None = None  #: in an emergency stop
    average_input_speed: Annotated[Speed, Positive] | None = None
    """for the mean over a duty cycle; the drive check takes the rated speed where it is left out"""
    max_input_speed: Annotated[Speed, Positive] | None = None  #: largest speed of the input shaft


class GearboxLimits(GearboxLoads):
    """Limits of a gearbox. No run depends on them; the drive check compares with them."""

    rated_life: Annotated[Time, Positive] | None = None
    """L10h at rated torque and rated speed"""
    life_exponent: Annotated[Number, Positive] = 3.0
    """p of the life over the torque; 10/3 where roller bearings decide"""
    max_radial_force: Annotated[Force, Positive] | None = None
    """on the output bearing"""
    max_axial_force: Annotated[Force, Positive] | None = None
    """on the output bearing"""


class Transmission(TransmissionFields):
    """Base of gearboxes and gears of a drive train: ratio, inertia, compliance."""

    loss_range: tuple[Annotated[Number, Positive], Annotated[Number, Positive]] | None = None
    """range of estimated losses: the multiples between which the losses of such gearboxes lie. No run depends on it; the drive check says which of its verdicts hold at both ends"""

    if TYPE_CHECKING:
        losses: Any  # each class states its kinds

    stiffness: Annotated[TorsionCurve | LinearStiffness | Rigid, Field(discriminator="kind")]
    hysteresis: Hysteresis | None = None
    mesh_stiffness: MeshStiffness | None = None
    """factor on the stiffness over the angle of the input shaft; left out, 1"""
    limits: GearboxLimits | None = None
    note: Note = NO_NOTE
    """for readers of the results, such as that a loss table is a stand-in: text, or by the key that it is about"""

    _note_is_about_a_key = field_validator("note")(classmethod(note_is_about))

    @field_validator("ratio")
    @classmethod
    def _is_not_zero(cls, ratio: float) -> float:
        if ratio == 0.0:
            raise ValueError("is no ratio; give input speed / output speed, below 0 for a gear that reverses")
        return ratio

    @rule
    def _range_is_of_a_map(self) -> Iterator[str]:
        if self.loss_range is None:
            return
        if not isinstance(self.losses, LossMap):
            yield f"has a loss_range beside losses of kind {self.losses.kind!r}; only those of a map are estimated"
        if self.loss_range[0] > self.loss_range[1]:
            yield f"has a loss_range that falls, from {self.loss_range[0]:g} to {self.loss_range[1]:g}"

    def with_losses(self, factor: float) -> Self:
        """The gearbox with known losses: `factor` times the losses of the map."""
        return self.model_copy(update={"losses": self.losses.scaled(factor), "loss_range": None})

    @rule
    def _compliance_fits(self) -> Iterator[str]:
        hysteresis = self.hysteresis is not None and self.hysteresis.efficiency < 1.0
        rigid = isinstance(self.stiffness, Rigid)
        backlash = not isinstance(self.stiffness, Rigid) and self.stiffness.has_gap
        if hysteresis and rigid:
            yield "has hysteresis but is rigid; leave hysteresis out or give it a stiffness"
        if self.mesh_stiffness is not None and rigid:
            yield "has mesh_stiffness, a factor on its stiffness, but is rigid; give it a stiffness"
        if self.mesh_damping > 0.0 and rigid:
            yield "has mesh damping but is rigid; leave mesh_damping out or give it a stiffness"
        if self.mesh_damping > 0.0 and backlash and hysteresis:
            yield "has backlash with both mesh damping and hysteresis; leave one of the two out"
        if self.damping_limited and not (self.mesh_damping > 0.0 and backlash):
            yield "has damping_limited, which needs mesh_damping and a stiffness with backlash; give both"

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units, without the fields that are None."""
        return super().core_fields() | {
            "stiffness": None if isinstance(self.stiffness, Rigid) else self.stiffness.core(),
            **(
                {"flanks.backlash": self.stiffness.backlash, "flanks.restitution": self.stiffness.restitution}
                if isinstance(self.stiffness, Rigid) and self.stiffness.strikes
                else {}
            ),
            "mesh_stiffness": self.mesh_stiffness and self.mesh_stiffness.core(),
            "hysteresis.efficiency": None if self.hysteresis is None else self.hysteresis.efficiency,
        }


class Gearbox(core_parameters.GearboxFields, Transmission):  # type: ignore[misc]  # it needs what a transmission may leave out
    """A compliance and a loss law, each chosen freely.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.gearbox("wittenstein-tp010-mf-10").rated_output_torque
    81.0
    """

    losses: Annotated[ConstantEfficiency | LossMap, Field(discriminator="kind")]

    @rule
    def _strikes_not(self) -> Iterator[str]:
        if isinstance(self.stiffness, Rigid) and self.stiffness.strikes:
            yield "has rigid flanks with backlash, which require a drive train; read the file by lm.load, or give a stiffness"

    def __repr__(self) -> str:
        laws = f"stiffness {self.stiffness.kind}, losses {self.losses.kind}"
        rated = f"{self.rated_output_torque:.4g} N·m at {practical(self.rated_input_speed, 'rad/s', 4)}"
        return f"Gearbox({self.ratio:g}:1, {rated}, {laws})"

    def forward(self) -> Self:
        """The same as the test rig takes it: with a ratio above 0, and with the factor 1 on its stiffness at all angles.

        One that reverses has the same values.
        """
        if self.ratio > 0.0 and self.mesh_stiffness is None:
            return self
        return self.model_copy(update={"ratio": abs(self.ratio), "mesh_stiffness": None})
