"""A few cases of `make fuzz`, the same each time, and the watchdog that runs them."""

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from conftest import ROOT
from fuzz.__main__ import KINDS
from fuzz.faults import FAULTS
from fuzz.watchdog import Case, failure_of

NEEDS = {"log_files": ("asammdf", "nptdms", "mcap", "rosbags", "h5py", "openpyxl"), "study_folders": ("pyarrow",)}
COUNTS = {"scenario_files": 4, "command_lines": 3, "study_folders": 3, "log_files": 6, "fmu_calls": 2, "random_trains": 4}


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("kind", KINDS)
def test_cases_of_every_kind_are_read_run_or_refused_plainly(kind: str, tmp_path: Path) -> None:
    if missing := [name for name in NEEDS.get(kind, ()) if find_spec(name) is None]:
        pytest.skip(f"{missing[0]} is missing")
    for number in range(COUNTS[kind]):
        folder = tmp_path / str(number)
        folder.mkdir()
        assert failure_of(Case(kind, 0, number), folder) == ""


@pytest.mark.parametrize("fault", FAULTS[:4])
def test_the_watchdog_reports_a_fault_and_keeps_its_files(fault: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "fuzz", "--kinds", "faults", "--minutes", "0.02", "--processes", "1"]
    done = subprocess.run(
        [*command, "--out", str(tmp_path / "out")],
        cwd=ROOT / "tests",
        env=os.environ | {"FUZZ_FAULT": fault},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == bool(fault), done.stdout + done.stderr
    assert fault in done.stdout
    kept = sorted((tmp_path / "out").glob("*"))
    assert bool(kept) == bool(fault)
    for folder in kept:
        assert (folder / "input.txt").read_text() == "what the case was made of"
        assert (folder / "failure.txt").read_text().startswith('make fuzz CASE="faults:1:')
