"""Residuals that are no noise are reported and widen the intervals; minima and interpolations that leave them are not kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lostmotion.identification.engine import Engine
from lostmotion.identification.identify import IdentificationResult, identify_logs
from lostmotion.identification.ladder import problem_of, start_point
from lostmotion.identification.logs import Channel, Log
from lostmotion.identification.misfit import misfits
from lostmotion.identification.prepare import prepared
from lostmotion.identification.recorded import course_of
from lostmotion.identification.rig import Rig
from lostmotion.identification.task import Identification
from lostmotion.identification.virtual import virtual_log
from lostmotion.reports.identification import write_identification

AXIS = """
[shafts.rotor]
viscous_friction = 2e-4
friction_torque = 5e-3
[shafts.load]
inertia = 0.5
viscous_friction = 2.0
[motors.drive]
shaft = "rotor"
kind = "torque_source"
rated_torque = 1.0
rotor_inertia = 1e-4
[gears.g]
input = "rotor"
output = "load"
ratio = 50
mesh_damping = 10.0
stiffness = { kind = "curve", slopes = [2e4], backlash = 2.4e-3 }
[simulation]
duration = "1 s"
sample_interval = "1 ms"
"""
TRUTH = {"backlash": 2.4e-3, "inertia": 0.5, "friction": 5e-3}
NOISE = 2e-4  # rad, of the motor's encoder
TIME = 1e-3 * np.arange(2500)
TORQUE = 0.1 * np.sin(8 * np.pi * TIME) + 0.03 * np.sin(21.6 * np.pi * TIME)


def axis_task(directory: Path, interpolation: str | None, start: float, **more: Any) -> Identification:
    (directory / "axis.toml").write_text(AXIS)
    data: dict[str, Any] = {
        "scenario": "axis.toml",
        "logs": {"files": ["*.csv"]},
        "inputs": {"drive_command": {"channel": "torque", "interpolation": interpolation}},
        "measured": {"angle": {"channel": "angle", "variable": "rotor_angle", "deviation": NOISE}},
        "set": {
            "gears.g.stiffness.backlash": "backlash",
            "shafts.load.inertia": "inertia",
            "shafts.rotor.friction_torque": "friction",
        },
        "parameters": {
            "backlash": {"start": start, "min": 1e-4, "max": 2e-2},
            "inertia": {"start": 0.51, "min": 0.01, "max": 5.0},
            "friction": {"start": 6e-3, "max": 0.1},
        },
        "fit": {"regression": False, "iterations": 20},
    }
    return Identification(**data | more)


def identified(directory: Path, truth: str, given: str | None, start: float, **more: Any) -> IdentificationResult:
    """From a log whose torque went on between samples as `truth` says."""
    plan = Log("0.csv", TIME, {"torque": Channel(TORQUE)})
    log = virtual_log(Rig(axis_task(directory, truth, 1.0e-3), directory), plan, TRUTH, noise={"angle": NOISE}, seed=3)
    rig = Rig(axis_task(directory, given, start, **more), directory)
    return identify_logs(rig, [prepared(rig.task, log, rig.units)], threads=1)


@pytest.mark.parametrize("truth", ["linear", "hold"])
def test_the_interpolation_of_a_smooth_command_is_that_of_its_sender(tmp_path: Path, truth: str) -> None:
    result = identified(tmp_path, truth, None, 2.2e-3)
    (said,) = result.inputs
    assert said.startswith(f"drive_command: {'straight lines' if truth == 'linear' else 'held'} between samples, since")
    assert said in str(result) and not result.warnings()
    for name, value in TRUTH.items():
        i = result.intervals[name]
        assert result.values[name] == pytest.approx(value, rel=2e-3)
        assert abs(value - 0.5 * (i.low + i.high)) < 0.5 * 1.53 * (i.high - i.low), name  # three standard deviations
    assert result.task.inputs["drive_command"].interpolation == truth


@pytest.mark.parametrize("start", [1e-3, 5e-3])
def test_backlash_is_found_from_other_starts_by_default(tmp_path: Path, start: float) -> None:
    """One search from these values ends at 1.0 and 4.9 mrad with residuals of 0.03 and 0.04 rad."""
    result = identified(tmp_path, "linear", "linear", start)
    assert result.values["backlash"] == pytest.approx(2.4e-3, rel=1e-3)
    assert result.error()[1] == pytest.approx(NOISE, rel=0.05)
    assert not result.warnings()


def test_a_wrong_interpolation_is_reported_and_no_interval_is_narrow(tmp_path: Path) -> None:
    """Held against the truth, the torque is 0.5 ms late on average; the residuals are hundreds of times the noise."""
    result = identified(tmp_path, "linear", "hold", 2e-3)
    size, lost = result.warnings()
    assert "times the stated 0.0002 rad" in size and "runs of one sign instead of" in size
    assert lost.startswith("backlash may have any value within its bounds")
    assert result.lines()[:2] == [size, lost]
    page = write_identification(tmp_path / "out", "axis", result).read_text()
    assert page.index("times the stated") < page.index("</section>")  # in the verdict
    for name, value in TRUTH.items():
        assert result.intervals[name].low <= value <= result.intervals[name].high, name


def problem_with(directory: Path, residuals: np.ndarray) -> list[Any]:
    task = axis_task(directory, "hold", 1e-3)
    rig = Rig(task, directory)
    n = residuals.shape[1]
    log = Log("0.csv", 1e-3 * np.arange(n), {"torque": Channel(np.zeros(n)), "angle": Channel(np.arange(n) * 1e-4)})
    logs = [prepared(task, log, rig.units)]
    start_point(task, logs)
    return misfits(problem_of(rig, Engine(rig, threads=1), logs, 0), [residuals])


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_runs_of_one_sign_tell_noise_from_structure(tmp_path: Path, rho: float) -> None:
    """Two neighbours of a Gaussian process have other signs with probability arccos(rho)/pi (Sheppard 1899)."""
    n = 4000
    e = np.random.default_rng(2).normal(size=n)
    x = np.zeros(n)
    for k in range(1, n):
        x[k] = rho * x[k - 1] + np.sqrt(1.0 - rho**2) * e[k]
    (found,) = problem_with(tmp_path, 3.0 * NOISE * x[None])
    assert found.structured == (rho > 0.0)
    assert found.ratio == pytest.approx(3.0, rel=0.15) and found.large
    assert found.runs == pytest.approx(n * np.arccos(rho) / np.pi, rel=0.1)
    assert found.expected == pytest.approx(n / 2, rel=0.01)


@pytest.mark.parametrize(
    ("values", "course"),
    [
        (np.sin(5.0 * TIME), "smooth"),
        (np.repeat(np.sin(5.0 * TIME[::20]), 20), "staircase"),
        (np.sign(np.sin(5.0 * TIME)), "steps"),
        (np.random.default_rng(0).normal(size=len(TIME)), "rough"),
        (np.full(len(TIME), 0.3), "constant"),
    ],
)
def test_courses_of_commands(values: np.ndarray, course: str) -> None:
    assert course_of(values) == course


def test_a_command_that_repeats_its_values_is_held(tmp_path: Path) -> None:
    task = axis_task(tmp_path, None, 2.4e-3, parameters={"friction": {"start": 6e-3, "max": 0.1}})
    data = task.model_dump()
    data["set"] = {"shafts.rotor.friction_torque": "friction"}
    rig = Rig(Identification(**data), tmp_path)
    plan = Log("0.csv", TIME[:800], {"torque": Channel(np.repeat(TORQUE[:800:10], 10))})
    log = virtual_log(rig, plan, {"friction": 5e-3}, noise={"angle": NOISE})
    result = identify_logs(rig, [prepared(rig.task, log, rig.units)], threads=1)
    assert result.inputs == ["drive_command: held between samples, since the channel repeats its values"]
