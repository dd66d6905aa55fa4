"""The scenarios that come with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def shipped_scenarios() -> dict[str, Path]:
    """The scenarios that come with the package: name -> file."""
    directory = files("lostmotion") / "scenarios"
    return {f.name.removesuffix(".toml"): Path(str(f)) for f in sorted(directory.iterdir(), key=lambda f: f.name)}
