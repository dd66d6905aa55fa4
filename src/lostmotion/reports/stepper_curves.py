"""Charts and tables of the curves of a stepper over its step rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .figure_style import LOOKS
from .panels import Curve, Panel

if TYPE_CHECKING:
    import xarray

NAMES = {
    "pull_out_torque": "pull-out, from the data",
    "pull_out_torque_of_runs": "pull-out, from runs",
    "pull_in_torque": "pull-in, from the data",
    "pull_in_torque_of_runs": "pull-in, from runs",
}


def charts(curves: xarray.Dataset) -> list[Panel]:
    """Torques and swing over the step rate."""
    rates = curves.step_rate.values
    lines = tuple(Curve(label, rates, curves[name].values, LOOKS[k]) for k, (name, label) in enumerate(NAMES.items()))
    swing = (Curve("rotor in its field", rates, curves.swing.values, LOOKS[0]),)
    rate = "step rate [Hz]"
    return [
        Panel(f"Torque of {curves.attrs['motor']} over the step rate", rate, "torque [N·m]", lines, log_x=True),
        Panel("Swing of the rotor", rate, "amplitude [full steps]", swing, log_x=True),
    ]


def table(curves: xarray.Dataset) -> list[str]:
    """Lines for the terminal."""
    lines = ["step rate [Hz]   pull-out [N·m] data   runs   pull-in data   runs   swing [full steps]"]
    for k, rate in enumerate(curves.step_rate.values):
        torques = [f"{float(curves[name][k]):.3g}" for name in NAMES]
        swing = float(curves.swing[k])
        lines.append(
            f"{rate:14.4g} {torques[0]:>21} {torques[1]:>6} {torques[2]:>14} {torques[3]:>6} "
            + (f"{swing:>8.2g}" if math.isfinite(swing) else "   slips")
        )
    return lines


def as_csv(curves: xarray.Dataset) -> str:
    """The curves as comma-separated values, with a line of units."""
    names = ["step_rate", *NAMES, "swing"]
    rows = [names, [curves[name].attrs["units"] for name in names]]
    rows += [[f"{float(curves[name][k]):.6g}" for name in names] for k in range(curves.step_rate.size)]
    return "\n".join(",".join(row) for row in rows) + "\n"
