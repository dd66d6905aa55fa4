"""Continuous controllers: PID and state space, as states and regimes of the train."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from .. import _core
from ..errors import InputError, inside, need
from ..inputs.argument_checks import checked
from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Angle,
    Inertia,
    NotNegative,
    Number,
    Positive,
    Share,
    Speed,
    Stiffness,
    Time,
    Torque,
    ViscousFriction,
)
from ..inputs.refusal_messages import did_you_mean, shown
from ..model.motor import Motor
from ..model.shaft_ratio import turns
from ..model.signals import Signal, Step
from ..model.train import DriveTrain
from ..recorded_numbers import numbers
from ..reproducible import sin
from ..units.conversion import Unit
from .command import CommandSignal
from .firmware import Firmware
from .loops import FirstOrderCurrent, IdealCurrent, VoltageCommand

MAX_ORDER = 8  # of a state space

GainRow = tuple[Number, ...]


class PositionSignal(Signal[Angle]):
    """A position [rad] over time: the sum of all that is given."""

    kind: Literal["position"] = "position"


class SpeedSignal(Signal[Speed]):
    """A speed [rad/s] over time: the sum of all that is given."""

    kind: Literal["speed"] = "speed"


@dataclass(frozen=True)
class LinearSystem:
    """x' = A x + B y + back (u - v), v = C x + D y, in units of what it gives; y by name."""

    signals: tuple[str, ...]  # reference, reference_rate, measured, measured_rate
    states: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    back: np.ndarray


class _PID(Part):
    proportional_weight: Annotated[Number, Share] = 1.0
    """share of the reference that the proportional part sees: below 1 steps of the reference overshoot less"""
    derivative_weight: Annotated[Number, Share] = 0.0
    """share of the reference that the derivative part sees: 0 takes the derivative of what is measured alone"""
    filter_time: Annotated[Time, NotNegative] = 0.0  #: time constant of the first-order filter of the derivative

    @property
    def gains(self) -> tuple[float, float, float]:
        """k_p, k_i, k_d (SI)."""
        own: Any = self
        return own.gain, own.integral_gain, own.derivative_gain

    @rule
    def _has_a_use(self) -> Iterator[str]:
        k_p, k_i, k_d = self.gains
        if k_p == k_i == k_d == 0.0:
            yield "has no gain; give gain, integral_gain or derivative_gain"
        given = [key for key in ("derivative_weight", "filter_time") if getattr(self, key) != 0.0]
        if k_d == 0.0 and given:
            yield f"has {given[0]} but no derivative_gain; give one, or leave it out"

    def system(self, anti_windup_time: float | None) -> LinearSystem:
        """The controller of reference and measured value, and of their rates where the derivative has no filter."""
        k_p, k_i, k_d = self.gains
        b, c, tau = self.proportional_weight, self.derivative_weight, self.filter_time
        rows: dict[str, tuple[dict[str, float], float, float]] = {}  # of y, output, back-calculation
        direct = {"reference": b * k_p, "measured": -k_p}
        if k_i > 0.0:
            back = k_i / k_p if anti_windup_time is None and k_p > 0.0 else 1.0 / (anti_windup_time or math.inf)
            rows["integral"] = ({"reference": k_i, "measured": -k_i}, 1.0, back)
        if k_d > 0.0 and tau > 0.0:
            rows["filter"] = ({"reference": c / tau, "measured": -1.0 / tau}, -k_d / tau, 0.0)
            direct["reference"] += c * k_d / tau
            direct["measured"] -= k_d / tau
        elif k_d > 0.0:
            direct |= {"measured_rate": -k_d} | ({"reference_rate": c * k_d} if c > 0.0 else {})
        A = np.diag([-1.0 / tau if name == "filter" else 0.0 for name in rows])
        B = numbers([[by.get(y, 0.0) for y in direct] for by, _, _ in rows.values()]).reshape(len(rows), len(direct))
        C, back_calculation = (numbers([row[k] for row in rows.values()]) for k in (1, 2))
        return LinearSystem(tuple(direct), tuple(rows), A, B, C, numbers(list(direct.values())), back_calculation)


