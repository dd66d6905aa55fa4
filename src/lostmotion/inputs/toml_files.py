"""Reading TOML files: every way in which one cannot be read ends in one clear line."""

import difflib
import os
import re
import tomllib
from pathlib import Path
from typing import Any

from ..errors import InputError
from .implausible_values import doubt_all
from .memory_limits import read_text

PER_BYTE = 16  # bytes of memory for each byte of a TOML file, measured
RESULTS = (".nc", ".csv", ".parquet")  # endings of saved results
MAX_LEVELS = 50  # of tables and lists within each other
MAX_NAME = 200  # characters of the name of a file that is shown
# A dotted key of more parts than there may be levels, at the beginning of a line, a table or an entry. The parser
# takes a time that grows with the square of their number.
_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(
    rf"""(?:^[ \t]*+\[?+\[?+|[{{,])[ \t]*+(?:{_PART}[ \t]*+\.[ \t]*+){{{MAX_LEVELS}}}""", re.MULTILINE
)


def is_in_file(reference: str) -> bool:
    """Whether a reference is to a record in a file: ``sheets.toml``, or ``sheets.toml#name`` for one of several."""
    return reference.partition("#")[0].endswith(".toml")


def no_such_file(path: Path) -> InputError:
    """Says that there is no such file, and what may have been meant."""
    try:
        beside = [p.name for p in path.parent.glob("*.toml")]
    except (OSError, ValueError):  # of a name that is too long, or with a zero in it
        beside = []
    near = difflib.get_close_matches(path.name, beside, n=1)
    hint = f"; did you mean {path.parent / near[0]}?" if near else "; check the name"
    return InputError(f"{in_short(path)}: there is no such file{hint}")


def in_short(path: Path) -> str:
    """The name of a file; of one that is too long for a message, its ends."""
    name = str(path)
    return name if len(name) <= MAX_NAME else f"{name[: MAX_NAME // 2]}...{name[-MAX_NAME // 2 :]}"


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The contents of a TOML file that is meant to hold `what`."""
    if path.suffix in RESULTS and os.path.isfile(path):
        raise InputError(f"{path}: has the ending of a saved result; {what} is a TOML file (.toml)")
    try:
        text = read_text(path, per_byte=PER_BYTE)
    except InputError:
        raise
    except IsADirectoryError:
        raise InputError(f"{path}: is a directory; name a file of {what} (.toml)") from None
    except FileNotFoundError:
        raise no_such_file(path) from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); {what} is a TOML file") from None
    except OSError as error:
        raise InputError(f"{in_short(path)}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise InputError(f"{in_short(path)}: is no name of a file; check it") from None
    try:
        if _DEEP_KEY.search(text):
            raise RecursionError
        data = shallow(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None
    except RecursionError:
        raise InputError(
            f"{path}: has more than {MAX_LEVELS} levels of tables and lists; write {what} with fewer"
        ) from None
    doubt_all(data, path)
    return data


def shallow(data: dict[str, Any]) -> dict[str, Any]:
    """Tables that can be walked by functions that call themselves. Raises RecursionError: they have too many levels."""
    level: list[Any] = [data]
    for _ in range(MAX_LEVELS):
        values = (value for entry in level for value in (entry.values() if isinstance(entry, dict) else entry))
        level = [value for value in values if isinstance(value, dict | list)]
        if not level:
            return data
    raise RecursionError
