"""Sampled controllers on published axes, against solutions that know nothing of the solver."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm

# --- EMPS: Janot, Gautier, Brunot (2019), one linear axis ---
EMPS = {"M": 95.1089, "F_v": 203.5034, "F_c": 20.3935, "offset": -3.1648, "g_tau": 35.15065, "k_p": 160.18, "k_v": 243.45}
MOVES = {"kind": "position", "speed": 0.15, "acceleration": 1.5, "dwell": 0.25, "moves": [{"to": 0.2}, {"to": 0.0}]}
VOLTS = 10.0


def emps(resolution: float) -> lm.Scenario:
    p = EMPS
    encoder: dict[str, Any] = {"resolution": resolution} if resolution else {"ideal": True}
    return lm.Scenario(
        slides={"axis": {"mass": p["M"], "viscous_friction": p["F_v"], "friction_force": p["F_c"], "force": p["offset"]}},
        linear_motors={"m": {"slide": "axis", "rated_force": 1.0}},
        controllers={"m": {
            "sample_time": 1e-3, "reference": MOVES, "encoder": encoder,
            "position": {"gain": p["k_p"], "reference_delay": 1e-3},
            "speed": {"gain": p["k_v"] * p["g_tau"], "torque_limit": VOLTS * p["g_tau"], "estimate": {"kind": "difference", "span": 2}},
        }},
        simulation={"duration": 4.0, "sample_interval": 1e-3},
    )  # fmt: skip


class CoulombMass:
    """M v' = u - F_v v - F_c sgn v - offset with sticking, under a constant u: piecewise in closed form."""

    def __init__(self) -> None:
        self.q, self.v, self.stops = 0.0, 0.0, 0

    def advance(self, u: float, T: float) -> None:
        M, F_v, F_c = EMPS["M"], EMPS["F_v"], EMPS["F_c"]
        force, tau, left = u - EMPS["offset"], M / F_v, T
        while left > 0.0:
            if self.v == 0.0 and abs(force) <= F_c:
                return
            way = math.copysign(1.0, self.v if self.v != 0.0 else force)
            final = (force - way * F_c) / F_v
            rests = -math.inf if self.v == 0.0 or final * way >= 0.0 else math.log1p(-self.v / final) * tau
            t = rests if 0.0 < rests < left else left
            self.q += final * t + (self.v - final) * tau * -math.expm1(-t / tau)
            if t == rests:
                self.v, self.stops = 0.0, self.stops + 1
            else:
                self.v = final + (self.v - final) * math.exp(-t / tau)
            left -= t


def test_the_emps_axis_in_closed_loop_is_that_of_its_closed_form() -> None:
    """Also its standstills: the axis comes to rest four times and sticks for a second in all."""
    axis = emps(0.0)
    result = lm.simulate(axis)
    T, p = 1e-3, EMPS
    wanted = lm.PositionReference(**MOVES).at(np.maximum(0.0, np.arange(-1, 4000) * T))[0].tolist()
    body, pending, read = CoulombMass(), 0.0, [0.0, 0.0]
    q, v, u = [], [], []
    for k in range(4001):
        q.append(body.q)
        v.append(body.v)
        speed = (body.q - read[-2]) / (2.0 * T)
        read.append(body.q)
        volts = p["k_v"] * (p["k_p"] * (wanted[k] - body.q) - speed)
        u.append(max(-VOLTS, min(VOLTS, volts)))
        body.advance(pending * p["g_tau"], T)
        pending = u[-1]
    assert body.stops >= 2
    assert max(map(abs, u)) > 3.0  # the axis works
    assert np.abs(result["axis_position"].to_numpy() - q).max() < 1e-9 * 0.2
    assert np.abs(result["axis_speed"].to_numpy() - v).max() < 1e-9 * 0.15
    assert np.abs(result["m_torque_reference"].to_numpy() - p["g_tau"] * np.array(u)).max() < 1e-9 * VOLTS * p["g_tau"]
    energy = lm.energy_of(result)
    assert abs(energy["residual"]) <= 1e-9 * energy["turned_over"]


# --- Test rig of DTU and Siemens: Papageorgiou (2017), two motors on a shaft with backlash and static friction ---
RIG = {"J": 8.31e-4, "K": 32.94, "D": 0.0548, "T_C": (0.0223, 0.0232), "T_S": (0.0441, 0.0453), "gap": 0.0016, "limit": 13.0}
RIG_T, RIG_TICKS = 125e-6, 2000
# Identical damping of both pole pairs of the two-mass drive, R = 1, with 0.4.
W_A = math.sqrt(RIG["K"] / RIG["J"])
GAIN, INTEGRAL = 2.0 * 0.4 * RIG["J"] * W_A * math.sqrt(5.0 - 4.0 * 0.4**2), RIG["K"]
WANTED = {"kind": "speed", "sines": [{"amplitude": 6.0, "frequency": 12.0}]}


