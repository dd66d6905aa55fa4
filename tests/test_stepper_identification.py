"""Parameters of a stepper's axis from the log of an encoder on its load."""

import math
from pathlib import Path

import numpy as np

import lostmotion as lm

ARCMIN = math.pi / 10_800.0
NOISE = 2e-4  # [rad]
TRUTH = {"holding": 0.4, "friction": 0.2, "play": 6.0 * ARCMIN}
RIG = """
[shafts]
motor = { viscous_friction = "2 mN m s/rad" }
load = { inertia = "0.02 kg m^2", friction_torque = "0.2 N m" }
[motors.m]
shaft = "motor"
kind = "stepper"
steps_per_revolution = 200
holding_torque = "0.4 N m"
rotor_inertia = "60 g cm^2"
[gears.g]
input = "motor"
output = "load"
ratio = 20
stiffness = { kind = "curve", backlash = "6 arcmin", slopes = ["2000 N m/rad"] }
mesh_damping = "5 N m s/rad"
[command.m.stepping]
microsteps = 16
reference = { moves = [{ to = "0.4 rad" }, { to = "0.1 rad" }, { to = "0.3 rad" }], speed = "1 rad/s", acceleration = "20 rad/s^2", dwell = "0.2 s" }
[simulation]
duration = "2.4 s"
sample_interval = "2 ms"
"""
TASK = """
scenario = "rig.toml"
[logs]
files = ["log.csv"]
[measured.encoder]
channel = "encoder"
variable = "load_angle"
deviation = "0.2 mrad"
[set]
"motors.m.holding_torque" = "holding"
"shafts.load.friction_torque" = "friction"
"gears.g.stiffness.backlash" = "play"
[parameters]
holding = { start = 0.3, min = 0.1, max = 2.0, unit = "N*m" }
friction = { start = 0.1, min = 0.01, max = 2.0, unit = "N*m" }
play = { start = "3 arcmin", min = "0.1 arcmin", max = "30 arcmin", unit = "arcmin" }
"""


def test_holding_torque_friction_and_backlash_are_found_from_an_encoder_on_the_load(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(RIG)
    (tmp_path / "identify.toml").write_text(TASK)
    run = lm.simulate(lm.load(tmp_path / "rig.toml"))
    angle = run.load_angle.values + NOISE * np.random.default_rng(1).normal(size=run.time.size)
    rows = "\n".join(f"{t:.9g},{y:.9g}" for t, y in zip(run.time.values, angle, strict=True))
    (tmp_path / "log.csv").write_text(f"t [s],encoder [rad]\n{rows}\n")
    result = lm.identify(tmp_path / "identify.toml")
    for name, value in TRUTH.items():
        interval = result.intervals[name]
        assert interval.low <= value <= interval.high, name
        assert interval.high - interval.low < 0.3 * value, name
