"""The parts made of the records of the catalogue, with changes and under conditions of use."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from ..errors import InputError, prefixed
from ..inputs.argument_checks import RecordName, checked
from ..inputs.implausible_values import doubt
from ..inputs.part import Part
from ..inputs.quantities import Angle, Inertia, NotNegative, Number, Positive, Temperature, argument
from ..inputs.refusal_messages import shortened, shown, unknown_key
from ..inputs.schema import keys_within
from ..inputs.toml_files import is_in_file
from ..model.gearbox import Gearbox
from ..model.motor import DC_KEYS, Motor
from ..model.notes import Noted, Notes, together
from ..model.torsion import LinearStiffness, TorsionCurve

if TYPE_CHECKING:
    from .actuator_sheet import ActuatorSheet
    from .gearbox_sheet import GearboxSheet
    from .loss_map_from_data_sheet import BuiltMap
    from .motor_sheet import MotorSheet

S = TypeVar("S", bound="GearboxSheet | MotorSheet | ActuatorSheet")


class Conditions(Part):
    """Conditions of use of a record: keys of `[gearbox]` beside `from`."""

    temperature: Temperature | None = None  #: temperature of the lubricant; default: the temperature of the data
    added_backlash: Annotated[Angle, NotNegative] = 0.0  #: wear
    loss_factor: Annotated[Number, Positive] = 1.0  #: wear


def gearbox_table(
    reference: str, changes: Mapping[str, Any], where: str = "gearbox"
) -> tuple[dict[str, Any], BuiltMap | None]:
    """Values of `[gearbox]`, or of the table `where`, for a record with `changes`, and the loss map's origin.

    A change replaces the value that it names and nothing else. The hysteresis stays as the record prints it, also if
    the stiffness is changed or wear adds backlash.
    """
    from .gearbox_sheet import GearboxSheet  # here, as most scenarios name no record
    from .records import find

    known = {*Gearbox.model_fields, *Conditions.model_fields}
    for key in changes:
        if key not in known:
            schema = Gearbox.model_json_schema()
            inner = [".".join((where, *path)) for path in keys_within(schema, [schema])]
            raise InputError(unknown_key(key, known, inner), f"{where}.{shortened(key)}")
    record = find(reference, "gearbox")
    assert isinstance(record, GearboxSheet)
    return _table_of_sheet(record, shown(reference), changes, where)


def gearbox_of(sheet: GearboxSheet) -> Gearbox:
    """The gearbox of a data sheet."""
    return Gearbox(**_table_of_sheet(sheet, shown(sheet.name), {}, "gearbox")[0])


def _table_of_sheet(
    record: GearboxSheet, name: str, changes: Mapping[str, Any], where: str
) -> tuple[dict[str, Any], BuiltMap | None]:
    from .gearbox_sheet import SCALARS
    from .loss_map_from_data_sheet import build_loss_map

    scalars = {key: value for key, value in changes.items() if key in SCALARS}
    try:
        sheet = _with(record, scalars)
        conditions = Conditions(**{key: changes[key] for key in Conditions.model_fields if key in changes})
    except InputError as error:
        raise InputError(error, table=where, record=name) from None
    for key, hint in sheet.missing().items():
        if key not in changes:
            lacks = f"the record lacks {key}, {hint}; give {where}.{key} beside {_naming(where)}"
            raise InputError(lacks, table=where, record=name)
    built = None
    if not _whole(changes.get("losses")):
        try:
            built = build_loss_map(sheet, temperature=conditions.temperature, loss_factor=conditions.loss_factor)
        except ValueError as error:
            raise InputError(f"gearbox {error}") from None
    table: dict[str, Any] = sheet.scalars() | {"limits": sheet.limits().model_dump()}
    if (torsion := sheet.torsion()) is not None:
        table["stiffness"] = torsion.model_dump()
    if built is not None:
        table["losses"] = built.losses.model_dump()
        if (estimate := sheet.loss_estimate()) is not None:
            table["loss_range"] = estimate.factors()
    table["note"] = together(sheet.note, {"losses": " ".join(built.notes if built else ())})
    noted = Noted(table)
    _change(table, changes)
    if "hysteresis" not in changes:
        table["hysteresis"] = _hysteresis(record, sheet, table["stiffness"])
    _wear(table, changes, conditions, where)
    noted.keep_true(table)
    return table, built


def _naming(where: str) -> str:
    """The key of a table that names its record."""
    return "`gearbox`" if where.startswith("gears.") else "`from`"


def _with(sheet: S, values: Mapping[str, Any]) -> S:
    """A sheet with other values, and with the notes that still hold for these values."""
    if not values:
        return sheet
    given = {name: getattr(sheet, name) for name in sheet.model_fields_set}
    changed = {**given, **values}
    return type(sheet)(**{**changed, "note": Notes(sheet.note).still_true(given, changed)})


def _whole(table: Any) -> bool:
    """Whether a change takes the place of a whole table, as it says its kind."""
    return isinstance(table, Mapping) and "kind" in table


def _change(table: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Puts changes into a part's values; a table without a kind changes single keys."""
    for key, value in changes.items():
        if key in Conditions.model_fields:
            continue
        old = table.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping) and not _whole(value):
            table[key] = {**old, **value}
        else:
            table[key] = value


