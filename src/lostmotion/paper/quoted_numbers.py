"""The numbers that the report's text quotes, all taken from the runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..response.crossovers import three_decibels_down
from ..response.rigid import rigid_constants
from ..simulation.runs.results import energy_of
from .published_drive import AMPLITUDES, MODELS, paper_scenario
from .runs import FREQUENCIES, Results, stuck_intervals

if TYPE_CHECKING:
    import xarray

CASES = tuple((model, amplitude) for model in MODELS for amplitude in AMPLITUDES)


@dataclass(frozen=True)
class Facts:
    """Numbers of the runs of 2 s and of the frequency responses, by amplitude, or by model and amplitude."""

    worst_balance: float  # largest residual of the energy balance / energy turned over
    stuck: dict[tuple[str, str], float]  # share of the time with the motor's shaft stuck
    load_rests: dict[tuple[str, str], float]  # share of the time after its first motion with the load at rest
    torque_gap: (
        float  # largest distance of a linear model's motor torque from the torque of 2-DOF-NL / peak, large amplitude
    )
    best_efficiency: dict[str, float]  # of 2-DOF-NL, as the next three
    mean_efficiency: dict[str, float]  # over the time in which it is defined
    energy_efficiency: dict[str, float]  # energy out / energy in, each counted where its power is positive
    distortion: dict[str, float]  # of the load's speed, at 1 Hz
    created: dict[tuple[str, str], float]  # energy that the gearbox creates [J]
    closed_bandwidth: float  # of (10) [Hz]
    bandwidth: dict[tuple[str, str], float]  # -3 dB against the lowest frequency [Hz]
    resonance: float  # where the gain of 2-DOF-NL is largest, small amplitude [Hz]
    lowest_gain: dict[tuple[str, str], float]  # g at the lowest frequency


def facts(results: Results) -> Facts:
    """The quoted numbers, computed from the runs."""
    runs = results.runs
    rigid = paper_scenario("1-DOF-L", "large")
    constants_of_rigid = rigid_constants(rigid)
    gains = {case: np.abs(results.load_response(*case)) for case in CASES}
    torque = {model: runs[model, "large"]["motor_torque"].values for model in MODELS}
    peak = np.abs(torque["2-DOF-NL"]).max()
    nonlinear = {amplitude: runs["2-DOF-NL", amplitude] for amplitude in AMPLITUDES}
    return Facts(
        worst_balance=max(abs(e["residual"]) / e["turned_over"] for e in map(energy_of, runs.values())),
        stuck={case: _stuck_share(run) for case, run in runs.items()},
        load_rests={case: _rest_share(run) for case, run in runs.items()},
        torque_gap=max(float(np.abs(t - torque["2-DOF-NL"]).max() / peak) for t in torque.values()),
        best_efficiency={amplitude: float(run["efficiency"].max()) for amplitude, run in nonlinear.items()},
        mean_efficiency={amplitude: float(run["efficiency"].mean()) for amplitude, run in nonlinear.items()},
        energy_efficiency={amplitude: _energy_efficiency(run) for amplitude, run in nonlinear.items()},
        distortion={amplitude: results.distortion(amplitude) for amplitude in AMPLITUDES},
        created={case: _created(run, rigid.gearbox.ratio) for case, run in runs.items()},
        closed_bandwidth=constants_of_rigid.bandwidth,
        bandwidth={case: three_decibels_down(FREQUENCIES, gain) for case, gain in gains.items()},
        resonance=float(FREQUENCIES[np.argmax(gains["2-DOF-NL", "small"])]),
        lowest_gain={
            case: float(gain[0]) * rigid.gearbox.ratio / constants_of_rigid.rated_speed for case, gain in gains.items()
        },
    )


def _stuck_share(run: xarray.Dataset) -> float:
    return sum(end - begin for begin, end in stuck_intervals(run)) / float(run["time"][-1])


def _rest_share(run: xarray.Dataset) -> float:
    at_rest = run["load_speed"].values == 0.0
    return float(at_rest[np.argmin(at_rest) :].mean())


def _energy_efficiency(run: xarray.Dataset) -> float:
    power_in = (run["input_torque"] * run["motor_speed"]).values
    power_out = (run["output_torque"] * run["load_speed"]).values
    return float(np.maximum(power_out, 0.0).sum() / np.maximum(power_in, 0.0).sum())


def _created(run: xarray.Dataset, ratio: float) -> float:
    loss = (run["input_torque"] - run["output_torque"] / ratio) * run["motor_speed"]
    return -float(np.minimum(loss, 0.0).sum()) * float(run["time"][1])
