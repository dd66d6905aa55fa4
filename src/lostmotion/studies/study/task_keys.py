"""Keys of a task that may vary and are none of motor and gearbox: of the load or the slide, the last stage, controller and task."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from ...errors import InputError
from ...inputs.refusal_messages import shown
from ...inputs.schema import follow, unit_in_schema
from ...model.linear_motor import LinearMotorData
from ...model.motor import Motor
from ...simulation.forms.set_by_dotted_key import list_index
from ...simulation.forms.slide_units import OF_REFERENCE, of_slides
from ...simulation.forms.train_tables import TrainTables
from ...simulation.scenario.units_of_keys import in_si, unit_in, unit_of_key
from ...sizing.axis_task.axis_task import AxisTask
from ...sizing.linear_stage_demands import STAGES
from ...sizing.whole_drives import WHOLE
from .records_that_vary import kind_of_record
from .vary import WAYS, Vary

COMMON = ("task", "load", "slide", "controller")  # tables that all candidates share
TABLES = (*COMMON, *STAGES, *WHOLE)
PARTS = {**STAGES, "task": AxisTask, "linear_motor": LinearMotorData, "actuator": Motor}


def is_own(key: str) -> bool:
    """Whether it is a key of such a table, and takes no names of records."""
    return key.split(".", maxsplit=1)[0] in TABLES and kind_of_record(key) is None


def with_first(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables of a task with the first value of each own key that varies, whose values are in SI then."""
    entries = tables.get("vary")
    if not isinstance(entries, list):
        return tables
    found, out = tables, []
    for entry in entries:
        keys = _keys(entry)
        if any(map(is_own, keys)):
            if not all(map(is_own, keys)):
                raise InputError(f"vary: {' and '.join(keys)} cannot vary together; give each an entry of its own")
            out.append(_in_si(entry, keys[0], linear="load" not in tables))
            levels = Vary(**out[-1]).levels()
            if levels is None:
                raise InputError(f"vary: {keys[0]} of a task needs values or grid, not a distribution")
            found = with_value(found, out[-1], float(levels[0]))
        else:
            out.append(entry)
    return {**found, "vary": out}


def with_value(tables: dict[str, Any], entry: Mapping[str, Any], value: float) -> dict[str, Any]:
    """The tables with a value at the keys of an entry, or a factor of what they have."""
    out = dict(tables)
    for key in _keys(entry):
        table, *path = key.split(".")
        given = out.get(table, {})
        node = out[table] = {"from": given} if isinstance(given, str) else deepcopy(given)
        for name in path[:-1]:
            node = node[list_index(node, name)] if isinstance(node, list) else node.setdefault(name, {})
        last: Any = list_index(node, path[-1]) if isinstance(node, list) else path[-1]
        if entry.get("relative"):
            if isinstance(node, dict) and last not in node:
                raise InputError("varies with relative, but the task has no value there to multiply", key)
            node[last] = value * _number(node[last], str(entry["unit_of_values"]), key)
        else:
            node[last] = int(value) if value.is_integer() else value  # as numbers of teeth must be
    return out


def _keys(entry: Any) -> list[str]:
    if not isinstance(entry, dict):
        return []
    return [str(key) for key in (entry.get("keys") or ([entry["key"]] if "key" in entry else []))]


def _number(value: Any, unit: str, key: str) -> float:
    try:
        found: float = float(in_si(value, "" if unit == "1" else unit))
    except (TypeError, ValueError) as error:
        raise InputError(str(error), key) from None
    return found


def _in_si(entry: dict[str, Any], key: str, *, linear: bool) -> dict[str, Any]:
    unit = _unit(key, linear=linear)
    if unit is None:
        raise InputError(f"{shown(key)} names nothing with a number in a task; vary a key that does", "vary")
    try:
        values = {way: entry[way] if entry.get("relative") else in_si(entry[way], unit) for way in WAYS if way in entry}
    except ValueError as error:
        raise InputError(f"vary: of {key}: {error}") from None
    return entry | values | {"unit_of_values": unit or "1"}


def _unit(key: str, *, linear: bool) -> str | None:
    """SI unit of a key, empty for a plain number; None if it is none."""
    table, _, rest = key.partition(".")
    path = tuple(int(name) if name.isdecimal() else name for name in rest.split("."))
    if table == "slide":
        return "" if rest == "friction_coefficient" else unit_in(TrainTables, f"slides.slide.{rest}")
    if table in PARTS:
        reached, nodes = follow(PARTS[table].model_json_schema(), path)
        nodes = nodes if reached == path else []
        plain = "" if any(node.get("type") == "integer" for node in nodes) else None
        unit = next((u for node in nodes if (u := unit_in_schema(node)) is not None), plain)
        return of_slides(unit, positions=True, forces=False) if unit and linear and table == "task" else unit
    unit = unit_of_key(key)
    translated = linear and table == "controller" and any(path[: len(place)] == place for place in OF_REFERENCE)
    return of_slides(unit, positions=True, forces=False) if unit and translated else unit
