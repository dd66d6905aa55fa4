"""A synchronous motor under sampled field-oriented control by its full equations: currents, angles and speeds as one system of
ordinary differential equations, solved from tick to tick by the pair of Dormand and Prince of order 8; the controller in complex
numbers as docs/control.md says it. Nothing of the package is used."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import DOP853


def steps(rates: Any, t: float, x: np.ndarray, end: float, longest: float) -> list[np.ndarray]:
    """The states after the steps of a solution."""
    solver, states = DOP853(rates, t, x, end, rtol=1e-13, atol=1e-15, max_step=longest), []
    while solver.status == "running":
        solver.step()
        states.append(solver.y)
    assert solver.status == "finished"
    return states


@dataclass
class Axis:
    """A motor on a load over a gear with play; values as in docs/motors.md and docs/control.md."""

    p: int
    R: float
    L_d: float
    L_q: float
    psi: float
    u_max: float
    i_max: float
    J_M: float
    J_Z: float
    friction: float
    ratio: float
    stiffness: float
    gap: float
    tick: float
    gain: float = 1.0 / 3.0
    weakening: float = 0.02
    weakening_voltage: float = 0.95
    speed_gain: float | None = None
    integral_gain: float = 0.0
    torque_limit: float = math.inf
    reference: float = 0.0
    load_torque: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    """from these times on"""
    x: list[float] = field(default_factory=lambda: 6 * [0.0])
    """motor angle and speed, load angle and speed, i_d, i_q"""

    def torque(self, i_d: float, i_q: float) -> float:
        return 1.5 * self.p * (self.psi + (self.L_d - self.L_q) * i_d) * i_q

    def rates(self, u: complex, angle: float, M_Z: float):
        """Of the state, under a voltage that stands still in the stator at an electrical angle."""
        p, R, L_d, L_q, psi = self.p, self.R, self.L_d, self.L_q, self.psi
        size, along = abs(u), angle + math.atan2(u.imag, u.real)

        def rates(_: float, x: list[float]) -> list[float]:
            motor, w_M, load, w, i_d, i_q = x
            turned = along - p * motor
            u_d, u_q = size * math.cos(turned), size * math.sin(turned)
            d = motor / self.ratio - load
            T_2 = self.stiffness * (d - min(max(d, -0.5 * self.gap), 0.5 * self.gap))
            w_e = p * w_M
            return [
                w_M,
                (self.torque(i_d, i_q) - T_2 / self.ratio) / self.J_M,
                w,
                (T_2 - self.friction * w - M_Z) / self.J_Z,
                (u_d - R * i_d + w_e * L_q * i_q) / L_d,
                (u_q - R * i_q - w_e * (L_d * i_d + psi)) / L_q,
            ]

        return rates

    def follow(self, x: np.ndarray, t: float, end: float, u: complex, angle: float) -> np.ndarray:
        for begin, M_Z in self.load_torque:
            nexts = [b for b, _ in self.load_torque if b > begin]
            until = min([end, *nexts])
            if until <= t or begin >= end:
                continue
            rates = self.rates(u, angle, M_Z)
            states = steps(rates, t, x, until, math.inf)
            # At the edges of the play the error that a step of order 8 sees is not the one that it makes.
            if self.gap and len({self.flank(state) for state in (x, *states)}) > 1:
                states = steps(rates, t, x, until, self.tick / 64)
            t, x = until, states[-1]
        return x

    def flank(self, x: np.ndarray) -> int:
        """The flank of the play that touches: 1, -1 or none."""
        d = x[0] / self.ratio - x[2]
        return int(d > 0.5 * self.gap) - int(d < -0.5 * self.gap)

    def run(self, ticks: int) -> tuple[np.ndarray, np.ndarray]:
        """States at the ticks, and the voltages that act from there on, in coordinates of the rotor."""
        control = Controller(self)
        x = np.array(self.x)
        p, T = self.p, self.tick
        induced = min(max(p * x[1] * self.psi, -self.u_max), self.u_max)
        pending = complex(0.0, induced), p * (x[0] + 0.5 * x[1] * T)
        states, voltages = [], []
        for k in range(ticks + 1):
            states.append(x)
            acting = pending
            pending = control(x)
            voltages.append(acting[0] * np.exp(1j * (acting[1] - p * x[0])))
            if k < ticks:
                x = self.follow(x, k * T, (k + 1) * T, *acting)
        return np.array(states), np.array(voltages)


class Controller:
    """One sample at a time."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        a = axis
        self.K = [a.gain * a.R / (1.0 - math.exp(-a.R * a.tick / L)) for L in (a.L_d, a.L_q)]
        self.integral = [0.0, 0.0]
        self.speed_integral = 0.0
        self.f = 0.0
        self.beyond = 0.0
        self.wanted = 0j
        self.available = self.most_torque(0.0, a.p * a.x[1])
        self.angle = a.x[0] - a.x[1] * a.tick

    def least_i_d(self) -> float:
        return -min(self.axis.i_max, self.axis.psi / self.axis.L_d)

    def most_i_q(self, i_d: float, w_e: float) -> float:
        a = self.axis
        most = math.sqrt(a.i_max**2 - i_d**2)
        if i_d <= self.least_i_d() and i_d > -a.i_max and w_e != 0.0:
            most = min(most, a.u_max / (abs(w_e) * a.L_q))
        return most

    def most_torque(self, f: float, w_e: float) -> float:
        """The largest on the circle of the current, by a search, with the field weakened from there."""
        a = self.axis
        low, high = -0.5 * math.pi, 0.5 * math.pi
        best = 0.0
        if a.L_d != a.L_q:
            for _ in range(200):
                one, other = low + (high - low) / 3.0, high - (high - low) / 3.0
                if a.torque(a.i_max * math.sin(one), a.i_max * math.cos(one)) < a.torque(
                    a.i_max * math.sin(other), a.i_max * math.cos(other)
                ):
                    low = one
                else:
                    high = other
            # A search by values alone knows the place to half the digits: one step of Newton for the derivative.
            angle = 0.5 * (low + high)
            for _ in range(3):
                s, c, S = math.sin(angle), math.cos(angle), (a.L_d - a.L_q) * a.i_max
                angle -= (S * (c * c - s * s) - a.psi * s) / (-4.0 * S * s * c - a.psi * c)
            best = a.i_max * math.sin(angle)
        i_d = max(best + f, self.least_i_d())
        return abs(a.torque(i_d, self.most_i_q(i_d, w_e)))

    def least_current(self, M: float) -> float:
        """i_d of the least current for a torque, by bisection for i_q."""
        a = self.axis
        if a.L_d == a.L_q or M == 0.0:
            return 0.0
        D = a.psi / (2.0 * (a.L_q - a.L_d))
        i_d = lambda i_q: D - math.copysign(math.sqrt(D * D + i_q * i_q), D)  # noqa: E731
        low, high = 0.0, abs(M) / (1.5 * a.p * a.psi)
        for _ in range(100):
            middle = 0.5 * (low + high)
            if a.torque(i_d(middle), middle) < abs(M):
                low = middle
            else:
                high = middle
        return i_d(0.5 * (low + high))

    def wanted_torque(self, w: float) -> float:
        a = self.axis
        if a.speed_gain is None:
            return a.reference
        most = min(a.torque_limit, self.available)
        v = self.speed_integral
        M = min(max(a.speed_gain * (a.reference - w) + v, -most), most)
        if (M - v) * self.beyond <= 0.0:
            self.speed_integral += a.tick * a.integral_gain / a.speed_gain * (M - v)
        return M

    def speed(self, x: np.ndarray) -> float:
        """Without a speed loop the difference of the angles."""
        difference, self.angle = (x[0] - self.angle) / self.axis.tick, x[0]
        return float(difference if self.axis.speed_gain is None else x[1])

    def __call__(self, x: np.ndarray) -> tuple[complex, float]:
        """The voltage u_d + j u_q, and the electrical angle in the stator that it is meant for."""
        a = self.axis
        w_M = self.speed(x)
        w_e, i_d, i_q = a.p * w_M, x[4], x[5]
        M = self.wanted_torque(w_M)
        w_b = max(abs(w_e), a.u_max / a.psi)
        spare = (a.weakening_voltage * a.u_max) ** 2 - abs(self.wanted) ** 2
        self.f = min(max(self.f + a.weakening * spare / (2.0 * w_b**2 * a.L_d * a.psi), -a.i_max), 0.0)
        self.available = self.most_torque(self.f, w_e)
        M = min(max(M, -self.available), self.available)
        want_d = min(max(self.least_current(M) + self.f, self.least_i_d()), a.i_max)
        most = self.most_i_q(want_d, w_e)
        want_q = min(max(M / (1.5 * a.p * (a.psi + (a.L_d - a.L_q) * want_d)), -most), most)
        e = want_d - i_d, want_q - i_q
        u = complex(
            self.K[0] * e[0] + self.integral[0] - w_e * a.L_q * i_q, self.K[1] * e[1] + self.integral[1] + w_e * (a.L_d * i_d + a.psi)
        )
        self.wanted = u
        limited = u if abs(u) <= a.u_max else a.u_max * u / abs(u)
        self.beyond = math.copysign(1.0, e[1]) if abs(u) > a.u_max else 0.0
        for k, (had, has) in enumerate(((u.real, limited.real), (u.imag, limited.imag))):
            self.integral[k] += a.gain * a.R * (e[k] + (has - had) / self.K[k])
        return limited, a.p * x[0] + 1.5 * w_e * a.tick
