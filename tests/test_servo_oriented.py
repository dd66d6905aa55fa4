"""The servo report of an axis under field-oriented control: closed forms at rest, and small sines through the whole core at speed."""

import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.servo.linear_regimes import axis_of, regimes
from lostmotion.servo.linear_sampled_loop import LinearLoop
from lostmotion.servo.margins import bandwidth_of, frequencies, margins
from refusals import refused

T = 125e-6
DAMPING, STIFFNESS = 1e-3, 2000.0
ROUND, WEAKENED = {"inductance_q": 4e-3}, {"dc_voltage": 300.0}


def axis(speed: float, **more: Any) -> lm.Scenario:
    """Motor and load on a coupling, at a constant speed, begun near its steady motion."""
    winding = {"pole_pairs": 4, "resistance_phase": 0.8, "inductance_d": 4e-3, "inductance_q": 9e-3, "flux_linkage": 0.09,
               "max_current_peak": 20.0} | {k: v for k, v in more.items() if k == "inductance_q"}  # fmt: skip
    every = more.get("every", 1) * T
    estimate = more.get("estimate", {"kind": "exact"})
    return lm.Scenario(
        shafts={"motor": {}, "load": {"inertia": 2e-3, "viscous_friction": DAMPING, "torque": 0.0}},
        motors={"m": {"shaft": "motor", "kind": "synchronous", "rotor_inertia": 1e-3, "rated_torque": 5.0,
                      "dc_voltage": more.get("dc_voltage", 560.0), "winding": winding}},
        gears={"coupling": {"input": "motor", "output": "load", "ratio": 1.0, "mesh_damping": 0.02,
                            "stiffness": {"kind": "linear", "stiffness": STIFFNESS}}},
        controllers={"m": {
            "sample_time": T, "delay": more.get("delay", 1), "encoder": {"ideal": True, "delay": more.get("encoder_delay", 0)},
            "reference": {"kind": "speed", "mean": speed},
            "speed": {"gain": 0.4, "integral_gain": 8.0, "estimate": estimate, "sample_time": every},
            "current": {"kind": "field_oriented", "sample_time": every, "field_weakening": more.get("weakening", 0.02)},
        }},
        initial={"speeds": {"motor": speed, "load": speed}, "twists": {"coupling": DAMPING * speed / STIFFNESS}},
        simulation={"duration": 0.1, "sample_interval": T},
    )  # fmt: skip


