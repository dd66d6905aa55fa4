"""Derivatives of runs with respect to values of their scenarios: closed forms, differences of the runs themselves, refusals."""

from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

# Of closed forms: the core's differences of its own numbers are good to 1e-11, what follows is rounding.
EXACT = 1e-10


def shaft(command: object, **values: float) -> lm.Scenario:
    """One shaft of 0.02 kg m2, turned by a torque source of 2 N m for command 1, for one second."""
    return lm.Scenario(
        shafts={"table": {"inertia": 0.02, **values}},
        motors={"motor": {"shaft": "table", "kind": "torque_source", "rated_torque": 2.0, "rotor_inertia": 0.0}},
        command={"motor": command},
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )


def derivative(result: object, variable: str, parameter: str) -> np.ndarray:
    return result[f"{variable}_sensitivity"].sel(parameter=parameter).to_numpy()


def differences(scenario: lm.Scenario, key: str, value: float) -> dict[str, np.ndarray]:
    """Central differences of sixth order."""
    h = 2.0**-11 * value
    weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    sums: dict[str, np.ndarray] = {}
    for k, weight in weights.items():
        up, down = (lm.simulate(scenario.replace(**{key: value + s * k * h}), energy=False) for s in (1, -1))
        for name in up.data_vars:
            sums[name] = sums.get(name, 0.0) + weight / h * (up[name] - down[name]).to_numpy()
    return sums


def check_against_differences(scenario: lm.Scenario, values: dict[str, float], near: float) -> None:
    """Where the variables are smooth: at a tenth of the instants a switching may lie between the runs beside."""
    result = lm.simulate(scenario, sensitivities=list(values))
    assert "sensitivities_end_by" not in result.attrs
    for key, value in values.items():
        wanted = differences(scenario, key, value)
        for name in wanted:
            if f"{name}_sensitivity" not in result:
                continue
            got = derivative(result, name, key)
            gap = np.abs(got - wanted[name])
            size = max(np.nanmax(np.abs(got), initial=0.0), 1e-4 * np.nanmax(np.abs(result[name]), initial=0.0) / value)
            assert np.nanquantile(gap, 0.9, method="lower") <= near * size, (key, name)


def test_an_inertia_that_a_constant_torque_turns() -> None:
    result = lm.simulate(shaft(0.5), sensitivities=["shafts.table.inertia", "command.motor", "motors.motor.rated_torque"])
    t, J, M = result.time.to_numpy(), 0.02, 1.0
    by_inertia = derivative(result, "table_angle", "shafts.table.inertia")
    assert by_inertia == pytest.approx(-M * t**2 / (2 * J**2), rel=EXACT)
    assert derivative(result, "table_speed", "command.motor") == pytest.approx(2.0 * t / J, rel=EXACT)
    assert derivative(result, "table_speed", "motors.motor.rated_torque") == pytest.approx(0.5 * t / J, rel=EXACT)


def test_the_instant_of_break_away_shifts_with_the_friction() -> None:
    J, T_f, rate = 0.02, 0.3, 2.0
    ramp = {"ramps": [{"rise": 1.0, "duration": 1.0}]}
    scenario = shaft(ramp, friction_torque=T_f)
    result = lm.simulate(scenario, sensitivities=["shafts.table.friction_torque"])
    slipping = np.maximum(result.time.to_numpy() - T_f / rate, 0.0)  # since it has broken away
    assert result.table_angle.to_numpy() == pytest.approx(rate * slipping**3 / (6 * J), rel=1e-12, abs=1e-12)
    got = derivative(result, "table_angle", "shafts.table.friction_torque")
    assert got == pytest.approx(-(slipping**2) / (2 * J), rel=1e-9, abs=1e-9)
    got = derivative(result, "table_speed", "shafts.table.friction_torque")
    assert got == pytest.approx(-slipping / J, rel=1e-9, abs=1e-9)


