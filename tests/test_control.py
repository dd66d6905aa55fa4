"""Sampled controllers: closed forms, independent recursions, published axes, and what must not change a run."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm
from two_mass import A, B, T, two_mass


def scenario(**tables: Any) -> lm.Scenario:
    return lm.Scenario(**tables)


def torque_source(**changes: Any) -> dict[str, Any]:
    return {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 1.0} | changes


# --- closed forms ---


def test_the_current_loop_overshoots_by_one_part_in_27() -> None:
    """g/(z (z - 1)) with g = 1/3 closed: c[k+2] = c[k+1] - (c[k] - r)/3, whose largest value is 28/27."""
    axis = scenario(
        shafts={"motor": {"inertia": 1e6}},  # stands
        motors={"m": {"shaft": "motor", "rotor_inertia": 0.0, "rated_torque": 0.5, "rated_speed": 300.0,
                      "electrical_time_constant": 1.3e-3, "armature_voltage_constant": 4.0}},
        controllers={"m": {"sample_time": T, "reference": {"kind": "torque", "mean": 0.5}, "current": {"kind": "pi"}}},
        simulation={"duration": 40 * T, "sample_interval": T},
    )  # fmt: skip
    torque = lm.simulate(axis)["m_torque"].to_numpy() / 0.5
    expected = [0.0, 0.0]
    while len(expected) < 41:
        expected.append(expected[-1] - (expected[-2] - 1.0) / 3.0)
    assert torque == pytest.approx(np.array(expected), abs=1e-9)
    assert torque.max() == pytest.approx(28.0 / 27.0, abs=1e-9)


def oscillation(gain: float, kind: str, ticks: int) -> np.ndarray:
    """Speed over ticks of a rigid drive at its first speed 1, under a proportional loop of `gain` J/T to speed 0."""
    J = 3e-4
    axis = scenario(
        shafts={"motor": {}},
        motors={"m": {"shaft": "motor", "rotor_inertia": J, "rated_torque": 0.5, "rated_speed": 300.0,
                      "electrical_time_constant": 1.3e-3, "armature_voltage_constant": 4.0}},
        controllers={"m": {
            "sample_time": T, "reference": {"kind": "speed"}, "encoder": {"ideal": True},
            "speed": {"gain": gain * J / T, "estimate": {"kind": kind}}, "current": {"kind": "ideal"},
        }},
        initial={"speeds": {"motor": 1.0}},
        simulation={"duration": ticks * T, "sample_interval": T},
    )  # fmt: skip
    return lm.simulate(axis, energy=False)["motor_speed"].to_numpy()[:ticks]


LIMITS = [("difference", 2.0 * (math.sqrt(2.0) - 1.0), 8), ("exact", 1.0, 6)]


@pytest.mark.parametrize(("kind", "limit", "period"), LIMITS)
def test_stability_ends_at_the_gain_and_the_frequency_of_theory(kind: str, limit: float, period: int) -> None:
    """w[k+2] = w[k+1] - K m[k], m the mean of w[k] and w[k-1] with the difference, w[k] with the true speed."""
    window = 100 * period
    at_limit = oscillation(limit, kind, 4 * window)
    assert at_limit[-window:] == pytest.approx(at_limit[window : 2 * window], abs=1e-9)
    spectrum = np.abs(np.fft.rfft(at_limit[-window:]))
    assert int(spectrum.argmax()) == window // period  # f_s/8, f_s/6
    for gain, grows in ((0.999 * limit, False), (1.001 * limit, True)):
        speed = oscillation(gain, kind, 4 * window)
        early, late = (float(np.sqrt(np.mean(part**2))) for part in (speed[:window], speed[-window:]))
        assert (late > early) == grows
        share = [0.0, 1.0] if kind == "exact" else [0.5, 0.5]  # of w[k-1] and w[k]
        z = np.abs(np.roots([1.0, -1.0, gain * share[1], gain * share[0]])).max()
        assert late / early == pytest.approx(z ** (3 * window), rel=0.01)


def test_a_linear_two_mass_drive_under_a_sampled_pi_is_the_linear_recursion() -> None:
    k_p, k_i, weight, share = 1.1, 45.0, 0.6, 1.0
    estimate = {"kind": "difference", "time_constant": 2e-4}
    axis = two_mass({"gain": k_p, "integral_gain": k_i, "reference_weight": weight, "estimate": estimate})
    axis = axis.replace(**{"simulation.duration": 400 * T})
    result = lm.simulate(axis)
    # Plant: w_M, w, twist, phi_M under a torque held for T.
    phi = expm(np.block([[A, B], [np.zeros((1, 5))]]) * T)
    x, integral, estimate, before, pending = np.zeros(4), 0.0, 0.0, 0.0, 0.0
    k_t, smoothing = weight * k_p, -math.expm1(-T / 2e-4) * share
    speeds = []
    for _ in range(401):
        speeds.append(x[:2].copy())
        estimate += smoothing * ((x[3] - before) / T - estimate)
        before = x[3]
        v = integral - (k_p - k_t) * estimate
        torque = k_t * (3.0 - estimate) + v
        integral += T * k_i / k_t * (torque - v)
        x, pending = phi[:4, :4] @ x + phi[:4, 4] * pending, torque
    expected = np.array(speeds).T
    scale = np.abs(expected).max()
    assert np.abs(result["motor_speed"].to_numpy() - expected[0]).max() < 1e-12 * scale
    assert np.abs(result["load_speed"].to_numpy() - expected[1]).max() < 1e-12 * scale


# --- step by step ---


@pytest.fixture
def axis() -> lm.Scenario:
    s = lm.load("position-axis", {"simulation.duration": 0.4})
    assert isinstance(s, lm.Scenario)
    return s


def test_steps_of_any_length_lead_where_the_run_leads(axis: lm.Scenario) -> None:
    run = lm.simulate(axis)
    rng = np.random.default_rng(5)
    simulation = lm.Simulation(axis)
    at = np.unique(np.concatenate([rng.uniform(0.0, 0.4, 150), np.arange(1, 40) * 1e-2, np.arange(1, 200) * T]))
    for begin, end in zip([0.0, *at[:-1]], at, strict=True):
        simulation.advance(end - begin)
    simulation.advance(0.4 - at[-1])
    for name in ("motor_speed", "load_speed", "twist", "load_angle"):
        scale = float(np.abs(run[name]).max())
        assert simulation[name] == pytest.approx(float(run[name][-1]), abs=1e-9 * scale)


def test_a_state_within_a_tick_continues_bit_for_bit(axis: lm.Scenario) -> None:
    one = lm.Simulation(axis)
    one.advance(0.1)
    one.advance(0.4 * T)
    state = one.state
    for _ in range(300):
        one.advance(0.7 * T)
    other = lm.Simulation(axis)
    other.state = state
    for _ in range(300):
        other.advance(0.7 * T)
    assert one.read() == other.read()
    assert one.state.values == other.state.values


def test_a_law_of_your_own_that_is_the_loop_moves_the_drive_as_the_loop_does() -> None:
    tables: dict[str, Any] = {
        "shafts": {"motor": {"inertia": 2e-3}, "load": {"inertia": 5e-3}},
        "motors": {"m": torque_source(rated_torque=2.0)},
        "gears": {"g": {"input": "motor", "output": "load", "ratio": 5.0, "stiffness": {"kind": "linear", "stiffness": 700.0}}},
        "simulation": {"duration": 0.1, "sample_interval": 1e-3},
    }  # fmt: skip
    common = {"sample_time": T, "reference": {"kind": "speed", "mean": 3.0}, "encoder": {"lines": 2048}}
    loop = lm.simulate(scenario(**tables, controllers={"m": common | {"speed": {"gain": 0.4, "integral_gain": 20.0}}}))

    def law(time: float, measured: Any, reference: Any, state: Any) -> float:
        torque = 0.4 * (5.0 * reference[0] - measured[1]) + state[0]
        state[0] += T * 20.0 / 0.4 * (torque - state[0])
        return torque / 2.0  # type: ignore[no-any-return]

    own = lm.simulate(scenario(**tables, controllers={"m": common | {"law": True}}), law=lm.control.Law(law, states=1))
    for name in ("motor_speed", "load_speed"):
        assert own[name].to_numpy() == pytest.approx(loop[name].to_numpy(), abs=1e-9 * float(np.abs(loop[name]).max()))


def test_what_a_law_raises_comes_through() -> None:
    tables: dict[str, Any] = {
        "shafts": {"motor": {"inertia": 2e-3}},
        "motors": {"m": torque_source()},
        "controllers": {"m": {"sample_time": T, "reference": {"kind": "torque"}, "encoder": {"ideal": True}, "law": True}},
        "simulation": {"duration": 0.1, "sample_interval": 1e-3},
    }  # fmt: skip

    def broken(*given: Any) -> float:
        raise ZeroDivisionError("in my law")

    with pytest.raises(ZeroDivisionError, match="in my law"):
        lm.simulate(scenario(**tables), law=broken)
    simulation = lm.Simulation(scenario(**tables), law=broken)
    with pytest.raises(ZeroDivisionError, match="in my law"):
        simulation.advance(1e-3)
    with pytest.raises(lm.SolverError, match="controller failed"):
        lm.simulate(scenario(**tables), law=lambda *given: math.nan)
