"""Spectrum of periodic errors: orders and amplitudes of the errors that were put in."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import lostmotion
from refusals import refused
from tables import run_of

ARCMIN = math.radians(1.0 / 60.0)


def sine(order: int, amplitude: float) -> dict[str, Any]:
    """By straight lines about the sine, so short that the amplitude is that of the sine to 1e-7; begins at its top, so that nothing is excited."""
    return {"kind": "sine", "order": order, "amplitude": amplitude, "phase": math.pi / 2, "error": 1e-7 * amplitude}


def gear(start: str, end: str, ratio: float, error: Any) -> dict[str, Any]:
    stiff = {"kind": "linear", "stiffness": 1e6}
    return {"input": start, "output": end, "ratio": ratio, "stiffness": stiff, "transmission_error": error}


def turning(gears: dict[str, Any], duration: float, **more: Any) -> lm.Scenario:
    """A free train at constant speed: motor at 1 rad/s, nothing that brakes it.

    A shaft of inertia J on a spring k answers a displacement of frequency w with 1/(1 - w^2 J/k): with J = 1e-3 kg m2,
    k = 1e6 N m/rad and w of at most 12 rad/s by less than 2e-7.
    """
    shafts, speeds, speed = {"motor": {}}, {"motor": 1.0}, 1.0
    for g in gears.values():
        speed /= g["ratio"]
        shafts[g["output"]], speeds[g["output"]] = {"inertia": 1e-3}, speed
    motor = {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 1e-3, "rated_torque": 1.0}
    return lm.Scenario(
        shafts=shafts, motors={"m": motor}, gears=gears, initial={"speeds": speeds}, simulation=run_of(duration, 0.1), **more
    )


def test_errors_of_two_gears_are_found_with_order_amplitude_and_part() -> None:
    """Amplitude at the output: that of the first gear over the ratio of the second. Orders per turn of each shaft by the ratios."""
    first, second = 2.0 * ARCMIN, 0.5 * ARCMIN
    gears = {"bevel": gear("motor", "middle", 2.0, sine(3, first)), "worm": gear("middle", "load", 3.0, sine(1, second))}
    found = lm.spectrum(turning(gears, 80.0))
    assert found.turns == pytest.approx({"motor": 6.0, "middle": 3.0, "load": 1.0})
    a, b = found.lines
    assert a.order == pytest.approx(3.0, abs=1e-12)
    assert a.orders == pytest.approx({"motor": 3.0, "middle": 6.0, "load": 18.0})
    assert a.amplitude == pytest.approx(first / 3.0, rel=1e-6)
    assert a.cause == "tooth mesh: transmission error of bevel"
    assert b.orders == pytest.approx({"motor": 0.5, "middle": 1.0, "load": 3.0})
    assert b.amplitude == pytest.approx(second, rel=1e-6)
    assert b.cause == "worm turn: transmission error of worm"
    assert a.phase == pytest.approx(math.pi / 2, abs=1e-5)
    s = np.linspace(0.0, 2.0 * np.pi, 100_001)
    both = first / 3.0 * np.cos(6.0 * s) + second * np.cos(s)
    assert found.peak_to_peak == pytest.approx(np.ptp(both), rel=1e-3)  # of samples, whose extremes lie between
    assert found.resampling_error < 1e-6 * second


def test_a_curve_has_the_multiples_of_its_order() -> None:
    """A triangle of height A: 8 A/(pi n)^2 at odd n. Sampled, with multiples beyond those that are looked for folded back: 1e-3."""
    A = ARCMIN
    curve = {"kind": "curve", "angles": [0.0, math.pi], "errors": [A, -A]}
    found = lm.spectrum(turning({"worm": gear("motor", "load", 1.0, curve)}, 30.0))
    for n, line in zip((1, 3, 5), found.lines, strict=False):
        assert line.order == pytest.approx(n)
        assert line.amplitude == pytest.approx(8.0 * A / (math.pi * n) ** 2, rel=1e-3)
        assert line.cause == "worm turn: transmission error of worm"


def test_an_order_that_two_parts_state_is_not_decided() -> None:
    ripple = {"shaft": "motor", "amplitude": 1e-9, "order": 3, "kind": "sine"}
    gears = {"pair": gear("motor", "load", 1.0, sine(3, ARCMIN))}
    (line,) = lm.spectrum(turning(gears, 14.0, angle_torques={"ripple": ripple}), start=0.1).lines
    assert line.cause == "not decided: tooth mesh: transmission error of pair or cogging: ripple on motor"


def test_an_error_that_no_part_states_has_no_cause() -> None:
    """A position reference with a sine on it: the following error of a load on a soft spring repeats with it."""
    sines = turning({"pair": gear("motor", "load", 1.0, None)}, 20.0)
    found = lm.spectrum(sines.replace(**{"initial.speeds.load": 0.9999}))
    assert {line.cause for line in found.lines} <= {"no part states this order"}


def test_the_error_of_an_encoder_is_found_in_the_following_error() -> None:
    """The loop holds what it reads, angle + e sin(N angle), so that the load errs by e/ratio; slow beside its bandwidth: 1 %."""
    error = 5.0 * ARCMIN
    axis = {
        "sample_time": 1e-3,
        "reference": {"kind": "position", "moves": [{"to": 100.0}], "speed": 0.25, "acceleration": 100.0, "jerk": 1e5},
        "encoder": {"ideal": True, "error": error, "error_periods": 4},
        "position": {"gain": 20.0, "feedforward": 1.0},
        "speed": {"gain": 0.4, "integral_gain": 10.0, "estimate": {"kind": "difference"}},
    }
    base = turning({"pair": gear("motor", "load", 2.0, None)}, 60.0)
    scenario = lm.Scenario(**{**dict(base), "initial": {}, "controllers": {"m": axis}})
    found = lm.spectrum(scenario, start=8.0)
    assert found.against == "reference"
    assert found.lines[0].order == pytest.approx(4.0)
    assert found.lines[0].amplitude == pytest.approx(error / 2.0, rel=0.01)
    assert found.lines[0].cause == "encoder error: encoder of m on motor"


def test_what_has_no_spectrum_is_refused() -> None:
    pair = {"pair": gear("motor", "load", 1.0, sine(3, ARCMIN))}
    refused(lambda: lm.spectrum(turning(pair, 4.0)), reason="start: the motor makes 0.318 revolutions ")
    assert "the speed of motor is not constant from 1 s to 2 s" in refused(lambda: lm.spectrum(lm.load("paper-2dof-nl-small")))
    assert 'against: "load" is not known' in refused(lambda: lm.spectrum(turning(pair, 20.0), against="load"))
    assert "this axis follows no position reference" in refused(lambda: lm.spectrum(turning(pair, 20.0), against="reference"))


def test_the_command_prints_the_spectrum_and_draws_one_subject(tmp_path: Path) -> None:
    def call(*words: str) -> Any:
        return lostmotion("run", *words, cwd=tmp_path)

    lm.save(lm.simulate(turning({"pair": gear("motor", "load", 1.0, sine(3, ARCMIN))}, 20.0)), tmp_path / "run.csv")
    done = call("run.csv", "--spectrum", "--plot", "motion.svg", "--figure", "motion")
    assert done.returncode == 0, done.stderr
    assert re.search(r"transmission error of load: (119\.\d|120(\.\d)?) arcsec peak to peak", done.stdout)
    assert re.search(r"60 arcsec +3 +3 +tooth mesh: transmission error of pair", done.stdout)
    assert (tmp_path / "motion.svg").exists()
    for words, problem in ((("--figure", "energy"), "add --plot"), (("--plot", "x.png", "--figure", "all"), "take one of motion, losses")):
        refused = call("run.csv", *words)
        assert (refused.returncode, len(refused.stderr.splitlines())) == (1, 1)
        assert problem in refused.stderr


@pytest.mark.parametrize("figure", ["motion", "losses", "contacts", "energy"])
def test_each_figure_shows_its_subject(figure: str) -> None:
    from lostmotion.reports.run_charts import figure_charts

    run = lm.simulate(lm.load("paper-2dof-nl-small"))
    titles = [chart.title for chart in figure_charts(run, figure)]
    expected = {
        "motion": ["Command", "Torque of motors: motor", "Speed of load", "Torque at outputs and loads", "Twist"],
        "losses": ["Torsion and hysteresis of gearbox", "Loss map of gearbox"],
        "contacts": ["Contacts"],
        "energy": ["Energy of the whole run"],
    }[figure]
    assert titles == expected
