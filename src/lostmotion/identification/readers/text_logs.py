"""Logs in text: columns separated by commas, semicolons, tabs or spaces, with decimal points or decimal commas."""

import csv
import itertools
import re
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...inputs.memory_limits import check_memory
from .irregular_tables import odd_table_log
from .log import Log, reason
from .log_tables import TableRow, UnreadError, plain_number, split_at_spaces, table_log

PER_CELL = 11  # bytes of memory for a value while the table grows, measured
WITH_COMMA = re.compile(r"\s*[+-]?\d+(,\d+)?([eE][+-]?\d+)?\s*")
LAST_CELL = re.compile(r".*[;\t ,](?=[^;\t ])")  # all before the last cell of a line
COMPARED = 10  # lines before the last one
THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2}(,\d{3})+\s*")


@dataclass
class Reading:
    """One way to read a text: what separates its cells, and what its decimals."""

    separator: str
    decimal: str
    first: tuple[int, str] = (0, "")  # line and cell with the first decimal comma
    sure: bool = False  # whether a comma separates decimals for certain, since it cannot be one between thousands
    line: int = 0

    def cells(self, line: str) -> list[str]:
        """Cells of a line."""
        if self.separator == " ":
            return split_at_spaces(line)
        return next(csv.reader([line], delimiter=self.separator, skipinitialspace=True))

    def number(self, cell: Any) -> float | None:
        """Number in a cell; None if the cell has no number."""
        if self.decimal == "." or "," not in cell:
            return plain_number(cell) if self.decimal == "." or "." not in cell else None
        if not WITH_COMMA.fullmatch(cell):
            return None
        if not self.sure:
            self.first = self.first if self.first[0] else (self.line, cell.strip())
            self.sure = not THOUSANDS.fullmatch(cell)
        return float(cell.replace(",", "."))


def read_text_log(path: Path, time: str, decimal: str) -> Log:
    """Read a table with one heading: ``time [s], position [deg]``, with ``# key: value`` or ``# key = value`` above it as the header.

    A comment ``# unit position: deg``, or a line of units below the heading, gives the unit of a column. A number in brackets,
    as in ``load (5)``, is a part of the name. Without a heading the columns are ``column 1``, ``column 2`` and so on. Times are
    numbers, or time stamps of ISO 8601.

    time: name of the column of the time; left out, ``time``, ``t``, ``timestamp``, or the first column.
    decimal: what separates decimals. Left out, a comma is taken only where nothing else makes a table of the text, and
        is noted.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"is not UTF-8 text (byte {error.start}); save it as CSV in UTF-8") from None
    text, cut = _without_cut_number(text)
    cells = max(map(text.count, ",;\t ")) + text.count("\n") + 1
    check_memory(2 * sys.getsizeof(text) + PER_CELL * cells)
    problems: list[UnreadError] = []
    ways = [
        Reading(separator, sign) for sign, separator in itertools.product(decimal or ".,", ";\t, ") if sign != separator
    ]
    for reading in ways:
        comments: list[str] = []
        try:
            log = table_log(_rows(text, comments, reading), reading.number, comments, time)
        except UnreadError as problem:
            problems.append(problem)
            continue
        log = log if decimal else _announced(log, reading)
        return replace(log, notes=(*log.notes, *cut))
    found: list[tuple[int, Log, Reading]] = []
    for reading in ways:
        comments = []
        with suppress(UnreadError):
            rows = list(_rows(text, comments, reading))
            lost, log = odd_table_log(rows, reading.number, comments, time)
            cell = reading.first[1]
            if cell:
                reading.first = next((n, cell) for n, cells in rows if cell in (c.strip() for c in cells))
            found.append((lost, log, reading))
    if found:
        _, log, reading = min(found, key=lambda way: way[0])
        log = log if decimal else _announced(log, reading)
        return replace(log, notes=(*log.notes, *cut))
    worst = max(problems, key=lambda problem: problem.row)
    raise InputError(f"{f'line {worst.row}: ' if worst.row else ''}{worst}")


def _without_cut_number(text: str) -> tuple[str, tuple[str, ...]]:
    """The text without a last line that has no end and a shorter last number than all lines before, and a note on it.

    A file that was cut off within a number has another number there, which nothing else shows.
    """
    begin = len(text)
    for _ in range(COMPARED + 1):  # the rest of a long text is not copied
        begin = text.rfind("\n", 0, max(begin, 0))
    *lines, last = text[begin + 1 :].split("\n")
    ends = [len(LAST_CELL.sub("", line)) for line in lines]
    if len(ends) < COMPARED or not last or len(LAST_CELL.sub("", last)) >= min(ends):
        return text, ()
    line = text.count("\n") + 1
    return text[: -len(last)], (
        f"line {line} has no end and is left out: {last[-40:]!r} may be cut off within its last number",
    )


def _announced(log: Log, reading: Reading) -> Log:
    """A log with a note on its decimal commas, if they can be nothing else."""
    line, cell = reading.first
    if not line:
        return log
    if not reading.sure:
        raise InputError(
            f"line {line}: {cell!r} may have a decimal comma, or one between thousands; "
            'give logs.decimal = ",", or write it without commas between thousands'
        )
    note = f'its commas are read as decimal commas, such as {cell!r} in line {line}; logs.decimal = "," says so'
    return replace(log, notes=(note, *log.notes))


def _rows(text: str, comments: list[str], reading: Reading) -> Iterator[TableRow]:
    for number, line in _lines(text, comments):
        reading.line = number
        try:
            cells = reading.cells(line)
        except csv.Error as error:
            raise UnreadError(number, f"cannot be read ({reason(error)}); the file may be damaged") from None
        yield number, cells


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
