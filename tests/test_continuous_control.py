"""Continuous controllers in a train, against closed forms and independent integrations."""

import functools
import itertools
import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import lostmotion as lm
from conftest import some
from lostmotion.simulation.forms.key_aliases import DRIVE
from refusals import file_of, refusals_of, refused
from tables import constant_efficiency, gear_between, run_of, torque_source

J = 1.0  # kg m2
PID = {"gain": 4.0, "integral_gain": 1.5, "derivative_gain": 0.8}
M = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.5 / J, -4.0 / J, -0.8 / J]])  # of e, e', e'' while it slips


def inertia(friction: float, breakaway: float, duration: float, **controller: Any) -> lm.Scenario:
    """A PID position loop on one inertia with dry friction."""
    return lm.Scenario(
        shafts={"axis": {"inertia": J, "friction_torque": friction, "breakaway_torque": breakaway}},
        motors={"servo": {"shaft": "axis", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 0.0}},
        controllers={"servo": {"kind": "continuous", "reference": {"kind": "position", "mean": 1.0}, "position": PID} | controller},
        simulation={"duration": duration, "sample_interval": 0.01},
    )


def rests(run: xarray.Dataset) -> np.ndarray:
    """The errors at which it sticks, one after the other."""
    stuck = run["axis_contact"].values == 0
    error = run["servo_error"].values
    return np.array([next(group)[1] for held, group in itertools.groupby(zip(stuck, error, strict=True), lambda p: p[0]) if held])


def slip(start: np.ndarray, before: float = 40.0) -> float:
    """When e' first returns to zero after a start at rest."""
    t = np.linspace(1e-3, before, 40_000)
    step = expm(M * (t[1] - t[0]))
    z, states = expm(M * t[0]) @ start, []
    for _ in t:
        states.append(z[1])
        z = step @ z
    k = int(np.flatnonzero(np.sign(states[1:]) != np.sign(states[:-1]))[0])
    return float(brentq(lambda s: (expm(M * s) @ start)[1], t[k], t[k + 1], xtol=1e-15, rtol=1e-15))


def test_without_static_friction_errors_shrink_in_a_fixed_ratio_forever() -> None:
    """Each slip begins at zero net torque: e''' + k_d e'' + k_p e' + k_i e = 0 from (e, 0, 0) until e' = 0 again."""
    run = lm.simulate(inertia(0.3, 0.3, 300.0))
    e = rests(run)
    start = np.array([1.0, 0.0, 0.0])
    ratio = float((expm(M * slip(start)) @ start)[0])
    assert len(e) > 8
    assert abs(ratio) < 1.0
    # The error is a difference from the reference, 1 rad: rounding of the angle counts by its share.
    np.testing.assert_allclose(e[1:8] / e[:7], ratio, rtol=0.0, atol=1e-12 / np.abs(e[:7]).min())


@functools.cache
def hunting(excess: float) -> tuple[float, float]:
    """Amplitude [rad] and period [s] of the limit cycle by F_s - F_c: a slip from (e, 0, -excess) ends at -e."""
    one, two = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -excess / J])

    def mismatch(t: float) -> float:
        a, b = expm(M * t) @ one, expm(M * t) @ two
        return float(a[1] * b[0] - b[1] * (1.0 + a[0]))

    def amplitude(t: float) -> float:
        return float(-(expm(M * t) @ two)[0] / (1.0 + (expm(M * t) @ one)[0]))

    grid = np.linspace(0.05, 20.0, 4000)
    values = [mismatch(t) for t in grid]
    for k in np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1])):
        t = float(brentq(mismatch, grid[k], grid[k + 1], xtol=1e-15, rtol=1e-15))
        e = amplitude(t)
        if e > 0.0 and abs(slip(e * one + two) - t) < 1e-9:
            return e, t
    raise AssertionError("no symmetric limit cycle")


