"""The filter of a controller's reference: closed forms at its samples, in both written forms, and in the linear sampled loops."""

import ctypes as c
import math

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.servo.linear_regimes import axis_of, regimes
from lostmotion.servo.linear_sampled_loop import LinearLoop
from refusals import refusals
from test_c_interface import OK, library  # noqa: F401
from test_description import Scenario

TAU, T = 0.02, 1e-3
FILTER = {"time_constant": f"{TAU} s"}


def axis(**changes: object) -> lm.Scenario:
    """A rest of 1 rad that the reference asks for from the start on, all loops at one sample time."""
    return lm.load("position-axis").replace(
        **{
            "controller.sample_time": T,
            "controller.position.sample_time": None,
            "controller.reference": {"kind": "position", "mean": 0.01},
            "controller.encoder": {"ideal": True},
            "controller.reference_filter": FILTER,
            "simulation.duration": 0.2,
            "simulation.sample_interval": T,
            **changes,
        }
    )


def test_a_step_of_the_reference_is_that_of_a_first_order_lag_at_each_sample() -> None:
    short = axis()
    for scenario, prefix in ((short, ""), (short.long(), "motor_")):
        result = lm.simulate(scenario)
        shown = result[f"{prefix}position_reference"].values
        assert shown == pytest.approx(0.01 * (1.0 - np.exp(-result.time.values / TAU)), abs=1e-16)


def test_the_loops_are_fed_forward_with_the_slope_of_the_lag() -> None:
    result = lm.simulate(axis())
    wanted, position = result.position_reference.values, result.measured_position.values
    speed = 90.0 * (10.0 * (wanted - position) + (0.01 - wanted) / TAU)
    assert result.speed_reference.values == pytest.approx(speed, abs=1e-12)


def test_it_begins_where_the_axis_is() -> None:
    result = lm.simulate(axis(**{"initial.load_angle": 0.004}))
    assert result.position_reference.values[0] == pytest.approx(0.004, abs=1e-15)
    speed = {"kind": "speed", "mean": 2.0}
    begun = axis(**{"controller.reference": speed, "controller.position": None, "initial.load_speed": 0.5, "initial.motor_speed": 45.0})
    result = lm.simulate(begun)
    lag = 90.0 * (2.0 - 1.5 * np.exp(-result.time.values / TAU))
    assert result.speed_reference.values == pytest.approx(lag, rel=1e-12)


test_what_cannot_be_is_refused = refusals(
    (lambda: axis(**{"controller.position.reference_delay": 5.0 * T}), "controller: reference_delay"),
    (lambda: axis(**{"controller.reference_filter": {}}), "controller.reference_filter.time_constant"),
    (lambda: axis(**{"controller.reference_filter": {"time_constant": 0.0}}), "controller.reference_filter.time_constant: must be greater than 0"),
)  # fmt: skip


def test_the_linear_loops_have_it_before_the_outermost_loop_alone() -> None:
    with_filter, without = (
        axis_of(axis(**{"controller.position.feedforward": 0.0, "controller.reference_filter": f})) for f in (FILTER, None)
    )
    frequency = np.array([1.0, 5.0, 20.0])
    z, a = np.exp(2j * math.pi * frequency * T), math.exp(-T / TAU)
    for loop, factor in (("position", (1.0 - a) / (z - a)), ("speed", 1.0)):
        one, other = (LinearLoop(of, regimes(of)[0], loop, cut=False) for of in (with_filter, without))
        assert one.response(frequency) == pytest.approx(factor * other.response(frequency), rel=1e-9)


def test_its_derivative_by_the_time_constant_is_that_of_the_closed_form() -> None:
    key = "controller.reference_filter.time_constant"
    result = lm.simulate(axis(**{"controller.current": {"kind": "first_order", "time_constant": "1 ms"}}), sensitivities=[key])
    t = result.time.values
    by_tau = result.position_reference_sensitivity.sel(parameter=key).values
    assert by_tau == pytest.approx(-0.01 * t / TAU**2 * np.exp(-t / TAU), abs=1e-9)


def test_programs_without_python_run_and_change_it(library: c.CDLL) -> None:  # noqa: F811
    there = Scenario(library, lm.portable.description(axis()))
    assert there.set("controller.reference_filter.time_constant", 0.05) == OK
    here = lm.simulate(axis(**{"controller.reference_filter": {"time_constant": 0.05}}))
    assert np.array_equal(there.run()["position_reference"], here.position_reference.values)
