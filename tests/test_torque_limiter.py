"""Torque limiters: release, slip, and where they engage again."""

import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

T_1, T_2 = 30.0, 8.0


def wound_up(k: float, J: float, v: float, duration: float, **limiter: Any) -> lm.Scenario:
    """A spring that is wound up at a constant speed turns a hub, which the limiter holds to a wall."""
    return lm.Scenario(
        shafts={"drive": {"speed": {"mean": v}}, "hub": {"inertia": J}, "wall": {"speed": {"mean": 0.0}}},
        gears={"spring": {"input": "drive", "output": "hub", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": k}}},
        torque_limiters={"limiter": {"input": "hub", "output": "wall", "release_torque": T_1, "slip_torque": T_2, **limiter}},
        simulation={"duration": duration, "sample_interval": 1e-3},
    )


def test_it_releases_the_energy_between_both_torques() -> None:
    """J w' = k d - T_2, d' = v - w from k d = T_1 until w = 0, at tan(W t/2) = -(T_1 - T_2) W/(k v); the heat is T_2 times the slip."""
    k, J, v = 500.0, 0.02, 0.4
    result = lm.simulate(wound_up(k, J, v, 1.0))
    W, wound = math.sqrt(k / J), T_1 / k
    lasts = 2.0 * (math.pi - math.atan((T_1 - T_2) * W / (k * v))) / W
    left = T_2 / k + (T_1 - T_2) / k * math.cos(W * lasts) + v / W * math.sin(W * lasts)
    slipped = v * lasts - (left - wound)
    again = (wound - left) / v
    released = [wound / v + n * (lasts + again) for n in range(10)]
    expected = sorted(t for r in released for t in (r, r + lasts) if t < 1.0)
    assert np.asarray(lm.switchings_of(result)["instant"])[-len(expected) :] == pytest.approx(expected, rel=1e-9)
    slips = sum(r + lasts < 1.0 for r in released)
    energy = lm.energy_of(result)
    assert released[slips] > 1.0
    assert energy["limiter: torque limiter"] == pytest.approx(slips * T_2 * slipped, rel=1e-9)
    # Of each release: what the spring gives between both of its twists, and the drive meanwhile.
    given = 0.5 * k * (wound**2 - left**2)
    driven = v * (T_2 * lasts + (T_1 - T_2) / W * math.sin(W * lasts) + k * v / W**2 * (1.0 - math.cos(W * lasts)))
    assert given + driven == pytest.approx(T_2 * slipped, rel=1e-12)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]


def slipping(**limiter: Any) -> lm.Scenario:
    return lm.Scenario(
        shafts={"a": {"inertia": 0.3}, "b": {"inertia": 0.6, "torque": {"steps": [{"height": -10.0, "time": 5.0}]}}},
        torque_limiters={"limiter": {"input": "a", "output": "b", "release_torque": T_1, "slip_torque": T_2, **limiter}},
        initial={"speeds": {"a": 60.0}},
        simulation={"duration": 6.0, "sample_interval": 1e-3},
    )


PER_TORQUE = 1.0 / 0.3 + 1.0 / 0.6  # slip acceleration


def test_it_engages_where_the_speeds_are_nearly_the_same() -> None:
    result = lm.simulate(slipping(engaging_speed="3 rad/s"))
    engages = (60.0 - 3.0) / (T_2 * PER_TORQUE)
    together = engages + 3.0 / (T_1 * PER_TORQUE)
    instants = np.asarray(lm.switchings_of(result)["instant"])
    assert instants[:2] == pytest.approx([engages, together], rel=1e-9)
    t, torque = np.asarray(result["time"]), np.asarray(result["limiter_contact_torque"])
    assert torque[t < engages] == pytest.approx(T_2, rel=1e-12)
    assert torque[(t > engages) & (t < together)] == pytest.approx(T_1, rel=1e-12)
    assert float(result["a_speed"].sel(time=4.0)) == pytest.approx(60.0 * 0.3 / 0.9, rel=1e-12)
    # It holds 10 N m, more than it slips at: a follows b.
    assert float(result["a_speed"][-1]) == pytest.approx(20.0 + 10.0 / 0.9, rel=1e-10)


def test_it_engages_at_the_next_pocket() -> None:
    pockets, engaging = 6, 12.0
    result = lm.simulate(slipping(engaging_speed=engaging, pockets=pockets))
    pitch, a = 2.0 * math.pi / pockets, T_2 * PER_TORQUE
    slow = (60.0 - engaging) / a
    passed = 60.0 * slow - 0.5 * a * slow**2
    pocket = pitch * math.ceil(passed / pitch)
    slip = math.sqrt(60.0**2 - 2.0 * a * pocket)
    caught = (60.0 - slip) / a
    instants = np.asarray(lm.switchings_of(result)["instant"])
    together = caught + slip / (T_1 * PER_TORQUE)
    assert instants[instants < 4.0][-3:] == pytest.approx([slow, caught, together], rel=1e-9)
    assert float(result["a_speed"].sel(time=4.0)) == pytest.approx(20.0, rel=1e-12)
    heat = lm.energy_of(result)["limiter: torque limiter"]
    assert heat == pytest.approx(0.5 * 0.2 * 60.0**2, rel=1e-10)


def test_between_pockets_it_holds_but_its_slip_torque() -> None:
    """One pocket to a turn: it stops short of it, and slips again under a torque between both."""
    result = lm.simulate(slipping(engaging_speed="1 rad/s", pockets=1).replace(**{"shafts.b.torque": None}))
    stops = 60.0 / (T_2 * PER_TORQUE)
    turns = 0.5 * 60.0 * stops / (2.0 * math.pi)
    assert 0.1 < turns % 1.0 < 0.9
    assert float(result["a_speed"].sel(time=4.0)) == pytest.approx(20.0, rel=1e-12)
    pulled = lm.simulate(
        slipping(engaging_speed="0.001 rad/s", pockets=1).replace(
            **{"shafts.b.torque": {"steps": [{"height": -15.0, "time": 5.0}]}, "simulation.duration": "5.2 s"}
        )
    )
    needed = 15.0 * 0.3 / 0.9
    assert needed < T_2
    assert float(pulled["a_speed"][-1]) == pytest.approx(float(pulled["b_speed"][-1]), rel=1e-12)
    torn = lm.simulate(
        slipping(engaging_speed="0.001 rad/s", pockets=1).replace(
            **{"shafts.b.torque": {"steps": [{"height": -45.0, "time": 5.0}]}, "simulation.duration": "5.2 s"}
        )
    )
    assert T_2 < 45.0 * 0.3 / 0.9 < T_1
    assert float(torn["a_speed"][-1]) == pytest.approx(20.0 + 0.2 * T_2 / 0.3, rel=1e-10)


@pytest.mark.parametrize("limiter", [{"engaging_speed": 3.0}, {"engaging_speed": 12.0, "pockets": 6}])
def test_both_solvers_and_steps_agree(limiter: dict[str, Any]) -> None:
    scenario = slipping(**limiter)
    exact = lm.simulate(scenario)
    adaptive = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    assert np.asarray(adaptive["a_speed"]) == pytest.approx(np.asarray(exact["a_speed"]), abs=1e-6)
    simulation = lm.Simulation(scenario)
    for k in range(60):
        simulation.advance(0.1, b_load_torque=-10.0 if k >= 50 else 0.0)
    assert simulation["a_speed"] == pytest.approx(float(exact["a_speed"][-1]), rel=1e-10)
    assert "limiter_contact" in str(lm.explain(scenario, 4.0))


def test_a_slip_torque_above_the_release_torque_is_refused() -> None:
    refused(lambda: slipping(slip_torque=31.0), "torque_limiters.limiter")
