"""The energy ledger of a run, and the warning where it does not close."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..scenario.scenario import Scenario
from .core_runs import core_result

MOST_RESIDUAL = 1e-6  # of the energy turned over, by which the balance of an accurate run fails at most
ROUNDING = 2.0**-46  # share of a stored energy: 64 units in the last place


def ledger_of(scenario: Scenario) -> dict[str, float]:
    """The ledger of a run of the exact solver [J]."""
    options = scenario.simulation.grid() | {"energy": True, "max_switchings": 0}
    ledger: dict[str, float] = core_result(scenario, scenario.control(), options)["energy"]
    return ledger


def largest_stored(data: Mapping[Any, Any]) -> float:
    """Bound on the elastic energy of each gear in a run [J]: output torque times twist, and at least the work of the
    largest torque over a rounding of a radian, or of a force over a rounding of a metre: shafts that friction holds may have
    the speed of a rounding.
    """
    torques = [np.abs(values).max() for name, values in data.items() if str(name).endswith(("torque", "force"))]
    largest = ROUNDING * float(max(torques, default=0.0))
    for torque, twist in (("output_torque", "twist"), ("output_force", "deflection")):
        for gear in (str(name).removesuffix(torque) for name in data if str(name).endswith(torque)):
            if gear + twist in data:
                most = float(np.abs(data[gear + torque]).max() * np.abs(data[gear + twist]).max())
                largest = max(largest, most)
    return largest


def warned(attributes: Mapping[str, Any], text: str) -> dict[str, Any]:
    """The attributes of a result, with one more warning."""
    return {**attributes, "warning": " ".join(filter(None, [attributes.get("warning"), text]))}


def with_energy(attributes: Mapping[str, Any], energy: Mapping[str, float], stored: float) -> dict[str, Any]:
    """The attributes of a run with its energy ledger, and a warning if the ledger does not close.

    stored: bound on the elastic energy of a gear in the run [J]. Energies below its rounding belong to a drive that is
        stuck under load, and do not indicate an error.
    """
    residual = abs(energy["residual"])
    turned_over = energy["turned_over"] or stored  # drives that vibrate freely take and give nothing
    share = residual / turned_over if turned_over > 0.0 and residual > ROUNDING * stored else 0.0
    found = {**attributes, "energy": json.dumps(energy), "energy_residual": share}
    if share <= MOST_RESIDUAL:
        return found
    return warned(
        found,
        f"the energy balance closes to no more than {share:.1e} of the energy turned over, so this run is inaccurate. "
        "Look for ratios, inertias or stiffnesses many orders of magnitude apart.",
    )
