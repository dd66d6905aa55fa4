"""Scenario files: TOML in the words of the parts, with units, checked before anything runs."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import model_validator

from ..data_sheets.records import Conditions, as_torque_source, at_voltage, gearbox_table, motor_table
from ..errors import InputError
from ..inputs.quantities import Angle, NotNegative, Part, Positive, Speed, Time, Torque
from ..inputs.toml_files import RESULTS, read_toml
from ..inputs.validation import shown
from ..model.parts import Drive, Gearbox, Load, Motor, Rigid
from ..model.signals import CommandSignal, TorqueSignal
from ..model.task import Task
from .series_files import read_series

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
        _set_all(data, changes.items())
        _use_records(data)
        return Scenario(**data)

    def to_json(self) -> str:
        """All values in SI, as JSON that `from_json` reads."""
        return self.model_dump_json(exclude_none=True)

    @classmethod
    def from_json(cls, text: str) -> Scenario:
        return cls.model_validate_json(text)

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        return json_schema()


def drive_of(what: Scenario | Drive) -> Drive:
    """The drive of a scenario, or a drive as it is."""
    return what if isinstance(what, Drive) else what.drive()


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
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read_tables(path: str | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> dict[str, Any]:
    """The tables of a scenario file with those of its `base` and the overrides, records still as `from`.

    Raises
    ------
    InputError
    """
    path = find_scenario(path)
    data = _read(path, ())
    override(data, overrides, path)
    return data


def override(data: dict[str, Any], overrides: Mapping[str, Any] | Iterable[str], path: Path) -> None:
    """Changes tables of a file by dotted key.

    Raises
    ------
    InputError
    """
    overrides = [overrides] if isinstance(overrides, str) else overrides
    if not isinstance(overrides, Iterable) or not all(isinstance(entry, str) for entry in overrides):
        raise InputError(f'{shown(overrides)} must be changes by key, such as {{"command.amplitude": 0.1}}')
    items = overrides.items() if isinstance(overrides, Mapping) else [_parse_override(text) for text in overrides]
    try:
        _set_all(data, items)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def from_tables(tables: Mapping[str, Any]) -> Scenario:
    """The scenario of such tables.

    Raises
    ------
    InputError
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
            "description": f"A {table} of the catalogue, or of a sheet file; other keys take the place of its values. A table "
            "that says its kind takes the place of the whole one, any other changes the keys that it gives.",
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
        raise InputError(f"{path}: key base: {shown(base)} must be the name of a scenario file")
    if Path(base).suffix in RESULTS:
        raise InputError(
            f"{path}: key base: {shown(base)} has the ending of a saved result; name a scenario file (.toml), or change the result by "
            f"`lostmotion run {base} --set KEY=VALUE`"
        )
    based = _read(find_scenario(base, path.parent), (*including, path.resolve()))
    motor = data.get("motor")
    if isinstance(motor, dict) and "rated_voltage" in motor and "from" not in motor:
        try:
            _set_all(based, [(f"motor.{key}", value) for key, value in motor.items()])
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    return _merge(based, data)


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
        problem = f"{path}: key {'.'.join(where)}.file: {shown(name)}"
        if value:
            raise InputError(f"{problem} leaves no room for {', '.join(value)}; give the file alone")
        if not isinstance(name, str):
            raise InputError(f"{problem} must be the name of a CSV file with columns time [s] and value")
        try:
            value["times"], value["values"] = read_series(path.parent / name, "" if where[0] == "command" else "N*m")
        except InputError as error:
            raise InputError(f"{path}: key {'.'.join(where)}.file: {error}") from None


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
        if not isinstance(changes, dict):
            continue
        if "from" not in changes:
            for key in Conditions.model_fields if table == "gearbox" else ():
                if key in changes:
                    raise InputError(f"key gearbox.{key}: acts on a record; give gearbox.from, or leave it out")
            continue
        changes = dict(changes)
        record = changes.pop("from")
        if not isinstance(record, str):
            raise InputError(f"key {table}.from: {shown(record)} must be the name of a record, or of a file with one")
        data[table] = gearbox_table(record, changes)[0] if table == "gearbox" else motor_table(record, changes)


def gearbox_from_record(reference: str, overrides: Iterable[str] = ()) -> tuple[Gearbox, tuple[str, ...]]:
    """A record's gearbox with ``KEY=VALUE`` changes, as in `[gearbox]`, and the notes of its loss map.

    Raises
    ------
    InputError
    """
    changes: dict[str, Any] = {}
    _set_all(changes, ((key.removeprefix("gearbox."), value) for key, value in map(_parse_override, overrides)))
    values, built = gearbox_table(reference, changes)
    try:
        return Gearbox(**values), built.notes if built else ()
    except InputError as error:
        raise InputError(f"gearbox {reference}: {error}") from None


def _parse_override(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text}: must be KEY=VALUE, such as --set command.amplitude=0.1")
    try:
        parsed = tomllib.loads(f"value = {value}")
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()
    return key.strip(), parsed["value"] if len(parsed) == 1 else value.strip()


def _set_all(data: dict[str, Any], changes: Iterable[tuple[str, Any]]) -> None:
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
