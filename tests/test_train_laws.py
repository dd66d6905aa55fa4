"""The laws of the elements of a drive train: both solvers on each, closed forms, what commands and errors may be."""

import ctypes as c
import json
import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import SCENARIOS
from lostmotion.simulation.runs import core_runs
from lostmotion.simulation.runs.separate_trains import parts_of
from refusals import refusals, refusals_of, refused
from tables import gear_between, linked, rated_gearbox, run_of, torque_source
from test_c_interface import OK, library  # noqa: F401
from test_description import Scenario
from test_drive_train import train
from test_end_stops import ball
from test_impacts import pair
from test_massless_shafts import GAP as GAP_AT_NODE
from test_massless_shafts import chain


def two_shafts(**tables: Any) -> lm.Scenario:
    """Two shafts, a torque source on the first, and these tables."""
    base: dict[str, Any] = {
        "shafts": {"a": {"inertia": 1e-3}, "b": {"inertia": 2e-3, "torque": 0.0}},
        "motors": {"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 1e-4}},
        "command": {"m": {"mean": 0.3, "amplitude": 1.0, "frequency": 2.0}},
        "simulation": {"duration": 0.6, "sample_interval": 1e-3},
    }
    return lm.Scenario(**base | {name: {**base.get(name, {}), **table} for name, table in tables.items()})


SOFT = {"input": "a", "output": "b", "ratio": 2.0, "stiffness": {"kind": "linear", "stiffness": 50.0}}
STIFF = {"input": "a", "output": "b", "ratio": 2.0}
STRIBECK = {"friction_torque": 0.1, "breakaway_torque": 0.2, "stribeck_speed": 1.0, "friction_error": 0.002}
FAN = {"kind": "quadratic", "coefficient": 1e-5, "max_speed": 300.0, "error": 0.005}
FLUID = {"kind": "quadratic", "coefficient": 1e-4, "max_speed": 100.0, "error": 0.01}
GAP = {"kind": "curve", "backlash": 0.1, "slopes": [100.0]}
PIVOT = {"kind": "linear", "stiffness": 5.0}
STOPS = {"kind": "curve", "backlash": 0.4, "slopes": [20.0, 80.0], "breaks": [0.05]}
ERROR = {"kind": "sine", "amplitude": 1e-3, "order": 5, "error": 1e-5}
PAIRS = {"teeth": 24, "contact_ratio": 1.4, "fewer_pairs": 0.6}
ELEMENTS = {
    "brake": two_shafts(
        gears={"g": SOFT},
        brakes={"k": {"shaft": "b", "torque": 3.0}},
        command={"k": {"steps": [{"height": 1.0, "time": 0.2}, {"height": -1.0, "time": 0.4}]}},
    ),
    "clutch": two_shafts(
        clutches={"c": linked("a", "b", torque=0.6)}, command={"c": {"ramps": [{"rise": 1.0, "duration": 0.3, "begin": 0.1}]}}
    ),
    "safety clutch": two_shafts(clutches={"c": linked("a", "b", kind="safety", torque=0.6)}),
    "freewheel": two_shafts(freewheels={"f": linked("a", "b")}),
    "damper": two_shafts(dampers={"d": linked("a", "b", viscous_friction=5e-3)}),
    "fluid coupling": two_shafts(
        dampers={"d": linked("a", "b", drag=FLUID)}, shafts={"b": {"inertia": 2e-3, "torque": 0.0, "friction_torque": 0.05}}
    ),
    "damper beside a clutch": two_shafts(
        clutches={"c": linked("a", "b", torque=0.3)},
        dampers={"d": linked("b", "a", viscous_friction=2e-3, drag=FLUID)},
        command={"c": {"ramps": [{"rise": 1.0, "duration": 0.3, "begin": 0.1}]}},
    ),
    "vibration damper": two_shafts(
        gears={"g": SOFT}, shafts={"ring": {"inertia": 1e-3}}, dampers={"d": linked("b", "ring", viscous_friction=5e-3)}
    ),
    "gravity": two_shafts(gears={"g": SOFT}, gravity={"arm": {"shaft": "b", "mass": 0.5, "radius": 0.2}}),
    "cogging": two_shafts(
        gears={"g": STIFF}, angle_torques={"cog": {"kind": "sine", "shaft": "a", "amplitude": 0.02, "order": 12, "error": 0.001}}
    ),
    "spring": two_shafts(gears={"g": SOFT}, springs={"pivot": {"shaft": "b", "stiffness": PIVOT, "rest_angle": 0.3}}),
    "end stops": two_shafts(gears={"g": SOFT}, springs={"stops": {"shaft": "b", "stiffness": STOPS}}),
    "transmission error": two_shafts(gears={"g": SOFT | {"mesh_damping": 0.01, "transmission_error": ERROR}}),
    "mesh stiffness": two_shafts(gears={"g": SOFT | {"mesh_damping": 0.01, "mesh_stiffness": PAIRS}}),
    "mesh stiffness with play": two_shafts(
        gears={"g": SOFT | {"stiffness": GAP, "mesh_damping": 0.2, "mesh_stiffness": PAIRS}},
        shafts={"b": {"inertia": 2e-3, "torque": 0.0, "friction_torque": 0.05}},
    ),
    "mesh stiffness with hysteresis": two_shafts(
        gears={"g": SOFT | {"hysteresis": {"efficiency": 0.8}, "mesh_stiffness": PAIRS}},
        shafts={"a": {"inertia": 1e-3, "friction_torque": 0.02}},
    ),
    "housing": two_shafts(
        gears={"g": SOFT | {"housing": "h", "stiffness": GAP, "mesh_damping": 0.01}, "support": SOFT | gear_between("h", "b", 1.5)},
        shafts={"h": {"inertia": 4e-3, "friction_torque": 0.02}},
    ),
    "planetary gear": two_shafts(
        gears={"g": STIFF | {"ratio": 4.0, "housing": "ring"}}, shafts={"ring": {"inertia": 4e-3, "friction_torque": 0.1}}
    ),
    "friction over speed": two_shafts(gears={"g": SOFT}, shafts={"b": {"inertia": 2e-3, "torque": 0.0, **STRIBECK}}),
    "drag": two_shafts(gears={"g": STIFF}, shafts={"b": {"inertia": 2e-3, "torque": 0.0, "drag": FAN}}),
    "damped play": two_shafts(gears={"g": SOFT | {"stiffness": GAP, "mesh_damping": 0.2}}),
    "limited damping": two_shafts(gears={"g": SOFT | {"stiffness": GAP, "mesh_damping": 0.2, "damping_limited": True}}),
    "torque limit": two_shafts(gears={"g": STIFF}, motors={"m": torque_source(1e-4, "a", torque_limit=0.5)}),
    "worm and brake": train(),
}


def chords(scenario: lm.Scenario) -> float:
    """By how much chords in place of sines move a speed [rad/s] at most: their error over the smallest inertia."""
    smooth: dict[str, Any] = {**scenario.gravity, **scenario.angle_torques}
    if not smooth:
        return 0.0
    error = sum(element.error or 1e-3 * 9.80665 * element.mass * element.radius for element in smooth.values())
    return error * scenario.simulation.duration / min(shaft.inertia for shaft in scenario.shafts.values())


EVERY = ELEMENTS | {path.stem: lm.load(path) for path in SCENARIOS}


@pytest.mark.parametrize("scenario", EVERY.values(), ids=EVERY)
def test_both_solvers_agree_on_every_element_and_every_drive(scenario: lm.Scenario) -> None:
    """The adaptive solver takes sines as they are, the exact one by chords."""
    exact = lm.simulate(scenario)
    coarse, fine = (lm.simulate(scenario, solver="dormand-prince", relative_tolerance=tolerance) for tolerance in (1e-8, 1e-10))
    for name in exact:
        if str(name).endswith(("_speed", "_angle", "twist")):
            size = float(abs(exact[name]).max()) or 1.0
            open_by = float(abs(coarse[name] - fine[name]).max()) / size  # what the tolerance leaves open
            sines = chords(scenario) * (1.0 if str(name).endswith("_speed") else scenario.simulation.duration)
            assert float(abs(exact[name] - fine[name]).max()) <= (2.0 * open_by + 1e-9) * size + sines, name
    ledger = lm.energy_of(exact)
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]


