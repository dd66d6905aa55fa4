"""A log that was spoiled is named with its fault and left out, so that the values are those of the other logs."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from dry_friction import RIG, TASK, angles, write_log
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.preparation.screening import constant_stretches, frozen_stretches, screened, wrapped_by
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.result import IdentificationResult
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.identification.verdicts.shared_faults import _kinds_of
from lostmotion.identification.virtual_logs import virtual_log
from refusals import refused

ARM = """
shafts.rotor = { friction_torque = 5e-3, viscous_friction = 2e-4 }
shafts.arm = { inertia = 0.1, viscous_friction = 0.05 }
motors.drive = { shaft = "rotor", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 1e-4 }
gears.g = { input = "rotor", output = "arm", ratio = 20 }
simulation = { duration = "1 s", sample_interval = "1 ms" }
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
        set={"shafts.rotor.friction_torque": "friction"} | {f"shafts.arm.{key}": key for key in ("inertia", "viscous_friction")},
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
    if fault == "sign of the command":  # from rest, a motion with the opposite torque is the opposite motion: both are named
        assert "angle has the opposite sign, or torque has the opposite sign" in named[0].text


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
    assert constant_stretches(np.round(np.minimum(t, 5.0), 1)) == []  # at rest with a coarse encoder is not frozen
    noisy = np.sin(t) + 1e-3 * np.random.default_rng(1).normal(size=1000)
    noisy[300:360] = noisy[300]
    assert constant_stretches(noisy) == [(300, 360)]


def test_a_log_of_another_rate_is_refused_where_its_times_cannot_be_seconds(tmp_path: Path) -> None:
    rig = Rig(arm_task(tmp_path), tmp_path)
    log = arm_logs(rig, 0)[0]
    assert "times are read in s" in refused(lambda: prepared(rig.task, replace(log, time=1e6 * log.time), rig.units))


# --- faults that many logs share are the model's ---
TIME = np.arange(800) / 200


def stuck(amplitude: float = 0.35, coulomb: float = 0.2) -> np.ndarray:
    """An angle that rests for a while at each reversal, since the torque is below the friction."""
    return angles(amplitude * np.sin(2 * np.pi * 0.7 * TIME), 5e-3, coulomb=coulomb)


@pytest.mark.parametrize("rounded", [12, 6, 4])
def test_a_load_that_rests_below_its_friction_is_not_frozen(rounded: int) -> None:
    angle = np.round(stuck(), rounded)
    assert np.sum(np.diff(angle) == 0.0) > 100
    assert frozen_stretches(angle) == []
    speed = np.gradient(stuck(), TIME)
    speed[np.abs(speed) < 1e-9] = 0.0
    assert frozen_stretches(speed) == []
    log = Log("a.csv", TIME, {"angle": Channel(angle, "rad")})
    assert not any("frozen" in note for note in screened(log, ["angle"], []).notes)


def test_readings_between_those_of_a_coarse_encoder_are_no_noise_of_a_frozen_sensor() -> None:
    """A register of 12 bit, read 70 times a second and interpolated to 200 Hz, as servos on a bus give it."""
    step = 2.0 * np.pi / 4096.0
    read = np.arange(0.0, TIME[-1], 1.0 / 70.0)
    angle = np.interp(TIME, read, step * np.round(np.interp(read, TIME, stuck()) / step))
    assert len(constant_stretches(angle)) >= 4
    assert frozen_stretches(angle) == []
    moving = int(np.argmax(np.abs(np.diff(angle))))
    angle[moving : moving + 30] = angle[moving]
    (begin, end), *others = frozen_stretches(angle)
    assert (begin <= moving, end, others) == (True, moving + 30, [])


def test_logs_of_a_few_kinds_are_said_to_be_of_these_if_that_is_no_chance() -> None:
    """9 of 60 logs, all of two trajectories of five, as 4 and 5 of 12: by chance once in 4,000 times."""
    words = ("brutal", "lift", "sine", "square", "up")
    facts = {f"{word}{k}": {"trajectory": word, "mass": 0.1 * (k % 4)} for word in words for k in range(12)}
    odd = {f"brutal{k}" for k in range(4)} | {f"lift{k}" for k in range(5)}
    assert _kinds_of(facts, odd) == "trajectory = brutal or lift (9 of 24 such logs)"
    assert _kinds_of(facts, {"brutal0", "lift0"}) == ""
    assert _kinds_of(facts, {f"{word}0" for word in words}) == "mass = 0 (5 of 15 such logs)"


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("value", ["last", "zero"])
def test_a_sensor_that_stops_in_a_motion_is_frozen(noise: float, value: str) -> None:
    angle = 1.0 + np.sin(3.0 * TIME) + noise * np.random.default_rng(0).normal(size=len(TIME))
    angle[250:310] = angle[250] if value == "last" else 0.0
    assert frozen_stretches(angle) == [(250, 310)]


