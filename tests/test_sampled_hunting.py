"""The certificate of hunting of sampled controllers: its sets of states against the recurrence of a rotor, and what it refuses."""

import math
import random
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.servo.hunting.quantised_slip_end import loudest
from lostmotion.servo.hunting.sampled_proof import Readings, end_of_slip
from lostmotion.servo.hunting.sampled_stuck_contact import sampled_slip
from lostmotion.servo.linear_regimes import axis_of
from refusals import refused

INERTIA, SLIDING, TICK = 0.5, 2.0, 1e-3
K_V, K_P, K_I = 5.0, 20.0, 40.0
STUCK = 8  # ticks after which the controller has settled


def rotor(breakaway: float, step: float, **changes: Any) -> lm.Scenario:
    """A rotor on its own with dry friction under a cascade; changes by the dotted key with / in place of dots."""
    encoder = {"resolution": step} if step else {"ideal": True}
    scenario = lm.Scenario(
        shafts={"rotor": {"friction_torque": SLIDING, "breakaway_torque": breakaway}},
        motors={"m": {"kind": "torque_source", "shaft": "rotor", "rotor_inertia": INERTIA, "rated_torque": 10.0}},
        controllers={
            "m": {
                "sample_time": TICK,
                "encoder": encoder,
                "reference": {"kind": "position", "steps": [{"time": 0.1, "height": 0.2}]},
                "position": {"gain": K_V},
                "speed": {"gain": K_P, "integral_gain": K_I},
            }
        },
        simulation={"duration": 20.0, "sample_interval": 1e-3},
    )
    return scenario.replace(**{key.replace("/", "."): value for key, value in changes.items()})


def slip_by_hand(error: float, breakaway: float, step: float, within: float, late: float) -> float:
    """Error that is left by a slip from a reading, until the rotor has been stuck for some samples.

    The angle is off the middle of its step by a share `within` of a step, and the torque at the break-away by a share `late` of its
    rise in a sample: torque of a sample later, I + k_p (k_v e - w), I += T k_i (k_v e - w), e and w by the readings.
    """
    angle, speed, read = -error + within * step, 0.0, -error
    rise = TICK * K_I * K_V * error
    acts = breakaway + late * rise
    asked = acts + rise
    integral = asked + rise - K_P * K_V * error
    way, stuck = 1.0, 0
    while stuck < STUCK:
        if way != 0.0:
            rate = (acts - way * SLIDING) / INERTIA
            after = speed + rate * TICK
            if way * after <= 0.0 and way * rate < 0.0:
                angle, speed, way, stuck = angle - 0.5 * speed**2 / rate, 0.0, 0.0, 0
            else:
                angle, speed = angle + TICK * (speed + 0.5 * rate * TICK), after
        else:
            stuck += 1
        seen = step * math.floor(angle / step + 0.5) if step else angle
        wanted = -K_V * seen - (seen - read) / TICK
        read, acts = seen, asked
        asked = integral + K_P * wanted
        integral += TICK * K_I * wanted
        if way == 0.0 and abs(acts) >= breakaway:
            way, stuck = math.copysign(1.0, acts), 0
    return -angle


@pytest.mark.parametrize("breakaway", [2.6, 3.0, 4.0])
def test_without_steps_the_error_after_a_slip_is_that_of_the_recurrence(breakaway: float) -> None:
    of = sampled_slip(axis_of(rotor(breakaway, 0.0)))
    for error in (1e-3, 3e-3):
        low, high = end_of_slip(of, error, error)
        ends = [slip_by_hand(error, breakaway, 0.0, 0.0, late) for late in (0.0, 0.3, 0.9999)]
        assert low - 1e-12 <= min(ends) <= max(ends) <= high + 1e-12
        assert high - low < 1e-4


def test_with_steps_each_recurrence_ends_within_the_bounds() -> None:
    step, rng = 1e-5, random.Random(5)
    of = sampled_slip(axis_of(rotor(3.0, step)))
    fast = loudest(of)
    for low, high in ((1.5e-3, 1.6e-3), (4e-3, 4.2e-3)):
        least, most = end_of_slip(of, low, high, cells=4, fast=fast)
        ends = []
        for _ in range(60):
            error = step * round(rng.uniform(low, high) / step)
            ends.append(slip_by_hand(error, 3.0, step, rng.uniform(-0.5, 0.5), rng.random()))
        assert least <= min(ends) <= max(ends) <= most
        assert most - least < 3.0 * (max(ends) - min(ends)) + 10.0 * step


@pytest.mark.parametrize(("step", "counts", "bounded"), [(2e-4, (1, 6), False), (1e-5, (20, 150), True)])
def test_each_recurrence_from_a_reading_leaves_one_of_the_errors_that_are_found(
    step: float, counts: tuple[int, ...], bounded: bool
) -> None:
    rng, slips = random.Random(7), Readings(sampled_slip(axis_of(rotor(3.0, step))))
    for count in counts:
        found = slips.left(count, bounded=bounded)
        starts = [(rng.uniform(-0.5, 0.5), rng.random()) for _ in range(60)]
        ends = {-math.floor(0.5 - slip_by_hand(count * step, 3.0, step, *one) / step) for one in starts}
        assert ends <= found
        assert max(found) - min(found) <= max(ends) - min(ends) + (20 if bounded else 1)


def test_the_recurrence_stays_within_the_readings_of_a_limit_cycle() -> None:
    step = 2e-5
    certificate = lm.hunting_certificate(rotor(3.0, step))
    assert certificate.verdict == "hunts"
    assert certificate.band is not None
    low, high = certificate.band
    assert high - low < 8.0 * step
    error = 0.5 * (low + high)
    for _ in range(10):
        error = abs(step * round(slip_by_hand(step * round(error / step), 3.0, step, 0.3, 0.7) / step))
        assert low < error < high


