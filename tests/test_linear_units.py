"""What programs print and write of axes without anything that turns has no unit of rotation."""

from __future__ import annotations

import html
import re
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.errors import InputError

AXIS = """title = "A slide with a linear motor"
[slides.table]
mass = "10 kg"
friction_force = "5 N"
[linear_motors.drive]
slide = "table"
rated_force = "200 N"
peak_force = "500 N"
mass = "2 kg"
"""
LOOPS = """[controllers.drive]
sample_time = "125 us"
encoder = { grating_period = "20 um", bits = 10 } # a linear scale
position = { gain = "3 (m/min)/mm", feedforward = 1.0 }
speed = { gain = 3000.0, integral_time = "6 ms", torque_limit = 400.0 }
[controllers.drive.reference]
kind = "position"
speed = "500 mm/s"
acceleration = "5 m/s^2"
dwell = "0.1 s"
moves = [{ to = "50 mm" }, { to = "0 mm" }]
"""
RUN = """[simulation]
duration = "0.6 s"
sample_interval = "1 ms"
"""
COMMAND = "[command.drive]\namplitude = 0.2\nfrequency = 5.0\n"
ROTARY = re.compile(r"(?<![\w.])(?:[mµ]?rad\b|[kmµ]?N[·*]m|kg[·*]m|rpm\b|arcmin\b|arcsec\b)")


def shown(page: str) -> str:
    """The text of a page and its data, without its program and styles."""
    data = re.findall(r"<script[^>]*application/json[^>]*>(.*?)</script>", page, flags=re.S)
    text = re.sub(r"<script.*?</script>|<style.*?</style>", " ", page, flags=re.S)
    return html.unescape(" ".join([re.sub(r"<[^>]+>", " ", text), *data]))


def rotary_in(text: str) -> list[str]:
    return [text[max(0, m.start() - 60) : m.end() + 20] for m in ROTARY.finditer(text)]


COMMANDS = {
    "run": (LOOPS, ["run", "FILE", "-o", "result.csv"]),
    "report": (LOOPS, ["run", "FILE", "--report", "run.html"]),
    "explain": (COMMAND, ["run", "FILE", "--explain", "0.13"]),
    "servo": (LOOPS, ["servo", "FILE", "-o", "sheet", "--drive-units"]),
    "tune": (LOOPS, ["servo", "FILE", "--tune", "suited", "--feedforward", "-o", "tuned.toml"]),
    "check": (LOOPS, ["drive", "check", "FILE"]),
    "response": (COMMAND, ["response", "FILE", "--input", "drive_command", "--variable", "table_speed", "-o", "response"]),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_no_command_writes_a_unit_of_rotation(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tables, arguments = COMMANDS[name]
    Path("axis.toml").write_text(AXIS + tables + RUN)
    result = CliRunner().invoke(app, [argument.replace("FILE", "axis.toml") for argument in arguments])
    assert result.exit_code == 0, result.output
    assert rotary_in(result.output) == []
    for path in Path().rglob("*"):
        if path.suffix in (".csv", ".html", ".toml"):
            text = path.read_text(encoding="utf-8")
            assert rotary_in(shown(text) if path.suffix == ".html" else text) == [], path


def test_no_variable_of_a_result_and_no_state_of_a_linear_model_has_one(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(AXIS + COMMAND + RUN)
    scenario = lm.load(tmp_path / "axis.toml")
    result = lm.simulate(scenario)
    for name, variable in result.variables.items():
        assert rotary_in(f"{variable.attrs.get('units', '')} {variable.attrs.get('long_name', '')}") == [], name
    assert rotary_in(str(lm.linearize(scenario, time=0.05))) == []
    assert rotary_in(repr(scenario)) == []


def test_no_variable_of_an_fmu_has_one(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(AXIS + LOOPS + RUN)
    lm.export_fmu(lm.load(tmp_path / "axis.toml"), tmp_path / "axis.fmu")
    with zipfile.ZipFile(tmp_path / "axis.fmu") as files:
        text = files.read("modelDescription.xml").decode()
    # The phase of the error within a grating period is an angle, wherever the scale lies.
    lines = [part for part in text.split("<ScalarVariable ")[1:] if 'error_phase"' not in part]
    assert len(lines) > 20
    assert rotary_in("\n".join(lines).partition("</ModelVariables>")[0]) == []


def test_gains_of_a_linear_motor_are_written_in_its_units_beside_the_comments_of_the_file(tmp_path: Path) -> None:
    source, target = tmp_path / "axis.toml", tmp_path / "tuned.toml"
    source.write_text(AXIS + LOOPS + RUN)
    tuned = lm.tune(lm.load(source), rule="suited", feedforward=True)
    assert {key: new for key, _, new in tuned.changes()}["controllers.drive.feedforward.inertia"] == "12 kg"
    tuned.write(target, source)
    text = target.read_text()
    assert "# a linear scale" in text
    assert re.search(r'gain = "[\d.]+ N\*s/m"', text)
    assert lm.load(target) == tuned.scenario


def test_gains_of_the_short_form_of_an_axis_are_written_into_it(tmp_path: Path) -> None:
    tuned = lm.tune(lm.load("ball-screw-axis"), rule="suited")
    tuned.write(tmp_path / "tuned.toml", "ball-screw-axis")
    text = (tmp_path / "tuned.toml").read_text()
    assert "[axis.screw]" in text
    assert "N*m*s/rad" in text  # of the motor, which turns
    assert lm.load(tmp_path / "tuned.toml") == tuned.scenario


def test_the_window_of_a_slide_is_a_distance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("axis.toml").write_text(AXIS + LOOPS + RUN)
    result = CliRunner().invoke(app, ["servo", "axis.toml", "--window", "20 um"])
    assert "within 20 µm" in result.output
    result = CliRunner().invoke(app, ["servo", "axis.toml", "--window", "1 arcmin"])
    assert isinstance(result.exception, InputError)
    assert 'must be a value in m, such as "1 m"' in str(result.exception)
