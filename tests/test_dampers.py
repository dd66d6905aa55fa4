"""Dampers between two shafts: closed forms of runs, energies, sensitivities and linear models; where they stand beside the rest."""

import ctypes as c
import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.simulation.runs.separate_trains import parts_of
from refusals import refusals_of, refused
from test_c_interface import INPUTS, OK, VARIABLES, Train, library  # noqa: F401
from test_description import Scenario
from test_sensitivities import check_against_differences, derivative

J_A, J_B, D = 2e-3, 3e-3, 8e-3  # kg·m², kg·m², N·m·s/rad
SERIES = J_A * J_B / (J_A + J_B)  # inertia that the slip feels
EXACT = 1e-10


def pair(damper: dict[str, Any] | None = None, **tables: Any) -> lm.Scenario:
    """Two shafts on a damper, the first with a torque source."""
    base: dict[str, Any] = {
        "shafts": {"a": {"inertia": J_A}, "b": {"inertia": J_B, "torque": 0.0}},
        "motors": {"m": {"shaft": "a", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 0.0}},
        "dampers": {"d": {"input": "a", "output": "b", **(damper or {"viscous_friction": D})}},
        "simulation": {"duration": 1.0, "sample_interval": 0.01},
    }
    return lm.Scenario(**base | {name: {**base.get(name, {}), **table} for name, table in tables.items()})


FLUID: dict[str, Any] = {"drag": {"kind": "curve", "speeds": [0.0, 5.0, 20.0, 40.0], "torques": [0.0, 0.005, 0.08, 0.32]}}
SPINNING = {"speeds": {"a": 50.0}, "angles": {"b": 0.3}}


def test_the_slip_decays_and_what_is_lost_is_heat() -> None:
    result = lm.simulate(pair(initial=SPINNING))
    t = result.time.to_numpy()
    slip = 50.0 * np.exp(-D / SERIES * t)
    together = 50.0 * J_A / (J_A + J_B)
    assert result["a_speed"].to_numpy() == pytest.approx(together + slip * J_B / (J_A + J_B), rel=EXACT)
    assert result["b_speed"].to_numpy() == pytest.approx(together - slip * J_A / (J_A + J_B), rel=EXACT, abs=1e-9)
    # Each side has its angle.
    turned = (50.0 - slip) * SERIES / D
    assert result["a_angle"].to_numpy() == pytest.approx(together * t + turned * J_B / (J_A + J_B), rel=EXACT)
    assert result["b_angle"].to_numpy() == pytest.approx(0.3 + together * t - turned * J_A / (J_A + J_B), rel=EXACT)
    heat = 0.5 * SERIES * (50.0**2 - slip[-1] ** 2)
    ledger = lm.energy_of(result)
    assert ledger["d: damper"] == pytest.approx(heat, rel=EXACT)
    assert abs(ledger["residual"]) <= 1e-12 * heat


def test_the_slip_changes_with_the_friction_of_the_damper_as_its_closed_form_does() -> None:
    result = lm.simulate(pair(initial=SPINNING), sensitivities=["dampers.d.viscous_friction"])
    t = result.time.to_numpy()
    by_friction = [derivative(result, f"{shaft}_speed", "dampers.d.viscous_friction") for shaft in "ab"]
    expected = -t / SERIES * 50.0 * np.exp(-D / SERIES * t)
    assert by_friction[0] - by_friction[1] == pytest.approx(expected, rel=1e-9, abs=1e-9 * float(abs(expected).max()))


def test_sensitivities_across_the_edges_of_a_curve_and_a_shaft_that_sticks_are_quotients_of_differences() -> None:
    scenario = pair(
        FLUID | {"viscous_friction": 1e-3},
        shafts={"b": {"inertia": J_B, "torque": 0.0, "friction_torque": 0.08}},
        command={"m": {"mean": 0.1, "amplitude": 0.5, "frequency": 1.5}},
    )
    values = {"dampers.d.viscous_friction": 1e-3, "shafts.b.friction_torque": 0.08, "shafts.b.inertia": J_B}
    check_against_differences(scenario, values, 1e-6)


