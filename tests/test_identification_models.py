"""Candidate models are compared under one course of inputs, and the answer holds the parameters of the chosen one alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from dry_friction import RIG, TASK, angles, write_log
from lostmotion.identification.identify import IdentificationResult

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
