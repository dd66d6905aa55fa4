"""Shafts at rest together on rigid gears: they break away when no distribution of the torques between them is consistent, which a linear programme decides."""

import itertools
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from tables import mesh_efficiency

linprog = pytest.importorskip("scipy.optimize").linprog
STEP = 2e-3  # s between samples


def tree(seed: int, losses: bool) -> dict[str, Any]:
    """Two to four shafts on rigid gears, each with a load in ramps of 1 s and, every other one, a break-away torque."""
    draw = random.Random(seed)
    n = draw.choice([2, 2, 3, 4])
    scale, gears, shafts = [1.0] * n, {}, {}
    for k in range(1, n):
        before, ratio = draw.randrange(k), float(draw.choice([1, 2, 3]))
        scale[k] = scale[before] * ratio
        gears[f"g{k}"] = {"input": f"s{before}", "output": f"s{k}", "ratio": ratio}
        if losses and draw.random() < 0.6:
            gears[f"g{k}"]["losses"] = mesh_efficiency(draw.uniform(0.6, 0.95), draw.uniform(0.4, 0.9))
    for k in range(n):
        friction = scale[k] * draw.uniform(0.1, 0.5)
        ramps = [{"rise": scale[k] * draw.uniform(-0.6, 0.6), "duration": 1.0, "begin": float(b)} for b in range(6)]
        shafts[f"s{k}"] = {"inertia": 0.01 * scale[k] ** 2, "friction_torque": friction, "torque": {"ramps": ramps}}
        if draw.random() < 0.5:
            shafts[f"s{k}"]["breakaway_torque"] = friction * draw.uniform(1.1, 2.0)
    return {"shafts": shafts, "gears": gears, "simulation": {"duration": 6.0, "sample_interval": STEP}}


def load(shaft: dict[str, Any], time: float) -> float:
    return sum(r["rise"] * min(max(time - r["begin"], 0.0), 1.0) for r in shaft["torque"]["ramps"])


def margin(train: dict[str, Any], time: float) -> float:
    """The largest margin [N m] that all contacts can have at rest together, over all torques T_2 of the gears; < 0: none rests."""
    shafts, gears = list(train["shafts"].items()), list(train["gears"].values())
    best = -np.inf
    for signs in itertools.product((1.0, -1.0), repeat=len(gears)):  # of the torques
        rows, bounds = [], []
        for name, shaft in shafts:
            held, more, less = np.zeros((3, len(gears) + 1))  # torque on the contact; what losses add to its capacities
            for j, gear in enumerate(gears):
                if gear["output"] == name:
                    held[j] += 1.0
                if gear["input"] == name:
                    held[j] -= 1.0 / gear["ratio"]
                    if law := gear.get("losses"):
                        share = {1.0: 1.0 / law["drive_efficiency"] - 1.0, -1.0: 1.0 - law["backdrive_efficiency"]}
                        more[j] = signs[j] * share[signs[j]] / gear["ratio"]
                        less[j] = signs[j] * share[-signs[j]] / gear["ratio"]
            capacity = shaft.get("breakaway_torque", shaft["friction_torque"])
            for side, added in ((1.0, more), (-1.0, less)):
                row = side * held - added
                row[-1] = 1.0
                rows.append(row)
                bounds.append(capacity + side * load(shaft, time))
        for j, sign in enumerate(signs):
            rows.append(np.eye(len(gears) + 1)[j] * -sign)
            bounds.append(0.0)
        found = linprog([*[0.0] * len(gears), -1.0], A_ub=rows, b_ub=bounds, bounds=[(None, None)] * (len(gears) + 1))
        if found.status == 0:
            best = max(best, -found.fun)
    return best


@pytest.mark.parametrize("losses", [False, True])
def test_random_trees_break_away_when_no_torques_between_them_are_consistent(losses: bool) -> None:
    broken, cases = 0, some(40, 16)
    for seed in range(cases):
        train = tree(seed, losses)
        result = lm.simulate(lm.Scenario(**train))
        moves = np.nonzero(np.asarray(result["s0_speed"]))[0]
        if moves.size == 0:
            assert min(margin(train, t) for t in np.arange(0.25, 6.0, 0.25)) > -1e-9, seed
            continue
        broken += 1
        last = float(result["time"][moves[0] - 1])
        assert margin(train, last) > -1e-9, seed
        assert margin(train, last + STEP) < 1e-9, seed
    assert broken >= cases // 2


def joint_rest(tmp_path: Path, torque_a: str, torque_b: str, coulomb: float = 3.0) -> Any:
    """Two shafts on a rigid gear, one of which holds more than it takes while it slips."""
    path = tmp_path / "rest.toml"
    path.write_text(
        f"""
[shafts.a]
inertia = 1
friction_torque = {coulomb}
breakaway_torque = 5
torque = {{ {torque_a} }}
[shafts.b]
inertia = 1
friction_torque = 1.5
torque = {{ {torque_b} }}
[gears.g]
input = "a"
output = "b"
ratio = 1
[simulation]
duration = 8
sample_interval = 0.5
"""
    )
    return lm.simulate(lm.load(path))


@pytest.mark.parametrize("coulomb", [3.0, 5.0])
@pytest.mark.parametrize("rise", [0.0, -1.0])
def test_two_shafts_at_rest_break_away_when_both_have_given_what_they_hold(rise: float, coulomb: float, tmp_path: Path) -> None:
    """Up to 5 N*m + 1.5 N*m, though one alone is at its limit from 5 N*m on; from there on the other takes the rest."""
    result = joint_rest(tmp_path, "ramps = [{ rise = 10, duration = 10 }]", f"ramps = [{{ rise = {rise}, duration = 10 }}]", coulomb)
    time = np.asarray(result["time"])
    away = 6.5 / (1.0 + 0.1 * rise)
    moves = np.asarray(result["a_speed"]) != 0.0
    assert (moves == (time > away)).all()
    rests = time < away
    assert np.asarray(result["g_output_torque"])[rests] == pytest.approx(-np.maximum(time[rests] - 5.0, 0.0), abs=1e-12)


def test_rest_at_a_start_beyond_what_one_shaft_holds_changes_the_torques_least(tmp_path: Path) -> None:
    result = joint_rest(tmp_path, "mean = 5.5", "mean = -0.55")
    assert not np.asarray(result["a_speed"]).any()
    assert np.asarray(result["g_output_torque"]) == pytest.approx(-0.5, abs=1e-12)


def test_speeds_that_differ_by_the_rounding_of_what_they_were_are_the_same_at_the_start() -> None:
    """A run that begins where another has ended, as two shafts in a closed clutch pass through zero, begins stuck."""
    scenario = lm.Scenario(
        shafts={"a": {"inertia": 1.0, "torque": {"mean": -0.3}}, "b": {"inertia": 2.0}},
        clutches={"c": {"input": "a", "output": "b", "torque": 1.0, "kind": "safety"}},
        initial={"speeds": {"a": 2e-16, "b": -3e-17}},
        simulation={"duration": 1.0, "sample_interval": 0.1},
    )
    result = lm.simulate(scenario)
    assert result["c_contact"].values.tolist() == [0] * 11
    assert result.attrs["switching_count"] == 0
    assert result["b_speed"].values.tolist() == result["a_speed"].values.tolist()
