"""Where rigid friction has no motion, and where a search for it must not fail: the cases that random trains found."""

import cmath
import itertools
import math
import os
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from locking_trains import locking_train
from tables import direct_current, gear_between, linked, mesh_efficiency, run_of, torque_source

# Of the random cases, this share is tried; `LOSTMOTION_CASES=1` tries all.
SHARE = float(os.environ.get("LOSTMOTION_CASES", "0.05"))


def at_end(result: Any, name: str) -> float:
    return float(result[name].values[-1])


# --- a stop that takes others along ---
def flywheel(inertia: float, stiffness: float | None, beside: int = 0) -> lm.Scenario:
    """A worm that locks as its motor reverses; a flywheel behind a freewheel, which it has left behind, catches up then.

    beside: how many shafts rest behind a gap that the drum does not close.
    """
    others = [f"rests{k}" for k in range(beside)]
    hangs = {"kind": "curve", "backlash": 10.0, "slopes": [1e4]}
    mesh = {"kind": "rigid"} if stiffness is None else {"kind": "linear", "stiffness": stiffness}
    damping = {} if stiffness is None else {"mesh_damping": 0.2 * math.sqrt(stiffness)}
    return lm.Scenario(
        shafts={
            "flywheel": {"inertia": inertia},
            "worm": {"inertia": 1e-4},
            "drum": {"inertia": 2.0, "torque": {"mean": 5.0, "steps": [{"time": 0.1, "height": -25.0}]}},
            **{name: {"inertia": 0.01, "friction_torque": 0.1} for name in others},
        },
        motors={"drive": torque_source(0.0, "worm"), "slow": torque_source(0.0, "flywheel")},
        freewheels={"free": linked("flywheel", "worm")},
        gears={
            "gear": gear_between("worm", "drum", 50.0, mesh, losses=mesh_efficiency(0.4, -0.3), **damping),
            **{f"to_{b}": gear_between(a, b, 2.0, hangs, hysteresis={"efficiency": 0.8}) for a, b in itertools.pairwise(["drum", *others])},
        },
        command={
            "drive": {"mean": 0.5, "steps": [{"time": 0.1, "height": -0.5}]},
            "slow": {"mean": 50.0 * inertia, "steps": [{"time": 0.1, "height": -50.0 * inertia}]},
        },
        simulation=run_of(0.11, 1e-3),
    )


def test_a_gear_that_locks_stops_the_flywheel_behind_its_freewheel_too() -> None:
    """|eta_b| J_2/i^2 = 2.4e-4 kg m^2 is more than the worm has with this flywheel."""
    inertia, speed = 1e-5, 50.0 * 0.1
    worm = (0.5 - 5.0 / (50.0 * 0.4)) / (1e-4 + 2.0 / (2500.0 * 0.4)) * 0.1
    assert worm > 2.0 * speed
    rigid = lm.simulate(flywheel(inertia, None))
    assert at_end(rigid, "worm_speed") == at_end(rigid, "drum_speed") == at_end(rigid, "flywheel_speed") == 0.0
    energy = lm.energy_of(rigid)
    lost = 0.5 * (1e-4 + 2.0 / 2500.0) * worm**2 + 0.5 * inertia * speed**2
    assert energy["gear: impacts"] == pytest.approx(lost, rel=1e-9)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]
    # The limit of ever stiffer meshes.
    soft = [lm.simulate(flywheel(inertia, k)) for k in (1e7, 1e9)]
    off = [abs(at_end(s, "drum_angle") - at_end(rigid, "drum_angle")) for s in soft]
    assert abs(at_end(soft[1], "flywheel_speed")) < 1e-6
    assert off[1] < min(5e-3 * at_end(rigid, "drum_angle"), 0.3 * off[0])


def test_a_gear_that_a_flywheel_keeps_from_locking_is_refused_by_name() -> None:
    """With 1e-3 kg m^2 more all of it goes on, at a speed that the impulses in the meshes decide."""
    with pytest.raises(lm.SolverError, match=r"'gear'.*'worm'.*'drum'.* t = 0.100000 s: the friction jams.*compliance"):
        lm.simulate(flywheel(1e-3, None))


def test_shafts_that_an_event_does_not_reach_take_no_part_in_its_search() -> None:
    """3**16 to 3**32 combinations of their contacts stick and slip, and as many are tried with 16 as with 8 of them."""
    few, many = (lm.simulate(flywheel(1e-5, None, beside)) for beside in (8, 16))
    assert at_end(few, "drum_angle") == pytest.approx(at_end(lm.simulate(flywheel(1e-5, None)), "drum_angle"), rel=1e-12)
    assert many.attrs["mode_trials"] == few.attrs["mode_trials"] < 600  # where one search gives up


