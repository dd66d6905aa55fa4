"""Shared by the tests."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import lostmotion as lm
from lostmotion import _instruction_set

ROOT = Path(__file__).parent.parent
ALL_SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))
TRAINS = [p for p in ALL_SCENARIOS if any(table in p.read_text() for table in ("[shafts.", "[controllers."))]
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
        [sys.executable, *arguments],
        env=os.environ | {"LOSTMOTION_CORE": build},
        capture_output=True,
        text=True,
        check=False,
    )


def rows_by_any_threads_and_executor(study: lm.Study, directory: Path) -> pa.Table:
    """The table of a study, having found that one thread, three and processes give the same; in folder `1` of the directory."""
    one = pq.ParquetDataset(lm.study(study, directory / "1", threads=1)).read()
    three = pq.ParquetDataset(lm.study(study, directory / "3", threads=3)).read()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        processes = pq.ParquetDataset(lm.study(study, directory / "p", executor=pool)).read()
    assert one.equals(three)
    assert one.equals(processes)
    return one
