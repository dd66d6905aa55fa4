"""Records of the catalogue as what a study varies: which keys take names, and which records fit a filter."""

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from ...data_sheets.records import KINDS, called, catalogue, find, read_again
from ...data_sheets.train_components import CONDITIONS, RECORD_KINDS, RECORDS, without_record
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, listed, shown
from ...inputs.schema import unit_in_schema
from ...inputs.toml_files import is_in_file
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.units_of_keys import in_si

# Of keys that take the name of a record: the part that the record describes, and what kind of record it is.
_RECORD_KEYS = {
    "gearbox": re.compile(r"(gearbox)(\.from)?|(gears\.[^.]+)\.gearbox"),
    "motor": re.compile(r"(motor)(\.from)?|(motors\.[^.]+)\.from"),
} | {
    RECORD_KINDS[table]: re.compile(rf"({RECORD_KINDS[table]})|({table}\.[^.]+)\.from")  # the first of a task
    for table in RECORDS
    if table not in ("gears", "motors")
}
_RECORD_KEYS["actuator"] = re.compile("(actuator)")  # of a task
# Of keys that hold beside the name of a record: the part.
_CONDITION = re.compile(
    "|".join(
        rf"({'gearbox|' if table == 'gears' else ''}{table}\.[^.]+)\.(?:{'|'.join(part.model_fields)})"
        for table, part in CONDITIONS.items()
    )
)


def kind_of_record(key: str) -> str | None:
    """The kind of a record, such as ``"gearbox"``, for a key that takes the name of one, else None."""
    return next((kind for kind, pattern in _RECORD_KEYS.items() if pattern.fullmatch(key)), None)


def is_condition(key: str) -> bool:
    """Whether it is a key that holds beside the name of a record only."""
    return _CONDITION.fullmatch(key) is not None


def owner_of(key: str) -> str:
    """The part that such a key belongs to, such as ``gearbox`` or ``gears.worm``."""
    found = next((m for p in (*_RECORD_KEYS.values(), _CONDITION) if (m := p.fullmatch(key))), None)
    assert found is not None, key
    return str(next(group for group in found.groups() if group not in (None, ".from")))


def name_key(part: str) -> str:
    """The key of a part of a scenario that names its record: ``from``, or ``gearbox`` of the gear of a train."""
    table, _, name = part.partition(".")
    return RECORDS[table][0] if name else "from"


def names_a_record(tables: Mapping[str, Any], part: str) -> bool:
    """Whether a part of a scenario, as its file has it, names a record."""
    table, _, name = part.partition(".")
    element = tables.get(table, {})
    element = element.get(name, {}) if name else element
    return isinstance(element, str) or name_key(part) in element


def names_that_fit(table: str, wanted: Mapping[str, Any]) -> list[str]:
    """The names of all records that a filter lets through.

    table: the kind of records, such as ``"gearbox"``.
    wanted: for each datum of a record a text in any case with ``*`` for anything (``kind``, ``manufacturer``,
        ``name``), or minimum and maximum. A record that lacks the datum does not fit.
    """
    schema = KINDS[table].model_json_schema()["properties"]
    known = [key for key, node in schema.items() if unit_in_schema(node) is not None or _is_text(key)]
    bounds = {}
    for key, value in wanted.items():
        if key not in known:
            raise ValueError(
                f"has catalogue.{key}, which is no datum of {called(table)}; they are {listed(sorted(known))}"
            )
        if _is_text(key):
            if not isinstance(value, str):
                raise ValueError(
                    f"has catalogue.{key} = {shown(value)}; it must be a text in quotes, * standing for anything"
                )
            continue
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise ValueError(f"has catalogue.{key} = {shown(value)}; it must be a list of minimum and maximum")
        try:
            bounds[key] = [float(x) for x in in_si(value, unit_in_schema(schema[key]))]
        except (TypeError, ValueError) as error:
            raise ValueError(f"has catalogue.{key} = {shown(value)}: {error}") from None
        if not bounds[key][0] <= bounds[key][1]:
            raise ValueError(f"has catalogue.{key} = {shown(value)}, which is reversed; the least value comes first")
    records = [r for r in catalogue() if isinstance(r, KINDS[table]) and (not r.illustrative or "name" in wanted)]

    def fits(record: Any, key: str) -> bool:
        value = getattr(record, key)
        if _is_text(key):
            return fnmatchcase(str(value).lower(), wanted[key].lower())
        return value is not None and bounds[key][0] <= value <= bounds[key][1]

    found = [record.name for record in records if all(fits(record, key) for key in wanted)]
    if not found:
        raise ValueError(
            _why_none_fits(table, wanted, {key: [fits(r, key) for r in records] for key in wanted}, records)
        )
    return found