# --- a given motion against a gear that locks itself ---
def against(stiffness: float | None) -> lm.Scenario:
    mesh = {"kind": "rigid"} if stiffness is None else {"kind": "linear", "stiffness": stiffness}
    return lm.Scenario(
        shafts={"worm": {"inertia": 0.001}, "table": {"speed": {"amplitude": 0.02, "frequency": 0.5}}},
        gears={"gear": gear_between("worm", "table", 9.0, mesh, losses=mesh_efficiency(0.7, -0.3))},
        simulation=run_of(0.5, 0.01),
    )


def test_a_given_motion_that_drives_a_self_locking_gear_by_its_output_is_refused_with_the_remedy() -> None:
    with pytest.raises(lm.SolverError) as error:
        lm.simulate(against(None))
    for said in ("'gear'", "'worm'", "'table'", "t = 0.000000 s", "stiffness"):
        assert said in str(error.value)
    assert "\n" not in str(error.value)


def at_rest_beside(**held: Any) -> lm.Scenario:
    """A rigid lossy gear `wedge` that rests between friction and a spring whose mass reverses, among others at rest; `held` keeps s7 still."""
    curve = {"kind": "curve"}
    return lm.Scenario(
        shafts={
            "s0": {"inertia": 5e-3},
            "s3": {"inertia": 0.033},
            "s5": {"inertia": 0.032, "friction_torque": 0.124},
            "s6": {"inertia": 0.095, "torque": {"mean": -0.895, "amplitude": 1.6, "frequency": 48.4, "phase": -1.56}},
            "s7": {"inertia": 1.76e-3, **held},
            "s10": {"inertia": 0.231, "friction_torque": 1.8e-3},
            "s13": {
                "inertia": 2.33e-3,
                "friction_torque": 1.84e-3,
                "viscous_friction": 0.63,
                "torque": {"mean": -0.396, "amplitude": 0.158, "frequency": 2.08, "phase": 2.07},
            },
            "s14": {"inertia": 0.075, "friction_torque": 6e-3, "torque": {"amplitude": 0.31, "frequency": 32.3, "phase": -1.3}},
            "s19": {"inertia": 0.012, "friction_torque": 0.095},
            "s20": {"inertia": 2.3e-3, "friction_torque": 0.4},
            "s24": {"inertia": 0.032, "friction_torque": 0.068},
        },
        command={"clutch": 1.0},
        gears={
            "x5": gear_between("s3", "s5", 1.767, curve | {"backlash": 9.6e-3, "slopes": [3910.0]}),
            "x7": gear_between("s5", "s7", 5.19, curve | {"backlash": 4.65e-4, "slopes": [13567.0]}, hysteresis={"efficiency": 0.913}),
            "x13": gear_between("s3", "s13", 6.3, curve | {"backlash": 1.68e-3, "slopes": [26859.0]}),
            "wedge": gear_between("s3", "s20", 0.588, losses=mesh_efficiency(0.536, 0.536)),
        },
        dampers={"x3": linked("s0", "s3", viscous_friction=10.0), "x10": linked("s6", "s10", viscous_friction=1.05)},
        freewheels={"x6": linked("s0", "s6"), "x14": linked("s7", "s14"), "x19": linked("s10", "s19")},
        clutches={"clutch": linked("s5", "s24", torque=0.104, kind="friction")},
        simulation=run_of(0.02, 1e-3),
    )


def test_a_given_motion_elsewhere_leaves_the_torque_of_a_wedged_gear_as_it_is() -> None:
    """A shaft whose given speed is 0 is one that friction holds: the gear, which has to keep its torque as the spring reverses, is not near it."""
    given, held = (lm.simulate(at_rest_beside(**own)) for own in ({"speed": {"mean": 0.0}}, {"friction_torque": 1e3}))
    for name in ("s13_speed", "s6_speed", "s10_speed", "s14_speed", "x13_output_torque", "wedge_output_torque"):
        np.testing.assert_allclose(given[name].values, held[name].values, rtol=1e-9, atol=1e-12)


def test_with_a_stiffness_that_motion_winds_the_gear_up() -> None:
    """The worm holds, so that the torque is the stiffness times the given angle."""
    result = lm.simulate(against(1e4))
    t = result["time"].values
    angle = 0.02 * (1.0 - np.cos(math.pi * t)) / math.pi
    assert np.all(result["worm_speed"].values == 0.0)
    np.testing.assert_allclose(np.abs(result["gear_output_torque"].values), 1e4 * angle, rtol=1e-9, atol=1e-9)


