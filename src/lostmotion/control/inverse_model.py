"""Feedforward by the model of the drive, with losses over load and speed that may adapt, and the load that follows from it."""

from collections.abc import Iterator
from typing import Any

from ..errors import InputError
from ..inputs.core_parameters import (
    FrictionAdaptationLawFields,
    InverseModelFields,
    LoadObserverFields,
    LossAdaptationLawFields,
)
from ..inputs.part import rule
from ..model.gear import Gear
from ..model.losses import ConstantEfficiency, LossMap, MeshEfficiency, WormMesh, efficiency_map
from ..model.torsion import Rigid
from ..model.train import DriveTrain


class LossAdaptationLaw(LossAdaptationLawFields):
    """``kappa' = rate e Y``, e the error of the motor's speed and Y the torque of the losses (Slotine and Li 1987)."""


class FrictionAdaptationLaw(FrictionAdaptationLawFields):
    """``T_10' = rate e sgn w*``, e the error of the motor's speed."""


class LoadObserver(LoadObserverFields):
    """Observer of the load torque from the motor's torque and speed, through the losses of the gear; it adds to the
    feedforward.

    ``T_1 = LP[M - J w' - b w - T_10 sgn w]``, ``T_2/i + sgn(w) kappa M_2B(T_2)/|i| = T_1``, ``M_Z = LP[T_2 - J_Z phi'' - b_Z phi']``
    """


class InverseModel(InverseModelFields):
    """Feedforward of the motor torque and the twist that the reference requires, by the data of the drive.

    ``T_2* = J_Z a + b_Z w + M_Z``, ``M = J_MR i a + b_MR i w + T_2*/i + sgn(i w) (T_10 + kappa M_2B(T_2*)/|i|)`` for the speed w
    and the acceleration a of the reference. With the encoder on the motor its position runs ahead by the twist under T_2*.
    Parameters that are left out here have the values of the drive.
    """

    loss_adaptation: LossAdaptationLaw | None = None
    friction_adaptation: FrictionAdaptationLaw | None = None
    load_observer: LoadObserver | None = None

    @rule
    def _starts_within_limits(self) -> Iterator[str]:
        for law, key, value in (
            (self.loss_adaptation, "loss_factor", self.loss_factor),
            (self.friction_adaptation, "friction_torque", self.friction_torque),
        ):
            if law is None:
                continue
            low, high = law.limits
            if not low < high:
                yield f"has limits = {[low, high]}, which must rise; check them"
            if value is not None and not low <= value <= high:
                yield f"has {key} = {value:g}, outside the limits {[low, high]} of its adaptation"

    def solver_fields(self, train: DriveTrain, motor: str, shaft: str, *, on_motor: bool) -> dict[str, Any]:
        """Fields for the solver, for a motor whose reference is of a shaft; `on_motor`: the position is measured on the motor.

        Raises
        ------
        InputError
            Not one gear alone joins the two shafts, or a gap has no rate.
        """
        gear = self._gear(train, train.motors[motor].shaft, shaft)
        try:
            train.refuse_coupled(
                (gear.input, gear.output), "an inverse model takes each inertia by itself; leave inverse_model out"
            )
        except InputError as problem:
            raise InputError(problem, "inverse_model") from None
        here, there, m = train.shafts[gear.input], train.shafts[gear.output], train.motors[motor]
        laws = {key: getattr(self, key) for key in ("loss_adaptation", "friction_adaptation", "load_observer")}
        own = {
            "friction_torque": m.friction_torque + here.friction()["torque"],
            "load_inertia": train.inertia_of(gear.output),
            **{key: value for key, value in self.core_fields().items() if value is not None},
        }
        if self.friction_adaptation is not None:
            low, high = self.friction_adaptation.limits
            if not low <= own["friction_torque"] <= high:
                raise InputError(
                    f"{[low, high]} N*m leave out the friction of the drive, "
                    f"{own['friction_torque']:g} N*m; widen them, or give friction_torque",
                    "inverse_model.friction_adaptation.limits",
                )
        losses = self._losses(gear)
        return own | {
            "efficiency": losses.pop("efficiency", None),
            "motor_inertia": train.inertia_of(gear.input) + m.rotor_inertia + gear.inertia,
            "motor_viscous_friction": here.viscous_friction + gear.viscous_friction,
            "load_viscous_friction": there.viscous_friction,
            "losses": losses,
            "twist": self._twist(gear) if on_motor else None,
            **{key: None if law is None else law.core_fields() for key, law in laws.items()},
        }

    def _twist(self, gear: Gear) -> dict[str, Any] | None:
        if isinstance(gear.stiffness, Rigid):
            return None
        if gear.stiffness.has_gap and self.twist_rate is None:
            raise InputError(
                "lacks twist_rate; the gear has a gap, and the motor needs a speed to pass it with", "inverse_model"
            )
        return {"curve": gear.stiffness.core()}

    def _gear(self, train: DriveTrain, motor_shaft: str, shaft: str) -> Gear:
        between = [g for g in train.gears.values() if {g.input, g.output} & {motor_shaft, shaft}]
        if len(between) != 1 or (between[0].input, between[0].output) != (motor_shaft, shaft):
            raise InputError(
                f"takes one gear from the shaft {motor_shaft} to {shaft} and no other at either; "
                "take feedforward for other trains",
                "inverse_model",
            )
        return between[0]

    def _losses(self, gear: Gear) -> dict[str, Any]:
        losses = ConstantEfficiency(efficiency=self.efficiency) if self.efficiency is not None else gear.losses
        out: dict[str, Any] = {"ratio": gear.ratio, "kind": "loss_map"}
        if isinstance(losses, ConstantEfficiency):
            return out | {"kind": "constant_efficiency", "efficiency": losses.efficiency}
        if isinstance(losses, MeshEfficiency | WormMesh):
            return out | {"map": efficiency_map(*losses.efficiencies()).core()}
        if isinstance(losses, LossMap):
            rated = {"rated_torque": gear.rated_output_torque or 1.0, "rated_speed": gear.rated_input_speed or 1.0}
            return out | rated | {"map": losses.core()}
        return out
