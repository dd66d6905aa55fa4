"""Logs of robots: messages of topics, in MCAP files (JSON, ROS 1, ROS 2) and in bags of ROS 1 and ROS 2."""

import bz2
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import InputError, need
from ...inputs.memory_limits import check_memory, memory_limit
from ...inputs.refusal_messages import listed
from .log import Channel, Log, as_number, as_refusal, reason

Course = tuple[np.ndarray, np.ndarray]  # times of the messages [ns] and values
STAMP = ".header.stamp"
LONGEST_LIST = 100  # of numbers that are channels; longer ones are images, point clouds, maps
LONGEST_DEFINITION = 200_000  # characters of the definition of a message
MOST_ENTRIES = 10_000  # of fixed lists of words and messages in a definition
MOST_LEVELS = 50  # of lists and objects inside of a message
PER_MESSAGE = 1000  # bytes of memory for a message and its parts
PER_CHARACTER = 10  # bytes of memory for a character of JSON


@dataclass
class Recording:
    """Content of a file: (time [ns], message) by topic, encodings of the topics that are left out, and its header."""

    topics: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    header: dict[str, Any] = field(default_factory=dict)
    held: int = 0  # bytes of memory that its messages need, as estimated

    def add(self, topic: str, at: int, decode: Callable[[bytes], Any] | None, data: bytes, encoding: str) -> None:
        """Decode a message and keep it, if all messages together fit into the memory limit."""
        if decode is None:
            self.left_out[topic] = encoding or "of no stated encoding"
            return
        self.held += PER_MESSAGE + (PER_CHARACTER if encoding == "json" else 1) * len(data)
        check_memory(self.held)
        self.topics.setdefault(topic, []).append((at, _decoded(topic, decode, data)))


def read_mcap_log(path: Path, time: str) -> Log:
    """Read an MCAP file: the numbers of its messages are channels ``TOPIC.FIELD``, ``TOPIC.FIELD[0]`` of lists; units are SI.

    All are at the publish times of one topic; channels of other topics are interpolated linearly between their messages. Metadata
    of the file are the header.

    time: the topic of the times; default: the topic of the first message. ``TOPIC.header.stamp`` takes the stamps in
        its messages in place of their publish times.
    """
    need("mcap", "Reading MCAP files", "identify")
    recording = _read_mcap(path)
    if not recording.topics:
        kinds = listed(sorted(set(recording.left_out.values()))) or "no message"
        raise InputError(
            f"has no topic in JSON or of ROS ({kinds}); record in one of these, or write its topics as CSV"
        )
    return _log(recording, time)


def read_ros_bag(path: Path, time: str) -> Log:
    """Read a bag of ROS 1 (``.bag``) or ROS 2 (``.db3``): channels as of MCAP files, at the times of recording.

    Messages of ROS 2 bags without definitions are read by the definitions of Humble.
    """
    need("rosbags", "Reading bags of ROS", "identify")
    recording = _read_bag(path)
    if not recording.topics:
        raise InputError("has no message; record it again")
    return _log(recording, time)


def _log(recording: Recording, time: str) -> Log:
    topics = {
        topic: [rows[k] for k in sorted(range(len(rows)), key=lambda k: rows[k][0])]
        for topic, rows in recording.topics.items()
    }
    topic = time.strip("/") or next(iter(topics))
    stamped = topic not in topics and topic.endswith(STAMP)
    topic = topic.removesuffix(STAMP) if stamped else topic
    if topic not in topics:
        raise InputError(f"has no topic {topic}; its topics are {listed(topics)}")
    instants = np.array([at for at, _ in topics[topic]], dtype=np.int64)
    clock = _stamps(topic, topics[topic]) if stamped else instants
    long: set[str] = set()
    channels = {
        name: Channel(_at(instants, course, own=topic_name == topic))
        for topic_name, rows in topics.items()
        for name, course in _courses(topic_name, rows, long).items()
    }
    if not channels:
        raise InputError(f"the messages of {listed(topics)} have no number")
    log = Log("", 1e-9 * (clock - clock[0]), channels, recording.header)
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
    from mcap import records

    recording = Recording()
    decoders: dict[int, Callable[[bytes], Any] | None] = {}
    channels: dict[int, Any] = {}
    schemas: dict[int, Any] = {}
    first: dict[str, int] = {}  # log time of the first message of each topic
    with as_refusal("is not an MCAP file that mcap reads", "; if cut off, use `mcap recover`"), path.open("rb") as file:
        for record in _mcap_records(file):
            if isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel):
                channels[record.id] = record
            elif isinstance(record, records.Metadata):
                recording.header |= {k: as_number(v) for k, v in record.metadata.items()}
            elif isinstance(record, records.Message):
                channel = channels[record.channel_id]
                topic = channel.topic.strip("/")
                if channel.id not in decoders:
                    decoders[channel.id] = _decoder(topic, channel.message_encoding, schemas.get(channel.schema_id))
                first[topic] = min(record.log_time, first.get(topic, record.log_time))
                recording.add(topic, record.publish_time, decoders[channel.id], record.data, channel.message_encoding)
    recording.topics = {topic: recording.topics[topic] for topic in sorted(recording.topics, key=lambda t: first[t])}
    return recording


