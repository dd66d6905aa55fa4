"""Resources that an HDF5 file requires of its reader, checked before any data are read."""

import zlib
from pathlib import Path
from typing import Any

from ..errors import InputError
from .memory_limits import LOG, check_memory

DEFLATE, SHUFFLE, CHECKSUM, LZF = 1, 2, 3, 32000
FILTERS = {DEFLATE, SHUFFLE, CHECKSUM, LZF}
EXPANSION = 1032  # bytes that deflate makes of one, at most


def datasets(file: Any, limit: int = LOG, depth: int = 0) -> dict[str, Any]:
    """Datasets of an open file by their paths, if all of them fit into memory.

    file: ``h5py.File``.
    limit: default of the memory limit [bytes].
    depth: levels of groups below the root whose datasets are wanted.
    """
    found: dict[str, Any] = {}
    _collect(file, "", found, depth, set())
    texts = sum(node.size for node in found.values() if node.dtype.hasobject)  # each may be as long as the file
    check_memory(texts * Path(file.filename).stat().st_size + sum(map(_needed, found.values())), "", limit)
    for node in found.values():
        _check_filters(node, limit)
    return found


def _collect(group: Any, where: str, found: dict[str, Any], depth: int, seen: set[int]) -> None:
    """Datasets of a group; one that several names lead to is read once, so that groups within themselves have an end."""
    import h5py

    address = h5py.h5o.get_info(group.id).addr
    if address in seen:
        return
    seen.add(address)
    for name in group:
        at = f"{where}{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InputError(f"{at}: is a link to another place or file; save the data itself")
        node = group[name]
        if isinstance(node, h5py.Group) and depth > 0:
            _collect(node, f"{at}/", found, depth - 1, seen)
        elif isinstance(node, h5py.Group) and where:
            raise InputError(f"{at}: is a group within too many others; save its datasets nearer to the root")
        elif isinstance(node, h5py.Dataset):
            if node.is_virtual or node.external:
                raise InputError(f"{at}: refers to data in other files; save the data itself")
            found[at] = node


def _needed(node: Any) -> float:
    """Bytes that a dataset needs, and bytes of one of its chunks while it is decompressed."""
    chunk = 1.0
    for length in node.chunks or (0,):
        chunk *= length
    return float(node.nbytes + chunk * node.dtype.itemsize)


def _check_filters(node: Any, limit: int) -> None:
    """Refuse chunks that decompress to more than they announce; the library would take memory for them without limit."""
    properties = node.id.get_create_plist()
    used = {properties.get_filter(k)[0] for k in range(properties.get_nfilters())}
    if not used <= FILTERS:
        raise InputError(f"{node.name}: is compressed by a filter other than deflate; save it with deflate")
    if DEFLATE not in used:
        return
    for k in range(node.id.get_num_chunks()):
        chunk = node.id.get_chunk_info(k)
        check_memory(chunk.size, node.name, limit)
        _, content = node.id.read_direct_chunk(chunk.chunk_offset)
        announced = _needed(node) + 4.0  # of a checksum
        if len(content) * EXPANSION > announced and not chunk.filter_mask:
            try:
                made = len(zlib.decompressobj().decompress(content, int(announced) + 1))
            except zlib.error:
                continue  # the library reports it
            if made > announced:
                raise InputError(f"{node.name}: has a chunk that is longer than it announces; save it again")