def test_with_static_friction_it_hunts_in_proportion_to_the_excess() -> None:
    friction = 0.3
    for excess in (0.1, 0.2):
        e, t = hunting(excess)
        at_stop = expm(M * t) @ np.array([e, 0.0, -excess / J])
        torque = friction - J * at_stop[2]  # of the motor, when it stops
        stick = (torque + friction + excess) / (PID["integral_gain"] * e)
        run = lm.simulate(inertia(friction, friction + excess, 2000.0))
        found = rests(run)[-6:]
        np.testing.assert_allclose(np.abs(found), e, rtol=1e-11)
        assert np.all(np.sign(found[1:]) == -np.sign(found[:-1]))
        instants = lm.switchings_of(run)["instant"].values
        assert instants[-1] - instants[-5] == pytest.approx(2.0 * (t + stick), rel=1e-11)
    assert hunting(0.2)[0] == pytest.approx(2.0 * hunting(0.1)[0], rel=1e-11)


# --- linear, limited, random ---
TWO_MASSES: dict[str, Any] = {
    "shafts": {"motor": {"inertia": 0.002, "viscous_friction": 0.01}, "load": {"inertia": 0.05, "viscous_friction": 0.02}},
    "gears": {
        "belt": gear_between(
            "motor", "load", 4.0, 300.0, rated_input_speed=100.0, rated_output_torque=20.0, losses=constant_efficiency(1.0)
        )
    },
    "motors": {"servo": torque_source(0.0, "motor", rated_torque=2.0)},
}
LOOP: dict[str, Any] = {
    "kind": "continuous",
    "reference": {"kind": "position", "mean": 0.4},
    "position": {"gain": 6.0, "integral_gain": 9.0, "derivative_gain": 0.6, "filter_time": "20 ms", "derivative_weight": 0.5},
}


def two_masses(duration: float = 2.0, interval: float = 0.05, **controller: Any) -> lm.Scenario:
    return lm.Scenario(**TWO_MASSES, controllers={"servo": LOOP | controller}, simulation=run_of(duration, interval))


def plant_rates(w: float, load: float, twist: float, torque: float) -> tuple[float, float, float]:
    """Rates of both speeds and of the twist."""
    passed = 300.0 * twist
    return (torque - 0.01 * w - passed / 4.0) / 0.002, (passed - 0.02 * load) / 0.05, w / 4.0 - load


