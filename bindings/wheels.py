"""Builds the wheels for all platforms on one machine, by the Zig compiler.

    python bindings/wheels.py dist
    python bindings/wheels.py dist --platforms x86_64-linux --pythons cp311

For each platform there are two: for Python 3.11, and for 3.12 and later by the limited API. The headers of both Pythons have to be at
hand; of Python's libraries nothing is needed. The compiler is on PyPI: pip install ziglang.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from zipfile import ZipFile

import nanobind
from c.build import CORE_FLAGS, KERNELS, PLATFORMS, ROOT, fmu, objects, room, zig

HERE = Path(__file__).resolve().parent
BUILD = ROOT / "build" / "wheels"
MODEL = room("analysis", "control", "elements", "model", "scenario", "simulation")
ANALYSES = ROOT / "core" / "kernels" / "analyses.cpp"
BATCH = room("batch")
MODULE = [HERE / f"{name}.cpp" for name in ("module", "described", "elementary")]
LIBRARIES = ROOT / "src" / "lostmotion" / "fmu_libraries"
PAGES = [ROOT / "src" / "lostmotion" / name for name in ("live_page/page.html", "reports/report.js")]
# The builds of the core, as in CMakeLists.txt: the processors they are for.
BUILDS = {"x86_64": {"any": "baseline", "avx2": "x86_64+avx2"}, "aarch64": {"any": "baseline"}}
# Headers of the limited API leave stdio.h out.
NANOBIND_FLAGS = ("-DNDEBUG", "-include", "stdio.h", "-fno-strict-aliasing", "-fno-stack-protector")


@dataclass(frozen=True)
class Platform:
    """One of those of the FMUs' libraries, in the words of wheels."""

    name: str
    target: str
    """of the Zig compiler"""
    tag: str

    @property
    def processor(self) -> str:
        return self.name.partition("-")[0]

    @property
    def system(self) -> str:
        return self.name.partition("-")[2]


@dataclass(frozen=True)
class Python:
    """One for which there is a wheel."""

    tag: str
    """cp311, or cp312 with the limited API"""
    limited: bool

    @property
    def version(self) -> str:
        """Such as 3.11."""
        return f"{self.tag[2]}.{self.tag[3:]}"

    @property
    def abi(self) -> str:
        return "abi3" if self.limited else self.tag

    def suffix(self, platform: Platform) -> str:
        """Of the file names of extension modules."""
        if platform.system == "windows":
            return ".pyd" if self.limited else f".{self.tag}-{platform.tag}.pyd"
        if self.limited:
            return ".abi3.so"
        machine = f"{platform.processor}-linux-gnu" if platform.system == "linux" else "darwin"
        return f".cpython-{self.tag[2:]}-{machine}.so"

    def library(self) -> str:
        """That extension modules for Windows name."""
        return "python3" if self.limited else f"python{self.tag[2:]}"

    def flags(self) -> list[str]:
        """Where its headers are, and which of them count."""
        limited = [f"-DPy_LIMITED_API=0x03{int(self.tag[3:]):02X}0000"] if self.limited else []
        nano = Path(nanobind.source_dir()).parent
        return [
            *(*limited, *NANOBIND_FLAGS, f"-I{headers(self.version)}", f"-I{nano / 'include'}"),
            f"-I{nano / 'ext' / 'robin_map' / 'include'}",
        ]


PYTHONS = {p.tag: p for p in (Python("cp311", False), Python("cp312", True))}
WHEELS = {
    "x86_64-linux": Platform("x86_64-linux", PLATFORMS["x86_64-linux"][0], "manylinux_2_17_x86_64"),
    "aarch64-linux": Platform("aarch64-linux", PLATFORMS["aarch64-linux"][0], "manylinux_2_17_aarch64"),
    "x86_64-windows": Platform("x86_64-windows", PLATFORMS["x86_64-windows"][0], "win_amd64"),
    "aarch64-windows": Platform("aarch64-windows", PLATFORMS["aarch64-windows"][0], "win_arm64"),
    "x86_64-darwin": Platform("x86_64-darwin", "x86_64-macos.11.0", "macosx_11_0_x86_64"),
    "aarch64-darwin": Platform("aarch64-darwin", "aarch64-macos.11.0", "macosx_11_0_arm64"),
}


def of_pyenv(version: str) -> list[str]:
    """The Pythons of a version that pyenv has installed."""
    return [str(p) for p in Path.home().glob(f".pyenv/versions/{version}.*/bin/python")]


@cache
def headers(version: str) -> Path:
    """Python's headers with a pyconfig.h for every platform, in the build directory."""
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    installed = [sys.executable] if version == here else [f"python{version}", *of_pyenv(version)]
    words = ["-c", "import sysconfig; print(sysconfig.get_paths()['include'])"]
    for program in installed:
        told = shutil.which(program) and subprocess.run([program, *words], capture_output=True, text=True, check=False)
        if told and (of_python := Path(told.stdout.strip()) / "Python.h").exists():
            break
    else:
        sys.exit(f"the headers of Python {version} are missing: install it with its headers, as python{version}")
    to = BUILD / f"python{version}"
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(of_python.parent, to, ignore=shutil.ignore_patterns("pyconfig.h", "internal"))
    shutil.copy(HERE / "pyconfig.h", to)
    return to


