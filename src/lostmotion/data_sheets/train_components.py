"""Records of the catalogue at any place of a drive train."""

from collections.abc import Callable, Mapping
from typing import Any

from ..errors import InputError
from ..inputs.part import Part
from ..inputs.refusal_messages import shown
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.motor import Motor, ShaftMotor
from .components import Conditions, gearbox_table, motor_table, use_accessories
from .linear_components import ScrewConditions, linear_table

# For each table of elements: the key that names a record, and the keys that a record does not give.
RECORDS = {
    "gears": ("gearbox", tuple(key for key in Gear.model_fields if key not in Gearbox.model_fields)),
    "motors": ("from", tuple(key for key in ShaftMotor.model_fields if key not in Motor.model_fields)),
    "screws": ("from", ("input", "output")),
    "racks": ("from", ("input", "output")),
    "belts": ("from", ("input", "output")),
    "linear_motors": ("from", ("slide",)),
}
# For each of them the kind of its records.
RECORD_KINDS = {table: "gearbox" if table == "gears" else table.removesuffix("s") for table in RECORDS}
# For some of them the conditions of use: keys that act on a record.
CONDITIONS: dict[str, type[Part]] = {"gears": Conditions, "screws": ScrewConditions}


def use_train_records(data: dict[str, Any], written: Callable[[str], str] = str) -> None:
    """Puts the values of a record in place of the key that names it, such as `gears.NAME.gearbox` and `screws.NAME.from`."""
    if "task" in data:
        data["task"] = use_accessories(data["task"])
    for table in RECORDS:
        if isinstance(data.get(table), dict):
            data[table] = {name: _with_record(table, name, value, written) for name, value in data[table].items()}


def without_record(table: str, element: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of an element that are not values of its record, so that another record can replace it."""
    return {key: value for key, value in element.items() if key in RECORDS[table][1]}


def _with_record(table: str, name: str, element: Any, written: Callable[[str], str]) -> Any:
    if not isinstance(element, dict):
        return element
    key = RECORDS[table][0]
    where, from_key = written(f"{table}.{name}"), written(f"{table}.{name}.{key}")
    if key not in element:
        for condition in CONDITIONS[table].model_fields if table in CONDITIONS else ():
            if condition in element:
                raise InputError(f"acts on a record; give {from_key}, or leave it out", f"{where}.{condition}")
        return element
    record = element[key]
    if not isinstance(record, str):
        raise InputError(f"{shown(record)} must be the name of a record, or of a file with one", from_key)
    try:
        values, kept = _values(table, record, element, where)
    except InputError as error:
        raise (error if error.problems[0].keys and not error.where else InputError(error, from_key)) from None
    return values | kept


def _values(table: str, record: str, element: dict[str, Any], where: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The values of a record with the changes beside it, and what of the element is neither."""
    key, own = RECORDS[table]
    if table not in ("gears", "motors"):
        changes = {k: v for k, v in element.items() if k not in (key, *own)}
        return linear_table(RECORD_KINDS[table], record, changes, where), without_record(table, element)
    part = {*Gearbox.model_fields, *Conditions.model_fields} if table == "gears" else {*Motor.model_fields}
    changes = {k: v for k, v in element.items() if k in part}
    kept = {k: v for k, v in element.items() if k not in (key, *part)}
    values = gearbox_table(record, changes, where)[0] if table == "gears" else motor_table(record, changes, where)
    return values, kept