def test_linear_loop_of_two_masses_is_the_matrix_exponential() -> None:
    """States w, w_load, twist, angle, integral [N·m], filter [rad], 1."""
    k_p, k_i, k_d, tau, c, r = 6.0, 9.0, 0.6, 0.02, 0.5, 0.4
    A = np.zeros((7, 7))
    error, slow = np.zeros(7), np.zeros(7)
    error[[3, 6]] = -1.0, r
    slow[[3, 6]] = -1.0, c * r
    filtered = slow - np.eye(7)[5]
    torque = k_p * error + np.eye(7)[4] + k_d / tau * filtered
    for k in range(3):
        column = np.zeros(3)
        column[k] = 1.0
        A[:3, k] = plant_rates(*column, 0.0)
    A[0] += torque / 0.002
    A[3, 1] = 1.0
    A[4] = k_i * error
    A[5] = filtered / tau
    x = np.zeros(7)
    x[5], x[6] = c * r, 1.0  # the filter has settled
    run = lm.simulate(two_masses())
    step = expm(A * 0.05)
    names = ["motor_speed", "load_speed", "belt_twist", "load_angle", "servo_integral", "servo_filter"]
    expected = [x]
    for _ in run["time"].values[1:]:
        expected.append(step @ expected[-1])
    for k, name in enumerate(names):
        wanted = np.array(expected)[:, k]
        np.testing.assert_allclose(run[name].values, wanted, rtol=0.0, atol=1e-12 * np.abs(wanted).max())
    np.testing.assert_allclose(2.0 * run["servo_command"].values, np.array(expected) @ torque, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("anti_windup", [None, 0.1])
def test_limit_and_anti_windup_are_those_of_an_independent_integration(anti_windup: float | None) -> None:
    limit, k_p, k_i, k_d, r = 1.2, 1.5, 8.0, 0.1, 3.2
    k_t = k_i / k_p if anti_windup is None else 1.0 / anti_windup

    def output(x: np.ndarray) -> float:
        return float(k_p * (r - x[3]) + x[4] - k_d * x[0])

    def rates(side: int) -> Callable[[float, np.ndarray], list[float]]:
        def f(_: float, x: np.ndarray) -> list[float]:
            v = output(x)
            u = side * limit if side else v
            return [*plant_rates(x[0], x[1], x[2], u), x[0], k_i * (r - x[3]) + k_t * (u - v)]

        return f

    def event(level: float) -> Callable[[float, np.ndarray], float]:
        def g(_: float, x: np.ndarray) -> float:
            return output(x) - level

        g.terminal = True  # type: ignore[attr-defined]
        return g

    t, x, side, crossings = 0.0, np.zeros(5), 1, []
    while t < 3.0:
        levels = [limit, -limit] if side == 0 else [side * limit]
        found = solve_ivp(rates(side), (t, 3.0), x, "DOP853", rtol=1e-12, atol=1e-13, max_step=2e-3, events=[event(v) for v in levels])
        t, x = float(found.t[-1]), found.y[:, -1]
        if t >= 3.0:
            break
        crossings.append(t)
        v = output(x)
        side = (1 if v > 0.0 else -1) if side == 0 else 0
        x = found.y[:, -1] + 1e-12 * np.array(rates(side)(t, x))  # off the event
        t += 1e-12
    pid = {"gain": k_p, "integral_gain": k_i, "derivative_gain": k_d}
    run = lm.simulate(
        two_masses(
            3.0,
            0.5,
            shaft="motor",
            reference={"kind": "position", "mean": r},
            position=pid,
            limit=limit,
            **({} if anti_windup is None else {"anti_windup_time": anti_windup}),
        )
    )
    instants = lm.switchings_of(run)["instant"].values
    assert crossings
    np.testing.assert_allclose(instants, crossings, atol=1e-8)
    end = json.loads(run.attrs["end_state"])
    names = ["motor_speed", "load_speed", "belt_twist", "motor_angle", "servo_integral"]
    np.testing.assert_allclose([end[name] for name in names], x, rtol=1e-7, atol=1e-9)
    assert np.abs(run["servo_command"].values).max() <= 0.5 * limit


def random_scenario(rng: np.random.Generator) -> lm.Scenario:
    """Backlash, friction, static friction, limits, PID and state spaces, at random."""
    tables = json.loads(json.dumps(TWO_MASSES))
    tables["shafts"]["load"]["friction_torque"] = friction = float(rng.uniform(0.0, 1.0))
    if friction and rng.random() < 0.5:
        tables["shafts"]["load"]["breakaway_torque"] = friction * float(rng.uniform(1.0, 1.6))
    if rng.random() < 0.5:
        tables["gears"]["belt"]["stiffness"] = {
            "kind": "curve",
            "backlash": float(rng.uniform(0.005, 0.05)),
            "slopes": [300.0],
            "breaks": [],
        }
    controller: dict[str, Any] = {"kind": "continuous", "shaft": str(rng.choice(["motor", "load"]))}
    kind = str(rng.choice(["position", "speed"]))
    wave = {"amplitude": float(rng.uniform(0.1, 1.0)), "frequency": float(rng.uniform(0.3, 2.0))}
    controller["reference"] = {"kind": kind, "mean": float(rng.uniform(-1.0, 1.0))} | wave
    filter_time = float(rng.uniform(0.005, 0.05))
    if rng.random() < 0.3:
        controller["state_space"] = {"A": [[-5.0, 1.0], [0.0, -8.0]], "B": [[1.0], [10.0]], "C": [3.0, 1.0], "D": [2.0]}
        if rng.random() < 0.5:
            controller["state_space"]["back_calculation"] = [1.0, -2.0]
    else:
        gains = {"position": (6.0, 9.0, 0.6), "speed": (0.6, 2.0, 0.01)}[kind]
        k_p, k_i, k_d = (float(g * rng.uniform(0.3, 1.5)) for g in gains)
        controller[kind] = {"gain": k_p, "integral_gain": k_i, "derivative_gain": k_d, "filter_time": filter_time}
        controller[kind] |= {"derivative_weight": float(rng.uniform(0.0, 1.0)), "proportional_weight": float(rng.uniform(0.0, 1.0))}
        if rng.random() < 0.5:
            controller["anti_windup_time"] = float(rng.uniform(0.05, 0.5))
    controller["limit"] = float(rng.uniform(0.5, 3.0))  # so that none grows without bound
    if rng.random() < 0.4:
        controller["current"] = {"kind": "first_order", "time_constant": 0.002}
    return lm.Scenario(**tables, controllers={"servo": controller}, simulation={"duration": 2.0, "sample_interval": 0.02})


def test_exact_and_adaptive_solver_agree_on_random_loops_and_the_energy_ledger_closes() -> None:
    rng = np.random.default_rng(20261122)
    switchings, cases = 0, some(60, 20)
    for _ in range(cases):
        scenario = random_scenario(rng)
        exact = lm.simulate(scenario)
        adaptive = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-13)
        switchings += exact.attrs["switching_count"]
        for name in ("load_angle", "load_speed", "servo_command"):
            a, b = exact[name].values, adaptive[name].values
            np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-6 * max(np.abs(a).max(), 1e-3), err_msg=name)
        ledger = lm.energy_of(exact)
        assert abs(ledger["residual"]) <= 1e-11 * ledger["turned_over"]
    assert switchings > 5 * cases


