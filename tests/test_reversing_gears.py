"""Gears of negative ratio: closed forms, and the mirrored motion of what is behind them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.errors import InputError


def test_a_bevel_differential_of_two_motors() -> None:
    """w_a - w_c = -(w_b - w_c). With M_a + M_b on the carrier, (J_c + 4 J/2) w_c' = M_a + M_b, and J (w_a - w_b)' = M_a - M_b."""
    J, carrier, a, b = 1e-4, 0.02, 0.3, 0.1
    train = lm.Scenario(
        shafts={"a": {}, "b": {}, "carrier": {"inertia": carrier, "torque": {"mean": 0.0}}},
        motors={n: {"kind": "torque_source", "shaft": n[1], "rotor_inertia": J} for n in ("ma", "mb")},
        gears={"bevel": {"input": "a", "output": "b", "housing": "carrier", "ratio": -1.0}},
        command={"ma": {"mean": a}, "mb": {"mean": b}},
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )
    end = lm.simulate(train).isel(time=-1)
    mean, half = (a + b) / (carrier + 2.0 * J), 0.5 * (a - b) / J
    assert float(end["carrier_speed"]) == pytest.approx(mean, rel=1e-12)
    assert float(end["a_speed"]) == pytest.approx(mean + half, rel=1e-12)
    assert float(end["b_speed"]) == pytest.approx(mean - half, rel=1e-12)


LOSSES: dict[str, dict[str, Any]] = {
    "none": {"kind": "constant_efficiency", "efficiency": 1.0},
    "constant": {"kind": "constant_efficiency", "efficiency": 0.8},
    "two efficiencies": {"kind": "mesh_efficiency", "drive_efficiency": 0.7, "backdrive_efficiency": 0.4},
    "self-locking": {"kind": "mesh_efficiency", "drive_efficiency": 0.45, "backdrive_efficiency": -0.2},
    "map": {
        "kind": "map", "loads": [-1.0, 0.0, 1.0], "speeds": [0.0, 0.5, 1.0],
        "values": [[0.35, 0.3, 0.32], [0.05, 0.08, 0.1], [0.2, 0.15, 0.17]],
    },
}  # fmt: skip
STIFFNESS: dict[str, dict[str, Any]] = {
    "rigid": {"kind": "rigid"},
    "spring": {"kind": "linear", "stiffness": 900.0},
    "gap": {"kind": "curve", "slopes": [400.0, 1500.0], "breaks": [0.01], "backlash": 0.02},
}


def axis(ratio: float, losses: str, stiffness: str, seed: int) -> lm.Scenario:
    """Motor, gear, load; what is on the load is turned around with the ratio."""
    draw = np.random.default_rng(seed)
    way = 1.0 if ratio > 0.0 else -1.0
    gear: dict[str, Any] = {"input": "motor", "output": "load", "ratio": ratio, "stiffness": STIFFNESS[stiffness]}
    gear |= {"losses": LOSSES[losses], "rated_input_speed": 20.0, "rated_output_torque": 8.0}
    if stiffness == "spring":
        gear["hysteresis"] = {"efficiency": 0.9}
    return lm.Scenario(
        shafts={
            "motor": {"friction_torque": draw.uniform(0.0, 0.1), "viscous_friction": 1e-3},
            "load": {
                "inertia": draw.uniform(0.02, 0.3),
                "friction_torque": draw.uniform(0.0, 0.5),
                "torque": {"mean": way * draw.uniform(-2.0, 2.0), "amplitude": way * 3.0, "frequency": 1.3},
            },
        },
        motors={"m": {"kind": "torque_source", "shaft": "motor", "rotor_inertia": 5e-3}},
        gears={"g": gear},
        command={"m": {"amplitude": draw.uniform(0.5, 2.0), "frequency": 0.9, "phase": draw.uniform(0.0, 6.0)}},
        simulation={"duration": 2.0, "sample_interval": 1e-2},
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("stiffness", STIFFNESS)
@pytest.mark.parametrize("losses", LOSSES)
def test_the_load_behind_a_reversing_gear_moves_mirrored(losses: str, stiffness: str, seed: int) -> None:
    if losses == "self-locking" and stiffness == "rigid":
        pytest.skip("jams: rigid friction has no motion or several")
    straight = lm.simulate(axis(6.0, losses, stiffness, seed))
    reverse = lm.simulate(axis(-6.0, losses, stiffness, seed))
    mirrored = ("load_speed", "load_angle", "g_twist", "g_output_torque")
    for name in straight.data_vars:
        if name.startswith("load_load_torque") or "contact" in str(name):
            continue
        sign = -1.0 if name in mirrored else 1.0
        assert np.array_equal(sign * reverse[name].values + 0.0, straight[name].values + 0.0, equal_nan=True), name
    one, other = lm.energy_of(straight), lm.energy_of(reverse)
    for flow in one:
        assert other[flow] == pytest.approx(one[flow], rel=1e-9, abs=1e-9), flow
    assert abs(other["residual"]) < 1e-9 * max(1.0, other["turned_over"])


@pytest.mark.parametrize("load", [0.0, 3.0, -3.0])
@pytest.mark.parametrize("stiffness", STIFFNESS)
@pytest.mark.parametrize("losses", LOSSES)
def test_the_command_that_turns_a_reversing_gear_is_that_of_another(losses: str, stiffness: str, load: float) -> None:
    """One motor is on the input, one on the output. The gear exchanges their directions."""
    found = []
    for way in (1.0, -1.0):
        tables = axis(way * 6.0, losses, stiffness, 2).model_dump(exclude_none=True)
        tables["shafts"]["load"]["torque"] = {"mean": way * load}
        tables["motors"]["far"] = {"kind": "torque_source", "shaft": "load", "rotor_inertia": 0.1}
        tables["command"] = {"m": {"mean": 0.2}, "far": {"mean": 0.3 * way}}
        found.append({m.name: m for m in lm.explain(lm.Scenario(**tables), 0.0).motors})
    one, other = found
    assert (one["m"].command_forward, one["m"].command_backward) == pytest.approx(
        (other["m"].command_forward, other["m"].command_backward), rel=1e-14, nan_ok=False
    )
    assert (one["far"].command_forward, one["far"].command_backward) == pytest.approx(
        (-other["far"].command_backward, -other["far"].command_forward), rel=1e-14, nan_ok=False
    )


def test_the_command_that_turns_a_reversing_gear_by_hand() -> None:
    """10 N m of friction on the load behind 5:1 at 0.9, and 0.1 N m on the motor."""
    train = lm.Scenario(
        shafts={"motor": {"friction_torque": 0.1}, "load": {"inertia": 1.0, "friction_torque": 10.0}},
        motors={"m": {"kind": "torque_source", "shaft": "motor", "rotor_inertia": 1e-3, "rated_torque": 10.0}},
        gears={"g": {"input": "motor", "output": "load", "ratio": -5.0, "stiffness": {"kind": "linear", "stiffness": 1e4},
                     "losses": {"kind": "mesh_efficiency", "drive_efficiency": 0.9, "backdrive_efficiency": 0.8}}},
        simulation={"duration": 1.0, "sample_interval": 0.1},
    )  # fmt: skip
    (motor,) = lm.explain(train, 0.5).motors
    assert motor.command_forward == pytest.approx((10.0 / (5.0 * 0.9) + 0.1) / 10.0, rel=1e-12)
    assert motor.command_backward == -motor.command_forward


def test_a_bevel_differential_is_explained_without_a_number_that_statics_do_not_give() -> None:
    """Its housing turns: with unequal loads it has no rest at any command."""
    text = str(lm.explain(lm.load("bevel-differential"), 1.0))
    assert "forward at a command that statics do not determine (gears in a loop, or a housing that turns)" in text
    assert "-0 " not in text


@pytest.mark.parametrize("losses", ["two efficiencies", "map"])
def test_both_solvers_agree_on_reversing_gears(losses: str) -> None:
    scenario = axis(-6.0, losses, "gap", 11)
    exact = lm.simulate(scenario)
    other = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-10)
    assert float(abs(exact["load_speed"] - other["load_speed"]).max()) < 1e-6


def test_linear_models_of_a_reversing_gear_have_the_same_poles() -> None:
    poles = []
    for ratio in (6.0, -6.0):
        simulation = lm.Simulation(axis(ratio, "constant", "gap", 1))
        simulation.advance(0.5, m_command=1.0)
        poles.append(np.sort_complex(np.linalg.eigvals(lm.linearize(simulation).A)))
    assert np.allclose(*poles, rtol=1e-12, atol=1e-12)


MIRRORED = ("load_speed", "load_angle", "load_contact", "twist", "output_torque", "twist_contact")


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "paper-2dof-nl-large", "paper-2dof-l-large"])
def test_a_drive_whose_gearbox_reverses_moves_its_load_mirrored(name: str) -> None:
    straight = lm.load(name)
    reverse = straight.replace(**{"gearbox.ratio": -straight.gearbox.ratio})
    a, b = lm.simulate(straight), lm.simulate(reverse)
    for variable in a.data_vars:
        sign = -1.0 if variable in MIRRORED else 1.0
        assert np.array_equal(sign * b[variable].values + 0.0, a[variable].values + 0.0, equal_nan=True), variable
    one, other = (lm.Simulation(s) for s in (straight, reverse))
    for simulation in (one, other):
        simulation.advance(0.2, command=0.9, load_torque=0.0)
    assert one["efficiency"] == other["efficiency"] != 0.0
    assert lm.test_rig.TestRig(reverse.gearbox).gearbox == straight.gearbox


@pytest.mark.parametrize("gear", ["two efficiencies", "self-locking", "map"])
@pytest.mark.parametrize("between", [2.0, -2.0])
def test_what_a_load_does_to_a_reversing_gear_is_what_it_does_to_another(gear: str, between: float) -> None:
    """A stage of 2:1 before it, which may reverse too."""
    found = []
    for ratio, belt in ((6.0, 2.0), (-6.0, between)):
        tables = axis(ratio, gear, "spring", 3).model_dump(exclude_none=True)
        tables["gears"]["g"].pop("hysteresis")
        tables["shafts"]["rotor"] = {"inertia": 0.0, "friction_torque": 0.02}
        tables["shafts"]["motor"]["inertia"] = 2e-3
        tables["motors"]["m"]["shaft"] = "rotor"
        losses = {"kind": "mesh_efficiency", "drive_efficiency": 0.9, "backdrive_efficiency": 0.8}
        tables["gears"]["belt"] = {"input": "rotor", "output": "motor", "ratio": belt, "losses": losses}
        tables["gears"]["belt"]["stiffness"] = {"kind": "linear", "stiffness": 50.0}
        found.append(lm.sizing.self_locking(lm.Scenario(**tables).train(), "g", 5.0))
    one, other = found
    # Eigenvalues have roundings of the largest of them, some 100 1/s.
    assert (one.rate, one.undamped_rate) == pytest.approx((other.rate, other.undamped_rate), abs=1e-11)
    assert replace(one, rate=0.0, undamped_rate=0.0) == replace(other, rate=0.0, undamped_rate=0.0)
    assert one.least_torque != 0.0


@pytest.mark.parametrize("encoder", ["motor", "load"])
def test_an_inverse_model_drives_a_reversing_gearbox(encoder: str) -> None:
    """The reference mirrored, the same torques to the last bit: with the losses of the map, their adaptation and the load observer."""
    straight = lm.load("position-axis-load-encoder")
    controller = straight.controller.model_dump(exclude_none=True)
    controller["inverse_model"] = {
        "twist_rate": 0.5, "min_speed": 1.0, "loss_adaptation": {"rate": 100.0},
        "load_observer": {"input_time": 2e-3, "load_time": 2e-2},
    }  # fmt: skip
    controller["encoder"] = {"ideal": True}
    controller["position_encoder"] = {"ideal": True, "shaft": "load"}
    if encoder == "motor":
        del controller["position_encoder"]
    results = []
    for way in (1.0, -1.0):
        controller["reference"] = {"kind": "position", "amplitude": way * 0.2, "frequency": 0.5}
        changes = {"gearbox.ratio": way * straight.gearbox.ratio, "simulation.duration": 3.0}
        changes["load.torque"] = {"mean": way * 5.0, "amplitude": way * 2.0, "frequency": 0.8}
        results.append(lm.simulate(straight.replace(controller=controller, **changes)))
    a, b = results
    assert float(abs(a["load_angle"]).max()) > 0.1
    for name, sign in (("motor_torque", 1.0), ("load_angle", -1.0), ("observed_load_torque", -1.0)):
        assert np.array_equal(sign * b[name].values + 0.0, a[name].values + 0.0), name
    assert np.array_equal(a["model_loss_factor"].values, b["model_loss_factor"].values)


def test_ratio_zero_is_refused() -> None:
    for make in (
        lambda: lm.Gear(input="a", output="b", ratio=0.0),
        lambda: lm.load("paper-2dof-nl-small").replace(**{"gearbox.ratio": 0.0}),
    ):
        with pytest.raises(InputError, match="is no ratio; give input speed"):
            make()
