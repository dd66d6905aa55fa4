"""The certificate of hunting: its map against closed forms and Newton's method, and what it refuses."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.servo.hunting.limit_cycle_causes import without_backlash, without_friction
from refusals import refused

INERTIA, K_P, K_I, K_D = 0.5, 50.0, 120.0, 8.0
SLIDING = 2.0


def rotor(breakaway: float, **position: Any) -> lm.Scenario:
    """A rotor on its own with dry friction under a PID controller without a filter."""
    gains = {"gain": K_P, "integral_gain": K_I, "derivative_gain": K_D} | position
    return lm.Scenario(
        shafts={"rotor": {"friction_torque": SLIDING, "breakaway_torque": breakaway}},
        motors={"m": {"kind": "torque_source", "shaft": "rotor", "rotor_inertia": INERTIA, "rated_torque": 10.0}},
        controllers={
            "m": {"kind": "continuous", "reference": {"kind": "position", "steps": [{"time": 0.1, "height": 0.2}]}, "position": gains}
        },
        simulation={"duration": 20.0, "sample_interval": 1e-3},
    )


def slip_by_hand(error: float, excess: float) -> tuple[float, float, float]:
    """J e''' + k_d e'' + k_p e' + k_i e = 0, e(0) = error, e'(0) = 0, e''(0) = -excess/J until e' = 0 again: its duration, the error
    that is left, and the integral of the error."""
    roots = np.roots([INERTIA, K_D, K_P, K_I])
    weights = np.linalg.solve(np.vander(roots, increasing=True).T, np.array([error, 0.0, -excess / INERTIA]))

    def derivative(t: float, order: int) -> float:
        return float((weights * roots**order * np.exp(roots * t)).sum().real)

    t = 0.01
    while derivative(t, 1) < 0.0:
        t += 0.01
    low, high = t - 0.01, t
    for _ in range(60):
        t = 0.5 * (low + high)
        low, high = (t, high) if derivative(t, 1) < 0.0 else (low, t)
    return t, derivative(t, 0), derivative(t, -1) - derivative(0.0, -1)


def test_without_an_excess_each_slip_leaves_the_share_of_the_closed_form() -> None:
    """J g''' + k_d g'' + k_p g' + k_i g = 0 with g(0) = 1 and g' = g'' = 0 until g' = 0 again: the share is g there."""
    certificate = lm.hunting_certificate(rotor(SLIDING))
    duration, share, _ = slip_by_hand(1.0, 0.0)
    assert certificate.verdict == "does not hunt"
    assert certificate.factor == pytest.approx(abs(share), rel=1e-7)
    assert certificate.map is not None
    assert certificate.map["image"].values == pytest.approx(share * certificate.map["error"].values, rel=1e-9)
    assert certificate.map["slip_time"].values == pytest.approx(duration, rel=1e-6)
    assert not certificate.fixed_points


@pytest.mark.parametrize("breakaway", [2.2, 3.0, 5.0])
def test_with_an_excess_the_map_is_that_of_the_closed_form_and_hunts(breakaway: float) -> None:
    certificate = lm.hunting_certificate(rotor(breakaway))
    assert certificate.verdict == "hunts"
    assert certificate.map is not None
    assert certificate.band is not None
    for error in certificate.map["error"].values[::15]:
        one = certificate.map.sel(error=error)
        duration, left, integral = slip_by_hand(float(error), breakaway - SLIDING)
        assert float(one["image"]) == pytest.approx(left, abs=1e-10)
        assert float(one["slip_time"]) == pytest.approx(duration, rel=1e-6)
        # The torque of the integrator at the stop, from that of the break-away and the error until then; it winds up by k_i e.
        held = breakaway + K_I * integral + K_P * (left - float(error))
        room = math.copysign(breakaway, left) - held
        assert float(one["stuck_time"]) == pytest.approx(room / (K_I * left), rel=1e-5)
    (cycle,) = certificate.fixed_points
    low, high = certificate.band
    assert low < cycle.amplitude < high
    assert slip_by_hand(cycle.amplitude, breakaway - SLIDING)[1] == pytest.approx(-cycle.amplitude, rel=1e-9)