def _mcap_records(file: BinaryIO) -> Iterator[Any]:
    """Records in the order of the file, with the records of chunks."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    for record in StreamReader(file, emit_chunks=True, record_size_limit=memory_limit()).records:
        if isinstance(record, Chunk):
            check_memory(record.uncompressed_size)
            content = _decompressed(record.compression, record.data, record.uncompressed_size)
            if len(content) > record.uncompressed_size:
                raise ValueError("a chunk is longer than it announces")
            yield from breakup_chunk(replace(record, compression="", data=content))
        else:
            yield record


def _decompressed(method: str, data: bytes, size: int) -> bytes:
    """Content of a chunk, cut off one byte after the given size."""
    if method == "zstd":
        import zstandard

        with zstandard.ZstdDecompressor().stream_reader(data) as stream:
            content = stream.read(size + 1)
    elif method == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        content = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif method == "bz2":
        content = bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
    elif method in ("", "none"):
        content = data
    else:
        raise ValueError(f"compression {method!r} is not supported")
    return bytes(content)


def _decoder(topic: str, encoding: str, schema: Any) -> Callable[[bytes], Any] | None:
    """None of an encoding that is not read."""
    if encoding == "json":
        return json.loads
    if encoding not in ("cdr", "ros1") or schema is None or schema.encoding not in ("ros2msg", "ros2idl", "ros1msg"):
        return None
    need("rosbags", "Reading messages of ROS", "identify")
    from rosbags.typesys import Stores, get_typestore
    from rosbags.typesys.msg import normalize_msgtype

    with as_refusal(f"topic {topic}: the definition of {schema.name} cannot be read", "; record it again"):
        store = get_typestore(Stores.EMPTY)
        store.register(_types(schema.data.decode(errors="replace"), schema.name, idl=schema.encoding == "ros2idl"))
        kind = normalize_msgtype(schema.name)
        store.get_msgdef(kind)
    decode = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
    return partial(decode, typename=kind)


def _types(text: str, name: str, *, idl: bool) -> dict[str, Any]:
    """Types that a definition holds, checked before the library writes and runs code that reads them.

    The library takes only letters, digits and underscores into names, and writes out values as literals. Definitions
    that it would process without limit are refused here. They are fixed lists of words or messages: the library
    writes lines of code for each entry. They are also lists of messages without any byte, and shifts to numbers of any
    length.
    """
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if len(text) > LONGEST_DEFINITION:
        raise ValueError(f"it is longer than {LONGEST_DEFINITION} characters")
    if idl and "<<" in text:
        raise ValueError("it has a shift <<; write the number")
    types: dict[str, Any] = {}
    for part in re.split(r"^=+\nIDL: \S+\n", text, flags=re.MULTILINE) if idl else [text]:
        if part.strip():
            types |= get_types_from_idl(part) if idl else get_types_from_msg(part, name)
    _check_lists(types)
    return types


def _check_lists(types: Mapping[str, Any]) -> None:
    from rosbags.interfaces import Nodetype

    empty: set[str] = set()  # messages without any byte

    def is_empty(node: Any, inner: Any) -> bool:
        if node == Nodetype.ARRAY:
            return inner[1] == 0 or is_empty(*inner[0])
        return node == Nodetype.NAME and inner in empty

    before = -1
    while len(empty) > before:
        before = len(empty)
        empty |= {kind for kind, (_, members) in types.items() if all(is_empty(*desc) for _, desc in members)}
    entries = 0
    for kind, (_, members) in types.items():
        for member, (node, inner) in members:
            if node not in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                continue
            (kind_of_entry, what), length = inner
            if is_empty(kind_of_entry, what):
                raise ValueError(f"{kind}.{member} is a list of messages without data")
            if node == Nodetype.ARRAY and (kind_of_entry == Nodetype.NAME or what[0] in ("string", "wstring")):
                entries += length
    if entries > MOST_ENTRIES:
        raise ValueError(f"its fixed lists of words or messages have more than {MOST_ENTRIES} entries")


def _read_bag(path: Path) -> Recording:
    from rosbags import rosbag1, rosbag2
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    recording = Recording()
    remedy = "; if cut off, use `rosbag reindex` or `ros2 bag reindex`"
    with as_refusal("is not a bag that rosbags reads", remedy):
        if path.suffix.lower() == ".db3":
            _check_tables(path)
        with rosbag2.Reader(path) if path.suffix.lower() == ".db3" else rosbag1.Reader(path) as opened:
            for connection in opened.connections:
                _check_definition(connection)
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for one in reader.readers:
                if isinstance(one, rosbag1.Reader):
                    one.chunks = {at: _bounded(chunk) for at, chunk in one.chunks.items()}
            for connection, at, data in reader.messages():
                topic = connection.topic.strip("/")
                recording.add(topic, at, partial(reader.deserialize, typ=connection.msgtype), data, "ros")
    return recording


def _check_definition(connection: Any) -> None:
    from rosbags.interfaces import MessageDefinitionFormat

    kind = connection.msgdef.format
    if kind == MessageDefinitionFormat.NONE:
        return
    topic = connection.topic.strip("/")
    with as_refusal(f"topic {topic}: the definition of {connection.msgtype} cannot be read", "; record it again"):
        _types(connection.msgdef.data, connection.msgtype, idl=kind == MessageDefinitionFormat.IDL)


def _bounded(chunk: Any) -> Any:
    """A chunk of a bag of ROS 1 that is decompressed up to the memory limit; the library knows none."""
    from rosbags.rosbag1.reader import decompressors

    method = next(name for name, how in decompressors.items() if how is chunk.decompressor)

    def decompress(data: bytes) -> bytes:
        content = _decompressed(method, data, memory_limit())
        check_memory(len(content))
        return content

    return chunk._replace(decompressor=decompress)


def _check_tables(path: Path) -> None:
    """Refuse a bag of ROS 2 whose database computes rows in place of holding them."""
    import sqlite3
    from contextlib import closing

    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?immutable=1", uri=True)) as database:
        entries = database.execute("SELECT type, name, coalesce(sql, '') FROM sqlite_master").fetchall()
    for kind, name, text in entries:
        if kind not in ("table", "index") or re.search(r"\b(VIRTUAL|GENERATED|AS)\b", text, re.IGNORECASE):
            raise ValueError(f"its database computes {name}; it must hold plain tables")


def _decoded(topic: str, decode: Callable[[bytes], Any], data: bytes) -> Any:
    try:
        return decode(data)
    except Exception as error:  # of what the message is not
        raise InputError(f"topic {topic}: a message cannot be read ({reason(error)}); record it again") from None


def _stamps(topic: str, rows: list[tuple[int, Any]]) -> np.ndarray:
    """Times that messages carry in their header [ns]."""
    out = np.empty(len(rows), dtype=np.int64)
    for k, (_, message) in enumerate(rows):
        stamp = _member(_member(message, "header"), "stamp")
        seconds, rest = _member(stamp, "sec"), _member(stamp, "nanosec")
        if not (isinstance(seconds, int) and isinstance(rest, int)):
            raise InputError(
                f"topic {topic}: message {k + 1} has no header.stamp with sec and nanosec; "
                f"give logs.time = {topic!r} for the times of its messages"
            )
        out[k] = 1_000_000_000 * seconds + rest
    return out


def _member(message: Any, name: str) -> Any:
    return message.get(name) if isinstance(message, dict) else getattr(message, name, None)


def _courses(topic: str, rows: list[tuple[int, Any]], long: set[str]) -> dict[str, Course]:
    """Courses by channel, NaN in messages that lack it; names of lists that are too long go to ``long``."""
    found: dict[str, np.ndarray] = {}
    for k, (_, message) in enumerate(rows):
        for name, value in _shallow(topic, message, long):
            if name not in found:
                check_memory(16.0 * len(rows) * (len(found) + 1), f"topic {topic}: {len(found) + 1} channels")
                found[name] = np.full(len(rows), np.nan)
            found[name][k] = value
    at = np.array([at for at, _ in rows], dtype=np.int64)
    return {name: (at, values) for name, values in found.items()}


def _shallow(topic: str, message: Any, long: set[str]) -> Iterator[tuple[str, float]]:
    try:
        yield from _numbers(message, topic, long)
    except RecursionError:
        raise InputError(
            f"topic {topic}: a message has more than {MOST_LEVELS} lists and objects inside of each other"
        ) from None


def _numbers(node: Any, name: str, long: set[str], levels: int = MOST_LEVELS) -> Iterator[tuple[str, float]]:
    """Numbers of a message, also within lists and objects; words are left out."""
    if levels == 0:
        raise RecursionError
    if isinstance(node, dict):
        for key, inner in node.items():
            yield from _numbers(inner, f"{name}.{key}", long, levels - 1)
    elif is_dataclass(node):
        for part in fields(node):
            yield from _numbers(getattr(node, part.name), f"{name}.{part.name}", long, levels - 1)
    elif isinstance(node, list | np.ndarray):
        if len(node) > LONGEST_LIST:
            long.add(name)
            return
        for k, inner in enumerate(node):
            yield from _numbers(inner, f"{name}[{k}]", long, levels - 1)
    elif isinstance(node, int | float | np.number | np.bool_):
        try:
            yield name, float(node)
        except OverflowError:
            yield name, float("inf")


def _at(instants: np.ndarray, course: Course, *, own: bool) -> np.ndarray:
    at, values = course
    return values if own else np.interp(instants - instants[0], at - instants[0], values)
