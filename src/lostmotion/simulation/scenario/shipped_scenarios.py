"""The scenarios that come with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from ...inputs.argument_checks import checked


@checked
def shipped_scenarios() -> dict[str, Path]:
    """Return the scenarios that come with the package.

    Returns
    -------
    dict of str to Path
        File of each scenario by its name. `load` takes the name.

    Examples
    --------
    >>> import lostmotion as lm
    >>> "position-axis" in lm.shipped_scenarios()
    True
    """
    directory = files("lostmotion") / "scenarios"
    return {f.name.removesuffix(".toml"): Path(str(f)) for f in sorted(directory.iterdir(), key=lambda f: f.name)}