def _hysteresis(record: GearboxSheet, sheet: GearboxSheet, stiffness: Any) -> dict[str, Any] | None:
    """Hysteresis of the record as printed; missing values come from the changes."""
    if isinstance(stiffness, Mapping) and stiffness.get("kind") == "rigid":
        return None
    printed = sheet if record.rated_output_torque is None else record
    try:
        curve = printed.torsion_curve() if printed.stiffness is not None else _curve(stiffness)
        found = None if curve is None else printed.hysteresis(curve)
    except ValueError as error:
        raise InputError(f"gearbox {error}") from None
    return None if found is None else found.model_dump()


def _curve(stiffness: Any) -> TorsionCurve | LinearStiffness | None:
    """A stiffness as a part; None if it is not valid, which the gearbox then reports with the name of the key."""
    if not isinstance(stiffness, Mapping):
        return None
    with suppress(InputError):
        return LinearStiffness(**stiffness) if stiffness.get("kind") == "linear" else TorsionCurve(**stiffness)
    return None


def _wear(table: dict[str, Any], changes: Mapping[str, Any], conditions: Conditions, where: str) -> None:
    """Adds the backlash, and refuses conditions that would have no effect."""
    if "losses" in changes:
        for key, default in (("loss_factor", 1.0), ("temperature", None)):
            if getattr(conditions, key) != default:
                raise InputError(
                    f"acts on the record's own losses; leave it out beside {where}.losses", f"{where}.{key}"
                )
    if conditions.added_backlash == 0.0:
        return
    curve = _curve(table["stiffness"])
    if isinstance(curve, TorsionCurve):
        table["stiffness"] = curve.model_dump() | {"backlash": curve.backlash + conditions.added_backlash}
    elif curve is not None or _whole(table["stiffness"]):
        raise InputError(
            f'needs a torsion curve; leave it out, or give {where}.stiffness the kind "curve"',
            f"{where}.added_backlash",
        )


@checked
def gearbox(
    name: RecordName, *, temperature: float | None = None, added_backlash: float = 0.0, loss_factor: float = 1.0
) -> Gearbox:
    """Return the gearbox of a record.

    Parameters
    ----------
    name : str
        Name of a record in the catalogue, or a file (``.toml``) with one record.
    temperature : float, optional
        Temperature of the lubricant [°C]. Default: the temperature of the data.
    added_backlash : float
        Wear: added to the printed backlash [rad].
    loss_factor : float
        Wear: factor of all losses.

    Returns
    -------
    Gearbox
        The gearbox with stiffness, backlash, hysteresis and loss map.

    Raises
    ------
    InputError
        There is no such record, or it lacks data that a run requires.

    Examples
    --------
    >>> import lostmotion as lm
    >>> gearbox = lm.gearbox("wittenstein-tp010-mf-10")
    >>> gearbox.ratio, round(gearbox.rated_output_torque, 1)
    (10.0, 81.0)
    """
    doubt("added_backlash", added_backlash)
    changes: dict[str, Any] = {"added_backlash": added_backlash, "loss_factor": loss_factor}
    if temperature is not None:
        changes["temperature"] = temperature
    table, _ = gearbox_table(name, changes)
    return Gearbox(**table)


@checked
def motor(name: RecordName, *, voltage_limit: float | None = None) -> Motor:
    """Return the motor of a record.

    Parameters
    ----------
    name : str
        Name of a record in the catalogue, or a file (``.toml``) with one record.
    voltage_limit : float, optional
        Largest voltage of the amplifier [V].

    Returns
    -------
    Motor
        The motor with its speed-torque line and limits.

    Raises
    ------
    InputError
        There is no such record, or it lacks data that a run requires.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.motor("maxon-ec-i-52-606793").kind
    'dc'
    """
    table = motor_table(name, {} if voltage_limit is None else {"voltage_limit": voltage_limit})
    with prefixed(f"motor {name}"):
        return Motor(**table)


