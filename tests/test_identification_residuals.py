"""Residuals that are no noise are reported and widen the intervals; minima and interpolations that leave them are not kept."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import some
from lostmotion import Simulation, load
from lostmotion.identification.fit.input_courses import course_of
from lostmotion.identification.fit.intervals import bootstrap
from lostmotion.identification.fit.least_squares import Fit, FitProblem, problem_of
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.result import IdentificationResult
from lostmotion.identification.rig.residuals import Engine, ParameterPoint, start_point
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.free_parameters import FreeParameter
from lostmotion.identification.task.identification_file import FitOptions, Identification
from lostmotion.identification.verdicts.residual_tests import misfits
from lostmotion.identification.virtual_logs import virtual_log
from lostmotion.reports.identification import write_identification

AXIS = """
shafts.rotor = { viscous_friction = 2e-4, friction_torque = 5e-3 }
shafts.load = { inertia = 0.5, viscous_friction = 2.0 }
motors.drive = { shaft = "rotor", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 1e-4 }
simulation = { duration = "1 s", sample_interval = "1 ms" }
[gears.g]
input = "rotor"
output = "load"
ratio = 50
mesh_damping = 10.0
stiffness = { kind = "curve", slopes = [2e4], backlash = 2.4e-3 }
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
        "set": {"gears.g.stiffness.backlash": "backlash", "shafts.load.inertia": "inertia", "shafts.rotor.friction_torque": "friction"},
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
    assert " deviations with straight lines and " in said  # the task states them
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


@pytest.mark.parametrize(("truth", "start"), [("hold", 0.8e-3), ("linear", 6e-3)][: some(2, 1)])
def test_interpolation_and_backlash_are_found_together_from_far_starts(tmp_path: Path, truth: str, start: float) -> None:
    """At such starts the residuals of both interpolations say nothing; at the backlash that is found they do."""
    result = identified(tmp_path, truth, None, start)
    assert result.task.inputs["drive_command"].interpolation == truth
    assert result.values["backlash"] == pytest.approx(2.4e-3, rel=1e-3)
    assert result.error()[1] == pytest.approx(NOISE, rel=0.05)
    assert not result.warnings()


def test_a_wrong_interpolation_is_reported_and_no_interval_is_narrow(tmp_path: Path) -> None:
    """Held against the truth, the torque is 0.5 ms late on average; the residuals are hundreds of times the noise."""
    result = identified(tmp_path, "linear", "hold", 2e-3)
    size, lost = result.warnings()
    assert "times the stated 0.01146 deg" in size and "runs of one sign instead of" in size
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
    return misfits(problem_of(Engine(rig, threads=1), logs, 0), [residuals])


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


def test_courses_of_commands() -> None:
    wave = np.sin(5.0 * TIME)
    courses = {"smooth": wave, "staircase": np.repeat(wave[::20], 20), "steps": np.sign(wave), "constant": np.full(len(TIME), 0.3)}
    courses["rough"] = np.random.default_rng(0).normal(size=len(TIME))
    for course, values in courses.items():
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


# --- what is missing in the model ---
SPINDLE = """
shafts.spindle = { viscous_friction = 0.02, friction_torque = 0.1 }
motors.drive = { shaft = "spindle", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 5e-3 }
simulation = { duration = "1 s", sample_interval = "2 ms" }
"""
SPINDLE_NOISE = 1e-3  # rad


