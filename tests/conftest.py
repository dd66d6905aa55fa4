"""Shared by the tests."""

import contextlib
import gc
import io
import json
import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

# Before NumPy is imported: on small matrices the threads of BLAS take up to ten times the time that they save.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import lostmotion as lm
from lostmotion import _instruction_set
from lostmotion.cli import main
from tables import gear_between, mesh_efficiency, run_of, torque_source

ROOT = Path(__file__).parent.parent
ALL_SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))
TRAINS = [p for p in ALL_SCENARIOS if any(table in p.read_text() for table in ("[shafts", "[controllers.", "[axis."))]
"""in the long form"""
SCENARIOS = [path for path in ALL_SCENARIOS if path not in TRAINS]
"""in the short form"""
CONTROLLED = [path for path in ALL_SCENARIOS if "[controller" in path.read_text()]
"""with a controller"""


# A shell that runs the tests in the background has Ctrl-C ignored, which the processes that they interrupt would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def large() -> Path:
    return ROOT / "scenarios" / "paper-2dof-nl-large.toml"


@pytest.fixture(scope="session")
def small() -> Path:
    return ROOT / "scenarios" / "paper-2dof-nl-small.toml"


@pytest.fixture(scope="module")
def fast_compiles() -> Iterator[None]:
    """Kernels of Warp with little optimisation."""
    import warp as wp

    level = wp.config.optimization_level
    wp.config.optimization_level = 1
    yield
    wp.config.optimization_level = level


def jamming() -> lm.Scenario:
    """A rigid self-locking worm under a heavy load, which jams: its effective inertia is below zero."""
    return lm.Scenario(
        shafts={"worm": {}, "drum": {"inertia": 2.0, "torque": 20.0}},
        motors={"motor": torque_source(1e-4, "worm")},
        gears={"gear": gear_between("worm", "drum", 50, {"kind": "rigid"}, losses=mesh_efficiency(0.44, -0.2))},
        initial={"speeds": {"worm": -100.0, "drum": -2.0}},
        simulation=run_of(0.1, 1e-3),
    )


