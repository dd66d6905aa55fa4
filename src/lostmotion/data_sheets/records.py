"""The records of the catalogue: shipped and own data sheets."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias, get_args

from ..errors import InputError, prefixed
from ..inputs.argument_checks import checked
from ..inputs.refusal_messages import names_like, shown, unknown_key
from ..inputs.toml_files import is_in_file, read_toml
from .accessory_sheets import AmplifierSheet, BrakeSheet
from .actuator_sheet import ActuatorSheet
from .gearbox_sheet import GearboxSheet
from .linear_sheets import BeltSheet, LinearMotorSheet, RackSheet, ScrewSheet
from .motor_sheet import MotorSheet

Sheet: TypeAlias = (
    GearboxSheet
    | MotorSheet
    | ScrewSheet
    | RackSheet
    | BeltSheet
    | LinearMotorSheet
    | ActuatorSheet
    | BrakeSheet
    | AmplifierSheet
)
Kind: TypeAlias = type[Sheet]
Entry: TypeAlias = tuple[Kind, dict[str, Any], str]
# The table of a record in a sheet file has the name of its sheet, such as linear_motor.
KINDS: dict[str, Kind] = {
    re.sub("(?<=[a-z])(?=[A-Z])", "_", kind.__name__.removesuffix("Sheet")).lower(): kind for kind in get_args(Sheet)
}


# Keys of a sheet file that hold for all of its records.
COMMON = ("kind", "manufacturer", "note")


@checked
def catalogue() -> tuple[Sheet, ...]:
    """Return all records that are shipped: gearboxes, motors, screws, racks, belts, linear motors, actuators, brakes and amplifiers.

    Returns
    -------
    tuple of Sheet
        The data sheets. ``lm.gearbox(sheet.name)`` and ``lm.motor(sheet.name)`` make parts of them.

    Examples
    --------
    >>> import lostmotion as lm
    >>> names = [sheet.name for sheet in lm.catalogue()]
    >>> "schaeffler-rt1-h-20-100" in names
    True
    """
    return _shipped()


@cache
def _shipped() -> tuple[Sheet, ...]:
    found = [_made(*entry) for file in _texts() for entry in _entries_of(file)]
    order = list(KINDS)
    return tuple(sorted(found, key=lambda record: order.index(table_of(record))))


def table_of(record: Sheet) -> str:
    """The table that a record has in a sheet file, such as ``"gearbox"``."""
    return next(table for table, kind in KINDS.items() if isinstance(record, kind))


def called(table: str) -> str:
    """A kind of record in a sentence, such as ``"a linear motor"``."""
    name = table.replace("_", " ")
    return f"{'an' if name[0] == 'a' else 'a'} {name}"


@cache
def _texts() -> dict[str, str]:
    """The files of the catalogue, by their names."""
    directory = files("lostmotion") / "catalogue"
    found = sorted((f for f in directory.iterdir() if f.name.endswith(".toml")), key=lambda f: f.name)
    return {f.name: f.read_text(encoding="utf-8") for f in found}


@cache
def _entries_of(file: str) -> tuple[Entry, ...]:
    """Entries from which the records of a catalogue file are made."""
    return tuple(_entries(tomllib.loads(_texts()[file]), file))


@cache
def _named(name: str) -> Sheet | None:
    """The shipped record of a name, in any case. Only files whose text has the name are parsed, and no other record is made."""
    name = name.lower()
    near = (entry for file, text in _texts().items() if f'"{name}"' in text for entry in _entries_of(file))
    return next((_made(*entry) for entry in near if entry[1].get("name") == name), None)


def read_sheets(path: Path) -> list[Sheet]:
    """The records of a sheet file."""
    return parse_sheets(read_toml(path, "a data sheet"), str(path))


def parse_sheets(data: dict[str, Any], where: str) -> list[Sheet]:
    """Records from the contents of a sheet file."""
    records = [_made(*entry) for entry in _entries(data, where)]
    if not records:
        raise InputError(f"{where}: holds no record; add a table such as [[gearbox]] or [[screw]]")
    return records


def _entries(data: dict[str, Any], where: str) -> Iterator[Entry]:
    """The kind of each record of a sheet file, its fields, and what it is called in messages."""
    known = {*KINDS, *COMMON, "source", "gap"}
    for key in data:
        if key not in known:
            raise InputError(unknown_key(key, known), key, where=where)
    common = {key: data[key] for key in COMMON if key in data}
    for table, kind in KINDS.items():
        for entry in _tables(data, table, where):
            which = f"{where}: {table} {entry.get('name', '(no name)')}"
            fields = {**common, **entry}
            for key in ("source", "gap"):  # sources and gaps of the record, then of the whole file
                fields.pop(key, None)
                fields[f"{key}s"] = [*_tables(entry, key, which), *_tables(data, key, where)]
            yield kind, fields, which


def _made(kind: Kind, fields: Mapping[str, Any], which: str) -> Sheet:
    with prefixed(which):
        return kind(**fields)


def _tables(data: Mapping[str, Any], key: str, where: str) -> list[Mapping[str, Any]]:
    """The tables of an array of tables; none if the key is not there."""
    entries = data.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, Mapping) for entry in entries):
        raise InputError(f"{shown(entries)} must be tables; write [[{key}]] with double brackets", key, where=where)
    return entries


def read_again(path: Path) -> tuple[Sheet, ...]:
    """The records of a sheet file, read only once as long as it does not change."""
    try:
        status = path.stat()
    except (OSError, ValueError):  # which reading says in one line
        return tuple(read_sheets(path))
    return _kept_sheets(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=256)
def _kept_sheets(path: Path, _modified: int, _size: int) -> tuple[Sheet, ...]:
    return tuple(read_sheets(path))


def _in_file(reference: str, table: str) -> Sheet:
    """The record that a reference to a file means."""
    file, _, name = reference.partition("#")
    own = [r for r in read_again(Path(file)) if isinstance(r, KINDS[table])]
    if name:
        named = [r for r in own if r.name == name.lower()]
        if len(named) == 1:
            return named[0]
        hint = names_like(name, [r.name for r in own], "read the file") if own else "it has none at all"
        raise InputError(f"{file}: has {len(named) or 'no'} {table.replace('_', ' ')} {shown(name)}; {hint}")
    if len(own) != 1:
        found = f"{len(own)} of them" if own else "none"
        remedy = f"choose one, such as {file}#{own[0].name}" if own else "name a file with one"
        raise InputError(f"{file}: {called(table)} is wanted here, and this file has {found}; {remedy}")
    return own[0]


def find(reference: str, *tables: str) -> Sheet:
    """Find the record of a name, or a record in a file: the only one (``sheets.toml``), or that of a name (``sheets.toml#name``).

    tables: kinds that are possible, keys of `KINDS` such as ``"gearbox"``.

    Raises InputError: there is none.
    """
    wanted = " or ".join(table.replace("_", " ") for table in tables)
    if not isinstance(reference, str):
        raise InputError(f"{wanted}: {shown(reference)} must be the name of a record, or of a file with one")
    if is_in_file(reference):
        of_file = {table_of(record) for record in read_again(Path(reference.partition("#")[0]))}
        return _in_file(reference, next((table for table in tables if table in of_file), tables[0]))
    record = _named(reference)
    if record is None:
        same = [r.name for r in catalogue() if table_of(r) in tables]
        hint = names_like(reference, same, "`lostmotion catalogue` lists them")
        raise InputError(f"{wanted} {shown(reference)} is not in the catalogue; {hint}")
    if table_of(record) not in tables:
        other = f"{reference} is {called(table_of(record))}; {called(wanted)} is wanted here"
        raise InputError(f"{other}; `lostmotion catalogue` lists them")
    return record