def test_a_pendulum_swings_with_its_period() -> None:
    small = 0.02  # rad; the period of a pendulum is longer by small^2/16
    scenario = lm.Scenario(
        shafts={"arm": {"inertia": 2.0 * 0.3**2}},
        gravity={"mass": {"shaft": "arm", "mass": 2.0, "radius": 0.3, "error": 1e-7}},
        initial={"angles": {"arm": small}},
        simulation={"duration": 3.0, "sample_interval": 1e-3},
    )
    result = lm.simulate(scenario)
    expected = small * np.cos(math.sqrt(9.80665 / 0.3) * result["time"].values)
    phase = math.sqrt(9.80665 / 0.3) * 3.0  # by a small^2/16th of which it lags at the end
    assert float(abs(result["arm_angle"] - expected).max()) < 1.5 * small * phase * small**2 / 16.0


FINE_MAP = {"kind": "map", "speeds": [float(k) for k in range(140)], "loads": [k - 70.0 for k in range(140)], "values": [[0.1] * 140] * 140}
test_what_takes_too_many_straight_lines_is_refused = refusals_of(
    lambda elements: two_shafts(**({"gears": {"g": SOFT}} | elements)).train(),
    ({"angle_torques": {"cog": {"kind": "sine", "shaft": "a", "amplitude": 1.0, "error": 1e-9}}}, "angle_torques.cog: straight lines; at most 30000"),
    ({"gears": {"g": SOFT | {"transmission_error": ERROR | {"error": 1e-12}}}}, "gears.g: with its transmission error would take "),
    ({"shafts": {"b": {"inertia": 2e-3, "drag": FAN | {"error": 1e-12}}}}, "shafts.b: with its drag would take "),
    ({"gears": {"g": SOFT | {"rated_input_speed": 100.0, "rated_output_torque": 10.0, "losses": FINE_MAP}}}, "gears.g"),
)  # fmt: skip


