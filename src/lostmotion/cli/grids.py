"""Lists of values on the command line."""

import itertools
import re

from ..errors import InputError
from ..inputs.refusal_messages import shown
from ..units.conversion import si_value

MOST = 100_000  # values of a range


def parse_grid(text: str, option: str, unit: str = "") -> list[float]:
    """Values from ``0.1,1,10`` or, with equal ratios, ``0.1..100:60`` (first, last, how many).

    unit: of bare numbers (SI); an entry may bring its own.
    """
    problem = f"--{option} {text}: must be numbers such as 0.1,1,10 or a range such as 0.1..100:60"
    if ".." not in text:
        _refuse_decimal_comma(text, option)
        values = [_value(entry, unit, problem) for entry in text.split(",")]
    else:
        bounds, _, count = text.partition(":")
        low, _, high = bounds.partition("..")
        if not (count.isascii() and count.isdecimal() and int(count) > 0):
            raise InputError(problem)
        if len(count) > len(str(MOST)) or int(count) > MOST:
            raise InputError(f"--{option} {text}: has more than {MOST} values; give fewer")
        ends = [_value(entry, unit, problem) for entry in (low, high)]
        if min(ends) <= 0.0:
            raise InputError(f"{problem}, all of them above 0")
        import numpy as np

        values = np.geomspace(ends[0], ends[1], int(count)).tolist() if int(count) > 1 else ends[:1]
    if min(values) <= 0.0:
        raise InputError(f"{problem}, all of them above 0")
    return values


def _value(entry: str, unit: str, problem: str) -> float:
    if not entry.strip():
        raise InputError(problem)
    try:
        return si_value(entry.strip(), unit)
    except ValueError as error:
        raise InputError(f"{problem}; {shown(entry.strip())} {error}") from None


def _refuse_decimal_comma(text: str, option: str) -> None:
    """Two whole numbers, or digits after a comma that no whole number begins with, may be one number with a decimal comma."""
    entries = [entry.strip() for entry in text.split(",")]
    whole = [bool(re.fullmatch("[0-9]+", entry)) for entry in entries]
    if len(entries) == 2 and all(whole) and not re.match("0[0-9]", entries[1]):
        first, second = entries
        raise InputError(
            f"--{option} {text}: may be a list or a decimal comma; write {first}.0,{second}.0 or {first}.{second}"
        )
    for before, entry in itertools.pairwise(entries):
        if re.match("0[0-9]", entry) and re.fullmatch("[0-9]+", before):
            thousands = f" or {before}{entry}" if len(entry) == 3 and not before.startswith("0") else ""
            raise InputError(
                f"--{option} {text}: has a decimal comma in {before},{entry}; write {before}.{entry}{thousands}"
            )