def test_linear_model_has_the_controller_inside() -> None:
    """Closed-loop poles against the characteristic polynomial of plant and PID, and the steady response to the reference."""
    model = lm.linearize(two_masses())
    poles = np.sort_complex(np.linalg.eigvals(model.A))
    # Position over torque of the plant: 300/4 / ((J1 s + b1) s ((J2 s + b2) s + 300) + ...), by its polynomial.
    first, second = np.poly1d([0.002, 0.01, 0.0]), np.poly1d([0.05, 0.02, 0.0])  # of both angles
    denominator = first * (second + 300.0) + second * (300.0 / 16.0)
    pid_top = np.poly1d([6.0 * 0.02 + 0.6, 6.0 + 9.0 * 0.02, 9.0])
    pid_bottom = np.poly1d([0.02, 1.0, 0.0])
    closed = denominator * pid_bottom + 75.0 * pid_top
    np.testing.assert_allclose(poles, np.sort_complex(closed.roots), rtol=1e-9, atol=1e-9)
    gain = model.response([1e-4], "load_angle", "servo_reference")
    assert abs(gain[0]) == pytest.approx(1.0, abs=1e-6)


# --- limit cycles ---
def test_limit_cycle_with_static_friction_is_that_of_the_closed_form() -> None:
    """State and period to rounding; its multiplier is the square of that of half a period, by symmetry."""
    for excess in (0.1, 0.2):
        e, t = hunting(excess)
        at_stop = expm(M * t) @ np.array([e, 0.0, -excess / J])
        stick = (0.3 - J * at_stop[2] + 0.3 + excess) / (PID["integral_gain"] * e)
        cycle = lm.servo.limit_cycle(inertia(0.3, 0.3 + excess, 100.0))
        assert cycle.exact
        assert cycle.stable
        assert cycle.period == pytest.approx(2.0 * (t + stick), rel=1e-13)
        assert cycle.amplitudes["axis_angle"] == pytest.approx(e, rel=1e-12)
        assert set(cycle.causes) == {"dry friction", "static friction"}
        # From e + de the next slip ends at -(e + de) f(de/excess): a difference quotient of the closed form.
        h = 1e-6 * e
        ends = []
        for start in (e - h, e + h):
            z = np.array([start, 0.0, -excess / J])
            ends.append((expm(M * slip(z)) @ z)[0])
        assert cycle.multipliers[0] == pytest.approx(((ends[1] - ends[0]) / (2.0 * h)) ** 2, rel=1e-6)


