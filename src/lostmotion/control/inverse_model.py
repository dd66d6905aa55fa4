"""Feedforward by the model of the drive, with losses over load and speed that may adapt, and the load that follows from it."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import model_validator

from .. import _core
from ..errors import InputError
from ..inputs.part import Part
from ..inputs.quantities import (
    Frequency,
    Inertia,
    Limit,
    LossAdaptation,
    NotNegative,
    Number,
    Positive,
    Speed,
    Stiffness,
    Time,
    Torque,
)
from ..model.gear import Gear
from ..model.losses import ConstantEfficiency, LossMap, MeshEfficiency, WormMesh, efficiency_map
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from ..reproducible import expm1

Range = tuple[Annotated[Number, NotNegative], Annotated[Number, NotNegative]]
TorqueRange = tuple[Annotated[Torque, NotNegative], Annotated[Torque, NotNegative]]


class LossAdaptationLaw(Part):
    """``kappa' = rate e Y``, e the error of the motor's speed and Y the torque of the losses (Slotine and Li 1987)."""

    rate: Annotated[LossAdaptation, Positive]
    """g_1"""
    limits: Range = (0.0, 5.0)
    """that the factor stays within"""


class FrictionAdaptationLaw(Part):
    """``T_10' = rate e sgn w*``, e the error of the motor's speed."""

    rate: Annotated[Stiffness, Positive]
    """g_2"""
    limits: TorqueRange
    """that the torque stays within"""


class LoadObserver(Part):
    """The load torque from the motor's torque and speed, through the losses of the gear; it joins the feedforward.

    ``T_1 = LP[M - J w' - b w - T_10 sgn w]``, ``T_2 + sgn(w) kappa M_2B(T_2) = i T_1``, ``M_Z = LP[T_2 - J_Z phi'' - b_Z phi']``
    """

    input_time: Annotated[Time, Positive]
    """of the low pass on the torque at the gear's input"""
    load_time: Annotated[Time, Positive]
    """of the low pass on the load torque"""
    speed_bandwidth: Annotated[Frequency, Positive] | None = None
    """w_c/(2 pi): the gains of the speed loop become k_p = w_c J and k_i = k_p w_c/4, with the inertia
    J = J_MR + (1 + dm_2B/dmu) J_Z/i^2 that the motor feels under that load; left out, they stay"""


