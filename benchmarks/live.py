"""The live page: its size, how soon it shows something, and its core against the same core compiled for this machine."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from report import Report

import lostmotion as lm
from lostmotion.live_page.page import write_page
from lostmotion.portable.scenario_as_numbers import kernel_of

ROOT = Path(__file__).parent.parent
CHROMIUM = Path("/usr/bin/chromium")
SCENARIOS = {
    "paper-2dof-nl-small": "the paper's drive",
    "joint-under-gravity": "a robot joint",
    "worm-lowering": "a worm that chatters",
    "hunting-with-backlash": "an axis that hunts",
}
ROUNDS, REPEATS = 5, 40  # of a program, alternating with the other; runs in each


def native(library: Path, description: Path) -> float:
    """Least time of a run by the C library, without wide vectors [ms]."""
    lib = ctypes.CDLL(str(library))
    lib.lm_scenario_read.restype = lib.lm_scenario_run.restype = ctypes.c_void_p
    numbers = description.read_bytes()
    given = (ctypes.c_double * (len(numbers) // 8)).from_buffer_copy(numbers)
    scenario = ctypes.c_void_p(lib.lm_scenario_read(given, ctypes.c_size_t(len(given)), None, ctypes.c_size_t(0)))
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        result = lib.lm_scenario_run(scenario, 1, ctypes.c_size_t(0))
        lib.lm_result_free(ctypes.c_void_p(result))
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def portable(core: Path, description: Path) -> float:
    """The same of the WebAssembly module in Chromium [ms]."""
    words = ["node", str(ROOT / "benchmarks" / "wasm_run.mjs"), str(core), str(description), str(REPEATS)]
    return float(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def section(report: Report) -> None:
    """Left out where there is no node, or `make page` and `make c-library` have not run."""
    library = ROOT / "build" / "c" / "liblostmotion.so"
    needed = (CHROMIUM, library, ROOT / "build" / "page-core" / "any" / "core.wasm")
    if not (shutil.which("node") and all(path.exists() for path in needed)):
        return
    report.section(
        "Live page",
        "The whole run with its energies by the same function, `lm_scenario_run`: in Chromium as WebAssembly, and from the C library, compiled by g++\n"
        "without wide vectors, in alternation. First plot: until Chromium shows it, from the opening of the file, of a long run its beginning; whole run:\n"
        "until that is there; frame: while a slider moves in each.",
    )
    rows = []
    with tempfile.TemporaryDirectory() as directory:
        for name, words in SCENARIOS.items():
            scenario = lm.load(name)
            page, numbers = Path(directory, f"{name}.html"), Path(directory, f"{name}.bin")
            write_page(page, scenario)
            numbers.write_bytes(lm.portable.description(scenario, parameters=False).astype("<f8").tobytes())
            core = ROOT / "build" / "page-core" / kernel_of(scenario) / "core.wasm"
            pairs = [(native(library, numbers), portable(core, numbers)) for _ in range(ROUNDS)]
            here, there = (min(times) for times in zip(*pairs, strict=True))
            size = f"{page.stat().st_size / 1e3:.0f}"
            opened = ["node", str(ROOT / "benchmarks" / "first_plot.mjs"), str(page)]
            first, whole, frame = subprocess.run(opened, check=True, capture_output=True, text=True).stdout.split()
            shown = f"{float(first):.0f}", f"{float(whole):.0f}", f"{float(frame):.1f}"
            rows.append((words, size, *shown, f"{here:.3f}", f"{there:.3f}", f"{there / here:.2f}"))
    columns = (
        "",
        "page [kB]",
        "first plot [ms]",
        "whole run [ms]",
        "frame [ms]",
        "C [ms]",
        "WebAssembly [ms]",
        "ratio",
    )
    report.table(columns, rows)


if __name__ == "__main__":
    alone = Report()
    section(alone)
    sys.stdout.write(alone.text())
