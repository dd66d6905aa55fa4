"""Candidate models are compared under one course of inputs, and the answer holds the parameters of the chosen one alone."""

from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from dry_friction import RIG, TASK, angles, write_log
from lostmotion.identification.result import IdentificationResult

LADDER = """
[parameters]
inertia = { start = 6e-3, min = 1e-4, max = 1.0 }
viscous = { start = 0.03, max = 1.0 }
coulomb = { start = 0.05, max = 2.0, off = 0.0 }
[[ladder]]
name = "viscous"
free = ["inertia", "viscous"]
[[ladder]]
name = "and dry friction"
free = ["coulomb"]
"""
NOISE = 1e-3


def identified(directory: Path, phase: float, coulomb: float, interpolation: str = "") -> IdentificationResult:
    (directory / "rig.toml").write_text(RIG)
    task = TASK.replace('files = ["l*.csv"]', 'files = ["l*.csv"]\nheld_out = "file == \'l2.csv\'"')
    task = task.replace('channel = "torque"', f'channel = "torque"\n{interpolation}')
    task = task.replace("[set]", '[set]\n"motors.m.rotor_inertia" = "inertia"')
    (directory / "i.toml").write_text(task + LADDER)
    time = np.arange(400) / 200
    for seed in (1, 2):
        torque = 0.35 * np.sin(2 * np.pi * 1.1 * time) + 0.25 * np.sin(2 * np.pi * 3.3 * time + seed + phase)
        noise = NOISE * np.random.default_rng(seed).standard_normal(len(time))
        write_log(directory / f"l{seed}.csv", time, torque, angles(torque, 5e-3, coulomb=coulomb) + noise)
    return lm.identify(directory / "i.toml", threads=1)


@pytest.mark.parametrize("phase", [3.0, 0.0])
def test_the_answer_does_not_depend_on_whether_the_course_of_the_input_was_given(tmp_path: Path, phase: float) -> None:
    """At the phase 3 the simpler model alone prefers straight lines, and the richer one shows that the command is held."""
    given = identified(tmp_path, phase, 0.1, 'interpolation = "hold"')
    found = identified(tmp_path, phase, 0.1)
    assert any("held between samples" in text for text in found.inputs)
    assert all(" rad with straight lines and " in text for text in found.inputs)
    for a, b in zip(found.rungs, given.rungs, strict=True):
        assert (a.train, a.held_out) == pytest.approx((b.train, b.held_out), rel=1e-3), a.name
        assert a.fit.point.values == pytest.approx(b.fit.point.values, rel=1e-3, abs=1e-9), a.name
    assert found.rungs[found.chosen].name == "and dry friction"
    # The simpler model has no dry friction: its error is that of a motion without it, far above the noise.
    assert found.rungs[0].fit.point.values["coulomb"] == 0.0
    assert found.rungs[0].held_out > 10.0 * NOISE
    for name, truth in (("inertia", 5e-3), ("viscous", 0.02), ("coulomb", 0.1)):
        i = found.intervals[name]
        assert i.low < truth < i.high, name
        assert i.high - i.low < 0.02 * truth, name


def test_the_file_that_is_written_has_the_other_parameters_off(tmp_path: Path) -> None:
    """Without dry friction in the logs the simpler model is chosen; the rig that is written has none either."""
    found = identified(tmp_path, 3.0, 1e-12)
    assert found.rungs[found.chosen].name == "viscous"
    assert set(found.intervals) == {"inertia", "viscous"}
    assert found.values["coulomb"] == 0.0
    assert found.scenario.shafts["c"].friction_torque == 0.0
    assert "coulomb" not in "\n".join(found.lines()[1:4])


def test_offsets_are_added_after_the_scale_and_first_values_contain_them(tmp_path: Path) -> None:
    """A channel is scale*variable + offset, and what acts is scale*channel + offset; the first value is that of the file."""
    (tmp_path / "rig.toml").write_text(RIG)
    time = np.arange(400) / 200
    torque = 0.35 * np.sin(2 * np.pi * 1.1 * time) + 0.25 * np.sin(2 * np.pi * 3.3 * time + 1)
    reading = 2.0 * (angles(torque, 5e-3, coulomb=0.1) - 0.7) + 0.3  # the shaft begins at -0.7 rad
    write_log(tmp_path / "l1.csv", time, (torque - 0.05) / 3.0, reading)
    task = TASK.replace('channel = "torque"', 'channel = "torque"\ninterpolation = "hold"\nscale = 3.0\noffset = 0.05')
    task = task.replace('variable = "c_angle"', 'variable = "c_angle"\nscale = 2.0\noffset = "zero"')
    task = task.replace("[set]", '[set]\n"initial.angles.c" = "(first_position - 0.3)/2"')
    parameters = "[parameters]\ncoulomb = { start = 0.08, max = 1.0 }\nviscous = { start = 0.03, max = 1.0 }\n"
    (tmp_path / "i.toml").write_text(f"{task}{parameters}zero = {{ start = 0.0, min = -2.0, max = 2.0 }}\n")
    found = lm.identify(tmp_path / "i.toml", threads=1)
    assert found.logs[0].facts["first_position"] == pytest.approx(reading[0], abs=1e-9)
    assert reading[0] == pytest.approx(2.0 * -0.7 + 0.3)
    assert found.values["zero"] == pytest.approx(0.3, abs=1e-4)
    assert found.values["coulomb"] == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize(("limit", "viscous", "state", "words"), [
    (2.0, 0.02, "fits", "position fits to 0.05"),
    (1e-3, 0.02, "does not fit", "is left of a motion of"),
    (2.0, 0.025, "fits with a reservation", "a systematic error is left"),
])  # fmt: skip
def test_the_verdict_says_how_well_the_model_describes_the_logs(
    tmp_path: Path, limit: float, viscous: float, state: str, words: str
) -> None:
    """A friction that may be 1 mN·m at most does not describe one of 100; a viscous friction that is given wrongly leaves an error."""
    (tmp_path / "rig.toml").write_text(RIG)
    time = np.arange(400) / 200
    torque = 0.35 * np.sin(2 * np.pi * 1.1 * time) + 0.25 * np.sin(2 * np.pi * 3.3 * time + 1)
    noise = NOISE * np.random.default_rng(1).standard_normal(len(time))
    write_log(tmp_path / "l1.csv", time, torque, angles(torque, 5e-3, coulomb=0.1) + noise)
    task = TASK.replace('channel = "torque"', 'channel = "torque"\ninterpolation = "hold"')
    start = 0.5 * min(limit, 0.1)
    parameters = f"[parameters]\ncoulomb = {{ start = {start}, max = {limit} }}\nviscous = {{ start = {viscous}, fixed = true }}\n"
    (tmp_path / "i.toml").write_text(task + parameters)
    verdict = lm.identify(tmp_path / "i.toml", threads=1).verdict
    assert verdict.state == state, verdict
    assert words in str(verdict)
