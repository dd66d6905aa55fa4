"""Parts of a servo's firmware from logs of its position: the logs are of a law written down by itself."""

import math
from pathlib import Path

import numpy as np
import pytest

from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification

J, B, WEIGHT = 0.03, 0.02, 0.6  # kg m2, N m s/rad, N m
R, K, U = 7.0, 3.5, 12.0  # ohm, N m/A, V
TRUTH = {
    "dead_band": 0.012,
    "corner_duty": 0.25,
    "max_duty": 0.9,
    "max_current": 0.7,
    "supply_resistance": 1.2,
    "filter_time": 4e-3,
    "goal_rate_limit": 6.0,
}
CORNER, LAST = 0.05, 0.3  # rad
STEP = 1e-3  # s
NOISE = 2e-4  # rad
RIG = """
[shafts.arm]
inertia = "0.03 kg*m^2"
viscous_friction = "0.02 N*m*s/rad"
[motors.servo]
shaft = "arm"
kind = "torque_source"
rated_torque = "1 N*m"
rotor_inertia = 0.0
[springs.weight]
shaft = "arm"
stiffness = { kind = "linear", stiffness = "0.6 N*m/rad" }
[controllers.servo]
CONTROLLER
[controllers.servo.firmware]
supply_voltage = "12 V"
resistance = "7 ohm"
torque_constant = "3.5 N*m/A"
duty = { errors = [0.0, 0.05, 0.3], values = [0.0, 0.1, 1.0] }
[simulation]
duration = "1 s"
sample_interval = "10 ms"
"""
SAMPLED = 'sample_time = "1 ms"\ndelay = 0\nencoder = { ideal = true }\nreference = { kind = "position" }'
CONTINUOUS = 'kind = "continuous"\nreference = { kind = "position" }'


def torque(error: float, speed: float, supply_resistance: float) -> float:
    t = TRUTH
    e = max(abs(error) - t["dead_band"], 0.0)
    share = min((e - CORNER) / (LAST - CORNER), 1.0)
    duty = t["corner_duty"] * e / CORNER if e < CORNER else t["corner_duty"] + share * (t["max_duty"] - t["corner_duty"])
    duty = math.copysign(duty, error)
    current = (duty * U - K * speed) / (R + duty * duty * supply_resistance)
    return K * min(max(current, -t["max_current"]), t["max_current"])


def goal(k: int, time: np.ndarray) -> np.ndarray:
    kinds = (
        0.8 * np.sign(np.sin(4.0 * time + 0.1)),
        0.5 * np.sin(2.0 * time**2),
        np.minimum(0.25 * time, 0.4) * np.sign(np.cos(3.0 * time)),
    )
    return np.asarray(kinds[k % 3])


def log(k: int, *, sampled: bool) -> Log:
    """Angles at 100 Hz of the law, with torque and limited goal held for 1 ms, or with its derivative taken every 0.05 ms."""
    time = np.arange(0.0, 2.0, 0.01)
    wanted = goal(k, time)
    inner = 20
    fine = STEP / inner
    angle = speed = seen = 0.0
    followed = float(wanted[0])
    angles = []
    held = 0.0

    def rates(w: float, q: float, r: float) -> tuple[float, float]:
        acting = held if sampled else torque(r - q, w, 0.0)
        return (acting - B * w - WEIGHT * q) / J, w

    for r in wanted.tolist():
        angles.append(angle)
        for _ in range(10):
            if sampled:
                seen += (1.0 - math.exp(-STEP / TRUTH["filter_time"])) * (angle - seen)
                followed += min(max(r - followed, -TRUTH["goal_rate_limit"] * STEP), TRUTH["goal_rate_limit"] * STEP)
                held = torque(followed - seen, speed, TRUTH["supply_resistance"])
            for _ in range(inner):  # the midpoint rule, of second order
                middle = rates(speed, angle, r)
                speed, angle = (
                    x + fine * rate
                    for x, rate in zip(
                        (speed, angle), rates(speed + 0.5 * fine * middle[0], angle + 0.5 * fine * middle[1], r), strict=True
                    )
                )
    noise = np.random.default_rng(k).normal(size=len(time)) * NOISE
    channels = {"goal": Channel(wanted, "rad"), "position": Channel(np.array(angles) + noise, "rad")}
    return Log(f"log {k}", time, channels, {})


def identified(directory: Path, controller: str, starts: dict[str, float]) -> dict[str, tuple[float, float, float]]:
    """Value and ends of the interval of each parameter."""
    (directory / "rig.toml").write_text(RIG.replace("CONTROLLER", controller), encoding="utf-8")
    keys = {name: f"controllers.servo.firmware.{name}" for name in starts if not name.endswith("duty")}
    task = Identification(
        scenario="rig.toml",
        logs={"files": ["*.json"]},
        inputs={"servo_reference": {"channel": "goal", "interpolation": "hold"}},
        measured={"position": {"channel": "position", "variable": "arm_angle", "deviation": NOISE}},
        set={key: name for name, key in keys.items()} | {"controllers.servo.firmware.duty.values": [0.0, "corner_duty", "max_duty"]},
        parameters={name: {"start": s, "min": 1e-4, "max": 10.0, "scale": s} for name, s in starts.items()},
    )
    rig = Rig(task, directory)
    logs = [prepared(task, log(k, sampled=controller == SAMPLED), rig.units) for k in range(3)]
    result = identify_logs(rig, logs, threads=1)
    return {n: (result.values[n], result.intervals[n].low, result.intervals[n].high) for n in starts}


def test_dead_band_duty_curve_and_current_limit_are_found(tmp_path: Path) -> None:
    starts = {"dead_band": 0.02, "corner_duty": 0.2, "max_duty": 0.8, "max_current": 1.0}
    for name, (value, low, high) in identified(tmp_path, CONTINUOUS, starts).items():
        assert value == pytest.approx(TRUTH[name], rel=0.02), name
        assert low - 0.005 * value <= TRUTH[name] <= high + 0.005 * value, name


def test_a_supply_that_sags_a_filter_and_the_rate_of_the_goal_are_found(tmp_path: Path) -> None:
    starts = {"supply_resistance": 0.6, "filter_time": 2e-3, "dead_band": 0.02, "corner_duty": 0.2, "max_duty": 0.8}
    starts |= {"max_current": 1.0, "goal_rate_limit": 8.0}
    for name, (value, _, _) in identified(tmp_path, SAMPLED, starts).items():
        assert value == pytest.approx(TRUTH[name], rel=0.05), name
