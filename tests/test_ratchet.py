"""Ratchets: free backward, and held again at the next tooth."""

import math

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

J_1, J_2, T, AHEAD = 0.2, 0.5, 3.0, 9.0


def handle(teeth: int, restitution: float = 0.0) -> lm.Scenario:
    """The drum runs ahead of a handle at rest, which a constant torque accelerates until it catches up."""
    return lm.Scenario(
        shafts={"handle": {"inertia": J_1, "torque": {"mean": -T}}, "drum": {"inertia": J_2}},
        ratchets={"ratchet": {"input": "handle", "output": "drum", "teeth": teeth, "restitution": restitution}},
        initial={"speeds": {"drum": AHEAD}},
        simulation={"duration": 3.0, "sample_interval": 1e-3},
    )


def tooth(teeth: int) -> tuple[float, float]:
    """The instant at which the pawl strikes, and with which speed: a t^2/2 - w t = -n pitch, the last tooth passed."""
    a, pitch = T / J_1, 2.0 * math.pi / teeth
    passed = math.floor(AHEAD**2 / (2.0 * a) / pitch)
    u = math.sqrt(AHEAD**2 - 2.0 * a * passed * pitch)
    return (AHEAD + u) / a, u


@pytest.mark.parametrize("teeth", [1, 7, 12, 360])
def test_it_holds_at_the_last_tooth_that_it_has_passed(teeth: int) -> None:
    struck, u = tooth(teeth)
    result = lm.simulate(handle(teeth))
    instants = np.asarray(lm.switchings_of(result)["instant"])
    assert instants[-1] == pytest.approx(struck, rel=1e-9)
    t = np.asarray(result["time"])
    begin = (T * struck + J_2 * AHEAD) / (J_1 + J_2)
    after = t > struck
    speed = begin + T / (J_1 + J_2) * (t[after] - struck)
    for name in ("handle_speed", "drum_speed"):
        assert np.asarray(result[name])[after] == pytest.approx(speed, rel=1e-12)
    torque = np.asarray(result["ratchet_contact_torque"])
    assert torque[after] == pytest.approx(T * J_2 / (J_1 + J_2), rel=1e-12)
    assert np.all(torque[t < struck] == 0.0)
    energy = lm.energy_of(result)
    assert energy["ratchet: impacts"] == pytest.approx(0.5 * J_1 * J_2 / (J_1 + J_2) * u**2, rel=1e-11)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]


def test_a_pawl_that_bounces_comes_to_rest_on_its_tooth() -> None:
    """Bounces under the slip acceleration T/J_1 end at the geometric series, none of them as far as a tooth."""
    e, teeth = 0.3, 7
    struck, u = tooth(teeth)
    result = lm.simulate(handle(teeth, e))
    instants = np.asarray(lm.switchings_of(result)["instant"])
    assert instants[-1] == pytest.approx(struck + 2.0 * e * u * J_1 / T / (1.0 - e), rel=1e-9)
    assert float(result["handle_speed"][-1]) == pytest.approx(float(result["drum_speed"][-1]), rel=1e-13)


def test_it_begins_at_a_tooth_and_drives_at_once() -> None:
    result = lm.simulate(handle(12).replace(**{"initial.speeds": {}}))
    assert float(result["drum_speed"][-1]) == pytest.approx(T / (J_1 + J_2) * 3.0, rel=1e-12)


def test_solvers_and_steps_agree() -> None:
    scenario = handle(7, 0.3)
    exact = lm.simulate(scenario)
    adaptive = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    assert float(adaptive["drum_speed"][-1]) == pytest.approx(float(exact["drum_speed"][-1]), rel=1e-8)
    simulation = lm.Simulation(scenario)
    for _ in range(30):
        simulation.advance(0.1, handle_load_torque=-T)
    assert simulation["drum_speed"] == pytest.approx(float(exact["drum_speed"][-1]), rel=1e-11)


def test_what_takes_no_impacts_says_so() -> None:
    assert "ratchets.ratchet" in refused(lambda: lm.linearize(handle(7)))