def test_from_the_last_readings_the_recurrence_comes_to_rest_at_the_reference() -> None:
    step, rng = 1e-5, random.Random(6)
    certificate = lm.hunting_certificate(rotor(SLIDING, step))
    assert certificate.verdict == "does not hunt"
    assert certificate.largest_error == pytest.approx(3.5 * step)
    assert abs(certificate.reached) <= certificate.largest_error
    for count in (1, 2, 3):
        for _ in range(10):
            left = slip_by_hand(count * step, SLIDING, step, rng.uniform(-0.5, 0.5), rng.uniform(0.01, 1.0))
            assert abs(round(left / step)) < count


def test_an_excess_of_static_friction_hunts_within_a_band() -> None:
    certificate = lm.hunting_certificate(rotor(3.0, 1e-5))
    assert certificate.verdict == "hunts"
    assert certificate.band is not None
    low, high = certificate.band
    error, sizes = 0.5 * (low + high), []
    for _ in range(20):
        error = abs(slip_by_hand(1e-5 * round(error / 1e-5), 3.0, 1e-5, 0.2, 0.5))
        sizes.append(error)
    assert low < min(sizes) < max(sizes) < high
    assert certificate.map is not None
    assert certificate.map["image"].values == pytest.approx(
        [slip_by_hand(float(e), 3.0, 0.0, 0.0, 0.5) for e in certificate.map["error"].values], abs=2e-5
    )


def test_a_reference_between_two_steps_is_never_reached() -> None:
    """0.2 rad are 1000.5 steps: the error is never below half a step, and the integrator frees the rotor again and again."""
    step = 0.2 / 1000.5
    certificate = lm.hunting_certificate(rotor(SLIDING, step))
    assert certificate.verdict == "hunts"
    assert "no reading of the encoder is the reference" in repr(certificate)
    run = lm.simulate(rotor(SLIDING, step, **{"simulation/duration": 600.0, "simulation/sample_interval": 0.1}))
    late = run["rotor_angle"].values[run["time"].values > 100.0]
    assert np.ptp(late) > 0.01 * step


@pytest.mark.parametrize(("bits", "count"), [(19, 11562), (17, 2999), (20, 77771), (13, 333)])
def test_a_reference_that_is_a_reading_to_rounding_is_one(bits: int, count: int) -> None:
    """count * step / step may differ from count in the last bit, which winds up no integrator."""
    step = 2.0 * math.pi / 2**bits
    height = {"controllers/m/reference/steps": [{"time": 0.1, "height": count * step}]}
    contact = sampled_slip(axis_of(rotor(SLIDING, step, **height)))
    assert contact.offset == 0.0
    assert sampled_slip(
        axis_of(rotor(SLIDING, step, **{"controllers/m/reference/steps": [{"time": 0.1, "height": (count + 1e-6) * step}]}))
    ).offset == pytest.approx(1e-6, rel=1e-3)


@pytest.mark.parametrize(("changes", "verdict", "reason"), [
    ({"controllers/m/speed/integral_gain": 0.0}, "does not hunt", "no integrator winds up"),
    ({"controllers/m/speed/torque_limit": 1.9}, "does not hunt", "limit of the controller is below"),
    ({"shafts/rotor/stribeck_speed": 0.1, "shafts/rotor/breakaway_torque": 3.0}, "not decided", "friction of rotor that varies"),
    ({"controllers/m/position_encoder": {"resolution": 1e-5}}, "not decided", "a position_encoder (give one encoder to both"),
    ({"controllers/m/position": {"gain": K_V, "integral_gain": 1.0, "dead_zone": [1e-4, 2e-4]}}, "not decided", "a dead zone of the integrator"),
    ({"controllers/m/position/integral_gain": 1.0}, "not decided", "does not wind up in proportion to the error"),
])  # fmt: skip
def test_reasons_of_a_sampled_axis_are_named(changes: dict[str, Any], verdict: str, reason: str) -> None:
    certificate = lm.hunting_certificate(rotor(SLIDING, 1e-5, **changes))
    assert certificate.verdict == verdict
    assert reason in certificate.reason


def test_losses_that_grow_with_the_load_alone_are_no_constant_friction() -> None:
    axis = {
        "motor": {"kind": "torque_source", "rotor_inertia": 2e-4, "rated_torque": 3.0},
        "belt": {"travel_per_turn": 0.07, "efficiency": 0.8, "stiffness": 1e6, "damping": 1e3},
        "slide": {"mass": 40.0},
    }
    controller = {
        "sample_time": 5e-4,
        "encoder": {"bits": 20},
        "reference": {"kind": "position", "speed": 0.2, "acceleration": 2.0, "moves": [{"to": 0.005}]},
        "position": {"gain": 20.0},
        "speed": {"gain": 0.05, "integral_time": 0.05},
    }
    scenario = lm.Scenario(axis=axis, controller=controller, simulation={"duration": 0.1, "sample_interval": 0.01})
    certificate = lm.hunting_certificate(scenario)
    assert certificate.verdict == "not decided"
    assert "motor_contact grows with the load alone" in certificate.reason
    several = lm.load("direction-finder")
    refused(lambda: lm.hunting_certificate(several), "motor", reason="there are several controllers")
    assert {lm.hunting_certificate(several, motor=motor).verdict for motor in several.axes()} == {"not decided"}
    report = lm.commission(rotor(3.0, 1e-5, **{"simulation/duration": 2.0}))
    assert report.certificate.verdict == "hunts"
    assert ("certificate", "hunts") in report.summary()