def test_without_static_friction_or_with_a_small_gain_there_is_none_and_why() -> None:
    assert repr(lm.servo.limit_cycle(inertia(0.3, 0.3, 100.0))).startswith("no limit cycle: it comes to rest")
    assert not lm.servo.limit_cycle(play_loop(2.0, 1e-4)).cycles


def play(gain: float) -> tuple[float, float]:
    """Amplitude before a play of width 1 and period of K/(s (s + 1)) closed through it, from the reversal at X on."""

    def phases(X: float) -> tuple[float, float, float]:
        gap = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, -gain * (X - 0.5)], [0.0, 0.0, 0.0]])
        touch = np.array([[0.0, 1.0, 0.0], [-gain, -1.0, -0.5 * gain], [0.0, 0.0, 0.0]])
        start = np.array([X, 0.0, 1.0])
        first = brentq(lambda s: (expm(gap * s) @ start)[0] - (X - 1.0), 0.0, 4.0, xtol=1e-15)
        z = expm(gap * first) @ start
        second = brentq(lambda s: (expm(touch * s) @ z)[1], 1e-9, np.pi / np.sqrt(gain - 0.25), xtol=1e-15)
        return float(first), float(second), float((expm(touch * second) @ z)[0])

    X = float(brentq(lambda X: phases(X)[2] + X, 0.8, 1.8, xtol=1e-14))
    first, second, _ = phases(X)
    return X, 2.0 * (first + second)


def play_loop(gain: float, small: float) -> lm.Scenario:
    """A motor of inertia 1 and viscous friction 1 that takes along, through a play, a load of hardly any inertia.

    `small`: viscous friction of the load, of which that of the motor would have a like share less; the load stops within a
    small time when the flanks part.
    """
    stiffness = 1e7 * small  # 1e-7 s until the flanks carry
    gear = {
        "input": "motor",
        "output": "load",
        "ratio": 1.0,
        "rated_input_speed": 1.0,
        "rated_output_torque": 1.0,
        "stiffness": {"kind": "curve", "backlash": 1.0, "slopes": [stiffness], "breaks": []},
        "losses": {"kind": "constant_efficiency", "efficiency": 1.0},
    }
    return lm.Scenario(
        shafts={"motor": {"inertia": 1.0, "viscous_friction": 1.0 - small}, "load": {"inertia": 1e-8 * small, "viscous_friction": small}},
        motors={"drive": {"shaft": "motor", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 0.0}},
        gears={"play": gear},
        controllers={"drive": {"kind": "continuous", "reference": {"kind": "position", "mean": 0.0}, "position": {"gain": gain}}},
        initial={"angles": {"motor": 1.0}, "twists": {"play": 0.5}},
        simulation={"duration": 40.0, "sample_interval": 0.01},
    )