class InverseModel(Part):
    """Torque of the motor and twist of the gear that the reference needs, by the data of the drive itself.

    ``T_2* = J_Z a + b_Z w + M_Z``, ``M = J_MR i a + b_MR i w + T_2*/i + sgn(w) (T_10 + kappa M_2B(T_2*)/i)`` for the speed w
    and the acceleration a of the reference. With the encoder on the motor its position runs ahead by the twist under T_2*.
    What is left out here is that of the drive.
    """

    efficiency: Annotated[Number, Limit(gt=0.0, le=1.0)] | None = None
    """constant efficiency, in the place of the losses of the gear"""
    loss_factor: Annotated[Number, NotNegative] = 1.0
    """kappa at the start, on the losses"""
    friction_torque: Annotated[Torque, NotNegative] | None = None
    """T_10 at the start"""
    load_inertia: Annotated[Inertia, NotNegative] | None = None
    load_torque: Torque = 0.0
    """M_Z that is known beforehand, against the motion forward"""
    twist_rate: Annotated[Speed, Positive] | None = None
    """at which the motor passes through a gap, in terms of the load's shaft; needed where the gear has one"""
    loss_adaptation: LossAdaptationLaw | None = None
    friction_adaptation: FrictionAdaptationLaw | None = None
    min_speed: Annotated[Speed, NotNegative] = 0.0
    """of the motor, below which nothing is adapted or observed"""
    load_observer: LoadObserver | None = None

    @model_validator(mode="after")
    def _starts_within_limits(self) -> Self:
        for law, key, value in (
            (self.loss_adaptation, "loss_factor", self.loss_factor),
            (self.friction_adaptation, "friction_torque", self.friction_torque),
        ):
            if law is None:
                continue
            low, high = law.limits
            if not low < high:
                raise ValueError(f"has limits = {[low, high]}, which must rise; check them")
            if value is not None and not low <= value <= high:
                raise ValueError(f"has {key} = {value:g}, outside the limits {[low, high]} of its adaptation")
        return self

    def core(self, train: DriveTrain, motor: str, shaft: str, *, on_motor: bool) -> _core.InverseModel:
        """The solver's block, for a motor whose reference is of a shaft; `on_motor`: the position is measured on the motor.

        Raises
        ------
        InputError
            Not one gear alone joins the two shafts, or a gap has no rate.
        """
        gear = self._gear(train, train.motors[motor].shaft, shaft)
        out = _core.InverseModel()
        out.present = True
        here, there, m = train.shafts[gear.input], train.shafts[gear.output], train.motors[motor]
        out.motor_inertia = here.inertia + m.rotor_inertia + gear.inertia
        out.motor_viscous_friction = here.viscous_friction + gear.viscous_friction
        out.load_inertia = there.inertia if self.load_inertia is None else self.load_inertia
        out.load_viscous_friction = there.viscous_friction
        out.load_torque = self.load_torque
        out.losses = self._losses(gear)
        out.loss_factor = self.loss_factor
        out.friction_torque = (
            m.friction_torque + here.friction()[0] if self.friction_torque is None else self.friction_torque
        )
        out.min_speed = self.min_speed
        for law, adapted in ((self.loss_adaptation, out.of_losses), (self.friction_adaptation, out.of_friction)):
            if law is not None:
                adapted.rate, (adapted.min, adapted.max) = law.rate, law.limits
        low, high = out.of_friction.min, out.of_friction.max
        if not low <= out.friction_torque <= high:
            raise InputError(
                f"inverse_model.friction_adaptation.limits: {[low, high]} N*m leave out the friction of the drive, "
                f"{out.friction_torque:g} N*m; widen them, or give friction_torque"
            )
        if on_motor and not isinstance(gear.stiffness, Rigid):
            out.through_gear = True
            out.curve = gear.stiffness.core()
            has_gap = gear.stiffness.pieces()[1][0] == 0.0
            if has_gap and self.twist_rate is None:
                raise InputError(
                    "inverse_model: lacks twist_rate; the gear has a gap, and the motor needs a speed to pass it with"
                )
            out.twist_rate = self.twist_rate or math.inf
        return out

    def core_observer(self, sample_time: float) -> _core.LoadObserver:
        """The solver's block, at the sample time [s] of the speed loop."""
        out = _core.LoadObserver()
        if self.load_observer is not None:
            out.present = True
            out.input_time = self.load_observer.input_time
            out.load_time = self.load_observer.load_time
            out.input_share = -expm1(-sample_time / out.input_time)
            out.load_share = -expm1(-sample_time / out.load_time)
            out.bandwidth = 2.0 * math.pi * (self.load_observer.speed_bandwidth or 0.0)
        return out

    def _gear(self, train: DriveTrain, motor_shaft: str, shaft: str) -> Gear:
        between = [g for g in train.gears.values() if {g.input, g.output} & {motor_shaft, shaft}]
        if len(between) != 1 or (between[0].input, between[0].output) != (motor_shaft, shaft):
            raise InputError(
                f"inverse_model: takes one gear from the shaft {motor_shaft} to {shaft} and no other at either; "
                "take feedforward for other trains"
            )
        return between[0]

    def _losses(self, gear: Gear) -> _core.GearLosses:
        losses = ConstantEfficiency(efficiency=self.efficiency) if self.efficiency is not None else gear.losses
        out = _core.GearLosses()
        out.ratio = gear.ratio
        if isinstance(losses, ConstantEfficiency):
            out.kind = _core.GearLosses.Kind.efficiency
            out.efficiency = losses.efficiency
            return out
        out.kind = _core.GearLosses.Kind.map
        if isinstance(losses, MeshEfficiency | WormMesh):
            out.map = efficiency_map(*losses.efficiencies()).core()
        elif isinstance(losses, LossMap):
            out.map = losses.core()
            out.rated_torque = gear.rated_output_torque or 1.0
            out.rated_speed = gear.rated_input_speed or 1.0
        return out
