"""JSON logs of servo recorders: a header, and `entries` with a `timestamp` each (the layout of BAM)."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.limits import check_memory
from .logs import Channel, Log, as_number, reason

# Bytes of memory for the objects, lists, keys and values of JSON, by a sign of each; measured.
PER_SIGN = {"{": 64, "[": 64, ":": 100, ",": 32}


def read_servo_json(path: Path, *, time: str = "") -> Log:
    """Read a file ``{"mass": 0.5, ..., "entries": [{"timestamp": 0.0, "position": 0.1, ...}, ...]}``; units are SI.

    Keys of the header with hyphens are read with underscores. Words and lists of the header are kept as they are.

    Parameters
    ----------
    time
        Key of the time in each entry; left out, ``timestamp``, or steps of ``dt`` of the header.

    Raises
    ------
    InputError
    """
    clock = time or "timestamp"
    try:
        text = path.read_text(encoding="utf-8-sig")
        check_memory(2 * sys.getsizeof(text) + sum(n * text.count(sign) for sign, n in PER_SIGN.items()), str(path))
        data = json.loads(text)
        del text
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", where=path) from None
    except RecursionError:
        raise InputError("is not a log, its lists are too deep; leave the file out", where=path) from None
    except ValueError as error:  # of the encoding, of JSON, or of a number of thousands of digits
        raise InputError(
            f"is not JSON ({reason(error)}); it may have been cut off, record or copy it again", where=path
        ) from None
    if not isinstance(data, dict) or not isinstance(data.get("entries"), list):
        raise InputError("has no list entries; a servo log is an object with entries, one for each instant", where=path)
    entries = data["entries"]
    if not entries:
        raise InputError("is empty; leave the file out", "entries", where=path)
    if not all(isinstance(entry, dict) for entry in entries):
        raise InputError("must be objects, each with a timestamp", "entries", where=path)
    header = {key.replace("-", "_"): as_number(value) for key, value in data.items() if key != "entries"}
    step = header.get("dt")
    if clock in entries[0]:
        times = _column(path, entries, clock)
    elif not time and isinstance(step, int | float) and step > 0:
        times = step * np.arange(len(entries))
    else:
        raise InputError(
            f"entries[0] lacks {clock}; add it to each entry, or the interval dt [s] to the header", where=path
        )
    keys = [key for key in entries[0] if key != clock and any(_is_number(entry.get(key)) for entry in entries)]
    channels = {key: Channel(_column(path, entries, key)) for key in keys}
    partial = sorted({key for entry in entries for key in entry} - set(keys) - {clock})
    log = Log(path.name, times, channels, header)
    return (
        log.noted(f"channels without numbers, or that the first entry lacks, are left out: {', '.join(partial)}")
        if partial
        else log
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, bool | int | float)


def _column(path: Path, entries: list[dict[str, Any]], key: str) -> np.ndarray:
    """One value of each entry; NaN where it is null."""
    out = np.empty(len(entries))
    for k, entry in enumerate(entries):
        if key not in entry:
            raise InputError(
                f"entries[{k}] lacks {key}, which entries[0] has; remove the entry, or add the value", where=path
            )
        value = entry[key]
        if value is not None and not _is_number(value):
            raise InputError(f"entries[{k}].{key}: {value!r} is not a number; put one there, or null", where=path)
        try:
            out[k] = np.nan if value is None else float(value)
        except OverflowError:
            out[k] = np.inf
    return out
