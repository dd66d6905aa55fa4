"""Scenario of a candidate of a task: motor and gearbox, tuned by rule, over so many cycles."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ...control.command import CommandSignal, Stepping
from ...control.controller import AnyCurrent, Controller
from ...control.gain_rules import TwoInertias, suited
from ...control.loops import Feedforward, FirstOrderCurrent, SampledCurrent
from ...control.references import PositionReference
from ...inputs.cached_values import kept
from ...model.gearbox import Gearbox
from ...model.motor import Motor
from ...model.process_loads import Duty
from ...model.signals import Samples, TimeFunction, TorqueSignal
from ...servo.tuning_data import lag_sum, secant
from ...simulation.forms.common_tables import SimulationTable
from ...simulation.forms.drive_tables import Initial, LoadTable
from ...simulation.scenario.scenario import Scenario
from ..duty_cycle import Rest, rests_of
from ..required_motion import duty_torque, required_motion
from .axis_task import AxisTask, reference_of, repeated, repeated_torque


def load_torque_of(base: Scenario, task: AxisTask) -> TorqueSignal:
    """The load torque of one cycle: the load of the base, with the duty of the task along the reference added."""
    if not task.anything:
        return base.load.torque
    duty = Duty(gravity=task.gravity, payload=task.payload, process=task.process)
    return _duty_torque(reference_of(base), base.load, task.cycle, duty, task.rise)


@lru_cache(maxsize=32)
def _duty_torque(
    reference: PositionReference, load: LoadTable, cycle: float, duty: Duty, rise: float | None
) -> TorqueSignal:
    times, torques = duty_torque(required_motion(reference, load, cycle, duty, rise), load)
    return TorqueSignal(samples=Samples(times=tuple(times.tolist()), values=tuple(torques.tolist())))


def axis_scenario(base: Scenario, motor: Motor, gearbox: Gearbox, task: AxisTask, count: int) -> Scenario:
    """The base with a motor, a gearbox and gains by rule for them, over so many cycles, from rest where the reference begins.

    Raises InputError: the parts do not fit together.
    """
    around = cycles_of(base, task, count)
    changes: dict[str, Any] = {"motor": motor, "gearbox": gearbox, "initial": around.initial}
    if motor.kind == "stepper":  # without a loop: its driver turns the reference into steps
        stepping = Stepping(reference=around.reference, microsteps=task.microsteps)
        changes |= {"controller": None, "command": CommandSignal(stepping=stepping)}
    else:
        changes["controller"] = tuned(base, motor, gearbox, task.current)
    found = over(base.unchecked(**changes), around)
    try:
        found.check()
    except ValueError:
        return base.model_copy(update={name: getattr(found, name) for name in (*changes, "load", "simulation")})
    return found


@dataclass(frozen=True, eq=False)
class Cycles:
    """Reference, load and times over so many cycles of a task, the same for all candidates."""

    task: AxisTask
    count: int
    reference: PositionReference
    load: LoadTable
    simulation: SimulationTable
    initial: Initial

    @cached_property
    def time(self) -> np.ndarray:
        """Instants of the samples, one in each sample time of the controller [s]."""
        return self.simulation.instants()

    @property
    def last(self) -> slice:
        """The samples of the last cycle, both ends included."""
        return last_cycle(self.simulation.samples, self.count)

    @cached_property
    def position(self) -> np.ndarray:
        """Reference over the last cycle [rad]."""
        return self.reference.at(self.time[self.last])[0]

    @cached_property
    def rests(self) -> list[Rest]:
        """Rests after the moves of the last cycle."""
        return rests_of(self.reference, self.time[self.last], len(self.reference.moves) // self.count)


def last_cycle(samples: int, count: int, back: int = 1) -> slice:
    """The samples of the last of so many cycles, both ends included; `back` = 2 for the one before."""
    each = (samples - 1) // count
    return slice((count - back) * each, (count - back + 1) * each + 1)


@lru_cache(maxsize=32)
def begins_alike(shorter: Cycles, longer: Cycles) -> bool:
    """Whether references and loads of both are the same, to the bit, as far as the shorter ones last."""
    end = shorter.simulation.duration

    def until(signal: TimeFunction[Any]) -> tuple[Any, ...]:
        return [piece for piece in signal.breakpoint_list() if piece[0] < end], list(signal.sine_list())

    pairs = (shorter.reference, longer.reference), (shorter.load.torque, longer.load.torque)
    return all(until(a) == until(b) for a, b in pairs)


def cycles_of(base: Scenario, task: AxisTask, count: int) -> Cycles:
    """Reference, load, times and start over so many cycles; made once."""
    made = base.kept_values().setdefault(cycles_of, {})
    if count not in made or made[count].task is not task:
        assert base.controller is not None
        reference, step = reference_of(base), base.controller.sample_time
        torque = repeated_torque(load_torque_of(base, task), task.cycle, count)
        made[count] = Cycles(
            task,
            count,
            repeated(reference, task.cycle, count),
            base.load.model_copy(update={"torque": torque}),
            SimulationTable(duration=count * task.cycle, sample_interval=step),
            Initial(load_angle=float(reference.at(0.0)[0])),
        )
    return made[count]  # type: ignore[no-any-return]


def over(scenario: Scenario, cycles: Cycles) -> Scenario:
    """The scenario over so many cycles."""
    if scenario.controller is None:
        return scenario.unchecked(load=cycles.load, simulation=cycles.simulation)
    controller = scenario.controller.unchecked(reference=cycles.reference)
    return scenario.unchecked(controller=controller, load=cycles.load, simulation=cycles.simulation)


@kept
def with_scale_alone(base: Scenario) -> Scenario:
    """The base with the scale of its slide as the only encoder, as with a linear motor."""
    controller = base.controller
    assert controller is not None
    assert controller.position_encoder is not None
    scale = controller.position_encoder.model_copy(update={"shaft": None})
    return base.model_copy(update={"controller": controller.model_copy(update={"encoder": scale})})


def current_loop(controller: Controller, wanted: AnyCurrent | None, motor: Motor) -> AnyCurrent:
    """The current loop of a task for a motor: of a torque source, whose winding is not known, a lag as long as the lag of a sampled loop.

    A closed loop g/(z (z - 1)) lags by T/g at low frequency, the delay of its output included.
    """
    found = controller.current if wanted is None else wanted
    if motor.kind != "torque_source" or not isinstance(found, SampledCurrent):
        return found
    lag = (found.sample_time or controller.sample_time) / found.gain - controller.delay * controller.sample_time
    return FirstOrderCurrent(kind="first_order", time_constant=max(lag, 0.5 * controller.sample_time))


def _with_loop(controller: Controller, loop: AnyCurrent) -> tuple[Controller, float]:
    """The controller with a current loop, and the sum of the lags in its speed loop [s]; made once."""
    made = controller.kept_values().setdefault(_with_loop, {})
    if loop not in made:
        found = controller.model_copy(update={"current": loop})
        made[loop] = found, lag_sum(found)
    return made[loop]  # type: ignore[no-any-return]


def tuned(base: Scenario, motor: Motor, g: Gearbox, current: AnyCurrent | None = None) -> Controller:
    """Controller of the base with gains by rule for a motor, a gearbox and its load. The torque of their inertia is
    fed forward. `current` is its current loop, if not the base's."""
    assert base.controller is not None
    controller, lag = _with_loop(base.controller, current_loop(base.controller, current, motor))
    assert controller.position is not None
    assert controller.speed is not None
    J_M, J_L = motor.rotor_inertia + g.inertia, base.load.inertia / g.ratio**2
    drive = TwoInertias(J_M, J_L, secant(g) / g.ratio**2)
    gains = suited(drive, lag, controller.loop_time("position"))
    speed: dict[str, Any] = {
        "gain": gains.speed.gain,
        "integral_gain": gains.speed.integral_gain,
        "integral_time": None,
    }
    if controller.speed.torque_limit is None:
        speed["torque_limit"] = torque_limit(motor)
    feedforward = controller.feedforward
    if feedforward == Feedforward():
        feedforward = Feedforward(inertia=J_M + J_L)
    numbers = [gains.position, *(x for x in speed.values() if x is not None)]
    if not all(0.0 < x < math.inf for x in numbers):  # which is refused
        controller.position.model_copy(update={"gain": gains.position})
        controller.speed.model_copy(update=speed)
    return controller.unchecked(
        position=controller.position.unchecked(gain=gains.position),
        speed=controller.speed.unchecked(**speed),
        feedforward=feedforward,
    )


def torque_limit(motor: Motor) -> float | None:
    """Torque at the largest current, or the peak torque if that is less [N·m]; None where neither is given."""
    limits, found = motor.limits, [motor.largest_torque]
    if limits is not None and limits.peak_torque is not None:
        found.append(limits.peak_torque)
    if limits is not None and limits.max_current is not None and limits.torque_constant is not None:
        found.append(limits.max_current * limits.torque_constant)
    return None if math.isinf(min(found)) else min(found)
