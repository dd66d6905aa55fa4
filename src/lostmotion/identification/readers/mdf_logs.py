"""Logs in MDF 4 files, read by asammdf. Before that library follows the links between their blocks, the links are checked.

Layout: ASAM MDF 4.2, block header of 24 bytes (id, length, number of links), links of 8 bytes, then data.
"""

import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import InputError, need
from ...inputs.memory_limits import check_memory
from .channel_conversions import conversion_of
from .log import Channel, Log, quiet_ends, reason, warnings_of

FIRST = 64  # address of the header block
MAX_DEPTH = 20  # lists inside of lists
LINKS = 1_000_000  # of one block
EXPANSION = 1032  # bytes that deflate makes of one, at most
DATA = (b"##DT", b"##SD", b"##RD", b"##DV", b"##DI")
DEFLATE = (0, 1)  # plain and transposed
ALGEBRAIC = 3  # type of a conversion of MDF 4
MDF_NUMBERS = range(6)  # data types of MDF 4: integers and floating-point numbers of both byte orders


def read_mdf_log(path: Path, time: str) -> Log:
    """Read an MDF 4 file by asammdf: all channels at the instants of the channel `time`, or of the first.

    Algebraic conversions are read by `conversion_of`. Databases of buses that a file attaches are not read.
    """
    need("asammdf", "Reading MDF files", "identify")
    check_mdf_blocks(path)
    problem = ""
    with warnings_of("asammdf") as said, quiet_ends():
        try:
            signals = _mdf_signals(path)
        except InputError:
            raise
        except Exception as error:  # the library raises what its parts raise
            problem = reason(error)
    if problem:
        raise InputError(f"is not an MDF file that asammdf reads ({problem})")
    numbers = [signal for signal in signals if signal.samples.dtype.kind in "biuf" and signal.samples.ndim == 1]
    if not numbers:
        raise InputError("has no channel of numbers")
    first = next((signal for signal in numbers if signal.name == time), numbers[0])
    clock = np.asarray(first.timestamps, dtype=float)
    channels = {
        s.name: Channel(np.interp(clock, s.timestamps, s.samples.astype(float)), str(s.unit or "")) for s in numbers
    }
    log = Log("", clock - clock[0], channels)
    return log.noted(f"asammdf reports: {said[0]}") if said else log


def _mdf_signals(path: Path) -> list[Any]:
    import asammdf

    with asammdf.MDF(path, process_bus_logging=False) as file:  # type: ignore[call-arg]
        formulas = _formulas(file)
        _check_mdf_memory(file)
        masters = {(k, m) for k, m in file.masters_db.items()}
        places = {name: at for name, at in file.channels_db.items() if not masters.intersection(at)}
        return [_signal(file, name, at, formulas) for name, at in places.items() if _is_plain(file, at[0])]


Formulas = dict[tuple[int, int], Callable[[np.ndarray], np.ndarray]]


def _formulas(file: Any) -> Formulas:
    """Algebraic conversions by group and channel; they are taken out of the file, so that its library evaluates none."""
    found: Formulas = {}
    for k, group in enumerate(file.groups):
        for n, channel in enumerate(group.channels):
            rule = channel.conversion
            if rule is None:
                continue
            try:
                if rule.conversion_type == ALGEBRAIC:
                    found[k, n] = conversion_of(rule.formula)
                    channel.unit = channel.unit or rule.unit
                    channel.conversion = None
                elif _has_formula(rule):
                    raise ValueError("is a table with a formula in it, which is not supported")
            except ValueError as error:
                raise InputError(f"channel {channel.name}: its conversion {error}") from None
    return found


def _has_formula(rule: Any) -> bool:
    inner = [one for one in (rule.referenced_blocks or {}).values() if hasattr(one, "conversion_type")]
    return any(one.conversion_type == ALGEBRAIC or _has_formula(one) for one in inner)


def _check_mdf_memory(file: Any) -> None:
    """Refuse channels that need more memory than the limit: raw values, physical ones, and instants of each."""
    needed = 0.0
    for group in file.groups:
        about = group.channel_group
        record = about.samples_byte_nr + about.invalidation_bytes_nr
        needed += float(about.cycles_nr) * (record + 24.0 * len(group.channels))
    check_memory(needed)


def _is_plain(file: Any, at: tuple[int, int]) -> bool:
    """Whether a channel holds one number for each instant, by what its block says."""
    channel = file.groups[at[0]].channels[at[1]]
    return channel.data_type in MDF_NUMBERS and not file.groups[at[0]].channel_dependencies[at[1]]


def _signal(file: Any, name: str, at: Sequence[tuple[int, int]], formulas: Formulas) -> Any:
    """Physical values of a channel at their instants."""
    signal = file.get(name)  # refuses a name that several groups have
    group, place = at[0]
    if (group, place) in formulas:
        signal.samples = formulas[group, place](signal.samples)
    master = (group, file.masters_db.get(group))
    if master in formulas:
        signal.timestamps = formulas[master](signal.timestamps)
    return signal


