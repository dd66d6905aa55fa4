"""`make fuzz`: cases of all kinds by turns, for some minutes; or one case again."""

from __future__ import annotations

import argparse
import itertools
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzz.watchdog import Case, Process, failure_of, run

KINDS = ("scenario_files", "command_lines", "study_folders", "log_files", "fmu_calls", "random_trains")
KEPT = 3  # cases of one failure that are written to folders


def again(case: Case) -> int:
    """Runs one case in this process."""
    with TemporaryDirectory(prefix="fuzz-") as folder:
        text = failure_of(case, Path(folder))
    print(text or f"{case}: nothing fails")
    return bool(text)


def endless(kinds: list[str], seed: int, seconds: float) -> Iterator[Case]:
    """Cases of the kinds by turns."""
    begin = time.monotonic()
    for number in itertools.count():
        for kind in kinds:
            if time.monotonic() - begin > seconds:
                return
            yield Case(kind, seed, number)


def signature(case: Case, text: str) -> str:
    """The same for cases that fail alike."""
    frames = re.findall(r'File "[^"]*lostmotion/([^"]*)", line (\d+)', text)
    first = re.sub(r"\d+(\.\d+)?", "0", text.partition("\n")[0])[:60]
    return f"{case.kind}: {first} {':'.join(frames[-1]) if frames else ''}"


def report(case: Case, text: str, process: Process, out: Path) -> None:
    folder = out / str(case).replace(":", "-")
    process.keep(folder)
    repeat = f'make fuzz CASE="{case}"'
    (folder / "failure.txt").write_text(f"{repeat}\n\n{text}\n", errors="backslashreplace")
    print(f"{case}: {text.partition(chr(10))[0][:500]}\n  {folder}; again: {repeat}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"))
    parser.add_argument("--case", default="", help="KIND:SEED:NUMBER")
    given = parser.parse_args()
    if given.case:
        kind, seed, number = given.case.split(":")
        return again(Case(kind, int(seed), int(number)))
    done, failures = Counter[str](), Counter[str]()
    cases = endless(given.kinds.split(","), given.seed, 60.0 * given.minutes)
    for case, text, process in run(cases, given.processes):
        done[case.kind] += 1
        if text:
            kind = signature(case, text)
            failures[kind] += 1
            if failures[kind] <= KEPT:
                report(case, text, process, given.out)
    print(", ".join(f"{kind} {count}" for kind, count in done.items()))
    for kind, count in failures.most_common():
        print(f"{count:5d}  {kind}")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
