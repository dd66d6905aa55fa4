"""Keys of the long form, and what files in the other forms call them."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from .set_by_dotted_key import renamed

MOTOR, LOAD, GEARBOX, SLIDE, BRAKE = "motor", "load", "gearbox", "slide", "brake"  # names in the long form
DRIVES = {"screw": "screws", "rack": "racks", "belt": "belts"}
"""what moves the slide of an axis, called after its kind, and its table in the long form"""
_DRIVE = {
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
_AXIS = {
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


@dataclass(frozen=True)
class Form:
    """A form of files."""

    keys: tuple[tuple[str, str], ...]  # keys of the long form, and what they are called
    back: tuple[tuple[str, str], ...]
    """keys of derived data, and of the tables that a scenario is read from again"""

    def in_file(self, key: str) -> str:
        """A key of the long form as files have it; others as they are."""
        return renamed(key, dict(self.keys))

    def in_long(self, key: str) -> str:
        """A key of files in the long form; others as they are."""
        return renamed(key, dict(sorted(_first_of(self.keys).items(), key=lambda pair: -len(pair[0]))))

    def in_tables(self, key: str) -> str:
        """A key of files, or of the long form, as it is in the tables that are read again."""
        return key if key == "command" else renamed(key, dict(self.back))


def _back(keys: Mapping[str, str], *commands: str) -> Iterator[tuple[str, str]]:
    """Keys of files in the long form, which the tables are kept in; keys of commands in the long form stay."""
    yield from ((key, key) for key in commands)
    yield from _first_of(keys.items()).items()


def _first_of(keys: Iterable[tuple[str, str]]) -> dict[str, str]:
    """First key of the long form for each key of files."""
    first: dict[str, str] = {}
    for long, short in keys:
        first.setdefault(short, long)
    return first


TRAIN = Form((), ())
DRIVE = Form(tuple(_DRIVE.items()), tuple(_DRIVE.items()))
TRAIN_OF_DRIVE = Form(tuple(_DRIVE.items()), tuple(_back(_DRIVE, f"command.{MOTOR}")))
"""of files of a motor, a gearbox and a load whose tables are kept in the long form, for what only drive trains have"""
AXIS = Form(tuple(_AXIS.items()), tuple(_back(_AXIS, f"command.{MOTOR}", f"command.{BRAKE}")))


def in_file(key: str, tables: Mapping[str, Any]) -> str:
    """A key of the long form as a file with these tables has it; other keys as they are."""
    form = AXIS if "axis" in tables else DRIVE if {MOTOR, GEARBOX, LOAD} <= tables.keys() else TRAIN
    return form.in_file(key)
