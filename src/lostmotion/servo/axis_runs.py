"""Exact runs of an axis: step responses of its loops, and the following error of its reference."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..control.loops import CurrentLoop, Feedforward, FieldOriented
from ..model.shaft_ratio import turns
from ..simulation.runs.run import run
from ..simulation.runs.sample_means import weights
from ..simulation.scenario.scenario import Scenario
from .linear_regimes import Axis, speed_of
from .margins import unstable_pole
from .tuning_data import inertias

if TYPE_CHECKING:
    from ..simulation.runs.results import RunArrays

STEPPED = ("current", "speed", "position")  # loops that a reference can step; the loop of i_d has none of its own
HALVINGS = 12  # of a step, until no limit acts on it
STEP_SHARE = 0.02  # of the longest move, the first size of a position step
MAX_POINTS = 4000  # of a step response
WITHIN = 1.0 - 1e-9  # of a limit, from which on it acts


@dataclass(frozen=True)
class StepResponse:
    """Step of one loop's reference, from rest, with the loops around it left out; by exact simulation."""

    loop: str
    size: float
    unit: str
    """unit of reference and value: N·m, rad/s at the motor, rad at the reference's shaft"""
    limited: bool
    """whether a limit of torque, speed or voltage acted even on the smallest step that was tried"""
    time: np.ndarray
    value: np.ndarray
    """value of the motor's torque, of the motor's speed, or of the position at the reference's shaft"""

    @property
    def rise_time(self) -> float:
        """Time from 10 to 90 % of the step [s]; NaN if it does not get there."""
        share = self.value / self.size
        reached = [np.flatnonzero(share >= level) for level in (0.1, 0.9)]
        return float(self.time[reached[1][0]] - self.time[reached[0][0]]) if all(map(len, reached)) else math.nan

    @property
    def overshoot(self) -> float:
        """Overshoot, as a share of the step."""
        return max(float((self.value / self.size).max()) - 1.0, 0.0)

    @property
    def settling_time(self) -> float:
        """Time until the error stays within 2 % of the step [s]; NaN if it does not."""
        return settled(self.time, self.value - self.size, 0.02 * abs(self.size))


def settled(time: np.ndarray, error: np.ndarray, window: float) -> float:
    """Time from the first instant until an error stays within a window to the last [s]; NaN if it is outside at the last."""
    outside = np.flatnonzero(np.abs(error) > window)
    if len(outside) == 0:
        return 0.0
    return float(time[outside[-1] + 1] - time[0]) if outside[-1] + 1 < len(time) else math.nan


def ran(axis: Axis, **simulation: float) -> RunArrays:
    """The run of an axis, at once or with other times."""
    scenario = axis.scenario
    if simulation:
        scenario = changed(scenario, simulation=scenario.simulation.model_copy(update=simulation))
    with pole_named(axis):
        return run(scenario, energy=False)


@contextmanager
def pole_named(axis: Axis) -> Iterator[None]:
    """Name the pole of an unstable axis whose motion leaves the range of numbers."""
    try:
        yield
    except _core.SolverError as error:
        pole = unstable_pole(axis) if "left the range" in str(error) else ""
        raise _core.SolverError(f"unstable: {pole}" if pole else str(error)) from None


def changed(scenario: Scenario, **fields: Any) -> Scenario:
    """The scenario with other fields."""
    return scenario.model_copy(update=fields)


def with_controller(axis: Axis, **fields: Any) -> Axis:
    """The axis with another controller."""
    controller = axis.controller.model_copy(update=fields)
    scenario = axis.scenario
    return Axis(changed(scenario, controllers={**scenario.controllers, axis.motor: controller}), axis.motor)


# --- steps ---


def step_response(axis: Axis, loop: str) -> StepResponse:
    """Step response of one loop. The step is halved until no limit acts on it."""
    size, limited = first_size(axis, loop), True
    for _ in range(HALVINGS):
        data = _step(axis, loop, size)
        if not (limited := _is_limited(axis, loop, data)):
            break
        size *= 0.5
    name, unit = axis.measured["torque" if loop == "current" else loop]
    value = data[name]
    return StepResponse(loop, size, unit, limited, data["time"], value - value[0])


def first_size(axis: Axis, loop: str) -> float:
    """First size of a step of one loop."""
    if loop == "current":
        return 0.5 * axis.train.motors[axis.motor].rated_torque
    if loop == "speed":
        return speed_of(axis) * abs(axis.ratio)
    reference = axis.controller.reference
    value = reference.at(np.linspace(0.0, axis.scenario.simulation.duration, 2001))[0]
    return STEP_SHARE * float(np.ptp(value)) or 0.01


def step_duration(axis: Axis, loop: str) -> float:
    """Time that shows the whole step [s]."""
    c = axis.controller
    if loop == "current":
        return 60.0 * c.loop_time("current")
    total = sum(inertias(axis))
    assert c.speed is not None
    times = [12.0 * total / c.speed.gain, 60.0 * c.loop_time("speed")]
    if c.speed.k_i:
        times.append(6.0 * c.speed.gain / c.speed.k_i)
    if loop == "position" and c.position is not None:
        times.append(12.0 / c.position.gain)
    return max(times)


