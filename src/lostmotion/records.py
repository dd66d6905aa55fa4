"""The component catalogue: shipped and own data sheets, and the parts made of them."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from pydantic import ValidationError

from .data_sheet import SCALARS, GearboxSheet, MotorSheet
from .errors import InputError
from .loss_map_builder import BuiltMap, build_loss_map
from .parts import Gearbox, Motor
from .quantities import Angle, NotNegative, Number, Part, Positive, Temperature
from .toml_files import read_toml

KINDS: dict[str, type[GearboxSheet] | type[MotorSheet]] = {"gearbox": GearboxSheet, "motor": MotorSheet}
# Keys of a sheet file that hold for all of its records.
COMMON = ("kind", "maker", "note")


class Conditions(Part):
    """Under which conditions a record is used: keys of `[gearbox]` beside `from`."""

    temperature: Temperature | None = None
    """of the lubricant; left out, that of the figures"""
    added_backlash: Annotated[Angle, NotNegative] = 0.0
    """wear"""
    loss_factor: Annotated[Number, Positive] = 1.0
    """wear"""


@cache
def catalogue() -> tuple[GearboxSheet | MotorSheet, ...]:
    """All records that are shipped, gearboxes first."""
    found: list[GearboxSheet | MotorSheet] = []
    directory = files("lostmotion") / "catalogue"
    for file in sorted(directory.iterdir(), key=lambda f: f.name):
        if file.name.endswith(".toml"):
            found += parse_sheets(tomllib.loads(file.read_text(encoding="utf-8")), file.name)
    return tuple(sorted(found, key=lambda r: isinstance(r, MotorSheet)))


def read_sheets(path: Path) -> list[GearboxSheet | MotorSheet]:
    """The records of a sheet file.

    Raises
    ------
    InputError
        With one line that names the file, the record, the key, the value and the remedy.
    """
    return parse_sheets(read_toml(path, "a data sheet"), str(path))


def parse_sheets(data: dict[str, Any], where: str) -> list[GearboxSheet | MotorSheet]:
    """Records from the contents of a sheet file."""
    known = {*KINDS, *COMMON, "source", "gap"}
    for key in data:
        if key not in known:
            near = difflib.get_close_matches(key, sorted(known), n=1)
            hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(sorted(known))}"
            raise InputError(f"{where}: key {key}: is not known; {hint}")
    records: list[GearboxSheet | MotorSheet] = []
    for table, kind in KINDS.items():
        entries = data.get(table, [])
        if not isinstance(entries, list):
            raise InputError(f"{where}: key {table}: write [[{table}]] with double brackets, one for each record")
        for entry in entries:
            own = dict(entry)
            sources, gaps = own.pop("source", []), own.pop("gap", [])
            common = {key: data[key] for key in COMMON if key in data}
            fields = common | own | {"sources": [*sources, *data.get("source", [])]}
            fields["gaps"] = [*gaps, *data.get("gap", [])]
            try:
                records.append(kind(**fields))
            except ValidationError as error:
                raise InputError(f"{where}: {table} {own.get('name', '(no name)')}: {describe(error)}") from None
    if not records:
        raise InputError(f"{where}: holds no record; add a table [[gearbox]] or [[motor]]")
    return records


def describe(error: ValidationError) -> str:
    """One line for a record that fails its schema."""
    first = error.errors()[0]
    key = ".".join(str(k) for k in first["loc"])
    value = first["input"]
    if first["type"] == "missing":
        return f"key {key}: is missing; add it"
    if first["type"] == "extra_forbidden":
        return f"key {key}: is not known; run `lostmotion catalogue new` for a template with all keys"
    text = str(first["ctx"]["error"]) if first["type"] == "value_error" else first["msg"]
    shown = "" if isinstance(value, dict) else f"{value!r}: "
    return f"key {key}: {shown}{text}" if key else text


def find(reference: str, table: str) -> GearboxSheet | MotorSheet:
    """The record of a name, or the only one of that kind in a file (``.toml``).

    Parameters
    ----------
    table
        ``"gearbox"`` or ``"motor"``.

    Raises
    ------
    InputError
        There is none.
    """
    kind = KINDS[table]
    if reference.endswith(".toml"):
        own = [r for r in read_sheets(Path(reference)) if isinstance(r, kind)]
        if len(own) != 1:
            raise InputError(
                f"{reference}: holds {len(own)} records of kind {table}; it must hold one to be named here"
            )
        return own[0]
    records = {r.name: r for r in catalogue() if isinstance(r, kind)}
    if reference not in records:
        near = difflib.get_close_matches(reference, records, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}?" if near else "`lostmotion catalogue` lists them"
        raise InputError(f"{table} {reference!r} is not in the catalogue; {hint}")
    return records[reference]


def gearbox_table(reference: str, changes: Mapping[str, Any]) -> tuple[dict[str, Any], BuiltMap | None]:
    """Values of `[gearbox]` for a record, where nothing in `changes` takes their place, and the loss map's origin.

    Raises
    ------
    InputError
        The record lacks what a run needs and `changes` do not give it; the message says where to read it.
    """
    sheet = find(reference, "gearbox")
    assert isinstance(sheet, GearboxSheet)
    scalars = {key: value for key, value in changes.items() if key in SCALARS}
    try:
        sheet = GearboxSheet(**{**{k: getattr(sheet, k) for k in sheet.model_fields_set}, **scalars})
        conditions = Conditions(**{key: changes[key] for key in Conditions.model_fields if key in changes})
    except ValidationError as error:
        raise InputError(f"gearbox from {reference!r}: {describe(error)}") from None
    for key, what in sheet.missing().items():
        if key not in changes:
            raise InputError(
                f"gearbox from {reference!r}: the record lacks {key}, {what}; give gearbox.{key} beside `from`"
            )
    table: dict[str, Any] = sheet.scalars() | {"limits": sheet.limits().model_dump()}
    built = None
    notes = [sheet.note] if sheet.note else []
    try:
        if "stiffness" not in changes:
            curve = sheet.torsion_curve(conditions.added_backlash)
            table["stiffness"] = curve.model_dump()
            if (hysteresis := sheet.hysteresis(curve)) is not None:
                table["hysteresis"] = hysteresis.model_dump()
        elif conditions.added_backlash > 0.0:
            raise ValueError(
                "added_backlash belongs to the record's own stiffness; put it into gearbox.stiffness.backlash"
            )
        elif sheet.hysteresis_efficiency is not None:
            table["hysteresis"] = {"efficiency": sheet.hysteresis_efficiency}
        if "losses" not in changes:
            built = build_loss_map(sheet, temperature=conditions.temperature, loss_factor=conditions.loss_factor)
            table["losses"] = built.losses.model_dump()
            notes += built.notes
    except ValueError as error:
        raise InputError(f"gearbox {error}") from None
    if notes:
        table["note"] = " ".join(notes)
    return table, built


def gearbox(
    name: str, *, temperature: float | None = None, added_backlash: float = 0.0, loss_factor: float = 1.0
) -> Gearbox:
    """The gearbox of a record.

    Parameters
    ----------
    name
        Of a record in the catalogue, or a file (``.toml``) with one record.
    temperature
        Of the lubricant [°C]; left out, that of the figures.
    added_backlash
        Wear: added to the printed backlash [rad].
    loss_factor
        Wear: multiplies all losses.

    Raises
    ------
    InputError
        There is no such record, or it lacks what a run needs.
    """
    changes: dict[str, Any] = {"added_backlash": added_backlash, "loss_factor": loss_factor}
    if temperature is not None:
        changes["temperature"] = temperature
    table, _ = gearbox_table(name, changes)
    return Gearbox(**table)


def motor(name: str, *, voltage_limit: float | None = None) -> Motor:
    """The motor of a record.

    Parameters
    ----------
    name
        Of a record in the catalogue, or a file (``.toml``) with one record.
    voltage_limit
        Largest voltage of the amplifier [V].

    Raises
    ------
    InputError
        There is no such record, or it lacks what a run needs.
    """
    sheet = find(name, "motor")
    assert isinstance(sheet, MotorSheet)
    try:
        return sheet.motor(voltage_limit)
    except ValidationError as error:
        raise InputError(f"motor {name}: {describe(error)}") from None
    except ValueError as error:
        raise InputError(f"motor {error}") from None
