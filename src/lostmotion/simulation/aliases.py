"""Keys of the long form, and what files in the other forms call them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .keys import renamed

MOTOR, LOAD, GEARBOX, SLIDE, BRAKE = "motor", "load", "gearbox", "slide", "brake"  # names in the long form
DRIVES = {"screw": "screws", "rack": "racks", "belt": "belts"}
"""what moves the slide of an axis, called after its kind, and its table in the long form"""
DRIVE = {
    f"controllers.{MOTOR}": "controller",
    f"command.{MOTOR}": "command",
    f"motors.{MOTOR}": MOTOR,
    f"shafts.{LOAD}": LOAD,
    f"gears.{GEARBOX}.gearbox": f"{GEARBOX}.from",
    f"gears.{GEARBOX}": GEARBOX,
    f"initial.speeds.{MOTOR}": "initial.motor_speed",
    f"initial.speeds.{LOAD}": "initial.load_speed",
    f"initial.angles.{LOAD}": "initial.load_angle",
    f"initial.twists.{GEARBOX}": "initial.twist",
    f"initial.motor_torques.{MOTOR}": "initial.motor_torque",
    f"initial.hysteresis_capacities.{GEARBOX}": "initial.hysteresis_capacity",
}
AXIS = {
    **{f"{long}.{short}": f"axis.{short}" for short, long in DRIVES.items()},
    **{f"shafts.{short}": f"axis.{short}" for short in DRIVES},
    f"controllers.{MOTOR}": "controller",
    f"command.{MOTOR}": "command",
    f"command.{BRAKE}": f"axis.{BRAKE}.command",
    f"brakes.{BRAKE}": f"axis.{BRAKE}",
    f"motors.{MOTOR}": "axis.motor",
    f"gears.{GEARBOX}.gearbox": "axis.gearbox.from",
    f"gears.{GEARBOX}": "axis.gearbox",
    f"slides.{SLIDE}": "axis.slide",
}


def in_file(key: str, tables: Mapping[str, Any]) -> str:
    """A key of the long form as a file with these tables has it; other keys as they are."""
    if "axis" in tables:
        return renamed(key, AXIS)
    return renamed(key, DRIVE) if {MOTOR, GEARBOX, LOAD} <= tables.keys() else key


def of_axis(key: str) -> str:
    """A key of a file with the table `axis` in the long form; others, and `command` as a whole, as they are."""
    if key.partition(".")[0] == "command" and (key == "command" or key.split(".")[1] in (MOTOR, BRAKE)):
        return key
    first: dict[str, str] = {}
    for long, short in AXIS.items():
        first.setdefault(short, long)
    return renamed(key, first)
