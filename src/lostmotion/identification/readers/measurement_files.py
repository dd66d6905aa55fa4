"""Logs in the formats of measuring tools: MATLAB, HDF5, Parquet, MDF 4, TDMS, each read by its library."""

import io
import math
import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, need
from ...inputs.hdf5_files import datasets
from ...inputs.limits import check_memory, memory_limit
from ...inputs.refusal_messages import did_you_mean, listed
from .channel_conversions import conversion_of
from .log import Channel, Log, as_number, as_refusal, quiet_ends, reason, warnings_of
from .log_tables import TIME_NAMES
from .mdf_blocks import check_mdf_blocks

MATLAB_NUMBERS = {*(f"{u}int{n}" for u in ("", "u") for n in (8, 16, 32, 64)), "double", "single", "char", "logical"}
COMPRESSED = 15  # type of an element of a MATLAB file
PIECE = 2**20  # [bytes] that are decompressed at once
ALGEBRAIC = 3  # type of a conversion of MDF 4
MDF_NUMBERS = range(6)  # data types of MDF 4: integers and floating-point numbers of both byte orders
LEVELS = 5  # of groups of HDF5 within each other
LONGEST_WORD = 65536  # [bytes] of an attribute of HDF5
WAVEFORM = {"wf_increment", "wf_start_offset"}  # properties of a TDMS channel that holds its time


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


def read_parquet_log(path: Path, time: str) -> Log:
    """Read a Parquet table; a field's metadata ``unit`` is the unit of its column, other metadata of the table the header.

    Columns without numbers are not read.
    """
    need("pyarrow", "Reading Parquet files", "identify")
    import pyarrow as pa
    import pyarrow.parquet as pq

    def is_read(kind: pa.DataType) -> bool:
        types = pa.types
        return bool(
            types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_timestamp(kind)
        )

    with as_refusal("is not a Parquet file"), pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        names = [field.name for field in schema if is_read(field.type)]
        check_memory(16.0 * len(names) * file.metadata.num_rows)
        table = file.read(names)
    units = {f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in schema}
    header = {k.decode(): v.decode() for k, v in (schema.metadata or {}).items() if not k.startswith(b"ARROW")}
    columns: dict[str, Any] = {}
    for name in table.column_names:
        column = table.column(name)
        if pa.types.is_timestamp(column.type):
            column = column.cast(pa.timestamp("ns")).cast(pa.int64())
            units[name] = "ns"
        columns[name] = column.to_numpy()
    log = log_of_variables(columns, units, time)
    return Log(
        log.name, log.time, log.channels, {**log.header, **{k: as_number(v) for k, v in header.items()}}, log.notes
    )


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


def read_tdms_log(path: Path, time: str) -> Log:
    """Read a TDMS file by npTDMS: the channels of all groups; their time is a channel, or increments of the waveform.

    Channels without numbers are not read.
    """
    need("nptdms", "Reading TDMS files", "identify")
    import nptdms

    variables: dict[str, Any] = {}
    units = {}
    with (
        as_refusal("is not a TDMS file"),
        warnings_of("nptdms") as said,
        path.open("rb") as stream,
        nptdms.TdmsFile.open(stream) as file,
    ):
        channels = [c for group in file.groups() for c in group.channels() if c.dtype.kind in "biuf"]
        check_memory(sum(float(len(c)) * (c.dtype.itemsize + 8.0) for c in channels))
        for channel in channels:
            variables[channel.name] = np.asarray(channel[:])
            units[channel.name] = str(channel.properties.get("unit_string", ""))
            if channel.properties.keys() >= WAVEFORM and not any(name in variables for name in TIME_NAMES):
                variables["time"] = channel.time_track()
        properties = file.properties
    variables |= {name: value for name, value in properties.items() if isinstance(value, int | float | str)}
    log = log_of_variables(variables, units, time)
    return log.noted(f"may be cut off or damaged; npTDMS reports: {said[0]}") if said else log


def log_of_variables(variables: Mapping[str, Any], units: Mapping[str, str], time: str) -> Log:
    """The log of named values: vectors and columns of matrices of the length of the time are channels, single values the header.

    The columns of a matrix ``x`` are ``x column 1``, ``x column 2`` and so on. If the file holds nothing but one matrix, its first column
    is the time.
    """
    arrays = {n: np.asarray(v) for n, v in variables.items() if np.ndim(v) > 0 and np.asarray(v).dtype.kind in "biuf"}
    vectors = {n: v for n, v in arrays.items() if v.ndim == 1}
    matrices = {n: v for n, v in arrays.items() if v.ndim == 2 and v.shape[0] > v.shape[1]}
    of_matrix = {name: [f"{name} column {k + 1}".strip() for k in range(x.shape[1])] for name, x in matrices.items()}
    notes = []
    name = time or _time_name(vectors)
    if not name and not vectors and len(matrices) == 1:
        name = next(iter(of_matrix.values()))[0]
        notes.append(f"has no vector of the time; {name} is taken for it")
    clock = next((vectors[n] for n in vectors if n == name), None)
    if clock is None:
        clock = next((matrices[n][:, c.index(name)] for n, c in of_matrix.items() if name in c), None)
    if clock is None:
        known = [*vectors, *(column for columns in of_matrix.values() for column in columns)]
        meant = did_you_mean(name or "time", known, f"its vectors are {listed(known) or 'none'}")
        raise InputError(f"has no vector of the time{f' {name}' if name else ''}; name it with logs.time; {meant}")
    values = clock.astype(float) * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}.get(units.get(name, ""), 1.0)
    if units.get(name) == "ns":
        whole = clock.astype(np.int64) if clock.dtype.kind in "iu" else clock
        values = 1e-9 * (whole - whole[0]).astype(float)
    columns = dict(vectors)
    for n, x in matrices.items():
        if len(x) == len(values):
            columns |= {column: x[:, k] for k, column in enumerate(of_matrix[n])}
    check_memory(8.0 * sum(v.size for v in columns.values()))
    channels = {
        n: Channel(v.astype(float), units.get(n, "")) for n, v in columns.items() if n != name and len(v) == len(values)
    }
    header = {n: as_number(v) for n, v in variables.items() if np.ndim(v) == 0 and not isinstance(v, bytes)}
    other = [
        f"{n} ({' x '.join(map(str, v.shape))})"
        for n, v in arrays.items()
        if len(v) != len(values) or not (v.ndim == 1 or n in matrices)
    ]
    if other:
        notes.append(f"arrays not of the length of {name} ({len(values)}) are left out: {listed(other)}")
    plain = {k: v for k, v in header.items() if isinstance(v, int | float | str)}
    return Log("", values, channels, plain, tuple(notes))


def _time_name(vectors: Mapping[str, Any]) -> str:
    """Name of the vector that is the time by its name, without the group that it is in; empty if none or several are."""
    for wanted in TIME_NAMES:
        found = [name for name in vectors if name.rpartition("/")[2].rpartition(".")[2].lower() == wanted]
        if found:
            return found[0] if len(found) == 1 else ""
    return ""
