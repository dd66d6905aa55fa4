"""The answer and its page: errors have a unit, a channel and the logs that they are of."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from identification_logs import POSITION_NOISE, released, spring_task
from lostmotion.identification.identify import IdentificationResult, identify_task
from lostmotion.reports.identification import write_identification

SPEED_NOISE = 1e-3  # m/s


def identified(directory: Path, **logs: str) -> IdentificationResult:
    """Two logs of a released carriage, position in mm and speed."""
    time = np.arange(0.0, 2.0, 2e-3)
    for k, begin in enumerate((0.05, 0.08)):
        draw = np.random.default_rng(k)
        x = released(time, begin)
        position = x + POSITION_NOISE * draw.normal(size=len(time))
        speed = np.gradient(x, time) + SPEED_NOISE * draw.normal(size=len(time))
        rows = "\n".join(f"{t:.4f},{1e3 * a:.9g},{b:.9g}" for t, a, b in zip(time, position, speed, strict=True))
        (directory / f"{k}.csv").write_text(f"# number: {k}\ntime [s],pos [mm],speed [m/s]\n{rows}\n")
    measured = {
        "position": {"channel": "pos", "variable": "carriage_angle", "deviation": POSITION_NOISE},
        "speed": {"channel": "speed", "variable": "carriage_speed", "deviation": SPEED_NOISE},
    }
    task = spring_task(directory, measured=measured, logs={"files": ["*.csv"], **logs})
    return identify_task(task, directory, threads=1)


@pytest.mark.parametrize("held_out", [True, False])
def test_errors_are_of_the_logs_that_they_name_with_units_and_all_channels(tmp_path: Path, held_out: bool) -> None:
    """Root mean squares of the noise: 2e-5 m and 1e-3 m/s, to what 1000 samples allow (2 %, thrice)."""
    result = identified(tmp_path, **({"held_out": "number == 1"} if held_out else {}))
    what = "error of 1 log held out: " if held_out else "error of the fit, since no log was held out: "
    for text in (result.source(), write_identification(tmp_path / "out", "axis", result).read_text()):
        assert what in text and "other logs" not in text
        errors = text[text.index(what) :]
        position = re.search(r"position MAE \S+ m, RMSE (\S+) m;", errors)
        speed = re.search(r"speed MAE \S+ m/s, RMSE (\S+) m/s", errors)
        assert position is not None and speed is not None
        assert float(position[1]) == pytest.approx(POSITION_NOISE, rel=0.07)
        assert float(speed[1]) == pytest.approx(SPEED_NOISE, rel=0.07)


def test_tables_of_errors_name_their_units(tmp_path: Path) -> None:
    result = identified(tmp_path)
    page = write_identification(tmp_path / "out", "axis", result).read_text()
    assert "mean absolute error, fitted [standard deviations]" in page
    heading, first, second, *_ = (tmp_path / "out" / "errors.csv").read_text().splitlines()
    assert heading.endswith(",unit of MAE and RMSE") and first.endswith(",m") and second.endswith(",m/s")
    assert "position [m]" in (tmp_path / "out" / "overlays.csv").read_text()
    assert "position, 2 logs fitted: MAE" in str(result) and re.search(r"RMSE \S+ m/s", str(result))
