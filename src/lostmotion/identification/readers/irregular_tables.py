"""Tables with a header of many lines, a column of the time for each channel, or lines and cells that cannot be read.

Oscilloscopes and controllers write lines of `key value` above the table. Exports of PLC scopes have a pair of columns for each
channel, its time and its values. Above them are lines of `key value key value`, one pair for each channel. A line that was
cut off and a cell such as `ERROR` cost only themselves, as long as they are few.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...units.practical import counted
from .log import Channel, Log
from .log_tables import SECONDS, Stamps, TableRow, UnreadError, named_columns, remedy_for_cell, table_log, units_below

IN_ROW = 3  # rows of one length, with a number first, from which on a table begins
HEADER = 200  # lines above a table, at most
LOST = 0.1  # share of the rows that may be lost, and of the cells of a column
LEAST = 10  # rows that must be left
ENDS = ("eof", "end")  # words in a last line that marks the end
TIME_OF = "time of "

Number = Callable[[Any], float | None]


def odd_table_log(rows: Sequence[TableRow], number: Number, comments: list[str], time: str) -> tuple[int, Log]:
    """(number of lines and cells that are lost, the log).

    rows, number, comments, time: as in `table_log`.
    """
    begin = next((k for k in range(min(HEADER, len(rows))) if _begins(rows[k : k + IN_ROW], number)), None)
    if begin is None:
        raise UnreadError(0, "has no table of numbers")
    width, head, pairs = len(rows[begin][1]), rows[:begin], False
    if head and all(len(cells) == width for _, cells in head):
        count = 2 if len(head) > 1 and units_below(head[1], width, number) is not None else 1
        heading, body = list(head[:count]), rows[count:]
    else:
        heading, pairs = _heading(head, width, number, comments)
        body = rows[begin:]
    kept, lost, notes, words = _mended(
        [str(cell) for cell in heading[0][1]] if heading else [], body, width, number, time
    )
    log = table_log(iter([*heading, *kept]), number, comments, time)
    if pairs:
        log = _on_one_clock(log)
    channels = {
        name: c
        for name, c in log.channels.items()
        if np.isfinite(c.values).any() or name not in [name for name, _ in named_columns(words)]
    }
    return lost, replace(log, channels=channels, notes=(*log.notes, *notes))


def _begins(rows: Sequence[TableRow], number: Number) -> bool:
    """Whether some rows look like the first ones of a table: a time, and numbers in half of the cells."""
    if len(rows) < IN_ROW or len({len(cells) for _, cells in rows}) > 1 or len(rows[0][1]) < 2:
        return False
    values = [[number(cell) is not None for cell in cells] for _, cells in rows]
    stamps = Stamps()
    return all(
        (row[0] or stamps.seconds(cells[0]) is not None) and sum(row[1:]) >= max(1, (len(row) - 1) // 2)
        for row, (_, cells) in zip(values, rows, strict=True)
    )


def _heading(head: Sequence[TableRow], width: int, number: Number, comments: list[str]) -> tuple[list[TableRow], bool]:
    """(heading and row of units, whether each channel has a column of the time); other lines become comments of the header."""
    pairs: dict[str, list[str]] = {}
    for _, cells in head:
        texts = [str(cell if cell is not None else "").strip() for cell in cells]
        if width % 2 == 0 and len(texts) == width and texts[0] and len(set(texts[::2])) == 1:
            pairs[texts[0]] = texts[1::2]
        elif len(texts) < width and len(texts) > 1 and all(texts[:2]):
            comments.append(f"{texts[0]}: {texts[1]}")
    written = {re.sub(r"[\W_]", "", re.sub(r"[\[(].*", "", key)).lower(): key for key in pairs}
    names = pairs.get(written.get("name", ""), pairs.get(written.get("symbolname", ""), []))
    if names and all(names):
        clock = next(
            (m[1] for key in pairs if "time" in key.lower() and (m := re.search(r"[\[(](\w+)[\])]", key))), "s"
        )
        units = pairs.get(written.get("unit", ""), [""] * len(names))
        found = []
        for k, (name, unit) in enumerate(zip(_distinct(names), units, strict=True)):
            found += [f"{TIME_OF}{name} [{clock}]" if k else f"time [{clock}]", f"{name} [{unit}]" if unit else name]
        return [(head[-1][0], found)], True
    wide = [row for row in head[-2:] if len(row[1]) == width]
    if len(wide) == 2 and units_below(wide[1], width, number) is None:
        wide = wide[1:]
    return list(wide), False


def _distinct(names: Sequence[str]) -> list[str]:
    counts = Counter(names)
    return [name if counts[name] == 1 else f"{name} {k + 1}" for k, name in enumerate(names)]


def _mended(
    names: Sequence[str], body: Sequence[TableRow], width: int, number: Number, time: str
) -> tuple[list[TableRow], int, list[str], list[str]]:
    """(rows that fit, with empty cells in place of words; how much is lost; notes on it; columns of words)."""
    lines = [row for row in body if len(row[1]) != width]
    kept = [(line, list(cells)) for line, cells in body if len(cells) == width]
    end = lines[-1] if lines and lines[-1] == body[-1] else None
    if end is not None and str(end[1][0]).strip().lower() in ENDS:
        lines.pop()
    allowed = max(1.0, LOST * len(kept))
    if lines and (len(lines) > allowed or len(kept) < LEAST):
        raise UnreadError(lines[0][0], f"has {len(lines[0][1])} values for {width} columns; the file may be cut off")
    notes = []
    if lines:
        more = f" ({counted(len(lines), 'line')} in all)" if len(lines) > 1 else ""
        notes.append(
            f"line {lines[0][0]} has {len(lines[0][1])} of {width} values and is left out; the file may be cut off or damaged{more}"
        )
    lost, blank = len(lines), []
    for j in range(width):
        stamps = Stamps()
        name = names[j].strip() if j < len(names) and names[j].strip() else f"column {j + 1}"
        bad = [
            k
            for k, (_, cells) in enumerate(kept)
            if _is_word(cells[j], number, stamps, time_stamp=j == 0 or name == time)
        ]
        if not bad:
            continue
        line, cell = kept[bad[0]][0], str(kept[bad[0]][1][j]).strip()[:40]
        if remedy := remedy_for_cell(cell):
            raise UnreadError(line, f"{cell!r} in column {name} is not a number{remedy}")
        lost += len(bad)
        if len(bad) > allowed:
            if j == 0:
                raise UnreadError(line, f"{cell!r} in column {name} is not a number")
            blank.append(name)
        elif len(kept) < LEAST:
            raise UnreadError(line, f"{cell!r} in column {name} is not a number")
        else:
            more = f" ({counted(len(bad), 'cell')} in all)" if len(bad) > 1 else ""
            notes.append(f"line {line}: {cell!r} in column {name} is not a number; its sample is missing there{more}")
        for k in bad:
            kept[k][1][j] = ""
    if len(blank) == width - 1:
        raise UnreadError(kept[0][0], "has no column of numbers")
    if blank:
        notes.append(f"columns of words are left out: {', '.join(blank)}")
    return [*kept], lost, notes, blank


def _is_word(cell: Any, number: Number, stamps: Stamps, *, time_stamp: bool) -> bool:
    if cell is None or not str(cell).strip() or number(cell) is not None:
        return False
    return not (time_stamp and stamps.seconds(cell) is not None)


def _on_one_clock(log: Log) -> Log:
    """Channels at the times of the first one: as they are where theirs are the same, else by straight lines between their samples."""
    clocks = {name.removeprefix(TIME_OF): c for name, c in log.channels.items() if name.startswith(TIME_OF)}
    channels: dict[str, Channel] = {}
    moved = []
    for name, channel in log.channels.items():
        if name.startswith(TIME_OF):
            continue
        channels[name] = channel
        if name in clocks:
            own = clocks[name].values * SECONDS[clocks[name].unit]
            there = np.isfinite(own) & np.isfinite(channel.values)
            if not np.array_equal(own, log.time) and there.any():
                values = np.interp(log.time, own[there], channel.values[there], left=np.nan, right=np.nan)
                channels[name] = replace(channel, values=values)
                moved.append(name)
    log = replace(log, channels=channels)
    if not moved:
        return log
    return log.noted(
        f"channels with times of their own are read by straight lines at those of the first one: {', '.join(moved)}"
    )
