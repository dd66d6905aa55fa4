"""Bare numbers that no drive has: a warning names the unit in which they are read; options print theirs back."""

import math
import re
import warnings
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT, lostmotion
from lostmotion.cli import app
from lostmotion.inputs.implausible_values import LARGEST, ValueWarning, doubt_all
from lostmotion.simulation.scenario.units_of_keys import unit_for
from refusals import refused

JOINT = "catalogue-robot-joint"


def test_a_gap_of_3_is_said_to_be_172_degrees() -> None:
    """3 rad are 3 · 180/pi = 171.9 degrees."""
    for call in (
        lambda: lm.load(JOINT, {"gearbox.added_backlash": 3}),
        lambda: lm.load(JOINT, ["gearbox.added_backlash=3"]),
        lambda: lm.gearbox("schaeffler-rt1-h-20-100", added_backlash=3),
        lambda: lm.load(JOINT).replace(**{"gearbox.stiffness.backlash": 3}),
    ):
        with pytest.warns(ValueWarning, match=r'backlash: 3 is read as 3 rad \(172 deg\).*"3 arcmin"'):
            call()


def test_the_gap_of_a_slide_is_in_metres() -> None:
    """20, meant in micrometres."""
    for table in ("axis.screw", "screws.left", "racks.a"):
        with pytest.warns(ValueWarning, match=rf'key {table}.backlash: 20 is read as 20 m; .*"20 um"'):
            doubt_all({f"{table}.backlash": 20}, "file")


