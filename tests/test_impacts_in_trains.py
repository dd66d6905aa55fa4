"""Flanks of several gears that strike at once or in turn, gears that lock in motion, clutches that are closed at the start."""

import itertools
import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from impact_reference import Chain, Vector, random_chain
from tables import gear_between, mesh_efficiency, run_of, torque_source

# Of the random cases, this share is tried; `LOSTMOTION_CASES=1` tries all.
SHARE = float(os.environ.get("LOSTMOTION_CASES", "0.02"))


def at_end(result: Any, chain: Chain) -> Vector:
    n = len(chain.inertias)
    names = [f"s{k}_speed" for k in range(n)] + [f"g{k}_twist" for k in range(n - 1)]
    return np.array([float(result[name].values[-1]) for name in names])


# --- several gears ---
IN_TURN: dict[str, Any] = {
    "inertias": np.array([20.0, 0.5, 0.7]),
    "torques": np.array([0.0, -1.0, -0.49]),
    "friction": np.zeros(3),
    "ratios": np.ones(2),
    "backlash": np.array([0.02, 0.005]),
    "restitution": np.array([0.3, 0.0]),
    "speeds": np.zeros(3),
    "twists": np.zeros(2),
}


def test_impacts_in_turn_end_with_the_common_speed_of_the_momentum() -> None:
    """The shaft between two others is struck by both in turn, ever faster: all over at 0.15157 s, then -1.49/21.2 rad/s^2."""
    chain = Chain(**IN_TURN)
    result = lm.simulate(chain.scenario(0.4, 40))
    speeds = np.array([float(result[f"s{k}_speed"].values[-1]) for k in range(3)])
    # The momentum of all torques since the start.
    np.testing.assert_allclose(speeds, -1.49 / 21.2 * 0.4, rtol=1e-12)
    np.testing.assert_allclose(speeds, -0.028113, rtol=2e-5)
    last = float(lm.switchings_of(result)["instant"].values[-1])
    assert last == pytest.approx(0.15157, abs=1e-5)
    energy = lm.energy_of(result)
    chain.run(0.4)
    assert energy["g0: impacts"] + energy["g1: impacts"] == pytest.approx(chain.lost, rel=1e-10)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]


@pytest.mark.parametrize("intervals", [7, 50, 333, 1000])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.8])
def test_a_shaft_struck_from_both_sides_at_one_instant_is_the_same_for_all_samples(e: float, intervals: int) -> None:
    """Both gaps of 0.01 rad close after 0.01/1 s; each pair parts at -e times its speed, whatever the inertias."""
    J = np.array([0.3, 0.7, 1.9])
    chain = Chain(
        inertias=J,
        torques=np.zeros(3),
        friction=np.zeros(3),
        ratios=np.ones(2),
        backlash=np.array([0.02, 0.02]),
        restitution=np.array([e, e]),
        speeds=np.array([1.0, 0.0, -1.0]),
        twists=np.zeros(2),
    )
    result = lm.simulate(chain.scenario(0.017, intervals))
    w = np.array([float(result[f"s{k}_speed"].values[-1]) for k in range(3)])
    np.testing.assert_allclose([w[0] - w[1], w[1] - w[2]], [-e, -e], atol=1e-13)
    assert J @ w == pytest.approx(0.3 - 1.9, rel=1e-13)
    first = float(lm.switchings_of(result)["instant"].values[0])
    assert first == pytest.approx(0.01, rel=1e-12)


def expected(parts: dict[str, Any], duration: float) -> tuple[Chain, Vector, float | None]:
    """The reference, its speeds and twists at the end by their sizes, and how exact they can be.

    The last is the answer to changes of the torques by 1e-9. None: it is not continuous.
    """
    n = len(parts["inertias"])
    chain = Chain(**parts)
    end = chain.run(duration)
    size = np.array([*n * [max(float(np.abs(end[:n]).max()), 1e-3 * chain.size)], *parts["backlash"]])
    changed = parts | {"torques": parts["torques"] * (1.0 + 1e-9 * np.cos(np.arange(n)))}
    condition = float(np.max(np.abs(Chain(**changed).run(duration) - end) / size)) / 1e-9
    return chain, size, 1e-9 * (1.0 + condition) if condition < 1e5 else None


