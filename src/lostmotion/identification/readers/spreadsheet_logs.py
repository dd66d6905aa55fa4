"""Logs in spreadsheets (XLSX): the values of one sheet; no formula is evaluated."""

import warnings
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import IO, Any
from xml.parsers import expat

from ...errors import InputError, need
from ...inputs.memory_limits import check_memory
from ...inputs.refusal_messages import listed
from ...inputs.zip_files import members
from .irregular_tables import odd_table_log
from .log import Log, as_refusal
from .log_tables import TableRow, UnreadError, plain_number, table_log

PER_ELEMENT = 1500  # bytes of memory for an element of a part that describes the workbook, measured of styles
PER_TEXT = 200  # bytes of memory for an element of the list of texts
PER_ROW = 700  # bytes of memory for a row of a sheet: what is kept of it while the sheet is read
PER_CELL = 11  # bytes of memory for a value
PIECE = 2**16  # [bytes] that are decompressed at once
MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384  # by the format
STYLES = "xl/styles.xml"


def read_xlsx_log(path: Path, time: str) -> Log:
    """Read the first sheet of a workbook with values: a heading, in the first column ``# key: value`` above it as the header.

    Formulas count by the values that are saved with them. Times are numbers, time stamps, or cells with a date.
    """
    need("openpyxl", "Reading XLSX files", "identify")
    import openpyxl

    with as_refusal("is not an XLSX file", "; save it as .xlsx again, or as CSV"):
        with zipfile.ZipFile(path) as archive:
            _check(archive)
        with warnings.catch_warnings(), path.open("rb") as file:
            warnings.simplefilter("ignore")  # of extensions, validations and headers of pages, which are not read
            book = openpyxl.load_workbook(file, read_only=True, data_only=True, keep_links=False)
            log = _of_book(book, time)
            book.close()
    return log


def _of_book(book: Any, clock: str) -> Log:
    """The log of the first sheet with something in it."""
    for sheet in book.worksheets:
        sheet.reset_dimensions()  # what a file announces need not be so
        comments: list[str] = []
        rows = list(_rows(sheet, comments))
        if not rows:
            continue
        width = len(rows[0][1])  # cells that a sheet does not hold are empty
        rows = [(number, [*cells, *[None] * (width - len(cells))]) for number, cells in rows]
        try:
            log = _table(rows, comments, clock)
        except UnreadError as problem:
            raise InputError(f"sheet {sheet.title}, row {problem.row}: {problem}") from None
        others = [s.title for s in book.worksheets if s is not sheet]
        note = f"sheet {sheet.title} is read; left out are {listed(others)}"
        return log.noted(note) if others else log
    raise InputError("has no sheet with values; save the log in the first sheet")


def _table(rows: list[TableRow], comments: list[str], time: str) -> Log:
    """The log of a sheet, without the lines and cells that cannot be read."""
    try:
        return table_log(iter(rows), _number, comments, time)
    except UnreadError as problem:
        try:
            return odd_table_log(rows, _number, comments, time)[1]
        except UnreadError:
            raise problem from None


def _rows(sheet: Any, comments: list[str]) -> Iterator[TableRow]:
    """Rows with something in them, without empty cells at their ends; comments are put into the list."""
    for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
        cells = list(row)
        while cells and (cells[-1] is None or cells[-1] == ""):
            cells.pop()
        if not cells:
            continue
        if isinstance(cells[0], str) and cells[0].lstrip().startswith("#"):
            texts = [str(cell) for cell in cells[:2] if cell is not None]
            comments.append((texts[0] if ":" in texts[0] or "=" in texts[0] else ": ".join(texts)).lstrip(" #"))
            continue
        yield number, cells


def _number(cell: Any) -> float | None:
    """Number in a cell; None if the cell has no number."""
    if isinstance(cell, bool | int | float):
        with suppress(OverflowError):
            return float(cell)
        return None
    if isinstance(cell, timedelta):
        return cell.total_seconds()
    if isinstance(cell, time):
        return (datetime.combine(datetime.min, cell) - datetime.min).total_seconds()
    return plain_number(cell) if isinstance(cell, str) else None


# --- checks ---


def _check(archive: zipfile.ZipFile) -> None:
    """Refuse a workbook that needs more memory than the limit, defines entities, or has formulas without values."""
    needed = 0.0
    for name, about in members(archive).items():
        part = _Part(name)
        with archive.open(name) as stream:
            part.count(stream)
        each = PER_TEXT if part.root == "sst" and name != STYLES else PER_ELEMENT
        needed += (
            2.0 * about.file_size + each * part.outside + PER_ROW * (part.rows + part.largest) + PER_CELL * part.cells
        )
        check_memory(needed)


class _Part:
    """Content of a part of a workbook, by a parser that stores nothing."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.root = ""
        self.rows, self.cells = 0, 0
        self.outside = 0  # elements that are in no row
        self.largest = 0  # elements and attributes of the largest row
        self._row, self._column, self._size = 0, 0, 0
        self._in_row, self._in_value = False, False
        self._formula, self._value = False, False

    def count(self, stream: IO[bytes]) -> None:
        """Read the part; what is no XML, such as a picture, ends it."""
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.StartElementHandler = self._begin
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.StartDoctypeDeclHandler = self._refuse
        with suppress(expat.ExpatError):  # openpyxl reports the errors in parts that it needs
            while piece := stream.read(PIECE):
                parser.Parse(piece)
            parser.Parse(b"", True)

    def _refuse(self, *_: Any) -> None:
        raise InputError(f"{self.name}: defines entities, which no workbook does; save it again")

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        tag = tag.rpartition(" ")[2]
        self.root = self.root or tag
        self._size += 1 + len(attributes)
        if tag == "row":
            self.rows += 1
            self._in_row, self._column, self._size = True, 0, 0
            row = int(float(attributes.get("r", self._row + 1)))
            if not self._row < row <= MOST_ROWS:
                raise InputError(f"{self.name}: row {row} comes after row {self._row}; save the file again")
            self._row = row
        elif not self._in_row:
            self.outside += 1
        elif tag == "c":
            letters = attributes.get("r", "").rstrip("0123456789")
            self._column = _column(letters) if letters else self._column + 1
            self.cells += 1
            if self._column > MOST_COLUMNS:
                raise InputError(f"{self.name}: row {self._row} has a cell {letters}; save the file again")
            self._formula, self._value = False, attributes.get("t") == "str"
        self._formula = self._formula or tag == "f"
        self._in_value = tag == "v"

    def _text(self, text: str) -> None:
        self._value = self._value or (self._in_value and bool(text.strip()))

    def _end(self, tag: str) -> None:
        tag = tag.rpartition(" ")[2]
        if tag == "row":
            self._in_row = False
            self.largest = max(self.largest, self._size)
            self.cells += self._column
        elif tag == "c" and self._in_row and self._formula and not self._value:
            raise InputError(
                f"{self.name}: row {self._row} has a formula without its value; open the file in a spreadsheet "
                "program, and save it"
            )
        self._in_value = False


def _column(letters: str) -> int:
    """Number of a column from its letters: A is 1."""
    number = 0
    for letter in letters[:4].upper():
        number = 26 * number + ord(letter) - 64
    return number
