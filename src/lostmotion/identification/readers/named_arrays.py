"""Logs of named arrays, as MATLAB, HDF5, Parquet, TDMS and NumPy files hold them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...errors import InputError
from ...inputs.memory_limits import check_memory
from ...inputs.refusal_messages import did_you_mean, listed
from .log import Channel, Log, as_number
from .log_tables import TIME_NAMES


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