def test_the_order_of_the_shafts_in_the_file_changes_nothing() -> None:
    """Chains written from their other end: each ratio is its inverse, each twist the negative in units of the other shaft."""
    draw = np.random.default_rng(59)
    for case in range(int(max(10, 200 * SHARE))):
        parts, duration = random_chain(draw)
        back = Chain(
            inertias=parts["inertias"][::-1],
            torques=parts["torques"][::-1],
            friction=parts["friction"][::-1],
            ratios=1.0 / parts["ratios"][::-1],
            backlash=(parts["backlash"] * np.abs(parts["ratios"]))[::-1],
            restitution=parts["restitution"][::-1],
            speeds=parts["speeds"][::-1],
            twists=-(parts["twists"] * parts["ratios"])[::-1],
        )
        n = len(parts["inertias"])
        _, size, tolerance = expected(parts, duration)
        if tolerance is None:
            continue
        one, other = (at_end(lm.simulate(c.scenario(duration)), c)[:n] for c in (Chain(**parts), back))
        assert np.all(np.abs(one - other[::-1]) < tolerance * size[:n]), case


def compare(cases: Sequence[int], seed: int, *, friction: bool) -> None:
    compared = impacts = 0
    for case in cases:
        parts, duration = random_chain(np.random.default_rng([seed, case]), friction=friction)
        result = lm.simulate(Chain(**parts).scenario(duration))
        energy = lm.energy_of(result)
        turned = max(energy["turned_over"], 1e-9)
        assert abs(energy["residual"]) < 1e-10 * turned, case
        taken = sum(energy[f"g{k}: impacts"] for k in range(len(parts["ratios"])))
        assert taken > -1e-13 * turned, case
        chain, size, tolerance = expected(parts, duration)
        if tolerance is None:
            continue
        assert np.all(np.abs(at_end(result, chain) - chain.end) < tolerance * size), (case, tolerance)
        assert taken == pytest.approx(chain.lost, rel=1e-6, abs=tolerance * turned), case
        compared += 1
        impacts += chain.impacts
    assert compared > 0.8 * len(cases)
    assert impacts > 20 * len(cases)


def test_random_chains_are_those_of_momentum_and_restitution() -> None:
    """3 to 6 shafts, inertias over 2.5 decades, 0 to 0.9 of restitution: none jams, and all are as from impact to impact."""
    compare(range(int(2000 * SHARE)), 59, friction=False)


def test_random_chains_with_friction_are_those_of_momentum_and_restitution() -> None:
    compare(range(int(max(12, 300 * SHARE))), 60, friction=True)


def test_flanks_accumulate_beside_others_that_part_for_long() -> None:
    """All are without a gap at that instant: those that part at a speed take no part."""
    compare([312, 458, 722, 1247, 1521, 1660, 1695, 1876][: some(8, 3)], 61, friction=True)


@pytest.mark.parametrize("duration", [0.14, 0.2, 0.3])
def test_an_elastic_flank_comes_to_rest_where_others_lose_energy(duration: float) -> None:
    """At 0.115 s an elastic flank has struck a thousand times in turn with an inelastic one; a strike at 0.155 s finds both touching."""
    parts: dict[str, Any] = {
        "inertias": np.array([0.6354, 0.5691, 0.01062, 0.6555]),
        "torques": np.array([-0.02151, 0.451, 0.3598, 0.4093]),
        "friction": np.zeros(4),
        "ratios": np.array([1.0, -1.0, 0.5]),
        "backlash": np.array([0.005143, 0.008681, 0.006281]),
        "restitution": np.array([0.6423, 1.0, 0.0]),
        "speeds": np.array([-0.02153, 0.0617, -0.0008742, 0.04054]),
        "twists": np.array([-0.001894, 0.00153, 0.002665]),
    }
    chain = Chain(**parts)
    result = lm.simulate(Chain(**parts).scenario(duration))
    size = np.array([*4 * [0.1], *parts["backlash"]])
    chain.run(duration)
    assert np.all(np.abs(at_end(result, chain) - chain.end) < 1e-10 * size)