# --- the search itself ---
def test_two_torques_over_one_angle_are_their_sum() -> None:
    """The shaft turns back near the angle 0, where both laws begin a turn: their sum is one sine."""
    laws = {"a": (0.03, 0.0), "b": (0.1, -2.0)}
    sum_of = sum(a * cmath.exp(1j * p) for a, p in laws.values())
    common: dict[str, Any] = {
        "shafts": {"rotor": {"inertia": 0.0, "friction_torque": 0.02}},
        "motors": {"m": direct_current(0.04, 1.0, 100.0, 0.00056, 13.0, "rotor")},
        "command": {"m": {"amplitude": 0.7, "frequency": 9.0, "phase": 2.0}},
        "simulation": run_of(0.1, 0.001),
    }
    two = {name: {"shaft": "rotor", "kind": "sine", "amplitude": a, "phase": p} for name, (a, p) in laws.items()}
    one = {"c": {"shaft": "rotor", "kind": "sine", "amplitude": abs(sum_of), "phase": cmath.phase(sum_of)}}
    first, second = (lm.simulate(lm.Scenario(**common, angle_torques=t)) for t in (two, one))
    speed = second["rotor_speed"].values
    np.testing.assert_allclose(first["rotor_speed"].values, speed, rtol=0.0, atol=1e-4 * np.abs(speed).max())
    assert abs(lm.energy_of(first)["residual"]) < 1e-10 * lm.energy_of(first)["turned_over"]


def test_a_torque_between_shafts_at_rest_ends_with_the_capacity_that_holds_it() -> None:
    """The load on a self-locking gear passes through zero while its shaft rests: what that shaft holds of another does so too."""

    def scenario(**closing: Any) -> lm.Scenario:
        spring = {"kind": "linear", "stiffness": 1e5}
        locks = {"kind": "mesh_efficiency", "drive_efficiency": 0.8, "backdrive_efficiency": -0.1}
        constant = {"kind": "constant_efficiency", "efficiency": 0.68}
        return lm.Scenario(
            shafts={"a": {"inertia": 0.2}, "b": {"inertia": 0.3}, "c": {}, "d": {"friction_torque": 0.2}},
            motors={"m": direct_current(0.001, 1.0, 100.0, 0.005, 10.0, "d")},
            command={"m": 0.9},
            gears={
                "x1": gear_between("a", "b", 2.0, spring, losses=locks),
                "x2": gear_between("b", "c", 90.0, {"kind": "curve", "backlash": 0.0005, "slopes": [4396.306451040023]}),
                "x3": gear_between("c", "d", 2.0, {"kind": "curve", "backlash": 0.001, "slopes": [147921.0279792854]}),
                "closing": gear_between("a", "d", 0.6, losses=constant, **closing),
            },
            mass_matrices={
                "j": {
                    "shafts": ["c", "d"],
                    "matrix": [[0.014768608594581978, 0.0003421195468940676], [0.0003421195468940676, 0.0011858531666905168]],
                }
            },
            simulation=run_of(0.7, 0.001),
        )

    result = lm.simulate(scenario())
    rests = result["a_speed"].values == 0.0
    mesh, other = (result[f"{name}_output_torque"].values[rests] for name in ("x1", "closing"))
    assert (mesh > 0.01).any() and (mesh < -0.01).any()
    held, bounds = -other / (0.6 * 0.68), np.sort([-0.1 * mesh / 2.0, mesh / 0.8 / 2.0], axis=0)
    assert np.all((bounds[0] - 1e-11 <= held) & (held <= bounds[1] + 1e-11))
    # The limit of ever stiffer meshes.
    off = []
    for k in (1e6, 1e8):
        soft = lm.simulate(scenario(stiffness={"kind": "linear", "stiffness": k}, mesh_damping=0.05 * math.sqrt(k)))
        off.append(float(abs(soft["b_speed"] - result["b_speed"]).max() / abs(result["b_speed"]).max()))
    assert off[1] < min(2e-3, 0.03 * off[0])


def test_samples_of_a_large_train_are_right_though_matrices_are_given_up_between_them() -> None:
    """Stick-slip of 40 shafts: hundreds of regimes lie between two samples, and the matrices of all take more memory than is kept."""
    names = [f"s{k}" for k in range(40)]

    def run(interval: float) -> Any:
        load = {"friction_torque": 0.1, "viscous_friction": 0.5, "inertia": 1e-3}
        return lm.simulate(
            lm.Scenario(
                shafts={
                    s: {**load, "torque": {"amplitude": 0.3, "frequency": 1.0 + 0.137 * k, "phase": 0.7 * k}} for k, s in enumerate(names)
                },
                gears={f"g{k}": gear_between(a, b, 1.0, 1.0) for k, (a, b) in enumerate(itertools.pairwise(names))},
                simulation=run_of(0.4, interval),
            )
        )

    coarse, fine = run(0.4), run(0.04)
    assert coarse.attrs["switching_count"] > 200  # matrices of 1.4 MB each, of which 256 MB are kept
    for name in names:
        np.testing.assert_allclose(coarse[f"{name}_speed"].values, fine[f"{name}_speed"].values[::10], rtol=0.0, atol=1e-9)


