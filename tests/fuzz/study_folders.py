"""Folders of studies, damaged: refused with the file's name, or with the rows that they had."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path
from random import Random
from tempfile import mkdtemp
from typing import Any

import lostmotion as lm
from fuzz import mutation
from fuzz.verdict import Failure, refused
from lostmotion.studies.runs.read_table import read_table
from lostmotion.studies.runs.run_study import study_of

RUNS = 1203  # three parts


@cache
def whole(seed: int = 1) -> tuple[Path, Any]:
    """The folder of a study, and its rows."""
    text = f"""
base = "paper-2dof-nl-small"
design = "random"
runs = {RUNS}
seed = {seed}
set = {{ "simulation.duration" = 0.01, "simulation.sample_interval" = 0.005 }}
[[vary]]
key = "load.inertia"
uniform = [1.5, 2.5]
[keep]
peak_load_speed = "peak(load_speed)"
"""
    folder = Path(mkdtemp(prefix="fuzz-study-"))
    (folder / "study.toml").write_text(text)
    lm.study(lm.studies.load_study(folder / "study.toml"), folder / "study", threads=1)
    return folder / "study", read_table(folder / "study")


def damage(random: Random, folder: Path) -> None:
    """Changes, removes, adds or exchanges files."""
    paths = sorted(path for path in folder.iterdir() if path.is_file() and not path.is_symlink())
    path, other = random.choice(paths), random.choice([p for k in (1, 2) for p in sorted(whole(k)[0].iterdir())])
    match random.randrange(8):
        case 0:
            path.unlink()
        case 1 | 2 | 3:
            path.write_bytes(mutation.content(random, path.read_bytes(), other.read_bytes()))
        case 4:
            path.write_bytes(other.read_bytes())
        case 5:
            path.unlink()
            path.mkdir()
        case 6:
            path.unlink()
            path.symlink_to(random.choice(("nowhere", path.name, "/dev/zero", "..")))
        case 7:
            stray = folder / f"part-{random.choice((0, 1, 2, 3, 999999)):06d}.parquet"
            if not stray.is_dir() and not stray.is_symlink():
                shutil.copy(other, stray)


def case(random: Random, folder: Path) -> None:
    """Reading, resuming and repairing give the rows of the study, or name what is damaged."""
    original, rows = whole()
    shutil.copytree(original, folder / "study")
    for _ in range(random.randint(1, 2)):
        damage(random, folder / "study")
    names = ["study"]
    for repair in random.choice(((False,), (True,), (False, True))):
        table = refused(lambda: read_table(Path("study")), names)
        if table is not None and not rows.equals(table) and not _is_part(table, rows):
            raise Failure(f"read_table gives {table.num_rows} other rows")
        resumed = refused(lambda: _resume(repair), names)  # noqa: B023
        if resumed is not None and not rows.equals(resumed):
            raise Failure(f"resuming with repair = {repair} gives {resumed.num_rows} other rows")


def _resume(repair: bool) -> Any:
    from lostmotion.studies.runs.run_study import restore_note

    if repair:
        restore_note(Path("study"))
    return read_table(lm.study(study_of("study"), "study", threads=1, repair=repair))


def _is_part(table: Any, rows: Any) -> bool:
    """Whether all its rows are there, as of a study that is not complete."""
    return bool(table.num_rows < rows.num_rows and {*map(str, table.to_pylist())} <= {*map(str, rows.to_pylist())})
