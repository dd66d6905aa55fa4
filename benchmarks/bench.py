"""`make bench`: lostmotion and its peers in one run on one machine. Times are the best of several."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import batches
import build_times
import closed_loops
import commands
import costs
import gradients
import identification
import live
import one_run
import quotes
import robots
import studies
import tasks
import trains
from report import Report

import lostmotion as lm
from lostmotion import _instruction_set

ROOT = Path(__file__).parent.parent
PEERS = ("numpy", "scipy", "numba", "pathsim", "mujoco", "rumoca", "cma", "xarray", "pyarrow")


def outputs(build: Path) -> dict[str, list[list[str]]]:
    """What the C++ programs print, in all builds that this processor can run; costs in the one for the widest vectors."""
    builds = _instruction_set.builds()
    wanted = [
        *(f"bench_run_{name}" for name in builds),
        f"bench_costs_{builds[0]}",
        f"bench_trains_{builds[0]}",
        f"bench_control_{builds[0]}",
        "peer_cvode",
    ]
    wanted += [f"{p} size" for p in wanted if p.startswith(("bench_trains", "peer_cvode"))]
    return {
        p: [
            line.split("|")
            for line in subprocess.run(
                [build / p.split()[0], *p.split()[1:]], check=True, capture_output=True, text=True
            ).stdout.splitlines()
        ]
        for p in wanted
        if (build / p.split()[0]).exists()
    }


def main() -> None:
    build = Path(sys.argv[1])
    scenario = lm.load(ROOT / "scenarios" / "paper-2dof-nl-large.toml")
    programs = outputs(build)
    model = next(
        (x.split(":")[1].strip() for x in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in x), "?"
    )
    report = Report()
    report.add("# Benchmark", "", "Made by `make bench`, all in one run; times are the best of several.", "")
    report.add(
        f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}, Python {platform.python_version()},",
        f"lostmotion {version('lostmotion')}, {', '.join(f'{m} {version(m)}' for m in PEERS)}.",
    )
    one_run.section(report, scenario, programs)
    build_times.section(report)
    trains.section(report, programs)
    trains.sizes(report, programs)
    closed_loops.section(report, programs)
    gradients.section(report)
    robots.section(report)
    batches.section(report)
    identification.section(report)
    costs.section(report, scenario, build, programs)
    studies.section(report, scenario)
    tasks.section(report)
    commands.section(report)
    live.section(report)
    print(report.text())
    (ROOT / "benchmarks" / "RESULTS.md").write_text(report.text())
    quotes.write()


if __name__ == "__main__":
    main()