class PositionPID(_PID):
    """PID controller of a position: ``k_p (b r - phi) + k_i integral of (r - phi) + k_d d/dt (c r - phi)/(1 +
    filter_time d/dt)``.
    """

    gain: Annotated[Stiffness, NotNegative] = 0.0
    """k_p"""
    integral_gain: Annotated[float, Unit("N*m/rad/s"), NotNegative] = 0.0
    """k_i"""
    derivative_gain: Annotated[ViscousFriction, NotNegative] = 0.0
    """k_d"""


class SpeedPID(_PID):
    """PID controller of a speed: ``k_p (b r - w) + k_i integral of (r - w) + k_d d/dt (c r - w)/(1 + filter_time
    d/dt)``.
    """

    gain: Annotated[ViscousFriction, NotNegative] = 0.0
    """k_p"""
    integral_gain: Annotated[Stiffness, NotNegative] = 0.0
    """k_i"""
    derivative_gain: Annotated[Inertia, NotNegative] = 0.0
    """k_d"""

    @rule
    def _filtered(self) -> Iterator[str]:
        if self.derivative_gain > 0.0 and self.filter_time == 0.0:
            yield "has a derivative_gain without filter_time: the derivative of a speed jumps with the torque; give a filter_time"


class StateSpace(Part):
    """State space ``x' = A x + B e, v = C x + D e`` in SI, of the error, or of reference and measured value if B and
    D have two columns.
    """

    A: tuple[tuple[Number, ...], ...] = ()
    """one row for each state"""
    B: tuple[tuple[Number, ...], ...] = ()
    """one row for each state, a column for each input"""
    C: tuple[Number, ...] = ()
    """one entry for each state"""
    D: tuple[Number, ...] = (0.0,)
    """one entry for each input"""
    back_calculation: tuple[Number, ...] | None = None
    """per state, what the excess over the limit adds to its rate: x' = A x + B e + back_calculation (u - v)"""

    @rule
    def _fits(self) -> Iterator[str]:
        n, m = len(self.C), len(self.D)
        if n > MAX_ORDER:
            yield f"has {n} states; at most {MAX_ORDER} are possible"
        if m not in (1, 2):
            yield f"has {m} entries in D; give one, of the error, or two, of reference and measured value"
        shapes = {"A": (self.A, n), "B": (self.B, m)}
        for name, (rows, wide) in shapes.items():
            if len(rows) != n or any(len(row) != wide for row in rows):
                yield f"has C of {n} states and D of {m} inputs, so that {name} must be {n} x {wide}; check it"
        if self.back_calculation is not None and len(self.back_calculation) != n:
            yield f"has {len(self.back_calculation)} entries in back_calculation; give one for each of {n} states"

    def winds_up(self) -> bool:
        """Whether a state neither decays by itself nor follows the limited output."""
        if self.back_calculation is not None or not self.A:
            return False
        poles = np.linalg.eigvals(np.array(self.A, float))
        return bool((poles.real > -1e-9 * abs(poles).max()).any()) if poles.any() else True

    def system(self) -> LinearSystem:
        """Matrices for reference and measured value as inputs."""
        n = len(self.C)
        A = np.array(self.A, float).reshape(n, n)
        B, D = np.array(self.B, float).reshape(n, len(self.D)), np.array(self.D, float)
        if len(self.D) == 1:
            B, D = np.hstack([B, -B]), np.array([D[0], -D[0]])
        back = np.zeros(n) if self.back_calculation is None else np.array(self.back_calculation, float)
        states = tuple(f"state_{k + 1}" for k in range(n))
        return LinearSystem(("reference", "measured"), states, A, B, np.array(self.C, float), D, back)


