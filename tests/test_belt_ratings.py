"""Ratings of toothed belts by profile and width, in the drive check and in selections."""

import math
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.data_sheets.accessory_sheets import AmplifierSheet
from lostmotion.data_sheets.records import catalogue
from lostmotion.model.process_loads import Amplifier
from lostmotion.model.rack_and_belt import RatedBelt
from lostmotion.reports.catalogue_text import record_text
from lostmotion.servo.tuning import drive_units
from lostmotion.sizing.axis_rules import belt_rules
from lostmotion.sizing.belt_ratings import of_profile, working_tension
from lostmotion.sizing.supply import amplifier_rules
from lostmotion.studies.selection.task_file import task_of
from tables import rated_gearbox

AXIS = ROOT / "scenarios" / "stepper-belt-axis.toml"


def belt(**data) -> RatedBelt:
    return RatedBelt(**{"teeth": 20, "pitch": "5 mm", "stiffness": "1 N/um"} | data)


@pytest.mark.parametrize(
    ("profile", "width", "rated", "tooth"),
    [
        ("AT5", "16 mm", 1120.0, 56.48),  # Elatech; Synchroflex prints 1260 N, and 35.3 N/cm for 36.4
        ("at 5", "16 mm", 1120.0, 56.48),
        ("AT10", "25 mm", 3500.0, 183.75),  # Synchroflex, 73.5 N/cm
        ("AT 10 GEN III", "25 mm", 5000.0, 229.7),  # 91.88 N/cm
        ("T5", "10 mm", 360.0, 24.7),
        ("AT5", "17 mm", None, None),
        ("XYZ", "16 mm", None, None),
    ],
)
def test_a_profile_and_its_width_have_the_ratings_that_sheets_print(profile, width, rated, tooth):
    found = of_profile(belt(profile=profile, width=width, pitch="10 mm" if "10" in profile else "5 mm"))
    assert (found.rated_force, found.tooth_force) == (rated, pytest.approx(tooth) if tooth else None)


def test_ratings_that_are_given_take_the_place_of_those_of_the_profile():
    assert of_profile(belt(profile="AT5", width="16 mm", rated_force="900 N")).rated_force == 900.0


@pytest.mark.parametrize(
    ("profile", "pitch", "pounds"),
    [("GT2", 2, 25), ("GT2", 3, 114), ("GT2-3M", 3, 114), ("HTD", 5, 102), ("HTD 8M", 8, 178), ("T10", 10, 405)],
)
def test_the_working_tension_of_an_inch_is_that_of_the_handbook(profile, pitch, pounds):
    """SDP/SI prints it in pounds and in newtons, each rounded."""
    found = working_tension(belt(profile=profile, pitch=f"{pitch} mm", width="1 in"))
    assert found == pytest.approx(4.448 * pounds, rel=0.01)
    half = working_tension(belt(profile=profile, pitch=f"{pitch} mm", width="0.5 in"))
    assert half == pytest.approx(0.5 * found)


def test_an_unknown_profile_has_no_working_tension():
    assert working_tension(belt(profile="AT5", width="16 mm")) is None
    assert working_tension(belt(profile="GT2", width="6 mm", pitch="4 mm")) is None


TRAIN = """
    [shafts]
    motor = {}
    [slides]
    carriage = { mass = "0.5 kg", friction_force = "2 N" }
    [motors.m]
    shaft = "motor"
    kind = "torque_source"
    rotor_inertia = "54 g cm^2"
    rated_torque = "0.1 N m"
    [belts.x]
    input = "motor"
    output = "carriage"
    pitch = "2 mm"
    teeth = 20
    stiffness = "100 N/mm"
    damping = "30 N s/m"
    profile = "GT2"
    width = "1 in"
    [command.m]
    mean = 1.0
    [simulation]
    duration = "0.1 s"
    sample_interval = "1 ms"
"""


def findings(scenario: lm.Scenario) -> dict:
    return {f.rule: f for f in lm.check_drive(scenario) if f.rule in ("belt_force", "belt_teeth", "rack_force")}


