"""The core compiled to WebAssembly gives the bits that the extension gives, which golden.toml holds."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS, CONTROLLED
from lostmotion import _core
from lostmotion.model.drive import _core_drive
from lostmotion.model.signals import _core_signal
from portable import PortableCore, Recorder


@pytest.fixture(scope="module")
def portable() -> PortableCore:
    return PortableCore()


@pytest.fixture(scope="module")
def recorder() -> Iterator[Recorder]:
    for kept in (_core_drive, _core_signal):
        kept.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        yield Recorder(patch)


def bits(values: Any) -> bytes:
    """Of the numbers; one NaN is like another."""
    numbers = np.array(values, "<f8")
    numbers[np.isnan(numbers)] = np.nan
    return numbers.tobytes()


def flat(*values: Any) -> np.ndarray:
    return np.concatenate([np.ravel(np.asarray(v, float)) for v in values])


def of_drive(result: Any) -> np.ndarray:
    samples, switchings, _, energy, end, capacity, _, _, _ = result
    return flat(end, capacity, energy, switchings, samples)


def of_train(result: dict[str, Any]) -> np.ndarray:
    return flat([*result["end_state"].values()], [*result["energy"].values()], result["switchings"], result["values"])


@pytest.mark.parametrize("solver", ["exact", "dormand-prince"])
@pytest.mark.parametrize("path", [p for p in ALL_SCENARIOS if p not in CONTROLLED], ids=lambda p: p.stem)
def test_webassembly_gives_the_same_bits(path: Path, solver: Any, portable: PortableCore, recorder: Recorder) -> None:
    compared = []

    def checked(what: int, native: Any, of: Any) -> Any:
        def run(*arguments: Any) -> Any:
            result = native(*arguments)
            status, time, *there = portable([what, *recorder.numbers(*arguments[:-1])])  # without controllers
            assert status == 0.0
            assert time == arguments[4 if what else 5]
            assert bits(there) == bits(of(result))
            compared.append(len(there))
            return result

        return run

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_core, "run", checked(0, _core.run, of_drive))
        patch.setattr(_core, "run_train", checked(1, _core.run_train, of_train))
        lm.simulate(lm.load(path), solver=solver)
    assert sum(compared) > 1000