@pytest.mark.parametrize(("gain", "amplitude", "frequency"), [(5.0, 0.980, 1.573), (10.0, 1.573, 2.699)])
def test_limit_cycle_of_a_play_is_that_of_the_closed_form_and_the_published_one(gain: float, amplitude: float, frequency: float) -> None:
    """The load's friction and inertia go to zero together: the difference is of their first order."""
    X, period = play(gain)
    assert (round(X, 3), round(2.0 * np.pi / period, 3)) == (amplitude, frequency)
    errors = []
    for small in (1e-4, 1e-5):
        cycle = lm.servo.limit_cycle(play_loop(gain, small), causes=small == 1e-5)
        assert cycle.stable
        errors.append([cycle.amplitudes["motor_angle"] / X - 1.0, cycle.period / period - 1.0])
    assert cycle.causes == ("backlash",)
    errors = np.abs(errors)
    assert np.all(errors[0] < 1e-3)
    # The amplitude is read from 2048 samples a period: (pi/2048)^2/2 = 1.2e-6 of a peak.
    assert np.all(errors[1] < 0.12 * errors[0] + 1.2e-6)


# --- systems of other libraries, input that is refused, maps ---
def test_systems_of_scipy_and_python_control_act_as_the_pid_that_they_equal() -> None:
    """6 + 9/s + 0.6 s/(1 + 0.02 s), as one transfer function, of the error."""
    import control
    import scipy.signal

    top, bottom = [6.0 * 0.02 + 0.6, 6.0 + 9.0 * 0.02, 9.0], [0.02, 1.0, 0.0]
    pid = LOOP["position"] | {"derivative_weight": 1.0}
    reference = {"kind": "position", "amplitude": 0.4, "frequency": 0.7}  # the derivative of a step would start the filter
    wanted = lm.simulate(
        lm.Scenario(
            **TWO_MASSES,
            controllers={"servo": LOOP | {"position": pid, "reference": reference}},
            initial={"controller_states": {"servo_filter": 0.0}},
            simulation={"duration": 2.0, "sample_interval": 0.05},
        )
    )
    for system in (scipy.signal.lti(top, bottom), control.tf(top, bottom), control.ss(control.tf(top, bottom))):
        run = lm.simulate(two_masses(reference=reference, position=None, state_space=lm.control.as_state_space(system)))
        x = wanted["load_angle"].values
        np.testing.assert_allclose(run["load_angle"].values, x, rtol=0.0, atol=1e-11 * np.abs(x).max())
    assert "has a sample time of" in refused(lambda: lm.control.as_state_space(scipy.signal.dlti(top, bottom, dt=0.1)))
    assert "as many poles as zeros" in refused(lambda: lm.control.as_state_space(scipy.signal.lti([1.0, 2.0, 3.0], [1.0, 1.0])))


REFUSED = [
    ({"position": {"gian": 3.0}}, "controllers.servo.position.gian: is not known; did you mean gain"),
    ({"sample_time": 1e-3}, 'controllers.servo.sample_time: is a key of kind "sampled", and this table has another'),
    ({"shaft": "lod"}, 'controllers.servo.shaft: "lod" is no shaft; did you mean load'),
    ({"reference": {"kind": "speed", "mean": 1.0}}, "controllers.servo: give speed or state_space"),
    ({"current": {"kind": "voltage"}}, 'controllers.servo: current.kind = "voltage", for which there is state_space alone'),
    ({"anti_windup_time": 0.1}, "controllers.servo.anti_windup_time: nothing limits the output; give a limit"),
    ({"position": {"gain": 1.0}, "anti_windup_time": 0.1, "limit": 1.0}, "controllers.servo: an anti_windup_time but no integral_gain"),
    ({"position": {"gain": 1.0, "filter_time": 0.1}}, "controllers.servo.position: has filter_time but no derivative_gain"),
    (
        {"position": None, "state_space": {"A": [[1.0, 2.0]], "B": [[1.0]], "C": [1.0], "D": [0.0]}},
        "controllers.servo.state_space: A must be 1 x 1",
    ),
    ({"limit": -1.0}, "controllers.servo.limit: -1.0 must be greater than 0"),
    (
        {"position": {"gain": 1.0, "derivative_gain": 0.1, "derivative_weight": 1.0}}
        | {"reference": {"kind": "position", "steps": [{"time": 0.1, "height": 1.0}]}},
        "controllers.servo: give a filter_time",
    ),
]


