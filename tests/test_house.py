"""The rules of the house: one-way imports, quick start-up, stub and docs in step with the code."""

import ast
import math
import re
import runpy
import subprocess
import sys
import typing
from graphlib import TopologicalSorter
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel
from scipy.interpolate import CubicSpline

import lostmotion
import lostmotion as lm
from conftest import ROOT, run_in_build
from lostmotion import _core
from lostmotion import reproducible as r
from lostmotion.inputs import core_parameters
from lostmotion.model.drive import Drive
from lostmotion.studies.runs.read_table import read_table
from lostmotion.studies.runs.runs_in_core import core_can
from lostmotion.units.conversion import Unit
from public_names import PATHS, public

PACKAGE = ROOT / "src" / "lostmotion"

# Each package may import only from those in layers below its own, each module of the root counts as a package. The way of
# the data: units -> parts -> scenario -> run -> dataset -> analysis -> figures and reports -> command line.
LAYERS = [
    {"errors", "namespace", "verdict", "version", "_instruction_set"},
    {"_core", "atomic_writer"},
    {"recorded_numbers", "interruptible_threads"},
    {"reproducible"},
    {"units"},
    {"inputs"},
    {"model"},
    {"data_sheets", "control"},
    {"simulation"},
    {"response", "test_rig"},
    {"servo"},
    {"sizing", "pointing"},
    {"studies", "identification"},
    {"portable"},
    {"mujoco"},
    {"warp"},
    {"live_page"},
    {"reports"},
    {"paper"},
    {"cli"},
    {"__init__", "__main__"},
]
# The same within packages that have rooms of their own; modules beside the rooms count as rooms.
INNER = {
    "simulation": [{"variables"}, {"variables_of_trains"}, {"forms"}, {"scenario"}, {"stepping"}, {"runs"}, {"batches"}],
    "studies": [{"expressions"}, {"study"}, {"runs"}, {"selection"}],
    "identification": [
        {"task"},
        {"readers"},
        {"prepared_log"},
        {"rig"},
        {"preparation"},
        {"fit"},
        {"verdicts"},
        {"candidate_models"},
        {"left_out_conditions", "result_as_scenario", "virtual_logs", "monitor"},
        {"result", "virtual_campaign"},
        {"identify", "experiment_design"},
    ],
    "servo": [
        {"winding"},
        {"linear_regimes"},
        {"tuning_data", "linear_sampled_loop"},
        {"margins"},
        {"axis_runs"},
        {"hunting"},
        {"settling", "tuning_result"},
        {"tuning"},
        {"commissioning_report"},
    ],
}
MODULES = sorted(p.relative_to(PACKAGE).with_suffix("") for p in PACKAGE.rglob("*.py"))
SOURCES = sorted(p for room in ("lostmotion", "kernels") for p in (ROOT / "core" / room).rglob("*.?pp"))
HEADERS = [path for path in SOURCES if path.suffix == ".hpp"]


