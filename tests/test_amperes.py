"""Whether currents are effective values or amplitudes: gains of drives, rules, columns and data sheets, by arithmetic."""

import math
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.data_sheets.accessory_sheets import AmplifierSheet
from lostmotion.data_sheets.records import catalogue
from lostmotion.model.duty import Amplifier
from lostmotion.reports.listing import record_text
from lostmotion.servo.tuning import drive_units
from lostmotion.sizing.supply import amplifier_rules
from lostmotion.studies.selection.task_file import task_of

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
        "gearbox": {
            "ratio": ratio,
            "inertia": 1e-6,
            "rated_input_speed": 300.0,
            "rated_output_torque": 50.0,
            "stiffness": {"kind": "rigid"},
            "losses": {"kind": "constant_efficiency", "efficiency": 1.0},
        },
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
