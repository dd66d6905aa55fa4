"""Logs of robots: messages of topics, in MCAP files (JSON, ROS 1, ROS 2) and in bags of ROS 1 and ROS 2."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, need
from .logs import Channel, Log, as_number

Course = tuple[np.ndarray, np.ndarray]  # times of the messages [ns] and values
STAMP = ".header.stamp"
LONGEST_LIST = 100  # of numbers that are channels; longer ones are images, point clouds, maps


@dataclass
class Recording:
    """What a file holds: (time [ns], message) by topic, encodings of the topics that are left out, and its header."""

    topics: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    header: dict[str, Any] = field(default_factory=dict)


def read_mcap_log(path: Path, *, time: str = "") -> Log:
    """Of an MCAP file: the numbers of its messages are channels ``TOPIC.FIELD``, ``TOPIC.FIELD[0]`` of lists; units are SI.

    All are at the publish times of one topic; those of others are read from straight lines between their messages. Metadata
    of the file are the header.

    Parameters
    ----------
    time
        The topic of the times; left out, that of the first message. ``TOPIC.header.stamp`` takes the stamps in its messages
        in place of their publish times.

    Raises
    ------
    InputError
    MissingLibraryError
        mcap, or for messages of ROS rosbags, is not installed.
    """
    need("mcap", "Reading MCAP files", "identify")
    recording = _read_mcap(path)
    if not recording.topics:
        kinds = ", ".join(sorted(set(recording.left_out.values()))) or "no message"
        raise InputError(
            f"{path}: has no topic in JSON or of ROS ({kinds}); record in one of these, or write its topics as CSV"
        )
    return _log(path, recording, time)


def read_ros_bag(path: Path, *, time: str = "") -> Log:
    """Of a bag of ROS 1 (``.bag``) or ROS 2 (``.db3``): channels as of MCAP files, at the times of recording.

    Messages of ROS 2 bags that do not hold their definitions are taken for those of Humble.

    Raises
    ------
    InputError
    MissingLibraryError
        rosbags is not installed.
    """
    need("rosbags", "Reading bags of ROS", "identify")
    recording = _read_bag(path)
    if not recording.topics:
        raise InputError(f"{path}: has no message; record it again")
    return _log(path, recording, time)


def _log(path: Path, recording: Recording, time: str) -> Log:
    topics = {
        topic: [rows[k] for k in sorted(range(len(rows)), key=lambda k: rows[k][0])]
        for topic, rows in recording.topics.items()
    }
    topic = time.strip("/") or next(iter(topics))
    stamped = topic not in topics and topic.endswith(STAMP)
    topic = topic.removesuffix(STAMP) if stamped else topic
    if topic not in topics:
        raise InputError(f"{path}: has no topic {topic}; its topics are {', '.join(topics)}")
    instants = np.array([at for at, _ in topics[topic]], dtype=np.int64)
    clock = _stamps(path, topic, topics[topic]) if stamped else instants
    long: set[str] = set()
    channels = {
        name: Channel(_at(instants, course, own=of == topic))
        for of, rows in topics.items()
        for name, course in _courses(of, rows, long).items()
    }
    if not channels:
        raise InputError(f"{path}: the messages of {', '.join(topics)} have no number")
    log = Log(path.name, 1e-9 * (clock - clock[0]), channels, recording.header)
    if recording.left_out:
        kinds = ", ".join(f"{t} ({e})" for t, e in recording.left_out.items())
        log = log.noted(f"topics that are neither in JSON nor of ROS are left out: {kinds}")
    if long:
        log = log.noted(f"lists of more than {LONGEST_LIST} numbers are left out: {', '.join(sorted(long))}")
    if len(topics) > 1:
        others = ", ".join(t for t in topics if t != topic)
        log = log.noted(f"read at the instants of {topic}, between their messages: {others}")
    return log


def _read_mcap(path: Path) -> Recording:
    from mcap.reader import make_reader

    recording = Recording()
    decoders: dict[int, Callable[[bytes], Any] | None] = {}
    try:
        with path.open("rb") as file:
            reader = make_reader(file)
            for schema, channel, message in reader.iter_messages():
                topic = channel.topic.strip("/")
                if channel.id not in decoders:
                    decoders[channel.id] = _decoder(path, topic, channel.message_encoding, schema)
                decode = decoders[channel.id]
                if decode is None:
                    recording.left_out[topic] = channel.message_encoding or "of no stated encoding"
                    continue
                row = (message.publish_time, _decoded(path, topic, decode, message.data))
                recording.topics.setdefault(topic, []).append(row)
            recording.header = {k: as_number(v) for entry in reader.iter_metadata() for k, v in entry.metadata.items()}
    except (InputError, ImportError):
        raise
    except Exception as error:  # the library raises what its parts raise
        raise InputError(
            f"{path}: is not an MCAP file that mcap reads ({_line(error)}); if cut off, use `mcap recover`"
        ) from None
    return recording


def _decoder(path: Path, topic: str, encoding: str, schema: Any) -> Callable[[bytes], Any] | None:
    """None of an encoding that is not read."""
    if encoding == "json":
        return json.loads
    if encoding not in ("cdr", "ros1") or schema is None or schema.encoding not in ("ros2msg", "ros2idl", "ros1msg"):
        return None
    need("rosbags", "Reading messages of ROS", "identify")
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
    from rosbags.typesys.msg import normalize_msgtype

    text = schema.data.decode(errors="replace")
    try:
        store = get_typestore(Stores.EMPTY)
        if schema.encoding == "ros2idl":
            for part in re.split(r"^=+\nIDL: \S+\n", text, flags=re.MULTILINE):
                store.register(get_types_from_idl(part) if part.strip() else {})
        else:
            store.register(get_types_from_msg(text, schema.name))
        kind = normalize_msgtype(schema.name)
        store.get_msgdef(kind)
    except Exception as error:  # of a grammar
        raise InputError(
            f"{path}: topic {topic}: the definition of {schema.name} cannot be read ({_line(error)}); record it again"
        ) from None
    decode = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
    return partial(decode, typename=kind)


def _read_bag(path: Path) -> Recording:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    recording = Recording()
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, at, data in reader.messages():
                topic = connection.topic.strip("/")
                message = _decoded(path, topic, partial(reader.deserialize, typ=connection.msgtype), data)
                recording.topics.setdefault(topic, []).append((at, message))
    except InputError:
        raise
    except Exception as error:  # the library raises what its parts raise
        raise InputError(
            f"{path}: is not a bag that rosbags reads ({_line(error)}); if cut off, use `rosbag reindex` or "
            "`ros2 bag reindex`"
        ) from None
    return recording


def _decoded(path: Path, topic: str, decode: Callable[[bytes], Any], data: bytes) -> Any:
    try:
        return decode(data)
    except Exception as error:  # of what the message is not
        raise InputError(f"{path}: topic {topic}: a message cannot be read ({_line(error)}); record it again") from None


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _stamps(path: Path, topic: str, rows: list[tuple[int, Any]]) -> np.ndarray:
    """Times that messages carry in their header [ns]."""
    out = np.empty(len(rows), dtype=np.int64)
    for k, (_, message) in enumerate(rows):
        stamp = _member(_member(message, "header"), "stamp")
        seconds, rest = _member(stamp, "sec"), _member(stamp, "nanosec")
        if not (isinstance(seconds, int) and isinstance(rest, int)):
            raise InputError(
                f"{path}: topic {topic}: message {k + 1} has no header.stamp with sec and nanosec; "
                f"give logs.time = {topic!r} for the times of its messages"
            )
        out[k] = 1_000_000_000 * seconds + rest
    return out


def _member(message: Any, name: str) -> Any:
    return message.get(name) if isinstance(message, dict) else getattr(message, name, None)


def _courses(topic: str, rows: list[tuple[int, Any]], long: set[str]) -> dict[str, Course]:
    """By channel, NaN in messages that lack it; names of lists that are too long go to ``long``."""
    found: dict[str, np.ndarray] = {}
    for k, (_, message) in enumerate(rows):
        for name, value in _numbers(message, topic, long):
            found.setdefault(name, np.full(len(rows), np.nan))[k] = value
    at = np.array([at for at, _ in rows], dtype=np.int64)
    return {name: (at, values) for name, values in found.items()}


def _numbers(node: Any, name: str, long: set[str]) -> Iterator[tuple[str, float]]:
    """Of a message, those within lists and objects too; words are left out."""
    if isinstance(node, dict):
        for key, inner in node.items():
            yield from _numbers(inner, f"{name}.{key}", long)
    elif is_dataclass(node):
        for part in fields(node):
            yield from _numbers(getattr(node, part.name), f"{name}.{part.name}", long)
    elif isinstance(node, list | np.ndarray):
        if len(node) > LONGEST_LIST:
            long.add(name)
            return
        for k, inner in enumerate(node):
            yield from _numbers(inner, f"{name}[{k}]", long)
    elif isinstance(node, int | float | np.number | np.bool_):
        yield name, float(node)


def _at(instants: np.ndarray, course: Course, *, own: bool) -> np.ndarray:
    at, values = course
    return values if own else np.interp(instants - instants[0], at - instants[0], values)
