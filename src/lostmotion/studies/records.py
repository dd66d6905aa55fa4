"""Records of the catalogue as what a study varies: which keys take names, and which records fit a filter."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any

from ..data_sheets.components import Conditions
from ..data_sheets.records import KINDS, catalogue, find
from ..data_sheets.sheet import in_current_words
from ..errors import InputError
from ..inputs.schema import unit_in_schema
from ..inputs.validation import shown
from ..simulation.scenario import Scenario, from_tables
from .units import in_si

TABLE_OF = {key: table for table in KINDS for key in (table, f"{table}.from")}
"""keys that take the name of a record, and its kind"""
CONDITIONS = tuple(f"gearbox.{name}" for name in Conditions.model_fields)
"""keys that hold beside the name of a record only"""


def names_that_fit(table: str, wanted: Mapping[str, Any]) -> list[str]:
    """The names of all records that a filter lets through.

    Parameters
    ----------
    table
        ``"gearbox"`` or ``"motor"``.
    wanted
        For each datum of a record a text with ``*`` for anything (``kind``, ``manufacturer``, ``name``), or minimum and maximum. A
        record that lacks the datum does not fit.

    Raises
    ------
    ValueError
        A key is no datum of such records, its value is neither, or nothing fits.
    """
    schema = KINDS[table].model_json_schema()["properties"]
    known = [key for key, node in schema.items() if unit_in_schema(node) is not None or _is_text(key)]
    bounds = {}
    wanted = in_current_words(wanted)
    for key, value in wanted.items():
        if key not in known:
            raise ValueError(
                f"has catalogue.{key}, which is no datum of a {table}; they are {', '.join(sorted(known))}"
            )
        if _is_text(key):
            if not isinstance(value, str):
                raise ValueError(
                    f"has catalogue.{key} = {shown(value)}; it must be a text in quotes, * standing for anything"
                )
            continue
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise ValueError(f"has catalogue.{key} = {shown(value)}; it must be a list of minimum and maximum")
        try:
            bounds[key] = [float(x) for x in in_si(value, unit_in_schema(schema[key]))]
        except (TypeError, ValueError) as error:
            raise ValueError(f"has catalogue.{key} = {shown(value)}: {error}") from None
        if not bounds[key][0] <= bounds[key][1]:
            raise ValueError(f"has catalogue.{key} = {shown(value)}, which is reversed; the least value comes first")
    found = []
    for record in catalogue():
        if not isinstance(record, KINDS[table]):
            continue
        texts = all(fnmatchcase(str(getattr(record, k)), v) for k, v in wanted.items() if _is_text(k))
        numbers = {key: getattr(record, key) for key in bounds}
        if texts and all(x is not None and bounds[k][0] <= x <= bounds[k][1] for k, x in numbers.items()):
            found.append(record.name)
    if not found:
        raise ValueError(f"has a catalogue filter that no {table} fits; `lostmotion catalogue` lists them")
    return found


def _is_text(key: str) -> bool:
    return key in ("name", "kind", "manufacturer")


def check_names(table: str, names: Any) -> None:
    """Sees that all are names of records, or of files with one.

    Raises
    ------
    ValueError
        One is not; the message says what may have been meant.
    """
    if not isinstance(names, list | tuple):
        raise ValueError(f"has values = {shown(names)}; it must be a list of names")
    for name in names:
        if not isinstance(name, str):
            raise ValueError(f"has the value {shown(name)}, which is no name of a {table}")
        find(name, table)


def with_records(written: Mapping[str, Any], changes: Mapping[str, Any]) -> Scenario:
    """The scenario of tables in which records, and the conditions of their use, are others.

    What the tables give beside `from` holds for every record; of a table without `from` the record takes the place.

    Raises
    ------
    InputError
        A record lacks what a run needs, or a value cannot be used.
    """
    tables = dict(written)
    for key, value in changes.items():
        table, _, name = key.partition(".")
        own = tables.get(table)
        beside = {"from": own} if isinstance(own, str) else dict(own) if isinstance(own, dict) and "from" in own else {}
        if key not in TABLE_OF and not beside:
            raise InputError(f"{key} belongs beside `from`, but the {table} of the base is written out")
        tables[table] = beside | {"from" if key in TABLE_OF else name: value}
    return from_tables(tables)
