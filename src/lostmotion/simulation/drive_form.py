"""The short form of a drive with what only drive trains have: continuous controllers, given motion, flanks that strike."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from ..errors import InputError
from .drive_scenario import from_tables
from .keys import renamed
from .scenario import Scenario
from .train_scenario import TrainScenario, in_long_form

MOTOR, LOAD, GEARBOX = "motor", "load", "gearbox"  # names in the long form
GIVEN = ("speed", "motion")
# Keys of the long form that such a scenario is checked by, and those of its file.
KEYS = {
    f"controllers.{MOTOR}": "controller",
    f"command.{MOTOR}": "command",
    f"shafts.{LOAD}": LOAD,
    f"gears.{GEARBOX}": GEARBOX,
    f"initial.speeds.{LOAD}": "initial.load_speed",
    f"initial.angles.{LOAD}": "initial.load_angle",
}


def drive_from_tables(tables: Mapping[str, Any]) -> Scenario:
    """The scenario of such tables: one in the long form where the short one does not suffice.

    Raises
    ------
    InputError
        A record is unknown or lacks what a run needs; a value cannot be used.
    """
    controller, load, gearbox = (_table(tables, key) for key in ("controller", LOAD, GEARBOX))
    continuous = controller.get("kind") == "continuous"
    given = {key: load[key] for key in GIVEN if load.get(key) is not None}
    stiffness = _table(gearbox, "stiffness")
    strikes = stiffness.get("kind") == "rigid" and bool(stiffness.get("backlash") or stiffness.get("restitution"))
    if not (continuous or given or strikes):
        return from_tables(tables)
    if continuous:
        _check_continuous(tables)
    plain = {key: value for key, value in tables.items() if key != "controller" or not continuous}
    if given:
        plain[LOAD] = {key: value for key, value in load.items() if key not in GIVEN}
    if strikes:
        plain[GEARBOX] = {**gearbox, "stiffness": {"kind": "rigid"}}
    drive = dict(in_long_form(from_tables(plain)))
    if continuous:
        drive |= {"command": {}, "controllers": {MOTOR: controller}}
    if given:
        drive["shafts"] = {**drive["shafts"], LOAD: {**dict(drive["shafts"][LOAD]), **given}}
        drive["initial"] = _without_load(drive["initial"], "motion" in given)
    if strikes:
        drive["gears"] = {GEARBOX: {**dict(drive["gears"][GEARBOX]), "stiffness": stiffness}}
    try:
        return TrainScenario(**drive)
    except InputError as error:
        raise error.with_keys(partial(renamed, names=KEYS)) from None


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
            raise InputError(f"keys {key}, controller: {why}; leave one of them out")


def _without_load(initial: Any, angle: bool) -> Any:
    """The start without the zeros of the load, whose motion begins as it is given."""
    left_out = ("speeds", "angles") if angle else ("speeds",)
    kept = {
        key: {name: value for name, value in getattr(initial, key).items() if name != LOAD or value != 0.0}
        for key in left_out
    }
    return initial.model_copy(update=kept)
