"""Command lines: commands and options of the application with all kinds of values."""

from __future__ import annotations

import contextlib
import io
import sys
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import typer.main

import lostmotion as lm
from fuzz import mutation, scenario_files
from fuzz.verdict import Failure, check_message, ends
from lostmotion.cli.entry import app, main

SECONDS = 4.0  # of processor time until the command is interrupted
EXCLUDED = ("reproduce", "live", "scheduler", "processes", "open", "libraries")  # take minutes, processes or compilers
OLD = b"an old file"
OUTPUTS = ("out.nc", "out.csv", "out.parquet", "out.png", "out.svg", "out.fmu", "out", "none/out.csv", ".", "drive.toml/x")
VALUES = {
    "SCENARIO": ("drive.toml", "drive.toml", "broken.toml", "position-axis", "paper-2dof-nl-small", "none.toml", "."),
    "OTHER": ("drive.toml", "broken.toml", "position-axis", "none"),
    "GEARBOX": ("schaeffler-rt1-h-20-100", "drive.toml", "broken.toml", "none"),
    "NAME": ("exact", "dormand-prince", "command", "load_speed", "load_torque", "motor", "none"),
    "LIST": ("0.1,1,10", "0.1..10:4", "1..0", "1,5", "0.1..1e9:100000000", "-1", "1 Hz,2 Hz"),
    "KEY=VALUE": ("load.inertia=3", "simulation.duration=0.1", "command.amplitude=1e9", "x=1", "=", "a.b.c=[", "gearbox=none"),
    "TIME": ("0.1", "1 s", "-1", "1e9", "3 m"),
    "DIR": ("out", "study", ".", "drive.toml", "none/none"),
    "STUDY.toml | show | resume": ("study.toml", "show", "resume", "drive.toml"),
    "TASK.toml": ("task.toml", "drive.toml", "study.toml"),
    "IDENTIFY.toml": ("identify.toml", "drive.toml"),
    "KIND": ("motor", "gearbox", "planetary", "none"),
    "MIN..MAX": ("1..100", "5", "9..1", "..", "1 N*m..3 N*m"),
    "N": ("1", "2", "0", "-1"),
    "2|3": ("2", "3", "4"),
}
STUDY = """
base = "drive.toml"
design = "random"
runs = 7
[[vary]]
key = "load.inertia"
uniform = [1.5, 2.5]
[keep]
peak = "peak(load_speed)"
"""


@cache
def commands() -> dict[tuple[str, ...], list[Any]]:
    """Arguments and options of each command."""
    found: dict[tuple[str, ...], list[Any]] = {}

    def walk(name: tuple[str, ...], command: Any) -> None:
        for inner, other in getattr(command, "commands", {}).items():
            walk((*name, inner), other)
        if name and not hasattr(command, "commands") and name[0] not in EXCLUDED:
            found[name] = [p for p in command.params if p.opts[-1].strip("-") not in EXCLUDED]

    walk((), typer.main.get_command(app))
    return found


def word(random: Random, parameter: Any) -> str:
    """A value of an argument or option."""
    known = VALUES.get(parameter.metavar or "", OUTPUTS if "-o" in parameter.opts or parameter.metavar == "FILE" else ())
    if known and random.random() < 0.85:
        return random.choice(known)
    made = random.choice((*mutation.TEXTS, *map(str, mutation.NUMBERS)))
    return mutation.misspelt(random, made)[:300].replace("\0", "")


def line(random: Random) -> list[str]:
    """Words of a command line."""
    name = random.choice(list(commands()))
    words = [*name]
    for parameter in commands()[name]:
        option = parameter.opts[0].startswith("-")
        if random.random() < (0.3 if option else 0.95):
            value = [] if getattr(parameter, "is_flag", False) else [word(random, parameter)]
            words += [random.choice(parameter.opts), *value] if option else value
    if random.random() < 0.1:
        words.insert(random.randrange(len(words) + 1), random.choice(("--", "-x", "--none", "", "--memory", "1 MB", "-h")))
    return words


def case(random: Random, folder: Path) -> None:
    """Exit code 0, 1, 2 or, of a verdict, 3; of a failure one line; files are whole, or as they were."""
    drive = random.choice(scenario_files.texts())
    (folder / "drive.toml").write_bytes(drive)
    (folder / "broken.toml").write_bytes(scenario_files.mutated(random))
    (folder / "study.toml").write_text(STUDY)
    (folder / "task.toml").write_bytes(mutation.content(random, STUDY.encode(), drive))
    (folder / "identify.toml").write_bytes(mutation.content(random, b'scenario = "drive.toml"\n' + drive, drive))
    old = [Path(name) for name in OUTPUTS[:6] if random.random() < 0.3]
    for path in old:
        path.write_bytes(OLD)
    words = line(random)
    (folder / "words.txt").write_text(repr(words))
    code, out, err = call(words)
    judged = "\nVerdict: " in out and not err
    if code not in (0, 1, 2, None) and not (code == 3 and judged):
        raise Failure(f"{words}: ends with {code}: {err}")
    if code and not judged and not (err and code == 2 and "Usage:" in err):
        check_message(err.removeprefix("lostmotion: "))
    for path in old:
        if code != 0 and not judged and path.read_bytes() != OLD:
            raise Failure(f"{words}: fails with {code} and changes {path}: {err}")
    if stray := [p.name for p in Path().iterdir() if p.name.startswith(".")]:
        raise Failure(f"{words}: leaves {stray[0]}")
    for name in OUTPUTS[:3]:
        if Path(name).exists() and Path(name).read_bytes() != OLD:
            lm.open_result(name)


def call(words: list[str]) -> tuple[int | None, str, str]:
    """Exit code, output and errors; the code is None where it was interrupted."""
    out, err = io.StringIO(), io.StringIO()
    before, sys.argv = sys.argv, ["lostmotion", *words]

    def run() -> int:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                main()
            except SystemExit as end:
                return end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        return 0

    try:
        return ends(run, SECONDS), out.getvalue(), err.getvalue()
    finally:
        sys.argv = before
