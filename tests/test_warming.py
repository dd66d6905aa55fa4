"""Temperature as a slow parameter: the two bodies against closed forms, what follows them, and the error of freezing."""

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm
from lostmotion.model.losses import LossMap
from lostmotion.reproducible import interpolate
from lostmotion.sizing.thermal import COPPER, TwoBodies
from refusals import refused

BODIES = TwoBodies(2.0, 5.0, 20.0, 300.0, loss=4.0, reference=25.0, ambient=20.0)
LIMITS = {
    "resistance": 1.5,
    "torque_constant": 0.05,
    "thermal_resistance_winding_case": 2.0,
    "thermal_resistance_case_ambient": 5.0,
    "thermal_time_constant_winding": 20.0,
    "thermal_time_constant_motor": 300.0,
}
OIL = lm.data_sheets.Lubricant(viscosity_40="220 mm^2/s", viscosity_100="19 mm^2/s")


def scenario(**changes: Any) -> lm.Scenario:
    """A torque source that turns a fan through a gear with viscous friction and a loss map."""
    losses = {"kind": "map", "speeds": [0.0, 1.0], "loads": [0.0, 1.0], "values": [[0.02, 0.05], [0.06, 0.1]], "mirrored": True}
    gear = {
        "input": "rotor",
        "output": "fan",
        "ratio": 5.0,
        "viscous_friction": 2e-5,
        "losses": losses,
        "rated_input_speed": "3000 rpm",
        "rated_output_torque": 1.0,
        "stiffness": {"kind": "linear", "stiffness": 500.0},
        "mesh_damping": 0.5,
    }
    return lm.Scenario(
        shafts={"rotor": {"inertia": 1e-5}, "fan": {"inertia": 1e-3, "viscous_friction": 5e-3}},
        motors={"motor": {"shaft": "rotor", "kind": "torque_source", "rotor_inertia": 1e-5, "limits": LIMITS}},
        gears={"gear": gear},
        command={"motor": {"mean": 0.1, "amplitude": 0.03, "frequency": 0.3}},
        simulation={"duration": 16.0, "sample_interval": 0.02},
    ).replace(**changes)


def test_constant_heat_in_both_bodies_has_the_closed_form_and_no_joule_is_lost() -> None:
    square, losses, start = 0.9, 3.0, np.array([10.0, 4.0])
    C = np.array([20.0 / 2.0, 300.0 / 5.0])
    A = np.array(
        [[(COPPER * BODIES.loss * square - 1.0 / 2.0) / C[0], 1.0 / 2.0 / C[0]], [1.0 / 2.0 / C[1], -(1.0 / 2.0 + 1.0 / 5.0) / C[1]]]
    )
    b = np.array([BODIES.loss * square * (1.0 + COPPER * (20.0 - 25.0)), losses]) / C
    times = np.array([0.1, 7.0, 90.0, 2000.0])
    F, g = BODIES.response(times, square, losses)
    steady = np.linalg.solve(A, -b)
    for k, t in enumerate(times):
        assert np.allclose(F[k] @ start + g[k], steady + expm(A * t) @ (start - steady), rtol=1e-12, atol=1e-12)
    # Without a winding that grows with the temperature: the steady rises are heat times resistance.
    cold = TwoBodies(2.0, 5.0, 20.0, 300.0, loss=4.0, reference=25.0, ambient=20.0, alpha=0.0)
    F, g = cold.response(np.array([1e5]), square, losses)
    assert g[0] == pytest.approx([3.6 * 2.0 + 6.6 * 5.0, 6.6 * 5.0], rel=1e-12)


