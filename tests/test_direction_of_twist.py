"""Stiffness that depends on the direction of twist: closed forms of half periods, the torque law, energy, both solvers."""

import ctypes as c
import math

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused
from test_c_interface import OK, library  # noqa: F401
from test_description import Scenario

K, BACKWARD, J = 200.0, 2.25, 0.5


def periods() -> tuple[float, float]:
    """Half periods [s] of an inertia J on the two sides of the curve."""
    return math.pi * math.sqrt(J / K), math.pi * math.sqrt(J / (K * BACKWARD))


def swing(amplitude: float, t: np.ndarray) -> np.ndarray:
    """Angle of that inertia, released at an angle > 0: half periods of both sides in turn, with one speed at angle 0."""
    one, other = periods()
    turn = np.mod(t + 0.5 * one, one + other)
    w = math.pi / one
    forward = amplitude * np.sin(w * turn)
    back = -amplitude / math.sqrt(BACKWARD) * np.sin(w * math.sqrt(BACKWARD) * (turn - one))
    return np.where(turn < one, forward, back)


def on_spring() -> lm.Scenario:
    curve = {"kind": "curve", "slopes": [f"{K} N*m/rad"], "backward": BACKWARD}
    return lm.Scenario(
        shafts={"arm": {"inertia": J}},
        springs={"bar": {"shaft": "arm", "stiffness": curve}},
        initial={"angles": {"arm": "0.1 rad"}},
        simulation={"duration": 3.0 * sum(periods()), "sample_interval": 0.003},
    )


@pytest.mark.parametrize(("solver", "error"), [("exact", 1e-13), ("dormand-prince", 1e-7)])
def test_an_arm_on_a_spring_swings_by_half_periods_of_both_directions(solver: str, error: float) -> None:
    result = lm.simulate(on_spring(), solver=solver)
    assert result.arm_angle.values == pytest.approx(swing(0.1, result.time.values), abs=error)


def test_the_twist_of_a_gearbox_swings_by_half_periods_in_the_short_form() -> None:
    rotor, ratio, load = 2e-4, 50.0, 0.75
    scenario = lm.Scenario(
        motor={"kind": "torque_source", "rotor_inertia": rotor, "rated_torque": 1.0},
        gearbox={
            "ratio": ratio,
            "rated_input_speed": 300.0,
            "rated_output_torque": 50.0,
            "stiffness": {"kind": "curve", "slopes": [K], "backward": BACKWARD},
            "losses": {"kind": "constant_efficiency", "efficiency": 1.0},
        },
        load={"inertia": load},
        initial={"twist": 0.01},
        simulation={"duration": 1.0, "sample_interval": 0.002},
    )
    own = 1.0 / (1.0 / load + 1.0 / (rotor * ratio**2))
    stretched = math.sqrt(J / own)
    for what in (scenario, lm.Scenario(**scenario.long().model_dump())):
        result = lm.simulate(what)
        twist = result.twist if "twist" in result else result.gearbox_twist
        assert twist.values == pytest.approx(swing(0.01, stretched * result.time.values), abs=1e-10)


def test_gap_and_preload_hold_in_each_direction() -> None:
    curve = lm.model.TorsionCurve(slopes=(100.0, 300.0), breaks=(0.02,), backward=2.0)
    gap = lm.model.TorsionCurve(slopes=(100.0, 300.0), breaks=(0.02,), backward=2.0, backlash=0.01)
    tight = lm.model.TorsionCurve(slopes=(100.0, 300.0), breaks=(0.02,), backward=2.0, preload=2.0)
    for d in (0.001, 0.015, 0.02, 0.05):
        forward = 100.0 * d if d <= 0.02 else 2.0 + 300.0 * (d - 0.02)
        assert curve.torque(d) == pytest.approx(forward, rel=1e-14)
        assert curve.torque(-d) == pytest.approx(-2.0 * forward, rel=1e-14)
        assert gap.torque(d + 0.005) == pytest.approx(forward, rel=1e-12)
        assert gap.torque(-d - 0.005) == pytest.approx(-2.0 * forward, rel=1e-12)
        assert gap.torque(0.004) == gap.torque(-0.004) == 0.0
        # The preload of 2 N m is reached at 20 mrad forward, at 10 mrad backward.
        assert tight.torque(d) == pytest.approx(300.0 * d, rel=1e-14)
        assert tight.torque(-d) == pytest.approx(-200.0 * d if d <= 0.01 else -2.0 - 600.0 * (d - 0.01), rel=1e-12)
    for what in (curve, gap, tight):
        core = what.core()
        for torque in (-7.0, -1.0, 0.5, 11.0):
            assert what.torque(core.twist(torque)) == pytest.approx(torque, rel=1e-13)


def test_both_solvers_agree_with_backlash_and_hysteresis_in_each_direction() -> None:
    scenario = lm.load("paper-2dof-nl-large").replace(
        **{"gearbox.stiffness.backward": 1.5, "simulation.duration": 0.5, "simulation.sample_interval": 0.01}
    )
    exact, stepped = (lm.simulate(scenario, solver=solver) for solver in ("exact", "dormand-prince"))
    for name in ("motor_speed", "load_speed", "twist", "output_torque"):
        size = float(np.abs(exact[name].values).max())
        assert stepped[name].values == pytest.approx(exact[name].values, abs=1e-5 * size)
    odd = lm.simulate(scenario.replace(**{"gearbox.stiffness.backward": 1.0}))
    assert float(np.abs(odd.twist.values - exact.twist.values).max()) > 1e-5


def test_what_takes_one_curve_for_both_directions_refuses_it() -> None:
    drive = lm.load("paper-2dof-nl-large").replace(**{"gearbox.stiffness.backward": 1.5})
    assert "differs between the two directions of twist" in refused(drive.gearbox.stiffness.pieces)
    assert "backward: 0.0 must be greater than 0" in refused(lambda: lm.model.TorsionCurve(slopes=[1.0], backward=0.0))


def test_the_half_periods_follow_from_the_derivative_by_the_factor() -> None:
    key = "springs.bar.stiffness.backward"
    result = lm.simulate(on_spring(), sensitivities=[key])
    # Behind the first half period angle and speed are those of the closed form, whose differences are good to 1e-6.
    h = 1e-5
    one, other = (lm.simulate(on_spring().replace(**{key: BACKWARD + s * h})).arm_angle.values for s in (1.0, -1.0))
    assert result.arm_angle_sensitivity.sel(parameter=key).values == pytest.approx((one - other) / (2.0 * h), abs=1e-6)


def test_programs_without_python_run_and_change_it(library: c.CDLL) -> None:  # noqa: F811
    scenario = lm.load("paper-2dof-nl-large").replace(
        **{"gearbox.stiffness.backward": 1.5, "simulation.duration": 0.3, "simulation.sample_interval": 0.01}
    )
    there = Scenario(library, lm.portable.description(scenario))
    assert there.set("gearbox.stiffness.backward", 1.2) == OK
    here = lm.simulate(scenario.replace(**{"gearbox.stiffness.backward": 1.2}))
    assert np.array_equal(there.run()["twist"], here.twist.values)
