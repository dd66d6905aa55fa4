"""Frequency response of closed loops: the exact sampled linear loop, long runs, encoders with steps, frequencies that do not fit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.response.windows import fitting
from lostmotion.servo.linear_regimes import axis_of, regimes
from lostmotion.servo.linear_sampled_loop import LinearLoop
from refusals import refused
from two_mass import T, two_mass


def two_masses(kind: str, **changes: Any) -> lm.Scenario:
    """Two masses without friction that is dry: one linear regime."""
    estimate = {"kind": "difference", "time_constant": 2e-4}
    controller: dict[str, Any] = {"reference": {"kind": kind}}
    if kind == "position":
        controller["position"] = {"gain": 20.0, "feedforward": 0.5, "sample_time": 8 * T}
        controller["position_encoder"] = {"ideal": True, "shaft": "load"}
    speed = {"gain": 1.1, "integral_gain": 45.0, "reference_weight": 0.6, "estimate": estimate}
    return two_mass(speed, **(controller | changes))


def exact_loop(scenario: lm.Scenario, loop: str) -> LinearLoop:
    axis = axis_of(scenario)
    (regime,) = regimes(axis)
    return LinearLoop(axis, regime, loop, False)


FREQUENCIES = [0.5, 3.0, 10.0, 33.0, 77.7, 190.0]


@pytest.mark.parametrize(("kind", "changes"), [
    ("speed", {}),
    ("speed", {"delay": 0}),
    ("speed", {"encoder": {"ideal": True, "delay": 3}}),
    ("position", {}),
    ("position", {"blend_time": 5e-3}),
])  # fmt: skip
def test_a_linear_loop_has_the_response_of_its_matrices(kind: str, changes: dict[str, Any]) -> None:
    """The transfer function in z at the samples of the loop, from the matrix exponential of the plant and the controller's laws."""
    scenario = two_masses(kind, **changes)
    response = lm.frequency_response(scenario, FREQUENCIES, [0.3])
    f = response["frequency"].to_numpy()
    got = response["response"].sel(output=f"m_measured_{kind}").to_numpy()[0]
    assert np.abs(got / exact_loop(scenario, kind).response(f) - 1.0).max() < 1e-10
    assert (response["reason"] == "").all()
    assert float(response["residual"].max()) < 1e-10
    assert (response["spread"] == 0.0).all()


@pytest.mark.parametrize("frequency", [0.5, 10.0, 76.923, 190.5])
def test_a_load_torque_meets_the_stiffness_of_the_matrices(frequency: float) -> None:
    """From the matrix exponential of the plant under a sine of continuous time, and the controller's laws."""
    scenario = two_masses("position")
    response = lm.frequency_response(scenario, frequency, 0.7, source="load_load_torque")
    f = response["frequency"].to_numpy()
    compliance = exact_loop(scenario, "position").compliance
    got = response["response"].sel(output="m_measured_position").to_numpy()[0]
    assert np.abs(got / compliance(f, "load", "load") - 1.0).max() < 1e-10
    assert float(response["residual"].max()) < 1e-10


def test_a_loop_of_the_speed_may_go_on_turning() -> None:
    """Of a linear loop the response does not depend on the mean speed, and the angle advances by it."""
    scenario = two_masses("speed")
    turning = scenario.replace(**{"controllers.m.reference": {"kind": "speed", "mean": 2.0}})
    one, two = (lm.frequency_response(s, [10.0, 40.0], [0.3]) for s in (scenario, turning))
    assert np.abs(two["response"] / one["response"] - 1.0).sel(output=["m_measured_speed", "load_speed"]).max() < 1e-9
    assert two["angle_advance"].to_numpy()[0] == pytest.approx(2.0 / two["frequency"].to_numpy(), rel=1e-9)
    mean = two["harmonics"].sel(output="load_speed", harmonic=0).to_numpy()
    assert mean == pytest.approx(np.full(mean.shape, 2.0), rel=1e-9)


# --- drives that are not linear, against long runs ---
def axis(**changes: Any) -> lm.Scenario:
    scenario = lm.load("position-axis")
    assert isinstance(scenario, lm.Scenario)
    return scenario.replace(**changes)


