"""Shafts without inertia that dampers hold: closed forms, limits of small inertias, and what is refused."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import lostmotion as lm
from conftest import some
from refusals import refusals_of, refused
from tables import gear_between, linear

FIRST = {"k": 800.0, "c": 3.0}
SECOND = {"k": 2000.0, "c": 0.5}
RATIO = 2.0  # of the second stage


def chain(inertia: float = 0.0, *, first: dict[str, Any] | None = None, **changes: Any) -> lm.Scenario:
    """Two inertias, and between two compliant stages a shaft of which nothing but dampers determines the speed."""
    gears = {
        "first": gear_between("a", "node", 1.0, mesh_damping=FIRST["c"]) | {"stiffness": linear(FIRST["k"])} | (first or {}),
        "second": gear_between("node", "b", RATIO, mesh_damping=SECOND["c"]) | {"stiffness": linear(SECOND["k"])},
    }
    tables: dict[str, Any] = {
        "shafts": {
            "a": {"inertia": 0.02, "torque": {"amplitude": 3.0, "frequency": 4.0}},
            "node": {"inertia": inertia},
            "b": {"inertia": 0.3},
        },
        "gears": gears,
        "initial": {"speeds": {"a": 5.0}, "twists": {"first": 2e-3}},
        "simulation": {"duration": 0.5, "sample_interval": 1e-3},
    }
    return lm.Scenario(**(tables | changes))


COUPLED = np.array([[0.02, 0.01], [0.01, 0.3]])


@pytest.mark.parametrize("M", [np.diag([0.02, 0.3]), COUPLED], ids=["inertias", "mass matrix"])
def test_the_speed_of_the_node_is_that_of_the_balance_of_its_torques(M: np.ndarray) -> None:
    """0 = k_1 d_1 + c_1 (w_a - w) - (k_2 d_2 + c_2 (w/2 - w_b))/2, against the matrix exponential of what is left."""
    k1, c1, k2, c2 = FIRST["k"], FIRST["c"], SECOND["k"], SECOND["c"]
    matrix = {"shafts.a": {}, "shafts.b": {}, "mass_matrices": {"arm": {"shafts": ["a", "b"], "matrix": M.tolist()}}}
    scenario = chain().replace(**(matrix if M is COUPLED else {"shafts.a.torque": 0.0}))
    result = lm.simulate(scenario)
    # States: w_a, w_b, d_1, d_2. The node: w = (c_1 w_a + k_1 d_1 - k_2 d_2/2 + c_2 w_b/2)/(c_1 + c_2/4).
    node = np.array([c1, c2 / 2.0, k1, -k2 / 2.0]) / (c1 + c2 / 4.0)
    one = np.eye(4)
    T_1 = k1 * one[2] + c1 * (one[0] - node)
    T_2 = k2 * one[3] + c2 * (node / 2.0 - one[1])
    A = np.vstack([np.linalg.solve(M, np.array([-T_1, T_2])), one[0] - node, node / 2.0 - one[1]])
    x = np.array([expm(A * t) @ [5.0, 0.0, 2e-3, 0.0] for t in result["time"].values])
    for name, expected in (
        ("a_speed", x[:, 0]),
        ("b_speed", x[:, 1]),
        ("node_speed", x @ node),
        ("second_twist", x[:, 3]),
        ("first_output_torque", x @ T_1),
        ("second_input_torque", x @ T_2 / 2.0),
    ):
        scale = float(np.abs(expected).max())
        np.testing.assert_allclose(result[name].values, expected, rtol=0.0, atol=1e-11 * scale, err_msg=name)
    assert abs(lm.energy_of(result)["residual"]) < 1e-12 * lm.energy_of(result)["turned_over"]
    model = lm.linearize(scenario, time=0.1)
    poles = np.linalg.eigvals(model.A)
    for pole in np.linalg.eigvals(A):
        assert abs(poles - pole).min() < 1e-9 * abs(A).max()
    assert "node_speed" not in model.states


def test_a_link_named_in_a_mass_matrix_has_an_inertia() -> None:
    refused(
        lambda: chain().replace(
            **{"shafts.b": {}, "mass_matrices": {"arm": {"shafts": ["b", "node"], "matrix": [[0.3, 0.0], [0.0, 0.0]]}}}
        ),
        "mass_matrices.arm",
    )


def test_it_is_the_limit_of_a_small_inertia() -> None:
    """The error falls with the inertia itself."""
    exact = lm.simulate(chain())["b_speed"].values
    off = [float(np.abs(lm.simulate(chain(J))["b_speed"].values - exact).max()) for J in (1e-5, 1e-6, 1e-7)]
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.1)
    assert off[1] / off[2] == pytest.approx(10.0, rel=0.1)


GAP = {"stiffness": {"kind": "curve", "backlash": 0.01, "slopes": [FIRST["k"]]}}


@pytest.mark.parametrize("limited", [False, True])
def test_with_backlash_before_the_node_it_follows_the_other_damper_through_the_gap(limited: bool) -> None:
    scenario = chain(first=GAP | {"damping_limited": limited})
    result = lm.simulate(scenario)
    other = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    assert len(result.attrs["switchings"] if "switchings" in result.attrs else lm.switchings_of(result)) > 4
    for name in ("a_speed", "node_speed", "b_speed", "first_twist"):
        scale = float(np.abs(result[name].values).max())
        np.testing.assert_allclose(other[name].values, result[name].values, rtol=0.0, atol=1e-6 * scale, err_msg=name)
    assert abs(lm.energy_of(result)["residual"]) < 1e-11 * lm.energy_of(result)["turned_over"]
    # In the gap only the second stage acts on the node: k_2 d_2 + c_2 (w/2 - w_b) = 0.
    free = np.abs(result["first_twist"].values) < 0.005 - 1e-9
    assert free.sum() > 20
    expected = 2.0 * (result["b_speed"].values - SECOND["k"] / SECOND["c"] * result["second_twist"].values)
    np.testing.assert_allclose(result["node_speed"].values[free], expected[free], rtol=1e-9, atol=1e-9)


def test_a_direct_current_motor_without_inductance_holds_a_node() -> None:
    """A rotor without inertia on a spring: the back-e.m.f. is its damper."""
    k, k_N, T_R, w_R, J = 50.0, 3.0, 0.5, 300.0, 0.01
    scenario = lm.Scenario(
        shafts={"rotor": {}, "load": {"inertia": J}},
        motors={
            "m": {
                "shaft": "rotor", "kind": "dc", "rotor_inertia": 0.0, "rated_torque": T_R, "rated_speed": w_R,
                "electrical_time_constant": 0.0, "armature_voltage_constant": k_N,
            }
        },
        gears={"g": {"input": "rotor", "output": "load", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": k}}},
        command={"m": {"mean": 0.5}},
        simulation={"duration": 0.2, "sample_interval": 1e-3},
    )  # fmt: skip
    b = T_R * (k_N - 1.0) / w_R
    stall = 0.5 * k_N * T_R

    def rates(t: float, y: np.ndarray) -> list[float]:
        w, d = y
        return [k * d / J, (stall - k * d) / b - w]

    result = lm.simulate(scenario)
    times = result["time"].values
    expected = solve_ivp(rates, (0.0, 0.2), [0.0, 0.0], "Radau", t_eval=times, rtol=1e-11, atol=1e-13).y
    np.testing.assert_allclose(result["load_speed"].values, expected[0], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(result["rotor_speed"].values, (stall - k * expected[1]) / b, rtol=0.0, atol=1e-5)


def test_two_of_them_in_a_row_and_one_tied_to_another() -> None:
    """Two nodes with a rigid gear between them and a third behind a damped spring: the stages in a row are springs and dampers in a row."""
    spring = {"stiffness": {"kind": "linear", "stiffness": 900.0}, "mesh_damping": 2.0}
    shafts: dict[str, Any] = {"a": {"inertia": 0.02}, "b": {"inertia": 0.3}}
    start = {"speeds": {"a": 5.0}}
    times = {"duration": 0.3, "sample_interval": 1e-3}
    row = lm.Scenario(
        shafts=shafts | {"n1": {}, "n2": {}, "n3": {}},
        gears={
            "s1": {"input": "a", "output": "n1", "ratio": 1.0} | spring,
            "rigid": {"input": "n1", "output": "n2", "ratio": -1.0},
            "s2": {"input": "n2", "output": "n3", "ratio": -1.0} | spring,
            "s3": {"input": "n3", "output": "b", "ratio": 1.0} | spring,
        },
        initial=start,
        simulation=times,
    )
    one = lm.Scenario(
        shafts=shafts,
        gears={"s": gear_between("a", "b", 1.0, mesh_damping=2.0 / 3.0) | {"stiffness": linear(300.0)}},
        initial=start,
        simulation=times,
    )
    for name in ("a_speed", "b_speed"):
        np.testing.assert_allclose(lm.simulate(row)[name].values, lm.simulate(one)[name].values, rtol=0.0, atol=1e-11, err_msg=name)
    result = lm.simulate(row)
    np.testing.assert_allclose(result["n2_speed"].values, -result["n1_speed"].values, rtol=0.0, atol=1e-14)


test_what_has_no_unique_motion_is_refused_with_the_remedy = refusals_of(
    lambda changes: chain().replace(**changes),
    ({"gears.first.mesh_damping": 0.0, "gears.second.mesh_damping": 0.0},
         "shafts.node: give it an inertia (2e-06 kg*m^2 is harmless beside its neighbours), or mesh damping"),
    ({"gears.first.stiffness": GAP["stiffness"], "gears.second.stiffness": GAP["stiffness"]},
         "shafts.node: has no inertia, and no damping acts"),
    ({"shafts.node.friction_torque": 0.1}, "shafts.node: has no inertia, and node_contact is a dry contact at it"),
    ({"gears.first.hysteresis": {"efficiency": 0.9}}, "shafts.node: has no inertia, and first_twist_contact is a dry contact"),
    ({"initial.speeds": {"node": 1.0}}, "initial.speeds.node: node has no inertia, and its speed follows"),
)  # fmt: skip


@pytest.mark.parametrize("seed", range(some(20, 8)))
def test_random_trains_by_both_solvers(seed: int) -> None:
    """Chains of five shafts, every second one without inertia, with backlash, friction of the heavy ones and limited damping."""
    draw = np.random.default_rng(seed)
    shafts, gears = {}, {}
    for k in range(5):
        heavy = {"inertia": float(10.0 ** draw.uniform(-2.0, 0.0)), "friction_torque": float(draw.choice([0.0, 0.2]))}
        shafts[f"s{k}"] = heavy if k % 2 == 0 else {}
    for k in range(4):
        stiffness: dict[str, Any] = {"kind": "linear", "stiffness": float(10.0 ** draw.uniform(2.0, 3.0))}
        gear: dict[str, Any] = {"mesh_damping": float(10.0 ** draw.uniform(-1.0, 1.0))}
        if k % 2 == 0 and draw.random() < 0.7:
            stiffness = {"kind": "curve", "backlash": 0.01, "slopes": [stiffness["stiffness"]]}
            gear["damping_limited"] = bool(draw.random() < 0.5)
        ratio = float(draw.choice([-2.0, 1.0, 3.0]))
        gears[f"g{k}"] = gear | {"input": f"s{k}", "output": f"s{k + 1}", "ratio": ratio, "stiffness": stiffness}
    shafts["s0"]["torque"] = {"amplitude": 5.0, "frequency": float(draw.uniform(1.0, 5.0))}
    scenario = lm.Scenario(shafts=shafts, gears=gears, simulation={"duration": 0.5, "sample_interval": 5e-3})
    exact = lm.simulate(scenario)
    other = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    for name in ("s0_speed", "s1_speed", "s2_speed", "s3_speed", "s4_speed"):
        scale = float(np.abs(exact[name].values).max()) + 1e-3
        np.testing.assert_allclose(other[name].values, exact[name].values, rtol=0.0, atol=1e-6 * scale, err_msg=name)
    energy = lm.energy_of(exact)
    assert abs(energy["residual"]) < 1e-10 * max(1.0, energy["turned_over"])
