"""One rule for the numbers of every library: what is one number in NumPy or xarray is read as that number."""

import math
import re
import sys
from collections.abc import Iterable
from decimal import Decimal
from numbers import Real
from typing import Any

OWN = (float, int, str, bool, type(None))
NUMBERS, PLAIN = "iuf", "iufbUO"  # kinds of NumPy's types: dates, spans of time and complex numbers are no numbers here
SI = {"", "rad", "s", "N", "m", "Nm", "kg", "A", "V", "W", "J", "H", "K", "Hz", "Wb", "T", "ohm", "Ω", "degC"}


def scalar(value: Any) -> Any:
    """The number, Boolean or text that an array or DataArray without dimensions holds; anything else as it is."""
    if type(value) in OWN or getattr(value, "ndim", None) != 0 or not hasattr(value, "item"):
        return value
    if _kind(value) not in PLAIN or not _is_in_si(value):
        return value
    found = math.nan if _is_masked(value) else value.item()
    return float(found) if _kind(found) == "f" and hasattr(found, "dtype") else found  # a long double stays one


def plain(value: Any) -> Any:
    """The same of all values of a table or list; arrays are lists."""
    if type(value) in OWN:
        return value
    if type(value) is dict:
        return {key: plain(entry) for key, entry in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    if getattr(value, "ndim", 0) and hasattr(value, "dtype") and _is_in_si(value):
        array = value.to_numpy() if hasattr(value, "to_numpy") else value
        return array.tolist() if _kind(array) in PLAIN and not _is_masked(array) else value
    return scalar(value)


def is_several(value: Any) -> bool:
    """Whether it can be gone through entry by entry; text cannot."""
    return isinstance(value, Iterable) and not isinstance(value, str | bytes) and getattr(value, "ndim", 1) > 0


def is_number(value: Any) -> bool:
    """Whether it is a real number of any library, and no Boolean."""
    return isinstance(value, Real | Decimal) and not isinstance(value, bool) and _kind(value) in NUMBERS


def objection(value: Any) -> str:
    """Why something that holds a number is not read as one; empty if there is nothing to add."""
    if not _is_in_si(value):
        return f'has units = "{value.attrs["units"]}", and bare numbers are in SI; give its float() in SI, or text with the unit'
    if is_several(value) and getattr(value, "size", len(value) if isinstance(value, list | tuple) else 0) == 1:
        return "is a list of one; give its entry"
    return ""


def _kind(value: Any) -> str:
    return getattr(getattr(value, "dtype", None), "kind", "f")


def _is_in_si(value: Any) -> bool:
    """Whether the units of a DataArray, if any, are the units of bare numbers."""
    attributes = getattr(value, "attrs", None)
    units = attributes.get("units", "") if isinstance(attributes, dict) else ""
    return not isinstance(units, str) or all(symbol in SI for symbol in re.split(r"[ *·/()^0-9.+-]+", units))


def _is_masked(value: Any) -> bool:
    numpy = sys.modules.get("numpy")  # who has an array has imported it
    return numpy is not None and isinstance(value, numpy.ma.MaskedArray) and bool(numpy.ma.is_masked(value))
