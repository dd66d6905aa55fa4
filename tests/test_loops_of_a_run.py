"""What a run says of its loops: true and measured errors by their names, and a loop that does not work."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.reports.page import render
from lostmotion.reports.run import run_report, summary, verdict_of
from lostmotion.reports.run_loops import loop_errors
from lostmotion.reports.servo import servo_report
from lostmotion.servo.linear_regimes import axis_of, regimes
from lostmotion.servo.margins import instability
from two_mass import two_mass

MOVES = {"kind": "position", "moves": [{"to": 0.5 * math.pi}], "speed": 4.0, "acceleration": 40.0}


SLUGGISH = {"gain": 0.05, "integral_gain": 5.0}
"""a speed loop that is slower than the position loop around it"""


def axis(speed: dict[str, Any]) -> lm.Scenario:
    """A cascade on two masses."""
    scenario = two_mass(speed | {"torque_limit": 6.0}, reference=MOVES, position={"gain": 30.0, "feedforward": 1.0})
    return scenario.replace(**{"simulation.duration": 3.0, "simulation.sample_interval": 1e-3})


def test_an_unstable_axis_says_that_it_swings_and_by_how_much_it_leaves_its_reference() -> None:
    scenario = axis(SLUGGISH)
    of = axis_of(scenario)
    assert all(instability(of, regime) is not None for regime in regimes(of))
    result = lm.simulate(scenario)
    beyond = float(result["load_angle"].max()) - 0.5 * math.pi
    assert beyond > 1.0
    text, verdict = summary(result), verdict_of(result)
    assert f"leaves the range of its reference by {math.degrees(beyond):.4g} deg" in text
    assert verdict is not None
    assert (verdict.state, verdict.exit_code) == ("does not fit", 1)
    assert verdict.lines[0] in text
    late = result["load_angle"].values[-1000:] - 0.5 * math.pi
    swing = float(re.findall(r"±([\d.]+) deg", verdict.lines[0])[0])
    assert swing == pytest.approx(math.degrees(0.5 * np.ptp(late)), rel=0.1)


@pytest.mark.parametrize("name", ["ball-screw-axis", "rack-axis-with-play"])
def test_a_motor_that_swings_within_its_backlash_is_unstable_though_its_slide_rests(name: str) -> None:
    """20 times the gain of the speed loop: the friction of the guide holds the slide, while the motor swings at its torque limit."""
    scenario = lm.load(name)
    result = lm.simulate(scenario.replace(**{"controller.speed.gain": 20.0 * scenario.controllers["motor"].speed.gain}))
    (errors,) = loop_errors(result)
    assert (errors.swing, errors.grows) == (0.0, False)
    verdict = verdict_of(result)
    assert verdict is not None
    assert verdict.state == "does not fit"
    assert "caused by the speed loop" in verdict.lines[0]


def test_a_limit_cycle_of_a_stable_loop_is_a_reservation_however_large() -> None:
    """Static friction under integral action swings on between break-aways. No requirement is missed by a run that shows it."""
    scenario = lm.load("hunting-with-static-friction")
    assert lm.servo.limit_cycle(scenario, causes=False).verdict == "hunts"
    verdict = verdict_of(lm.simulate(scenario))
    assert verdict is not None
    assert (verdict.state, verdict.exit_code) == ("fits with a reservation", 0)
    assert "does not die out" in verdict.lines[0]


SINE = {"controllers.m.reference": {"kind": "position", "amplitude": 0.1, "frequency": 2.0}}
DISTURBED = {"shafts.load.torque": {"amplitude": 1.0, "frequency": 3.0}}


@pytest.mark.parametrize("changes", [{}, SINE, DISTURBED])
def test_a_loop_that_works_gets_no_verdict_of_a_run(changes: dict[str, Any]) -> None:
    """Nor does an error that swings as an input does, which never comes to rest."""
    scenario = axis({"gain": 1.1, "integral_gain": 45.0}).replace(**changes)
    result = lm.simulate(scenario)
    assert verdict_of(result) is None
    unstable = verdict_of(lm.simulate(axis(SLUGGISH).replace(**changes)))
    assert unstable is not None
    assert unstable.state == "does not fit"


def test_both_errors_of_a_speed_are_at_the_shaft_of_its_reference() -> None:
    """The encoder on the motor turns 100 times as fast as the load, whose speed the reference is."""
    result = lm.simulate(lm.load("speed-axis"))
    (errors,) = loop_errors(result)
    assert errors.measured is not None
    ratio = lm.load("speed-axis").gearbox.ratio
    read = (result["speed_reference"].values - result["measured_speed"].values) / ratio
    np.testing.assert_allclose(errors.measured, read, rtol=1e-12)
    assert np.abs(errors.measured).max() == pytest.approx(np.abs(errors.true).max(), rel=0.2)


def test_an_error_that_grows_while_the_reference_moves_on_is_said_to_diverge() -> None:
    ramp = {"reference": {"kind": "position", "samples": {"times": [0.0, 10.0], "values": [0.0, 0.1]}}}
    verdict = verdict_of(lm.simulate(two_mass(SLUGGISH, position={"gain": 30.0}, **ramp), duration=2.0, sample_interval=1e-3))
    assert verdict is not None
    assert verdict.lines[0].startswith("unstable: the position error of m diverges, up to ")


def test_an_axis_whose_motion_leaves_the_range_of_numbers_is_said_to_be_unstable_with_the_loop_that_causes_it(tmp_path: Path) -> None:
    """A speed loop of 40 times the gain of the stable one has a pole outside the unit circle; no limit holds its motion."""
    scenario = axis({"gain": 44.0, "integral_gain": 45.0}).replace(**{"controllers.m.speed.torque_limit": None})
    assert all(instability(axis_of(scenario), regime) is not None for regime in regimes(axis_of(scenario)))
    with pytest.raises(lm.SolverError, match=r"^unstable: .* a pole of magnitude .*caused by the speed loop"):
        lm.commission(scenario)


@pytest.fixture(scope="module")
def shipped() -> Any:
    return lm.simulate(lm.load("position-axis"))


def test_true_and_measured_errors_have_their_names(shipped: Any) -> None:
    """The true error by the load's angle, the measured one by the encoder on the motor, which does not see the twist."""
    reference = lm.load("position-axis").controller.reference.at(shipped["time"].values)[0]
    errors = {
        "true (reference less load)": reference - shipped["load_angle"].values,
        "measured (reference less encoder on motor)": shipped["position_reference"].values - shipped["measured_position"].values,
    }
    page = render(run_report("position-axis", shipped))
    for name, error in errors.items():
        peak, last = (f"{x * 10800.0 / math.pi:.4g} arcmin" for x in (np.abs(error).max(), error[-1]))
        line = f"position error, {name}: at most {peak}, at the end {last}"
        for text in (summary(shipped), shipped.lm.summary(), page):
            assert line in text


def test_pages_of_run_and_servo_give_no_name_to_both_errors(shipped: Any) -> None:
    titles = [
        {panel.title for group in page.groups() for panel in group.charts if "rror" in panel.title}
        for page in (run_report("position-axis", shipped), servo_report("position-axis", lm.commission(lm.load("position-axis"))))
    ]
    assert titles == [{"Measured following error"}, {"following error over the run, reference less true value"}]


def test_the_command_ends_with_the_exit_code_of_its_verdict(tmp_path: Path) -> None:
    from test_servo import lostmotion

    stable = lostmotion("run", "position-axis", cwd=tmp_path)
    assert (stable.returncode, "Verdict" in stable.stdout) == (0, False)
    unstable = lostmotion("run", "position-axis", "--set", "controller.position.gain=2000 1/s", cwd=tmp_path)
    assert unstable.stdout.splitlines()[-1].startswith("Verdict: ")
    assert unstable.returncode == (1 if "does not fit" in unstable.stdout else 0)
