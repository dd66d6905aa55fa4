"""The 2-DOF-NL drive with its contacts, written straightforwardly in Python for the peers that integrate it.

Nothing of lostmotion is used but the numbers of the scenario, so this is a third opinion on the physics too. The functions of
the right-hand side can be compiled by numba.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


def numbers_of(scenario: Any, convert: Callable[[Any], Any]) -> tuple[Any, ...]:
    """All that the right-hand side needs; tables as lists for Python, as arrays for numba."""
    m, g, load, losses = scenario.motor, scenario.gearbox, scenario.load, scenario.gearbox.losses
    return (
        *(m.friction_torque, m.rated_torque, m.rated_speed, m.electrical_time_constant, m.armature_voltage_constant),
        *(m.rotor_inertia + g.inertia, g.viscous_friction, g.ratio, load.inertia, load.viscous_friction),
        *(g.rated_input_speed, g.rated_output_torque, scenario.command.amplitude, scenario.command.frequency),
        *(convert(x) for x in (g.stiffness.breaks, g.stiffness.slopes, losses.speeds, losses.loads, losses.values)),
    )


class Functions(NamedTuple):
    spring: Callable[..., float]
    loss: Callable[..., float]
    output_torque: Callable[..., float]
    rates: Callable[..., tuple[float, ...]]


def make_functions(p: tuple[Any, ...], jit: Callable[[Any], Any], interval: Callable[..., int]) -> Functions:
    """x = (m_D M_DR, w_M, w, d, phi); `shaft` and `gear` are the modes of the input shaft and of the twist."""
    # By name, not as a whole: so numba takes them as constants.
    T_10, M_DR, w_DR, tau, k_N, J_1, b_1, ratio, J_2, b_2, n_1R, T_2R, amplitude, frequency = p[:14]
    breaks, slopes, speeds, loads, values = p[14:]

    @jit
    def spring(d):
        torque, begin = 0.0, 0.0
        for k in range(len(slopes)):
            end = breaks[k] if k < len(breaks) else math.inf
            torque += slopes[k] * (min(abs(d), end) - begin)
            if abs(d) <= end:
                break
            begin = end
        return math.copysign(torque, d)

    @jit
    def loss(mu, v):
        """Linear on triangles, mirrored; the run stays within the table."""
        mu = abs(mu)
        i, j = interval(speeds, v), interval(loads, mu)
        s = (v - speeds[i]) / (speeds[i + 1] - speeds[i])
        r = (mu - loads[j]) / (loads[j + 1] - loads[j])
        a, b = values[j][i], values[j + 1][i + 1]
        if r > s:
            corner = values[j + 1][i]
            return a + (corner - a) * r + (b - corner) * s
        corner = values[j][i + 1]
        return a + (corner - a) * s + (b - corner) * r

    @jit
    def input_acceleration(shaft, M_D, w_M, T_2):
        if shaft == 0:
            return 0.0
        lost = T_10 + T_2R / ratio * loss(shaft * T_2 / T_2R, max(0.0, shaft * w_M) / n_1R)
        return (M_D - b_1 * w_M - shaft * lost - T_2 / ratio) / J_1

    @jit
    def apart(shaft, M_D, w_M, w, T_2):
        return input_acceleration(shaft, M_D, w_M, T_2) / ratio - (T_2 - b_2 * w) / J_2

    @jit
    def output_torque(shaft, gear, h, M_D, w_M, w, d):
        """P + H; stuck, the torque that keeps the twist, by secants (the map makes it piecewise linear)."""
        P = spring(d)
        if gear != 0:
            return P + gear * h
        a, b = P, P + 0.1
        f_a, f_b = apart(shaft, M_D, w_M, w, a), apart(shaft, M_D, w_M, w, b)
        for _ in range(50):
            if f_a == f_b or abs(f_b) < 1e-14 * (1.0 + abs(f_a)):
                break
            next_b = b - f_b * (b - a) / (f_b - f_a)
            a, f_a, b = b, f_b, next_b
            f_b = apart(shaft, M_D, w_M, w, b)
        return b

    @jit
    def rates(shaft, gear, h, t, x):
        M_D, w_M, w, d = x[0], x[1], x[2], x[3]
        if shaft == 0:
            w_M = 0.0
        if gear == 0:
            w = w_M / ratio
        T_2 = output_torque(shaft, gear, h, M_D, w_M, w, d)
        E = amplitude * math.sin(2.0 * math.pi * frequency * t)
        dM_D = M_DR / tau * (k_N * E - (k_N - 1.0) * w_M / w_DR - M_D / M_DR)
        a_1 = input_acceleration(shaft, M_D, w_M, T_2)
        a_2 = a_1 / ratio if gear == 0 else (T_2 - b_2 * w) / J_2
        return dM_D, a_1, a_2, 0.0 if gear == 0 else w_M / ratio - w, w

    return Functions(spring, loss, output_torque, rates)


def in_python(scenario: Any) -> Functions:
    return make_functions(
        numbers_of(scenario, list), lambda f: f, lambda edges, x: min(bisect_right(edges, x) - 1, len(edges) - 2)
    )


def by_numba(scenario: Any) -> Functions:
    from numba import njit

    @njit
    def interval(edges, x):
        k = 0
        while k < len(edges) - 2 and edges[k + 1] <= x:
            k += 1
        return k

    return make_functions(numbers_of(scenario, lambda x: np.array(x, dtype=float)), njit, interval)


class ContactDrive:
    """Right-hand side in the present modes, guards that are positive while these hold, and the choice of the next."""

    def __init__(self, scenario: Any, *, compiled: bool = False) -> None:
        self.f = by_numba(scenario) if compiled else in_python(scenario)
        g = scenario.gearbox
        self.T_10, self.T_2R, self.ratio = scenario.motor.friction_torque, g.rated_output_torque, g.ratio
        self.compiled = compiled
        self.eta_H = g.hysteresis.efficiency
        self.rest()

    def rest(self) -> None:
        """The modes in which a run from rest begins."""
        self.shaft, self.gear, self.h = 0, 0, 0.0
        self.choose(0.0, np.zeros(5), input_at_rest=True, twist_at_rest=True)

    def rates(self, t: float, x: np.ndarray) -> tuple[float, ...]:
        return self.f.rates(self.shaft, self.gear, self.h, t, x if self.compiled else x.tolist())

    def output_torque(self, x: np.ndarray) -> float:
        return self.f.output_torque(self.shaft, self.gear, self.h, *x[:4].tolist())

    def input_guard(self, x: np.ndarray) -> float:
        if self.shaft != 0:
            return self.shaft * float(x[1])
        T_2 = self.output_torque(x)
        held = float(x[0]) - T_2 / self.ratio
        # The map is mirrored: both capacities are the same.
        return self.T_10 + self.T_2R / self.ratio * self.f.loss(T_2 / self.T_2R, 0.0) - abs(held)

    def twist_guard(self, x: np.ndarray) -> float:
        if self.gear != 0:
            return self.gear * (float(x[1]) / self.ratio - float(x[2]))
        if self.shaft == 0 and self.h == 0.0:
            return 1.0  # all stands, and nothing has wound up the gear yet
        return self.h - abs(self.output_torque(x) - self.f.spring(float(x[3])))

    def switch(self, t: float, x: np.ndarray, *, input_fired: bool, twist_fired: bool) -> np.ndarray:
        """Goes over to the modes that follow; the state with what is at rest set to rest."""
        x = x.copy()
        input_at_rest, twist_at_rest = self.shaft == 0, self.gear == 0
        if input_fired and self.shaft != 0:
            input_at_rest, x[1] = True, 0.0
        if twist_fired and self.gear != 0:
            twist_at_rest = True
            self.h = 0.5 * (1.0 - self.eta_H) * abs(self.f.spring(float(x[3])))
            x[2] = x[1] / self.ratio
        self.choose(t, x, input_at_rest=input_at_rest, twist_at_rest=twist_at_rest)
        return x

    def choose(self, t: float, x: np.ndarray, *, input_at_rest: bool, twist_at_rest: bool) -> None:
        """First of the modes, most stuck first, whose reactions and accelerations are consistent just after t."""
        ahead = 1e-9
        inputs = (0, 1, -1) if input_at_rest else (int(math.copysign(1, x[1])),)
        twists = (0, 1, -1) if twist_at_rest else (int(math.copysign(1, x[1] / self.ratio - x[2])),)
        modes = sorted(((a, b) for a in inputs for b in twists), key=lambda m: abs(m[0]) + abs(m[1]))
        for slack in (1e-12, 1e-9, 1e-7, 1e-5):  # the state carries the integrator's error
            for self.shaft, self.gear in modes:
                y = x + ahead * np.array(self.rates(t, x))
                y = y + 0.5 * ahead * (np.array(self.rates(t + ahead, y)) - np.array(self.rates(t, x)))
                ok = True
                if self.shaft == 0:
                    ok &= self.input_guard(y) >= -slack
                elif input_at_rest:
                    ok &= self.shaft * y[1] >= -slack
                if self.gear == 0:
                    gap = self.h - abs(self.output_torque(y) - self.f.spring(float(y[3])))
                    ok &= gap >= -slack * self.T_2R
                elif twist_at_rest:
                    ok &= self.gear * (y[1] / self.ratio - y[2]) >= -slack
                if ok:
                    return
        raise RuntimeError(f"no consistent mode at t = {t}")


def tolerances(rtol: float) -> np.ndarray:
    """Absolute ones of the five states, in parts of their sizes in the paper's run."""
    return rtol * np.array([0.5, 300.0, 3.0, 3e-3, 1.0]) * 1e-2
