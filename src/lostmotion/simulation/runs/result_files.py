"""Files of results: NetCDF, CSV, Parquet. Each carries its scenario and can be run again."""

from __future__ import annotations

import errno
import io
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...atomic_writer import write_whole
from ...errors import InputError, need, prefixed
from ...inputs.argument_checks import checked
from ...inputs.hdf5_files import datasets
from ...inputs.memory_limits import RESULT, check_memory, read_text
from ...inputs.toml_files import in_short
from .results import labelled, recorded_variables, whole
from .switchings import ATTRIBUTE as SWITCHINGS
from .switchings import packed_again, switchings_of

if TYPE_CHECKING:
    import xarray

FORMATS = {".nc": "NetCDF", ".csv": "CSV", ".parquet": "Parquet"}
PARQUET_NUMBERS = ("DOUBLE", "FLOAT", "INT32", "INT64", "BOOLEAN")
PER_BYTE = 4  # bytes of memory for each byte of a result in CSV


def check_output(path: str | Path) -> Path:
    """The path, if a result can be written there by its ending and its directory."""
    path = Path(path)
    if path.suffix not in FORMATS:
        endings = ", ".join(f"{ending} ({name})" for ending, name in FORMATS.items())
        scenario = (
            "; a copy of a scenario is made by lostmotion new NAME -o FILE.toml" if path.suffix == ".toml" else ""
        )
        raise InputError(
            f"{path}: the ending {path.suffix or '(none)'} is not known; it must be one of {endings}{scenario}"
        )
    if os.path.isdir(path):
        raise InputError(f"{path}: is a directory; name a file")
    if not os.path.isdir(path.parent):
        raise InputError(f"{in_short(path)}: its directory does not exist; make it first")
    _need_library(path)
    return path


def _need_library(path: Path) -> None:
    if path.suffix == ".nc":
        need("h5netcdf", f"{path}: a NetCDF file", "netcdf")
    elif path.suffix == ".parquet":
        need("pyarrow", f"{path}: a Parquet file", "study")


@checked
def save(dataset: xarray.Dataset, path: str | Path) -> None:
    """Write a result with its energy ledger. `open_result` reads it back unchanged.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result of `simulate`.
    path : str or Path
        File with the ending ``.nc``, ``.csv`` or ``.parquet``.

    Returns
    -------
    None

    Raises
    ------
    InputError
        The dataset is no result, the ending is unknown, or the file cannot be written. Nothing half-written remains.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> with TemporaryDirectory() as folder:
    ...     lm.save(lm.simulate(lm.load("step-to-standstill")), Path(folder, "run.nc"))
    ...     print([path.name for path in Path(folder).iterdir()])
    ['run.nc']
    """
    if "time" not in dataset.coords or not any(v.name in dataset for v in recorded_variables(dataset.attrs)):
        raise InputError("this dataset is no result over time; give one of simulate, periodic_motion or open_result")
    path, dataset = check_output(path), whole(dataset)
    writers = {".nc": _write_netcdf, ".csv": _write_csv, ".parquet": _write_parquet}
    write_whole(path, lambda target: writers[path.suffix](dataset, target))


@checked
def open_result(path: str | Path) -> xarray.Dataset:
    """Read a result that `save` wrote.

    Parameters
    ----------
    path : str or Path
        File with the ending ``.nc``, ``.csv`` or ``.parquet``.

    Returns
    -------
    xarray.Dataset
        The result, with the same values and attributes as before `save`.

    Raises
    ------
    InputError
        The file is not such a result, or needs more memory than the limit.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> result = lm.simulate(lm.load("step-to-standstill"))
    >>> with TemporaryDirectory() as folder:
    ...     lm.save(result, Path(folder, "run.csv"))
    ...     same = lm.open_result(Path(folder, "run.csv"))
    >>> bool((same["load_speed"] == result["load_speed"]).all())
    True
    """
    path = Path(path)
    readers = {".nc": _read_netcdf, ".csv": _read_csv, ".parquet": _read_parquet}
    if path.suffix not in readers:
        raise InputError(
            f"{path}: the ending {path.suffix or '(none)'} is not known; it must be one of {', '.join(readers)}"
        )
    if not os.path.isfile(path):
        raise InputError(f"{in_short(path)}: there is no such file; check the name")
    _need_library(path)
    try:
        return readers[path.suffix](path)
    except InputError:
        raise
    except OSError as error:
        if error.strerror and error.errno in (errno.EACCES, errno.EPERM):
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None
        raise InputError(_damaged(path)) from None
    except Exception:  # whatever the format's library makes of a damaged file
        raise InputError(_damaged(path)) from None


def _damaged(path: Path) -> str:
    return f"{path}: is no {FORMATS[path.suffix]} file of a result, or is damaged or cut off; run the scenario again"


