"""Where a scenario may come from: a file, the name of a shipped one, or a saved result."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..inputs.arguments import ScenarioName, checked
from . import scenario_files
from .result_files import FORMATS, open_result
from .scenario import Scenario
from .scenario_files import changed, override
from .train_scenario import TrainScenario


@checked
def load(source: ScenarioName | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> Scenario | TrainScenario:
    """The scenario of a file, of a shipped example, or of a saved result.

    In the short form (tables `[motor] [gearbox] [load]`) it is a `Scenario`, in the long form (`[shafts.NAME]` ...) a
    `TrainScenario`.

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


def load_drive(source: str | Path, overrides: Mapping[str, Any] | Iterable[str] = ()) -> Scenario:
    """As `load`, where only the short form will do.

    Raises
    ------
    InputError
        Also if the scenario is in the long form.
    """
    scenario = load(source, overrides)
    if isinstance(scenario, TrainScenario):
        raise InputError(
            f"{source}: is a drive train ([shafts]), which can be run; this takes a drive of [motor], [gearbox] and [load]"
        )
    return scenario