def test_a_spring_balances_an_arm() -> None:
    # An arm that gravity would turn at m g r = 6 N m, held level by a spring of 10 N m/rad that is wound up by 0.6 rad:
    # there it stands, and swings about it with sqrt(k/J).
    mgr, k, J, small = 6.0, 10.0, 0.2, 1e-3
    scenario = lm.Scenario(
        shafts={"arm": {"inertia": J}},
        gravity={"weight": {"shaft": "arm", "mass": mgr / 9.80665, "radius": 1.0, "angle": math.pi / 2, "error": 1e-7}},
        springs={"balance": {"shaft": "arm", "stiffness": {"kind": "linear", "stiffness": k}, "rest_angle": mgr / k}},
        initial={"angles": {"arm": small}},
        simulation={"duration": 2.0, "sample_interval": 1e-3},
    )
    result = lm.simulate(scenario)
    expected = small * np.cos(math.sqrt(k / J) * result["time"].values)
    # What the cosine of gravity leaves: m g r phi^2/2 and the chords, over J, for the two seconds.
    assert float(abs(result["arm_angle"] - expected).max()) < (mgr * small**2 / 2 + 1e-7) / J * 2.0**2 / 2
    assert "balance: spring" in lm.energy_of(result)


def test_a_self_locking_worm_holds_lowers_smoothly_or_chatters() -> None:
    """Efficiencies of its drawing: eta_b = tan(g - r)/tan g with g = 4 deg, tan r = 0.084; i = 50, load 20 N m."""
    tan_g = math.tan(math.radians(4.0))
    eta_b = (tan_g - 0.084) / (1.0 + 0.084 * tan_g) / tan_g
    smooth = lm.simulate(lm.load("worm-lowering", {"shafts.drum.inertia": 0.5}))
    held = smooth.sel(time=slice(0.0, 0.099))
    assert float(abs(held["drum_speed"]).max()) < 1e-12  # the motor is off
    # What the motor has left turns the worm against 1e-3 N m s/rad of oil.
    speed = (0.15 - 0.01 - 20.0 * abs(eta_b) / 50.0) / 1e-3
    assert float(smooth["worm_speed"].sel(time=1.19, method="nearest")) == pytest.approx(-speed, rel=1e-5)
    assert not np.any(smooth["worm_contact"].sel(time=slice(0.11, 1.19)) == 0)
    # The paradox of rigid friction, |eta_b| J_2 > J_1 i^2, is chatter of the compliant mesh: the worm locks while the motor pushes.
    assert abs(eta_b) * 2.0 > 1e-4 * 50.0**2 > abs(eta_b) * 0.5
    chatter = lm.simulate(lm.load("worm-lowering"))
    locked = chatter["worm_contact"].sel(time=slice(0.11, 1.19)).values == 0
    assert np.count_nonzero(np.diff(locked.astype(int)) == 1) >= 2


