"""Parts of the directory of a study: their names, their checksums, and what is wrong with them."""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path

from ...atomic_writer import unwritable, write_bytes
from ...errors import InputError
from ..study.random_designs import CHUNK
from ..study.study_definition import Study

CHECKSUMS = "_checksums.txt"  # as `sha256sum` writes and checks it; readers of Parquet directories pass it over

PAIRS = 40  # of a task in a part: they take a second each, and an interruption loses the runs of an unfinished part

STRAY = "is no part of this study"
FOREIGN = "belongs to another study"
FOLDER = "is a directory"
NO_REPAIR = (STRAY, FOLDER)  # what repairing leaves to the user


def parts(directory: Path, what: Study) -> dict[tuple[int, int], Path]:
    """File of each part, by its first run and the run after its last."""
    size = CHUNK if what.axis is None else PAIRS
    runs = ((first, min(first + size, what.total)) for first in range(0, what.total, size))
    return {one: directory / f"part-{number:06d}.parquet" for number, one in enumerate(runs)}


def write_part(part: Path, content: bytes) -> None:
    """Write a part whole or not at all. Its checksum comes first: a part without one would be made again."""
    try:
        with part.with_name(CHECKSUMS).open("a", encoding="ascii") as file:
            file.write(f"{hashlib.sha256(content).hexdigest()}  {part.name}\n")
    except OSError as error:
        raise unwritable(part.with_name(CHECKSUMS), error) from None
    write_bytes(part, content)


def checksums(directory: Path) -> dict[str, str]:
    """Checksums of parts by their names; lines that a kill or damage left unreadable are passed over."""
    path = directory / CHECKSUMS
    if not os.path.lexists(path):
        return {}
    if not path.is_file():
        raise InputError(f"{path}: is no file; remove it, and `lostmotion study resume {directory} --repair`")
    try:
        lines = path.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    return {words[1]: words[0] for line in lines if len(words := line.split()) == 2 and len(words[0]) == 64}


def forget_missing(directory: Path) -> None:
    """Rewrite the list of checksums, with the parts that are there alone."""
    kept = {name: sum_ for name, sum_ in checksums(directory).items() if (directory / name).is_file()}
    write_bytes(directory / CHECKSUMS, "".join(f"{kept[name]}  {name}\n" for name in sorted(kept)).encode())


def checksum_of(path: Path) -> str:
    """Checksum of a file as it is now."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def carried(metadata: Mapping[bytes, bytes] | None) -> str:
    """The study as JSON that a part carries; empty for other files."""
    return (metadata or {}).get(b"lostmotion_study", b"").decode()


def damages(directory: Path, what: Study, text: str) -> dict[Path, str]:
    """Parts that are damaged, or belong elsewhere, each with the reason.

    text: the study as JSON.
    """
    known = checksums(directory)
    runs = {part: one for one, part in parts(directory, what).items()}
    found = {}
    for path in sorted(directory.glob("part-*.parquet")):
        reason = _damage(path, *runs[path], text, known.get(path.name)) if path in runs else STRAY
        if reason:
            found[path] = reason
    return found


def _damage(path: Path, first: int, last: int, text: str, checksum: str | None) -> str:
    import pyarrow.parquet as pq

    if path.is_dir():
        return FOLDER
    if not path.is_file():
        return "is no file"
    if checksum is None:
        return f"has no line in {CHECKSUMS}"
    try:
        if checksum_of(path) != checksum:
            return "is damaged: its checksum differs"
        with pq.ParquetFile(path) as part:
            if carried(part.schema_arrow.metadata) != text:
                return FOREIGN
            if part.read(["run"])["run"].to_pylist() != list(range(first, last)):
                return f"does not hold the runs {first} to {last - 1}"
    except OSError as error:
        return f"cannot be read: {error.strerror or error}"
    except Exception:  # the library raises what its parts raise
        return "is no Parquet file of a study"
    return ""
