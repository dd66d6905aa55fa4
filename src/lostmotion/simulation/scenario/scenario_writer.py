"""A scenario file with some values changed, its comments and its order kept."""

import itertools
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import InlineTable

from ...atomic_writer import write_whole
from ...errors import InputError
from ...inputs.toml_files import RESULTS, is_in_file
from ..forms.key_aliases import in_file
from ..forms.set_by_dotted_key import list_index
from .scenario import Scenario
from .scenario_files import find_base, find_scenario, scenario_text
from .scenario_files import load as load_file
from .shipped_scenarios import shipped_scenarios

MARK = "# Tuned"
"""begins each line of the comment above a changed file, which the next change replaces"""


def write_changed(
    target: Path, scenario: Scenario, source: str | Path, changes: Mapping[str, Any], notes: list[str]
) -> None:
    """Write a scenario that differs from the scenario of a file by some values.

    The comments and the order of the file are kept. The written file is read again and compared with the scenario. If
    the changes cannot be made in the file, or the source is a saved result, the whole scenario is written instead.

    source: that the scenario was loaded from.
    changes: new values by dotted key; None removes a key.
    notes: lines of the comment at the top.

    Raises InputError: the file cannot be written; nothing is left behind.
    """
    texts = []
    # A file may need its title, which it otherwise has from its base or without what has changed.
    ways = itertools.product((changes, {**changes, "title": scenario.title}), (False, True))
    for values, inline in ways if Path(source).suffix not in RESULTS else ():
        # A file may have a shape in which these values cannot be changed.
        with suppress(TOMLKitError, KeyError, TypeError, ValueError, AttributeError):
            texts.append(changed_text(find_scenario(source), values, target, notes, inline))
    texts.append(scenario_text(scenario, "\n".join(f"{MARK[2:]}{note}" for note in notes)))

    def write(temporary: Path) -> None:
        for text in texts:
            temporary.write_text(text, encoding="utf-8")
            try:
                read = load_file(temporary)
            except InputError:
                continue
            if read.model_dump() == scenario.model_dump():
                return
        raise InputError(f"{target}: this scenario cannot be written as a file; change its gains in {source} by hand")

    write_whole(target, write)


def changed_text(source: Path, changes: Mapping[str, Any], target: Path, notes: list[str], inline: bool = False) -> str:
    """The text of a scenario file with some values changed, for a file at another place.

    inline: whether tables that are new stand on one line, as they must among dotted keys.
    """
    document = tomlkit.parse(source.read_text(encoding="utf-8"))
    new: list[Any] = []
    for key, value in changes.items():
        _set(document, in_file(key, document).split("."), value, new, inline)
    for table in new:
        table.add(tomlkit.nl())  # before what follows
    if os.path.abspath(target.parent) != os.path.abspath(source.parent):
        _move_names(document, source, target)
    lines = tomlkit.dumps(document).splitlines()
    while lines and lines[0].startswith(MARK):
        lines.pop(0)
    return "\n".join([*(f"{MARK}{note}" for note in notes), *lines]) + "\n"


def _set(node: Any, keys: list[str], value: Any, new: list[Any], inline: bool) -> None:
    """Change one value; the tables that this makes are added to `new`."""
    *path, last = keys
    for key in path:
        if isinstance(node, list):
            node = node[list_index(node, key)]
            continue
        if key not in node:
            on_one_line = inline or isinstance(node, InlineTable)
            node[key] = tomlkit.inline_table() if on_one_line else tomlkit.table()
            if not on_one_line:
                new.append(node[key])
        node = node[key]
    if isinstance(node, list):
        node[list_index(node, last)] = value
    elif value is None:
        node.pop(last, None)
    else:
        node[last] = _inline(value)


def _inline(value: Any) -> Any:
    """Tables within lists as inline tables, on one line."""
    if isinstance(value, list | tuple):
        out = tomlkit.array()
        for entry in value:
            out.append(_inline(entry))
        return out
    if isinstance(value, Mapping):
        table = tomlkit.inline_table()
        for key, entry in value.items():
            table[key] = _inline(entry)
        return table
    return value


def _move_names(document: Any, source: Path, target: Path) -> None:
    """Names of other files, which are relative to the file that names them."""
    for table, key in list(_names(document, ())):
        name = str(table[key])
        if key == "base":
            found = find_base(name, source)
            table[key] = found.stem if found == shipped_scenarios().get(found.stem) else _seen_from(target, found)
        else:
            table[key] = _seen_from(target, source.parent / name)


def _seen_from(target: Path, path: Path) -> str:
    try:
        return Path(os.path.relpath(path, target.parent)).as_posix()
    except ValueError:  # on another drive
        return Path(os.path.abspath(path)).as_posix()


def _names(table: Any, where: tuple[str, ...]) -> Iterator[tuple[Any, str]]:
    """Keys whose value is the relative name of a file, with their tables."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _names(value, (*where, key))
            continue
        if not isinstance(value, str) or Path(value).is_absolute():
            continue
        record = key in ("from", "gearbox", "motor") and is_in_file(value)
        if record or (key == "base" and not where) or (key == "file" and where[-1:] == ("samples",)):
            yield table, key
