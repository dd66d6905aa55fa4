"""Tables of rows and columns, of text files and spreadsheets: headings, units, the column of the time, the log that they make."""

import itertools
import math
import re
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

import numpy as np

from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, shortened
from .channel_units import is_unit
from .log import Channel, Log

NAME = re.compile(r"^\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")
COMMENT = re.compile(r"^\s*(?P<key>[\w .-]+?)\s*[:=]\s*(?P<value>.+?)\s*$")
STAMP = re.compile(
    r"\s*(\d{4}-?\d\d-?\d\d[T ]\d\d:?\d\d(?::?\d\d)?)(?:[.,](\d+))?\s*(Z|[+-]\d\d(?::?\d\d)?)?\s*", re.IGNORECASE
)
EPOCH = datetime(1970, 1, 1)
TIME_NAMES = ("time", "t", "timestamp", "times", "tm")
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}

TableRow = tuple[int, Sequence[Any]]  # its number in the file, its cells


class UnreadError(Exception):
    """A table cannot be read: in which row of the file, and why."""

    def __init__(self, row: int, text: str) -> None:
        super().__init__(text)
        self.row = row


class Stamps:
    """Time stamps of ISO 8601 as seconds from the first of them, to the nanosecond."""

    def __init__(self) -> None:
        self.count = 0
        self._first = 0
        self.zoned = False

    def seconds(self, cell: Any) -> float | None:
        """Time of a stamp [s]; None where the cell is no stamp."""
        found = _nanoseconds(cell)
        if found is None:
            return None
        at, zoned = found
        if self.count == 0:
            self._first, self.zoned = at, zoned
        if zoned != self.zoned:
            raise ValueError("some time stamps have a zone and others have none; write all with their zone")
        self.count += 1
        return 1e-9 * (at - self._first)


def _nanoseconds(cell: Any) -> tuple[int, bool] | None:
    """(time since 1970 [ns], whether it has a zone) of a time stamp."""
    if isinstance(cell, datetime):
        moment, fraction = cell.replace(microsecond=0), 1000 * cell.microsecond
    else:
        match = STAMP.fullmatch(cell) if isinstance(cell, str) else None
        if match is None:
            return None
        try:
            moment = datetime.fromisoformat(match[1].upper() + (match[3] or "").upper())
        except ValueError:
            return None
        fraction = int((match[2] or "")[:9].ljust(9, "0"))
    zoned = moment.tzinfo is not None
    try:
        since = (moment.astimezone(UTC).replace(tzinfo=None) if zoned else moment) - EPOCH
    except OverflowError:
        return None
    return (86_400 * since.days + since.seconds) * 10**9 + fraction, zoned


def table_log(rows: Iterator[TableRow], number: Callable[[Any], float | None], comments: list[str], time: str) -> Log:
    """The log that a table is.

    rows: those with something in them; a heading first, unless the first row is numbers, and a row of units below it.
    number: value of a cell; None of a cell that is not a number.
    comments: those read so far; ``key: value``, ``key = value`` and ``unit COLUMN: deg`` are the header. More may be
        added with the rows.
    time: name of the column of the time; left out, ``time``, ``t``, ``timestamp``, or the first column.
    """
    first, cells = next(rows, (1, ()))
    above = comments[-1] if comments else ""
    columns, notes, ahead = _columns(first, cells, number, above, rows)
    names = [name for name, _ in columns]
    if len(names) < 2:
        raise UnreadError(0, "has one column; a log needs the time and one channel at least")
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise UnreadError(first, f"has the column {min(twice)!r} twice; rename one of them")
    place = _time_column(first, names, time)
    stamps = Stamps()
    table = _numbers(names, place, stamps, number, itertools.chain(ahead, rows))
    if len(table) < 2:
        raise InputError(f"has {len(table)} rows of values; a log needs two rows at least")
    header, units = _header(comments, number)
    units |= {name: unit for name, unit in columns if unit is not None}
    values = table[:, place]
    if stamps.count:
        if stamps.count < np.sum(np.isfinite(values)):
            raise InputError(f"column {shortened(names[place])} has time stamps and numbers; write all alike")
        if not stamps.zoned:
            notes.append("its time stamps have no zone; they are taken to be of one clock that is not set meanwhile")
    else:
        values = values * seconds_of(units.get(names[place], ""))
    # A column with neither name nor values is behind a separator at the end of each line.
    blank = [name.startswith("column ") and bool(np.isnan(x).all()) for name, x in zip(names, table.T, strict=True)]
    kept = [k for k in range(len(names)) if k != place and not blank[k]]
    found = {names[k]: Channel(table[:, k], units.get(names[k], "")) for k in kept}
    return Log("", values, found, header, tuple(notes))


Columns = list[tuple[str, str | None]]


def _columns(
    first: int, cells: Sequence[Any], number: Callable[[Any], float | None], above: str, rows: Iterator[TableRow]
) -> tuple[Columns, list[str], list[TableRow]]:
    """((name, unit) of each column, notes, rows of values that have been read already)."""
    blank = [cell is None or not str(cell).strip() for cell in cells]
    if all(blank) or not all(b or _is_value(cell, number) for cell, b in zip(cells, blank, strict=True)):
        columns = named_columns([str(cell if cell is not None else "").strip() for cell in cells])
        below = next(rows, None)
        units = units_below(below, len(columns), number) if below is not None else None
        if units is not None:
            return (
                [(name, unit if own is None else own) for (name, own), unit in zip(columns, units, strict=True)],
                [],
                [],
            )
        return columns, [], [below] if below is not None else []
    if (names := _heading_above(above, len(cells))) is not None:
        note = f"its heading is the comment above the values: {', '.join(name for name, _ in names)}"
        return names, [note], [(first, cells)]
    names = [(f"column {k + 1}", None) for k in range(len(cells))]
    return names, ["has no heading; its columns are named column 1, column 2 and so on"], [(first, cells)]


