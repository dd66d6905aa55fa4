"""The runs, frequency responses and measurements that the paper's figures show."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..response.harmonic import frequency_response
from ..simulation.runs.run import simulate
from ..simulation.runs.switchings import switchings_of
from ..test_rig.torsion_loop import Loop
from ..test_rig.virtual_rig import TestRig
from .published_drive import AMPLITUDES, MODELS, paper_scenario

if TYPE_CHECKING:
    import xarray

FREQUENCIES = np.geomspace(0.1, 100.0, 61)  # [Hz], twenty a decade
LOOPS = (1.0, 0.6, 0.3)  # amplitudes of the hysteresis loops, relative to rated torque

WORK = len(MODELS) * len(AMPLITUDES) * (1 + len(FREQUENCIES)) + 1  # how often `compute` reports its progress


@dataclass(frozen=True)
class Results:
    """All runs that the figures are drawn from."""

    runs: dict[tuple[str, str], xarray.Dataset]  # by model and amplitude
    responses: dict[str, xarray.Dataset]  # by model
    first_loading: tuple[Any, Any]  # twist [rad] and torque [N·m] of 2-DOF-NL with the input locked
    loops: tuple[Loop, ...]  # loops of the same, at the amplitudes `LOOPS`

    def load_response(self, model: str, amplitude: str) -> Any:
        """F(w)/F(E) [rad/s] of the load's speed over `FREQUENCIES`."""
        chosen = self.responses[model].sel(output="load_speed", amplitude=AMPLITUDES[amplitude])
        return chosen["response"].values

    def distortion(self, amplitude: str) -> float:
        """Total harmonic distortion of the load's speed of 2-DOF-NL at 1 Hz."""
        chosen = self.responses["2-DOF-NL"].sel(output="load_speed", amplitude=AMPLITUDES[amplitude])
        return float(chosen["distortion"].sel(frequency=1.0, method="nearest"))


def compute(progress: Callable[[], None] = lambda: None) -> Results:
    """All simulations behind the figures."""
    runs, responses = {}, {}
    for model in MODELS:
        for amplitude in AMPLITUDES:
            runs[model, amplitude] = simulate(paper_scenario(model, amplitude))
            progress()
        drive = paper_scenario(model, "large").drive()
        found = frequency_response(drive, list(FREQUENCIES), list(AMPLITUDES.values()), progress=progress)
        if any(reasons := [r for r in found["reason"].values.ravel() if r]):
            raise RuntimeError(f"figures 17 and 18, {model}: {reasons[0]}")
        responses[model] = found
    rig = TestRig(paper_scenario("2-DOF-NL", "large").gearbox)
    rated = rig.gearbox.rated_output_torque
    first_loading = rig.initial_loading_curve(1.2 * rated)
    loops = tuple(rig.loop(share * rated) for share in LOOPS)
    progress()
    return Results(runs, responses, first_loading, loops)


def stuck_intervals(run: xarray.Dataset) -> tuple[tuple[float, float], ...]:
    """Intervals of time [s] in which the motor's shaft is stuck."""
    switchings, time = switchings_of(run), run["time"].values
    edges = [float(time[0]), *switchings["instant"].values.tolist(), float(time[-1])]
    modes = [int(run["input_contact"][0]), *switchings["input_contact_after"].values.tolist()]
    found: list[tuple[float, float]] = []
    for (begin, end), mode in zip(itertools.pairwise(edges), modes, strict=True):
        if mode == 0 and end > begin:
            joined = bool(found) and found[-1][1] == begin
            found[-1:] = [(found[-1][0], end)] if joined else [*found[-1:], (begin, end)]
    return tuple(found)
