"""What the extension takes to compile: processor time and code of each object, so that neither creeps back unseen."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from report import Report

ROOT = Path(__file__).parent.parent
TREE = ROOT / "build" / "timed"


def section(report: Report) -> None:
    """Compiles the extension anew, one object at a time, in a tree of its own."""
    report.section(
        "Build",
        "Processor time and code of each object of the extension for this processor, compiled one after the other, those above a second.",
    )
    shutil.rmtree(TREE, ignore_errors=True)
    bin = Path(sys.executable).parent
    nanobind = subprocess.run(
        [sys.executable, "-m", "nanobind", "--cmake_dir"], capture_output=True, text=True, check=True
    )
    log = TREE / "times.txt"
    launcher = f"{sys.executable};{ROOT / 'benchmarks' / 'timed_compiler.py'};{log}"
    options = {
        "CMAKE_MAKE_PROGRAM": bin / "ninja",
        "CMAKE_CXX_COMPILER_LAUNCHER": launcher,
        "Python_EXECUTABLE": sys.executable,
        "nanobind_DIR": nanobind.stdout.strip(),
        "LOSTMOTION_PYTHON": "ON",
    }
    configure = [bin / "cmake", "-S", ROOT, "-B", TREE, "-G", "Ninja", *(f"-D{k}={v}" for k, v in options.items())]
    subprocess.run(configure, check=True, stdout=subprocess.DEVNULL)
    subprocess.run([bin / "cmake", "--build", TREE, "--parallel", "1"], check=True, stdout=subprocess.DEVNULL)
    rows = []
    for line in log.read_text().splitlines():
        time, code, made = line.split("|")
        parts = Path(made).parts
        room = next(p.removesuffix(".dir") for p in parts if p.endswith(".dir"))
        rows.append((float(time), int(code), f"{room}: {parts[-1].removesuffix('.o')}"))
    total = (sum(r[0] for r in rows), sum(r[1] for r in rows))
    (library,) = TREE.glob("_core_*.so")
    shown = [(name, f"{t:.1f}", f"{c / 1e3:.0f}") for t, c, name in sorted(rows, reverse=True) if t > 1.0]
    report.table(("object", "time [s]", "code [kB]"), [*shown, ("all", f"{total[0]:.0f}", f"{total[1] / 1e3:.0f}")])
    report.add("", f"The extension has {library.stat().st_size / 1e6:.2f} MB.")
