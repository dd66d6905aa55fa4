"""Logs of MCAP files, as robots record them: messages of topics, in JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, need
from .binary_logs import as_number
from .logs import Channel, Log

Course = tuple[np.ndarray, np.ndarray]  # publish times [ns] and values


def read_mcap_log(path: Path, *, time: str = "") -> Log:
    """Of an MCAP file: the numbers of its JSON messages are channels ``TOPIC.FIELD``, ``TOPIC.FIELD[0]`` of lists; units are SI.

    All are at the publish times of one topic; those of others are read from straight lines between their messages. Metadata
    of the file are the header.

    Parameters
    ----------
    time
        The topic of the times; left out, that of the first message.

    Raises
    ------
    InputError
    MissingLibraryError
        mcap is not installed.
    """
    need("mcap", "Reading MCAP files", "identify")
    messages, other, header = _read(path)
    if not messages:
        kinds = ", ".join(sorted(set(other.values()))) or "no message"
        raise InputError(
            f"{path}: has no topic in JSON ({kinds}); record with the message encoding json, or write its topics as CSV, "
            "those of ROS 2 by mcap-ros2-support"
        )
    topic = time.strip("/") or next(iter(messages))
    if topic not in messages:
        raise InputError(f"{path}: has no topic {topic} in JSON; its topics are {', '.join(messages)}")
    columns = {name: _columns(name, rows) for name, rows in messages.items()}
    clock = np.sort(np.array([at for at, _ in messages[topic]], dtype=np.int64))
    channels = {
        name: Channel(_at(clock, course, own=of == topic))
        for of, courses in columns.items()
        for name, course in courses.items()
    }
    if not channels:
        raise InputError(f"{path}: the messages of {', '.join(messages)} have no number")
    log = Log(path.name, 1e-9 * (clock - clock[0]), channels, header)
    if other:
        log = log.noted(
            f"topics that are not in JSON are left out: {', '.join(f'{t} ({e})' for t, e in other.items())}"
        )
    if len(messages) > 1:
        log = log.noted(
            f"read at the instants of {topic}, between their messages: {', '.join(t for t in messages if t != topic)}"
        )
    return log


def _read(path: Path) -> tuple[dict[str, list[tuple[int, Any]]], dict[str, str], dict[str, Any]]:
    """By topic (publish time [ns], message) of those in JSON, encodings of the others, and the metadata."""
    from mcap.reader import make_reader

    messages: dict[str, list[tuple[int, Any]]] = {}
    other: dict[str, str] = {}
    try:
        with path.open("rb") as file:
            reader = make_reader(file)
            for _, channel, message in reader.iter_messages():
                topic = channel.topic.strip("/")
                if channel.message_encoding != "json":
                    other[topic] = channel.message_encoding or "of no stated encoding"
                    continue
                messages.setdefault(topic, []).append((message.publish_time, _decoded(path, topic, message.data)))
            header = {k: as_number(v) for entry in reader.iter_metadata() for k, v in entry.metadata.items()}
    except InputError:
        raise
    except Exception as error:  # the library raises what its parts raise
        raise InputError(
            f"{path}: is not an MCAP file that mcap reads ({error}); if cut off, use `mcap recover`"
        ) from None
    return messages, other, header


def _decoded(path: Path, topic: str, data: bytes) -> Any:
    try:
        return json.loads(data)
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: topic {topic}: a message is not JSON ({error}); record it again") from None


def _columns(topic: str, rows: list[tuple[int, Any]]) -> dict[str, Course]:
    """By channel, NaN in messages that lack it."""
    order = sorted(range(len(rows)), key=lambda k: rows[k][0])
    found: dict[str, np.ndarray] = {}
    for k, place in enumerate(order):
        for name, value in _numbers(rows[place][1], topic):
            found.setdefault(name, np.full(len(rows), np.nan))[k] = value
    at = np.array([rows[place][0] for place in order], dtype=np.int64)
    return {name: (at, values) for name, values in found.items()}


def _numbers(node: Any, name: str) -> Iterator[tuple[str, float]]:
    """Of a message, those within lists and objects too; words are left out."""
    if isinstance(node, dict):
        for key, inner in node.items():
            yield from _numbers(inner, f"{name}.{key}")
    elif isinstance(node, list):
        for k, inner in enumerate(node):
            yield from _numbers(inner, f"{name}[{k}]")
    elif isinstance(node, int | float):
        yield name, float(node)


def _at(clock: np.ndarray, course: Course, *, own: bool) -> np.ndarray:
    at, values = course
    return values if own else np.interp(clock - clock[0], at - clock[0], values)