def _is_value(cell: Any, number: Callable[[Any], float | None]) -> bool:
    return number(cell) is not None or _nanoseconds(cell) is not None


def units_below(row: TableRow, count: int, number: Callable[[Any], float | None]) -> list[str | None] | None:
    """Units in the row below a heading; None where it is no such row."""
    texts = [str(cell if cell is not None else "").strip() for cell in row[1]]
    if len(texts) != count or not any(texts) or any(_is_value(text, number) for text in texts):
        return None
    plain = [text[1:-1] if text[:1] + text[-1:] in ("[]", "()") else text for text in texts]
    return [text or None for text in plain] if all(map(is_unit, plain)) else None


def _heading_above(comment: str, count: int) -> Columns | None:
    """Names in the comment above the values, as numpy.savetxt writes them: one of them is the time, or has a unit."""
    if ":" in comment or "=" in comment:
        return None
    for cells in (*(comment.split(sign) for sign in ";\t,"), split_at_spaces(comment)):
        if len(cells) == count:
            columns = named_columns([cell.strip() for cell in cells])
            if any(unit is not None or name.lower() in TIME_NAMES for name, unit in columns):
                return columns
    return None


SPACED = re.compile(
    r'"[^"]{0,200}"|\d{4}-\d\d-\d\d \d\d:\d\d\S*|[^\s\[(]+(?:\s{0,9}[\[(][^\])]{0,99}[\])])?|\S+'
)  # repetitions are bounded, so that no line takes longer than its length


def split_at_spaces(line: str) -> list[str]:
    """Cells between blanks; a unit in brackets belongs to the name before it, a time to the date before it."""
    return [cell.strip('"') for cell in SPACED.findall(line)]


def named_columns(heading: list[str]) -> Columns:
    """(name, unit) of each column; one without a name is called by its number.

    A number in brackets counts columns, so it belongs to the name. So does a text that is no known unit, if columns would be
    alike without it.
    """
    matches = [NAME.match(cell) for cell in heading]
    names = [match["name"] if match else cell for match, cell in zip(matches, heading, strict=True)]
    found: Columns = []
    for k, (cell, name, match) in enumerate(zip(heading, names, matches, strict=True)):
        alone = names.count(name) == 1
        if match is None:
            found.append((cell or f"column {k + 1}", None))
        elif match["unit"] == "1" and alone and "[" in cell:  # dimensionless
            found.append((name or f"column {k + 1}", "1"))
        elif plain_number(match["unit"]) is not None or not (alone or is_unit(match["unit"])):
            found.append((cell, None))
        else:
            found.append((name or f"column {k + 1}", match["unit"]))
    return found


def _time_column(row: int, names: list[str], wanted: str) -> int:
    if wanted:
        if wanted not in names:
            meant = did_you_mean(wanted, names, f"its columns are {', '.join(names)}")
            raise UnreadError(row, f"has no column {wanted}; {meant}")
        return names.index(wanted)
    lower = [name.lower() for name in names]
    return next((lower.index(name) for name in TIME_NAMES if name in lower), 0)


def seconds_of(unit: str) -> float:
    """Seconds of a unit of time."""
    if unit.strip() not in SECONDS:
        raise InputError(f"the unit {unit!r} of the time is none of {', '.join(filter(None, SECONDS))}")
    return SECONDS[unit.strip()]


def _header(comments: list[str], number: Callable[[Any], float | None]) -> tuple[dict[str, Any], dict[str, str]]:
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
            numeric = number(value)
            header[re.sub(r"\W+", "_", key.strip())] = value if numeric is None else numeric
    return header, units


def _numbers(
    names: list[str], place: int, stamps: Stamps, number: Callable[[Any], float | None], rows: Iterator[TableRow]
) -> np.ndarray:
    found = array("d")
    for row, cells in rows:
        if len(cells) != len(names):
            raise UnreadError(row, f"has {len(cells)} values for {len(names)} columns; the file may be cut off")
        for j, cell in enumerate(cells):
            value = number(cell)
            if value is None and j == place:
                try:
                    value = stamps.seconds(cell)
                except ValueError as problem:
                    raise UnreadError(row, str(problem)) from None
            if value is None and cell is not None and str(cell).strip():
                raise UnreadError(
                    row,
                    f"{str(cell).strip()[:40]!r} in column {shortened(names[j])} is not a number{remedy_for_cell(cell)}",
                )
            found.append(math.nan if value is None else value)
    return np.frombuffer(found).reshape(-1, max(1, len(names)))


def remedy_for_cell(cell: Any) -> str:
    """Remedy for a cell that is not a number."""
    if _nanoseconds(cell) is not None:
        return "; if it is the time, name the column with logs.time"
    if plain_number(str(cell).replace(",", "").replace(".", "")) is not None:
        return "; write all numbers with decimal points, and nothing between thousands"
    return ""


def plain_number(cell: Any) -> float | None:
    """Number in a text with a decimal point, or 1 and 0 for true and false; None of anything else."""
    text = str(cell).strip()
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    with suppress(ValueError):
        return float(text)
    return None
