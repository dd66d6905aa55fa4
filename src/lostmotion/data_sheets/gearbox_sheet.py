"""The data sheet of a gearbox, as manufacturers print it, and the parts that follow from it."""

import itertools
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ..errors import InputError
from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Angle,
    Inertia,
    NotNegative,
    Number,
    Positive,
    Speed,
    Stiffness,
    Switch,
    Torque,
    ViscousFriction,
)
from ..model.gearbox import GearboxLimits, GearboxLoads
from ..model.torsion import Hysteresis, LinearStiffness, Rigid, TorsionCurve
from .loss_data import Efficiency, EfficiencyPoint, LossData, LossEstimate
from .sheet import Record

# Data of a gearbox that `[gearbox]` has too, under the same names.
SCALARS = ("ratio", "inertia", "viscous_friction", "rated_input_speed", "rated_output_torque")


# By kind and from which ratio on. The ranges are wider than what these sheets print, as other makes are worse and better.
ESTIMATES: dict[str, tuple[tuple[float, LossEstimate], ...]] = {
    "planetary": (
        (0.0, LossEstimate(0.97, 0.90, 0.98, "one stage: Bonfiglioli R05 and Wittenstein TP print 97 %, maxon GP 80 to 95 %")),
        (10.0, LossEstimate(0.94, 0.80, 0.96, "two stages: Bonfiglioli R05 and Wittenstein TP print 94 %, maxon GP 71 to 87 %")),
        (100.0, LossEstimate(0.91, 0.70, 0.94, "three stages: Bonfiglioli R05 prints 91 %, maxon GP 66 to 78 %")),
    ),
    "strain_wave": (
        (0.0, LossEstimate(0.75, 0.60, 0.85, "Schaeffler RT1-H prints 67 to 77 % at ratio 100, 2000 rpm and 20 °C")),
    ),
}  # fmt: skip


class StiffnessData(Part):
    """Torsional stiffness by segments, as manufacturers print it: K1 up to torque T1, K2 up to T2, K3 beyond."""

    slopes: tuple[Annotated[Stiffness, Positive], ...] = Field(min_length=1)  #: K1, K2, ...
    torques: tuple[Annotated[Torque, Positive], ...] = ()  #: T1, T2, ...: one fewer
    scatter: Annotated[Number, NotNegative] | None = None  #: relative, from unit to unit

    @rule
    def _matches(self) -> Iterator[str]:
        if len(self.torques) != len(self.slopes) - 1:
            yield f"has {len(self.slopes)} slopes and {len(self.torques)} torques; it needs one torque fewer"
        for a, b in itertools.pairwise(self.torques):
            if b <= a:
                yield f"has torques that do not rise: {b} N*m follows {a} N*m"

    def breaks(self) -> tuple[float, ...]:
        """Twists [rad] at which the stiffness changes."""
        out, twist, previous = [], 0.0, 0.0
        for torque, slope in zip(self.torques, self.slopes, strict=False):
            twist += (torque - previous) / slope
            out.append(twist)
            previous = torque
        return tuple(out)


