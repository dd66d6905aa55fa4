"""Practical units: those in which this trade prints speeds, angles and inertias. Inside the package everything is SI."""

from __future__ import annotations

import math
from typing import Any

RPM = 30.0 / math.pi  # of one rad/s
ARCMIN = 10800.0 / math.pi  # of one rad

# SI unit -> (unit, how many of them).
PRACTICAL = {
    "rad/s": ("rpm", RPM),
    "rad": ("arcmin", ARCMIN),
    "kg*m^2": ("kg·cm²", 1e4),
    "s": ("ms", 1e3),
    "H": ("mH", 1e3),
    "degC": ("°C", 1.0),
    "ohm": ("Ω", 1.0),
}


def practical(value: Any, unit: str, digits: int = 5) -> str:
    """A value in an SI unit, or several, as text in the practical one; text stays as it is."""
    if isinstance(value, str):
        return value
    name, factor = PRACTICAL.get(unit, (unit.replace("*", "·"), 1.0))
    text = ", ".join(f"{factor * v:.{digits}g}" for v in (value if isinstance(value, tuple) else (value,)))
    return f"{text} {name}".strip()
