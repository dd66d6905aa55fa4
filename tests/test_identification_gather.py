"""Which logs of a task are used: bad ones are left out and listed, a task that is wrong is refused, each in one line."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from identification_logs import SERVO
from lostmotion.identification.preparation.usable_logs import distinct_names, gathered
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import load_identification
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
    "no supply voltage": (
        without("vin"),
        "has no vin, which key set.controllers.servo.position.gain names; add it to the file, or give it with logs.header",
    ),
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
}


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
    "a value beyond all": (
        changed(lambda log: log["entries"][5].update(position=1e300)),
        "the residuals of 1 sample in which position is not a number are left out",
    ),
    "a switch of nothing": (
        changed(lambda log: log["entries"][7].update(torque_enable=None)),
        "dropped 1 sample in which torque_enable is not a number",
    ),
    "times in ms": (each(timestamp=lambda k: 10.0 * k), "its samples are 10 s apart; times are read in s"),
    "a header with a parameter's name": (servo_log(resistance=99.0), "resistance is known of the log, and a parameter"),
}


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
