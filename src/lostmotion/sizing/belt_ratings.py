"""Ratings of toothed belts by profile and width, where a table gives none of its own."""

import math
import re
from functools import cache

import numpy as np

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

# Force that a tooth of 1 cm width carries [N/cm] over the speed of the small pulley [rpm]: T5 by Elatech (catalogue 2012, page 9), the others by Synchroflex
# (catalogue, pages 45 to 69). GEN III carries 1.25 times as much (ATP10 1.1 times) and Elatech's AT5, ATL5 and AT20 3 % more, with the same shares.
SPEEDS = (0.0, 100.0, 500.0, 1000.0, 1500.0, 2000.0, 3000.0, 4000.0, 6000.0, 8000.0, 10_000.0)
TOOTH_FORCES = {
    "T5": (24.70, 22.28, 18.45, 16.32, 15.00, 14.03, 12.65, 11.66, 10.24, 9.23, 8.44),
    "AT3": (32.34, 30.80, 26.91, 24.09, 22.16, 20.70, 18.53, 16.93, 14.62, 12.94, 11.63),
    "AT5": (35.3, 33.5, 29.0, 25.7, 23.5, 21.9, 19.42, 17.61, 15.00, 13.11, 11.63),
    "AT10": (73.5, 68.7, 57.4, 49.5, 44.3, 40.3, 34.5, 30.3, 24.2, 19.77, 16.32),
    "AT20": (147.0, 134.9, 107.2, 88.4, 76.0, 66.7, 53.1, 43.2, 28.9),
    "ATP10": (95.5, 89.28, 74.54, 64.33, 57.51, 52.40, 44.87, 39.36, 31.42, 25.69, 21.21),
}


def of_profile(belt: RatedBelt) -> RatedBelt:
    """The belt with the ratings that sheets of its profile and width print: of several the least.

    Those that it has remain. Without such a sheet it is returned as it is.
    """
    sheets = [
        sheet for sheet in _sheets(_spelling(belt.profile)) if _same(sheet.width, belt.width) and _fits(sheet, belt)
    ]
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
    pitch = _pitch(belt)
    family = re.match(r"[A-Z]+2?", _spelling(belt.profile))
    if pitch is None or family is None:
        return None
    known = (N for (name, mm), N in WORKING_TENSION.items() if name == family[0] and _same(pitch, 1e-3 * mm))
    tension = next(known, None)
    return None if tension is None else tension * belt.width / INCH


def tooth_shares(profile: str, rpm: np.ndarray) -> np.ndarray | None:
    """Share of the tooth force at standstill that is left at speeds of the small pulley; None of a profile whose table is not known."""
    forces = TOOTH_FORCES.get(_spelling(profile).removesuffix("GENIII").replace("ATL", "AT"))
    if forces is None:
        return None
    shares: np.ndarray = np.interp(rpm, SPEEDS[: len(forces)], forces) / forces[0]
    return shares


def widths(belt: RatedBelt) -> list[float]:
    """Widths of the profile and pitch of a belt for which the catalogue has a sheet [m]."""
    sheets = (sheet for sheet in _sheets(_spelling(belt.profile)) if _fits(sheet, belt))
    return sorted({sheet.width for sheet in sheets if sheet.width is not None})


def _pitch(belt: RatedBelt) -> float | None:
    return belt.pitch or (None if belt.teeth is None else belt.travel() / belt.teeth)


def _fits(sheet: BeltSheet, belt: RatedBelt) -> bool:
    """Whether a belt may have the pitch of a sheet."""
    return sheet.pitch is None or (pitch := _pitch(belt)) is None or _same(sheet.pitch, pitch)


@cache
def _sheets(profile: str) -> tuple[BeltSheet, ...]:
    belts = (record for record in catalogue() if isinstance(record, BeltSheet))
    return tuple(sheet for sheet in belts if profile and _spelling(sheet.profile) == profile)


def _spelling(profile: str) -> str:
    """A profile without blanks, dashes and small letters."""
    return re.sub(r"[\s-]", "", profile).upper()


def _same(a: float | None, b: float | None) -> bool:
    return a is not None and b is not None and math.isclose(a, b, rel_tol=SAME)
