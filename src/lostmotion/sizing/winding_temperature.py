"""Winding and case of a motor as two bodies: their temperatures under a copper loss that follows the torque.

    C_w dT_w/dt = P - (T_w - T_c)/R_wc,                     C_w = tau_w/R_wc
    C_c dT_c/dt = (T_w - T_c)/R_wc - (T_c - T_a)/R_ca,      C_c = tau_m/R_ca
    P = p M² (1 + alpha (T_w - T_r))

with p M² the copper loss at the temperature T_r. Over each interval M² is replaced by its mean: the energy is exact, and each step
is the exact solution of a linear system.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..model.motor import Motor

COPPER = 0.00393  # relative rise of a winding's resistance [1/K]
ROUNDING = 1e-18  # of a term over the first, from which on it is left out
SERIES = 0.1  # below it the divided difference of the exponential loses digits, and its series does not


@dataclass(frozen=True)
class TwoBodies:
    """Winding and case."""

    winding_case: float  # R_wc [K/W]
    case_ambient: float  # R_ca [K/W]
    winding_time: float  # tau_w [s], of the winding against a case of constant temperature
    case_time: float  # tau_m [s], of the case against the ambient
    loss: float  # p [W/(N·m)²]
    reference: float  # T_r [°C]
    ambient: float  # T_a [°C]
    alpha: float = COPPER  # [1/K]

    @classmethod
    def of(cls, motor: Motor, ambient: float, alpha: float = COPPER) -> TwoBodies | None:
        """Bodies of a motor; None if its data do not suffice (`needed` names the missing ones)."""
        if needed(motor):
            return None
        limits, copper = motor.limits, motor.copper_loss()
        assert limits is not None
        assert limits.thermal_parts is not None
        assert limits.thermal_time_constant_winding is not None
        assert limits.thermal_time_constant_motor is not None
        assert copper is not None
        times = limits.thermal_time_constant_winding, limits.thermal_time_constant_motor
        return cls(*limits.thermal_parts, *times, *copper, ambient, alpha)

    def equations(self, square: Any, case_heat: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Matrix A and vector b of x' = A x + b for x = (T_w, T_c) - T_a, by the mean of M² [(N·m)²] and further heat in the case [W]."""
        heat = np.asarray(self.loss * square)
        C_w, C_c = self.winding_time / self.winding_case, self.case_time / self.case_ambient
        A, b = np.empty((*heat.shape, 2, 2)), np.empty((*heat.shape, 2))
        A[..., 0, 0] = (self.alpha * heat - 1.0 / self.winding_case) / C_w
        A[..., 0, 1], A[..., 1, 0] = 1.0 / (self.winding_case * C_w), 1.0 / (self.winding_case * C_c)
        A[..., 1, 1] = -(1.0 / self.winding_case + 1.0 / self.case_ambient) / C_c
        b[..., 0] = heat * (1.0 + self.alpha * (self.ambient - self.reference)) / C_w
        b[..., 1] = case_heat / C_c
        return A, b

    def steps(self, time: np.ndarray, square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Map x -> F x + g of the temperatures x = (T_w, T_c) - T_a for each interval between instants [s]. F (n, 2,
        2) and g (n, 2) follow from the mean of M² over the interval [(N·m)²]."""
        return self.response(np.diff(time), square)

    def response(self, h: np.ndarray, square: Any, case_heat: Any = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Map of the same kind over the durations h [s], with further heat in the case [W]."""
        A, b = self.equations(np.broadcast_to(square, h.shape), case_heat)
        # The eigenvalues are real, since a12 a21 > 0; q(A) of a function q is q(l_1) + q[l_1, l_2] (A - l_1).
        a11, a22 = A[:, 0, 0], A[:, 1, 1]
        middle, half = 0.5 * (a11 + a22), np.sqrt((0.5 * (a11 - a22)) ** 2 + A[:, 0, 1] * A[:, 1, 0])
        l_1, l_2 = middle + half, middle - half
        unit = np.eye(2)
        slope, integral = _divided(l_1, l_2, h), _integral(l_1, h)
        whole = integral[:, None, None] * unit + slope[:, None, None] * (A - l_1[:, None, None] * unit)
        return unit + A @ whole, whole[:, :, 0] * b[:, :1] + whole[:, :, 1] * b[:, 1:]

    def course(self, time: np.ndarray, square: np.ndarray, start: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Temperatures of winding and case [°C] at the instants, from those at the first."""
        return self._follow(*_from_start(*self.steps(time, square)), np.subtract(start, self.ambient))

    def repeated(self, time: np.ndarray, square: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """The same, of a cycle that has been repeated for ever.

        x = F x + g over the whole cycle, solved for x. None if the heat that grows with the temperature has no end.
        """
        F, g = _from_start(*self.steps(time, square))
        if max(abs(np.linalg.eigvals(F[-1]))) >= 1.0:
            return None
        return self._follow(F, g, np.linalg.solve(np.eye(2) - F[-1], g[-1]))

    def _follow(self, F: np.ndarray, g: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        every = self.ambient + np.vstack([x, F @ x + g])
        return every[:, 0], every[:, 1]

    def error_bound(self, lead: float, hottest: float) -> float:
        """Error bound of the temperatures at the ends of intervals [K], where the heat of each is spread evenly.

        lead: largest integral from the start of an interval of M² less its mean [(N·m)² s].
        hottest: highest temperature of the winding [°C].

        Notes
        -----
        With the heat e(t) by which the even course is behind, and the response K of a body to one joule, the error is the integral
        of K de = -e dK, since e is 0 at the ends of intervals. K of the winding is at most 1/C_w and falls; K of the case rises to
        less than that and falls.
        """
        factor = 1.0 + self.alpha * max(hottest - self.reference, 0.0)
        return float(2.0 * factor * self.loss * lead * self.winding_case / self.winding_time)


def needed(motor: Motor) -> list[str]:
    """Keys of `[motor]` that the two bodies need and the motor lacks."""
    keys = (
        "thermal_resistance_winding_case",
        "thermal_resistance_case_ambient",
        "thermal_time_constant_winding",
        "thermal_time_constant_motor",
    )
    lacking = [f"limits.{key}" for key in keys if getattr(motor.limits, key, None) is None]
    if motor.copper_loss() is None:
        lacking += ["limits.resistance", "limits.torque_constant"]
    return lacking


def steady_rise(heat: float, resistance: float, ambient: float, reference: float) -> float:
    """Rise of a winding over the ambient [K] under a constant current, whose heat is `heat` [W] at the reference temperature.

    dT = R_th P (1 + alpha (T_a + dT - T_r)); infinite if the heat grows faster than it is carried off.
    """
    cold = resistance * heat
    if cold * COPPER >= 1.0:
        return math.inf
    return cold * (1.0 + COPPER * (ambient - reference)) / (1.0 - COPPER * cold)


def mean_square(torque: np.ndarray) -> np.ndarray:
    """Mean of M² over each interval between samples, M being straight there."""
    a, b = torque[:-1], torque[1:]
    return np.asarray((a * a + a * b + b * b) / 3.0)


def rms(time: np.ndarray, torque: np.ndarray) -> float:
    """Root mean square over the time [N·m]."""
    return float(np.sqrt(np.sum(mean_square(torque) * np.diff(time)) / (time[-1] - time[0])))


def _from_start(F: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Maps from the start to the end of each of the steps x -> F x + g: within blocks first, all of them side by side."""
    n = len(F)
    size = math.isqrt(n - 1) + 1
    blocks = -(-n // size)
    P, q = np.empty((blocks, size, 2, 2)), np.zeros((blocks, size, 2))
    P[:] = np.eye(2)
    P.reshape(-1, 2, 2)[:n], q.reshape(-1, 2)[:n] = F, g
    for k in range(1, size):
        q[:, k] += (P[:, k] @ q[:, k - 1, :, None])[:, :, 0]
        P[:, k] = P[:, k] @ P[:, k - 1]
    for k in range(1, blocks):
        q[k] += P[k] @ q[k - 1, -1]
        P[k] = P[k] @ P[k - 1, -1]
    return P.reshape(-1, 2, 2)[:n], q.reshape(-1, 2)[:n]


def _integral(rate: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Integral of e^(rate s) from 0 to h."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(rate == 0.0, h, np.expm1(rate * h) / rate)


def _divided(l_1: np.ndarray, l_2: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Divided difference of `_integral` over two rates."""
    plain = (_integral(l_1, h) - _integral(l_2, h)) / (l_1 - l_2)
    reach = np.maximum(np.abs(l_1), np.abs(l_2)) * h
    near = reach < SERIES
    series, power, total, last = np.zeros_like(h), h * h / 2.0, np.ones_like(h), np.ones_like(h)
    most = float(reach[near].max(initial=0.0))
    for k in range(2, 12):
        series += power * total  # h^k/k! times the sum of l_1^i l_2^j with i + j = k - 2
        if most ** (k - 1) < ROUNDING:
            break
        power, last = power * h / (k + 1.0), last * l_2
        total = total * l_1 + last
    return np.where(near, series, plain)


def need_two_bodies(motor: Motor, ambient: float, alpha: float, where: str) -> TwoBodies:
    """Bodies as `TwoBodies.of` returns them; an error if data are missing.

    Raises InputError: with the keys that lack.
    """
    bodies = TwoBodies.of(motor, ambient, alpha)
    if bodies is None:
        keys = ", ".join(f"{where}.{key}" for key in needed(motor))
        raise InputError(f"temperatures: the motor lacks {keys}; data sheets print them, give them")
    return bodies
