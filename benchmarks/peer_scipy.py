"""The paper's run by scipy's solve_ivp, with the same contacts written straightforwardly in Python.

Nothing of lostmotion is used but the numbers of the scenario, so this is a third opinion on the physics too.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp


class Peer:
    """2-DOF-NL with state (m_D M_DR, w_M, w, d, phi) and contact modes of the input shaft and the twist."""

    def __init__(self, scenario: Any) -> None:
        m, g, load = scenario.motor, scenario.gearbox, scenario.load
        self.T_10, self.M_DR, self.w_DR = m.friction_torque, m.rated_torque, m.rated_speed
        self.tau, self.k_N = m.electrical_time_constant, m.armature_voltage_constant
        self.J_1, self.b_1, self.i = m.rotor_inertia + g.inertia, g.viscous_friction, g.ratio
        self.J_2, self.b_2 = load.inertia, load.viscous_friction
        self.breaks, self.slopes = g.stiffness.breaks, g.stiffness.slopes
        self.eta_H = g.hysteresis.efficiency
        self.n_1R, self.T_2R = g.rated_input_speed, g.rated_output_torque
        self.speeds, self.loads, self.values = g.losses.speeds, g.losses.loads, g.losses.values
        self.amplitude, self.frequency = scenario.command.amplitude, scenario.command.frequency
        self.input, self.twist, self.h = 0, 0, 0.0

    def spring(self, d: float) -> float:
        torque, begin = 0.0, 0.0
        for k, slope in enumerate(self.slopes):
            end = self.breaks[k] if k < len(self.breaks) else math.inf
            torque += slope * (min(abs(d), end) - begin)
            if abs(d) <= end:
                break
            begin = end
        return math.copysign(torque, d)

    def loss(self, mu: float, v: float) -> float:
        """Linear on triangles, mirrored; the run stays within the table."""
        mu = abs(mu)
        i = min(bisect_right(self.speeds, v) - 1, len(self.speeds) - 2)
        j = min(bisect_right(self.loads, mu) - 1, len(self.loads) - 2)
        s = (v - self.speeds[i]) / (self.speeds[i + 1] - self.speeds[i])
        r = (mu - self.loads[j]) / (self.loads[j + 1] - self.loads[j])
        a, b = self.values[j][i], self.values[j + 1][i + 1]
        if r > s:
            corner = self.values[j + 1][i]
            return a + (corner - a) * r + (b - corner) * s
        corner = self.values[j][i + 1]
        return a + (corner - a) * s + (b - corner) * r

    def input_acceleration(self, M_D: float, w_M: float, T_2: float) -> float:
        if self.input == 0:
            return 0.0
        s = self.input
        lost = self.T_10 + self.T_2R / self.i * self.loss(s * T_2 / self.T_2R, max(0.0, s * w_M) / self.n_1R)
        return (M_D - self.b_1 * w_M - s * lost - T_2 / self.i) / self.J_1

    def load_acceleration(self, w: float, T_2: float) -> float:
        return (T_2 - self.b_2 * w) / self.J_2

    def output_torque(self, M_D: float, w_M: float, w: float, d: float) -> float:
        """P + H; stuck, the torque that keeps the twist, by secants (the map makes it piecewise linear)."""
        P = self.spring(d)
        if self.twist != 0:
            return P + self.twist * self.h

        def apart(T: float) -> float:
            return self.input_acceleration(M_D, w_M, T) / self.i - self.load_acceleration(w, T)

        a, b = P, P + 0.1
        f_a, f_b = apart(a), apart(b)
        for _ in range(50):
            if f_a == f_b or abs(f_b) < 1e-14 * (1.0 + abs(f_a)):
                break
            a, f_a, b = b, f_b, b - f_b * (b - a) / (f_b - f_a)
            f_b = apart(b)
        return b

    def rates(self, t: float, x: np.ndarray) -> list[float]:
        M_D, w_M, w, d, _ = x.tolist()
        if self.input == 0:
            w_M = 0.0
        if self.twist == 0:
            w = w_M / self.i
        T_2 = self.output_torque(M_D, w_M, w, d)
        E = self.amplitude * math.sin(2.0 * math.pi * self.frequency * t)
        dM_D = self.M_DR / self.tau * (self.k_N * E - (self.k_N - 1.0) * w_M / self.w_DR - M_D / self.M_DR)
        a_1 = self.input_acceleration(M_D, w_M, T_2)
        a_2 = a_1 / self.i if self.twist == 0 else self.load_acceleration(w, T_2)
        return [dM_D, a_1, a_2, 0.0 if self.twist == 0 else w_M / self.i - w, w]

    # Guards: positive while the mode holds.
    def held(self, x: np.ndarray) -> tuple[float, float]:
        M_D, w_M, w, d, _ = x.tolist()
        T_2 = self.output_torque(M_D, w_M, w, d)
        held = M_D - T_2 / self.i
        up = self.T_10 + self.T_2R / self.i * self.loss(T_2 / self.T_2R, 0.0)
        return up - held, up + held  # the map is mirrored: both capacities are the same

    def guards(self) -> list[Any]:
        found = []
        if self.input != 0:
            s = self.input
            found.append(lambda t, x: s * x[1])
        else:
            found.append(lambda t, x: min(self.held(x)))
        if self.twist != 0:
            q = self.twist
            found.append(lambda t, x: q * (x[1] / self.i - x[2]))
        elif self.input != 0 or self.h > 0.0:
            found.append(lambda t, x: self.h - abs(self.output_torque(*x[:4].tolist()) - self.spring(x[3])))
        for guard in found:
            guard.terminal, guard.direction = True, -1
        return found

    def choose(self, t: float, x: np.ndarray, input_at_rest: bool, twist_at_rest: bool) -> None:
        """First of the modes, most stuck first, whose reactions and accelerations are consistent just after t."""
        ahead = 1e-9
        inputs = (0, 1, -1) if input_at_rest else (int(math.copysign(1, x[1])),)
        twists = (0, 1, -1) if twist_at_rest else (int(math.copysign(1, x[1] / self.i - x[2])),)
        modes = sorted(((a, b) for a in inputs for b in twists), key=lambda m: abs(m[0]) + abs(m[1]))
        for slack in (1e-12, 1e-9, 1e-7, 1e-5):  # the state carries the integrator's error
            for self.input, self.twist in modes:
                y = x + ahead * np.array(self.rates(t, x))
                y = y + 0.5 * ahead * (np.array(self.rates(t + ahead, y)) - np.array(self.rates(t, x)))
                ok = True
                if self.input == 0:
                    ok &= min(self.held(y)) >= -slack
                elif input_at_rest:
                    ok &= self.input * y[1] >= -slack
                if self.twist == 0:
                    ok &= abs(self.output_torque(*y[:4].tolist()) - self.spring(y[3])) <= self.h + slack * self.T_2R
                elif twist_at_rest:
                    ok &= self.twist * (y[1] / self.i - y[2]) >= -slack
                if ok:
                    return
        raise RuntimeError(f"no consistent mode at t = {t}")

    def run(self, duration: float, times: np.ndarray, method: str, rtol: float) -> np.ndarray:
        """States at the times, shape (len(times), 5)."""
        x, t = np.zeros(5), 0.0
        out = np.zeros((len(times), 5))
        self.h = 0.0
        self.choose(t, x, True, True)
        atol = rtol * np.array([0.5, 300.0, 3.0, 3e-3, 1.0]) * 1e-2
        while t < duration:
            guards = self.guards()
            done = solve_ivp(
                self.rates,
                (t, duration),
                x,
                method,
                events=guards,
                rtol=rtol,
                atol=atol,
                dense_output=True,
                max_step=0.05,
            )
            inside = (times >= t) & (times <= done.t[-1])
            out[inside] = done.sol(times[inside]).T
            x = done.y[:, -1].copy()
            fired = [len(e) > 0 for e in done.t_events]
            if not any(fired):
                break
            t = done.t[-1]
            input_at_rest, twist_at_rest = self.input == 0, self.twist == 0
            if fired[0] and self.input != 0:
                input_at_rest, x[1] = True, 0.0
            if len(fired) > 1 and fired[1] and self.twist != 0:
                twist_at_rest = True
                self.h = 0.5 * (1.0 - self.eta_H) * abs(self.spring(x[3]))
                x[2] = x[1] / self.i
            self.choose(t, x, input_at_rest, twist_at_rest)
        return out