def rig() -> lm.Scenario:
    p = RIG
    shafts = {
        name: {"inertia": p["J"], "friction_torque": p["T_C"][k], "breakaway_torque": p["T_S"][k]}
        for k, name in enumerate(("motor", "load"))
    }
    return lm.Scenario(
        shafts=shafts,
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": p["limit"]}},
        gears={"coupling": {
            "input": "motor", "output": "load", "ratio": 1.0, "mesh_damping": p["D"],
            "stiffness": {"kind": "curve", "backlash": p["gap"], "slopes": [p["K"]]},
        }},
        controllers={"m": {
            "sample_time": RIG_T, "reference": WANTED, "encoder": {"ideal": True},
            "speed": {"gain": GAIN, "integral_gain": INTEGRAL, "torque_limit": p["limit"],
                      "estimate": {"kind": "difference", "time_constant": 5e-4}},
        }},
        simulation={"duration": RIG_TICKS * RIG_T, "sample_interval": RIG_T},
    )  # fmt: skip


class Rig:
    """Both inertias and the gap under a constant torque, by scipy with an event for each change of mode."""

    def __init__(self) -> None:
        self.y = np.zeros(4)  # w_M, w_L, twist, angle of the motor
        self.side = 0.0  # of the gap whose flanks press
        self.changes = 0

    def pressed(self, y: np.ndarray, side: float) -> float:
        return RIG["K"] * (side * y[2] - 0.5 * RIG["gap"]) + RIG["D"] * side * (y[0] - y[1])

    def nets(self, y: np.ndarray, u: float) -> tuple[float, float]:
        torque = self.side * self.pressed(y, self.side) if self.side else 0.0
        return u - torque, torque

    def advance(self, u: float, T: float) -> None:
        t, broken, calls = 0.0, dict[int, float](), 0
        while t < T:
            ways = []
            for k, net in enumerate(self.nets(self.y, u)):
                slips = math.copysign(1.0, self.y[k]) if self.y[k] else math.copysign(1.0, net)
                rests = self.y[k] == 0.0 and abs(net) <= RIG["T_S"][k]
                ways.append(broken.get(k, 0.0 if rests else slips))
            t, broken = self.until_a_change(t, T, u, ways)
            calls += 1
            assert calls < 20

    def events(self, u: float, ways: list[float]) -> list[Any]:
        half, found = 0.5 * RIG["gap"], list[Any]()

        def add(what: Any, direction: float) -> None:
            def event(_: float, y: np.ndarray) -> float:
                return float(what(y))

            event.direction, event.terminal = direction, True  # type: ignore[attr-defined]
            found.append(event)

        for k, way in enumerate(ways):
            if way:
                add(lambda y, k=k: y[k], -way)
            else:
                add(lambda y, k=k: abs(self.nets(y, u)[k]) - RIG["T_S"][k], 1.0)
        if self.side:
            add(lambda y: self.pressed(y, self.side), -1.0)
            return found
        for side in (1.0, -1.0):  # parted flanks may press again beyond the gap, or come back into it
            add(lambda y, side=side: side * y[2] - half, 0.0 if side * self.y[2] > half else 1.0)
            add(lambda y, side=side: self.pressed(y, side) if side * y[2] > half else -1.0, 1.0)
        return found

    def until_a_change(self, t: float, T: float, u: float, ways: list[float]) -> tuple[float, dict[int, float]]:
        def rates(_: float, y: np.ndarray) -> list[float]:
            both = zip(self.nets(y, u), ways, RIG["T_C"], strict=True)
            w = [(net - way * T_C) / RIG["J"] if way else 0.0 for net, way, T_C in both]
            return [*w, y[0] - y[1], y[0]]

        s = solve_ivp(rates, (t, T), self.y, "DOP853", rtol=1e-11, atol=1e-15, events=self.events(u, ways))
        self.y = s.y[:, -1].copy()
        broken, half = dict[int, float](), 0.5 * RIG["gap"]
        for k, found in enumerate(s.t_events or []):
            if not len(found):
                continue
            self.changes += 1
            if k < 2 and ways[k]:
                self.y[k] = 0.0
            elif k < 2:
                broken[k] = math.copysign(1.0, self.nets(self.y, u)[k])
            elif self.side:
                self.side = 0.0
            else:
                side = math.copysign(1.0, self.y[2])
                if k in (2, 4):
                    self.y[2] = side * half
                self.side = side if self.pressed(self.y, side) > 0.0 or k in (3, 5) else 0.0
        return float(s.t[-1]), broken


