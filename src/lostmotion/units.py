"""Units at the edge: numbers are SI, strings carry a unit. Inside the package everything is SI and radians."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pint
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema


@cache
def registry() -> pint.UnitRegistry[Any]:
    """The unit registry, made when the first string with a unit is read (importing it takes a while)."""
    import pint

    units: pint.UnitRegistry[Any] = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    units.define("arcmin = arcminute")
    return units


@lru_cache(maxsize=10_000)  # data sheets say the same again and again
def to_si(text: str, unit: str) -> float:
    """Value of `text`, such as ``"3300 rpm"``, in `unit` (SI; ``""`` for a plain number).

    Raises
    ------
    ValueError
        The text is no number with a unit, or its unit measures something else.
    """
    import pint

    example = f'such as "1 {unit}"' if unit else 'such as "0.5" or "50 percent"'
    try:
        quantity: pint.Quantity[Any] = registry().Quantity(text)
    except (pint.errors.PintError, AttributeError, TypeError, ValueError, AssertionError, SyntaxError):
        raise ValueError(
            f"is not a number with a unit that is known; write a value in {unit or '1'}, {example}"
        ) from None
    except Exception as error:  # the registry's parser raises its tokenizer's errors as they come
        raise ValueError(f"cannot be read as a number with a unit ({type(error).__name__}); {example}") from None
    if unit and quantity.dimensionless and quantity.units == registry().Unit(""):
        raise ValueError(f'has no unit; write it as a bare number for {unit}, or "{text} {unit}"')
    try:
        return float(quantity.to(unit).magnitude)
    except pint.errors.PintError:
        raise ValueError(
            f"has the unit of something else ({quantity.units:~}); it must be in {unit or '1'}, {example}"
        ) from None


def si_number(text: str) -> float:
    """Value of a number with any unit, in SI base units (angles in radians).

    Raises
    ------
    ValueError
        The text is no number with a unit that is known.
    """
    import pint

    try:
        return float(registry().Quantity(text).to_base_units().magnitude)
    except (pint.errors.PintError, AttributeError, TypeError, ValueError, AssertionError, SyntaxError):
        raise ValueError(f"{text!r} is not a number with a unit that is known") from None


@dataclass(frozen=True)
class Unit:
    """Annotation of a field: the SI unit of its value. Accepts a number or a string with a unit."""

    unit: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema

        def read(value: Any) -> Any:
            if isinstance(value, str):
                return to_si(value, self.unit)
            if isinstance(value, bool):
                raise ValueError(f"is a Boolean; it must be a number in {self.unit or '1'}")
            return value

        return core_schema.no_info_before_validator_function(read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        inner = handler(schema)
        return {"anyOf": [inner, {"type": "string"}], "x-unit": self.unit}
