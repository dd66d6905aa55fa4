"""Types of the fields of parts: SI numbers that may be written as strings with a unit."""

import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, GetCoreSchemaHandler, Strict
from pydantic_core import CoreSchema

from ..errors import InputError
from ..units.conversion import Unit
from ..units.scalars import is_several
from .refusal_messages import shown

Count = Annotated[int, "above 0"]  # a whole number above 0, as the core takes it
Number = Annotated[float, Unit("")]
Torque = Annotated[float, Unit("N*m")]
Inertia = Annotated[float, Unit("kg*m^2")]
Speed = Annotated[float, Unit("rad/s")]
Acceleration = Annotated[float, Unit("rad/s^2")]
Jerk = Annotated[float, Unit("rad/s^3")]
Angle = Annotated[float, Unit("rad")]
Time = Annotated[float, Unit("s")]
Frequency = Annotated[float, Unit("Hz")]
Voltage = Annotated[float, Unit("V")]
Stiffness = Annotated[float, Unit("N*m/rad")]
ViscousFriction = Annotated[float, Unit("N*m*s/rad")]
Mass = Annotated[float, Unit("kg")]
Length = Annotated[float, Unit("m")]
LinearSpeed = Annotated[float, Unit("m/s")]
LinearAcceleration = Annotated[float, Unit("m/s^2")]
LinearJerk = Annotated[float, Unit("m/s^3")]
Force = Annotated[float, Unit("N")]
MassPerLength = Annotated[float, Unit("kg/m")]
LinearVoltageConstant = Annotated[float, Unit("V*s/m")]
Power = Annotated[float, Unit("W")]
Current = Annotated[float, Unit("A")]
Resistance = Annotated[float, Unit("ohm")]
Inductance = Annotated[float, Unit("H")]
TorqueConstant = Annotated[float, Unit("N*m/A")]
KinematicViscosity = Annotated[float, Unit("m^2/s")]
SlideStiffness = Annotated[float, Unit("N/m")]
ThermalResistance = Annotated[float, Unit("K/W")]
VoltageConstant = Annotated[float, Unit("V*s/rad")]


@dataclass(frozen=True)
class Limit:
    """Annotation of a quantity: the range of its value."""

    gt: float | None = None
    ge: float | None = None
    le: float | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        # Into the number itself, behind the reading of units, so that the JSON Schema has it too.
        schema: Any = handler(source)
        # A type variable has no number yet.
        schema.get("schema", {}).update({name: value for name, value in vars(self).items() if value is not None})
        return schema  # type: ignore[no-any-return]


Positive = Limit(gt=0.0)
NotNegative = Limit(ge=0.0)
UpToOne = Limit(gt=0.0, le=1.0)
Share = Limit(ge=0.0, le=1.0)

Temperature = Annotated[float, Unit("degC"), Limit(ge=-273.15)]
Switch = Annotated[bool, Strict()]  # true or false, and not 1 or "yes"


def _no_boolean(value: Any) -> Any:
    if isinstance(value, bool | str):
        raise ValueError("must be a whole number")
    return value


Whole = Annotated[int, BeforeValidator(_no_boolean)]  # a whole number


def argument(name: str, value: Any, unit: str) -> float:
    """A number that is given to a function, in `unit` (SI); as a string with its own unit too."""
    try:
        number = Unit(unit).read(value)
    except ValueError as error:
        raise InputError(f"{name}: {shown(value)} {error}") from None
    if not math.isfinite(number):
        raise InputError(f"{name}: {shown(value)} must be a finite number")
    return float(number)


def arguments(name: str, values: Any, unit: str) -> list[float]:
    """Several such numbers, or one alone."""
    return [argument(name, value, unit) for value in (values if is_several(values) else [values])]
