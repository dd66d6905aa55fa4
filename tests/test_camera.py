"""A camera in the loop and the tracker of its frames: closed forms of latency and noise, what a frame shows, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.stats import kstest

import lostmotion as lm
from refusals import refused

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
    """What the tracker expects at the ticks [rad], and where the target is."""
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
    """What the tracker makes of a target that jumps by 1, frame by frame: the sum of its responses to single frames."""
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


@pytest.mark.parametrize(
    ("change", "said"),
    [
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
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], said: str) -> None:
    s = noisy()
    c = {k: v for k, v in (s.controller.model_dump(exclude_none=True) | change).items() if v is not None}
    if "position" not in c:
        c.pop("position_encoder")
    refused(lambda: s.replace(controller=c), match=said)
