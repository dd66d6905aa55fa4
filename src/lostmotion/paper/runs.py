"""The runs and the frequency response that the paper's figures show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..response.harmonic import frequency_response
from ..simulation.run import simulate
from .drive import AMPLITUDES, MODELS, paper_scenario

if TYPE_CHECKING:
    import xarray

FREQUENCIES = np.geomspace(0.1, 100.0, 61)  # [Hz], twenty a decade

WORK = len(MODELS) * len(AMPLITUDES) + 2 * len(FREQUENCIES)  # how often `compute` reports its progress


@dataclass
class Results:
    """All runs that the figures are drawn from."""

    runs: dict[tuple[str, str], xarray.Dataset] = field(default_factory=dict)
    response: xarray.Dataset | None = None

    def load_response(self, amplitude: str) -> Any:
        """F(w)/F(E) [rad/s] of the nonlinear drive over `FREQUENCIES`."""
        assert self.response is not None
        return self.response["response"].sel(output="load_speed", amplitude=AMPLITUDES[amplitude]).values


def compute(progress: Callable[[], None] = lambda: None) -> Results:
    """All simulations behind the figures."""
    results = Results()
    for model in MODELS:
        for amplitude in AMPLITUDES:
            results.runs[model, amplitude] = simulate(paper_scenario(model, amplitude))
            progress()
    drive = paper_scenario("2-DOF-NL", "large").drive()
    results.response = frequency_response(drive, list(FREQUENCIES), list(AMPLITUDES.values()), progress=progress)
    if any(reasons := [r for r in results.response["reason"].values.ravel() if r]):
        raise RuntimeError(f"figures 17 and 18: {reasons[0]}")
    return results
