"""The report on the axis of a stepper without a loop."""

import csv
import math

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from refusals import refused
from tables import rated_gearbox, run_of

ARCMIN = math.pi / 10_800.0
STEPS, T_H, J, RATIO = 200, 0.5, 60e-7, 20.0
MOVES = {"moves": [{"to": 0.3}, {"to": 0.0}], "speed": 0.5, "acceleration": 5.0, "dwell": 0.3}
MOTOR = {"kind": "stepper", "rotor_inertia": J, "steps_per_revolution": STEPS, "holding_torque": T_H}


def train(backlash: float = 0.0, friction: float = 0.2, stiffness: float = 2e4, **stepping) -> lm.Scenario:
    gear = {"kind": "curve", "slopes": [stiffness], "backlash": backlash}
    return lm.Scenario(
        shafts={"motor": {"viscous_friction": 5e-3}, "load": {"inertia": 0.01, "friction_torque": friction}},
        motors={"m": {**MOTOR, "shaft": "motor"}},
        gears={"g": {"input": "motor", "output": "load", "ratio": RATIO, "stiffness": gear, "mesh_damping": 10.0}},
        command={"m": {"stepping": {"microsteps": 64, "reference": MOVES, **stepping}}},
        simulation={"duration": 2.2, "sample_interval": 1e-3},
    )


def test_stiffness_at_rest_is_the_field_and_the_gear_in_series():
    found = lm.sizing.open_loop(train())
    field = STEPS / 4 * T_H * RATIO**2
    assert found.field_stiffness == pytest.approx(field, rel=1e-12)
    assert found.stiffness == pytest.approx(1.0 / (1.0 / field + 1.0 / 2e4), rel=1e-12)


def test_resonances_are_those_of_two_masses_on_two_springs():
    """Sum and product of the squares: (k_1 + k_2)/J_1 + k_2/J_2 and k_1 k_2/(J_1 J_2)."""
    k_1, k_2, J_1, J_2 = STEPS / 4 * T_H * RATIO**2, 2e4, J * RATIO**2, 0.01
    squares = [(2.0 * math.pi * f) ** 2 for f in lm.sizing.open_loop(train()).resonances]
    assert sum(squares) == pytest.approx((k_1 + k_2) / J_1 + k_2 / J_2, rel=1e-9)
    assert math.prod(squares) == pytest.approx(k_1 * k_2 / (J_1 * J_2), rel=1e-9)


def test_the_reversal_error_is_the_backlash_and_what_friction_bends():
    """Coming to rest slowly the load stays behind by its backlash and up to 2 T_f/k of both springs."""
    plain, wide = (lm.sizing.open_loop(train(backlash)).reversal for backlash in (0.0, 5.0 * ARCMIN))
    bent = 2.0 * 0.2 / lm.sizing.open_loop(train()).stiffness
    microstep = 2.0 * math.pi / STEPS / 64 / RATIO
    assert 0.0 < plain < bent + microstep
    assert wide - 5.0 * ARCMIN == pytest.approx(0.5 * bent, abs=0.5 * bent + microstep)


def test_a_load_that_rings_settles_when_its_envelope_enters_the_window():
    """Without friction at the load the lower mode dies as exp(-b w_1^2 ...): the report names the instant from which on samples stay inside."""
    scenario, window = train(friction=0.0, stiffness=500.0).replace(**{"gears.g.mesh_damping": 0.05}), 0.3 * ARCMIN
    found = lm.sizing.open_loop(scenario, window=window)
    result = lm.simulate(scenario)
    reference = scenario.tables.command["m"].stepping.reference
    _, end = reference.intervals()[0]
    begin_next = reference.intervals()[1][0]
    t, y = result.time.values, result.load_angle.values
    rest = (t >= end) & (t <= begin_next)
    outside = t[rest][abs(y[rest] - 0.3) > window]
    assert found.settling[0] == pytest.approx(outside.max() + 1e-3 - end, abs=1e-9)
    assert found.settling[0] > 0.01


def test_the_short_form_and_an_axis_have_the_same_report():
    short = lm.Scenario(
        motor=MOTOR,
        gearbox=rated_gearbox(RATIO, 100.0, 10.0, 2e4, 1.0, inertia=0.0, viscous_friction=5e-3, mesh_damping=10.0),
        load={"inertia": 0.01, "friction_torque": 0.2},
        command={"stepping": {"microsteps": 64, "reference": MOVES}},
        simulation=run_of(2.2, 1e-3),
    )
    one, other = lm.sizing.open_loop(short), lm.sizing.open_loop(train())
    assert one.resonances == pytest.approx(other.resonances, rel=1e-9)
    assert one.settling == pytest.approx(other.settling, abs=2e-3)
    assert one.reversal == pytest.approx(other.reversal, rel=1e-3)
    axis = lm.sizing.open_loop(lm.load("stepper-belt-axis"))
    assert axis.unit == "m"
    radius = 0.04 / (2.0 * math.pi)
    field = 50 * 0.44 / radius**2
    assert axis.stiffness == pytest.approx(1.0 / (1.0 / field + 1.0 / 1e5), rel=1e-9)


def test_lost_steps_and_moves_that_do_not_settle_do_not_fit():
    lost = lm.load("stepper-belt-axis", {"command.stepping.travel.acceleration": "150 m/s^2", "command.stepping.travel.speed": "0.8 m/s"})
    assert lm.sizing.open_loop(lost).verdict.state == "does not fit"
    assert lm.sizing.open_loop(train(), window=1e-9).verdict.state == "does not fit"
    assert lm.sizing.open_loop(train(), window=1e-2).verdict.state == "fits"


@pytest.mark.parametrize("option", [["--tune", "margins"], ["--drive-units"]])
def test_what_a_loop_would_do_is_refused_with_the_reason(option: list[str]):
    answer = CliRunner().invoke(app, ["servo", "stepper-belt-axis", *option])
    assert answer.exit_code == 1
    assert "without a loop" in str(answer.exception)


def test_the_command_prints_the_report():
    answer = CliRunner().invoke(app, ["servo", "stepper-belt-axis", "--window", "50 um"])
    assert answer.exit_code == 0
    for word in ("65.19 Hz", "none lost", "settling", "reversal error"):
        assert word in answer.output


def test_the_page_has_the_error_the_lag_and_the_settling_of_each_move(tmp_path):
    answer = CliRunner().invoke(app, ["servo", "stepper-belt-axis", "-o", str(tmp_path)])
    assert answer.exit_code == 0
    page = (tmp_path / "servo.html").read_text()
    for word in ("Verdict: fits", "field before the rotor", "65.19 Hz", "Settling"):
        assert word in page
    rows = list(csv.reader((tmp_path / "open-loop.csv").read_text().splitlines()))
    found = lm.sizing.open_loop(lm.load("stepper-belt-axis"))
    error = [float(row[3]) for row in rows if row[:2] == ["error of slide", "error"]]
    assert max(map(abs, error)) == pytest.approx(1e6 * found.following)
    lag = [float(row[3]) for row in rows if row[0] == "field before the rotor"]
    assert 70.0 < max(map(abs, lag)) / found.lost.largest_lag < 90.0  # 90 degrees to a full step; samples miss some of it


def test_a_scenario_without_a_stepper_is_refused():
    assert "no stepper that follows a reference" in refused(lambda: lm.sizing.open_loop(lm.load("position-axis")))
