"""Practical units: those in which this trade prints speeds, angles and inertias. Inside the package everything is SI."""

import math
from collections.abc import Callable
from typing import Any

RPM = 30.0 / math.pi  # of one rad/s
ARCMIN = 10800.0 / math.pi  # of one rad

# SI unit -> (unit, how many of them).
PRACTICAL = {
    "rad/s": ("rpm", RPM),
    "rad": ("arcmin", ARCMIN),
    "m": ("mm", 1e3),
    "m/s": ("mm/s", 1e3),
    "N/m": ("N/µm", 1e-6),
    "kg*m^2": ("kg·cm²", 1e4),
    "s": ("ms", 1e3),
    "H": ("mH", 1e3),
    "degC": ("°C", 1.0),
    "ohm": ("Ω", 1.0),
}
OF_ERRORS = {"rad": ("deg", math.degrees(1.0)), "m": ("mm", 1e3)}  # units of errors of measured channels
MOST_DIGITS = 12  # of a printed number
PRINTED = (("*", "·"), ("^2", "²"), ("^3", "³"))


# Units of charts and summaries, where they are not SI, and units of small values such as twists and errors.
CHARTED = {"rad": ("deg", math.degrees(1.0)), "m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "m/s^2": ("mm/s²", 1e3)}
SMALL = 1e-4  # [m], below which lengths are in µm
CHARTED_SMALL = {"rad": ("arcmin", ARCMIN), "m": ("µm", 1e6)}


def printed(unit: str) -> str:
    """An SI unit as pages, charts and tables print it: N·m, m/s²."""
    for written, shown in PRINTED:
        unit = unit.replace(written, shown)
    return unit


def counted(number: int, noun: str) -> str:
    """A number of things as text: 1 sample, 2 samples."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


ROUNDING = 1e-9  # share of a limit within which a value is at the limit: both may have been converted from other units


def excess(share: float) -> str:
    """Share of a limit by which it is missed, in percent, never rounded to 0."""
    percent = 100.0 * share
    return f"{percent:.0f} %" if percent >= 10.0 else f"{percent:.2g} %" if percent >= 1e-4 else "less than 0.0001 %"


def told_apart(
    value: float,
    limit: float,
    differ: bool = True,
    show: Callable[[float, int], str] = "{:.{}g}".format,
    digits: int = 4,
) -> tuple[str, str]:
    """A value and its limit as text, with as many more digits as are needed where their texts have to differ."""
    while differ and digits < MOST_DIGITS and show(value, digits) == show(limit, digits):
        digits += 1
    return show(value, digits), show(limit, digits)


def share_of_limit(use: float) -> str:
    """Share of a limit that is used, in percent: 100 % only where it is not exceeded."""
    percent, _ = told_apart(100.0 * use, 100.0, use > 1.0 + ROUNDING, "{:.{}f}".format, 0)
    return f"{percent} %"


def part_of_whole(share: float) -> str:
    """A share in percent: 0 % only where it is nothing, and 100 % only where it is all."""
    percent = round(100.0 * share)
    if percent == 0 and share > 0.0:
        return "less than 1 %"
    return "more than 99 %" if percent == 100 and share < 1.0 else f"{percent} %"


def charted(unit: str, *, small: bool = False) -> tuple[str, float]:
    """Unit of a chart or a summary for an SI unit, and how many of them one is."""
    found = CHARTED_SMALL.get(unit) if small else None
    return found or CHARTED.get(unit, (printed(unit), 1.0))


def practical(value: Any, unit: str, digits: int = 5) -> str:
    """A value in an SI unit, or several, as text in the practical one; text stays as it is."""
    if isinstance(value, str):
        return value
    name, factor = PRACTICAL.get(unit, (printed(unit), 1.0))
    values = value if isinstance(value, tuple) else (value,)
    if unit == "m" and any(values) and all(abs(v) < SMALL for v in values):
        name, factor = CHARTED_SMALL["m"]
    text = ", ".join(_in_digits(factor * v, digits) for v in values)
    return f"{text} {name}".strip()


def _in_digits(value: float, digits: int) -> str:
    """So many digits, without an exponent below a million."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e6 else text
