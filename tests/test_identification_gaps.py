"""What a log lacks: units other than SI, samples without a number, and pauses do not change the values that are found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification_logs import MASS, POSITION_NOISE, released, spring_task
from lostmotion.errors import InputError
from lostmotion.identification.identify import identify_task
from lostmotion.identification.logs import Channel, Log
from lostmotion.identification.prepare import prepared
from lostmotion.identification.rig import Rig


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("mm", 1e3), ("um", 1e6)])
def test_a_log_in_another_unit_gives_the_same_mass(tmp_path: Path, unit: str, factor: float) -> None:
    """The first value of the channel is where the run begins."""
    time = np.arange(0.0, 3.0, 2e-3)
    x = released(time, 0.05) + POSITION_NOISE * np.random.default_rng(1).normal(size=len(time))
    rows = "\n".join(f"{t:.4f},{factor * v:.9g}" for t, v in zip(time, x, strict=True))
    (tmp_path / "log.csv").write_text(f"time [s],pos [{unit}]\n{rows}\n")
    result = identify_task(spring_task(tmp_path), tmp_path, threads=1)
    assert result.values["mass"] == pytest.approx(MASS, rel=2e-3)
    assert result.error()[1] == pytest.approx(POSITION_NOISE, rel=0.1)


def test_first_values_means_and_conditions_are_in_si(tmp_path: Path) -> None:
    task = spring_task(tmp_path, logs={"files": ["*.csv"], "weight": "1 + 9*(speed > 1)", "stated": {"vin": "volts"}})
    time = np.arange(20) * 0.01
    channels = {
        "pos": Channel(100.0 + np.arange(20.0), "mm"),
        "speed": Channel(np.repeat([5.0, 20.0], 10), "rpm"),
        "volts": Channel(np.full(20, 12e3), "mV"),
        "raw": Channel(np.arange(20.0), "counts"),
    }
    rig = Rig(task, tmp_path)
    log = prepared(task, Log("log.csv", time, channels, {"vin": 12.0}), rig.units)
    assert log.facts["first_pos"] == pytest.approx(0.1)
    assert log.facts["mean_pos"] == pytest.approx(0.1095)
    assert log.facts["mean_volts"] == pytest.approx(12.0) and not log.log.notes
    assert log.weight.tolist() == [1.0] * 10 + [10.0] * 10  # 20 rpm are 2.1 rad/s


def test_a_formula_with_a_channel_of_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    task = spring_task(tmp_path, set={"motors.drive.rotor_inertia": "mass + 0*first_raw"})
    channels = {"pos": Channel(np.arange(20.0)), "raw": Channel(np.arange(20.0), "counts")}
    with pytest.raises(InputError, match=r"^log\.csv: channel raw: the unit 'counts' is not known, and a formula"):
        prepared(task, Log("log.csv", np.arange(20) * 0.01, channels), Rig(task, tmp_path).units)
