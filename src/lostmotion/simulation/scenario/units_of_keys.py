"""Units of the keys of a scenario, in the short or the long form."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

from ...inputs.quantities import Limit
from ...inputs.refusal_messages import shown
from ...inputs.schema import follow, unit_in_schema
from ...units.conversion import to_si
from ...units.scalars import is_number, objection
from ..forms.common_tables import ScenarioTables
from ..forms.drive_tables import DriveTables
from ..forms.slide_units import unit_of_slides
from ..forms.train_tables import TrainTables
from .scenario import Scenario

Place = tuple[int | str, ...]  # parts of a dotted key


def unit_of_key(key: str) -> str | None:
    """SI unit of a dotted key of a scenario; empty for a plain number, None if it is no quantity or not known.

    A key of both forms (`command.frequency`, where a motor has that name) is read as the key of the short form.
    """
    of_drive = unit_in(DriveTables, key)
    return unit_in(TrainTables, key) if of_drive is None else of_drive


def unit_in(form: type[ScenarioTables], key: str) -> str | None:
    """The same, of a key of the short or of the long form."""
    return _unit(_place(key), form)


def unit_for(scenario: Scenario, key: str) -> str | None:
    """SI unit of a dotted key of a scenario, by the kinds of its tables; its controllers move slides in units of translation."""
    key = scenario.key_of_tables(key)
    unit = _unit(_place(key), type(scenario.written), _with_kinds(scenario.written, key))
    if not unit or not key.startswith("controllers."):
        return unit
    return unit_of_slides(scenario.model_dump(), key, unit)


def limit_in(form: type[ScenarioTables], key: str) -> Limit:
    """The range that a value of the short or of the long form may have, whatever the others are."""
    nodes = _nodes(_place(key), form)
    numbers = [node for node in nodes if node.get("type") == "number"]

    def bound(name: str, widest: Callable[[list[float]], float]) -> float | None:
        given = [node[name] for node in numbers if name in node]
        return widest(given) if given and len(given) == len(numbers) else None

    return Limit(gt=bound("exclusiveMinimum", min), ge=bound("minimum", min), le=bound("maximum", max))


def meaning_in(form: type[ScenarioTables], key: str) -> str:
    """Meaning of a key of the short or of the long form; empty where nothing says it."""
    return next((str(node["description"]) for node in _nodes(_place(key), form) if "description" in node), "")


@cache
def _unit(place: Place, form: type[ScenarioTables], kinds: Place = ()) -> str | None:
    return next((unit for node in _nodes(place, form, kinds) if (unit := unit_in_schema(node)) is not None), None)


def _place(key: str) -> Place:
    return tuple(int(part) if part.isdecimal() else part for part in key.split("."))


def _with_kinds(tables: Any, key: str) -> Place:
    """A dotted key with the kind of each table on the way, since keys of two kinds may have one name and two units."""
    found: list[int | str] = []
    for part in _place(key):
        if isinstance(part, int):
            tables = tables[part] if isinstance(tables, Sequence) and part < len(tables) else None
        else:
            tables = tables.get(part) if isinstance(tables, Mapping) else getattr(tables, part, None)
        kind = getattr(tables, "kind", None)
        found += [part, kind] if isinstance(kind, str) else [part]
    return tuple(found)


def _nodes(place: Place, form: type[ScenarioTables], kinds: Place = ()) -> list[Mapping[str, Any]]:
    """Nodes of a key in the JSON Schema, perhaps of the same with the kinds of its tables; none if the key is unknown."""
    found, nodes = follow(_made(form), kinds or place)
    if found != place:
        return []
    if any({"mean", "sines"} <= node.get("properties", {}).keys() for node in nodes):
        return _nodes(
            (*place, "mean"), form, (*kinds, "mean") if kinds else ()
        )  # a signal, which one value makes constant
    return nodes


@cache
def _made(form: type[ScenarioTables]) -> dict[str, Any]:
    return form._described_by()


def in_si(value: Any, unit: str | None) -> Any:
    """Strings with a unit as numbers, in lists and tables too; numbers as they are.

    Raises ValueError: a string is not a number with a unit, or has the unit of something else; or a value is anything else.
    """
    if isinstance(value, bool):
        raise ValueError(f"{str(value).lower()} is not a number")
    if isinstance(value, str):
        try:
            return value if unit is None else to_si(value, unit)
        except ValueError as error:
            raise ValueError(f"{shown(value)} {error}") from None
    if isinstance(value, list | tuple):
        return [in_si(x, unit) for x in value]
    if isinstance(value, dict):
        return {k: in_si(x, unit) for k, x in value.items()}
    if value is not None and not is_number(value):
        raise ValueError(f"{shown(value)} {objection(value) or 'is not a number'}")
    return value