# --- gears that lock in motion ---
def worm(stiffness: float | None, *, eta_b: float = -0.3, mass: float = 2.0) -> lm.Scenario:
    """A worm that lifts; at 0.1 s the motor is switched off and the load turns round, so that it drives on."""
    mesh: dict[str, Any] = {"kind": "rigid"} if stiffness is None else {"kind": "linear", "stiffness": stiffness}
    damping = {} if stiffness is None else {"mesh_damping": 0.6 * math.sqrt(stiffness * mass)}
    return lm.Scenario(
        shafts={"worm": {"inertia": 1e-4}, "drum": {"inertia": mass, "torque": {"mean": 5.0, "steps": [{"time": 0.1, "height": -25.0}]}}},
        motors={"motor": torque_source(0.0, "worm")},
        gears={"gear": gear_between("worm", "drum", 50.0, mesh, losses=mesh_efficiency(0.4, eta_b), **damping)},
        command={"motor": {"mean": 0.5, "steps": [{"time": 0.1, "height": -0.5}]}},
        simulation=run_of(0.3, 1e-3),
    )


def test_a_gear_that_locks_in_motion_stops_by_an_impulse() -> None:
    result = lm.simulate(worm(None))
    t, w = result["time"].values, result["worm_speed"].values
    # Up to there: (J_1 + J_2/(i^2 eta_f)) a = M - M_Z/(i eta_f).
    a = (0.5 - 5.0 / (50.0 * 0.4)) / (1e-4 + 2.0 / (2500.0 * 0.4))
    np.testing.assert_allclose(w[t < 0.1], a * t[t < 0.1], rtol=1e-12, atol=1e-13)
    assert np.all(w[t > 0.1] == 0.0)
    assert np.all(result["drum_speed"].values[t > 0.1] == 0.0)
    energy = lm.energy_of(result)
    speed = a * 0.1
    assert energy["gear: impacts"] == pytest.approx(0.5 * (1e-4 + 2.0 / 2500.0) * speed**2, rel=1e-11)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]
    assert float(result["gear_output_torque"].values[-1]) == pytest.approx(-20.0)


def test_ever_stiffer_meshes_lead_to_that_stop() -> None:
    """The torque in the mesh grows at the rate sqrt(k): angles beyond those of the rigid gear fall nearly so, with each decade."""
    rigid = lm.simulate(worm(None))
    beyond = []
    for stiffness in (1e6, 1e7, 1e8, 1e9):
        soft = lm.simulate(worm(stiffness))
        late = soft["time"].values > 0.25
        assert np.abs(soft["worm_speed"].values[late]).max() < 1e-6
        assert np.abs(soft["drum_speed"].values[late]).max() < 1e-6
        beyond.append(abs(float(soft["drum_angle"].values[-1] - rigid["drum_angle"].values[-1])))
    assert beyond[-1] < 4e-3 * float(rigid["drum_angle"].values[-1])
    assert all(after < 0.45 * before for before, after in itertools.pairwise(beyond))


def test_a_gear_that_has_locked_breaks_away_as_stiffer_meshes_do() -> None:
    """The motor turns on again at 0.2 s and drives the load: from rest, in the same direction as before."""
    again = {"motor": {"mean": 0.5, "steps": [{"time": 0.1, "height": -0.5}, {"time": 0.2, "height": 0.5}]}}
    speeds = [float(lm.simulate(worm(k).replace(command=again))["drum_speed"].values[-1]) for k in (1e6, 1e9)]
    rigid = float(lm.simulate(worm(None).replace(command=again))["drum_speed"].values[-1])
    # (J_1 + J_2/(i^2 eta_f)) a = M + 20 N m/(i eta_f)
    assert rigid == pytest.approx((0.5 + 20.0 / (50.0 * 0.4)) / (1e-4 + 2.0 / (2500.0 * 0.4)) * 0.1 / 50.0, rel=1e-11)
    assert abs(speeds[1] - rigid) < 2e-4 * rigid
    assert abs(speeds[1] - rigid) < 0.2 * abs(speeds[0] - rigid)


