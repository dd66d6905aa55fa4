"""The libraries that `make fmu` builds for other platforms give the bits of Python: aarch64 under QEMU, Windows under Wine.

Run where there are the libraries and what runs them: `make test-fmu`.
"""

import os
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.portable import fmu as exporting
from lostmotion.simulation.forms.key_aliases import DRIVE

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