def test_the_rig_with_backlash_and_static_friction_is_that_of_scipy() -> None:
    result = lm.simulate(rig(), energy=False)
    body, pending, before, estimate, integral = Rig(), 0.0, 0.0, 0.0, 0.0
    wanted = lm.control.SpeedReference(**WANTED).at(RIG_T * np.arange(RIG_TICKS + 1))[0].tolist()
    smoothing = -math.expm1(-RIG_T / 5e-4)
    states = []
    for k in range(RIG_TICKS + 1):
        states.append(body.y.copy())
        estimate += smoothing * ((body.y[3] - before) / RIG_T - estimate)
        before = body.y[3]
        torque = GAIN * (wanted[k] - estimate) + integral
        integral += RIG_T * INTEGRAL / GAIN * (torque - integral)
        body.advance(pending, RIG_T)
        pending = torque
    expected = np.array(states).T
    assert body.changes > 20
    for k, name in enumerate(("motor_speed", "load_speed", "coupling_twist")):
        scale = np.abs(expected[k]).max()
        assert np.abs(result[name].to_numpy() - expected[k]).max() < 1e-8 * scale, name


def test_the_rig_is_the_same_by_the_adaptive_solver() -> None:
    exact = lm.simulate(rig(), energy=False)
    adaptive = lm.simulate(rig(), solver="dormand-prince", relative_tolerance=1e-12)
    for name in ("motor_speed", "load_speed", "coupling_twist", "m_torque_reference"):
        scale = np.abs(exact[name].to_numpy()).max()
        assert np.abs(exact[name].to_numpy() - adaptive[name].to_numpy()).max() < 1e-8 * scale, name


# --- motulator's two-mass example: its mechanics, its speed controller, its delay ---
def test_two_masses_under_motulators_speed_controller_are_those_of_motulator() -> None:
    """Its equations and its controller as they are; its own integration (relative tolerance 1e-3) is replaced by a tight one."""
    pytest.importorskip("motulator")
    from motulator.common.control import PIController
    from motulator.common.model._simulation import Delay
    from motulator.drive.model import TwoMassMechanicalSystem
    from motulator.drive.utils import TwoMassMechanicalSystemPars

    J_M, J_L, K, C, T, ticks, limit, load = 0.005, 0.005, 700.0, 0.01, 250e-6, 400, 14.0, 5.0
    bandwidth = 2.0 * math.pi * 10.0
    k_p, k_i = 2.0 * bandwidth * (J_M + J_L), bandwidth**2 * (J_M + J_L)
    axis = lm.Scenario(
        shafts={"motor": {"inertia": J_M}, "load": {"inertia": J_L, "torque": load}},
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": limit}},
        gears={"coupling": {"input": "motor", "output": "load", "ratio": 1.0, "mesh_damping": C,
                            "stiffness": {"kind": "linear", "stiffness": K}}},
        controllers={"m": {
            "sample_time": T, "reference": {"kind": "speed", "mean": 30.0}, "encoder": {"ideal": True},
            "speed": {"gain": k_p, "integral_gain": k_i, "reference_weight": 0.5, "torque_limit": limit, "estimate": {"kind": "exact"}},
        }},
        simulation={"duration": ticks * T, "sample_interval": T},
    )  # fmt: skip
    result = lm.simulate(axis, energy=False)
    mechanics = TwoMassMechanicalSystem(TwoMassMechanicalSystemPars(J_M=J_M, J_L=J_L, K_S=K, C_S=C), tau_L=lambda t: load)
    controller, delay = PIController(k_p, k_i, k_t=0.5 * k_p, max_u=limit), Delay(1, elem=1)

    def rates(t: float, y: np.ndarray) -> list[float]:
        mechanics.state.w_M, mechanics.state.w_L, mechanics.state.theta_ML = y
        mechanics.set_outputs(t)
        w_M, _, w_L, twist = mechanics.rhs()
        return [w_M, w_L, twist]

    y, states, limited = np.zeros(3), [], 0
    for _ in range(ticks + 1):
        states.append(y)
        torque = float(controller.output(30.0, y[0]))
        controller.update(T, torque)
        limited += abs(torque) == limit
        mechanics.inp.tau_M = float(np.ravel(delay([torque]))[0])
        y = solve_ivp(rates, (0.0, T), y, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    assert 20 < limited < ticks  # the integrator is held while the torque is limited
    for k, name in enumerate(("motor_speed", "load_speed", "coupling_twist")):
        expected = np.array(states)[:, k]
        assert np.abs(result[name].to_numpy() - expected).max() < 1e-9 * np.abs(expected).max(), name
