"""What `make cross-check` writes, by FMPy's program for it."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import ROOT

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")


@pytest.fixture(scope="module")
def written(tmp_path_factory: Any) -> Path:
    directory = tmp_path_factory.mktemp("cross-check")
    subprocess.run([sys.executable, ROOT / "bindings" / "fmu" / "cross_check.py", directory], check=True)
    return Path(directory)


# In Co-Simulation FMPy holds inputs over a step; where there are none it should give the reference itself.
@pytest.mark.filterwarnings("ignore:Please import:DeprecationWarning")  # by FMPy, of scipy
@pytest.mark.parametrize(
    ("interface", "model", "error"),
    [("cs", "PaperDrive", 0.1), ("cs", "PositionAxis", 1e-11), ("me", "PaperDrive", 0.1), ("me", "PositionAxis", 0.1)],
)
def test_the_files_follow_the_rules_and_fmpy_gives_the_reference(interface: str, model: str, error: float, written: Path) -> None:
    from fmpy.cross_check import validate_result
    from fmpy.cross_check.validate_vendor_repo import validate_test_fmu
    from fmpy.util import read_csv, read_ref_opt_file

    (directory,) = written.glob(f"2.0/{interface}/*/lostmotion/*/{model}")
    assert validate_test_fmu(str(directory)) == []
    assert (directory / "README.md").read_text().strip()
    reference, options = (read_csv(str(directory / f"{model}_ref.csv")), read_ref_opt_file(str(directory / f"{model}_ref.opt")))
    found = fmpy.simulate_fmu(
        str(directory / f"{model}.fmu"),
        fmi_type={"cs": "CoSimulation", "me": "ModelExchange"}[interface],
        step_size=options["StepSize"],
        output_interval=options["StepSize"],
        # With inputs from a table FMPy's CVODE reaches its limit of steps at the 1e-8 of modelDescription.xml (docs/fmu.md).
        relative_tolerance=1e-4,
        stop_time=options["StopTime"],
        input=read_csv(str(directory / f"{model}_in.csv")),
        output=reference.dtype.names[1:],
    )
    assert validate_result(found, reference, options["StartTime"], options["StopTime"]) is None
    for name in reference.dtype.names[1:]:
        gap = np.interp(reference["time"], found["time"], found[name]) - reference[name]
        assert np.abs(gap).max() <= error * np.abs(reference[name]).max(), name