def transfer(damping: float, friction: float, frequency: float) -> complex:
    """F(w_b)/F(M) of two inertias on a damper, the second with viscous friction."""
    s = 2j * math.pi * frequency
    return damping / ((J_A * s + damping) * (J_B * s + damping + friction) - damping**2)


def test_the_linear_model_has_the_eigenvalue_and_the_transfer_function_of_two_inertias_on_a_damper() -> None:
    model = lm.linearize(pair().train())
    values = sorted(np.linalg.eigvals(model.A).real)
    assert values[0] == pytest.approx(-D / SERIES, rel=EXACT)
    assert values[1:] == pytest.approx([0.0] * (len(values) - 1), abs=1e-9)
    assert model.response(3.0, "b_speed", "m_command") == pytest.approx(transfer(D, 0.0, 3.0), rel=1e-9)


def test_the_frequency_response_of_a_fluid_coupling_is_linear_on_its_first_line_only() -> None:
    scenario = pair(FLUID, shafts={"b": {"inertia": J_B, "viscous_friction": 1e-2}})
    response = lm.frequency_response(scenario, 2.0, [1e-3, 1.0], source="m_command")
    small, large = response["response"].sel(output="b_speed").values[:, 0]
    first = FLUID["drag"]["torques"][1] / FLUID["drag"]["speeds"][1]
    assert small == pytest.approx(transfer(first, 1e-2, 2.0), rel=1e-8)
    assert abs(large) > 1.1 * abs(small)  # the more slip, the stiffer it is


def test_what_holds_a_shaft_behind_a_damper_is_explained() -> None:
    scenario = pair(shafts={"a": {"inertia": J_A, "friction_torque": 0.5}}, initial={"speeds": {"b": 20.0}})
    told = lm.explain(lm.Simulation(scenario))
    held = D * 20.0
    contact = next(c for c in told.contacts if c.name == "a_contact")
    assert contact.torque == pytest.approx(held, rel=EXACT)
    assert (told.motors[0].command_forward, told.motors[0].command_backward) == pytest.approx((0.5 - held, -0.5 - held), rel=EXACT)


def test_stepping_has_the_variables_and_values_of_a_run() -> None:
    scenario = pair(FLUID, initial=SPINNING, command={"m": {"mean": 0.2}})
    simulation, run = lm.Simulation(scenario, step=0.01), lm.simulate(scenario)
    assert set(simulation.read()) == {str(name) for name in run}
    for _ in range(100):
        simulation.advance(0.01, m_command=0.2, b_load_torque=0.0)
    for name in run:
        assert simulation[str(name)] == pytest.approx(float(run[name][-1]), rel=1e-9, abs=1e-9), name


def test_a_damper_joins_its_shafts_to_one_part() -> None:
    scenario = pair(shafts={"alone": {"inertia": 1.0, "torque": 0.1}})
    assert [list(part.shafts) for part in parts_of(scenario)] == [["a", "b"], ["alone"]]
    assert lm.simulate(scenario)["alone_speed"][-1] == pytest.approx(-0.1)


def test_a_damper_has_the_bits_of_python_in_a_description_and_its_value_can_be_changed(library: c.CDLL) -> None:  # noqa: F811
    scenario = pair(FLUID | {"viscous_friction": D}, initial=SPINNING, command={"m": {"mean": 0.2}})
    there = Scenario(library, lm.portable.description(scenario))
    for value in (D, 2.0 * D):
        assert there.set("dampers.d.viscous_friction", value) == OK
        here = lm.simulate(scenario.replace(**{"dampers.d.viscous_friction": value}))
        told = there.run()
        assert set(told) == set(here)
        for name, course in told.items():
            assert np.array_equal(course, here[name].to_numpy(), equal_nan=True), name


def test_a_train_with_a_damper_has_the_bits_of_python_in_the_c_interface(library: c.CDLL) -> None:  # noqa: F811
    scenario = pair(FLUID | {"viscous_friction": 1e-3})
    stepped, python = Train(library, scenario).simulation(1e-3), lm.Simulation(scenario, step=1e-3)
    given = {"m_command": 0.7, "b_load_torque": 0.1}
    for _ in range(200):
        assert stepped.advance(1e-3, [given[name] for name in stepped.names(INPUTS)]) == OK
        python.advance(1e-3, **given)
    told = dict(zip(stepped.names(VARIABLES), stepped.read(), strict=True))
    assert {name: told[name] for name in python.read()} == python.read()
    assert told["a_speed"] - told["b_speed"] > 5.0


