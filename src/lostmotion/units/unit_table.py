"""The units of the grammar in SI. Prefixes are left out; the tests compare all units with a unit library."""

from collections.abc import Iterable, Mapping
from decimal import Decimal
from functools import cache

UNITS = {
    "newton": ("1", "kg m s-2", "newton newtons"),
    "pascal": ("1", "kg m-1 s-2", "pascal pascals"),
    "meter": ("1", "m", "meter metre meters metres"),
    "second": ("1", "s", "sec second seconds"),
    "minute": ("60", "s", "min minute minutes"),
    "hour": ("3600", "s", "h hr hour hours"),
    "day": ("86400", "s", "d day days"),
    "radian": ("1", "rad", "radian radians"),
    "degree": ("0.01745329251994329576923690768", "rad", "deg ° degree degrees"),
    "arcminute": ("0.0002908882086657215961539484615", "rad", "arcmin ' arcmins arcminute arcminutes"),
    "arcsecond": ("0.000004848136811095359935899141025", "rad", 'arcsec " arcsecs arcsecond arcseconds'),
    "milliarcsecond": ("4.848136811095359935899141025E-9", "rad", "mas"),
    "gon": ("0.01570796326794896619231321692", "rad", "gon"),
    "revolution": ("6.283185307179586476925286766", "rad", "r turn turns revs revolution revolutions U tr"),
    "hertz": ("1", "s-1", "hertz"),
    "volt": ("1", "kg m2 s-3 A-1", "volt volts"),
    "ampere": ("1", "A", "amp amps ampere amperes"),
    "ohm": ("1", "kg m2 s-3 A-2", "ohms"),
    "farad": ("1", "kg-1 m-2 s4 A2", "farad farads"),  # F alone is a temperature
    "millifarad": ("0.001", "kg-1 m-2 s4 A2", "mF"),
    "microfarad": ("0.000001", "kg-1 m-2 s4 A2", "uF"),
    "kelvin": ("1", "K", "kelvin"),
    "degree_Celsius": ("1", "K", "degC °C C celsius"),  # in a product, a difference of temperatures
    "degree_Fahrenheit": ("0.5555555555555555555555555556", "K", "degF °F F fahrenheit"),
    "watt": ("1", "kg m2 s-3", "watt watts"),
    "percent": ("0.01", "", "% percent"),
    "permille": ("0.001", "", "‰"),
    "ppm": ("0.000001", "", "ppm"),
    "inch": ("0.0254", "m", "in inch inches"),
    "foot": ("0.3048", "m", "ft foot feet"),
    "pound": ("0.45359237", "kg", "lb lbs pound pounds"),
    "avoirdupois_pound": ("0.45359237", "kg", "lbm"),  # a mass and nothing else
    "force_pound": ("4.4482216152605", "kg m s-2", "lbf"),
    "ounce": ("0.028349523125", "kg", "oz ounce ounces"),
    "force_ounce": ("0.27801385095378125", "kg m s-2", "ozf"),
    "slug": ("14.59390293720636482939632545", "kg", "slug slugs"),
    "kilogram_force": ("9.80665", "kg m s-2", "kgf kp"),
    "force_gram": ("0.00980665", "kg m s-2", "gf"),
    "gram": ("0.001", "kg", ""),
    "henry": ("1", "kg m2 s-2 A-2", ""),
    "joule": ("1", "kg m2 s-2", ""),
    "stokes": ("0.0001", "m2 s-1", ""),
}
"""name: how many SI units it is, to the digits of decimal arithmetic; the SI unit, where angles are plain numbers; and
its spellings beside those of `grammar.PREFIXED`, the one that messages show first"""
PREFIXES = {
    "n": ("nano", "1e-9"),
    "u": ("micro", "1e-6"),
    "m": ("milli", "1e-3"),
    "c": ("centi", "1e-2"),
    "d": ("deci", "1e-1"),
    "da": ("deca", "1e1"),
    "k": ("kilo", "1e3"),
    "M": ("mega", "1e6"),
    "G": ("giga", "1e9"),
}


@cache
def _unit(name: str) -> tuple[Decimal, dict[str, int]]:
    """One of a unit in SI, and its dimension: the power of each SI base unit, and of the plane angle."""
    prefix, size = next(((p, n) for p, n in PREFIXES.values() if name not in UNITS and name.startswith(p)), ("", "1"))
    factor, bases, _ = UNITS[name.removeprefix(prefix)]
    powers = ((base.rstrip("-0123456789"), base) for base in bases.split())
    dimension = {symbol: int(base.removeprefix(symbol) or 1) for symbol, base in powers}
    return Decimal(factor) * Decimal(size), dimension


def factor_of(units: Mapping[str, int]) -> Decimal:
    """One of a product of units in SI. Raises ArithmeticError: it is beyond the range of numbers."""
    factor = Decimal(1)
    for name, power in units.items():
        factor *= _unit(name)[0] ** power
    return factor


def powers_of(units: Iterable[tuple[str, float]]) -> dict[str, float]:
    """The power of each SI base unit, and of the plane angle (rad), in a product of units to their powers."""
    found: dict[str, float] = {}
    for name, power in units:
        for base, n in _unit(name)[1].items():
            found[base] = found.get(base, 0) + n * power
    return {base: power for base, power in found.items() if power}


def dimension_of(units: Mapping[str, float]) -> dict[str, float]:
    """The power of each SI base unit in a product of units; of an angle none."""
    return {base: power for base, power in powers_of(units.items()).items() if base != "rad"}


def angle_of(units: Mapping[str, int]) -> int:
    """The power of the plane angle, whose dimension is the dimension of a plain number."""
    return int(powers_of(units.items()).get("rad", 0))
