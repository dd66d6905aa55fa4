"""A shaft whose motion is given: the torque that this takes against closed forms, other ways to compute it and a heavy shaft."""

import itertools
import math
import random
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import lostmotion as lm
from conftest import some
from refusals import refusals, refused
from tables import gear_between, run_of

SPRING = {"kind": "linear", "stiffness": 100.0}
CASE: dict[str, Any] = {
    "shafts": {"crank": {"inertia": 1.0, "friction_torque": 0.5, "speed": {"amplitude": 1.0, "frequency": 1.0}}, "load": {"inertia": 1.0}},
    "gears": {"g": {"input": "crank", "output": "load", "ratio": 1.0, "stiffness": SPRING}},
    "simulation": {"duration": 1.0, "sample_interval": 0.01},
}


def scenario(**tables: Any) -> lm.Scenario:
    """The case with some of its tables replaced."""
    return lm.Scenario(**(CASE | tables))


def test_torque_at_a_crank_with_friction_has_its_closed_form() -> None:
    """crank angle (1 - cos W t)/W; load x'' + K x = K times that, from rest; torque W cos W t + K (crank - x) + 0.5 sign."""
    r = lm.simulate(scenario())
    t = r.time.values
    W, k = 2.0 * math.pi, 10.0
    crank = (1.0 - np.cos(W * t)) / W
    load = (1.0 - np.cos(k * t)) / W - k**2 / (k**2 - W**2) * (np.cos(W * t) - np.cos(k * t)) / W
    torque = W * np.cos(W * t) + 100.0 * (crank - load) + 0.5 * np.sign(np.sin(W * t))
    assert np.allclose(r.crank_speed, np.sin(W * t), rtol=0.0, atol=1e-14)
    assert np.allclose(r.crank_acceleration, W * np.cos(W * t), rtol=0.0, atol=1e-14)
    # Rounding of some hundred steps of terms of up to 10.
    inside = np.abs(np.sin(W * t)) > 1e-9  # at the zeros the sign is either
    assert inside.sum() == len(t) - 3
    assert np.allclose(r.load_angle, load, rtol=0.0, atol=1e-13)
    assert np.allclose(r.crank_drive_torque.values[inside], torque[inside], rtol=0.0, atol=2e-12)
    ledger = lm.energy_of(r)
    assert abs(ledger["residual"]) <= 1e-12 * ledger["turned_over"]
    work = np.trapezoid(torque * np.sin(W * t), t)
    assert ledger["crank: given motion"] == pytest.approx(work, rel=1e-3)
    assert ledger["crank: dry friction"] == pytest.approx(0.5 * 2.0 / math.pi, rel=1e-13)  # 0.5 times the mean of |sin|


