"""Monitoring: changes of a drive found from its operation logs, and the false-alarm rate that is stated."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import some
from lostmotion.cli.entry import app
from lostmotion.identification.monitor.change_detection import SIZES, _log_factors, find_change
from lostmotion.identification.monitor.monitor import LogEstimate, _in_units_of_baseline
from refusals import refused

JOINT = """
shafts.motor = { friction_torque = "8 mN*m" }
shafts.arm = { inertia = "0.25 kg*m^2", friction_torque = "0.8 N*m" }
motors.drive = { shaft = "motor", kind = "torque_source", rated_torque = 1.0, rotor_inertia = "0.8 kg*cm^2" }
simulation = { duration = "1 s", sample_interval = "1 ms" }
[gears.mesh]
input = "motor"
output = "arm"
ratio = 80
stiffness = { kind = "curve", backlash = "0.6 mrad", slopes = ["9000 N*m/rad"] }
mesh_damping = "20 N*m*s/rad"
losses = { kind = "constant_efficiency", efficiency = 0.9 }
"""
STEP = 2.0 * np.pi / 2**17  # of the motor's encoder
NOISE = 1e-4  # rad
TASK: dict[str, Any] = {
    "title": "Joint",
    "scenario": "joint.toml",
    "logs": {"files": ["logs/*.csv"]},
    "inputs": {"drive_command": {"channel": "torque", "interpolation": "hold"}},
    "measured": {"motor": {"channel": "motor", "variable": "motor_angle", "resolution": STEP, "deviation": 1.02e-4}},
    "set": {"gears.mesh.stiffness.backlash": "backlash", "shafts.motor.friction_torque": "friction"},
    "parameters": {
        "backlash": {"start": 0.58e-3, "min": 1e-5, "max": 5e-3, "unit": "mrad"},
        "friction": {"start": 0.0085, "max": 0.05, "unit": "N*m"},
    },
    "monitor": {"baseline": 8, "order": "hours", "watch": {"backlash": {"direction": "up", "max": "0.68 mrad"}, "friction": {}}},
}


def write_logs(directory: Path, backlash: Callable[[int], float], count: int, *, still: tuple[int, ...] = ()) -> Path:
    """Logs of a joint whose friction differs from log to log by 4 %; returns the identification file."""
    (directory / "logs").mkdir()
    (directory / "joint.toml").write_text(JOINT)
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 1.0, 1e-3)
    scenario = lm.load(directory / "joint.toml")
    for k in range(count):
        friction = 0.008 * (1.0 + 0.04 * rng.normal())
        values = {"gears.mesh.stiffness.backlash": backlash(k), "shafts.motor.friction_torque": friction}
        drive = lm.Simulation(scenario.replace(**values).train(), step=1e-3)
        phase, w = rng.uniform(0.0, 1.0), rng.uniform(7.0, 11.0)
        torque = np.round(0.11 * np.sin(w * time + phase), 5) * (0.02 if k in still else 1.0)
        angle = np.zeros(len(time))
        for n, u in enumerate(torque):
            angle[n] = 80.0 * (drive["arm_angle"] + drive["mesh_twist"])
            drive.advance(1e-3, drive_command=u)
        angle = STEP * np.round((angle + NOISE * rng.normal(size=len(time))) / STEP)
        rows = "\n".join(f"{t:.3f},{u:.6g},{q:.8g}" for t, u, q in zip(time, torque, angle, strict=True))
        text = f"# hours: {100 - k}\ntime [s],torque [N*m],motor [rad]\n{rows}\n"  # the last file is the first log
        (directory / "logs" / f"{count - k:03d}.csv").write_text(text.replace(f"hours: {100 - k}", f"hours: {k}"))
    return write_task(directory, TASK)


def write_task(directory: Path, task: dict[str, Any]) -> Path:
    """The identification file; JSON values are TOML ones here, apart from tables."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in task.items() if not isinstance(value, dict)]

    def table(name: str, entries: dict[str, Any]) -> None:
        plain = {k: v for k, v in entries.items() if not isinstance(v, dict)}
        lines.append(f"[{name}]")
        lines.extend(f"{json.dumps(k)} = {json.dumps(v)}" for k, v in plain.items())
        for k, v in entries.items():
            if isinstance(v, dict):
                table(f"{name}.{k}", v)

    for key, value in task.items():
        if isinstance(value, dict):
            table(key, value)
    (directory / "task.toml").write_text("\n".join(lines))
    return directory / "task.toml"


