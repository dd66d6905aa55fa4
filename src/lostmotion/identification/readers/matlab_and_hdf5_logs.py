"""Logs in MATLAB files, by scipy or h5py, and in HDF5 files, by h5py."""

import io
import math
import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import need
from ...inputs.hdf5_files import datasets
from ...inputs.memory_limits import check_memory, memory_limit
from .log import Log, as_number, as_refusal
from .named_arrays import log_of_variables

MATLAB_NUMBERS = {*(f"{u}int{n}" for u in ("", "u") for n in (8, 16, 32, 64)), "double", "single", "char", "logical"}
COMPRESSED = 15  # type of an element of a MATLAB file
PIECE = 2**20  # [bytes] that are decompressed at once
LEVELS = 5  # of groups of HDF5 within each other
LONGEST_WORD = 65536  # [bytes] of an attribute of HDF5


def read_mat_log(path: Path, time: str) -> Log:
    """Read a MATLAB file: vectors of one length and columns of matrices are channels, single numbers and words the header.

    Version 7.3 is read by h5py, older ones by scipy.
    """
    if not _begins_with(path, b"MATLAB 7.3"):
        return log_of_variables(_mat5_variables(path), {}, time)
    found, units, _ = _hdf5_variables(path, matlab=True)
    return log_of_variables(found, units, time)


def read_hdf5_log(path: Path, time: str) -> Log:
    """Read an HDF5 file: datasets of one length are channels, attributes of the file and single values the header.

    The attribute ``units`` or ``unit`` of a dataset is its unit. Datasets in groups are named ``GROUP/NAME``; attributes of the group of
    the time belong to the header too.
    """
    found, units, attributes = _hdf5_variables(path, matlab=False)
    log = log_of_variables(found, units, time)
    return replace(log, header={**log.header, **attributes})


def _begins_with(path: Path, text: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(text)) == text


def _mat5_variables(path: Path) -> dict[str, Any]:
    need("scipy", "Reading MATLAB files", "identify")
    import scipy.io

    check_memory(_mat5_bytes(path))
    with as_refusal("is not a MATLAB file", "; save it with -v7 or -v7.3"):
        listed = [(name, shape) for name, shape, kind in scipy.io.whosmat(str(path)) if kind in MATLAB_NUMBERS]
        check_memory(8.0 * sum(math.prod(shape) for _, shape in listed))
        data = scipy.io.loadmat(str(path), squeeze_me=True, variable_names=[name for name, _ in listed])
    return {name: value for name, value in data.items() if not name.startswith("__")}


def _mat5_bytes(path: Path) -> int:
    """Bytes that the compressed elements of a file hold, at most one more than the memory limit; 0 of other versions."""
    total, limit = 0, memory_limit()
    with path.open("rb") as file:
        order = {b"IM": "<", b"MI": ">"}.get(file.read(128)[126:])
        while order and len(tag := file.read(8)) == 8:
            kind, length = struct.unpack(f"{order}II", tag)
            if kind != COMPRESSED:
                file.seek(length, io.SEEK_CUR)
                continue
            stream = zlib.decompressobj()
            content = file.read(length)
            try:
                while content and total <= limit:
                    total += len(stream.decompress(content, PIECE))
                    content = stream.unconsumed_tail
            except zlib.error:
                return total  # the library reports it
    return total


def _hdf5_variables(path: Path, *, matlab: bool) -> tuple[dict[str, Any], dict[str, str], dict[str, Any]]:
    """(values, units, attributes of the file) by name."""
    kind = "MATLAB 7.3" if matlab else "HDF5"
    need("h5py", f"Reading {kind} files", "identify")
    import h5py

    found: dict[str, Any] = {}
    units: dict[str, str] = {}
    with as_refusal(f"is not a {kind} file"), h5py.File(path, "r") as file:
        for name, node in datasets(file, depth=0 if matlab else LEVELS).items():
            if matlab and node.dtype.kind in "biuf":
                value = np.squeeze(node[()].T)
                text = node.attrs.get("MATLAB_class", b"") == b"char"
                found[name] = "".join(map(chr, np.atleast_1d(value))) if text else value
            elif node.dtype.names is not None:
                found |= {f"{name}.{part}": node[part] for part in node.dtype.names if node.dtype[part].kind in "biuf"}
            elif node.dtype.kind in "biuf" or node.shape == ():
                found[name] = _text(node[()])
            if not matlab:
                own = _attributes(node)
                units[name] = str(own.get("units", own.get("unit", "")))
        attributes = {} if matlab else _attributes(file)
    return found, units, attributes


def _text(value: Any) -> Any:
    return value.decode(errors="replace") if isinstance(value, bytes) else value


def _attributes(node: Any) -> dict[str, Any]:
    """Single numbers and words among the attributes of a group or a dataset."""
    found = {}
    for name in node.attrs:
        about = node.attrs.get_id(name)
        if math.prod(about.shape or ()) == 1 and about.dtype.itemsize <= LONGEST_WORD and about.dtype.kind in "biufSO":
            value = node.attrs[name]
            value = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
            value = as_number(_text(value))
            if isinstance(value, int | float | str):
                found[name] = value
    return found
