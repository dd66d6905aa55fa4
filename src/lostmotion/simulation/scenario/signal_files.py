"""Sampled signals from CSV files: two columns, time and value."""

import csv
import io
import re
from contextlib import suppress
from pathlib import Path

from ...errors import InputError
from ...inputs.memory_limits import read_text
from ...inputs.refusal_messages import shown
from ...units.conversion import to_si
from ...units.grammar import UnknownUnitError, plain, read_unit


def read_series(path: Path, unit: str) -> tuple[list[float], list[float]]:
    """Times [s] and values [`unit`] of a CSV file. A heading may name the units of the columns in brackets.

    Raises InputError: with one line that names the file, the line and the remedy.
    """
    try:
        lines = csv.reader(io.StringIO(read_text(path), newline=""))
        rows = [(lines.line_num, row) for row in lines if row and not row[0].startswith("#")]
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise InputError(f"{path}: is not a CSV file; it must hold two columns, time [s] and value") from None
    factors = [1.0, 1.0]
    if rows and not any(re.match(r"\s*[-+.,]?[0-9]", cell) for cell in rows[0][1]):
        number, heading = rows.pop(0)
        for k, (cell, si) in enumerate(zip(heading, ("s", unit), strict=False)):
            factors[k] = _factor(cell, si, f"{path}, line {number}")
    points = [_point(row, f"{path}, line {number}") for number, row in rows]
    return [factors[0] * t for t, _ in points], [factors[1] * x for _, x in points]


def _factor(cell: str, unit: str, where: str) -> float:
    """One of the unit in the brackets of a heading, in SI; 1 without brackets.

    What stands in parentheses is a unit where it can be read as one: it may also be the number of a channel.
    """
    in_brackets, in_parentheses = re.search(r"\[(.*)\]", cell), re.search(r"\(([^()]*)\)\s*$", cell)
    written = in_brackets or (in_parentheses if in_parentheses and _is_unit(in_parentheses[1]) else None)
    if written is None or written[1].strip() in ("", "-", "1"):
        return 1.0
    if re.fullmatch(r"[-+.0-9\s]+", written[1]):
        raise InputError(
            f"{where}: {shown(cell)} has no unit in its brackets; write [{unit or '-'}] there, or leave them out"
        )
    try:
        return to_si(f"1 {written[1]}", unit)
    except ValueError as error:
        raise InputError(f"{where}: the unit of {shown(cell)} {error}") from None


def _is_unit(text: str) -> bool:
    try:
        return bool(read_unit(plain(text)))
    except UnknownUnitError:
        return False


def _point(row: list[str], where: str) -> tuple[float, float]:
    if len(row) != 2:
        text = ",".join(row)
        raise InputError(f"{where}: {shown(text)} must be two numbers with decimal points, separated by one comma")
    time, value = (_number(cell, where) for cell in row)
    return time, value


def _number(cell: str, where: str) -> float:
    if "_" not in cell and cell.isascii():  # the language would also read 1_000 and the digits of other scripts
        with suppress(ValueError):
            return float(cell)
    try:
        return to_si(cell, "")
    except ValueError as error:
        raise InputError(f"{where}: {shown(cell)} {error}") from None