def test_the_speed_after_a_lock_does_not_depend_on_what_it_was_before() -> None:
    """The motor turns on again at 0.2 s: J a = M + 20 N m/(i eta_f), J = J_1 + J_2/(i^2 eta_f), so dw/dJ_2 = -w/(J i^2 eta_f)."""
    again = {"motor": {"mean": 0.5, "steps": [{"time": 0.1, "height": -0.5}, {"time": 0.2, "height": 0.5}]}}
    scenario = worm(None).replace(command=again)
    key = "shafts.drum.inertia"
    result = lm.simulate(scenario, sensitivities=[key])
    t, w = result["time"].values, result["worm_speed"].values
    derivative = result["worm_speed_sensitivity"].sel(parameter=key).values
    late = t > 0.21
    np.testing.assert_allclose(derivative[late], -w[late] / (1e-4 + 2.0 / 1000.0) / 1000.0, rtol=1e-9)
    assert np.all(derivative[(t > 0.1) & (t < 0.2)] == 0.0)


def test_a_gear_that_locks_as_its_inputs_jump_goes_on_from_rest_until_it_locks_again() -> None:
    """Its drag lets the load overrun the input above some speed; at rest there is none, and the motor drives on."""
    J, b, eta, step = (4e-4, 3e-3), (0.02, 0.008), 0.45, 0.1
    M, load = (2.0, 0.5), (-0.1, -0.5)
    scenario = lm.Scenario(
        shafts={
            "worm": {"inertia": J[0], "viscous_friction": b[0]},
            "drum": {
                "inertia": J[1],
                "viscous_friction": b[1],
                "torque": {"mean": load[0], "steps": [{"time": step, "height": load[1] - load[0]}]},
            },
        },
        motors={"motor": torque_source(0.0, "worm")},
        gears={"gear": gear_between("worm", "drum", 1.0, {"kind": "rigid"}, losses=mesh_efficiency(eta, -0.3))},
        command={"motor": {"mean": M[0], "steps": [{"time": step, "height": M[1] - M[0]}]}},
        simulation=run_of(0.5, 0.0033),
    )
    result = lm.simulate(scenario)
    t, w = result["time"].values, result["worm_speed"].values
    drag = b[0] + b[1] / eta
    rate = drag / (J[0] + J[1] / eta)
    first, then = ((m - T / eta) / drag for m, T in zip(M, load, strict=True))
    # The torque of the mesh, J_2 a + b_2 w + M_Z, is zero at this speed.
    locks = (J[1] * rate * then + load[1]) / (J[1] * rate - b[1])
    period = -math.log1p(-locks / then) / rate
    expected = np.where(t < step, -first * np.expm1(-rate * t), -then * np.expm1(-rate * ((t - step) % period)))
    np.testing.assert_allclose(w, expected, rtol=1e-10, atol=1e-12)
    energy = lm.energy_of(result)
    stops = math.floor((t[-1] - step) / period)
    assert stops == 2
    lost = 0.5 * sum(J) * ((first * math.expm1(-rate * step)) ** 2 + stops * locks**2)
    assert energy["gear: impacts"] == pytest.approx(lost, rel=1e-11)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]


def self_locking_chain(draw: np.random.Generator) -> tuple[lm.Scenario, float, float, float, float]:
    """2 to 4 gears in a row without friction, whose motor turns round at 0.1 s: scenario, its torque, inertias at the motor.

    These are the one that drives, and that of a motion which slows down; a negative one allows none.
    """
    n = int(draw.integers(2, 5))
    J = [float(10.0 ** draw.uniform(-4, k - 2)) for k in range(n + 1)]
    ratio = [float(draw.uniform(0.5, 5.0) * draw.choice([-1, 1])) for _ in range(n)]
    drive = [float(draw.uniform(0.3, 0.9)) for _ in range(n)]
    back = [float(draw.choice([-0.8, -0.3, -0.05, 0.5])) * d for d in drive]
    driving = slowing = J[n]
    for k in range(n - 1, -1, -1):
        driving = J[k] + driving / (ratio[k] ** 2 * drive[k])
        slowing = J[k] + slowing / ratio[k] ** 2 * (back[k] if slowing > 0.0 else 1.0 / drive[k])
    torque = driving * 10.0
    scenario = lm.Scenario(
        shafts={f"s{k}": {"inertia": J[k]} for k in range(n + 1)},
        motors={"m": torque_source(0.0, "s0")},
        gears={
            f"g{k}": gear_between(f"s{k}", f"s{k + 1}", ratio[k], {"kind": "rigid"}, losses=mesh_efficiency(drive[k], back[k]))
            for k in range(n)
        },
        command={"m": {"mean": torque, "steps": [{"time": 0.1, "height": -2.0 * torque}]}},
        simulation=run_of(0.3, 0.013),
    )
    return scenario, torque, driving, slowing, sum(J[k] / np.prod(ratio[:k]) ** 2 for k in range(n + 1))


