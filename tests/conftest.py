"""Shared by the tests."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ALL_SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))
TRAINS = [path for path in ALL_SCENARIOS if "[shafts." in path.read_text()]
"""in the long form"""
SCENARIOS = [path for path in ALL_SCENARIOS if path not in TRAINS]
"""in the short form"""


@pytest.fixture(scope="session")
def large() -> Path:
    return ROOT / "scenarios" / "paper-2dof-nl-large.toml"


@pytest.fixture(scope="session")
def small() -> Path:
    return ROOT / "scenarios" / "paper-2dof-nl-small.toml"


def run_in_build(build: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in a process of its own, with the named build of the core."""
    return subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"LOSTMOTION_CORE": build},
        capture_output=True,
        text=True,
        check=False,
    )
