"""Runs from Python: agreement of solvers, laws, stepping, interruption."""

import json
import math
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lostmotion as lm
from conftest import SCENARIOS
from refusals import refused, refuses


def test_the_lossy_rigid_gear_switches_at_the_closed_form_instants() -> None:
    path = next(p for p in SCENARIOS if p.stem == "lossy-rigid-gear")
    result = lm.simulate(lm.load(path))
    switchings = lm.switchings_of(result)
    changes = switchings["input_contact_before"] != switchings["input_contact_after"]
    instants = switchings["instant"].values[changes.values]
    expected = [0.0804771339, 0.1995199008, 0.3713427780, 0.4645394616]
    assert instants == pytest.approx(expected, abs=1e-9)
    assert float(result["load_speed"][-1]) == pytest.approx(-0.01626192938, abs=1e-10)


def test_shift_the_time_and_the_motion_shifts(small: Path) -> None:
    scenario = lm.load(small, {"simulation.sample_interval": 0.01})
    shift = 0.37
    steps = {"steps": [{"height": 0.03, "time": 0.1}, {"height": -0.05, "time": 0.9}]}
    late = {"steps": [{**s, "time": s["time"] + shift} for s in steps["steps"]]}  # type: ignore[dict-item]
    a = lm.simulate(scenario, command=lm.CommandSignal(**steps), duration=1.5)
    b = lm.simulate(scenario, command=lm.CommandSignal(**late), duration=1.5 + shift)
    for name in ("motor_speed", "load_speed", "twist"):
        shifted = b[name].values[37:]
        assert shifted == pytest.approx(a[name].values, abs=1e-9 * float(abs(a[name]).max()))


@settings(max_examples=40, deadline=None)
@given(amplitude=st.floats(0.005, 1.2), frequency=st.floats(0.3, 30.0), mean=st.floats(-0.3, 0.3), torque=st.floats(-20.0, 20.0))
def test_mirror_the_command_and_the_motion_mirrors(amplitude: float, frequency: float, mean: float, torque: float) -> None:
    scenario = lm.load(SCENARIOS[0].parent / "paper-2dof-nl-large.toml", {"simulation.duration": 0.5})
    command = lm.CommandSignal(mean=mean, amplitude=amplitude, frequency=frequency)
    a = lm.simulate(scenario, command=command, load_torque=torque)
    b = lm.simulate(scenario, command=command.mirrored(), load_torque=-torque)
    for name in ("motor_torque", "motor_speed", "load_speed", "twist", "output_torque"):
        assert b[name].values == pytest.approx(-a[name].values, abs=1e-10 * (1e-9 + float(abs(a[name]).max())))


def test_sampling_does_not_affect_the_motion(small: Path) -> None:
    fine, coarse = (lm.simulate(lm.load(small, {"simulation.sample_interval": interval})) for interval in (1e-3, 0.1))
    for name in ("load_speed", "twist", "load_angle"):
        assert coarse[name].values == pytest.approx(fine[name].values[::100], rel=1e-9, abs=1e-13)


def test_step_by_step_equals_one_run(small: Path) -> None:
    scenario = lm.load(small)
    sim = lm.Simulation(scenario.drive(), step=0.01)
    times = np.arange(101) * 0.01
    values = 0.03 * np.sin(7.0 * times)
    for k in range(100):
        sim.advance(0.01, command=(values[k], values[k + 1]))
    command = lm.CommandSignal(samples={"times": times.tolist(), "values": values.tolist()})
    run = lm.simulate(scenario, command=command, duration=1.0, sample_interval=0.01)
    for name in ("motor_speed", "load_speed", "twist", "output_torque"):
        assert sim[name] == pytest.approx(float(run[name][-1]), rel=1e-9, abs=1e-12)