class ContinuousController(Part):
    """A controller without sample time, whose states are states of the train: for theory, and for exact limit cycles.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.load("hunting-with-static-friction").controllers["servo"].position.gain
    8.0
    """

    limit: Annotated[Torque, Positive] | None = None
    """limit of the magnitude of the torque; torque_limit and the largest current of the motor act, too"""
    anti_windup_time: Annotated[Time, Positive] | None = None
    """with which the integrator follows the limited output (back-calculation); left out, gain/integral_gain"""
    kind: Literal["continuous"]
    reference: Annotated[PositionSignal | SpeedSignal, Field(discriminator="kind")]
    """reference of the angle or the speed of `shaft`"""
    shaft: str | None = None
    """shaft whose angle or speed is compared with the reference; left out, the last one"""
    position: PositionPID | None = None
    """controller of a position, which gives the torque of the motor"""
    speed: SpeedPID | None = None
    """controller of a speed, which gives the torque of the motor"""
    state_space: StateSpace | None = None
    """controller of either, which gives the torque of the motor [N·m], or the relative voltage if current.kind is "voltage\""""
    firmware: Firmware | None = None
    """position control of a hobby servo: error to duty cycle to the torque of its winding"""
    current: Annotated[IdealCurrent | FirstOrderCurrent | VoltageCommand, Field(discriminator="kind")] = IdealCurrent()

    @rule
    def _fits_together(self) -> Iterator[str]:
        kind = self.reference.kind
        given = [key for key in ("position", "speed", "state_space", "firmware") if getattr(self, key) is not None]
        if len(given) != 1 or given[0] not in _follow(kind):
            has = f"has {' and '.join(given)}" if given else "has no controller"
            yield f"{has}; with a reference of the {kind}, give {kind} or state_space, and one alone"
        voltage = isinstance(self.current, VoltageCommand)
        if voltage and (self.state_space is None or self.limit is not None):
            yield (
                'has current.kind = "voltage", for which there is state_space alone, limited by the motor\'s voltage; leave out '
                + ("limit" if self.state_space is not None else given[0])
            )
        pid = self.position or self.speed
        if self.anti_windup_time is not None and (pid is None or pid.gains[1] == 0.0):
            yield (
                "has an anti_windup_time but no integral_gain; leave it out"
                + ("" if pid is not None else ", or give state_space.back_calculation")
            )
        if self._needs_rate() and any(a != b for a, b in _jumps(self.reference)):
            yield "has a reference with steps, whose derivative has no bounds; give a filter_time, or derivative_weight = 0"

    def system(self) -> LinearSystem:
        """Matrices of the given controller."""
        pid = self.position or self.speed
        if pid is not None:
            return pid.system(self.anti_windup_time)
        if self.firmware is not None:
            return _seen_by(self.firmware)
        assert self.state_space is not None
        return self.state_space.system()

    def _needs_rate(self) -> bool:
        return "reference_rate" in self.system().signals

    def signals(self, motor: str) -> dict[str, Signal[Any]]:
        """Signals that enter the train in place of the motor's command, by the name of the result variable."""
        found: dict[str, Signal[Any]] = {f"{motor}_reference": self.reference}
        if self._needs_rate():
            found[f"{motor}_reference_rate"] = _rate(self.reference)
        return found

    def start(self, motor: str, measured: float) -> dict[str, float]:
        """States at t = 0 that are not 0, by the name of their result variable: the filter of the derivative has settled."""
        if self.firmware is not None:
            return {f"{motor}_filter": measured} if self.firmware.filter_time > 0.0 else {}
        pid = self.position or self.speed
        if pid is None or pid.gains[2] == 0.0 or pid.filter_time == 0.0:
            return {}
        value = self.reference.breakpoint_list()[0][1]
        value += sum(a * sin(phase) for a, _, phase in self.reference.sine_list())
        return {f"{motor}_filter": pid.derivative_weight * value - measured}

    def output_limit(self, motor: Motor) -> float:
        """Limit of the command, in units of the rated torque or of the rated voltage."""
        if isinstance(self.current, VoltageCommand):
            return math.inf if motor.command_limit is None else motor.command_limit
        limits = [motor.largest_torque, math.inf if self.limit is None else self.limit]
        if self.firmware is not None and self.firmware.max_current is not None:
            limits.append(self.firmware.torque_constant * self.firmware.max_current)
        return min(limits) / motor.rated_torque

    def _check_limits(self, motor: Motor, limit: float) -> None:
        """Refuses a voltage limit that would have no effect, and integrators that would wind up at a limit."""
        current = self.current
        if motor.torque_line() is not None and not isinstance(current, VoltageCommand):
            key = "voltage_limit" if motor.kind == "dc" else "dc_voltage"
            remedy = 'make it a motor of kind "torque_source"' if motor.kind == "synchronous" else f"leave {key} out"
            raise InputError(
                f'"{current.kind}" does not keep to the {key} of the motor; take "voltage" or a sampled controller, or {remedy}',
                "current.kind",
            )
        if math.isinf(limit):
            if self.anti_windup_time is not None:
                raise InputError("nothing limits the output; give a limit, or leave it out", "anti_windup_time")
            return
        pid = self.position or self.speed
        if pid is not None and pid.gains[0] == 0.0 < pid.gains[1] and self.anti_windup_time is None:
            raise InputError(
                "is missing; an integrator behind a limit needs it where there is no gain", "anti_windup_time"
            )
        if self.state_space is not None and self.state_space.winds_up():
            raise InputError(
                "has an integrator behind a limit, which would wind up; give back_calculation (zeros let it wind up)",
                "state_space",
            )

    def add_to(self, core: _core.Train, train: DriveTrain, name: str) -> None:
        """Adds it to the solver's train, as the controller of a motor.

        Raises
        ------
        InputError
            Its shaft is none of the train, a limit of the motor would have no effect, or it would wind up at its limit.
        """
        shaft = list(train.shafts)[-1] if self.shaft is None else self.shaft
        if shaft not in train.shafts:
            meant = did_you_mean(shaft, train.shafts, f"the shafts are {', '.join(train.shafts)}")
            raise InputError(f"{shown(shaft)} is no shaft; {meant}", "shaft")
        motor = train.motors[name]
        limit = self.output_limit(motor)
        self._check_limits(motor, limit)
        system = self.system()
        per_unit = 1.0 if isinstance(self.current, VoltageCommand) else 1.0 / motor.rated_torque
        curve, droop = None, 0.0
        if self.firmware is not None:
            curve, droop = self._curve(self.firmware, motor)
            turning = turns(train, motor.shaft, shaft)
            per_unit = -1.0 if turning is not None and turning < 0.0 else 1.0  # the curve takes the error
        measured = "angle" if self.reference.kind == "position" else "speed"
        number = list(train.shafts).index(shaft)
        there = {"kind": measured, "shaft": number}
        places = {"measured": there, "measured_rate": {"kind": "speed", "shaft": number}}
        fields = {
            "signals": [places.get(signal, {"kind": signal}) for signal in system.signals],
            "compared": there,
            "states": list(system.states),
            "A": system.A.tolist(),
            "B": system.B.tolist(),
            "C": [per_unit * c for c in system.C],
            "D": [per_unit * d for d in system.D],
            "back_calculation": [back / per_unit for back in system.back],
            "limit": limit,
            "curve": curve,
            "droop": droop,
        }
        core.add_controller(name, fields)

    @staticmethod
    def _curve(firmware: Firmware, motor: Motor) -> tuple[_core.TorsionCurve, float]:
        """Command of the motor over the error, and its fall with the speed of the motor [s/rad]."""
        with inside("firmware"):
            errors, torques, droop = firmware.curve()
        commands = [torque / motor.rated_torque for torque in torques]
        points = zip(itertools.pairwise(errors), itertools.pairwise(commands), strict=True)
        slopes = [(d - c) / (b - a) for (a, b), (c, d) in points]
        return _core.TorsionCurve(errors[1:], [*slopes, 0.0]), droop / motor.rated_torque