def test_a_bias_above_half_the_torque_of_the_ring_keeps_the_backlash_closed() -> None:
    biased = lm.simulate(lm.load("two-motors-one-ring"))
    settled = biased.sel(time=slice(1.0, None))  # the flanks have met
    gap = 0.5 * 4.0 * math.pi / 10800.0
    assert np.all(settled["first_gear_twist"] > gap)
    assert np.all(settled["second_gear_twist"] < -gap)
    changes = {f"command.{name}_motor.mean": 0.0 for name in ("first", "second")}
    loose = lm.simulate(lm.load("two-motors-one-ring", changes)).sel(time=slice(1.0, None))
    for name in ("first", "second"):
        assert float(loose[f"{name}_gear_twist"].min()) < -gap
        assert float(loose[f"{name}_gear_twist"].max()) > gap


def braked(command: Any, **delays: float) -> lm.Scenario:
    """A flywheel of 2 kg·m² at 10 rad/s and a brake of 4 N·m."""
    return lm.Scenario(
        shafts={"wheel": {"inertia": 2.0, "torque": 0.0}},
        brakes={"b": {"shaft": "wheel", "torque": 4.0, **delays}},
        command={"b": command},
        initial={"speeds": {"wheel": 10.0}},
        simulation={"duration": 2.0, "sample_interval": 0.001},
    )


def test_a_brake_acts_after_its_delays() -> None:
    command = {"steps": [{"height": 1, "time": 0.5}, {"height": -1, "time": 1.0}]}
    speed = lm.simulate(braked(command, engagement_delay=0.03, release_delay=0.1)).wheel_speed
    # 2 rad/s^2 from 0.53 s to 1.1 s
    assert float(speed.sel(time=0.53, method="nearest")) == 10.0
    assert float(speed[-1]) == pytest.approx(10.0 - 2.0 * (1.1 - 0.53), abs=1e-12)
    assert float(speed.sel(time=0.8, method="nearest")) == pytest.approx(10.0 - 2.0 * 0.27, abs=1e-12)


SAFETY = {"kind": "safety", "input": "a", "output": "b", "torque": 1.0, "release_delay": 0.1}
test_what_a_brake_or_a_clutch_cannot_do_is_refused = refusals(
    (lambda: braked({"ramps": [{"rise": 1, "duration": 0.1}]}, engagement_delay=0.03), "command.b: is not made of steps"),
    (
        lambda: braked({"steps": [{"height": 1, "time": 0.5}, {"height": -1, "time": 0.51}]}, engagement_delay=0.03),
        "command.b: steps at 0.5 s and at 0.51 s, which after the delays would act in reverse order; leave more time between them",
    ),
    (lambda: braked(8.0), "command.b: may reach 8; it is a share, and 1 is the full torque, 4 N*m"),
    (lambda: braked({"steps": [{"height": 1}, {"height": 1, "time": 0.5}]}), "command.b: may reach 2;"),
    (lambda: braked({"mean": 0.2, "ramps": [{"rise": 1, "duration": 0.1}]}), "command.b: may reach 1.2;"),
    (lambda: braked({"mean": 0.5, "amplitude": 0.6, "frequency": 1}), "command.b: may reach 1.1;"),
    (lambda: braked({"samples": {"times": [0, 0.1, 0.2], "values": [0, 1.5, 0]}}), "command.b: may reach 1.5;"),
    (lambda: two_shafts(clutches={"c": SAFETY}).train(), ": is a safety clutch, which has no command; remove engagement_delay"),
    (lambda: lm.linearize(handle(7)), ": ratchets.ratchet"),
)


