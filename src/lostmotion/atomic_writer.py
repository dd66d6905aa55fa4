"""Files written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from .errors import InputError


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Write a file under another name and move it into place, so that no half-written file bears the final name.

    Raises InputError: the file cannot be written there; nothing is left behind.
    """
    temporary: Path | None = None
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a directory; name a file")
        if path.exists() and not path.is_file():  # a device takes no move
            write(path)
            return
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        write(temporary)
        mode = 0o666 & ~_umask()
        temporary.chmod(mode)
        temporary.replace(path)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def unwritable(path: Path, error: OSError) -> InputError:
    """Why a file cannot be written."""
    if not isinstance(error, FileNotFoundError):
        return InputError(f"{path}: cannot be written: {error.strerror or error}")
    if path.parent.is_dir():  # of a file system that makes its files itself
        return InputError(f"{path}: cannot be written: its directory takes no new files; name another one")
    return InputError(f"{path}: its directory does not exist; make it first")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole or not at all."""

    def write(target: Path) -> None:
        target.write_bytes(content)

    write_whole(path, write)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