def test_a_straight_line_of_speed_is_a_matrix_exponential() -> None:
    """Given speed a t on the first of three shafts with springs: scipy's expm of the states with t and 1."""
    a, J, K, c = 3.0, (0.7, 0.2), (40.0, 90.0), 0.03
    s = lm.Scenario(
        shafts={
            "first": {"speed": {"ramps": [{"rise": 2.0 * a, "duration": 2.0}]}, "inertia": 0.4},
            "second": {"inertia": J[0], "viscous_friction": c},
            "third": {"inertia": J[1]},
        },
        gears={"a": gear_between("first", "second", 2.0, K[0]), "b": gear_between("second", "third", 1.0, K[1])},
        simulation=run_of(1.5, 0.125),
    )
    r = lm.simulate(s)
    A = np.zeros((6, 6))  # w1, w2, twist a, twist b, t, 1
    A[0, [0, 2, 3]] = -c / J[0], K[0] / J[0], -K[1] / J[0]
    A[1, 3] = K[1] / J[1]
    A[2, [0, 4]] = -1.0, a / 2.0
    A[3, [0, 1]] = 1.0, -1.0
    A[4, 5] = 1.0
    for k, t in enumerate(r.time.values):
        x = expm(A * t) @ [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        assert r.second_speed.values[k] == pytest.approx(x[0], abs=1e-12)
        assert r.third_speed.values[k] == pytest.approx(x[1], abs=1e-12)
        assert r.first_drive_torque.values[k] == pytest.approx(0.4 * a + K[0] * x[2] / 2.0, abs=1e-12)


def test_rigid_gears_move_with_the_shaft_that_drives_them() -> None:
    """All inertias, dampers and frictions are felt there through the ratio; a shaft beside it may have none."""
    s = lm.Scenario(
        shafts={
            "in": {"inertia": 0.01, "viscous_friction": 0.02},
            "mid": {"inertia": 0.0, "speed": {"mean": 1.0, "amplitude": 3.0, "frequency": 2.0, "phase": 0.4}},
            "out": {"inertia": 5.0, "friction_torque": 2.0, "torque": {"mean": 1.5}},
        },
        gears={"up": {"input": "in", "output": "mid", "ratio": 4.0}, "down": {"input": "mid", "output": "out", "ratio": 10.0}},
        simulation={"duration": 1.2, "sample_interval": 0.007},
    )
    r = lm.simulate(s)
    t, W = r.time.values, 4.0 * math.pi
    w, a = 1.0 + 3.0 * np.sin(W * t + 0.4), 3.0 * W * np.cos(W * t + 0.4)
    torque = (16.0 * 0.01 + 5.0 / 100.0) * a + 16.0 * 0.02 * w + (1.5 + 2.0 * np.sign(w)) / 10.0
    assert np.allclose(r.mid_drive_torque, torque, rtol=0.0, atol=1e-13 * 20.0)
    assert np.allclose(r.in_speed, 4.0 * w, rtol=0.0, atol=1e-13)
    assert np.allclose(r.out_speed, w / 10.0, rtol=0.0, atol=1e-13)
    ledger = lm.energy_of(r)
    assert abs(ledger["residual"]) <= 1e-12 * ledger["turned_over"]


def test_friction_takes_nothing_while_the_given_speed_is_zero() -> None:
    """A move of up, hold and down: 0.5 N m only while it lasts, and exactly none before and after, where the drive holds all."""
    points = {"times": (0.5, 0.8, 1.1, 1.4), "values": (0.0, 0.3, 0.3, 0.0)}
    s = scenario(
        shafts={"crank": {"inertia": 1.0, "friction_torque": 0.5, "speed": {"samples": points}}}, gears={}, simulation=run_of(2.0, 0.05)
    )
    r = lm.simulate(s)
    t = r.time.values
    moves = (t > 0.5) & (t < 1.4)
    torque = np.where(moves, 0.5, 0.0) + np.where((t >= 0.5) & (t < 0.8), 1.0, 0.0) - np.where((t >= 1.1) & (t < 1.4), 1.0, 0.0)
    inside = np.min(np.abs(t[:, None] - np.array(points["times"])), axis=1) > 1e-9
    assert np.allclose(r.crank_drive_torque.values[inside], torque[inside], rtol=0.0, atol=1e-13)
    assert list(r.crank_contact.values[inside]) == list(np.where(moves, 1.0, 0.0)[inside])
    assert np.all(r.crank_speed.values[t > 1.4] == 0.0)


@pytest.mark.parametrize("friction", [0.5, 0.0])
def test_the_speed_is_its_signal_after_a_thousand_periods(friction: float) -> None:
    """To the last bit; the angle is integrated, with the rounding of 1e3 steps of up to 6e-13 each."""
    shafts = CASE["shafts"] | {"crank": CASE["shafts"]["crank"] | {"friction_torque": friction}}
    r = lm.simulate(scenario(shafts=shafts, simulation={"duration": 1000.0, "sample_interval": 0.9}), energy=False)
    t = r.time.values
    W = 2.0 * math.pi
    speed, angle = np.sin(W * np.fmod(t, 1.0)), (1.0 - np.cos(W * np.fmod(t, 1.0))) / W
    assert np.allclose(r.crank_speed, speed, rtol=0.0, atol=3e-16)
    assert np.allclose(r.crank_angle, angle, rtol=0.0, atol=1e-12 if friction else 1e-9)


MOVES = {"start": 0.5, "begin": 0.1, "moves": [{"to": 2.0}, {"to": -1.0, "jerk": 90.0}], "speed": 4.0, "acceleration": 20.0, "dwell": 0.2}


def test_moves_drive_a_shaft_exactly() -> None:
    """Angle, speed and acceleration are those of the reference; the load follows from scipy's integrator between its pieces."""
    shafts = {"crank": {"inertia": 0.3, "friction_torque": 0.5, "motion": MOVES}, "load": {"inertia": 1.0}}
    s = scenario(shafts=shafts, simulation={"duration": 3.0, "sample_interval": 0.01})
    r = lm.simulate(s)
    t = r.time.values
    reference = s.shafts["crank"].motion
    assert reference is not None
    angle, speed, acceleration, _ = reference.at(t)
    breaks = [piece[0] for piece in reference.pieces()]
    inside = np.min(np.abs(t[:, None] - np.array(breaks)), axis=1) > 1e-9
    assert np.allclose(r.crank_angle, angle, rtol=0.0, atol=2e-14)
    assert np.allclose(r.crank_speed, speed, rtol=0.0, atol=4e-15)
    assert np.allclose(r.crank_acceleration.values[inside], acceleration[inside], rtol=0.0, atol=1e-12)
    x, begin = np.array([0.5, 0.0]), 0.0  # of the load, at rest and without twist
    load = np.empty_like(t)
    for end in [*breaks[1:], t[-1] + 1e-9]:
        _, *given = reference.pieces()[max(k for k, b in enumerate(breaks) if b <= begin)]
        at = (t >= begin) & (t < end)

        def rates(time: float, y: np.ndarray, given: list[float] = given, begin: float = begin) -> list[float]:
            h = time - begin
            return [y[1], 100.0 * (given[0] + h * (given[1] + h * (given[2] / 2.0 + h * given[3] / 6.0)) - y[0])]

        found = solve_ivp(rates, (begin, end), x, "DOP853", t_eval=[*t[at], end], rtol=1e-13, atol=1e-14)
        load[at], x, begin = found.y[0][:-1], found.y[:, -1], end
    assert np.allclose(r.load_angle, load, rtol=0.0, atol=1e-11)
    torque = 0.3 * acceleration + 100.0 * (angle - load) + 0.5 * np.sign(speed)
    moving = inside & (np.abs(speed) > 1e-9)
    assert np.allclose(r.crank_drive_torque.values[moving], torque[moving], rtol=0.0, atol=2e-9)
    ledger = lm.energy_of(r)
    assert abs(ledger["residual"]) <= 1e-12 * ledger["turned_over"]


def test_a_slide_of_given_motion_is_the_shaft_of_the_same_numbers() -> None:
    """In mm, m/s and N; its force is the torque of the shaft to the bit."""
    of_shafts = lm.simulate(scenario(shafts={"crank": {"inertia": 2.0, "motion": MOVES}}, gears={}))
    moves = MOVES | {"start": "500 mm", "moves": [{"to": "2000 mm"}, {"to": "-1 m", "jerk": "90 m/s^3"}]}
    moves |= {"speed": "4 m/s", "acceleration": "20 m/s^2"}
    tables = {"shafts": {}, "gears": {}, "slides": {"table": {"mass": "2 kg", "motion": moves}}}
    r = lm.simulate(scenario(**tables))
    same = {"position": "angle", "speed": "speed", "acceleration": "acceleration", "drive_force": "drive_torque"}
    for name, other in same.items():
        assert np.array_equal(r[f"table_{name}"], of_shafts[f"crank_{other}"]), name
    units = {name: r[name].attrs["units"] for name in map(str, r)}
    assert units["table_drive_force"] == "N"
    assert not any("rad" in unit or "N*m" in unit for unit in units.values())
    speed = {"amplitude": "100 mm/s", "frequency": 1.0}
    wave = lm.simulate(scenario(**tables | {"slides": {"table": {"mass": 2.0, "speed": speed}}}))
    assert np.allclose(wave.table_speed, 0.1 * np.sin(2.0 * math.pi * wave.time), rtol=0.0, atol=1e-16)


def test_the_force_at_a_slide_drives_its_screw() -> None:
    """Rigid screw of lead p: force m a + (2 pi/p)^2 J a + friction, at constant acceleration."""
    p = 0.01
    s = lm.Scenario(
        shafts={"screw": {"inertia": 1e-4}},
        slides={"table": {"mass": 20.0, "friction_force": 30.0, "speed": {"ramps": [{"rise": 1.0, "duration": 0.5}]}}},
        screws={"lead": {"input": "screw", "output": "table", "lead": p}},
        simulation={"duration": 0.4, "sample_interval": 0.01},
    )
    force = lm.simulate(s).table_drive_force.values[1:]
    assert np.allclose(force, (20.0 + 1e-4 * (2.0 * math.pi / p) ** 2) * 2.0 + 30.0, rtol=1e-14)


def test_steps_move_a_slide_by_its_position() -> None:
    table = {"mass": 3.0, "speed": 0.0}
    simulation = lm.Simulation(scenario(shafts={}, gears={}, slides={"table": table}), step=0.1)
    simulation.advance(0.1, motion={"table": {"position": "1 mm", "speed": 0.03, "acceleration": 0.6}})
    assert simulation["table_position"] == pytest.approx(1e-3, abs=1e-17)
    assert simulation["table_drive_force"] == pytest.approx(1.8, rel=1e-13)
    assert "motion.table.angle: is not known" in refused(lambda: simulation.advance(0.1, motion={"table": {"angle": 1.0, "speed": 0.0}}))


ONE = {"inertia": 1.0}


def moved(crank: Any, load: Any = ONE, **more: Any) -> lm.Scenario:
    return scenario(shafts={"crank": {"inertia": 1.0, **crank}, "load": load}, **more)


test_a_motion_that_no_torque_gives_is_refused = refusals(
    (lambda: moved({"motion": {"steps": [{"height": 1.0, "time": 0.5}]}}), "shafts.crank.motion: its position jumps at 0.5 s from 0 to 1 rad"),
    (lambda: moved({"motion": {"ramps": [{"rise": 1.0, "duration": 0.5, "begin": 0.1}]}}), "shafts.crank.motion: its speed jumps at 0.1 s from 0 to 2 rad/s"),
    (lambda: moved({"motion": MOVES}, initial={"angles": {"crank": 1.0}}), "shafts.crank.motion, initial.angles.crank: both say where the shaft is at t = 0"),
    (lambda: moved({"motion": MOVES}, initial={"speeds": {"crank": 1.0}}), "shafts.crank.motion, initial.speeds.crank: both say how fast the shaft turns at t = 0"),
    (lambda: moved({"motion": MOVES, "speed": 1.0}), "shafts.crank.speed, shafts.crank.motion"),
    (lambda: moved({"speed": {"steps": [{"height": 1.0, "time": 0.5}]}}), "shafts.crank.speed: jumps at 0.5 s from 0 to 1 rad/s"),
    (lambda: moved({"speed": "3 m/s"}), "shafts.crank.speed.mean"),
    (lambda: moved({"speed": 1.0}, {"inertia": 1.0, "speed": 1.0}, gears={"g": {"input": "crank", "output": "load", "ratio": 1.0}}), "gears.g: is rigid and joins shafts whose motions are both given; give it a stiffness"),
    (lambda: scenario(initial={"speeds": {"crank": 1.0}}), "shafts.crank.speed, initial.speeds.crank: both say how fast the shaft turns"),
    (lambda: lm.linearize(scenario(), time=0.5), ": shafts.crank.speed gives the motion of a shaft"),
    (lambda: lm.simulate(scenario(), sensitivities=["shafts.load.inertia"]), ": shafts.crank.speed gives the motion of a shaft"),
    (lambda: lm.frequency_response(scenario(), [1.0], 0.1), ": shafts.crank.speed gives the motion of a shaft"),
    (lambda: lm.periodic_motion(scenario()), ": shafts.crank.speed gives the motion of a shaft"),
)  # fmt: skip


def heavy(s: lm.Scenario, inertia: float = 1e12) -> lm.Scenario:
    """The same with an inertia on each of those shafts that a torque turns as the motion is given: that torque is all but exact."""
    data = s.model_dump()
    for name, shaft in data["shafts"].items():
        if shaft["speed"] is None:
            continue
        speed = s.shafts[name].speed
        assert speed is not None
        (mean, *steps), sines = speed.acceleration().breakpoint_list(), speed.acceleration().sine_list()
        jumps = [(t, a - b) for (t, a, _), (_, b, _) in zip(steps, [mean, *steps], strict=False)]
        shaft |= {
            "speed": None,
            "inertia": inertia,
            "torque": {
                "mean": -inertia * mean[1],
                "steps": [{"time": t, "height": -inertia * j} for t, j in jumps],
                "sines": [{"amplitude": -inertia * a, "frequency": f, "phase": p} for a, f, p in sines],
            },
        }
    data["initial"]["speeds"] = dict(s.begin().speeds)
    return lm.Scenario(**data)


def random_train(seed: int) -> lm.Scenario:
    """Two to five shafts in a row, one or two of them with a given motion."""
    draw = random.Random(seed)
    names = [f"s{k}" for k in range(draw.randint(2, 5))]
    shafts: dict[str, Any] = {
        name: {
            "inertia": 10.0 ** draw.uniform(-1.0, 0.5),
            "friction_torque": draw.choice([0.0, draw.uniform(0.1, 1.0)]),
            "viscous_friction": draw.choice([0.0, draw.uniform(0.0, 0.5)]),
        }
        for name in names
    }
    for name in names:
        if shafts[name]["friction_torque"] and draw.random() < 0.3:
            shafts[name]["breakaway_torque"] = 1.5 * shafts[name]["friction_torque"]
    gears: dict[str, Any] = {}
    clutches: dict[str, Any] = {}
    for k, (a, b) in enumerate(itertools.pairwise(names)):
        kind = draw.choice(["rigid", "soft", "soft", "play", "hysteresis", "lossy", "clutch"])
        gear: dict[str, Any] = {"input": a, "output": b, "ratio": draw.choice([1.0, 2.0, 3.5])}
        k_gear = 10.0 ** draw.uniform(1.0, 2.5)
        if kind in ("soft", "hysteresis", "lossy"):
            gear["stiffness"] = {"kind": "linear", "stiffness": k_gear}
        if kind == "play":
            gear |= {"stiffness": {"kind": "curve", "backlash": 0.05, "slopes": [k_gear]}}
        if kind == "hysteresis":
            gear["hysteresis"] = {"efficiency": draw.uniform(0.7, 0.95)}
        if kind == "lossy":
            gear["losses"] = {"kind": "mesh_efficiency", "drive_efficiency": 0.9, "backdrive_efficiency": 0.85}
        if kind == "clutch":
            clutches[f"c{k}"] = {"kind": "safety", "input": a, "output": b, "torque": draw.uniform(0.2, 3.0)}
        else:
            gears[f"g{k}"] = gear

    def motion() -> dict[str, Any]:
        if draw.random() < 0.4:
            times = sorted(draw.uniform(0.0, 1.4) for _ in range(draw.randint(2, 5)))
            values = [draw.choice([0.0, draw.uniform(-3.0, 3.0)]) for _ in times]
            return {"samples": {"times": tuple(times), "values": tuple(values)}}
        return {
            "mean": draw.choice([0.0, draw.uniform(-1.0, 1.0)]),
            "amplitude": draw.uniform(0.5, 3.0),
            "frequency": draw.uniform(0.5, 3.0),
            "phase": draw.uniform(0.0, 6.0),
        }

    driven = draw.sample(names, 1 if draw.random() < 0.7 else 2)
    for name in driven:
        shafts[name]["speed"] = motion()
    free = [name for name in names if name not in driven]
    if free and draw.random() < 0.5:
        shafts[draw.choice(free)]["torque"] = {"amplitude": draw.uniform(0.5, 4.0), "frequency": draw.uniform(0.3, 2.0)}
    return lm.Scenario(shafts=shafts, gears=gears, clutches=clutches, simulation={"duration": 1.5, "sample_interval": 0.01})


def random_trains(seeds: range) -> list[lm.Scenario]:
    """Those of these that are trains: two shafts of a rigid group cannot both be given."""
    found = []
    for seed in seeds:
        try:
            found.append(random_train(seed))
        except lm.InputError as problem:
            assert "whose motions are both given" in str(problem), seed
    return found


def compared(name: str) -> bool:
    """Whether a variable is compared between two ways to compute a motion: those that do not jump."""
    return name.endswith(("_speed", "_angle", "_twist"))


@pytest.mark.parametrize("block", range(some(8, 2)))
def test_both_solvers_agree_on_random_trains(block: int) -> None:
    for s in random_trains(range(40 * block, 40 * block + 40)):
        exact = lm.simulate(s)
        coarse, fine = (lm.simulate(s, solver="dormand-prince", relative_tolerance=tolerance) for tolerance in (1e-7, 1e-9))
        for name in filter(compared, map(str, exact)):
            size = max(1e-3, float(abs(exact[name]).max()))
            open_by = float(abs(coarse[name] - fine[name]).max()) / size
            assert float(abs(exact[name] - fine[name]).max()) <= (4.0 * open_by + 1e-7) * size, (s, name)
        ledger = lm.energy_of(exact)
        assert abs(ledger["residual"]) <= 1e-10 * ledger["turned_over"], s


@pytest.mark.parametrize("block", range(some(4, 1)))
def test_it_is_the_limit_of_a_heavy_shaft_that_is_driven_by_force(block: int) -> None:
    """With 1e12 kg m2 the torques of the train, of up to some 1e3 N m, change its speed by 1e-9 rad/s in a second and its angle, in
    growing twists, by less; springs of 1e2 N m/rad make 1e-7 N m of that."""
    jammed = 0
    for s in random_trains(range(1000 + 30 * block, 1030 + 30 * block)):
        given = lm.simulate(s)
        try:
            forced = lm.simulate(heavy(s), energy=False)
        except lm.SolverError:  # torques of 1e12 and of 1 N m leave few digits to the statics
            jammed += 1
            continue
        for name in map(str, given):
            if name.endswith(("_speed", "_twist")):
                size = max(1.0, float(abs(given[name]).max()))
                assert float(abs(given[name] - forced[name]).max()) <= 1e-6 * size, (s, name)
    assert jammed <= 1


def test_the_torque_is_the_rate_of_momentum_and_what_is_lost() -> None:
    """On random trains: its work over the run, by Simpson's rule, is what the ledger says."""
    for s in random_trains(range(2000, 2030)):
        r = lm.simulate(s.replace(**{"simulation.sample_interval": 1e-4}))
        ledger = lm.energy_of(r)
        for name in s.given():
            power = (r[f"{name}_drive_torque"] * r[f"{name}_speed"]).values
            # The torque jumps where contacts switch; a sample on either side of a jump leaves half an interval of it.
            jumps = float(np.abs(np.diff(power)).sum()) * 1e-4
            assert abs(np.trapezoid(power, dx=1e-4) - ledger[f"{name}: given motion"]) <= jumps + 1e-9


def test_a_given_angle_begins_at_zero_or_where_it_is_told() -> None:
    """Also with a twist behind it: angles over which a mesh error or a torque acts are not shifted."""
    tables: dict[str, Any] = {
        "shafts": {"a": {"inertia": 1.0, "speed": {"mean": 2.0}}, "b": {"inertia": 0.1}},
        "gears": {"g": {"input": "a", "output": "b", "ratio": 3, "stiffness": {"kind": "linear", "stiffness": 1e3}}},
        "initial": {"twists": {"g": 0.01}, "speeds": {"b": 2.0 / 3.0}},
    }
    for angles, first in (({}, 0.0), ({"a": 0.5}, 0.5), ({"b": 0.2}, 3.0 * (0.2 + 0.01))):
        r = lm.simulate(scenario(**tables | {"initial": {**tables["initial"], "angles": angles}}))
        assert np.allclose(r.a_angle, first + 2.0 * r.time, rtol=1e-13, atol=1e-13)
        assert float(r.b_angle[0]) == pytest.approx(first / 3.0 - 0.01, rel=1e-13)
    tables["gears"]["g"]["transmission_error"] = {"kind": "sine", "order": 1, "amplitude": 1e-3, "phase": 1.0}
    tables["initial"] = {"speeds": {"b": 2.0 / 3.0}, "twists": {"g": 0.01}}
    r = lm.simulate(scenario(**tables))
    assert np.allclose(r.a_angle, 2.0 * r.time, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("ratio", [4.0, 0.5])
def test_a_given_shaft_needs_no_inertia_behind_backlash(ratio: float) -> None:
    """Its speed follows from no balance: all others move as with any inertia of it, and its torque is what the mesh takes."""
    tables: dict[str, Any] = {
        "shafts": {"p": {"speed": {"amplitude": 5.0, "frequency": 1.3}}, "x": {"inertia": 15.0, "friction_torque": 1.0}},
        "gears": {"g": gear_between("p", "x", ratio, {"kind": "curve", "slopes": [1e4], "backlash": 1e-3}, mesh_damping=30.0)},
    }
    alone = lm.simulate(scenario(**tables))
    heavy = lm.simulate(scenario(**tables | {"shafts": {**tables["shafts"], "p": {**tables["shafts"]["p"], "inertia": 2.0}}}))
    for name in ("x_speed", "x_angle", "g_twist", "p_speed"):
        assert np.allclose(alone[name], heavy[name], rtol=1e-10, atol=1e-12)
    assert np.allclose(alone.p_drive_torque, alone.g_output_torque / ratio, rtol=1e-12, atol=1e-12)


def test_steps_meet_the_motion_that_is_given_at_their_ends() -> None:
    """Angle, speed and acceleration of sin(t), in steps of 0.05 s: they are met to rounding, without drift over 400 steps."""
    simulation = lm.Simulation(scenario(), step=0.05)
    for k in range(1, 401):
        t = 0.05 * k
        simulation.advance(0.05, motion={"crank": {"angle": 1.0 - math.cos(t), "speed": math.sin(t), "acceleration": math.cos(t)}})
        # The twist less the two angles is integrated beside them.
        load, twist = simulation["load_angle", "g_twist"]
        assert load + twist == pytest.approx(1.0 - math.cos(t), abs=1e-12)
        assert simulation["crank_speed"] == pytest.approx(math.sin(t), abs=1e-13)
        assert simulation["crank_acceleration"] == pytest.approx(math.cos(t), abs=1e-12)
        friction = 0.5 * np.sign(math.sin(t))
        assert simulation["crank_drive_torque"] == pytest.approx(math.cos(t) + 100.0 * twist + friction, abs=1e-11)


def test_steps_of_constant_acceleration_are_the_run() -> None:
    """A ramp of speed step by step has the bits of no other way, but its values to rounding."""
    ramp = {"ramps": [{"rise": 3.0, "duration": 1.0}]}
    s = scenario(shafts=CASE["shafts"] | {"crank": {"inertia": 1.0, "friction_torque": 0.5, "speed": ramp}})
    simulation, r = lm.Simulation(s, step=0.01), lm.simulate(s)
    for k in range(1, 100):
        simulation.advance(0.01, motion={"crank": {"speed": 0.03 * k}})
        assert simulation["crank_drive_torque"] == pytest.approx(float(r.crank_drive_torque[k]), abs=1e-12)
        assert simulation["load_speed"] == pytest.approx(float(r.load_speed[k]), abs=1e-13)


def test_a_train_alone_takes_the_given_shafts_by_name_and_a_step_their_motions() -> None:
    train = scenario().train()
    simulation = lm.Simulation(train, given=["load"])
    assert simulation.given == ("load",)
    simulation.advance(0.1, motion={"load": {"speed": 2.0}})
    assert simulation["load_speed"] == 2.0
    refused(lambda: lm.Simulation(train, given=["cranc"]), reason='given: "cranc" is no shaft of this train')
    simulation = lm.Simulation(scenario())
    for motion, says in (
        (None, "motion.crank: is missing; give at least its speed"),
        ({"crank": {"angle": 1.0}}, "motion.crank.speed: is missing"),
        ({"crank": {"speed": 1.0, "spee": 1.0}}, "motion.crank.spee: is not known"),
        ({"crank": {"speed": 1.0}, "load": {"speed": 1.0}}, 'motion."load": is no shaft whose motion is given'),
        ({"crank": 3.0}, "motion.crank: 3.0 must name what is given"),
    ):
        assert says in refused(lambda motion=motion: simulation.advance(1e-3, motion=motion))
    assert simulation.time == 0.0


@pytest.mark.parametrize("inertia", [1e10, 1e12, 1e15])
def test_a_freewheel_on_a_great_inertia_is_one_on_a_given_motion(inertia: float) -> None:
    """The limit of a shaft that nothing slows down: it overtakes, takes along and lets go at the instants of a given speed."""
    tables: dict[str, Any] = {
        "shafts": {
            "a": {"inertia": inertia, "torque": {"amplitude": 0.5 * inertia, "frequency": 0.5}},
            "b": {"inertia": 1.0, "friction_torque": 0.2, "torque": {"amplitude": 1.0, "frequency": 1.3}},
        },
        "freewheels": {"f": {"input": "a", "output": "b"}},
        "gears": {},
        "simulation": {"duration": 5.0, "sample_interval": 0.01},
    }
    heavy = lm.simulate(scenario(**tables))
    # a' = -0.5 sin(pi t)
    speed = {"mean": -0.5 / math.pi, "amplitude": 0.5 / math.pi, "frequency": 0.5, "phase": 0.5 * math.pi}
    given = lm.simulate(scenario(**tables | {"shafts": {**tables["shafts"], "a": {"speed": speed}}}))
    assert int(heavy.attrs["switching_count"]) == int(given.attrs["switching_count"]) > 10
    assert np.allclose(heavy.b_speed, given.b_speed, rtol=0.0, atol=10.0 / inertia + 1e-11)
