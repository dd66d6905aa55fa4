"""The units of the grammar in SI. Prefixes are left out; the tests compare all units with a unit library."""

from collections.abc import Mapping
from decimal import Decimal
from functools import cache

# Name: how many SI units it is, to the digits of decimal arithmetic, and the SI unit. Angles are plain numbers.
UNITS = {
    "newton": ("1", "kg m s-2"),
    "meter": ("1", "m"),
    "pascal": ("1", "kg m-1 s-2"),
    "gram": ("0.001", "kg"),
    "second": ("1", "s"),
    "radian": ("1", ""),
    "hertz": ("1", "s-1"),
    "volt": ("1", "kg m2 s-3 A-1"),
    "ampere": ("1", "A"),
    "ohm": ("1", "kg m2 s-3 A-2"),
    "henry": ("1", "kg m2 s-2 A-2"),
    "farad": ("1", "kg-1 m-2 s4 A2"),
    "millifarad": ("0.001", "kg-1 m-2 s4 A2"),
    "microfarad": ("0.000001", "kg-1 m-2 s4 A2"),
    "joule": ("1", "kg m2 s-2"),
    "watt": ("1", "kg m2 s-3"),
    "kelvin": ("1", "K"),
    "stokes": ("0.0001", "m2 s-1"),
    "minute": ("60", "s"),
    "hour": ("3600", "s"),
    "day": ("86400", "s"),
    "revolution": ("6.283185307179586476925286766", ""),
    "degree": ("0.01745329251994329576923690768", ""),
    "gon": ("0.01570796326794896619231321692", ""),
    "arcminute": ("0.0002908882086657215961539484615", ""),
    "arcsecond": ("0.000004848136811095359935899141025", ""),
    "milliarcsecond": ("4.848136811095359935899141025E-9", ""),
    "percent": ("0.01", ""),
    "permille": ("0.001", ""),
    "ppm": ("0.000001", ""),
    "degree_Celsius": ("1", "K"),  # as a difference of temperatures
    "degree_Fahrenheit": ("0.5555555555555555555555555556", "K"),
    "inch": ("0.0254", "m"),
    "foot": ("0.3048", "m"),
    "pound": ("0.45359237", "kg"),
    "avoirdupois_pound": ("0.45359237", "kg"),
    "ounce": ("0.028349523125", "kg"),
    "slug": ("14.59390293720636482939632545", "kg"),
    "force_pound": ("4.4482216152605", "kg m s-2"),
    "force_ounce": ("0.27801385095378125", "kg m s-2"),
    "kilogram_force": ("9.80665", "kg m s-2"),
    "force_gram": ("0.00980665", "kg m s-2"),
}
PREFIXES = {
    "nano": "1e-9",
    "micro": "1e-6",
    "milli": "1e-3",
    "centi": "1e-2",
    "deci": "1e-1",
    "deca": "1e1",
    "kilo": "1e3",
    "mega": "1e6",
    "giga": "1e9",
}


@cache
def _unit(name: str) -> tuple[Decimal, dict[str, int]]:
    """One of a unit in SI, and its dimension: the power of each SI base unit."""
    prefix = "" if name in UNITS else next(p for p in PREFIXES if name.startswith(p))
    factor, bases = UNITS[name.removeprefix(prefix)]
    powers = ((base.rstrip("-0123456789"), base) for base in bases.split())
    dimension = {symbol: int(base.removeprefix(symbol) or 1) for symbol, base in powers}
    return Decimal(factor) * Decimal(PREFIXES.get(prefix, 1)), dimension


def factor_of(units: Mapping[str, int]) -> Decimal:
    """One of a product of units in SI. Raises ArithmeticError: it is beyond the range of numbers."""
    factor = Decimal(1)
    for name, power in units.items():
        factor *= _unit(name)[0] ** power
    return factor


def dimension_of(units: Mapping[str, float]) -> dict[str, float]:
    """The power of each SI base unit in a product of units; of an angle none."""
    found: dict[str, float] = {}
    for name, power in units.items():
        for base, n in _unit(name)[1].items():
            found[base] = found.get(base, 0) + n * power
    return {base: power for base, power in found.items() if power}
