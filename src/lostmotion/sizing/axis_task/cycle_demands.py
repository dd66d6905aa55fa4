"""Columns of the row of an axis: demands of one cycle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...model.motor import Motor
from ...simulation.forms.slide_units import of_slides
from ...simulation.runs.results import RunArrays
from ...simulation.scenario.scenario import Scenario
from ..duty_cycle import DutyCycle, after_moves
from ..motor_check import rms_rise
from ..winding_temperature import TwoBodies
from .candidate_scenario import Cycles, last_cycle
from .motor_per_sample_time import Electrical

COLUMNS = {
    "current_peak": ("A", "largest current of the motor; of a synchronous one amplitude of a phase"),
    "current_rms": ("A", "rms current of the motor over the cycle; of a synchronous one effective current of a phase"),
    "voltage_peak": ("V", "largest voltage of the motor; of a synchronous one amplitude of a phase"),
    "voltage_rms": ("V", "rms voltage of the motor over the cycle; of a synchronous one effective voltage of a phase"),
    "motor_torque_peak": ("N*m", "largest torque of the motor"),
    "motor_torque_rms": ("N*m", "rms torque of the motor"),
    "motor_force_peak": ("N", "largest force of the linear motor"),
    "motor_force_rms": ("N", "rms force of the linear motor"),
    "required_torque_peak": ("N*m", "largest torque that the motion needs from the motor if the drive is rigid"),
    "required_torque_rms": ("N*m", "rms torque that the motion needs from the motor if the drive is rigid"),
    "required_force_peak": ("N", "largest force that the motion needs from the linear motor if the drive is rigid"),
    "required_force_rms": ("N", "rms force that the motion needs from the linear motor if the drive is rigid"),
    "winding_temperature": ("degC", "highest temperature of the winding after many cycles"),
    "case_temperature": ("degC", "highest temperature of the motor's case after many cycles"),
    "output_torque_peak": ("N*m", "largest torque at the gearbox output"),
    "output_torque_mean": ("N*m", "cubic mean of that torque, weighted with speed: what its life depends on"),
    "input_speed_peak": ("rad/s", "largest speed of the gearbox input"),
    "input_speed_mean": ("rad/s", "mean speed of the gearbox input"),
    "inertia_ratio": ("1", "inertia of the load with its payload, stage and gearbox at the motor / of the rotor"),
    "tracking_error_peak": ("rad", "largest distance of the load from its reference"),
    "tracking_error_rms": ("rad", "rms distance of the load from its reference"),
    "reversal_error": ("rad", "load at rest after forward moves less that after backward ones, magnitude"),
    "settling_time": ("s", "longest time after a move until the load stays in the window"),
    "rest_error": ("rad", "largest distance of the load from the end of its move, at the end of the rest after it"),
    "energy": ("J", "electrical energy taken per cycle, by its mean in each sample time"),
    "energy_returned": ("J", "electrical energy given back per cycle, the same way"),
    "mechanical_energy": (
        "J",
        "energy that the motor gives to its shaft per cycle, counted in each sample time: without its own heat",
    ),
    "position_gain": ("1/s", "gain of the position loop"),
    "speed_gain": ("N*m*s/rad", "gain of the speed loop"),
    "integral_gain": ("N*m/rad", "integral gain of the speed loop"),
    "mass": ("kg", "mass of the parts, by the total_mass of their records"),
    "length": ("m", "length of motor and gearbox in line, by the overall_length of their records"),
    "price": ("1", "price of the parts"),
    "lead_time": ("s", "latest delivery of a part"),
    "cycles": ("1", "cycles run; the values are of the last"),
    "change": ("1", "relative difference of the last two cycles"),
}
"""each with its unit and meaning"""

OF_LOAD = (
    "output_torque_peak",
    "output_torque_mean",
    "tracking_error_peak",
    "tracking_error_rms",
    "reversal_error",
    "rest_error",
)
"""columns in units of translation where the load is a slide"""


OF_ROTARY_MOTORS = (
    "motor_torque_peak",
    "motor_torque_rms",
    "required_torque_peak",
    "required_torque_rms",
    "output_torque_peak",
    "output_torque_mean",
    "input_speed_peak",
    "input_speed_mean",
    "speed_gain",
    "integral_gain",
)
"""columns that a linear motor does not have"""


def unit_of_column(name: str, *, slides: bool) -> str:
    """The unit of a column."""
    unit = COLUMNS[name][0]
    return of_slides(unit, positions=True, forces=True) if slides and name in OF_LOAD else unit


TOGETHER = 8  # sample times whose heat is taken as even


def rms(values: np.ndarray) -> float:
    """Root mean square over a cycle, whose last sample is the first of the next."""
    return float(np.sqrt(np.mean(values[:-1] ** 2)))


def change(result: RunArrays, count: int) -> float:
    """Difference of the last two cycles in rms torque, rms twist, and mean distance from the reference."""
    last, before = (last_cycle(len(result.time), count, back) for back in (1, 2))
    found = 0.0
    for name in ("motor_torque", "twist", "load_speed"):
        a, b = rms(result[name][last]), rms(result[name][before])
        found = max(found, abs(a - b) / max(a, b, math.ulp(0.0)))
    return found


@dataclass(frozen=True)
class Repeated:
    """Run of a candidate that repeats, or has as many cycles as the task permits."""

    scenario: Scenario
    cycles: Cycles
    result: RunArrays
    change: float

    @cached_property
    def duty(self) -> DutyCycle:
        """The last cycle as the rules of the drive check take it."""
        return duty_cycle_of(self.result, self.cycles.last, self.cycles.task.cycle)


def duty_cycle_of(result: RunArrays, cycle: slice, period: float) -> DutyCycle:
    """The duty cycle that the rules of the drive check are for."""
    values = (result[name][cycle] for name in ("motor_speed", "output_torque", "motor_torque"))
    speed, output, torque = values
    return DutyCycle(result.time[cycle], np.abs(speed), output, torque, None, period)


def temperatures_of(motor: Motor, time: np.ndarray, square: np.ndarray, ambient: float) -> tuple[float, float]:
    """Highest temperatures of winding and case [°C] in the cycle repeated for ever, as far as the data of the motor
    allow. Without its time constants the winding alone is computed, by the rms torque. NaN if nothing is known.

    time: [s], evenly.
    square: mean of the torque that heats as this cycle does, squared, over each interval [(N·m)²].
    """
    bodies = TwoBodies.of(motor, ambient)
    if bodies is not None:
        first = np.arange(0, len(square), TOGETHER)
        mean = np.add.reduceat(square, first) / np.diff(np.append(first, len(square)))
        course = bodies.repeated(np.append(time[first], time[-1]), mean)
        return (math.inf, math.inf) if course is None else (float(course[0].max()), float(course[1].max()))
    rise = rms_rise(motor, math.sqrt(float(square.mean())), ambient)
    return math.nan if rise is None else ambient + rise, math.nan


def columns_of_gearbox(duty: DutyCycle) -> dict[str, float]:
    """Torque and speed of the gearbox over a cycle."""
    return {
        "output_torque_peak": float(np.abs(duty.output_torque).max()),
        "output_torque_mean": duty.mean_output_torque,
        "input_speed_peak": duty.peak_input_speed,
        "input_speed_mean": duty.mean_input_speed,
    }


def row_of(run: Repeated, *, slides: bool = False) -> dict[str, float]:
    """The columns of one run; `slides`: of a linear motor, which has no torque, no input shaft and no ratio of inertias."""
    scenario, result, here, duty = run.scenario, run.result, run.cycles.last, run.duty
    time = result.time[here]
    e = Electrical.of(scenario, result, here)
    winding, case = temperatures_of(scenario.motor, time, e.heating_square, run.cycles.task.ambient_temperature)
    torque = result["motor_torque"][here]
    power = torque * result["motor_speed"][here]
    given = 0.5 * (power[1:] + power[:-1]) * np.diff(time)
    error = result["load_angle"][here] - run.cycles.position
    peak, mean = float(np.abs(torque).max()), math.sqrt(float(e.torque_square.mean()))
    effective = 1.0 if scenario.motor.winding is None else math.sqrt(0.5)  # of amplitudes
    columns = {
        "current_peak": float(np.abs(e.current).max()),
        "current_rms": effective * e.current_rms,
        "voltage_peak": float(np.abs(e.voltage).max()),
        "voltage_rms": effective * rms(e.voltage),
        "motor_torque_peak": peak,
        "motor_torque_rms": mean,
        "winding_temperature": winding,
        "case_temperature": case,
        **columns_of_gearbox(duty),
        "tracking_error_peak": float(np.abs(error).max()),
        "tracking_error_rms": rms(error),
        **_at_rest(run.cycles, error),
        "energy": float(np.maximum(e.energy, 0.0).sum()),
        "energy_returned": float(-np.minimum(e.energy, 0.0).sum()),
        "mechanical_energy": float(np.maximum(given, 0.0).sum()),
        **_gains(scenario),
        "cycles": float(run.cycles.count),
        "change": run.change,
    }
    if not slides:
        return columns
    forces = {"motor_force_peak": peak, "motor_force_rms": mean}
    return {name: value for name, value in columns.items() if name not in OF_ROTARY_MOTORS} | forces


def _gains(scenario: Scenario) -> dict[str, float]:
    """Gains of the loops; of a stepper, which has none, not known."""
    controller = scenario.controller
    if controller is None:
        return dict.fromkeys(("position_gain", "speed_gain", "integral_gain"), math.nan)
    assert controller.position is not None
    assert controller.speed is not None
    speed = controller.speed
    return {"position_gain": controller.position.gain, "speed_gain": speed.gain, "integral_gain": speed.k_i}


def _at_rest(cycles: Cycles, error: np.ndarray) -> dict[str, float]:
    """Settling time, reversal error and error at rest, from the rests after the moves of the last cycle."""
    window, asked = cycles.task.settling_window, cycles.reference.moves and cycles.task.settling_window is not None
    settling, reversal = after_moves(cycles.rests, cycles.time[cycles.last], error, window or 0.0)
    off = max((abs(float(error[rest][-1])) for _, _, rest in cycles.rests), default=math.nan)
    slowest = max([0.0, *settling]) if asked else math.nan
    return {"reversal_error": reversal, "settling_time": slowest, "rest_error": off}
