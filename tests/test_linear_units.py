"""What programs print and write of axes without anything that turns has no unit of rotation."""

import html
import re
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.errors import InputError
from lostmotion.live_page.description import describe
from lostmotion.portable.derivation import derivation_of
from lostmotion.portable.scenario_as_numbers import numbers_of
from lostmotion.simulation.forms.set_by_dotted_key import set_values
from refusals import refused

AXIS = """title = "A slide with a linear motor"
[slides.table]
mass = "10 kg"
friction_curve = { speeds = ["0 mm/s", "10 mm/s", "1 m/s"], forces = ["5 N", "4 N", "6 N"] }
breakaway_force = "6 N"
viscous_friction = "3 N s/m"
end_stops = { lower = "-200 mm", upper = "200 mm", stiffness = "10 N/um" }
[linear_motors.drive]
slide = "table"
rated_force = "200 N"
peak_force = "500 N"
mass = "2 kg"
cogging_force = "2 N"
pole_pitch = "20 mm"
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
FOLLOWS = re.sub(r"(kind = \"position\"\n).*", r'\1amplitude = "30 mm"\nfrequency = "0.5 Hz"\n', LOOPS, flags=re.S)
COMMAND = "[command.drive]\namplitude = 0.2\nfrequency = 5.0\n"
ROTARY = re.compile(r"(?<![\w.])(?:[mµ]?rad\b|[µ]rad²|[kmµ]?N[·*]m|kg[·*]m|rpm\b|arcmin\b|arcsec\b|torque over angle)")


def shown(page: str) -> str:
    """The text of a page and its data, without its program and styles."""
    data = re.findall(r"<script[^>]*application/json[^>]*>(.*?)</script>", page, flags=re.S)
    text = re.sub(r"<script.*?</script>|<style.*?</style>", " ", page, flags=re.S)
    return html.unescape(" ".join([re.sub(r"<[^>]+>", " ", text), *data]))


def labels(picture: str) -> str:
    """The texts of a picture, which matplotlib repeats as comments."""
    found = re.findall(r"<!--(.*?)-->", picture, flags=re.S)
    assert len(found) > 5
    return "\n".join(found)


def rotary_in(text: str) -> list[str]:
    return [text[max(0, m.start() - 60) : m.end() + 20] for m in ROTARY.finditer(text)]


COMMANDS = {
    "run": (LOOPS, ["run", "FILE", "-o", "result.csv", "--plot", "run.svg"]),
    "report": (LOOPS, ["run", "FILE", "--report", "run.html"]),
    "explain": (COMMAND, ["run", "FILE", "--explain", "0.13"]),
    "servo": (LOOPS, ["servo", "FILE", "-o", "sheet", "--drive-units", "--figures", "svg"]),
    "tune": (LOOPS, ["servo", "FILE", "--tune", "suited", "--feedforward", "-o", "tuned.toml"]),
    "check": (LOOPS, ["check", "FILE"]),
    "response": (COMMAND, ["response", "FILE", "--input", "drive_command", "--variable", "table_speed", "-o", "response", "--figures", "svg",
                             "--amplitudes", "0.2,1.0", "--frequencies", "2..40:4"]),
    "track": (FOLLOWS, ["track", "FILE", "-o", "track", "--figures", "svg"]),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_no_command_writes_a_unit_of_rotation(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tables, arguments = COMMANDS[name]
    Path("axis.toml").write_text(AXIS + tables + RUN)
    result = CliRunner().invoke(app, [argument.replace("FILE", "axis.toml") for argument in arguments])
    assert result.exit_code == (1 if "verdict          does not fit: " in result.output else 0), result.output
    assert rotary_in(result.output) == []
    for path in Path().rglob("*"):
        if path.suffix in (".csv", ".html", ".toml", ".svg"):
            text = path.read_text(encoding="utf-8")
            text = {".html": shown, ".svg": labels}.get(path.suffix, str)(text)
            assert rotary_in(text) == [], path


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


def test_no_text_of_the_live_page_has_one() -> None:
    page = describe(lm.Scenario.model_validate(tomllib.loads(AXIS + LOOPS + RUN)), "axis")
    texts = dict(strings({key: value for key, value in page.items() if key != "core"}))
    assert {key: text for key, text in texts.items() if rotary_in(text)} == {}
    sliders = {s["key"]: (s["label"], s["unit"]) for s in page["sliders"]}
    assert sliders["controllers.drive.speed.torque_limit"] == ("force limit", "N")
    assert sliders["controllers.drive.speed.gain"] == ("speed gain", "N·s/m")


def strings(node: Any, key: str = "") -> Iterator[tuple[str, str]]:
    if isinstance(node, dict):
        for name, value in node.items():
            yield from strings(value, f"{key}.{name}")
    elif isinstance(node, list | tuple):
        for k, value in enumerate(node):
            yield from strings(value, f"{key}.{k}")
    elif isinstance(node, str):
        yield key, node


def test_what_a_description_for_other_programs_names_has_none() -> None:
    """The C interface lists variables, and keys that it can change: both have units of translation."""
    scenario = lm.Scenario.model_validate(tomllib.loads(AXIS + COMMAND + RUN))
    parameters = derivation_of(scenario, numbers_of).parameters
    assert len(parameters) > 5
    assert rotary_in("\n".join(f"{p.key} {p.unit}" for p in parameters if "phase" not in p.key)) == []
    channels = scenario.core().channels()
    assert rotary_in("\n".join(" ".join(row) for row in channels)) == []
    assert rotary_in("\n".join(scenario.core().ledger_names())) == []


@pytest.mark.parametrize(("changes", "message"), [
    ({"slides.other.mass": 1.0}, "key slides.other: is moved by nothing: no motor, gear or load force acts on it"),
    ({"initial.slide_speeds.table": "1 rad/s"}, "such as"),
    ({"slides.table.end_stops.lower": "-1 rad"}, "slides.table.end_stops.lower"),
    ({"linear_motors.drive.rated_force": "3 N m"}, "linear_motors.drive.rated_force"),
    ({"mass_matrices.m": {"shafts": ["table"], "matrix": [[1.0]]}}, "key mass_matrices.m: holds the mass of slide 'table', which has one of its own, 10 kg"),
])  # fmt: skip
def test_messages_about_slides_have_none_but_what_was_given(changes: dict[str, Any], message: str) -> None:
    tables = tomllib.loads(AXIS + COMMAND + RUN)
    set_values(tables, changes.items())
    told = refused(lambda: lm.Scenario.model_validate(tables))
    said = told
    assert message in said
    given = [value for value in changes.values() if isinstance(value, str)]
    for value in given:
        said = said.replace(f"{value} has the unit", "").replace(value, "")
    assert rotary_in(said.replace("something else (rad", "").replace("something else (N*m", "")) == []


def test_speeds_at_the_start_that_do_not_fit_a_rigid_screw_are_named_in_their_units() -> None:
    tables = {
        "shafts": {"motor": {"inertia": 1e-4}},
        "slides": {"table": {"mass": 3.0, "force": 0.0}},
        "screws": {"screw": {"input": "motor", "output": "table", "lead": 0.01}},
        "initial": {"speeds": {"motor": 1.0}, "slide_speeds": {"table": 5e-3}},
        "simulation": {"duration": 1.0, "sample_interval": 0.1},
    }
    refused(lambda: lm.Scenario.model_validate(tables), "initial.slide_speeds.table")


def test_a_spectrum_over_revolutions_is_refused_where_nothing_turns() -> None:
    assert "makes no revolutions" in refused(lambda: lm.spectrum(lm.Scenario.model_validate(tomllib.loads(AXIS + COMMAND + RUN))))


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