def _follow(kind: str) -> tuple[str, ...]:
    """Controllers that follow a reference of this kind."""
    return (kind, "state_space", "firmware") if kind == "position" else (kind, "state_space")


def _seen_by(firmware: Firmware) -> LinearSystem:
    """The error of a firmware, whose angle may come through a filter."""
    tau, signals = firmware.filter_time, ("reference", "measured")
    none = np.zeros((0, 0))
    if tau == 0.0:
        return LinearSystem(signals, (), none, np.zeros((0, 2)), np.zeros(0), np.array([1.0, -1.0]), np.zeros(0))
    A, B = np.array([[-1.0 / tau]]), np.array([[0.0, 1.0 / tau]])
    return LinearSystem(signals, ("filter",), A, B, np.array([-1.0]), np.array([1.0, 0.0]), np.zeros(1))


def _jumps(signal: Signal[Any]) -> Iterator[tuple[float, float]]:
    """Value before and after each breakpoint."""
    for (t0, v0, slope), (t1, v1, _) in itertools.pairwise(signal.breakpoint_list()):
        before = v0 + slope * (t1 - t0)
        yield (before, v1) if abs(v1 - before) > 1e-9 * (abs(v1) + abs(before)) else (v1, v1)


def _rate(signal: Signal[Any]) -> CommandSignal:
    """The derivative of a signal without jumps."""
    slopes = [(t, slope) for t, _, slope in signal.breakpoint_list()]
    steps = [Step[Number](time=t, height=b - a) for (_, a), (t, b) in itertools.pairwise(slopes)]
    sines = [
        {"amplitude": 2.0 * math.pi * f * a, "frequency": f, "phase": phase + 0.5 * math.pi}
        for a, f, phase in signal.sine_list()
    ]
    return CommandSignal.model_validate({"mean": slopes[0][1], "steps": steps, "sines": sines})