def test_a_restored_simulation_continues_bit_for_bit(small: Path) -> None:
    drive = lm.load(small).drive()
    a, b = lm.Simulation(drive), lm.Simulation(drive)
    for k in range(300):
        a.advance(1e-3, command=0.03 * math.sin(0.05 * k), load_torque=0.1)
    b.state = a.state
    for k in range(300, 600):
        for sim in (a, b):
            sim.advance(1e-3, command=0.03 * math.sin(0.05 * k), load_torque=0.1)
        assert repr(a.read()) == repr(b.read())  # all digits; NaN equals NaN
    assert a.time == b.time


def test_explain_names_what_holds_and_what_would_free(small: Path) -> None:
    scenario = lm.load(small)
    explanation = lm.explain(scenario, 1.0)
    shaft = explanation.contacts[0]
    assert shaft.mode == 0
    assert -shaft.capacity_backward <= shaft.torque <= shaft.capacity_forward
    assert "stuck" in str(explanation)
    # T_10 + M_2B/i at rest and without load: 0.016 + 0.020 * 51.6/90 N·m against a stall torque of k_N M_DR a unit.
    rest = lm.explain(lm.Simulation(scenario.drive()))
    expected = (0.016 + 0.020 * 51.6 / 90.0) / (3.1169 * 0.521)
    assert rest.command_forward == pytest.approx(expected, rel=1e-12)
    assert rest.command_backward == pytest.approx(-expected, rel=1e-12)
    limited = lm.load(small, {"motor.voltage_limit": "0.1 V"})
    assert "cannot reach" in str(lm.explain(limited, 0.1))


def test_the_smallest_command_moves_the_load_and_less_does_not(small: Path) -> None:
    scenario = lm.load(small)
    smallest = lm.explain(lm.Simulation(scenario.drive())).command_forward
    for factor, moves in ((0.99, False), (1.01, True)):
        command = lm.CommandSignal(ramps=[{"rise": factor * smallest, "duration": 5.0}])
        result = lm.simulate(scenario, command=command, duration=20.0, sample_interval=0.1)
        assert (float(abs(result["load_speed"][-1])) > 1e-6) == moves


def test_two_runs_in_two_threads_give_the_same_bits(large: Path) -> None:
    scenario = lm.load(large)
    results: list[np.ndarray] = []

    def work() -> None:
        results.append(lm.simulate(scenario)["load_speed"].values)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert all(np.array_equal(r, results[0]) for r in results)


def test_ctrl_c_ends_a_long_run_at_once(small: Path) -> None:
    script = textwrap.dedent(f"""
        import lostmotion as lm
        scenario = lm.load({str(small)!r}, {{"simulation.duration": 1e9, "simulation.sample_interval": 1e6}})
        print("running", flush=True)
        lm.simulate(scenario)
    """)
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "running\n"
    time.sleep(1.0)
    os.kill(process.pid, signal.SIGINT)
    _, error = process.communicate(timeout=600.0)  # the run itself would take days
    assert "KeyboardInterrupt" in error
    assert process.returncode != 0


def test_memory_does_not_grow_with_the_duration(small: Path) -> None:
    script = textwrap.dedent(f"""
        import resource
        import lostmotion as lm
        peaks = []
        for duration in (2.0, 2.0, 5000.0):
            scenario = lm.load({str(small)!r}, {{"simulation.duration": duration, "simulation.sample_interval": duration / 100}})
            result = lm.simulate(scenario)
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        print(peaks[2] - peaks[1], result.attrs["switching_count"], lm.switchings_of(result).sizes["switching"])
    """)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    grown, count, kept = map(int, done.stdout.split())
    assert count > 100_000 >= kept  # all are counted, a bounded number is kept
    assert grown < 60_000  # KiB: the kept switchings


def test_memory_does_not_grow_with_the_number_of_drives(small: Path) -> None:
    script = textwrap.dedent(f"""
        import resource
        import lostmotion as lm
        scenario = lm.load({str(small)!r}, {{"command.amplitude": 1.0}})
        peaks = []
        for k in range(150):
            lm.simulate(scenario.replace(**{{"load.inertia": 1.0 + 1e-6 * k}}))  # each has as many regimes
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        print(peaks[149] - peaks[30])
    """)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 20_000  # KiB; a drive whose regimes are kept takes some 2000


