"""Rules of what feeds motors: energy that comes back, voltage of the DC bus, brake resistor, current of the amplifier."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..model.motor import Motor
from ..model.process_loads import Amplifier, Bus
from ..model.task import Task
from ..simulation.runs.results import RunArrays
from ..simulation.scenario.scenario import Scenario
from .axis_rules import missing
from .catalogue_formulas import bus_voltage, capacitor_energy
from .duty_cycle import integral, stretches
from .finding import Finding, within
from .motor_check import amperes_of, current_voltage_power
from .motor_quantities import phase_amplitudes
from .required_motion import InputDemand


@dataclass(frozen=True)
class Returned:
    """Energy that one cycle of an axis, or of several on one DC bus, returns."""

    largest: float  # without a pause [J]
    each: tuple[float, ...]  # energy of each stretch of braking [J]
    power: float  # largest [W]
    cycle: float  # [s]


def electrical_power(demand: InputDemand, motor: Motor) -> np.ndarray:
    """Power that a motor takes over its cycle [W], M w + copper loss; NaN where its data do not tell."""
    torque = demand.motor_torque(motor)
    copper = motor.copper_loss()
    if copper is None:
        return np.full_like(torque, np.nan)
    return np.asarray(torque * demand.speed + copper[0] * torque**2)


def returned(time: np.ndarray, power: np.ndarray, cycle: float) -> Returned:
    """Energy that a power over one cycle [W] returns; the cycle repeats, so that braking may begin before its end and end after it."""
    energy = np.maximum(-0.5 * (power[1:] + power[:-1]), 0.0) * np.diff(time)
    found = tuple(stretches(energy, energy > 0.0))
    return Returned(max(found, default=0.0), found, float(-min(power.min(), 0.0)), cycle)


def power_in_run(
    scenario: Scenario, name: str, result: RunArrays, command: np.ndarray, torque: str, speed: str
) -> np.ndarray:
    """Power that a motor takes at the samples of a run [W]; NaN where its data do not tell."""
    if (amplitudes := phase_amplitudes(scenario, result, name)) is not None:
        i_d, i_q, u_d, u_q = amplitudes
        return np.asarray(1.5 * (u_d * i_d + u_q * i_q))
    return current_voltage_power(scenario.train().motors[name], command, result[torque], result[speed])[2]


def bus_findings(
    result: RunArrays, powers: Mapping[str, np.ndarray], supply: Bus | None, cycle: float | None
) -> list[Finding]:
    """The rules of the DC bus that feeds all motors of a run.

    What one motor returns while another one takes power does not reach the capacitors.

    powers: of each motor [W], by its table.
    cycle: period after which the motion of the run repeats [s]; None: without a pause.
    """
    if supply is None:
        return []
    for where, power in powers.items():
        if np.isnan(power).any() and not supply.returns_to_mains:
            unknown = missing("bus_voltage", "DC bus", f"{where}.limits.torque_constant or {where}.limits.resistance")
            return [unknown]
    total = np.sum(list(powers.values()), axis=0)
    return supply_rules(returned(result.time, total, cycle or float(result.time[-1] - result.time[0])), supply)


def supply_rules(back: Returned | None, supply: Bus) -> list[Finding]:
    """Bus voltage, or with a brake resistor its largest and its mean power, for the energy returned in a cycle.

    Source: HIWIN MM99TE07-1701, p. 118: what the capacitors take up to the limit goes there first, the rest to the resistor.
    """
    rule = "bus_voltage" if supply.brake_resistance is None else "brake_resistor"
    what = "DC bus after braking" if supply.brake_resistance is None else "brake resistor"
    if supply.returns_to_mains:
        return []
    if back is None:
        return [missing(rule, what, "motor.limits.resistance")]
    if back.largest == 0.0:
        return [Finding(rule, what, "no energy returns", "ok", "", 0.0)]
    start = supply.start()
    for key, value in (
        ("voltage_limit", supply.voltage_limit),
        ("capacitance", supply.capacitance),
        ("max_voltage", start),
    ):
        if value is None:
            return [missing(rule, f"{what}: {back.largest:.4g} J return at once", f"task.supply.{key}")]
    assert supply.voltage_limit is not None
    assert supply.capacitance is not None
    assert start is not None
    if supply.brake_resistance is None:
        voltage = bus_voltage(supply.capacitance, start, back.largest)
        return [within(rule, what, voltage, supply.voltage_limit, "V", "largest voltage of the bus")]
    most = supply.voltage_limit**2 / supply.brake_resistance
    found = [within(rule, "brake resistor, largest power", back.power, most, "W", "power of the brake resistor")]
    taken = capacitor_energy(supply.capacitance, supply.voltage_limit, start)
    mean = sum(max(e - taken, 0.0) for e in back.each) / back.cycle
    what = "brake resistor, mean power"
    if supply.brake_power is None:
        return [*found, missing(rule, f"{what}: {mean:.4g} W", "task.supply.brake_power")]
    return [*found, within(rule, what, mean, supply.brake_power, "W", "continuous power of the brake resistor")]


def amplifier_rules(
    time: np.ndarray,
    current: np.ndarray,
    cycle: float,
    amplifier: Amplifier,
    bus: float | None,
    motor: Motor,
    where: str = "motor",
) -> list[Finding]:
    """Rules of an amplifier: rms and largest current, the longest time above the continuous one, and the voltage of the bus.

    Source: definitions of data sheets.

    time, current: current of the motor over the cycle [A], as the data sheet of the amplifier counts it; NaN where it
        is not known.
    bus: largest voltage of the DC bus before energy returns [V].
    where: table of the motor.
    """
    of, unit = amperes_of(motor, where), "A" if motor.winding is None else "A rms"
    what, continuous = "current, rms over the cycle", amplifier.continuous_current
    if np.isnan(current).any():
        found = [missing("amplifier_current", what, f"{where}.limits.torque_constant")]
    else:
        rms, name = math.sqrt(integral(time, current**2) / cycle), "continuous current of the amplifier"
        found = [within("amplifier_current", what + of, rms, continuous, unit, name)]
        if amplifier.peak_current is not None:
            peak, name = float(np.abs(current).max()), "peak current of the amplifier"
            what = f"current of the amplifier, largest{of}"
            found.append(within("amplifier_peak", what, peak, amplifier.peak_current, unit, name))
        if amplifier.peak_time is not None:
            longest = longest_above(time, np.abs(current), continuous)
            what, name = "longest time above the continuous current", "peak time of the amplifier"
            found.append(within("amplifier_peak", what, longest, amplifier.peak_time, "s", name))
    if amplifier.max_dc_voltage is not None:
        key, name = "task.supply.max_voltage", "largest bus voltage of the amplifier"
        what, limit = "DC bus of the amplifier", amplifier.max_dc_voltage
        unknown = missing("amplifier_voltage", what, key)
        found.append(unknown if bus is None else within("amplifier_voltage", what, bus, limit, "V", name))
    return found


def amplifier_of_a_run(
    time: np.ndarray, current: np.ndarray, motor: Motor, task: Task, where: str = "motor"
) -> list[Finding]:
    """The rules of an amplifier for a run, over the cycle of the task, or repeated without a pause."""
    assert task.amplifier is not None
    bus = None if task.supply is None else task.supply.start()
    return amplifier_rules(time, current, task.cycle or float(time[-1] - time[0]), task.amplifier, bus, motor, where)


def longest_above(time: np.ndarray, values: np.ndarray, limit: float) -> float:
    """Longest time without a pause during which values are above a limit; the cycle repeats, so that it may span its end."""
    return max(stretches(np.diff(time), np.minimum(values[1:], values[:-1]) > limit), default=0.0)


def effective_current(
    motor: Motor, torque: np.ndarray, speed: np.ndarray, oriented: np.ndarray | None = None
) -> np.ndarray:
    """Current of a motor [A], of one with a winding the effective value of a phase; NaN where its data do not tell.

    oriented: amplitude of a phase under field-oriented control.
    """
    current = oriented
    if current is None:
        current = current_voltage_power(motor, np.zeros_like(torque), torque, speed)[0]
    return current if motor.winding is None else current / math.sqrt(2.0)
