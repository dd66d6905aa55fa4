"""Targets in space as references: closed forms, differences, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

FLY_BY = {"path": "fly_by", "distance": 500.0, "height": 200.0, "speed": 100.0, "crossing_time": 30.0}
WEAVE = FLY_BY | {"path": "weave", "width": 80.0, "frequency": 0.1}
CIRCLE = {"path": "circle", "distance": 900.0, "radius": 300.0, "height": 150.0, "speed": 60.0, "start": 1.0}
ROUND = CIRCLE | {"distance": 200.0}
STAR = {"path": "star", "declination": "20 deg", "hour_angle": "-5 deg", "latitude": "49 deg", "duration": 3600.0}
TIMES = np.linspace(0.0, 60.0, 31)
TRACK = {
    "path": "track", "times": tuple(TIMES), "x": tuple(40.0 * TIMES - 900.0), "y": tuple(500.0 + 3.0 * TIMES),
    "z": tuple(100.0 + 30.0 * np.sin(0.1 * TIMES)),
}  # fmt: skip
PATHS = {"fly_by": FLY_BY, "weave": WEAVE, "circle": CIRCLE, "round": ROUND, "star": STAR, "track": TRACK}


def reference(path: dict[str, Any], axis: str, **more: Any) -> lm.PositionReference:
    return lm.PositionReference(target=path | {"axis": axis} | more)


def test_a_fly_by_has_the_traverse_of_its_closed_form() -> None:
    V, R_0 = 100.0, 500.0
    t = np.linspace(0.0, 59.9, 4001)
    x, w = V * (t - 30.0) / R_0, V / R_0
    A, rate, second, third = reference(FLY_BY, "traverse").target.at(t)
    np.testing.assert_allclose(A, np.arctan(x), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(rate, w / (1.0 + x**2), rtol=1e-14)
    np.testing.assert_allclose(second, -2.0 * w**2 * x / (1.0 + x**2) ** 2, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(third, w**3 * (6.0 * x**2 - 2.0) / (1.0 + x**2) ** 3, rtol=1e-12, atol=1e-17)
    fine = np.linspace(25.0, 35.0, 100_001)
    _, rate, second, third = reference(FLY_BY, "traverse").target.at(fine)
    assert rate.max() == pytest.approx(w, rel=1e-12)
    assert np.abs(second).max() == pytest.approx(0.375 * math.sqrt(3.0) * w**2, rel=1e-8)
    assert np.abs(third).max() == pytest.approx(2.0 * w**3, rel=1e-12)


def test_the_elevation_of_a_fly_by_reverses_at_the_crossing() -> None:
    V, R_0, h = 100.0, 500.0, 200.0
    E, rate, second, _ = reference(FLY_BY, "elevation").target.at([10.0, 30.0])
    assert E[1] == pytest.approx(math.atan(h / R_0), rel=1e-15)
    assert rate[1] == pytest.approx(0.0, abs=1e-18)
    assert second[1] == pytest.approx(-h * V**2 / (R_0 * (R_0**2 + h**2)), rel=1e-13)
    rho = math.hypot(R_0, V * 20.0)
    assert rate[0] == pytest.approx(h * V**2 * 20.0 / rho / (rho**2 + h**2), rel=1e-13)


def test_heading_and_bearing_turn_the_traverse() -> None:
    left = reference(FLY_BY, "traverse", heading="left", bearing=1.0).at(20.0)
    right = reference(FLY_BY, "traverse").at(20.0)
    assert left[0] == pytest.approx(1.0 - right[0])
    assert left[1] == pytest.approx(-right[1])


@pytest.mark.parametrize("axis", ["traverse", "elevation"])
@pytest.mark.parametrize("name", PATHS)
def test_derivatives_are_those_of_differences(name: str, axis: str) -> None:
    target = reference(PATHS[name], axis).target
    t = np.linspace(0.1, target.duration - 0.2, 200)
    if name == "track":  # whose third derivative jumps at its points, 2 s apart
        t = t[np.abs(t % 2.0 - 1.0) < 0.9]
    scale = target.duration / 60.0
    h = 1e-3 * scale
    at = [np.array(target.at(t + k * h)) for k in (-2, -1, 0, 1, 2)]
    slope = (at[0] - 8.0 * at[1] + 8.0 * at[3] - at[4]) / (12.0 * h)
    for order in range(3):
        span = np.abs(at[2][order + 1]).max()
        np.testing.assert_allclose(slope[order], at[2][order + 1], rtol=0.0, atol=1e-7 * span + 1e-11 / scale)


@pytest.mark.parametrize("name", PATHS)
def test_the_pieces_follow_the_path(name: str) -> None:
    r = reference(PATHS[name], "traverse")
    t = np.random.default_rng(1).uniform(0.0, 0.999 * r.target.duration, 3000)
    wanted, given = r.target.at(np.sort(t)), r.at(np.sort(t))
    np.testing.assert_allclose(given[0], wanted[0], rtol=0.0, atol=2e-12)
    np.testing.assert_allclose(given[1], wanted[1], rtol=0.0, atol=1e-9)
    end = r.target.duration
    turns = (r.at(end + 5.0)[0] - r.target.at(end)[0][0]) / (2.0 * math.pi)
    assert turns == pytest.approx(round(float(turns)), abs=1e-12)
    assert r.at(end + 5.0)[1] == 0.0


def test_a_target_that_goes_round_the_station_turns_on() -> None:
    r = reference(ROUND, "traverse", duration=120.0)
    A = r.target.at(np.linspace(0.0, 120.0, 5001))[0]
    assert np.all(np.diff(A) > 0.0)
    assert A[-1] - A[0] == pytest.approx(60.0 / 300.0 * 120.0, abs=math.pi)


def test_a_star_culminates_where_astronomy_says() -> None:
    # At the upper culmination south of the zenith the altitude is 90 deg - latitude + declination, the azimuth 180 deg
    # and its rate omega cos(declination)/cos(altitude).
    r = reference(STAR | {"hour_angle": 0.0}, "elevation")
    assert r.at(0.0)[0] == pytest.approx(math.radians(90.0 - 49.0 + 20.0))
    turn = reference(STAR | {"hour_angle": 0.0}, "traverse").at(0.0)
    assert abs(turn[0]) == pytest.approx(math.pi)
    rate = 7.292115e-5 * math.cos(math.radians(20.0)) / math.cos(math.radians(61.0))
    assert turn[1] == pytest.approx(rate, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"axis": "azimuth"}, "traverse"),
        ({"distance": "500 kg"}, "distance"),
        ({"speed": -3.0}, "speed"),
        ({"path": "loop"}, "fly_by"),
        ({"path": "weave", "width": 600.0, "frequency": 1.0}, "not less than its distance"),
        (TRACK | {"x": (0.0,)}, "lists of different length"),
        (TRACK | {"duration": 90.0}, "must cover"),
        (CIRCLE | {"distance": 300.0}, "passes over the station"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], said: str) -> None:
    base = FLY_BY if change.get("path", "fly_by") in ("fly_by", "weave", "loop") else {}
    refused(lambda: reference(base | change, change.get("axis", "traverse")), match=said)


def test_a_target_and_moves_are_two_things() -> None:
    with pytest.raises(lm.InputError, match="target and moves"):
        lm.PositionReference(target=FLY_BY | {"axis": "traverse"}, moves=[{"to": 1.0}], speed=1.0, acceleration=1.0)


def test_an_axis_follows_a_target() -> None:
    axis = lm.load("position-axis-load-encoder")
    controller = axis.controller.model_dump(exclude_none=True)
    controller["reference"] = {"kind": "position", "target": FLY_BY | {"axis": "traverse", "crossing_time": 3.0, "duration": 6.0}}
    controller["inverse_model"] = {"twist_rate": 0.5}
    start = lm.PositionReference(**controller["reference"]).at(0.0)
    s = axis.replace(
        controller=controller,
        **{"simulation.duration": 6.0, "initial.load_angle": float(start[0]), "initial.load_speed": float(start[1]),
           "initial.motor_speed": 90.0 * float(start[1])},
    )  # fmt: skip
    r = lm.simulate(s)
    error = r.load_angle.values - s.controller.reference.at(r.time.values)[0]
    late = (r.time.values > 1.0) & (r.time.values < 5.9)
    assert np.abs(error[late]).max() < 1e-4


@pytest.mark.parametrize("speed", [3e4, 1e7, 1e12, 1e200])
def test_a_path_too_fast_to_follow_is_refused_before_memory_is_taken(speed: float) -> None:
    import tracemalloc

    tracemalloc.start()
    try:
        with np.errstate(all="ignore"), pytest.raises(ValueError, match="more than 2000000 pieces over 60 s; lower its speed"):
            reference(FLY_BY, "traverse", distance=100.0, speed=speed).target.breakpoints()
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()