def check_mdf_blocks(path: Path) -> None:
    """Refuse a file whose lists never end, or whose data need more memory than the limit."""
    with path.open("rb") as file:
        if file.read(8).strip() not in (b"MDF", b"UnFinMF") or not file.read(8).startswith(b"4"):
            raise InputError("is not an MDF 4 file; save it as MDF 4")
        check_memory(_Blocks(file).needed())


class _Blocks:
    def __init__(self, file: BinaryIO) -> None:
        self.file = file

    def damaged(self, why: str) -> InputError:
        return InputError(f"is not an MDF file, or is damaged ({why}); record or copy it again")

    def block(self, at: int) -> tuple[bytes, list[int], int]:
        """Id, links and length of the data of a block."""
        self.file.seek(at)
        try:
            name, _, length, count = struct.unpack("<4sIQQ", self.file.read(24))
            if count > LINKS:
                raise self.damaged(f"a block has {count} links")
            links = list(struct.unpack(f"<{count}Q", self.file.read(8 * count)))
        except struct.error:
            raise self.damaged(f"there is no block at byte {at}") from None
        return name, links, length - 24 - 8 * count

    def chain(self, at: int) -> Iterator[list[int]]:
        """Links of the blocks of a list. The first link of each block leads to the next."""
        seen = set()
        while at:
            if at in seen:
                raise self.damaged("a list of blocks leads back into itself")
            seen.add(at)
            _, links, _ = self.block(at)
            if not links:
                raise self.damaged(f"the block at byte {at} has no links")
            yield links
            at = links[0]

    def needed(self) -> int:
        """Bytes of all data once they are decompressed."""
        _, head, _ = self.block(FIRST)
        for at in head[1:5]:  # history, hierarchy, attachments, events
            self.tree(at, MAX_DEPTH)
        total = 0
        for group in self.chain(head[0]):
            total += self.data(group[2], MAX_DEPTH)
            for channels in self.chain(group[1]):
                total += self.channels(channels[1], MAX_DEPTH)
        return total

    def tree(self, at: int, depth: int) -> None:
        for links in self.chain(at):
            if depth == 0:
                raise self.damaged("its lists are nested too deeply")
            if len(links) > 1 and links[1] and self.block(links[1])[0] == b"##CH":
                self.tree(links[1], depth - 1)

    def channels(self, at: int, depth: int) -> int:
        if depth == 0:
            raise self.damaged("channels are nested too deeply")
        total = 0
        for links in self.chain(at):
            if len(links) < 6:
                raise self.damaged("a channel lacks links")
            self.conversion(links[4], MAX_DEPTH)
            if links[5] and self.block(links[5])[0] != b"##CG":
                total += self.data(links[5], MAX_DEPTH)
            if links[1] and self.block(links[1])[0] == b"##CN":
                total += self.channels(links[1], depth - 1)
        return total

    def conversion(self, at: int, depth: int) -> None:
        if not at:
            return
        name, links, _ = self.block(at)
        if name == b"##CC":
            if depth == 0:
                raise self.damaged("conversions are nested too deeply")
            for inner in set(links[4:]):
                self.conversion(inner, depth - 1)

    def data(self, at: int, depth: int) -> int:
        """Bytes of the data that a block holds or lists."""
        if not at:
            return 0
        if depth == 0:
            raise self.damaged("its lists of data are nested too deeply")
        name, links, length = self.block(at)
        if name in DATA:
            return length
        if name == b"##DZ":
            return self.decompressed(at, links)
        if name == b"##HL":
            return self.data(links[0], depth - 1) if links else 0
        if name in (b"##DL", b"##LD"):
            sizes: dict[int, int] = {0: 0}
            total = 0
            for parts in self.chain(at):
                for part in parts[1:]:
                    if part not in sizes:
                        sizes[part] = self.data(part, depth - 1)
                    total += sizes[part]
            return total
        raise self.damaged(f"the block at byte {at} is no block of data")

    def decompressed(self, at: int, links: list[int]) -> int:
        """Announced length of a compressed block, which its content keeps to."""
        self.file.seek(at + 24 + 8 * len(links))
        try:
            _, kind, _, _, announced, length = struct.unpack("<2sBBIQQ", self.file.read(24))
        except struct.error:
            raise self.damaged(f"the block at byte {at} is cut off") from None
        if kind not in DEFLATE:
            raise InputError("has data compressed by another method than deflate; save it with deflate")
        check_memory(max(announced, length))
        if EXPANSION * length > announced:
            try:
                made = zlib.decompressobj().decompress(self.file.read(length), announced + 1)
            except zlib.error as error:
                raise self.damaged(f"a compressed block: {error}") from None
            if len(made) > announced:
                raise self.damaged("a compressed block is longer than it announces")
        return int(announced)
