"""`make bench`: the paper's run against its peers, in one run on one machine. Times are best of several."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from peer_scipy import Peer

import lostmotion as lm

ROOT = Path(__file__).parent.parent


def best(repeats: int, work: Callable[[], object]) -> float:
    """Milliseconds."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def start_up(*command: str) -> float:
    return best(5, lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL))


def output_of(program: Path) -> str:
    return subprocess.run([program], check=True, capture_output=True, text=True).stdout


def main() -> None:
    scenario = lm.load(ROOT / "scenarios" / "paper-2dof-nl-large.toml")
    exact = lm.simulate(scenario)
    rows: list[tuple[str, float, str]] = []
    responses: list[tuple[str, float]] = []
    programs = [Path(sys.argv[1]) / name for name in ("bench_core", "peer_cvode")]
    lines = [line for p in programs if p.exists() for line in output_of(p).splitlines()]
    for line in lines:
        name, milliseconds, error = line.split("|")
        if name.startswith("response, "):
            responses.append((name.removeprefix("response, "), float(milliseconds)))
        else:
            rows.append((f"C++: {name}", float(milliseconds), error))
    rows.append(("Python to dataset, no ledger", best(100, lambda: lm.simulate(scenario, energy=False)), "0"))
    rows.append(("Python to dataset, with ledger", best(100, lambda: lm.simulate(scenario)), "0"))

    peer = Peer(scenario)
    times = exact["time"].values
    for method in ("LSODA", "Radau"):
        for rtol in (1e-6, 1e-8):
            begin = time.perf_counter()
            try:
                states = peer.run(2.0, times, method, rtol)
            except RuntimeError as error:
                rows.append((f"scipy {method}, rtol {rtol:g}: {error}", float("nan"), "-"))
                continue
            spent = 1e3 * (time.perf_counter() - begin)
            errors = [
                np.max(np.abs(states[:, column] - exact[name].values)) / np.max(np.abs(exact[name].values))
                for column, name in ((2, "load_speed"), (3, "twist"))
            ]
            rows.append((f"scipy {method}, rtol {rtol:g}, events in Python", spent, f"{max(errors):.3g}"))

    report = Report()
    model = next(
        (x.split(":")[1].strip() for x in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in x), "?"
    )
    report.add("# Benchmark", "", "Made by `make bench`, all in one run; times are the best of several.", "")
    report.add(
        f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}, Python {platform.python_version()}"
    )
    report.add(
        f"lostmotion {exact.attrs['lostmotion_version']}, {', '.join(f'{m} {version(m)}' for m in ('numpy', 'scipy', 'xarray'))}"
    )
    report.add("", "## One run", "")
    report.add(
        "2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, sampled at 1 kHz, stand-in loss table. CVODE has the same regimes and"
    )
    report.add(
        "contact logic as the exact solver and differs in the integrator alone; scipy has them written in Python.", ""
    )
    reference = next(ms for name, ms, _ in rows if "same drive again" in name)
    cells = [(name, f"{ms:.4f}", f"{ms / reference:.1f}", error) for name, ms, error in rows]
    report.table(("", "time [ms]", "ratio", "largest error"), cells)
    report.add(
        "", "## Frequency response", "", "The same drive, 60 frequencies from 0.1 to 100 Hz at 8 amplitudes.", ""
    )
    report.table(("", "time [ms]", "ratio"), [(n, f"{ms:.0f}", f"{ms / responses[0][1]:.1f}") for n, ms in responses])
    report.add("", "## Studies", "", "Runs of 1 s of the same drive, two values kept of each, Parquet written.", "")
    report.table(("what varies", "threads", "runs/s", "simulated s per s and core"), studies(scenario))
    report.add("", "## Start-up", "")
    python, command = sys.executable, str(Path(sys.executable).with_name("lostmotion"))
    bare = start_up(python, "-c", "pass")
    begin = time.perf_counter()
    subprocess.run(
        [command, "reproduce", "-o", str(ROOT / "build" / "bench-report")], check=True, stdout=subprocess.DEVNULL
    )
    reproduced = 1e3 * (time.perf_counter() - begin)
    report.table(
        ("", "time [ms]"),
        [
            (
                f"import lostmotion, beyond the interpreter's own {bare:.1f} ms",
                f"{start_up(python, '-c', 'import lostmotion') - bare:.1f}",
            ),
            ("lostmotion --help", f"{start_up(command, '--help'):.0f}"),
            ("lostmotion reproduce", f"{reproduced:.0f}"),
        ],
    )
    print(report.text())
    (ROOT / "benchmarks" / "RESULTS.md").write_text(report.text())


class Report:
    """Text that reads well in the terminal and as Markdown."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, *lines: str) -> None:
        self.lines += lines

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        widths = [max(len(str(r[k])) for r in [header, *rows]) for k in range(len(header))]

        def line(cells: Sequence[str]) -> str:
            first, *rest = (str(c) for c in cells)
            return (
                "| "
                + " | ".join([first.ljust(widths[0]), *(c.rjust(w) for c, w in zip(rest, widths[1:], strict=True))])
                + " |"
            )

        self.add(
            line(header),
            "|" + "|".join(("-" * (w + 1) + ":") if k else "-" * (w + 2) for k, w in enumerate(widths)) + "|",
        )
        self.add(*(line(r) for r in rows))

    def text(self) -> str:
        return "\n".join(self.lines) + "\n"


def studies(scenario: lm.Scenario) -> list[tuple[str, ...]]:
    base = scenario.replace(**{"simulation.duration": 1.0})
    keep = {"peak": "peak(load_speed)", "rms": "rms(twist)"}
    command = [{"key": "command.amplitude", "uniform": [0.1, 1.0]}]
    drive = [{"key": "load.inertia", "uniform": [1.0, 3.0]}, {"key": "motor.friction_torque", "uniform": [0.01, 0.02]}]
    rows = []
    with tempfile.TemporaryDirectory() as directory:  # the first study of a process loads the libraries
        lm.study(lm.Study(scenario=base, design="random", runs=1, vary=command, keep=keep), Path(directory) / "s")
    for name, vary in (("the command", command), ("the command and the drive", command + drive)):
        for threads in sorted({1, os.cpu_count() or 1}):
            study = lm.Study(scenario=base, design="random", runs=4000, vary=vary, keep=keep)
            with tempfile.TemporaryDirectory() as directory:
                spent = best(1, lambda: lm.study(study, Path(directory) / "s", threads=threads))  # noqa: B023
            rate = 4000 / (1e-3 * spent)
            rows.append((name, str(threads), f"{rate:.0f}", f"{rate / threads:.0f}"))
    return rows


if __name__ == "__main__":
    main()
