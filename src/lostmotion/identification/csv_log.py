"""CSV logs with units in the names of their columns, in a line below them, or in comments above them."""

from __future__ import annotations

import csv
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.validation import did_you_mean
from .logs import Channel, Log
from .prepare import is_unit

NAME = re.compile(r"^\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")
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
    comments, lines = [], []
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith(("#", "%")):
            comments.append(line.lstrip(" #%"))
        elif line.strip():
            lines.append((number, line))
    if len(lines) < 3:
        raise InputError(
            f"{path}: has {max(0, len(lines) - 1)} rows of values; a log needs a heading and two rows at least"
        )
    separator = max(",;\t", key=lines[0][1].count)
    rows = [_cells(path, number, line, separator) for number, line in lines]
    heading = [cell.strip() for cell in rows[0]]
    if all(_number(cell) is not None for cell in heading):
        raise InputError(
            f"{path}, line {lines[0][0]}: has no heading; name the columns, such as time [s],position [rad]"
        )
    header, units = _header(comments)
    columns = _columns(heading)
    names = [name for name, _ in columns]
    units |= {name: unit for name, unit in columns if unit is not None}
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{path}, line {lines[0][0]}: has the column {twice[0]!r} twice; rename one of them")
    table = _table(path, names, rows[1:], [number for number, _ in lines[1:]])
    place = _time_column(path, names, time)
    values = table[:, place] * _seconds(path, units.get(names[place], ""))
    channels = {name: Channel(table[:, k], units.get(name, "")) for k, name in enumerate(names) if k != place and name}
    return Log(path.name, values, channels, header)


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
        raise InputError(f"{path}, line {number}: cannot be read ({error}); the file may be damaged") from None


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


def _table(path: Path, names: list[str], rows: list[list[str]], numbers: list[int]) -> np.ndarray:
    out = np.full((len(rows), len(names)), np.nan)
    for k, (row, number) in enumerate(zip(rows, numbers, strict=True)):
        if len(row) != len(names):
            raise InputError(
                f"{path}, line {number}: has {len(row)} values for {len(names)} columns; the file may be cut off"
            )
        for j, cell in enumerate(row):
            value = _number(cell)
            if value is None and cell.strip():
                remedy = "; write decimal points" if _number(cell.replace(",", ".")) is not None else ""
                raise InputError(
                    f"{path}, line {number}: {cell.strip()[:40]!r} in column {names[j]} is no number{remedy}"
                )
            if value is not None:
                out[k, j] = value
    return out


def _number(cell: str) -> float | None:
    text = cell.strip()
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    with suppress(ValueError):
        return float(text)
    return None
