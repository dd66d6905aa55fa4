"""Values of a scenario by dotted key, as `--set` names them."""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from ...data_sheets.components import as_torque_source, at_voltage
from ...data_sheets.train_components import RECORDS, without_record
from ...errors import InputError
from ...inputs.implausible_values import doubt
from ...inputs.refusal_messages import shortened, shown
from ...inputs.toml_files import MAX_LEVELS, shallow
from ...model.notes import Noted
from ...units.scalars import is_number, plain


def parse_override(text: str) -> tuple[str, Any]:
    """Key and value of ``KEY=VALUE``, with a warning of a doubtful value; a value that is no TOML is text."""
    key, value = key_and_value(text)
    if not isinstance(value, str):
        doubt(key, value, "--set")
    return key, value


def key_and_value(text: str) -> tuple[str, Any]:
    """The same without warnings."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text}: must be KEY=VALUE, such as --set command.amplitude=0.1")
    try:
        parsed = shallow(tomllib.loads(f"value = {value}"))
    except RecursionError:
        raise InputError(f"--set {key.strip()}: has too many levels of tables and lists; write it with fewer") from None
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()
    if len(parsed) > 1:
        return key.strip(), value.strip()
    return key.strip(), parsed["value"]


# Keys that others depend on, in the order in which they are changed: a part as a whole, its record, and what other values
# of a motor follow from.
_FIRST = tuple(
    re.compile(pattern)
    for pattern in (
        r"gearbox|motor|(gears|motors)\.[^.]+",
        r"(gearbox|motor|motors\.[^.]+)\.from|gears\.[^.]+\.gearbox",
        r"(motor|motors\.[^.]+)\.kind",
        r"(motor|motors\.[^.]+)\.rated_voltage",
    )
)
CHANGES_OTHERS = _FIRST[-1]  # of these a number, with which other values change
_SIGNALS = re.compile(r"command|load\.torque")
_OFF_DIAGONAL = re.compile(r"(mass_matrices\.[^.]+\.matrix)\.(\d+)\.(\d+)")
_TRAIN_SIGNALS = re.compile(r"command\.[^.]+|shafts\.[^.]+\.torque|slides\.[^.]+\.force")


def set_values(data: dict[str, Any], changes: Iterable[tuple[str, Any]]) -> None:
    """Changes values by dotted key. What others depend on comes before them, in whatever order they are given."""
    changes = [(key, plain(value)) for key, value in _with_mirrored(changes)]
    given = [key for key, _ in changes]
    signals = _TRAIN_SIGNALS if "shafts" in data or "slides" in data else _SIGNALS
    own = _Copies()

    def rank(change: tuple[str, Any]) -> int:
        last = len(_FIRST) + (".note" in change[0])  # a note is about the values as they are then
        return next((n for n, pattern in enumerate(_FIRST) if pattern.fullmatch(change[0])), last)

    for key, value in sorted(changes, key=rank):
        if key.count(".") > MAX_LEVELS:
            raise InputError(f"has more than {MAX_LEVELS} levels; no table is as deep", shortened(key))
        _change_what_follows(data, key, value, given, own)
        first, *rest = key.split(".")
        data[first] = _changed(data.get(first), rest, value, first, signals, own)


def _with_mirrored(changes: Iterable[tuple[str, Any]]) -> Iterator[tuple[str, Any]]:
    """The changes, and of entries of mass matrices those across the diagonal, which are equal, unless they are given too."""
    all_changes = list(changes)
    given = {key for key, _ in all_changes}
    for key, value in all_changes:
        yield key, value
        if (entry := _OFF_DIAGONAL.fullmatch(key)) and (other := ".".join(entry.group(1, 3, 2))) not in given:
            yield other, value


class _Copies:
    """Tables and lists that were copied to be changed, so that each is copied once, however many changes there are."""

    def __init__(self) -> None:
        self.made: dict[int, Any] = {}

    def of(self, node: Any) -> Any:
        """The node itself, if it is a copy already; else a copy."""
        if id(node) in self.made:
            return node
        copy = dict(node) if isinstance(node, dict) else list(node)
        self.made[id(copy)] = copy
        return copy


def _change_what_follows(data: dict[str, Any], key: str, value: Any, given: Sequence[str], own: _Copies) -> None:
    """Change the values that depend on the kind or the rated voltage of a motor; beside `from` the record does so."""
    where, _, last = key.rpartition(".")
    *table, name = where.split(".")
    parent = data.get("motors") if table == ["motors"] else data if where == "motor" else None
    node = parent.get(name) if isinstance(parent, dict) else None
    if not isinstance(node, dict) or "from" in node:
        return
    if last == "kind" and value == "torque_source":
        changed = as_torque_source(node)
    elif last == "rated_voltage":
        changed = at_voltage(node, value, [k.removeprefix(f"{where}.") for k in given], where)
    else:
        return
    Noted(node).keep_true(changed)
    if table:
        data["motors"] = own.of(data["motors"])
        data["motors"][name] = changed
    else:
        data["motor"] = changed


def _changed(node: Any, keys: list[str], value: Any, where: str, signals: re.Pattern[str], own: _Copies) -> Any:
    """A node of a scenario file with one value changed; lists are counted from 0."""
    if not keys:
        return value
    if keys == ["from"] and where in ("gearbox", "motor"):  # the record takes the place of the whole table
        return {"from": value}
    table, _, name = where.partition(".")
    if table in RECORDS and name and keys == [RECORDS[table][0]] and isinstance(node, dict):
        return {**without_record(table, node), keys[0]: value}
    if where in ("gearbox", "motor") and isinstance(node, str):
        node = {"from": node}
    if signals.fullmatch(where) and (isinstance(node, str) or is_number(node)):
        node = {"mean": node}
    key, *rest = keys
    inner = f"{where}.{key}"
    if isinstance(node, list | tuple) or (node is None and key.isdecimal()):
        entries = own.of(node or ())
        try:
            place = list_index(entries, key)
        except ValueError as error:
            raise InputError(error, inner) from None
        entries[place] = _changed(entries[place], rest, value, inner, signals, own)
        return entries
    if node is not None and not isinstance(node, dict):
        raise InputError(f"{where} is the value {shown(node)}, not a table; it has no {key}", inner)
    fields = own.of(node or {})
    noted = Noted(fields)
    fields[key] = _changed(fields.get(key), rest, value, inner, signals, own)
    noted.keep_true(fields)
    return fields


def list_index(entries: Sequence[Any], part: str) -> int:
    """The index that a part of a dotted key names, such as 0 in ``command.ramps.0.rise``.

    Raises ValueError: there is no such entry.
    """
    if not (part.isascii() and part.isdigit()):
        raise ValueError(f"{part!r} is no index; entries of a list are numbered from 0")
    if int(part) >= len(entries):
        count = f"{len(entries)} entr{'y' if len(entries) == 1 else 'ies'}"
        raise ValueError(f"there is no entry {part}; the list has {count}, numbered from 0")
    return int(part)


def renamed(key: str, names: Mapping[str, str]) -> str:
    """A dotted key in which a table, or a value, has another name.

    names: by the dotted keys that are replaced, the first that fits.
    """
    for old, new in names.items():
        if key == old or key.startswith(f"{old}."):
            return new + key.removeprefix(old)
    return key
