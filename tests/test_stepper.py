"""Steppers: closed forms of the field, the steps of a driver, forms of scenarios, the adaptive solver."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
from conftest import ROOT, some
from lostmotion.control.command import CommandSignal, Stepping
from refusals import refusals_of, refused
from stepper_axes import departure

J, T_H, N = 5e-6, 0.3, 50
MOTOR = {"kind": "stepper", "steps_per_revolution": 200, "holding_torque": T_H, "rotor_inertia": J}


def alone(command=None, torque=0.0, angle=0.0, duration=0.02, sample_interval=1e-4, viscous=0.0, **motor) -> lm.Scenario:
    """A rotor with nothing on it."""
    return lm.Scenario(
        shafts={"motor": {"inertia": 0.0, "viscous_friction": viscous, "torque": torque}},
        motors={"m": {"shaft": "motor", **MOTOR, **motor}},
        command={"m": command or {}},
        initial={"angles": {"motor": angle}},
        simulation={"duration": duration, "sample_interval": sample_interval},
    )


def frequency(error: float) -> float:
    """Of small oscillations, which stay on one straight line: phi = a cos(2 pi f t), from its last zero [Hz]."""
    found = lm.simulate(alone(angle=1e-7, duration=0.2, sample_interval=1e-5, torque_error=error * T_H))
    t, phi, speed = (np.asarray(found[name]) for name in ("time", "motor_angle", "motor_speed"))
    begin = np.nonzero(phi[:-1] * phi[1:] < 0.0)[0]
    near = math.sqrt(N * T_H / J)
    zeros = t[begin] - np.arctan(phi[begin] * near / speed[begin]) / near
    return (zeros.size - 1) / 2.0 / float(zeros[-1] - zeros[0])


def test_small_oscillations_have_the_frequency_of_the_field() -> None:
    """sqrt(N T_H/J)/(2 pi). The chord through the rest has the slope of the sine but for h^2/24, which two widths h take away."""
    exact = math.sqrt(N * T_H / J) / (2.0 * math.pi)
    errors = [(math.pi / 4.0 / q / math.sin(math.pi / 4.0 / q)) ** 2 - 1.0 for q in (40, 80)]
    coarse, fine = (frequency(error * (1.0 + 1e-9)) for error in errors)
    assert coarse / exact - 1.0 == pytest.approx((0.5 * math.pi / 40) ** 2 / 48.0, rel=1e-2)
    assert fine + (fine - coarse) / 3.0 == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("share", [-0.9, -0.3, 0.2, 0.7, 0.97])
def test_static_error_under_load_is_that_of_the_sine_but_for_the_bound(share: float) -> None:
    """asin(T/T_H)/N; torques that are off by e move the rest by at most the distance to where the sine is T - e or T + e."""
    error = 1e-3 * T_H
    ramp = {"ramps": [{"rise": share * T_H, "duration": 0.2}]}
    end = lm.simulate(alone(torque=ramp, viscous=2e-3, duration=0.5)).motor_angle[-1]
    low, high = (math.asin((share * T_H + way * error) / T_H) / N for way in (-1, 1))
    assert low <= -float(end) <= high


@pytest.mark.parametrize(("share", "lost"), [(0.997, False), (1.003, True)])
def test_a_load_above_the_holding_torque_pulls_the_rotor_out(share: float, lost: bool) -> None:
    ramp = {"ramps": [{"rise": share * T_H, "duration": 0.5}]}
    end = lm.simulate(alone(torque=ramp, viscous=2e-3, duration=0.7)).motor_angle[-1]
    assert (abs(float(end)) > math.pi / N) == lost


def test_nearly_without_current_the_rotor_rests_in_its_detents() -> None:
    """A field of a tenth of T_D at standstill: the rotor stays next to where it is put, at the nearest whole step."""
    step = 2.0 * math.pi / 200
    pulses = {"pulses": {"times": [1e-6, 2e-6], "values": [1, -1]}, "standstill_delay": 1e-6}
    motor = {"detent_torque": 0.02, "standstill_current": 1e-3, "holding_torque": 2.0}
    end = lm.simulate(alone({"stepping": pulses}, angle=3.3 * step, viscous=1e-2, duration=0.3, **motor))
    assert float(end.motor_angle[-1]) == pytest.approx(3.0 * step, abs=1e-2 * step)


def test_the_motion_is_that_of_an_integration_of_the_sine() -> None:
    """A jump of 1.5 steps, which the rotor follows: DOP853 to 1e-12, off by what the straight lines leave."""
    error = 1e-5
    goal = 1.5 * 2.0 * math.pi / 200
    scenario = alone({"mean": goal}, viscous=2e-4, torque_error=error * T_H)
    found = lm.simulate(scenario)

    def rate(_, x):
        return [x[1], (-T_H * math.sin(N * (x[0] - goal)) - 2e-4 * x[1]) / J]

    exact = solve_ivp(rate, (0.0, 0.02), [0.0, 0.0], "DOP853", t_eval=found.time.values, rtol=1e-12, atol=1e-14).y[0]
    off = np.abs(found.motor_angle.values - exact).max()
    assert off < 20.0 * error / N
    assert np.abs(lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11).motor_angle.values - exact).max() < 1e-6 / N


# 43 and 69 pass near an unstable rest, which amplifies; 88 rests on a corner of the straight lines.
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 43, 69, 88])
def test_random_axes_agree_with_the_adaptive_solver_within_the_error_of_the_straight_lines(seed: int) -> None:
    """Electrical angle, as the torque of the adaptive solver is the sine itself: off by a few times the share 1e-5."""
    assert departure(seed, 1e-5) < 2e-4


def test_steps_come_where_the_reference_is_half_a_step_ahead() -> None:
    """From rest with acceleration a: step k at sqrt(2 (k - 1/2) step/a), and mirrored on the way back."""
    step, a = 2.0 * math.pi / 200, 40.0
    move = {"moves": [{"to": 10.0 * step}, {"to": 0.0}], "speed": 100.0, "acceleration": a}
    times, counts = Stepping(reference=move).steps(1.0, step, 10.0)
    whole = 2.0 * math.sqrt(10.0 * step / a)
    assert counts.tolist() == [*range(1, 11), *range(9, -1, -1)]
    assert times[:5] == pytest.approx([math.sqrt(2.0 * (k - 0.5) * step / a) for k in range(1, 6)], rel=1e-13)
    assert times[5:10] == pytest.approx(whole - times[:5][::-1], rel=1e-13)
    assert times[10:] == pytest.approx(whole + times[:10], rel=1e-13)


def test_steps_of_a_sine_come_at_its_arcsines() -> None:
    times, counts = Stepping(reference={"amplitude": 2.2, "frequency": 1.0}).steps(1.0, 1.0, 1.0)
    assert counts.tolist() == [1, 2, 1, 0, -1, -2, -1, 0]
    first = [math.asin(v / 2.2) / (2.0 * math.pi) for v in (0.5, 1.5)]
    assert times == pytest.approx(
        [*first, 0.5 - first[1], 0.5 - first[0], *(0.5 + t for t in first), 1.0 - first[1], 1.0 - first[0]], rel=1e-12
    )


def test_microsteps_have_the_error_of_the_table() -> None:
    stepping = Stepping(pulses={"times": [0.1, 0.2, 0.3, 0.4], "values": [1, 1, 1, -1]}, microsteps=4, table_error=0.1)
    _, counts = stepping.steps(1.0, 1.0, 1.0)
    assert counts.tolist() == [1, 2, 3, 2]
    assert stepping.table(counts) == pytest.approx([0.25 + 0.1, 0.5, 0.75 - 0.1, 0.5], abs=1e-15)


test_a_stepper_that_makes_no_sense_is_refused = refusals_of(
    lambda change: lm.Motor(**{key: value for key, value in {**MOTOR, **change}.items() if value is not None}),
    ({"steps_per_revolution": 202}, ": multiple of 4"),
    ({"holding_torque": None}, ": lacks holding_torque"),
    ({"torque_error": 1e-12}, ": 2e-08 to 0.05 of its holding_torque"),
    ({"torque_error": T_H}, ": 2e-08 to 0.05 of its holding_torque"),
    ({"detent_torque": 1.1 * T_H}, ": below its holding_torque"),
    ({"rated_torque": 2.0}, ": of no use to a stepper; give holding_torque"),
    ({"voltage_limit": 3.0, "rated_voltage": 3.0}, ": of no use to a stepper"),
)


def test_what_turns_a_stepper_otherwise_is_refused() -> None:
    steps = {"pulses": {"times": [0.1, 0.2], "values": [1, 1]}}
    fast = {"reference": {"moves": [{"to": 1.0}], "speed": 10.0, "acceleration": 1e3}, "max_step_rate": 300.0}
    tables = lm.load("speed-axis").written.model_dump(exclude_none=True) | {"motor": MOTOR}
    refused(lambda: alone({"stepping": fast}), "command.m")
    refused(lambda: lm.Scenario(**tables), "controller")
    refused(lambda: lm.load("ball-screw-axis").without_controllers().replace(**{"command.motor": {"stepping": steps}}), "command")
    refused(lambda: lm.Motor(kind="torque_source", rotor_inertia=1e-4, detent_torque=0.1), reason='only a motor of kind "stepper"')
    refused(lambda: CommandSignal(mean=0.1, stepping=steps), reason="both turn the field")
    refused(lambda: Stepping(reference=0.0, **steps), reason="give one of reference, travel and")
    unsupplied = lm.Motor(**{k: v for k, v in NEMA_17.items() if k != "supply_voltage"})
    refused(lambda: lm.sizing.pull_out_torque(unsupplied, 400.0), "supply_voltage")
    simulation = lm.Simulation(lm.load("stepper-belt-axis", {"axis.motor.standstill_current": 0.5}), step=1e-3)
    refused(lambda: simulation.advance(0.01, command=0.01), reason="motor_command, motor_current_command")
    simulation.advance(0.5, motor_command=0.03, motor_current_command=1.0)
    assert float(simulation["motor_angle"]) == pytest.approx(0.03, abs=2e-3)


def test_current_is_reduced_after_the_delay() -> None:
    """At rest under load the error is asin(T/(s T_H))/N with the share s of the current."""
    pulses = {"pulses": {"times": [0.01, 0.02], "values": [1, -1]}, "standstill_delay": 0.1}
    found = lm.simulate(alone({"stepping": pulses}, torque=0.3 * T_H, viscous=2e-3, duration=0.4, standstill_current=0.5))
    held = -found.motor_angle.sel(time=[0.11, 0.4], method="nearest").values * N
    assert held == pytest.approx([math.asin(0.3), math.asin(0.6)], abs=3e-3)


SHORT = {
    "motor": {**MOTOR, "detent_torque": 0.01, "standstill_current": 0.5},
    "gearbox": {"ratio": 10.0, "rated_input_speed": 300.0, "rated_output_torque": 2.0}
    | {"stiffness": {"kind": "linear", "stiffness": 200.0}, "losses": {"kind": "constant_efficiency", "efficiency": 0.9}},
    "load": {"inertia": 2e-3, "viscous_friction": 0.02},
    "command": {"stepping": {"reference": {"moves": [{"to": 3.0}], "speed": 6, "acceleration": 200}, "microsteps": 16}},
    "simulation": {"duration": 0.7, "sample_interval": 1e-3},
}


def test_both_forms_of_one_drive_give_the_same_bits() -> None:
    short = lm.Scenario(**SHORT)
    a, b = lm.simulate(short), lm.simulate(short.long())
    assert np.array_equal(a.load_angle, b.load_angle)
    assert float(a.load_angle[-1]) == pytest.approx(3.0, abs=0.01)
    again = lm.Scenario.from_json(short.to_json())
    assert np.array_equal(lm.simulate(again).load_angle, a.load_angle)


def test_a_slide_moves_by_the_travel_of_its_motor() -> None:
    axis = lm.Scenario(
        axis={"motor": MOTOR, "screw": {"lead": "10 mm", "stiffness": "100 N/um"}, "slide": {"mass": 5, "friction_force": "20 N"}},
        command={"stepping": {"travel": {"moves": [{"to": "50 mm"}], "speed": "100 mm/s", "acceleration": "1 m/s^2"}, "microsteps": 16}},
        simulation={"duration": 0.9, "sample_interval": 1e-3},
    )
    assert float(lm.simulate(axis).slide_position[-1]) == pytest.approx(0.05, abs=10e-3 / 200 / 2)


def test_energy_of_a_run_that_loses_steps_closes() -> None:
    fast = {"stepping": {"reference": {"moves": [{"to": 3.0}], "speed": 6, "acceleration": 2000}, "microsteps": 16}}
    scenario = lm.Scenario(**{**SHORT, "command": fast})
    found = lm.simulate(scenario, energy=True)
    assert float(found.load_angle[-1]) < 2.9
    assert found.attrs["energy_residual"] < 1e-9


NEMA_17 = MOTOR | {"holding_torque": 0.44, "rated_current": 1.7, "resistance_phase": 1.5}
NEMA_17 |= {"inductance_phase": 2.8e-3, "supply_voltage": 24.0}


def test_the_pull_out_torque_is_the_largest_of_all_currents_within_both_limits() -> None:
    """A search over all currents i of the two-phase circuit, |i| <= sqrt(2) I and |(R + j n w L) i + j K w| <= U, at 12 speeds."""
    motor = lm.Motor(**NEMA_17)
    speeds = np.linspace(0.0, 330.0, 12)
    size, K = math.sqrt(2.0) * 1.7, 0.44 / (math.sqrt(2.0) * 1.7)
    found = lm.sizing.pull_out_torque(motor, speeds)
    part = np.linspace(-size, size, 2001)
    i = part[:, None] + 1j * part[None, :]
    for w, torque in zip(speeds, found, strict=True):
        within = (abs(i) <= size) & (abs((1.5 + 1j * 50 * w * 2.8e-3) * i + 1j * K * w) <= 24.0)
        assert torque == pytest.approx(K * max(float(i.imag[within].max()), 0.0), abs=4.0 * K * size / 2000)
    assert found[0] == pytest.approx(0.44, rel=1e-15)
    assert np.all(np.diff(found) <= 0.0)
    # Where the current is below its limit: K (U/Z - K w R/Z^2) with Z^2 = R^2 + (n w L)^2.
    w, Z = 400.0, math.hypot(1.5, 50 * 400.0 * 2.8e-3)
    plenty = lm.sizing.pull_out_torque(lm.Motor(**{**NEMA_17, "supply_voltage": 90.0}), w)
    assert float(plenty) == pytest.approx(K * (90.0 / Z - K * w * 1.5 / Z**2), rel=1e-14)


def test_lost_steps_are_those_of_an_integration_of_the_sine() -> None:
    """A field that turns at once at 90 rad/s for 0.2 s pulls the rotor out: slips of DOP853 to 1e-12, by number and instant."""
    speed, viscous = 90.0, 1e-4
    scenario = alone(
        {"ramps": [{"rise": speed * 0.2, "duration": 0.2}]}, viscous=viscous, duration=0.3, sample_interval=1e-4, torque_error=1e-5 * T_H
    )
    (found,) = lm.simulation.lost_steps(lm.simulate(scenario))

    def lag(t, phi):
        return N * (phi - speed * min(t, 0.2))

    def rate(t, x):
        return [x[1], (-T_H * math.sin(lag(t, x[0])) - viscous * x[1]) / J]

    t = np.linspace(0.0, 0.3, 30_001)
    phi = solve_ivp(rate, (0.0, 0.3), [0.0, 0.0], "DOP853", t_eval=t, rtol=1e-12, atol=1e-13, max_step=1e-4).y[0]
    period = np.floor(np.array([lag(a, b) for a, b in zip(t, phi, strict=True)]) / (2.0 * math.pi) + 0.5)
    at = np.nonzero(np.diff(period))[0]
    assert len(found.times) == at.size > 10
    assert found.lost == 4 * abs(int(period[-1]))
    assert np.abs(np.array(found.times) - t[at + 1]).max() < 3e-5


@pytest.mark.parametrize("seed", range(some(40, 10)))
def test_lost_steps_of_random_rotors_are_those_of_an_integration(seed: int) -> None:
    """Fields too fast for the rotor: number and instants of its slips by DOP853 to 1e-12. What the straight lines leave grows by slips."""
    draw = np.random.default_rng(seed)
    natural = math.sqrt(N * T_H / J)
    speed = natural / N * float(draw.uniform(1.5, 4.0))
    viscous = math.sqrt(N * T_H * J) / N * float(draw.uniform(0.01, 0.2))
    load, until = T_H * float(draw.uniform(-0.3, 0.3)), 40.0 / natural
    scenario = alone(
        {"ramps": [{"rise": speed * until, "duration": until}]},
        torque=load,
        viscous=viscous,
        duration=until,
        sample_interval=until / 20,
        torque_error=1e-6 * T_H,
    )
    (found,) = lm.simulation.lost_steps(lm.simulate(scenario))

    def rate(t, x):
        return [x[1], (-T_H * math.sin(N * (x[0] - speed * t)) - viscous * x[1] - load) / J]

    def slips(t, x):
        return math.cos(0.5 * N * (x[0] - speed * t))

    exact = solve_ivp(rate, (0.0, until), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13, max_step=until / 400, events=slips)
    assert len(found.times) == exact.t_events[0].size
    assert np.array(found.times) == pytest.approx(exact.t_events[0], abs=1e-5 * until)


@pytest.mark.parametrize("seed", range(8))
def test_lost_steps_of_random_axes_are_those_of_an_integration_from_step_to_step(seed: int) -> None:
    """Rotor and load on a gear, fields that jump by full steps: number, way and instants of slips, however far apart the samples are."""
    draw = np.random.default_rng(100 + seed)
    J_L, k, c, b = J * float(draw.uniform(0.5, 4.0)), N * T_H * float(draw.uniform(1.0, 10.0)), 1e-3, 3e-3
    speed, acceleration, until = float(draw.uniform(20.0, 40.0)), float(draw.uniform(0.9, 2.0)) * T_H / (J + J_L), 0.1
    gear = {"input": "motor", "output": "load", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": k}, "mesh_damping": c}
    scenario = lm.Scenario(
        shafts={"motor": {"inertia": 0.0}, "load": {"inertia": J_L, "viscous_friction": b}},
        motors={"m": {"shaft": "motor", **MOTOR, "torque_error": 1e-7 * T_H}},
        gears={"g": gear},
        command={"m": {"stepping": {"reference": {"moves": [{"to": 1.5}], "speed": speed, "acceleration": acceleration}}}},
        simulation={"duration": until, "sample_interval": 2e-3},
    )
    (found,) = lm.simulation.lost_steps(lm.simulate(scenario))
    steps = [(t, v) for t, v, _ in scenario.signals()["m_command"].breakpoint_list() if t < until]
    x, slips, period = np.zeros(4), [], 0
    for (begin, field), end in zip(steps, [*(t for t, _ in steps[1:]), until], strict=True):

        def rate(_, y, field=field):
            mesh = k * (y[0] - y[1]) + c * (y[2] - y[3])
            return [y[2], y[3], (-T_H * math.sin(N * (y[0] - field)) - mesh) / J, (mesh - b * y[3]) / J_L]

        def passes(_, y, field=field):
            return math.cos(0.5 * N * (y[0] - field))

        now = math.floor(N * (x[0] - field) / (2.0 * math.pi) + 0.5)
        slips += [(begin, int(math.copysign(1, now - period)))] * abs(now - period)
        run = solve_ivp(rate, (begin, end), x, "DOP853", rtol=1e-12, atol=1e-13, events=passes)
        slips += [(t, 1 if y[2] > 0.0 else -1) for t, y in zip(run.t_events[0], run.y_events[0], strict=True)]
        x = run.y[:, -1]
        period = math.floor(N * (x[0] - field) / (2.0 * math.pi) + 0.5)
    assert list(found.slips) == [way for _, way in slips]
    assert np.array(found.times) == pytest.approx([t for t, _ in slips], abs=2e-6)
    assert found.lost == 4 * abs(period)


def test_a_run_that_loses_steps_does_not_fit() -> None:
    from lostmotion.reports.run import summary, verdict_of

    scenario = lm.load(ROOT / "scenarios" / "stepper-belt-axis.toml")
    good = lm.simulate(scenario)
    assert "steps of motor: none lost" in summary(good)
    assert verdict_of(good) is None
    lost = lm.simulate(scenario.replace(**{"command.stepping.travel.acceleration": 150.0, "command.stepping.travel.speed": 0.8}))
    assert lm.simulation.lost_steps(lost)[0].times
    verdict = verdict_of(lost)
    assert verdict is not None
    assert verdict.state == "does not fit"


def test_the_belt_axis_rings_at_the_frequency_of_its_two_masses() -> None:
    """Field and belt as springs, rotor and carriage as masses: the lower frequency, from a fit behind the ramp."""
    radius = 20 * 2e-3 / (2.0 * math.pi)
    field, belt, rotor, carriage = 50 * 0.44 / radius**2, 1e5, 54e-7 / radius**2, 0.5
    matrix = np.array([[(field + belt) / rotor, -belt / rotor], [-belt / carriage, belt / carriage]])
    expected = math.sqrt(min(np.linalg.eigvals(matrix).real)) / (2.0 * math.pi)
    scenario = lm.load(ROOT / "scenarios" / "stepper-belt-axis.toml")
    found = lm.simulate(scenario.replace(**{"simulation.sample_interval": 1e-4, "command.stepping.travel.speed": 0.15}))
    t = found.time.values
    within = (t > 0.0505) & (t < 0.2)
    t, y = t[within] - 0.0505, found.slide_position.values[within]

    def left(f: float) -> float:
        wave = [np.exp(-20.0 * t) * shape(2.0 * math.pi * f * t) for shape in (np.cos, np.sin)]
        return float(np.linalg.lstsq(np.stack([np.ones_like(t), t, *wave], 1), y, rcond=None)[1][0])

    frequencies = np.arange(55.0, 80.0, 0.1)
    assert frequencies[np.argmin([left(f) for f in frequencies])] == pytest.approx(expected, rel=5e-3)


def test_a_mount_rests_while_its_worm_crosses_the_backlash() -> None:
    """12 arcsec of backlash and twice the wind-up of 0.3 N·m on 20 kN·m/rad, at 7.5205 arcsec/s, from 4 s on."""
    found = lm.simulate(lm.load(ROOT / "scenarios" / "stepper-equatorial-mount.toml"))
    arcsec = math.pi / 648_000.0
    turned = found.axis_angle.values
    rests = found.time.values[np.abs(turned - turned.max()) < 0.1 * arcsec]
    crossing = (12.0 + 2.0 * 0.3 / 20e3 / arcsec) / 7.5205
    assert rests.max() - 4.0 == pytest.approx(crossing, abs=0.15)  # a step of the field, and the periodic error


@pytest.mark.parametrize(("changes", "rule", "verdict"), [
    ({}, "lost_steps", "ok"),
    ({"command.stepping.travel.acceleration": 150.0, "command.stepping.travel.speed": 0.8}, "lost_steps", "warning"),
    ({}, "stepper_torque", "unknown"),
    ({"axis.motor.supply_voltage": 24.0}, "stepper_torque", "ok"),
    ({"axis.motor.supply_voltage": 3.0}, "lost_steps", "warning"),
    ({"axis.motor.supply_voltage": 3.0}, "stepper_torque", "warning"),
    ({"axis.motor.holding_torque": 0.12, "axis.motor.supply_voltage": 60.0}, "stepper_torque", "caution"),
    ({"command.stepping.microsteps": 1}, "step_resonance", "caution"),
    ({}, "step_resonance", "ok"),
    ({"axis.slide.mass": 5.0}, "inertia_ratio", "caution"),
])  # fmt: skip
def test_rules_of_steppers_turn(changes: dict, rule: str, verdict: str) -> None:
    findings = lm.check_drive(lm.load(ROOT / "scenarios" / "stepper-belt-axis.toml", changes))
    assert [f.verdict for f in findings if f.rule == rule] == [verdict]


def test_the_derivative_by_the_holding_torque_is_that_of_differences() -> None:
    """Central differences of step 1e-5 N·m, whose error is the third derivative's."""
    base, key, h = lm.load(ROOT / "scenarios" / "stepper-belt-axis.toml"), "axis.motor.holding_torque", 1e-5
    found = lm.simulate(base, sensitivities=[key]).slide_position_sensitivity.values.ravel()
    after, before = (lm.simulate(base.replace(**{key: 0.44 + step})).slide_position.values for step in (h, -h))
    assert np.abs(found - (after - before) / (2.0 * h)).max() < 1e-5 * np.abs(found).max()


