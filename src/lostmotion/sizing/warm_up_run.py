"""Temperature as a slow parameter: a run in intervals, whose temperatures are frozen within each and follow its losses.

Winding and housing are the two bodies of `winding_temperature.TwoBodies`. An interval runs with the values of its first temperatures: the winding's
resistance, the torque constant, and all that goes with the viscosity of the lubricant. Then the bodies take the mean heat of that
interval, from its energy ledger and the mean square of the torque, by the exact solution of their equations.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..data_sheets.loss_data import Lubricant
from ..data_sheets.loss_map_from_data_sheet import VISCOSITY_EXPONENT
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.implausible_values import trusted
from ..inputs.quantities import Number, Temperature, Time
from ..inputs.refusal_messages import chosen_motor, did_you_mean
from ..model.gearbox import Transmission
from ..model.losses import LossMap
from ..model.motor import Motor
from ..model.signals import core_signal
from ..reproducible import interpolate, power
from ..simulation.runs.core_runs import core_case
from ..simulation.runs.results import raw_result
from ..simulation.runs.run import MAX_SWITCHINGS, check_memory
from ..simulation.scenario.scenario import Scenario
from .torque_squares import squares
from .winding_temperature import COPPER, TwoBodies, need_two_bodies

if TYPE_CHECKING:
    import xarray

SUMS = ("switching_count", "steps", "mode_trials", "mode_fallbacks")
HEAT = ("viscous friction", "dry friction", "mesh", "hysteresis and damping")
WHOLE = 1e-6  # share by which a number of samples may miss a whole one, as numbers in single precision do


@dataclass(frozen=True)
class _Law:
    """The scenario with all that depends on the temperatures."""

    scenario: Scenario
    name: str
    bodies: TwoBodies
    lubricant: Lubricant | None
    lubricant_temperature: float
    magnets: float
    heating: tuple[str, ...]

    @property
    def motor(self) -> Motor:
        return self.scenario.train().motors[self.name]

    def magnet_factor(self, housing: float) -> float:
        factor = 1.0 + self.magnets * (housing - self.bodies.reference)
        if not factor > 0.0:
            raise InputError(
                f"warm_up: magnet_coefficient {self.magnets:g} 1/K leaves no torque constant at {housing:.1f} °C"
            )
        return factor

    def viscosity_factor(self, housing: float) -> float:
        if self.lubricant is None:
            return 1.0
        viscosities = [self.lubricant.viscosity(t) for t in (housing, self.lubricant_temperature)]
        return power(viscosities[0] / viscosities[1], VISCOSITY_EXPONENT)

    def at(self, winding: float, housing: float) -> Scenario:
        """The scenario with its values at these temperatures [°C]."""
        changes: dict[str, Any] = {}
        factor = self.viscosity_factor(housing)
        if self.lubricant is not None:
            for key, gear in self.scenario.gears_by_key().items():
                changes |= {f"{key}.{name}": value for name, value in _thinned(gear, factor).items()}
        if self.motor.kind == "dc":
            resistance = 1.0 + self.bodies.alpha * (winding - self.bodies.reference)
            warm = _warm_motor(self.motor, resistance, self.magnet_factor(housing), winding)
            changes |= {f"{self.scenario.motor_key(self.name)}.{name}": value for name, value in warm.items()}
        with trusted():
            return self.scenario.replace(**changes)


def _thinned(gear: Transmission, factor: float) -> dict[str, Any]:
    """Viscous friction and the losses without load of a gear whose lubricant has become thinner or thicker."""
    changes: dict[str, Any] = {"viscous_friction": factor * gear.viscous_friction}
    if isinstance(gear.losses, LossMap):
        of_speed = np.array(gear.losses.values).T
        unloaded = [interpolate(0.0, gear.losses.loads, column) for column in of_speed]
        changes["losses.values"] = [
            [max(0.0, m + (factor - 1.0) * m_0) for m, m_0 in zip(row, unloaded, strict=True)]
            for row in gear.losses.values
        ]
    return changes


def _warm_motor(motor: Motor, resistance: float, magnets: float, winding: float) -> dict[str, Any]:
    """Values of a DC motor whose resistance and torque constant have changed by these factors.

    Its stall torque goes with their quotient, its no-load speed with the reciprocal of the torque constant.
    """
    k_N, tau = motor.armature_voltage_constant, motor.electrical_time_constant
    assert k_N is not None
    warm = k_N * magnets / resistance
    if not warm > 1.0:
        raise InputError(
            f"warm_up: with its winding at {winding:.1f} °C the motor stalls under its rated torque at the voltage of command 1; "
            "give a smaller rated_torque"
        )
    speed = motor.unloaded_speed / magnets
    return {
        "armature_voltage_constant": warm,
        "rated_speed": speed * (warm - 1.0) / warm,
        "electrical_time_constant": None if tau is None else tau / resistance,
    }


@dataclass
class _Course:
    """A run in intervals."""

    result: dict[str, Any]
    winding: np.ndarray
    housing: np.ndarray
    heat: dict[str, float]


@checked
def warm_up(
    scenario: Scenario,
    *,
    update: Time,
    motor: str | None = None,
    lubricant: Lubricant | None = None,
    lubricant_temperature: Temperature | None = None,
    magnet_coefficient: Number = 0.0,
    ambient: Temperature | None = None,
    winding: Temperature | None = None,
    housing: Temperature | None = None,
    heating: Sequence[str] | None = None,
) -> xarray.Dataset:
    """Run a scenario whose losses and friction follow the temperatures of winding and housing.

    The temperatures are frozen for intervals of `update`. At the end of each, the mean heat of that interval warms the two bodies, by
    the exact solution of their equations. The motor needs the data of `temperatures`.

    Parameters
    ----------
    scenario : Scenario
        A scenario with commands or continuous controllers. Its values hold at the reference temperatures: for the motor at the
        temperature of its resistance, for gears at `lubricant_temperature`.
    update : float
        Interval between two updates of the temperatures [s], an even multiple of simulation.sample_interval.
    motor : str, optional
        Name of one of several motors of a drive train.
    lubricant : Lubricant, optional
        Its viscosity at 40 °C and 100 °C. The viscous friction of the gears and the part of their loss maps without load are scaled
        by the viscosity to the power 2/3. Default: they do not depend on the temperature.
    lubricant_temperature : float, optional
        Temperature of the lubricant at which the values of the scenario hold [°C]. Default: the ambient temperature.
    magnet_coefficient : float
        Relative change of the torque constant with the temperature of the housing [1/K], such as -0.001.
    ambient : float, optional
        Ambient temperature [°C]. Default: the temperature in the task, or 25 °C.
    winding, housing : float, optional
        Temperatures at t = 0 [°C]. Default: the ambient one.
    heating : sequence of str, optional
        Entries of the energy ledger that heat the housing. Default: friction of the motor's shaft and losses of the gears.

    Returns
    -------
    xarray.Dataset
        The variables of `simulate`, with `winding_temperature` and `housing_temperature` [°C]. The attribute `freezing_error` states
        the error of both [K] that freezing makes, estimated from a second run with half the interval. `heat` states the heat [J] into
        winding and housing, what they store and what goes to the ambient.

    Raises
    ------
    InputError
        The motor lacks data, the scenario has a sampled controller, or a value cannot be used.

    Examples
    --------
    >>> import lostmotion as lm
    >>> scenario = lm.load("catalogue-robot-joint").replace(**{"simulation.duration": "4 s"})
    >>> hot = lm.sizing.warm_up(scenario, update="1 s", winding="80 degC")
    >>> bool(hot["winding_temperature"][-1] < hot["winding_temperature"][0])
    True
    """
    if scenario.axes():
        raise InputError(
            "is a sampled controller, whose state an update does not keep; give commands, or a continuous controller",
            scenario.controller_key(next(iter(scenario.axes()))),
            where="warm_up",
        )
    name, driven = _motor(scenario, motor)
    if magnet_coefficient and driven.kind != "dc":
        raise InputError('warm_up: magnet_coefficient acts on a motor of kind "dc"; leave it out')
    ambient = scenario.task.ambient_temperature if ambient is None else ambient
    bodies = need_two_bodies(driven, ambient, COPPER, scenario.motor_key(name))
    at = ambient if lubricant_temperature is None else lubricant_temperature
    law = _Law(scenario, name, bodies, lubricant, at, magnet_coefficient, _heating(scenario, name, heating))
    table = scenario.simulation
    each = update / table.sample_interval
    if abs(each - 2 * round(each / 2)) > WHOLE * each or round(each) == 0:
        raise InputError(
            f"warm_up: update {update:g} s must be an even multiple of simulation.sample_interval, {table.sample_interval:g} s"
        )
    check_memory(table.samples, 24.0 * len(scenario.variables()))
    start = (ambient if winding is None else winding, ambient if housing is None else housing)
    coarse, fine = (_course(law, samples, start) for samples in (round(each), round(each / 2)))
    # The error of freezing falls linearly with the interval, so the coarse run errs by twice the difference of both.
    error = {
        body: 2.0 * float(np.max(np.abs(getattr(coarse, body) - getattr(fine, body))))
        for body in ("winding", "housing")
    }
    found = raw_result(scenario, scenario.core(), coarse.result, "exact", ledger=True).dataset()
    for body in ("winding", "housing"):
        attributes = {"units": "degC", "long_name": f"temperature of the {body}", "freezing_error": error[body]}
        found[f"{body}_temperature"] = ("time", getattr(coarse, body), attributes)
    found.attrs |= {"update": update, "freezing_error": json.dumps(error), "heat": json.dumps(coarse.heat)}
    return found


def _motor(scenario: Scenario, name: str | None) -> tuple[str, Motor]:
    motors = scenario.train().motors
    name = chosen_motor(name, motors, "motors", "warm_up: the scenario has no motor")
    found = motors[name]
    if found.kind == "synchronous":
        raise InputError(
            f'warm_up: {scenario.motor_key(name)} is synchronous; give a "torque_source" with the same winding, or a "dc" motor'
        )
    return name, found


def _heating(scenario: Scenario, motor: str, given: Sequence[str] | None) -> tuple[str, ...]:
    h = scenario.simulation.sample_interval
    run = _core.run(core_case(scenario), duration=h, sample_interval=h, samples=2, energy=True)
    entries = list(run["energy"])
    if given is not None:
        for entry in given:
            if entry not in entries:
                raise InputError(
                    f"warm_up: heating {entry!r} is no entry of the ledger; {did_you_mean(entry, entries, ', '.join(entries))}"
                )
        return tuple(given)
    train = scenario.train()
    hot = {train.motors[motor].shaft, *train.gears}
    wanted = {train.shown(f"{element}: {loss}") for element in hot for loss in HEAT}
    return tuple(entry for entry in entries if entry in wanted)


def _later(signal: Any, time: float) -> _core.Signal:
    """The signal with its zero of time at `time`."""
    points = signal.breakpoint_list()
    first = max((k for k, p in enumerate(points) if p[0] <= time), default=0)
    begin, value, slope = points[first][:3]
    lines = [(0.0, value + slope * (time - begin), slope), *((p[0] - time, *p[1:3]) for p in points[first + 1 :])]
    sines = [
        (a, f, math.fmod(phase + 2.0 * math.pi * math.fmod(f * time, 1.0), 2.0 * math.pi))
        for a, f, phase in signal.sine_list()
    ]
    return core_signal(lines, sines)


def _course(law: _Law, each: int, start: tuple[float, float]) -> _Course:
    scenario, table = law.scenario, law.scenario.simulation
    names, signals = scenario.core().input_names(), scenario.signals()
    state, capacities = scenario.start(), scenario.capacities()
    last = table.samples - 1
    fastest = max((f for name in names for _, f, _ in signals[name].sine_list()), default=0.0)
    torque = scenario.train().variable(law.name, "torque")
    now, results, temperatures = start, [], [np.array([start])]
    heat = dict.fromkeys(("winding", "housing", "stored", "ambient"), 0.0)
    for first in range(0, last, each):
        samples = min(each, last - first)
        begin, times = first * table.sample_interval, np.arange(1, samples + 1) * table.sample_interval
        if first + samples == last and table.instants()[-1] < last * table.sample_interval:
            times[-1] = table.duration - begin
        length = float(times[-1])
        core = law.at(*now).core()
        inputs = [_later(signals[name], begin) for name in names]
        grid: dict[str, Any] = {"duration": length, "sample_interval": table.sample_interval, "samples": samples + 1}
        case = _core.Case(core, inputs=inputs, start=state, hysteresis_capacities=capacities)
        result = _core.run(case, **grid, energy=True, max_switchings=MAX_SWITCHINGS)
        state, capacities = _end(
            result["end_state"], {gear: scenario.train().variable(gear, "hysteresis_capacity") for gear in capacities}
        )
        breaks = [p[0] - begin for name in names for p in signals[name].breakpoint_list()]
        torques = squares(case, torque, np.array([0.0, length]), breaks=breaks, fastest=fastest)
        square = float(torques.square[0]) / law.magnet_factor(now[1]) ** 2
        losses = math.fsum(result["energy"][entry] for entry in law.heating) / length
        now, course = _warmed(law.bodies, square, losses, now, times, heat)
        temperatures.append(course)
        results.append(result)
    both = np.vstack(temperatures).T
    return _Course(_joined(results, each * table.sample_interval), both[0], both[1], heat)


def _end(end: Mapping[str, float], names: Mapping[str, str]) -> tuple[dict[str, float], dict[str, float]]:
    """State with which the next interval begins, and the hysteresis capacities by gear; `names`: of these in the end state."""
    kept = set(names.values())
    return {name: v for name, v in end.items() if name not in kept}, {
        gear: end.get(n, 0.0) for gear, n in names.items()
    }


def _warmed(
    bodies: TwoBodies,
    square: float,
    losses: float,
    start: tuple[float, float],
    times: np.ndarray,
    heat: dict[str, float],
) -> tuple[tuple[float, float], np.ndarray]:
    """Temperatures after times [s] of a constant mean square of the torque [(N·m)²] and losses in the housing [W]; adds the heat [J].

    The integral of x' = A x + b is A^-1 (x(h) - x(0) - b h).
    """
    C = np.array([bodies.winding_time / bodies.winding_case, bodies.case_time / bodies.case_ambient])
    A, b = bodies.equations(square, losses)
    F, g = bodies.response(times, square, losses)
    x_0 = np.subtract(start, bodies.ambient)
    x = F @ x_0 + g
    mean = np.linalg.solve(A, x[-1] - x_0 - b * times[-1])  # integral of x
    copper = bodies.loss * square
    heat["winding"] += copper * (
        times[-1] * (1.0 + bodies.alpha * (bodies.ambient - bodies.reference)) + bodies.alpha * mean[0]
    )
    heat["housing"] += losses * times[-1]
    heat["stored"] += float(C @ (x[-1] - x_0))
    heat["ambient"] += float(mean[1]) / bodies.case_ambient
    course = bodies.ambient + x
    return (float(course[-1, 0]), float(course[-1, 1])), course


def _joined(results: Sequence[dict[str, Any]], interval: float) -> dict[str, Any]:
    """The result of the whole run."""
    values = [
        np.concatenate([rows[0][:1], *(row[1:] for row in rows)])
        for rows in zip(*(r["values"] for r in results), strict=True)
    ]
    tables = [np.array(r["switchings"]) for r in results]
    for k, switchings in enumerate(tables):
        switchings[:, 0] += k * interval
    ledgers = [r["energy"] for r in results]
    left = [k * interval + r["left_data_at"] for k, r in enumerate(results)]
    return {
        "values": values,
        "control": [],
        "switchings": np.concatenate(tables)[:MAX_SWITCHINGS],
        **{name: sum(r[name] for r in results) for name in SUMS},
        "end_state": results[-1]["end_state"],
        "energy": {entry: math.fsum(ledger[entry] for ledger in ledgers) for entry in ledgers[0]},
        "left_data_at": min(left),
    }
