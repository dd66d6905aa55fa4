"""The energy ledger of a run, and the warning where it does not close."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from .core_runs import core_result
from .scenario import Scenario
from .train_scenario import TrainScenario

MOST_RESIDUAL = 1e-6  # of the energy turned over, by which the balance of an accurate run fails at most


def ledger_of(scenario: Scenario | TrainScenario) -> dict[str, float]:
    """The ledger of a run of the exact solver [J]."""
    table = scenario.simulation
    options = (table.duration, table.sample_interval, table.samples, True, 0.0, 0)
    ledger: dict[str, float] = core_result(scenario, options, scenario.control())[1]["energy"]
    return ledger


def warned(attributes: Mapping[str, Any], text: str) -> dict[str, Any]:
    """The attributes of a result, with one more warning."""
    return {**attributes, "warning": " ".join(filter(None, [attributes.get("warning"), text]))}


def with_energy(attributes: Mapping[str, Any], energy: Mapping[str, float]) -> dict[str, Any]:
    """The attributes of a run with its energy ledger, and a warning if the ledger does not close."""
    share = abs(energy["residual"]) / energy["turned_over"] if energy["turned_over"] > 0.0 else 0.0
    found = {**attributes, "energy": json.dumps(energy), "energy_residual": share}
    if share <= MOST_RESIDUAL:
        return found
    return warned(
        found,
        f"the energy balance closes to no more than {share:.1e} of the energy turned over, so this run is inaccurate. "
        "Look for ratios, inertias or stiffnesses many orders of magnitude apart.",
    )
