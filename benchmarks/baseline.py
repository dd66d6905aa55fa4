"""The paper's run before and after: against an earlier commit, compiled with the same flags.

`python baseline.py DIRECTORY` takes its sources out of the history, if that is there.
"""

from __future__ import annotations

import io
import resource
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
from report import VECTORS, Report

ROOT = Path(__file__).parent.parent
BASELINE = "5ee048b344242e235b51a682e13ccc10f50884b1"  # the last whose core was made of headers alone
PAIRS, RUNS = 250, 250
ROUNDS = 3


def take(directory: Path) -> None:
    shutil.rmtree(directory, ignore_errors=True)
    archive = subprocess.run(
        ["git", "-C", str(ROOT), "archive", BASELINE, "core", "benchmarks"], capture_output=True, check=False
    )
    if archive.returncode != 0:
        print(f"without the run of commit {BASELINE[:7]}: the history of this copy does not go back to it")
        return
    with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as sources:
        sources.extractall(directory, filter="data")


def user_time(program: Path) -> float:
    """Of one run [ms]."""
    begin = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([program, str(RUNS)], check=True)
    return 1e3 * (resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin) / RUNS


def pairs(before: Path, after: Path, count: int = PAIRS) -> tuple[np.ndarray, np.ndarray]:
    """User times of one run [ms], measured in turns: before, after, after, before."""
    both = np.array([[user_time(program) for program in (before, after, after, before)] for _ in range(count)])
    return 0.5 * (both[:, 0] + both[:, 3]), 0.5 * (both[:, 1] + both[:, 2])


def section(report: Report, build: Path, builds: list[str]) -> None:
    report.section(
        "Before and after",
        f"The run of the first table, same drive again, load speed and twist sampled, by commit {BASELINE[:7]} and by this one with the\n"
        f"same flags. User time of {2 * RUNS} runs each, {PAIRS} times in turns: medians, and the quartiles of the ratio.",
    )
    there = [name for name in builds if (build / f"baseline_{name}").exists()]
    if not there:
        report.add("Not measured: the history of this copy does not go back to that commit.")
        return
    rows = []
    for name in there:
        before, after = pairs(build / f"baseline_{name}", build / f"bench_run_{name}")
        low, median, high = np.quantile(after / before, (0.25, 0.5, 0.75))
        rows.append(
            (
                f"build{VECTORS.get(name, ' for any processor')}",
                *(f"{np.median(times):.4f}" for times in (before, after)),
                f"{median:.3f}",
                f"{low:.3f} to {high:.3f}",
            )
        )
    report.table(("", "before [ms]", "after [ms]", "ratio", "quartiles"), rows)
    name = there[0]
    before, after = (_trains(build / f"{program}_{name}") for program in ("baseline_trains", "bench_trains"))
    report.add("", f"Trains, the best of {ROUNDS} rounds in turns: the same train again, and a new one.")
    report.table(
        ("", "again, before [ms]", "after [ms]", "ratio", "new, before [ms]", "after [ms]", "ratio"),
        [
            (
                case,
                *(
                    cell
                    for a, b in zip(before[case], after[case], strict=True)
                    for cell in (f"{a:.4f}", f"{b:.4f}", f"{b / a:.3f}")
                ),
            )
            for case in before
            if case in after
        ],
    )


def _trains(program: Path) -> dict[str, tuple[float, float]]:
    """Times of the trains of benchmarks/bench_trains.cpp [ms]: the same train again, and a new one."""
    best: dict[str, tuple[float, float]] = {}
    for _ in range(ROUNDS):
        for line in subprocess.run([program], check=True, capture_output=True, text=True).stdout.splitlines():
            case, *_, again, new = line.split("|")
            known = best.get(case, (np.inf, np.inf))
            best[case] = (min(known[0], float(again)), min(known[1], float(new)))
    return best


if __name__ == "__main__":
    take(Path(sys.argv[1]))
