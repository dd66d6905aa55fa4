"""A first identification file: it names what is there and what is in doubt, and is read by the command once the rig is named."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from identification_logs import AXIS
from lostmotion.cli import app
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.rig.rig_scenario import Rig
from refusals import refused

TIME = np.arange(0.0, 2.0, 0.01)
FORCE, MASS, VISCOUS = 400.0, 80.0, 150.0  # N, kg, N*s/m


def speed(time: np.ndarray) -> np.ndarray:
    """Of m v' + b v = F from rest."""
    return np.asarray(FORCE / VISCOUS * (1.0 - np.exp(-VISCOUS / MASS * time)))


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two logs of an axis under a constant force, without dry friction."""
    for name, share in (("a.csv", 1.0), ("b.csv", 0.5)):
        rows = "\n".join(f"{t!r},{share * FORCE!r},{share * v!r}" for t, v in zip(TIME.tolist(), speed(TIME).tolist(), strict=True))
        (tmp_path / name).write_text(f"# share: {share}\ntime [s],force [N],carriage speed [m/s]\n{rows}\n")
    (tmp_path / "rig.toml").write_text(AXIS.replace("friction_force = 20.0\n", ""))
    return tmp_path


def invoke(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output + (str(done.exception) if done.exception else "")


@pytest.mark.parametrize("rated", [1.0, 250.0])
def test_the_command_reads_the_file_with_a_rig_and_finds_the_truth(logs: Path, rated: float) -> None:
    """The command of a motor of 250 N is force/250 N."""
    rig = (logs / "rig.toml").read_text()
    (logs / "rig.toml").write_text(rig.replace("rated_force = 1.0", f"rated_force = {rated}"))
    code, said = invoke("identify", "new", str(logs), "--rig", str(logs / "rig.toml"))
    assert code == 0, said
    assert f"written to {logs / 'identify.toml'}" in said
    result = lm.identify(logs / "identify.toml")
    assert result.values["drive_mass"] == pytest.approx(MASS, rel=1e-3)
    assert result.values["carriage_viscous_friction"] == pytest.approx(VISCOUS, rel=1e-3)


def test_without_a_rig_the_file_is_whole_but_for_the_rig(logs: Path) -> None:
    assert invoke("identify", "new", str(logs))[0] == 0
    task, _ = lm.identification.load_identification(logs / "identify.toml")
    assert task.logs.files == ("*.csv",)
    assert {m.channel for m in task.measured.values()} == {"carriage speed"}
    assert {i.channel for i in task.inputs.values()} == {"force"}
    assert "RIG.toml" in refused(lambda: lm.identify(logs / "identify.toml"))
    text = (logs / "identify.toml").read_text()
    text = text.replace("RIG.toml", "rig.toml").replace("MOTOR_", "drive_").replace("SLIDE", "carriage")
    text = text.replace("friction_force", "viscous_friction").replace("max = 100.0", "max = 1000.0")
    (logs / "identify.toml").write_text(text)
    assert lm.identify(logs / "identify.toml").values  # the mass of the rig is not that of the logs


def test_without_any_rig_a_template_is_written_that_the_file_takes(logs: Path, tmp_path: Path) -> None:
    """Of a length that of a slide, of an angle that of a shaft, whose variables the file names."""
    for k, (name, unit) in enumerate((("slide", "mm"), ("load", "deg"))):
        folder = tmp_path / str(k)
        folder.mkdir()
        rows = [f"{0.01 * n},{n % 7},{0.1 * (n % 3)}" for n in range(30)]
        (folder / "log.csv").write_text("\n".join([f"time [s],pos [{unit}],torque [N*m]", *rows]))
        code, said = invoke("identify", "new", str(folder))
        assert code == 0, said
        rig = lm.load(folder / "rig.toml")
        assert bool(rig.slides) == (unit == "mm")
        assert name in rig.train().shafts
        task = (folder / "identify.toml").read_text()
        assert 'scenario = "rig.toml"' in task
        assert "SHAFT" not in task and "SLIDE" not in task and "MOTOR" not in task
        assert [v for v in lm.load(folder / "rig.toml").train().shafts if f'variable = "{v}_' in task]


def test_no_file_is_overwritten(logs: Path) -> None:
    (logs / "identify.toml").write_text("mine")
    (logs / "link.toml").symlink_to(logs / "nowhere")
    for more in ([], ["-o", str(logs / "a.csv")], ["-o", str(logs / "link.toml")]):
        code, said = invoke("identify", "new", str(logs), *more)
        assert code == 1 and "exists; name another file with -o" in said
    assert (logs / "identify.toml").read_text() == "mine" and not (logs / "nowhere").exists()


def test_what_is_in_doubt_is_said(logs: Path) -> None:
    rows = "\n".join(f"{0.02 * k:.2f};{0.5 * k}".replace(".", ",") for k in range(100))
    inner = logs / "more"
    inner.mkdir()
    (inner / "c.txt").write_text(f"time;carriage speed\n{rows}\n")
    (inner / 'd"\n.csv').write_text("time,x\n0,fast\n")
    text = lm.identification.first_task(logs)
    data = tomllib.loads(text)
    assert data["logs"] == {"files": ["*.csv", "more/*.txt"], "decimal": ","}
    assert data["measured"] == {"carriage_speed": {"channel": "carriage speed", "variable": "SLIDE_speed"}}
    for line in (
        "# Sample time: 10 to 20 ms; logs last 1.98 to 1.99 s.",
        "# Header: share is 1, 0.5 (in 2 of 3 logs)",
        "is not a number; it is left out",
        "# Doubt: c.txt: its commas are read as decimal commas",
        "# Doubt: channel carriage speed has no unit in c.txt, so that it is read in SI there",
        "# Doubt: channel force is in 2 of 3 logs; the others cannot be used",
        "# Doubt: sample times differ between logs: 10 to 20 ms",
        "force [N]: 200 to 400, in 2 of them",
    ):
        assert line in text, text


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["new"], 2, "needs the directory of the logs"),
        (["new", "nowhere"], 1, "nowhere: is no directory"),
        (["new", "empty"], 1, "empty: has no log; logs end in .json, .jsonl, .csv"),
        (["new", "bad"], 1, "none of its 1 logs can be read"),
        (["x.toml", "empty"], 2, "DIR goes with `identify new`"),
        (["x.toml", "--rig", "rig.toml"], 2, "--rig goes with `identify new`"),
    ],
)
def test_wrong_calls_end_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], code: int, said: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "log.csv").write_text("nothing")
    found, text = invoke("identify", *words)
    assert found == code and said in text.replace("\n", " "), text


SCREW = """
[axis.motor]
kind = "torque_source"
rotor_inertia = "1 kg cm^2"
rated_torque = "1 N m"
[axis.screw]
lead = "10 mm"
efficiency = 0.9
[axis.slide]
mass = "20 kg"
[command]
[simulation]
duration = "1 s"
sample_interval = "1 ms"
"""


def test_a_length_is_that_of_a_slide_and_an_angle_that_of_a_shaft(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(SCREW)
    rows = "\n".join(f"{t:.2f},{t},{36.0 * t},{t}" for t in TIME)
    (tmp_path / "a.csv").write_text(f"time [s],pos [mm],theta [deg],torque [N*m]\n{rows}\n")
    text = lm.identification.first_task(tmp_path, rig=tmp_path / "rig.toml")
    measured = tomllib.loads(text)["measured"]
    assert {m["channel"]: m["variable"] for m in measured.values()} == {"pos": "slide_position", "theta": "motor_angle"}
    assert "Doubt: it is in" not in text


@pytest.mark.parametrize(
    ("variable", "unit", "other"), [("slide_position", "mm", "deg"), ("slide_speed", "mm/s", "rpm"), ("motor_angle", "deg", "mm")]
)
def test_no_length_is_fitted_to_an_angle_without_a_factor(tmp_path: Path, variable: str, unit: str, other: str) -> None:
    (tmp_path / "rig.toml").write_text(SCREW)
    for name in (unit, other):
        rows = "\n".join(f"{t:.2f},{t},0.1" for t in TIME)
        (tmp_path / "a.csv").write_text(f"time [s],x [{name}],u [N*m]\n{rows}\n")
        data = {
            "scenario": "rig.toml",
            "logs": {"files": ["a.csv"]},
            "inputs": {"motor_command": {"channel": "u"}},
            "measured": {"x": {"channel": "x", "variable": variable}},
            "set": {"axis.slide.mass": "mass"},
            "parameters": {"mass": {"start": 20.0}},
        }
        task = lm.identification.Identification(**data)
        rig = Rig(task, tmp_path)
        log = lm.identification.read_log(tmp_path / "a.csv")
        if name == unit:
            assert list(prepared(task, log, rig.units).measured) == ["x"]
            continue
        with pytest.raises(lm.InputError, match="give a scale that turns one into the other, such as a radius"):
            prepared(task, log, rig.units)
        data["measured"] = {"x": {"channel": "x", "variable": variable, "scale": 0.1}}
        assert prepared(lm.identification.Identification(**data), log, rig.units).measured


def test_a_first_file_doubts_an_angle_of_a_rig_that_slides(logs: Path) -> None:
    rows = "\n".join(f"{t:.2f},{t}" for t in TIME)
    (logs / "a.csv").write_text(f"time [s],theta [deg]\n{rows}\n")
    (logs / "b.csv").unlink()
    text = lm.identification.first_task(logs, rig=logs / "rig.toml")
    assert "# Doubt: it is in rad, and carriage_position is in m" in text
