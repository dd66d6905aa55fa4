"""Types of the fields of parts: SI numbers that may be written as strings with a unit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from typing import Annotated, Any, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, GetCoreSchemaHandler, Strict, ValidationError
from pydantic_core import CoreSchema

from ..errors import InputError
from ..units.conversion import Unit
from .validation import describe, shown

Count = Annotated[int, "above 0"]
"""a whole number above 0, as the core takes it"""
Number = Annotated[float, Unit("")]
Torque = Annotated[float, Unit("N*m")]
Inertia = Annotated[float, Unit("kg*m^2")]
Speed = Annotated[float, Unit("rad/s")]
Angle = Annotated[float, Unit("rad")]
Time = Annotated[float, Unit("s")]
Frequency = Annotated[float, Unit("Hz")]
Voltage = Annotated[float, Unit("V")]
Stiffness = Annotated[float, Unit("N*m/rad")]
ViscousFriction = Annotated[float, Unit("N*m*s/rad")]
Current = Annotated[float, Unit("A")]
Resistance = Annotated[float, Unit("ohm")]
Inductance = Annotated[float, Unit("H")]
TorqueConstant = Annotated[float, Unit("N*m/A")]
KinematicViscosity = Annotated[float, Unit("m^2/s")]
ThermalResistance = Annotated[float, Unit("K/W")]


@dataclass(frozen=True)
class Limit:
    """Annotation of a quantity: the range of its value."""

    gt: float | None = None
    ge: float | None = None
    le: float | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        # Into the number itself, behind the reading of units, so that the JSON Schema tells it too.
        schema: Any = handler(source)
        schema["schema"].update({name: value for name, value in asdict(self).items() if value is not None})
        return schema  # type: ignore[no-any-return]


Positive = Limit(gt=0.0)
NotNegative = Limit(ge=0.0)

Temperature = Annotated[float, Unit("degC"), Limit(ge=-273.15)]
Switch = Annotated[bool, Strict()]
"""true or false, and not 1 or "yes\""""


def _no_boolean(value: Any) -> Any:
    if isinstance(value, bool | str):
        raise ValueError("must be a whole number")
    return value


Whole = Annotated[int, BeforeValidator(_no_boolean)]
"""a whole number"""


class Part(BaseModel):
    """Immutable; unknown keys, NaN and infinity are refused, with an `InputError` that says what would be right."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """What differs from its default; of long lists the ends."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if value != field.default:
                yield name, abridged(value)

    def _repr_html_(self) -> str:
        """All values with their units, for notebooks."""
        from .notebook import table

        return table(self)

    def __init__(self, /, *nameless: Any, **values: Any) -> None:
        if nameless:
            first = next(iter(type(self).model_fields))
            raise InputError(
                f"{self._subject()} takes its values by name, such as {first}=...; not {shown(nameless[0])}"
            )
        with self._one_error(values):
            super().__init__(**values)

    # Parts within parts are made by pydantic itself, so that it knows where in the whole a value stands.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """As the constructor, from a mapping."""
        with cls._one_error(obj):
            return super().model_validate(obj, **options)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with changes, which are checked as in the constructor."""
        if not update:
            return super().model_copy(deep=deep)
        return type(self)(**({name: getattr(self, name) for name in self.model_fields_set} | dict(update)))

    @classmethod
    def model_validate_json(cls, json_data: str | bytes | bytearray, **options: Any) -> Self:
        """As the constructor, from JSON."""
        with cls._one_error():
            return super().model_validate_json(json_data, **options)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):  # of the object alone, such as what it keeps for later
            super().__setattr__(name, value)
            return
        raise InputError(f"{self._subject()} is frozen; make a changed one instead of setting {name}")

    @classmethod
    @contextmanager
    def _one_error(cls, given: Any = None) -> Iterator[None]:
        try:
            yield
        except ValidationError as error:
            raise InputError(describe(error, _description(cls), cls._subject(), given)) from None

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        """The JSON Schema with all keys that may be written."""
        return cls.model_json_schema()

    @classmethod
    def _subject(cls) -> str:
        """What it is, for messages: the torsion curve."""
        return "the " + " ".join(re.findall("[A-Z][a-z]*", cls.__name__.split("[")[0])).lower()


@cache  # it takes longer than all the rest of a refusal
def _description(part: type[Part]) -> dict[str, Any]:
    return part._described_by()


class _Abridged(str):
    """Text that stands for itself in a representation."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def abridged(value: Any, longest: int = 6) -> Any:
    """The value; a long list as text with its ends and its length."""
    if not isinstance(value, tuple):
        return value
    if value and isinstance(value[0], tuple):
        return _Abridged(f"({len(value)} x {len(value[0])} numbers)")
    if len(value) <= longest:
        return value
    return _Abridged(f"({value[0]!r}, {value[1]!r}, ..., {value[-1]!r}; {len(value)} entries)")


def argument(name: str, value: Any, unit: str) -> float:
    """A number that is given to a function, in `unit` (SI); as a string with its own unit too.

    Raises
    ------
    InputError
        It is no finite number, or has the unit of something else.
    """
    try:
        number = Unit(unit).read(value)
    except ValueError as error:
        raise InputError(f"{name}: {shown(value)} {error}") from None
    if not math.isfinite(number):
        raise InputError(f"{name}: {shown(value)} must be a finite number")
    return float(number)


def arguments(name: str, values: Any, unit: str) -> list[float]:
    """Several such numbers, or one alone."""
    several = values if isinstance(values, Iterable) and not isinstance(values, str) else [values]
    return [argument(name, value, unit) for value in several]


def unit_in_schema(node: Mapping[str, Any]) -> str | None:
    """The SI unit of a field, from its JSON Schema; ``""`` for a pure number, None for what is no quantity."""
    if "x-unit" in node:
        return str(node["x-unit"])
    options = [option for key in ("anyOf", "oneOf", "allOf") for option in node.get(key, [])]
    options += [node["items"]] if isinstance(node.get("items"), dict) else []
    return next((unit for option in options if (unit := unit_in_schema(option)) is not None), None)
