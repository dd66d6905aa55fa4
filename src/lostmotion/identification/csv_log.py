"""CSV logs with units in the names of their columns, in a line below them, or in comments above them."""

from __future__ import annotations

import csv
import itertools
import math
import re
import sys
from array import array
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.limits import check_memory
from ..inputs.validation import did_you_mean, shortened
from .logs import Channel, Log, reason
from .prepare import is_unit

NAME = re.compile(r"^\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")
PER_CELL = 11  # bytes of memory for a value while the table grows, measured
COMMENT = re.compile(r"^\s*(?P<key>[\w .-]+?)\s*[:=]\s*(?P<value>.+?)\s*$")


def read_csv_log(path: Path, *, time: str = "") -> Log:
    """Of a table with one heading: ``time [s], position [deg]``, with ``# key: value`` above it as the header.

    Separators are commas, semicolons or tabs. A comment ``# unit position: deg`` gives the unit of a column. A number in brackets,
    as in ``load (5)``, is a part of the name.

    Parameters
    ----------
    time
        Name of the column of the time; left out, ``time``, ``t``, ``timestamp``, or the first column.

    Raises
    ------
    InputError
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); save it as CSV in UTF-8") from None
    comments: list[str] = []
    lines = _lines(text, comments)
    first, heading_line = next(lines, (1, ""))
    separator = max(",;\t", key=heading_line.count)
    cells = text.count(separator) + text.count("\n") + 1
    check_memory(2 * sys.getsizeof(text) + PER_CELL * cells, str(path))
    heading = [cell.strip() for cell in _cells(path, first, heading_line, separator)]
    if heading and all(_number(cell) is not None for cell in heading):
        raise InputError(f"{path}, line {first}: has no heading; name the columns, such as time [s],position [rad]")
    columns = _columns(heading)
    names = [name for name, _ in columns]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(f"{path}, line {first}: has the column {min(twice)!r} twice; rename one of them")
    table = _table(path, names, lines, separator)
    if len(table) < 2:
        raise InputError(f"{path}: has {len(table)} rows of values; a log needs a heading and two rows at least")
    header, units = _header(comments)
    units |= {name: unit for name, unit in columns if unit is not None}
    place = _time_column(path, names, time)
    values = table[:, place] * _seconds(path, units.get(names[place], ""))
    channels = {name: Channel(table[:, k], units.get(name, "")) for k, name in enumerate(names) if k != place and name}
    return Log(path.name, values, channels, header)


def _lines(text: str, comments: list[str]) -> Iterator[tuple[int, str]]:
    """Lines with something in them and their numbers, one at a time; comments are put into the list."""
    begin = 0
    for number in itertools.count(1):
        end = text.find("\n", begin)
        line = text[begin:] if end < 0 else text[begin:end]
        if line.lstrip().startswith(("#", "%")):
            comments.append(line.lstrip(" #%"))
        elif line.strip():
            yield number, line
        if end < 0:
            return
        begin = end + 1


def _columns(heading: list[str]) -> list[tuple[str, str | None]]:
    """(name, unit) of each column.

    A number in brackets counts columns, so it belongs to the name. So does a text that is no known unit, if columns would be
    alike without it.
    """
    matches = [NAME.match(cell) for cell in heading]
    names = [match["name"] if match else cell for match, cell in zip(matches, heading, strict=True)]
    found: list[tuple[str, str | None]] = []
    for cell, name, match in zip(heading, names, matches, strict=True):
        alone = names.count(name) == 1
        if match is None:
            found.append((cell, None))
        elif match["unit"] == "1" and alone and "[" in cell:  # dimensionless
            found.append((name, "1"))
        elif _number(match["unit"]) is not None or not (alone or is_unit(match["unit"])):
            found.append((cell, None))
        else:
            found.append((name, match["unit"]))
    return found


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator))
    except csv.Error as error:
        raise InputError(f"{path}, line {number}: cannot be read ({reason(error)}); the file may be damaged") from None


def _seconds(path: Path, unit: str) -> float:
    known = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}
    if unit.strip() not in known:
        raise InputError(f"{path}: the unit {unit!r} of the time is none of {', '.join(filter(None, known))}")
    return known[unit.strip()]


def _header(comments: list[str]) -> tuple[dict[str, Any], dict[str, str]]:
    """Values by key, and units by column, of the comments above a table."""
    header: dict[str, Any] = {}
    units = {}
    for comment in comments:
        match = COMMENT.match(comment)
        if match is None:
            continue
        key, value = match["key"], match["value"]
        if key.startswith("unit "):
            units[key.removeprefix("unit ").strip()] = value
        else:
            number = _number(value)
            header[re.sub(r"\W+", "_", key.strip())] = value if number is None else number
    return header, units


def _time_column(path: Path, names: list[str], wanted: str) -> int:
    if wanted:
        if wanted not in names:
            meant = did_you_mean(wanted, names, f"its columns are {', '.join(names)}")
            raise InputError(f"{path}: has no column {wanted}; {meant}")
        return names.index(wanted)
    lower = [name.lower() for name in names]
    return next((lower.index(name) for name in ("time", "t", "timestamp", "times") if name in lower), 0)


def _table(path: Path, names: list[str], lines: Iterator[tuple[int, str]], separator: str) -> np.ndarray:
    found = array("d")
    for number, line in lines:
        row = _cells(path, number, line, separator)
        if len(row) != len(names):
            raise InputError(
                f"{path}, line {number}: has {len(row)} values for {len(names)} columns; the file may be cut off"
            )
        for j, cell in enumerate(row):
            value = _number(cell)
            if value is None and cell.strip():
                remedy = "; write decimal points" if _number(cell.replace(",", ".")) is not None else ""
                raise InputError(
                    f"{path}, line {number}: {cell.strip()[:40]!r} in column {shortened(names[j])} is no number{remedy}"
                )
            found.append(math.nan if value is None else value)
    return np.frombuffer(found).reshape(-1, max(1, len(names)))


def _number(cell: str) -> float | None:
    text = cell.strip()
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    with suppress(ValueError):
        return float(text)
    return None