def _write_netcdf(dataset: xarray.Dataset, path: Path) -> None:
    """The result, and its switchings, if it has any, in a group of their own; periodic motions have none."""
    plain = dataset.drop_attrs(deep=False).assign_attrs({k: v for k, v in dataset.attrs.items() if k != SWITCHINGS})
    with io.BytesIO() as memory:  # the library's own writer leaves a half-open file behind when the disk is full
        plain.to_netcdf(memory, engine="h5netcdf", mode="w")
        if SWITCHINGS in dataset.attrs:
            switchings_of(dataset).to_netcdf(memory, engine="h5netcdf", mode="a", group=SWITCHINGS)
        path.write_bytes(memory.getvalue())


def _read_netcdf(path: Path) -> xarray.Dataset:
    import h5netcdf
    import h5py
    import xarray as xr

    with prefixed(path), h5py.File(path, "r") as raw:
        datasets(raw, RESULT, depth=1)
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        result = opened.load()
    with h5netcdf.File(path) as file:
        has_group = SWITCHINGS in file.groups
    if not has_group:
        return result
    with xr.open_dataset(path, engine="h5netcdf", group=SWITCHINGS) as opened:
        columns = {str(name): v for name, v in opened.load().items()}
    return result.assign_attrs({SWITCHINGS: packed_again(columns, result.attrs)})


def _header(dataset: xarray.Dataset) -> str:
    """The attributes, number of samples and switchings by columns, as JSON."""
    attributes = {k: v for k, v in dataset.attrs.items() if k != SWITCHINGS}
    header = {"attributes": attributes, "samples": dataset.sizes["time"]}
    if SWITCHINGS in dataset.attrs:
        header[SWITCHINGS] = {str(name): v.values.tolist() for name, v in switchings_of(dataset).items()}
    return json.dumps(header)


def _assemble(header: str, columns: dict[str, Any], path: Path) -> xarray.Dataset:
    try:
        meta = json.loads(header)
        written, time = meta["samples"], columns.pop("time")
    except (json.JSONDecodeError, KeyError):
        raise InputError(f"{path}: is no result of lostmotion; its header or its time column is missing") from None
    if len(time) != written:
        raise InputError(
            f"{path}: holds {len(time)} of the {written} samples that its header announces; it is cut off or changed; run the scenario again"
        )
    switchings = {SWITCHINGS: packed_again(meta[SWITCHINGS], meta["attributes"])} if SWITCHINGS in meta else {}
    attributes = meta["attributes"] | switchings
    return labelled(time, columns, attributes, recorded_variables(attributes))


def _columns(dataset: xarray.Dataset) -> dict[str, Any]:
    return {"time": dataset["time"].values} | {
        v.name: dataset[v.name].values for v in recorded_variables(dataset.attrs) if v.name in dataset
    }


def _write_csv(dataset: xarray.Dataset, path: Path) -> None:
    columns = _columns(dataset)
    units = {v.name: v.unit for v in recorded_variables(dataset.attrs)} | {"time": "s"}
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# lostmotion {_header(dataset)}\n")
        file.write(",".join(f"{name} [{units[name]}]" for name in columns) + "\n")
        for row in zip(*(c.tolist() for c in columns.values()), strict=True):
            file.write(",".join(map(repr, row)) + "\n")


def _read_csv(path: Path) -> xarray.Dataset:
    first, heading, *lines = read_text(path, per_byte=PER_BYTE, default=RESULT).splitlines(keepends=True)
    names = [cell.split(" [")[0] for cell in heading.strip().split(",")]
    if not first.startswith("# lostmotion "):
        raise InputError(f"{path}: is no result of lostmotion; its first line does not say so")
    if not lines or not lines[-1].endswith("\n"):
        raise InputError(_damaged(path))
    table = np.loadtxt(lines, delimiter=",", ndmin=2)
    return _assemble(first.removeprefix("# lostmotion "), dict(zip(names, table.T.copy(), strict=True)), path)


def _write_parquet(dataset: xarray.Dataset, path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table(_columns(dataset)).replace_schema_metadata({"lostmotion": _header(dataset)})
    with path.open("wb") as file:
        pq.write_table(table, file)


def _read_parquet(path: Path) -> xarray.Dataset:
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:
        about = file.metadata
        check_memory(16.0 * about.num_rows * about.num_columns, str(path), RESULT)
        if any(about.schema.column(k).physical_type not in PARQUET_NUMBERS for k in range(about.num_columns)):
            raise InputError(f"{path}: is no result of lostmotion; it has columns without numbers")
        table = file.read()
    header = (table.schema.metadata or {}).get(b"lostmotion", b"")
    return _assemble(header.decode(), {name: table[name].to_numpy() for name in table.column_names}, path)
