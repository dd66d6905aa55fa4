"""The core compiled to WebAssembly gives the bits that the extension gives, which golden.toml holds."""

import hashlib
import json
import shutil
import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS
from lostmotion.portable.description import description
from lostmotion.simulation.train_parts import parts_of
from portable import END_STATE, ENERGIES, SAMPLES, PortableCore, bits, compiled


def of_one_part(path: Path) -> bool:
    """Python solves parts of a train that nothing joins one after the other, the C interface as one train."""
    scenario = lm.load(path)
    return isinstance(scenario, lm.Scenario) or len(parts_of(scenario)) == 1


SCENARIOS = [path for path in ALL_SCENARIOS if of_one_part(path)]


@pytest.fixture(scope="module")
def portable() -> PortableCore:
    return PortableCore()


@cache
def native(path: Path) -> dict[str, np.ndarray]:
    """The same of the extension, by the names of `PortableCore.run`."""
    result = lm.simulate(lm.load(path))
    out = {f"{SAMPLES} {name}": result[name].values for name in result}
    out |= {f"{ENERGIES} {name}": np.array([v]) for name, v in lm.energy_of(result).items()}
    out |= {f"{END_STATE} {name}": np.array([v]) for name, v in json.loads(result.attrs["end_state"]).items()}
    return out | {"instants": lm.switchings_of(result)["instant"].values}


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_webassembly_gives_the_same_bits(path: Path, portable: PortableCore) -> None:
    there, here = portable.run(description(lm.load(path), parameters=False)), native(path)
    there["instants"] = there.pop("switchings")[:, 0]
    assert here.keys() == there.keys()
    assert [name for name in here if bits(here[name]) != bits(there[name])] == []


@pytest.mark.skipif(shutil.which("node") is None, reason="without node")
def test_node_gives_the_same_bits(tmp_path: Path) -> None:
    module = compiled()
    for path in SCENARIOS:
        (tmp_path / f"{path.stem}.bin").write_bytes(
            description(lm.load(path), parameters=False).astype("<f8").tobytes()
        )
    script = Path(__file__).with_name("portable.mjs")
    done = subprocess.run(["node", str(script), str(module), str(tmp_path)], capture_output=True, text=True, check=True)
    told = json.loads(done.stdout)
    for path in SCENARIOS:
        here = native(path)
        for name, digest in told[path.stem].items():
            assert hashlib.sha256(bits(here[f"{SAMPLES} {name}"])).hexdigest() == digest, (path.stem, name)
