"""Steppers as candidates of a task. The base of a task has a controller, which a stepper cannot have: they are made apart."""

from collections.abc import Mapping
from typing import Any

from ...data_sheets.components import motor_table
from ...data_sheets.records import find
from ...errors import inside
from ...model.motor import Motor
from .vary import Vary, scaled


def is_stepper(table: Mapping[str, Any]) -> bool:
    """Whether a table `[motor]`, with or without a record, belongs to a stepper."""
    if "from" not in table:
        return bool(table.get("kind") == "stepper")
    return find(str(table["from"]), "motor").kind == "stepper" and table.get("kind", "stepper") == "stepper"


def stepper_of(beside: Mapping[str, Any], parameters: list[tuple[Vary, float]]) -> Motor | None:
    """The stepper that a row of a task has by some of its parameters; None of another motor.

    beside: table `[motor]` of the task.
    """
    table, factors = dict(beside), dict[str, float]()
    for varied, number in parameters:
        for key in varied.all_keys:
            if varied.names is not None:
                table["from"] = varied.value(number)
            elif varied.relative:
                factors[key.removeprefix("motor.")] = float(varied.value(number))
            else:
                table[key.removeprefix("motor.")] = varied.value(number)
    if not is_stepper(table):
        return None
    own = {key: value for key, value in table.items() if key != "from"}
    with inside("motor"):
        motor = Motor(**(motor_table(str(table["from"]), own) if "from" in table else own))
        if factors:
            motor = Motor(**motor.model_dump() | {key: scaled(getattr(motor, key), x) for key, x in factors.items()})
    return motor
