"""Ratings of toothed belts by profile and width, where a table gives none of its own."""

from __future__ import annotations

import math
import re
from functools import cache

from ..data_sheets.linear_sheets import BeltSheet
from ..data_sheets.records import catalogue
from ..model.rack_and_belt import RatedBelt

INCH = 25.4e-3
SAME = 1e-6  # of pitches and widths, relative
FULL_MESH = 6  # teeth, from which on manufacturers let a belt carry its working tension

# Allowable working tension [N] of a width of one inch, by profile and pitch [mm]: SDP/SI, Handbook D265, page T-15, table 3. GT2 and HTD are neoprene
# with glass fibre, T urethane with steel.
WORKING_TENSION = {
    ("GT2", 2.0): 111.0,
    ("GT2", 3.0): 507.0,
    ("GT2", 5.0): 712.0,
    ("GT2", 8.0): 1690.0,
    ("GT2", 14.0): 2891.0,
    ("HTD", 3.0): 285.0,
    ("HTD", 5.0): 454.0,
    ("HTD", 8.0): 792.0,
    ("T", 2.5): 312.0,
    ("T", 5.0): 930.0,
    ("T", 10.0): 1800.0,
}
SOURCE = "SDP/SI, Handbook D265, T-15"


def of_profile(belt: RatedBelt) -> RatedBelt:
    """The belt with the ratings that sheets of its profile and width print: of several the least.

    Those that it has remain. Without such a sheet it is returned as it is.
    """
    sheets = [sheet for sheet in _sheets(_spelling(belt.profile)) if _same(sheet.width, belt.width)]
    found = {}
    for key in ("rated_force", "tooth_force"):
        printed = [value for sheet in sheets if (value := getattr(sheet, key)) is not None]
        if getattr(belt, key) is None and printed:
            found[key] = min(printed)
    return belt.model_copy(update=found) if found else belt


def working_tension(belt: RatedBelt) -> float | None:
    """Allowable working tension [N] of a belt, in proportion to its width; None where it is not known."""
    if belt.width is None or not belt.profile:
        return None
    pitch = belt.pitch or (None if belt.teeth is None else belt.travel() / belt.teeth)
    family = re.match(r"[A-Z]+2?", _spelling(belt.profile))
    if pitch is None or family is None:
        return None
    known = (N for (name, mm), N in WORKING_TENSION.items() if name == family[0] and _same(pitch, 1e-3 * mm))
    tension = next(known, None)
    return None if tension is None else tension * belt.width / INCH


def widths(profile: str) -> list[float]:
    """Widths of a profile for which the catalogue has a sheet [m]."""
    return sorted({sheet.width for sheet in _sheets(_spelling(profile)) if sheet.width is not None})


@cache
def _sheets(profile: str) -> tuple[BeltSheet, ...]:
    belts = (record for record in catalogue() if isinstance(record, BeltSheet))
    return tuple(sheet for sheet in belts if profile and _spelling(sheet.profile) == profile)


def _spelling(profile: str) -> str:
    """A profile without blanks, dashes and small letters."""
    return re.sub(r"[\s-]", "", profile).upper()


def _same(a: float | None, b: float | None) -> bool:
    return a is not None and b is not None and math.isclose(a, b, rel_tol=SAME)