def compiled(
    sources: Sequence[Path], optimisation: str, platform: Platform, cpu: str, directory: Path, *flags: str
) -> list[Path]:
    """Object files for a platform and its processors."""
    position = [] if platform.system == "windows" else ["-fPIC"]
    target = ["-target", platform.target, f"-mcpu={cpu}", *position]
    return objects(
        [[source] for source in sources], target, optimisation, BUILD / platform.name / directory, (*CORE_FLAGS, *flags)
    )


@cache
def import_library(platform: Platform, python: Python) -> Path:
    """For Windows: of all that Python's headers declare."""
    of_python = headers(python.version)
    declared = "\n".join(p.read_text() for p in sorted(of_python.rglob("*.h")))
    names = dict(re.findall(r"PyAPI_(?:FUNC|DATA)\([^;()]*\)[\s*]*(\w+)\s*([;(\[])", declared))
    directory = BUILD / platform.name / python.tag
    definition = directory / f"{python.library()}.def"
    exports = [name if after == "(" else f"{name} DATA" for name, after in sorted(names.items())]
    definition.write_text("\n".join([f"LIBRARY {python.library()}.dll", "EXPORTS", *exports, ""]))
    to = definition.with_suffix(".lib")
    machine = "i386:x86-64" if platform.processor == "x86_64" else "arm64"
    zig("dlltool", "-m", machine, "-d", definition, "-l", to)
    return to


def extension(platform: Platform, python: Python, name: str, made: Sequence[Path], to: Path) -> None:
    """Link an extension module of these object files into a directory."""
    python_later = {
        "linux": lambda: ["-Wl,-z,undefs"],
        "darwin": lambda: ["-undefined", "dynamic_lookup"],
        "windows": lambda: [import_library(platform, python)],
    }[platform.system]()
    module = to / f"{name}{python.suffix(platform)}"
    zig("c++", "-target", platform.target, "-mcpu=baseline", "-shared", "-s", *made, *python_later, "-o", module)


def extensions(platform: Platform, python: Python, to: Path) -> None:
    """The extension modules of a wheel into a directory."""
    flags = python.flags()
    nano = compiled(
        [Path(nanobind.source_dir()) / "nb_combined.cpp"], "-O3", platform, "baseline", Path(python.tag), *flags
    )
    chooser = compiled([HERE / "instruction_set.cpp"], "-Os", platform, "baseline", Path(python.tag), *flags)
    extension(platform, python, "_instruction_set", [*chooser, *nano], to)
    for build, cpu in BUILDS[platform.processor].items():
        name = f"_core_{build}"
        kernels = compiled(list(KERNELS.values()), "-O3", platform, cpu, Path(build))
        kernels += compiled(BATCH, "-O3", platform, cpu, Path(build) / "batch")
        kernels += compiled(MODEL, "-O2", platform, cpu, Path(build) / "model")
        kernels += compiled([ANALYSES], "-Os", platform, cpu, Path(build))
        own = compiled(MODULE, "-Os", platform, cpu, Path(python.tag) / build, *flags, f"-DCORE_MODULE={name}")
        extension(platform, python, name, [*own, *kernels, *nano], to)


def pure() -> Path:
    """A wheel without anything compiled, unpacked."""
    directory = BUILD / "pure"
    shutil.rmtree(directory, ignore_errors=True)
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(directory)]
    subprocess.run([*pip, "--config-settings=wheel.cmake=false", str(ROOT)], check=True)
    (archive,) = directory.glob("*.whl")
    unpacked = directory / "unpacked"
    with ZipFile(archive) as wheel:
        wheel.extractall(unpacked)
    scenarios = unpacked / "lostmotion" / "scenarios"
    scenarios.mkdir()
    for path in (ROOT / "scenarios").glob("*.toml"):
        shutil.copy(path, scenarios)
    shutil.copytree(LIBRARIES, unpacked / "lostmotion" / "fmu_libraries", dirs_exist_ok=True)
    return unpacked


def wheel(platform: Platform, python: Python, base: Path, to: Path) -> None:
    """The wheel for a platform and a Python."""
    directory = BUILD / "unpacked"
    shutil.rmtree(directory, ignore_errors=True)
    shutil.copytree(base, directory)
    extensions(platform, python, directory / "lostmotion")
    (told,) = directory.glob("*.dist-info/WHEEL")
    tag = f"Tag: {python.tag}-{python.abi}-{platform.tag}"
    lines = [line for line in told.read_text().splitlines() if line and not line.startswith(("Root-Is", "Tag"))]
    told.write_text("\n".join([*lines, "Root-Is-Purelib: false", tag, ""]))
    subprocess.run([sys.executable, "-m", "wheel", "pack", str(directory), "-d", str(to)], check=True)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("to", type=Path, help="directory of the wheels")
    parser.add_argument("--platforms", nargs="+", choices=WHEELS, default=list(WHEELS))
    parser.add_argument("--pythons", nargs="+", choices=PYTHONS, default=list(PYTHONS))
    given = parser.parse_args()
    for built in PAGES:
        if not built.exists():
            sys.exit(f"{built.relative_to(ROOT)} is missing: make page")
    fmu(LIBRARIES)
    subprocess.run([sys.executable, HERE / "fmu" / "sources.py", LIBRARIES / "sources"], check=True)
    base = pure()
    given.to.mkdir(parents=True, exist_ok=True)
    for platform in given.platforms:
        for python in given.pythons:
            wheel(WHEELS[platform], PYTHONS[python], base, given.to)


if __name__ == "__main__":
    main()