@checked
def as_state_space(system: "Any") -> StateSpace:
    """Convert a continuous-time system of scipy or python-control to the state space of a controller.

    Parameters
    ----------
    system : scipy.signal.lti or control.LTI
        Transfer function, poles and zeros, or state space, with one output. Its input is the error [rad] or [rad/s] of the
        controller; with two inputs they are the reference and the measured value. Its output is the torque [N·m] or the relative
        voltage.

    Returns
    -------
    StateSpace
        The state space, for `ContinuousController`.

    Raises
    ------
    InputError
        The system is of discrete time, has another number of inputs or outputs, or has more zeros than poles.

    Examples
    --------
    >>> from scipy.signal import lti
    >>> import lostmotion as lm
    >>> lm.control.as_state_space(lti([2.0, 1.0], [0.1, 1.0])).A
    ((-10.0,),)
    """
    need("scipy", "This conversion", "control")
    if isinstance(dt := getattr(system, "dt", None), float | int) and dt > 0.0:
        raise InputError(
            f"system: has a sample time of {dt:g} s, and a continuous controller has none; give one of continuous time, or use a "
            "sampled controller with as_filter"
        )
    try:
        if hasattr(system, "ninputs"):  # python-control
            import control

            ss: Any = control.ss(system)
        else:
            ss = system.to_ss()
    except AttributeError:
        raise InputError(
            f"system: {shown(system)} must be a system of scipy.signal (lti) or of python-control"
        ) from None
    except ValueError as problem:
        raise InputError(f"system: has no state space ({problem}); a controller needs as many poles as zeros") from None
    A, B, C, D = (np.atleast_2d(np.asarray(m, float)) for m in (ss.A, ss.B, ss.C, ss.D))
    if len(D) != 1 or D.shape[1] not in (1, 2):
        raise InputError(
            f"system: has {D.shape[1]} inputs and {len(D)} outputs; give one output, and one or two inputs"
        )
    n = A.shape[0] if A.size else 0
    return StateSpace(
        A=tuple(tuple(map(float, row)) for row in A[:n]),
        B=tuple(tuple(map(float, row)) for row in B[:n]),
        C=tuple(map(float, C[0][:n])),
        D=tuple(map(float, D[0])),
    )
