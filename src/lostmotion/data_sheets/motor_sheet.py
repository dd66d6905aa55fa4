"""The data sheet of a motor, and the motor that follows from it."""

from __future__ import annotations

from typing import Annotated, Literal

from ..errors import InputError
from ..inputs.quantities import (
    Current,
    Inductance,
    Inertia,
    Limit,
    NotNegative,
    Number,
    Positive,
    Resistance,
    Speed,
    Temperature,
    ThermalResistance,
    Time,
    Torque,
    TorqueConstant,
    Voltage,
)
from ..model.motor import Motor, MotorLimits
from .sheet import Record


class MotorSheet(Record):
    """Data sheet of a DC motor, or of a brushless one seen from its supply as a DC motor."""

    kind: Literal["dc_brushed", "brushless"] = "dc_brushed"
    rated_voltage: Annotated[Voltage, Positive]
    rotor_inertia: Annotated[Inertia, Positive] | None = None
    rated_torque: Annotated[Torque, Positive] | None = None
    """at the shaft, continuous; with armature_voltage_constant that of the field"""
    rated_speed: Annotated[Speed, Positive] | None = None
    rated_current: Annotated[Current, Positive] | None = None
    no_load_speed: Annotated[Speed, Positive] | None = None
    no_load_current: Annotated[Current, Positive] | None = None
    stall_torque: Annotated[Torque, Positive] | None = None
    stall_current: Annotated[Current, Positive] | None = None
    torque_constant: Annotated[TorqueConstant, Positive] | None = None
    resistance: Annotated[Resistance, Positive] | None = None
    """terminal, at 25 °C"""
    inductance: Annotated[Inductance, Positive] | None = None
    friction_torque: Annotated[Torque, NotNegative] | None = None
    armature_voltage_constant: Annotated[Number, Limit(gt=1.0)] | None = None
    """k_N, where it is known itself"""
    electrical_time_constant: Annotated[Time, Positive] | None = None
    max_speed: Annotated[Speed, Positive] | None = None
    thermal_resistance: Annotated[ThermalResistance, Positive] | None = None
    """winding to ambient, both in series"""
    max_winding_temperature: Temperature | None = None

    def missing(self) -> dict[str, str]:
        """What a run needs and the record lacks."""
        need = {
            "rotor_inertia": self.rotor_inertia,
            "torque_constant, resistance": self.armature_voltage_constant or (self.torque_constant and self.resistance),
            "rated_torque or rated_current": self.rated_torque or self.rated_current,
            "inductance": self.electrical_time_constant or self.inductance,
            "friction_torque or no_load_current": self.friction_torque is not None or self.no_load_current,
        }
        return {key: f"see {self.where(key)}" for key, value in need.items() if not value}

    def motor(self) -> Motor:
        """Parameters of eq. (2).

        The rated point and the stall torque of the sheet are kept. So no-load speed is a result; manufacturers' data are
        often not consistent with each other, and `no_load_speed_of_model` says by how much.
        """
        missing = self.missing()
        if missing:
            key, where = next(iter(missing.items()))
            raise InputError(f"{self.name}: lacks {key}; {where}")
        k_t, R = self.torque_constant, self.resistance
        T_10 = self.friction_torque
        if T_10 is None:
            assert k_t is not None
            assert self.no_load_current is not None
            T_10 = k_t * self.no_load_current
        k_N, M_DR = self.armature_voltage_constant, self.rated_torque
        speed = self.rated_speed
        if k_N is None:
            assert k_t is not None
            assert R is not None
            if M_DR is None:
                assert self.rated_current is not None
                M_DR = k_t * self.rated_current
            else:
                M_DR += T_10
            stall = self.stall_torque if self.stall_torque is not None else k_t * self.rated_voltage / R
            k_N = stall / M_DR
            if speed is None:
                speed = (self.rated_voltage - R * M_DR / k_t) / k_t
        tau = self.electrical_time_constant
        if tau is None:
            assert self.inductance is not None
            assert R is not None
            tau = self.inductance / R
        return Motor(
            rotor_inertia=self.rotor_inertia,  # type: ignore[arg-type]  # not missing
            friction_torque=T_10,
            rated_torque=M_DR,  # type: ignore[arg-type]
            rated_speed=speed,
            rated_voltage=self.rated_voltage,
            electrical_time_constant=tau,
            armature_voltage_constant=k_N,
            limits=MotorLimits(
                continuous_torque=M_DR,
                max_speed=self.max_speed,
                resistance=R,
                torque_constant=k_t,
                thermal_resistance=self.thermal_resistance,
                max_winding_temperature=self.max_winding_temperature,
            ),
        )

    def no_load_speed_of_model(self) -> float:
        """[rad/s], where the speed-torque line of eq. (2) at rated voltage meets the friction torque."""
        m = self.motor()
        assert m.armature_voltage_constant is not None
        assert m.rated_speed is not None
        k = m.armature_voltage_constant
        return m.rated_speed * (k - m.friction_torque / m.rated_torque) / (k - 1.0)