def test_where_a_shaft_stops_depends_on_its_speed_friction_and_inertia() -> None:
    J, T_f, w = 0.02, 0.3, 5.0
    scenario = shaft(0.0, friction_torque=T_f).replace(**{"initial.speeds.table": w})
    keys = ["initial.speeds.table", "shafts.table.friction_torque", "shafts.table.inertia"]
    result = lm.simulate(scenario, sensitivities=keys)
    assert result.table_angle[-1] == pytest.approx(J * w**2 / (2 * T_f), rel=1e-12)
    wanted = (J * w / T_f, -J * w**2 / (2 * T_f**2), w**2 / (2 * T_f))
    for key, value in zip(keys, wanted, strict=True):
        assert derivative(result, "table_angle", key)[-1] == pytest.approx(value, rel=EXACT)
        assert derivative(result, "table_speed", key)[-1] == 0.0


def test_a_step_that_comes_later() -> None:
    scenario = shaft({"steps": [{"time": 0.25, "height": 0.5}]})
    result = lm.simulate(scenario, sensitivities=["command.motor.steps.0.time"])
    since = np.maximum(result.time.to_numpy() - 0.25, 0.0)
    got = derivative(result, "table_angle", "command.motor.steps.0.time")
    assert got == pytest.approx(-since / 0.02, rel=EXACT, abs=1e-12)


def test_the_published_drive_with_play_and_hysteresis() -> None:
    scenario = lm.load("paper-2dof-nl-small").replace(**{"simulation.duration": 1.0, "simulation.sample_interval": 0.02})
    values = {"load.inertia": scenario.load.inertia, "gearbox.ratio": scenario.gearbox.ratio}
    check_against_differences(scenario, values, 1e-7)


def test_a_parameter_that_sets_a_shaft_at_rest_in_motion_has_no_derivative() -> None:
    result = lm.simulate(shaft(0.0, friction_torque=0.3), sensitivities=["initial.speeds.table"])
    assert np.isnan(derivative(result, "table_angle", "initial.speeds.table")).all()
    assert result.attrs["sensitivities_end_at"] == 0.0
    assert "table_contact" in result.attrs["sensitivities_end_by"]


def test_what_cannot_be_varied_is_refused_by_one_line() -> None:
    scenario = shaft(0.5)
    for keys, words in (
        (["shafts.table.inerta"], "shafts.table.inerta: the scenario has nothing of that name; did you mean shafts.table.inertia?"),
        (["shafts.tabel.inertia"], "shafts.tabel.inertia: the scenario has nothing of that name; did you mean shafts.table.inertia?"),
        (["motors.motor.kin"], "motors.motor.kin: the scenario has nothing of that name; give the key of a number"),
        (["x" * 5000], "xxx...: the scenario has nothing of that name; give the key of a number"),
        (["motors.motor.kind"], 'motors.motor.kind: the scenario has "torque_source" there'),
        ([], "give keys of the scenario"),
        (["shafts.table.inertia"] * 2, "each once"),
    ):
        assert words in refused(lambda keys=keys: lm.simulate(scenario, sensitivities=keys))
    other = refused(lambda: lm.simulate(scenario, solver="dormand-prince", sensitivities=["shafts.table.inertia"]))
    assert "derivatives are those of the exact solver" in other


def test_the_parameter_without_derivatives_is_data_of_the_error() -> None:
    scenario = lm.load("position-axis").replace(**{"simulation.duration": 0.01, "controller.position.sample_time": None})
    keys = ["load.inertia", "controller.sample_time"]
    with pytest.raises(lm.InputError, match=r"^sensitivities: key controller\.sample_time: ") as caught:
        lm.simulate(scenario, sensitivities=keys)
    (problem,) = caught.value.problems
    assert problem.keys == ("controller.sample_time",) and problem.reason.startswith("changes the instants")