@pytest.mark.parametrize(
    ("changes", "verdicts"),
    [
        ({}, ("unknown", "unknown")),
        ({"profile": "GT2", "width": "1 in"}, ("unknown", "ok")),
        ({"profile": "GT2", "width": "6 mm"}, ("unknown", "unknown")),  # narrower than an inch
        ({"profile": "GT2", "width": "2 mm"}, ("unknown", "warning")),  # 9.8 of 8.7 N
        ({"profile": "GT2", "width": "1 in", "teeth_in_mesh": 4}, ("unknown", "unknown")),
        ({"rated_force": "100 N", "tooth_force": "5 N"}, ("ok", "ok")),
        ({"rated_force": "19 N", "tooth_force": "0.9 N"}, ("warning", "warning")),  # 19.6 N, 9.8 of 9 N
        ({"rated_force": "19 N", "pretension": "5 N"}, ("ok", "unknown")),
        ({"tooth_force": "5 N", "teeth_in_mesh": 1}, ("unknown", "warning")),
    ],
)
def test_the_drive_check_of_an_axis_judges_its_belt(changes, verdicts):
    found = findings(lm.load(AXIS, {f"axis.belt.{key}": value for key, value in changes.items()}))
    assert tuple(found[rule].verdict for rule in ("belt_force", "belt_teeth")) == verdicts


def test_the_drive_check_of_a_train_judges_its_belt_by_the_largest_force(tmp_path):
    """Torque 0.1 N m behind 20 teeth of 2 mm: the belt swings, so that its peak is between the steady force and twice of it."""
    (tmp_path / "t.toml").write_text(TRAIN)
    scenario = lm.load(tmp_path / "t.toml")
    found = findings(scenario)["belt_teeth"]
    peak = float(abs(lm.simulate(scenario.replace(**{"simulation.sample_interval": 1e-5})).x_output_force).max())
    assert found.use == pytest.approx(peak / 111.0, rel=1e-3)
    assert found.verdict == "ok"


def test_a_record_brings_its_ratings_into_a_scenario(tmp_path):
    (tmp_path / "t.toml").write_text(
        TRAIN.replace('pitch = "2 mm"', 'from = "elatech-at5-16"')
        .replace('stiffness = "100 N/mm"', 'free_lengths = ["0.5 m", "0.5 m"]')
        .replace('profile = "GT2"\n', "")
        .replace('width = "1 in"\n', "")
    )
    found = findings(lm.load(tmp_path / "t.toml"))
    assert {f.verdict for f in found.values()} == {"ok"}
    assert "1120 N" in found["belt_force"].value
    assert "581.8 N" in found["belt_teeth"].value  # 582.4 N less what 2 rpm take


@pytest.mark.parametrize(
    ("profile", "width", "rpm", "force"),
    [
        ("AT10", "25 mm", 1000.0, 49.5),  # Synchroflex, page 57, as all figures here but the last three
        ("AT10", "25 mm", 1800.0, 41.8),
        ("AT10", "25 mm", 5000.0, 26.9),
        ("AT 10 GEN III", "25 mm", 1000.0, 61.88),
        ("AT5", "16 mm", 2000.0, 21.9),
        ("ATL5", "16 mm", 2000.0, 22.42),  # Elatech
        ("AT20", "50 mm", 1440.0, 79.16 / 1.02993),  # Elatech; the least of both sheets counts
        ("T5", "10 mm", 2400.0, 13.42),
    ],
)
def test_teeth_carry_less_at_speed_as_the_sheets_print(profile, width, rpm, force):
    """Force of ten teeth at a speed of the pulley; straight lines between the speeds that are kept are 1.5 % too high at most."""
    data = belt(profile=profile, width=width, pitch=None, teeth=None, travel_per_turn="0.2 m", teeth_in_mesh=10)
    speed = rpm / 60.0 * data.travel()
    (teeth,) = (f for f in belt_rules(np.array([10.0, 20.0]), np.array([0.0, speed]), data) if f.rule == "belt_teeth")
    cm = 100.0 * data.width
    assert teeth.use == pytest.approx(20.0 / (10.0 * cm * force), rel=0.015)
    assert f"at {rpm:.0f} rpm" in teeth.remark


