"""The EMPS axis in open loop, from public data that are not shipped (Janot, Gautier, Brunot 2019)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from conftest import ROOT
from lostmotion.identification.prepare import prepared, read_all
from lostmotion.identification.rig import Rig
from lostmotion.identification.task import Identification, load_identification

EMPS = ROOT / "examples" / "emps"
DATA = os.environ.get("LOSTMOTION_EMPS", "")

# Found from the first log by `lostmotion identify examples/emps/identify.toml`, on the rung "friction over speed".
FOUND = {
    "mass": 95.21203322586986,
    "viscous_friction": 220.46616889466924,
    "coulomb_friction": 18.402815185901265,
    "offset": -3.3376954399613927,
    "static_friction": 11.277128587340197,
    "friction_speed": 0.02,
}
RMSE = [2.35347e-3, 5.10274e-3]  # [m]


@pytest.mark.skipif(
    not DATA,
    reason="the environment variable LOSTMOTION_EMPS names no folder with DATA_EMPS.mat and DATA_EMPS_PULSES.mat",
)
def test_the_axis_follows_its_voltage_in_open_loop() -> None:
    """25 s without any feedback; the best linear model of the benchmark reaches a fit of 25.4 %, a plain four-parameter drive 6.98 mm."""
    task, _ = load_identification(EMPS / "identify.toml")
    data = task.model_dump()
    data["logs"]["files"] = [str(Path(DATA) / name) for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")]
    task = Identification(**data)
    rig = Rig(task, EMPS)
    errors = []
    for log in read_all(task, EMPS):
        one = prepared(task, log, rig.units)
        errors.append(float(np.sqrt(np.mean((one.measured["position"] - rig.run(one, FOUND, 1)["position"]) ** 2))))
    # As measured when these values were found, to the last figure given.
    assert errors == pytest.approx(RMSE, abs=1e-5)
