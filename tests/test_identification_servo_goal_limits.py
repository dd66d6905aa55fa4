"""A goal that the firmware of a servo filters and limits: closed forms of its course, and limits found from logs."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification_logs import NOISE, SERVO, TRUTH, servo_plans, servo_task
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.readers.log import Channel
from lostmotion.identification.rig.rig_runs import run_log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.rig.servo_goal_limits import shaped
from lostmotion.identification.task.identification_file import Identification
from lostmotion.identification.virtual_logs import virtual_log
from refusals import refused
from test_firmware import goal_course

NONE: dict[str, Any] = {"held": True, "rate": math.inf, "acceleration": math.inf, "filter_time": 0.0}


def step(time: np.ndarray, at: float) -> np.ndarray:
    return np.where(time >= at, 1.0, 0.0)


def test_a_limited_step_is_a_ramp() -> None:
    time = np.arange(0.0, 1.0, 0.01)
    fine, course, count = shaped(time, step(time, 0.1), **NONE | {"rate": 4.0})
    assert count == 2 and np.allclose(fine[::2], time)
    assert np.allclose(course, np.clip(4.0 * (fine - 0.1), 0.0, 1.0), atol=1e-12)


def test_limits_of_rate_and_acceleration_give_the_trapezoid() -> None:
    """The steps of the grid are a hundredth of the time of acceleration: the course departs by a h^2 at most, at each of 3 corners."""
    time = np.arange(0.0, 2.0, 0.004)
    rate, acceleration = 2.0, 8.0
    fine, course, _ = shaped(time, step(time, 0.2), **NONE | {"rate": rate, "acceleration": acceleration})
    h = float(np.diff(fine)[0])
    departure = np.abs(course - goal_course(1.0, rate, acceleration, fine - 0.2))
    assert np.max(departure) < rate * h + 3.0 * acceleration * h**2
    assert np.max(course) <= 1.0 + acceleration * h**2 and course[-1] == pytest.approx(1.0, abs=1e-9)
    speed = np.diff(course) / h
    assert np.max(np.abs(speed)) <= rate * (1 + 1e-9)
    assert np.max(np.abs(np.diff(speed))) <= acceleration * h * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_random_goals_keep_to_the_limits_and_are_reached(seed: int) -> None:
    draw = np.random.default_rng(seed)
    rate, acceleration = draw.uniform(0.5, 5.0), draw.uniform(5.0, 50.0)
    time = np.arange(0.0, 8.0, 0.02)
    goal = np.repeat(draw.uniform(-1.0, 1.0, 4), 100)
    fine, course, _ = shaped(time, goal, **NONE | {"rate": rate, "acceleration": acceleration})
    h = np.diff(fine)
    speed = np.diff(course) / h
    assert np.max(np.abs(speed)) <= rate * (1 + 1e-9)
    assert np.max(np.abs(np.diff(speed) / h[1:])) <= acceleration * (1 + 1e-6)
    if 2.0 / rate + rate / acceleration < 1.8:
        assert np.allclose(course[np.searchsorted(fine, (1.99, 3.99, 5.99))], goal[[0, 100, 200]], atol=1e-6)


def test_the_filter_is_exact_for_steps_and_ramps() -> None:
    time = np.arange(0.0, 1.0, 0.05)
    tau = 0.08
    fine, course, _ = shaped(time, step(time, 0.1), **NONE | {"filter_time": tau})
    s = np.maximum(fine - 0.1, 0.0)
    assert np.allclose(course, 1.0 - np.exp(-s / tau), atol=1e-12)
    fine, course, _ = shaped(time, 3.0 * time, **NONE | {"held": False, "filter_time": tau})
    assert np.allclose(course, 3.0 * (fine - tau + tau * np.exp(-fine / tau)), atol=1e-12)


def limited_task(directory: Path) -> Identification:
    data = servo_task(directory).model_dump()
    known = {n: {"start": v, "fixed": True} for n, v in TRUTH.items() if n not in ("viscous_friction", "armature")}
    data["parameters"] |= known
    data["parameters"]["goal_rate"] = {"start": 6.0, "min": 0.5, "max": 100.0, "logarithmic": True, "unit": "rad/s"}
    data["inputs"]["servo_reference"] |= {"rate_limit": "goal_rate"}
    data["ladder"] = [{"name": "limited goal", "free": ["goal_rate", "viscous_friction", "armature"]}]
    data["logs"]["held_out"] = None
    return Identification(**data)


def test_the_rate_limit_of_a_firmware_is_found(tmp_path: Path) -> None:
    """The logs are of a rig whose goal is a ramp by closed form, at 1 kHz; what is recorded is the step."""
    rate = 3.0
    free = limited_task(tmp_path).model_dump()
    free["inputs"]["servo_reference"] |= {"interpolation": "linear", "rate_limit": None}
    del free["parameters"]["goal_rate"]
    free["ladder"][0]["free"] = ["viscous_friction", "armature"]
    true_rig, rig = Rig(Identification(**free), SERVO), Rig(limited_task(tmp_path), SERVO)
    logs = []
    for k, plan in enumerate(servo_plans(2)):
        time = np.arange(0.0, 2.0, 1e-3)
        height = (1.0, -0.7)[k]
        goal = np.clip(rate * (time - 0.2), 0.0, abs(height)) * np.sign(height)
        channels = {n: Channel(np.full(len(time), c.values[0])) for n, c in plan.channels.items()}
        fine = replace(plan, time=time, channels=channels | {"goal_position": Channel(goal)})
        log = virtual_log(true_rig, fine, TRUTH, noise={"position": NOISE}, seed=k)
        thin = {n: replace(c, values=c.values[::10]) for n, c in log.channels.items()}
        thin["goal_position"] = Channel(height * step(time, 0.2)[::10])
        logs.append(prepared(rig.task, replace(log, time=time[::10], channels=thin), rig.units))
    result = identify_logs(rig, logs, threads=1)
    assert result.values["goal_rate"] == pytest.approx(rate, rel=2e-3)
    assert result.error()[1] < 1.1 * math.hypot(NOISE, 2.0 * math.pi / 4096 / math.sqrt(12.0))  # noise and quantisation


def test_a_goal_that_is_recorded_each_tenth_of_a_second_is_limited_in_between(tmp_path: Path) -> None:
    """The same rig, once with the ramp of the goal at 1 kHz, once with its step at 10 Hz, which a dead time puts between samples."""
    rate, time = 4.0, np.arange(0.0, 2.0, 1e-3)
    free = limited_task(tmp_path).model_dump()
    free["inputs"]["servo_reference"] |= {"interpolation": "linear", "rate_limit": None}
    del free["parameters"]["goal_rate"]
    free["ladder"][0]["free"] = ["viscous_friction", "armature"]
    plan, values = servo_plans(1)[0], TRUTH | {"dead_time": 0.045}
    held = {n: Channel(np.full(len(time), c.values[0])) for n, c in plan.channels.items()}
    held["torque_enable"] = Channel(np.where(time < 0.1, 0.0, 1.0))  # so that a run begins between two points of the course of the goal
    ramp = held | {"goal_position": Channel(np.clip(rate * (time - 0.2), 0.0, 1.0))}
    fine = virtual_log(Rig(Identification(**free), SERVO), replace(plan, time=time, channels=ramp), values)
    slow = {n: Channel(c.values[::100]) for n, c in held.items()} | {"goal_position": Channel(step(time, 0.2)[::100])}
    limited = replace(plan, time=time[::100], channels=slow)
    rig, measured = Rig(limited_task(tmp_path), SERVO), fine.channels["position"].values[::100]
    log = prepared(rig.task, replace(limited, channels=slow | {"position": Channel(measured)}), rig.units)
    known = {n: p.start for n, p in rig.task.parameters.items()}
    found = run_log(rig, log, known | values | {"goal_rate": rate}, 0)["position"]
    assert np.abs(found - measured).max() < 2.0 * 2.0 * math.pi / 4096  # steps of the encoder


def test_a_limit_that_is_no_limit_is_refused(tmp_path: Path) -> None:
    data = limited_task(tmp_path).model_dump()
    data["inputs"]["servo_reference"]["rate_limit"] = "-goal_rate"
    rig = Rig(Identification(**data), SERVO)
    refused(lambda: virtual_log(rig, servo_plans(1)[0], TRUTH), "inputs.servo_reference.rate_limit")
