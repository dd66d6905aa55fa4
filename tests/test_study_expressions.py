"""Expressions of what a study keeps: their units, and that the docs name all they may use."""

import pytest

from conftest import ROOT
from lostmotion.study_expressions import FUNCTIONS, OF_THE_RUN, read_expression
from lostmotion.units import registry


@pytest.mark.parametrize(
    ("expression", "unit"),
    [
        ("mean(input_contact == 0)", "1"),
        ("(output_torque * motor_speed).integrate('time')", "N*m*rad"),
        ("sqrt(mean(output_torque**2))", "N*m"),
        ("peak(output_torque) / peak(twist)", "N*m/rad"),
        ("bandwidth(0.1)", "Hz"),
        ("bandwidth(amplitude=0.1)", "Hz"),
        ("dead_time(load_angle, share=0.05)", "s"),
        ("energy.source - energy.load_work", "J"),
        ("peak(load_speed - ideal_speed)", "rad/s"),
        ("peak(twist) * 1e6", ""),  # of what may be a change of unit nothing is claimed
        ("peak(twist) + peak(load_speed)", ""),
    ],
)
def test_an_expression_has_the_unit_of_what_it_gives(expression: str, unit: str):
    parse = registry().Unit
    found = read_expression(expression).unit
    assert (found == "") == (unit == "")
    assert parse("" if found == "1" else found.replace("^", "**")) == parse("" if unit == "1" else unit)


def test_the_page_on_studies_names_all_that_an_expression_may_use():
    page = (ROOT / "docs" / "studies.md").read_text()
    for name in (*FUNCTIONS, *OF_THE_RUN):
        assert f"`{name}" in page
