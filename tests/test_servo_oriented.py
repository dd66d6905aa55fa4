"""The servo report of an axis under field-oriented control: closed forms at rest, and small sines through the whole core at speed."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.servo.linear_regimes import Axis, axis_of, regimes
from lostmotion.servo.linear_sampled_loop import LinearLoop
from lostmotion.servo.margins import bandwidth_of, frequencies, margins
from lostmotion.servo.tuning_data import frictions
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


@pytest.mark.parametrize(("speed", "frequency", "more"), [
    (150.0, 50.0, ROUND),
    (500.0, 200.0, {}),
    (300.0, 50.0, {"encoder_delay": 2}),
    (300.0, 100.0, {"every": 2, "delay": 0}),
    (600.0, 20.0, WEAKENED),
    (600.0, 100.0, {**WEAKENED, "weakening": 0.1, "estimate": {"kind": "difference", "time_constant": 2e-4}}),
])  # fmt: skip
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
    refused(lambda: lm.commission(short), reason="field_weakening")


# --- from a gearhead's sheet to gains ---
SHEET = """
[[gearbox]]
name = "planetary-80"
kind = "planetary"
manufacturer = "mine"
title = "planetary, two stages"
ratio = 40
rated_output_torque = "70 N*m"
rated_input_speed = "3000 rpm"
inertia = "0.35 kg*cm^2"
backlash = "3 arcmin"
stiffness = { slopes = ["6 N*m/arcmin"] }
[gearbox.losses]
efficiency = [{ input_speed = "3000 rpm", load = 1.0, efficiency = 0.94 }]
no_load_torque = [{ input_speed = "3000 rpm", torque = "0.06 N*m" }]
[[gearbox.source]]
data = ["ratio", "rated_output_torque", "rated_input_speed", "stiffness", "losses"]
status = "manufacturer"
text = "sheet"
"""
AXIS = """
motor = { from = "allied-mf0076056-300v" }
gearbox = { from = "gear.toml" }
load = { inertia = "0.6 kg*m^2" }
[controller]
sample_time = "125 us"
encoder = { lines = 4096 }
reference = { kind = "position", law = "modified_sine", dwell = "0.6 s", moves = [{ to = "90 deg", duration = "0.4 s" }, { to = "0 deg", duration = "0.4 s" }] }
[simulation]
duration = "2 s"
sample_interval = "1 ms"
"""


@pytest.fixture
def axis_of_a_sheet(tmp_path: Path) -> Path:
    (tmp_path / "gear.toml").write_text(SHEET)
    (tmp_path / "axis.toml").write_text(AXIS)
    return tmp_path / "axis.toml"


def test_a_file_without_loops_is_tuned_and_the_load_without_friction_floats_in_the_gap(axis_of_a_sheet: Path) -> None:
    tuned = axis_of_a_sheet.with_name("tuned.toml")
    asked = ["servo", str(axis_of_a_sheet), "--window", "1 arcmin", "--tune", "margins", "--feedforward", "-o", str(tuned)]
    done = CliRunner().invoke(app, asked)
    assert isinstance(done.exception, SystemExit) and done.exit_code == 1, done.output
    assert "controller.speed.gain                   none -> " in done.output
    assert "the motor stands and the load still swings by" in done.output and "it floats in the backlash" in done.output
    found = lm.load(tuned)
    # The losses without load are 0.06 N m at all speeds, so that none of the friction is viscous.
    assert frictions(Axis(found, "motor")) == pytest.approx((0.0, 0.06), abs=1e-12)
    assert found.controller.feedforward.friction_torque == pytest.approx(0.06, rel=1e-12)


def test_without_gains_the_option_that_finds_them_is_named(axis_of_a_sheet: Path) -> None:
    done = CliRunner().invoke(app, ["servo", str(axis_of_a_sheet)])
    assert "controller.position.gain: no gain is given; add it, or find it: --tune margins" in str(done.exception)


def test_the_margins_hold_in_the_position_loop_too_where_its_encoder_sees_the_resonance(axis_of_a_sheet: Path) -> None:
    """With the usual gain of the position loop this axis_of_a_sheet is unstable at 27.7 Hz, the resonance of gearbox and load."""
    on_load = {"controller.position_encoder": {"shaft": "load", "bits": 20}, "load.viscous_friction": 2.0}
    loops = {"controller.position": {"gain": 42.62}, "controller.speed": {"gain": 0.2647, "integral_gain": 26.54}}
    usual = lm.load(axis_of_a_sheet, on_load | loops)
    tuned = lm.tune(usual, rule="margins")
    assert tuned.position_gain < 0.5 * 42.62
    rows = [row.margins for row in lm.commission(tuned.scenario).loops if row.loop == "position"]
    assert all(m.stable and not m.phase_margin < 1.047 and not m.gain_margin < 10.0**0.3 for m in rows)
    assert any(m.gain_margin < 10.0**0.35 for m in rows)  # and no more is given up than a tenth of the gain


def test_a_gain_of_zero_is_refused_as_such_and_not_as_missing() -> None:
    done = CliRunner().invoke(app, ["servo", "position-axis", "--set", "controller.speed.gain=0"])
    assert "controller.speed.gain: 0.0 must be greater than 0" in str(done.exception)