@pytest.mark.parametrize("begin", [250, 450, 650])
def test_a_sensor_that_stops_for_ever_is_frozen_however_slowly_it_moved(begin: int) -> None:
    """It has noise while it moves, and none from then on; the motion is slow where it stops, as at a reversal."""
    time = TIME - TIME[begin]
    angle = 1.0 - np.cos(3.0 * time) + 1e-3 * np.random.default_rng(1).normal(size=len(time))
    angle[begin:] = angle[begin]
    assert frozen_stretches(angle) == [(begin, len(angle))]


def test_another_channel_that_moves_tells_a_frozen_sensor_from_a_load_at_rest() -> None:
    angle = stuck()
    begin, end = max(
        ((a, b) for a in range(len(angle)) for b in (int(np.argmax(angle[a:] != angle[a])) + a,) if b - a > 25), key=lambda s: s[1] - s[0]
    )
    moving = np.sin(3.0 * TIME)
    assert (begin, end) in frozen_stretches(angle, [moving])
    assert frozen_stretches(angle, [angle]) == []


PARAMETERS = """
[parameters]
viscous = { start = 0.03, max = 1.0 }
coulomb = { start = 0.08, max = 2.0 }
"""
RATE = 6.0  # N·m/s, of the limit that the amplifier has and the model lacks


def limited_logs(directory: Path, steps: int, sines: int) -> Path:
    """Logs of an amplifier that limits the rate of its torque: sines below the limit, and steps that it makes into ramps."""
    (directory / "rig.toml").write_text(RIG)
    time, fine = np.arange(300) / 200, np.arange(300 * 20) / 4000
    for k in range(steps + sines):
        draw = np.random.default_rng(k)
        if k < steps:
            goal = (0.45 + 0.05 * k) * np.sign(np.sin(2 * np.pi * 1.3 * time + 0.1 + k))
        else:
            goal = 0.5 * np.sin(2 * np.pi * 1.2 * time + k) + 0.08 * np.sin(2 * np.pi * 3.0 * time)
        course = np.empty(len(fine))
        course[0] = goal[0]
        for n in range(1, len(fine)):  # held between samples, then limited
            course[n] = course[n - 1] + np.clip(goal[(n - 1) // 20] - course[n - 1], -RATE / 4000, RATE / 4000)
        angle = angles(course, 1 / 4000, coulomb=0.1)[::20] + 1e-3 * draw.standard_normal(len(time))
        header = f"# trajectory: {'steps' if k < steps else 'sines'}\n# mass: {0.5 if k % 2 else 1.0}\n"
        write_log(directory / f"l{k:02d}.csv", time, goal, angle, header)
    task = TASK.replace('channel = "torque"', 'channel = "torque"\ninterpolation = "hold"')
    (directory / "i.toml").write_text(task + PARAMETERS)
    return directory / "i.toml"


def test_logs_that_a_limit_of_the_rate_makes_late_stay_and_the_limit_is_proposed(tmp_path: Path) -> None:
    path = limited_logs(tmp_path, 4, 12)
    found = lm.identify(path, threads=1)
    assert found.left_out == {}
    assert len(found.logs) == 16
    (shared,) = found.shared
    assert set(shared.logs) == {f"l{k:02d}.csv" for k in range(4)}
    assert "trajectory = steps (4 of 4 such logs)" in shared.common or "largest step" in shared.common
    words = shared.candidate.split()
    assert words[0] == "inputs.m_command.rate_limit"
    assert float(words[2].rstrip(",")) == pytest.approx(RATE, rel=0.1)
    assert sum("late" in line for line in found.warnings()) <= 1
    table = {(k.key, k.value): k for k in found.kinds}
    assert table["trajectory", "steps"].odd == table["trajectory", "steps"].logs == 4
    assert table["trajectory", "sines"].odd == 0
    assert table["trajectory", "steps"].mae > 2.0 * table["trajectory", "sines"].mae
    path.write_text(
        path.read_text().replace('channel = "torque"', 'channel = "torque"\nrate_limit = "rate"')
        + "rate = { start = 5.0, min = 1.0, max = 100.0 }\n"
    )
    better = lm.identify(path, threads=1)
    assert better.shared == [] and better.odd == []
    assert better.values["rate"] == pytest.approx(RATE, rel=0.02)
    assert better.values["coulomb"] == pytest.approx(0.1, rel=0.02)
