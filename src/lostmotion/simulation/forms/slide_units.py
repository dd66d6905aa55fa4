"""Values of controllers and tasks that are given for slides: with units of length and force where a shaft has units of angle and torque."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from ...errors import InputError
from ...inputs.quantities import argument
from ...inputs.refusal_messages import shown
from ...inputs.schema import follow, unit_in_schema
from ...units.conversion import Unit

# Keys of a controller that belong to the shaft of its reference, and keys that belong to the shafts of its encoders.
OF_REFERENCE = (
    ("reference",),
    ("position", "speed_limit"),
    ("position", "dead_zone"),
    ("feedforward", "backlash"),
    ("feedforward", "backlash_rate"),
    ("inverse_model", "twist_rate"),
)
ENCODERS = ("encoder", "position_encoder")
LOST_MOTION = "max_lost_motion"


def in_si(data: Mapping[str, Any], schema: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """The tables of a train with the strings of controllers of slides as numbers in SI.

    schema: of the tables, which says the unit of each key for a shaft.

    Raises InputError: a value has the unit of something else.
    """
    slides, controllers = data.get("slides"), data.get("controllers")
    if not isinstance(slides, Mapping) or not slides:
        return dict(data)
    if isinstance(masses := data.get("mass_matrices"), Mapping):
        data = {**data, "mass_matrices": {name: _masses_in_si(name, mass, slides) for name, mass in masses.items()}}
    if isinstance(task := data.get("task"), Mapping) and isinstance(lost := task.get(LOST_MOTION), str):
        data = {**data, "task": {**task, LOST_MOTION: argument(f"task.{LOST_MOTION}", lost, "m")}}
    if not isinstance(controllers, Mapping):
        return dict(data)
    of_slides: dict[str, Any] = {}
    for name, controller in controllers.items():
        if isinstance(controller, Mapping):
            of_slides[name] = _Reader(data, name, controller, schema()).controller()
        else:
            of_slides[name] = controller
    return {**data, "controllers": of_slides}


def _masses_in_si(name: str, mass: Any, slides: Mapping[str, Any]) -> Any:
    """A mass matrix with the strings of slides as numbers in SI."""
    rows = mass.get("matrix") if isinstance(mass, Mapping) else None
    if not isinstance(rows, list | tuple) or not isinstance(mass.get("shafts"), list | tuple):
        return mass

    def read(a: int, b: int, value: Any) -> Any:
        unit = _unit_of_mass(mass["shafts"], a, b, slides)
        if not isinstance(value, str) or unit is None:
            return value
        try:
            return Unit(unit).read(value)
        except ValueError as error:
            raise InputError(f"{shown(value)} {error}", f"mass_matrices.{name}.matrix.{a}.{b}") from None

    def row_in_si(a: int, row: Any) -> Any:
        return [read(a, b, value) for b, value in enumerate(row)] if isinstance(row, list | tuple) else row

    return {**mass, "matrix": [row_in_si(a, row) for a, row in enumerate(rows)]}


def _unit_of_mass(shafts: Sequence[str], a: int, b: int, slides: Mapping[str, Any]) -> str | None:
    """Unit of an entry of a mass matrix that belongs to a slide; None for others."""
    slide = [k < len(shafts) and shafts[k] in slides for k in (a, b)]
    return "kg" if all(slide) else "kg*m" if any(slide) else None


def unit_of_slides(data: Mapping[str, Any], key: str, unit: str) -> str:
    """The unit of a key for the slides of the tables of a train.

    key: dotted, such as ``controllers.motor.reference.moves.0.to``.
    unit: that it has for shafts.
    """
    table, _, rest = key.partition(".")
    if data.get("slides") and key == f"task.{LOST_MOTION}":
        return "m"
    if table == "mass_matrices" and ".matrix." in rest and data.get("slides"):
        name, _, a, b = rest.split(".")
        return _unit_of_mass(data[table][name]["shafts"], int(a), int(b), data["slides"]) or unit
    name, _, path = rest.partition(".")
    controller = (data.get("controllers") or {}).get(name)
    if table != "controllers" or not data.get("slides") or not isinstance(controller, Mapping):
        return unit
    positions, forces = _Reader(data, name, controller, {}).slides_at(tuple(path.split(".")))
    return of_slides(unit, positions=positions, forces=forces)


class _Reader:
    def __init__(
        self, data: Mapping[str, Any], name: str, controller: Mapping[str, Any], schema: Mapping[str, Any]
    ) -> None:
        self.schema, self.table, self.name = schema, controller, name
        slides = data["slides"]
        self.motor_slides = name in (data.get("linear_motors") or {})
        shaft = controller.get("shaft")
        self.reference_slides = (next(reversed(slides)) if shaft is None else shaft) in slides
        self.encoder_slides = {}
        for key in ENCODERS:
            encoder = controller.get(key)
            own = encoder.get("shaft") if isinstance(encoder, Mapping) else None
            self.encoder_slides[key] = self.motor_slides if own is None else own in slides

    def controller(self) -> dict[str, Any]:
        return {key: self._read(value, (key,)) for key, value in self.table.items()}

    def slides_at(self, path: tuple[int | str, ...]) -> tuple[bool, bool]:
        """Whether angles at this key are positions, and torques forces."""
        if "phase" in str(path[-1]):
            return False, False  # of a sine
        if path[0] in ENCODERS:
            return self.encoder_slides[str(path[0])], False
        positions = any(path[: len(key)] == key for key in OF_REFERENCE)
        if self.table.get("kind") == "continuous":
            return self.reference_slides, self.motor_slides
        torque = path[0] == "reference" and self.table.get("reference", {}).get("kind") == "torque"
        return (self.reference_slides if positions and not torque else self.motor_slides), self.motor_slides

    def _read(self, value: Any, path: tuple[int | str, ...]) -> Any:
        if isinstance(value, Mapping):
            return {key: self._read(inner, (*path, key)) for key, inner in value.items()}
        if isinstance(value, list | tuple):
            return [self._read(inner, (*path, k)) for k, inner in enumerate(value)]
        if not isinstance(value, str):
            return value
        positions, forces = self.slides_at(path)
        if not positions and not forces:
            return value
        units = set(self._units(path))
        if len(units) != 1:
            return value  # no quantity, or no such key: refused when the scenario is made
        wanted = of_slides(units.pop(), positions=positions, forces=forces)
        try:
            return Unit(wanted).read(value) if wanted else value
        except ValueError as error:
            key = ".".join(("controllers", self.name, *map(str, path)))
            raise InputError(f"{shown(value)} {error}", key) from None

    def _units(self, path: tuple[int | str, ...]) -> Iterator[str]:
        """SI units that a key has for a shaft, by the kinds of the tables around it."""
        place: list[int | str] = ["controllers", self.name]
        node: Any = self.table
        place += [str(node["kind"])] if "kind" in node else []
        for key in path:
            place.append(key)
            node = node[key]
            if isinstance(node, Mapping) and "kind" in node:
                place.append(str(node["kind"]))
        _, nodes = follow(self.schema, tuple(place))
        for found in nodes:
            if (unit := unit_in_schema(found)) is not None:
                yield unit


def of_slides(unit: str, *, positions: bool, forces: bool) -> str:
    """The unit of a slide for one of a shaft, such as m/s for rad/s."""
    if forces:
        unit = unit.replace("kg*m^2", "kg").replace("N*m", "N")
    return unit.replace("rad", "m") if positions else unit
