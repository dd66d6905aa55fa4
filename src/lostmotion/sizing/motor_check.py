"""The check of a motor: speed, heat, voltage, current."""

from __future__ import annotations

import math

import numpy as np

from ..model.motor import Motor
from ..units.practical import RPM
from .duty_cycle import DutyCycle
from .finding import Finding, Verdict, within

COPPER = 0.00393  # relative rise of a winding's resistance [1/K]
REFERENCE = 25.0  # temperature that the printed resistance holds for [°C]


def largest_speed(m: Motor, speed: float, where: str = "motor") -> Finding:
    """speed: the largest of the run [rad/s]. where: the table of the motor."""
    limit = m.limits.max_speed if m.limits else None
    return within(
        "max_motor_speed",
        "input speed, largest, for the motor",
        RPM * speed,
        None if limit is None else RPM * limit,
        "rpm",
        "largest speed of the motor",
        key=f"{where}.limits.max_speed",
    )


def heat(m: Motor, cycle: DutyCycle, ambient: float, where: str = "motor") -> list[Finding]:
    """Torque over the cycle and the temperature of the winding at this ambient temperature [°C]."""
    limits = m.limits
    torque = cycle.rms_motor_torque()
    continuous = limits.continuous_torque if limits is not None else m.rated_torque if m.kind == "dc" else None
    name = "continuous torque of the motor"
    key = f"{where}.limits.continuous_torque"
    findings = [within("motor_torque", "motor torque, rms", torque, continuous, "N·m", name, key=key, cycle=cycle)]
    if (
        limits is None
        or limits.resistance is None
        or limits.torque_constant is None
        or limits.thermal_resistance is None
        or limits.max_winding_temperature is None
    ):
        return findings
    permissible = limits.max_winding_temperature
    what = "winding temperature"
    # dT = R_th R(T) I², R(T) = R (1 + a (ambient + dT - 25 °C))
    cold = limits.thermal_resistance * limits.resistance * (torque / limits.torque_constant) ** 2
    if cold * COPPER >= 1.0:
        remark = "the current is far too large to last"
        return [
            *findings,
            Finding("winding_temperature", what, f"thermal runaway, {cycle}", "warning", remark, math.inf),
        ]
    rise = cold * (1.0 + COPPER * (ambient - REFERENCE)) / (1.0 - COPPER * cold)
    value = f"{ambient + rise:.0f} of {permissible:.0f} °C in the long run at {ambient:.0f} °C ambient, {cycle}"
    use = rise / (permissible - ambient) if permissible > ambient else math.inf
    remark = f"reserve {permissible - ambient - rise:.0f} K"
    verdict: Verdict = "ok" if use <= 1.0 else "warning"
    return [*findings, Finding("winding_temperature", what, value, verdict, remark, use)]


def voltage(m: Motor, command: np.ndarray, torque: np.ndarray, speed: np.ndarray, where: str = "motor") -> Finding:
    """The largest that the command asks for, or that torque [N·m] and speed [rad/s] need."""
    limits = m.limits
    if m.kind == "dc":
        if m.rated_voltage is None:
            return Finding("voltage", "voltage, largest", "not known", "unknown", f"{where}.rated_voltage is missing")
        peak = m.rated_voltage * float(abs(command).max())
        limit = m.voltage_limit or (limits.max_voltage if limits else None)
    elif limits is not None and limits.resistance is not None and limits.torque_constant is not None:
        current = torque / limits.torque_constant
        emf = limits.torque_constant * speed
        peak = float(abs(limits.resistance * current + emf).max())
        limit = limits.max_voltage
    else:
        missing = f"{where}.limits.resistance and {where}.limits.torque_constant are missing"
        return Finding("voltage", "voltage, largest", "not known", "unknown", missing)
    key = f"{where}.voltage_limit" if m.kind == "dc" else f"{where}.limits.max_voltage"
    return within("voltage", "voltage, largest", peak, limit, "V", "limit of the amplifier", key=key)


def current(m: Motor, torque: np.ndarray, where: str = "motor") -> Finding:
    """The largest of the run."""
    limits = m.limits
    if limits is None or limits.torque_constant is None:
        missing = f"{where}.limits.torque_constant is missing"
        return Finding("current", "current, largest", "not known", "unknown", missing)
    peak = float(abs(torque).max()) / limits.torque_constant
    name, key = "limit of motor and amplifier", f"{where}.limits.max_current"
    return within("current", "current, largest", peak, limits.max_current, "A", name, key=key)