# --- random trains with gears that lock themselves ---
def run_locking(number: int, stiffness: float | None = None, seed: int = 1) -> Any:
    tables = locking_train(seed, number, stiffness)
    return lm.simulate(lm.Scenario(**{key: table for key, table in tables.items() if table}))


def test_random_trains_with_gears_that_lock_themselves_have_a_motion() -> None:
    for number in range(int(700 * SHARE)):
        energy = lm.energy_of(run_locking(number))
        assert abs(energy["residual"]) <= 1e-9 * energy["turned_over"], number


def test_speeds_that_come_to_nothing_in_ever_shorter_times_are_at_rest() -> None:
    """Three shafts lock, slip on a clutch and lock again, at one instant: the limit of ever stiffer meshes goes on from rest."""
    rigid = run_locking(318)
    speeds = {name: rigid[name].values for name in rigid.data_vars if str(name).endswith("_speed")}
    assert len(speeds) == 5
    for stiffness, share in ((1e7, 2e-3), (1e9, 3e-4)):
        soft = run_locking(318, stiffness)
        for name, speed in speeds.items():
            # Angles, since the teeth of a stiff mesh still rattle.
            angle = np.cumsum(speed)
            assert np.abs(np.cumsum(soft[name].values) - angle).max() < share * np.abs(angle).max()


# 101: the mesh of two shafts comes to overrun; two others turn on beyond a soft mesh, with more inertia than locks.
# 177: two shafts come to their limits at once, beside a gear without a load.
@pytest.mark.parametrize(("seed", "number", "shafts"), [(77, 101, 4), (79, 177, 5)])
def test_gears_that_lock_turn_their_shafts_as_ever_stiffer_meshes_do(seed: int, number: int, shafts: int) -> None:
    runs = (run_locking(number, k, seed) for k in (None, 1e7, 1e9))
    rigid, *soft = ([r[f"s{k}_angle"].values for k in range(shafts)] for r in runs)
    off = [np.abs(np.subtract(s, rigid)).max() / np.abs(rigid).max() for s in soft]
    assert off[1] < min(0.02, 0.5 * off[0])


def test_torques_at_rest_after_a_stop_do_not_depend_on_the_last_bit() -> None:
    """Four shafts on three rigid gears stop at once, and go on to hold the torques that they had."""
    tables = locking_train(78, 193)
    before, *after = (
        {name: at_end(run, f"{name}_output_torque") for name in ("x1", "x2", "x3")}
        for end in (0.28374, 0.2838, 0.285, 0.297, 0.31, 0.34, 0.38)
        for run in [lm.simulate(lm.Scenario(**{k: v for k, v in tables.items() if v}).replace(simulation=run_of(end, end)))]
    )
    for torques in after:
        assert torques == pytest.approx(before, rel=1e-3)
        assert torques == pytest.approx(after[0], rel=1e-11)


def test_a_wedge_that_gives_way_leaves_others_at_rest() -> None:
    """Motor and load turn a gear the same way, which holds T up to M i/|eta_b|; a brake behind a spring holds more gears."""
    tables = {key: table for key, table in locking_train(79, 23).items() if table}
    scenario = lm.Scenario(**tables)
    gear, motor = scenario.gears["x1"], scenario.command["m"].mean
    losses, i = gear.losses, gear.ratio
    instant = float(lm.switchings_of(lm.simulate(scenario))["instant"].values[0])
    result = lm.simulate(scenario.replace(simulation={"duration": instant + 1e-6, "sample_interval": 1e-6}))
    load = at_end(result, "s1_load_torque")
    assert load == pytest.approx(motor * i / losses.backdrive_efficiency, rel=1e-4)
    inertias = [scenario.shafts[name].inertia for name in ("s0", "s1")]
    share = 1.0 / (i * losses.drive_efficiency)
    rate = (motor - load * share) / (inertias[0] + inertias[1] / i * share)
    assert at_end(result, "s0_speed") == pytest.approx(rate * 1e-6, rel=1e-3)
    assert at_end(result, "s2_speed") == 0.0


@pytest.mark.parametrize("number", [130, 280])
def test_wedged_gears_rest_where_ever_stiffer_meshes_come_to_rest(number: int) -> None:
    """The torques between shafts at rest change to the nearest that hold as an input jumps."""
    assert all(np.all(v.values == 0.0) for name, v in run_locking(number).data_vars.items() if str(name).endswith("_speed"))
    turned = []
    for stiffness in (1e5, 1e7, 1e9):
        soft = run_locking(number, stiffness)
        turned.append(max(abs(v.values).sum() * 0.005 for n, v in soft.data_vars.items() if str(n).endswith("_speed")))
    assert turned[2] < 1e-5
    assert turned[2] < 0.2 * turned[1] < 0.04 * turned[0]
