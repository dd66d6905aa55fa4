"""The answer and its page: errors have a unit, a channel and the logs that they are of."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from identification_logs import AXIS, POSITION_NOISE, released, spring_task
from lostmotion.cli import app
from lostmotion.identification.fit.saved_progress import Progress
from lostmotion.identification.identify import identify_task
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.preparation.usable_logs import gathered
from lostmotion.identification.result import IdentificationResult
from lostmotion.identification.rig.residuals import ParameterPoint
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.reports.identification import write_identification
from refusals import refused, refuses

SPEED_NOISE = 1e-3  # rad/s


def identified(directory: Path, **logs: str) -> IdentificationResult:
    """Two logs of a released carriage, position in mrad and speed."""
    time = np.arange(0.0, 2.0, 2e-3)
    for k, begin in enumerate((0.05, 0.08)):
        draw = np.random.default_rng(k)
        x = released(time, begin)
        position = x + POSITION_NOISE * draw.normal(size=len(time))
        speed = np.gradient(x, time) + SPEED_NOISE * draw.normal(size=len(time))
        rows = "\n".join(f"{t:.4f},{1e3 * a:.9g},{b:.9g}" for t, a, b in zip(time, position, speed, strict=True))
        (directory / f"{k}.csv").write_text(f"# number: {k}\ntime [s],pos [mrad],speed [rad/s]\n{rows}\n")
    measured = {
        "position": {"channel": "pos", "variable": "carriage_angle", "deviation": POSITION_NOISE},
        "speed": {"channel": "speed", "variable": "carriage_speed", "deviation": SPEED_NOISE},
    }
    task = spring_task(directory, measured=measured, logs={"files": ["*.csv"], **logs})
    return identify_task(task, directory, threads=1)


@pytest.mark.parametrize("held_out", [True, False])
def test_errors_are_of_the_logs_that_they_name_with_units_and_all_channels(tmp_path: Path, held_out: bool) -> None:
    """Root mean squares of the noise: 2e-5 rad and 1e-3 rad/s, to what 1000 samples allow (2 %, thrice)."""
    result = identified(tmp_path, **({"held_out": "number == 1"} if held_out else {}))
    what = "error of 1 log held out: " if held_out else "error of the fit, since no log was held out: "
    for text in (result.source(), write_identification(tmp_path / "out", "axis", result).read_text()):
        assert what in text and "other logs" not in text
        errors = text[text.index(what) :]
        position = re.search(r"position MAE \S+ deg, RMSE (\S+) deg;", errors)
        speed = re.search(r"speed MAE \S+ rad/s, RMSE (\S+) rad/s", errors)
        assert position is not None and speed is not None
        assert math.radians(float(position[1])) == pytest.approx(POSITION_NOISE, rel=0.07)
        assert float(speed[1]) == pytest.approx(SPEED_NOISE, rel=0.07)


def test_tables_of_errors_name_their_units(tmp_path: Path) -> None:
    result = identified(tmp_path)
    page = write_identification(tmp_path / "out", "axis", result).read_text()
    assert "mean absolute error, fitted [standard deviations]" in page
    heading, first, second, *_ = (tmp_path / "out" / "errors.csv").read_text().splitlines()
    assert heading.endswith(",unit of MAE and RMSE") and first.endswith(",rad") and second.endswith(",rad/s")
    assert "position [deg]" in (tmp_path / "out" / "overlays.csv").read_text()
    assert "position, 2 logs fitted: MAE" in str(result) and re.search(r"RMSE \S+ rad/s", str(result))


def carriages(directory: Path, count: int) -> Identification:
    """Logs of a released carriage, of which every third has a noise of its own; a sequence of two models."""
    time = np.arange(0.0, 0.6, 4e-3)
    for k in range(count):
        noise = POSITION_NOISE * (1.0 + k / count)
        x = released(time, 0.05) + noise * np.random.default_rng(k).normal(size=len(time))
        rows = "\n".join(f"{t:.4f},{a:.9g}" for t, a in zip(time, x, strict=True))
        (directory / f"{k:02d}.csv").write_text(f"time [s],pos [rad]\n{rows}\n")
    parameters = {"mass": {"start": 90.0, "min": 1.0, "max": 1000.0}, "damping": {"start": 18.0, "max": 100.0, "off": 20.0}}
    ladder = ({"name": "mass", "free": ["mass"]}, {"name": "damping", "free": ["damping"]})
    task = spring_task(directory, parameters=parameters, ladder=ladder)
    return task.model_copy(update={"set": {**task.set, "shafts.carriage.viscous_friction": "damping"}})


def test_of_many_logs_the_worst_median_and_best_are_drawn(tmp_path: Path) -> None:
    """The noise rises from log to log by 3 %, and its root mean square has a deviation of 6 %: the ends are told apart."""
    result = identify_task(carriages(tmp_path, 30), tmp_path, threads=1)
    page = write_identification(tmp_path / "out", "axis", result).read_text()
    titles = re.findall(r"<b>([^<]*) \((worst|median|best)\)</b>", page)
    assert [rank for _, rank in titles] == ["worst"] * 4 + ["median"] * 4 + ["best"] * 4
    number = {rank: np.mean([int(log) for log, r in titles if r == rank]) for rank in ("worst", "median", "best")}
    assert number["worst"] > number["median"] > number["best"]
    everything = write_identification(tmp_path / "all", "axis", result, all_logs=True).read_text()
    assert not re.search(r"\((worst|median|best)\)</b>", everything)
    assert all(f"<b>{k:02d}</b>" in everything for k in range(30))


def test_an_interrupted_identification_continues_with_the_next_model(tmp_path: Path) -> None:
    task, kept = carriages(tmp_path, 3), tmp_path / "kept.json"
    seen: list[str] = []

    def notify(model: str, iteration: int, cost: float) -> None:
        seen.append(model)
        if model == "damping":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identify_task(task, tmp_path, threads=1, notify=notify, resume=kept)
    assert set(seen) == {"mass", "damping"}
    assert kept.is_file()
    seen.clear()
    again = identify_task(task, tmp_path, threads=1, notify=lambda model, *_: seen.append(model), resume=kept)
    assert set(seen) == {"damping"}
    assert not kept.exists()
    whole = identify_task(task, tmp_path, threads=1)
    for name, interval in whole.intervals.items():
        width = interval.high - interval.low
        assert again.values[name] == pytest.approx(whole.values[name], abs=1e-2 * width), name
        assert again.intervals[name].high - again.intervals[name].low == pytest.approx(width, rel=0.05)


def test_models_of_other_logs_are_not_continued(tmp_path: Path) -> None:
    task, kept = carriages(tmp_path, 3), tmp_path / "kept.json"
    progress = Progress(kept)
    rig = Rig(task, tmp_path)
    logs, _ = gathered(rig, tmp_path)
    progress.of(task, logs).keep("mass", ParameterPoint({"mass": 95.0}, {}), [])
    assert Progress(kept).of(task, logs).fitted("mass") == (ParameterPoint({"mass": 95.0}, {}), [])
    assert Progress(kept).of(task, logs[1:]).fitted("mass") is None
    kept.write_text("{")
    assert Progress(kept).of(task, logs).fitted("mass") is None


# --- A first identification file ---
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
    """A log in lengths gets the rig of a slide, a log in angles that of a shaft. The file names the variables of that rig."""
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


@pytest.mark.parametrize(("words", "code", "said"), [
    (["new"], 2, "needs the directory of the logs"),
    (["new", "nowhere"], 1, "nowhere: is no directory"),
    (["new", "empty"], 1, "empty: has no log; logs end in .json, .jsonl, .csv"),
    (["new", "bad"], 1, "none of its 1 logs can be read"),
    (["x.toml", "empty"], 2, "DIR goes with `identify new`"),
    (["x.toml", "--rig", "rig.toml"], 2, "--rig goes with `identify new`"),
])  # fmt: skip
def test_wrong_calls_end_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], code: int, said: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "log.csv").write_text("nothing")
    found, text = invoke("identify", *words)
    assert found == code and said in text.replace("\n", " "), text


SCREW = """
axis.motor = { kind = "torque_source", rotor_inertia = "1 kg cm^2", rated_torque = "1 N m" }
axis.screw = { lead = "10 mm", efficiency = 0.9 }
axis.slide = { mass = "20 kg" }
command = {}
simulation = { duration = "1 s", sample_interval = "1 ms" }
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
        with refuses(reason="give a scale that turns one into the other, such as a radius"):
            prepared(task, log, rig.units)
        data["measured"] = {"x": {"channel": "x", "variable": variable, "scale": 0.1}}
        assert prepared(lm.identification.Identification(**data), log, rig.units).measured


def test_a_first_file_doubts_an_angle_of_a_rig_that_slides(logs: Path) -> None:
    rows = "\n".join(f"{t:.2f},{t}" for t in TIME)
    (logs / "a.csv").write_text(f"time [s],theta [deg]\n{rows}\n")
    (logs / "b.csv").unlink()
    text = lm.identification.first_task(logs, rig=logs / "rig.toml")
    assert "# Doubt: it is in rad, and carriage_position is in m" in text
