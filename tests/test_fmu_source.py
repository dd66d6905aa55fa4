"""FMUs with sources: they compile by the standards alone, and give the bits of the libraries in the FMU."""

import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.portable.fmu_sources import SOURCES

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group dev")
COMPILER = shutil.which("g++") or shutil.which("c++")
CMAKE = shutil.which("cmake") or shutil.which("cmake", path=str(Path(sys.executable).parent))
STRICT = ("-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fvisibility=hidden", "-fPIC")


def exported(name: str, to: Path, fmi: int = 2) -> Path:
    """The directory of an FMU with sources, axis.fmu beside it."""
    to.mkdir(exist_ok=True)
    lm.export_fmu(lm.load(name), to / "axis.fmu", fmi=fmi, source=True)
    with zipfile.ZipFile(to / "axis.fmu") as archive:
        archive.extractall(to / "axis")
    return to / "axis"


def compiled(sources: Path, to: Path, definitions: Sequence[str], files: Sequence[str]) -> list[Path]:
    """Objects of the sources, without the extensions of GCC; its warnings are errors."""
    made = {to / Path(name).with_suffix(".o").name: sources / name for name in files}
    to.mkdir(exist_ok=True)
    flags = [*STRICT, *(f"-D{d}" for d in definitions)]
    for made_of, source in made.items():
        subprocess.run([str(COMPILER), *flags, "-c", str(source), "-o", str(made_of)], check=True)
    return list(made)


def shared_names(objects: Sequence[Path]) -> list[str]:
    """Names that objects define for all others; the linker takes one of several inline functions."""
    listed = subprocess.run(["nm", "-g", "--defined-only", *objects], check=True, capture_output=True, text=True).stdout
    words = [line.split() for line in listed.splitlines() if len(line.split()) > 2]
    return [name for _, kind, name in words if kind not in "VWu"]


def results(fmu: Path) -> Any:
    """A run by Co-Simulation."""
    return fmpy.simulate_fmu(str(fmu), stop_time=0.5, output_interval=1e-3, fmi_type="CoSimulation")


def same_bits(found: Any, wanted: Any) -> None:
    assert found.dtype.names == wanted.dtype.names
    assert len(found) == 501
    assert float(np.ptp(found["load_angle"])) > 0.01
    for name in found.dtype.names:
        assert found[name].tobytes() == wanted[name].tobytes(), name


@pytest.mark.skipif(None in (CMAKE, COMPILER, shutil.which("nm")), reason="there is no CMake, no C++ compiler, or no nm")
@pytest.mark.slow("the sources of an FMU are compiled")
def test_sources_give_the_bits_of_the_library_and_share_no_names_with_another_fmu(tmp_path: Path) -> None:
    """By CMake in FMI 3, file by file in FMI 2, of which all but the interface is the same and compiled once.

    A program that links FMUs statically needs other names for the functions of each; a library has those of the standard.
    """
    three, two = (exported("position-axis", tmp_path / str(fmi), fmi) for fmi in (3, 2))
    wanted = results(tmp_path / "3" / "axis.fmu")
    build = tmp_path / "build"
    flags = " ".join((*STRICT, "-DLOSTMOTION_PLAIN_VECTORS"))
    for command in (
        [CMAKE, "-S", three / "sources", "-B", build, f"-DCMAKE_CXX_FLAGS={flags}", "-DCMAKE_CXX_FLAGS_RELEASE=-DNDEBUG"],
        [CMAKE, "--build", build, "--parallel", "2"],
    ):
        subprocess.run(list(map(str, command)), check=True, capture_output=True)
    library = next((three / "binaries").rglob("axis.*"))
    shutil.copy(next(build.glob("axis.*o*")), library)
    same_bits(results(three), wanted)

    shared = ("solving.cpp", "model.cpp", "lostmotion.hpp")
    for name in shared:
        assert (two / "sources" / name).read_bytes() == (three / "sources" / name).read_bytes()
    objects = [next(build.rglob(f"{name}.o")) for name in shared if name.endswith(".cpp")]
    names = shared_names(objects + compiled(two / "sources", tmp_path / "static", [], ["fmi.cpp", "resources.cpp"]))
    assert {"axis_fmi2DoStep", "axis_lm_advance"} <= set(names)
    assert [name for name in names if "axis_" not in name] == []

    objects += compiled(two / "sources", tmp_path / "library", ["FMI2_OVERRIDE_FUNCTION_PREFIX"], ["fmi.cpp", "resources.cpp"])
    library = next((two / "binaries").rglob("axis.*"))
    before = library.read_bytes()
    subprocess.run([str(COMPILER), "-shared", *map(str, objects), "-o", str(library)], check=True)
    assert library.read_bytes() != before
    shutil.rmtree(two / "resources")  # the sources contain them
    same_bits(results(two), wanted)


def test_the_description_lists_the_sources(tmp_path: Path) -> None:
    for fmi, listed in ((2, "modelDescription.xml"), (3, "sources/buildDescription.xml")):
        directory = exported("paper-2dof-nl-small", tmp_path, fmi)
        root = ET.parse(directory / listed).getroot()
        assert [e.get("name") for e in root.iter("SourceFile" if fmi == 3 else "File")][:4] == list(SOURCES)
        description = fmpy.read_model_description(str(tmp_path / "axis.fmu"), validate=True)
        assert description.coSimulation.modelIdentifier == "axis"


def test_without_sources_there_is_one_clear_line(tmp_path: Path) -> None:
    source = next((Path(lm.__file__).parent / "fmu_libraries").glob("*/all.*"))
    to = tmp_path / source.parent.name
    to.mkdir()
    shutil.copy(source, to)
    with pytest.raises(lm.InputError, match="has no sources of an FMU; run `make fmu-library`"):
        lm.export_fmu(lm.load("paper-2dof-nl-small"), tmp_path / "a.fmu", source=True, libraries=tmp_path)
