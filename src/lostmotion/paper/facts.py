"""The numbers that the report's text quotes, all taken from the runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..response.bandwidth import three_decibels_down
from ..response.linear import rigid_constants
from ..simulation.results import energy_of
from .drive import AMPLITUDES, paper_scenario
from .runs import FREQUENCIES, Results


def facts(results: Results) -> dict[str, Any]:
    """Numbers that the report's text quotes, all taken from the runs."""
    out: dict[str, Any] = {"worst_balance": 0.0, "stuck": {}, "efficiency": {}, "created": {}, "bandwidth": {}}
    for (model, amplitude), run in results.runs.items():
        ledger = energy_of(run)
        out["worst_balance"] = max(out["worst_balance"], abs(ledger["residual"]) / ledger["turned_over"])
        ratio = paper_scenario(model, amplitude).gearbox.ratio
        loss = (run["input_torque"] - run["output_torque"] / ratio) * run["motor_speed"]
        created = -float(np.minimum(loss, 0.0).sum()) * float(run["time"][1])
        out["created"][model, amplitude] = created
        out["stuck"][model, amplitude] = float((run["input_contact"] == 0).mean())
        moving = run["efficiency"].values[np.isfinite(run["efficiency"].values)]
        out["efficiency"][model, amplitude] = float(np.max(moving)), float(np.mean(moving))
    rigid = rigid_constants(paper_scenario("1-DOF-L", "large").drive())
    out["bandwidth"]["closed"] = rigid.bandwidth
    for amplitude in AMPLITUDES:
        out["bandwidth"][amplitude] = three_decibels_down(FREQUENCIES, np.abs(results.load_response(amplitude)))
    out["static_gain_small"] = float(
        np.abs(results.load_response("small")[0]) / np.abs(results.load_response("large")[0])
    )
    return out
