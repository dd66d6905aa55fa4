"""Linear motors as candidates of a task: printed sizing examples, the arithmetic of a spreadsheet, runs against the long form."""

import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.model.angle_torques import STANDARD_GRAVITY as G
from lostmotion.studies.runs.candidate_rows import Axes
from lostmotion.studies.selection.task_file import task_of
from lostmotion.studies.study.study_definition import Study
from refusals import refusals_of

SCALE = {"grating_period": "20 um", "bits": 10}
MOVES = {
    "kind": "position",
    "speed": "1.875 m/s",
    "acceleration": "14.0625 m/s^2",
    "moves": [{"to": "0.5 m", "dwell": "0.35 s"}, {"to": "0 m"}],
}
TASK: dict[str, Any] = {
    "task": {"cycle": "1.5 s", "settling_window": "10 um"},
    "slide": {"mass": "5 kg", "friction_coefficient": 0.01},
    "controller": {"encoder": {"bits": 20}, "position_encoder": SCALE, "reference": MOVES},
    "candidates": {"linear_motor": ["inoprec-lmc88-130"]},
}
# Inoprec, LMC88-130, as printed.
COIL, K_F, PULL = 0.8, 26.7, 300.0
R_LINES, L_LINES, PITCH = 2.0, 23.8e-3, 0.014


def changed(**changes: Any) -> dict[str, Any]:
    return {**TASK, **{key: TASK[key] | value for key, value in changes.items()}}


def rules(study: Study, row: int = 0) -> dict[str, Any]:
    return {f.rule: f for f in Axes(study).judged(study.parameters(row, row + 1)[0])}


def test_the_sizing_example_that_hiwin_prints(tmp_path):
    """HIWIN MM99TE07-1701, p. 116: 5 kg in all, mu 0.01, 33.8 N/A, 1.8 A: 70.79 N, 41.92 N, 1.24 A, 68.89 %."""
    sheet = tmp_path / "coil.toml"
    sheet.write_text(
        '[[linear_motor]]\nname = "coil"\nkind = "ironless"\nmass = "1 kg"\nforce_constant = "33.8 N/A"\nrated_current = "1.8 A"\n'
    )
    tables = changed(slide={"mass": "4 kg"}, candidates={"linear_motor": [str(sheet)]})
    study = task_of(tables)
    found = rules(study)
    force = found["motor_torque"].use * 1.8 * 33.8
    assert force == pytest.approx(41.92, abs=0.02)
    assert force / 33.8 == pytest.approx(1.24, abs=5e-3)
    assert found["motor_torque"].use == pytest.approx(0.6889, abs=2e-3)
    peak = 5.0 * 14.0625 + 0.01 * 5.0 * G
    assert found["current"].value.startswith(f"{peak / 33.8:.4g} A")
    assert peak == pytest.approx(70.79, abs=0.02)
    assert {"inertia_ratio", "guide_friction"} & set(found) == set()


def test_forces_voltage_and_heat_of_a_record():
    """Attraction presses on the guide; at the end of the acceleration the voltage of a phase is largest."""
    found = rules(task_of(TASK))
    friction = 0.01 * ((5.0 + COIL) * G + PULL)
    peak = (5.0 + COIL) * 14.0625 + friction
    assert 187.0 * found["motor_peak_torque"].use == pytest.approx(peak, rel=1e-9)
    third = 0.5 / 1.875 / 2.0
    brake = friction - (5.0 + COIL) * 14.0625
    square = third * (peak**2 + friction**2 + brake**2) / (3.0 * third + 0.35)
    assert 96.0 * found["motor_torque"].use == pytest.approx(math.sqrt(square), rel=1e-6)
    psi = K_F / (1.5 * math.sqrt(2.0))  # V s/m, amplitude of a phase
    current = peak / (1.5 * psi)
    u_q = 0.5 * R_LINES * current + psi * 1.875
    u_d = math.pi / PITCH * 1.875 * 0.5 * L_LINES * current
    assert 310.0 / math.sqrt(3.0) * found["voltage"].use == pytest.approx(math.hypot(u_q, u_d), rel=1e-6)
    assert 10.8 * found["current"].use == pytest.approx(peak / K_F, rel=1e-9)


def test_the_supply_limits_the_speed():
    """At 60 V the voltage of a phase ends at 34.6 V, below what the example needs."""
    found = rules(task_of(changed(task={"supply": {"min_voltage": "60 V"}})))
    assert found["voltage"].verdict == "warning"
    assert found["voltage"].use == pytest.approx(310.0 / 60.0 * rules(task_of(TASK))["voltage"].use, rel=1e-9)


def test_attraction_on_a_guide_of_unknown_friction_is_not_judged():
    study = task_of({**TASK, "slide": {"mass": "5 kg", "friction_force": "1 N"}})
    found = rules(study)["guide_friction"]
    assert found.verdict == "unknown"
    assert "300 N" in found.what
    assert "slide.friction_coefficient" in found.remark


def test_a_payload_presses_on_the_guide():
    study = task_of(changed(task={"payload": [{"begin": "0.4 s", "end": "1 s", "mass": "2 kg"}]}))
    assert study.scenario.load.friction_torque == pytest.approx(0.01 * 7.0 * G)
    tilted = task_of(changed(slide={"inclination": "60 deg"}, task={"hold_without_power": False}))
    assert tilted.scenario.load.friction_torque == pytest.approx(0.01 * 5.0 * G * 0.5)