@pytest.mark.parametrize("gap", ["3 arcmin", "6 deg", 1e-3, math.radians(4.9)])
def test_a_gap_with_a_unit_and_one_that_a_gear_has_are_not_doubted(gap: str | float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lm.load(JOINT, {"gearbox.added_backlash": gap})


@pytest.mark.parametrize("key", LARGEST)
def test_a_doubtful_number_in_a_file_is_said_with_its_file_key_and_unit(key: str, tmp_path: Path) -> None:
    from lostmotion.inputs.toml_files import read_toml

    usual, file = LARGEST[key], tmp_path / "drive.toml"
    file.write_text(f"[[a.b]]\n{key} = {1.01 * usual.most!r}\n")
    with pytest.warns(ValueWarning) as found:
        read_toml(file, "a scenario")
    (text,) = (str(warning.message) for warning in found)
    assert str(file) in text
    assert f"key a.b.0.{key}" in text
    assert usual.unit.replace("degC", "°C") in text
    file.write_text(f"[[a.b]]\n{key} = {0.99 * usual.most!r}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_toml(file, "a scenario")


def test_no_shipped_file_is_doubted() -> None:
    from lostmotion.inputs.toml_files import read_toml

    files = [*(ROOT / "scenarios").glob("*.toml"), *(ROOT / "src/lostmotion/catalogue").glob("*.toml")]
    assert len(files) > 50
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for file in files:
            read_toml(file, "a file")


def test_a_window_that_holds_the_whole_move_is_doubted() -> None:
    """The shipped axis moves by 45 degrees."""
    with pytest.warns(ValueWarning, match=r"window: 2 rad \(115 deg\) is no less than the whole motion, .* rad \(45 deg\)"):
        lm.commission(lm.load("position-axis"), window=2.0)
    coarse = lm.load("position-axis-load-encoder", {"controller.position_encoder": {"shaft": "load", "bits": 4}})
    with pytest.warns(ValueWarning, match=r"window: 1\.5708 rad \(90 deg\) is no less than the whole motion"):  # 4 steps
        found = lm.commission(coarse)
    assert found.settling[-1].time == 0.0  # and not the rounding of two instants


def test_the_settling_window_of_a_task_is_compared_with_its_motion(tmp_path: Path) -> None:
    text = (ROOT / "examples" / "select-axis.toml").read_text()
    wide = re.sub(r'settling_window = "[^"]*"', 'settling_window = "300 deg"', text)
    assert wide != text
    (tmp_path / "task.toml").write_text(wide)
    with pytest.warns(ValueWarning, match=r"key task.settling_window: 5\.23599 rad \(300 deg\) is no less than the whole"):
        lm.studies.load_task(tmp_path / "task.toml")


def test_options_print_bare_numbers_back_with_their_unit() -> None:
    run = CliRunner().invoke
    said = run(app, ["run", JOINT, "--set", "load.inertia=2", "--explain", "0.5"]).output
    assert "load.inertia: 2 kg*m^2; a bare number is read in SI units" in said
    assert "--explain: 0.5 s; a bare number is read in SI units" in said
    quiet = run(app, ["run", JOINT, "--set", "load.inertia=2 kg*m^2", "--explain", "500 ms"]).output
    assert "bare number" not in quiet


def test_a_command_that_is_suggested_has_the_changes_of_this_one() -> None:
    changes = ["--set", "load.inertia=2 kg*m^2"]
    for command, then in (("run", "lostmotion run"), ("check", "lostmotion check")):
        said = CliRunner().invoke(app, [command, JOINT, *changes]).output
        assert f"page: {then} {JOINT} --set 'load.inertia=2 kg*m^2' --report" in said.replace("\n", " ")


def test_the_bare_numbers_of_a_list_of_tables_are_printed_back() -> None:
    moves = 'controller.reference.moves=[{to=1.0}, {to="90 deg", dwell=0.1}]'
    said = CliRunner().invoke(app, ["run", "position-axis", "--set", moves]).output
    assert "controller.reference.moves.0.to: 1 rad (57.3 deg); a bare number" in said
    assert "controller.reference.moves.1.dwell: 0.1 s; a bare number" in said
    assert "moves.1.to" not in said
    slide = CliRunner().invoke(app, ["run", "ball-screw-axis", "--set", "controller.reference.moves=[{to=0.2}]"]).output
    assert "controller.reference.moves.0.to: 0.2 m; a bare number" in slide


@pytest.mark.parametrize(("name", "key", "unit"), [
    ("position-axis", "controller.reference.speed", "rad/s"),
    ("position-axis", "controller.reference.moves.0.to", "rad"),
    ("speed-axis", "controller.reference.mean", "rad/s"),
    ("speed-axis", "controller.reference.steps.0.height", "rad/s"),
    ("ball-screw-axis", "controller.reference.speed", "m/s"),
    ("gantry-two-screws", "controllers.left_servo.reference.moves.0.to", "m"),
])  # fmt: skip
def test_the_unit_of_a_reference_is_that_of_its_kind(name: str, key: str, unit: str) -> None:
    """`mean` is an angle or a speed, and `speed` a number of moves or a reference itself."""
    assert unit_for(lm.load(name), key) == unit


def test_an_inclination_of_90_is_refused_with_its_unit() -> None:
    refused(lambda: lm.load("vertical-axis-with-brake", ["slides.head.inclination=90"]), "slides.head.inclination")


def test_a_command_prints_a_warning_as_one_line_without_the_place_in_the_code(tmp_path: Path) -> None:
    done = lostmotion("run", JOINT, "--set", "gearbox.added_backlash=3", cwd=tmp_path)
    assert done.returncode == 0
    lines = [line for line in done.stdout.splitlines() if line.startswith("warning: ")]
    assert len(lines) == 1
    assert "3 rad (172 deg)" in lines[0]
    assert done.stderr == ""


@pytest.mark.parametrize("value", ["96", "96.0"])
def test_an_efficiency_of_96_is_refused_with_both_ways_to_write_it(value: str) -> None:
    assert '0.96, or "96 %"' in refused(
        lambda: lm.load("paper-2dof-l-small", [f"gearbox.losses.efficiency={value}"]), "gearbox.losses.efficiency"
    )
    losses: Any = lm.load("paper-2dof-l-small", ["gearbox.losses.efficiency=96 %"]).gearbox.losses
    assert losses.efficiency == 0.96


def test_numbers_that_are_computed_are_not_doubted() -> None:
    loose = lm.load("paper-2dof-nl-small").replace(**{"gearbox.stiffness.backlash": "20 deg"})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lm.simulate(loose, sensitivities=["gearbox.stiffness.backlash"])
