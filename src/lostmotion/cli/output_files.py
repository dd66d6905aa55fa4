"""Files and directories that commands write to: tried before the work, and what goes wrong as one line."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..atomic_writer import unwritable
from ..errors import InputError
from ..inputs.toml_files import in_short


def try_file(path: Path) -> None:
    """See, before the work, that a file can be written; nothing is left behind."""
    if os.path.isdir(path):
        raise InputError(f"{path}: is a directory; name a file")
    if os.path.exists(path) and not os.path.isfile(path):  # a device
        return
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise unwritable(path, error) from None


def try_page(path: Path) -> None:
    """Test whether the page of a report can be written, as `try_file` does."""
    if path.suffix not in (".html", ".htm"):
        raise InputError(f"{path}: a report is a page; its name must end in .html")
    try_file(path)


def try_directory(path: Path) -> None:
    """See, before the work, that files can be written into a directory, made if missing; nothing is left behind."""
    if os.path.lexists(path) and not os.path.isdir(path):
        raise InputError(f"{path}: is a file; -o names a directory")
    made: list[Path] = []
    try:
        for directory in reversed([p for p in (path, *path.parents) if not os.path.exists(p)]):
            directory.mkdir()
            made.append(directory)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise InputError(f"{in_short(path)}: cannot be written: {error.strerror}") from None
    finally:
        for directory in reversed(made):
            directory.rmdir()


@contextmanager
def writing(directory: Path, then: str = "") -> Iterator[None]:
    """Turn errors of a directory that is written to into one line."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{directory}: cannot be written: {error.strerror}{then}") from None


def pictures_of(figures: str | None, output: Path | None) -> tuple[str, ...]:
    """Endings of the pictures that are asked for beside a report, whose directory is tried."""
    from ..reports.pictures import endings

    pictures = endings(figures)
    if figures is not None and output is None:
        raise InputError(f"--figures {figures}: needs the directory of the report; add -o DIR")
    if output is not None:
        try_directory(output)
    return pictures
