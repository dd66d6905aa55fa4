"""The exact linear sampled loops of an axis in one regime of its plant.

Between two base ticks the plant is x' = A x + B u with u held, so x[k+1] = Phi x[k] + Gamma u[k] with the matrix exponential. A
sample step of the controller is affine away from its limits; the core gives its matrices (core/lostmotion/control/linear_step.hpp).
Both together are linear and repeat after the sample time of the outermost loop that is closed. Over that time they are one
time-invariant system, from whose samples all is computed; nothing is averaged or approximated.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..errors import InputError
from ..response.linearisation import LinearModel
from .linear_regimes import Axis, Regime

INPUTS = ("reference", "rate", "acceleration", "measured")
"""of a loop: its reference with two derivatives, and what takes the place of its measured value where it is cut"""
CURRENTS = {"direct current": _core.CurrentAxis.direct, "current": _core.CurrentAxis.quadrature}
"""loops of field-oriented control, of i_d and of i_q, the other one closed"""

LinearForm = np.ndarray  # a signal as a linear form over the state at a tick, and the inputs


@dataclass(frozen=True)
class LinearLoop:
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
        """Sample time of the loop [s]."""
        return self.every(self.loop) * self.tick

    # --- matrices of each tick ---

    @cached_property
    def ticks(self) -> list[tuple[np.ndarray, np.ndarray, dict[str, LinearForm]]]:
        """Matrices of each sample instant: state to state, inputs to state, and the signals."""
        first = self.axis.law[0].position_phase if self.loop == "position" else 0
        ticks = [self._tick(first + k) for k in range(self.every(self.loop))]
        # What neither the plant nor an input reaches stays as it is, such as the integrators of the loops left open.
        reached = np.arange(len(ticks[0][0])) < self._plant_states
        for _ in reached:
            reached = reached | np.any([F[:, reached].any(axis=1) | G.any(axis=1) for F, G, _ in ticks], axis=0)
        kept = np.append(reached, np.ones(len(INPUTS), bool))
        return [
            (F[np.ix_(reached, reached)], G[reached], {name: row[kept] for name, row in rows.items()})
            for F, G, rows in ticks
        ]

    @property
    def _plant_states(self) -> int:
        """Number of states of the plant, with the currents of a winding."""
        return len(self.model.states) + (0 if self.regime.winding is None else 2)

    def _tick(self, tick: int) -> tuple[np.ndarray, np.ndarray, dict[str, LinearForm]]:
        law, position_shaft, speed_shaft = self.axis.law
        winding, motor, loop = self.regime.winding, self.axis.motor, self.loop
        oriented = CURRENTS.get(loop) if winding is not None else None
        outermost = getattr(_core.Loop, "current" if oriented else loop)
        step = _core.linear_step(law, outermost=outermost, cut=self.cut, sample=tick, sample_time=self.tick)
        currents = np.zeros((4, 0)) if winding is None else winding.step(oriented, self.cut, tick)
        counts = (self._plant_states, len(step), len(currents) - 4, len(INPUTS))
        plant, slots, own, inputs = np.split(np.eye(sum(counts)), np.cumsum(counts)[:-1])
        train = self.axis.train
        sampled = (
            train.variable(position_shaft, "angle"),
            train.variable(speed_shaft, "angle"),
            train.variable(speed_shaft, "speed"),
            train.variable(motor, "torque"),
        )
        # What a controller does not read need not follow from the states.
        read = [
            self._output(name, plant) if column.any() else np.zeros(sum(counts))
            for name, column in zip(sampled, step.T[len(step) :], strict=False)
        ]
        after = step @ np.vstack([slots, *read, 0.0 * inputs if oriented else inputs])
        rows = {name: after[j] for j, (name, _, _) in enumerate(_core.axis_signals())}
        angles = [train.variable(s, "angle") for s in (self.axis.motor_shaft, self.axis.shaft)]
        rows |= {angle: self._output(angle, plant) for angle in angles}
        rows |= {f"{name}_measured": rows[f"measured_{name}"] for name in ("speed", "position")}
        if winding is None:
            acting, over_tick = after[[_core.COMMAND_SLOT]], self.regime.over_tick
            if loop == "current":
                rows["current_measured"] = self._output(sampled[3], plant)
        else:
            rotor = rows[angles[0]]
            angle = after[_core.SPEED_ANGLE_SLOT] if law.commutates_by_encoder else rotor
            taken = [rows["torque_reference"], rows["measured_speed"], angle, rotor, *plant[-2:], inputs[0], inputs[3]]
            own, acting, measured = np.split(currents @ np.vstack([own, *taken]), [len(own), len(own) + 2])
            rows |= {f"{name}_measured": row for name, row in zip(CURRENTS, measured, strict=True)}
            over_tick = winding.over_ticks[tick % winding.every][0]
        whole = np.vstack([over_tick @ np.vstack([plant, acting]), after, own])
        return whole[:, : -len(INPUTS)], whole[:, -len(INPUTS) :], rows

    def _output(self, name: str, plant: np.ndarray) -> LinearForm:
        """A variable of the plant that the command does not act on at once."""
        m = self.model
        if name not in m.outputs:
            raise InputError(
                f"{name}: follows from no gear in this regime, as behind a transmission error or an open clutch; put the encoder "
                "on a shaft that the motor turns"
            )
        return np.asarray(m.C[m.outputs.index(name)] @ plant[: len(m.states)])

    # --- what follows ---

    @cached_property
    def transition(self) -> np.ndarray:
        """State to state over one sample time of the loop."""
        whole = np.eye(len(self.ticks[0][0]))
        for F, _, _ in self.ticks:
            whole = F @ whole
        return whole

    @cached_property
    def _onward(self) -> np.ndarray:
        """Matrix of each sample instant: from the state after it to the state at the next sample of the loop."""
        found = [np.eye(len(self.ticks[0][0]))]
        for F, _, _ in self.ticks[:0:-1]:
            found.append(found[-1] @ F)
        return np.array(found[::-1], complex)

    @cached_property
    def _entered(self) -> np.ndarray:
        """Matrix of each sample instant: from its inputs to the state at the next sample of the loop."""
        return np.asarray(self._onward @ np.array([G for _, G, _ in self.ticks]))

    def _turned(self, w: np.ndarray) -> np.ndarray:
        """Phase factor of a sine at each sample instant, exp(j w t), over frequencies and sample instants."""
        return np.asarray(np.exp(1j * self.tick * np.outer(w, np.arange(len(self.ticks)))))

    def _summed(self, w: np.ndarray, matrices: np.ndarray, entering: np.ndarray) -> np.ndarray:
        """The sum over the ticks of their matrices times what enters, which goes as exp(j w t)."""
        ticks, n, m = matrices.shape
        both = (self._turned(w) @ matrices.reshape(ticks, n * m)).reshape(len(w), n, m)
        return np.asarray((both @ entering[:, :, None])[:, :, 0])

    def _samples(self, signal: str, w: np.ndarray, forced: np.ndarray, direct: np.ndarray) -> np.ndarray:
        """A signal at the samples of the loop, where all that enters goes as exp(j w t).

        w: angular frequencies [rad/s].
        forced: what has entered the state from one sample to the next, over the frequencies.
        direct: the inputs at the sample, over the frequencies.
        """
        whole, turn = self.transition, np.exp(1j * w * self.tick * len(self.ticks))
        n = len(whole)
        state = np.linalg.solve(turn[:, None, None] * np.eye(n) - whole, forced[:, :, None])[:, :, 0]
        row = self.ticks[0][2][signal]
        return np.asarray(state @ row[:n] + direct @ row[n:])

    def response(self, frequency: Any, *, feedforward: bool = True, signal: str | None = None) -> np.ndarray:
        """Response from a sine of the loop's reference to its measured value, at its samples.

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
        return self._samples(signal or f"{self.loop}_measured", w, self._summed(w, self._entered, inputs), inputs)

    def closed_loop(self, frequency: Any, *, feedforward: bool = False) -> np.ndarray:
        """Closed loop as `response`, with the measured value at the reference's shaft [Hz]."""
        of_load = self.loop == "speed" and self.axis.controller.reference.kind == "speed"
        return self.response(frequency, feedforward=feedforward) / (self.axis.ratio if of_load else 1.0)

    def open_loop(self, frequency: Any) -> np.ndarray:
        """L(exp(j w T)) of the loop that is cut: what comes back, with the sign turned, for what enters its controller [Hz]."""
        w = _angular(frequency)
        one = np.zeros((len(w), len(INPUTS)))
        one[:, INPUTS.index("measured")] = 1.0
        # What enters counts at the samples of the loop alone.
        return -self._samples(f"{self.loop}_measured", w, one @ self._entered[0].T, one)

    def compliance(self, frequency: Any, shaft: str, load: str) -> np.ndarray:
        """Angle of a shaft [rad], or position of a slide [m], at the samples. The load torque is a sine of 1 N·m, of
        a slide the force a sine of 1 N, of continuous time [Hz]."""
        m, n, winding = self.model, len(self.model.states), self.regime.winding
        w, b = _angular(frequency), m.B[:, m.inputs.index(self.axis.train.variable(load, "load_torque"))]
        force = np.zeros((len(w), len(self.transition)), complex)
        nothing = np.zeros((len(w), len(INPUTS)))

        if winding is None:
            z, eye = np.exp(1j * w * self.tick), np.eye(n)
            over_tick = (z[:, None, None] * eye - self.regime.over_tick[:, :-1]) @ b
            force[:, :n] = np.linalg.solve(1j * w[:, None, None] * eye - m.A, over_tick[:, :, None])[:, :, 0]
            forced = self._summed(w, self._onward, force)
        else:
            forced = np.zeros_like(force)
            for k, (onward, turn) in enumerate(zip(self._onward, self._turned(w).T, strict=True)):
                force[:, : n + 2] = winding.forced(b, w, k % winding.every)
                forced += turn[:, None] * (force @ onward.T)
        return self._samples(self.axis.train.variable(shaft, "angle"), w, forced, nothing)


def _angular(frequency: Any) -> np.ndarray:
    """[rad/s] of [Hz], as an array."""
    return 2.0 * math.pi * np.atleast_1d(np.asarray(frequency, float))
