"""Sources of a scenario: a file, the name of a shipped one, or a saved result."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...inputs.argument_checks import ScenarioName, checked
from ..scenario import scenario_files
from ..scenario.scenario import Scenario
from ..scenario.scenario_files import changed, override
from .result_files import FORMATS, open_result


@checked
def load(source: ScenarioName | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> Scenario:
    """Return the scenario of a file, of a shipped example, or of a saved result.

    Parameters
    ----------
    source : str or Path
        A scenario file (``.toml``), whose key `base` may name another scenario that it changes; the name of a shipped scenario, such
        as ``"paper-2dof-nl-small"``; or a result (``.nc``, ``.csv``, ``.parquet``), whose scenario can be run again.
    overrides : mapping or iterable of str
        Changed values, ``{"command.amplitude": 0.1}`` or ``["command.amplitude=0.1"]``, as with ``--set``.

    Returns
    -------
    Scenario
        A `Scenario` for the short form (tables `[motor] [gearbox] [load]`), a `Scenario` for the long form
        (`[shafts.NAME]` and so on).

    Raises
    ------
    InputError
        A file, a key or a value cannot be used. The message names file, key, value and remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> scenario = lm.load("paper-2dof-nl-small", {"load.inertia": "3 kg*m^2"})
    >>> scenario.load.inertia
    3.0
    """
    path = Path(source)
    if path.suffix not in FORMATS:
        return scenario_files.load(source, overrides)
    result = open_result(path)
    if "scenario" not in result.attrs:
        raise InputError(f"{path}: is no result of a run; it carries no scenario that could be run again")
    try:
        tables = json.loads(result.attrs["scenario"])
    except (ValueError, RecursionError):
        raise InputError(f"{path}: the scenario within it is damaged; run the original one again") from None
    override(tables, overrides, path)
    return changed(tables, path)
