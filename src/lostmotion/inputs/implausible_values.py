"""Bare numbers that no drive has, mostly since another unit was meant: a warning names the unit in which they are read."""

import math
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

from ..units.scalars import is_number


class Usual(NamedTuple):
    """Largest value that a drive may have, with its unit, and the unit that is usual for it."""

    most: float
    unit: str
    meant: str


GAP = Usual(math.radians(5.0), "rad", "arcmin")
GAP_OF_SLIDE = Usual(5e-3, "m", "um")
OF_SLIDE = re.compile(r"(axis\.(screw|rack|belt)|(screws|racks|belts)\.[^.]+)\.backlash")
SPEED = Usual(1e5 * math.pi / 30.0, "rad/s", "rpm")
INPUT_SPEED = Usual(4e4 * math.pi / 30.0, "rad/s", "rpm")
PITCH = Usual(0.5, "m", "mm")
TICK = Usual(1.0, "s", "us")
LARGEST: dict[str, Usual] = {
    **dict.fromkeys(("backlash", "added_backlash", "hysteresis_loss", "max_lost_motion", "settling_window"), GAP),
    **dict.fromkeys(("max_tracking_error", "max_reversal_error"), GAP),
    **dict.fromkeys(("rated_speed", "max_speed", "no_load_speed"), SPEED),
    **dict.fromkeys(("max_input_speed", "rated_input_speed"), INPUT_SPEED),
    **dict.fromkeys(("lead", "pitch", "module", "grating_period"), PITCH),
    **dict.fromkeys(("sample_time", "electrical_time_constant"), TICK),
    "rotor_inertia": Usual(10.0, "kg*m^2", "kg*cm^2"),
    "ambient_temperature": Usual(150.0, "degC", "K"),
}
"""by key; gaps and errors of a task may belong to a slide, in m, for which 0.09 is as much too large"""


class ValueWarning(UserWarning):
    """A bare number that no drive has in the unit in which it is read."""


_TRUSTED = ContextVar("trusted", default=False)


@contextmanager
def trusted() -> Iterator[None]:
    """Doubt no numbers inside: they are computed, and nobody has written them."""
    token = _TRUSTED.set(True)
    try:
        yield
    finally:
        _TRUSTED.reset(token)


def doubt(key: str, value: Any, where: object = "") -> None:
    """Warn of a bare number that no drive has.

    key: dotted key, whose last part says what it is.
    value: as it was written; text has a unit of its own and is not doubted.
    where: file or function that the warning begins with.
    """
    usual = GAP_OF_SLIDE if OF_SLIDE.fullmatch(key) else LARGEST.get(key.rpartition(".")[2])
    if _TRUSTED.get() or usual is None or not is_number(value) or not abs(value) > usual.most:
        return
    begin = f"{where}: key {key}" if where else key
    slide = " or, of a slide, m" if usual is GAP else ""
    text = f"{begin}: {value:g} is read as {read_as(value, usual.unit)}{slide}; write it with its unit, such as"
    warnings.warn(f'{text} "{value:g} {usual.meant}"', ValueWarning, stacklevel=3)


def doubt_window(window: float, travel: float, unit: str, where: str) -> None:
    """Warn of a window of settling in which all of the motion lies."""
    if window >= travel > 0.0:
        text = f"{where}: {read_as(window, unit)} is no less than the whole motion, {read_as(travel, unit)}; give a part of it, "
        warnings.warn(f'{text}such as "1 {"arcmin" if unit == "rad" else "um"}"', ValueWarning, stacklevel=3)


def doubt_all(data: Mapping[str, Any], where: object) -> None:
    """Warn of all such numbers in the tables of a file."""
    tables: list[tuple[str, Any]] = [("", data)]
    while tables:
        prefix, table = tables.pop()
        entries = table.items() if isinstance(table, Mapping) else enumerate(table)
        for key, value in entries:
            if isinstance(value, Mapping) or (isinstance(value, list) and isinstance(next(iter(value), None), Mapping)):
                tables.append((f"{prefix}{key}.", value))
            elif str(key).rpartition(".")[2] in LARGEST:
                doubt(f"{prefix}{key}", value, where)


def read_as(value: float, unit: str) -> str:
    """A value in an SI unit, with angles in degrees beside: 1 rad (57.3 deg)."""
    name = "°C" if unit == "degC" else unit
    return f"{value:g} {name}" + (f" ({math.degrees(value):.3g} deg)" if unit == "rad" else "")
