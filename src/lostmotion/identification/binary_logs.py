"""Logs in the formats of measuring tools: MATLAB, Parquet, MDF 4, TDMS, each read by its library."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, need
from ..inputs.validation import did_you_mean
from .logs import Channel, Log, as_number

TIME_NAMES = ("time", "t", "timestamp", "times", "tm")


def read_mat_log(path: Path, *, time: str = "") -> Log:
    """Of a MATLAB file: vectors of one length are channels, single numbers and words the header.

    Version 7.3 is read by h5py, older ones by scipy.

    Raises
    ------
    InputError
    """
    variables = _hdf5_variables(path) if _begins_with(path, b"MATLAB 7.3") else _mat5_variables(path)
    return _of_variables(path, variables, {}, time)


def _begins_with(path: Path, text: bytes) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(text)) == text
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None


def _mat5_variables(path: Path) -> dict[str, Any]:
    need("scipy", "Reading MATLAB files", "identify")
    import scipy.io

    try:
        data = scipy.io.loadmat(str(path), squeeze_me=True)
    except Exception as error:  # the library raises what its parts raise
        raise InputError(f"{path}: is not a MATLAB file ({error}); save it with -v7 or -v7.3") from None
    return {name: value for name, value in data.items() if not name.startswith("__")}


def _hdf5_variables(path: Path) -> dict[str, Any]:
    need("h5py", "Reading MATLAB 7.3 files", "identify")
    import h5py

    found: dict[str, Any] = {}
    try:
        with h5py.File(path, "r") as file:
            for name, node in file.items():
                if isinstance(node, h5py.Dataset):
                    value = np.squeeze(node[()])
                    text = node.attrs.get("MATLAB_class", b"") == b"char"
                    found[name] = "".join(map(chr, np.atleast_1d(value))) if text else value
    except OSError as error:
        raise InputError(f"{path}: is not a MATLAB 7.3 file ({error})") from None
    return found


def read_parquet_log(path: Path, *, time: str = "") -> Log:
    """Of a Parquet table; a field's metadata ``unit`` is the unit of its column, other metadata of the table the header.

    Raises
    ------
    InputError
    """
    need("pyarrow", "Reading Parquet files", "identify")
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: is not a Parquet file ({error})") from None
    units = {f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in table.schema}
    header = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items() if not k.startswith(b"ARROW")}
    columns: dict[str, Any] = {}
    for name in table.column_names:
        column = table.column(name)
        if pa.types.is_timestamp(column.type):
            column = column.cast(pa.timestamp("ns")).cast(pa.int64())
            units[name] = "ns"
        columns[name] = column.to_numpy()
    log = _of_variables(path, columns, units, time)
    return Log(
        log.name, log.time, log.channels, {**log.header, **{k: as_number(v) for k, v in header.items()}}, log.notes
    )


def read_mdf_log(path: Path, *, time: str = "") -> Log:
    """Of an MDF 4 file by asammdf: all channels at the instants of the channel `time`, or of the first.

    Raises
    ------
    InputError
    """
    need("asammdf", "Reading MDF files", "identify")
    import asammdf

    try:
        with asammdf.MDF(path) as file:
            masters = {file.groups[k].channels[m].name for k, m in file.masters_db.items()}
            signals = [file.get(name) for name in file.channels_db if name not in masters]
    except Exception as error:  # the library raises what its parts raise
        raise InputError(f"{path}: is not an MDF file that asammdf reads ({error})") from None
    numbers = [signal for signal in signals if signal.samples.dtype.kind in "biuf" and signal.samples.ndim == 1]
    if not numbers:
        raise InputError(f"{path}: has no channel of numbers")
    first = next((signal for signal in numbers if signal.name == time), numbers[0])
    clock = np.asarray(first.timestamps, dtype=float)
    channels = {
        s.name: Channel(np.interp(clock, s.timestamps, s.samples.astype(float)), str(s.unit or "")) for s in numbers
    }
    return Log(path.name, clock - clock[0], channels)


def read_tdms_log(path: Path, *, time: str = "") -> Log:
    """Of a TDMS file by npTDMS: the channels of all groups; their time is a channel, or increments of the waveform.

    Raises
    ------
    InputError
    """
    need("nptdms", "Reading TDMS files", "identify")
    import nptdms

    try:
        file = nptdms.TdmsFile.read(path)
    except Exception as error:  # the library raises what its parts raise
        raise InputError(f"{path}: is not a TDMS file ({error})") from None
    variables: dict[str, Any] = {}
    units = {}
    for group in file.groups():
        for channel in group.channels():
            variables[channel.name] = np.asarray(channel[:])
            units[channel.name] = str(channel.properties.get("unit_string", ""))
            if "wf_increment" in channel.properties and not any(name in variables for name in TIME_NAMES):
                variables["time"] = channel.time_track()
    variables |= {name: value for name, value in file.properties.items() if isinstance(value, int | float | str)}
    return _of_variables(path, variables, units, time)


def _of_variables(path: Path, variables: Mapping[str, Any], units: Mapping[str, str], time: str) -> Log:
    """Vectors of the length of the time are channels, single values the header."""
    vectors = {n: np.asarray(v) for n, v in variables.items() if np.ndim(v) == 1 and np.asarray(v).dtype.kind in "biuf"}
    lower = {name.lower(): name for name in vectors}
    name = time or next((lower[n] for n in TIME_NAMES if n in lower), "")
    if name not in vectors:
        meant = did_you_mean(name or "time", vectors, f"its vectors are {', '.join(vectors) or 'none'}")
        raise InputError(
            f"{path}: has no vector of the time{f' {name}' if name else ''}; name it with logs.time; {meant}"
        )
    values = vectors[name].astype(float) * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}.get(units.get(name, ""), 1.0)
    if units.get(name) == "ns":
        values = values - values[0]
    channels = {
        n: Channel(v.astype(float), units.get(n, "")) for n, v in vectors.items() if n != name and len(v) == len(values)
    }
    header = {n: as_number(v) for n, v in variables.items() if np.ndim(v) == 0 and not isinstance(v, bytes)}
    other = [f"{n} ({len(v)})" for n, v in vectors.items() if len(v) != len(values)]
    log = Log(path.name, values, channels, {k: v for k, v in header.items() if isinstance(v, int | float | str)})
    return (
        log.noted(f"vectors not of the length of {name} ({len(values)}) are left out: {', '.join(other)}")
        if other
        else log
    )
