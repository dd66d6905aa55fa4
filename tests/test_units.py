"""A value is one number and one unit: what each text means under each key, or the sentence that refuses it."""

import math
import random
import re
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path

import pint
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import lostmotion as lm
from conftest import ROOT
from lostmotion.data_sheets.records import parse_sheets
from lostmotion.simulation.scenario.scenario_files import gearbox_from_record
from lostmotion.simulation.scenario.units_of_keys import unit_of_key
from lostmotion.units.conversion import si_factor, to_si
from lostmotion.units.grammar import PREFIXED, plain, read_unit, symbols, written
from lostmotion.units.practical import practical
from lostmotion.units.unit_table import PREFIXES, UNITS, angle_of, dimension_of, factor_of

RPM = 2.0 * math.pi / 60.0
DEG = math.pi / 180.0
POUND, OUNCE, INCH, FOOT, GRAVITY = 0.45359237, 0.028349523125, 0.0254, 0.3048, 9.80665  # their definitions, in SI

# (key of a scenario, text, value in SI)
READ = [
    # numbers
    ("load.inertia", "2 kg*m^2", 2.0),
    ("load.inertia", "  2\tkg*m^2 ", 2.0),
    ("load.inertia", "2kg*m^2", 2.0),
    ("load.inertia", "+2e-3 kg*m^2", 2e-3),
    ("load.inertia", "2.E+2 kg*m^2", 200.0),
    ("load.inertia", ".5 kg*m^2", 0.5),
    ("load.inertia", "2\u00a0kg*m^2", 2.0),  # no-break space
    ("load.inertia", "2\u202fkg\u2009m²", 2.0),  # thin spaces, raised digit
    ("initial.load_angle", "−5 deg", -5 * DEG),  # minus sign of typography
    ("initial.load_angle", "–5 deg", -5 * DEG),  # dash, as copied from a printed page
    ("initial.load_angle", "+5 deg", 5 * DEG),
    ("command.amplitude", "0.5", 0.5),
    ("command.amplitude", "5 %", 0.05),
    ("command.amplitude", "5 percent", 0.05),
    ("gearbox.hysteresis.efficiency", "93%", 0.93),
    ("initial.load_angle", "- 5 deg", -5 * DEG),
    # powers and products
    ("load.inertia", "3 kg cm^2", 3e-4),
    ("load.inertia", "3 kg*cm**2", 3e-4),
    ("load.inertia", "3 kg·cm²", 3e-4),
    ("load.inertia", "3 kgcm2", 3e-4),
    ("load.inertia", "3 kgcm²", 3e-4),
    ("load.inertia", "3 gcm2", 3e-7),
    ("load.inertia", "3 g·cm²", 3e-7),
    ("load.inertia", "3 kgm²", 3.0),
    ("load.inertia", "3 KG*CM^2", 3e-4),
    ("load.inertia", "3 lb*in^2", 3 * POUND * INCH**2),
    ("load.inertia", "3 lbm*in^2", 3 * POUND * INCH**2),
    ("load.inertia", "3 slug*ft^2", 3 * POUND * GRAVITY / FOOT * FOOT**2),
    ("load.inertia", "3 lb*in*s^2", 3 * POUND * GRAVITY * INCH),  # a force, or it would be no moment of inertia
    ("load.inertia", "3 oz-in-s^2", 3 * OUNCE * GRAVITY * INCH),
    ("load.inertia", "3 kgf*cm*s^2", 3 * GRAVITY * 0.01),
    # torques: a pound is a force here
    ("motor.rated_torque", "3 Nm", 3.0),
    ("motor.rated_torque", "3 N·m", 3.0),
    ("motor.rated_torque", "3 N.m", 3.0),
    ("motor.rated_torque", "3 N m", 3.0),
    ("motor.rated_torque", "3 mNm", 3e-3),  # not a nautical mile
    ("motor.rated_torque", "3 kNm", 3e3),
    ("motor.rated_torque", "3 Ncm", 3e-2),
    ("motor.rated_torque", "3 cNm", 3e-2),
    ("motor.rated_torque", "3 daNm", 30.0),
    ("motor.rated_torque", "3 µNm", 3e-6),
    ("motor.rated_torque", "3 Nmm", 3e-3),
    ("motor.rated_torque", "3 lb*in", 3 * POUND * GRAVITY * INCH),
    ("motor.rated_torque", "3 in-lb", 3 * POUND * GRAVITY * INCH),
    ("motor.rated_torque", "3 lbf in", 3 * POUND * GRAVITY * INCH),
    ("motor.rated_torque", "3 ft-lbs", 3 * POUND * GRAVITY * FOOT),
    ("motor.rated_torque", "3 oz*in", 3 * OUNCE * GRAVITY * INCH),
    ("motor.rated_torque", "3 oz in", 3 * OUNCE * GRAVITY * INCH),
    ("motor.rated_torque", "3 ozf*in", 3 * OUNCE * GRAVITY * INCH),
    ("motor.rated_torque", "3 kgf*cm", 3 * GRAVITY * 0.01),
    # speeds: turns
    ("motor.rated_speed", "3000 rpm", 3000 * RPM),
    ("motor.rated_speed", "1e3 rpm", 1000 * RPM),
    ("motor.rated_speed", "3000 RPM", 3000 * RPM),
    ("motor.rated_speed", "3000 1/min", 3000 * RPM),
    ("motor.rated_speed", "3000 /min", 3000 * RPM),
    ("motor.rated_speed", "3000 min^-1", 3000 * RPM),
    ("motor.rated_speed", "3000 min-1", 3000 * RPM),
    ("motor.rated_speed", "3000 min⁻¹", 3000 * RPM),
    ("motor.rated_speed", "3000 rev/min", 3000 * RPM),
    ("motor.rated_speed", "3000 r/min", 3000 * RPM),
    ("motor.rated_speed", "3000 U/min", 3000 * RPM),
    ("motor.rated_speed", "50 rev/s", 3000 * RPM),
    ("motor.rated_speed", "50 rad/s", 50.0),
    ("motor.rated_speed", "15 deg/h", 15 * DEG / 3600),
    ("initial.load_speed", "15 arcsec/s", 15 * DEG / 3600),
    # frequencies: periods
    ("command.frequency", "5 Hz", 5.0),
    ("command.frequency", "5 kHz", 5e3),
    ("command.frequency", "5 1/s", 5.0),
    ("command.frequency", "60 1/min", 1.0),
    # angles and times
    ("gearbox.stiffness.backlash", "3 arcmin", 3 * DEG / 60),
    ("gearbox.stiffness.backlash", "3′", 3 * DEG / 60),
    ("gearbox.stiffness.backlash", "3'", 3 * DEG / 60),
    ("gearbox.stiffness.backlash", "3 arcsec", 3 * DEG / 3600),
    ("gearbox.stiffness.backlash", "3″", 3 * DEG / 3600),
    ("gearbox.stiffness.backlash", "3 arc min", 3 * DEG / 60),
    ("gearbox.stiffness.backlash", "3 arc-sec", 3 * DEG / 3600),
    ("gearbox.stiffness.backlash", "3 mas", 3e-3 * DEG / 3600),
    ("gearbox.stiffness.backlash", "3 deg", 3 * DEG),
    ("gearbox.stiffness.backlash", "3°", 3 * DEG),
    ("gearbox.stiffness.backlash", "3 µrad", 3e-6),  # micro sign
    ("gearbox.stiffness.backlash", "3 μrad", 3e-6),  # Greek letter
    ("gearbox.stiffness.backlash", "3 urad", 3e-6),
    ("simulation.duration", "2 min", 120.0),  # not milli-inch
    ("simulation.duration", "2 h", 7200.0),
    ("motor.electrical_time_constant", "0.1286 ms", 0.1286e-3),
    # stiffness, damping, electrical constants
    ("gearbox.stiffness.stiffness", "23 N*m/arcmin", 23 * 10800 / math.pi),
    ("gearbox.stiffness.stiffness", "23 Nm/arcmin", 23 * 10800 / math.pi),
    ("gearbox.stiffness.stiffness", "23 Nm/'", 23 * 10800 / math.pi),
    ("gearbox.stiffness.stiffness", "23 in-lb/arcmin", 23 * POUND * GRAVITY * INCH * 10800 / math.pi),
    ("load.viscous_friction", "2 N*m*s/rad", 2.0),
    ("load.viscous_friction", "2 Nms", 2.0),
    ("load.viscous_friction", "2 kg*m^2/s", 2.0),
    ("load.viscous_friction", "2 N*m/(rad/s)", 2.0),
    ("load.viscous_friction", "2 mNm/rpm", 2e-3 / RPM),
    ("load.viscous_friction", "2 Nm/krpm", 2e-3 / RPM),
    ("load.viscous_friction", "2 Nm*min", 2.0 / RPM),  # N*m/(1/min)
    ("motor.limits.torque_constant", "40 mNm/A", 0.04),
    ("motor.limits.torque_constant", "40 mV*s/rad", 0.04),
    ("motor.limits.torque_constant", "40 V/krpm", 0.04 / RPM),
    ("motor.limits.torque_constant", "40 mV/min^-1", 0.04 / RPM),
    ("motor.limits.resistance", "3 mΩ", 3e-3),
    ("motor.limits.resistance", "3 Ω", 3.0),
    # temperatures and differences of temperatures
    ("motor.limits.max_winding_temperature", "155 degC", 155.0),
    ("motor.limits.max_winding_temperature", "155 °C", 155.0),
    ("motor.limits.max_winding_temperature", "155 deg. C", 155.0),
    ("motor.limits.thermal_resistance", "4.55 deg C/W", 4.55),
    ("motor.limits.max_winding_temperature", "300 K", 26.85),
    ("motor.limits.max_winding_temperature", "212 °F", 100.0),
    ("motor.limits.thermal_resistance", "4.55 K/W", 4.55),
    ("motor.limits.thermal_resistance", "4.55 degC/W", 4.55),
    ("motor.limits.thermal_resistance", "4.55 °C/W", 4.55),
    ("motor.limits.thermal_resistance", "1.8 °F/W", 1.0),
]

