"""What a run costs, over simulated time, switchings, size of the loss map and of a batch; and how much of the machine it uses."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from report import Report, best

import lostmotion as lm
from lostmotion import _core
from lostmotion.simulation.runs.core_runs import core_case

CORES = os.cpu_count() or 1
PLANE = {"speeds": [0.0, 10.0], "loads": [0.0, 10.0], "values": [[0.02, 0.42], [0.62, 1.02]], "mirrored": True}


def section(report: Report, scenario: lm.Scenario, build: Path, programs: dict[str, list[list[str]]]) -> None:
    name = next(name for name in programs if name.startswith("bench_costs"))
    lines = programs[name]

    def rows(table: str) -> list[list[str]]:
        return [cells[1:] for cells in lines if cells[0] == table]

    what = f"In C++ ({name.rsplit('_', 1)[1]} build), the drive of the first table"
    report.section("Cost over simulated time", f"{what}, without samples.")
    report.table(("simulated [s]", "switchings", "time [ms]", "ms per s"), rows("time"))
    report.section("Cost over switchings", f"{what}, 10 s, without samples.")
    report.table(("amplitude", "frequency [Hz]", "switchings", "time [ms]", "us per switching"), rows("events"))
    report.section(
        "Cost over the size of the loss map",
        f"{what}, 2 s, without samples. From run to run four thousand regimes are kept.",
    )
    report.table(("map, speeds x loads", "switchings", "same drive again [ms]", "new drive [ms]"), rows("map"))
    responses = rows("response")
    report.section("Frequency response", "The same drive, 60 frequencies from 0.1 to 100 Hz at 8 amplitudes.")
    report.table(
        ("", "time [ms]", "ratio"),
        [(n, f"{float(ms):.0f}", f"{float(ms) / float(responses[0][1]):.1f}") for n, ms in responses],
    )
    peak(report, build, programs)
    batches(report, scenario)


def peak(report: Report, build: Path, programs: dict[str, list[list[str]]]) -> None:
    """Floating-point operations are counted instruction by instruction, as they are executed."""
    kind = next(kind for kind in ("avx2", "any") if f"bench_run_{kind}" in programs)  # valgrind knows nothing wider
    program = build / f"bench_run_{kind}"
    measured = subprocess.run([build / f"bench_costs_{kind}", "peak"], check=True, capture_output=True, text=True)
    gigaflops = float(measured.stdout.split("|")[1])
    report.section(
        "Share of the floating-point peak",
        f"The paper's run, same drive again, {kind} build. The peak is measured: multiplications and additions side by side, without fused ones,\n"
        "which the core does not use, so that all builds give the same bits.",
    )
    if shutil.which("valgrind") is None:
        report.add("Not measured: valgrind, which counts the instructions, is not installed.")
        return
    few, many = (count(program, runs) for runs in (2, 12))
    flops, instructions = ((m - f) / 10.0 for f, m in zip(few, many, strict=True))
    spent = min(float(cells[2]) for cells in programs[program.name] if "table" in cells[0] and "again" in cells[1])
    rate = flops / (1e6 * spent)
    report.table(
        ("instructions a run", "floating-point operations", "Gflop/s", "peak of one core", "share"),
        [
            (
                f"{instructions:.0f}",
                f"{flops:.0f}",
                f"{rate:.2f}",
                f"{gigaflops:.1f}",
                f"{100.0 * rate / gigaflops:.1f} %",
            )
        ],
    )


def count(program: Path, runs: int) -> tuple[int, int]:
    """Floating-point operations and instructions of so many runs."""
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory) / "counts"
        subprocess.run(
            [
                *("valgrind", "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no"),
                *(f"--callgrind-out-file={out}", str(program), str(runs)),
            ],
            check=True,
            capture_output=True,
        )
        executed: dict[int, int] = {}
        after_call = False
        for line in out.read_text().splitlines():
            if line.startswith("calls="):
                after_call = True  # the next line is the cost of what was called, which is counted there
            elif line.startswith("0x"):
                if not after_call:
                    address, _, times = line.split()
                    executed[int(address, 16)] = executed.get(int(address, 16), 0) + int(times)
                after_call = False
    text = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], check=True, capture_output=True, text=True)
    flops = 0
    for address, operation, operands in re.findall(r"^ *([0-9a-f]+):\t(\w+) *(.*)$", text.stdout, re.MULTILINE):
        found = re.fullmatch(r"v?(?:add|sub|mul|div|sqrt|max|min)([sp])d", operation)
        if found:
            width = 1 if found[1] == "s" else 4 if "%ymm" in operands else 2
            flops += width * executed.get(int(address, 16), 0)
    return flops, sum(executed.values())


def batches(report: Report, scenario: lm.Scenario) -> None:
    short = scenario.replace(**{"simulation.duration": 1.0})
    plane = short.replace(**{f"gearbox.losses.{k}": v for k, v in PLANE.items()})
    fields = [_core.batch_fields().index(key) for key in ("command.amplitude", "load.inertia", "motor.friction_torque")]
    channels = ("load_speed", "twist")

    def rate(s: lm.Scenario, runs: int, threads: int, *, drive: bool) -> float:
        share = np.arange(runs) / runs
        values = np.stack([0.1 + 0.9 * share, 1.0 + 2.0 * share, 0.01 + 0.01 * share], axis=1)
        used = 3 if drive else 1
        chosen = np.ascontiguousarray(values[:, :used])

        def work() -> None:
            what = {"fields": fields[:used], "values": chosen, "energies": (), "channels": channels, "kept": []}
            _core.run_batch([core_case(s)], **what, **s.simulation.grid(), threads=threads)

        return runs / (1e-3 * best(7 if runs < 5000 else 3, work))

    report.section(
        "Batches",
        "Runs of 1 s in one call, command amplitude from 0.1 to 1, two channels sampled at 1 kHz; with the drive: load inertia and\n"
        "motor friction too. A run is a simulated second.",
    )
    rows = []
    for name, s in (("stand-in table", short), ("plane map", plane)):
        for drive in (False, True):
            one, all_cores = (rate(s, 2000, threads, drive=drive) for threads in (1, CORES))
            rows.append(
                (
                    f"{name}, {'command and drive vary' if drive else 'command varies'}",
                    f"{one:.0f}",
                    f"{all_cores:.0f}",
                    f"{100.0 * all_cores / one / CORES:.0f} %",
                )
            )
    report.table(("", "runs/s, 1 thread", f"runs/s, {CORES} threads", "efficiency"), rows)
    report.add("", "Over the size of the batch, stand-in table, the command varies:", "")
    report.table(
        ("runs", "runs/s, 1 thread", f"runs/s, {CORES} threads"),
        [
            (str(n), *(f"{rate(short, n, threads, drive=False):.0f}" for threads in (1, CORES)))
            for n in (1, 10, 100, 1000, 10000)
        ],
    )
