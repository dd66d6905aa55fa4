"""What commands take, and what one run from Python takes beyond the core. `python benchmarks/commands.py` prints this section alone."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from report import Report, best

import lostmotion as lm
from lostmotion import _core

# Each with how often it is run; the first run of all compiles the modules.
COMMANDS = (
    ("--help", 5),
    ("run --help", 5),
    ("scenarios", 5),
    ("run paper-2dof-nl-small", 5),
    ("run position-axis --plot run.png", 3),
    ("drive check catalogue-robot-joint", 5),
    ("rig schaeffler-rt1-h-20-100", 2),
    ("response paper-2dof-nl-small -o response", 2),
    ("servo position-axis", 1),
    ("track direction-finder", 1),
    ("reproduce -o out", 1),
)
# Processor time of the outermost imports, printed behind all else.
IMPORTS = """
import builtins, sys, time
plain, spent, within = builtins.__import__, 0.0, False
def timed(*arguments, **options):
    global spent, within
    if within:
        return plain(*arguments, **options)
    within, begin = True, time.process_time()
    try:
        return plain(*arguments, **options)
    finally:
        within, spent = False, spent + time.process_time() - begin
builtins.__import__ = timed
try:
    from lostmotion.cli import main
    main()
finally:
    print(spent, file=sys.stderr)
"""
RUNS = ("paper-2dof-nl-small", "position-axis", "worm-lowering")


def processor_time(*command: str, repeats: int = 5) -> tuple[float, float, str]:
    """Least processor time and least wall time of whole processes [ms], and what the last one wrote to stderr."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    times, text = [], ""
    with tempfile.TemporaryDirectory() as directory:
        for _ in range(repeats):
            before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=directory, env=environment)
            wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
            times.append((after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall))
            text = done.stderr
    return *(1e3 * min(column) for column in zip(*times, strict=True)), text


def of_commands(report: Report) -> None:
    python, command = sys.executable, str(Path(sys.executable).with_name("lostmotion"))
    bare, _, _ = processor_time(python, "-c", "pass")
    rows = []
    for what, repeats in COMMANDS:
        words = what.split()
        *_, text = processor_time(python, "-c", IMPORTS, *words, repeats=1)
        processor, wall, _ = processor_time(command, *words, repeats=repeats)
        rows.append((f"lostmotion {what}", f"{processor:.0f}", f"{1e3 * float(text.split()[-1]):.0f}", f"{wall:.0f}"))
    imported, wall, _ = processor_time(python, "-c", "import lostmotion")
    rows.insert(0, ("import lostmotion", f"{imported:.0f}", f"{imported - bare:.0f}", f"{wall:.0f}"))
    report.section(
        "Commands",
        f"Whole processes, of which the interpreter alone takes {bare:.0f} ms. Processor time is that of all threads; other programs on\n"
        "the machine lengthen wall times, and processor times much less.",
    )
    report.table(("", "processor time [ms]", "of which imports [ms]", "wall time [ms]"), rows)


def in_core(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Least processor time of a piece of work [ms], and the part of it in the runs of the core."""
    spent = 0.0

    def timed(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            nonlocal spent
            begin = time.process_time()
            try:
                return function(*arguments, **options)
            finally:
                spent += time.process_time() - begin

        return call

    whole = {name: getattr(_core, name) for name in dir(_core) if name.startswith("run")}
    least = best(repeats, work, time.process_time)
    try:
        for name, function in whole.items():
            setattr(_core, name, timed(function))
        best(repeats, work)
    finally:
        for name, function in whole.items():
            setattr(_core, name, function)
    assert spent > 0.0, "no function of the core whose name begins with run was called"
    return least, 1e3 * spent / repeats


def of_runs(report: Report) -> None:
    rows = []
    for name in RUNS:
        scenario = lm.load(name)
        dataset, core = in_core(lambda scenario=scenario: lm.simulate(scenario), 50)
        arrays, _ = in_core(lambda scenario=scenario: lm.simulate(scenario, output="arrays"), 50)
        ledger, _ = in_core(lambda scenario=scenario: lm.simulate(scenario, energy=True), 50)
        beyond = (f"{dataset - core:.2f}", f"{arrays - core:.2f}")
        rows.append((name, f"{dataset:.2f}", f"{core:.2f}", *beyond, f"{ledger:.2f}"))
    report.add("", "One run from Python, the same scenario again; processor time:")
    report.table(
        (
            "",
            "lm.simulate [ms]",
            "core [ms]",
            "beyond the core [ms]",
            "the same to arrays [ms]",
            "with energy ledger [ms]",
        ),
        rows,
    )


def section(report: Report) -> None:
    of_commands(report)
    of_runs(report)


if __name__ == "__main__":
    alone = Report()
    section(alone)
    print(alone.text())
