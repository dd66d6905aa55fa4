"""Logs in Parquet tables, read by pyarrow."""

from pathlib import Path
from typing import Any

from ...errors import need
from ...inputs.memory_limits import check_memory
from .log import Log, as_number, as_refusal
from .named_arrays import log_of_variables


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
