"""Scenario files: TOML in the words of the parts, with units, checked before anything runs."""

from __future__ import annotations

import csv
import difflib
import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import ValidationError, model_validator

from .errors import InputError
from .parts import Drive, Gearbox, Load, Motor, Rigid
from .quantities import Angle, NotNegative, Part, Positive, Speed, Time, Torque
from .records import Conditions, gearbox_table, motor
from .signals import CommandSignal, TorqueSignal
from .task import Task
from .toml_files import read_toml

MAX_SAMPLES = 100_000_000


class LoadTable(Load):
    """The driven body and the disturbance torque on it."""

    torque: TorqueSignal = TorqueSignal()
    """M_Z"""


class Initial(Part):
    """State at t = 0."""

    motor_torque: Torque = 0.0
    motor_speed: Speed = 0.0
    load_speed: Speed = 0.0
    twist: Angle = 0.0
    load_angle: Angle = 0.0
    hysteresis_capacity: Annotated[Torque, NotNegative] = 0.0
    """h, which the last turning point before t = 0 left behind"""


class SimulationTable(Part):
    """How long, and at which instants the result is wanted. Neither affects the motion."""

    duration: Annotated[Time, Positive]
    sample_interval: Annotated[Time, Positive]

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        if self.sample_interval > self.duration:
            raise ValueError(f"has a sample_interval of {self.sample_interval} s, longer than its duration")
        if self.duration / self.sample_interval > MAX_SAMPLES:
            raise ValueError(f"asks for more than {MAX_SAMPLES:.0e} samples; lengthen sample_interval")
        return self

    @property
    def samples(self) -> int:
        """Number of instants 0, sample_interval, ... up to the duration."""
        return int(self.duration / self.sample_interval * (1.0 + 1e-12)) + 1


class Scenario(Part):
    """A drive, what acts on it, and what is wanted of it."""

    title: str = ""
    command: CommandSignal = CommandSignal()
    """E_C: 1 is rated voltage, or with a torque source rated torque"""
    motor: Motor
    gearbox: Gearbox
    load: LoadTable
    initial: Initial = Initial()
    task: Task = Task()
    simulation: SimulationTable

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        drive = self.drive()
        start = self.initial
        if isinstance(drive.gearbox.stiffness, Rigid):
            if start.twist != 0.0:
                raise ValueError(f"has initial.twist = {start.twist} rad, but the gearbox is rigid; leave it out")
            if abs(start.motor_speed / drive.gearbox.ratio - start.load_speed) > 1e-12 * abs(start.load_speed):
                raise ValueError(
                    f"has initial.motor_speed = {start.motor_speed} rad/s and initial.load_speed = {start.load_speed} "
                    "rad/s, but the gearbox is rigid; their quotient must be its ratio"
                )
        if drive.motor.kind == "torque_source" and start.motor_torque != 0.0:
            raise ValueError("has initial.motor_torque, but a torque source has no such state; use command")
        return self

    def drive(self) -> Drive:
        """The drive without its surroundings."""
        load = Load(**{name: getattr(self.load, name) for name in Load.model_fields})
        return Drive(motor=self.motor, gearbox=self.gearbox, load=load)

    def __repr__(self) -> str:
        title = f"{self.title!r}, " if self.title else ""
        return f"Scenario({title}{self.drive()!r}, {self.simulation.duration:.4g} s, {self.simulation.samples} samples)"

    def replace(self, **changes: Any) -> Scenario:
        """The same scenario with changes by dotted key, such as ``**{"command.amplitude": 0.1}``, checked anew."""
        data = self.model_dump()
        for key, value in changes.items():
            _set(data, key, value)
        return Scenario(**data)

    def to_json(self) -> str:
        """All values in SI, as JSON that `from_json` reads."""
        return self.model_dump_json(exclude_none=True)

    @classmethod
    def from_json(cls, text: str) -> Scenario:
        return cls(**json.loads(text))


def drive_of(what: Scenario | Drive) -> Drive:
    """The drive of a scenario, or a drive as it is.

    Raises
    ------
    TypeError
        It is neither.
    """
    if isinstance(what, Drive):
        return what
    if isinstance(what, Scenario):
        return what.drive()
    raise TypeError(f"{what!r:.60} is no drive; give a Drive, or a Scenario such as load(path) returns")