def test_a_width_that_no_sheet_has_names_those_that_are():
    found = findings(lm.load(AXIS, {"axis.belt.profile": "AT10", "axis.belt.width": "12 mm", "axis.belt.pitch": "10 mm"}))
    assert "16, 25, 32, 50, 75, 100, 150 mm" in found["belt_force"].remark
    other = findings(lm.load(AXIS, {"axis.belt.profile": "AT10", "axis.belt.width": "16 mm"}))  # of 2 mm
    assert other["belt_force"].verdict == "unknown"
    assert "no sheet of AT10 with this pitch" in other["belt_force"].remark


# --- whether currents are effective values or amplitudes ---
GAIN = 0.48  # N·m/(rad/s), of scenarios/field-weakening.toml
RMS = 0.88  # N·m to one ampere rms, printed for its motor: 1FT7044-.AK7, (3/sqrt 2) p psi


def currents(lines: list[str]) -> dict[str, float]:
    """Values whose unit has amperes, by unit."""
    found = (re.match(r".{31}([\d.]+) (m?A.*?)  ", line) for line in lines)
    return {match[2].strip(): float(match[1]) for match in found if match}


def test_gains_in_amperes_of_a_synchronous_motor_are_effective_values_with_the_amplitude_beside() -> None:
    found = currents(drive_units(lm.load("field-weakening")))
    assert found == {
        "A rms/(rad/s)": pytest.approx(GAIN / RMS, rel=1e-4),
        "A peak/(rad/s)": pytest.approx(math.sqrt(2.0) * GAIN / RMS, rel=1e-4),
        "mA rms/rpm": pytest.approx(1e3 * GAIN / RMS * math.pi / 30.0, rel=1e-4),
    }


def test_the_constant_to_one_ampere_rms_is_that_of_the_flux_linkage() -> None:
    """1FT7042: (3/sqrt 2) p psi with psi = sqrt(2/3) 87 V/krpm/(104.72 p) is 1.439 N·m to one ampere rms."""
    psi = math.sqrt(2.0 / 3.0) * 87.0 / (1000.0 * 2.0 * math.pi / 60.0) / 3.0
    winding = {"poles": 6, "resistance_phase": 3.66, "inductance_phase": 21e-3, "flux_linkage": psi, "max_current_rms": 30.0}
    data = lm.load("field-weakening").model_dump(exclude_none=True)
    motor = {**data["motors"]["m"], "winding": winding}
    found = drive_units(lm.Scenario(**{**data, "motors": {"m": motor}}))
    constant = 3.0 / math.sqrt(2.0) * 3.0 * psi
    assert constant == pytest.approx(1.439, abs=5e-4)
    assert currents(found)["A rms/(rad/s)"] == pytest.approx(GAIN / constant, rel=1e-4)
    assert any("1.439 N·m/A rms" in line for line in found)


def test_gains_in_amperes_of_a_dc_motor_are_those_of_its_armature() -> None:
    """maxon EC 40 with block commutation, as its equivalent DC motor."""
    scenario = lm.load("position-axis", {"motor.limits.torque_constant": 0.05})
    found = currents(drive_units(scenario))
    gain = float(scenario.controller.speed.gain)  # type: ignore[union-attr]
    assert found == {
        "A/(rad/s)": pytest.approx(gain / 0.05, rel=1e-4),
        "mA/rpm": pytest.approx(1e3 * gain / 0.05 * math.pi / 30.0, rel=1e-4),
    }


def test_the_amplifier_of_a_synchronous_motor_is_compared_in_amperes_rms() -> None:
    motor = lm.load("field-weakening").motors["m"]
    amplifier = Amplifier(continuous_current=5.0, peak_current=10.0)
    time, current = np.linspace(0.0, 1.0, 11), np.full(11, 4.0)
    found = amplifier_rules(time, current, 1.0, amplifier, None, motor)
    assert [f.value for f in found] == ["4 of 5 A rms", "4 of 10 A rms"]


