"""Sampled controllers: closed forms, independent recursions, published axes, and what must not change a run."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm

T = 125e-6


def scenario(**tables: Any) -> lm.TrainScenario:
    return lm.TrainScenario(**tables)


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


def test_a_linear_two_mass_drive_under_a_sampled_pi_is_the_linear_recursion() -> None:
    J_M, J_L, k, d = 2e-3, 5e-3, 700.0, 0.02
    k_p, k_i, weight, share = 1.1, 45.0, 0.6, 1.0
    axis = scenario(
        shafts={"motor": {"inertia": J_M, "viscous_friction": 0.01}, "load": {"inertia": J_L, "viscous_friction": d}},
        motors={"m": torque_source(rated_torque=2.0)},
        gears={"coupling": {"input": "motor", "output": "load", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": k}}},
        controllers={"m": {
            "sample_time": T, "reference": {"kind": "speed", "mean": 3.0}, "encoder": {"ideal": True},
            "speed": {"gain": k_p, "integral_gain": k_i, "reference_weight": weight, "estimate": {"kind": "difference", "time_constant": 2e-4}},
        }},
        simulation={"duration": 400 * T, "sample_interval": T},
    )  # fmt: skip
    result = lm.simulate(axis)
    # Plant: w_M, w, twist, phi_M under a torque held for T.
    A = np.array([[-0.01 / J_M, 0, -k / J_M, 0], [0, -d / J_L, k / J_L, 0], [1, -1, 0, 0], [1, 0, 0, 0]], float)
    B = np.array([1.0 / J_M, 0, 0, 0])
    phi = expm(np.block([[A, B[:, None]], [np.zeros((1, 5))]]) * T)
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