def _step(axis: Axis, loop: str, size: float) -> RunArrays:
    kind = {"current": "torque"}.get(loop, loop)
    start = axis.scenario.initial.angles.get(axis.shaft, 0.0) if loop == "position" else 0.0
    shown = size / axis.ratio if loop == "speed" else size
    fields: dict[str, Any] = {"reference": {"kind": kind, "mean": start + shown}}
    if loop != "position":
        fields |= {"position": None, "position_encoder": None, "blend_time": None, "phase": 0.0}
    if loop == "current":
        fields["speed"] = None
    if loop != axis.controller.reference.kind:
        fields |= {"feedforward": Feedforward(), "inverse_model": None}
    duration = step_duration(axis, loop)
    ticks = max(1, math.ceil(duration / MAX_POINTS / axis.controller.sample_time))
    interval = axis.controller.sample_time * (ticks if loop != "current" else 0.125)
    return ran(with_controller(axis, **fields), duration=duration, sample_interval=interval)


def _is_limited(axis: Axis, loop: str, data: RunArrays) -> bool:
    return any(share > 0.0 for share in limited(axis, loop, data).values())


def limited(axis: Axis, loop: str, data: RunArrays) -> dict[str, float]:
    """Share of a run in which each limit within a loop acts, by its name."""
    c, motor = axis.controller, axis.train.motors[axis.motor]
    found: list[tuple[str, np.ndarray, float]] = []
    if c.speed is not None and c.speed.torque_limit is not None and loop != "current":
        found.append(
            ("speed.torque_limit", data[axis.train.variable(axis.motor, "torque_reference")], c.speed.torque_limit)
        )
    if c.position is not None and c.position.speed_limit is not None and loop == "position":
        most = c.position.speed_limit * abs(axis.ratio)
        found.append(("position.speed_limit", data[axis.train.variable(axis.motor, "speed_reference")], most))
    if motor.command_limit is not None and isinstance(c.current, CurrentLoop):
        found.append(
            ("limit of the motor's voltage", data[axis.train.variable(axis.motor, "command")], motor.command_limit)
        )
    if motor.torque_limit is not None:
        found.append(
            ("limit of the motor's torque", data[axis.train.variable(axis.motor, "torque")], motor.torque_limit)
        )
    if isinstance(c.current, FieldOriented) and motor.winding is not None and motor.winding.max_current is not None:
        for what, limit in (("voltage", motor.phase_voltage), ("current", math.sqrt(2.0) * motor.winding.max_current)):
            pair = (data[f"{axis.motor}_{which}_{what}"] for which in ("direct", "quadrature"))
            found.append((f"limit of the motor's {what}", np.hypot(*pair), limit))
    share = weights(data["time"])
    return {name: float(np.average(np.abs(values) >= WITHIN * limit, weights=share)) for name, values, limit in found}


# --- following and settling ---


@dataclass(frozen=True)
class Following:
    """Error of the outermost loop over the scenario's own run: reference less the true value at its shaft."""

    unit: str
    time: np.ndarray
    reference: np.ndarray
    error: np.ndarray
    peak: float
    rms: float
    unseen: np.ndarray
    """part of the error of a position that its encoder does not see: the angle of the encoder's shaft, in terms of
    the reference's shaft, minus the angle of the reference's shaft [rad]"""
    encoder: str
    """shaft of that encoder"""
    limits: Mapping[str, float]
    """share of the run in which each limit acts"""


def following(axis: Axis) -> Following:
    """Following error over the run of the scenario."""
    data = ran(axis)
    time, reference = data["time"], axis.controller.reference
    wanted = reference.at(time)[0]
    name, unit = axis.measured[reference.kind]
    if reference.kind == "speed":
        name, unit = axis.train.variable(axis.shaft, "speed"), axis.train.speed_unit(axis.shaft)
    error = wanted - data[name]
    rms = math.sqrt(float(np.average(error**2, weights=weights(time))))
    unseen = errors_of(axis, data)[1] if reference.kind == "position" else np.zeros_like(error)
    limits = {name: share for name, share in limited(axis, axis.loops[-1], data).items() if share > 0.0}
    return Following(
        unit, time, wanted, error, float(np.abs(error).max()), rms, unseen, axis.position_encoder[0], limits
    )


def errors_of(axis: Axis, data: RunArrays) -> tuple[np.ndarray, np.ndarray]:
    """Error of a position over a run, and the part that its encoder does not measure [rad]."""
    train, encoder, name = axis.train, axis.position_encoder[0], axis.measured["position"][0]
    error = axis.controller.reference.at(data["time"])[0] - data[name]
    if encoder == axis.shaft:
        return error, np.zeros_like(error)
    return error, data[train.variable(encoder, "angle")] / (turns(train, encoder, axis.shaft) or 1.0) - data[name]
