"""Studies of axes that follow a target: rows are those of single runs, whoever makes them, noise included."""

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import lostmotion as lm
from lostmotion.simulation.forms.key_aliases import DRIVE
from lostmotion.studies.runs.chunk import scenario_of_run
from refusals import refused

CAMERA = {"sample_time": 5e-3, "latency": 10e-3, "noise": 1e-4, "seed": 4}


def two_axes() -> lm.Scenario:
    s = lm.load("direction-finder", {"simulation.duration": 0.3})
    data = s.model_dump(exclude_none=True) | {"initial": {"on_reference": True}}
    for c in data["controllers"].values():
        c |= {"camera": CAMERA, "tracker": {"alpha": 0.5, "beta": 0.2}}
    return lm.Scenario(**data)


def one_axis() -> lm.Scenario:
    return lm.load("tracking-camera", {"simulation.duration": 0.5, "initial": {"on_reference": True}})


CASES: list[tuple[Any, str, str]] = [
    (two_axes, "controllers.traverse_drive.", "traverse_drive_pointing_error"),
    (one_axis, "controller.", "pointing_error"),
]


@pytest.mark.parametrize(("make", "prefix", "error"), CASES, ids=["two", "one"])
def test_rows_are_those_of_single_runs_for_any_number_of_workers(make: Any, prefix: str, error: str, tmp_path: Path) -> None:
    signal = error.replace("pointing_error", "target_direction")
    study = lm.studies.Study(
        scenario=make(),
        vary=[{"key": f"{prefix}reference.target.speed", "values": [60.0, 120.0]}, {"key": f"{prefix}camera.seed", "grid": [1, 2, 2]}],
        keep={"rms": f"rms({error})", "peak": f"peak({error}.where(time > 0.1))", "last": f"final({signal})"},
    )
    with ProcessPoolExecutor(2) as workers:
        ways: list[dict[str, Any]] = [{"threads": 1}, {"threads": 3}, {"executor": workers}]
        found = [pq.ParquetDataset(lm.study(study, tmp_path / str(k), **way)).read() for k, way in enumerate(ways)]
    assert set(found[0]["error"].to_pylist()) == {""}
    for name in ("rms", "peak", "last"):
        rows = [table[name].to_numpy() for table in found]
        np.testing.assert_array_equal(rows[0], rows[1])
        np.testing.assert_array_equal(rows[0], rows[2])
        assert len(set(rows[0])) == 4
    for run in range(4):
        s = scenario_of_run(study, run)
        r = lm.simulate(s, energy=False)
        axis = s.controller if s.form == DRIVE else s.controllers["traverse_drive"]
        shaft = "load" if s.form == DRIVE else "traverse"
        missed = axis.reference.at(r.time.values)[0] - r[f"{shaft}_angle"].values
        assert found[0]["rms"][run].as_py() == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-14)
        assert found[0]["peak"][run].as_py() == np.abs(missed[r.time.values > 0.1]).max()
        assert found[0]["last"][run].as_py() == r[signal].values[-1]


def test_an_axis_begins_on_its_reference() -> None:
    drive, train = one_axis(), two_axes()
    r = lm.simulate(drive, duration=5e-3, energy=False)
    angle, speed, *_ = drive.controller.reference.at(0.0)
    assert r.load_angle[0] == angle
    assert r.load_speed[0] == pytest.approx(speed, rel=1e-15)  # the rigid gear ties it to the motor
    assert r.motor_speed[0] == pytest.approx(speed * drive.gearbox.ratio, rel=1e-15)
    r = lm.simulate(train, duration=5e-3, energy=False)
    for axis in ("traverse", "elevation"):
        angle, speed, *_ = train.controllers[f"{axis}_drive"].reference.at(0.0)
        assert (r[f"{axis}_angle"][0], r[f"{axis}_speed"][0]) == (angle, speed)
        assert r[f"{axis}_motor_speed"][0] == pytest.approx(speed * train.gears[f"{axis}_gear"].ratio, rel=1e-15)
    steps = lm.Simulation(train, step=1e-3)
    assert steps["traverse_angle"] == float(r["traverse_angle"][0])
    for s, key in ((drive, "initial.load_angle"), (train, "initial.angles")):
        with pytest.raises(lm.InputError, match="follows from it"):
            s.replace(**{key: 0.1 if s.form == DRIVE else {"traverse": 0.1}})
    assert "no controller" in refused(lambda: lm.load("paper-2dof-nl-small", {"initial.on_reference": True}))
