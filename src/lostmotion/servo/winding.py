"""The winding of a synchronous motor under field-oriented control about a steady motion: what small deviations of it do.

The rotor turns at the speed of the regime, and the motor gives the torque that keeps it. Over the sample time of the
currents that motion repeats. The inverter holds its voltage in coordinates of the stator, so that currents and
voltages in coordinates of the rotor have the same course from sample to sample. About it

    L_d di_d' = du_d - R di_d + w_e L_q di_q + p dw L_q i_q        du_d' =  w_e du_q + p dw u_q
    L_q di_q' = du_q - R di_q - w_e L_d di_d - p dw (L_d i_d + psi)    du_q' = -w_e du_d - p dw u_d
    dM = 1.5 p ((psi + S i_d) di_q + S i_q di_d),  S = L_d - L_q

are linear with coefficients that repeat, together with the plant under dM; a tick is solved by Magnus's series of order 6 between
Gauss's points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import _core
from ..control.controller import Controller
from ..control.loops import FieldOriented
from ..errors import InputError
from ..model.synchronous_motor import PhaseValues
from ..model.train import DriveTrain
from ..response.linearisation import LinearModel

POINTS, WEIGHTS = (0.5 * (x + s) for x, s in zip(np.polynomial.legendre.leggauss(12), (1.0, 0.0), strict=True))
"""weights of Gauss's formula over a tick, as shares of the tick"""


