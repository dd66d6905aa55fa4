"""Limits of current, torque, speed and voltage: no integrator runs further into one, and every limit that a file states acts or is refused.

Axes run up at the limit and turn around, against the closed form of a motor whose torque ends at its torque-speed line.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from refusals import refused

KINDS = ["ideal", "first_order", "pi", "field_oriented"]
MODES = ["torque", "speed", "position"]
PAIRS = 3.0  # pole pairs


@dataclass(frozen=True)
class Line:
    """A motor on an inertia, whose torque is at most `stall` - `droop` times the speed, and of the magnitude `most`."""

    stall: float
    droop: float
    most: float
    inertia: float

    @property
    def no_load(self) -> float:
        return self.stall / self.droop

    @property
    def time(self) -> float:
        return self.inertia / self.droop

    def forward(self, w: float, t: float) -> float:
        """Speed after the time t under the largest torque forward: first constant, then along the line towards no load."""
        bend = (self.stall - self.most) / self.droop
        if w < bend:
            t1 = (bend - w) * self.inertia / self.most
            if t <= t1:
                return w + self.most * t / self.inertia
            w, t = bend, t - t1
        return self.no_load + (w - self.no_load) * math.exp(-t / self.time)

    def backward(self, w: float, t: float) -> float:
        return -self.forward(-w, t)


def motor(line: Line, kind: str, tau: float) -> dict[str, Any]:
    """With this torque-speed line at the voltage that it states."""
    if kind != "field_oriented":
        k_N = 2.5
        M_R = line.stall / k_N
        return {
            "shaft": "rotor", "rotor_inertia": line.inertia, "rated_torque": M_R, "rated_speed": M_R * (k_N - 1.0) / line.droop,
            "rated_voltage": 24.0, "voltage_limit": 24.0, "armature_voltage_constant": k_N, "electrical_time_constant": tau, "kind": "dc",
        }  # fmt: skip
    u = 48.0 / math.sqrt(3.0)
    psi = u / (PAIRS * line.no_load)
    R = 1.5 * PAIRS * psi * u / line.stall
    winding = {"pole_pairs": PAIRS, "resistance_phase": R, "inductance_phase": R * tau, "flux_linkage": psi}
    winding["max_current_peak"] = 10.0 * u / R
    return {
        "shaft": "rotor", "kind": "synchronous", "rotor_inertia": line.inertia, "rated_torque": 0.4 * line.stall,
        "dc_voltage": 48.0, "winding": winding,
    }  # fmt: skip


def axis(line: Line, kind: str, mode: str, T: float, tau: float, turn: float, end: float, way: float, **changes: Any) -> dict[str, Any]:
    """A scenario that asks for far more than there is, and from the time `turn` on for the opposite."""
    limited = line.most if math.isfinite(line.most) else 20.0 * line.stall
    far = {"torque": limited, "speed": 2.0 * line.no_load, "position": 50.0 * line.no_load * end}[mode] * way
    controller: dict[str, Any] = {
        "sample_time": T,
        "reference": {"kind": mode, "mean": far, "steps": [{"time": turn, "height": -2.0 * far}]},
        "current": {"kind": kind} | ({"time_constant": tau} if kind == "first_order" else {}),
        "encoder": {"ideal": True},
    }
    if kind == "field_oriented":
        controller["current"]["field_weakening"] = 0.0
    if mode != "torque":
        controller["speed"] = {"gain": 20.0 * line.droop, "integral_time": 0.05 * line.time}
        if math.isfinite(line.most):
            controller["speed"]["torque_limit"] = line.most
    if mode == "position":
        controller["position"] = {"gain": 2.0 / line.time, "integral_gain": 10.0 / line.time**2}
    return {
        "shafts": {"rotor": {"inertia": 0.0}},
        "motors": {"m": motor(line, kind, tau)},
        "controllers": {"m": controller | changes},
        "simulation": {"duration": end, "sample_interval": T},
    }


def random_axis(rng: np.random.Generator, kind: str, mode: str) -> tuple[Line, float, float, float, float]:
    """The motor, sample time, electrical time constant, and the times of turning and end."""
    T = math.exp(rng.uniform(math.log(62.5e-6), math.log(2e-3)))
    tau = T * math.exp(rng.uniform(math.log(0.1), math.log(8.0)))
    stall, no_load = math.exp(rng.uniform(-2.0, 4.0)), math.exp(rng.uniform(1.0, 6.0))
    if kind == "field_oriented":  # so slow that the decoupling takes no voltage that counts
        no_load = 0.02 / (PAIRS * max(T, tau))
    time = rng.uniform(300.0, 600.0) * max(T, tau)
    most = stall * rng.uniform(0.2, 1.5) if mode == "torque" or rng.random() < 0.5 else math.inf
    line = Line(stall, stall / no_load, most, time * stall / no_load)
    turn = rng.uniform(1.0, 3.0) * time
    return line, T, tau, turn, turn + rng.uniform(0.5, 1.5) * time


def lag(T: float, tau: float) -> float:
    """By which the torque comes later than that of the closed form: samples of the loops, and the current at the voltage limit."""
    return 8.0 * T + 2.5 * tau


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", KINDS)
def test_axes_turn_around_after_a_run_up_at_the_limit(kind: str, mode: str) -> None:
    """Random axes in both directions, with and without a limit of the torque beside that of the voltage."""
    rng = np.random.default_rng(1000 * KINDS.index(kind) + MODES.index(mode))
    for n in range(some(20, 8)):
        line, T, tau, turn, end = random_axis(rng, kind, mode)
        way = 1.0 if n % 2 else -1.0
        run = lm.simulate(lm.Scenario(**axis(line, kind, mode, T, tau, turn, end, way)), energy=False)
        t, w = run["time"].to_numpy(), way * run["rotor_speed"].to_numpy()
        top = line.forward(0.0, turn)
        wanted = np.array([line.forward(0.0, s) if s < turn else line.backward(top, s - turn) for s in t])
        largest = min(line.most, 2.0 * line.stall)
        error = np.abs(w - wanted).max() * line.inertia / largest  # as a time under the largest torque
        assert error < lag(T, tau), (n, line, T, tau, error / T, error / tau)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_reversed_torque_reference_is_followed_after_a_run_up_at_the_voltage_limit(way: float) -> None:
    """40 (1 - w/30) N·m at 24 V, 0.32 kg·m²: 23.7 N·m forward, from 0.4 s on 23.7 N·m backward, which need less than 10 V."""
    line = Line(40.0, 40.0 / 30.0, 23.7, 0.32)
    run = lm.simulate(lm.Scenario(**axis(line, "pi", "torque", 5e-4, 1e-4, 0.4, 1.0, way)))
    assert float(run["m_torque"].sel(time=0.5, method="nearest")) == pytest.approx(-23.7 * way, rel=1e-6)
    assert float(run["rotor_speed"][-1]) == pytest.approx(way * line.backward(line.forward(0.0, 0.4), 0.6), abs=0.2)
    assert line.backward(line.forward(0.0, 0.4), 0.6) == pytest.approx(-19.2, abs=0.05)


@pytest.mark.parametrize("within", ["speed", "torque", "voltage"])
@pytest.mark.parametrize("kind", KINDS)
def test_no_integrator_of_a_position_winds_up_on_random_axes(kind: str, within: str) -> None:
    """Sample times over a range of 32, time constants over one of 80, both ways: the speed reference turns around with the reference."""
    rng = np.random.default_rng(100 + 10 * KINDS.index(kind) + len(within))
    for n in range(some(10, 6)):
        line, T, tau, turn, _ = random_axis(rng, kind, "position")
        line = replace(line, most=0.3 * line.stall if within == "torque" else math.inf)
        at, way = round(turn / T), 1.0 if n % 2 else -1.0
        scenario = axis(line, kind, "position", T, tau, at * T, (at + 20) * T, way)
        if within == "speed":
            scenario["controllers"]["m"]["position"]["speed_limit"] = 0.2 * line.no_load
        run = lm.simulate(lm.Scenario(**scenario), energy=False)
        reference = way * run["m_speed_reference"].to_numpy()
        assert reference[at - 1] > 0.0, (n, line, T, tau)
        assert reference[at + 2] < 0.0, (n, line, T, tau)


@pytest.mark.parametrize("kind", KINDS)
def test_observers_stay_right_at_limits_on_random_axes(kind: str) -> None:
    """Up and back at the limit: the torque of the observer is late by samples and time constants, and by nothing else.

    With the torque of the reference the speed of such an observer would err by 2 zeta (M* - M)/(J w_o), 70 of the larger
    of the two times under the torque of standstill.
    """
    rng = np.random.default_rng(200 + KINDS.index(kind))
    for n in range(some(20, 8)):
        line, T, tau, turn, end = random_axis(rng, kind, "torque")
        line = replace(line, most=line.stall)
        scenario = axis(line, kind, "speed", T, tau, turn, end, 1.0 if n % 2 else -1.0)
        observer = {"kind": "observer", "bandwidth": 0.02 / max(T, tau), "inertia": line.inertia}
        scenario["controllers"]["m"]["speed"]["estimate"] = observer
        run = lm.simulate(lm.Scenario(**scenario), energy=False)
        error = np.abs(run["m_measured_speed"] - run["rotor_speed"]).to_numpy().max()
        assert error * line.inertia / line.stall < lag(T, tau), (n, line, T, tau)


def test_what_an_inverse_model_adapts_does_not_wind_up_at_a_limit() -> None:
    """The speed that a limited torque fails to reach says nothing of the friction, whose estimate stays as it was."""
    scenario = {
        "shafts": {"rotor": {"inertia": 0.0}, "load": {"inertia": 0.01}},
        "motors": {"m": motor(Line(2.0, 0.02, math.inf, 0.004), "ideal", 1e-3)},
        "gears": {
            "gear": {
                "input": "rotor", "output": "load", "ratio": 2.0, "stiffness": {"kind": "linear", "stiffness": 2000.0},
                "losses": {"kind": "constant_efficiency", "efficiency": 1.0}, "rated_input_speed": 100.0, "rated_output_torque": 4.0,
            }
        },
        "controllers": {
            "m": {
                "sample_time": 5e-4, "encoder": {"ideal": True},
                "reference": {"kind": "speed", "mean": 100.0, "steps": [{"time": 0.5, "height": -200.0}]},
                "speed": {"gain": 0.1, "torque_limit": 0.5},
                "inverse_model": {"friction_torque": 0.1, "friction_adaptation": {"rate": 1.0, "limits": [0.0, 1.0]}},
            }
        },
        "simulation": {"duration": 1.0, "sample_interval": 1e-3},
    }  # fmt: skip
    run = lm.simulate(lm.Scenario(**scenario))
    assert np.abs(np.abs(run["m_torque_reference"].to_numpy()[1:]) - 0.5).max() == 0.0
    estimate = run["m_model_friction_torque"].to_numpy()
    assert np.abs(estimate - 0.1).max() == 0.0


# --- continuous controllers ---
def continuous(line: Line, controller: dict[str, Any], turn: float, end: float, **more: Any) -> Any:
    """A run of an inertia whose torque source such a controller commands."""
    source = {"shaft": "rotor", "kind": "torque_source", "rotor_inertia": line.inertia, "rated_torque": 0.7}
    return lm.Scenario(
        shafts={"rotor": {"inertia": 0.0}},
        motors={"m": source | more},
        controllers={"m": {"kind": "continuous"} | controller},
        simulation={"duration": end, "sample_interval": end / 1000.0},
    )


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("mode", ["position", "speed"])
def test_continuous_controllers_do_not_wind_up(mode: str, way: float) -> None:
    """Constant torque both ways: a triangle of the speed, on random axes, without any anti_windup_time given."""
    rng = np.random.default_rng(5)
    for _ in range(some(30, 10)):
        J, limit = math.exp(rng.uniform(-7.0, 2.0)), math.exp(rng.uniform(-3.0, 3.0))
        turn = rng.uniform(0.2, 2.0)
        far = 100.0 * way * limit / J * turn * (turn if mode == "position" else 1.0)
        gains = {"gain": rng.uniform(0.5, 2.0) * limit / abs(far) * 30.0}
        gains["integral_gain"] = gains["gain"] * rng.uniform(0.3, 30.0) / turn
        reference = {"kind": mode, "mean": far, "steps": [{"time": turn, "height": -2.0 * far}]}
        scenario = continuous(Line(math.inf, 1.0, limit, J), {"limit": limit, "reference": reference, mode: gains}, turn, 2.5 * turn)
        run = lm.simulate(scenario, energy=False)
        t = run["time"].to_numpy()
        wanted = way * limit / J * np.where(t < turn, t, 2.0 * turn - t)
        assert np.abs(run["rotor_speed"].to_numpy() - wanted).max() < 1e-9 * limit / J * turn


def test_state_space_without_decay_behind_a_limit_says_how_it_keeps_from_winding_up() -> None:
    law = {"A": [[0.0]], "B": [[1.0]], "C": [1.0], "D": [0.5]}
    controller = {"limit": 1.0, "reference": {"kind": "speed", "mean": 1.0}, "state_space": law}
    refused(lambda: continuous(Line(1.0, 1.0, 1.0, 0.1), controller, 1.0, 1.0), "controllers.m.state_space")
    controller["state_space"] = law | {"back_calculation": [2.0]}
    continuous(Line(1.0, 1.0, 1.0, 0.1), controller, 1.0, 1.0)
    pure = {"limit": 1.0, "reference": {"kind": "speed", "mean": 1.0}, "speed": {"integral_gain": 2.0}}
    refused(lambda: continuous(Line(1.0, 1.0, 1.0, 0.1), pure, 1.0, 1.0), "controllers.m.anti_windup_time")


# --- every stated limit under every mode ---
LINE = Line(2.0, 0.02, math.inf, 0.004)
T, TAU = 2.5e-4, 2e-4
HELD = 3.0 * max(T, TAU) / LINE.time
"""share of the torque at standstill by which a torque may be above the line: of the tick before, or of an inductance"""
SOURCE = {"shaft": "rotor", "kind": "torque_source", "rotor_inertia": 0.004, "rated_torque": 0.7}


def run_up(kind: str, mode: str, **more: Any) -> Any:
    """Far forward under a limit, with other values of the motor."""
    scenario = axis(LINE, kind, mode, T, TAU, 0.5, 0.9, 1.0)
    scenario["motors"]["m"] |= more
    return scenario


def seen(scenario: dict[str, Any]) -> Any:
    return lm.simulate(lm.Scenario(**scenario), energy=False)


def largest(run: Any, name: str) -> float:
    return float(np.abs(run[name].to_numpy()).max())


def voltage_share(run: Any) -> np.ndarray:
    """Voltage that torque and speed need in the steady state, to the largest."""
    return np.asarray((run["m_torque"] + LINE.droop * run["rotor_speed"]).to_numpy() / LINE.stall)


LIMITED = [("speed loop", kind, mode) for kind in KINDS for mode in MODES[1:]]
LIMITED += [("torque source", kind, mode) for kind in KINDS[:2] for mode in MODES]
LIMITED += [("current", kind, mode) for kind in KINDS for mode in MODES]


@pytest.mark.parametrize(("limited", "kind", "mode"), LIMITED)
def test_a_limit_of_torque_or_current_acts(limited: str, kind: str, mode: str) -> None:
    scenario = run_up(kind, mode)
    if limited == "speed loop":
        scenario["controllers"]["m"]["speed"]["torque_limit"] = 0.5
    elif limited == "torque source":
        scenario["motors"]["m"] = SOURCE | {"torque_limit": 0.5}
    else:
        scenario["motors"]["m"] = motor(LINE, "field_oriented", TAU)
        winding = scenario["motors"]["m"]["winding"]
        winding["max_current_peak"] = 0.5 / (1.5 * PAIRS * winding["flux_linkage"])
    run = seen(scenario)
    if limited == "current":
        assert largest(run, "m_torque_reference") <= (0.5 + 1e-12 if mode != "torque" or kind != "field_oriented" else math.inf)
    else:
        assert largest(run, "m_torque_reference") == 0.5
    top = 0.5 + 1e-12 if limited == "torque source" else 0.5 * 28.0 / 27.0 + 0.02
    assert (0.48 if limited == "current" else 0.49) < largest(run, "m_torque") < top


@pytest.mark.parametrize("kind", KINDS)
def test_a_limit_of_the_speed_acts(kind: str) -> None:
    scenario = run_up(kind, "position")
    scenario["controllers"]["m"]["position"]["speed_limit"] = 40.0
    run = seen(scenario)
    assert largest(run, "m_speed_reference") == 40.0
    assert 39.0 < largest(run, "rotor_speed") < 60.0


@pytest.mark.parametrize("source", ["dc", "synchronous", "torque_source"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", MODES)
def test_a_limit_of_the_voltage_acts(kind: str, mode: str, source: str) -> None:
    scenario = run_up(kind, mode)
    if source != "dc":
        scenario["motors"]["m"] = motor(LINE, "field_oriented", TAU) | {"kind": source}
    impossible = {("field_oriented", "dc"), ("field_oriented", "torque_source"), ("pi", "torque_source")}
    if (kind, source) in impossible:
        if source == "dc":
            scenario["motors"]["m"] = motor(LINE, "pi", TAU)
        refused(lambda: lm.Scenario(**scenario), match=f'controllers.m.current.kind: "{kind}" needs a motor')
        return
    run = seen(scenario)
    share = voltage_share(run)
    assert 0.99 < share.max() < 1.0 + HELD
    assert -1.0 - 2.0 * HELD < share.min() < -0.99
    if kind == "pi":
        assert largest(run, "m_command") == 1.0
    if kind == "field_oriented":
        u = np.hypot(run["m_direct_voltage"], run["m_quadrature_voltage"]).to_numpy()
        assert u.max() < 48.0 / math.sqrt(3.0) * (1.0 + 1e-9)


def controlled(kind: str = "ideal", **more: Any) -> dict[str, Any]:
    """A continuous controller of the speed, far beyond what there is."""
    current = {"kind": kind} | ({"time_constant": TAU} if kind == "first_order" else {})
    return {"reference": {"kind": "speed", "mean": 200.0}, "speed": {"gain": 0.2, "integral_gain": 1.0}, "current": current} | more


@pytest.mark.parametrize("kind", ["ideal", "first_order"])
def test_limits_of_torque_and_current_act_under_continuous_controllers(kind: str) -> None:
    winding = {k: v for k, v in motor(LINE, "field_oriented", TAU)["winding"].items() if k != "max_current_peak"}
    winding["max_current_peak"] = 0.5 / (1.5 * PAIRS * winding["flux_linkage"])
    for own, of_motor in (({"limit": 0.5}, {}), ({}, {"torque_limit": 0.5}), ({}, {"winding": winding})):
        run = lm.simulate(continuous(LINE, controlled(kind, **own), 0.5, 0.5, **of_motor))
        assert 0.49 < largest(run, "m_torque") < 0.5 + 1e-9


@pytest.mark.parametrize("kind", ["ideal", "first_order"])
def test_continuous_controllers_refuse_a_limit_of_the_voltage_that_they_would_not_keep(kind: str) -> None:
    winding = motor(LINE, "field_oriented", TAU)
    for of_motor, key in (
        (motor(LINE, "pi", TAU), "voltage_limit"),
        (winding, "dc_voltage"),
        (winding | {"kind": "torque_source"}, "dc_voltage"),
    ):
        message = rf"controllers.m.current.kind: .* {key} "
        assert len(refused(lambda m=of_motor: continuous(LINE, controlled(kind, limit=0.5), 0.5, 0.5, **m), match=message)) <= 200
    limited = controlled(kind, position={"gain": 1.0, "speed_limit": 1.0})
    refused(lambda: continuous(LINE, limited, 0.5, 0.5), "controllers.m.position.speed_limit")


@pytest.mark.parametrize("source", ["dc", "synchronous"])
def test_a_limit_of_the_voltage_acts_under_continuous_controllers_of_the_voltage(source: str) -> None:
    """A run-up at the limit and a turn, by the two linear equations of motor and inertia."""
    law = {"A": [[0.0]], "B": [[1.0]], "C": [1.0], "D": [0.05], "back_calculation": [20.0]}
    reference = {"kind": "speed", "mean": 300.0, "steps": [{"time": 0.5, "height": -600.0}]}
    controller = {"reference": reference, "state_space": law, "current": {"kind": "voltage"}}
    of_motor = motor(LINE, "pi" if source == "dc" else "field_oriented", TAU)
    run = lm.simulate(continuous(LINE, controller, 0.5, 0.9, **of_motor))
    t, w = run["time"].to_numpy(), run["rotor_speed"].to_numpy()
    top = LINE.forward(0.0, 0.5)
    wanted = np.array([LINE.forward(0.0, s) if s < 0.5 else LINE.backward(top, s - 0.5) for s in t])
    assert np.abs(w - wanted).max() * LINE.inertia / (2.0 * LINE.stall) < 1.5 * TAU


def test_limits_act_on_laws_of_your_own() -> None:
    """On a torque the line of the motor, on the voltages of a winding the circle."""
    scenario = run_up("ideal", "torque")
    scenario["controllers"]["m"] |= {"law": True}
    run = lm.simulate(lm.Scenario(**scenario), law=lambda time, *_: 50.0 if time < 0.5 else -50.0)
    share = voltage_share(run)
    assert 0.99 < share.max() < 1.0 + HELD
    assert -1.0 - 2.0 * HELD < share.min() < -0.99
    scenario = run_up("field_oriented", "torque")
    scenario["controllers"]["m"] |= {"law": True}
    run = lm.simulate(lm.Scenario(**scenario), law=lambda *_: (30.0, 40.0))
    u = np.hypot(run["m_direct_voltage"], run["m_quadrature_voltage"]).to_numpy()
    assert u.max() == pytest.approx(48.0 / math.sqrt(3.0), rel=1e-9)


def test_ratings_are_no_limits_of_a_run() -> None:
    """What motor.limits states is compared by the drive check alone, as its description says."""
    scenario = run_up("pi", "speed")
    plain = seen(scenario)
    scenario["motors"]["m"]["limits"] = {"max_speed": 1.0, "max_current": 0.1, "torque_constant": 0.1, "continuous_torque": 0.1}
    assert largest(seen(scenario), "rotor_speed") == largest(plain, "rotor_speed")


@pytest.mark.parametrize("kind", ["ideal", "pi"])
def test_the_short_form_keeps_to_the_same_line(kind: str) -> None:
    line = Line(40.0, 40.0 / 30.0, 23.7, 0.32)
    reference = {"kind": "torque", "mean": 23.7, "steps": [{"time": 0.4, "height": -47.4}]}
    rigid = {"stiffness": {"kind": "rigid"}, "losses": {"kind": "constant_efficiency", "efficiency": 1.0}}
    of_motor = {k: v for k, v in motor(line, "pi", 1e-4).items() if k != "shaft"} | {"rotor_inertia": 0.02}
    scenario = lm.Scenario(
        motor=of_motor,
        gearbox={"ratio": 1, "rated_input_speed": 15, "rated_output_torque": 20, **rigid},
        load={"inertia": 0.3},
        controller={"sample_time": "0.5 ms", "current": {"kind": kind}, "reference": reference},
        simulation={"duration": 1, "sample_interval": 1e-3},
    )
    run = lm.simulate(scenario)
    assert float(run["motor_speed"][-1]) == pytest.approx(line.backward(line.forward(0.0, 0.4), 0.6), abs=0.2)