def test_gears_in_a_row_lock_together_where_no_motion_slows_them_down() -> None:
    """The torque of each mesh is that which accelerates all behind it: it tells whether the gear drives or is driven."""
    draw = np.random.default_rng(7)
    locked = 0
    for case in range(60):
        scenario, torque, driving, slowing, inertia = self_locking_chain(draw)
        result = lm.simulate(scenario)
        t, first = result["time"].values, torque / driving * 0.1
        rests = 0.1 + (first * slowing / torque if slowing > 0.0 else 0.0)
        expected = np.where(
            t < 0.1, torque / driving * t, np.where(t < rests, first - torque / slowing * (t - 0.1), -torque / driving * (t - rests))
        )
        np.testing.assert_allclose(result["s0_speed"].values, expected, rtol=1e-9, atol=1e-9 * first, err_msg=str(case))
        energy = lm.energy_of(result)
        impacts = sum(energy[name] for name in energy if str(name).endswith(": impacts"))
        assert impacts == pytest.approx(0.5 * inertia * first**2 if slowing < 0.0 else 0.0, rel=1e-9), case
        assert abs(energy["residual"]) < 1e-11 * energy["turned_over"], case
        locked += slowing < 0.0
    assert locked >= 20


def test_a_gear_that_does_not_lock_goes_on() -> None:
    """|eta_b| J_2 < J_1 i^2: it slows down by (J_1 + eta_b J_2/i^2) a = -eta_b M/i with the load of -20 N m."""
    result = lm.simulate(worm(None, mass=0.5))
    t, w = result["time"].values, result["worm_speed"].values
    first = (0.5 - 0.25) / (1e-4 + 0.5 / 1000.0)
    slowing = -0.3 * 20.0 / 50.0 / (1e-4 - 0.3 * 0.5 / 2500.0)
    stops = 0.1 + first * 0.1 / -slowing
    between = (t > 0.1) & (t < stops)
    np.testing.assert_allclose(w[between], first * 0.1 + slowing * (t[between] - 0.1), rtol=1e-9, atol=1e-9)
    assert lm.energy_of(result)["gear: impacts"] == 0.0


# --- the start ---
def test_a_clutch_that_is_closed_at_the_start_holds_what_its_static_limit_holds() -> None:
    """Shafts of 0.0458 and 0.0301 kg m^2: common acceleration needs M J_2/(J_1 + J_2) = 0.639 N m, below 0.672, above 0.5."""
    J, needed = (0.0458, 0.0301), 0.639
    M = needed * sum(J) / J[1]
    scenario = lm.Scenario(
        shafts={"a": {"inertia": J[0], "torque": -M}, "b": {"inertia": J[1]}},
        clutches={"c": {"input": "a", "output": "b", "torque": 0.5, "breakaway_torque": 0.672}},
        command={"c": 1.0},
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )
    result = lm.simulate(scenario)
    for name in ("a", "b"):
        np.testing.assert_allclose(result[f"{name}_speed"].values, M / sum(J) * result["time"].values, rtol=1e-12)
    # One that needs more slips from the start.
    slips = lm.simulate(scenario.replace(**{"shafts.a.torque": -M * 0.68 / needed}))
    assert float(slips["b_speed"].values[-1]) == pytest.approx(0.5 / J[1] * 0.1, rel=1e-12)
