"""What is installed with what: declared libraries, extras, messages where one is missing, warnings of compilers."""

import ast
import json
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

import lostmotion as lm
from conftest import ROOT, Command, forks

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


def names(requirements: list[str]) -> set[str]:
    return {re.match(r"[\w-]+", r).group().lower() for r in requirements}  # type: ignore[union-attr]


def imports(node: ast.AST) -> set[str]:
    """Other people's packages that are imported anywhere below a node."""
    found = set()
    for n in ast.walk(node):
        if isinstance(n, ast.Import):
            found |= {a.name.partition(".")[0] for a in n.names}
        elif isinstance(n, ast.ImportFrom) and n.level == 0 and n.module:
            found.add(n.module.partition(".")[0])
    own = {"lostmotion", "mpl_toolkits", "pydantic_core", "markupsafe"}  # the last three come with those they belong to
    return {m.lower() for m in found - own if m not in sys.stdlib_module_names}


def test_the_core_installation_is_small_and_covers_all_that_is_imported_at_once() -> None:
    core = names(PROJECT["dependencies"])
    assert core == {"numpy", "xarray", "pydantic", "matplotlib", "typer", "rich"}
    everything = core | set().union(*(names(r) for r in EXTRAS.values()))
    for path in (ROOT / "src" / "lostmotion").glob("*.py"):
        tree = ast.parse(path.read_text())
        checking = [n for n in tree.body if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.dump(n.test)]
        at_once = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
        assert set().union(*(imports(n) for n in at_once)) <= core, path.name
        assert imports(tree) - set().union(*(imports(n) for n in checking)) <= everything, path.name


def test_extras_and_metadata() -> None:
    assert {"study", "docs", "report"} <= set(EXTRAS)
    assert names(EXTRAS["all"]) == {"lostmotion"}
    assert PROJECT["version"] == lm.__version__
    assert any(c.startswith("Topic :: Scientific/Engineering") for c in PROJECT["classifiers"])
    cited = (ROOT / "CITATION.cff").read_text()
    assert re.search(r"^version: (.*)$", cited, re.M).group(1) == PROJECT["version"]  # type: ignore[union-attr]
    assert f"license: {PROJECT['license']}" in cited


# --- missing libraries ---
OPTIONAL = ("scipy", "pyarrow", "h5netcdf", "h5py", "jinja2", "control", "SALib", "distributed", "dask")


def without(libraries: Collection[str]) -> str:
    """Statements after which these libraries cannot be imported."""
    return f"import sys; sys.modules.update(dict.fromkeys({list(libraries)!r}));"


def without_extras(*calls: str, cwd: Path, but: Collection[str] = ()) -> Iterator[Command]:
    """Commands in processes where the optional libraries cannot be imported, but for some."""
    before = f"{without([name for name in OPTIONAL if name not in but])} import lostmotion.simulation.scenario.scenario"
    return forks(map(shlex.split, calls), cwd, before)


MAKEFILE = (ROOT / "Makefile").read_text()
NEXT = re.findall(r"echo '(?:Next:| {5}) \$\(BIN\)/lostmotion ([^']+)'", MAKEFILE)


def test_the_core_installation_runs_checks_and_draws(tmp_path: Path) -> None:
    grid = "--amplitudes 0.1,1 --frequencies 1,2,3"
    response, *others = without_extras(
        f"response paper-2dof-nl-small {grid} -o r",
        "run paper-2dof-nl-small -o small.csv --plot small.png --explain 0.3",
        "drive check catalogue-robot-joint",
        "catalogue",
        "catalogue schaeffler-rt1-h-20-100",
        "scenarios",
        "schema",
        cwd=tmp_path,
    )
    assert [done.args for done in (response, *others) if done.returncode != 0] == []
    # It leaves out only the file that it cannot write.
    assert 'response.nc is left out: it needs h5netcdf; install it: pip install "lostmotion[netcdf]"' in response.stdout
    assert {p.name for p in (tmp_path / "r").iterdir()} == {
        "response.html", "bode.csv", "response.csv", "characteristics.csv",
    }  # fmt: skip