def _why_none_fits(
    table: str, wanted: Mapping[str, Any], fits: Mapping[str, list[bool]], records: Sequence[Any]
) -> str:
    """Condition of a filter that no record meets, or how many records fit without each condition."""
    name = table.replace("_", " ")
    for key in wanted:
        if any(fits[key]):
            continue
        values = [value for r in records if (value := getattr(r, key)) is not None]
        if _is_text(key):
            names = sorted({value for value in values if value})
            there = did_you_mean(str(wanted[key]), names, f"there are {', '.join(names)}")
        elif values:
            unit = unit_in_schema(KINDS[table].model_json_schema()["properties"][key])
            there = f"they go from {min(values):.4g} to {max(values):.4g}{'' if unit in ('', '1') else f' {unit}'}"
        else:
            there = "no record has it"
        return f"has catalogue.{key} = {shown(wanted[key])}, which no {name} of the catalogue has; {there}"
    rest = {
        key: sum(all(f[k] for other, f in fits.items() if other != key) for k in range(len(records))) for key in wanted
    }
    without = ", ".join(f"{count} without {key}" for key, count in rest.items() if count) or "leave two of them out"
    return f"has a catalogue filter that no {name} fits: {without}; `lostmotion catalogue` lists them"


def _is_text(key: str) -> bool:
    return key in ("name", "kind", "manufacturer", "profile")


def names_of(table: str, given: Any, directory: Path = Path()) -> list[str]:
    """The names of all records that a list gives: names, files and directories of data sheets, and filters of the catalogue.

    table: the kind of records, such as ``"gearbox"``.
    given: one of these, or a list: the name of a record; a file (``.toml``) or a directory of such files; all records
        of the kind are taken; a filter as `names_that_fit` takes it. What is named twice is taken once.
    directory: files and directories are relative to it.
    """
    found: list[str] = []
    for one in given if isinstance(given, list | tuple) else [given]:
        if isinstance(one, Mapping):
            found += names_that_fit(table, one)
        elif not isinstance(one, str):
            raise ValueError(f"has the value {shown(one)}, which is no name of {called(table)}")
        elif is_in_file(one):
            file, _, name = one.partition("#")
            path = str((directory / file).resolve()) if directory != Path() else file
            found += [f"{path}#{name}"] if name else _of_file(table, path)
        elif one.endswith("/") or (directory / one).is_dir():
            found += _of_directory(table, directory / one)
        else:
            found.append(one)
    return list(dict.fromkeys(found))


def _of_file(table: str, path: str) -> list[str]:
    """References to all records of a kind in a file; to an only one by the file alone."""
    own = [record.name for record in read_again(Path(path)) if isinstance(record, KINDS[table])]
    return [f"{path}#{name}" for name in own] if len(own) > 1 else [path]


def _of_directory(table: str, directory: Path) -> list[str]:
    """References to all records of a kind in the files of a directory."""
    if not directory.is_dir():
        raise ValueError(f"has {shown(str(directory))}, which is no directory; name one with data sheets (.toml)")
    files = sorted(directory.resolve().glob("*.toml"))
    holds = [file for file in files if any(isinstance(r, KINDS[table]) for r in read_again(file))]
    if not holds:
        raise ValueError(
            f"has the directory {shown(str(directory))}, in which no data sheet (.toml) has {called(table)}"
        )
    return [name for file in holds for name in _of_file(table, str(file))]


def shown_name(reference: str) -> str:
    """A reference to a record in lists of results: of one in a file its own name."""
    return reference.partition("#")[2] or reference


def check_names(table: str, names: Any) -> None:
    """Sees that all are names of records, or of files with one."""
    if not isinstance(names, list | tuple):
        raise ValueError(f"has values = {shown(names)}; it must be a list of names")
    for name in names:
        if not isinstance(name, str):
            raise ValueError(f"has the value {shown(name)}, which is no name of {called(table)}")
        find(name, table)


def with_records(written: Mapping[str, Any], changes: Mapping[str, Any]) -> Scenario:
    """The scenario of tables in which records, and the conditions of their use, are others.

    What the tables give beside the name of a record holds for every record; of a part without such a name the record takes
    the place.
    """
    tables = dict(written)
    # The names first, so that the conditions find them.
    for key in sorted(changes, key=lambda key: kind_of_record(key) is None):
        table, _, name = owner_of(key).partition(".")
        if name:
            tables[table] = {**tables[table], name: _changed(tables, f"{table}.{name}", key, changes[key])}
        else:
            tables[table] = _changed(tables, table, key, changes[key])
    return Scenario(**tables)


def _changed(tables: Mapping[str, Any], part: str, key: str, value: Any) -> dict[str, Any]:
    table, _, name = part.partition(".")
    element: Any = tables[table][name] if name else tables.get(table)
    if names_a_record(tables, part):
        beside = {"from": element} if isinstance(element, str) else dict(element)
    elif kind_of_record(key):
        beside = without_record(table, element) if name else {}
    else:
        raise InputError(f"{key} belongs beside `{name_key(part)}`, but the {part} of the base is written out")
    return beside | {name_key(part) if kind_of_record(key) else key.rpartition(".")[2]: value}
