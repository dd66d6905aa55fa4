"""Ratings of toothed belts by profile and width, in the drive check and in selections."""

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.model.rack_and_belt import RatedBelt
from lostmotion.sizing.axis_rules import belt_rules
from lostmotion.sizing.belt_ratings import of_profile, working_tension

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
