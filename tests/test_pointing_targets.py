"""Targets in space as references: closed forms, differences, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_discrete_are
from scipy.signal import periodogram
from scipy.special import gamma
from scipy.stats import kstest

import lostmotion as lm
from refusals import refusals_of, refused

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


@pytest.mark.parametrize(("change", "said"), [
    ({"axis": "azimuth"}, "traverse"),
    ({"distance": "500 kg"}, "distance"),
    ({"speed": -3.0}, "speed"),
    ({"path": "loop"}, "fly_by"),
    ({"path": "weave", "width": 600.0, "frequency": 1.0}, "not less than its distance"),
    (TRACK | {"x": (0.0,)}, "lists of different length"),
    (TRACK | {"duration": 90.0}, "must cover"),
    (CIRCLE | {"distance": 300.0}, "passes over the station"),
])  # fmt: skip
def test_what_does_not_fit_is_refused(change: dict[str, Any], said: str) -> None:
    base = FLY_BY if change.get("path", "fly_by") in ("fly_by", "weave", "loop") else {}
    refused(lambda: reference(base | change, change.get("axis", "traverse")), match=said)


def test_a_target_and_moves_are_two_things() -> None:
    refused(
        lambda: lm.PositionReference(target=FLY_BY | {"axis": "traverse"}, moves=[{"to": 1.0}], speed=1.0, acceleration=1.0),
        reason="target and moves",
    )


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


# --- wind as a torque ---
ON_AREA: dict[str, Any] = {"speed": 12.0, "drag_coefficient": 1.3, "area": 2.0, "lever": 0.4, "duration": 100.0, "max_frequency": 4.0}
WINDS: dict[str, dict[str, Any]] = {
    "davenport": ON_AREA | {"kind": "davenport", "surface_drag": 0.008},
    "von_karman": ON_AREA | {"kind": "von_karman", "turbulence": 0.18, "length_scale": 90.0},
    "kaimal": ON_AREA | {"kind": "kaimal", "height": 15.0},
    "table": {
        "kind": "table", "frequencies": (0.02, 0.3, 5.0), "densities": ("3 N^2*m^2/Hz", 2.0, 0.01), "duration": 100.0, "max_frequency": 4.0,
    },
}  # fmt: skip
PER_GUST = 1.225 * 1.3 * 2.0 * 0.4 * 12.0
"""rho c A r V [N m s/m]: torque for a gust of 1 m/s"""


def wind(name: str, **change: Any) -> Any:
    return lm.TorqueSignal(wind=WINDS[name] | change).wind


def test_the_spectra_hold_the_variance_of_their_closed_forms() -> None:
    # Of (u*)^2 = K V^2 Davenport's has 6; Kaimal's 105/33 3/2; of sigma^2 von Karman's 4 sqrt(pi/70.8)/2 Gamma(1/3)/Gamma(5/6).
    wanted = {
        "davenport": 6.0 * 0.008 * 12.0**2,
        "kaimal": 105.0 / 22.0 * (0.4 * 12.0 / np.log(15.0 / 0.03)) ** 2,
        "von_karman": (0.18 * 12.0) ** 2 * 2.0 * np.sqrt(np.pi / 70.8) * gamma(1.0 / 3.0) / gamma(5.0 / 6.0),
    }
    for name, variance in wanted.items():
        w = wind(name)
        found = quad(lambda u: w.spectrum(np.array([np.exp(u)]))[0] * np.exp(u), -25.0, 40.0, limit=500)[0]  # noqa: B023
        assert found == pytest.approx(variance * PER_GUST**2, rel=1e-5), name


def test_a_table_is_a_power_law_between_its_points() -> None:
    w = wind("table")
    assert w.spectrum(np.array([0.02, 0.3, 5.0])) == pytest.approx([3.0, 2.0, 0.01])
    assert w.spectrum(np.array([np.sqrt(0.02 * 0.3)]))[0] == pytest.approx(np.sqrt(6.0))
    assert (w.spectrum(np.array([0.0199, 5.01])) == 0.0).all()


@pytest.mark.parametrize("name", WINDS)
def test_the_periodogram_of_a_run_is_the_spectrum(name: str) -> None:
    w = wind(name)
    time, torque = w.samples()
    step = time[1]
    r = lm.simulate(
        lm.Scenario(
            shafts={"dish": {"inertia": 40.0, "viscous_friction": 30.0, "torque": {"wind": WINDS[name]}}},
            simulation={"duration": 100.0, "sample_interval": step},
        ),
        energy=False,
    )
    given = r["dish_load_torque"].values
    np.testing.assert_allclose(given, torque, rtol=0.0, atol=1e-10 * np.abs(torque).max())
    f, density = periodogram(given[:-1], 1.0 / step)
    lines = w.lines()
    assert f[1 : lines.size + 1] == pytest.approx(lines)
    np.testing.assert_allclose(density[1 : lines.size + 1], w.spectrum(lines), rtol=1e-8, atol=1e-12)
    assert density[lines.size + 1 :].max() < 1e-12 * density.max()
    assert np.var(given[:-1]) == pytest.approx(w.spectrum(lines).sum() / 100.0, rel=1e-9)
    whole = quad(lambda x: w.spectrum(np.array([x]))[0], 0.5 / 100.0, lines[-1] + 0.5 / 100.0, limit=300)[0]
    assert np.var(given[:-1]) == pytest.approx(whole, rel=0.03)  # the midpoint rule where the spectrum is steepest
    mean = 0.0 if name == "table" else 0.5 * PER_GUST * 12.0
    assert given[:-1].mean() == pytest.approx(mean, abs=1e-9)


def test_a_load_is_shaken_as_its_frequency_response_says() -> None:
    # J w' + b w = -M: each line of the wind by 1/(b + i 2 pi f J), after the transient exp(-t b/J), b/J = 2 1/s.
    J, b, w = 15.0, 30.0, wind("von_karman")
    s = lm.Scenario(
        shafts={"dish": {"inertia": J, "viscous_friction": b, "torque": {"wind": WINDS["von_karman"]}}},
        simulation={"duration": 100.0, "sample_interval": 0.02},
    )
    speed = lm.simulate(s, energy=False)["dish_speed"].values[1000:]
    f = w.lines()
    variance = np.sum(w.spectrum(f) / 100.0 / (b**2 + (2.0 * np.pi * f * J) ** 2))
    assert np.var(speed) == pytest.approx(variance, rel=0.25)  # 80 of the 100 s that the slowest line takes
    time, torque = w.samples()
    phases = np.fft.rfft(torque[:-1])[1 : f.size + 1] / (0.5 * (time.size - 1))
    at = np.arange(1000, 5001) * 0.02
    steady = -np.real(np.exp(2j * np.pi * np.outer(at, f)) @ (phases / (b + 2j * np.pi * f * J))) - w.mean() / b
    # Chords between the points leave (pi/16)^2/2 of the fastest line, which hardly moves the load.
    assert np.abs(speed - steady).max() < 1e-3 * np.ptp(steady)


def test_a_seed_is_a_wind_and_a_longer_spectrum_keeps_its_phases() -> None:
    one, same, other = (wind("kaimal", seed=k).samples()[1] for k in (7, 7, 8))
    np.testing.assert_array_equal(one, same)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.5
    long = wind("kaimal", seed=7, max_frequency=8.0)
    assert np.fft.rfft(long.samples()[1][:-1])[3] * one.size / long.samples()[1].size == pytest.approx(np.fft.rfft(one[:-1])[3], rel=2e-3)


def test_a_wind_turns_around_with_its_signal() -> None:
    signal = lm.TorqueSignal(wind=WINDS["kaimal"], mean=2.0)
    forth, back = signal.breakpoint_list(), signal.mirrored().breakpoint_list()
    np.testing.assert_array_equal(np.array(forth) * [1.0, -1.0, -1.0], np.array(back))
    assert lm.TorqueSignal.model_validate_json(signal.model_dump_json()) == signal


test_what_does_not_fit_a_wind_is_refused = refusals_of(
    lambda name, change: wind(name, **change),
    ("kaimal", {"roughness_length": 20.0}, "wind: roughness_length"),
    ("kaimal", {"max_frequency": 1e4}, "wind: more than"),
    ("kaimal", {"max_frequency": 1e-3}, "wind: no line"),
    ("kaimal", {"kind": "breeze"}, "wind: davenport"),
    ("table", {"densities": (1.0, 2.0)}, "wind: as many of each"),
    ("table", {"frequencies": (0.1, 0.1, 1.0)}, "wind: rise"),
    ("table", {"densities": ("1 N*m", 1.0, 1.0)}, "wind.densities[0]"),
    ("von_karman", {"turbulence": 1.5}, "wind.turbulence"),
    ("davenport", {"area": "2 m"}, "wind.area"),
)


# --- A camera in the loop and the tracker of its frames ---
T = 1e-3
LAST = slice(-200, -1)  # where the tracker has settled; the tick at the very end is no part of the run


def scenario(reference: dict[str, Any], camera: dict[str, Any], tracker: dict[str, Any], **more: Any) -> lm.Scenario:
    """A shaft that its motor turns directly, under a cascade that hardly matters: the camera sits on it."""
    encoder = more.pop("encoder", {"ideal": True})
    return lm.Scenario(
        shafts={"table": {"inertia": 1e-3}},
        motors={"m": {"shaft": "table", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 1.0}},
        controllers={
            "m": {
                "sample_time": T,
                "encoder": encoder,
                "reference": {"kind": "position"} | reference,
                "position": {"gain": 20.0},
                "speed": {"gain": 0.2, "estimate": {"kind": "exact"}},
                "camera": {"sample_time": T} | camera,
                "tracker": tracker,
            }
        },
        simulation={"duration": more.pop("duration", 2.0), "sample_interval": T},
        **more,
    )


def expected(s: lm.Scenario) -> tuple[np.ndarray, np.ndarray]:
    """The angles that the tracker expects at the ticks [rad], and those of the target."""
    r = lm.simulate(s, energy=False)
    return r["m_position_reference"].values, s.controllers["m"].reference.at(r.time.values)[0]


RAMP = {"ramps": [{"rise": 1.0, "duration": 4.0}]}


@pytest.mark.parametrize("latency", [0.0, 7e-3, 40e-3])
def test_a_latency_costs_speed_times_latency_unless_it_is_predicted(latency: float) -> None:
    omega = 0.25
    late, target = expected(scenario(RAMP, {"latency": latency}, {"alpha": 1.0, "beta": 1.0, "prediction": False}))
    np.testing.assert_allclose((target - late)[LAST], omega * latency, rtol=0.0, atol=1e-12)
    ahead, _ = expected(scenario(RAMP, {"latency": latency}, {"alpha": 1.0, "beta": 1.0}))
    np.testing.assert_allclose((target - ahead)[LAST], 0.0, atol=1e-12)


@pytest.mark.parametrize("gains", [(1.0, 1.0), (0.6, 0.4), (0.3, 0.05)])
@pytest.mark.parametrize("latency", [0.0, 20e-3, 50e-3])
def test_with_alpha_and_beta_an_acceleration_costs_what_the_closed_form_says(gains: tuple[float, float], latency: float) -> None:
    # Steady errors after a frame: angle a T^2 (1 - alpha)/beta, rate a T (2 alpha - beta)/(2 beta); then a straight line for the latency.
    a, (alpha, beta) = 0.8, gains
    reference = {"speed": 100.0, "acceleration": a, "moves": [{"to": 30.0}]}
    found, target = expected(scenario(reference, {"latency": latency}, {"alpha": alpha, "beta": beta}))
    angle, rate = a * T**2 * (1.0 - alpha) / beta, a * T * (2.0 * alpha - beta) / (2.0 * beta)
    np.testing.assert_allclose((target - found)[LAST], angle + rate * latency + a * latency**2 / 2.0, rtol=0.0, atol=1e-11)
    if gains == (1.0, 1.0) and latency > 0.0:
        assert (target - found)[-2] == pytest.approx(a * latency**2 / 2.0, rel=1.01 * T / latency)
    third, _ = expected(scenario(reference, {"latency": latency}, {"alpha": 0.6, "beta": 0.4, "gamma": 0.1}))
    np.testing.assert_allclose((target - third)[LAST], 0.0, atol=1e-10)


def response_to_one_frame(tracker: dict[str, Any]) -> np.ndarray:
    """The estimate of a target that jumps by 1, frame by frame: the sum of the responses to single frames."""
    found, _ = expected(scenario({"steps": [{"height": 1.0, "time": 0.1 - 0.4 * T}]}, {}, tracker, duration=4.0))
    return np.diff(found[:-1])


@pytest.mark.parametrize(("alpha", "beta"), [(0.5, 0.2), (0.2, 0.02), (0.9, 0.9)])
def test_alpha_and_beta_reduce_noise_by_the_closed_form(alpha: float, beta: float) -> None:
    ratio = (2.0 * alpha**2 + beta * (2.0 - 3.0 * alpha)) / (alpha * (4.0 - 2.0 * alpha - beta))
    assert np.sum(response_to_one_frame({"alpha": alpha, "beta": beta}) ** 2) == pytest.approx(ratio, rel=1e-9)


@pytest.mark.parametrize(("alpha", "beta", "gamma"), [(0.5, 0.2, 0.04), (0.3, 0.06, 0.01), (0.8, 0.6, 0.2)])
def test_alpha_beta_and_gamma_reduce_noise_by_the_closed_form(alpha: float, beta: float, gamma: float) -> None:
    g = gamma / 2.0  # in the form of the closed formula, with gains alpha, beta/T and gamma/(2 T^2)
    above = 2.0 * beta * (2.0 * alpha**2 + 2.0 * beta - 3.0 * alpha * beta) - alpha * g * (4.0 - 2.0 * alpha - beta)
    below = (4.0 - 2.0 * alpha - beta) * (2.0 * alpha * beta + alpha * g - 2.0 * g)
    tracker = {"alpha": alpha, "beta": beta, "gamma": gamma}
    assert np.sum(response_to_one_frame(tracker) ** 2) == pytest.approx(above / below, rel=1e-9)


@pytest.mark.parametrize("index", [1e-3, 0.1, 3.0])
def test_the_tracking_index_gives_the_gains_of_the_kalman_filter(index: float) -> None:
    # Acceleration constant within each frame, white from frame to frame, of deviation index; noise of deviation 1; T = 1.
    F, G = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[0.5], [1.0]])
    P = solve_discrete_are(F.T, np.array([[1.0], [0.0]]), index**2 * G @ G.T, np.eye(1))
    K = P[:, 0] / (P[0, 0] + 1.0)
    assert lm.control.Tracker(tracking_index=index).gains()[:2] == pytest.approx(K, rel=1e-9)


def test_the_noise_is_white_and_normal() -> None:
    sigma = 1e-4
    r = lm.simulate(scenario({}, {"noise": sigma, "seed": 5}, {"alpha": 0.2, "beta": 0.02}, duration=20.0), energy=False)
    noise = r["m_target_direction"].values[:-1] / sigma  # the encoder adds what the table has turned, which the target is beside it by
    n = len(noise)
    assert kstest(noise, "norm").pvalue > 1e-3
    assert abs(noise.mean()) < 4.0 / math.sqrt(n)
    assert noise.var() == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / n))
    for lag in (1, 2, 7):
        assert abs(np.mean(noise[lag:] * noise[:-lag])) < 4.0 / math.sqrt(n)


def test_seed_and_name_of_the_motor_make_the_noise() -> None:
    def noise(**camera: Any) -> np.ndarray:
        s = scenario({}, {"noise": 1e-4} | camera, {"alpha": 0.2, "beta": 0.02})
        return lm.simulate(s, energy=False)["m_target_direction"].values

    np.testing.assert_array_equal(noise(seed=1), noise(seed=1))
    assert np.abs(np.corrcoef(noise(seed=1), noise(seed=2))[0, 1]) < 0.1
    both = lm.load("direction-finder", {"simulation.duration": 0.2})
    data = both.model_dump(exclude_none=True)
    for c in data["controllers"].values():
        c |= {"camera": {"sample_time": T, "noise": 1.0, "seed": 3}, "tracker": {"alpha": 1e-6, "beta": 0.0}}
    r = lm.simulate(type(both)(**data), energy=False)
    one, other = (r[f"{axis}_drive_target_direction"].values for axis in ("traverse", "elevation"))
    assert np.abs(np.corrcoef(one, other)[0, 1]) < 0.3


def test_a_frame_shows_whole_pixels_or_parts_of_them() -> None:
    pixel = 2e-3
    s = scenario({"amplitude": 0.3, "frequency": 1.0}, {"pixel": pixel, "pixel_parts": 4}, {"alpha": 0.8, "beta": 0.4})
    r = lm.simulate(s, energy=False)
    target = s.controllers["m"].reference.at(r.time.values)[0]
    offset = target - r["table_angle"].values
    seen = r["m_target_direction"].values - r["table_angle"].values
    np.testing.assert_allclose(seen[:-1], pixel / 4.0 * np.floor(offset / (pixel / 4.0) + 0.5)[:-1], rtol=0.0, atol=1e-12)
    assert np.abs(offset).max() > 4.0 * pixel


def test_a_target_out_of_view_is_expected_to_go_straight_on() -> None:
    # It turns back at 1 s faster than the axis, which then looks where it would have been.
    ramps = [{"rise": 0.5, "duration": 1.0}, {"rise": -20.0, "duration": 1.0, "begin": 1.0}]
    tracker = {"alpha": 1.0, "beta": 1.0}
    r = lm.simulate(scenario({"ramps": ramps}, {"sample_time": 0.01, "field": 0.1}, tracker), energy=False)
    seen = r["m_target_seen"].values
    lost = int(np.argmin(seen[100:])) + 100
    t = r.time.values
    assert 1.0 < t[lost] < 1.02
    assert not seen[lost:-1].any()
    speed = np.diff(r["m_position_reference"].values[lost:-1]) / T
    np.testing.assert_allclose(speed, speed[0], rtol=1e-9)
    assert (r["m_target_direction"].values[lost:-1] == r["m_target_direction"].values[lost]).all()


def test_the_camera_makes_good_what_an_encoder_on_the_motor_does_not_see() -> None:
    """It turns with the load: the twist that the encoder leaves out is in its offset, too, and the load points at the target."""
    axis = lm.load("tracking-loss-map", {"simulation.duration": 3.0})
    c = axis.controller.model_dump(exclude_none=True)
    c.pop("position_encoder")
    c |= {"encoder": {"ideal": True}, "inverse_model": None, "reference": {"kind": "position", "ramps": [{"rise": 0.9, "duration": 3.0}]}}
    blind = axis.replace(controller=c, initial={})
    sees = blind.replace(controller=c | {"camera": {"sample_time": 5e-3}, "tracker": {"alpha": 0.3, "beta": 0.05}})

    def missed(s: lm.Scenario) -> float:
        r = lm.simulate(s, energy=False)
        error = s.controller.reference.at(r.time.values)[0] - r.load_angle.values
        return float(np.abs(error[(r.time.values > 2.0) & (r.time.values < 2.9)].mean()))

    assert missed(sees) < 0.1 * missed(blind)


def noisy() -> lm.Scenario:
    axis = lm.load("tracking-loss-map", {"simulation.duration": 1.0})
    camera = {"sample_time": "20 ms", "latency": "50 ms", "noise": "0.05 mrad", "field": "5 deg", "seed": 7}
    c = axis.controller.model_dump(exclude_none=True) | {"camera": camera, "tracker": {"alpha": 0.5, "beta": 0.2, "gamma": 0.02}}
    c |= {"encoder": {"ideal": True}, "position_encoder": {"ideal": True, "shaft": "load"}}  # whose steps rounding decides
    return axis.replace(controller=c)


def test_both_solvers_see_the_same() -> None:
    exact = lm.simulate(noisy(), energy=False)
    adaptive = lm.simulate(noisy(), energy=False, solver="dormand-prince", relative_tolerance=1e-11)
    for name in ("load_angle", "motor_speed", "target_direction", "position_reference"):
        gap = np.abs(exact[name].values - adaptive[name].values).max()
        assert gap < 1e-7 * np.abs(exact[name].values).max(), name


def test_a_state_holds_the_frames_that_are_on_their_way() -> None:
    s = noisy()
    one, other = lm.Simulation(s, step=1e-3), lm.Simulation(s, step=1e-3)
    for _ in range(233):
        one.advance(1.3e-3)
    state = one.state
    other.state = state
    for _ in range(200):
        one.advance(1.3e-3)
        other.advance(1.3e-3)
    assert one.state.values == other.state.values
    assert one.read() == other.read()


@pytest.mark.parametrize(("change", "said"), [
    ({"tracker": None}, "belong together"),
    ({"camera": None}, "belong together"),
    ({"camera": {"sample_time": 1.5e-4}}, "camera.sample_time: 0.00015 s is no whole multiple"),
    ({"camera": {"sample_time": 1e-3, "latency": 1e-4}}, "camera.latency: 0.0001 s is no whole multiple"),
    ({"camera": {"sample_time": 1e-3, "noise": -1.0}}, "noise"),
    ({"camera": {"sample_time": 1e-3, "seed": 0.5}}, "seed"),
    ({"camera": {"sample_time": 1e-3, "pixel_parts": 3}}, "no pixel"),
    ({"camera": {"sample_time": 1e-3, "pixel": 0.2, "field": 0.1}}, "more than its field"),
    ({"tracker": {"alpha": 0.5}}, "lacks beta"),
    ({"tracker": {"alpha": 1.5, "beta": 1.5}}, "its errors grow"),
    ({"tracker": {"alpha": 0.1, "beta": 0.01, "gamma": 0.1}}, "its errors grow"),
    ({"tracker": {"tracking_index": 0.1, "beta": 0.1}}, "give one of them"),
    ({"reference": {"kind": "speed"}, "position": None}, "reference of the speed"),
])  # fmt: skip
def test_what_does_not_fit_a_camera_is_refused(change: dict[str, Any], said: str) -> None:
    s = noisy()
    c = {k: v for k, v in (s.controller.model_dump(exclude_none=True) | change).items() if v is not None}
    if "position" not in c:
        c.pop("position_encoder")
    refused(lambda: s.replace(controller=c), match=said)