class GearboxSheet(GearboxLoads, Record):
    """Data sheet of a gearbox."""

    kind: Literal["strain_wave", "planetary", "worm", "cycloidal", "other"]
    ratio: Annotated[Number, Positive]  #: input speed / output speed
    rated_output_torque: Annotated[Torque, Positive] | None = None
    rated_input_speed: Annotated[Speed, Positive] | None = None  #: at which the rated torque and the efficiency hold
    inertia: Annotated[Inertia, NotNegative] | None = None  #: on the input shaft
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0  #: on the input shaft, beside the losses
    stiffness: StiffnessData | None = None
    rigid: Switch = False
    """without any twist, so that there is no stiffness: of a gear that was identified, or is taken, as such"""
    backlash: Annotated[Angle, NotNegative] | None = None  #: total gap at the output
    hysteresis_loss: Annotated[Angle, Positive] | None = None
    """width of the loop at zero torque after loading to rated torque in both directions"""
    hysteresis_efficiency: Efficiency | None = None  #: eta_H of (16), where the loop itself is known
    losses: LossData = LossData()

    @model_validator(mode="before")
    @classmethod
    def _as_printed(cls, table: Any) -> Any:
        """One efficiency, which holds at rated load and speed, and one stiffness stand for lists with one entry."""
        if not isinstance(table, Mapping):
            return table
        table = dict(table)
        losses = table.get("losses", {})
        if "efficiency" in table:
            if not isinstance(losses, Mapping) or "efficiency" in losses:
                raise ValueError("has efficiency and losses.efficiency, which say the same; give one of them")
            losses = {**losses, "efficiency": table.pop("efficiency")}
        if isinstance(losses, Mapping) and isinstance(losses.get("efficiency"), float | int | str):
            if table.get("rated_input_speed") is None:
                raise ValueError("has one efficiency, which holds at rated_input_speed; give that too")
            point = {"input_speed": table["rated_input_speed"], "efficiency": losses["efficiency"]}
            losses = {**losses, "efficiency": [point]}
        if losses:
            table["losses"] = losses
        if isinstance(table.get("stiffness"), float | int | str):
            table["stiffness"] = {"slopes": [table["stiffness"]]}
        return table

    @rule
    def _rigid_has_no_twist(self) -> Iterator[str]:
        if self.rigid:
            for key in ("stiffness", "backlash", "hysteresis_loss", "hysteresis_efficiency"):
                if getattr(self, key) is not None:
                    yield f"is rigid and has {key}; a rigid gearbox has no twist, so leave one of them out"

    @rule
    def _one_hysteresis(self) -> Iterator[str]:
        if self.hysteresis_loss is not None and self.hysteresis_efficiency is not None:
            yield "has hysteresis_loss and hysteresis_efficiency; they say the same, so give one"

    def missing(self) -> dict[str, str]:
        """Data that a run requires and the record lacks: the key of `[gearbox]`, and a hint to its place."""
        hints = {
            "rated_output_torque": "",
            "rated_input_speed": "",
            "inertia": "moment of inertia on the input shaft; ",
            **({} if self.rigid else {"stiffness": "torsional stiffness; "}),
        }
        out = {key: f"{hint}see {self.where(key)}" for key, hint in hints.items() if getattr(self, key) is None}
        if self.losses.empty and self.loss_estimate() is None:
            out["losses"] = f"an efficiency or a loss table; see {self.where('losses.efficiency')}"
        return out

    def loss_estimate(self) -> LossEstimate | None:
        """Loss estimate of the kind, if the sheet prints no efficiency; None if it does, or if the kind has no estimate."""
        if not self.losses.empty:
            return None
        found = [estimate for ratio, estimate in ESTIMATES.get(self.kind, ()) if self.ratio > ratio]
        return found[-1] if found else None

    def with_losses(self) -> Self:
        """The sheet with the estimated efficiency at rated load and speed, where the sheet prints none."""
        estimate = self.loss_estimate()
        if estimate is None or self.rated_input_speed is None:
            return self
        point = EfficiencyPoint(input_speed=self.rated_input_speed, efficiency=estimate.efficiency)
        return self.model_copy(update={"losses": self.losses.model_copy(update={"efficiency": (point,)})})

    def level(self) -> str | None:
        """Level of a run with these data: ``"printed losses"``, ``"estimated losses"``, or None."""
        return None if self.missing() else "printed losses" if self.loss_estimate() is None else "estimated losses"

    def _assumed(self) -> dict[str, str]:
        estimate = self.loss_estimate()
        if estimate is None:
            return {}
        return {
            "losses": f"The losses of {self.name} are not printed. Its efficiency at rated load is estimated as {estimate.efficiency:.0%}, "
            f"of its kind {estimate.lowest:.0%} to {estimate.highest:.0%} ({estimate.source})."
        }

    def torsion(self) -> TorsionCurve | Rigid | None:
        """The compliance, where the sheet says it."""
        if self.rigid:
            return Rigid()
        return None if self.stiffness is None else self.torsion_curve()

    def torsion_curve(self) -> TorsionCurve:
        """The torsion curve, with the backlash as its first segment."""
        assert self.stiffness is not None
        return TorsionCurve(slopes=self.stiffness.slopes, breaks=self.stiffness.breaks(), backlash=self.backlash or 0.0)

    def hysteresis(self, curve: TorsionCurve | LinearStiffness) -> Hysteresis | None:
        """eta_H of (16), from itself or from the width of the loop.

        On the loop that turns at rated torque T_R, P = T_R - h at the turning points and h = (1 - eta_H)/2 P; it
        crosses zero torque where P = h. So the width gives h, and h gives eta_H.
        """
        if self.hysteresis_efficiency is not None:
            return Hysteresis(efficiency=self.hysteresis_efficiency)
        if self.hysteresis_loss is None:
            return None
        assert self.rated_output_torque is not None
        h = curve.core().torque(0.5 * self.hysteresis_loss)
        q = h / (self.rated_output_torque - h)
        if not 0.0 <= q < 0.5:
            raise InputError(
                f"{self.name}: has hysteresis_loss = {self.hysteresis_loss:.4g} rad, which with this stiffness means a loop of half of "
                "the rated torque or more; check both values and their units"
            )
        return Hysteresis(efficiency=1.0 - 2.0 * q)

    def limits(self) -> GearboxLimits:
        """Limits for the drive check."""
        return GearboxLimits.like(self)

    def scalars(self) -> dict[str, Any]:
        """Keys of `[gearbox]` that the sheet has too."""
        return {name: getattr(self, name) for name in SCALARS if getattr(self, name) is not None}
