"""Measured motion as an input of identification: the torque that it takes is what is fitted."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.rig.residuals import Engine, start_point
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification

RIG = """
shafts.crank = { inertia = 2e-3, speed = { mean = 0.0 } }
shafts.lever = { inertia = 5e-3 }
gears.mesh = { input = "crank", output = "lever", ratio = 2 }
simulation = { duration = "1 s", sample_interval = "1 ms" }
"""
TRUTH = {"inertia": 5e-3, "coulomb": 0.05, "viscous": 2e-3}  # of the lever; on the crank a quarter or a half of it
NOISE = 2e-3  # N*m, of the torque sensor
ANGLE_NOISE = 1.4e-5  # rad, of an encoder with 17 bit


def rig_of(directory: Path, **given: Any) -> Rig:
    (directory / "rig.toml").write_text(RIG)
    task = Identification(
        scenario="rig.toml",
        logs={"files": ["*.csv"]},
        inputs={"crank_given_speed": {"channel": "motion", "smoothing": 0.04} | given},
        measured={"torque": {"channel": "torque", "variable": "crank_drive_torque", "deviation": NOISE}},
        set={"shafts.lever.inertia": "inertia", "shafts.lever.friction_torque": "coulomb", "shafts.lever.viscous_friction": "viscous"},
        parameters={
            "inertia": {"start": 3e-3, "min": 1e-5, "max": 1.0},
            "coulomb": {"start": 0.1, "max": 1.0},
            "viscous": {"start": 1e-3, "max": 1.0},
        },
    )
    return Rig(task, directory)


def logs_of(rig: Rig, unit: str) -> list[Prepared]:
    """Angle, or speed, and torque of three motions by their closed form."""
    time, found = 1e-3 * np.arange(2000), []
    for k in range(3):
        w, draw = 3.0 + 2.0 * k, np.random.default_rng(k)
        angle = np.sin(w * time) + 0.3 * np.sin(1.7 * w * time)
        speed = w * np.cos(w * time) + 0.51 * w * np.cos(1.7 * w * time)
        rate = -(w**2) * np.sin(w * time) - 0.867 * w**2 * np.sin(1.7 * w * time)
        torque = (2e-3 + TRUTH["inertia"] / 4.0) * rate + TRUTH["viscous"] / 4.0 * speed
        torque += TRUTH["coulomb"] / 2.0 * np.sign(speed) + NOISE * draw.normal(size=len(time))
        noisy = angle + ANGLE_NOISE * draw.normal(size=len(time))
        motion = {"rad": noisy, "deg": np.rad2deg(noisy), "rad/s": speed}[unit]
        channels = {"motion": Channel(motion, unit), "torque": Channel(torque, "N*m")}
        found.append(prepared(rig.task, Log(f"{k}.csv", time, channels), rig.units))
    return found


@pytest.mark.parametrize(("unit", "given"), [("rad", {}), ("deg", {}), ("rad/s", {"smoothing": 0.0})])
def test_inertia_and_friction_follow_from_measured_motion_and_torque(tmp_path: Path, unit: str, given: dict[str, Any]) -> None:
    """A local cubic over 40 ms errs by less than (20 ms)^2/6 of the fourth derivative: 0.5 mN*m of the fastest motion."""
    rig = rig_of(tmp_path, **given)
    result = identify_logs(rig, logs_of(rig, unit), threads=1)
    assert result.error()[1] == pytest.approx(NOISE, rel=0.06)  # with 6000 samples the noise itself departs by 3 % at most
    assert result.by_differences == {}
    for name, value in TRUTH.items():
        i = result.intervals[name]
        bias = 0.0 if unit == "rad/s" else 0.01 * value
        assert abs(result.values[name] - value) < 4.0 * (i.high - i.low) / (2.0 * 1.96) + bias, name


def test_derivatives_with_a_given_motion_are_those_of_small_differences(tmp_path: Path) -> None:
    rig = rig_of(tmp_path, scale="factor", smoothing=0.0)
    data = rig.task.model_dump()
    data["parameters"]["factor"] = {"start": 1.02, "min": 0.5, "max": 2.0}
    rig = Rig(Identification(**data), tmp_path)
    logs = logs_of(rig, "rad/s")
    engine, point = Engine(rig, threads=1), start_point(rig.task, logs)
    jacobians = engine.jacobians(logs, point, 0, rig.task.parameters)
    for n, name in enumerate(rig.task.parameters):
        h = 1e-5 * point.values[name]
        up, down = (engine.residuals(logs, type(point)({**point.values, name: point.values[name] + s * h}, {}), 0) for s in (1.0, -1.0))
        for J, a, b in zip(jacobians, up, down, strict=True):
            assert J[..., n] == pytest.approx((a - b) / (2.0 * h), abs=1e-6 * max(1e-3, np.abs(J[..., n]).max()))


@pytest.mark.parametrize(("given", "message"), [
    ({"smoothing": 0.0}, 'is an angle; give smoothing, such as "20 ms"'),
    ({"smoothing": 2e-3}, "has 3 samples of 0.csv"),
    ({"interpolation": "hold"}, "would make the speed jump"),
])  # fmt: skip
def test_a_motion_that_cannot_be_given_is_refused(tmp_path: Path, given: dict[str, Any], message: str) -> None:
    with pytest.raises(lm.InputError, match=message):
        rig = rig_of(tmp_path, **given)
        logs = logs_of(rig, "rad")
        Engine(rig, threads=1).residuals(logs, start_point(rig.task, logs), 0)
        raise lm.InputError(next(iter(_failures(rig, logs))))


def _failures(rig: Rig, logs: list[Prepared]) -> list[str]:
    """Why logs have no run."""
    engine = Engine(rig, threads=1)
    engine.residuals(logs, start_point(rig.task, logs), 0)
    return list(engine.failed.values())
