"""The short form of a drive with what only drive trains have: continuous controllers, given motion, end stops, flanks that strike."""

from collections.abc import Mapping
from typing import Any

from ...control.continuous import ContinuousController
from ...errors import InputError
from .drive_tables import DriveTables
from .key_aliases import GEARBOX, LOAD, MOTOR

OF_SHAFT = ("speed", "motion", "end_stops")  # of the load, which drive trains alone have


def is_short(tables: Mapping[str, Any]) -> bool:
    """Whether the short form suffices for such tables."""
    return not (_continuous(tables) or _of_shaft(tables) or _strikes(tables))


def long_form(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The same tables in the long form, for what only drive trains have. Raises InputError: a value cannot be used."""
    continuous, of_shaft, strikes = _continuous(tables), _of_shaft(tables), _strikes(tables)
    if continuous:
        _check_continuous(tables)
    plain = {key: value for key, value in tables.items() if key != "controller" or not continuous}
    if of_shaft:
        plain[LOAD] = {key: value for key, value in _table(tables, LOAD).items() if key not in OF_SHAFT}
    if strikes:
        plain[GEARBOX] = {**_table(tables, GEARBOX), "stiffness": {"kind": "rigid"}}
    drive = dict(DriveTables(**plain).long())
    if continuous:
        drive |= {"command": {}, "controllers": {MOTOR: tables["controller"]}}
    if of_shaft:
        drive["shafts"] = {**drive["shafts"], LOAD: {**dict(drive["shafts"][LOAD]), **of_shaft}}
    if strikes:
        drive["gears"] = {GEARBOX: {**dict(drive["gears"][GEARBOX]), "stiffness": _table(tables, GEARBOX)["stiffness"]}}
    return drive


def _continuous(tables: Mapping[str, Any]) -> bool:
    controller = tables.get("controller")
    return isinstance(controller, ContinuousController) or _table(tables, "controller").get("kind") == "continuous"


def _of_shaft(tables: Mapping[str, Any]) -> dict[str, Any]:
    load = _table(tables, LOAD)
    return {key: load[key] for key in OF_SHAFT if load.get(key) is not None}


def _strikes(tables: Mapping[str, Any]) -> bool:
    stiffness = _table(_table(tables, GEARBOX), "stiffness")
    return stiffness.get("kind") == "rigid" and bool(stiffness.get("backlash") or stiffness.get("restitution"))


def _table(tables: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = tables.get(key)
    return found if isinstance(found, Mapping) else {}


def _check_continuous(tables: Mapping[str, Any]) -> None:
    for key in ("command", "task"):
        if key in tables:
            why = (
                "both turn the motor"
                if key == "command"
                else "a continuous controller is simulated, not judged for a task"
            )
            raise InputError(f"{why}; leave one of them out", key, "controller")
