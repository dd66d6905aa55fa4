"""Where a scenario may come from: a file, the name of a shipped one, or a saved result."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from . import scenario
from .results import FORMATS, open_result, scenario_of
from .scenario import Scenario, changed


def load(source: str | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> Scenario:
    """The scenario of a file, of a shipped example, or of a saved result.

    Parameters
    ----------
    source
        A scenario file (``.toml``), whose key `base` may name another scenario that it changes; the name of a scenario
        that comes with the package, such as ``"paper-2dof-nl-small"``; or a result (``.nc``, ``.csv``, ``.parquet``),
        whose scenario is taken so that it can be run again.
    overrides
        ``{"command.amplitude": 0.1}`` or ``["command.amplitude=0.1"]``, as by ``--set``.

    Raises
    ------
    InputError
        With one line that names the file, the key, the value and the remedy.
    """
    path = Path(source)
    if path.suffix not in FORMATS:
        return scenario.load(source, overrides)
    return changed(scenario_of(open_result(path)).model_dump(exclude_none=True), overrides, path)
