"""The runs of a piece as a table: its expressions evaluated over all of them at once."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...interruptible_threads import thread_pool
from ...model.shaft_ratio import turns
from ...response.crossovers import bandwidth
from ...simulation.scenario.scenario import Scenario
from ..study.records_that_vary import kind_of_record
from ..study.select_table import TASK_SHARES, USE
from ..study.study_definition import Study
from ..study.wanted_values import asks_for, used
from .chunk_results import Runs

if TYPE_CHECKING:
    import pyarrow as pa


def tabulate(study: Study, units: dict[str, str], first: int, last: int, runs: Runs, threads: int) -> pa.Table:
    """One row a run: its number, its parameters, the kept values, and its error if it has one."""
    import pyarrow as pa

    columns: dict[str, Any] = {"run": pa.array(np.arange(first, last))}
    for k, v in enumerate(study.vary):
        numbers = runs.parameters[:, k]
        columns[v.title] = pa.array(numbers if v.names is None else [v.value(x) for x in numbers])
    names = _names(study, runs, threads)
    kept_values = runs.kept | {
        name: e.values(names, last - first) for name, e in study.expressions.items() if name not in runs.kept
    }
    bad = np.array([e != "" for e in runs.errors])
    for name in study.kept_units:
        columns[name] = pa.array(np.where(bad, np.nan, kept_values[name]))
    if study.trajectories is not None:
        for name in study.trajectories.variables:
            kept = runs.samples[name][:, :: study.trajectories.every]
            columns[f"{name} over time"] = pa.array([None if b else row for b, row in zip(bad, kept, strict=True)])
    columns |= {name: pa.array(values) for name, values in runs.checks.items()}
    columns["switchings"] = pa.array(runs.switchings.astype(np.int64))
    columns["error"] = pa.array(runs.errors)
    fields = [pa.field(n, c.type, metadata={"units": units[n]} if units.get(n) else None) for n, c in columns.items()]
    return pa.table(columns, schema=pa.schema(fields))


def units_of(study: Study) -> dict[str, str]:
    """Units of the columns; empty where an expression's cannot be determined."""
    units = {v.title: v.unit for v in study.vary if v.names is None} | study.kept_units
    units |= {f"{USE}{rule}": "1" for rule in TASK_SHARES}
    units_by_name = dict(study.vocabulary.variables)
    return units | {
        f"{n} over time": units_by_name[n] for n in (study.trajectories.variables if study.trajectories else ())
    }


@lru_cache(maxsize=4)
def _instants(duration: float, interval: float) -> Any:
    """The coordinate of the samples; making its index takes longer than many a reduction."""
    import xarray as xr

    return xr.Coordinates({"time": _core.sample_times(duration, interval)})


def _names(study: Study, runs: Runs, threads: int) -> dict[str, Any]:
    """Values that the study's expressions may use, over all runs of a piece."""
    import xarray as xr

    def each_run(values: np.ndarray) -> xr.DataArray:
        return xr.DataArray(values, dims="run")

    instants = _instants(study.scenario.simulation.duration, study.scenario.simulation.sample_interval)
    names: dict[str, Any] = {
        name: xr.DataArray(runs.samples[name], instants, ("run", "time")) for name in used(study) & runs.samples.keys()
    }
    names["time"] = xr.DataArray(instants["time"], instants)
    if asks_for(study, "energy"):
        names["energy"] = {k: each_run(v) for k, v in runs.energy.items()}
    if asks_for(study, "ideal_speed"):
        names["ideal_speed"] = names[study.vocabulary.command] * each_run(_ideal_speeds(study, runs))
    names["bandwidth"] = lambda amplitude=None: each_run(_bandwidths(study, runs, amplitude, threads))
    return names


def _ideal_speeds(study: Study, runs: Runs) -> np.ndarray:
    """Load speed [rad/s] at command 1 of a rigid drive without inertia, friction and load, for each run."""

    def value_of(scenario: Scenario) -> float:
        train = scenario.train()
        (motor,) = train.motors.values()
        ratio = turns(train, motor.shaft, list(train.shafts)[-1])
        return motor.unloaded_speed / (ratio or math.nan)

    base = study.scenario
    keys = {key for v in study.vary for key in v.all_keys}
    if not any(key.startswith("motor") or key.endswith(".ratio") or kind_of_record(key) for key in keys):
        return np.full(len(runs.errors), value_of(base))
    rows = zip(runs.parameters, runs.errors, strict=True)
    return np.array([math.nan if error else value_of(study.scenario_at(row)) for row, error in rows])


def _bandwidths(study: Study, runs: Runs, amplitude: Any, threads: int) -> np.ndarray:
    """Bandwidth [Hz] of the load speed for each run, at the amplitude of its command or at the given one.

    Where it cannot be found, the run's error says why.
    """
    amplitudes = np.broadcast_to(np.nan if amplitude is None else np.asarray(amplitude, dtype=float), len(runs.errors))

    def find(k: int) -> float:
        if runs.errors[k]:
            return math.nan
        scenario = study.scenario_at(runs.parameters[k])
        own = next((signal.amplitude for signal in scenario.tables.command.values()), 0.0) or 0.0
        try:
            return bandwidth(scenario, own if amplitude is None else float(amplitudes[k]))
        except (RuntimeError, ValueError) as error:
            runs.errors[k] = str(error)
            return math.nan

    with thread_pool(threads) as pool:
        return np.array(list(pool.map(find, range(len(runs.errors)))))
