"""A log that was spoiled is named with its fault and left out, so that the values are those of the other logs."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from conftest import some
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.preparation.screening import constant_stretches, wrapped_by
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.result import IdentificationResult
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.identification.virtual_logs import virtual_log
from refusals import refused

ARM = """
[shafts.rotor]
friction_torque = 5e-3
viscous_friction = 2e-4
[shafts.arm]
inertia = 0.1
viscous_friction = 0.05
[motors.drive]
shaft = "rotor"
kind = "torque_source"
rated_torque = 1.0
rotor_inertia = 1e-4
[gears.g]
input = "rotor"
output = "arm"
ratio = 20
[simulation]
duration = "1 s"
sample_interval = "1 ms"
"""
TRUTH = {"inertia": 0.1, "friction": 5e-3, "viscous_friction": 0.05}
NOISE = 1e-3  # rad, of the arm's encoder
COUNT = 5
SPOILED = 2


def arm_task(directory: Path, seed: int = 0, truth: dict[str, float] = TRUTH) -> Identification:
    (directory / "arm.toml").write_text(ARM)
    draw = np.random.default_rng(seed)
    away = {name: float(value * draw.uniform(0.8, 1.25)) for name, value in truth.items()}
    return Identification(
        scenario="arm.toml",
        logs={"files": ["*.csv"]},
        inputs={"drive_command": {"channel": "torque", "interpolation": "hold"}},
        measured={"angle": {"channel": "angle", "variable": "arm_angle", "deviation": NOISE}},
        set={
            "shafts.arm.inertia": "inertia",
            "shafts.rotor.friction_torque": "friction",
            "shafts.arm.viscous_friction": "viscous_friction",
        },
        parameters={
            "inertia": {"start": away["inertia"], "min": 0.01, "max": 1.0},
            "friction": {"start": away["friction"], "max": 0.1},
            "viscous_friction": {"start": away["viscous_friction"], "max": 1.0},
        },
        fit={"regression": False, "iterations": 15},
    )


def arm_logs(rig: Rig, seed: int, truth: dict[str, float] = TRUTH) -> list[Log]:
    draw = np.random.default_rng(seed)
    time = 5e-3 * np.arange(400)
    found = []
    for k in range(COUNT):
        a, b, f = draw.uniform(0.05, 0.12), draw.uniform(0.02, 0.05), draw.uniform(0.7, 2.0)
        torque = a * np.sin(2 * np.pi * f * time + k) + b * np.sin(2 * np.pi * 2.7 * f * time)
        plan = Log(f"{k}.csv", time, {"torque": Channel(torque)})
        found.append(virtual_log(rig, plan, truth, noise={"angle": NOISE}, seed=seed + k))
    return found


def changed(log: Log, channel: str, change: Callable[[np.ndarray], np.ndarray]) -> Log:
    own = log.channels[channel]
    return replace(log, channels={**log.channels, channel: replace(own, values=change(own.values))})


def held(x: np.ndarray, every: int) -> np.ndarray:
    return np.repeat(x[::every], every)[: len(x)]


def late(x: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate([np.full(samples, x[0]), x[:-samples]])


def frozen(x: np.ndarray) -> np.ndarray:
    x = x.copy()
    x[120:220] = x[120]
    return x


def wrapped(x: np.ndarray) -> np.ndarray:
    period = 0.6 * float(np.ptp(x))
    return np.asarray(np.mod(x + 0.5 * period, period) - 0.5 * period)


# Fault put in -> what the answer must name.
FAULTS: dict[str, tuple[Callable[[Log], Log], str]] = {
    "sign of the sensor": (lambda log: changed(log, "angle", np.negative), "the opposite sign"),
    "sign of the command": (lambda log: changed(log, "torque", np.negative), "the opposite sign"),
    "angle in mrad": (lambda log: changed(log, "angle", lambda x: 1e3 * x), "angle is 1000 times too large"),
    "command in mN m": (lambda log: changed(log, "torque", lambda x: 1e3 * x), "torque is 1000 times too large"),
    "angle in degrees": (lambda log: changed(log, "angle", np.rad2deg), "angle is in degrees, read as rad"),
    "angle of the motor": (lambda log: changed(log, "angle", lambda x: 20.0 * x), "a factor of 20 too large"),
    "angle in turns of the motor": (lambda log: changed(log, "angle", lambda x: x / 20.0), "a factor of 20 too small"),
    "times in ms": (lambda log: replace(log, time=1e3 * log.time), "times are in ms, read as s"),
    "wrapped encoder": (lambda log: changed(log, "angle", wrapped), "as a counter that wraps"),
    "frozen sensor": (lambda log: changed(log, "angle", frozen), "angle is frozen from 0.6 to"),
    "slow sensor": (lambda log: changed(log, "angle", lambda x: held(x, 20)), "of its samples only"),
    "late sensor": (lambda log: changed(log, "angle", lambda x: late(x, 8)), "angle is [34][90].?[0-9]? ms late"),
    "late command": (lambda log: changed(log, "torque", lambda x: late(x, 10)), "the inputs are 50 ms late"),
    "fast clock": (lambda log: replace(log, time=1.03 * log.time), "its clock runs 3 % too fast"),
    "offset": (lambda log: changed(log, "angle", lambda x: x + 0.3), "has an offset of 0."),
}


def identified(directory: Path, seed: int, spoil: Callable[[Log], Log]) -> IdentificationResult:
    rig = Rig(arm_task(directory, seed), directory)
    logs = arm_logs(rig, 100 * seed)
    logs[SPOILED] = spoil(logs[SPOILED])
    return identify_logs(rig, [prepared(rig.task, log, rig.units) for log in logs], threads=1)


@pytest.mark.parametrize(
    ("fault", "seed"), [(fault, seed) for fault in FAULTS for seed in ((2,) if fault == "times in ms" else (2, 1, 3)[: some(3, 1)])]
)
def test_a_spoiled_log_is_named_with_its_fault_and_left_out(tmp_path: Path, fault: str, seed: int) -> None:
    spoil, words = FAULTS[fault]
    result = identified(tmp_path, seed, spoil)
    named = [o for o in result.odd if o.log == f"{SPOILED}.csv"]
    assert len(result.odd) == 1 and re.search(words, named[0].text), result.odd
    assert result.left_out == {f"{SPOILED}.csv": named[0].text}
    assert result.warnings() == [f"{named[0].text}, so that it is left out of the fit"]
    for name, value in TRUTH.items():
        i = result.intervals[name]
        assert abs(value - result.values[name]) < 1.5 * (i.high - i.low), name  # six standard deviations


def test_signs_that_the_log_does_not_distinguish_are_both_named(tmp_path: Path) -> None:
    """From rest, a motion with the opposite torque is the opposite motion."""
    (odd,) = identified(tmp_path, 1, FAULTS["sign of the command"][0]).odd
    assert "angle has the opposite sign, or torque has the opposite sign" in odd.text


def test_a_channel_of_another_kind_is_refused_without_a_factor(tmp_path: Path) -> None:
    task = arm_task(tmp_path)
    rig = Rig(task, tmp_path)
    log = arm_logs(rig, 0)[0]
    log = replace(log, channels=log.channels | {"torque": Channel(log.channels["torque"].values, "A")})
    assert "inputs.drive_command: channel torque is in A, and drive_command is in N*m" in refused(lambda: prepared(task, log, rig.units))
    scaled = task.inputs["drive_command"].model_copy(update={"scale": 0.08})
    scaled = type(scaled).model_validate(scaled.model_dump())
    assert prepared(task.model_copy(update={"inputs": {"drive_command": scaled}}), log, rig.units).log.duration > 1.0


@pytest.mark.parametrize("seed", range(4))
def test_logs_as_they_were_recorded_are_not_odd(tmp_path: Path, seed: int) -> None:
    result = identified(tmp_path, seed, lambda log: log)
    assert not result.odd and not result.left_out and len(result.logs) == COUNT


def test_a_log_that_no_fault_explains_is_named_and_stays(tmp_path: Path) -> None:
    """A weight nobody logged pushes the arm half of the time."""

    def pushed(log: Log) -> Log:
        x = log.channels["angle"].values
        return changed(log, "angle", lambda _: x + 0.5 * np.sin(7.0 * log.time) ** 3 * x)

    result = identified(tmp_path, 1, pushed)
    (odd,) = result.odd
    assert odd.log == f"{SPOILED}.csv" and not odd.fault and "stays in the fit" in result.warnings()[0]
    assert not result.left_out and len(result.logs) == COUNT


def test_wraps_and_frozen_stretches_are_noted_in_a_single_log(tmp_path: Path) -> None:
    rig = Rig(arm_task(tmp_path), tmp_path)
    log = arm_logs(rig, 0)[0]
    assert "frozen" in prepared(rig.task, changed(log, "angle", frozen), rig.units).log.notes[0]
    turning = changed(log, "angle", lambda x: np.mod(x + 3.0 * log.time, 2.0 * np.pi))
    assert "jumps by 6.28319" in prepared(rig.task, turning, rig.units).log.notes[0]


def test_counters_that_wrap_are_told_from_steps_and_noise() -> None:
    draw = np.random.default_rng(0)
    t = np.linspace(0.0, 10.0, 1000)
    assert wrapped_by(np.mod(40.0 * t, 360.0)) == 360.0
    assert wrapped_by(np.mod(3000.0 * t, 4096.0)) == pytest.approx(4096.0, rel=1e-3)
    assert wrapped_by(draw.normal(size=1000)) is None
    assert wrapped_by(np.where(t > 5.0, 1.0, 0.0)) is None
    assert wrapped_by(np.sin(t)) is None


def test_a_channel_at_rest_with_a_coarse_encoder_is_not_frozen() -> None:
    t = np.linspace(0.0, 10.0, 1000)
    assert constant_stretches(np.round(np.minimum(t, 5.0), 1)) == []
    noisy = np.sin(t) + 1e-3 * np.random.default_rng(1).normal(size=1000)
    noisy[300:360] = noisy[300]
    assert constant_stretches(noisy) == [(300, 360)]


def test_a_log_of_another_rate_is_refused_where_its_times_cannot_be_seconds(tmp_path: Path) -> None:
    rig = Rig(arm_task(tmp_path), tmp_path)
    log = arm_logs(rig, 0)[0]
    assert "times are read in s" in refused(lambda: prepared(rig.task, replace(log, time=1e6 * log.time), rig.units))