def test_heat_into_the_bodies_is_stored_or_leaves_them() -> None:
    hot = lm.sizing.warm_up(scenario(), update=2.0, lubricant=OIL, lubricant_temperature="40 degC")
    heat = json.loads(hot.attrs["heat"])
    assert heat["winding"] + heat["housing"] == pytest.approx(heat["stored"] + heat["ambient"], rel=1e-12)
    ledger = lm.energy_of(hot)
    assert heat["housing"] == pytest.approx(
        sum(ledger[f"gear: {loss}"] for loss in ("mesh", "hysteresis and damping"))
        + ledger["rotor: viscous friction"]
        + ledger.get("rotor: dry friction", 0.0)
    )
    square = float(np.mean(hot["motor_torque"].values ** 2))
    assert heat["winding"] == pytest.approx(1.5 / 0.05**2 * square * 16.0, rel=0.02)  # some kelvins above 25 °C
    stored = 10.0 * (hot["winding_temperature"][-1] - 25.0) + 60.0 * (hot["housing_temperature"][-1] - 25.0)
    assert float(stored) == pytest.approx(heat["stored"], rel=1e-12)
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]


def test_the_heat_of_a_ripple_does_not_depend_on_the_samples() -> None:
    """A sine of 0.3 Hz with a mean, over five periods: mean square 0.1² + 0.03²/2, whatever the samples."""
    fine, coarse = (lm.sizing.warm_up(scenario(**{"simulation.sample_interval": h}), update=4.0, winding=25.0) for h in (0.02, 2.0))
    heats = [json.loads(found.attrs["heat"])["winding"] for found in (fine, coarse)]
    assert heats[1] == pytest.approx(heats[0], rel=1e-9)
    t = 16.0 * 2.0 * math.pi * 0.3
    square = 0.1**2 + 0.03**2 * (0.5 - math.sin(2.0 * t) / (4.0 * t)) + 0.006 * (1.0 - math.cos(t)) / t
    assert heats[0] >= 1.5 / 0.05**2 * square * 16.0  # and what the winding's resistance grows by
    assert heats[0] == pytest.approx(1.5 / 0.05**2 * square * 16.0, rel=0.03)


def test_without_anything_that_depends_on_the_temperature_the_motion_is_that_of_one_run() -> None:
    plain, hot = lm.simulate(scenario()), lm.sizing.warm_up(scenario(), update=2.0)
    assert hot.sizes["time"] == plain.sizes["time"]
    for name in plain:
        size = float(abs(plain[name]).max()) or 1.0
        assert float(abs(plain[name] - hot[name]).max()) <= 1e-8 * size, name
    one = lm.sizing.temperatures(plain)["winding_temperature"]
    losses = json.loads(hot.attrs["heat"])["housing"]
    assert 0.0 < float(hot["winding_temperature"][-1] - one[-1]) < losses / 60.0  # which heat the housing alone


def test_the_error_of_freezing_is_stated_and_falls_linearly_with_the_interval() -> None:
    given: dict[str, Any] = {"lubricant": OIL, "lubricant_temperature": 40.0, "housing": 15.0}
    even = scenario(**{"command.motor": 0.1})
    # From the speed of the cold gear on, the heat changes with the temperatures alone.
    end = lm.sizing.warm_up(even.replace(**{"simulation.duration": 2.0}), update=0.04, **given).isel(time=-1)
    speeds = {shaft: float(end[f"{shaft}_speed"]) for shaft in ("rotor", "fan")}
    even = even.replace(**{"initial.speeds": speeds, "initial.twists": {"gear": float(end["gear_twist"])}})
    runs = {update: lm.sizing.warm_up(even, update=update, **given) for update in (4.0, 2.0, 1.0, 0.04)}
    exact = runs[0.04]
    errors = {update: float(abs(hot["housing_temperature"] - exact["housing_temperature"]).max()) for update, hot in runs.items()}
    assert errors[4.0] > 1e-3
    for update in (4.0, 2.0):
        assert errors[update] / errors[0.5 * update] == pytest.approx(2.0, rel=0.1)
        stated = json.loads(runs[update].attrs["freezing_error"])["housing"]
        assert stated == pytest.approx(errors[update], rel=0.3)