def test_the_phase_current_of_a_check_has_the_part_that_weakens_the_field() -> None:
    """i_d^2 + i_q^2 of the run, of which the torque tells i_q alone; the torque that heats alike is k_T to its rms."""
    scenario = lm.load("field-weakening").replace(**{"task.amplifier": {"continuous_current": 5.0, "peak_current": 11.0}})
    result = lm.simulate(scenario)
    rms = np.hypot(result["m_direct_current"], result["m_quadrature_current"]).values / math.sqrt(2.0)
    found = {f.rule: f for f in lm.check_drive(scenario)}
    read = {
        rule: float(re.match(r"[\d.]+", found[rule].value)[0])
        for rule in ("current", "amplifier_peak", "amplifier_current", "motor_torque")
    }  # type: ignore[index]
    assert float(np.abs(result["m_torque"]).max()) / RMS < 0.85 * rms.max()
    assert read["current"] == pytest.approx(rms.max(), rel=5e-3)  # the check samples more finely
    assert (read["amplifier_peak"], found["amplifier_peak"].verdict) == (pytest.approx(rms.max(), rel=5e-3), "warning")
    whole = math.sqrt(float(np.mean(rms**2)))
    assert read["amplifier_current"] == pytest.approx(whole, rel=1e-2)
    moving = result["time"].values <= 0.479  # the motion of the run; the rest is standstill
    assert read["motor_torque"] == pytest.approx(RMS * math.sqrt(float(np.mean(rms[moving] ** 2))), rel=2e-2)


def test_the_amplifier_of_a_torque_source_is_compared_in_the_amperes_of_its_torque_constant() -> None:
    """Amplitudes or effective values: only the sheet with that constant tells."""
    limits = {"torque_constant": 0.5, "max_current": 8.0}
    motor = lm.Motor(kind="torque_source", rotor_inertia=1e-4, rated_torque=1.0, limits=limits)
    found = amplifier_rules(
        np.linspace(0.0, 1.0, 11), np.full(11, 4.0), 1.0, Amplifier(continuous_current=5.0, peak_current=10.0), None, motor
    )
    assert all(f.what.endswith("in the amperes of motor.limits.torque_constant") for f in found)


def test_currents_and_voltages_of_a_selection_are_effective_values_beside_amplitudes() -> None:
    """1FT7044, 0.61 ohm a phase, holds 0.8 N·m nearly at rest: 0.8/0.88 A rms, across the resistance of a phase alone.

    0.01 rad/s and 0.1 rad/s^2 behind a ratio of 10 are 0.03 V of 0.8 V, and 1.5 mN·m. The rms over the cycle of 2 s hardly has them.
    """
    torque, ratio = 8.0, 10.0
    moves = {"kind": "position", "speed": 0.01, "acceleration": 0.1, "moves": [{"to": 1e-3, "dwell": 0.5}, {"to": 0.0}]}
    tables = {
        "task": {"cycle": "2 s", "max_inertia_ratio": 1e4},
        "load": {"inertia": 0.05, "torque": torque},
        "controller": {"encoder": {"ideal": True}, "reference": moves},
        "motor": {"from": "siemens-1ft7044-ak7"},
        "gearbox": rated_gearbox(ratio, 300.0, 50.0, {"kind": "rigid"}, 1.0, inertia=1e-6),
    }
    row = lm.select(task_of(tables)).isel(pair=0)
    effective = torque / ratio / RMS
    assert float(row["current_rms"]) == pytest.approx(effective, rel=1e-4)
    assert float(row["voltage_rms"]) == pytest.approx(0.61 * effective, rel=1e-3)
    assert float(row["current_peak"]) == pytest.approx(math.sqrt(2.0) * float(row["motor_torque_peak"]) / RMS, rel=1e-9)
    assert float(row["voltage_peak"]) == pytest.approx(math.sqrt(2.0) * 0.61 * effective, rel=0.06)


@pytest.mark.parametrize("record", [r for r in catalogue() if isinstance(r, AmplifierSheet)], ids=lambda r: r.name)
def test_currents_of_amplifiers_are_printed_as_effective_values(record: AmplifierSheet) -> None:
    lines = [line for line in record_text(record.name).splitlines() if re.match(r"  \w+ current ", line)]
    assert lines
    assert all(re.search(r"[\d.]+ A rms ", line) for line in lines)


def test_the_list_of_amplifiers_says_rms() -> None:
    listed = CliRunner().invoke(app, ["catalogue", "--kind", "amplifier", "--all"]).stdout
    assert listed.count(" A rms ") == len(re.findall(r" [\d.]+ A\b", listed)) > 5