def test_a_brake_may_swing_from_open_to_full_torque() -> None:
    tenths = {"steps": [{"height": 0.1, "time": 0.1 * k} for k in range(10)]}  # their sum is 1 up to rounding
    for command in ({"mean": 0.5, "amplitude": 0.5, "frequency": 1}, tenths):
        assert float(lm.simulate(braked(command)).wheel_speed[-1]) < 10.0
    simulation = lm.Simulation(braked(1.0))
    assert "b_command 2.0 is a share, and 1 is the full torque" in refused(lambda: simulation.advance(0.1, b_command=2.0))
    simulation.advance(0.1, b_command=(1.0, 0.0))


@pytest.mark.parametrize("stiffness", [1e40, 1e60, 1e100, 1e200, 1e300])
def test_a_stiffness_without_measure_ends_in_one_line(stiffness: float) -> None:
    spring = {"kind": "linear", "stiffness": stiffness}
    to_frame = two_shafts(gears={"g": STIFF}, springs={"s": {"shaft": "b", "stiffness": spring}})
    between = two_shafts(gears={"g": SOFT | {"stiffness": spring}})
    for scenario in (to_frame, between):
        with pytest.raises(lm.SolverError, match="left the range that can be computed at t = 0"):
            lm.simulate(scenario)


@pytest.mark.parametrize("solver", ["exact", "dormand-prince"])
@pytest.mark.parametrize("inertia", [1e-4, 1e-10, 1e-13, 0.0])
def test_the_inertia_of_a_held_ring_does_not_matter(inertia: float, solver: str) -> None:
    """Sun 1 kg m^2 and carrier 10 kg m^2 at ratio 2.5: 20 N m accelerate the sun by 20/(1 + 10/2.5^2) rad/s^2."""
    scenario = lm.Scenario(
        shafts={"sun": {"inertia": 1.0}, "ring": {"inertia": inertia}, "carrier": {"inertia": 10.0}},
        motors={"m": {"shaft": "sun", "kind": "torque_source", "rotor_inertia": 0.0}},
        gears={"p": {"input": "sun", "output": "carrier", "housing": "ring", "ratio": 2.5}},
        brakes={"b": {"shaft": "ring", "torque": 100.0}},
        command={"m": 20.0, "b": 1.0},
        simulation={"duration": 1.0, "sample_interval": 0.5},
    )
    run = lm.simulate(scenario, solver=solver)
    assert float(run["carrier_speed"][-1]) == pytest.approx(20.0 / (1.0 + 10.0 / 6.25) / 2.5, rel=1e-13)
    if solver == "exact":
        energy = lm.energy_of(run)
        assert abs(energy["residual"]) < 1e-14 * energy["turned_over"]
    model = lm.linearize(scenario, time=0.5)
    rate = model.B[list(model.states).index("carrier_speed"), list(model.inputs).index("m_command")]
    assert rate == pytest.approx(1.0 / (1.0 + 10.0 / 6.25) / 2.5, rel=1e-13)


