"""The firmware of a hobby servo: sample by sample against an independent law, without sample time against an integrator."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
from lostmotion.errors import InputError
from lostmotion.identification.rig.servo_goal_limits import shaped
from refusals import refused

J, B = 0.03, 0.02  # kg m2, N m s/rad
T = 1e-3  # s
SERVO: dict[str, Any] = {
    "supply_voltage": 12.0,
    "resistance": 7.0,
    "torque_constant": 3.5,
    "max_current": 0.6,
    "dead_band": 0.01,
    "filter_time": 4e-3,
    "duty": {"errors": [0.0, 0.05, 0.4], "values": [0.0, 0.2, 0.95]},
}


def axis(controller: dict[str, Any], duration: float = 1.5, **motor: Any) -> lm.Scenario:
    """An inertia with viscous friction, turned by a servo."""
    return lm.Scenario(
        shafts={"arm": {"inertia": J, "viscous_friction": B}},
        motors={"servo": {"shaft": "arm", "kind": "torque_source", "rated_torque": 2.0, "rotor_inertia": 0.0} | motor},
        controllers={"servo": controller},
        simulation={"duration": duration, "sample_interval": T},
    )


def sampled(firmware: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {
        "sample_time": T,
        "encoder": {"ideal": True},
        "reference": {"kind": "position", "steps": [{"time": 0.05, "height": 1.0}, {"time": 0.8, "height": -1.4}]},
        "firmware": firmware,
    } | changes


def continuous(firmware: dict[str, Any], height: float = 1.0, **changes: Any) -> dict[str, Any]:
    reference = {"kind": "position", "steps": [{"time": 0.05, "height": height}]}
    return {"kind": "continuous", "reference": reference, "firmware": firmware} | changes


def duty(error: float) -> float:
    """The table of SERVO beyond its dead band, written down once more."""
    e = abs(error) - SERVO["dead_band"]
    if e <= 0.0:
        return 0.0
    d = 0.2 * e / 0.05 if e <= 0.05 else min(0.2 + 0.75 * (e - 0.05) / 0.35, 0.95)
    return math.copysign(d, error)


def law(error: float, speed: float, supply_resistance: float) -> float:
    """Torque: the current for which winding and supply agree, by bisection over it, then its limit."""
    d = duty(error)
    low, high = -50.0, 50.0
    for _ in range(200):
        current = 0.5 * (low + high)
        supply = 12.0 - supply_resistance * d * current
        if d * supply - 3.5 * speed - 7.0 * current > 0.0:
            low = current
        else:
            high = current
    return 3.5 * min(max(current, -0.6), 0.6)


@pytest.mark.parametrize(("supply_resistance", "delay"), [(0.0, 1), (1.5, 1), (1.5, 0)])
def test_a_sampled_firmware_is_its_law_at_each_sample(supply_resistance: float, delay: int) -> None:
    """Between samples the torque is constant: w' = (M - B w)/J by its closed form."""
    run = lm.simulate(axis(sampled(SERVO | {"supply_resistance": supply_resistance}, delay=delay)))
    goal = run["servo_position_reference"].values
    decay = math.exp(-B / J * T)
    angle = speed = seen = acting = computed = 0.0
    angles, torques = [], []
    for r in goal:
        seen += (1.0 - math.exp(-T / 4e-3)) * (angle - seen)
        computed, before = law(r - seen, speed, supply_resistance), computed
        acting = before if delay else computed
        angles.append(angle)
        torques.append(computed)
        end = acting / B
        angle += end * T + (speed - end) * J / B * (1.0 - decay)
        speed = end + (speed - end) * decay
    assert np.max(np.abs(run["servo_torque_reference"].values - torques)) < 1e-9
    assert np.max(np.abs(run["arm_angle"].values - angles)) < 1e-9
    limited = np.isclose(np.abs(torques), 3.5 * 0.6)
    assert 20 < limited.sum() < 1000, "the current is limited for a while"
    assert any(duty(e) == 0.0 for e in goal - np.array(angles)), "the dead band is entered"


def goal_course(goal: float, rate: float, acceleration: float | None, times: np.ndarray) -> np.ndarray:
    """From 0 to a goal at rest: a ramp, or a trapezoid of the speed, in closed form."""
    if acceleration is None:
        return np.asarray(np.minimum(rate * times, goal))
    up, end = rate / acceleration, goal / rate + rate / acceleration
    s = np.clip(times, 0.0, end)
    rising, braking = 0.5 * acceleration * s**2, goal - 0.5 * acceleration * (end - s) ** 2
    return np.where(s < up, rising, np.where(s > end - up, braking, rate * (s - 0.5 * up)))


