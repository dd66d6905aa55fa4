"""The rules of the house: one-way imports, quick start-up, stub and docs in step with the code."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import lostmotion
from conftest import ROOT
from lostmotion import _instruction_set

PACKAGE = ROOT / "src" / "lostmotion"

# Each module may import only from rooms before its own. The way of the data: parts -> scenario -> run -> dataset ->
# analysis -> plots -> report -> command line.
ROOMS = [
    {"_instruction_set", "errors"},
    {"_core", "variables", "unit_grammar", "validation"},
    {"units"},
    {"quantities", "notebook", "toml_files", "series_files"},
    {"signals", "parts", "task"},
    {"data_sheet"},
    {"loss_map_builder"},
    {"records"},
    {"scenario"},
    {"switchings"},
    {"results"},
    {"sources"},
    {"run"},
    {"test_rig"},
    {"duty_cycle", "holding"},
    {"drive_check"},
    {"stepping"},
    {"explanation"},
    {"linear_analysis"},
    {"shooting"},
    {"harmonic_response"},
    {"paper"},
    {"panels"},
    {"plots"},
    {"pages"},
    {"sheet_rows", "grids"},
    {"rig_sheet"},
    {"study_units", "study_measures", "study_design"},
    {"study_functions"},
    {"study_expressions", "study_records", "study_select"},
    {"study_check"},
    {"study_vary"},
    {"study_file"},
    {"study_chunk"},
    {"study_engine", "study_table"},
    {"study_selection"},
    {"study_selection_report"},
    {"study_report"},
    {"listing"},
    {"response_figures"},
    {"response_sheet"},
    {"run_sheet", "terminal"},
    {"accessor"},
    {"reproduce", "report"},
    {"cli"},
    {"__init__", "__main__"},
]


def imports_of(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            found |= {node.module.split(".")[0]} if node.module else {a.name for a in node.names}
    return found


def test_every_module_has_its_room() -> None:
    assert {p.stem for p in PACKAGE.glob("*.py")} | {"_instruction_set"} == set.union(*ROOMS)


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda p: p.stem)
def test_imports_go_one_way(path: Path) -> None:
    room = next(k for k, names in enumerate(ROOMS) if path.stem in names)
    allowed = set.union(*ROOMS[: room + 1])
    assert imports_of(path) <= allowed


def test_importing_takes_no_plotting_or_data_library_along() -> None:
    script = "import sys, lostmotion; print([m for m in ('matplotlib', 'xarray', 'pydantic', 'pint', 'numpy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_exists_and_is_documented() -> None:
    for name in lostmotion.__all__:
        value = getattr(lostmotion, name)
        assert name == "VARIABLES" or value.__doc__
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = lostmotion.simulat


def test_the_extension_s_stub_is_current(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "nanobind.stubgen",
        "-q",
        "-m",
        "lostmotion._core",
        "-o",
        str(tmp_path / "_core.pyi"),
    ]
    subprocess.run(command, check=True)
    assert (tmp_path / "_core.pyi").read_text() == (PACKAGE / "_core.pyi").read_text(), "run: make stub"


def test_all_builds_of_the_core_give_the_same_bits() -> None:
    script = (
        "import hashlib, sys, lostmotion as lm; from lostmotion import _core;"
        "results = [lm.simulate(lm.load(p)) for p in sys.argv[1:]];"
        "bits = b''.join(v.values.tobytes() for r in results for v in r.data_vars.values() if v.dtype.kind == 'f');"
        "print(_core.__name__, hashlib.sha256(bits).hexdigest(), len(bits))"
    )
    scenarios = [str(p) for p in sorted((ROOT / "scenarios").glob("*.toml"))]
    prints = {}
    for build in _instruction_set.builds():
        done = subprocess.run(
            [sys.executable, "-c", script, *scenarios],
            env=os.environ | {"LOSTMOTION_CORE": build},
            capture_output=True,
            text=True,
            check=True,
        )
        name, *prints[build] = done.stdout.split()
        assert name == f"lostmotion._core_{build}"
    assert int(prints["any"][1]) > 1_000_000
    assert all(p == prints["any"] for p in prints.values())


def test_a_build_of_the_core_that_is_not_there_is_refused() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from lostmotion import _core"],
        env=os.environ | {"LOSTMOTION_CORE": "abacus"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "LOSTMOTION_CORE = 'abacus' is no build of the core here; take " in done.stderr


def test_typing_marker_is_shipped() -> None:
    assert (PACKAGE / "py.typed").exists()


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.stem)
def test_examples_run(path: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, str(path)], cwd=tmp_path, check=True, capture_output=True, timeout=120)


def test_help_names_every_command() -> None:
    done = subprocess.run([sys.executable, "-m", "lostmotion", "--help"], capture_output=True, text=True, check=True)
    for command in ("reproduce", "run", "response", "rig", "catalogue", "scenarios", "drive", "study", "schema"):
        assert f"  {command} " in done.stdout