def test_the_fixed_point_is_the_limit_cycle_that_newtons_method_finds() -> None:
    scenario = lm.load("hunting-with-static-friction")
    certificate, cycle = lm.hunting_certificate(scenario), lm.servo.limit_cycle(scenario, causes=False)
    (point,) = certificate.fixed_points
    assert point.period == pytest.approx(cycle.period, rel=1e-8)
    assert point.amplitude == pytest.approx(cycle.amplitudes["servo_error"], rel=1e-9)
    assert point.multiplier == pytest.approx(np.abs(cycle.multipliers).max(), rel=1e-4)
    assert point.stable
    assert cycle.stable
    assert "stable limit cycle of 0.35196" in repr(certificate)
    axis = lm.load("ball-screw-axis").long()  # a slide and its screw are left without friction and play as shafts and gears are
    smooth, tight = without_friction(axis), without_backlash(axis)
    assert smooth is not None and tight is not None
    assert (axis.slides["slide"].friction_force > 0.0, axis.screws["screw"].backlash) == (True, 2e-6)
    assert not any(value for entry, value in lm.simulate(smooth).lm.energy.items() if "dry friction" in entry)
    assert tight.screws["screw"].backlash == 0.0
    assert without_backlash(tight) is without_friction(smooth) is None


def test_what_keeps_an_axis_from_hunting_is_named() -> None:
    """Without an integrator, or with a limit below the static friction, nothing frees the contact."""
    scenario = lm.load("hunting-with-static-friction")
    gain = {"controllers.servo.position.integral_gain": 0.0, "controllers.servo.anti_windup_time": None}
    still = lm.hunting_certificate(scenario.replace(**gain))
    assert (still.verdict, still.map) == ("does not hunt", None)
    assert "no integrator winds up" in still.reason
    held = lm.hunting_certificate(scenario.replace(**{"controllers.servo.limit": 7.5 / 50.0}))
    assert held.verdict == "does not hunt"
    assert "limit of the controller" in held.reason
    assert lm.hunting_certificate(scenario.replace(**{"controllers.servo.limit": 8.5 / 50.0})).verdict != "does not hunt"


@pytest.mark.parametrize(("changes", "reason"), [
    ({"shafts.motor.friction_torque": 0.01}, "2 dry contacts, motor_contact, table_contact"),
    ({"gravity": {"arm": {"shaft": "table", "mass": 1.0, "radius": 0.1}}}, "regime: it has gravity"),
    ({"shafts.table.stribeck_speed": 0.1}, "friction of table that varies with speed"),
    ({"controllers.servo.position.integral_gain": 80.0}, "the linear loop is unstable"),
    ({"gears.drive.stiffness": {"kind": "curve", "backlash": 1e-3, "slopes": [2e4], "breaks": []}}, "segments of drive"),
])  # fmt: skip
def test_what_is_not_decided_is_named(changes: dict[str, Any], reason: str) -> None:
    certificate = lm.hunting_certificate(lm.load("hunting-with-static-friction").replace(**changes))
    assert certificate.verdict == "not decided"
    assert reason in certificate.reason


def test_other_controllers_and_a_wrong_error_are_refused() -> None:
    refused(lambda: lm.hunting_certificate(lm.load("speed-axis")), "controllers.motor.reference.kind")
    assert "the scenario has no controller" in refused(lambda: lm.hunting_certificate(lm.load("step-to-standstill")))
    assert "largest_error: -1" in refused(lambda: lm.hunting_certificate(lm.load("hunting-with-static-friction"), largest_error=-1.0))
    assert lm.hunting_certificate(lm.load("hunting-with-static-friction"), largest_error="10 mrad").largest_error == 0.01


def test_the_command_prints_the_certificate_and_writes_its_page(tmp_path: Path) -> None:
    """The amplitude of 5.762 mrad is 19.81 arcmin; the chart has the points of the map."""
    found = CliRunner().invoke(app, ["servo", "hunting-with-static-friction", "-o", str(tmp_path)])
    assert found.exit_code == 1  # does not fit: it hunts
    assert "limit cycle    ±19.81 arcmin, 0.352 Hz, stable" in found.stdout
    certificate = lm.hunting_certificate(lm.load("hunting-with-static-friction"))
    assert certificate.map is not None
    with (tmp_path / "hunting.csv").open() as file:
        points = [(float(row["x"]), float(row["y"])) for row in csv.DictReader(file) if row["curve"] == "after the slip"]
    arcmin = np.degrees(certificate.map["image"].values) * 60.0
    assert np.array(points)[:, 1] == pytest.approx(arcmin)
    assert "From break-away to break-away" in (tmp_path / "servo.html").read_text()
    refused = CliRunner().invoke(app, ["servo", "hunting-with-static-friction", "--tune", "suited"])
    assert "--tune: for sampled controllers" in str(refused.exception)