@checked
def actuator(
    name: RecordName, *, rotor_inertia: Inertia | None = None, efficiency: Number | None = None
) -> tuple[Motor, Gearbox]:
    """Return the motor and the gearbox of the record of an actuator.

    Parameters
    ----------
    name : str
        Name of a record in the catalogue, or a file (``.toml``) with one record.
    rotor_inertia : float, optional
        Inertia of the rotor [kg·m²] in place of the record's value.
    efficiency : float, optional
        Efficiency of the gearbox at rated load, in place of the record's value or the estimate for its kind.

    Returns
    -------
    tuple of Motor and Gearbox
        A torque source, and a rigid gearbox with a loss map.

    Raises
    ------
    InputError
        There is no such record, or it lacks data that a run requires.

    Examples
    --------
    >>> import lostmotion as lm
    >>> motor, gearbox = lm.actuator("t-motor-ak80-6")
    >>> gearbox.ratio, motor.kind
    (6.0, 'torque_source')
    """
    from .actuator_sheet import ActuatorSheet
    from .records import find

    sheet = find(name, "actuator")
    assert isinstance(sheet, ActuatorSheet)
    beside = {"rotor_inertia": rotor_inertia, "efficiency": efficiency}
    beside = {key: value for key, value in beside.items() if value is not None}
    sheet = _with(sheet, beside)
    for key, hint in sheet.missing().items():
        raise InputError(f"the record lacks {key}, {hint}", table="actuator", record=shown(name))
    return sheet.motor(), gearbox_of(sheet.gearbox_sheet())


# Keys of `[motor]` that may close a gap of a record, and the keys of a sheet that say the same.
CLOSES = {
    "rotor_inertia": ("rotor_inertia",),
    "friction_torque": ("friction_torque", "no_load_current"),
    "electrical_time_constant": ("electrical_time_constant", "inductance"),
    "dc_voltage": ("dc_voltage",),
    "rated_torque": ("rated_torque", "rated_current"),
    "steps_per_revolution": ("steps_per_revolution",),
    "holding_torque": ("holding_torque",),
    "detent_torque": ("detent_torque",),
}
OF_STEPPERS = ("steps_per_revolution", "holding_torque", "detent_torque")


def motor_table(reference: str, changes: Mapping[str, Any], where: str = "motor") -> dict[str, Any]:
    """Values of `[motor]`, or of the table `where`, for a record with `changes`. Each change replaces the value that it names."""
    from .motor_sheet import MotorSheet
    from .records import find

    record = find(reference, "motor")
    assert isinstance(record, MotorSheet)
    lacked = [key for key, same in CLOSES.items() if all(getattr(record, name) is None for name in same)]
    gaps = {key: changes[key] for key in lacked if key in changes}
    if record.kind != "synchronous":
        gaps.pop("dc_voltage", None)  # there it stands beside the kind "synchronous"
    for key in ("rated_torque", "electrical_time_constant") if record.kind == "stepper" else OF_STEPPERS:
        gaps.pop(key, None)  # which the part refuses
    winding = changes.get("winding")
    if record.kind == "brushless" and isinstance(winding, Mapping) and "pole_pairs" in winding:
        gaps["pole_pairs"] = winding["pole_pairs"]
    try:
        sheet = _with(record, gaps)
        table = (sheet.synchronous() if changes.get("kind") == "synchronous" else sheet.motor()).model_dump()
    except ValueError as error:
        needed = {*record.missing(), *(["dc_voltage"] if changes.get("kind") == "synchronous" else [])}
        keys = [f"{where}.{key}" for key in lacked if key in needed and key not in changes]
        remedy = f"; give {' and '.join(keys)} beside `from`" if keys else ""
        reason = error.reason if isinstance(error, InputError) else str(error)
        raise InputError(reason + remedy, table=where, record=shown(reference)) from None
    noted = Noted(table)
    if changes.get("kind") == "torque_source":
        table = as_torque_source(table)
    elif "rated_voltage" in changes:
        table = at_voltage(table, changes["rated_voltage"], changes, where)
    _change(table, changes)
    noted.keep_true(table)
    return table


def as_torque_source(table: Mapping[str, Any]) -> dict[str, Any]:
    """The values of `[motor]` without the keys that only a DC motor has."""
    return {key: value for key, value in table.items() if key not in DC_KEYS}


