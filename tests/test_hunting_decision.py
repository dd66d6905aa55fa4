"""What loops do under a constant reference: hunt, rest or not decided; against long runs, and arithmetic by hand."""

import math
import random
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from lostmotion.servo.hunting.hunting_decision import NOISE, WatchedRun
from lostmotion.servo.hunting.limit_cycle_causes import at_rest, limit_cycle
from lostmotion.servo.linear_regimes import axis_of, regimes
from lostmotion.servo.margins import instability
from lostmotion.simulation.runs.run import run
from tables import run_of

SEEDS = range(20_260_101, 20_260_101 + some(4, 2))
AXES = some(50, 10)  # of each seed
LONG, LONGEST = 60.0, 3000.0  # [s], of the runs that decide; slower axes are not checked


def one_inertia(
    friction: float, breakaway: float, height: float, speed: dict[str, Any], duration: float, sample_time: float = 1e-3, **loops: Any
) -> lm.Scenario:
    """A rotor of 1e-4 kg·m² with dry friction under a position loop."""
    rotor = {"friction_torque": friction, "breakaway_torque": breakaway, "viscous_friction": 1e-3}
    motor = {"kind": "torque_source", "shaft": "rotor", "rotor_inertia": 1e-4, "rated_torque": 0.5}
    reference = {"kind": "position", "steps": [{"time": 0.05, "height": height}]}
    controller = {"sample_time": sample_time, "reference": reference, "speed": {"torque_limit": 0.5} | speed, **loops}
    return lm.Scenario(shafts={"rotor": rotor}, motors={"m": motor}, controllers={"m": controller}, simulation=run_of(duration, 0.01))


def geared(of: lm.Scenario, backlash: float, friction: float) -> lm.Scenario:
    """The same rotor behind a gear of ratio 20 with a gap, the position read at the load."""
    gear = {
        "input": "rotor",
        "output": "load",
        "ratio": 20.0,
        "rated_input_speed": 300.0,
        "rated_output_torque": 10.0,
        "stiffness": {"kind": "curve", "slopes": [3000.0], "breaks": [], "backlash": backlash},
        "losses": {"kind": "constant_efficiency", "efficiency": 0.95},
    }
    load = {"inertia": 0.04, "friction_torque": friction, "viscous_friction": 0.1}
    data = of.model_dump()
    data["shafts"] = {**data["shafts"], "load": load}
    data["gears"] = {"gear": gear}
    data["controllers"]["m"]["position_encoder"] = {"shaft": "load", "bits": 18}
    return lm.Scenario(**data)


def random_axis(rng: random.Random) -> lm.Scenario:
    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    friction = log(5e-3, 5e-2)
    speed: dict[str, Any] = {"gain": log(8e-3, 4e-2)}
    if rng.random() < 0.7:
        speed["integral_time"] = log(0.1, 1.0)
    position: dict[str, Any] = {"gain": log(6.0, 30.0)}
    if rng.random() < 0.3:
        position["integral_gain"] = position["gain"] * log(0.3, 5.0)
    if position.get("integral_gain") and rng.random() < 0.3:
        position["dead_zone"] = (2e-3, 4e-3)
    encoder: dict[str, Any] = rng.choice([{"ideal": True}, {"bits": 12}, {"bits": 17}])
    whole = rng.random() < 0.3  # a reference that the encoder can read
    height = 128 * 2.0 * np.pi / 4096 if whole else log(0.1, 1.0)
    breakaway = friction * rng.choice([1.0, 1.3, 2.0])
    axis = one_inertia(friction, breakaway, float(height), speed, 10.0, rng.choice([1e-3, 2e-3]), position=position, encoder=encoder)
    return geared(axis, log(2e-4, 5e-3), rng.choice([0.0, 0.3])) if rng.random() < 0.3 else axis