def test_a_batch_of_steppers_makes_the_steps_of_each_alone() -> None:
    """Fields that turn by a microstep in each step, one of them with half the carriage."""
    base = lm.load("stepper-belt-axis")
    scenarios = [base, base.replace(**{"axis.slide.mass": 0.25})]
    batch, alone = lm.SimulationBatch(scenarios, step=1e-3), [lm.Simulation(s, step=1e-3) for s in scenarios]
    for k in range(60):
        field = 2.0 * math.pi / 3200 * np.array([k, 2 * k])
        batch.step(field)
        for simulation, angle in zip(alone, field, strict=True):
            simulation.advance(1e-3, command=angle)
    for name in ("slide_position", "motor_electrical_angle"):
        assert batch[name].tolist() == [simulation[name] for simulation in alone]


def test_the_live_page_draws_the_electrical_angle() -> None:
    from lostmotion.live_page.description import describe

    page = describe(lm.load("stepper-belt-axis"), "belt")
    assert [f["series"][0]["variable"] for f in page["figures"]] == ["motor_command", "motor_electrical_angle"]
    assert not [s for s in page["sliders"] if s["key"].startswith("command")]  # which would take the steps away
    assert not page["open_loop"]  # a field that swings by a radian is no command to draw a response of


def test_a_telescope_s_stepper_turns_its_axis_by_the_steps_that_its_controller_counts() -> None:
    """AstroEQ: 48 steps, 300:1 and 144:1. A step is 0.625 arcsec; at 15.041 arcsec/s the 24 that are due in the first second come each 41.55 ms."""
    arcsec = math.pi / 648_000.0
    mesh = {"stiffness": {"kind": "linear", "stiffness": 2e4}, "mesh_damping": 200.0}
    scenario = lm.Scenario(
        shafts={"motor": {"inertia": 0.0, "viscous_friction": 2e-5}, "axis": {"inertia": 2.0}},
        motors={"ra": {**MOTOR, "shaft": "motor", "steps_per_revolution": 48, "holding_torque": 0.03, "rotor_inertia": 5e-7}},
        gears={"train": {"input": "motor", "output": "axis", "ratio": 43200, **mesh}},
        command={"ra": {"stepping": {"reference": {"ramps": [{"duration": 1.0, "rise": 15.041 * arcsec}]}}}},
        simulation={"duration": 2.0, "sample_interval": 1e-3},
    )
    times = np.array([time for time, *_ in scenario.signals()["ra_command"].breakpoint_list()][1:])
    assert times.size == 24
    assert np.diff(times) == pytest.approx(np.full(23, 0.625 / 15.041), rel=1e-9)
    assert float(lm.simulate(scenario).axis_angle[-1]) == pytest.approx(24 * 0.625 * arcsec, rel=1e-4)


