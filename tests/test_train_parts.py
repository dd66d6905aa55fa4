"""Parts of a drive train that nothing joins are solved alone: the results of the whole are those that the whole solved at once has."""

import json
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.simulation.runs import core_runs
from lostmotion.simulation.runs.separate_trains import parts_of

MASSES: dict[str, Any] = {
    "shafts": {
        "a": {"inertia": 1e-3, "friction_torque": 0.02},
        "x": {"inertia": 2e-3, "friction_torque": 0.05, "torque": {"amplitude": 0.4, "frequency": 3.0}},
        "b": {"inertia": 0.5, "torque": 1.0},
        "y": {"inertia": 1e-3, "viscous_friction": 1e-2},
        "alone": {"inertia": 1.0, "torque": 0.3},
    },
    "gears": {
        "g": {"input": "a", "output": "b", "ratio": 20.0, "stiffness": {"kind": "curve", "slopes": [0.0, 500.0], "breaks": [1e-3]}}
    },
    "clutches": {"c": {"kind": "safety", "input": "x", "output": "y", "torque": 0.2}},
    "brakes": {"hold": {"shaft": "a", "torque": 0.3}},
    "motors": {"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0}},
    "gravity": {"arm": {"shaft": "b", "mass": 1.0, "radius": 0.1, "error": 1e-3}},
    "command": {"m": {"amplitude": 0.5, "frequency": 1.0}, "hold": {"steps": [{"height": 1.0, "time": 1.2}]}},
    "initial": {"speeds": {"alone": 0.4}, "angles": {"b": 0.2}, "twists": {"g": 5e-4}},
    "simulation": {"duration": 2.0, "sample_interval": 0.01},
}  # fmt: skip


def both_ways(scenario: lm.Scenario, monkeypatch: pytest.MonkeyPatch, **how: Any) -> tuple[Any, Any]:
    """The run by its parts, and of all at once."""
    by_parts = lm.simulate(scenario, **how)
    monkeypatch.setattr(core_runs, "parts_of", lambda whole: [whole])
    return by_parts, lm.simulate(scenario, **how)


def finder() -> lm.Scenario:
    """Without steps of encoders, of which rounding may decide which one is read."""
    data = lm.load("direction-finder", {"simulation.duration": 1.0}).model_dump(exclude_none=True)
    for c in data["controllers"].values():
        c |= {"encoder": {"ideal": True}, "position_encoder": {"ideal": True, "shaft": c["shaft"]}}
    return lm.Scenario(**data)


@pytest.mark.parametrize("make", [finder, lambda: lm.Scenario(**MASSES)], ids=["finder", "masses"])
def test_parts_give_the_dataset_of_the_whole(make: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    parts, whole = both_ways(make(), monkeypatch, energy=True)
    assert list(parts) == list(whole)
    for name in whole:
        x, y = parts[name].values, whole[name].values
        np.testing.assert_allclose(x, y, rtol=0.0, atol=1e-9 * np.abs(y).max(), err_msg=str(name))
    for attribute in ("energy", "end_state"):
        a, b = (json.loads(r.attrs[attribute]) for r in (parts, whole))
        assert list(a) == list(b)
        # Magnitudes are summed from switching to switching, of which a part has only its own.
        sizes = {entry: d.pop(entry, 0.0) for d in (a, b) for entry in ("turned_over",)}
        scale = max(abs(v) for v in (*b.values(), *sizes.values()))
        assert list(a.values()) == pytest.approx(list(b.values()), abs=1e-10 * scale)
    assert {k: parts.attrs[k] for k in ("switching_columns", "switching_count", "scenario")} == {
        k: whole.attrs[k] for k in ("switching_columns", "switching_count", "scenario")
    }
    a, b = lm.switchings_of(parts), lm.switchings_of(whole)
    for name in b:
        np.testing.assert_allclose(a[name].values, b[name].values, rtol=0.0, atol=1e-9, err_msg=str(name))


def test_by_the_adaptive_solver_too(monkeypatch: pytest.MonkeyPatch) -> None:
    how: dict[str, Any] = {"solver": "dormand-prince", "relative_tolerance": 1e-11}
    parts, whole = both_ways(lm.Scenario(**MASSES), monkeypatch, **how)
    for name in ("a_speed", "b_angle", "y_speed", "alone_angle"):
        assert np.abs(parts[name].values - whole[name].values).max() < 1e-7 * np.abs(whole[name].values).max()


def test_what_joins_shafts_makes_them_one_part() -> None:
    def groups(**change: Any) -> list[list[str]]:
        return [list(part.shafts) for part in parts_of(lm.Scenario(**(MASSES | change)))]

    assert groups() == [["a", "b"], ["x", "y"], ["alone"]]
    assert groups(freewheels={"f": {"input": "alone", "output": "y"}}, initial={}) == [["a", "b"], ["x", "y", "alone"]]
    elsewhere = {
        "m": {
            "reference": {"kind": "speed", "mean": 1.0}, "shaft": "b", "sample_time": 1e-3, "speed": {"gain": 0.01},
            "encoder": {"ideal": True, "shaft": "a"},
        }
    }  # fmt: skip
    hold = {"hold": MASSES["command"]["hold"]}
    assert groups(controllers=elsewhere, command=hold) == [["a", "b"], ["x", "y"], ["alone"]]
    assert parts_of(lm.load("two-motors-one-ring")) == [lm.load("two-motors-one-ring")]


def test_speeds_are_shown_in_terms_of_the_last_shaft_of_their_own_part() -> None:
    from lostmotion.reports.plots import overview

    figure = overview(lm.simulate(lm.load("direction-finder", {"simulation.duration": 0.02})))
    shown = {a.get_title(): [line.get_label() for line in a.get_lines()] for a in figure.axes}
    for axis in ("traverse", "elevation"):
        assert shown[f"Speed of {axis}"] == [f"{axis}_motor / 100", axis]


def test_bits_do_not_depend_on_whether_parts_run_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = lm.load("direction-finder", {"simulation.duration": 0.2})
    beside = lm.simulate(scenario)
    monkeypatch.setattr(core_runs, "SIDE_BY_SIDE", 0)
    assert lm.simulate(scenario).identical(beside)
