"""Reading TOML files: every way in which one cannot be read ends in one clear line."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any

from ..errors import InputError

RESULTS = (".nc", ".csv", ".parquet")  # endings of saved results


def no_such_file(path: Path) -> InputError:
    """Says that there is no such file, and what may have been meant."""
    near = difflib.get_close_matches(path.name, [p.name for p in path.parent.glob("*.toml")], n=1)
    hint = f"; did you mean {path.parent / near[0]}?" if near else "; check the name"
    return InputError(f"{path}: there is no such file{hint}")


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The contents of a TOML file that is meant to hold `what`.

    Raises
    ------
    InputError
        It cannot be read; the message says why, and what may have been meant.
    """
    if path.suffix in RESULTS and path.is_file():
        raise InputError(f"{path}: has the ending of a saved result; {what} is a TOML file (.toml)")
    try:
        text = path.read_text(encoding="utf-8")
    except IsADirectoryError:
        raise InputError(f"{path}: is a directory; name a file of {what} (.toml)") from None
    except FileNotFoundError:
        raise no_such_file(path) from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); {what} is a TOML file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None
