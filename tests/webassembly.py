"""The C interface compiled to WebAssembly: other vectors, another mathematical library, no processor of its own."""

import importlib.util
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

MISSING = "the compiler is missing: .venv/bin/pip install --group portable"
pytest.importorskip("ziglang", reason=MISSING)
wasmtime: Any = pytest.importorskip("wasmtime", reason=MISSING)

ROOT = Path(__file__).parent.parent
SAMPLES, ENERGIES, END_STATE, SWITCHINGS = range(4)


@cache
def builder() -> Any:
    """bindings/c/build.py"""
    spec = importlib.util.spec_from_file_location("c_build", ROOT / "bindings" / "c" / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def compiled(kernel: str) -> Path:
    """The core of live pages for drives in the short form, or for trains of a kernel."""
    path: Path = builder().page_cores([kernel])[0]
    return path


class PortableCore:
    """Functions of lostmotion.h in an instance of the module of a kernel."""

    def __init__(self, kernel: str) -> None:
        engine = wasmtime.Engine()
        module = wasmtime.Module.from_file(engine, str(compiled(kernel)))
        assert [i.name for i in module.imports] == []
        self._store = wasmtime.Store(engine)
        self._exports = wasmtime.Instance(self._store, module, []).exports(self._store)
        self._memory = self._exports["memory"]
        self._exports["_initialize"](self._store)

    def __call__(self, function: str, *arguments: Any) -> Any:
        return self._exports[function](self._store, *arguments)

    def place(self, numbers: np.ndarray) -> int:
        """The address of numbers in the memory of the module."""
        address: int = self("malloc", 8 * numbers.size)
        self._memory.write(self._store, numbers.astype("<f8").tobytes(), address)
        return address

    def numbers(self, address: int, count: int) -> np.ndarray:
        return np.frombuffer(bytes(self._memory.read(self._store, address, address + 8 * count)), "<f8")

    def text(self, address: int) -> str:
        end = address
        while self._memory.read(self._store, end, end + 1)[0]:
            end += 1
        return bytes(self._memory.read(self._store, address, end)).decode()

    def scenario(self, description: np.ndarray) -> int:
        numbers, error = self.place(description), self("malloc", 1000)
        handle: int = self("lm_scenario_read", numbers, description.size, error, 1000)
        assert handle, self.text(error)
        self("free", numbers)
        self("free", error)
        return handle

    def run(self, description: np.ndarray) -> dict[str, np.ndarray]:
        """All that a whole run of a scenario gives, by name."""
        scenario = self.scenario(description)
        result = self("lm_scenario_run", scenario, 1, 100_000)
        assert result, self.text(self("lm_scenario_error", scenario))
        assert self("lm_result_status", result) == 0
        out = {}
        each = self("lm_result_samples", result)
        for part, length in ((SAMPLES, each), (ENERGIES, 1), (END_STATE, 1)):
            count = self("lm_result_count", result, part)
            values = self.numbers(self("lm_result_values", result, part), count * length).reshape(count, length)
            for k in range(count):
                out[f"{part} {self.text(self('lm_result_name', result, part, k))}"] = values[k]
        rows, columns = self("lm_result_switching_count", result), self("lm_result_count", result, SWITCHINGS)
        table = self.numbers(self("lm_result_values", result, SWITCHINGS), rows * columns)
        out["switchings"] = table.reshape(rows, columns)
        self("lm_result_free", result)
        self("lm_scenario_free", scenario)
        return out


def bits(values: Any) -> bytes:
    """Of the numbers; one NaN is like another."""
    numbers = np.array(values, "<f8")
    numbers[np.isnan(numbers)] = math.nan
    return numbers.tobytes()
