"""The wheels that `make wheels` builds: what is in them, and the same bits as here wherever this machine can run them.

Run where there are wheels: `make test-wheels`. Each is installed into an environment of its own with what it needs from the package
index; aarch64 runs under QEMU in Debian's Python, which `make aarch64-python` unpacks.
"""

import os
import re
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path
from zipfile import ZipFile

import pytest

import lostmotion as lm
from conftest import ROOT

DIST = Path(os.environ.get("LOSTMOTION_WHEELS", ROOT / "dist"))
WHEELS = {p.name.split("-", 2)[2].removesuffix(".whl"): p for p in sorted(DIST.glob("lostmotion-*.whl"))}
ARM = ROOT / "build" / "aarch64"
QEMU = shutil.which("qemu-aarch64")
# The builds of the core by the name of the processor in the tag.
BUILDS = {"x86_64": {"any", "avx2"}, "amd64": {"any", "avx2"}, "aarch64": {"any"}, "arm64": {"any"}}
FMU_PLATFORMS = [f"{p}-{s}" for p in ("aarch64", "x86_64") for s in ("darwin", "linux", "windows")]
NEEDED = "[study]"
"""by tests/golden.py"""

pytestmark = pytest.mark.skipif(not WHEELS, reason="there are no wheels in dist/: make wheels")


def processor(tag: str) -> str:
    return next(p for p in BUILDS if tag.endswith(p))


@pytest.mark.parametrize("tag", WHEELS)
def test_a_wheel_holds_all_that_a_user_needs(tag: str) -> None:
    with ZipFile(WHEELS[tag]) as wheel:
        names = wheel.namelist()
        told = wheel.read(next(n for n in names if n.endswith(".dist-info/WHEEL"))).decode()
    assert f"Tag: {tag}\n" in told
    assert "Root-Is-Purelib: false" in told
    suffix = r"\.abi3\.so|\.pyd" if "abi3" in tag else r"\.cpython-311-[\w-]+\.so|\.cp311-\w+\.pyd"
    modules = {m.group(1) for n in names if (m := re.fullmatch(rf"lostmotion/_core_(\w+?)(?:{suffix})", n))}
    assert modules == BUILDS[processor(tag)]
    assert any(re.fullmatch(rf"lostmotion/_instruction_set(?:{suffix})", n) for n in names)
    libraries = {(p.parent.name, p.stem) for p in map(Path, names) if p.parts[1] == "fmu_libraries"}
    assert libraries == set(product(FMU_PLATFORMS, ("drive", "middle", "any")))
    assert {"lostmotion/live_page/page.html", "lostmotion/live_page/any.wasm.gz"} <= set(names)
    assert {f"lostmotion/reports/{name}" for name in ("report.js", "style.css", "report.css")} <= set(names)
    assert {f"lostmotion/scenarios/{name}.toml" for name in lm.shipped_scenarios()} <= set(names)


def same_bits(python: list[str], *, build: str = "any", home: Path, packages: str = "") -> None:
    """tests/golden.py by another Python, far from the checkout's own package."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")} | {"LOSTMOTION_CORE": build}
    if packages:
        environment["PYTHONPATH"] = packages
    golden = [*python, str(ROOT / "tests" / "golden.py")]
    told = subprocess.run(golden, env=environment, cwd=home, capture_output=True, text=True, check=False)
    assert told.stderr == ""
    assert told.stdout == ""
    assert told.returncode == 0


def of_linux(abi: str) -> str:
    return next((t for t in WHEELS if abi in t and t.endswith("linux_2_17_x86_64")), "")


@pytest.mark.parametrize(("version", "abi"), [("3.11", "cp311-cp311"), ("3.12", "cp312-abi3"), ("3.13", "cp312-abi3")])
def test_an_installed_wheel_gives_the_same_bits(version: str, abi: str, tmp_path: Path) -> None:
    if sys.platform != "linux" or not of_linux(abi):
        pytest.skip("there is no such wheel for this machine in dist/")
    candidates = [f"python{version}", *map(str, Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))]
    here = "import sys; print('{}.{}'.format(*sys.version_info))"
    for python in candidates:
        told = shutil.which(python) and subprocess.run([python, "-c", here], capture_output=True, text=True, check=False)
        if told and told.stdout.strip() == version:
            break
    else:
        pytest.skip(f"Python {version} is missing")
    subprocess.run([python, "-m", "venv", tmp_path / "venv"], check=True)
    own = str(tmp_path / "venv" / "bin" / "python")
    pip = [own, "-m", "pip", "install", "-q", "--only-binary=:all:"]
    subprocess.run([*pip, f"{WHEELS[of_linux(abi)]}{NEEDED}"], check=True)
    for build in sorted(BUILDS["x86_64"]):
        same_bits([own], build=build, home=tmp_path)


def test_the_wheel_for_aarch64_gives_the_same_bits_under_qemu(tmp_path: Path) -> None:
    tag = next((t for t in WHEELS if t.startswith("cp311") and t.endswith("linux_2_17_aarch64")), "")
    if not tag or QEMU is None or not (ARM / "usr" / "bin" / "python3.11").exists():
        pytest.skip("for aarch64: its wheel, qemu-user and make aarch64-python")
    platforms = [f"--platform=manylinux_2_{minor}_aarch64" for minor in (17, 28)]
    pip = [sys.executable, "-m", "pip", "install", "-q", "--python-version=3.11", "--only-binary=:all:", *platforms]
    subprocess.run([*pip, f"--target={tmp_path}", f"{WHEELS[tag]}{NEEDED}"], check=True)
    python = [QEMU, "-L", str(ARM), str(ARM / "usr" / "bin" / "python3.11")]
    same_bits(python, home=tmp_path, packages=str(tmp_path))
