"""Axes that point by a stepper without a loop: errors by cause and by order."""

import math

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from refusals import refused

ARCSEC = math.pi / 648_000.0
STEPS, T_H, J, RATIO = 400, 0.44, 68e-7, 144.0
FULL_STEP = 2.0 * math.pi / STEPS
SPEED = 0.02  # of the axis [rad/s]


def reference(duration: float, speed: float = SPEED) -> dict:
    return {"ramps": [{"duration": 2.0 * duration, "rise": 2.0 * duration * speed}]}


def mount(
    duration: float = 5.0, microsteps: int = 16, table_error: float = 0.0, detent: float = 0.0, worm: float = 0.0, **gear
) -> lm.Scenario:
    """A motor with damping near the critical one, and a light axis behind a worm."""
    error = {"transmission_error": {"kind": "sine", "amplitude": worm, "order": 1}} if worm else {}
    return lm.Scenario(
        shafts={"motor": {"viscous_friction": 0.02}, "axis": {"inertia": 1e-3}},
        motors={
            "ra": {
                "shaft": "motor",
                "kind": "stepper",
                "rotor_inertia": J,
                "steps_per_revolution": STEPS,
                "holding_torque": T_H,
                "detent_torque": detent,
            }
        },
        gears={
            "worm": {
                "input": "motor",
                "output": "axis",
                "ratio": RATIO,
                "stiffness": {"kind": "linear", "stiffness": 2e4},
                "mesh_damping": 20.0,
                **error,
                **gear,
            }
        },
        command={"ra": {"stepping": {"microsteps": microsteps, "table_error": table_error, "reference": reference(duration)}}},
        simulation={"duration": duration, "sample_interval": 1e-3},
    )


def carried(order: float) -> float:
    """How much of a swing of the field at an order of the motor the axis makes: rotor in its field, then axis on its mesh."""
    s, k = 1j * SPEED * RATIO * order, STEPS / 4 * T_H
    rotor = 1.0 / (1.0 + s * 0.02 / k + s * s * (J + 1e-3 / RATIO**2) / k)
    return abs(rotor * (1.0 + s * 20.0 / 2e4) / (1.0 + s * 20.0 / 2e4 + s * s * 1e-3 / 2e4))


def line(found: lm.response.Spectrum, cause: str):
    return next(one for one in found.lines if cause in one.cause)


def test_the_error_of_the_worm_is_a_line_of_its_amplitude_at_the_order_of_its_turns():
    found = lm.spectrum(mount(worm=10.0 * ARCSEC))
    worm = line(found, "transmission error of worm")
    assert worm.order == pytest.approx(1.0, rel=1e-9)
    assert worm.orders["axis"] == pytest.approx(RATIO, rel=1e-9)
    assert worm.amplitude == pytest.approx(10.0 * ARCSEC, rel=2e-3)


def test_microsteps_are_a_sawtooth_at_their_order():
    """The first harmonic of a sawtooth of the height q is q/pi."""
    found = line(lm.spectrum(mount(microsteps=4)), "microsteps of ra")
    assert found.order == pytest.approx(4 * STEPS, rel=1e-9)
    assert found.amplitude == pytest.approx(FULL_STEP / 4 / RATIO / math.pi * carried(4 * STEPS), rel=0.02)


def test_the_error_of_a_sine_table_is_a_line_at_the_order_of_full_steps():
    """A sine that is held over sixteenths of its period has sinc(1/16) of its amplitude."""
    found = line(lm.spectrum(mount(microsteps=16, table_error=0.05)), "sine table")
    assert found.order == pytest.approx(STEPS, rel=1e-9)
    expected = 0.05 * FULL_STEP / RATIO * carried(STEPS) * float(np.sinc(1.0 / 16.0))
    assert found.amplitude == pytest.approx(expected, rel=0.01)


def test_detents_are_a_line_at_the_order_of_full_steps():
    """T_D sin(4 n phi) bends the field by T_D/(n T_H), at full steps and slow speed."""
    found = line(lm.spectrum(mount(microsteps=16, detent=0.02 * T_H)), "detents")
    assert found.order == pytest.approx(STEPS, rel=1e-9)
    assert found.amplitude == pytest.approx(0.02 / (STEPS / 4) / RATIO, rel=0.1)


