"""What users wait for, as a whole and on all cores: maps, passes, budgets, selections; and the step of an FMU."""

from __future__ import annotations

import subprocess
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from report import Report, best

import lostmotion as lm

ROOT = Path(__file__).parent.parent


def section(report: Report) -> None:
    report.section("Whole tasks", "From Python, on all cores.")
    rows = [(words, f"{seconds:.2f}") for words, seconds in (hunting_map(), one_pass(), budget(), selection())]
    report.table(("", "time [s]"), rows)
    fmu_step(report)


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Time [s] and what comes out."""
    begin = time.perf_counter()
    made = work()
    return time.perf_counter() - begin, made


def hunting_map() -> tuple[str, float]:
    over = {
        "controllers.servo.position.integral_gain": np.linspace(4, 64, 40),
        "shafts.table.breakaway_torque": np.linspace(5, 12, 40),
    }
    seconds, _ = timed(lambda: lm.servo.hunting_map(lm.load("hunting-with-static-friction"), over))
    return "hunting map of 40 x 40 limit cycles", seconds


def one_pass() -> tuple[str, float]:
    """Both axes of the direction finder, with a target that takes three times as long."""
    target = {"duration": "60 s", "crossing_time": "30 s"}
    axes = ("traverse_drive", "elevation_drive")
    longer = {f"controllers.{axis}.reference.target.{key}": value for axis in axes for key, value in target.items()}
    scenario = lm.load("direction-finder", longer | {"simulation.duration": "60 s"})
    time = best(3, lambda: lm.simulate(scenario, energy=False))
    return "60 s of both axes of the direction finder at 8 kHz", time / 1e3


def budget() -> tuple[str, float]:
    seconds, sheet = timed(lambda: lm.pointing_budget(lm.load("direction-finder"), after="2 s"))
    each = (sheet.without, sheet.alone, sheet.successive, sheet.variants, sheet.robustness, sheet.speeds)
    n = 2 + sum(map(len, each))
    return f"pointing budget of the direction finder, 20 s, {n} variants", seconds


def selection() -> tuple[str, float]:
    """The indexing table of the examples, with gearboxes of more ratios."""
    text = (ROOT / "examples" / "select-axis.toml").read_text()
    before = "catalogue = { ratio = [20, 110], rated_output_torque"
    assert before in text
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory, "table.toml")
        path.write_text(text.replace(before, "catalogue = { ratio = [3, 200], rated_output_torque"))
        begin = time.process_time()
        found = lm.select(path, Path(directory, "rows"))
        seconds = time.process_time() - begin
    pairs, ran = found.sizes["pair"], int(found["cycles"].notnull().sum())
    return f"select: {pairs} pairs, {ran} of them run; processor time", seconds


def fmu_step(report: Report) -> None:
    """A step of 1 ms of the paper's drive by the C interface, and by an FMU over it."""
    core = ROOT / "build" / "c" / "liblostmotion.so"
    scenario = lm.load("paper-2dof-nl-large")
    with tempfile.TemporaryDirectory() as directory:
        fmu, program = Path(directory, "drive.fmu"), Path(directory, "fmu_step")
        try:
            lm.export_fmu(scenario, fmu)
        except lm.InputError as e:
            report.add("", f"The step of an FMU is not measured: {e}")
            return
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(directory)
        libraries = [p for p in Path(directory, "binaries").rglob("lostmotion.*") if p.is_file()]
        own = [p for p in libraries if p.parent.name == "linux64"]
        if not core.exists() or not own:
            report.add(
                "", "The step of an FMU is not measured: `make c-library` has not run, or this is not Linux on x86-64."
            )
            return
        subprocess.run(["cc", "-O2", ROOT / "benchmarks" / "fmu_step.c", "-o", program, "-ldl"], check=True)
        guid = Path(directory, "modelDescription.xml").read_text().split('guid="')[1].split('"')[0]
        resources = Path(directory, "resources")
        words = [program, own[0], resources.as_uri(), guid, core, resources / "scenario.bin"]
        by_core, by_fmu = subprocess.run(words, check=True, capture_output=True, text=True).stdout.split()
        size = fmu.stat().st_size / 1e6
    report.add(
        "",
        f"A step of 1 ms of the paper's drive in C: {float(by_core):.2f} us by the C interface, {float(by_fmu):.2f} us by its FMU, of {size:.1f} MB",
        f"with the libraries for {len(libraries)} of six platforms.",
    )
