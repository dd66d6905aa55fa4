"""The blocks of controllers, tick by tick: recomputed from docs/control.md alone, with the exact drive by the matrix exponential."""

import itertools
import math
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm

T = 250e-6
J_M, J_L, B_M, B_L, C, RATIO = 4e-4, 3e-3, 2e-3, 4e-3, 90.0, 2.0  # two masses behind a gear without losses
STEPS = 1200  # ticks

A = np.array(
    [[-B_M / J_M, 0.0, -C / (RATIO * J_M), 0.0], [0.0, -B_L / J_L, C / J_L, 0.0], [1.0 / RATIO, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
)
"""of the speeds of motor and load, the twist at the load, the angle of the load; the torque of the motor acts on the first"""
PHI = expm(np.block([[A, np.array([[1.0 / J_M], [0.0], [0.0], [0.0]])], [np.zeros((1, 5))]]) * T)[:4]


def motor_angle(x: np.ndarray) -> float:
    return RATIO * float(x[3] + x[2])


# --- what docs/control.md says of the blocks ---
def read(angle: float, lines: int, error: float = 0.0, periods: int = 0, phase: float = 0.0) -> float:
    """q floor(angle/q + 1/2) + e sin(N angle + psi)"""
    q = 2.0 * math.pi / (4 * lines)
    return q * math.floor(angle / q + 0.5) + error * math.sin(periods * angle + phase)


class Late:
    """What was some samples ago; before the first it is as at the first."""

    def __init__(self, samples: int) -> None:
        self.samples, self.kept = samples, []

    def __call__(self, value: float) -> float:
        self.kept = self.kept or [value] * self.samples
        self.kept.append(value)
        return float(self.kept.pop(0))


class Difference:
    """y += (1 - exp(-T/tau)) ((angle[k] - angle[k-n])/(n T) - y)"""

    def __init__(self, span: int, tau: float) -> None:
        self.late, self.span, self.y = Late(span), span, 0.0
        self.share = 1.0 if tau == 0.0 else 1.0 - math.exp(-T / tau)

    def __call__(self, angle: float, _torque: float) -> float:
        self.y += self.share * ((angle - self.late(angle)) / (self.span * T) - self.y)
        return self.y


class Observer:
    """x_1 += T (x_2 + 2 zeta w_o e) + T^2 M/(2 J), x_2 += T (w_o^2 e + M/J), e = angle - x_1"""

    def __init__(self, w: float, zeta: float, J: float) -> None:
        self.x1, self.x2, self.w, self.zeta, self.J = 0.0, 0.0, w, zeta, J

    def __call__(self, angle: float, torque: float) -> float:
        seen, e = self.x2, angle - self.x1
        self.x1 += T * (self.x2 + 2.0 * self.zeta * self.w * e) + T**2 * torque / (2.0 * self.J)
        self.x2 += T * (self.w**2 * e + torque / self.J)
        return seen


class SpeedLoop:
    """v = I - (k_p - k_t) w + M_ff, M = sat(k_t (w* - w) + v), I += T (k_i/k_t) (M - v), not further into a limit of the voltage"""

    def __init__(self, k_p: float, k_i: float, weight: float = 1.0, limit: float = math.inf) -> None:
        self.k_p, self.k_i, self.k_t, self.limit, self.I = k_p, k_i, weight * k_p, limit, 0.0

    def __call__(self, wanted: float, speed: float, ahead: float = 0.0, beyond: float = 0.0) -> float:
        v = self.I - (self.k_p - self.k_t) * speed + ahead
        M = min(max(self.k_t * (wanted - speed) + v, -self.limit), self.limit)
        self.I += 0.0 if (M - v) * beyond > 0.0 else T * self.k_i / self.k_t * (M - v)
        return M


class PositionLoop:
    """w* = sat(K_v e + I + k_ff rate), I += T k_i e but within the dead zone while the reference stands."""

    def __init__(self, K_v: float, every: int, k_i: float = 0.0, k_ff: float = 0.0, zone: tuple[float, float] = (0.0, 0.0)) -> None:
        self.K_v, self.time, self.k_i, self.k_ff, self.zone = K_v, every * T, k_i, k_ff, zone
        self.I, self.holds, self.held = 0.0, False, 0

    def __call__(self, e: float, rate: float) -> float:
        wanted = self.K_v * e + self.I + self.k_ff * rate
        inner, outer = self.zone
        if rate != 0.0 or abs(e) > outer:
            self.holds = False
        elif abs(e) < inner:
            self.holds = True
        self.held += self.holds
        if not self.holds:
            self.I += self.time * self.k_i * e
        return wanted


def recomputed(control: Callable[[int, np.ndarray], float], load: Callable[[float], float] = lambda _: 0.0) -> np.ndarray:
    """States at the ticks, under a torque of the motor that acts one tick after it was computed; the load jumps at ticks only."""
    pushed = expm(np.block([[A, np.array([[0.0], [-1.0 / J_L], [0.0], [0.0]])], [np.zeros((1, 5))]]) * T)[:4, 4]
    x, acting, out = np.zeros(4), 0.0, []
    for k in range(STEPS + 1):
        out.append(x)
        computed = control(k, x)
        x = PHI[:, :4] @ x + PHI[:, 4] * acting + pushed * load(k * T)
        acting = computed
    return np.array(out)


def simulated(controller: dict[str, Any], torque: Any = None) -> Any:
    """The same by the solver."""
    base: dict[str, Any] = {"sample_time": T, "encoder": {"lines": 256}, "speed": {"gain": 0.05, "integral_gain": 1.0}}
    return lm.simulate(
        lm.Scenario(
            shafts={
                "motor": {"inertia": J_M, "viscous_friction": B_M},
                "load": {"inertia": J_L, "viscous_friction": B_L, "torque": torque},
            },
            motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 1.0}},
            gears={"gear": {"input": "motor", "output": "load", "ratio": RATIO, "stiffness": {"kind": "linear", "stiffness": C}}},
            controllers={"m": base | controller},
            simulation={"duration": STEPS * T, "sample_interval": T},
        ),
        energy=False,
    )


