"""Values of a scenario by dotted key, as `--set` names them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

from ..data_sheets.components import as_torque_source, at_voltage
from ..errors import InputError
from ..inputs.validation import shown


def parse_override(text: str) -> tuple[str, Any]:
    """Key and value of ``KEY=VALUE``; a value that is no TOML is text.

    Raises
    ------
    InputError
    """
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text}: must be KEY=VALUE, such as --set command.amplitude=0.1")
    try:
        parsed = tomllib.loads(f"value = {value}")
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()
    return key.strip(), parsed["value"] if len(parsed) == 1 else value.strip()


def set_values(data: dict[str, Any], changes: Iterable[tuple[str, Any]]) -> None:
    """Changes values by dotted key. What others depend on comes before them, in whatever order they are given."""
    before = ("gearbox", "motor", "gearbox.from", "motor.from", "motor.kind", "motor.rated_voltage")
    changes = list(changes)
    given = [key.removeprefix("motor.") for key, _ in changes]
    for key, value in sorted(changes, key=lambda change: before.index(change[0]) if change[0] in before else 99):
        first, *rest = key.split(".")
        node = data.get(first)
        if isinstance(node, dict) and "from" not in node:  # beside `from` the record sees to it
            if key == "motor.kind" and value == "torque_source":
                node = as_torque_source(node)
            elif key == "motor.rated_voltage":
                node = at_voltage(node, value, given)
        data[first] = _changed(node, rest, value, first)


def _changed(node: Any, keys: list[str], value: Any, where: str) -> Any:
    """A node of a scenario file with one value changed; lists are counted from 0."""
    if not keys:
        return value
    if keys == ["from"] and where in ("gearbox", "motor"):  # the record takes the place of the whole table
        return {"from": value}
    if where in ("gearbox", "motor") and isinstance(node, str):
        node = {"from": node}
    if where in ("command", "load.torque") and isinstance(node, int | float | str):
        node = {"mean": node}
    key, *rest = keys
    inner = f"{where}.{key}"
    if isinstance(node, list | tuple) or (node is None and key.isdecimal()):
        entries = node or ()
        try:
            place = list_index(entries, key)
        except ValueError as error:
            raise InputError(f"key {inner}: {error}") from None
        return [_changed(x, rest, value, inner) if n == place else x for n, x in enumerate(entries)]
    if node is not None and not isinstance(node, dict):
        raise InputError(f"key {inner}: {where} is the value {shown(node)}, not a table; it has no {key}")
    table = node or {}
    return {**table, key: _changed(table.get(key), rest, value, inner)}


def list_index(entries: Sequence[Any], part: str) -> int:
    """The index that a part of a dotted key names, such as 0 in ``command.ramps.0.rise``.

    Raises
    ------
    ValueError
        There is no such entry.
    """
    if not (part.isascii() and part.isdigit()):
        raise ValueError(f"{part!r} is no index; entries of a list are numbered from 0")
    if int(part) >= len(entries):
        count = f"{len(entries)} entr{'y' if len(entries) == 1 else 'ies'}"
        raise ValueError(f"there is no entry {part}; the list has {count}, numbered from 0")
    return int(part)
