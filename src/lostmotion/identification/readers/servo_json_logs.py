"""JSON logs of servo recorders: a header, and `entries` with a `timestamp` each (the layout of BAM), or an array for each channel."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...inputs.memory_limits import check_memory
from .irregular_tables import LEAST, LOST
from .log import Channel, Log, as_number, reason
from .log_tables import TIME_NAMES, named_columns, seconds_of

# Bytes of memory for the objects, lists, keys and values of JSON, by a sign of each; measured.
PER_SIGN = {"{": 64, "[": 64, ":": 100, ",": 32}


def read_servo_json(path: Path, time: str) -> Log:
    """Read a file ``{"mass": 0.5, ..., "entries": [{"timestamp": 0.0, "position": 0.1, ...}, ...]}``; units are SI.

    Or a file ``{"mass": 0.5, ..., "timestamps": [0.0, ...], "positions": [0.1, ...]}``, whose arrays of one length are the channels.
    Or a list of objects, one in each line (``.jsonl``), or of rows below a heading, or an object that has one of these within. Names may
    have units, such as ``"position [mm]"``. A
    file that was cut off is read up to there, and a few entries without a number are missing samples. Keys of the header with hyphens are read with underscores. Words and lists of the header are kept as they are.

    time: key of the time in each entry; left out, ``timestamp``, ``time``, ``t``, or steps of ``dt`` of the header.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        check_memory(2 * sys.getsizeof(text) + sum(n * text.count(sign) for sign, n in PER_SIGN.items()))
        if path.suffix.lower() == ".jsonl":
            text = f"[{','.join(line for line in text.splitlines() if line.strip())}]"
        data, cut = _parsed(text)
        del text
        data = _table(data)
    except InputError:
        raise
    except RecursionError:
        raise InputError("is not a log, its lists are too deep; leave the file out") from None
    except ValueError as error:  # of the encoding, of JSON, or of a number of thousands of digits
        raise InputError(f"is not JSON ({reason(error)}); it may have been cut off, record or copy it again") from None
    notes = ["the file is cut off; it is read up to there"] if cut else []
    if isinstance(data, dict) and "entries" not in data and (arrays := _arrays(data, cut=cut)):
        columns, others = arrays, {key: value for key, value in data.items() if key not in arrays}
    else:
        columns, others, more = _entries(data)
        notes += more
    names = named_columns(list(columns))
    columns, units = dict(zip((name for name, _ in names), columns.values(), strict=True)), dict(names)
    clock = time or next((key for key in columns if key.lower().removesuffix("s") in TIME_NAMES), "timestamp")
    header = {key.replace("-", "_"): as_number(value) for key, value in others.items()}
    step, count = header.get("dt"), len(next(iter(columns.values())))
    if clock in columns:
        times = _numbers(columns[clock], clock, notes) * seconds_of(units[clock] or "")
    elif not time and isinstance(step, int | float) and step > 0:
        times = float(step) * np.arange(count, dtype=float)
    else:
        raise InputError(
            f"{'entries[0] ' if 'entries' in data else ''}lacks {clock}; add it to each entry, or the interval dt [s] to the header"
        )
    keys = [key for key, values in columns.items() if key != clock and any(map(_is_number, values))]
    if lacking := sorted(columns.keys() - set(keys) - {clock}):
        notes.append(f"channels without numbers are left out: {', '.join(lacking)}")
    channels = {key: Channel(_numbers(columns[key], key, notes), units[key] or "") for key in keys}
    return Log("", times, channels, header, tuple(notes))


def _table(data: Any) -> Any:
    """The object with entries or arrays that a file is, or has within; made of a list of objects, or of rows below a heading."""
    if isinstance(data, list) and data and all(isinstance(row, dict) for row in data):
        return {"entries": data}
    if isinstance(data, list) and data and all(isinstance(row, list) and len(row) == len(data[0]) for row in data):
        names, *rows = data
        return {name: [row[k] for row in rows] for k, name in enumerate(names) if isinstance(name, str)}
    if isinstance(data, dict) and "entries" not in data and not _arrays(data, cut=False):
        for key, value in data.items():
            inner = _table(value)
            if isinstance(inner, dict) and ("entries" in inner or _arrays(inner, cut=False)):
                return {name: other for name, other in data.items() if name != key} | inner
    return data


def _parsed(text: str) -> tuple[Any, bool]:
    """(content, whether the file was cut off): a text without its end is closed behind the last whole entry or number."""
    try:
        return json.loads(text), False
    except ValueError as error:
        for sign, kept in (("}", 1), (",", 0)):
            end = text.rfind(sign)
            try:
                return json.loads(f"{text[: end + kept]}]}}"), True
            except ValueError:
                continue
        raise error from None


def _arrays(data: dict[str, Any], *, cut: bool) -> dict[str, list[Any]]:
    """Arrays of numbers of the length of the longest, which are channels; with the shorter last one if the file was cut off."""
    found = {k: v for k, v in data.items() if isinstance(v, list) and len(v) >= LEAST and any(map(_is_number, v))}
    count = max(map(len, found.values()), default=0)
    if cut and found:
        count = min(count, len(next(reversed(found.values()))))
        return {key: values[:count] for key, values in found.items() if len(values) >= count}
    return {key: values for key, values in found.items() if len(values) == count}


def _entries(data: Any) -> tuple[dict[str, list[Any]], dict[str, Any], list[str]]:
    """(values of each entry by key, header, notes)."""
    if not isinstance(data, dict) or not isinstance(data.get("entries"), list):
        raise InputError(
            "has no list of entries; a log is a list of objects or rows, or an object with arrays of one length, one of them the time"
        )
    entries = data["entries"]
    if not entries:
        raise InputError("is empty; leave the file out", "entries")
    if not all(isinstance(entry, dict) for entry in entries):
        raise InputError("must be objects, each with a timestamp", "entries")
    notes, keys = [], list(entries[0])
    allowed = LOST * len(entries) if len(entries) >= LEAST else 0.0
    for key in keys:
        lacking = [k for k, entry in enumerate(entries) if key not in entry]
        if len(lacking) > allowed:
            raise InputError(
                f"entries[{lacking[0]}] lacks {key}, which entries[0] has; remove the entry, or add the value"
            )
        if lacking:
            notes.append(f"{len(lacking)} entries without {key}, the first entries[{lacking[0]}]; missing there")
    if others := sorted({key for entry in entries for key in entry} - set(keys)):
        notes.append(f"channels that the first entry lacks are left out: {', '.join(others)}")
    columns = {key: [entry.get(key) for entry in entries] for key in keys}
    return columns, {key: value for key, value in data.items() if key != "entries"}, notes


def _is_number(value: Any) -> bool:
    return isinstance(value, bool | int | float)


def _numbers(values: list[Any], key: str, notes: list[str]) -> np.ndarray:
    """Values of a channel; NaN where a value is null, and where a few are words."""
    words = [k for k, value in enumerate(values) if value is not None and not _is_number(value)]
    if len(words) > (LOST * len(values) if len(values) >= LEAST else 0.0):
        value = values[words[0]]
        raise InputError(f"entries[{words[0]}].{key}: {value!r} is not a number; put one there, or null")
    if words:
        notes.append(
            f"entries[{words[0]}].{key}: {values[words[0]]!r} is not a number; its sample is missing there ({len(words)} in all)"
        )
    out = np.full(len(values), np.nan)
    for k, value in enumerate(values):
        if _is_number(value):
            try:
                out[k] = float(value)
            except OverflowError:
                out[k] = np.inf
    return out
