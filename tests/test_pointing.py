"""The pointing report: closed forms of pointing errors, and the removal of causes."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.pointing.budget import PointingError, View, first_gap
from lostmotion.reports.pointing import verdict_of
from refusals import refused

ROOT = Path(__file__).parent.parent
IDEAL = {"ideal": True}
FLY_BY = lm.load("tracking-constant-efficiency", {"simulation.duration": 12.0})


def rigid_axis(friction: float, controller: dict[str, Any], duration: float) -> lm.Scenario:
    """An inertia on a motor with dry friction, without delay and without encoder steps."""
    return lm.Scenario(
        motor={"kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0, "friction_torque": friction},
        gearbox={
            "ratio": 50.0, "rated_input_speed": 300.0, "rated_output_torque": 50.0, "stiffness": {"kind": "rigid"},
            "losses": {"kind": "constant_efficiency", "efficiency": 1.0},
        },
        load={"inertia": 0.5},
        controller={"sample_time": 2e-5, "delay": 0, "encoder": IDEAL} | controller,
        simulation={"duration": duration, "sample_interval": 1e-4},
    )  # fmt: skip


def test_the_axis_sticks_at_a_reversal_as_long_as_the_closed_form_says() -> None:
    # Before the reversal the motor gives i J a - F against the motion, at rest up to F holds it: it sticks until
    # i (K_p (a t + K_v a t^2/2) + K_i (a t^2/2 + K_v a t^3/6)) = 2 F - i J a.
    a, K_v, K_p, K_i, F, i = 0.4, 10.0, 0.02, 0.3, 0.08, 50.0
    J = 1e-4 + 0.5 / i**2
    reference = {
        "kind": "position", "speed": 10.0, "acceleration": a,
        "moves": [{"to": 1.6}, {"to": 0.0}],
    }  # fmt: skip
    controller = {
        "reference": reference,
        "position": {"gain": K_v, "feedforward": 1.0},
        "speed": {"gain": K_p, "integral_gain": K_i, "estimate": {"kind": "exact"}},
    }
    s = rigid_axis(F, controller, 6.0)
    turn = s.controller.reference.intervals()[0][1]

    def lacking(t: float) -> float:
        linear = K_p * (a * t + K_v * a * t**2 / 2.0) + K_i * (a * t**2 / 2.0 + K_v * a * t**3 / 6.0)
        return i * linear - (2.0 * F - i * J * a)

    stuck = brentq(lacking, 0.0, 1.0)
    r = lm.simulate(s)
    moving = r.time.values[(r.time.values > turn + 1e-3) & (r.load_speed.values != 0.0)]
    assert moving[0] - turn == pytest.approx(stuck, abs=1.2e-4 + 2e-5)
    just_before = r.time.values < moving[0] - 1e-4
    error = (s.controller.reference.at(r.time.values)[0] - r.load_angle.values)[just_before][-1]
    assert abs(error) == pytest.approx(a * stuck**2 / 2.0, rel=2e-2)


def test_a_motor_encoder_errs_by_torque_over_stiffness_in_steady_motion() -> None:
    s = lm.load("position-axis")
    w, k, b = 0.3, 2.65e4, s.load.viscous_friction
    controller = s.controller.model_dump(exclude_none=True)
    controller |= {"encoder": IDEAL, "reference": {"kind": "position", "ramps": [{"rise": 8.0 * w, "duration": 8.0}]}}
    data = s.model_dump(exclude_none=True) | {"controller": controller}
    data["gearbox"] |= {"stiffness": {"kind": "linear", "stiffness": k}, "hysteresis": None}
    scenario = lm.Scenario(**data).replace(**{"simulation.duration": 7.9})
    budget = lm.pointing_budget(scenario, after=6.0, robustness=False)
    # Reference less load: the twist, and what the position loop takes a sample too late.
    error = budget.whole["motor"]
    assert error.mean == pytest.approx(b * w / k, abs=w * 2e-4)
    # Where a sample falls on a tick, rounding decides whether the reading of before still shows.
    assert error.measured_rms == pytest.approx(b * w / k, rel=5e-3)


def test_causes_are_those_that_the_scenario_has() -> None:
    budget = lm.pointing_budget(FLY_BY, after=2.0, robustness=False)
    assert set(budget.without) == set(budget.alone)
    assert "backlash" not in budget.without
    assert {"hysteresis", "losses of the gears", "encoder steps", "dry friction"} <= set(budget.without)
    whole, left = budget.whole["motor"], budget.without["losses of the gears"]["motor"]
    assert left.peak < 0.05 * whole.peak  # what a constant efficiency does not know
    assert budget.alone["losses of the gears"]["motor"].peak > 0.5 * whole.peak
    assert budget.ideal["motor"].peak < 0.01 * whole.peak
    again = lm.pointing_budget(FLY_BY, after=2.0, robustness=False)
    assert again.whole == budget.whole
    assert again.without == budget.without


def test_a_cause_that_is_taken_away_is_the_scenario_without_it() -> None:
    budget = lm.pointing_budget(FLY_BY, after=0.0, robustness=False)
    by_hand = FLY_BY.replace(**{"gearbox.hysteresis": None})
    r = lm.simulate(by_hand)
    error = by_hand.controller.reference.at(r.time.values)[0] - r.load_angle.values
    assert budget.without["hysteresis"]["motor"].peak == pytest.approx(np.abs(error).max(), rel=1e-9)


CAMERA = lm.load("tracking-camera", {"simulation.duration": 4.0, "initial": {"on_reference": True}})


def rms_of(scenario: Any) -> float:
    """From 1 s on."""
    r = lm.simulate(scenario, energy=False)
    e = scenario.controller.reference.at(r.time.values)[0] - r.load_angle.values
    return float(np.sqrt(np.mean(e[r.time.values >= 1.0] ** 2)))


def test_contributions_add_up_and_the_last_one_leaves_what_all_leave() -> None:
    budget = lm.pointing_budget(CAMERA, after=1.0, robustness=False)
    assert list(budget.successive) == list(budget.without) == list(budget.alone)
    assert {"latency of the camera", "noise of the camera", "pixels"} <= set(budget.successive)
    parts, whole, ideal = budget.contributions("motor"), budget.whole["motor"], budget.ideal["motor"]
    assert sum(parts.values()) == pytest.approx(whole.rms**2 - ideal.rms**2, rel=1e-12)
    first = next(iter(parts))
    assert budget.successive[first] == budget.without[first]
    assert whole.rms == pytest.approx(rms_of(CAMERA), rel=1e-6)
    for name, key in (("noise of the camera", "noise"), ("latency of the camera", "latency")):
        alone = rms_of(CAMERA.replace(**{f"controller.camera.{key}": 0.0}))
        assert budget.without[name]["motor"].rms == pytest.approx(alone, rel=1e-6)
    assert budget.pixels == {"motor": 2e-4}
    assert budget.view is not None  # the camera's own
    r = lm.simulate(CAMERA, energy=False)
    missed = (CAMERA.controller.reference.at(r.time.values)[0] - r.position_reference.values)[r.time.values >= 1.0]
    assert whole.measured_rms == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-6)


def test_another_day_is_the_scenario_with_other_values_and_the_controller_does_not_know() -> None:
    s = lm.load("tracking-loss-map", {"simulation.duration": 3.0})
    ideal = {"encoder": IDEAL, "position_encoder": IDEAL | {"shaft": "load"}}  # of whose steps rounding would decide some
    s = s.replace(controller=s.controller.model_dump(exclude_none=True) | ideal)
    budget = lm.pointing_budget(s, after=1.0)
    gearbox, motor, k = s.gearbox, s.motor, s.motor.armature_voltage_constant
    lubricant, copper, flux = math.exp(-0.015 * 20.0), 1.0 + 20.0 * 3.93e-3, 1.0 - 20.0 * 2e-3
    warm, no_load = k * flux / copper, motor.rated_speed * k / (k - 1.0)
    knows = "controller.inverse_model."
    by_hand: dict[str, dict[str, Any]] = {
        "+20 K": {
            "gearbox.losses.values": [[lubricant * v for v in row] for row in gearbox.losses.values],
            "gearbox.viscous_friction": lubricant * gearbox.viscous_friction,
            "motor.friction_torque": lubricant * motor.friction_torque,
            "motor.armature_voltage_constant": warm,
            "motor.electrical_time_constant": motor.electrical_time_constant / copper,
            "motor.rated_speed": no_load / flux * (warm - 1.0) / warm,
            f"{knows}loss_factor": 1.0 / lubricant,
            f"{knows}friction_torque": motor.friction_torque,
        },
        "losses in the controller x 0.6": {f"{knows}loss_factor": 0.6},
        "wear: 1 arcmin more backlash": {"gearbox.stiffness.backlash": math.radians(1.0 / 60.0), f"{knows}twist_rate": 0.5},
    }
    assert len(budget.robustness) == 12
    for name, change in by_hand.items():
        assert budget.robustness[name]["motor"].rms == pytest.approx(rms_of(s.replace(**change)), rel=1e-5), name
    assert list(budget.speeds) == [0.25, 0.5, 1.0, 1.5, 2.0]
    fast = s.replace(**{"controller.reference.target.speed": 200.0, "initial": {"on_reference": True}})
    assert budget.speeds[2.0]["motor"].rms == pytest.approx(rms_of(fast), rel=1e-5)


def test_a_gap_is_taken_out_of_the_torsion_curve() -> None:
    gap = FLY_BY.replace(
        **{"gearbox.stiffness.slopes": (0.0, 2e4, 3e4), "gearbox.stiffness.breaks": (1e-3, 2e-3),
           "controller.inverse_model": None, "simulation.duration": 3.0}
    )  # fmt: skip
    closed = gap.replace(**{"gearbox.stiffness.slopes": (2e4, 3e4), "gearbox.stiffness.breaks": (1e-3,)})
    found = lm.pointing_budget(gap, after=0.0, robustness=False).without["backlash"]["motor"]
    assert found.peak == pytest.approx(lm.pointing_budget(closed, after=0.0, robustness=False).whole["motor"].peak, rel=1e-12)


def test_the_field_of_view_counts_time_and_probability() -> None:
    angle = 2.0 * 4e-4
    budget = lm.pointing_budget(FLY_BY, after=2.0, view={"motor": angle}, robustness=False)
    e = budget.errors["motor"][budget.time >= 2.0]
    assert budget.view is not None
    assert budget.view.share == np.mean(np.abs(e) < 4e-4)
    assert 0.0 < budget.view.share < 1.0
    between = norm.cdf(4e-4, e.mean(), e.std()) - norm.cdf(-4e-4, e.mean(), e.std())
    assert budget.view.probability == pytest.approx(between, rel=1e-12)
    assert budget.whole["motor"].probable == pytest.approx(norm.ppf(0.75) * e.std(), rel=1e-12)


def test_two_axes_in_one_scenario_are_those_of_two() -> None:
    both = lm.load("direction-finder", {"simulation.duration": 4.0})
    data = both.model_dump(exclude_none=True)
    for controller in data["controllers"].values():  # rounding may decide which of two steps an encoder shows
        controller["encoder"] = IDEAL
        controller["position_encoder"] = IDEAL | {"shaft": controller["shaft"]}
    both = type(both)(**data)
    together = lm.simulate(both, energy=False)
    for axis in ("traverse", "elevation"):
        one = dict(data)
        for table, mine in (("shafts", axis), ("motors", axis), ("gears", axis), ("controllers", axis)):
            one[table] = {name: value for name, value in data[table].items() if name.startswith(mine)}
        one["gravity"] = data["gravity"] if axis == "elevation" else {}
        one["initial"] = {"angles": {axis: data["initial"]["angles"][axis]}}
        alone = lm.simulate(type(both)(**one), energy=False)
        for variable in (f"{axis}_angle", f"{axis}_drive_torque_reference"):
            gap = np.abs(alone[variable].values - together[variable].values).max()
            assert gap <= 1e-9 * np.abs(alone[variable].values).max()


@pytest.mark.parametrize(
    ("share", "state", "said"),
    [(1.0, "fits", "all the time"), (0.97, "does not fit", "for 3 % of"), (1.0 - 2e-5, "does not fit", "for 0.002 % of")],
)
def test_a_target_that_leaves_the_view_does_not_fit(share: float, state: str, said: str) -> None:
    found = verdict_of(SimpleNamespace(lost=(), limits={}, view=View(share, 0.5)))  # type: ignore[arg-type]
    assert found is not None
    assert found.state == state
    assert said in found.lines[0]
    assert verdict_of(SimpleNamespace(lost=(), limits={}, view=None)) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("peak", "state", "said"),
    [
        (6.0e-3, "does not fit", "peak error 6 mrad, 20 % above its limit of 5 mrad"),
        (5.0e-3 * (1.0 + 1e-12), "fits", "peak error 5 mrad, within its limit of 5 mrad"),  # converted from another unit
        (4.0e-3, "fits", "peak error 4 mrad, within its limit of 5 mrad"),
    ],
)
def test_the_peak_of_an_axis_is_compared_with_its_limit(peak: float, state: str, said: str) -> None:
    whole = {"motor": PointingError(rms=1e-3, peak=peak, mean=0.0, probable=1e-3, measured_rms=0.0)}
    budget = SimpleNamespace(lost=(), orders={}, limits={"motor": 5e-3}, view=None, whole=whole, units={"motor": "rad"})
    found = verdict_of(budget)  # type: ignore[arg-type]
    assert found is not None and found.state == state
    assert said in found.lines[0]


@pytest.mark.parametrize("limit", [{"engine": 1.0}, {"motor": 0.0}, {"motor": "1 N*m"}])
def test_a_limit_of_no_axis_or_of_no_angle_is_refused(limit: dict[str, float | str]) -> None:
    refused(
        lambda: lm.pointing_budget(lm.load("tracking-loss-map", {"simulation.duration": 1.0}), limit=limit, robustness=False), match="limit"
    )


def test_the_command_writes_its_sheet(tmp_path: Path) -> None:
    changes = ["--set", "simulation.duration=3", "--view", "motor=5.27 deg"]
    done = CliRunner().invoke(app, ["track", "tracking-loss-map", "-o", str(tmp_path / "sheet"), *changes])
    assert done.exit_code == 0, done.output
    assert "without hysteresis" in done.output
    assert "rms [µrad]" in done.output
    assert "in view 100 %" in done.output
    made = {p.name for p in (tmp_path / "sheet").iterdir()}
    assert made == {"track.html", "budget.csv", "contributions.csv", "errors.csv", "speed.csv", "robustness.csv"}
    assert "http" not in (tmp_path / "sheet" / "track.html").read_text().replace("http://www.w3.org", "")


def test_a_bare_angle_of_view_is_printed_back_with_its_unit() -> None:
    """0.02 rad are 1.146 degrees, wider than the errors of the axis."""
    changes = ["--set", "simulation.duration=3", "--view", "motor=0.02"]
    done = CliRunner().invoke(app, ["track", "tracking-loss-map", *changes])
    assert done.exit_code == 0, done.output
    assert "--view motor: 0.02 rad (1.15 deg)" in done.output


@pytest.mark.parametrize(("scenario", "options", "said"), [
    ("paper-2dof-nl-small", {}, "no sampled controller"),
    ("speed-axis", {}, "not what an axis points by"),
    ("tracking-loss-map", {"after": 30.0}, "less than the duration"),
    ("tracking-loss-map", {"view": {"moter": 0.1}}, "moter"),
    ("tracking-loss-map", {"view": {"motor": -0.1}}, "above 0"),
    ("tracking-loss-map", {"view": {"motor": "5 kg"}}, "view"),
])  # fmt: skip
def test_what_does_not_fit_is_refused(scenario: str, options: dict[str, Any], said: str) -> None:
    refused(lambda: lm.pointing_budget(lm.load(scenario), **options), match=said)


def test_probable_error_is_half_of_all() -> None:
    from lostmotion.pointing.budget import PROBABLE

    assert math.erf(PROBABLE / math.sqrt(2.0)) == pytest.approx(0.5, rel=1e-15)


def test_the_start_up_transient_is_left_out_and_said_so() -> None:
    """The rms error after 2 s, long after the axes have caught up, by subtraction: not 36 times as much, as with their first jump."""
    scenario = lm.load("direction-finder")
    budget = lm.pointing_budget(scenario, robustness=False)
    r = lm.simulate(scenario, energy=False)
    error = scenario.controllers["traverse_drive"].reference.at(r.time.values)[0] - r.traverse_angle.values
    after, whole = (float(np.sqrt(np.mean(e**2))) for e in (error[r.time.values >= 2.0], error))
    assert 0.3 < budget.after < 2.0  # 5 and 34 time constants of the position loop
    assert budget.whole["traverse_drive"].rms == pytest.approx(after, rel=0.03)
    assert after < whole / 30.0
    assert f"errors count from {budget.after:.4g} s on: the start-up transient before is left out" in budget.after_line


@pytest.mark.parametrize(("times", "end"), [([], 0.0), ([0.1, 0.2, 0.8], 0.2), ([0.1, 0.55, 0.9, 1.5, 4.0], 1.5), ([0.6, 0.7], 0.0)])
def test_a_transient_ends_before_the_first_gap_as_long_as_itself(times: list[float], end: float) -> None:
    """With at least 0.5 s of quiet."""
    assert first_gap(np.array(times), 0.5) == end
