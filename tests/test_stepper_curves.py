"""Torques of steppers over the step rate: closed forms, an own integration, all forms of scenarios, the command line."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.sizing.pull_out_curves import _Axis
from refusals import refused

J, T_H, N = 5e-6, 0.3, 50
STEP = 2.0 * math.pi / (4 * N)
MOTOR = {"kind": "stepper", "steps_per_revolution": 4 * N, "holding_torque": T_H, "rotor_inertia": J}
RESOLUTION = 1.05 * T_H / 2**8


def rotor(viscous: float = 0.0, microsteps: int | None = None, **motor) -> lm.Scenario:
    """A rotor alone; without microsteps its field turns evenly."""
    stepping = {"stepping": {"reference": 0.0, "microsteps": microsteps}} if microsteps else {}
    return lm.Scenario(
        shafts={"motor": {"inertia": 0.0, "viscous_friction": viscous}},
        motors={"m": {"shaft": "motor", **MOTOR, **motor}},
        command={"m": stepping},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )


def test_a_rotor_in_step_holds_its_holding_torque() -> None:
    """The load takes 30 periods to rise, and swings the rotor by less than 1 %."""
    curves = lm.sizing.stepper_curves(rotor(), [200.0, 3000.0])
    assert curves.pull_out_torque_of_runs.values == pytest.approx(T_H, abs=0.01 * T_H)
    assert curves.pull_out_torque.values.tolist() == [T_H, T_H]


def test_the_pull_in_torque_of_runs_is_that_of_the_pendulum() -> None:
    """Without damping the energy decides; without a load up to 2 sqrt(T_H/(N J)), 2205 steps a second."""
    most = 2.0 * math.sqrt(T_H / (N * J)) / STEP
    curves = lm.sizing.stepper_curves(rotor(), [900.0, 0.99 * most, 1.01 * most])
    assert curves.pull_in_torque_of_runs.values == pytest.approx(curves.pull_in_torque.values, abs=RESOLUTION)
    assert curves.pull_in_torque.values[1] > 0.0
    assert curves.pull_in_torque.values[2] == curves.pull_in_torque_of_runs.values[2] == 0.0


@pytest.mark.parametrize("rate", [300.0, 1200.0])
def test_the_pull_in_torque_of_full_steps_is_that_of_an_integration(rate: float) -> None:
    """DOP853 to 1e-12 from step to step, with friction that brakes and holds; halved as the function does."""
    viscous, period = 1e-4, 2.0 * math.pi / math.sqrt(N * T_H / J)

    def slips(friction: float) -> bool:
        until, x, t, count = max(20.0 * period, 40.0 / rate), np.zeros(2), 0.0, 0
        while t < until:
            end = min((count + 0.5) / rate, until)  # a step comes where the reference is half of one ahead
            while t < end:
                drive = -T_H * math.sin(N * (x[0] - count * STEP))
                way = math.copysign(1.0, x[1] if x[1] != 0.0 else drive)
                if x[1] == 0.0 and abs(drive) <= friction:
                    break
                x[1] = x[1] or way * 1e-9  # past the event that has ended its motion

                def rate_of(_, y, goal=count * STEP, way=way):
                    return [y[1], (-T_H * math.sin(N * (y[0] - goal)) - viscous * y[1] - way * friction) / J]

                def stops(_, y, way=way):
                    return way * y[1] if friction > 0.0 else 1.0

                stops.terminal, stops.direction = True, -1.0
                found = solve_ivp(rate_of, (t, end), x, "DOP853", rtol=1e-12, atol=1e-12, events=stops)
                t, x = float(found.t[-1]), found.y[:, -1].copy()
                if abs(N * (x[0] - count * STEP)) > math.pi:
                    return True
                if found.status == 1:
                    x[1] = 0.0
            t, count = end, count + 1
            if abs(N * (x[0] - count * STEP)) > math.pi:
                return True
        return False

    low, high = 0.0, 1.05 * T_H
    for _ in range(0 if slips(0.0) else 8):  # 300 steps a second are near the 276 Hz of the rotor
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slips(middle) else (middle, high)
    found = lm.sizing.stepper_curves(rotor(viscous, microsteps=1, torque_error=1e-5 * T_H), [rate])
    assert float(found.pull_in_torque_of_runs[0]) == pytest.approx(low, abs=1.01 * RESOLUTION)


@pytest.mark.parametrize("share", [0.5, 0.97, 1.3])
def test_the_swing_is_that_of_a_linear_rotor_under_the_steps(share: float) -> None:
    """Microsteps of 1/16 are a sawtooth of harmonics step/(16 pi k); the rotor answers each by w0^2/(w0^2 - k^2 w^2 + i k w b/J)."""
    viscous, w0 = 1e-3, math.sqrt(N * T_H / J)
    w = share * w0  # of the microsteps
    t = np.linspace(0.0, 2.0 * math.pi / w, 4001)
    k = np.arange(1, 2000)[:, None]
    answer = w0**2 / (w0**2 - (k * w) ** 2 + 1j * k * w * viscous / J)
    swing = np.imag(answer * np.exp(1j * k * w * t) / (16.0 * math.pi * k)).sum(0)
    found = _Axis.of(rotor(viscous, microsteps=16), "m").swing(w / (2.0 * math.pi * 16.0))  # without the other curves
    assert found == pytest.approx(0.5 * (swing.max() - swing.min()), rel=0.03)


FORMS = {
    "short": {
        "motor": MOTOR,
        "gearbox": {
            "ratio": 10,
            "rated_input_speed": 300.0,
            "rated_output_torque": 3.0,
            "stiffness": {"kind": "linear", "stiffness": 500.0},
            "losses": {"kind": "constant_efficiency", "efficiency": 1.0},
        },
        "load": {"inertia": 3e-4},
    },
    "axis": {"axis": {"motor": MOTOR, "screw": {"lead": "10 mm", "stiffness": "50 N/um"}, "slide": {"mass": 1.0}}},
    "long": {
        "shafts": {"rotor": {"inertia": 0.0}, "load": {"inertia": 3e-4}},
        "motors": {"m": {"shaft": "rotor", **MOTOR}},
        "gears": {"g": {"input": "rotor", "output": "load", "ratio": 10}},
    },
}


@pytest.mark.parametrize("form", FORMS)
def test_curves_are_made_of_every_form(form: str) -> None:
    scenario = lm.Scenario(**FORMS[form], simulation={"duration": 1.0, "sample_interval": 1e-3})
    curves = lm.sizing.stepper_curves(scenario, 400.0)
    assert float(curves.pull_out_torque_of_runs[0]) == pytest.approx(T_H, rel=0.03)
    assert float(curves.pull_in_torque_of_runs[0]) == pytest.approx(float(curves.pull_in_torque[0]), rel=0.1)


def test_the_command_prints_the_curves_and_writes_them(tmp_path: Path) -> None:
    table, figure = tmp_path / "curves.csv", tmp_path / "curves.png"
    words = ["steps", str(ROOT / "scenarios" / "stepper-belt-axis.toml"), "--rates", "300.0,900.0"]
    done = CliRunner().invoke(app, [*words, "-o", str(table), "--plot", str(figure)])
    assert done.exit_code == 0, done.output
    names, units, *rows = csv.reader(table.read_text().splitlines())
    assert names[0] == "step_rate"
    assert units == ["Hz", "N*m", "N*m", "N*m", "N*m", "1"]
    assert [float(row[0]) for row in rows] == [300.0, 900.0]
    assert figure.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("scenario", "rates", "text"),
    [
        ("paper-2dof-nl-small", [100.0], 'no motor of kind "stepper"'),
        ("stepper-belt-axis", [0.0], "must lie between 10 and 1e"),
        ("stepper-belt-axis", "fast", "must be numbers"),
    ],
)
def test_curves_that_make_no_sense_are_refused(scenario: str, rates, text: str) -> None:
    refused(lambda: lm.sizing.stepper_curves(lm.load(ROOT / "scenarios" / f"{scenario}.toml"), rates), match=text)