@pytest.mark.parametrize("acceleration", [None, 8.0])
def test_the_goal_keeps_to_its_rate_and_acceleration(acceleration: float | None) -> None:
    """The reference that the loop follows is the closed form within the steps of the samples."""
    rate, goal, step = 2.0, 1.2, 0.05
    firmware = SERVO | {"goal_rate_limit": rate}
    if acceleration is not None:
        firmware |= {"goal_acceleration_limit": acceleration}
    reference = {"kind": "position", "steps": [{"time": step, "height": goal}]}
    run = lm.simulate(axis(sampled(firmware, reference=reference), duration=2.5))
    course, time = run["servo_position_reference"].values, run["time"].values
    wanted = goal_course(goal, rate, acceleration, np.maximum(time - step + T, 0.0))  # the sample at the step sees it
    assert np.max(np.abs(course - wanted)) < rate * T + 3.0 * (acceleration or 0.0) * T**2
    assert course[-1] == pytest.approx(goal, abs=1e-12)
    assert np.max(np.abs(np.diff(course))) <= rate * T * (1.0 + 1e-9)
    if acceleration is not None:
        assert np.max(np.abs(np.diff(course, 2))) <= acceleration * T**2 * (1.0 + 1e-6)
    plain = lm.simulate(axis(sampled(SERVO, reference=reference), duration=2.5))
    assert abs(plain["arm_angle"].values[400] - run["arm_angle"].values[400]) > 0.05, "the limit acts on the motion"


def test_the_filter_of_the_goal_is_exact_and_starts_at_rest() -> None:
    tau = 0.04
    reference = {"kind": "position", "mean": 0.3, "steps": [{"time": 0.05, "height": 1.0}]}
    run = lm.simulate(axis(sampled(SERVO | {"goal_filter_time": tau}, reference=reference)))
    time, course = run["time"].values, run["servo_position_reference"].values
    samples = np.maximum(np.round((time - 0.05) / T) + 1.0, 0.0)  # those that have seen the step
    assert np.allclose(course, 0.3 + 1.0 - np.exp(-samples * T / tau), atol=1e-12)


def test_the_limits_of_the_goal_are_those_of_an_identification() -> None:
    """`goal_shaping` of identification steps on a grid of its own: at that sample time both are the same numbers."""
    limits = {"rate": 3.0, "acceleration": 20.0, "filter_time": 0.01}
    keys = {"rate": "goal_rate_limit", "acceleration": "goal_acceleration_limit", "filter_time": "goal_filter_time"}
    run = lm.simulate(axis(sampled(SERVO | {keys[k]: v for k, v in limits.items()})))
    time = run["time"].values
    goal = np.where(time < 0.05 - 1e-9, 0.0, np.where(time < 0.8 - 1e-9, 1.0, -0.4))
    _, course, count = shaped(time, goal, held=True, **limits)
    assert count == 1
    assert np.max(np.abs(course[1:] - run["servo_position_reference"].values[:-1])) < 1e-12


def test_without_sample_time_the_motion_is_that_of_an_integrator() -> None:
    scenario = axis(continuous(SERVO))
    run, adaptive = lm.simulate(scenario), lm.simulate(scenario, solver="dormand-prince")
    assert np.max(np.abs(run["arm_angle"].values - adaptive["arm_angle"].values)) < 1e-7

    def rate(t: float, x: np.ndarray) -> list[float]:
        error = (1.0 if t >= 0.05 else 0.0) - x[2]
        return [x[1], (law(error, x[1], 0.0) - B * x[1]) / J, (x[0] - x[2]) / 4e-3]

    time = run["time"].values
    after = time >= 0.05
    found = solve_ivp(rate, (0.05, 1.5), [0.0, 0.0, 0.0], method="DOP853", t_eval=time[after], rtol=1e-9, atol=1e-11)
    assert np.max(np.abs(run["arm_angle"].values[after] - found.y[0])) < 2e-7  # kinks of the law, stepped over at 1e-9
    assert np.max(np.abs(run["arm_angle"].values[~after])) == 0.0
    assert run["servo_command"].values.max() * 2.0 == pytest.approx(3.5 * 0.6), "the current is limited"


def test_a_straight_table_is_a_position_gain_and_a_viscous_friction() -> None:
    plain = {"supply_voltage": 12.0, "resistance": 7.0, "torque_constant": 3.5}
    straight = plain | {"duty": {"errors": [0.0, 10.0], "values": [0.0, 1.0]}}
    gain, droop = 3.5 / 7.0 * 12.0 / 10.0, 3.5**2 / 7.0
    by_table = lm.simulate(axis(continuous(straight)))
    pid = axis(continuous({}) | {"firmware": None, "position": {"gain": gain}})
    by_gain = lm.simulate(pid.replace(**{"shafts.arm.viscous_friction": B + droop}))
    assert np.max(np.abs(by_table["arm_angle"].values - by_gain["arm_angle"].values)) < 1e-12