def test_end_state_continues_a_run(small: Path) -> None:
    scenario = lm.load(small)
    whole = lm.simulate(scenario, duration=2.0)
    half = lm.simulate(scenario, duration=1.0)
    end = json.loads(half.attrs["end_state"])
    rest = lm.simulate(scenario, duration=1.0, initial=lm.Initial(**end))
    assert float(rest["load_speed"][-1]) == pytest.approx(float(whole["load_speed"][-1]), rel=1e-6)


def test_bad_steps_are_refused_and_change_nothing():
    drive = lm.load("paper-2dof-nl-small").drive()
    simulation = lm.Simulation(drive)
    simulation.advance(1e-3, command=0.1)
    before = simulation.state
    for interval in (math.inf, 1e300, 1e-300, 0.0, -1e-3, math.nan):
        for call in (lambda h=interval: lm.Simulation(drive, step=h), lambda h=interval: simulation.advance(h, command=0.1)):
            refused(call, match=r"must lie between 1e-12 s and 1e\+12 s|must be a finite number")
    for inputs in ({"command": math.nan}, {"command": 0.1, "load_torque": math.inf}):
        refused(lambda inputs=inputs: simulation.advance(1e-3, **inputs), reason="must be a finite number")
    assert simulation.state == before
    simulation.advance(1e6, command=0.0)
    refused(lambda: simulation.advance(1e-12, command=0.1), reason="below the resolution of the time")


def test_samples_that_do_not_fit_into_memory_are_refused_before_the_run(monkeypatch):
    monkeypatch.setattr("lostmotion.inputs.memory_limits.free_memory", lambda: 5_000_000_000)
    with refuses(reason="1e+08 samples need 18.3 GB of memory, and 5 GB are free"):
        lm.simulate(lm.load("paper-2dof-nl-small"), duration=100.0, sample_interval=1.0000001e-6)


def test_results_that_do_not_fit_into_memory_are_refused_before_they_are_made(monkeypatch):
    """A thousand times a thousand points, with at least 16 bytes for each harmonic of each output."""
    monkeypatch.setattr("lostmotion.inputs.memory_limits.free_memory", lambda: 1_000_000_000)
    drive, many = lm.load("paper-2dof-nl-small"), np.linspace(1.0, 2.0, 1000)
    for call, said in (
        (lambda: lm.frequency_response(drive, many, many), r"1e\+06 points of the response need .* GB"),
        (lambda: lm.SimulationBatch(drive.drive(), step=1e-3, count=10**9), r"count: 1e\+09 drives need .* GB"),
        (lambda: lm.test_rig.TestRig(drive.gearbox).efficiency_map(many, np.ones(10**5)), r"1e\+08 points of the map"),
    ):
        with pytest.raises(lm.InputError, match=said + ".* of memory, and 1 GB are free; "):
            call()


def test_a_billion_seconds_at_constant_command_end():
    result = lm.simulate(lm.load("paper-2dof-nl-small"), command=0.3, duration=1e9, sample_interval=1e6)
    speed = result["load_speed"].values
    assert speed[1] == pytest.approx(speed[-1], rel=1e-12)
    assert result["load_angle"].values[-1] == pytest.approx(1e9 * speed[-1], rel=1e-6)


