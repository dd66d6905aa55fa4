"""Satellites as targets, from two-line elements by SGP4."""

import math
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Annotated, Literal

import numpy as np
from pydantic import field_validator

from ..errors import need
from ..inputs.part import rule
from ..inputs.quantities import Angle, Length, Limit, Time
from ..reproducible import cos, sin
from .pointing_targets import ORDER, Jet, TargetPath

# The earth, WGS 84.
EQUATOR, FLATTENING = 6378137.0, 1.0 / 298.257223563
SPACING = 5.0  # [s] between the points of the spline through the orbit
DEGREE = 7
DAY = 86400.0  # [s]
J2000 = 2451545.0  # Julian date


def sidereal_time(days: float, more: np.ndarray) -> np.ndarray:
    """Greenwich mean sidereal time [rad] so many and so many more days of UT1 after J2000 (IAU 1982; Aoki et al. 1982)."""
    T = (days + more) / 36525.0
    beyond = 8640184.812866 * T + 0.093104 * T * T - 6.2e-6 * T * T * T  # [s] of sidereal time, beside one turn a day
    return np.asarray(2.0 * math.pi * ((days % 1.0 + more) + (67310.54841 + beyond) / DAY))


class Satellite(TargetPath):
    """A satellite over a place on the earth, without refraction. Traverse is the azimuth less the bearing of y.

    Its position in the true equator, mean equinox frame of SGP4 is turned into the earth's by the mean sidereal time
    (IAU 1982). The motion of the pole, up to 0.5 arcsec, is left out. What SGP4 itself is wrong by is a kilometre
    after a day, and more beyond.
    """

    elements: tuple[str, str]  #: the two lines
    begin: datetime  #: UTC at t = 0, such as 2024-05-01T20:15:00Z
    latitude: Annotated[Angle, Limit(ge=-0.5 * math.pi, le=0.5 * math.pi)]  #: latitude of the station, geodetic
    longitude: Angle  #: east
    altitude: Length = 0.0  #: above the ellipsoid
    ut1: Annotated[Time, Limit(ge=-1.0, le=1.0)] = 0.0  #: UT1 - UTC, as the IERS publishes it; a second is 15 arcsec
    path: Literal["satellite"]

    @field_validator("begin")
    @classmethod
    def _in_utc(cls, value: datetime) -> datetime:
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)

    @rule
    def _can_be_read(self) -> Iterator[str]:
        for number, line in enumerate(self.elements, start=1):
            if len(line) < 69 or not line.startswith(f"{number} "):
                yield f'has elements whose line {number} is no line of a two-line element set; it must begin with "{number} " and have 69 characters'
            given = sum(int(c) if c.isdigit() else c == "-" for c in line[:68]) % 10
            if str(given) != line[68]:
                yield f"has elements whose line {number} ends with the check digit {line[68]}, and its digits give {given}; copy it anew"

    def position(self, t: np.ndarray) -> tuple[Jet, Jet, Jet]:
        need("scipy", "A satellite", "satellites")
        from scipy.interpolate import make_interp_spline

        first, last = float(t.min()), float(t.max())
        # A little more than asked for, so that derivatives at the ends are as good as within.
        points = first + SPACING * np.arange(-DEGREE, math.ceil((last - first) / SPACING) + 1 + DEGREE)
        spline = make_interp_spline(points, self.seen(points), k=DEGREE)
        x, y, z = np.array([spline(t, k) / math.factorial(k) for k in range(ORDER)]).transpose(2, 0, 1)
        return x, y, z

    def seen(self, t: np.ndarray) -> np.ndarray:
        """(n, 3): east, north and up from the station [m] at instants [s] after the beginning.

        Raises ValueError: SGP4 cannot go so far from the epoch of the elements.
        """
        need("sgp4", "A satellite", "satellites")
        from sgp4.api import SGP4_ERRORS, Satrec, jday

        b = self.begin
        whole, share = jday(b.year, b.month, b.day, b.hour, b.minute, b.second + 1e-6 * b.microsecond)
        shares = share + t / DAY
        error, r, _ = Satrec.twoline2rv(*self.elements).sgp4_array(np.full_like(shares, whole), shares)
        if error.any():
            raise ValueError(
                f"has elements that SGP4 refuses at that time: {SGP4_ERRORS[int(error.max())]}; take newer ones"
            )
        turn = sidereal_time(whole - J2000, shares + self.ut1 / DAY) + self.longitude
        # Axes of the place: east, north, up, in the equatorial frame that turns through the sidereal time.
        c, s = cos(turn), sin(turn)
        cl, sl = cos(self.latitude), sin(self.latitude)
        out, across = 1e3 * (c * r[:, 0] + s * r[:, 1]), 1e3 * (c * r[:, 1] - s * r[:, 0])
        square = FLATTENING * (2.0 - FLATTENING)
        curvature = EQUATOR / math.sqrt(1.0 - square * sl * sl)
        out = out - (curvature + self.altitude) * cl
        along = 1e3 * r[:, 2] - (curvature * (1.0 - square) + self.altitude) * sl
        return np.column_stack([across, cl * along - sl * out, cl * out + sl * along])
