"""Margins of the loops of controllers, as the page shows them."""

from __future__ import annotations

import math
from typing import Any

from ..errors import InputError
from ..servo.margins import bandwidth_of, frequencies, margins
from ..servo.regimes import axis_of, regimes
from ..servo.sampled import SampledLoop
from ..simulation.scenario import Scenario
from ..simulation.train_scenario import TrainScenario


def loop_views(scenario: Scenario | TrainScenario, motor: str) -> list[dict[str, Any]]:
    """Each loop of one controller in each regime, as page/src/description.ts describes it; none where they have no response."""
    try:
        axis = axis_of(scenario, motor)
        points = regimes(axis)
        return [
            _view(SampledLoop(axis, p, loop, True), SampledLoop(axis, p, loop, False))
            for loop in axis.loops
            for p in points
        ]
    except InputError:  # such as sample times that do not nest; `lostmotion servo` says so
        return []


def _view(cut: SampledLoop, closed: SampledLoop) -> dict[str, Any]:
    m = margins(cut, closed)
    bandwidth = bandwidth_of(frequencies(cut, closed), lambda f: closed.response(f, feedforward=False))
    numbers = {
        "gain_margin": m.gain_margin,
        "phase_margin": m.phase_margin,
        "crossover": m.crossover,
        "sensitivity_peak": m.sensitivity_peak,
        "bandwidth": bandwidth.three_decibels,
    }
    return {
        "loop": cut.loop,
        "regime": cut.regime.name,
        "meaning": cut.regime.meaning,
        "stable": m.stable,
        **{name: value if math.isfinite(value) else None for name, value in numbers.items()},
    }
