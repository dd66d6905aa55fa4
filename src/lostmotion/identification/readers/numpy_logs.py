"""Logs of NumPy: one array (NPY) or several (NPZ); nothing is unpickled."""

import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...errors import InputError
from ...inputs.memory_limits import check_memory
from ...inputs.zip_files import members
from .log import Log, as_refusal
from .named_arrays import log_of_variables

HEADER = 64_000  # [bytes] of a description of an array


def read_numpy_log(path: Path, time: str) -> Log:
    """Read an NPZ or NPY file: vectors of one length and columns of matrices are channels, single numbers and words the header.

    The fields of a structured array are channels by their names. Columns of the array of an NPY file are ``column 1``,
    ``column 2`` and so on.
    """
    variables: dict[str, Any] = {}
    units: dict[str, str] = {}
    others: list[str] = []
    with as_refusal("is not a file of NumPy", "; save it with numpy.save or numpy.savez"):
        if path.suffix.lower() == ".npy":
            with path.open("rb") as file:
                arrays = {"": _array("", file, path.stat().st_size)}
        else:
            with zipfile.ZipFile(path) as archive:
                arrays = {}
                for member, about in members(archive).items():
                    name = member.removesuffix(".npy")
                    with archive.open(member) as stream:
                        arrays[name] = _array(name, stream, about.file_size)
    for name, array in arrays.items():
        for own, values in _fields(name, array).items():
            if values.dtype.kind in "mM":
                variables[own], units[own] = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64), "ns"
            elif values.dtype.kind in "biuf":
                variables[own] = values
            elif values.dtype.kind == "U" and values.ndim == 0:
                variables[own] = str(values)
            else:
                others.append(own)
    log = log_of_variables(variables, units, time)
    return log.noted(f"arrays that are no numbers are left out: {', '.join(others)}") if others else log


def _array(name: str, file: IO[bytes], size: int) -> np.ndarray:
    """An array of a file, if its description tells of numbers, and of no more than the file holds."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, by_columns, kind = read(file, max_header_size=HEADER)
    if kind.hasobject:
        raise InputError("holds Python objects, which are not read; save arrays of numbers", where=name)
    if any(length < 0 for length in shape):
        raise ValueError(f"its shape is {shape}")
    needed = math.prod(shape) * kind.itemsize
    check_memory(float(needed), name)
    if needed > size - file.tell():
        raise InputError(
            f"announces {needed} bytes and holds {size - file.tell()}; it may have been cut off, copy it again",
            where=name,
        )
    values = np.frombuffer(file.read(needed), dtype=kind)
    return values.reshape(shape, order="F" if by_columns else "C")


def _fields(name: str, array: np.ndarray) -> dict[str, np.ndarray]:
    """The fields of a structured array, the array itself of any other."""
    if array.dtype.names is None:
        return {name: np.squeeze(array) if array.ndim > 1 else array}
    return {f"{name}.{part}" if name else part: array[part] for part in array.dtype.names}
