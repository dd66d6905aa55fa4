"""The programs of the benchmark compile, and its modules can be imported: `make bench` runs too long for a test."""

import importlib
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
BENCHMARKS = ROOT / "benchmarks"
FOREIGN = {"timed_compiler"}  # a command, which runs when it is imported


def test_the_programs_compile() -> None:
    """As one, which takes a third of the time."""
    programs = sorted(BENCHMARKS.glob("*.cpp"))
    if not Path("/usr/include/cvode/cvode.h").exists():  # SUNDIALS
        programs.remove(BENCHMARKS / "peer_cvode.cpp")
    text = "".join(f'#define main main_of_{p.stem}\n#include "{p}"\n#undef main\n' for p in programs)
    flags = ["-std=gnu++20", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    flags += ["-Wno-return-type"]  # main alone needs no return
    command = ["c++", "-x", "c++", "-fsyntax-only", *flags, "-I", ROOT / "core", "-"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("module", sorted({p.stem for p in BENCHMARKS.glob("*.py")} - FOREIGN))
def test_a_module_can_be_imported(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as missing:  # a peer, which only `make bench` installs
        if (missing.name or "").split(".")[0] in {"lostmotion", *(p.stem for p in BENCHMARKS.glob("*.py"))}:
            raise
        pytest.skip(f"without {missing.name}")