test_what_is_no_damper_is_refused = refusals_of(
    lambda change: pair({"viscous_friction": D} | change).train(),
    ({"viscous_friction": 0.0}, "dampers.d: has no torque at any slip; give viscous_friction or drag"),
    ({"output": "c"}, 'dampers.d.output: "c" is no shaft'),
    ({"output": "a"}, "dampers.d: joins shaft 'a' with itself; give it another output"),
    ({"drag": {"kind": "quadratic", "coefficient": 1e-4, "max_speed": 60.0, "error": 1e-12}}, "dampers.d: straight lines"),
)


# --- torque limiters ---
T_1, T_2 = 30.0, 8.0


def wound_up(k: float, J: float, v: float, duration: float, **limiter: Any) -> lm.Scenario:
    """A spring that is wound up at a constant speed turns a hub, which the limiter holds to a wall."""
    return lm.Scenario(
        shafts={"drive": {"speed": {"mean": v}}, "hub": {"inertia": J}, "wall": {"speed": {"mean": 0.0}}},
        gears={"spring": {"input": "drive", "output": "hub", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": k}}},
        torque_limiters={"limiter": {"input": "hub", "output": "wall", "release_torque": T_1, "slip_torque": T_2, **limiter}},
        simulation={"duration": duration, "sample_interval": 1e-3},
    )


def test_it_releases_the_energy_between_both_torques() -> None:
    """J w' = k d - T_2, d' = v - w from k d = T_1 until w = 0, at tan(W t/2) = -(T_1 - T_2) W/(k v); the heat is T_2 times the slip."""
    k, J, v = 500.0, 0.02, 0.4
    result = lm.simulate(wound_up(k, J, v, 1.0))
    W, wound = math.sqrt(k / J), T_1 / k
    lasts = 2.0 * (math.pi - math.atan((T_1 - T_2) * W / (k * v))) / W
    left = T_2 / k + (T_1 - T_2) / k * math.cos(W * lasts) + v / W * math.sin(W * lasts)
    slipped = v * lasts - (left - wound)
    again = (wound - left) / v
    released = [wound / v + n * (lasts + again) for n in range(10)]
    expected = sorted(t for r in released for t in (r, r + lasts) if t < 1.0)
    assert np.asarray(lm.switchings_of(result)["instant"])[-len(expected) :] == pytest.approx(expected, rel=1e-9)
    slips = sum(r + lasts < 1.0 for r in released)
    energy = lm.energy_of(result)
    assert released[slips] > 1.0
    assert energy["limiter: torque limiter"] == pytest.approx(slips * T_2 * slipped, rel=1e-9)
    # Of each release: what the spring gives between both of its twists, and the drive meanwhile.
    given = 0.5 * k * (wound**2 - left**2)
    driven = v * (T_2 * lasts + (T_1 - T_2) / W * math.sin(W * lasts) + k * v / W**2 * (1.0 - math.cos(W * lasts)))
    assert given + driven == pytest.approx(T_2 * slipped, rel=1e-12)
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]


def slipping(**limiter: Any) -> lm.Scenario:
    return lm.Scenario(
        shafts={"a": {"inertia": 0.3}, "b": {"inertia": 0.6, "torque": {"steps": [{"height": -10.0, "time": 5.0}]}}},
        torque_limiters={"limiter": {"input": "a", "output": "b", "release_torque": T_1, "slip_torque": T_2, **limiter}},
        initial={"speeds": {"a": 60.0}},
        simulation={"duration": 6.0, "sample_interval": 1e-3},
    )


PER_TORQUE = 1.0 / 0.3 + 1.0 / 0.6  # slip acceleration


def test_it_engages_where_the_speeds_are_nearly_the_same() -> None:
    result = lm.simulate(slipping(engaging_speed="3 rad/s"))
    engages = (60.0 - 3.0) / (T_2 * PER_TORQUE)
    together = engages + 3.0 / (T_1 * PER_TORQUE)
    instants = np.asarray(lm.switchings_of(result)["instant"])
    assert instants[:2] == pytest.approx([engages, together], rel=1e-9)
    t, torque = np.asarray(result["time"]), np.asarray(result["limiter_contact_torque"])
    assert torque[t < engages] == pytest.approx(T_2, rel=1e-12)
    assert torque[(t > engages) & (t < together)] == pytest.approx(T_1, rel=1e-12)
    assert float(result["a_speed"].sel(time=4.0)) == pytest.approx(60.0 * 0.3 / 0.9, rel=1e-12)
    # It holds 10 N m, more than it slips at: a follows b.
    assert float(result["a_speed"][-1]) == pytest.approx(20.0 + 10.0 / 0.9, rel=1e-10)


def test_it_engages_at_the_next_pocket() -> None:
    pockets, engaging = 6, 12.0
    result = lm.simulate(slipping(engaging_speed=engaging, pockets=pockets))
    pitch, a = 2.0 * math.pi / pockets, T_2 * PER_TORQUE
    slow = (60.0 - engaging) / a
    passed = 60.0 * slow - 0.5 * a * slow**2
    pocket = pitch * math.ceil(passed / pitch)
    slip = math.sqrt(60.0**2 - 2.0 * a * pocket)
    caught = (60.0 - slip) / a
    instants = np.asarray(lm.switchings_of(result)["instant"])
    together = caught + slip / (T_1 * PER_TORQUE)
    assert instants[instants < 4.0][-3:] == pytest.approx([slow, caught, together], rel=1e-9)
    assert float(result["a_speed"].sel(time=4.0)) == pytest.approx(20.0, rel=1e-12)
    heat = lm.energy_of(result)["limiter: torque limiter"]
    assert heat == pytest.approx(0.5 * 0.2 * 60.0**2, rel=1e-10)


def test_between_pockets_it_holds_but_its_slip_torque() -> None:
    """One pocket to a turn: it stops short of it, and slips again under a torque between both."""
    result = lm.simulate(slipping(engaging_speed="1 rad/s", pockets=1).replace(**{"shafts.b.torque": None}))
    stops = 60.0 / (T_2 * PER_TORQUE)
    turns = 0.5 * 60.0 * stops / (2.0 * math.pi)
    assert 0.1 < turns % 1.0 < 0.9
    assert float(result["a_speed"].sel(time=4.0)) == pytest.approx(20.0, rel=1e-12)
    pulled = lm.simulate(
        slipping(engaging_speed="0.001 rad/s", pockets=1).replace(
            **{"shafts.b.torque": {"steps": [{"height": -15.0, "time": 5.0}]}, "simulation.duration": "5.2 s"}
        )
    )
    needed = 15.0 * 0.3 / 0.9
    assert needed < T_2
    assert float(pulled["a_speed"][-1]) == pytest.approx(float(pulled["b_speed"][-1]), rel=1e-12)
    torn = lm.simulate(
        slipping(engaging_speed="0.001 rad/s", pockets=1).replace(
            **{"shafts.b.torque": {"steps": [{"height": -45.0, "time": 5.0}]}, "simulation.duration": "5.2 s"}
        )
    )
    assert T_2 < 45.0 * 0.3 / 0.9 < T_1
    assert float(torn["a_speed"][-1]) == pytest.approx(20.0 + 0.2 * T_2 / 0.3, rel=1e-10)


@pytest.mark.parametrize("limiter", [{"engaging_speed": 3.0}, {"engaging_speed": 12.0, "pockets": 6}])
def test_both_solvers_and_steps_agree(limiter: dict[str, Any]) -> None:
    scenario = slipping(**limiter)
    exact = lm.simulate(scenario)
    adaptive = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    assert np.asarray(adaptive["a_speed"]) == pytest.approx(np.asarray(exact["a_speed"]), abs=1e-6)
    simulation = lm.Simulation(scenario)
    for k in range(60):
        simulation.advance(0.1, b_load_torque=-10.0 if k >= 50 else 0.0)
    assert simulation["a_speed"] == pytest.approx(float(exact["a_speed"][-1]), rel=1e-10)
    assert "limiter_contact" in str(lm.explain(scenario, 4.0))


def test_a_slip_torque_above_the_release_torque_is_refused() -> None:
    refused(lambda: slipping(slip_torque=31.0), "torque_limiters.limiter")