def test_the_lost_motion_of_an_axis_is_that_under_its_holding_torque() -> None:
    """±3 % of 0.44 N·m behind 20 teeth of 2 mm on 100 N/mm."""
    (found,) = (f for f in lm.check_drive(lm.load("stepper-belt-axis")) if f.rule == "lost_motion")
    force = 0.03 * 0.44 / (0.04 / (2.0 * math.pi))
    assert float(found.value.split()[0]) == pytest.approx(1e6 * 2.0 * force / 1e5, rel=1e-3)


def test_the_response_to_the_field_is_that_of_a_rotor_on_its_spring() -> None:
    """i w n T_H/(n T_H - w^2 J + i w b) of a field that swings by 1e-5 rad, where sine and angle differ by 1e-8 and lines and sine by 1e-7 of the holding torque."""
    b, error = 2e-3, 1e-7
    moves = {"stepping": {"reference": {"moves": [{"to": 1.0}], "speed": 2.0, "acceleration": 20.0}}}
    k, w = N * T_H, 2.0 * math.pi * np.array([1.0, 100.0, 200.0, 400.0])
    found = lm.frequency_response(alone(moves, viscous=b, torque_error=error * T_H), w / (2.0 * math.pi), 1e-5)["response"]
    exact = 1j * w * k / (k - w**2 * J + 1j * w * b)
    assert np.abs(found.sel(output="motor_speed").values[0] / exact - 1.0).max() < 1e-5


def test_a_stuck_shaft_is_explained_by_its_field_and_has_no_dead_zone_of_commands() -> None:
    said = str(lm.explain(lm.load("stepper-belt-axis"), 0.3))
    assert "its shaft follows its field, which is at 9.425 rad, in steps" in said
    assert "statics" not in said
    scenario = lm.load("stepper-belt-axis")
    response = lm.frequency_response(scenario, [5.0, 10.0], 0.01)
    assert "dead_zone_forward" not in lm.response.characteristics(response, scenario).attrs
