"""Scenario files: found, read with what they are based on, and changed by dotted key."""

import os
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from ...data_sheets.components import accessories_in, gearbox_table, record_in
from ...data_sheets.linear_components import linear_table
from ...data_sheets.records import find
from ...data_sheets.train_components import RECORDS, without_record
from ...errors import InputError, prefixed
from ...inputs.implausible_values import doubt_all
from ...inputs.refusal_messages import names_like, shortened, shown
from ...inputs.schema import follow, unit_in_schema
from ...inputs.toml_files import RESULTS, no_such_file, read_toml
from ...inputs.toml_text import toml_text, without_empty
from ...model.gearbox import Gearbox
from ...model.notes import Noted, Notes
from ...model.screw import RatedScrew, ScrewData
from ..forms.axis_form import file_schema
from ..forms.key_aliases import in_file
from ..forms.set_by_dotted_key import parse_override, set_values
from .scenario import Scenario
from .shipped_scenarios import shipped_scenarios
from .signal_files import read_series

MAX_BASES = 100  # files that are each the base of the one before
CHANGED, MORE, MOST_KEYS = "; changed: ", ", ...", 3  # keys in a title


def find_scenario(name: str | Path, directory: Path = Path()) -> Path:
    """The file that is meant: a path relative to `directory`, or the name of a shipped scenario.

    Raises InputError: it is neither; the message names what is near.
    """
    path = directory / name
    shipped = shipped_scenarios() if len(Path(name).parts) == 1 else {}
    if os.path.isfile(path) or not shipped:
        return path
    if str(name) in shipped:
        return shipped[str(name)]
    if Path(name).stem in shipped and not os.path.lexists(path):
        raise InputError(
            f"{path}: there is no such file; the shipped scenario is called {Path(name).stem}, without ending"
        )
    if path.suffix or os.path.lexists(path):
        return path
    hint = names_like(str(name), shipped, f"the scenarios that come with the package are {', '.join(shipped)}", 1)
    raise InputError(f"{shortened(str(name))}: there is no such file (.toml) and no such scenario; {hint}")


def find_base(base: str, path: Path) -> Path:
    """The file that the key `base` of another file means. Raises InputError: there is none."""
    with prefixed(f"{path}: key base"):
        found = find_scenario(base, path.parent)
        if not os.path.lexists(found):
            raise no_such_file(found)
    return found