def agree(result: Any, states: np.ndarray, **signals: list[float]) -> None:
    """To rounding, which an encoder's steps and limits do not let grow."""
    for name, wanted in (("motor_speed", states[:, 0]), ("load_speed", states[:, 1]), ("load_angle", states[:, 3])):
        assert result[name].to_numpy() == pytest.approx(wanted, abs=1e-10 * np.abs(wanted).max()), name
    for name, values in signals.items():
        wanted = np.array(values)[:-1]  # the tick at the very end is no part of the run
        assert result[f"m_{name}"].to_numpy()[:-1] == pytest.approx(wanted, abs=1e-10 * np.abs(wanted).max()), name


# --- one block after the other ---
def test_an_encoder_has_steps_an_error_and_a_delay() -> None:
    loop, estimate, late = SpeedLoop(0.05, 1.0), Difference(2, 1e-3), Late(2)
    shown: list[float] = []
    first = read(0.0, 32, 1e-3, 3, 0.4)
    late.kept = [first, first]

    def control(k: int, x: np.ndarray) -> float:
        shown.append(estimate(late(read(motor_angle(x), 32, 1e-3, 3, 0.4)), 0.0))
        return loop(RATIO * 6.0 * math.sin(2.0 * math.pi * 7.0 * k * T), shown[-1])

    states = recomputed(control)
    result = simulated(
        {
            "reference": {"kind": "speed", "amplitude": 6.0, "frequency": 7.0},
            "encoder": {"lines": 32, "error": 1e-3, "error_periods": 3, "error_phase": 0.4, "delay": 2},
            "speed": {"gain": 0.05, "integral_gain": 1.0, "estimate": {"kind": "difference", "span": 2, "time_constant": 1e-3}},
        }
    )
    agree(result, states, measured_speed=shown)
    assert len(set(np.round(states[:, 3], 12))) > 1000


