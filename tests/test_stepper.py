"""Steppers: closed forms of the field, the steps of a driver, forms of scenarios, the adaptive solver."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
from lostmotion.control.command import CommandSignal, Stepping
from stepper_axes import departure

J, T_H, N = 5e-6, 0.3, 50
MOTOR = {"kind": "stepper", "steps_per_revolution": 200, "holding_torque": T_H, "rotor_inertia": J}


def alone(
    command=None, torque=0.0, angle=0.0, duration=0.02, sample_interval=1e-4, viscous=0.0, **motor
) -> lm.Scenario:
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
    """sqrt(N T_H/J)/(2 pi). The chord through the rest has the slope of the sine but for h^2/48, which two widths h take away."""
    exact = math.sqrt(N * T_H / J) / (2.0 * math.pi)
    errors = [math.tan(math.pi / 8.0 / q) ** 2 for q in (40, 80)]
    coarse, fine = (frequency(error * (1.0 + 1e-9)) for error in errors)
    assert coarse / exact - 1.0 == pytest.approx((0.5 * math.pi / 40) ** 2 / 96.0, rel=1e-2)
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


def test_without_current_the_rotor_rests_in_its_detents() -> None:
    """A field of a hundredth of T_D: the rotor stays next to where it is put, at the nearest whole step."""
    step = 2.0 * math.pi / 200
    end = lm.simulate(alone(angle=3.3 * step, viscous=1e-3, duration=0.3, holding_torque=1e-4, detent_torque=0.02))
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
    assert (
        np.abs(
            lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11).motor_angle.values - exact
        ).max()
        < 1e-6 / N
    )


@pytest.mark.parametrize("seed", range(4))
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


def test_a_step_rate_beyond_that_of_the_driver_is_refused() -> None:
    command = {
        "stepping": {"reference": {"moves": [{"to": 1.0}], "speed": 10.0, "acceleration": 1e3}, "max_step_rate": 300.0}
    }
    with pytest.raises(lm.InputError, match=r"asks for 318\.3 microsteps a second") as refusal:
        alone(command)
    assert refusal.value.problems[0].keys == ("command.m",)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"steps_per_revolution": 202}, "multiple of 4"),
        ({"holding_torque": None}, "lacks holding_torque"),
        ({"torque_error": 1e-12}, "allow more"),
        ({"voltage_limit": 3.0, "rated_voltage": 3.0}, "of no use to a stepper"),
    ],
)
def test_a_stepper_that_makes_no_sense_is_refused(change: dict, text: str) -> None:
    given = {key: value for key, value in {**MOTOR, **change}.items() if value is not None}
    with pytest.raises(lm.InputError, match=text):
        lm.Motor(**given)


def test_keys_of_steppers_and_their_steps_belong_to_steppers() -> None:
    with pytest.raises(lm.InputError, match='only a motor of kind "stepper"'):
        lm.Motor(kind="torque_source", rotor_inertia=1e-4, detent_torque=0.1)
    stepping = {"stepping": {"pulses": {"times": [0.1, 0.2], "values": [1, 1]}}}
    with pytest.raises(lm.InputError, match="stepping") as refusal:
        lm.load("ball-screw-axis").without_controllers().replace(**{"command.motor": stepping})
    assert refusal.value.problems[0].keys == ("command",)


def test_current_is_reduced_after_the_delay() -> None:
    """At rest under load the error is asin(T/(s T_H))/N with the share s of the current."""
    pulses = {"pulses": {"times": [0.01, 0.02], "values": [1, -1]}, "standstill_delay": 0.1}
    found = lm.simulate(
        alone({"stepping": pulses}, torque=0.3 * T_H, viscous=2e-3, duration=0.4, standstill_current=0.5)
    )
    held = -found.motor_angle.sel(time=[0.11, 0.4], method="nearest").values * N
    assert held == pytest.approx([math.asin(0.3), math.asin(0.6)], abs=3e-3)


SHORT = {
    "motor": {**MOTOR, "detent_torque": 0.01, "standstill_current": 0.5},
    "gearbox": {
        "ratio": 10.0,
        "rated_input_speed": 300.0,
        "rated_output_torque": 2.0,
        "stiffness": {"kind": "linear", "stiffness": 200.0},
        "losses": {"kind": "constant_efficiency", "efficiency": 0.9},
    },
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
        axis={
            "motor": MOTOR,
            "screw": {"lead": "10 mm", "stiffness": "100 N/um"},
            "slide": {"mass": 5, "friction_force": "20 N"},
        },
        command={
            "stepping": {
                "travel": {"moves": [{"to": "50 mm"}], "speed": "100 mm/s", "acceleration": "1 m/s^2"},
                "microsteps": 16,
            }
        },
        simulation={"duration": 0.9, "sample_interval": 1e-3},
    )
    assert float(lm.simulate(axis).slide_position[-1]) == pytest.approx(0.05, abs=10e-3 / 200 / 2)


def test_energy_of_a_run_that_loses_steps_closes() -> None:
    fast = {"stepping": {"reference": {"moves": [{"to": 3.0}], "speed": 6, "acceleration": 2000}, "microsteps": 16}}
    scenario = lm.Scenario(**{**SHORT, "command": fast})
    found = lm.simulate(scenario, energy=True)
    assert float(found.load_angle[-1]) < 2.9
    assert found.attrs["energy_residual"] < 1e-9


def test_a_command_that_is_not_all_steps_is_refused() -> None:
    with pytest.raises(lm.InputError, match="both turn the field"):
        CommandSignal(mean=0.1, stepping={"pulses": {"times": [0.1, 0.2], "values": [1, 1]}})
    with pytest.raises(lm.InputError, match="give one of reference, travel and pulses"):
        Stepping(reference=0.0, pulses={"times": [0.1, 0.2], "values": [1, 1]})
