"""Faults that many logs share are the model's: they are said once, with what the logs have in common, and no log is dropped."""

from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from dry_friction import RIG, TASK, angles, write_log
from lostmotion.identification.preparation.screening import constant_stretches, frozen_stretches, screened
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.verdicts.shared_faults import _kinds_of

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