@pytest.mark.parametrize("solver", ["exact", "dormand-prince"])
def test_a_clutch_does_not_break_away_when_another_contact_stops(solver: str) -> None:
    """Friction of a reverses at the stop: 6.75 rad/s^2 before, then 2.25, where the clutch takes 0.995 of 1.2 N m."""
    scenario = lm.Scenario(
        shafts={"a": {"inertia": 0.02, "friction_torque": 0.45}, "b": {"inertia": 0.18, "torque": -1.4}},
        motors={"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 0.0}},
        clutches={"c": {"kind": "safety", "input": "a", "output": "b", "torque": 0.9, "breakaway_torque": 1.2}},
        command={"m": -0.5},
        initial={"speeds": {"a": -1.0, "b": -1.0}},
        simulation={"duration": 1.0, "sample_interval": 0.1},
    )
    run = lm.simulate(scenario, solver=solver)
    for shaft in "ab":
        assert float(run[f"{shaft}_speed"][-1]) == pytest.approx(2.25 * (1.0 - 1.0 / 6.75), rel=1e-9)


# --- parts of a drive train that nothing joins are solved alone ---
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
    for own in data["controllers"].values():
        own |= {"encoder": {"ideal": True}, "position_encoder": {"ideal": True, "shaft": own["shaft"]}}
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


# --- ratchets ---
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


def test_both_solvers_agree_on_a_ratchet() -> None:
    exact = lm.simulate(handle(7, 0.3))
    adaptive = lm.simulate(handle(7, 0.3), solver="dormand-prince", relative_tolerance=1e-11)
    assert float(adaptive["drum_speed"][-1]) == pytest.approx(float(exact["drum_speed"][-1]), rel=1e-8)


NODE = {"shafts.a.torque": 1.0, "simulation.duration": 0.05}
STEPPED = {
    "ratchet": (handle(7, 0.3), {"handle_load_torque": -T}, 30, ("drum_speed",)),
    "end stop": (ball({"restitution": 0.6}, duration=4.0), {"ball_load_force": 9.80665}, 80, ("ball_position",)),
    "flanks": (pair(0.5, torques=(-3.0, 0.0), duration=0.5), {"a_load_torque": -3.0}, 100, ("a_speed", "b_speed", "mesh_twist")),
    "node": (chain(first=GAP_AT_NODE).replace(**NODE), {"a_load_torque": 1.0}, 50, ("node_speed", "b_speed")),
}


@pytest.mark.parametrize("what", STEPPED)
def test_step_by_step_it_is_the_same(what: str) -> None:
    scenario, inputs, steps, names = STEPPED[what]
    whole, simulation = lm.simulate(scenario), lm.Simulation(scenario)
    for _ in range(steps):
        simulation.advance(scenario.simulation.duration / steps, **dict.fromkeys(simulation.inputs, 0.0) | inputs)
    for name in names:
        assert simulation[name] == pytest.approx(float(whole[name][-1]), rel=1e-11, abs=1e-12), name


# --- stiffness that depends on the direction of twist ---
K, BACKWARD, J = 200.0, 2.25, 0.5


def periods() -> tuple[float, float]:
    """Half periods [s] of an inertia J on the two sides of the curve."""
    return math.pi * math.sqrt(J / K), math.pi * math.sqrt(J / (K * BACKWARD))


def swing(amplitude: float, t: np.ndarray) -> np.ndarray:
    """Angle of that inertia, released at an angle > 0: half periods of both sides in turn, with one speed at angle 0."""
    one, other = periods()
    turn = np.mod(t + 0.5 * one, one + other)
    w = math.pi / one
    forward = amplitude * np.sin(w * turn)
    back = -amplitude / math.sqrt(BACKWARD) * np.sin(w * math.sqrt(BACKWARD) * (turn - one))
    return np.where(turn < one, forward, back)


def on_spring() -> lm.Scenario:
    curve = {"kind": "curve", "slopes": [f"{K} N*m/rad"], "backward": BACKWARD}
    return lm.Scenario(
        shafts={"arm": {"inertia": J}},
        springs={"bar": {"shaft": "arm", "stiffness": curve}},
        initial={"angles": {"arm": "0.1 rad"}},
        simulation={"duration": 3.0 * sum(periods()), "sample_interval": 0.003},
    )


@pytest.mark.parametrize(("solver", "error"), [("exact", 1e-13), ("dormand-prince", 1e-7)])
def test_an_arm_on_a_spring_swings_by_half_periods_of_both_directions(solver: str, error: float) -> None:
    result = lm.simulate(on_spring(), solver=solver)
    assert result.arm_angle.values == pytest.approx(swing(0.1, result.time.values), abs=error)


def test_the_twist_of_a_gearbox_swings_by_half_periods_in_the_short_form() -> None:
    rotor, ratio, load = 2e-4, 50.0, 0.75
    scenario = lm.Scenario(
        motor=torque_source(rotor, rated_torque=1.0),
        gearbox=rated_gearbox(ratio, 300.0, 50.0, {"kind": "curve", "slopes": [K], "backward": BACKWARD}, 1.0),
        load={"inertia": load},
        initial={"twist": 0.01},
        simulation=run_of(1.0, 0.002),
    )
    own = 1.0 / (1.0 / load + 1.0 / (rotor * ratio**2))
    stretched = math.sqrt(J / own)
    for what in (scenario, lm.Scenario(**scenario.long().model_dump())):
        result = lm.simulate(what)
        twist = result.twist if "twist" in result else result.gearbox_twist
        assert twist.values == pytest.approx(swing(0.01, stretched * result.time.values), abs=1e-10)


def test_gap_and_preload_hold_in_each_direction() -> None:
    curve = lm.model.TorsionCurve(slopes=(100.0, 300.0), breaks=(0.02,), backward=2.0)
    gap = lm.model.TorsionCurve(slopes=(100.0, 300.0), breaks=(0.02,), backward=2.0, backlash=0.01)
    tight = lm.model.TorsionCurve(slopes=(100.0, 300.0), breaks=(0.02,), backward=2.0, preload=2.0)
    for d in (0.001, 0.015, 0.02, 0.05):
        forward = 100.0 * d if d <= 0.02 else 2.0 + 300.0 * (d - 0.02)
        assert curve.torque(d) == pytest.approx(forward, rel=1e-14)
        assert curve.torque(-d) == pytest.approx(-2.0 * forward, rel=1e-14)
        assert gap.torque(d + 0.005) == pytest.approx(forward, rel=1e-12)
        assert gap.torque(-d - 0.005) == pytest.approx(-2.0 * forward, rel=1e-12)
        assert gap.torque(0.004) == gap.torque(-0.004) == 0.0
        # The preload of 2 N m is reached at 20 mrad forward, at 10 mrad backward.
        assert tight.torque(d) == pytest.approx(300.0 * d, rel=1e-14)
        assert tight.torque(-d) == pytest.approx(-200.0 * d if d <= 0.01 else -2.0 - 600.0 * (d - 0.01), rel=1e-12)
    for what in (curve, gap, tight):
        core = what.core()
        for torque in (-7.0, -1.0, 0.5, 11.0):
            assert what.torque(core.twist(torque)) == pytest.approx(torque, rel=1e-13)


def test_both_solvers_agree_with_backlash_and_hysteresis_in_each_direction() -> None:
    scenario = lm.load("paper-2dof-nl-large").replace(
        **{"gearbox.stiffness.backward": 1.5, "simulation.duration": 0.5, "simulation.sample_interval": 0.01}
    )
    exact, stepped = (lm.simulate(scenario, solver=solver) for solver in ("exact", "dormand-prince"))
    for name in ("motor_speed", "load_speed", "twist", "output_torque"):
        size = float(np.abs(exact[name].values).max())
        assert stepped[name].values == pytest.approx(exact[name].values, abs=1e-5 * size)
    odd = lm.simulate(scenario.replace(**{"gearbox.stiffness.backward": 1.0}))
    assert float(np.abs(odd.twist.values - exact.twist.values).max()) > 1e-5


def test_what_takes_one_curve_for_both_directions_refuses_it() -> None:
    drive = lm.load("paper-2dof-nl-large").replace(**{"gearbox.stiffness.backward": 1.5})
    assert "differs between the two directions of twist" in refused(drive.gearbox.stiffness.pieces)
    assert "backward: 0.0 must be greater than 0" in refused(lambda: lm.model.TorsionCurve(slopes=[1.0], backward=0.0))


def test_the_half_periods_follow_from_the_derivative_by_the_factor() -> None:
    key = "springs.bar.stiffness.backward"
    result = lm.simulate(on_spring(), sensitivities=[key])
    # Behind the first half period angle and speed are those of the closed form, whose differences are good to 1e-6.
    h = 1e-5
    one, other = (lm.simulate(on_spring().replace(**{key: BACKWARD + s * h})).arm_angle.values for s in (1.0, -1.0))
    assert result.arm_angle_sensitivity.sel(parameter=key).values == pytest.approx((one - other) / (2.0 * h), abs=1e-6)


def test_programs_without_python_run_and_change_it(library: c.CDLL) -> None:  # noqa: F811
    scenario = lm.load("paper-2dof-nl-large").replace(
        **{"gearbox.stiffness.backward": 1.5, "simulation.duration": 0.3, "simulation.sample_interval": 0.01}
    )
    there = Scenario(library, lm.portable.description(scenario))
    assert there.set("gearbox.stiffness.backward", 1.2) == OK
    here = lm.simulate(scenario.replace(**{"gearbox.stiffness.backward": 1.2}))
    assert np.array_equal(there.run()["twist"], here.twist.values)
