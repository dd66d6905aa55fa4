"""The tables of slides and of what moves them, and the drive train that they make."""

from collections.abc import Mapping
from typing import Any

from pydantic import Field

from ..errors import InputError
from ..inputs.named_elements import Elements, Named, nothing
from ..inputs.refusal_messages import did_you_mean, shown
from ..recorded_numbers import may_differ
from .gear import Gear
from .linear_motor import LinearMotor
from .motor import ShaftMotor
from .rack_and_belt import Belt, Rack
from .screw import LinearDrive, Screw
from .shaft import FrictionCurve, Shaft
from .train import TrainElements

# Tables of what joins a shaft and a slide.
LINEAR_DRIVES = ("screws", "racks", "belts")
COGGING = "_cogging"  # behind the name of a linear motor


class LinearElements(TrainElements):
    """The elements of a drive train besides its shafts and slides, as scenarios have them."""

    screws: Elements[Screw] = Field(default_factory=nothing)
    racks: Elements[Rack] = Field(default_factory=nothing)
    belts: Elements[Belt] = Field(default_factory=nothing)
    linear_motors: Elements[LinearMotor] = Field(default_factory=nothing)

    def linear_drives(self) -> dict[str, LinearDrive]:
        """Screws, racks and belts by name."""
        return {name: drive for table in LINEAR_DRIVES for name, drive in getattr(self, table).items()}

    def kind_of(self, gear: str) -> str:
        """Word for what joins two of its shafts: gear, screw, rack or belt."""
        return next((table[:-1] for table in LINEAR_DRIVES if gear in getattr(self, table)), "gear")

    def key_of(self, table: str, name: str) -> str:
        """Key in a file of an element that the core has under this name in one of its tables."""
        if (motor := name.removesuffix(COGGING)) != name and motor in self.linear_motors:
            return f"linear_motors.{motor}.cogging_force"
        sources = {"shafts": ("slides",), "gears": LINEAR_DRIVES, "motors": ("linear_motors",)}.get(table, ())
        found = (source for source in sources if name in getattr(self, source, ()))
        return next((f"{source}.{name}" for source in found), super().key_of(table, name))

    def check_places(self, shafts: Mapping[str, Any], slides: Mapping[str, Any]) -> None:
        """Refuse what joins a slide with something that has other units, and names that are given twice."""
        for name in slides:
            if name in shafts:
                raise InputError("have the same name; rename one of them", f"shafts.{name}", f"slides.{name}")
        seen: dict[str, str] = {}
        for table in ("gears", *LINEAR_DRIVES, "motors", "linear_motors"):
            for name in getattr(self, table):
                kind = "motor" if table in ("motors", "linear_motors") else "gear"
                if (before := seen.setdefault(f"{kind} {name}", table)) != table:
                    raise InputError("have the same name; rename one of them", f"{before}.{name}", f"{table}.{name}")
        for table in LINEAR_DRIVES:
            for name, drive in getattr(self, table).items():
                _need(f"{table}.{name}.input", drive.input, shafts, slides, "shaft", "slide")
                _need(f"{table}.{name}.output", drive.output, slides, shafts, "slide", "shaft")
        for name, motor in self.linear_motors.items():
            _need(f"linear_motors.{name}.slide", motor.slide, slides, shafts, "slide", "shaft")
        for key, shaft in self.references():
            table = key.partition(".")[0]
            if shaft in slides and table != "mass_matrices":
                remedy = {
                    "gears": "write it as one of [screws], [racks] and [belts]",
                    "motors": "write it in [linear_motors]",
                    "gravity": f"give slides.{shaft}.inclination",
                    "springs": f"give slides.{shaft}.end_stops, or put it on a shaft",
                }.get(table, "put it on a shaft")
                raise InputError(f"{shown(shaft)} is a slide, and this acts on shafts, in N*m; {remedy}", key)

    def plain_elements(self) -> dict[str, Any]:
        """Tables of the drive train without its shafts: screws, racks and belts as gears, linear motors as sources of torque."""
        tables: dict[str, dict[str, Any]] = {table: dict(getattr(self, table)) for table in TrainElements.model_fields}
        gears: dict[str, Gear] = tables["gears"]
        for table in LINEAR_DRIVES:
            for name, drive in getattr(self, table).items():
                gears[name] = drive.gear(drive.input, drive.output)
        motors: dict[str, ShaftMotor] = tables["motors"]
        for name, motor in self.linear_motors.items():
            motors[name] = motor.motor()
            if (cogging := motor.cogging()) is not None:
                tables["angle_torques"][name + COGGING] = cogging
        return {table: Named(elements) for table, elements in tables.items()}

    def with_drag(self, shafts: Mapping[str, Shaft]) -> dict[str, Shaft]:
        """Shafts with the drag torque of the screws, racks and belts that they drive."""
        found = dict(shafts)
        for drive in self.linear_drives().values():
            if may_differ(drive.drag_torque):
                found[drive.input] = _with_friction(found[drive.input], drive.drag_torque)  # type: ignore[attr-defined]
        return found


def _need(key: str, name: str, wanted: Mapping[str, Any], other: Mapping[str, Any], what: str, not_what: str) -> None:
    if name in wanted:
        return
    if name in other:
        raise InputError(f"{shown(name)} is a {not_what}; give the name of a {what}", key)
    known = f"the {what}s are {', '.join(wanted)}" if wanted else f"there is none; add [{what}s.{name}]"
    raise InputError(f"{shown(name)} is no {what}; {did_you_mean(name, wanted, known)}", key)


def _with_friction(shaft: Shaft, torque: float) -> Shaft:
    """The shaft with more dry friction, at rest and in motion."""
    if shaft.friction_curve is not None:
        curve = shaft.friction_curve
        more = FrictionCurve(speeds=curve.speeds, torques=tuple(T + torque for T in curve.torques))
        changes: dict[str, Any] = {"friction_curve": more}
    else:
        changes = {"friction_torque": shaft.friction_torque + torque}
    if shaft.breakaway_torque is not None:
        changes["breakaway_torque"] = shaft.breakaway_torque + torque
    return shaft.model_copy(update=changes)
