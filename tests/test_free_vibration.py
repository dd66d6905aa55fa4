"""Trains without motor and load torque move freely, as closed forms say."""

import math

import numpy as np
import pytest

import lostmotion as lm


def test_two_shafts_and_a_compliant_gear_vibrate_freely() -> None:
    """No motor and no load torque: d = d0 cos(Omega t) with Omega^2 = k (1/(J_1 i^2) + 1/J_2)."""
    J_1, J_2, i, k, d0 = 2e-3, 0.05, 4.0, 300.0, 0.01
    scenario = lm.TrainScenario(
        shafts={"a": {"inertia": J_1}, "b": {"inertia": J_2}},
        gears={"g": {"input": "a", "output": "b", "ratio": i, "stiffness": {"kind": "linear", "stiffness": k}}},
        initial={"twists": {"g": d0}},
        simulation={"duration": 2.0, "sample_interval": 1e-3},
    )
    run = lm.simulate(scenario)
    omega, t = math.sqrt(k * (1.0 / (J_1 * i * i) + 1.0 / J_2)), run["time"].values
    assert run["g_twist"].values == pytest.approx(d0 * np.cos(omega * t), abs=1e-11)
    speed_b = k * d0 / (J_2 * omega) * np.sin(omega * t)
    assert run["b_speed"].values == pytest.approx(speed_b, abs=1e-9 * float(abs(speed_b).max()))
    assert run["a_speed"].values == pytest.approx(-J_2 / (J_1 * i) * speed_b, rel=1e-9, abs=1e-9)