def at_speed(scenario: lm.Scenario, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    """The axis and its regime at the speed of its reference, the coupling twisted by the torque that it carries there."""
    speed = scenario.controllers["m"].reference.mean
    twist = DAMPING * speed / STIFFNESS
    monkeypatch.setattr("lostmotion.servo.linear_regimes.speed_of", lambda _: speed)
    monkeypatch.setattr("lostmotion.servo.linear_regimes._last", lambda _: 2.0 * twist / 1.5)
    whole = axis_of(scenario)
    (regime,) = regimes(whole)
    return whole, regime


@pytest.mark.parametrize("saliency", [{}, ROUND])
def test_at_rest_both_current_loops_have_the_closed_form(saliency: dict[str, float]) -> None:
    """L = g/(z (z - 1)) each, where the rotor stands and none acts on the other."""
    scenario = axis(0.0, **saliency).replace(**{"motors.m.rotor_inertia": "1e6 kg*m^2"})
    whole = axis_of(scenario.replace(**{"controllers.m.reference.mean": 1e-9}))
    (regime,) = regimes(whole)
    x = 2.0 * math.asin(1.0 / 6.0)
    for loop in ("direct current", "current"):
        cut, closed = (LinearLoop(whole, regime, loop, is_cut) for is_cut in (True, False))
        found, band = margins(cut, closed), bandwidth_of(frequencies(closed), closed.response)
        assert found.crossover == pytest.approx(x / (2.0 * math.pi * T), rel=1e-6)
        assert found.phase_margin == pytest.approx(0.5 * math.pi - 1.5 * x, rel=1e-6)
        assert found.gain_margin == pytest.approx(3.0, rel=1e-6)
        assert band.three_decibels * T == pytest.approx(0.124, abs=5e-4)


def sine(run: Any, name: str, frequency: float, amplitude: float, ticks: int, begin: float) -> complex:
    """Complex amplitude of a variable at ticks from a time on, relative to the sine that made it."""
    n = round(begin / T)
    t = run["time"].to_numpy()[2 * n : -1 : 2 * ticks]
    y = run[name].to_numpy()[2 * n + 1 :: 2 * ticks]  # held until halfway to the next tick
    rows = [f(k * 2.0 * math.pi * frequency * t) for k in (1, 2) for f in (np.sin, np.cos)]
    (a, b, *_), *_ = np.linalg.lstsq(np.column_stack([*rows, np.ones_like(t)]), y, rcond=None)
    return complex(a, b) / amplitude


@pytest.mark.parametrize(
    ("speed", "frequency", "more"),
    [
        (150.0, 50.0, ROUND),
        (500.0, 200.0, {}),
        (300.0, 50.0, {"encoder_delay": 2}),
        (300.0, 100.0, {"every": 2, "delay": 0}),
        (600.0, 20.0, WEAKENED),
        (600.0, 100.0, {**WEAKENED, "weakening": 0.1, "estimate": {"kind": "difference", "time_constant": 2e-4}}),
    ],
)
def test_the_speed_loop_answers_a_small_sine_as_the_simulator_does(
    speed: float, frequency: float, more: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 0.05 rad/s in several hundred: what is quadratic in it is below 1e-7, as is the core's own exchange of torque and speed."""
    scenario, size = axis(speed, **more), 0.05
    whole, regime = at_speed(scenario, monkeypatch)
    found = LinearLoop(whole, regime, "speed", False).response(frequency, feedforward=False)[0]
    wave = {"kind": "speed", "mean": speed, "amplitude": size, "frequency": frequency}
    run = lm.simulate(scenario.replace(**{"controllers.m.reference": wave}), duration=1.6, sample_interval=T / 2)
    steady = regime.winding.steady
    assert (steady.weakening < 0.0) == ("dc_voltage" in more)
    assert abs(found - sine(run, "m_measured_speed", frequency, size, more.get("every", 1), 1.4)) < 1e-6 * abs(found)


def test_stiffness_at_speed_is_that_of_a_run_under_a_sine_of_load_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario, f, size = axis(400.0, every=2), 80.0, 0.01
    whole, regime = at_speed(scenario, monkeypatch)
    found = LinearLoop(whole, regime, "speed", False).compliance(f, "load", "load")[0]
    loaded = scenario.replace(**{"shafts.load.torque": {"amplitude": size, "frequency": f}})
    run = lm.simulate(loaded, duration=1.6, sample_interval=2 * T)
    n = round(1.4 / (2 * T))
    t, y = run["time"].to_numpy()[n:-1], run["load_angle"].to_numpy()[n:-1]
    rows = [np.sin(2 * np.pi * f * t), np.cos(2 * np.pi * f * t), np.ones_like(t), t]
    (a, b, *_), *_ = np.linalg.lstsq(np.column_stack(rows), y, rcond=None)
    assert abs(found - complex(a, b) / size) < 1e-6 * abs(found)


def test_a_frequency_response_is_that_of_the_linear_loop_where_it_is_small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the periodic motion at 0.05 rad/s; and the loop about zero torque of the same motor at half of that speed is another one."""
    scenario, f = axis(300.0), [20.0, 100.0]
    whole, regime = at_speed(scenario, monkeypatch)
    found = lm.frequency_response(scenario, f, 0.05)
    expected = LinearLoop(whole, regime, "speed", False).response(f, feedforward=False)
    assert not any(found["reason"].values.ravel())
    assert found["response"].sel(output="m_measured_speed").values.ravel() == pytest.approx(expected, rel=1e-6)
    assert not {"m_copper_heat", "m_electrical_energy"} & set(found["output"].values)


def test_a_large_sine_is_answered_as_a_long_run_answers_it() -> None:
    """8 rad/s at 50 Hz, where torque and current bend: the fundamental and the second harmonic of a run after its transient."""
    scenario, f, size = axis(300.0), 50.0, 8.0
    found = lm.frequency_response(scenario, [f], size)
    wave = {"kind": "speed", "mean": 300.0, "amplitude": size, "frequency": f}
    run = lm.simulate(scenario.replace(**{"controllers.m.reference": wave}), duration=1.6, sample_interval=T / 4)
    n = round(1.4 / (T / 4))  # a response samples at a quarter and three quarters of each tick
    t = run["time"].to_numpy()[n + 1 : -1 : 2]
    for name in ("m_quadrature_current", "m_direct_current", "m_torque", "load_speed"):
        y = run[name].to_numpy()[n + 1 :: 2]
        expected = [2.0 * np.mean(y * np.exp(-2j * np.pi * k * f * t)) for k in (1, 2)]
        harmonics = found["harmonics"].sel(output=name).values.ravel()
        assert np.abs(harmonics[1:3] - expected).max() < 1e-6 * abs(expected[0])


def test_the_sheet_of_a_spindle_has_both_currents() -> None:
    report = lm.commission(lm.load("field-weakening"))
    assert list(dict.fromkeys(row.loop for row in report.loops)) == ["direct current", "current", "speed"]
    assert [step.loop for step in report.steps] == ["current", "speed"]
    assert report.stable


def test_a_speed_without_the_voltage_for_it_is_refused() -> None:
    short = axis(1500.0, dc_voltage=300.0, weakening=0.0)
    refused(lambda: lm.commission(short), match=r"requires 26\d.\d V of a phase, and the inverter gives 173.2 V; .*field_weakening")
