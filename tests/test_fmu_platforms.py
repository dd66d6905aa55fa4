"""The libraries that `make fmu` builds for other platforms give the bits of Python: aarch64 under QEMU, Windows under Wine.

Run where there are the libraries and what runs them: `make test-fmu`.
"""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.portable import fmu_export as exporting
from lostmotion.portable.dependencies import dependencies_of
from lostmotion.simulation.forms.key_aliases import DRIVE
from tables import gear_between, run_of, torque_source

BUILT = Path(os.environ.get("LOSTMOTION_FMU_LIBRARIES", ROOT / "src" / "lostmotion" / "fmu_libraries"))
WINE = shutil.which("wine64", path=f"{os.environ['PATH']}:/usr/lib/wine")
QEMU = shutil.which("qemu-aarch64")
ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")
# Platform, target of the Zig compiler, what runs its programs.
RUNNERS: dict[str, tuple[str, list[str] | None]] = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", []),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", [QEMU, "-L", str(ARM_LIBRARIES)] if QEMU and ARM_LIBRARIES.exists() else None),
    "x86_64-windows": ("x86_64-windows-gnu", [WINE] if WINE else None),
}
STEPS, INTERVAL = 200, 1e-3


def built_driver(platform: str, to: Path) -> Path:
    target, _ = RUNNERS[platform]
    program = to / ("driver.exe" if "windows" in platform else "driver")
    cache = str(ROOT / "build" / "zig")
    subprocess.run(
        [
            *(sys.executable, "-m", "ziglang", "cc", "-target", target, "-O1", "-ffp-contract=off"),
            *(str(ROOT / "tests" / "fmu_driver.c"), "-o", str(program)),
            *([] if "windows" in platform else ["-ldl"]),
        ],
        env=os.environ | {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache},
        check=True,
    )
    return program


def of_python(scenario: Any, outputs: list[str]) -> list[list[float]]:
    """The same steps, with the inputs that tests/fmu_driver.c gives."""
    simulation = lm.Simulation(scenario, step=scenario.simulation.sample_interval)
    rows = []
    for s in range(STEPS):
        first = [0.0625 * ((s + k) % 7 - 3) for k in range(len(simulation.inputs))]
        rate = 8.0 * (s % 3 - 1)
        ends = {name: (a, a + rate * INTERVAL) for name, a in zip(simulation.inputs, first, strict=True)}
        simulation.advance(INTERVAL, **ends)
        read = simulation.read()
        rows.append([read[name] for name in outputs])
    return rows


@pytest.mark.parametrize("platform", RUNNERS)
def test_other_platforms_give_the_bits_of_python(platform: str, tmp_path: Path) -> None:
    pytest.importorskip("ziglang", reason="ziglang is missing: .venv/bin/pip install --group portable")
    fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")
    runner = RUNNERS[platform][1]
    if not list((BUILT / platform).glob("drive.*")):
        pytest.skip(f"`make fmu` has not built the library for {platform}")
    if runner is None:
        pytest.skip(f"nothing here runs programs for {platform}")
    driver = built_driver(platform, tmp_path)
    for name in lm.shipped_scenarios():
        scenario = lm.load(name)
        if scenario.form != DRIVE and scenario.given():
            continue  # whose steps are those of Co-Simulation alone
        path = tmp_path / f"{name}.fmu"
        lm.export_fmu(scenario, path, libraries=BUILT)
        description = fmpy.read_model_description(str(path))
        outputs = [v.name for v in description.modelVariables if v.causality == "output"]
        inputs = [v.name for v in description.modelVariables if v.causality == "input"]
        assert inputs == list(lm.Simulation(scenario).inputs)
        open_at = tmp_path / name
        with zipfile.ZipFile(path) as archive:
            archive.extractall(open_at)
        place, extension = exporting.PLATFORMS[2][platform]
        library = open_at / "binaries" / place / f"lostmotion.{extension}"
        drive = "Z:" if "windows" in platform else ""
        done = subprocess.run(
            [
                *(*runner, str(driver), f"{drive}{library}", f"file:///{drive}{open_at / 'resources'}", description.guid),
                *(str(len(inputs)), str(len(outputs)), str(STEPS), str(INTERVAL)),
            ],
            check=False,
            capture_output=True,
            text=True,
            env=os.environ | {"WINEDEBUG": "-all"},
        )
        assert done.returncode == 0, done.stderr
        told = [[struct.unpack(">d", bytes.fromhex(word))[0] for word in line.split()] for line in done.stdout.split("\n")]
        shared = [k for k, o in enumerate(outputs) if o in lm.Simulation(scenario).read()]
        assert len(shared) > 5
        wanted = of_python(scenario, [outputs[k] for k in shared])
        assert [[row[k] for k in shared] for row in told[:STEPS]] == wanted, name


# --- what an FMU declares of its structure holds in the regimes of runs, whose exact linear models say what depends on what ---
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
        motors={"servo": torque_source(3e-5, "motor", rated_torque=1.0)},
        gears={"gear": gear_between("motor", "joint", 50.0, {"kind": "curve", "backlash": 0.0, "slopes": [8000.0]})},
        simulation=run_of(1.0, 0.01),
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
