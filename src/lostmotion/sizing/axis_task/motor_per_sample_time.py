"""Torque, current and energy of the motor of an axis in each sample time of its controller, exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...control.command import CurrentLevel
from ...control.loops import FirstOrderCurrent, IdealCurrent
from ...simulation.runs.results import RunArrays
from ...simulation.scenario.scenario import Scenario
from ..motor_check import command_of_run, current_voltage_power
from ..motor_quantities import oriented_amplitudes
from ..winding_temperature import mean_square


@dataclass(frozen=True)
class Electrical:
    """Electrical quantities over the samples of one cycle, one in each sample time, both ends included, or over the times between them."""

    current: np.ndarray  # at the samples [A]; of a synchronous motor amplitude of a phase
    voltage: np.ndarray  # the same [V]
    energy: np.ndarray  # taken in each sample time [J]
    torque_square: np.ndarray  # mean of the torque squared in each [(N·m)²]
    heating_square: np.ndarray  # the same of the torque that all of the current would give across the magnets
    current_rms: float  # [A]

    @classmethod
    def of(cls, scenario: Scenario, result: RunArrays, here: slice) -> Electrical:
        """Quantities of the last cycle of a run that is sampled at each sample instant of its controller.

        Under field-oriented control the core has integrated energy and heat. Any other motor has the command E for a
        whole sample time. With tau dm/dt = k_N E - (k_N - 1) w/w_DR - m the integral of its torque over the sample
        time is known. Between its ends the torque is the parabola with that integral. The error of its square is
        (T/tau)^4/720 of the square of the ripple.
        """
        m, step = scenario.motor, float(result.time[1] - result.time[0])
        torque = result["motor_torque"][here]
        if m.kind == "stepper":
            return cls._of_stepper(scenario, result, here)
        oriented = oriented_amplitudes(scenario, result, "motor")
        if oriented is not None:
            assert m.winding is not None
            phase = m.winding.phase_values()
            heat = np.diff(result["copper_heat"][here]) / (1.5 * phase.resistance * step)  # mean of i squared
            return cls(
                oriented[0][here],
                oriented[1][here],
                np.diff(result["electrical_energy"][here]),
                mean_square(torque),
                phase.torque_constant**2 * heat,
                math.sqrt(float(heat.mean())),
            )
        c, command, speed = scenario.controller, result["command"][here], result["motor_speed"][here]
        given = command_of_run(m, c, command, torque, speed)
        current, voltage, _ = current_voltage_power(m, given, torque, speed)
        mean, square = _over_ticks(scenario, result, here, step)
        mean_speed = np.diff(_angle(scenario, result, here)) / step
        of_mean = command_of_run(m, c, command[:-1], mean, mean_speed)
        power = current_voltage_power(m, of_mean, mean, mean_speed)[2]
        to_one = current_voltage_power(m, np.zeros(1), np.ones(1), np.zeros(1))[0]
        rms = abs(float(to_one[0])) * math.sqrt(float(square.mean()))
        return cls(current, voltage, step * power, square, square, rms)

    @classmethod
    def _of_stepper(cls, scenario: Scenario, result: RunArrays, here: slice) -> Electrical:
        """The driver holds the rated current, which is its effective value in microsteps, and less at rest. Its voltage is not known.

        The energy is the work on the shaft and the heat of the phases.
        """
        m, time, torque, speed = (
            scenario.motor,
            *(np.asarray(values)[here] for values in (result.time, result["motor_torque"], result["motor_speed"])),
        )
        power, square = torque * speed, mean_square(torque)
        rms, loss = m.rated_current or math.nan, m.held_loss()
        full, rest = _at_full_current(scenario, time), m.standstill_current or 0.0
        shares = full + (np.diff(time) - full) * rest**2
        work = 0.5 * (power[1:] + power[:-1]) * np.diff(time)
        energy = work + (math.nan if loss is None else loss) * shares
        held = math.sqrt(float(shares.sum() / (time[-1] - time[0])))
        unknown = np.full_like(torque, math.nan)
        return cls(np.full_like(torque, math.sqrt(2.0) * rms), unknown, energy, square, square, rms * held)


def _at_full_current(scenario: Scenario, time: np.ndarray) -> np.ndarray:
    """Part of each interval in which the driver of the stepper holds its full current [s]."""
    levels = [s for s in scenario.signals().values() if isinstance(s, CurrentLevel)]
    if not levels:
        return np.diff(time)
    points = np.array(levels[0].breakpoint_list())
    edges = np.append(points[:, 0], max(float(time[-1]), float(points[-1, 0])))
    passed = np.append(0.0, np.cumsum(points[:, 1] * np.diff(edges)))
    return np.diff(np.interp(time, edges, passed))


def _angle(scenario: Scenario, result: RunArrays, here: slice) -> np.ndarray:
    """Angle of the motor [rad]."""
    return np.asarray(scenario.gearbox.ratio * (result["load_angle"][here] + result["twist"][here]))


def _over_ticks(scenario: Scenario, result: RunArrays, here: slice, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Means of the torque and of its square over each tick."""
    controller, m = scenario.controller, scenario.motor
    assert controller is not None
    asked = m.rated_torque * result["command"][here][:-1]
    if isinstance(controller.current, IdealCurrent):
        return asked, asked**2
    torque = result["motor_torque"][here]
    if isinstance(controller.current, FirstOrderCurrent):
        mean = asked - controller.current.time_constant * np.diff(torque) / step
    else:
        dc = m.as_dc()
        k_N, tau, w_R = dc.armature_voltage_constant, dc.electrical_time_constant, dc.rated_speed
        assert k_N is not None and tau is not None and w_R is not None  # noqa: PT018
        turned = np.diff(_angle(scenario, result, here)) / (w_R * step)
        mean = k_N * asked - m.rated_torque * (k_N - 1.0) * turned - tau * np.diff(torque) / step
    lift = mean - 0.5 * (torque[:-1] + torque[1:])
    return mean, mean_square(torque) + (torque[:-1] + torque[1:]) * lift + 1.2 * lift**2