def test_gears_follow_the_viscosity_of_their_lubricant() -> None:
    """At constant speed the losses without load go with the viscosity to the power 2/3."""
    cold, warm = (
        lm.sizing.warm_up(scenario(), update=0.4, lubricant=OIL, lubricant_temperature=40.0, housing=housing, ambient=housing)
        for housing in (10.0, 70.0)
    )
    factor = (OIL.viscosity(10.0) / OIL.viscosity(40.0)) ** (2.0 / 3.0)
    law = scenario().gears["gear"].losses
    assert isinstance(law, LossMap)
    by_hand = scenario(
        **{
            "gears.gear.viscous_friction": 2e-5 * factor,
            "gears.gear.losses.values": [
                [m + (factor - 1.0) * m_0 for m, m_0 in zip(row, law.values[0], strict=True)] for row in law.values
            ],
        }
    )
    first = slice(0, 21)  # the first interval
    assert np.allclose(cold["rotor_speed"].values[first], lm.simulate(by_hand)["rotor_speed"].values[first], rtol=1e-12)
    assert float(cold["rotor_speed"][-1]) < float(warm["rotor_speed"][-1])
    assert interpolate(0.0, law.loads, [row[0] for row in law.values]) == law.values[0][0]


def test_a_dc_motor_has_the_line_of_its_warm_winding_and_magnets() -> None:
    motor = {
        "shaft": "rotor",
        "rotor_inertia": 1e-5,
        "rated_torque": 0.1,
        "rated_speed": "3000 rpm",
        "electrical_time_constant": "1 ms",
        "armature_voltage_constant": 4.0,
        "limits": LIMITS,
    }
    drive = lm.Scenario(
        shafts={"rotor": {"inertia": 1e-5}},
        motors={"motor": motor},
        command={"motor": 1.0},
        simulation={"duration": 0.4, "sample_interval": 1e-3},
    )
    hot = lm.sizing.warm_up(drive, update=0.1, winding=125.0, housing=65.0, magnet_coefficient=-0.002)
    resistance, magnets = 1.0 + COPPER * 100.0, 1.0 - 0.002 * 40.0
    no_load = lm.load("worm-lowering") and 2.0 * math.pi * 50.0 * 4.0 / 3.0
    assert float(hot["rotor_speed"][-1]) == pytest.approx(no_load / magnets, rel=2e-3)
    # A locked rotor: stall torque.
    locked = drive.replace(**{"shafts.rotor.friction_torque": 10.0})
    stalled = lm.sizing.warm_up(locked, update=0.1, winding=125.0, housing=65.0, magnet_coefficient=-0.002)
    assert float(stalled["motor_torque"][99]) == pytest.approx(0.1 * 4.0 * magnets / resistance, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"update": 0.03}, "even multiple"),
        ({"update": 0.02}, "even multiple"),
        ({"update": 2.0, "motor": "mtor"}, "did you mean motor"),
        ({"update": 2.0, "magnet_coefficient": -0.001}, 'acts on a motor of kind "dc"'),
        ({"update": 2.0, "heating": ["gear: mash"]}, "is no entry of the ledger"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(given: dict[str, Any], said: str) -> None:
    assert said in refused(lambda: lm.sizing.warm_up(scenario(), **given))


def test_a_sampled_controller_is_refused() -> None:
    refused(lambda: lm.sizing.warm_up(lm.load("position-axis"), update="10 ms"), "controller")


def test_temperatures_reach_an_end_that_is_no_multiple_of_the_interval() -> None:
    """As with an interval that the duration is a multiple of: heat over the same intervals of frozen temperatures."""
    part, whole = (
        lm.sizing.warm_up(scenario(command={"motor": 0.1}, simulation={"duration": 15.99, "sample_interval": h}), update=0.4, lubricant=OIL)
        for h in (0.02, 0.01)
    )
    assert part.time.values[-2:].tolist() == [15.98, 15.99]
    for body in ("winding_temperature", "housing_temperature"):
        assert float(part[body][-1]) == pytest.approx(float(whole[body][-1]), abs=1e-5)
