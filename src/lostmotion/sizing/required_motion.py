"""Demands of a periodic motion on a motor and a gearbox, before any run: all compliance left out, the reference followed exactly."""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.references import PositionReference
from ..model.gearbox import Gearbox
from ..model.losses import ConstantEfficiency
from ..model.motor import Motor
from ..model.process_loads import Duty
from ..model.signals import TimeFunction
from ..simulation.forms.drive_tables import LoadTable
from .duty_cycle import DutyCycle
from .finding import Finding
from .gearbox_check import input_speeds, loads
from .motion_check import INERTIA_RATIO, inertia_ratio
from .motor_check import motor_rules, needed_command, rms_rise
from .stepper_check import speed_of_stepper, step_resonance, torque_reserve

POINTS = 1000  # of a cycle at least
LINES = 1e-3  # of the largest torque
EVEN = 10_001  # instants of a cycle at which the rate of full steps is looked at
WITHIN = 1e-9  # of an interval: so close to its ends, values are those on this side of a jump


@dataclass(frozen=True)
class RequiredMotion:
    """A cycle at the load: two samples at each instant at which something jumps."""

    time: np.ndarray  # [s]
    speed: np.ndarray  # [rad/s]
    acceleration: np.ndarray  # [rad/s²]
    torque: np.ndarray  # torque of the gearbox [N·m]
    cycle: float  # [s]
    position: np.ndarray  # [rad]
    inertia: np.ndarray  # inertia of the load with its payloads [kg·m²]
    holding: np.ndarray  # torque that holds the load at rest there, without friction [N·m]


NO_DUTY = Duty()


def required_motion(
    reference: PositionReference, load: LoadTable, cycle: float, duty: Duty = NO_DUTY, rise: float | None = None
) -> RequiredMotion:
    """The motion of a load that follows its reference over one cycle [s]: J acceleration + friction + load torque.

    duty: what acts on the load beside.
    rise: sine of the slope of a slide; None of a rotary load. All values of a slide are in units of translation.
    """
    times_of = (*reference.pieces(), *load.torque.breakpoint_list())
    breakpoints = {t for t in ({t for t, *_ in times_of} | duty.edges()) if 0.0 < t < cycle}
    edges = np.array([0.0, *sorted(breakpoints), cycle])
    frequencies = [f for signal in (reference, load.torque) for _, f, _ in signal.sine_list()]
    finest = cycle / max(POINTS, 100.0 * cycle * max(frequencies, default=0.0))
    times = []
    for a, b in itertools.pairwise(edges.tolist()):
        inside = np.linspace(a, b, max(3, int((b - a) / finest) + 2))
        inside[0], inside[-1] = a + WITHIN * (b - a), b - WITHIN * (b - a)
        times.append(inside)
    time = np.concatenate(times)
    position, speed, acceleration, _ = reference.at(time)
    speed = np.where(np.abs(speed) <= 1e-12 * np.abs(speed).max(), 0.0, speed)
    friction = load.viscous_friction * speed + load.friction_torque * np.sign(speed)
    inertia = load.inertia + duty.inertia(time, slides=rise is not None)
    holding = values_at(load.torque, time) + duty.torque(time, position, rise)
    return RequiredMotion(
        time, speed, acceleration, inertia * acceleration + friction + holding, cycle, position, inertia, holding
    )


def duty_torque(motion: RequiredMotion, load: LoadTable) -> tuple[np.ndarray, np.ndarray]:
    """Instants [s] and load torque [N·m] of a run in place of duty, along the reference. The torque holds the load
    and moves its payloads. It has as few straight lines as keep the error below 0.1 % of the peak."""
    torque = motion.holding + (motion.inertia - load.inertia) * motion.acceleration
    lines = _fewest_lines(motion.time, torque, LINES * float(np.abs(torque).max(initial=0.0)))
    return motion.time[lines], torque[lines]


def _fewest_lines(x: np.ndarray, y: np.ndarray, tolerance: float) -> np.ndarray:
    """Indices of the points to keep, so that straight lines through them depart by the tolerance at most (Douglas and Peucker)."""
    kept, waiting = np.zeros(len(x), bool), [(0, len(x) - 1)]
    kept[[0, -1]] = True
    while waiting:
        a, b = waiting.pop()
        if b - a < 2:
            continue
        off = np.abs(y[a] + (y[b] - y[a]) / (x[b] - x[a]) * (x[a + 1 : b] - x[a]) - y[a + 1 : b])
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            k = a + 1 + worst
            kept[k] = True
            waiting += [(a, k), (k, b)]
    return np.flatnonzero(kept)


