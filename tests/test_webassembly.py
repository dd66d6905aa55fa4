"""The core compiled to WebAssembly gives the bits that the extension gives, which golden.toml holds."""

import hashlib
import json
import shutil
import subprocess
from functools import cache
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS
from lostmotion.portable.scenario_as_numbers import description, kernel_of
from webassembly import END_STATE, ENERGIES, SAMPLES, PortableCore, bits, compiled


@cache
def loaded(path: Path) -> lm.Scenario:
    """The scenario; two seconds of the axes that take long as one train."""
    return lm.load(path, {"simulation.duration": 2.0} if path.stem == "direction-finder" else {})


@cache
def portable(kernel: str) -> PortableCore:
    return PortableCore(kernel)


@cache
def native(path: Path) -> dict[str, np.ndarray]:
    """The same of the extension, by the names of `PortableCore.run`.

    Python solves parts of a train that nothing joins one after the other, the C interface as one train: so it is here, too.
    """
    with patch("lostmotion.simulation.runs.core_runs.parts_of", lambda scenario: [scenario]):
        result = lm.simulate(loaded(path), energy=True)
    out = {f"{SAMPLES} {name}": result[name].values for name in result}
    out |= {f"{ENERGIES} {name}": np.array([v]) for name, v in lm.energy_of(result).items()}
    out |= {f"{END_STATE} {name}": np.array([v]) for name, v in json.loads(result.attrs["end_state"]).items()}
    return out | {"instants": lm.switchings_of(result)["instant"].values}


@pytest.mark.parametrize("path", ALL_SCENARIOS, ids=lambda p: p.stem)
def test_webassembly_gives_the_same_bits(path: Path) -> None:
    scenario = loaded(path)
    there, here = portable(kernel_of(scenario)).run(description(scenario, parameters=False)), native(path)
    there["instants"] = there.pop("switchings")[:, 0]
    assert here.keys() == there.keys()
    assert [name for name in here if bits(here[name]) != bits(there[name])] == []


@pytest.mark.skipif(shutil.which("node") is None, reason="without node")
def test_node_gives_the_same_bits(tmp_path: Path) -> None:
    of_kernel: dict[str, list[Path]] = {}
    for path in ALL_SCENARIOS:
        scenario = loaded(path)
        kernel = kernel_of(scenario)
        of_kernel.setdefault(kernel, []).append(path)
        (tmp_path / kernel).mkdir(exist_ok=True)
        numbers = description(scenario, parameters=False)
        (tmp_path / kernel / f"{path.stem}.bin").write_bytes(numbers.astype("<f8").tobytes())
    script = Path(__file__).with_name("webassembly.mjs")
    for kernel, paths in of_kernel.items():
        words = ["node", str(script), str(compiled(kernel)), str(tmp_path / kernel)]
        told = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
        for path in paths:
            here = native(path)
            for name, digest in told[path.stem].items():
                assert hashlib.sha256(bits(here[f"{SAMPLES} {name}"])).hexdigest() == digest, (path.stem, name)