def angles_over(scenario: lm.Scenario, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants and the rotor's angle of one run."""
    times = {"simulation.duration": duration, "simulation.sample_interval": 0.02}
    whole = run(scenario.replace(**times), energy=False)
    return whole.time, whole["rotor_angle"]


@pytest.mark.parametrize("seed", SEEDS)
def test_verdicts_of_random_axes_are_those_of_long_runs(seed: int) -> None:
    """At rest: nothing moves in the long run after the watch. Hunts: it moves in each third of it, about as far as was said."""
    rng = random.Random(seed)
    counts, checked = {"hunts": 0, "at rest": 0, "not decided": 0}, 0
    for k in range(AXES):
        scenario = random_axis(rng)
        found = at_rest(axis_of(scenario), LONGEST / 1.5)
        counts[found.verdict] += 1
        told = f"seed {seed}, axis {k}: {found}"
        duration = 1.5 * found.watched + LONG + (6.0 / found.frequency if found.frequency > 0.0 else 0.0)
        if found.verdict == "not decided" or duration > LONGEST:
            continue
        checked += 1
        time, angle = angles_over(scenario, duration)
        after = angle[time > 0.05 + found.watched]
        if found.verdict == "at rest":
            assert np.ptp(after) <= NOISE, told
        else:
            thirds = [np.ptp(part) for part in np.array_split(after, 3)]
            # Some axes with a gap have two cycles side by side, 0.017 and 0.03 rad in one of them, and rounding decides for one.
            assert min(thirds) > 2.0 * found.motor_amplitude / 3.0, told
            assert max(thirds) < 2.0 * found.motor_amplitude * 3.0, told
    print(f"seed {seed}: {counts}, {checked} checked by a long run")
    assert checked >= 0.6 * AXES, counts
    assert min(counts["hunts"], counts["at rest"]) >= 0.1 * AXES, counts


def slow_hunting(**changes: Any) -> lm.Scenario:
    """A weak integrator, and a rotor that breaks away at twice its sliding friction."""
    speed = {"gain": 0.02, "integral_time": 1.0}
    axis = one_inertia(0.02, 0.04, 0.3, speed, 120.0, 5e-4, position={"gain": 10.0}, encoder={"bits": 17})
    return axis.replace(**changes) if changes else axis


def test_hunting_slower_than_the_first_watch_is_found_with_its_cause() -> None:
    """Period and swing of an exact run of 600 s, by the instants at which the rotor breaks away forward."""
    scenario = slow_hunting()
    time, angle = angles_over(scenario, 600.0)
    late = time > 200.0
    up = time[1:][late[1:] & (np.diff(angle) > 1e-6)]
    slips = up[np.flatnonzero(np.diff(up, prepend=0.0) > 1.0)]
    period = float(np.diff(slips).mean())
    assert period == pytest.approx(14.76, abs=0.1)
    cycle = limit_cycle(axis_of(scenario))
    assert cycle is not None
    assert cycle.whole.verdict == "hunts"
    assert 1.0 / cycle.whole.frequency == pytest.approx(period, rel=0.01)
    assert 2.0 * cycle.whole.motor_amplitude == pytest.approx(np.ptp(angle[late]), rel=0.02)
    assert "dry friction" in cycle.causes
    assert lm.servo.limit_cycle(scenario, causes=False).verdict == "hunts"


def test_the_time_of_the_break_away_follows_from_the_stuck_state() -> None:
    """With T dI/dt = k_p/T_i K_v e the torque of the stuck rotor goes in a straight line to the 0.04 N·m that it holds."""
    axis = axis_of(slow_hunting())
    watch = WatchedRun(axis.scenario, ("rotor_angle",))
    outlook, looks = watch.outlook(0.05)
    while looks is None or not outlook.breaks_away > 2.0:
        watch.follow(0.25)
        outlook, looks = watch.outlook(0.05)
    s = watch.simulation
    e, torque = s["m_position_reference"] - s["m_measured_position"], s["m_torque_reference"]
    rate = 0.02 / 1.0 * 10.0 * e
    assert outlook.breaks_away == pytest.approx((math.copysign(0.04, rate) - torque) / rate, abs=2e-3)
    before = s["rotor_angle"]
    watch.follow(outlook.breaks_away - 0.01)
    assert s["rotor_angle"] == before
    watch.follow(0.02)
    assert s["rotor_angle"] != before
    # A torque limit of 0.03 N·m never frees the 0.04 N·m of the rotor, whatever error is left.
    assert at_rest(axis_of(slow_hunting(**{"controllers.m.speed.torque_limit": 0.03}))).verdict == "at rest"


def test_a_stuck_interval_that_is_extrapolated_ends_as_if_it_were_followed() -> None:
    two = [WatchedRun(slow_hunting(), ("rotor_angle",)) for _ in range(2)]
    window, ends = 0.005, []
    for watch in two:
        watch.follow(10.0)
        outlook, looks = watch.outlook(window)
        while looks is None or not outlook.breaks_away > 2.0:
            watch.follow(0.25)
            outlook, looks = watch.outlook(window)
        if watch is two[0]:
            assert watch.skip(outlook, looks, window)
        begin = watch.simulation["rotor_angle"]
        while watch.simulation["rotor_angle"] == begin:
            watch.follow(0.005, 1)
        ends.append(watch.elapsed)
    assert ends[0] == pytest.approx(ends[1], abs=0.011)


@pytest.mark.parametrize("speed", [1e-2, 1e-4, 1e-6])
def test_a_load_that_drifts_through_its_gap_is_not_at_rest(speed: float) -> None:
    """All contacts are stuck and no controller moves, but the load flies on without friction until it meets a flank."""
    axis = one_inertia(0.05, 0.05, 0.001, {"gain": 0.02}, 10.0, position={"gain": 10.0}, encoder={"ideal": True, "shaft": "rotor"})
    data = geared(axis, 0.5, 0.0).model_dump(exclude_none=True)
    del data["controllers"]["m"]["position_encoder"]
    data["shafts"]["load"]["viscous_friction"] = 0.0
    scenario = lm.Scenario(**data | {"initial": {"speeds": {"load": speed}}})
    assert float(lm.simulate(scenario)["load_angle"][-1]) == pytest.approx(10.0 * speed, rel=1e-9)
    found = at_rest(axis_of(scenario), 100.0)
    assert found.verdict != "at rest"
    assert found.amplitude > 0.0


def test_an_unstable_loop_is_named_with_its_frequency() -> None:
    """A rigid drive under a proportional speed loop with one sample time of delay: the limit is 2 (sqrt 2 - 1) J/T, at f_s/8."""
    T, J = 125e-6, 1e-4
    limit = 2.0 * (math.sqrt(2.0) - 1.0) * J / T
    motor = {"kind": "torque_source", "shaft": "rotor", "rotor_inertia": J, "rated_torque": 0.5}

    def found(gain: float) -> Any:
        controller = {"sample_time": T, "encoder": {"ideal": True}, "speed": {"gain": gain}}
        scenario = lm.Scenario(
            shafts={"rotor": {}},
            motors={"m": motor},
            controllers={"m": controller | {"reference": {"kind": "speed", "mean": 1.0}}},
            simulation={"duration": 0.1, "sample_interval": 1e-3},
        )
        axis = axis_of(scenario)
        return instability(axis, regimes(axis)[0])

    assert found(0.999 * limit) is None
    above = found(1.001 * limit)
    assert (above.loop, above.regime) == ("speed", "rigid")
    assert above.frequency == pytest.approx(1000.0, rel=1e-3)
    assert above.growth > 0.0


ROTARY_TABLE = {
    "motor": {
        "kind": "dc",
        "rotor_inertia": "0.847 kg*cm^2",
        "friction_torque": "0.02 N*m",
        "rated_torque": "2.1 N*m",
        "rated_speed": "6000 rpm",
    }
    | {"rated_voltage": 326.0, "electrical_time_constant": "4.26 ms", "armature_voltage_constant": 18.0},
    "gearbox": {"ratio": 50, "rated_output_torque": "120 N*m", "rated_input_speed": "3000 rpm", "inertia": "0.3 kg*cm^2"}
    | {"stiffness": {"kind": "curve", "backlash": "3 arcmin", "slopes": ["25 N*m/arcmin"], "breaks": []}}
    | {"losses": {"kind": "constant_efficiency", "efficiency": 0.94}},
    "load": {"inertia": "2.5 kg*m^2", "friction_torque": "3 N*m"},
    "simulation": {"duration": "3 s", "sample_interval": "1 ms"},
}


def rotary_table(**changes: Any) -> lm.Scenario:
    limits = {"speed": "60 deg/s", "acceleration": "400 deg/s^2", "jerk": "8000 deg/s^3"}
    controller: dict[str, Any] = {
        "sample_time": "125 us",
        "encoder": {"lines": 2048},
        "reference": {"kind": "position", "moves": [{"to": "90 deg"}], **limits},
        "position": {"gain": "20 1/s", "integral_gain": "60 1/s^2", "sample_time": "1 ms"},
        "speed": {"gain": "0.1 N*m*s/rad", "integral_gain": "2 N*m/rad", "torque_limit": "6 N*m"},
        "current": {"kind": "pi"},
    }
    return lm.Scenario(**ROTARY_TABLE, controller=controller | changes)


def test_a_loop_that_outer_loops_damp_is_no_instability() -> None:
    """An undamped mesh grows under the current loop alone, whose back-e.m.f. comes late; the speed loop damps it, as the run shows."""
    tuned = lm.tune(rotary_table(), rule="suited").scenario
    report = lm.commission(tuned)
    alone = next(row for row in report.loops if (row.loop, row.regime) == ("current", "stiffness"))
    assert not alone.margins.stable
    assert alone.verdict == "with outer loops"
    assert report.stable
    r = lm.simulate(tuned, duration=10.0, energy=False)
    assert np.ptp(r.load_angle.values[r.time.values > 8.0]) == 0.0


def test_hunting_through_the_gap_is_found_and_rest_without_it() -> None:
    scenario = rotary_table(position_encoder={"shaft": "load", "bits": 20})
    r = lm.simulate(scenario, duration=60.0, energy=False)
    late = r.time.values > 30.0
    found = lm.servo.limit_cycle(scenario, causes=False)
    assert found.verdict == "hunts"
    assert 2.0 * found.amplitudes["load_angle"] == pytest.approx(np.ptp(r.load_angle.values[late]), rel=0.1)
    assert np.ptp(r.twist.values[late]) > math.radians(3.0 / 60.0)  # the motor crosses the whole gap
