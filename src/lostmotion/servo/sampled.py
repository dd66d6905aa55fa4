"""The exact linear sampled loops of an axis in one regime of its plant.

Between two base ticks the plant is x' = A x + B u with u held, so x[k+1] = Phi x[k] + Gamma u[k] with the matrix exponential. The
controller computes at its ticks what core/lostmotion/control/axis.hpp says, without limits, quantisation and dead zones. Both
together are linear and repeat after the sample time of the outermost loop that is closed. Over that time they are one
time-invariant system, from whose samples all is computed; nothing is averaged or approximated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..control.axis import turns
from ..control.encoder import Encoder
from ..control.filters import companion
from ..control.loops import CurrentLoop, Difference, ExactSpeed, Observer
from ..errors import InputError
from ..response.linear import LinearModel
from . import field_orientation
from .regimes import Axis, Regime
from .rows import INPUTS, Row, Tick

LOOPS = ("direct current", "current", "speed", "position")  # the innermost first

Entering = Callable[[int, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class SampledLoop:
    """One loop of an axis with the loops within it, in one regime of the plant; the loops around it are open.

    The loop is cut where its measured value enters its controller, or closed.
    """

    axis: Axis
    regime: Regime
    loop: str
    cut: bool

    def __post_init__(self) -> None:
        if self.loop not in self.axis.loops:
            raise InputError(f"loop: the axis has no loop {self.loop!r}; it has {', '.join(self.axis.loops)}")
        every = [self.every(name) for name in self.active]
        for inner, outer, a, b in zip(self.active, self.active[1:], every, every[1:], strict=False):
            if b % a:
                raise InputError(
                    f"{outer}.sample_time: {b} ticks are no whole multiple of the {a} of the loop {inner} within it, so that the "
                    f"loop has no frequency response; take {-(-b // a) * a * self.tick:g} s"
                )

    @property
    def model(self) -> LinearModel:
        return self.regime.model

    @property
    def tick(self) -> float:
        """Base tick [s]."""
        return self.axis.controller.sample_time

    @property
    def active(self) -> tuple[str, ...]:
        return self.axis.loops[: self.axis.loops.index(self.loop) + 1]

    def every(self, loop: str) -> int:
        loop = {"direct current": "current"}.get(loop, loop)
        return next(n for name, _, n in self.axis.controller.schedules() if name == loop)

    @property
    def sample_time(self) -> float:
        """Of the loop [s]."""
        return self.every(self.loop) * self.tick

    # --- matrices of each tick ---

    @cached_property
    def ticks(self) -> list[tuple[np.ndarray, np.ndarray, dict[str, Row]]]:
        """Of each tick of one sample time: state to state, inputs to state, and the signals."""
        names = self._states()
        n, total = len(self.plant_states), len(names)
        out = []
        for k in range(self.every(self.loop)):
            tick = Tick(names)
            acting = self._control(tick, k)
            plant = self._over_tick(k) @ np.vstack([[tick[name] for name in names[:n]], acting])
            rows = np.vstack([plant, [tick[name] for name in names[n:]]])
            out.append((rows[:, :total], rows[:, total:], tick.rows))
        return out

    @property
    def plant_states(self) -> tuple[str, ...]:
        """Those of the plant, and the currents of a winding."""
        return (*self.model.states, *(() if self.regime.winding is None else field_orientation.CURRENTS))

    def _over_tick(self, k: int) -> np.ndarray:
        """From the states of the plant and what acts on it to its states a tick later."""
        winding = self.regime.winding
        return self.regime.over_tick if winding is None else winding.over_ticks[k % winding.every][0]

    def _states(self) -> list[str]:
        c = self.axis.controller
        names = list(self.plant_states)

        def row(name: str, count: int) -> list[str]:
            return [f"{name}{k}" for k in range(count)]

        names += ["torque_reference", "measured_speed", "speed_reference"]
        if self.regime.winding is not None:
            names += field_orientation.states(self.regime.winding)
        else:
            names += ["computed_command", "current_integral", *row("command_delay_", c.delay)]
        for key in ("encoder", "position_encoder"):
            encoder = getattr(c, key)
            names += row(f"{key}_delay_", 0 if encoder is None else encoder.delay)
        e = self._kind_of_estimate()
        names += row("before_", e.span) if isinstance(e, Difference) else []
        names += ["estimate", "estimated_angle"] if isinstance(e, Observer) else ["estimate"]
        if c.speed is not None:
            names += ["speed_integral"]
            for key in ("reference_filters", "torque_filters"):
                for k, system in enumerate(self._filters(key)):
                    names += row(f"{key}_{k}_", len(system[1]))
        if c.position is not None:
            names += ["position_integral", "blended"]
        return names

    def _kind_of_estimate(self) -> Difference | Observer | ExactSpeed:
        """Without a speed loop, the current loop has the plain difference for its back-e.m.f."""
        speed = self.axis.controller.speed
        return Difference() if speed is None else speed.estimate

    def _filters(self, key: str) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, float]]:
        c = self.axis.controller
        return [companion(*f.discrete(c.loop_time("speed"))) for f in getattr(c.speed, key)]

    def _output(self, tick: Tick, name: str) -> Row:
        """A variable of the plant that the command does not act on at once."""
        m = self.model
        if name not in m.outputs:
            raise InputError(
                f"{name}: follows from no gear in this regime, as behind a transmission error or an open clutch; put the encoder "
                "on a shaft that the motor turns"
            )
        return sum((c * tick[s] for c, s in zip(m.C[m.outputs.index(name)], m.states, strict=True)), tick.zero)

    # --- one tick, in the order of Axis::step ---

    def _control(self, tick: Tick, k: int) -> np.ndarray:
        """Computes the signals of a tick; returns what acts on the plant from it on."""
        c, axis = self.axis.controller, self.axis
        for shaft in (axis.motor_shaft, axis.shaft):
            tick[f"{shaft}_angle"] = self._output(tick, f"{shaft}_angle")
        due = {name: k % self.every(name) == 0 for name in LOOPS if name in self.active}
        speed_shaft = self._sensor(tick, "encoder", "speed_angle", axis.motor_shaft)
        if c.position_encoder is not None:
            self._sensor(tick, "position_encoder", "position_angle", axis.shaft)
        if k % self.every("speed") == 0:
            tick["measured_speed"] = self._estimate(tick, speed_shaft)
        if self.loop == "position" and due["position"]:
            self._position_loop(tick)
        if due.get("speed"):
            self._speed_loop(tick)
        if self.regime.winding is not None:
            return self._winding(tick, k, speed_shaft)
        if self.loop == "current":
            tick["torque_reference"] = tick["reference"]
        if isinstance(c.current, CurrentLoop):
            if due["current"]:
                tick["computed_command"] = self._current_loop(tick, c.current)
        else:
            tick["computed_command"] = tick["torque_reference"] / axis.scenario.motors[axis.motor].rated_torque
        return tick.delayed("command_delay_", tick["computed_command"], c.delay)[None, :]

    def _winding(self, tick: Tick, k: int, speed_shaft: str) -> np.ndarray:
        winding = self.regime.winding
        assert winding is not None
        rotor = tick[f"{self.axis.motor_shaft}_angle"]
        read = tick["speed_angle"] if speed_shaft == self.axis.motor_shaft else rotor
        if k % winding.every == 0:
            measured = partial(self._measured, tick)
            field_orientation.control(tick, winding, (rotor, read), self.loop, measured)
        return field_orientation.acting(tick, winding, rotor, k % winding.every)

    def _sensor(self, tick: Tick, key: str, signal: str, target: str) -> str:
        """Reads an encoder, to the angle of `target`; returns its shaft."""
        encoder: Encoder | None = getattr(self.axis.controller, key)
        shaft = (encoder and encoder.shaft) or self.axis.motor_shaft
        delay = 0 if encoder is None else encoder.delay
        scale = turns(self.axis.train, target, shaft)
        tick[signal] = (scale or 1.0) * tick.delayed(f"{key}_delay_", self._output(tick, f"{shaft}_angle"), delay)
        return shaft

    def _estimate(self, tick: Tick, shaft: str) -> Row:
        T, e, angle = self.axis.controller.loop_time("speed"), self._kind_of_estimate(), tick["speed_angle"]
        if isinstance(e, Difference):
            smoothing = -math.expm1(-T / e.time_constant) if e.time_constant > 0.0 else 1.0
            difference = (angle - tick.delayed("before_", angle, e.span)) / (T * e.span)
            tick["estimate"] = tick["estimate"] + smoothing * (difference - tick["estimate"])
            return tick["estimate"]
        if isinstance(e, Observer):
            w, before = 2.0 * math.pi * e.bandwidth, tick["estimate"]
            error = angle - tick["estimated_angle"]
            acceleration = tick["torque_reference"] / e.inertia if e.inertia else tick.zero
            step = before + 2.0 * e.damping * w * error
            tick["estimated_angle"] = tick["estimated_angle"] + T * step + 0.5 * T * T * acceleration
            tick["estimate"] = before + T * (w * w * error + acceleration)
            return before
        scale = turns(self.axis.train, self.axis.motor_shaft, shaft)
        return (scale or 1.0) * self._output(tick, f"{shaft}_speed")

    def _measured(self, tick: Tick, loop: str, row: Row) -> Row:
        """What a controller takes for its measured value: where the loop is cut, the input in its place."""
        tick[f"{loop}_measured"] = row
        return tick["measured"] if self.cut and loop == self.loop else row

    def _position_loop(self, tick: Tick) -> None:
        c, ratio = self.axis.controller, self.axis.ratio
        assert c.position is not None
        angle = tick["speed_angle"] / ratio
        if c.position_encoder is not None:
            T = c.loop_time("position")
            share = 1.0 if c.blend_time is None else -math.expm1(-T / c.blend_time)
            beyond = tick["position_angle"] - angle - tick["blended"]
            tick["blended"] = tick["blended"] + share * beyond
            angle = angle + tick["blended"]
        e = tick["reference"] - self._measured(tick, "position", angle)
        wanted = c.position.gain * e + tick["position_integral"] + c.position.feedforward * tick["rate"]
        tick["position_integral"] = tick["position_integral"] + c.loop_time("position") * c.position.integral_gain * e
        tick["speed_reference"] = ratio * wanted

    def _speed_loop(self, tick: Tick) -> None:
        c, ratio = self.axis.controller, self.axis.ratio
        loop, T = c.speed, c.loop_time("speed")
        assert loop is not None
        outermost = self.loop == c.reference.kind
        if self.loop == "speed":
            tick["speed_reference"] = (ratio if outermost else 1.0) * tick["reference"]
        wanted = tick["speed_reference"]
        for k, system in enumerate(self._filters("reference_filters")):
            wanted = tick.filtered(f"reference_filters_{k}_", wanted, system)
        ahead = tick.zero
        if outermost:
            speed, acceleration = ("reference", "rate") if self.loop == "speed" else ("rate", "second")
            f = c.feedforward
            ahead = ratio * (f.inertia * tick[acceleration] + f.viscous_friction * tick[speed])
        measured = self._measured(tick, "speed", tick["measured_speed"])
        k_t = loop.reference_weight * loop.gain
        v = tick["speed_integral"] - (loop.gain - k_t) * measured + ahead
        torque = k_t * (wanted - measured) + v
        if loop.k_i:
            tick["speed_integral"] = tick["speed_integral"] + T * loop.k_i / k_t * (torque - v)
        for k, system in enumerate(self._filters("torque_filters")):
            torque = tick.filtered(f"torque_filters_{k}_", torque, system)
        tick["torque_reference"] = torque

    def _current_loop(self, tick: Tick, loop: CurrentLoop) -> Row:
        m = self.axis.scenario.motors[self.axis.motor].as_dc()
        k_N, tau = m.armature_voltage_constant, m.electrical_time_constant
        assert k_N is not None and tau is not None and m.rated_speed is not None  # noqa: PT018
        share = -math.expm1(-self.axis.controller.loop_time("current") / tau)
        torque = self._measured(tick, "current", self._output(tick, f"{self.axis.motor}_torque"))
        e = (tick["torque_reference"] - torque) / m.rated_torque
        wanted = loop.gain / (k_N * share) * e + tick["current_integral"]
        wanted = wanted + loop.back_emf * (k_N - 1.0) / (k_N * m.rated_speed) * tick["measured_speed"]
        tick["current_integral"] = tick["current_integral"] + loop.gain / k_N * e
        return np.asarray(wanted)

    # --- what follows ---

    @cached_property
    def transition(self) -> np.ndarray:
        """State to state over one sample time of the loop."""
        whole = np.eye(len(self.ticks[0][0]))
        for F, _, _ in self.ticks:
            whole = F @ whole
        return whole

    def _samples(self, signal: str, w: np.ndarray, entering: Entering, direct: np.ndarray) -> np.ndarray:
        """A signal at the samples of the loop, where what enters the state at each tick goes as exp(j w t).

        Parameters
        ----------
        w
            Angular frequencies [rad/s].
        entering
            Of a tick and its matrix of the inputs: what is added to the state, over the frequencies.
        direct
            The inputs at the sample, over the frequencies.
        """
        whole, z = self.transition, np.exp(1j * w * self.tick)
        n = len(whole)
        forced = np.zeros((len(w), n), complex)
        for k, (F, G, _) in enumerate(self.ticks):
            forced = forced @ F.T + entering(k, G) * (z**k)[:, None]
        state = np.linalg.solve((z ** len(self.ticks))[:, None, None] * np.eye(n) - whole, forced[:, :, None])[:, :, 0]
        row = self.ticks[0][2][signal]
        return np.asarray(state @ row[:n] + direct @ row[n:])

    def response(self, frequency: Any, *, feedforward: bool = True, signal: str | None = None) -> np.ndarray:
        """From a sine of the loop's reference to what the loop measures, at its samples.

        Parameters
        ----------
        frequency
            [Hz], up to half the sampling frequency of the loop.
        feedforward
            Whether the derivatives of the reference are fed forward, as the outermost loop does.
        signal
            Another signal of the controller, such as ``torque_reference``.
        """
        w = _angular(frequency)
        inputs = np.zeros((len(w), len(INPUTS)), complex)
        position = self.axis.controller.position
        delay = position.reference_delay if self.loop == "position" and position is not None else 0.0
        inputs[:, 0] = np.exp(-1j * w * delay)
        if feedforward:
            inputs[:, 1], inputs[:, 2] = 1j * w, -w * w
        return self._samples(signal or f"{self.loop}_measured", w, lambda _, G: inputs @ G.T, inputs)

    def closed_loop(self, frequency: Any, *, feedforward: bool = False) -> np.ndarray:
        """As `response`, with what is measured as the reference has it: the speed of the motor as that of the reference's shaft [Hz]."""
        of_load = self.loop == "speed" and self.axis.controller.reference.kind == "speed"
        return self.response(frequency, feedforward=feedforward) / (self.axis.ratio if of_load else 1.0)

    def open_loop(self, frequency: Any) -> np.ndarray:
        """L(exp(j w T)) of the loop that is cut: what comes back, with the sign turned, for what enters its controller [Hz]."""
        w = _angular(frequency)
        one = np.zeros((len(w), len(INPUTS)))
        one[:, INPUTS.index("measured")] = 1.0
        # What enters counts at the samples of the loop alone.
        return -self._samples(f"{self.loop}_measured", w, lambda k, G: (one if k == 0 else 0.0 * one) @ G.T, one)

    def compliance(self, frequency: Any, shaft: str, load: str) -> np.ndarray:
        """Angle of a shaft [rad] at the samples, for one N·m of a load torque that is a sine of continuous time [Hz]."""
        m, n, winding = self.model, len(self.model.states), self.regime.winding
        w, b = _angular(frequency), m.B[:, m.inputs.index(f"{load}_load_torque")]
        force = np.zeros((len(w), len(self.transition)), complex)
        nothing = np.zeros((len(w), len(INPUTS)))

        def of_winding(k: int, _: np.ndarray) -> np.ndarray:
            assert winding is not None
            force[:, : n + 2] = winding.forced(b, w, k % winding.every)
            return force

        if winding is not None:
            return self._samples(f"{shaft}_angle", w, of_winding, nothing)
        z, eye = np.exp(1j * w * self.tick), np.eye(n)
        over_tick = (z[:, None, None] * eye - self.regime.over_tick[:, :-1]) @ b
        force[:, :n] = np.linalg.solve(1j * w[:, None, None] * eye - m.A, over_tick[:, :, None])[:, :, 0]
        return self._samples(f"{shaft}_angle", w, lambda _, __: force, nothing)


def _angular(frequency: Any) -> np.ndarray:
    """[rad/s] of [Hz], as an array."""
    return 2.0 * math.pi * np.atleast_1d(np.asarray(frequency, float))