@pytest.mark.parametrize("kind", ["difference", "observer"])
def test_two_encoders_are_blended(kind: str) -> None:
    """By and by the position of the load takes over: phi_M/i + LP(phi_L - phi_M/i), which begins where the drive is."""
    every, tau = 4, 20e-3
    loop, outer = SpeedLoop(0.05, 1.0), PositionLoop(25.0, every, k_ff=0.8)
    estimate: Any = Difference(1, 0.0) if kind == "difference" else Observer(2.0 * math.pi * 80.0, 0.8, 1.15e-3)
    q_L = 2.0 * math.pi / 2**12
    share, w = 1.0 - math.exp(-every * T / tau), 2.0 * math.pi * 4.0
    state = {"low": 0.0, "wanted": 0.0, "torque": 0.0, "position": 0.0}
    shown: dict[str, list[float]] = {"measured_position": [], "measured_speed": [], "torque_reference": []}

    def control(k: int, x: np.ndarray) -> float:
        motor = read(motor_angle(x), 64)
        speed = estimate(motor, state["torque"])
        if k % every == 0:
            load = q_L * math.floor(float(x[3]) / q_L + 0.5)
            state["low"] += share * (load - motor / RATIO - state["low"])
            state["position"] = motor / RATIO + state["low"]
            t = k * T
            state["wanted"] = RATIO * outer(0.4 * math.sin(w * t) - state["position"], 0.4 * w * math.cos(w * t))
        state["torque"] = loop(state["wanted"], speed)
        for name, value in zip(shown, (state["position"], speed, state["torque"]), strict=True):
            shown[name].append(value)
        return state["torque"]

    states = recomputed(control)
    chosen: dict[str, Any] = {"kind": "difference"}
    if kind == "observer":
        chosen = {"kind": "observer", "bandwidth": 80.0, "damping": 0.8, "inertia": 1.15e-3}
    result = simulated(
        {
            "reference": {"kind": "position", "amplitude": 0.4, "frequency": 4.0},
            "encoder": {"lines": 64},
            "position_encoder": {"shaft": "load", "bits": 12},
            "blend_time": tau,
            "position": {"gain": 25.0, "feedforward": 0.8, "sample_time": every * T},
            "speed": {"gain": 0.05, "integral_gain": 1.0, "estimate": chosen},
        }
    )
    agree(result, states, **shown)


def test_backlash_is_crossed_at_its_rate_when_the_reference_turns() -> None:
    """The reference is moved by half the backlash, by the way it goes, no faster than the rate; while it stands the offset stays."""
    gap, rate = 0.02, 0.3
    loop, outer, estimate = SpeedLoop(0.05, 1.0), PositionLoop(25.0, 1), Difference(1, 0.0)
    offsets = [0.0]

    def ramp(t: float) -> tuple[float, float]:
        """Up, rest, down: slopes at 0, 50 ms, 150 ms."""
        if t < 0.05:
            return 2.0 * t, 2.0
        return (0.1, 0.0) if t < 0.15 else (0.1 - 2.0 * (t - 0.15), -2.0)

    def control(k: int, x: np.ndarray) -> float:
        position, speed = ramp(k * T)
        target = 0.5 * gap * np.sign(speed) if speed else offsets[-1]
        offsets.append(offsets[-1] + min(max(target - offsets[-1], -rate * T), rate * T))
        angle = read(motor_angle(x), 256)
        return loop(RATIO * outer(position + offsets[-1] - angle / RATIO, speed), estimate(angle, 0.0))

    states = recomputed(control)
    ramps = [{"begin": 0.0, "duration": 0.05, "rise": 0.1}, {"begin": 0.15, "duration": 0.2, "rise": -0.4}]
    result = simulated(
        {
            "reference": {"kind": "position", "ramps": ramps},
            "position": {"gain": 25.0},
            "feedforward": {"backlash": gap, "backlash_rate": rate},
        }
    )
    agree(result, states)
    assert max(offsets) == pytest.approx(0.5 * gap)
    assert min(offsets) == pytest.approx(-0.5 * gap)


def test_the_integrator_of_the_position_holds_within_its_dead_zone_until_it_is_left() -> None:
    """A step that stands, and a load that pushes the axis out of the zone later and lets it go again."""
    zone = (1.5e-3, 4e-3)
    loop, outer, estimate = SpeedLoop(0.05, 0.5), PositionLoop(25.0, 4, k_i=400.0, zone=zone), Difference(1, 0.0)
    held: list[bool] = []
    state = {"wanted": 0.0}

    def load(t: float) -> float:
        return 0.6 if 0.15 <= t < 0.22 else 0.0

    def control(k: int, x: np.ndarray) -> float:
        angle = read(motor_angle(x), 512)
        if k % 4 == 0:
            state["wanted"] = RATIO * outer(0.05 - angle / RATIO, 0.0)
            held.append(outer.holds)
        return loop(state["wanted"], estimate(angle, 0.0))

    states = recomputed(control, load)
    steps = {"steps": [{"height": 0.6, "time": 0.15}, {"height": -0.6, "time": 0.22}]}
    position = {"gain": 25.0, "integral_gain": 400.0, "sample_time": 4 * T}
    controller = {"reference": {"kind": "position", "mean": 0.05}, "encoder": {"lines": 512}, "speed": {"gain": 0.05, "integral_gain": 0.5}}
    result = simulated(controller | {"position": position | {"dead_zone": list(zone)}}, steps)
    agree(result, states)
    changes = sum(a != b for a, b in itertools.pairwise(held))
    assert changes >= 3  # it held, was pushed out, and held again
    plain = simulated(controller | {"position": position}, steps)
    assert float(abs(plain["load_angle"] - result["load_angle"]).max()) > 1e-4