def long_run(scenario: lm.Scenario, amplitude: float, frequency: float, periods: int, last: int) -> dict[str, complex]:
    """First harmonics of the last periods of a long run from rest, at the samples of the position loop of 1 ms."""
    reference = {"kind": "position", "amplitude": amplitude, "frequency": frequency}
    changes = {"controller.reference": reference, "simulation": {"duration": periods / frequency, "sample_interval": 1e-3}}
    result = lm.simulate(scenario.replace(**changes), energy=False)
    count = round(last / frequency / 1e-3)
    tail = result.isel(time=slice(-count - 1, -1))
    wave = np.exp(-2j * np.pi * frequency * tail["time"].to_numpy())
    names = ("measured_position", "speed_reference")
    return {name: 2.0 * complex(np.mean(tail[name].to_numpy() * wave)) for name in names}


@pytest.mark.parametrize(("amplitude", "frequency"), [(0.002, 2.0), (0.02, 5.0), (0.3, 3.125), (0.002, 40.0)])
def test_a_drive_that_sticks_twists_and_is_limited_follows_a_long_run(amplitude: float, frequency: float) -> None:
    """Dry friction, a torsion curve, hysteresis, the limits of torque and voltage; 60 periods and at least 40 time constants 1/K_v."""
    scenario = axis(**{"controller.encoder": {"ideal": True}})
    response = lm.frequency_response(scenario, frequency, amplitude)
    assert float(response["frequency"].item()) == pytest.approx(frequency, rel=1e-12)
    expected = long_run(scenario, amplitude, frequency, max(60, int(4.0 * frequency)), 1)
    for name, value in expected.items():
        got = response["harmonics"].sel(output=name, harmonic=1).item()
        assert abs(got - value) < 1e-8 * abs(value)
    assert float(response["spread"].item()) == 0.0


def test_with_an_encoder_of_steps_the_mean_is_that_of_a_long_run() -> None:
    scenario = axis(**{"controller.encoder": {"lines": 64}})
    response = lm.frequency_response(scenario, 2.0, 0.02)
    spread = float(response["spread"].item())
    assert 1e-5 < spread < 0.01
    expected = long_run(scenario, 0.02, 2.0, 100, 50)
    got = response["harmonics"].sel(output="measured_position", harmonic=1).item()
    assert abs(got - expected["measured_position"]) < max(spread, 1e-3) * abs(got)
    # A finer encoder makes less of it, and comes to the one without steps.
    fine = lm.frequency_response(axis(**{"controller.encoder": {"bits": 30}}), 2.0, 0.02)
    without = lm.frequency_response(axis(**{"controller.encoder": {"ideal": True}}), 2.0, 0.02)
    assert float(fine["spread"].item()) < 1e-3 * spread
    here, there = (r["response"].sel(output="measured_position").item() for r in (fine, without))
    assert abs(here / there - 1.0) < 1e-6


def test_powers_are_those_of_the_energy_ledger() -> None:
    scenario = axis(**{"controller.encoder": {"ideal": True}})
    response = lm.frequency_response(scenario, 1.0, 0.1)
    runs = []
    for duration in (20.0, 24.0):
        reference = {"kind": "position", "amplitude": 0.1, "frequency": 1.0}
        simulation = {"duration": duration, "sample_interval": 1e-3}
        runs.append(lm.energy_of(lm.simulate(scenario.replace(**{"controller.reference": reference, "simulation": simulation}))))
    lost = sum(runs[1][name] - runs[0][name] for name in ("gear_losses", "hysteresis")) / 4.0
    # From 250 samples a period, with jumps of the torques at ticks and turning points.
    assert float(response["gear_loss"].item()) == pytest.approx(lost, rel=5e-3)