test_what_cannot_be_used_is_refused_in_one_line = refusals_of(lambda changes: two_masses(**changes), *REFUSED)


def test_a_map_has_the_limit_cycles_of_its_points() -> None:
    grid = {"shafts.axis.breakaway_torque": [0.3, 0.4, 0.5], "controllers.servo.position.integral_gain": [1.5, 2.0]}
    found = lm.servo.hunting_map(inertia(0.3, 0.4, 100.0), grid, threads=2)
    assert found["amplitude"].dims == ("shafts_axis_breakaway_torque", "controllers_servo_position_integral_gain")
    assert found["amplitude"][0, 0] == 0.0
    assert np.isnan(found["frequency"][0, 0])
    assert "rest" in str(found["reason"][0, 0].values)
    for row, excess in ((1, 0.1), (2, 0.2)):
        assert float(found["amplitude"][row, 0]) == pytest.approx(hunting(excess)[0], rel=1e-9)
        alone = lm.servo.limit_cycle(inertia(0.3, 0.3 + excess, 100.0, position=PID | {"integral_gain": 2.0}), causes=False)
        assert float(found["frequency"][row, 1]) == alone.frequency


def test_the_period_is_the_shortest_one() -> None:
    # At the middle gain Newton's method is first led to four periods.
    hunting = lm.load("hunting-with-static-friction", {"shafts.table.breakaway_torque": 11.0})
    key = "controllers.servo.position.integral_gain"
    found = [lm.servo.limit_cycle(hunting.replace(**{key: k}), causes=False).frequency for k in (7.5, 8.615384615384617, 9.5)]
    assert np.diff(found).min() > 0.0
    assert found[1] == pytest.approx(0.157284, rel=1e-5)


# --- in the short form ---
SHORT = """
base = "paper-2dof-nl-small"

[controller]
kind = "continuous"
limit = "1 N*m"
reference = { kind = "position", steps = [{ time = "10 ms", height = "0.02 rad" }] }

[controller.position]
gain = "20 N*m/rad"
integral_gain = "40 N*m/rad/s"
derivative_gain = "1 N*m*s/rad"
filter_time = "2 ms"

[simulation]
duration = "0.5 s"
sample_interval = "1 ms"
"""


def test_in_the_short_form_it_makes_a_train_of_the_drive(tmp_path: Path) -> None:
    """The same, element by element, as the drive written out as a train."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    short, drive = lm.load(path, ["controller.position.gain=30"]), lm.load("paper-2dof-nl-small")
    assert short.form != DRIVE
    controller = tomllib.loads(SHORT)["controller"]
    controller["position"]["gain"] = 30.0
    controller["shaft"] = "load"
    train = drive.drive().train()
    long = lm.Scenario(
        shafts={name: dict(shaft) for name, shaft in train.shafts.items()},
        motors=train.motors,
        gears=train.gears,
        controllers={"motor": controller},
        simulation={"duration": 0.5, "sample_interval": 1e-3},
    )
    a, b = lm.simulate(short, energy=False), lm.simulate(long, energy=False)
    assert float(a["load_angle"][-1]) == pytest.approx(0.02, rel=0.2)  # it follows
    for name in ("load_angle", "motor_command", "motor_integral", "gearbox_twist"):
        assert np.array_equal(a[name], b[name]), name


test_what_is_wrong_in_the_short_form_has_its_key = refusals_of(
    lambda text, *, tmp_path: lm.load(file_of(tmp_path / "short.toml", text)),
    (SHORT.replace('limit = "1 N*m"', "limit = -1"), "controller.limit: must be greater than 0"),
    (SHORT.replace("[simulation]", "[command]\namplitude = 0.1\n[simulation]"), "command, controller: both turn the motor"),
    (SHORT + '[task]\nambient_temperature = "30 degC"', "task, controller: "),
)  # fmt: skip