def test_a_limit_of_the_torque_does_not_wind_up_the_speed_loop() -> None:
    loop, estimate = SpeedLoop(0.02, 0.5, 0.7, 0.3), Difference(1, 0.0)
    shown: list[float] = []

    def control(k: int, x: np.ndarray) -> float:
        ahead = 3e-3 * RATIO * 10.0 + 0.02
        shown.append(loop(RATIO * 10.0, estimate(read(motor_angle(x), 256), 0.0), ahead))
        return shown[-1]

    states = recomputed(control)
    result = simulated(
        {
            "reference": {"kind": "speed", "mean": 10.0},
            "speed": {"gain": 0.02, "integral_gain": 0.5, "reference_weight": 0.7, "torque_limit": 0.3},
            "feedforward": {"inertia": 4e-4, "viscous_friction": 3e-3, "friction_torque": 0.02},
        }
    )
    agree(result, states, torque_reference=shown)
    assert max(shown) == 0.3
    assert min(abs(v) for v in shown) < 0.3


def test_a_limit_of_the_voltage_does_not_wind_up_the_current_loop() -> None:
    """v = K e + I + K_e w, u = sat(v), I += K (1 - a) (e + (u - v)/K); the motor of (2) on an inertia."""
    J, b, M_R, w_R, k_N, tau, g, limit = 8e-4, 3e-3, 0.5, 300.0, 4.0, 1.3e-3, 1.0 / 3.0, 1.2
    a = math.exp(-T / tau)
    K, K_e = g / (k_N * (1.0 - a)), (k_N - 1.0) / (k_N * w_R)
    plant = np.array([[-b / J, 1.0 / J, 0.0], [-(k_N - 1.0) * M_R / (w_R * tau), -1.0 / tau, k_N * M_R / tau], [0.0] * 3])
    phi = expm(plant * T)[:2]
    loop, estimate = SpeedLoop(0.02, 0.4, limit=1.5), Difference(1, 0.0)
    angular = expm(np.block([[plant, np.zeros((3, 1))], [1.0, 0.0, 0.0, 0.0]]) * T)[3]
    x, angle, integral, acting, beyond, speeds, voltages = np.zeros(2), 0.0, 0.0, 0.0, 0.0, [], []
    for _ in range(STEPS + 1):
        speeds.append(x[0])
        w = estimate(read(angle, 256), 0.0)
        e = (loop(150.0, w, beyond=beyond) - x[1]) / M_R
        wanted = K * e + integral + K_e * w
        u = min(max(wanted, -limit), limit)
        integral += K * (1.0 - a) * (e + (u - wanted) / K)
        beyond = float(np.sign(wanted - u))
        voltages.append(u)
        angle += float(angular[:3] @ [*x, acting])
        x, acting = phi[:, :2] @ x + phi[:, 2] * acting, u
    motor = {"shaft": "motor", "rotor_inertia": 0.0, "rated_torque": M_R, "rated_speed": w_R, "rated_voltage": 24.0,
             "electrical_time_constant": tau, "armature_voltage_constant": k_N, "voltage_limit": 24.0 * limit}  # fmt: skip
    result = lm.simulate(
        lm.Scenario(
            shafts={"motor": {"inertia": J, "viscous_friction": b}},
            motors={"m": motor},
            controllers={
                "m": {
                    "sample_time": T,
                    "reference": {"kind": "speed", "mean": 150.0},
                    "encoder": {"lines": 256},
                    "speed": {"gain": 0.02, "integral_gain": 0.4, "torque_limit": 1.5},
                    "current": {"kind": "pi"},
                }
            },
            simulation={"duration": STEPS * T, "sample_interval": T},
        ),
        energy=False,
    )
    assert result["motor_speed"].to_numpy() == pytest.approx(np.array(speeds), abs=1e-9 * max(speeds))
    assert max(voltages) == limit
    assert voltages[-1] < limit


# --- camera and tracker ---
MASK = 2**32 - 1


