"""Records of the catalogue at any place of a drive train."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InputError
from ..inputs.validation import shown
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.motor import Motor, ShaftMotor
from .components import Conditions, gearbox_table, motor_table

# For each table of elements: the key that names a record, and the keys that a record does not give.
RECORDS = {
    "gears": ("gearbox", tuple(key for key in Gear.model_fields if key not in Gearbox.model_fields)),
    "motors": ("from", tuple(key for key in ShaftMotor.model_fields if key not in Motor.model_fields)),
}


def use_train_records(data: dict[str, Any]) -> None:
    """Puts the values of a record in the place of `gears.NAME.gearbox` and `motors.NAME.from`.

    Raises
    ------
    InputError
        A record is unknown or lacks what a run needs.
    """
    for table in RECORDS:
        if isinstance(data.get(table), dict):
            data[table] = {name: _with_record(table, name, value) for name, value in data[table].items()}


def without_record(table: str, element: Mapping[str, Any]) -> dict[str, Any]:
    """What of an element is no value of its gearbox or motor, so that another record can take the place."""
    return {key: value for key, value in element.items() if key in RECORDS[table][1]}


def _with_record(table: str, name: str, element: Any) -> Any:
    if not isinstance(element, dict):
        return element
    key, _ = RECORDS[table]
    where = f"{table}.{name}"
    if key not in element:
        for condition in Conditions.model_fields if table == "gears" else ():
            if condition in element:
                raise InputError(f"key {where}.{condition}: acts on a record; give {where}.gearbox, or leave it out")
        return element
    record = element[key]
    if not isinstance(record, str):
        raise InputError(f"key {where}.{key}: {shown(record)} must be the name of a record, or of a file with one")
    part = {*Gearbox.model_fields, *Conditions.model_fields} if table == "gears" else {*Motor.model_fields}
    changes = {k: v for k, v in element.items() if k in part}
    kept = {k: v for k, v in element.items() if k not in (key, *part)}
    try:
        values = gearbox_table(record, changes, where)[0] if table == "gears" else motor_table(record, changes, where)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith("key ") else f"key {where}.{key}: {text}") from None
    return values | kept
