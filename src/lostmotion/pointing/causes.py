"""Causes of pointing errors, and the axis without each."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

from ..control.command import MOST_MICROSTEPS
from ..model.linear_train import LINEAR_DRIVES
from ..simulation.scenario.scenario import Scenario

Tables = dict[str, Any]
K = TypeVar("K")

FINE = 50_000  # microsteps of a run whose steps are taken away
SCREW_LOSSES = "efficiency backdriving_efficiency mean_diameter friction_coefficient friction_angle"
LAWS = "stribeck_speed friction_error friction_curve"
NO_LOSSES = {"kind": "constant_efficiency", "efficiency": 1.0}


def linear_drives(data: Tables) -> Iterator[Tables]:
    """The tables of screws, racks and belts."""
    for table in LINEAR_DRIVES:
        yield from data.get(table, {}).values()


def _backlash(data: Tables) -> None:
    for gear in data["gears"].values():
        stiffness = gear["stiffness"]
        if stiffness["kind"] != "curve":
            continue
        stiffness["backlash"] = 0.0
        slopes = list(stiffness["slopes"])
        if slopes[0] == 0.0:
            gap = stiffness["breaks"][0]
            stiffness["slopes"] = tuple(slopes[1:])
            stiffness["breaks"] = tuple(b - gap for b in stiffness["breaks"][1:])
    for drive in linear_drives(data):
        drive["backlash"] = 0.0
        drive.pop("restitution", None)


def _low_stiffness(data: Tables) -> None:
    for gear in data["gears"].values():
        stiffness = gear["stiffness"]
        if stiffness["kind"] == "curve":
            stiff = stiffness["slopes"][-1]
            stiffness["slopes"] = tuple(stiff if slope > 0.0 else 0.0 for slope in stiffness["slopes"])
    for drive in linear_drives(data):
        if curve := drive.get("stiffness_curve"):
            curve["slopes"] = tuple(curve["slopes"][-1] if slope > 0.0 else 0.0 for slope in curve["slopes"])


def _of_steppers(data: Tables) -> Iterator[Tables]:
    """Tables of the drivers that make steps of a reference."""
    for command in data.get("command", {}).values():
        stepping = command.get("stepping")
        if stepping is not None and stepping.get("pulses") is None:
            yield stepping


def _sine_table(data: Tables) -> None:
    for stepping in _of_steppers(data):
        stepping["table_error"] = 0.0


def _microsteps(data: Tables) -> None:
    """Finer ones: so many that a run has about `FINE` of them, and at least four times as many as they are."""
    scenario = Scenario(**data)
    for motor, command in data.get("command", {}).items():
        for stepping in _of_steppers({"command": {motor: command}}):
            field = scenario.signals()[scenario.train().variable(motor, "command")]
            made, given = len(field.breakpoint_list()), stepping.get("microsteps", 1)
            own = given
            while (2 * made <= FINE or own < 4 * given) and 2 * own <= MOST_MICROSTEPS:
                made, own = 2 * made, 2 * own
            stepping["microsteps"] = own


def _quantisation(data: Tables) -> None:
    for controller in data["controllers"].values():
        for key in ("encoder", "position_encoder"):
            if key in controller:
                kept = {name: controller[key][name] for name in ("shaft", "delay") if name in controller[key]}
                controller[key] = kept | {"ideal": True}


def _set(*rows: tuple[str, str, Any]) -> Callable[[Tables], None]:
    """The change that gives keys another value where tables have them: (path of the tables, keys, value); None drops the key."""

    def change(data: Tables) -> None:
        for path, keys, value in rows:
            for table in _tables_at(data, path):
                for key in set(keys.split()) & table.keys():
                    if value is None:
                        del table[key]
                    else:
                        table[key] = value

    return change


def _tables_at(data: Tables, path: str) -> Iterator[Tables]:
    """The tables at a dotted path, in which ``*`` stands for each name and ``|`` parts alternatives."""
    first, _, rest = path.partition(".")
    for key in data if first == "*" else first.split("|"):
        if isinstance(inner := data.get(key), dict):
            yield from _tables_at(inner, rest) if rest else [inner]


DRIVES = f"{'|'.join(LINEAR_DRIVES)}.*"
ENCODERS = "controllers.*.encoder|position_encoder"
CAUSES: dict[str, Callable[[Tables], None]] = {
    "backlash": _backlash,
    "low stiffness": _low_stiffness,
    "hysteresis": _set(("gears.*", "hysteresis", None), (DRIVES, "hysteresis", None)),
    "transmission error": _set(("gears.*", "transmission_error", None), (DRIVES, "pitch_error", None)),
    "microsteps": _microsteps,
    "sine table of the driver": _sine_table,
    "detents": _set(("motors.*", "detent_torque", 0.0)),
    "dry friction": _set(
        ("motors.*", "friction_torque", 0.0),
        ("shafts.*", f"friction_torque breakaway_torque {LAWS}", None),
        ("slides.*", f"friction_force breakaway_force {LAWS}", None),
        (DRIVES, "drag_torque", 0.0),
    ),
    "losses of the gears": _set(("gears.*", "losses", NO_LOSSES), (DRIVES, SCREW_LOSSES, None)),
    "encoder steps": _quantisation,
    "delay": _set(("controllers.*", "delay", 0), (ENCODERS, "delay", 0)),
    "latency of the camera": _set(("controllers.*.camera", "latency", 0.0)),
    "noise of the camera": _set(("controllers.*.camera", "noise", 0.0)),
    "pixels": _set(("controllers.*.camera", "pixel", None), ("controllers.*.camera", "pixel_parts", 1)),
    "wind": _set(("shafts.*.torque", "wind", None)),
}
"""how each is taken out of the tables of a scenario"""


VARIANTS: dict[str, Callable[[Tables], None]] = {
    "encoders on the motors": _set(("controllers.*", "position_encoder blend_time", None))
}
"""other controllers of the same axes"""


def present(scenario: Scenario, table: Mapping[K, Callable[[Tables], None]]) -> dict[K, Callable[[Tables], None]]:
    """Changes of a table that change the scenario at all."""
    return {name: change for name, change in table.items() if _changed(scenario, [change]) is not None}


def without(scenario: Scenario, changes: list[Callable[[Tables], None]]) -> Scenario | None:
    """The scenario after the changes; None if they change nothing."""
    data = _changed(scenario, changes)
    return None if data is None else Scenario(**data)


def _changed(scenario: Scenario, changes: list[Callable[[Tables], None]]) -> Tables | None:
    data, before = (scenario.model_dump(exclude_none=True) for _ in range(2))
    for change in changes:
        change(data)
    return None if data == before else data
