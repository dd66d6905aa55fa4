"""Sensitivities of coupled links with friction and stops: against differences of runs, and their own laws."""

from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

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


def differences(scenario: lm.Scenario, key: str, value: float) -> dict[str, Any]:
    """Central differences of fourth order of whole runs."""
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
    expected = differences(scenario, key, value_of(scenario, key))
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