def test_a_billion_seconds_of_a_sine_end_in_the_steady_state_of_a_linear_drive():
    scenario = lm.load("paper-2dof-l-large", ["motor.friction_torque=0", "command.frequency=1.3 Hz"])
    d = scenario.drive()
    m, g, z = d.motor, d.gearbox, d.load
    J, i, k = m.rotor_inertia + g.inertia, g.ratio, 17225.0
    slowing = (m.armature_voltage_constant - 1) / m.rated_speed
    A = np.array(
        [
            [-1 / m.electrical_time_constant, -m.rated_torque * slowing / m.electrical_time_constant, 0, 0],
            [1 / J, -g.viscous_friction / J, 0, -k / (i * 0.9 * J)],
            [0, 0, -z.viscous_friction / z.inertia, k / z.inertia],
            [0, 1 / i, -1, 0],
        ]
    )
    B = [m.rated_torque * m.armature_voltage_constant / m.electrical_time_constant, 0, 0, 0]
    omega = 2 * np.pi * 1.3
    answer = np.linalg.solve(1j * omega * np.eye(4) - A, B) * 1.0275  # to exp(i omega t)
    names = ("motor_torque", "motor_speed", "load_speed", "twist")
    for interval in (1e9, 1e7, 1e5 / 3):
        result = lm.simulate(scenario, duration=1e9, sample_interval=interval)
        assert result["time"].values[-1] == pytest.approx(1e9)
        for n in {result.sizes["time"] - 1, result.sizes["time"] // 3} - {0}:
            turns = float(Fraction(1.3) * Fraction(float(result["time"].values[n])) % 1)
            expected = (answer * np.exp(2j * np.pi * turns)).imag
            for name, value, size in zip(names, expected, abs(answer), strict=True):
                # np.linalg.solve is good for some 1e-12 here.
                assert result[name].values[n] == pytest.approx(value, abs=1e-9 * size)
        energy = lm.energy_of(result)
        assert energy["load_damper"] == pytest.approx(1e9 * z.viscous_friction * abs(answer[2]) ** 2 / 2, rel=1e-8)
        assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]


def test_stepping_and_sampled_constants_change_nothing_at_constant_speed():
    scenario = lm.load("paper-2dof-nl-large")
    whole = lm.simulate(scenario, command=0.3, duration=2.0, sample_interval=1e-3)
    times = [0.0, *(k * 1e-3 for k in range(1, 2000))]
    sampled = lm.simulate(
        scenario, command=lm.CommandSignal(samples={"times": times, "values": [0.3] * len(times)}), duration=2.0, sample_interval=1e-3
    )
    np.testing.assert_array_equal(sampled["output_torque"].values, whole["output_torque"].values)
    simulation = lm.Simulation(scenario.drive(), step=1e-3)
    torque = []
    for _ in range(2000):
        simulation.advance(1e-3, command=0.3)
        torque.append(simulation["output_torque"])
    np.testing.assert_allclose(torque, whole["output_torque"].values[1:], rtol=1e-9)


def test_thousands_of_steps_are_summed_as_one_by_one():
    steps = [{"time": 1e-3 * k, "height": 0.001 * (-1) ** k * (k % 7)} for k in range(1, 4000)]
    breakpoints = lm.CommandSignal(mean=0.5, steps=steps).breakpoint_list()
    total = 0.5 + np.cumsum([s["height"] for s in steps])
    assert [t for t, _, _ in breakpoints[1:]] == [s["time"] for s in steps]
    np.testing.assert_allclose([v for _, v, _ in breakpoints[1:]], total, rtol=0, atol=1e-12)
    assert all(slope == 0.0 for _, _, slope in breakpoints)


def test_ramps_that_overlap_are_added():
    signal = lm.CommandSignal(
        ramps=[{"begin": 0.0, "duration": 2.0, "rise": 1.0}, {"begin": 1.0, "duration": 2.0, "rise": -0.5}],
        steps=[{"time": 1.5, "height": 0.25}],
    )
    for t, value, slope in signal.breakpoint_list():
        first, second = min(t, 2.0) / 2.0, -0.25 * min(max(t - 1.0, 0.0), 2.0)
        assert value == pytest.approx(first + second + (0.25 if t >= 1.5 else 0.0), abs=1e-15)
        assert slope == pytest.approx((0.5 if t < 2.0 else 0.0) - (0.25 if 1.0 <= t < 3.0 else 0.0))
