"""Trains without motor and load torque move freely, as closed forms say."""

import math

import numpy as np
import pytest

import lostmotion as lm


def test_two_shafts_and_a_compliant_gear_vibrate_freely() -> None:
    """No motor and no load torque: d = d0 cos(Omega t) with Omega^2 = k (1/(J_1 i^2) + 1/J_2)."""
    J_1, J_2, i, k, d0 = 2e-3, 0.05, 4.0, 300.0, 0.01
    scenario = lm.Scenario(
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


@pytest.mark.parametrize("ratio", [-4.0, 1.0, 5.0])
def test_the_ledger_of_a_free_vibration_has_nothing_that_is_turned_over(ratio: float) -> None:
    """An angular frequency of sqrt(k (1/(J_1 i^2) + 1/J_2)); motion and ledger to rounding."""
    J_1, J_2, k = 1e-3, 5.0, 2000.0
    scenario = lm.Scenario(
        shafts={"a": {"inertia": J_1}, "b": {"inertia": J_2}},
        gears={"g": {"input": "a", "output": "b", "ratio": ratio, "stiffness": {"kind": "linear", "stiffness": k}}},
        initial={"twists": {"g": 1e-3}},
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )
    result = lm.simulate(scenario)
    frequency = math.sqrt(k * (1.0 / (J_1 * ratio**2) + 1.0 / J_2))
    wanted = 1e-3 * np.cos(frequency * result["time"].to_numpy())
    assert np.abs(result["g_twist"].to_numpy() - wanted).max() < 1e-12 * 1e-3 * frequency
    assert abs(lm.energy_of(result)["residual"]) < 1e-12 * k * 1e-3**2
    assert result.attrs.get("energy_residual", 0.0) < 1e-12