def spindle_result(directory: Path, drag: float, **more: Any) -> IdentificationResult:
    """Of five logs of a spindle with a quadratic drag; the model has Coulomb and viscous friction."""
    (directory / "spindle.toml").write_text(SPINDLE)
    task = Identification(
        **{
            "scenario": "spindle.toml",
            "logs": {"files": ["*.csv"]},
            "inputs": {"drive_command": {"channel": "torque", "interpolation": "hold"}},
            "measured": {"angle": {"channel": "angle", "variable": "spindle_angle", "deviation": SPINDLE_NOISE}},
            "set": {"motors.drive.rotor_inertia": "inertia"}
            | {"shafts.spindle.viscous_friction": "viscous", "shafts.spindle.friction_torque": "coulomb"},
            "parameters": {
                "inertia": {"start": 6e-3, "min": 1e-4, "max": 1.0},
                "viscous": {"start": 0.03, "max": 1.0, "off": 0.0},
                "coulomb": {"start": 0.12, "max": 2.0},
            },
        }
        | more
    )
    rig = Rig(task, directory)
    rng, time = np.random.default_rng(7), 2e-3 * np.arange(1000)
    change = {"shafts.spindle.drag": {"kind": "quadratic", "coefficient": drag, "max_speed": 60.0}} if drag else {}
    train = load(directory / "spindle.toml").replace(**change).train()
    logs = []
    for k in range(5):
        torque = np.round(0.4 * np.sin((3.0 + k) * time + k) + 0.25 * np.sin(11.0 * time), 4)
        drive, angle = Simulation(train, step=2e-3), np.zeros(len(time))
        for n, u in enumerate(torque):
            angle[n] = drive["spindle_angle"]
            drive.advance(2e-3, drive_command=u)
        angle += SPINDLE_NOISE * rng.normal(size=len(time))
        log = Log(f"{k}.csv", time, {"torque": Channel(torque), "angle": Channel(angle)})
        logs.append(prepared(task, log, rig.units))
    return identify_logs(rig, logs, threads=1)


def test_a_wrong_friction_law_is_named_and_flagged_at_every_interval(tmp_path: Path) -> None:
    wrong, right = spindle_result(tmp_path, 1e-3), spindle_result(tmp_path, 0.0)
    (misfit,) = wrong.misfits
    assert misfit.shapes[0][0] == "speed"
    assert "have a shape over speed (" in str(wrong)
    assert all(i.flag.startswith("may miss the value: structured residuals over speed") for i in wrong.intervals.values())
    page = write_identification(tmp_path / "out", "spindle", wrong).read_text()
    assert page.count("may miss the value: structured residuals over speed") >= 3
    assert right.misfits == []
    assert not any(i.flag for i in right.intervals.values())
    for name, value in {"inertia": 5e-3, "viscous": 0.02, "coulomb": 0.1}.items():
        i = right.intervals[name]
        assert abs(right.values[name] - value) < 4.0 * (i.high - i.low) / (2.0 * 1.96), name


def test_an_interval_contains_the_value_of_the_model_next_to_the_one_taken(tmp_path: Path) -> None:
    ladder = [{"name": "dry", "free": ["inertia", "coulomb"]}, {"name": "viscous", "free": ["viscous"]}]
    result = spindle_result(tmp_path, 1e-3, ladder=ladder)
    assert result.chosen == 1
    for name in ("inertia", "coulomb"):
        i = result.intervals[name]
        assert i.low <= result.rungs[0].fit.point.values[name] <= i.high
        assert i.low <= result.values[name] <= i.high


def test_errors_that_last_through_a_log_widen_the_interval() -> None:
    """Eight logs of twelve alike pieces: drawing pieces sees a twelfth of the variance that drawing logs does."""
    g = np.array([1.0, -1.0, 2.0, -2.0, 0.5, -0.5, 1.5, -1.5])
    scores = [np.full((12, 1), 1000.0 * value / 12.0) for value in g]
    p = FreeParameter(start=0.0, min=-1e6, max=1e6, scale=1.0)
    point = ParameterPoint({"x": 0.0}, {})
    fit = Fit(point, 0.0, 0.0, np.ones(1), ("x",), 1, normal=np.array([[1e4]]), scores=scores)
    options = FitOptions(leave_out=())
    logs: list[Any] = [None] * 8
    alone: Any = FitProblem(None, logs, 0, {"x": p}, {}, options)  # type: ignore[arg-type]
    i = bootstrap(alone, fit)["x"]
    # Student's t with 7 degrees of freedom for the sum of eight values. A quantile of 2000 draws has a standard error of 3 %.
    expected = 2.365 * np.sqrt(8.0) * 1000.0 * np.std(g, ddof=1) / 1e4
    assert i.high == pytest.approx(expected, rel=0.1)
    assert i.low == pytest.approx(-expected, rel=0.1)