def test_a_sampled_firmware_tends_to_that_without_sample_time() -> None:
    """The error of a held torque falls with the sample time, that is by 8 from 1 ms to 1/8 ms."""
    exact = lm.simulate(axis(continuous(SERVO)))["arm_angle"].values
    errors = []
    for count in (1, 8):
        controller = sampled(SERVO, sample_time=T / count, delay=0)
        controller["reference"] = {"kind": "position", "steps": [{"time": 0.05, "height": 1.0}]}
        errors.append(np.max(np.abs(lm.simulate(axis(controller))["arm_angle"].values - exact)))
    assert 6.0 < errors[0] / errors[1] < 10.0


def test_gears_that_reverse_the_motion_reverse_the_torque() -> None:
    """A motor behind a ratio of -5 with the values of the output, and the same motor on the arm."""
    on_arm = axis(continuous(SERVO))
    small = SERVO | {"torque_constant": 3.5 / 5.0}
    for make in (continuous, sampled):
        direct = lm.simulate(axis(make(SERVO)))["arm_angle"].values
        geared = lm.Scenario(
            shafts={"motor": {}, "arm": {"inertia": J, "viscous_friction": B}},
            motors={"servo": {"shaft": "motor", "kind": "torque_source", "rated_torque": 2.0, "rotor_inertia": 0.0}},
            gears={
                "train": {"input": "motor", "output": "arm", "ratio": -5.0, "losses": {"kind": "constant_efficiency", "efficiency": 1.0}}
            },
            controllers={"servo": make(small)},
            simulation=on_arm.simulation.model_dump(),
        )
        assert np.max(np.abs(lm.simulate(geared)["arm_angle"].values - direct)) < 1e-9


@pytest.mark.parametrize("make", [sampled, continuous])
def test_each_limit_acts(make: Any) -> None:
    """The largest current limits the torque, or the motor does if its limit is lower."""
    for motor, most in (({}, 3.5 * 0.6), ({"torque_limit": 1.5}, 1.5)):
        run = lm.simulate(axis(make(SERVO), **motor))
        assert run["servo_torque"].values.max() == pytest.approx(most, rel=1e-12)


def test_torque_in_python_is_that_of_the_core() -> None:
    servo = lm.control.Firmware(**SERVO | {"supply_resistance": 1.5})
    for error, speed in ((0.3, 1.0), (-0.03, -0.2), (0.005, 0.0), (-2.0, 2.0)):
        assert servo.torque(error, speed) == pytest.approx(law(error, speed, 1.5), rel=1e-12)


@pytest.mark.parametrize(("make", "firmware", "changes", "message"), [
    (continuous, {"supply_resistance": 1.0}, {}, r"firmware\.supply_resistance: makes the torque depend on error and speed"),
    (continuous, {"goal_rate_limit": 4.0}, {}, r"firmware\.goal_rate_limit: acts from sample to sample"),
    (continuous, {"goal_acceleration_limit": 4.0}, {}, r"firmware\.goal_acceleration_limit: acts from sample to"),
    (continuous, {"goal_filter_time": 4e-3}, {}, r"firmware\.goal_filter_time: acts from sample to sample"),
    (sampled, {"goal_rate_limit": 0.0}, {}, r"goal_rate_limit"),
    (sampled, {"duty": {"errors": [0.0, 0.1, 0.1], "values": [0.0, 0.5, 0.6]}}, {}, "errors that do not rise"),
    (sampled, {"duty": {"errors": [0.0, 0.1], "values": [0.1, 0.5]}}, {}, "does not begin at 0"),
    (sampled, {"duty": {"errors": [0.0, 0.1], "values": [0.0, 1.5]}}, {}, "1.5"),
    (sampled, {"resistance": 0.0}, {}, "resistance"),
    (sampled, {}, {"current": {"kind": "pi"}}, "which commands the voltage"),
    (sampled, {}, {"law": True}, "both are the loops"),
    (sampled, {}, {"reference": {"kind": "speed", "mean": 1.0}}, "reference.kind"),
    (sampled, {}, {"position": {"gain": 10.0}}, "has no use with a firmware"),
    (sampled, {}, {"encoder": None}, "lacks encoder"),
])  # fmt: skip
def test_bad_firmware_is_refused(make: Any, firmware: dict[str, Any], changes: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, ValueError), match=message):
        axis(make(SERVO | firmware, **changes))


def test_no_gains_are_found_for_a_duty_cycle() -> None:
    refused(lambda: lm.commission(axis(sampled(SERVO))), reason="duty cycle is not linear")
