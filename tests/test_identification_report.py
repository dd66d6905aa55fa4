"""The answer and its page: errors have a unit, a channel and the logs that they are of."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from identification_logs import POSITION_NOISE, released, spring_task
from lostmotion.identification.fit.saved_progress import Progress
from lostmotion.identification.identify import identify_task
from lostmotion.identification.preparation.usable_logs import gathered
from lostmotion.identification.result import IdentificationResult
from lostmotion.identification.rig.residuals import ParameterPoint
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.reports.identification import write_identification

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
