"""Satellites as targets: published verification values of SGP4, another library's azimuth and elevation, and what is refused."""

import math
from datetime import UTC, datetime, timedelta
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refusals_of

pytest.importorskip("sgp4")

ISS = (
    "1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927",
    "2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537",
)
PASS: dict[str, Any] = {
    "path": "satellite", "elements": ISS, "begin": "2008-09-20T19:55:30Z", "latitude": "48.1 deg", "longitude": "11.6 deg",
    "altitude": "500 m", "duration": 270.0,
}  # fmt: skip


DUT1 = -0.4815675
SKYFIELD = (
    (0.0, 0.26427740286268575, 4.462533321874798),
    (138.0, 1.2693659564154602, 5.921822539741965),
    (270.0, 0.2829068969344152, 1.1174224656223215),
)
"""seconds, elevation, azimuth [rad]"""


def target(axis: str = "traverse", **change: Any) -> Any:
    return lm.PositionReference(target=PASS | {"axis": axis} | change).target


def published(number: str) -> np.ndarray:
    """Minutes since the epoch and TEME position [km] of a satellite, from Vallado et al., Revisiting Spacetrack Report #3 (AIAA 2006-6753)."""
    rows, found = files("sgp4").joinpath("tcppver.out").read_text().splitlines(), []
    at = next(k for k, row in enumerate(rows) if row.strip() == f"{number} xx")
    for row in rows[at + 1 :]:
        if row.rstrip().endswith("xx"):
            break
        found.append([float(x) for x in row.split()[:4]])
    return np.array(found)


def lines(number: str) -> tuple[str, str]:
    rows = files("sgp4").joinpath("SGP4-VER.TLE").read_text().splitlines()
    k = next(k for k, row in enumerate(rows) if row.startswith(f"1 {number.zfill(5)}"))
    return rows[k][:69], rows[k + 1][:69]


def sidereal(at: datetime) -> float:
    """Greenwich mean sidereal time [rad] (IAU 1982; Aoki et al. 1982)."""
    days = (at - datetime(2000, 1, 1, 12, tzinfo=UTC)) / timedelta(days=1)
    T = days / 36525.0
    seconds = 67310.54841 + (876600.0 * 3600.0 + 8640184.812866) * T + 0.093104 * T**2 - 6.2e-6 * T**3
    return math.radians(seconds / 240.0)


@pytest.mark.parametrize("number", ["5", "6251", "28057", "8195", "9880", "22312"])
def test_positions_are_the_published_ones(number: str) -> None:
    # The epoch is known to a microsecond here, in which a satellite moves less than 10 mm.
    elements = lines(number)
    year, day = int(elements[0][18:20]), float(elements[0][20:32])
    epoch = datetime(2000 + year if year < 57 else 1900 + year, 1, 1, tzinfo=UTC) + timedelta(days=day - 1.0)
    latitude, longitude = 0.7, 0.3
    station = target(elements=elements, begin=epoch, latitude=latitude, longitude=longitude, altitude=120.0)
    wanted = published(number)
    e2 = (2.0 - 1.0 / 298.257223563) / 298.257223563
    N = 6378137.0 / math.sqrt(1.0 - e2 * math.sin(latitude) ** 2)
    place = np.array([(N + 120.0) * math.cos(latitude), 0.0, (N * (1.0 - e2) + 120.0) * math.sin(latitude)])
    for minutes, *r in wanted[:5]:
        east, north, up = station.seen(np.array([60.0 * minutes]))[0]
        turn = sidereal(epoch + timedelta(minutes=minutes)) + longitude
        # In the meridian of the place: outwards, across, along the axis of the earth.
        out = place[0] - math.sin(latitude) * north + math.cos(latitude) * up
        along = place[2] + math.cos(latitude) * north + math.sin(latitude) * up
        x, y = math.cos(turn) * out - math.sin(turn) * east, math.sin(turn) * out + math.cos(turn) * east
        assert np.array([x, y, along]) == pytest.approx(1e3 * np.array(r), abs=0.02), minutes


def test_azimuth_and_elevation_are_those_of_skyfield() -> None:
    """Skyfield 1.55 (Rhodes), EarthSatellite and wgs84.latlon, with its UT1 - UTC = -0.4816 s and without the motion of the pole."""
    at, elevation, azimuth = np.array(SKYFIELD).T
    both = [target(axis, ut1=DUT1).at(at)[0] for axis in ("traverse", "elevation")]
    assert np.remainder(both[0], 2.0 * math.pi) == pytest.approx(azimuth, abs=2e-8)
    assert both[1] == pytest.approx(elevation, abs=2e-8)


@pytest.mark.parametrize("axis", ["traverse", "elevation"])
def test_derivatives_are_those_of_differences(axis: str) -> None:
    t, h = np.linspace(1.0, 269.0, 269), 0.02
    at = [np.array(target(axis).at(t + k * h)) for k in (-2, -1, 0, 1, 2)]
    slope = (at[0] - 8.0 * at[1] + 8.0 * at[3] - at[4]) / (12.0 * h)
    for order in range(3):
        np.testing.assert_allclose(slope[order], at[2][order + 1], rtol=0.0, atol=1e-6 * np.abs(at[2][order + 1]).max())


def test_the_pieces_follow_the_satellite() -> None:
    r = lm.PositionReference(target=PASS | {"axis": "traverse"})
    t = np.linspace(0.0, 269.9, 1111)
    np.testing.assert_allclose(r.at(t)[0], r.target.at(t)[0], rtol=0.0, atol=2e-12)
    assert np.abs(r.at(t)[1]).max() > 0.02  # near the zenith the traverse is fast


def test_a_scenario_with_a_satellite_is_written_and_read_back() -> None:
    axis = lm.load("tracking-loss-map")
    c = axis.controller.model_dump(exclude_none=True) | {"reference": {"kind": "position", "target": PASS | {"axis": "elevation"}}}
    s = axis.replace(controller=c, initial={"on_reference": True}, **{"simulation.duration": 0.5})
    assert lm.Scenario.from_json(s.to_json()) == s
    r = lm.simulate(s, energy=False)
    error = s.controller.reference.at(r.time.values)[0] - r.load_angle.values
    assert np.abs(error[r.time.values > 0.3]).max() < 1e-4


test_what_does_not_fit_is_refused = refusals_of(
    lambda change: target(**change),
    ({"elements": (ISS[1], ISS[0])}, "target: no line of a two-line element set"),
    ({"elements": (ISS[0][:-1] + "3", ISS[1])}, "target: check digit"),
    ({"latitude": "91 deg"}, "target.latitude"),
    ({"begin": "yesterday"}, "target.begin"),
    ({"elements": lines("28872"), "begin": "2005-11-29T03:00:00Z"}, ": SGP4 refuses"),
    ({"ut1": 1.5}, "target.ut1"),
)