def mean_inputs(
    what: Scenario | Drive, command: float | None = None, load_torque: float | None = None
) -> tuple[float, float]:
    """Constant parts of E_C [-] and M_Z [N·m]: as given, else those of the scenario, else 0."""
    known = (what.command.mean, what.load.torque.mean) if isinstance(what, Scenario) else (0.0, 0.0)
    return known[0] if command is None else command, known[1] if load_torque is None else load_torque


def shipped_scenarios() -> dict[str, Path]:
    """The scenarios that come with the package: name -> file."""
    directory = files("lostmotion") / "scenarios"
    return {f.name.removesuffix(".toml"): Path(str(f)) for f in sorted(directory.iterdir(), key=lambda f: f.name)}


def find_scenario(name: str | Path, directory: Path = Path()) -> Path:
    """The file that is meant: a path relative to `directory`, or the name of a shipped scenario.

    Raises
    ------
    InputError
        It is neither; the message names what is near.
    """
    path = directory / name
    shipped = shipped_scenarios() if len(Path(name).parts) == 1 else {}
    if path.is_file() or not shipped:
        return path
    if str(name) in shipped:
        return shipped[str(name)]
    if Path(name).stem in shipped and not path.exists():
        raise InputError(
            f"{path}: there is no such file; the shipped scenario is called {Path(name).stem}, without ending"
        )
    if path.suffix or path.exists():
        return path
    near = difflib.get_close_matches(str(name), shipped, n=1)
    hint = f"did you mean {near[0]}?" if near else f"the scenarios that come with the package are {', '.join(shipped)}"
    raise InputError(f"{name}: there is no such file (.toml) and no such scenario; {hint}")


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
    """The scenario of the tables of a file, whose name stands in messages.

    Raises
    ------
    InputError
        With one line that names the file, the key, the value and the remedy.
    """
    try:
        return from_tables(tables)
    except ValidationError as error:
        raise InputError(f"{path}: {describe(error)}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read_tables(path: str | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> dict[str, Any]:
    """The tables of a scenario file with those of its `base` and the overrides, records still as `from`.

    Raises
    ------
    InputError
    """
    data = _read(find_scenario(path), ())
    override(data, overrides)
    return data


def override(data: dict[str, Any], overrides: Mapping[str, Any] | Iterable[str]) -> None:
    """Changes tables by dotted key.

    Raises
    ------
    InputError
    """
    items = overrides.items() if isinstance(overrides, Mapping) else [_parse_override(text) for text in overrides]
    for key, value in items:
        try:
            _set(data, key, value)
        except KeyError as error:
            raise InputError(f"--set {key}: {error.args[0]}") from None


def from_tables(tables: Mapping[str, Any]) -> Scenario:
    """The scenario of such tables.

    Raises
    ------
    InputError, pydantic.ValidationError
        A record is unknown or lacks what a run needs; a value cannot be used.
    """
    data = dict(tables)
    _use_records(data)
    return Scenario(**data)


def json_schema() -> dict[str, Any]:
    """JSON Schema of scenario files, for editors."""
    schema = Scenario.model_json_schema()
    schema["properties"]["base"] = {"type": "string", "description": "scenario file that this one changes"}
    schema["required"] = []  # with a base, none
    for table in ("gearbox", "motor"):
        whole = schema["properties"][table]
        name = {"type": "string", "description": "name of a record of the catalogue, or a file with one (.toml)"}
        conditions = Conditions.model_json_schema()["properties"] if table == "gearbox" else {}
        from_record = {
            "type": "object",
            "properties": {"from": name} | conditions,
            "required": ["from"],
            "description": f"A {table} of the catalogue, or of a sheet file; other keys take the place of its values.",
        }
        schema["properties"][table] = {"anyOf": [whole, name, from_record]}
    return schema


def _read(path: Path, including: tuple[Path, ...]) -> dict[str, Any]:
    if path.resolve() in including:
        raise InputError(f"{path}: key base: leads back to this file; break the circle")
    data = read_toml(path, "a scenario")
    _read_series(data, path, ())
    for table in ("gearbox", "motor"):
        if isinstance(data.get(table), str):
            data[table] = {"from": data[table]}
        record = data.get(table, {}).get("from") if isinstance(data.get(table), dict) else None
        if isinstance(record, str) and record.endswith(".toml"):
            data[table]["from"] = str(path.parent / record)
    if "base" not in data:
        return data
    base = data.pop("base")
    if not isinstance(base, str):
        raise InputError(f"{path}: key base: {base!r} must be the name of a scenario file")
    return _merge(_read(find_scenario(base, path.parent), (*including, path.resolve())), data)


def _read_series(data: dict[str, Any], path: Path, keys: tuple[str, ...]) -> None:
    """Puts the points of `samples.file`, a CSV file beside the scenario, in its place."""
    for key, value in data.items():
        if not isinstance(value, dict):
            continue
        where = (*keys, key)
        if key != "samples" or "file" not in value:
            _read_series(value, path, where)
            continue
        name = value.pop("file")
        problem = f"{path}: key {'.'.join(where)}.file: {name!r}"
        if value:
            raise InputError(f"{problem} leaves no room for {', '.join(value)}; give the file alone")
        if not isinstance(name, str):
            raise InputError(f"{problem} must be the name of a CSV file with columns time [s] and value")
        try:
            with (path.parent / name).open(newline="", encoding="utf-8") as file:
                rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
            points = [(float(time), float(number)) for time, number in rows[_has_heading(rows) :]]
        except OSError as error:
            raise InputError(f"{problem} cannot be read: {error.strerror}") from None
        except ValueError:
            raise InputError(f"{problem} is not a CSV file with two columns of numbers, time [s] and value") from None
        value["times"], value["values"] = [t for t, _ in points], [v for _, v in points]


def _has_heading(rows: list[list[str]]) -> bool:
    try:
        float(rows[0][0])
    except (ValueError, IndexError):
        return bool(rows)
    return False


def _merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Tables are merged; one of another `kind`, or `from` a record, takes the place of the old one."""
    merged = dict(base)
    for key, value in changes.items():
        old = base.get(key)
        if not isinstance(value, dict) or not isinstance(old, dict) or "from" in value:
            merged[key] = value
        elif value.get("kind", old.get("kind")) == old.get("kind"):
            merged[key] = _merge(old, value)
        else:
            merged[key] = value
    return merged


def _use_records(data: dict[str, Any]) -> None:
    """Puts the values of a record in the place of `from`; the other keys of the table go before them."""
    for table in ("gearbox", "motor"):
        changes = data.get(table)
        if isinstance(changes, str):
            changes = {"from": changes}
        if not isinstance(changes, dict) or "from" not in changes:
            continue
        changes = dict(changes)
        record = changes.pop("from")
        if not isinstance(record, str):
            raise InputError(f"key {table}.from: {record!r} must be the name of a record, or of a file with one")
        if table == "gearbox":
            values, _ = gearbox_table(record, changes)
            changes = {key: value for key, value in changes.items() if key not in Conditions.model_fields}
        else:
            values = motor(record).model_dump()
        data[table] = _merge(values, changes)


def gearbox_from_record(reference: str, overrides: Iterable[str] = ()) -> tuple[Gearbox, tuple[str, ...]]:
    """A record's gearbox with ``KEY=VALUE`` changes, as in `[gearbox]`, and the notes of its loss map.

    Raises
    ------
    InputError
    """
    changes: dict[str, Any] = {}
    for key, value in map(_parse_override, overrides):
        _set(changes, key, value)
    values, built = gearbox_table(reference, changes)
    own = {key: value for key, value in changes.items() if key not in Conditions.model_fields}
    try:
        part = Gearbox(**_merge(values, own))
    except ValidationError as error:
        raise InputError(f"gearbox {reference}: {describe(error).removeprefix('the scenario ')}") from None
    return part, built.notes if built else ()


def _parse_override(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text}: must be KEY=VALUE, such as --set command.amplitude=0.1")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def _set(data: dict[str, Any], key: str, value: Any) -> None:
    *tables, name = key.split(".")
    if name == "from" and len(tables) == 1:  # the record takes the place of the whole table
        data[tables[0]] = {"from": value}
        return
    if tables and isinstance(data.get(tables[0]), str):
        data[tables[0]] = {"from": data[tables[0]]}
    node: Any = data
    for table in tables:
        place: Any = list_index(node, table) if isinstance(node, list) else table
        inner = node[place] if isinstance(node, list) else node.setdefault(place, {})
        if table == "torque" and not isinstance(inner, dict):
            inner = node[place] = {"mean": inner}
        if inner is None:
            inner = node[place] = {}
        if isinstance(inner, tuple):
            inner = node[place] = list(inner)
        if not isinstance(inner, dict | list):
            raise KeyError(f"{table} is the value {inner!r}, not a table; it has no {name}")
        node = inner
    node[list_index(node, name) if isinstance(node, list) else name] = value


def list_index(entries: Sequence[Any], part: str) -> int:
    """The index that a part of a dotted key names, such as 0 in ``command.ramps.0.rise``.

    Raises
    ------
    KeyError
        There is no such entry.
    """
    if not (part.isascii() and part.isdigit()):
        raise KeyError(f"{part!r} is no index; entries of a list are numbered from 0")
    if int(part) >= len(entries):
        count = f"{len(entries)} entr{'y' if len(entries) == 1 else 'ies'}"
        raise KeyError(f"there is no entry {part}; the list has {count}, numbered from 0")
    return int(part)


def describe(error: ValidationError) -> str:
    """One line for a failed validation: the key, the value and what would be right."""
    # A misspelt key is the cause of the missing one.
    problems = sorted(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
    first = problems[0]
    # Names of classes that the choice between kinds puts into the location are not keys of the file.
    kinds = {"curve", "linear", "rigid", "constant_efficiency", "map"}
    location = list(first["loc"])
    keys = [
        k for n, k in enumerate(location) if not (k in kinds and n > 0 and location[n - 1] in ("stiffness", "losses"))
    ]
    name = _dotted(keys)
    text = _explain(first, keys)
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return (f"key {name}: {text}" if name else f"the scenario {text}") + more


def _dotted(keys: list[int | str]) -> str:
    text = ""
    for k in keys:
        text += f"[{k}]" if isinstance(k, int) else f".{k}" if text else str(k)
    return text


def _explain(problem: Any, keys: list[int | str]) -> str:
    kind, value, context = problem["type"], problem["input"], problem.get("ctx", {})
    shown = repr(value) if len(repr(value)) < 60 else repr(value)[:57] + "..."
    if kind == "missing":
        return "is missing; add it"
    if kind == "extra_forbidden":
        known = _known_keys(keys[:-1])
        near = difflib.get_close_matches(str(keys[-1]), known, n=1)
        return f"is not known; did you mean {near[0]}?" if near else f"is not known; known here: {', '.join(known)}"
    if kind == "value_error":
        text = str(context["error"])
        return text if isinstance(value, dict) or not isinstance(value, str | float | int) else f"{shown} {text}"
    if kind == "union_tag_invalid":
        return f"kind {context['tag']!r} is not known; it must be one of {context['expected_tags']}"
    if kind == "union_tag_not_found":
        return "lacks kind, which says what it is"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{shown} must be a table with some of the keys {', '.join(_known_keys(keys))}"
    if kind == "finite_number":
        return f"{shown} must be a finite number"
    message = problem["msg"]
    return f"{shown}: {message[0].lower()}{message[1:].replace('Input should', 'must')}".replace("input should", "must")


def _known_keys(keys: list[int | str]) -> list[str]:
    """Field names of the table at this place of the schema."""
    schema = json_schema()
    node: Any = schema
    for key in keys:
        node = _resolve(node, schema)
        node = node.get("items", {}) if isinstance(key, int) else node.get("properties", {}).get(key, {})
    return sorted(_resolve(node, schema).get("properties", {}))


def _resolve(node: Any, schema: dict[str, Any]) -> dict[str, Any]:
    """Follows references and merges the properties of alternatives."""
    if "$ref" in node:
        return _resolve(schema["$defs"][node["$ref"].rsplit("/", 1)[1]], schema)
    options = node.get("anyOf", []) + node.get("oneOf", []) + node.get("allOf", [])
    if not options:
        return dict(node)
    properties: dict[str, Any] = {}
    items: Any = {}
    for option in options:
        resolved = _resolve(option, schema)
        properties |= resolved.get("properties", {})
        items = resolved.get("items", items)
    return {"properties": properties, "items": items}
