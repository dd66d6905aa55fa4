"""JSON logs of servo recorders: a header, and `entries` with a `timestamp` each (the layout of BAM)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .logs import Channel, Log


def read_servo_json(path: Path) -> Log:
    """Of a file ``{"mass": 0.5, ..., "entries": [{"timestamp": 0.0, "position": 0.1, ...}, ...]}``; units are SI.

    Keys of the header with hyphens are read with underscores. Words and lists of the header are kept as they are.

    Raises
    ------
    InputError
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: is not JSON ({error}); it may have been cut off, record or copy it again") from None
    if not isinstance(data, dict) or not isinstance(data.get("entries"), list):
        raise InputError(f"{path}: has no list entries; a servo log is an object with entries, one for each instant")
    entries = data["entries"]
    if not entries:
        raise InputError(f"{path}: key entries: is empty; leave the file out")
    if not all(isinstance(entry, dict) for entry in entries):
        raise InputError(f"{path}: key entries: must be objects, each with a timestamp")
    header = {key.replace("-", "_"): value for key, value in data.items() if key != "entries"}
    step = header.get("dt")
    if "timestamp" not in entries[0] and isinstance(step, int | float) and step > 0:
        time = step * np.arange(len(entries))
    else:
        time = _column(path, entries, "timestamp")
    keys = [key for key in entries[0] if key != "timestamp" and not isinstance(entries[0][key], str | list | dict)]
    channels = {key: Channel(_column(path, entries, key)) for key in keys}
    partial = sorted({key for entry in entries for key in entry} - set(keys) - {"timestamp"})
    log = Log(path.name, time, channels, header)
    return log.noted(f"channels that do not begin with a number are left out: {', '.join(partial)}") if partial else log


def _column(path: Path, entries: list[dict[str, Any]], key: str) -> np.ndarray:
    """One value of each entry; NaN where it is null."""
    out = np.empty(len(entries))
    for k, entry in enumerate(entries):
        if key not in entry:
            raise InputError(
                f"{path}: entries[{k}] lacks {key}, which entries[0] has; remove the entry, or add the value"
            )
        value = entry[key]
        if value is not None and not isinstance(value, bool | int | float):
            raise InputError(f"{path}: entries[{k}].{key}: {value!r} is no number")
        out[k] = np.nan if value is None else float(value)
    return out
