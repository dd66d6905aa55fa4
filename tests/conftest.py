"""Shared by the tests."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))


@pytest.fixture(scope="session")
def large() -> Path:
    return ROOT / "scenarios" / "paper-2dof-nl-large.toml"


@pytest.fixture(scope="session")
def small() -> Path:
    return ROOT / "scenarios" / "paper-2dof-nl-small.toml"