def load(path: str | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> Scenario:
    """Read a scenario file.

    Parameters
    ----------
    path
        TOML file, or the name of a scenario that comes with the package, such as ``"paper-2dof-nl-small"``. The key
        `base` of a file may name another one (relative to it, or shipped) that this one changes.
    overrides
        ``{"command.amplitude": 0.1}`` or ``["command.amplitude=0.1"]``, as by ``--set``.

    Raises
    ------
    InputError
        With one line that names the file, the key, the value and the remedy.
    """
    path = find_scenario(path)
    return changed(read_tables(path, overrides), path)


def changed(tables: dict[str, Any], path: Path) -> Scenario:
    """The scenario of the tables of a file, in the short or the long form. The file's name stands in messages.

    Raises InputError: with one line that names the file, the key, the value and the remedy.
    """
    with prefixed(path):
        return Scenario(**tables)


def read_tables(path: str | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> dict[str, Any]:
    """The tables of a scenario file merged with the tables of its `base` and the overrides, records still as `from`."""
    path = find_scenario(path)
    data = _read(path, ())
    override(data, overrides, path)
    return data


def override(data: dict[str, Any], overrides: Mapping[str, Any] | Iterable[str], path: Path) -> None:
    """Changes tables of a file by dotted key."""
    overrides = [overrides] if isinstance(overrides, str) else overrides
    if not isinstance(overrides, Iterable) or not all(isinstance(entry, str) for entry in overrides):
        raise InputError(f'{shown(overrides)} must be changes by key, such as {{"command.amplitude": 0.1}}')
    if isinstance(overrides, Mapping):
        doubt_all(overrides, path)
        items: Iterable[tuple[str, Any]] = overrides.items()
    else:
        items = [parse_override(text) for text in overrides]
    items = [(in_file(key, data), value) for key, value in items]
    with prefixed(path):
        set_values(data, items)
    keys = [key.removesuffix(".mean") for key, _ in items]
    if isinstance(data.get("title"), str) and "title" not in keys:
        data["title"] = title_with(data["title"], [key for key in keys if not key.startswith("simulation.")])


def title_with(title: str, keys: Iterable[str]) -> str:
    """The title of a scenario with some values changed, which claims no more than holds.

    Examples
    --------
    >>> title_with("A robot joint, 1 Hz", ["command.frequency"])
    'A robot joint, 1 Hz; changed: command.frequency'
    """
    plain, _, before = title.partition(CHANGED)
    every = sorted({*filter(None, before.removesuffix(MORE).split(", ")), *keys})
    if not every or not plain:
        return title
    more = MORE if len(every) > MOST_KEYS or before.endswith(MORE) else ""
    return f"{plain}{CHANGED}{', '.join(every[:MOST_KEYS])}{more}"


def _read(path: Path, including: tuple[Path, ...]) -> dict[str, Any]:
    data = read_toml(path, "a scenario")
    real = Path(os.path.realpath(path))
    if real in including:
        raise InputError("leads back to this file; break the circle", "base", where=path)
    if len(including) > MAX_BASES:
        raise InputError(f"is the base of {MAX_BASES} files after one another; join some of them", "base", where=path)
    read_series_files(data, path, units_of_series)
    _find_records(data, path.parent)
    if "base" not in data:
        return data
    base = data.pop("base")
    if not isinstance(base, str):
        raise InputError(f"{shown(base)} must be the name of a scenario file", "base", where=path)
    if Path(base).suffix in RESULTS:
        raise InputError(
            f"{shown(base)} has the ending of a saved result; name a scenario file (.toml), or change the result by "
            f"`lostmotion run {base} --set KEY=VALUE`",
            "base",
            where=path,
        )
    based = _read(find_base(base, path), (*including, real))
    with prefixed(path):
        _change_voltages(based, data)
    _change_what_turns(based, data)
    merged = _merge(based, data)
    if "title" not in data and isinstance(merged.get("title"), str):
        merged["title"] = title_with(merged["title"], _changed_keys(data))
    return merged


def _changed_keys(data: Mapping[str, Any]) -> list[str]:
    """Keys of the tables of a file over a base, by which its motion differs."""
    tables = {name: table for name, table in data.items() if name != "simulation"}
    return [
        key
        for name, table in tables.items()
        for key in ([f"{name}.{part}" for part in table] if isinstance(table, Mapping) else [name])
    ]


def _change_what_turns(based: dict[str, Any], data: Mapping[str, Any]) -> None:
    """A controller over a base takes the place of the command of its motor, and the other way round."""
    for new, old in (("controller", "command"), ("command", "controller")):
        if new in data and old not in data:
            based.pop(old, None)
    for new, old in (("controllers", "command"), ("command", "controllers")):
        if isinstance(data.get(new), dict) and isinstance(based.get(old), dict):
            for motor in data[new]:
                based[old].pop(motor, None)


def _change_voltages(based: dict[str, Any], data: Mapping[str, Any]) -> None:
    """A rated voltage over a base takes with it what belongs to it."""
    motors = {"motor": data.get("motor")}
    if isinstance(data.get("motors"), dict):
        motors |= {f"motors.{name}": motor for name, motor in data["motors"].items()}
    for where, motor in motors.items():
        if isinstance(motor, dict) and "rated_voltage" in motor and "from" not in motor:
            set_values(based, [(f"{where}.{key}", value) for key, value in motor.items()])


def _find_records(data: dict[str, Any], directory: Path) -> None:
    """Files with a record are relative to the scenario."""
    if "task" in data:
        data["task"] = accessories_in(directory, data["task"])
    axis = data.get("axis")
    for tables in (data, axis) if isinstance(axis, dict) else (data,):
        for name in tables if tables is axis else ("gearbox", "motor"):
            if isinstance(tables.get(name), str):
                tables[name] = {"from": tables[name]}
            if name in tables:
                tables[name] = record_in(directory, tables[name])
    for table, (key, _) in RECORDS.items():
        if isinstance(data.get(table), dict):
            elements = data[table]
            data[table] = {n: record_in(directory, e, key) if isinstance(e, dict) else e for n, e in elements.items()}


def read_series_files(
    data: dict[str, Any],
    path: Path,
    units_at: Callable[[tuple[str, ...]], list[str]],
    keys: tuple[str, ...] = (),
    kinds: tuple[str, ...] = (),
) -> None:
    """Puts the points of `samples.file`, a CSV file beside the scenario or task of a path, in its place.

    units_at: SI units that values may have at keys, with the kind of each table that says it, which its units may depend on.
    keys, kinds: the keys of `data`, without and with those kinds.

    Raises InputError: a file cannot be used.
    """
    for key, value in data.items():
        if not isinstance(value, dict):
            continue
        where, place = (*keys, key), (*kinds, key, *[str(value[k]) for k in ("kind",) if k in value])
        if key != "samples" or "file" not in value:
            read_series_files(value, path, units_at, where, place)
            continue
        units = units_at(place)
        if not units or (len(units) > 1 and place != where):
            continue  # there is no such key, or no such kind: refused when the scenario is made
        name = value.pop("file")
        at = f"{'.'.join(where)}.file"
        if points := [key for key in ("times", "values") if key in value]:
            raise InputError(
                f"{shown(name)} leaves no room for {', '.join(points)}; give the file alone", at, where=path
            )
        if not isinstance(name, str):
            raise InputError(
                f"{shown(name)} must be the name of a CSV file with columns time [s] and value", at, where=path
            )
        if len(units) > 1:
            raise InputError(
                f"{shown(name)} may hold {' or '.join(units)}; give {'.'.join(keys)}.kind too", at, where=path
            )
        with prefixed(f"{path}: key {at}"):
            value["times"], value["values"] = read_series(path.parent / name, units[0])


@cache
def units_of_series(place: tuple[str, ...]) -> list[str]:
    """The SI units that the values of a series at these keys of a scenario may have."""
    _, nodes = follow(file_schema(), (*place, "values"))
    return sorted({unit for node in nodes if (unit := unit_in_schema(node)) is not None})


def _merge(base: dict[str, Any], changes: dict[str, Any], where: tuple[str, ...] = ()) -> dict[str, Any]:
    """Tables are merged; one of another `kind`, or with a record, takes the place of the old one."""
    merged = dict(base)
    for key, value in changes.items():
        old = base.get(key)
        if not isinstance(value, dict) or not isinstance(old, dict):
            merged[key] = value
        elif len(where) == 1 and where[0] in RECORDS and RECORDS[where[0]][0] in value:
            merged[key] = without_record(where[0], old) | value
        elif "from" in value:
            merged[key] = value
        elif value.get("kind", old.get("kind")) == old.get("kind"):
            merged[key] = _merge(old, value, (*where, key))
        else:
            merged[key] = value
    Noted(base).keep_true(merged)
    return merged


def scenario_text(scenario: Scenario, comment: str) -> str:
    """A scenario as a TOML file that `load` reads."""
    return toml_text(without_empty(scenario.model_dump(exclude_none=True)), comment)


def gearbox_from_record(reference: str, overrides: Iterable[str] = ()) -> tuple[Gearbox, tuple[str, ...]]:
    """A record's gearbox with ``KEY=VALUE`` changes, as in `[gearbox]`, and its notes."""
    changes: dict[str, Any] = {}
    set_values(changes, ((key.removeprefix("gearbox."), value) for key, value in map(parse_override, overrides)))
    values, built = gearbox_table(reference, changes)
    with prefixed(f"gearbox {reference}"):
        gearbox = Gearbox(**values)
    told = Notes(find(reference, "gearbox").note).values()
    return gearbox, tuple(note for note in (*told, *(built.notes if built else ())) if note in str(gearbox.note))


def screw_from_record(reference: str, overrides: Iterable[str] = ()) -> ScrewData:
    """A record's screw with ``KEY=VALUE`` changes, as beside `from` in `[screws.NAME]`."""
    changes: dict[str, Any] = {}
    set_values(changes, ((key.removeprefix("screw."), value) for key, value in map(parse_override, overrides)))
    values = linear_table("screw", reference, changes, "screw")
    with prefixed(f"screw {reference}"):
        return RatedScrew(**values)