def test_the_short_form_and_the_axis_have_the_same_lines_as_the_train():
    motor = {"kind": "stepper", "rotor_inertia": J, "steps_per_revolution": STEPS, "holding_torque": T_H}
    short = lm.Scenario(
        motor=motor,
        gearbox={
            "ratio": RATIO,
            "inertia": 0.0,
            "viscous_friction": 0.02,
            "rated_output_torque": 10.0,
            "rated_input_speed": 100.0,
            "stiffness": {"kind": "linear", "stiffness": 2e4},
            "mesh_damping": 20.0,
            "losses": {"kind": "constant_efficiency", "efficiency": 1.0},
        },
        load={"inertia": 1e-3},
        command={"stepping": {"microsteps": 4, "reference": reference(5.0)}},
        simulation={"duration": 5.0, "sample_interval": 1e-3},
    )
    axis = lm.Scenario(
        axis={
            "motor": motor,
            "belt": {"travel_per_turn": 2.0 * math.pi / RATIO, "stiffness": 2e8, "damping": 2e4},
            "slide": {"mass": 1e-3, "viscous_friction": 0.02 * RATIO**2},
        },
        command={"stepping": {"microsteps": 4, "travel": reference(5.0)}},
        simulation={"duration": 5.0, "sample_interval": 1e-3},
    )
    wanted = line(lm.spectrum(mount(microsteps=4)), "microsteps")
    for scenario, rel in ((short, 1e-3), (axis, 0.02)):  # the friction of the axis is behind its spring
        found = line(lm.spectrum(scenario), "microsteps")
        assert found.order == pytest.approx(wanted.order, rel=1e-9)
        assert found.amplitude == pytest.approx(wanted.amplitude, rel=rel)


def test_microsteps_worm_and_detents_are_causes_with_their_shares():
    """The rms of the worm is 10 arcsec/sqrt(2), that of the first harmonic of microsteps q/pi/sqrt(2) as the axis makes it."""
    budget = lm.pointing_budget(mount(microsteps=16, detent=0.02 * T_H, worm=10.0 * ARCSEC), after=1.0, robustness=False)
    assert {"microsteps", "detents", "transmission error"} <= set(budget.without)
    alone = budget.alone["microsteps"]["ra"]
    spread = math.sqrt(alone.rms**2 - alone.mean**2)
    assert spread == pytest.approx(FULL_STEP / 16 / RATIO / math.pi * carried(16 * STEPS) / math.sqrt(2.0), rel=0.1)
    assert budget.contributions("ra")["transmission error"] == pytest.approx(0.5 * (10.0 * ARCSEC) ** 2, rel=0.2)
    assert budget.units == {"ra": "rad"}


def test_a_slow_axis_has_the_rounding_of_its_microsteps_exactly():
    """At 1/20 of that speed the rotor follows each step at once."""
    scenario = mount(duration=20.0, microsteps=4).replace(**{"command.ra.stepping.reference": reference(20.0, SPEED / 20.0)})
    budget = lm.pointing_budget(scenario, after=2.0, robustness=False)
    error = budget.whole["ra"]
    assert math.sqrt(error.rms**2 - error.mean**2) == pytest.approx(FULL_STEP / 4 / RATIO / math.sqrt(12.0), rel=0.02)


def test_the_driver_counts_what_its_field_turns():
    """What the driver believes is the reference rounded to microsteps: the measured error is what is between field and axis."""
    budget = lm.pointing_budget(mount(microsteps=4), after=1.0, robustness=False)
    assert float(np.abs(budget.errors["ra"] + budget.measured["ra"]).max()) == pytest.approx(0.5 * FULL_STEP / 4 / RATIO, rel=0.01)


def test_a_mount_that_loses_steps_does_not_fit():
    from lostmotion.reports.pointing import verdict_of

    fast = mount(duration=0.5, microsteps=1).replace(**{"command.ra.stepping.reference": reference(0.5, 3.0)})
    budget = lm.pointing_budget(fast, robustness=False)
    verdict = verdict_of(budget)
    assert verdict is not None
    assert verdict.state == "does not fit"
    assert "full steps lost" in str(verdict)


def test_the_report_of_a_mount_is_in_arcsec_and_lists_its_orders(tmp_path):
    from lostmotion.reports.pages import write_report
    from lostmotion.reports.pointing import header, order_rows, pointing_report

    budget = lm.pointing_budget(mount(worm=10.0 * ARCSEC), after=1.0, robustness=False)
    assert "rms [arcsec]" in header(budget)
    first = order_rows(budget)[0]
    assert float(first[1]) == pytest.approx(10.0, rel=2e-3)
    page = write_report(tmp_path / "track", pointing_report("mount", budget), ())
    assert "Error at constant speed by order" in page.read_text()


def test_a_short_run_says_why_it_has_no_orders():
    budget = lm.pointing_budget(lm.load(ROOT / "scenarios" / "stepper-equatorial-mount.toml"), robustness=False)
    assert "whole one is needed" in str(budget.orders["stepper"])
    assert budget.alone["transmission error"]["stepper"].peak < budget.alone["backlash"]["stepper"].peak


def test_a_stepper_under_pulses_has_no_reference_to_point_by():
    scenario = mount().replace(**{"command.ra.stepping": {"pulses": {"times": [0.1, 0.2], "values": [1, 1]}, "microsteps": 4}})
    assert "command.stepping" in refused(lambda: lm.pointing_budget(scenario))
