"""What a log lacks: units other than SI, samples without a number, and pauses do not change the values that are found."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification_logs import AXIS, MASS, POSITION_NOISE, SERVO, released, servo_plans, servo_task, spring_task
from lostmotion.identification.identify import identify_task
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.preparation.recorder_pauses import split_at_pauses
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.readers.log_files import read_log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from refusals import refuses


@pytest.mark.parametrize(("unit", "factor"), [("rad", 1.0), ("mrad", 1e3), ("deg", 180.0 / np.pi)])
def test_a_log_in_another_unit_gives_the_same_mass(tmp_path: Path, unit: str, factor: float) -> None:
    """The first value of the channel is where the run begins."""
    time = np.arange(0.0, 3.0, 2e-3)
    x = released(time, 0.05) + POSITION_NOISE * np.random.default_rng(1).normal(size=len(time))
    rows = "\n".join(f"{t:.4f},{factor * v:.9g}" for t, v in zip(time, x, strict=True))
    (tmp_path / "log.csv").write_text(f"time [s],pos [{unit}]\n{rows}\n")
    result = identify_task(spring_task(tmp_path), tmp_path, threads=1)
    assert result.values["mass"] == pytest.approx(MASS, rel=2e-3)
    assert result.error()[1] == pytest.approx(POSITION_NOISE, rel=0.1)


def test_first_values_means_and_conditions_are_in_si(tmp_path: Path) -> None:
    task = spring_task(tmp_path, logs={"files": ["*.csv"], "weight": "1 + 9*(speed > 1)", "stated": {"vin": "volts"}})
    time = np.arange(20) * 0.01
    channels = {
        "pos": Channel(100.0 + np.arange(20.0), "mrad"),
        "speed": Channel(np.repeat([5.0, 20.0], 10), "rpm"),
        "volts": Channel(np.full(20, 12e3), "mV"),
        "raw": Channel(np.arange(20.0), "counts"),
    }
    rig = Rig(task, tmp_path)
    log = prepared(task, Log("log.csv", time, channels, {"vin": 12.0}), rig.units)
    assert log.facts["first_pos"] == pytest.approx(0.1)
    assert log.facts["mean_pos"] == pytest.approx(0.1095)
    assert log.facts["mean_volts"] == pytest.approx(12.0) and not log.log.notes
    assert log.weight.tolist() == [1.0] * 10 + [10.0] * 10  # 20 rpm are 2.1 rad/s


def test_a_formula_with_a_channel_of_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    task = spring_task(tmp_path, set={"motors.drive.rotor_inertia": "mass + 0*first_raw"})
    channels = {"pos": Channel(np.arange(20.0)), "raw": Channel(np.arange(20.0), "counts")}
    with refuses(match=r"^log\.csv: channel raw: the unit 'counts' is not known, and a formula"):
        prepared(task, Log("log.csv", np.arange(20) * 0.01, channels), Rig(task, tmp_path).units)


TRUTH = {"mass": 95.0, "viscous_friction": 200.0, "coulomb_friction": 20.0}
INTERVAL = 2e-3  # s
VARIABLES = {"angle": "position", "speed": "speed"}  # of the slide, by the names in the logs


def axis_task(directory: Path, variables: tuple[str, ...] = ("angle", "speed"), **more: Any) -> Identification:
    (directory / "axis.toml").write_text(AXIS)
    deviations = {"angle": POSITION_NOISE, "speed": 1e-3}
    names = {"mass": 60.0, "viscous_friction": 120.0, "coulomb_friction": 10.0}
    data: dict[str, Any] = {
        "scenario": "axis.toml",
        "logs": {"files": ["*.csv"]},
        "inputs": {"drive_command": {"channel": "force", "interpolation": "hold"}},
        "measured": {v: {"channel": v, "variable": f"carriage_{VARIABLES[v]}", "deviation": deviations[v]} for v in variables},
        "set": {
            "linear_motors.drive.mass": "mass",
            "slides.carriage.viscous_friction": "viscous_friction",
            "slides.carriage.friction_force": "coulomb_friction",
        },
        "parameters": {name: {"start": start, "min": 1.0, "max": 500.0} for name, start in names.items()},
        "fit": {"regression": False, "iterations": 15},
    }
    return Identification(**data | more)


def stride(x: float, v: float, force: float, h: float) -> tuple[float, float]:
    """Position and speed after h under m x'' = F - b x' - c sign(x'), in closed form; at rest the friction holds up to c."""
    m, b, c = TRUTH.values()
    if v == 0.0 and abs(force) <= c:
        return x, 0.0
    way = np.sign(v) if v != 0.0 else np.sign(force)
    final, rate = (force - c * way) / b, b / m
    stop = np.log1p(-v / final) / rate if v * final < 0.0 else np.inf  # v = final + (v - final) exp(-rate t) is 0
    t = min(h, stop)
    x += final * t + (v - final) * -np.expm1(-rate * t) / rate
    return stride(x, 0.0, force, h - t) if stop < h else (x, final + (v - final) * np.exp(-rate * t))


def driven(seconds: float = 6.0) -> dict[str, np.ndarray]:
    """The axis from rest, the force held between samples."""
    count = round(seconds / INTERVAL)
    time = INTERVAL * np.arange(count)
    force = 60.0 * np.sign(np.sin(2.1 * time)) + 50.0 * np.sin(5.3 * time + 0.4)
    angle, speed = np.zeros(count), np.zeros(count)
    for k in range(1, count):
        angle[k], speed[k] = stride(angle[k - 1], speed[k - 1], force[k - 1], INTERVAL)
    draw = np.random.default_rng(3)
    angle += POSITION_NOISE * draw.normal(size=count)
    speed += 1e-3 * draw.normal(size=count)
    return {"time": time, "force": force, "angle": angle, "speed": speed}


DRIVEN = driven()
BLOCK = slice(800, 1050)  # 0.5 s of motion


def csv_of(table: dict[str, np.ndarray], rows: np.ndarray) -> str:
    units = {"time": "s", "force": "N", "angle": "m", "speed": "m/s"}
    lines = [",".join(f"{name} [{units[name]}]" for name in table)]
    for row in np.array(list(table.values())).T[rows]:
        lines.append(",".join("" if np.isnan(x) else f"{x:.9g}" for x in row))
    return "\n".join(lines) + "\n"


def without(*channels: str) -> dict[str, np.ndarray]:
    """The log with a block in which some channels have no number."""
    table = {name: x.copy() for name, x in DRIVEN.items()}
    for name in channels:
        table[name][BLOCK] = np.nan
    return table


ALL = np.ones(len(DRIVEN["time"]), dtype=bool)
PAUSED = ALL.copy()
PAUSED[BLOCK] = False
GAPS: dict[str, tuple[dict[str, np.ndarray], np.ndarray, tuple[str, ...]]] = {
    "none": (DRIVEN, ALL, ("angle", "speed")),
    "position": (without("angle"), ALL, ("angle", "speed")),
    "speed": (without("speed"), ALL, ("angle", "speed")),
    "both": (without("angle", "speed"), ALL, ("angle", "speed")),
    "position alone": (without("angle"), ALL, ("angle",)),
    "input": (without("force"), ALL, ("angle", "speed")),
    "pause": (DRIVEN, PAUSED, ("angle", "speed")),
    "pause, position alone": (DRIVEN, PAUSED, ("angle",)),
    "pause, speed alone": (DRIVEN, PAUSED, ("speed",)),
}


@pytest.mark.parametrize("what", GAPS)
def test_a_gap_does_not_change_the_mass(what: str, tmp_path: Path) -> None:
    """Each value is within 1.53 times its 95 % interval, which is three standard deviations."""
    table, rows, variables = GAPS[what]
    (tmp_path / "log.csv").write_text(csv_of(table, rows))
    result = identify_task(axis_task(tmp_path, variables), tmp_path, threads=1)
    for name, value in TRUTH.items():
        i = result.intervals[name]
        middle, half = 0.5 * (i.low + i.high), 0.5 * 1.53 * (i.high - i.low)
        assert abs(value - middle) < half, (name, i, value)
        assert half < 0.02 * value, (name, i)
    for variable, noise in (("angle", POSITION_NOISE), ("speed", 1e-3)):
        if variable in variables:
            assert result.error(variable)[1] == pytest.approx(noise, rel=0.05)


def test_a_pause_under_dead_time_and_a_late_channel_does_not_change_the_mass(tmp_path: Path) -> None:
    """The force acts 6 ms after its sample; the position is shown 10 ms late, which is sought from 8 ms."""
    dead, late, still = 3, 5, 50  # samples
    table = {name: np.concatenate([np.zeros(still), DRIVEN[name]]) for name in ("force", "angle")}
    table["angle"][:still] += POSITION_NOISE * np.random.default_rng(4).normal(size=still)
    table["force"], table["angle"] = np.roll(table["force"], -dead)[late:], table["angle"][:-late]
    table = {"time": INTERVAL * np.arange(len(table["force"])), **table}
    rows = np.concatenate([ALL[: still - late], PAUSED])
    (tmp_path / "log.csv").write_text(csv_of(table, rows))
    task = axis_task(tmp_path, ("angle",))
    data = task.model_dump()
    data["inputs"]["drive_command"]["delay"] = dead * INTERVAL
    data["measured"]["angle"]["delay"] = "late"
    data["parameters"]["late"] = {"start": "8 ms", "max": "50 ms", "unit": "s", "scale": "5 ms"}
    data["set"]["initial.positions.carriage"] = "begin"
    data["set"]["initial.slide_speeds.carriage"] = "begin_speed"
    data["nuisance"] = {n: {"start": 0.0, "min": -1.0, "tolerance": 0.5, "scale": 0.01} for n in ("begin", "begin_speed")}
    result = identify_task(Identification(**data), tmp_path, threads=1)
    assert len(result.logs) == 2
    assert result.values["late"] == pytest.approx(late * INTERVAL, abs=1e-5)
    assert result.values["mass"] == pytest.approx(95.0, rel=1e-3)
    assert result.error("angle")[1] == pytest.approx(POSITION_NOISE, rel=0.05)


def test_a_glitch_of_a_measured_channel_is_no_gap_of_the_input(tmp_path: Path) -> None:
    angle = DRIVEN["angle"].copy()
    angle[700] += 0.5
    (tmp_path / "log.csv").write_text(csv_of(DRIVEN | {"angle": angle}, ALL))
    log = read_log(tmp_path / "log.csv")
    task = axis_task(tmp_path)
    seen = prepared(task, log, Rig(task, tmp_path).units)
    assert np.flatnonzero(~seen.valid[0]).tolist() == [700] and seen.valid[1].all()
    assert seen.inputs["drive_command"].tolist() == log.values("force").tolist()


def test_a_log_whose_first_value_is_missing_begins_where_it_is_measured(tmp_path: Path) -> None:
    table = {name: x[500:].copy() for name, x in DRIVEN.items()}  # in motion
    table["angle"][:40] = np.nan
    (tmp_path / "log.csv").write_text(csv_of(table, ALL[500:]))
    data = axis_task(tmp_path, ("angle",)).model_dump()
    data["set"]["initial.positions.carriage"] = "first_angle"
    result = identify_task(Identification(**data), tmp_path, threads=1)
    assert result.values["mass"] == pytest.approx(95.0, rel=1e-3)
    assert result.error("angle")[1] == pytest.approx(POSITION_NOISE, rel=0.05)


@pytest.mark.parametrize(("changes", "seconds"), [(True, 0.5), (False, 1.4)])
def test_a_rig_whose_state_no_channel_shows_is_used_up_to_its_pause(tmp_path: Path, changes: bool, seconds: float) -> None:
    """The gear is compliant; a goal that is the same before and after the pause is taken as having stayed."""
    data = servo_task(tmp_path).model_dump()
    data["set"]["gears.train.stiffness"] = {"kind": "linear", "stiffness": 1e3}
    rig = Rig(Identification(**data), SERVO)
    plan = servo_plans(1, duration=1.4)[0]
    goal = plan.values("goal_position") if changes else np.full(len(plan.time), 0.3)
    keep = (plan.time < 0.495) | (plan.time > 0.705)
    log = replace(plan, channels={**plan.channels, "goal_position": Channel(goal)}).only(keep, "")
    _, (part,), left_out = split_at_pauses(rig, [prepared(rig.task, log, rig.units)])
    assert left_out == {} and part.time[-1] == pytest.approx(seconds - 0.01)
    noted = [note for note in part.log.notes if "used up to its pause at 0.49 s: no channel shows the twist of gears.train" in note]
    assert len(noted) == changes
