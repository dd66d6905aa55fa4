"""Result of a study, read back as one table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError
from .run_study import damages_of, refuse_damaged, study_of

if TYPE_CHECKING:
    import pyarrow as pa


def read_table(directory: Path) -> pa.Table:
    """The table of all rows that are there, in the order of the runs. Raises InputError: there are none, or a part is damaged."""
    import pyarrow.dataset as ds

    files = _whole_parts(directory)
    if not files:
        raise InputError(f"{directory}: holds no runs yet; run the study first")
    return ds.dataset(files, format="parquet").to_table().sort_by("run")


def _whole_parts(directory: Path) -> list[str]:
    refuse_damaged(directory, damages_of(directory, study_of(directory)))
    return sorted(str(p) for p in directory.glob("part-*.parquet"))


def failures(directory: Path) -> list[str]:
    """Why runs have failed, each reason once for each of them."""
    import pyarrow.dataset as ds

    files = _whole_parts(directory)
    table = ds.dataset(files, format="parquet").to_table(columns=["error"], filter=ds.field("error") != "")
    return [str(reason) for reason in table["error"].to_pylist()]


def unit_of(table: pa.Table, name: str) -> str:
    """Unit of a column, ``"1"`` for a plain number; empty where it is not known."""
    return str((table.schema.field(name).metadata or {}).get(b"units", b"").decode())


def labelled(table: pa.Table, name: str) -> str:
    """A column's name with its unit."""
    unit = unit_of(table, name)
    return name if unit in ("", "1") else f"{name} [{unit}]"