@pytest.mark.parametrize("slope", [0.0, 30.0, 90.0])
def test_the_coils_ride_on_the_guide(slope: float):
    """They are accelerated, weigh on the guide and along its slope, and the brake holds them: 5 kg and 0.8 kg alike."""
    tables = changed(slide={"inclination": f"{slope} deg"}, task={"brake": {"force": "60 N"}})
    found, mass = rules(task_of(tables)), 5.0 + COIL
    along, across = mass * G * math.sin(math.radians(slope)), mass * G * math.cos(math.radians(slope))
    peak = mass * 14.0625 + 0.01 * (across + PULL) + along
    assert 187.0 * found["motor_peak_torque"].use == pytest.approx(peak, rel=1e-9)
    assert 60.0 * found["holding_brake"].use == pytest.approx(along, rel=1e-9, abs=1e-9)


def test_a_vertical_linear_motor_needs_a_brake_on_its_slide():
    tables = changed(slide={"inclination": "90 deg"})
    missing = rules(task_of(tables))["holding_brake"]
    assert missing.verdict == "unknown"
    assert "task.brake.force" in missing.remark
    braked = rules(task_of({**tables, "task": tables["task"] | {"brake": {"force": "60 N"}}}))["holding_brake"]
    # The brake holds the slide and the coils that ride on it.
    assert 60.0 * braked.use == pytest.approx((5.0 + COIL) * G, rel=1e-9)


def test_a_run_is_that_of_the_long_form_and_its_energy_closes():
    study = task_of(TASK)
    row = study.parameters(0, 1)[0]
    scenario = study.axis_at(row, 2)
    short = lm.simulate(scenario, energy=False)
    slide = {"mass": 5.0, "friction_force": 0.01 * ((5.0 + COIL) * G + PULL)}
    train = lm.Scenario(
        slides={"slide": slide},
        linear_motors={"coil": {"slide": "slide", "mass": COIL, "rated_force": 96.0, "peak_force": 187.0}},
        controllers={"coil": scenario.controller.model_dump(exclude_none=True) | {"shaft": "slide"}
                     | {key: SCALE | {"shaft": "slide"} for key in ("encoder", "position_encoder")}},
        simulation=scenario.simulation.model_dump(),
    )  # fmt: skip
    long = lm.simulate(train, energy=False)
    assert np.abs(short["load_angle"].values).max() > 0.49
    assert short["load_angle"].values == pytest.approx(long["slide_position"].values, abs=1e-9)
    columns, _ = Axes(study).measured(row)
    force = long["coil_force"].values if "coil_force" in long else long["coil_torque"].values
    here = long["time"].values >= 1.5
    assert columns["motor_force_peak"] == pytest.approx(np.abs(force[here]).max(), rel=1e-6)
    assert "motor_torque_peak" not in columns
    # Energy taken less returned = friction work + copper, 1.5 R_line I_rms^2.
    heat = 1.5 * R_LINES / K_F**2 * columns["motor_force_rms"] ** 2 * 1.5
    work = slide["friction_force"] * 1.0
    assert columns["energy"] - columns["energy_returned"] == pytest.approx(heat + work, rel=5e-3)


def test_linear_motors_are_ranked_beside_pairs():
    study = lm.studies.load_task(ROOT / "examples" / "tasks" / "pick-and-place.toml")
    assert study.total == 2 + 4
    rows = study.parameters(0, 6)
    assert np.isnan(rows[:2, 1]).all()
    assert np.isnan(rows[2:, 0]).all()
    assert rows[2:, 1].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert np.array_equal(study.parameters(3, 5), rows[3:5], equal_nan=True)
    pairs = lm.select(study)
    names = [str(m) or str(c) for m, c in zip(pairs["motor"].values, pairs["linear_motor"].values, strict=True)]
    assert set(names[:3]) == {"inoprec-lmc88-100", "inoprec-lmc88-130", "inoprec-map1-46-100"}
    fits = dict(zip(names, pairs["fits"].values.tolist(), strict=True))
    assert fits["yaskawa-sgmsh-10aa"]
    assert not fits["inoprec-mai1-55-120"]
    assert "motor force" in str(pairs["why"].values[names.index("inoprec-mai1-55-120")])
    assert math.isnan(pairs["motor_torque_rms"].values[0])
    assert math.isnan(pairs["motor_force_rms"].values[names.index("yaskawa-sgmsh-10aa")])


def test_all_linear_motors_where_none_is_named():
    study = task_of({key: value for key, value in TASK.items() if key != "candidates"} | {"linear_motor": {}})
    assert study.total == sum(isinstance(r, lm.data_sheets.LinearMotorSheet) for r in lm.catalogue())
    beside = task_of({**TASK, "linear_motor": {"friction_force": "2 N"}})
    assert rules(beside)["motor_peak_torque"].use == pytest.approx(rules(task_of(TASK))["motor_peak_torque"].use + 2.0 / 187.0, rel=1e-9)


test_bad_tasks_of_linear_motors_are_refused = refusals_of(
    lambda change: rules(task_of(TASK | change)),
    ({"controller": {"encoder": {"bits": 20}, "reference": MOVES}}, "controller.position_encoder: a linear motor needs a scale"),
    ({"linear_motor": {"mas": "1 kg"}}, "linear_motor.mas"),
    ({"slide": {"mass": "5 kg", "friction_coefficient": -0.1}}, "slide.friction_coefficient"),
    ({"task": {"cycle": "1.5 s", "brake": {"force": "60 N", "inertia": 1.0}}}, "task.brake: leave the inertia out"),
    ({"task": {"cycle": "1.5 s", "brake": {"inertia": 1.0}}}, "task.brake: needs torque, force of a brake"),
)  # fmt: skip