# --- periods and sample times ---
def test_frequencies_that_do_not_fit_are_moved_to_the_nearest() -> None:
    """10 ms are 10 samples of 1 ms; three periods of 30 Hz are 100; pi Hz is not a ratio of whole numbers."""
    exact = [fitting(f, T, 8) for f in (0.01, 1.0, 10.0, 30.0, 125.0, 400.0)]
    assert [w.frequency for w in exact] == pytest.approx([w.asked for w in exact], rel=1e-12)
    assert [w.periods for w in exact] == [1, 1, 1, 3, 1, 2]
    for f in (0.0314159265, 0.314159265, 3.14159265, 31.4159265, 314.159265):
        window = fitting(f, T, 8)
        assert window.ticks % 8 == 0
        assert window.frequency == pytest.approx(f, rel=2e-2 if f > 300.0 else 2e-3)
        assert window.frequency * window.ticks * T == pytest.approx(window.periods, rel=1e-12)
        assert window.samples >= 256 * window.periods
        assert (window.ticks * window.points) % window.stride == 0
    scenario = two_masses("position")
    response = lm.frequency_response(scenario, [31.4159265, 31.4159266], [0.3])  # both come to the same
    assert response.sizes["frequency"] == 1
    assert response["asked_frequency"].item() != response["frequency"].item()


def test_what_cannot_be_a_source_is_refused() -> None:
    assert "is not known; it must be reference or" in refused(lambda: lm.frequency_response(axis(), 1.0, 0.1, source="command"))
    assert "mean_command: a controller turns the motor" in refused(lambda: lm.frequency_response(axis(), 1.0, 0.1, mean_command=0.5))
    assert "law: the scenario has no" in refused(lambda: lm.frequency_response(lm.load("paper-2dof-l-small"), 1.0, 0.1, law=print))


def test_a_law_of_ones_own_has_a_response() -> None:
    """A proportional law on the speed, delayed by a tick, of a rigid inertia: closed form in z."""
    J, gain = 2e-3, 1.2
    scenario = lm.Scenario(
        shafts={"motor": {}},
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": J, "rated_torque": 1.0}},
        controllers={"m": {"sample_time": T, "law": True, "reference": {"kind": "speed"}, "encoder": {"ideal": True}}},
        simulation={"duration": 0.1, "sample_interval": 1e-3},
    )

    def law(time: float, measured: Any, reference: Any, state: Any) -> float:
        state[0] = measured[1]
        return gain * float(reference[0] - measured[1])

    response = lm.frequency_response(scenario, [50.0, 500.0], 0.4, law=lm.control.Law(law, states=1))
    z = np.exp(2j * np.pi * response["frequency"].to_numpy() * T)
    # J (w+ - w)/T = gain (r - m)/z, m = (w + w-)/2 the difference of the angles over a tick, under a torque that changes at ticks
    w = (gain * T / J / z) / (z - 1.0 + gain * T / J / z * 0.5 * (1.0 + 1.0 / z))
    m = 0.5 * (1.0 + 1.0 / z) * w
    got = response["response"].sel(output="m_measured_speed").to_numpy()[0]
    assert got == pytest.approx(m, rel=1e-9)


def test_the_command_says_what_it_has_moved_and_what_does_not_repeat(tmp_path: Path) -> None:
    options = ["--amplitudes", "0.02,0.1", "--frequencies", "2,3.14159", "-o", str(tmp_path / "r")]
    done = CliRunner().invoke(app, ["response", "position-axis", *options])
    assert done.exit_code == 0, done.output
    assert "1 of 2 frequencies moved to the nearest that fits the sample times" in done.output
    assert "4 responses averaged over many periods" in done.output
    assert {"response.html", "response.csv"} <= {p.name for p in (tmp_path / "r").iterdir()}
    assert ",spread,reason" in (tmp_path / "r" / "response.csv").read_text().splitlines()[0]


@pytest.mark.parametrize(("name", "time"), [("position-axis", 1.2), ("gantry-two-screws", 0.5), ("vertical-axis-with-brake", 0.4)])
def test_a_controlled_scenario_is_explained_in_the_state_of_its_run(name: str, time: float) -> None:
    scenario = lm.load(name)
    explained, run = lm.explain(scenario, time), lm.simulate(scenario, duration=time)
    assert float(run.time[-1]) == time
    for variable, value in explained.values.items():
        if variable in run:
            assert value == pytest.approx(float(run[variable][-1]), rel=1e-9, abs=1e-9), variable
    modes = {contact.name: contact.mode for contact in explained.contacts}
    assert {key: int(run[key][-1]) for key in modes if key in run} == {key: modes[key] for key in modes if key in run}
