"""Margins of the loops of controllers, as the page shows them."""

import math
from typing import Any

from ..errors import InputError
from ..servo.commissioning_report import LoopSheet, loop_sheet
from ..servo.linear_regimes import axis_of, regimes
from ..simulation.scenario.scenario import Scenario


def loop_views(scenario: Scenario, motor: str) -> list[dict[str, Any]]:
    """Each loop of one controller in each regime, as page/src/description.ts describes it; none where they have no response."""
    try:
        axis = axis_of(scenario, motor)
        points = regimes(axis)
        return [_view(loop_sheet(axis, p, loop), p.meaning) for loop in axis.loops for p in points]
    except InputError:  # such as sample times that do not nest; `lostmotion servo` says so
        return []


def _view(sheet: LoopSheet, meaning: str) -> dict[str, Any]:
    m = sheet.margins
    numbers = {
        "gain_margin": m.gain_margin,
        "phase_margin": m.phase_margin,
        "crossover": m.crossover,
        "sensitivity_peak": m.sensitivity_peak,
        "bandwidth": sheet.bandwidth.three_decibels,
    }
    return {
        "loop": sheet.loop,
        "regime": sheet.regime,
        "meaning": meaning,
        "stable": sheet.unstable is None,
        **{name: value if math.isfinite(value) else None for name, value in numbers.items()},
    }