def values_at(signal: TimeFunction[Any], time: np.ndarray) -> np.ndarray:
    """Values of a signal of straight lines and sines over time."""
    begin, value, slope = np.array(signal.breakpoint_list()).T
    k = np.searchsorted(begin, time, side="right") - 1
    out = value[k] + slope[k] * (time - begin[k])
    for amplitude, frequency, phase in signal.sine_list():
        out = out + amplitude * np.sin(2.0 * np.pi * frequency * time + phase)
    return np.asarray(out)


@dataclass(frozen=True)
class InputDemand:
    """Demands on the input shaft of a gearbox in a required motion."""

    motion: RequiredMotion
    gearbox: Gearbox
    speed: np.ndarray  # [rad/s]
    acceleration: np.ndarray  # [rad/s²]
    torque: np.ndarray  # with losses and inertia of the gearbox [N·m]
    with_stage: Gearbox | None = None  # the gearbox and the stage of a linear axis behind it as one

    @property
    def whole(self) -> Gearbox:
        """The gearbox that stands for everything between the motor and the load."""
        return self.with_stage or self.gearbox

    def cycle(self, motor_torque: np.ndarray) -> DutyCycle:
        """The duty cycle for the torque of the motor [N·m]."""
        m = self.motion
        return DutyCycle(m.time, np.abs(self.speed), m.torque, motor_torque, None, m.cycle)

    def motor_torque(self, motor: Motor) -> np.ndarray:
        """[N·m]"""
        own = motor.rotor_inertia * self.acceleration + motor.friction_torque * np.sign(self.speed)
        return np.asarray(self.torque + own)


def input_demand(motion: RequiredMotion, g: Gearbox, with_stage: Gearbox | None = None) -> InputDemand:
    """Demand on a gearbox whose output has this motion, with losses as the solver takes them: T_1 = (T_2 + s m_2B T_2R)/i.

    s is the direction of the load.
    """
    speed, acceleration = g.ratio * motion.speed, g.ratio * motion.acceleration
    s = np.sign(motion.speed)
    if isinstance(g.losses, ConstantEfficiency):
        through = motion.torque / (g.ratio * g.losses.efficiency)
    else:
        law, R = g.losses.core(), g.rated_output_torque
        points = zip((s * motion.torque / R).tolist(), (np.abs(speed) / g.rated_input_speed).tolist(), strict=True)
        lost = np.array([law(mu, v) for mu, v in points])
        through = (motion.torque + s * lost * R) / g.ratio
    return InputDemand(
        motion, g, speed, acceleration, through + g.inertia * acceleration + g.viscous_friction * speed, with_stage
    )


def check_gearbox(demand: InputDemand) -> list[Finding]:
    """The rules that do not depend on the motor: torque and speed of the gearbox."""
    cycle = demand.cycle(np.zeros_like(demand.speed))
    return [
        *loads(demand.gearbox, float(np.abs(demand.motion.torque).max()), cycle),
        *input_speeds(demand.gearbox, cycle),
    ]


def check_motor(
    demand: InputDemand,
    motor: Motor,
    load_inertia: float,
    ambient: float,
    largest: float | None = None,
    *,
    slides: bool = False,
    microsteps: int = 1,
) -> list[Finding]:
    """The rules for a motor at this gearbox, or with `slides` for a linear motor, whose ratio of inertias is not judged. `largest` is
    the largest wanted ratio of the inertias: left out, the limit of the motor's record, or else 10. `microsteps`
    belong to the driver of a stepper."""
    if largest is None and (motor.limits is None or motor.limits.max_inertia_ratio is None):
        largest = INERTIA_RATIO
    torque = demand.motor_torque(motor)
    cycle = demand.cycle(torque)
    if motor.kind == "stepper":  # its current does not follow its torque
        even = np.interp(np.linspace(0.0, demand.motion.cycle, EVEN), demand.motion.time, np.abs(demand.speed))
        return [
            *speed_of_stepper(motor, cycle.peak_input_speed),
            torque_reserve(motor, np.abs(torque), np.abs(demand.speed)),
            step_resonance(motor, demand.gearbox.inertia, even, microsteps),
            inertia_ratio(motor, demand.whole, load_inertia, largest),
        ]
    rise = rms_rise(motor, cycle.rms_motor_torque, ambient)
    command = needed_command(motor, torque, demand.speed)
    found = motor_rules(motor, cycle, ambient, command, torque, demand.speed, slides=slides, rise=rise)
    return found if slides else [*found, inertia_ratio(motor, demand.whole, load_inertia, largest)]