def module_at(directory: Path, name: str) -> ModuleType:
    """A file of Python that is in no package, as a module of its own."""
    spec = spec_from_file_location(f"at_{name}", directory / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def some(every: int, usual: int) -> int:
    """Number of random cases that are tried: `make soak` tries every one."""
    return every if os.environ.get("LOSTMOTION_CASES") == "1" else usual


def for_all(cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[[], None]]:
    """A test of many small cases that reports all failures at once; a tuple gives several arguments."""

    def wrap(check: Callable[..., None]) -> Callable[[], None]:
        def test() -> None:
            failures = []
            for case in cases:
                arguments = case if isinstance(case, tuple) else (case,)
                try:
                    check(*arguments)
                except (Exception, pytest.fail.Exception) as failure:
                    failures.append(f"{arguments!r:.200}: {type(failure).__name__}: {failure}")
            assert not failures, "\n".join([f"{len(failures)} cases fail:", *failures])

        test.__name__, test.__doc__, test.__module__ = check.__name__, check.__doc__, check.__module__
        return test

    return wrap


def installed_builds() -> list[str]:
    """Names of the builds of the core that are installed and run here: one from source, all that suit from a wheel."""
    return [name for name in _instruction_set.builds() if find_spec(f"lostmotion._core_{name}")]


def run_in_build(build: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in a process of its own, with the named build of the core."""
    return subprocess.run(
        [sys.executable, *arguments], env=os.environ | {"LOSTMOTION_CORE": build}, capture_output=True, text=True, check=False
    )


def lostmotion(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The command, called in a directory: what it prints and its exit code. In this process, as it takes longer to start than to run."""
    words = ["lostmotion", *map(str, arguments)]
    out, err, thresholds, code = io.StringIO(), io.StringIO(), gc.get_threshold(), None
    with (
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        warnings.catch_warnings(),
        mock.patch.object(sys, "argv", words),
        mock.patch.dict(os.environ),
    ):
        warnings.resetwarnings()
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        try:
            main()
        except SystemExit as end:
            code = end.code
        finally:
            gc.set_threshold(*thresholds)
    return subprocess.CompletedProcess(words, int(code or 0), out.getvalue(), err.getvalue())


# A fork has the modules of its parent, which takes a quarter of the time to start.
FORKS = """
import json, os, sys, traceback
{before}
from lostmotion.cli import main
done = []
for call in json.loads(sys.argv[1]):
    streams = [os.memfd_create("output") for _ in range(3)]
    child = os.fork()
    if not child:
        code = 1
        os.dup2(streams[0], 1), os.dup2(streams[1], 2)
        sys.argv[1:] = call
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
        except BaseException:
            traceback.print_exc()
        names = {{name for name, module in sys.modules.items() if module}}
        os.write(streams[2], " ".join(sorted(names)).encode())
        sys.stdout.flush(), sys.stderr.flush()
        os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    done.append((code, *(os.pread(stream, os.fstat(stream).st_size, 0).decode() for stream in streams)))
json.dump(done, sys.stdout)
"""


@dataclass
class Command(subprocess.CompletedProcess[str]):
    """A command that has run in a process of its own, with the modules that it has imported."""

    args: tuple[str, ...]
    returncode: int
    stdout: str
    stderr: str
    modules: set[str]


def forks(calls: Iterable[Sequence[str]], cwd: Path, before: str = "") -> Iterator[Command]:
    """Commands, each in a fork of a process that has run some statements."""
    calls = [tuple(call) for call in calls]
    words = [sys.executable, "-c", FORKS.format(before=before), json.dumps(calls)]
    done = subprocess.run(words, cwd=cwd, stdout=subprocess.PIPE, text=True, check=True)
    for call, (*result, modules) in zip(calls, json.loads(done.stdout), strict=True):
        yield Command(call, *result, set(modules.split()))


def rows_by_any_threads_and_executor(study: lm.studies.Study, directory: Path) -> pa.Table:
    """The table of a study, having found that one thread, three and processes give the same; in folder `1` of the directory."""
    one = pq.ParquetDataset(lm.study(study, directory / "1", threads=1)).read()
    three = pq.ParquetDataset(lm.study(study, directory / "3", threads=3)).read()
    context = get_context("forkserver")
    context.set_forkserver_preload(["lostmotion.studies.runs.chunk"])
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        processes = pq.ParquetDataset(lm.study(study, directory / "p", executor=pool)).read()
    assert one.equals(three)
    assert one.equals(processes)
    return one


# Files whose tests take long, and why they are worth it. `make check` leaves them out; `make test` runs them and prints their time.
SLOW = {
    "test_closed_loop_response.py": "periodic motions under sampled control against long runs: no closed form covers them",
    "test_command_line.py": "what commands import, in processes of their own",
    "test_docs.py": "every code block, number and link of the documentation is executed or followed",
    "test_field_oriented.py": "100 random axes against the full equations of the winding, the only second method for it",
    "test_fmu.py": "FMUs of every scenario by another importer",
    "test_fmu_cross_check.py": "the rules of the FMI cross-check, by its own program",
    "test_fmu_exchange.py": "Model Exchange by CVODE against the exact run",
    "test_fmu_played.py": "signals that an FMU plays, in both interfaces and versions",
    "test_hunting_axes.py": "random axes whose certificates are checked by long runs",
    "test_sampled_hunting_axes.py": "random sampled axes whose certificates are checked by long runs",
    "test_identification.py": "whole fits: the intervals contain the values put in",
    "test_identification_campaign.py": "a gearbox found from the logs of its own virtual rig",
    "test_identification_cycloidal.py": "measured logs with published values",
    "test_identification_residuals.py": "fits that end in a wrong minimum must be reported",
    "test_break_away_of_rigid_groups.py": "break-away times against a linear programme",
    "test_packaging.py": "processes without each optional library",
    "test_paper.py": "the whole reproduction of the paper",
    "test_select.py": "pairs of motor and gearbox simulated over whole cycles",
    "test_pages.py": "every page that is made is parsed",
    "test_pointing.py": "tracking errors of whole passes",
    "test_webassembly.py": "every scenario in WebAssembly, bit for bit",
    "test_response.py": "Jacobians of periodic motions against differences of runs",
    "test_servo.py": "margins and tuning against time responses of the exact loop",
    "test_settling.py": "random axes whose settling is decided by long runs",
    "test_slurm.py": "workers as processes, by the scripts of SLURM jobs",
    "test_study.py": "interrupted and distributed studies with real processes",
    "test_study_train.py": "the same for trains",
    "test_hunting_decision.py": "random axes whose verdicts are decided by long runs",
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if why := SLOW.get(item.path.name):
            item.add_marker(pytest.mark.slow(why))
    # The last tests are short, so that all processes end together.
    items.sort(key=lambda item: item.path.name not in SLOW)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    spent: dict[str, float] = {}
    for reports in terminalreporter.stats.values():
        for report in reports:
            name = Path(getattr(report, "nodeid", "").partition("::")[0]).name
            if name in SLOW:
                spent[name] = spent.get(name, 0.0) + getattr(report, "duration", 0.0)
    if spent:
        terminalreporter.section("slow files, and why they are worth their time")
    for name, seconds in sorted(spent.items(), key=lambda pair: -pair[1]):
        terminalreporter.write_line(f"{seconds:6.1f} s  {name}: {SLOW[name]}")
