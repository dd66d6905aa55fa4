"""The core compiled to WebAssembly: other vectors, another mathematical library, no processor of its own."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lostmotion import _core

MISSING = "the compiler is missing: .venv/bin/pip install --group portable"
pytest.importorskip("ziglang", reason=MISSING)
wasmtime: Any = pytest.importorskip("wasmtime", reason=MISSING)

ROOT = Path(__file__).parent.parent
SOURCES = sorted((ROOT / "core" / "portable").glob("*.cpp"))
BUILD = ROOT / "build" / "portable"
TARGET = ("-target", "wasm32-wasi")
FLAGS = ("-std=gnu++20", "-O2", "-g0", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
PLAIN = ("-fno-exceptions", "-fno-rtti")


def compiled() -> Path:
    """The module, compiled anew if anything in the core has changed since."""
    module = BUILD / "run.wasm"
    newest = max(p.stat().st_mtime for p in (*(ROOT / "core" / "lostmotion").rglob("*.hpp"), *SOURCES))
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one process of the tests compiles, the others wait
        if module.exists() and module.stat().st_mtime > newest:
            return module
        begun = time.time()
        objects = [BUILD / f"{source.stem}.o" for source in SOURCES]
        for source, made in zip(SOURCES, objects, strict=True):
            zig("c++", "-c", *FLAGS, *PLAIN, f"-I{ROOT / 'core'}", source, "-o", made)
        zig("cc", "-s", *objects, "-o", module)  # not c++: that would compile libc++, too
        os.utime(module, (begun, begun))  # what is edited in the meantime is newer
    return module


def zig(command: str, *arguments: str | Path) -> None:
    """A command of the Zig compiler, with its cache in the build directory."""
    cache = str(ROOT / "build" / "zig")
    environment = os.environ | {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
    words = [sys.executable, "-m", "ziglang", command, *TARGET, *map(str, arguments)]
    subprocess.run(words, env=environment, check=True)


class PortableCore:
    """Runs what is asked of it in a fresh instance of the module."""

    def __init__(self) -> None:
        self._engine = wasmtime.Engine()
        self._module = wasmtime.Module.from_file(self._engine, str(compiled()))
        self._linker = wasmtime.Linker(self._engine)
        self._linker.define_wasi()

    def __call__(self, numbers: list[float]) -> np.ndarray:
        """Numbers to its standard input, those of its standard output back."""
        with tempfile.TemporaryDirectory() as directory:
            to, back = Path(directory) / "in", Path(directory) / "out"
            to.write_bytes(np.array(numbers, "<f8").tobytes())
            wasi = wasmtime.WasiConfig()
            wasi.stdin_file, wasi.stdout_file = str(to), str(back)
            wasi.inherit_stderr()
            store = wasmtime.Store(self._engine)
            store.set_wasi(wasi)
            self._linker.instantiate(store, self._module).exports(store)["_start"](store)
            return np.frombuffer(back.read_bytes(), "<f8")


class Recorder:
    """Stands in for the makers of the extension, and knows with which arguments each object was made."""

    def __init__(self, patch: Any) -> None:
        self._made: dict[int, tuple[Any, list[float]]] = {}
        for name in ("TorsionCurve", "LossMap", "Signal", "Drive"):
            patch.setattr(
                _core, name, self._recording(getattr(_core, name), [] if name in ("Signal", "Drive") else [1])
            )
        patch.setattr(_core, "quadratic_drag", self._recording(_core.quadratic_drag, [2]))
        patch.setattr(_core, "PeriodicCurve", self._periodic_curve(_core.PeriodicCurve))
        patch.setattr(_core, "Train", self._train(_core.Train))

    def _recording(self, make: Any, prefix: list[float]) -> Any:
        def recorded(*arguments: Any, **named: Any) -> Any:
            made = make(*arguments, **named)
            self._made[id(made)] = made, [*prefix, *self.numbers(*arguments, *named.values())]
            return made

        return recorded

    def _periodic_curve(self, native: Any) -> Any:
        recorded = self._recording(native, [1])
        recorded.sine = self._recording(native.sine, [2])
        return recorded

    def _train(self, native: Any) -> Any:
        recorder = self

        class Train(native):  # type: ignore[misc]
            def __init__(self) -> None:
                super().__init__()
                self.added: list[list[float]] = []

        def adding(name: str) -> Any:
            def add(self: Any, *arguments: Any, **named: Any) -> None:
                getattr(native, name)(self, *arguments, **named)
                self.added.append(recorder.numbers(name, *arguments, *named.values()))

            return add

        for name in dir(native):
            if name.startswith("add_"):
                setattr(Train, name, adding(name))
        return Train

    def numbers(self, *values: Any) -> list[float]:
        """Arguments as core/portable/run.cpp reads them."""
        return [x for value in values for x in self._of(value)]

    def _of(self, value: Any) -> list[float]:
        if value is None:
            return [0.0]
        if isinstance(value, str):
            return [float(len(value)), *map(float, value.encode("ascii"))]
        if isinstance(value, dict):
            return [float(len(value)), *self.numbers(*(x for item in value.items() for x in item))]
        if isinstance(value, (list, tuple)):
            return [float(len(value)), *self.numbers(*value)]
        if hasattr(value, "added"):
            return [float(len(value.added)), *(x for call in value.added for x in call)]
        if id(value) in self._made:
            return self._made[id(value)][1]
        return [float(value)]