def test_logs_without_any_residual_are_not_odd() -> None:
    exact, off = (LogEstimate(str(r), 0.0, {}, {}, {}, r) for r in (0.0, 1e-3))
    assert _in_units_of_baseline([off] * 5 + [exact], 5)[-1].residual > 0.0
    found = _in_units_of_baseline([exact] * 5 + [off], 5)
    assert [e.residual for e in found] == [1.0] * 5 + [np.inf]
    assert [bool(e.why) for e in found] == [False] * 5 + [True]


# --- a drive ---
@pytest.fixture(scope="module")
def worn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Backlash grows by 0.1 mrad with the thirteenth log; the fifth one stands still."""
    directory = tmp_path_factory.mktemp("worn")
    return write_logs(directory, lambda k: 0.6e-3 if k < 12 else 0.7e-3, 18, still=(4,))


@pytest.fixture(scope="module")
def result(worn: Path) -> lm.identification.MonitorResult:
    return lm.monitor(worn)


def test_backlash_that_grows_by_a_tenth_of_a_milliradian_is_found_from_the_motor_encoder(result: lm.identification.MonitorResult) -> None:
    backlash = result.watched["backlash"]
    assert backlash.change is not None
    assert backlash.change.alarm is not None
    assert backlash.begins == 12
    assert result.logs[backlash.begins].at == 12.0
    assert backlash.before == pytest.approx(0.6e-3, abs=2e-6)
    assert backlash.level is not None
    # The interval is of the mean of six logs: it contains the truth, and is far from the value before.
    assert backlash.level.low <= 0.7e-3 <= backlash.level.high
    assert backlash.level.high - backlash.level.low < 0.02e-3
    assert backlash.beyond is True
    assert "beyond the largest permitted value 0.68 mrad" in backlash.text
    friction = result.watched["friction"]
    assert not friction.alarm
    assert [w.name for w in result.alarms] == ["backlash"]


def test_a_log_without_motion_tells_nothing_of_the_backlash(result: lm.identification.MonitorResult) -> None:
    assert "backlash" not in result.logs[4].told
    assert 4 not in result.watched["backlash"].logs
    assert all("backlash" in e.told for e in result.logs if e.at != 4.0)
    series = result.series("backlash")
    assert series["at"].tolist() == [float(k) for k in range(18)]
    assert series["told"].tolist() == [k != 4 for k in range(18)]


def test_each_log_says_what_friction_it_was_driven_with(result: lm.identification.MonitorResult) -> None:
    rng = np.random.default_rng(1)
    truth = []
    for _ in range(18):
        truth.append(0.008 * (1.0 + 0.04 * rng.normal()))
        rng.uniform(size=2)
        rng.normal(size=1000)
    found = result.series("friction")
    moved = np.arange(18) != 4
    assert found["value"][moved] == pytest.approx(np.array(truth)[moved], rel=2e-3)


def test_the_command_writes_a_page_and_ends_with_1_where_something_has_changed(worn: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke(app, ["monitor", str(worn), "-o", str(tmp_path / "out")])
    assert run.exit_code == 1, run.output
    assert "backlash: changed since 006.csv" in run.output
    page = (tmp_path / "out" / "monitor.html").read_text()
    assert "Verdict: does not fit" in page
    assert len(page) < 2e6
    rows = (tmp_path / "out" / "values.csv").read_text().splitlines()
    assert rows[0] == "log,place,residual,parameter,value,low,high,told"
    assert len(rows) == 1 + 18 * 2
    healthy = [str(worn.parent / "logs" / f"{k:03d}.csv") for k in range(7, 19)]
    run = CliRunner().invoke(app, ["monitor", str(worn), *healthy, "-o", str(tmp_path / "healthy")])
    assert run.exit_code == 0, run.output


@pytest.mark.parametrize(("change", "message"), [
    ({"constant": ["backlash"]}, "backlash in watch and in constant"),
    ({"watch": {"backlsh": {}}}, "did you mean backlash"),
    ({"watch": {"backlash": {"max": "1 s"}}}, "monitor.watch.backlash.max"),
    ({"watch": {"backlash": {"min": 2e-3, "max": 1e-3}}}, "not below max"),
    ({"model": "stick"}, "no model of the ladder"),
    ({"order": "days"}, "monitor.order"),
    ({"baseline": 5, "conditions": ["hours"]}, "give it 6 or more"),
    ({"watch": {}, "constant": ["backlash", "friction"]}, "none is left to be watched"),
])  # fmt: skip
def test_a_table_that_cannot_be_used_is_refused(worn: Path, change: dict[str, Any], message: str) -> None:
    path = worn.with_name("other.toml")
    task = write_task(worn.parent, TASK | {"monitor": TASK["monitor"] | change})
    task.rename(path)
    write_task(worn.parent, TASK)
    refused(lambda: lm.monitor(path), match=message)


# --- statistics ---
def test_the_bayes_factor_is_the_quotient_of_two_integrals() -> None:
    """Over level, scale and size of the change, by sums over fine grids."""
    x = np.array([0.3, -0.4, 0.1, 0.2, 1.9, 2.2])
    d = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    log_sigma = np.linspace(-5.0, 7.0, 301)
    sigma = np.exp(log_sigma)[:, None]
    mu = x.mean() + sigma * np.linspace(-14.0, 14.0, 351)  # in units of sigma

    def over_level_and_scale(size: float) -> float:
        squares = sum(((value - mu) / sigma - size * step) ** 2 for value, step in zip(x, d, strict=True))
        return float(np.sum(np.exp(-0.5 * squares) * sigma ** (1 - len(x))))  # d mu d sigma/sigma = sigma d(mu/sigma) d log sigma

    s = SIZES[0]
    sizes = np.linspace(-7.0, 7.0, 141)  # both ends and 0 are in it
    prior = np.exp(-0.5 * (sizes / s) ** 2) / (s * np.sqrt(2.0 * np.pi)) * (sizes[1] - sizes[0])
    likelihood = np.array([over_level_and_scale(a) for a in sizes]) / over_level_and_scale(0.0)
    both = float(np.sum(prior * likelihood))
    half = np.where(sizes > 0.0, 1.0, np.where(sizes == 0.0, 0.5, 0.0))
    above = float(np.sum(2.0 * half * prior * likelihood))
    logs, _ = _log_factors(x, np.ones(6), np.zeros((6, 0)), 4, "both")
    up, _ = _log_factors(x, np.ones(6), np.zeros((6, 0)), 4, "up")
    assert np.exp(logs[5, 0, 0, 0]) == pytest.approx(both, rel=1e-3)
    assert np.exp(up[5, 0, 0, 0]) == pytest.approx(above, rel=1e-3)


@pytest.mark.parametrize("direction", ["both", "up"])
def test_false_alarms_are_rarer_than_stated(direction: Any) -> None:
    """Of series without a change 5 % may give an alarm: at most three standard deviations of the count above."""
    rng, series = np.random.default_rng(2), some(300, 100)
    alarms = 0
    for _ in range(series):
        x = 3.0 + 0.2 * rng.normal(size=40)
        found = find_change(x, np.ones(40), np.zeros((40, 0)), 10, direction=direction, false_alarms=0.05, within=30)
        alarms += found.alarm is not None
    assert alarms <= 0.05 * series + 3.0 * np.sqrt(0.05 * 0.95 * series)


def test_the_mean_of_the_evidence_is_that_of_a_martingale() -> None:
    """After n values behind the baseline its expectation is n/within; large values are rare, so that its logarithm is not looked at."""
    rng = np.random.default_rng(3)
    logs = [_log_factors(rng.normal(size=12), np.ones(12), np.zeros((12, 0)), 10, "both")[0] for _ in range(2000)]
    factor = np.exp(np.array([own[11, 0, 0, 0] for own in logs]))  # prior deviation 1: a finite variance
    assert factor.mean() == pytest.approx(1.0, abs=4.0 * factor.std() / np.sqrt(len(factor)))


def test_a_known_condition_is_no_change() -> None:
    rng = np.random.default_rng(4)
    temperature = np.concatenate([rng.normal(size=20), 3.0 + rng.normal(size=20)])
    x = 1.0 + 0.5 * temperature + 0.1 * rng.normal(size=40)
    without = find_change(x, np.ones(40), np.zeros((40, 0)), 20)
    with_it = find_change(x, np.ones(40), temperature[:, None], 20)
    assert without.alarm is not None
    assert with_it.alarm is None


def test_a_drift_and_a_step_are_told_apart() -> None:
    rng = np.random.default_rng(5)
    noise = rng.normal(size=120)
    step = find_change(noise + 4.0 * (np.arange(120) >= 60), np.ones(120), np.zeros((120, 0)), 30)
    drift = find_change(noise + 0.15 * np.maximum(0, np.arange(120) - 60), np.ones(120), np.zeros((120, 0)), 30)
    assert step.ramp == 1
    assert step.begins is not None
    assert step.begins[0] == 60
    assert drift.ramp > 1
    assert drift.begins is not None
    assert drift.begins[1] <= 62 <= drift.begins[2] + 5


def test_one_value_that_is_wrong_makes_no_alarm() -> None:
    x = np.random.default_rng(6).normal(size=40)
    x[30] += 12.0
    assert find_change(x, np.ones(40), np.zeros((40, 0)), 20).alarm is None
