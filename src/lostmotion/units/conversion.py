"""Units at the edge: numbers are SI, strings carry a unit. Inside the package everything is SI and radians.

A string is one number and one unit, by a grammar of our own (`grammar`), and `table` has the units in SI. What a unit
means may depend on the key: ``1/min`` is a speed of rotation where a speed is wanted, ``lb`` a force where a torque is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .grammar import FORCE_OF, Product, UnknownUnitError, near, plain, read_unit, written
from .scalars import is_number, objection, scalar
from .unit_table import angle_of, dimension_of, factor_of

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema

# Quantities whose SI unit is written in two ways.
FORMS = {"N*m/A": ("V*s/rad", "N*m/A"), "N*m*s/rad": ("N*m*s/rad", "N*m*s")}
MAX_LENGTH = 100  # characters
POUNDS = ("pound", "ounce")

_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPED = re.compile(r"[+-]?[0-9]+(?:[.,'’_][0-9]+| [0-9]{3}(?![0-9]))*")
_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:[ .,'’_][0-9]{3})+")
_TIMES_TEN_TO = re.compile(r"\s*(?:[*xX]\s*10\s*(?:(?:\^|\*\*)\s*|(?=[+-]))|[eE])([+-]?[0-9]+)")
_OPERATION = re.compile(r"\s*(\*\*|[*/+^-])\s*([0-9.]+)(?:\s*(?:\^|\*\*)\s*([+-]?[0-9]+))?")


@lru_cache(maxsize=10_000)  # data sheets say the same again and again
def to_si(text: str, unit: str) -> float:
    """Value of `text`, such as ``"3300 rpm"``, in `unit` (SI; ``""`` for a plain number)."""
    if len(text) > MAX_LENGTH:
        raise ValueError(f"is too long for one number with one unit; write {_wanted(unit)}")
    digits, symbol = _split(plain(text), unit)
    number = Decimal(digits)
    if not math.isfinite(float(digits)) or (number and not float(digits)):
        raise ValueError("is beyond the range of numbers; check its exponent")
    if not symbol:
        if unit:
            raise ValueError(f'has no unit; write it as a bare number for {unit}, or "{digits} {unit}"')
        return float(digits)
    try:
        units = read_unit(symbol)
    except UnknownUnitError as error:
        raise ValueError(_unknown(digits, symbol, error.symbol, unit)) from None
    if unit == "degC":
        return _temperature(number, units, symbol)
    factor = _factor(units, unit)
    if factor is None:
        raise ValueError(_of_something_else(digits, units, symbol, unit))
    value = float(number * factor)
    if not math.isfinite(value):
        raise ValueError("is beyond the range of numbers; check its exponent")
    return value


def si_value(text: str, unit: str) -> float:
    """Value as `to_si` returns it, for a text that cannot but be a string: a bare number is in `unit`."""
    number = plain(text)
    return float(number) if _NUMBER.fullmatch(number) and math.isfinite(float(number)) else to_si(text, unit)


@lru_cache(maxsize=1000)
def si_factor(unit: str) -> float:
    """One of a unit in SI, angles in rad: ``"deg"`` is 0.01745, ``"rpm"`` 0.1047; 1 without a unit."""
    if unit.strip() in ("", "-", "1"):
        return 1.0
    try:
        units = read_unit(unit)
    except UnknownUnitError as error:
        raise ValueError(_unknown("1", unit, error.symbol, "")) from None
    factor = 0.0
    with suppress(ArithmeticError):
        factor = float(factor_of(units))
    if not 0.0 < factor < math.inf:
        raise ValueError("is beyond the range of numbers; check its exponent")
    return factor


def _wanted(unit: str) -> str:
    return f'a value in {unit}, such as "1 {unit}"' if unit else 'a plain number, such as "0.5" or "50 %"'


# --- the number ---


def _split(text: str, unit: str) -> tuple[str, str]:
    """The number at the beginning, and the unit behind it."""
    _refuse_separators(text, unit)
    number = _NUMBER.match(text)
    if number is None:
        what = "a finite number" if re.match("[+-]?(nan|inf)", text, re.IGNORECASE) else "one number with one unit"
        raise ValueError(f"is not {what}; write {_wanted(unit)}")
    rest = text[number.end() :]
    if operation := _TIMES_TEN_TO.match(rest):
        value = f"{number.group()}e{operation[1]}"
        value = value if _NUMBER.fullmatch(value) else ""
    elif operation := _OPERATION.match(rest):
        value = _computed(Decimal(number.group()), *operation.groups())
    else:
        return number.group(), rest.strip()
    hint = f'its value, "{_with_unit(value, rest[operation.end() :], unit)}"' if value else _wanted(unit)
    raise ValueError(f"is an expression or a range, not one number; write {hint}")


def _refuse_separators(text: str, unit: str) -> None:
    """Decimal commas and separators between thousands end in the right spelling."""
    grouped = _GROUPED.match(text)
    if grouped is None or _NUMBER.fullmatch(grouped.group()):
        return
    digits, rest = grouped.group(), text[grouped.end() :]
    head, mark, tail = digits.rpartition(max(",.", key=digits.rfind))
    whole = re.sub("[^0-9+-]", "", digits)
    decimal = f"{re.sub('[^0-9+-]', '', head)}.{tail}"
    # The last point or comma is a decimal one if it stands alone and what is before it is a number.
    fraction = mark and mark not in head and (re.fullmatch("[+-]?[0-9]+", head) or _THOUSANDS.fullmatch(head))
    if re.fullmatch("[+-]?[1-9][0-9]{0,2},[0-9]{3}", digits):
        what, readings = "a comma, which may be a decimal comma or a separator", [decimal, whole]
    elif fraction and tail.isdigit():
        what, readings = "a decimal comma" if mark == "," else "separators between thousands", [decimal]
    elif _THOUSANDS.fullmatch(digits):
        what, readings = "separators between thousands", [whole]
    else:
        raise ValueError(f"is not one number with one unit; write {_wanted(unit)}")
    raise ValueError(f"has {what}; write " + " or ".join(f'"{_with_unit(r, rest, unit)}"' for r in readings))


def _computed(a: Decimal, operator: str, second: str, power: str | None) -> str:
    """The value of ``a operator second``; empty where it cannot be determined, as of a range."""
    try:
        b = Decimal(second)
        b = b if power is None else b ** int(power)
        match operator:
            case "**" | "^":
                value = a**b
            case "*":
                value = a * b
            case "/":
                value = a / b
            case "+":
                value = a + b
            case _:
                return ""
        return f"{float(value):.12g}" if math.isfinite(float(value)) else ""
    except ArithmeticError:
        return ""


def _with_unit(number: str, rest: str, unit: str) -> str:
    return f"{number} {rest.strip() or unit}".strip() if rest[:1] not in ("e", "E") else f"{number}{rest}"


# --- the unit ---


@lru_cache(maxsize=1000)
def _known(unit: str) -> Product:
    return read_unit(unit) if unit else {}


def _ratio(units: Product, other: Product) -> Decimal | None:
    """Ratio of two units; None if they measure different quantities."""
    if angle_of(units) != angle_of(other) or dimension_of(units) != dimension_of(other):
        return None
    with suppress(ArithmeticError):
        return factor_of(units) / factor_of(other)
    return None


def _factor(units: Product, unit: str) -> Decimal | None:
    """One of `units` in the SI unit of a key; None if no reading fits the key."""
    for form in FORMS.get(unit, (unit,)):
        wanted = _known(form)
        for reading in _readings(units, wanted):
            if (factor := _ratio(reading, wanted)) is not None:
                return factor
    return None


def _readings(units: Product, wanted: Product) -> Iterator[Product]:
    """Possible meanings of a product where `wanted` is required: as written, with turns for a speed in 1/min, with pounds as forces."""
    if any(name.endswith("hertz") for name in units) and not any(name.endswith("hertz") for name in wanted):
        return  # whether turns or radians are counted cannot be determined
    turns = angle_of(wanted)
    if turns and angle_of(units) == 0 and units.get("minute", 0) == -turns:
        yield units | {"revolution": turns}
        return  # 1/min is never rad/min
    yield units
    yield from _as_forces(units, POUNDS)


def _with(units: Product, name: str, other: Product) -> Product:
    """A product with another one, to the same power, in place of a unit."""
    rest = {n: power for n, power in units.items() if n != name}
    for n, power in other.items():
        rest[n] = rest.get(n, 0) + power * units[name]
    return {n: power for n, power in rest.items() if power}


def _as_forces(units: Product, masses: tuple[str, ...]) -> Iterator[Product]:
    if any(name in masses for name in units):
        yield {FORCE_OF[name] if name in masses else name: power for name, power in units.items()}


def _temperature(number: Decimal, units: Product, symbol: str) -> float:
    """[°C]; the only quantity whose units differ in their zero."""
    ratio = _ratio(units, {"kelvin": 1})
    if ratio is None or len(units) != 1:
        raise ValueError(f'has the unit of something else ({symbol}); it must be a temperature, such as "20 degC"')
    match next(iter(units)):
        case "degree_Celsius":
            return float(number)
        case "degree_Fahrenheit":
            return float((number - 32) * ratio)
        case _:
            return float(number * ratio - Decimal("273.15"))


# --- messages ---


def _unknown(digits: str, text: str, symbol: str, unit: str) -> str:
    """Message on a unit that cannot be read: the nearest spellings that the key can take."""
    if not symbol:
        what = f"is not one number with one unit ({text}); write {_wanted(unit)}"
        changes = [re.sub("1000 ?(?=[A-Za-z])", "k", text)]
    else:
        what = f"has a unit that is not known ({symbol}); write {_wanted(unit)}"
        changes = [text.replace(symbol, candidate, 1) for candidate in near(symbol)]
    fitting = []
    for changed in changes:
        with suppress(UnknownUnitError):
            if _factor(read_unit(changed), unit) is not None:
                fitting.append(f'"{digits} {changed}"')
    several = 2 if fitting and symbol.lower() in fitting[0].lower() else 1
    return what + (f"; did you mean {' or '.join(fitting[:several])}?" if fitting else "")


def _of_something_else(digits: str, units: Product, symbol: str, unit: str) -> str:
    """Message on a unit that does not fit the key: what it may have meant, else what is wanted."""
    wanted = _known(unit)
    rate = {name: power for name, power in wanted.items() if name == "second"}
    if wanted == {"radian": 1} | rate and rate and (ratio := _ratio(units, rate)) is not None:
        hertz = any(name.endswith("hertz") for name in units)
        value = f"{float(Decimal(digits) * ratio):.7g}" if hertz else digits
        both = (written({angle: 1} | (rate if hertz else units)) for angle in ("revolution", "radian"))
        return "may mean turns or radians; write " + " or ".join(f'"{value} {text}"' for text in both)
    if unit == "Hz" and (turns := _ratio(units, {"revolution": 1, "second": -1})) is not None:
        plainly = f', or "{digits} Hz" for that many periods in a second' if "radian" in units else ""
        value = f"{float(Decimal(digits) * turns):.7g}"
        return f'is a speed of rotation, not a frequency; write "{value} Hz" for one period in each turn{plainly}'
    if counted := next((name for name in units if name.endswith("hertz")), None):
        speeds = [{angle: 1, "second": -1} for angle in ("revolution", "radian")]
        by_speed = [_with(units, counted, speed) for speed in speeds]
        if all(_factor(reading, unit) is not None for reading in by_speed):
            value = (
                f"{float(Decimal(digits) * (_ratio({counted: units[counted]}, {'hertz': units[counted]}) or 1)):.7g}"
            )
            return "may mean turns or radians; write " + " or ".join(f'"{value} {written(r)}"' for r in by_speed)
    angle = angle_of(wanted)
    if (
        angle
        and angle_of(units) == 0
        and _ratio(units, {}) is None
        and _ratio(units | {"radian": angle}, wanted) is not None
    ):
        both = (written(units | {name: angle}) for name in ("radian", "arcminute"))
        return "lacks the angle; write " + " or ".join(f'"{digits} {text}"' for text in both)
    for reading in _as_forces(units, tuple(FORCE_OF)):
        if _ratio(reading, wanted) is not None:
            return f'has a mass where a force is wanted; write "{digits} {written(reading)}" if its weight is meant'
    return f"has the unit of something else ({symbol}); it must be {_wanted(unit)}"


# --- fields ---


@dataclass(frozen=True)
class Unit:
    """Annotation of a field: the SI unit of its value. Accepts a number or a string with a unit."""

    unit: str

    def read(self, value: Any) -> Any:
        """The value in SI. Raises ValueError: it is not a number, or a string that is not one with a fitting unit."""
        if type(value) is float:  # nearly always, and large tables are read often
            return value
        value = scalar(value)
        if isinstance(value, str):
            return to_si(value, self.unit)
        if isinstance(value, bool):
            raise ValueError(f"is a Boolean; it must be {self._number()}")
        if not is_number(value):
            raise ValueError(objection(value) or f"must be {self._number()}")
        try:
            return float(value)
        except (OverflowError, ValueError):  # the latter of a signalling NaN
            raise ValueError("is beyond the range of numbers") from None

    def _number(self) -> str:
        return (
            f'a number in {self.unit}, or a string with its unit, such as "1 {self.unit}"' if self.unit else "a number"
        )

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        inner = handler(schema)
        return {"anyOf": [inner, {"type": "string"}], "x-unit": self.unit}