# (key of a scenario, text, what the message says)
REFUSED = [
    # decimal commas and separators, with the right spelling
    ("load.inertia", "1,2 kg*m^2", 'decimal comma; write "1.2 kg*m^2"'),
    ("load.inertia", "1,2e-3 kg*m^2", 'decimal comma; write "1.2e-3 kg*m^2"'),
    ("load.inertia", "1,2", 'write "1.2 kg*m^2"'),
    ("command.amplitude", "0,5", 'decimal comma; write "0.5"'),
    ("motor.rated_torque", "0,5 N*m", 'write "0.5 N*m"'),
    ("motor.rated_torque", "0,500 N*m", 'write "0.500 N*m"'),
    ("motor.rated_torque", "1 000 N*m", 'write "1000 N*m"'),
    ("motor.rated_torque", "1\u00a0000 N*m", 'write "1000 N*m"'),
    ("motor.rated_torque", "1\u202f000,5 N*m", 'write "1000.5 N*m"'),
    ("motor.rated_torque", "1'000 N*m", 'write "1000 N*m"'),
    ("motor.rated_torque", "1_000 N*m", 'write "1000 N*m"'),
    ("motor.rated_torque", "1.234,5 N*m", 'write "1234.5 N*m"'),
    ("motor.rated_torque", "1,234.5 N*m", 'write "1234.5 N*m"'),
    ("motor.rated_torque", "1.000.000 N*m", 'write "1000000 N*m"'),
    ("motor.rated_speed", "1,200 rpm", 'write "1.200 rpm" or "1200 rpm"'),
    ("motor.rated_speed", "5 000 1/min", 'write "5000 1/min"'),
    # expressions
    ("motor.rated_torque", "2**3 N*m", 'write its value, "8 N*m"'),
    ("motor.rated_torque", "2^3 N*m", '"8 N*m"'),
    ("motor.rated_torque", "1/2 N*m", '"0.5 N*m"'),
    ("motor.rated_torque", "2*10^3 N*m", '"2e3 N*m"'),
    ("motor.rated_torque", "1.5×10⁻³ N*m", '"1.5e-3 N*m"'),
    ("motor.rated_torque", "3+4 N*m", '"7 N*m"'),
    ("motor.rated_torque", "9**9**9**9 N*m", "not one number"),
    ("gearbox.stiffness.backlash", "3-5 arcmin", "range"),
    ("gearbox.stiffness.backlash", "3–5 arcmin", "range"),
    ("gearbox.stiffness.backlash", "≤ 3 arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "±3 arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "(3) arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "3 arcmin + 1 arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "3 4 arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "0x10 arcmin", "not known"),
    ("gearbox.stiffness.backlash", "1e5e3 arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "3°20'", "not one number"),
    ("gearbox.stiffness.backlash", "__import__('os')", "not one number"),
    ("gearbox.stiffness.backlash", "nan arcmin", "finite"),
    ("gearbox.stiffness.backlash", "inf", "finite"),
    ("gearbox.stiffness.backlash", "1e999 arcmin", "range of numbers"),
    ("gearbox.stiffness.backlash", "1e-999 arcmin", "range of numbers"),
    ("gearbox.stiffness.backlash", "", "not one number"),
    ("gearbox.stiffness.backlash", "arcmin", "not one number"),
    ("gearbox.stiffness.backlash", "٣ arcmin", "not one number"),
    ("gearbox.ratio", "100:1", "plain number"),
    ("gearbox.stiffness.backlash", "1e308 deg^1 arcmin", "something else"),
    ("motor.limits.resistance", "1e308 Mohm", "range of numbers"),
    ("motor.limits.resistance", "9" * 5000 + " ohm", "too long"),
    ("motor.limits.resistance", "5 " + "(" * 2000 + "ohm" + ")" * 2000, "too long"),
    ("load.inertia", "5x10^-4 kgm2", '"5e-4 kgm2"'),
    ("load.inertia", "5 x 10-4 kgm2", '"5e-4 kgm2"'),
    ("load.inertia", "5.0 E-4 kgm2", '"5.0e-4 kgm2"'),
    ("motor.rated_voltage", "5 MV", 'did you mean "5 mV"?'),
    ("motor.limits.torque_constant", "40 V/1000 rpm", 'did you mean "40 V/krpm"?'),
    # rotation and frequency
    ("motor.rated_speed", "50 Hz", 'write "50 rev/s" or "50 rad/s"'),
    ("motor.rated_speed", "50 1/s", 'write "50 rev/s" or "50 rad/s"'),
    ("motor.rated_speed", "50 s^-1", 'write "50 rev/s" or "50 rad/s"'),
    ("motor.rated_speed", "1.5 kHz", 'write "1500 rev/s" or "1500 rad/s"'),
    ("command.frequency", "60 rpm", 'write "1 Hz"'),
    ("load.viscous_friction", "3 N*m/Hz", 'turns or radians; write "3 N*m*s/rev" or "3 N*m*s/rad"'),
    ("motor.limits.torque_constant", "3 V/kHz", 'write "0.003 V*s/rev" or "0.003 V*s/rad"'),
    ("motor.rated_speed", "3 rad*Hz", "something else"),
    ("command.frequency", "1 rad/s", '"0.1591549 Hz" for one period in each turn, or "1 Hz"'),
    ("command.frequency", "360 deg/s", 'write "1 Hz"'),
    # the angle of a stiffness
    ("gearbox.stiffness.stiffness", "23 N*m", 'lacks the angle; write "23 N*m/rad" or "23 N*m/arcmin"'),
    ("motor.rated_torque", "23 N*m/rad", "something else"),
    ("command.amplitude", "5 rad", "something else"),
    ("gearbox.stiffness.backlash", "5 %", "something else"),
    # masses where a force is wanted
    ("motor.rated_torque", "3 kg*cm", 'write "3 kgf*cm"'),
    ("motor.rated_torque", "3 kgcm", 'write "3 kgf*cm"'),
    ("motor.rated_torque", "3 lbm*in", "something else"),
    ("motor.rated_torque", "3 kg*m^2", "something else"),
    ("load.inertia", "3 lb", "something else"),
    # other quantities, and what a unit library might take for one
    ("motor.rated_torque", "5 J", "not known"),
    ("motor.rated_torque", "3300 rpm", "something else"),
    ("motor.rated_speed", "3300", 'no unit; write it as a bare number for rad/s, or "3300 rad/s"'),
    ("simulation.duration", "3 a", "not known"),
    ("simulation.duration", "3 Gy", "not known"),
    ("command.amplitude", "5 dB", "not known"),
    ("load.inertia", "155 degC", "something else"),
    ("motor.limits.max_winding_temperature", "155 K/W", "a temperature"),
    ("motor.limits.max_winding_temperature", "155 degC^2", "a temperature"),
    # the nearest spelling
    ("motor.rated_speed", "3300 rmp", 'did you mean "3300 rpm"?'),
    ("gearbox.stiffness.backlash", "3 arcmn", 'did you mean "3 arcmin"?'),
    ("gearbox.stiffness.stiffness", "3 N*m/arcmn", 'did you mean "3 N*m/arcmin"?'),
    ("motor.rated_torque", "3 mnm", '"3 mNm" or "3 MNm"'),
    ("motor.limits.resistance", "3 Omh", 'did you mean "3 ohm"?'),
]


@pytest.mark.parametrize(("key", "text", "value"), READ)
def test_a_number_with_a_unit_is_read_by_what_its_key_measures(key: str, text: str, value: float):
    unit = unit_of_key(key)
    assert unit is not None
    assert to_si(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(("key", "text", "words"), REFUSED)
def test_what_is_not_one_number_with_a_fitting_unit_is_refused_with_the_remedy(key: str, text: str, words: str):
    unit = unit_of_key(key)
    assert unit is not None
    with pytest.raises(ValueError) as caught:
        to_si(text, unit)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    for remedy in re.findall('"([^"]*)"', str(caught.value)):
        assert math.isfinite(to_si(remedy, unit))  # what is shown as right, is


@given(st.text(max_size=30) | st.from_regex(r"[-+]?[0-9.,' ]{1,8}[eE]?[0-9]? ?[A-Za-z*/^0-9²·-]{0,8}", fullmatch=True))
def test_any_text_is_a_finite_number_or_a_sentence(text: str):
    for unit in ("", "N*m", "rad/s", "Hz", "degC", "N*m/rad"):
        try:
            assert math.isfinite(to_si(text, unit))
        except ValueError as error:
            assert len(str(error)) > 10


@given(st.integers(-(10**6), 10**6), st.integers(-6, 6))
@example(3, -7)
def test_decimal_prefixes_and_products_keep_every_digit(digits: int, exponent: int):
    assert to_si(f"{digits}e{exponent} ms", "s") == float(f"{digits}e{exponent - 3}")
    assert (to_si("3 gcm2", "kg*m^2"), to_si("5 cSt", "m^2/s"), to_si("7 mN*mm", "N*m")) == (3e-7, 5e-6, 7e-6)
    assert [practical(*x) for x in ((0.0755, "rad", 2), (12.555, "rad", 4), (1e-3, "rad", 2))] == [
        "260 arcmin",
        "43160 arcmin",
        "3.4 arcmin",
    ]


ACCELERATIONS = {"rad/s^2": 3.0, "rad/s²": 3.0, "deg/s^2": 3 * DEG, "rev/s^2": 6 * math.pi, "rpm/s": 3 * RPM, "krpm/s": 3000 * RPM}
ACCELERATIONS |= {"min-1/s": 3 * RPM, "rpm/ms": 3000 * RPM}
JERKS = {"rad/s^3": 3.0, "deg/s³": 3 * DEG, "rev/s^3": 6 * math.pi, "rpm/s^2": 3 * RPM}


def test_accelerations_and_jerks_are_read_in_turns_degrees_and_radians_and_not_without():
    for unit, texts in (("rad/s^2", ACCELERATIONS), ("rad/s^3", JERKS)):
        for text, value in texts.items():
            assert to_si(f"3 {text}", unit) == pytest.approx(value, rel=1e-14)
    for text, unit, words in (
        ("3 1/s^2", "rad/s^2", 'turns or radians; write "3 rev/s^2" or "3 rad/s^2"'),
        ("3 kHz/s", "rad/s^2", 'turns or radians; write "3000 rev/s^2" or "3000 rad/s^2"'),
        ("3 1/min^2", "rad/s^2", 'turns or radians; write "3 rev/min^2" or "3 rad/min^2"'),
        ("3 s^-3", "rad/s^3", 'turns or radians; write "3 rev/s^3" or "3 rad/s^3"'),
        ("3 rad/s^2", "rad/s^3", "something else"),
        ("3 m/s^2", "rad/s^2", "something else"),
    ):
        with pytest.raises(ValueError, match=re.escape(words)):
            to_si(text, unit)
    for unit in ("kN^999999999999", "kN^200", "mm^999999999999", "mm^-200"):
        with pytest.raises(ValueError, match="beyond the range of numbers"):
            si_factor(unit)


PINT = pint.UnitRegistry(non_int_type=Decimal)


def in_pint(units: Mapping[str, int]) -> pint.Quantity:
    """One of a product of units; within it a temperature is a difference of temperatures."""
    names = {name: f"delta_{name}" if name.startswith("degree_") else name for name in units}
    return PINT.Quantity(Decimal(1), "*".join(f"{names[name]}**{n}" for name, n in units.items()) or "dimensionless")


def test_every_unit_has_the_factor_and_the_dimension_of_pint():
    prefixed = {prefix + name for prefix, _ in PREFIXES.values() for name, _ in PREFIXED.values()}
    for name in {*UNITS, *prefixed, *(name for units in symbols().values() for name in units)}:
        expected = in_pint({name: 1}).to_base_units()
        assert factor_of({name: 1}) == expected.magnitude, name
        si = {"kg": "kilogram", "m": "meter", "s": "second", "A": "ampere", "K": "kelvin"}
        dimension = {si[base]: power for base, power in dimension_of({name: 1}).items()}
        assert dimension == {base: n for base, n in expected.unit_items() if base != "radian"}, name


def test_products_of_units_are_converted_as_by_pint():
    rng = random.Random(1)
    names = sorted({name for units in symbols().values() for name in units})
    for unit in ("N*m", "kg*m^2", "rad/s", "N*m/rad", "N*m*s/rad", "V*s/rad", "N*m/A", "K/W", "kg/m^3", "degC"):
        wanted = read_unit(unit)
        for _ in range(100):
            units: dict[str, int] = {}
            for name, power in wanted.items():
                like = [n for n in names if dimension_of({n: 1}) == dimension_of({name: 1}) and n != "hertz"]
                chosen = rng.choice([n for n in like if angle_of({n: 1}) == angle_of({name: 1})])
                units[chosen] = units.get(chosen, 0) + power
            factor = in_pint(units).to(in_pint(wanted).units).magnitude
            assert float(factor_of(units) / factor_of(wanted)) == float(factor), (units, unit)


def test_every_symbol_is_a_unit_of_the_table_and_is_written_as_it_is_read():
    for symbol, units in symbols().items():
        assert read_unit(plain(symbol)) == units, symbol
        assert read_unit(plain(written(units))) == units, symbol


def test_every_unit_of_the_schema_can_be_written():
    scenario = lm.Scenario.model_json_schema()

    def units(node: object) -> set[str]:
        if isinstance(node, dict):
            own = {node["x-unit"]} if "x-unit" in node else set()
            return own.union(*map(units, node.values()))
        return set().union(*map(units, node)) if isinstance(node, list) else set()

    sheets = [getattr(lm.data_sheets, f"{kind}Sheet") for kind in ("Gearbox", "Motor", "Screw", "Rack", "Belt", "LinearMotor")]
    found = units(scenario).union(*(units(part.model_json_schema()) for part in (*sheets, lm.PositionReference)))
    assert {"rad/s^2", "rad/s^3"} <= found
    assert {"", "N*m", "rad/s", "Hz", "degC", "K/W", "m^2/s", "kg", "N*m*s^2/rad^2"} <= found
    for unit in found:
        assert to_si(f"3 {unit}", unit) == 3.0


# --- the same everywhere ---
def doors(text: str, tmp_path: Path) -> dict[str, str]:
    """The message about a moment of inertia, wherever it is written."""
    base = ROOT / "scenarios" / "paper-2dof-nl-small.toml"
    quoted = text.replace('"', '\\"')
    (tmp_path / "s.toml").write_text(f'base = "{base}"\n[load]\ninertia = "{quoted}"\n')
    (tmp_path / "study.toml").write_text(
        f'base = "{base}"\n[[vary]]\nkey = "load.inertia"\nvalues = ["{quoted}"]\n[keep]\na = "peak(twist)"\n'
    )
    entry = {"name": "x", "kind": "other", "ratio": 10, "inertia": text}
    calls = {
        "scenario": lambda: lm.load(tmp_path / "s.toml"),
        "override": lambda: lm.load(base, [f"load.inertia={text}"]),
        "mapping": lambda: lm.load(base, {"load.inertia": text}),
        "study": lambda: lm.studies.load_study(tmp_path / "study.toml"),
        "sheet": lambda: parse_sheets({"gearbox": [entry]}, "x.toml"),
        "record": lambda: gearbox_from_record("paper-gearbox", [f"inertia={text}"]),
        "constructor": lambda: lm.Load(inertia=text),
        "replaced": lambda: lm.load(base).replace(**{"load.inertia": text}),
    }
    found = {}
    for door, call in calls.items():
        with pytest.raises(lm.InputError) as caught:
            call()
        found[door] = str(caught.value)
    return found


@pytest.mark.parametrize(("text", "sentence"), [
    ("1,2 kg*m^2", 'has a decimal comma; write "1.2 kg*m^2"'),
    ("1 000 kg*m^2", 'has separators between thousands; write "1000 kg*m^2"'),
    ("2**3 kg*m^2", 'is an expression or a range, not one number; write its value, "8 kg*m^2"'),
    ("3 rpm", 'has the unit of something else (rpm); it must be a value in kg*m^2, such as "1 kg*m^2"'),
])  # fmt: skip
def test_scenarios_studies_sheets_overrides_and_constructors_refuse_alike(text: str, sentence: str, tmp_path: Path):
    for door, message in doors(text, tmp_path).items():
        assert sentence in message, door
        assert "inertia" in message, door


def test_scenarios_studies_sheets_overrides_and_constructors_read_alike(tmp_path: Path):
    base = ROOT / "scenarios" / "paper-2dof-nl-small.toml"
    text, value = "3000 1/min", 3000 * RPM
    key = "gearbox.rated_input_speed"
    (tmp_path / "s.toml").write_text(f'base = "{base}"\n[gearbox]\nrated_input_speed = "{text}"\n')
    (tmp_path / "study.toml").write_text(f'base = "{base}"\n[[vary]]\nkey = "{key}"\nvalues = ["{text}"]\n[keep]\na = "peak(twist)"\n')
    gearbox = lm.load(base).gearbox
    (sheet,) = parse_sheets({"gearbox": [{"name": "x", "kind": "other", "ratio": 10, "rated_input_speed": text}]}, "")
    assert isinstance(sheet, lm.data_sheets.GearboxSheet)
    for found in (
        lm.load(tmp_path / "s.toml").gearbox.rated_input_speed,
        lm.load(base, [f"{key}={text}"]).gearbox.rated_input_speed,
        lm.studies.load_study(tmp_path / "study.toml").vary[0].values[0],
        sheet.rated_input_speed,
        gearbox_from_record("paper-gearbox", [f"rated_input_speed={text}"])[0].rated_input_speed,
        lm.Gearbox(**(gearbox.model_dump() | {"rated_input_speed": text})).rated_input_speed,
    ):
        assert found == pytest.approx(value, rel=1e-14)
