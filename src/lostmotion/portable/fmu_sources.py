"""The directory sources/ of an FMU, for tools and targets that compile FMUs themselves."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from ..errors import InputError
from .fmu_variables import document

SOURCES = ("solving.cpp", "model.cpp", "fmi.cpp", "resources.cpp")  # the files to compile
_LANGUAGE = "C++20"
_CMAKE = """# Compiles the FMU for this machine: cmake -S sources -B build && cmake --build build
cmake_minimum_required(VERSION 3.18)
project({identifier} LANGUAGES CXX)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release)
endif()
add_library({identifier} SHARED {sources})
target_compile_features({identifier} PRIVATE cxx_std_20)
set_target_properties({identifier} PROPERTIES PREFIX "" CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden)
# The functions of a shared library have the names of the standard, without the model identifier.
target_compile_definitions({identifier} PRIVATE {override})
# No fused multiply-adds, so that all builds give the same bits.
if(MSVC)
  target_compile_options({identifier} PRIVATE /fp:precise /permissive-)
else()
  target_compile_options({identifier} PRIVATE -ffp-contract=off)
endif()
"""


def source_files(
    directory: Path, fmi: int, kernel: str, identifier: str, description: np.ndarray, names: str
) -> Iterator[tuple[str, str]]:
    """Names and contents of the files in sources/.

    directory: what bindings/fmu/sources.py has written.
    fmi: version of the standard, 2 or 3.
    kernel: kernel that the scenario needs.
    identifier: model identifier, the prefix of all functions.
    description, names: the resources scenario.bin and names.txt.
    """
    listed = directory / "names.txt"
    if not listed.is_file():
        raise InputError(f"{directory}: has no sources of an FMU; run `make fmu-library` in a checkout")
    yield "configuration.hpp", _configuration(fmi, identifier, listed.read_text(encoding="utf-8").split())
    for name, source in (("solving", f"solving_{kernel}"), ("model", "model"), ("fmi", f"fmi{fmi}")):
        yield f"{name}.cpp", (directory / f"{source}.cpp").read_text(encoding="utf-8")
    yield "lostmotion.hpp", (directory / "lostmotion.hpp").read_text(encoding="utf-8")
    yield "resources.cpp", _resources(description, names)
    yield "CMakeLists.txt", _CMAKE.format(identifier=identifier, sources=" ".join(SOURCES), override=_override(fmi))
    if fmi == 3:
        yield "buildDescription.xml", _build_description(identifier)


def _override(fmi: int) -> str:
    """The macro by which the importer asks for the names of the standard."""
    return f"FMI{fmi}_OVERRIDE_FUNCTION_PREFIX"


def _configuration(fmi: int, identifier: str, names: list[str]) -> str:
    """The header that makes the sources the sources of one FMU."""
    functions = [name for name in names if name.startswith(f"fmi{fmi}")]
    others = [name for name in names if not name.startswith("fmi")]
    lines = [
        "// Names that no other FMU in the same program has.",
        "#pragma once",
        "#define LOSTMOTION_EMBEDDED",
        "#define LM_API",
        "#ifdef _MSC_VER",
        "#pragma fp_contract(off)",
        "#pragma warning(disable : 4996 5030)  // snprintf and attributes of other compilers",
        "#endif",
        *(f"#define {name} {identifier}_{name}" for name in others),
        f"#if !defined {_override(fmi)} && !defined DISABLE_PREFIX",
        *(f"#define {name} {identifier}_{name}" for name in functions),
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def _resources(description: np.ndarray, names: str) -> str:
    """The resources as C++. Hexadecimal numbers are exact."""
    numbers = ",\n".join(f"    {float(number).hex()}" for number in description)
    text = "\n".join(f'    "{_escaped(line)}\\n"' for line in names.splitlines())
    return (
        '#include "configuration.hpp"\n\n#include <limits>\n#include <string>\n#include <vector>\n\n'
        "namespace lostmotion::fmu {\n\n"
        "[[maybe_unused]] static constexpr double inf = std::numeric_limits<double>::infinity();\n"
        f"extern const std::vector<double> embedded_scenario = {{\n{numbers}}};\n"
        f"extern const std::string embedded_names =\n{text};\n\n}}  // namespace lostmotion::fmu\n"
    )


def _escaped(line: str) -> str:
    """A line as a literal of C++, in ASCII, with the bytes of UTF-8."""
    plain = line.replace("\\", "\\\\").replace('"', '\\"')
    return "".join(c if ord(c) < 128 else "".join(f"\\{byte:03o}" for byte in c.encode()) for c in plain)


def _build_description(identifier: str) -> str:
    """buildDescription.xml of FMI 3.0."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    listed = ET.SubElement(configuration, "SourceFileSet", language=_LANGUAGE)
    for name in SOURCES:
        ET.SubElement(listed, "SourceFile", name=name)
    ET.SubElement(listed, "PreprocessorDefinition", name=_override(3), value="", optional="true")
    return document(root).decode()
