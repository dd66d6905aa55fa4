"""`lostmotion identify`."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from .arguments import FiguresOption, argument, flag, option
from .output_files import pictures_of, writing
from .terminal import busy, fail

if TYPE_CHECKING:
    from ..identification.result import IdentificationResult

NOTES = 10  # lines of them in the terminal
PROGRESS = "identify-progress.json"


def identify(
    file: Path = argument(
        "IDENTIFY.toml|new", "Identification file: logs, rig, parameters; `new`: a first one for logs.", default=...
    ),
    directory: Path | None = argument("[DIR]", "With `new`: the directory that holds the logs."),
    output: Path | None = option(
        "PATH",
        "Directory of the results, made if missing; else none is written. With `new` the file (DIR/identify.toml).",
        "-o",
        "--output",
    ),
    rig: str | None = option("RIG.toml", "With `new`: scenario whose variables are taken."),
    profiles: bool = flag("Also intervals by the profile of the likelihood (takes longer).", "--profiles"),
    all_logs: bool = flag("Draw all logs; else of many logs the worst, median and best.", "--all-logs"),
    figures: FiguresOption = None,
) -> None:
    """To get the parameters of a real drive from measured logs.

    \b
    lostmotion identify examples/cycloidal/baseline.toml -o identified
    lostmotion identify new servo/logs --rig servo.toml

    Prints values, intervals, unidentifiable parameters and dropped parts of logs. With -o, writes identified.toml (the rig with the identified values, a
    scenario), identified.html (one page), errors.csv (of each log), parameters.csv and, with the key record, gearbox.toml (a data
    sheet). An interrupted command with -o keeps its fitted models in identify-progress.json, and continues with the next one.

    Exit code 0: the model describes the logs, with or without a reservation. Exit code 1: it leaves more than half of the motion, or
    an error. Exit code 3: the logs determine none of the parameters.

    `new` looks at the logs in DIR and writes a first identification file: channels, units, sample times, and what is in doubt about
    them. Without --rig it also writes rig.toml, a template of the rig. A file that exists is never overwritten.
    """
    if str(file) == "new":
        _new(directory, rig, output)
        return
    for what, value in (("DIR", directory), ("--rig", rig)):
        if value is not None:
            raise typer.BadParameter(f"{what} goes with `identify new`")
    pictures = pictures_of(figures, output)
    from ..identification.identify import identify as run

    kept = None if output is None else output / PROGRESS
    if kept is not None and kept.is_file():
        print(f"Continuing with the models that {kept} keeps", file=sys.stderr)
    try:
        with busy("Identifying") as tell:

            def notify(rung: str, iteration: int, cost: float) -> None:
                tell(f"{rung}, iteration {iteration}, cost {cost:.5g}")

            result = run(file, profiles=profiles, progress=notify, resume=kept)
    except KeyboardInterrupt:
        if kept is None or not kept.is_file():
            raise
        fail(
            f"interrupted; {kept} keeps the models that were fitted, and the same command continues with the next", 130
        )
    _print_summary(result)
    sys.stdout.flush()
    if output is None:
        print(f"The scenario and all charts: lostmotion identify {file} -o identified")
        raise typer.Exit(result.verdict.exit_code)
    with writing(output), busy("Writing"):
        from ..reports.identification import write_identification

        page = write_identification(output, file.stem, result, pictures, all_logs=all_logs)
    print(f"Report written to {page}")
    print(f"Next: lostmotion run {output / 'identified.toml'} --plot run.png")
    raise typer.Exit(result.verdict.exit_code)


def _new(directory: Path | None, rig: str | None, output: Path | None) -> None:
    """Write a first identification file."""
    if directory is None:
        raise typer.BadParameter("`new` needs the directory of the logs, such as `lostmotion identify new logs`")
    from ..errors import InputError
    from ..identification.preparation.new_identification_file import first_task

    path = output or directory / "identify.toml"
    if os.path.lexists(path):
        raise InputError(f"{path}: exists; name another file with -o")
    with busy("Reading logs") as tell:
        text = first_task(directory, home=path.parent, rig=rig or "", progress=tell)
        template = path.parent / "rig.toml"
        if rig is None and not os.path.lexists(template):
            _write_template(template, "slide" if "slides.SLIDE." in text else "rig")
            text = first_task(directory, home=path.parent, rig=template, progress=tell)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists; name another file with -o") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    doubts = text.count("# Doubt: ")
    print(f"First identification file written to {path}; {doubts} of its lines begin with Doubt:")
    print(f"Next, once they are settled: lostmotion identify {path} -o identified")


def _write_template(path: Path, kind: str) -> None:
    """Write a rig whose values are to be filled in."""
    from importlib.resources import files

    from ..reports.written_files import write_text

    write_text(path, (files("lostmotion") / "identification" / f"{kind}-template.toml").read_text(encoding="utf-8"))
    print(f"Template of a rig written to {path}: put in what is known of yours")


def _print_summary(result: IdentificationResult) -> None:
    print(result.task.title or "Identification")
    print(result.verdict)
    print(*(f"  {text}" for text in result.warnings()), sep="\n", end="\n" if result.warnings() else "")
    name, factor = result.error_unit()
    unit = f" {name}".rstrip()
    for k, rung in enumerate(result.rungs):
        held_out = "" if math.isnan(rung.held_out) else f", held out {factor * rung.held_out:.4g}{unit}"
        fitted = f"mean absolute error {factor * rung.train:.4g}{unit}"
        print(f"  {'*' if k == result.chosen else ' '} {rung.name}: {fitted}{held_out}")
    print(*result.lines()[len(result.warnings()) :], sep="\n")
    if result.left_out:
        print(
            f"Left out, since they cannot be used, are {len(result.left_out)} of {len(result.left_out) + len(result.logs)} logs:"
        )
        _print_some([f"  {name}: {why.removeprefix(f'{name}: ')}" for name, why in result.left_out.items()])
    if result.notes:
        print("Notes on the logs:")
        _print_some([f"  {name}: {note}" for name, notes in result.notes.items() for note in notes])


def _print_some(lines: list[str]) -> None:
    print(*lines[:NOTES], sep="\n")
    if len(lines) > NOTES:
        print(f"  and {len(lines) - NOTES} more, all on the page")
