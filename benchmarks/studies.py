"""Whole studies, Parquet written: runs per second over threads and workers, overhead, a hundred thousand runs, a resume."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from report import Report, best

import lostmotion as lm
from lostmotion import _core
from lostmotion.simulation.runs.core_runs import core_case
from lostmotion.studies.study.random_designs import CHUNK
from lostmotion.studies.study.study_files import to_json

CORES = os.cpu_count() or 1
KEEP = {"peak": "peak(load_speed)", "rms": "rms(twist)"}
KEPT = [(0, _core.reductions().index("peak")), (1, _core.reductions().index("rms"))]
COMMAND = [{"key": "command.amplitude", "uniform": [0.1, 1.0]}]
DRIVE = [{"key": "load.inertia", "uniform": [1.0, 3.0]}, {"key": "motor.friction_torque", "uniform": [0.01, 0.02]}]


def spent(study: lm.studies.Study, clock: Callable[[], float] = time.perf_counter, **how: object) -> float:
    """Time of the whole study [s]."""
    with tempfile.TemporaryDirectory() as directory:
        return 1e-3 * best(1, lambda: lm.study(study, Path(directory) / "s", **how), clock)  # type: ignore[arg-type]


def make(scenario: lm.Scenario, vary: list[dict[str, object]], runs: int) -> lm.studies.Study:
    base = scenario.replace(**{"simulation.duration": 1.0})
    return lm.studies.Study(scenario=base, design="random", runs=runs, vary=vary, keep=KEEP)  # type: ignore[arg-type]


def core_alone(study: lm.studies.Study, threads: int) -> float:
    """Processor time of the calls into the core alone [s]."""
    fields = [_core.batch_fields().index(v.key) for v in study.vary]
    channels = ("load_speed", "twist")
    case, grid = core_case(study.scenario), study.scenario.simulation.grid()
    what = {"fields": fields, "energies": (), "channels": channels, "kept": KEPT, "threads": threads}
    chunks = [study.parameters(k, k + CHUNK) for k in range(0, study.total, CHUNK)]

    def work() -> None:
        for values in chunks:
            _core.run_batch([case], values=np.ascontiguousarray(values), **what, **grid)

    return 1e-3 * best(3, work, time.process_time)


def section(report: Report, scenario: lm.Scenario) -> None:
    spent(make(scenario, COMMAND, 1))  # the first study of a process loads the libraries
    report.section(
        "Studies",
        "Runs of 1 s of the drive of the first table, peak and rms kept of each, Parquet written. Overhead: processor\n"
        "time of the study beyond that of its calls into the core alone, in parts of the latter.",
    )
    rows = []
    for name, vary in (("the command", COMMAND), ("the command and the drive", COMMAND + DRIVE)):
        study = make(scenario, vary, 8000)
        for threads in sorted({1, CORES}):
            whole = min(spent(study, threads=threads) for _ in range(2))
            used = min(spent(study, time.process_time, threads=threads) for _ in range(3))
            core = core_alone(study, threads)
            rows.append(
                (
                    name,
                    f"{threads} thread{'s' if threads > 1 else ''}",
                    f"{8000 / whole:.0f}",
                    f"{8000 / whole / threads:.0f}",
                    f"{100.0 * (used / core - 1.0):.0f} %",
                )
            )
    study = make(scenario, COMMAND, 8000)
    for workers in sorted({1, CORES}):
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            spent(make(scenario, COMMAND, 4 * CHUNK), executor=pool)  # the workers start
            rate = 8000 / spent(study, executor=pool)
        rows.append(
            (
                "the command",
                f"{workers} process{'es' if workers > 1 else ''}",
                f"{rate:.0f}",
                f"{rate / workers:.0f}",
                "",
            )
        )
    report.table(("what varies", "on", "runs/s", "simulated s per s and core", "overhead"), rows)
    large = make(scenario, COMMAND, 100_000)
    report.add("", f"100,000 runs of 1 s on {CORES} cores, the command varied, Parquet written: {spent(large):.1f} s.")
    report.add("", resume(make(scenario, COMMAND, 1_000_000)))


def resume(study: lm.studies.Study) -> str:
    """All parts of the study but the last are there; the time to find that out and to make the last."""
    parts = study.total // CHUNK
    with tempfile.TemporaryDirectory() as directory:
        whole, some = Path(directory) / "whole", Path(directory) / "some"
        lm.study(study.model_copy(update={"runs": CHUNK}), some)
        whole.mkdir()
        for k in range(parts - 1):
            shutil.copy(some / "part-000000.parquet", whole / f"part-{k:06d}.parquet")
        (whole / "_study.json").write_text(to_json(study))
        taken = 1e-3 * best(1, lambda: lm.study(study, whole))
    return f"A study of 1,000,000 runs of which {parts - 1} of {parts} parts are there is resumed and complete in {taken:.2f} s."