def philox(counter: list[int], key: int) -> list[int]:
    """Philox 4x32-10 of Salmon et al. (2011)."""
    low, high = key & MASK, key >> 32
    for _ in range(10):
        a, b = 0xD2511F53 * counter[0], 0xCD9E8D57 * counter[2]
        counter = [(b >> 32) ^ counter[1] ^ low, b & MASK, (a >> 32) ^ counter[3] ^ high, a & MASK]
        low, high = (low + 0x9E3779B9) & MASK, (high + 0xBB67AE85) & MASK
    return counter


def test_philox_gives_the_known_answers() -> None:
    """Those that its authors publish with it (Random123, kat_vectors)."""
    assert philox([0] * 4, 0) == [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]
    assert philox([MASK] * 4, 2**64 - 1) == [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]
    pi = [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344]
    assert philox(pi, 0x299F31D0A4093822) == [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1]


def normal(seed: int, name: str, n: int) -> float:
    """Of the counter (n, CRC-32 of the name, 0) and the key seed: sqrt(-2 log u_1) cos(2 pi u_2), 53 bits each."""
    r = philox([n & MASK, n >> 32, zlib.crc32(name.encode()), 0], seed)
    u, v = (((high << 21 | low >> 11) + 0.5) / 2.0**53 for high, low in ((r[0], r[1]), (r[2], r[3])))
    return math.sqrt(-2.0 * math.log(u)) * math.cos(2.0 * math.pi * v)


def test_a_camera_shows_where_the_target_was_and_the_loops_follow_what_the_tracker_expects() -> None:
    frame, late, pixel, parts, sigma, seed, half_field = 12, 20, 3e-3, 2, 4e-3, 12345678901, 0.1
    alpha, beta, gamma, q = 0.6, 0.3, 0.05, 2.0 * math.pi / 2**14
    t_frame, w = frame * T, 2.0 * math.pi * 5.0
    loop, outer, estimate = SpeedLoop(0.05, 1.0), PositionLoop(25.0, 4, k_ff=0.9), Difference(1, 0.0)
    state = {"x": 0.0, "v": 0.0, "a": 0.0, "t": 0.0, "wanted": 0.0, "seen": 0.0, "direction": 0.0, "position": 0.0}
    taken: dict[int, tuple[float, bool]] = {}
    shown: dict[str, list[float]] = {"target_direction": [], "target_seen": [], "position_reference": []}

    def expected(t: float) -> tuple[float, float]:
        h = t - state["t"]
        return state["x"] + h * state["v"] + h * h * state["a"] / 2.0, state["v"] + h * state["a"]

    def control(k: int, x: np.ndarray) -> float:
        motor, sight = read(motor_angle(x), 64), q * math.floor(float(x[3]) / q + 0.5)
        if k % frame == 0:
            offset = 0.3 * math.sin(w * k * T) - float(x[3])
            step = pixel / parts
            noisy = offset + sigma * normal(seed, "m", k // frame)
            taken[k] = (sight + step * math.floor(noisy / step + 0.5), abs(offset) <= half_field)
        if k - late in taken:
            z, seen = taken.pop(k - late)
            state["seen"] = float(seen)
            if seen:
                angle, rate = expected((k - late) * T)
                r = z - angle
                state.update(x=angle + alpha * r, v=rate + beta / t_frame * r, t=(k - late) * T, direction=z)
                state["a"] += gamma / (2.0 * t_frame**2) * r
        speed = estimate(motor, 0.0)
        if k % 4 == 0:
            state["position"], rate = expected(k * T)
            state["wanted"] = RATIO * outer(state["position"] - sight, rate)
        for name, value in zip(shown, (state["direction"], state["seen"], state["position"]), strict=True):
            shown[name].append(value)
        return loop(state["wanted"], speed)

    states = recomputed(control)
    result = simulated(
        {
            "reference": {"kind": "position", "amplitude": 0.3, "frequency": 5.0},
            "encoder": {"lines": 64},
            "position_encoder": {"shaft": "load", "bits": 14},
            "position": {"gain": 25.0, "feedforward": 0.9, "sample_time": 4 * T},
            "camera": {
                "sample_time": t_frame, "latency": late * T, "pixel": pixel, "pixel_parts": parts, "noise": sigma,
                "seed": seed, "field": 2.0 * half_field,
            },
            "tracker": {"alpha": alpha, "beta": beta, "gamma": gamma},
        }
    )  # fmt: skip
    agree(result, states, **shown)
    assert set(shown["target_seen"]) == {0.0, 1.0}
    assert len(set(shown["target_direction"])) > 20
