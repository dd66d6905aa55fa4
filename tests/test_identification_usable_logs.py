"""Which logs of a task are used: bad ones are left out and listed, a task that is wrong is refused, each in one line."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from identification_logs import AXIS, MASS, POSITION_NOISE, SERVO, released, servo_plans, servo_task, spring_task
from lostmotion.identification.identify import identify_task
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.preparation.recorder_pauses import split_at_pauses
from lostmotion.identification.preparation.usable_logs import distinct_names, gathered
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.readers.log_files import read_log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification, load_identification
from refusals import refused

FILE = (SERVO / "identify.toml").read_text()
SHORT = (
    FILE[: FILE.index("[[ladder]]")] + '[[ladder]]\nname = "one"\nfree = ["torque_constant", "coulomb_friction"]\n[fit]\niterations = 2\n'
)
Change = Callable[[dict[str, Any]], Any]


def servo_log(**header: Any) -> dict[str, Any]:
    """A log of 0.6 s."""
    time = 0.01 * np.arange(60)
    entries = [
        {"timestamp": t, "position": 0.05 * np.sin(9 * t), "goal_position": 0.06 * np.sin(9 * t), "torque_enable": True}
        for t in time.tolist()
    ]
    return {"mass": 0.5, "length": 0.1, "kp": 16, "vin": 15.0, "arm_mass": 0.1, **header, "entries": entries}


def write(directory: Path, name: str, content: dict[str, Any] | str | bytes) -> None:
    text = json.dumps(content) if isinstance(content, dict) else content
    path = directory / "logs" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())


@pytest.fixture
def servo(tmp_path: Path) -> Path:
    """A task with three good logs."""
    (tmp_path / "servo.toml").write_text((SERVO / "servo.toml").read_text())
    (tmp_path / "identify.toml").write_text(SHORT)
    for name, header in (("a", {}), ("b", {"mass": 1.0}), ("c", {"kp": 8})):
        write(tmp_path, f"{name}.json", servo_log(**header))
    return tmp_path


def logs_of(directory: Path) -> tuple[list[Prepared], dict[str, str]]:
    task, _ = load_identification(directory / "identify.toml")
    return gathered(Rig(task, directory), directory)


def changed(change: Change) -> dict[str, Any]:
    log = servo_log()
    change(log)
    return log


def each(**values: Any) -> dict[str, Any]:
    """A log with values in place of those of the entries, or made of the number of the entry."""
    log = servo_log()
    for k, entry in enumerate(log["entries"]):
        entry.update({key: value(k) if callable(value) else value for key, value in values.items()})
    return log


def without(key: str, **header: Any) -> dict[str, Any]:
    log = servo_log(**header)
    log.pop(key, None)
    for entry in log["entries"]:
        entry.pop(key, None)
    return log


UNUSABLE: dict[str, tuple[dict[str, Any] | str, str]] = {
    "an array": ("[1, 2]", "has no list of entries"),
    "deep": ("[" * 200_000, "its lists are too deep"),
    "a number of 5000 digits": ('{"entries": [{"timestamp": ' + "9" * 5000 + "}]}", "is not JSON"),
    "no time": (without("timestamp"), "entries[0] lacks timestamp; add it to each entry, or the interval dt"),
    "a step of time below 0": (without("timestamp", dt=-0.01), "entries[0] lacks timestamp; add it"),
    "no supply voltage": (without("vin"), "has no vin, which key set.controllers.servo.position.gain names; add it to the file, or give it with logs.header"),
    "a mass of nothing": (servo_log(mass=None), "has no mass, which key set.shafts.arm.inertia names"),
    "a length as a list": (servo_log(length=[0.1]), "has no length"),
    "a mass below 0": (servo_log(mass=-1.0), "key gravity.pendulum.mass: -0.95 must be greater than 0"),
    "no length": (servo_log(length=0), "key gravity.pendulum.radius: 0.0 must be greater than 0"),
    "no gain": (servo_log(kp=0), "key controllers.servo.position: has no gain; give gain"),
    "a gain that is not a number": (servo_log(kp=float("nan")), "has the value nan, which is no finite number"),
    "a channel of the phases missing": (without("torque_enable"), "'torque_enable' in 'torque_enable == 0' has no value"),
    "nothing but overflow": (each(position=lambda k: 1e308 * (-1) ** k), "has no number in any sample"),
    "times in ns since 1970": (each(timestamp=lambda k: 1.7e18 + 1e7 * k), "times are read in s: give their unit"),
    "a clock that is set": (each(timestamp=lambda k: 0.01 * k + 1.7e9 * (k > 30)), "split the file where the clock jumps"),
}  # fmt: skip


@pytest.mark.parametrize("what", UNUSABLE)
def test_a_log_that_cannot_be_used_is_left_out_and_the_others_are_not(what: str, servo: Path) -> None:
    content, text = UNUSABLE[what]
    write(servo, "x.json", content)
    logs, left_out = logs_of(servo)
    assert [log.name for log in logs] == ["a.json", "b.json", "c.json"]
    assert list(left_out) == ["x.json"] and text in left_out["x.json"] and "\n" not in left_out["x.json"]


NOTED: dict[str, tuple[dict[str, Any], str]] = {
    "a time as text": (
        changed(lambda log: log["entries"][5].update(timestamp="0.05")),
        "entries[5].timestamp: '0.05' is not a number; its sample is missing there (1 in all)",
    ),
    "a word at the first place": (
        changed(lambda log: log["entries"][0].update(position="x")),
        "entries[0].position: 'x' is not a number; its sample is missing there (1 in all)",
    ),
    "a time that is infinite": (changed(lambda log: log["entries"][5].update(timestamp=float("inf"))), "dropped 1 sample without a time"),
    "a time of 400 digits": (changed(lambda log: log["entries"][5].update(timestamp=10**400)), "dropped 1 sample without a time"),
    "a value beyond all": (changed(lambda log: log["entries"][5].update(position=1e300)), "the residuals of 1 sample in which position is not a number are left out"),
    "a switch of nothing": (changed(lambda log: log["entries"][7].update(torque_enable=None)), "dropped 1 sample in which torque_enable is not a number"),
    "times in ms": (each(timestamp=lambda k: 10.0 * k), "its samples are 10 s apart; times are read in s"),
    "a header with a parameter's name": (servo_log(resistance=99.0), "resistance is known of the log, and a parameter"),
}  # fmt: skip


@pytest.mark.parametrize("what", NOTED)
def test_what_is_odd_in_a_log_is_noted(what: str, servo: Path) -> None:
    content, text = NOTED[what]
    write(servo, "x.json", content)
    logs, left_out = logs_of(servo)
    assert left_out == {} and any(text in note for note in logs[-1].log.notes)


def test_numbers_written_as_words_and_a_byte_order_mark_are_read(servo: Path) -> None:
    write(servo, "x.json", b"\xef\xbb\xbf" + json.dumps(servo_log(kp="8")).encode())
    logs, left_out = logs_of(servo)
    assert left_out == {} and logs[-1].held_out and logs[-1].facts["kp"] == 8.0


WRONG_FILES: dict[str, tuple[str, str, str]] = {
    "pattern": ('"logs/*.json"', '"logs/**.json"', "is no pattern"),
    "no log held out": ("kp == 8", "kp == 9", "'kp == 9' holds for none of the logs, where kp is 16, 8; change"),
    "no log to begin with": ("[fit]", '[fit]\nfirst = "mass > 5"', "'mass > 5' holds for none of the logs, where mass is 0.5, 1"),
    "a name in no header": ('held_out = "kp == 8"', 'held_out = "kq == 8"', "(the first of 3 of 3 logs that cannot be used)"),
    "a record of no gear": ('"gear.train"', '"gear.trian"', "'gear.trian' must be gear.NAME with one of train"),
    "a record of a motor": ('"gear.train"', '"motor.servo"', "'motor.servo' must be gear.NAME"),
    "a parameter called pi": ("[parameters]", "[parameters]\npi = 3\n", "formulas know as something else"),
    "a parameter called max": ("[parameters]", "[parameters]\nmax = 3\n", "formulas know as something else"),
    "a parameter that enters nothing": ('= "coulomb_friction"', "= 0.1", "key parameters.coulomb_friction: enters no formula"),
    "a start out of bounds": ("[fit]", "multi_start = { torque_constant = [1, 99] }\n[fit]", "99 outside of 0.2 to 6"),
    "starts of what is not free": ("[fit]", "multi_start = { resistance = [1] }\n[fit]", "is not free there; add it"),
    "no starts": ("[fit]", "multi_start = { torque_constant = [] }\n[fit]", "without values; give some"),
    "a scale of 0": ('"arm_angle"', '"arm_angle"\nscale = 0', "scale is 0; it must be another number"),
    "a filter below 0": ('"arm_angle"', '"arm_angle"\nfilter_time = -1', "filter_time is -1 s; it must be at least 0"),
    "steps below 0": ('"2*pi/4096"', "-0.1", "key measured.position.resolution: -0.1 must be at least 0"),
    "a phase that no log has": ("{ controllers = {},", "{ controlers = {},", "controlers"),
    "a key of the time": ('files = ["logs/*.json"]', 'files = ["logs/*.json"]\ntime = "clock"', "entries[0] lacks clock"),
}


@pytest.mark.parametrize("what", WRONG_FILES)
def test_a_task_that_is_wrong_is_refused_before_the_fit_in_one_line(what: str, servo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, after, text = WRONG_FILES[what]
    assert before in SHORT
    (servo / "identify.toml").write_text(SHORT.replace(before, after, 1))
    monkeypatch.setattr("lostmotion.identification.identify.identify_logs", lambda *_, **__: pytest.fail("began the fit"))
    message = refused(lambda: lm.identify(servo / "identify.toml"))
    assert message.startswith(f"{servo / 'identify.toml'}: ")
    assert text in message


def test_where_half_of_the_logs_cannot_be_used_the_task_is_refused(servo: Path) -> None:
    for name in "xyz":
        write(servo, f"{name}.json", "{")
    refused(lambda: logs_of(servo), match=r"x\.json: is not JSON .* \(the first of 3 of 6 logs that cannot be used\)")


def test_the_answer_is_that_of_the_good_logs_and_the_command_lists_the_others(servo: Path) -> None:
    from typer.testing import CliRunner

    from lostmotion.cli.entry import app

    good = lm.identify(servo / "identify.toml", threads=1)
    write(servo, "x.json", json.dumps(servo_log())[:30])
    found = lm.identify(servo / "identify.toml", threads=1)
    assert found.values == good.values and list(found.left_out) == ["x.json"]
    ran = CliRunner().invoke(app, ["identify", str(servo / "identify.toml"), "-o", str(servo / "out")])
    assert "Left out, since they cannot be used, are 1 of 4 logs:\n  x.json: is not JSON" in ran.output
    assert re.search("x.json</td><td[^>]*>is not JSON", (servo / "out" / "identified.html").read_text())
    assert "x.json" not in (servo / "out" / "errors.csv").read_text()


def test_logs_of_one_name_keep_apart(servo: Path) -> None:
    """Two recordings 001.json, of two gains in two directories."""
    for kp in (4, 32):
        write(servo, f"kp{kp}/001.json", servo_log(kp=kp))
    (servo / "identify.toml").write_text(SHORT.replace("logs/*.json", "logs/**/*.json"))
    logs, _ = logs_of(servo)
    assert {log.name: log.facts["kp"] for log in logs if "001" in log.name} == {"kp4/001.json": 4, "kp32/001.json": 32}
    paths = [Path("a/x/1.csv"), Path("b/x/1.csv"), Path("b/2.csv")]
    assert distinct_names(paths) == ["a/x/1.csv", "b/x/1.csv", "2.csv"]


# --- what a log lacks ---
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
    refused(
        lambda: prepared(task, Log("log.csv", np.arange(20) * 0.01, channels), Rig(task, tmp_path).units),
        match=r"^log\.csv: channel raw: the unit 'counts' is not known, and a formula",
    )


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


def lacking(*channels: str) -> dict[str, np.ndarray]:
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
    "position": (lacking("angle"), ALL, ("angle", "speed")),
    "speed": (lacking("speed"), ALL, ("angle", "speed")),
    "both": (lacking("angle", "speed"), ALL, ("angle", "speed")),
    "position alone": (lacking("angle"), ALL, ("angle",)),
    "input": (lacking("force"), ALL, ("angle", "speed")),
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
