"""Motors: parameters and ratings."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import model_validator

from ..errors import InputError
from ..inputs.part import Part
from ..inputs.quantities import (
    Current,
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
    argument,
)
from ..units.practical import practical


class MotorLimits(Part):
    """What a motor can stand. No run depends on it; the drive check compares with it."""

    continuous_torque: Annotated[Torque, Positive] | None = None
    max_speed: Annotated[Speed, Positive] | None = None
    resistance: Annotated[Resistance, Positive] | None = None
    """of the winding, at 25 °C"""
    torque_constant: Annotated[TorqueConstant, Positive] | None = None
    thermal_resistance: Annotated[ThermalResistance, Positive] | None = None
    """winding to ambient"""
    max_winding_temperature: Temperature | None = None
    max_voltage: Annotated[Voltage, Positive] | None = None
    """of the amplifier of a torque source; of a DC motor `voltage_limit` says it"""
    max_current: Annotated[Current, Positive] | None = None
    """the smaller of those of motor and amplifier"""


# Keys of `[motor]` that a torque source has no use for.
DC_KEYS = (
    "rated_speed",
    "rated_voltage",
    "electrical_time_constant",
    "armature_voltage_constant",
    "voltage_limit",
)


class Motor(Part):
    """DC motor with servo amplifier (eq. 2), or a torque source in its place."""

    kind: Literal["dc", "torque_source"] = "dc"
    """`torque_source`: the command times `rated_torque` acts on the rotor without delay"""
    rotor_inertia: Annotated[Inertia, NotNegative]
    """J_M"""
    friction_torque: Annotated[Torque, NotNegative] = 0.0
    """T_10, dry friction of the bearings"""
    rated_torque: Annotated[Torque, Positive] = 1.0
    """M_DR"""
    rated_speed: Annotated[Speed, Positive] | None = None
    """omega_DR"""
    rated_voltage: Annotated[Voltage, Positive] | None = None
    """u_ZR, that of command 1. A change over a record or a base, by `--set` or in a study is the same motor at another voltage: rated_speed and
    armature_voltage_constant follow so that stall torque and no-load speed go with the voltage, unless they are given too"""
    electrical_time_constant: Annotated[Time, Positive] | None = None
    """tau_a"""
    armature_voltage_constant: Annotated[Number, Limit(gt=1.0)] | None = None
    """k_N, stall torque / rated torque at rated voltage"""
    voltage_limit: Annotated[Voltage, Positive] | None = None
    """largest voltage of the amplifier"""
    limits: MotorLimits | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.kind == "dc":
            for key in ("rated_speed", "electrical_time_constant", "armature_voltage_constant"):
                if getattr(self, key) is None:
                    raise ValueError(f'lacks {key}, which a motor of kind "dc" needs')
        else:
            idle = [key for key in DC_KEYS if getattr(self, key) is not None]
            if idle:
                raise ValueError(
                    f"has {', '.join(idle)}, of no use to a torque_source; leave {'it' if len(idle) == 1 else 'them'} out"
                )
        if self.voltage_limit is not None:
            if self.rated_voltage is None:
                raise ValueError("has a voltage_limit, which also needs rated_voltage")
            if self.limits is not None and self.limits.max_voltage is not None:
                raise ValueError("has voltage_limit and limits.max_voltage, which say the same of a DC motor; give one")
        return self

    def __repr__(self) -> str:
        if self.rated_speed is None:
            rated = f"torque source, rated {self.rated_torque:.4g} N·m"
        else:
            rated = f"dc, {self.rated_torque:.4g} N·m at {practical(self.rated_speed, 'rad/s', 4)}"
        return f"{type(self).__name__}({rated}, rotor {self.rotor_inertia:.4g} kg·m²)"

    @property
    def no_load_speed(self) -> float:
        """Speed [rad/s] at command 1 without any load or friction, by (2)."""
        if self.rated_speed is None or self.armature_voltage_constant is None:
            raise InputError("a torque source has no speed of its own")
        return self.rated_speed * self.armature_voltage_constant / (self.armature_voltage_constant - 1.0)

    @property
    def command_limit(self) -> float | None:
        """|E_C| that the amplifier can follow; None without a limit."""
        if self.voltage_limit is None or self.rated_voltage is None:
            return None
        return self.voltage_limit / self.rated_voltage

    def at_voltage(self, voltage: float) -> Self:
        """The same DC motor where command 1 is another voltage [V].

        Stall torque M_DR k_N and no-load speed omega_DR k_N/(k_N - 1) of (2) go with the voltage; the rated torque, which is
        a matter of heat, and the time constant stay.

        Raises
        ------
        InputError
            The motor has no rated voltage, or at this voltage it does not reach its rated torque.
        """
        voltage = argument("voltage", voltage, "V")
        if self.rated_voltage is None or self.armature_voltage_constant is None:
            raise InputError("a motor needs a rated_voltage to be taken to another one; give it")
        share = voltage / self.rated_voltage
        k_N = share * self.armature_voltage_constant
        if not k_N > 1.0:
            minimum = self.rated_voltage / self.armature_voltage_constant
            raise InputError(
                f"{voltage:g} V must be above {minimum:.4g} V, at which the motor stalls under its rated torque; "
                "or give rated_speed and armature_voltage_constant too"
            )
        speed = share * self.no_load_speed * (k_N - 1.0) / k_N
        return self.model_copy(
            update={"rated_voltage": voltage, "armature_voltage_constant": k_N, "rated_speed": speed}
        )


class ShaftMotor(Motor):
    """A motor on a shaft of a drive train."""

    shaft: str
    """that it turns"""
    torque_limit: Annotated[Torque, Positive] | None = None
    """largest torque of a torque source"""

    @model_validator(mode="after")
    def _limit_fits_kind(self) -> Self:
        if self.torque_limit is not None and self.kind != "torque_source":
            raise ValueError(
                'has a torque_limit, which a motor of kind "dc" does not; give voltage_limit, or the kind "torque_source"'
            )
        return self
