"""Hand-written lines by area, beside their budget: `make lint` prints them. A commit that goes beyond one says why."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parent.parent
AREAS = {
    "Python of the package": ("src/*.py", 52_000),
    "core": ("core/lostmotion/* core/kernels/*", 32_000),
    "bindings": ("bindings/*", 6_500),
    "tests in Python": ("tests/*.py", 34_000),
    "tests of the core": ("core/tests/*", 10_500),
    "live page": ("page/src/* page/tests/*", 5_000),
    "documentation": ("docs/*.md docs/*.py :!docs/reference", 8_500),
    "benchmarks": ("benchmarks/*.py benchmarks/*.?pp", 4_500),
}
"""patterns of git, and the budget"""


def lines_of(patterns: str) -> int:
    listed = subprocess.run(
        ["git", "ls-files", *patterns.split()], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return sum((ROOT / name).read_bytes().count(b"\n") for name in listed.stdout.splitlines())


if __name__ == "__main__":
    for area, (patterns, budget) in AREAS.items():
        lines = lines_of(patterns)
        print(f"{area:<22} {lines:>7,} lines, budget {budget:>7,}{' (above)' if lines > budget else ''}")