def imports_of(module: Path) -> set[Path]:
    """Modules of the package from which a module imports anywhere, also inside its functions."""
    found = set()
    for node in ast.walk(ast.parse((PACKAGE / module).with_suffix(".py").read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            home = module.parents[node.level - 1] / (node.module or "").replace(".", "/")
            inner = [home / a.name for a in node.names]
            found |= {m if (PACKAGE / m).with_suffix(".py").exists() else home for m in inner}
    return {m / "__init__" if (PACKAGE / m).is_dir() else m for m in found}


def room_of(module: Path) -> str:
    """The package of a module, by its path below the root."""
    return module.parts[0]


def test_every_package_has_its_layer() -> None:
    assert {room_of(m) for m in MODULES} | {"_instruction_set"} == set.union(*LAYERS)


def test_imports_go_to_lower_layers_only() -> None:
    upward = {}
    for module in MODULES:
        layer = next(k for k, names in enumerate(LAYERS) if room_of(module) in names)
        others = {room_of(m) for m in imports_of(module)} - {room_of(module)}
        upward[str(module)] = others - set().union(*LAYERS[:layer])
    assert {module: rooms for module, rooms in upward.items() if rooms} == {}


@pytest.mark.parametrize("package", INNER)
def test_imports_within_a_package_go_to_lower_rooms_only(package: str) -> None:
    own = [m for m in MODULES if m.parts[0] == package and m.name != "__init__"]
    assert {m.parts[1] for m in own} == set.union(*INNER[package])
    upward = {}
    for module in own:
        layer = next(k for k, names in enumerate(INNER[package]) if module.parts[1] in names)
        others = {m.parts[1] for m in imports_of(module) if m in own} - {module.parts[1]}
        upward[str(module)] = others - set().union(*INNER[package][:layer])
    assert {module: rooms for module, rooms in upward.items() if rooms} == {}


def test_no_modules_import_each_other_in_a_circle() -> None:
    TopologicalSorter({m: imports_of(m) for m in MODULES}).prepare()  # raises CycleError, which names the circle


# The same for the rooms of the core.
CORE_LAYERS = [
    {"base"},
    {"kernel", "parts"},
    {"solver"},
    {"control"},
    {"elements"},
    {"model"},
    {"simulation"},
    {"analysis"},
    {"scenario"},
    {"kernels"},
    {"batch"},
]


def included_by(source: Path) -> set[Path]:
    """The files of the core that one of them includes."""
    names = re.findall(r'#include "(.+)"', source.read_text())
    return {next(p for at in (source.parent, ROOT / "core") if (p := (at / name).resolve()).exists()) for name in names}


def test_includes_go_to_lower_layers_only() -> None:
    upward = {}
    for source in SOURCES:
        layer = next(k for k, rooms in enumerate(CORE_LAYERS) if source.parent.name in rooms)
        others = {h.parent.name for h in included_by(source)} - {source.parent.name}
        upward[f"{source.parent.name}/{source.name}"] = others - set().union(*CORE_LAYERS[:layer])
    assert {source: rooms for source, rooms in upward.items() if rooms} == {}


def test_no_headers_include_each_other_in_a_circle() -> None:
    includes = {h: included_by(h) for h in HEADERS}
    assert set().union(*includes.values()) <= includes.keys()
    assert sum(map(len, includes.values())) > len(HEADERS) / 2  # the pattern finds them
    TopologicalSorter(includes).prepare()


def test_only_kernels_see_the_solver() -> None:
    """Headers of `kernel` and `solver` are included in `core/kernels` alone."""
    solving = {"kernel", "solver", "kernels"}
    seen = {s: {h.parent.name for h in included_by(s)} & solving for s in SOURCES}
    assert sum(map(bool, seen.values())) > 20
    assert {s.parent.name for s, rooms in seen.items() if rooms} <= solving


# What ties code to a platform: threads, exceptions, and functions of the mathematical library that it need not round
# correctly, so that their last bits differ from system to system (sqrt, fma, floor, ldexp and the like are exact).
PORTABLE = ("base", "kernel", "kernels", "solver", "parts", "control", "elements", "model", "simulation", "scenario")
PLATFORM = (
    r"\b(thread_local|throw|try|catch)\b"
    r"|#include <(thread|mutex|atomic|condition_variable|future|exception|stdexcept|iostream)>"
    r"|std::(a?(sin|cos|tan)h?|atan2|exp2?|expm1|log(2|10|1p)?|pow|cbrt|hypot)\("
)


def test_what_solves_is_bound_to_no_platform() -> None:
    code = {s.name: re.sub(r"//.*", "", s.read_text()) for s in SOURCES if s.parent.name in PORTABLE}
    assert [name for name, text in code.items() if re.search(PLATFORM, text)] == []


def test_what_binds_to_a_platform_is_recognised() -> None:
    for line in ("thread_local int n;", "#include <mutex>", "throw 1;", "y = std::sin(x);", "std::pow(x, 3)", "std::log(x)"):
        assert re.search(PLATFORM, line)
    for line in ("std::sqrt(x)", "std::floor(x)", "sine_cosine(x)", "#include <memory>", "// country"):
        assert not re.search(PLATFORM, line)


# What Python derives from a scenario before the core sees it. These packages take functions that each platform rounds
# differently from `reproducible`, which has them from the core.
DERIVES = ("units", "inputs", "model", "control", "data_sheets", "simulation", "reproducible")
OUTSIDE = {
    "control/satellites": "SGP4 and its spline are libraries; docs/theory.md leaves satellites out of the promise",
    "model/self_locking": "its eigenvalues decide a verdict and enter no run",
    "units/conversion": "its powers are of decimal numbers",
    "units/unit_table": "its powers are of decimal numbers",
}
PERMITTED = {("control/continuous", "np.linalg"): "its eigenvalues decide whether a limit is refused, and enter no run"}
ROUNDED_DIFFERENTLY = {
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "power", "float_power", "cbrt", "hypot", "sinc"),
    *("linalg", "fft", "interp", "dot", "vdot", "inner", "matmul", "einsum", "tensordot", "convolve", "correlate"),
    *("polyfit", "polyval", "geomspace", "logspace", "trapezoid", "fsum", "sumprod", "dist", "gamma", "erf"),
}


def rounded_differently(code: str) -> list[str]:
    """Uses of functions and operators whose last bits depend on the platform, each with its line."""
    found = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.value.id in ("np", "math", "numpy") and node.attr in ROUNDED_DIFFERENTLY:
                found.append(f"line {node.lineno}: {node.value.id}.{node.attr}")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            found.append(f"line {node.lineno}: @")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            # Powers of two and of whole numbers are exact.
            base, power = (x.value if isinstance(x, ast.Constant) else None for x in (node.left, node.right))
            if not (isinstance(base, int) and isinstance(power, int)) and base != 2.0:
                found.append(f"line {node.lineno}: **")
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            found += [f"line {node.lineno}: {name}" for name in names if name.split(".")[0] == "scipy"]
    return found


def test_what_enters_the_core_is_rounded_alike_on_every_platform() -> None:
    concerned = [m for m in MODULES if room_of(m) in DERIVES and str(m) not in OUTSIDE]
    uses = {str(m): rounded_differently((PACKAGE / m).with_suffix(".py").read_text()) for m in concerned}
    refused = {
        module: left
        for module, found in uses.items()
        if (left := [use for use in found if (module, use.partition(": ")[2]) not in PERMITTED])
    }
    assert refused == {}, "use the functions of lostmotion.reproducible"


def test_functions_that_platforms_round_differently_are_recognised() -> None:
    for line in ("np.sin(x)", "math.log10(x)", "x**2", "x ** 0.5", "a @ b", "np.linalg.solve(a, b)", "from scipy import x"):
        assert rounded_differently(line), line
    for line in ("sin(x)", "x * x", "2.0**-11", "2**53", "10**6", "np.sqrt(x)", "math.ldexp(x, 2)", "f(**options)"):
        assert not rounded_differently(line), line


def test_importing_takes_no_plotting_or_data_library_along() -> None:
    script = "import sys, lostmotion; print([m for m in ('matplotlib', 'xarray', 'pydantic', 'pint', 'numpy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_exists_and_is_documented() -> None:
    for name in PATHS:
        assert name == "VARIABLES" or public(name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = lostmotion.simulat


def test_no_part_states_again_what_the_core_describes() -> None:
    assert lostmotion.simulation.TrainTables.model_fields  # with it all parts are made
    assert lostmotion.simulation.DriveTables.model_fields
    bases = core_parameters.Described.__subclasses__()
    assert {base.__name__ for base in bases} == {f"{table}Fields" for table in core_parameters.TABLES}
    parts = [part for base in bases for part in base.__subclasses__()]
    assert {part.__name__: set(part.described) & set(vars(part).get("__annotations__", {})) for part in parts} == {
        part.__name__: set() for part in parts
    }


def test_every_described_parameter_says_what_it_is() -> None:
    for table, rows in core_parameters.TABLES.items():
        for key, kind, symbol, unit, meaning, _, needed, default, _ in rows:
            assert symbol or meaning, f"{table}.{key}"
            assert unit or kind != "pair" or key in ("limits", "loss_range"), f"{table}.{key}"
            assert default is None or not needed, f"{table}.{key}"


def test_a_loss_map_is_validated_once() -> None:
    checked = []

    def count(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_name == "_is_a_map":
            checked.append(frame.f_code)

    sys.setprofile(count)
    try:
        lostmotion.simulate(lostmotion.load("position-axis"), duration=0.01)
    finally:
        sys.setprofile(None)
    assert len(checked) == 1


def test_the_extension_s_stub_is_current(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "lostmotion._core", "-o", str(tmp_path / "_core.pyi")]
    subprocess.run(command, check=True)
    assert (tmp_path / "_core.pyi").read_text() == (PACKAGE / "_core.pyi").read_text(), "run: make stub"
    assert core_parameters.stub() == (PACKAGE / "inputs" / "core_parameters.pyi").read_text(), "run: make stub"


def test_a_build_of_the_core_that_is_not_there_is_refused() -> None:
    done = run_in_build("abacus", "-c", "from lostmotion import _core")
    assert done.returncode != 0
    assert "LOSTMOTION_CORE = 'abacus' is no build of the core here; take " in done.stderr


def test_typing_marker_is_shipped() -> None:
    assert (PACKAGE / "py.typed").exists()


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.stem)
def test_examples_run(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(path)])
    runpy.run_path(str(path), run_name="__main__")


# --- the core's tables of names and parameters, from which Python and the binding are made ---
# What the core has no use for as it stands in a file: ratings, texts, the two voltages of which it takes the ratio, and what
# makes a synchronous motor a DC motor.
# The line of a motor becomes its rated point.
LINE = {"motor.stall_torque", "motor.no_load_speed", "motor.stall_current", "motor.no_load_current"}
NOT_OF_THE_CORE = {"motor.rated_voltage", "motor.voltage_limit", "motor.dc_voltage"} | LINE
# A stiffness of the kind rigid has the flanks of a gear.
OF_THE_CORE_ALONE = {"motor.command_limit", "gearbox.flanks.backlash", "gearbox.flanks.restitution"}


def plain_numbers(part: Any, prefix: str) -> dict[str, str]:
    """Units of all fields of a part that are single numbers, by dotted key, laws of compliance and losses included."""
    found = {}
    for name, field in part.model_fields.items():
        if name in ("limits", "winding"):
            continue
        key = f"{prefix}{name}"
        units = [m.unit for m in (*field.metadata, *annotations_in(field.annotation)) if isinstance(m, Unit)]
        models = [a for a in (field.annotation, *typing.get_args(field.annotation)) if is_model(a)]
        if units and not models and "tuple" not in str(field.annotation):
            found[key] = units[0]
        for model in models:
            found |= plain_numbers(model, f"{key}.")
    return found


def is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def annotations_in(annotation: Any) -> list[Any]:
    nested = [annotations_in(a) for a in typing.get_args(annotation)]
    return [*getattr(annotation, "__metadata__", ()), *(m for each in nested for m in each)]


def test_every_number_of_a_drive_is_a_parameter_of_the_core_with_the_same_unit() -> None:
    ours = plain_numbers(Drive, "")
    curves = ("gearbox.stiffness.", "gearbox.mesh_stiffness.")  # become the curves of the core
    ours = {key: unit for key, unit in ours.items() if not key.startswith(curves)}
    assert ours.keys() >= {"motor.rotor_inertia", "gearbox.hysteresis.efficiency", "load.friction_torque"}
    core = dict(_core.parameters())
    assert core.keys() - OF_THE_CORE_ALONE == ours.keys() - NOT_OF_THE_CORE
    assert {key: core[key] for key in core.keys() & ours} == {key: ours[key] for key in core.keys() & ours}


def test_a_drive_of_the_core_refuses_a_parameter_that_it_does_not_know() -> None:
    with pytest.raises(ValueError, match=r"unknown keys among .*mass"):
        _core.Train().add_motor("m", shaft="motor", fields={"mass": 1.0})


def test_the_states_are_variables_and_what_a_run_can_start_from() -> None:
    names = _core.states()
    assert names == [n for n in lm.Initial.model_fields if n not in ("hysteresis_capacity", "on_reference")]
    assert set(names) <= {v.name for v in lm.simulation.VARIABLES}


def test_a_constant_efficiency_varies_in_the_core_as_in_single_runs(tmp_path: Path) -> None:
    base = lm.load(ROOT / "scenarios" / "paper-2dof-l-large.toml", ["simulation.duration=0.2"])
    study = lm.studies.Study(
        scenario=base, vary=[{"key": "gearbox.losses.efficiency", "values": [0.6, 0.7]}], keep={"end": "final(load_angle)"}
    )
    assert core_can(study)
    rows = read_table(lm.study(study, tmp_path / "s")).to_pydict()
    for value, end in zip((0.6, 0.7), rows["end"], strict=True):
        single = lm.simulate(base.replace(**{"gearbox.losses.efficiency": value}))
        assert end == float(single["load_angle"][-1])
    assert len(set(rows["end"])) == 2


def test_names_of_the_ledger_add_up_to_the_balance() -> None:
    result = lm.simulate(lm.load(ROOT / "scenarios" / "paper-2dof-nl-small.toml", ["simulation.duration=0.5"]))
    e = lm.energy_of(result)
    lost = sum(e[n] for n in _core.energy_entries()[1:8])
    assert e["source"] - lost - e["kinetic_change"] - e["elastic_change"] == pytest.approx(e["residual"], abs=1e-12 * e["turned_over"])


def test_a_cause_s_number_goes_with_what_the_contacts_do() -> None:
    result = lm.simulate(lm.load(ROOT / "scenarios" / "paper-2dof-nl-small.toml"))
    s = lm.switchings_of(result)
    flags, meanings = s["cause"].attrs["flag_values"], s["cause"].attrs["flag_meanings"].split()
    assert len(flags) == len(meanings)
    of = dict(zip(meanings, flags, strict=False))
    rest = s["cause"].values == of["came_to_rest"]
    contacts = [name.removesuffix("_before") for name in s if str(name).endswith("contact_before")]
    before = np.stack([s[f"{c}_before"].values for c in contacts])
    after = np.stack([s[f"{c}_after"].values for c in contacts])
    # Where a contact has come to rest one was slipping before; where one has broken away one was stuck.
    assert rest.any() and (np.abs(before[:, rest]) == 1).any(axis=0).all()
    free = s["cause"].values == of["broke_away"]
    assert free.any() and ((before[:, free] == 0) & (np.abs(after[:, free]) == 1)).any(axis=0).all()


# --- functions that give the same bits on every platform, against NumPy and SciPy; their errors are tested in the core ---
RANDOM = np.random.default_rng(5)
ULP = 2.0**-52  # relative, at most
ANGLES = np.concatenate([RANDOM.uniform(-20.0, 20.0, 2000), RANDOM.uniform(-1e9, 1e9, 200), [0.0, -0.0]])
POSITIVE = np.exp(RANDOM.uniform(-300.0, 300.0, 2000))
NEAR_ONE = RANDOM.uniform(0.1, 10.0, 2000)


# The functions of NumPy are good to 4 units in the last place or better.
@pytest.mark.parametrize(("own", "other", "x", "units"), [
    (r.sin, np.sin, ANGLES, 5.0),
    (r.cos, np.cos, ANGLES, 5.0),
    (r.tan, np.tan, ANGLES, 7.0),
    (r.exp, np.exp, ANGLES[:2000], 6.0),
    (r.expm1, np.expm1, np.concatenate([ANGLES[:2000], 1e-9 * ANGLES]), 7.0),
    (r.log, np.log, POSITIVE, 6.0),
    (r.cbrt, np.cbrt, np.concatenate([POSITIVE, -POSITIVE]), 5.0),
])  # fmt: skip
def test_functions_of_one_number_are_those_of_numpy(own, other, x, units) -> None:
    wanted = other(x)
    assert np.all(np.abs(own(x) - wanted) <= units * ULP * np.abs(wanted))
    assert own(float(x[3])) == own(x)[3]
    assert isinstance(own(float(x[3])), float)
    assert own(x.reshape(2, -1)).shape == (2, x.size // 2)


def test_functions_of_two_numbers_are_those_of_numpy() -> None:
    y, x = RANDOM.uniform(-1.0, 1.0, (2, 2000))
    wanted = np.arctan2(y, x)
    assert np.all(np.abs(r.arctan2(y, x) - wanted) <= 6.0 * ULP * np.abs(wanted))
    assert r.arctan2(0.0, -1.0) == math.pi
    assert r.arctan(1.0) == math.pi / 4.0
    exponent = 3.0 * x
    bound = (6.0 + 3.0 * np.abs(exponent * np.log(NEAR_ONE))) * ULP
    assert np.all(np.abs(r.power(NEAR_ONE, exponent) / NEAR_ONE**exponent - 1.0) <= bound)
    assert r.log10(1000.0) == pytest.approx(3.0, rel=4.0 * ULP)


def test_ends_of_the_range() -> None:
    with np.errstate(all="ignore"):
        assert np.isnan(r.sin(np.array([np.nan, np.inf]))).all()
        assert r.exp(np.array([-np.inf, 800.0, -800.0])).tolist() == [0.0, math.inf, 0.0]
        assert r.log(np.array([0.0, np.inf])).tolist() == [-math.inf, math.inf]
        assert np.isnan(r.log(-1.0))
        assert r.power(np.array([0.0, 0.0]), np.array([2.0, 0.0])).tolist() == [0.0, 1.0]
    assert abs(r.sin(1e13)) <= 1.0


def test_straight_lines_are_those_of_numpy() -> None:
    points, values = np.cumsum(RANDOM.uniform(0.1, 1.0, 12)), RANDOM.normal(size=12)
    x = np.concatenate([RANDOM.uniform(-1.0, points[-1] + 1.0, 500), points])
    assert np.allclose(r.interpolate(x, points, values), np.interp(x, points, values), rtol=0.0, atol=1e-14)
    assert r.interpolate(points, points, values).tolist() == values.tolist()
    assert r.interpolate(5.0, [1.0], [7.0]) == 7.0


@pytest.mark.parametrize("points", [2, 3, 4, 5, 40])
@pytest.mark.parametrize("channels", [(), (3,)])
def test_cubic_splines_are_those_of_scipy(points: int, channels: tuple[int, ...]) -> None:
    times = np.cumsum(RANDOM.uniform(0.05, 1.0, points))
    values = RANDOM.normal(size=(points, *channels))
    # Slopes are rounded to about the condition of the system, below 10, times the values over the least interval.
    assert np.allclose(r.cubic_spline(times, values), CubicSpline(times, values).c[::-1], rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 7, 16, 60, 97, 360, 1024])
def test_fourier_sums_are_those_of_numpy(n: int) -> None:
    x, y = RANDOM.normal(size=(2, n))
    real, imaginary = r.fourier_sum(x, y)
    wanted = n * np.fft.ifft(x + 1j * y)
    # Each of n terms is rounded a few times, of the size of the numbers summed.
    assert np.abs(real + 1j * imaginary - wanted).max() <= 4.0 * ULP * n * math.log2(n + 1)


def test_sums_are_made_one_by_one() -> None:
    """Python compensates `sum` from 3.12 on: 1 + 1e-16 + 1e-16 would be 1 + 2.2e-16."""
    assert r.total([1.0, 1e-16, 1e-16]) == 1.0
    assert r.total([0.1, 0.2], 0.3) == (0.3 + 0.1) + 0.2
