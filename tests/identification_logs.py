"""Logs of a virtual servo with a pendulum, for the tests of identification."""

from pathlib import Path
from typing import Any

import numpy as np

from conftest import ROOT
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.readers.log_files import find_logs, read_log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification, load_identification
from lostmotion.identification.virtual_logs import virtual_log, write_servo_json

SERVO = ROOT / "examples" / "servo_logs"
TRUTH = {
    "torque_constant": 2.0,
    "resistance": 2.5,
    "armature": 0.02,
    "coulomb_friction": 0.06,
    "viscous_friction": 0.03,
    "dead_time": 0.028,
    "angle_offset": 0.015,
    "load_friction": 0.2,
    "direction": 0.2,
}
NOISE = 5e-4  # rad


def read_all(task: Identification, directory: Path) -> list[Log]:
    """All logs of a task, as they are read."""
    return [read_log(path, time=task.logs.time) for path in find_logs(task.logs.files, directory)]


def servo_task(directory: Path, **changes: object) -> Identification:
    """The shipped example with the logs of a directory."""
    task, _ = load_identification(SERVO / "identify.toml")
    data = task.model_dump()
    data["logs"]["files"] = [str(directory / "*.json")]
    data |= changes
    return Identification(**data)


def servo_plans(count: int = 4, duration: float = 2.0, rate: float = 100.0) -> list[Log]:
    """Experiments: moves of several kinds with several weights and gains; in every fourth the motor is switched off."""
    plans = []
    for k in range(count):
        time = np.arange(0.0, duration, 1.0 / rate)
        kinds = (np.sin(4.0 * time), np.sin(1.5 * time**2), 1.2 * np.minimum(1.5 * time, 1.0), 0.8 * np.sign(np.sin(5.0 * time + 0.1)))
        enable = np.ones(len(time))
        if k % 4 == 2:
            enable[time > 0.6 * duration] = 0.0
        mass, length, kp = (0.5, 1.0)[k % 2], (0.1, 0.15)[(k // 2) % 2], (16.0, 8.0, 32.0)[k % 3]
        header = {"mass": mass, "arm_mass": 0.1, "length": length, "kp": kp, "vin": 15.0}
        channels = {
            "goal_position": Channel(kinds[k % 4]),
            "torque_enable": Channel(enable),
            "position": Channel(np.zeros(len(time))),
            "input_volts": Channel(np.full(len(time), 15.0)),
        }
        plans.append(Log(f"{k:03d}.json", time, channels, header))
    return plans


def write_servo_logs(directory: Path, values: dict[str, float], *, rung: int, seed: int = 0, **plans: float) -> Rig:
    """Logs of a servo with given values; returns the rig that they are of."""
    rig = Rig(servo_task(directory), SERVO)
    for k, plan in enumerate(servo_plans(**plans)):  # type: ignore[arg-type]
        log = virtual_log(rig, plan, values, rung=rung, noise={"position": NOISE}, seed=seed + k)
        write_servo_json(directory / plan.name, log)
    return rig


AXIS = """
slides.carriage = { viscous_friction = 200.0, friction_force = 20.0, force = { mean = 0.0 } }
linear_motors.drive = { slide = "carriage", rated_force = 1.0, mass = "95 kg" }
simulation = { duration = "1 s", sample_interval = "1 ms" }
"""
SPRING = """
shafts.carriage = { viscous_friction = 20.0, torque = { mean = 0.0 } }
springs.rail = { shaft = "carriage", stiffness = { kind = "linear", stiffness = 900.0 } }
motors.drive = { shaft = "carriage", kind = "torque_source", rated_torque = 1.0, rotor_inertia = "95 kg*m^2" }
simulation = { duration = "1 s", sample_interval = "1 ms" }
"""
POSITION_NOISE = 2e-5  # m
MASS, FRICTION, STIFFNESS = 95.0, 20.0, 900.0


def released(time: np.ndarray, begin: float, mass: float = MASS) -> np.ndarray:
    """Position of m x'' + b x' + k x = 0, released at rest."""
    decay = FRICTION / (2.0 * mass)
    w = np.sqrt(STIFFNESS / mass - decay**2)
    return np.asarray(begin * np.exp(-decay * time) * (np.cos(w * time) + decay / w * np.sin(w * time)))


def spring_task(directory: Path, **more: Any) -> Identification:
    (directory / "axis.toml").write_text(SPRING)
    data: dict[str, Any] = {
        "scenario": "axis.toml",
        "logs": {"files": ["*.csv"]},
        "measured": {"position": {"channel": "pos", "variable": "carriage_angle"}},
        "set": {"motors.drive.rotor_inertia": "mass", "initial.angles.carriage": "first_pos"},
        "parameters": {"mass": {"start": 60.0, "min": 1.0, "max": 1000.0}},
        "fit": {"regression": False},
    }
    return Identification(**data | more)