def turn(angle: float) -> np.ndarray:
    """The matrix that turns a pair (d, q) by an angle [rad]."""
    sine, cosine = math.sin(angle), math.cos(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


@dataclass(frozen=True)
class Steady:
    """The steady motion: what repeats from sample to sample of the currents."""

    torque_reference: float  # [N·m]
    wanted: np.ndarray  # i_d*, i_q* [A]
    weakening: float  # by which i_d* is below the i_d of the least current [A], not above 0
    asked: np.ndarray  # voltage in the coordinates that are read at the sample [V]


@dataclass(frozen=True)
class OrientedWinding:
    """Winding and inverter of an axis in one regime, about its steady motion."""

    law: _core.Axis  # the controller as the solver has it
    phase: PhaseValues
    loop: FieldOriented
    tick: float  # base tick [s]
    every: int  # ticks from one sample of the currents to the next
    delay: int  # ticks until a voltage acts
    lag: float  # electrical angle by which the rotor is ahead of what is read, at the speed of the regime [rad]
    speed: float  # speed of the rotor [rad/s]
    torque: float  # mean torque of the motor [N·m]
    largest_voltage: float  # amplitude of a phase [V]
    largest_current: float  # amplitude of a phase [A]
    model: LinearModel
    command: np.ndarray  # dependence of the rates of the plant's states on the torque of the motor [1/(N·m)]
    speed_row: np.ndarray  # the speed of the rotor over the plant's states

    @classmethod
    def of(cls, train: DriveTrain, name: str, c: Controller, law: _core.Axis, model: LinearModel) -> OrientedWinding:
        """The winding in the regime of a linear model, at the speed of its point.

        name: of the motor with field-oriented control.
        c, law: its controller, and what the solver makes of that.

        Raises InputError: the inverter has not the voltage for it.
        """
        motor, loop = train.motors[name], c.current
        assert isinstance(loop, FieldOriented)
        assert motor.winding is not None
        assert motor.winding.max_current is not None
        phase = motor.winding.phase_values()
        row, rated = model.outputs.index(train.variable(motor.shaft, "speed")), motor.rated_torque
        state, inputs = (np.array([model.point[name] for name in names]) for names in (model.states, model.inputs))
        drive = model.B[:, model.inputs.index(train.variable(name, "command"))] / rated
        speed = float(model.C[row] @ state + model.offset[row])
        free = float(model.C[row] @ (model.A @ state + model.B @ inputs + model.rate))
        encoder = c.encoder
        on_rotor = encoder is None or encoder.shaft in (None, motor.shaft)
        late = encoder.delay * c.sample_time if encoder is not None and on_rotor else 0.0
        every = next(n for loop_name, _, n in c.schedules() if loop_name == "current")
        return cls(
            law=law,
            phase=phase,
            loop=loop,
            tick=c.sample_time,
            every=every,
            delay=c.delay,
            lag=phase.pole_pairs * speed * late,
            speed=speed,
            torque=-free / float(model.C[row] @ drive),
            largest_voltage=motor.phase_voltage,
            largest_current=math.sqrt(2.0) * motor.winding.max_current,
            model=model,
            command=drive,
            speed_row=model.C[row],
        )

    # --- the steady motion ---

    @property
    def electrical_speed(self) -> float:
        """w_e [rad/s]."""
        return self.phase.pole_pairs * self.speed

    @property
    def sample_time(self) -> float:
        """Sample time of the currents [s]."""
        return self.every * self.tick

    @property
    def saliency(self) -> float:
        """L_d - L_q [H]."""
        return self.phase.inductance_d - self.phase.inductance_q

    def placed(self, since: int) -> float:
        """Electrical angle from the voltage as it was asked for to that in coordinates of the rotor, so many ticks after the
        sample of the currents [rad]."""
        acting = (since - self.delay) % self.every
        return self.electrical_speed * (0.5 * self.sample_time - acting * self.tick) - self.lag

    @cached_property
    def _drift(self) -> np.ndarray:
        """Rates of (i_d, i_q, u_d, u_q, 1) at the speed of the regime."""
        w, m = self.electrical_speed, self.phase
        d, q, R = m.inductance_d, m.inductance_q, m.resistance
        return np.array(
            [
                [-R / d, w * q / d, 1.0 / d, 0.0, 0.0],
                [-w * d / q, -R / q, 0.0, 1.0 / q, -w * m.flux_linkage / q],
                [0.0, 0.0, 0.0, w, 0.0],
                [0.0, 0.0, -w, 0.0, 0.0],
                np.zeros(5),
            ]
        )

    def _drifted(self, time: float) -> np.ndarray:
        from scipy.linalg import expm

        return np.asarray(expm(self._drift * time))

    @cached_property
    def _at_points(self) -> list[np.ndarray]:
        """The same after shares of a tick: at Gauss's points, and at its end."""
        return [self._drifted(share * self.tick) for share in (*POINTS, 1.0)]

    @property
    def least_direct(self) -> float:
        """Least i_d [A], beyond which the voltage would rise again."""
        return -min(self.largest_current, self.phase.flux_linkage / self.phase.inductance_d)

    def _wanted(self, torque: float, weakening: float) -> np.ndarray:
        i_d = max(self.law.least_current(torque)[0] + weakening, self.least_direct)
        return np.array([i_d, torque / self.constant(i_d)])

    def constant(self, i_d: float) -> float:
        """Torque to i_q [N·m/A]."""
        return 1.5 * self.phase.pole_pairs * (self.phase.flux_linkage + self.saliency * i_d)

    def _asked(self, wanted: np.ndarray) -> np.ndarray:
        """The voltage under which these currents are read at each sample."""
        over = self._at_points[-1]
        current, by_voltage, constant = np.eye(2), np.zeros((2, 2)), np.zeros(2)
        for since in range(self.every):
            pair = over[:2, :2]
            by_voltage = pair @ by_voltage + over[:2, 2:4] @ turn(self.placed(since))
            current, constant = pair @ current, pair @ constant + over[:2, 4]
        begin = turn(-self.lag) @ wanted
        return np.asarray(np.linalg.solve(by_voltage, begin - current @ begin - constant))

    def _mean_torque(self, wanted: np.ndarray, asked: np.ndarray) -> float:
        at, total = turn(-self.lag) @ wanted, 0.0
        for since in range(self.every):
            start = np.array([*at, *(turn(self.placed(since)) @ asked), 1.0])
            for weight, over in zip(WEIGHTS, self._at_points, strict=False):
                i_d, i_q = (over @ start)[:2]
                total += weight * self.phase.torque(i_d, i_q)
            at = (self._at_points[-1] @ start)[:2]
        return total / self.every

    def _motion(self, torque: float, weakening: float) -> Steady:
        reference = torque
        for _ in range(50):
            wanted = self._wanted(reference, weakening)
            asked = self._asked(wanted)
            off = torque - self._mean_torque(wanted, asked)
            reference += off
            if abs(off) <= 1e-13 * abs(torque):
                break
        return Steady(reference, wanted, weakening, asked)

    def _kept(self, torque: float) -> Steady | None:
        """The steady state with the field weakened as the voltage requires; None where current and voltage do not suffice."""
        from scipy.optimize import brentq

        share = self.loop.weakening_voltage if self.loop.field_weakening > 0.0 else 1.0
        most = share * self.largest_voltage

        def excess(f: float) -> float:
            return float(np.hypot(*self._motion(torque, f).asked)) - most

        found, most_weakened = 0.0, -self.largest_current
        if excess(0.0) > 0.0:
            if self.loop.field_weakening == 0.0 or excess(most_weakened) > 0.0:
                return None
            found = float(brentq(excess, most_weakened, 0.0, xtol=1e-13 * self.largest_current))
        motion = self._motion(torque, found)
        return motion if float(np.hypot(*motion.wanted)) <= self.largest_current else None

    @cached_property
    def steady(self) -> Steady:
        """The steady state with the torque of the regime, or with the largest part that current and voltage permit."""
        found, low, high = self._kept(self.torque), 0.0, 1.0
        if found is not None:
            return found
        found = self._kept(0.0)
        if found is None:
            needed = float(np.hypot(*self._motion(0.0, 0.0).asked))
            raise InputError(
                f"half of the largest reference speed, {self.speed:.4g} rad/s, requires {needed:.4g} V of a phase, and the inverter gives "
                f"{self.largest_voltage:.4g} V; lower the speed, or give current.field_weakening or a higher motor.dc_voltage"
            )
        for _ in range(30):
            half = 0.5 * (low + high)
            kept = self._kept(half * self.torque)
            low, high, found = (half, high, kept) if kept is not None else (low, half, found)
        return found

    # --- small deviations ---

    def step(self, outermost: _core.CurrentAxis | None, cut: bool, tick: int) -> np.ndarray:
        """The matrix of `_core.linear_orientation` at a tick.

        outermost: the current that is looked at; None for both under a torque.
        """
        m = self.steady
        return _core.linear_orientation(
            self.law,
            speed=self.speed,
            lag=self.lag,
            torque=m.torque_reference,
            weakening=m.weakening,
            current=m.wanted.tolist(),
            voltage=m.asked.tolist(),
            outermost=outermost or _core.CurrentAxis.none,
            cut=cut,
            every=self.every,
            since=tick % self.every,
            sample_time=self.tick,
        )

    @cached_property
    def over_ticks(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Matrices of each sample instant after a sample of the currents. They map (plant, i_d, i_q, u_d, u_q) at its
        beginning to the plant and the currents at its end, (n + 2, n + 4). Those from each of Gauss's points to the
        same end are (12, n + 2, n + 4)."""
        return [self._over_tick(start) for start in self._starts]

    @cached_property
    def _starts(self) -> list[np.ndarray]:
        """(i_d, i_q, u_d, u_q, 1) at the beginning of each tick."""
        motion, out = self.steady, []
        at = turn(-self.lag) @ motion.wanted
        for since in range(self.every):
            out.append(np.array([*at, *self.voltage(since), 1.0]))
            at = (self._at_points[-1] @ out[-1])[:2]
        return out

    def voltage(self, since: int) -> np.ndarray:
        """(u_d, u_q) at the beginning of a tick [V]."""
        return np.asarray(turn(self.placed(since)) @ self.steady.asked)

    def _rates(self, values: np.ndarray) -> np.ndarray:
        """Rates of the deviations of (plant, i_d, i_q, u_d, u_q) from these steady values."""
        m, n, p = self.phase, len(self.model.states), self.phase.pole_pairs
        i_d, i_q, u_d, u_q, _ = values
        out = np.zeros((n + 4, n + 4))
        out[:n, :n] = self.model.A
        out[:n, n] = self.command * 1.5 * p * self.saliency * i_q
        out[:n, n + 1] = self.command * self.constant(i_d)
        out[n:, n:] = self._drift[:4, :4]
        by_speed = p * np.array(
            [
                m.inductance_q * i_q / m.inductance_d,
                -(m.inductance_d * i_d + m.flux_linkage) / m.inductance_q,
                u_q,
                -u_d,
            ]
        )
        out[n:, :n] = np.outer(by_speed, self.speed_row)
        return out

    def _over_tick(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        from scipy.linalg import expm

        n = len(self.model.states)
        whole = np.eye(n + 4)
        from_points = [whole]
        edges = np.array([0.0, *POINTS, 1.0]) * self.tick
        for begin, end in zip(edges[-2::-1], edges[:0:-1], strict=True):  # the last stretch first
            h, middle = end - begin, 0.5 * (begin + end)
            A = [
                self._rates(self._drifted(middle + c * math.sqrt(15.0) / 10.0 * h) @ start) * h
                for c in (-1.0, 0.0, 1.0)
            ]
            whole = whole @ expm(magnus(*A))
            from_points.append(whole)
        return whole[: n + 2], np.array(from_points[-2:0:-1])[:, : n + 2]

    def forced(self, load: np.ndarray, w: np.ndarray, since: int) -> np.ndarray:
        """Response of plant and currents at the end of a sample to a sine exp(j w t) on the plant's states [1/s]: (w, n + 2)."""
        _, from_points = self.over_ticks[since]
        each = from_points[:, :, : len(load)] @ load  # (point, n + 2)
        waves = np.exp(1j * np.outer(w, POINTS * self.tick)) * WEIGHTS * self.tick
        return np.asarray(waves @ each)


def magnus(A1: np.ndarray, A2: np.ndarray, A3: np.ndarray) -> np.ndarray:
    """Logarithm of the transition over a stretch, to order 6, from the rates at its three points of Gauss times its length
    (Blanes, Casas, Oteo, Ros 2009, eq. 253)."""

    def bracket(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(x @ y - y @ x)

    a1, a2, a3 = A2, math.sqrt(15.0) / 3.0 * (A3 - A1), 10.0 / 3.0 * (A3 - 2.0 * A2 + A1)
    c1 = bracket(a1, a2)
    c2 = -bracket(a1, 2.0 * a3 + c1) / 60.0
    return np.asarray(a1 + a3 / 12.0 + bracket(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0)
