"""Motor quantities of a run: current, voltage, temperatures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Temperature
from ..inputs.refusal_messages import chosen_motor
from ..model.motor import ShaftMotor
from ..simulation.runs.results import RunArrays, scenario_of
from ..simulation.scenario.scenario import Scenario
from .motor_check import amperes_of, command_of_run, current_voltage_power
from .torque_squares import squares_of
from .winding_temperature import COPPER, mean_square, need_two_bodies, rms

if TYPE_CHECKING:
    import xarray


@checked
def motor_current(result: xarray.Dataset, motor: str | None = None) -> xarray.Dataset:
    """Return current and voltage of the motor of a run.

    Parameters
    ----------
    result : xarray.Dataset
        Result of `simulate` or `open_result`.
    motor : str, optional
        Name of one of several motors of a drive train.

    Returns
    -------
    xarray.Dataset
        Over ``time`` [s]. A motor with a winding has `current` [A], i_q, the amplitude of a phase with the sign of the torque;
        `current_rms` [A]; and `voltage` [V], the amplitude of a phase with the decoupling, which may exceed `voltage_limit` since
        only u_q is limited. Under a current loop of kind ideal or first_order it is the voltage that torque and speed require.
        With first_order it includes the voltage of the inductance, which has no bound in an ideal loop. Under
        field-oriented control the amplitudes belong to both axes together, as in the run. Any other motor has `current`
        alone, torque / torque constant.

    Raises
    ------
    InputError
        The motor has neither a winding nor `limits.torque_constant`, or `motor` names none.

    Examples
    --------
    >>> import lostmotion as lm
    >>> result = lm.simulate(lm.load("field-weakening"))
    >>> sorted(lm.sizing.motor_current(result).data_vars)
    ['current', 'current_rms', 'voltage']
    """
    scenario = scenario_of(result)
    name, m, (command, torque, speed) = _motor_of(scenario, result, motor)
    oriented = oriented_amplitudes(scenario, result, name)
    command = command_of_run(m, scenario.controllers.get(name), command, torque, speed)
    current, voltage = oriented or current_voltage_power(m, command, torque, speed)[:2]
    attributes: dict[str, Any] = {}
    if m.winding is None:
        if m.limits is None or m.limits.torque_constant is None:
            raise InputError(
                f"motor_current: the motor lacks {scenario.motor_key(name)}.limits.torque_constant; give it, or a winding"
            )
        of = "current of the armature" if m.kind == "dc" else f"current{amperes_of(m, scenario.motor_key(name))}"
        found = {"current": (current, "A", of)}
    else:
        found = {
            "current": (current, "A", f"current{' i_q' if oriented is None else ''}, amplitude of a phase"),
            "current_rms": (abs(current) / math.sqrt(2.0), "A", "current of a phase, rms"),
            "voltage": (voltage, "V", "voltage, amplitude of a phase"),
        }
        if m.dc_voltage is not None:
            attributes["voltage_limit"] = m.phase_voltage
    return _dataset(result, found, attributes)


def phase_amplitudes(scenario: Scenario, result: xarray.Dataset | RunArrays, motor: str) -> list[np.ndarray] | None:
    """Currents i_d, i_q [A] and voltages u_d, u_q [V] under field-oriented control; None without."""
    quantities = ("direct_current", "quadrature_current", "direct_voltage", "quadrature_voltage")
    names = [scenario.train().variable(motor, quantity) for quantity in quantities]
    if any(name not in result for name in names):
        return None
    return [np.asarray(result[name]) for name in names]


def oriented_amplitudes(
    scenario: Scenario, result: xarray.Dataset | RunArrays, motor: str
) -> tuple[np.ndarray, np.ndarray] | None:
    """Current [A], with the sign of the torque, and voltage [V] under field-oriented control; None without."""
    if (amplitudes := phase_amplitudes(scenario, result, motor)) is None:
        return None
    i_d, i_q, u_d, u_q = amplitudes
    return np.copysign(np.hypot(i_d, i_q), i_q), np.hypot(u_d, u_q)


@checked
def temperatures(
    result: xarray.Dataset,
    motor: str | None = None,
    *,
    ambient: Temperature | None = None,
    winding: Temperature | None = None,
    case: Temperature | None = None,
    repeated: bool = False,
    constant_resistance: bool = False,
) -> xarray.Dataset:
    """Compute the temperatures of winding and case in a run, from the copper loss.

    The motor needs the thermal resistances from winding to case and from case to ambient and both thermal time constants
    (`limits`), and `winding`, or `limits.resistance` and `limits.torque_constant`. Losses in iron and friction are left out.

    Parameters
    ----------
    result : xarray.Dataset
        Result of `simulate` or `open_result`.
    motor : str, optional
        Name of one of several motors of a drive train.
    ambient : float, optional
        Ambient temperature [°C]. Default: the temperature in the task, or 25 °C.
    winding, case : float, optional
        Temperatures [°C] at the beginning. Default: the ambient one.
    repeated : bool
        Whether the run is a cycle that has been repeated until the temperatures repeat too, in closed form.
    constant_resistance : bool
        Whether the resistance stays at its value for the reference temperature. Otherwise it rises by 0.393 % per kelvin, as
        copper does.

    Returns
    -------
    xarray.Dataset
        Over ``time`` [s]: `winding_temperature` and `case_temperature` [°C] and `copper_loss` [W]; `rms_torque` [N·m], and `headroom`
        [K] if the limits have a largest temperature. The heat of each interval between samples is exact, from a second
        run. The attribute `error_bound` [K] bounds the error that results from its course within an interval. It is infinite
        for a run with a law of its own, which cannot be repeated: the torque is then taken as straight between the samples.

    Raises
    ------
    InputError
        The motor lacks data, `motor` names none, or the heat of the repeated motion has no bound.

    Examples
    --------
    >>> import lostmotion as lm
    >>> heat = lm.sizing.temperatures(lm.simulate(lm.load("catalogue-robot-joint")))
    >>> bool(heat["winding_temperature"][-1] > 25.0)
    True
    """
    scenario = scenario_of(result)
    name, m, (_, torque, _) = _motor_of(scenario, result, motor)
    if ambient is None:
        ambient = scenario_of(result).task.ambient_temperature
    bodies = need_two_bodies(m, ambient, 0.0 if constant_resistance else COPPER, scenario.motor_key(name))
    time = result["time"].values
    if len(time) < 2:
        raise InputError("temperatures: the result has a single sample; shorten simulation.sample_interval")
    heating, squares, lead, of_torque = _heating(scenario, result, name, torque)
    if repeated:
        if (winding, case) != (None, None):
            raise InputError(
                "temperatures: a motion that has been repeated for ever has no beginning; leave winding and case out"
            )
        course = bodies.repeated(time, squares)
    else:
        start = (ambient if winding is None else winding, ambient if case is None else case)
        course = bodies.course(time, squares, start)
    if course is None:
        raise InputError(
            "temperatures: repeated, the winding has no end to its heat: its loss grows faster than it is carried off"
        )
    of_winding, of_case = course
    loss = bodies.loss * heating**2 * (1.0 + bodies.alpha * (of_winding - bodies.reference))
    hottest = float(of_winding.max())
    found: dict[str, tuple[Any, str, str]] = {
        "winding_temperature": (of_winding, "degC", "temperature of the winding"),
        "case_temperature": (of_case, "degC", "temperature of the case"),
        "copper_loss": (loss, "W", "heat of the winding"),
        "rms_torque": (of_torque, "N*m", "motor torque, root mean square"),
    }
    if m.limits is not None and m.limits.max_winding_temperature is not None:
        found["headroom"] = (
            m.limits.max_winding_temperature - hottest,
            "K",
            "below the largest temperature of the winding",
        )
    return _dataset(result, found, {"ambient": ambient, "error_bound": bodies.error_bound(lead, hottest)})


def _heating(
    scenario: Scenario, result: xarray.Dataset, name: str, torque: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Torque that heats as the motor does [N·m], mean of its square over each interval, what the heat leads by at most
    (`Squares.lead`), and the rms torque."""
    time, train = result["time"].values, scenario.train()
    if any(controller.law for controller in scenario.axes().values()):
        return torque, mean_square(torque), math.inf, rms(time, torque)
    found, winding = squares_of(scenario, name, time), train.motors[name].winding
    if winding is None or (oriented := oriented_amplitudes(scenario, result, name)) is None:
        return torque, found.square, found.lead, found.rms
    phase = winding.phase_values()
    heat = result[train.variable(name, "copper_heat")].values
    square = phase.torque_constant**2 * np.diff(heat) / (1.5 * phase.resistance * np.diff(time))
    lead = float((square * np.diff(time)).max(initial=0.0))  # no heat is negative
    return phase.torque_constant * oriented[0], square, lead, found.rms


def _dataset(
    result: xarray.Dataset, found: dict[str, tuple[Any, str, str]], attributes: dict[str, Any]
) -> xarray.Dataset:
    import xarray as xr

    variables = {
        name: (("time",) if np.ndim(value) else (), value, {"units": unit, "long_name": meaning})
        for name, (value, unit, meaning) in found.items()
    }
    return xr.Dataset(variables, coords={"time": result["time"]}, attrs=attributes)


def _motor_of(scenario: Scenario, result: xarray.Dataset, name: str | None) -> tuple[str, ShaftMotor, list[np.ndarray]]:
    """Name of the motor, the motor, and its command, torque [N·m] and speed [rad/s] over the run."""
    train = scenario.train()
    motors = {motor: m for motor, m in train.motors.items() if not train.is_slide(m.shaft)}
    name = chosen_motor(name, motors, "motors", "motor: no motor turns it")
    m = motors[name]
    names = (train.variable(name, "command"), train.variable(name, "torque"), train.variable(m.shaft, "speed"))
    if lacking := [variable for variable in names if variable not in result]:
        raise InputError(f"the result lacks {', '.join(lacking)}; give a whole result of simulate or open_result")
    return name, m, [result[variable].values for variable in names]