def at_voltage(table: Mapping[str, Any], voltage: Any, given: Collection[str], where: str = "motor") -> dict[str, Any]:
    """Values of `[motor]` with another rated voltage, as `Motor.at_voltage`.

    table: as a scenario has it. One that is no whole DC motor with a rated voltage only gets the new one.
    voltage: [V], or text with a unit.
    given: keys that are changed too: where these say all that would follow, nothing does.
    """
    changed = {**table, "rated_voltage": voltage}
    if {"rated_speed", "armature_voltage_constant"} <= set(given):
        return changed
    try:
        motor = Motor(**{key: value for key, value in table.items() if key in Motor.model_fields})
        value = argument("rated_voltage", voltage, "V")
    except InputError:
        return changed  # which the scenario refuses, with the name of the key
    if motor.kind != "dc" or motor.rated_voltage is None or value <= 0.0:
        return changed
    try:
        moved = motor.at_voltage(value)
    except InputError as error:
        raise InputError(error, f"{where}.rated_voltage") from None
    follow = ("rated_speed", "armature_voltage_constant")
    return changed | {key: getattr(moved, key) for key in follow}


OF_THE_MOTOR = "of the motor"  # brake of a task: that which is built into the motor
# Tables of a task that may name a record, and the keys of both that say the same.
ACCESSORIES = {
    "brake": {"torque": "holding_torque", "inertia": "inertia"},
    "amplifier": {key: key for key in ("continuous_current", "peak_current", "peak_time", "max_dc_voltage")},
}


def built_in_brake(motor: str) -> dict[str, Any]:
    """Values of `task.brake` for the brake of a record of a motor."""
    from .accessory_sheets import BrakeSheet
    from .records import catalogue

    found = next((r for r in catalogue() if isinstance(r, BrakeSheet) and motor.lower() in r.motors), None)
    if found is None:
        lacks = "the catalogue has no brake of this motor; give its torque and inertia from the data sheet"
        raise InputError(lacks, table="task.brake", record=shown(motor))
    return _accessory("brake", {"from": found.name})


def _accessory(kind: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Values of `task.brake` or `task.amplifier`, merged with the values of the record that it names; the other keys go before them."""
    from .records import find

    record = find(table["from"], kind)
    for key, hint in record.missing().items():
        raise InputError(f"the record lacks {key}, {hint}", table=f"task.{kind}", record=shown(table["from"]))
    values = {key: getattr(record, own) for key, own in ACCESSORIES[kind].items()}
    beside = {key: value for key, value in table.items() if key != "from"}
    return {key: value for key, value in values.items() if value is not None} | beside


def use_accessories(task: Any, motor: Any = None) -> Any:
    """A table `[task]` with the values of the records of brake and amplifier; the brake of the motor that `motor` names, if it does."""
    if not isinstance(task, dict):
        return task
    found = dict(task)
    for kind in ACCESSORIES:
        given = found.get(kind)
        if kind == "brake" and given == OF_THE_MOTOR:
            name = motor.get("from") if isinstance(motor, dict) else motor
            found[kind] = built_in_brake(name) if isinstance(name, str) else {"of_the_motor": True}
        elif isinstance(given, str) or (isinstance(given, dict) and "from" in given):
            found[kind] = _accessory(kind, {"from": given} if isinstance(given, str) else given)
    return found


def record_in(directory: Path, given: Any, key: str = "from") -> Any:
    """A table that names a record, or its name alone. If the record is in a file relative to the directory, with the whole name."""
    name = given.get(key) if isinstance(given, dict) else given
    if not isinstance(name, str) or not is_in_file(name):
        return given
    return {**(given if isinstance(given, dict) else {}), key: str(directory / name)}


def accessories_in(directory: Path, task: Any) -> Any:
    """A table `[task]` with the whole names of the files of its brake and amplifier."""
    if not isinstance(task, dict):
        return task
    return task | {kind: record_in(directory, task[kind]) for kind in ACCESSORIES if kind in task}


def _without_record(key: str) -> str:
    """Remedy of a condition that changes a gearbox without a record."""
    if key == "added_backlash":
        return "is for gearboxes by name (gearbox.from); here change gearbox.stiffness.backlash"
    return "acts on a record; give gearbox.from, or leave it out"


def use_records(data: dict[str, Any]) -> None:
    """Puts the values of a record in place of `from`; the other keys of the table go before them."""
    if "task" in data:
        data["task"] = use_accessories(data["task"], data.get("motor"))
    for table in ("gearbox", "motor"):
        changes = data.get(table)
        if isinstance(changes, str):
            changes = {"from": changes}
        if not isinstance(changes, dict):
            continue
        if "from" not in changes:
            for key in Conditions.model_fields if table == "gearbox" else ():
                if key in changes:
                    raise InputError(_without_record(key), f"gearbox.{key}")
            continue
        changes = dict(changes)
        record = changes.pop("from")
        if not isinstance(record, str):
            raise InputError(f"{shown(record)} must be the name of a record, or of a file with one", f"{table}.from")
        data[table] = gearbox_table(record, changes)[0] if table == "gearbox" else motor_table(record, changes)
