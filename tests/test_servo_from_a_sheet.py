"""From a gearhead's sheet to gains: a file without loops, losses that do not change with the speed, a load that floats in the gap."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.servo.linear_regimes import Axis
from lostmotion.servo.tuning_data import frictions

SHEET = """
[[gearbox]]
name = "planetary-80"
kind = "planetary"
manufacturer = "mine"
title = "planetary, two stages"
ratio = 40
rated_output_torque = "70 N*m"
rated_input_speed = "3000 rpm"
inertia = "0.35 kg*cm^2"
backlash = "3 arcmin"
stiffness = { slopes = ["6 N*m/arcmin"] }
[gearbox.losses]
efficiency = [{ input_speed = "3000 rpm", load = 1.0, efficiency = 0.94 }]
no_load_torque = [{ input_speed = "3000 rpm", torque = "0.06 N*m" }]
[[gearbox.source]]
data = ["ratio", "rated_output_torque", "rated_input_speed", "stiffness", "losses"]
status = "manufacturer"
text = "sheet"
"""
AXIS = """
motor = { from = "allied-mf0076056-300v" }
gearbox = { from = "gear.toml" }
load = { inertia = "0.6 kg*m^2" }
[controller]
sample_time = "125 us"
encoder = { lines = 4096 }
reference = { kind = "position", law = "modified_sine", dwell = "0.6 s", moves = [{ to = "90 deg", duration = "0.4 s" }, { to = "0 deg", duration = "0.4 s" }] }
[simulation]
duration = "2 s"
sample_interval = "1 ms"
"""


@pytest.fixture
def axis(tmp_path: Path) -> Path:
    (tmp_path / "gear.toml").write_text(SHEET)
    (tmp_path / "axis.toml").write_text(AXIS)
    return tmp_path / "axis.toml"


def test_a_file_without_loops_is_tuned_and_the_load_without_friction_floats_in_the_gap(axis: Path) -> None:
    tuned = axis.with_name("tuned.toml")
    asked = ["servo", str(axis), "--window", "1 arcmin", "--tune", "margins", "--feedforward", "-o", str(tuned)]
    done = CliRunner().invoke(app, asked)
    assert isinstance(done.exception, SystemExit) and done.exit_code == 1, done.output
    assert "controller.speed.gain                   none -> " in done.output
    assert "the motor stands and the load still swings by" in done.output and "it floats in the backlash" in done.output
    found = lm.load(tuned)
    # The losses without load are 0.06 N m at all speeds, so that none of the friction is viscous.
    assert frictions(Axis(found, "motor")) == pytest.approx((0.0, 0.06), abs=1e-12)
    assert found.controller.feedforward.friction_torque == pytest.approx(0.06, rel=1e-12)


def test_without_gains_the_option_that_finds_them_is_named(axis: Path) -> None:
    done = CliRunner().invoke(app, ["servo", str(axis)])
    assert "controller.position.gain: no gain is given; add it, or find it: --tune margins" in str(done.exception)


def test_the_margins_hold_in_the_position_loop_too_where_its_encoder_sees_the_resonance(axis: Path) -> None:
    """With the usual gain of the position loop this axis is unstable at 27.7 Hz, the resonance of gearbox and load."""
    on_load = {"controller.position_encoder": {"shaft": "load", "bits": 20}, "load.viscous_friction": 2.0}
    loops = {"controller.position": {"gain": 42.62}, "controller.speed": {"gain": 0.2647, "integral_gain": 26.54}}
    usual = lm.load(axis, on_load | loops)
    tuned = lm.tune(usual, rule="margins")
    assert tuned.position_gain < 0.5 * 42.62
    rows = [row.margins for row in lm.commission(tuned.scenario).loops if row.loop == "position"]
    assert all(m.stable and not m.phase_margin < 1.047 and not m.gain_margin < 10.0**0.3 for m in rows)
    assert any(m.gain_margin < 10.0**0.35 for m in rows)  # and no more is given up than a tenth of the gain


def test_a_gain_of_zero_is_refused_as_such_and_not_as_missing() -> None:
    done = CliRunner().invoke(app, ["servo", "position-axis", "--set", "controller.speed.gain=0"])
    assert "controller.speed.gain: 0.0 must be greater than 0" in str(done.exception)
