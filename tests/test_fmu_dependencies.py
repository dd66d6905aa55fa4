"""What an FMU declares of its structure holds in the regimes of runs, whose exact linear models say what depends on what."""

import json
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.portable.dependencies import dependencies_of

OPEN_LOOP = ("paper-2dof-nl-small", "lossy-rigid-gear", "two-motors-one-ring", "worm-lowering")


@pytest.mark.parametrize("name", OPEN_LOOP)
def test_nothing_depends_on_what_is_not_declared(name: str) -> None:
    scenario = lm.load(name)
    states = json.loads(lm.simulate(scenario, energy=False).attrs["end_state"])  # also those that do not move
    for time in np.linspace(0.1, 0.9, 5) * scenario.simulation.duration:
        model = lm.linearize(scenario, time=float(time))
        declared = dependencies_of(scenario, states, model.inputs)
        rows = {f"der({n})": np.append(a, b) for n, a, b in zip(model.states, model.A, model.B, strict=True)}
        rows |= {n: np.append(c, d) for n, c, d in zip(model.outputs, model.C, model.D, strict=True) if n not in model.states}
        for unknown, row in rows.items():
            needed = {n for n, factor in zip((*model.states, *model.inputs), row, strict=True) if factor != 0.0}
            assert needed <= set(declared.get(unknown, needed)), (unknown, time)


def test_accelerations_of_a_soft_gear_depend_on_their_own_side(tmp_path: Path) -> None:
    """By Newton's law: each side has its own torque, and the spring and damper of the gear between them."""
    scenario = lm.Scenario(
        shafts={"motor": {}, "joint": {"inertia": 0.2, "torque": 0.0}},
        motors={"servo": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 3e-5, "rated_torque": 1.0}},
        gears={
            "gear": {
                "input": "motor",
                "output": "joint",
                "ratio": 50.0,
                "stiffness": {"kind": "curve", "backlash": 0.0, "slopes": [8000.0]},
            }
        },
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )
    states = ("motor_speed", "joint_speed", "gear_twist", "joint_angle")
    found = dependencies_of(scenario, states, ("servo_command", "joint_load_torque"))
    assert all(found[name] == [] for name in states)
    assert set(found["der(motor_speed)"]) == {"servo_command", "motor_speed", "joint_speed", "gear_twist"}
    assert set(found["der(joint_speed)"]) == {"joint_load_torque", "motor_speed", "joint_speed", "gear_twist"}
    assert found["der(joint_angle)"] == ["joint_speed"]
    for fmi in (2, 3):
        lm.export_fmu(scenario, tmp_path / "joint.fmu", fmi=fmi)
        with zipfile.ZipFile(tmp_path / "joint.fmu") as archive:
            root = ET.fromstring(archive.read("modelDescription.xml"))
        references = {v.get("name"): v for v in root.find("ModelVariables")}
        places = [v.get("name") for v in root.find("ModelVariables")]
        for unknown in [*root.iter("Unknown"), *root.iter("Output")]:
            index = unknown.get("index")
            name = (
                places[int(index) - 1]
                if index
                else next(n for n, v in references.items() if v.get("valueReference") == unknown.get("valueReference"))
            )
            if re.fullmatch("motor_speed|joint_speed|joint_angle", name) and unknown.get("dependencies") is not None:
                assert unknown.get("dependencies") == ""