# --- sensitivities of coupled links with friction and stops ---
LINKS: dict[str, Any] = {
    "shafts": {
        "shoulder": {"friction_torque": 0.3, "torque": {"mean": -1.0, "amplitude": 3.0, "frequency": 0.7}},
        "elbow": {
            "friction_torque": 0.15,
            "breakaway_torque": 0.25,
            "viscous_friction": 0.1,
            "torque": {"amplitude": 1.1, "frequency": 1.3},
        },
        "wheel": {"inertia": 0.05, "friction_torque": 0.02},
    },
    "mass_matrices": {"arm": {"shafts": ["shoulder", "elbow"], "matrix": [[2.6, 0.7], [0.7, 0.4]]}},
    "springs": {"stop": {"shaft": "elbow", "stiffness": {"kind": "curve", "backlash": 0.6, "slopes": [200.0]}}},
    "gears": {
        "mesh": {"input": "shoulder", "output": "wheel", "ratio": 0.5, "stiffness": {"kind": "curve", "backlash": 0.02, "slopes": [300.0]}}
    },
    "simulation": {"duration": 2.0, "sample_interval": 0.05},
}
KEYS = (
    "mass_matrices.arm.matrix.0.1",
    "mass_matrices.arm.matrix.0.0",
    "mass_matrices.arm.matrix.1.1",
    "shafts.elbow.friction_torque",
    "shafts.elbow.breakaway_torque",
    "shafts.shoulder.friction_torque",
    "shafts.elbow.viscous_friction",
    "shafts.shoulder.torque.amplitude",
    "springs.stop.stiffness.backlash",
    "springs.stop.stiffness.slopes.0",
    "gears.mesh.stiffness.backlash",
    "shafts.wheel.inertia",
)
VARIABLES = ("shoulder_speed", "elbow_speed", "wheel_speed", "elbow_angle", "mesh_twist")


def coupled_differences(scenario: lm.Scenario, key: str, value: float) -> dict[str, Any]:
    """Central coupled_differences of fourth order of whole runs."""
    h = 1e-6 * value
    runs = {k: lm.simulate(scenario.replace(**{key: value + k * h})) for k in (-2, -1, 1, 2)}
    weights = {-2: 1.0, -1: -8.0, 1: 8.0, 2: -1.0}
    return {name: sum(weights[k] * run[name].values for k, run in runs.items()) / (12.0 * h) for name in VARIABLES}


def value_of(scenario: lm.Scenario, key: str) -> float:
    node: Any = scenario.model_dump()
    for part in key.split("."):
        node = node[int(part)] if isinstance(node, list | tuple) else node[part]
    return float(node)


@pytest.mark.filterwarnings("ignore::lostmotion.inputs.implausible_values.ValueWarning")
@pytest.mark.parametrize("key", KEYS)
def test_derivatives_of_coupled_links_are_those_of_differences_of_runs(key: str) -> None:
    """Both entries off the diagonal change together; friction sticks, the elbow strikes its stop, the wheel its flanks."""
    scenario = lm.Scenario(**LINKS)
    result = lm.simulate(scenario, sensitivities=[key])
    assert lm.switchings_of(result).sizes["switching"] > 20
    expected = coupled_differences(scenario, key, value_of(scenario, key))
    for name in VARIABLES:
        found = result[f"{name}_sensitivity"].values.ravel()
        size = np.abs(expected[name]).max()
        assert np.isfinite(found).all()
        assert np.abs(found - expected[name]).max() <= 2e-5 * size, name


def test_an_entry_off_the_diagonal_is_set_on_both_sides() -> None:
    scenario = lm.Scenario(**LINKS)
    changed = scenario.replace(**{"mass_matrices.arm.matrix.0.1": 0.5})
    assert changed.mass_matrices["arm"].matrix == ((2.6, 0.5), (0.5, 0.4))
    refused(lambda: scenario.replace(**{"mass_matrices.arm.matrix.0.1": 0.5, "mass_matrices.arm.matrix.1.0": 0.6}), "mass_matrices.arm")