def test_the_commands_that_make_demo_names_need_only_what_it_installs(tmp_path: Path) -> None:
    installed = re.findall(r'--editable "\.\[([\w,]+)\]"', MAKEFILE)[0].split(",")
    libraries = {re.match(r"[\w-]+", text)[0] for extra in installed for text in EXTRAS[extra]}  # type: ignore[index]
    for done, name in zip(without_extras(*NEXT, cwd=tmp_path, but=libraries), ("run", "rig", "servo"), strict=True):
        assert done.args[0] == name
        misses = "does not fit: stable, but misses the window" in done.stdout  # the verdict on the axis, no error
        assert misses == (name == "servo")
        assert done.returncode == (1 if misses else 0), done
        assert done.stderr == ""


def test_a_missing_library_ends_in_one_line_that_says_what_to_install(tmp_path: Path) -> None:
    study = f"study {ROOT / 'examples' / 'tolerance.toml'} -o t"
    needs = {
        "run paper-2dof-nl-small -o a.nc": ("h5netcdf", "netcdf"),
        "run paper-2dof-nl-small -o a.parquet": ("pyarrow", "study"),
        "reproduce -o out": ("jinja2", "report"),
        study: ("pyarrow", "study"),
        f"{study} --scheduler tcp://a:1": ("distributed", "cluster"),
    }
    for done, (library, extra) in zip(without_extras(*needs, cwd=tmp_path), needs.values(), strict=True):
        assert done.returncode == 1
        (line,) = done.stderr.splitlines()
        assert line.endswith(f'needs {library}; install it: pip install "lostmotion[{extra}]"')
        assert library.lower() in names(EXTRAS[extra])
    assert list(tmp_path.iterdir()) == []


def test_in_python_too() -> None:
    """Each of these without the optional libraries."""
    calls = {
        "lm.response.bandwidth(s, 1.0)": "scipy",
        "lm.linearize(s, lm.Initial(motor_speed=1.0)).antiresonances()": "scipy",
        "lm.linearize(s, lm.Initial(motor_speed=1.0)).to_scipy()": "scipy",
        "lm.linearize(s, lm.Initial(motor_speed=1.0)).to_control()": "control",
    }
    script = f"{without(OPTIONAL)} import lostmotion as lm; s = lm.load('paper-2dof-nl-small')\n"
    script += "".join(f"try: {call}\nexcept lm.MissingLibraryError as error: print(error)\n" for call in calls)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    for line, library in zip(done.stdout.splitlines(), calls.values(), strict=True):
        assert line.endswith(f'needs {library}; install it: pip install "lostmotion[control]"')


# --- building ---
@pytest.mark.parametrize("strict", [False, True])
def test_warnings_are_errors_in_our_own_builds_only(tmp_path: Path, strict: bool) -> None:
    tools = Path(sys.executable).parent
    cmake = shutil.which("cmake", path=str(tools)) or shutil.which("cmake")
    ninja = shutil.which("ninja", path=str(tools)) or shutil.which("ninja")
    options = ["-DLOSTMOTION_BENCHMARKS=ON", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"] + ["-DLOSTMOTION_WERROR=ON"] * strict
    command = [cmake, "-S", ROOT, "-B", tmp_path, "-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={ninja}", *options]
    subprocess.run(command, check=True, capture_output=True)  # type: ignore[arg-type]
    compiled = json.loads((tmp_path / "compile_commands.json").read_text())
    assert len(compiled) >= 2
    core = [c["command"] for c in compiled if "-ffp-contract=off" in c["command"]]
    assert core
    assert all(("-Werror" in c) is strict for c in core)
    makefile = (ROOT / "Makefile").read_text().replace("\\\n", " ")
    configured = [line for line in makefile.splitlines() if re.search(r"(cmake|CMAKE\)) -S", line)]
    assert len(configured) == 2  # the build tree and the benchmark
    assert all("LOSTMOTION_WERROR=ON" in line for line in configured)
