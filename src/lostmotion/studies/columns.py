"""The runs of a piece as a table: its expressions evaluated over all of them at once."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..response.crossovers import bandwidth
from ..simulation.scenario import Scenario
from ..simulation.variables import CHANNEL_NAMES, gear_efficiency
from ..worker_threads import thread_pool
from .records import kind_of_record
from .runs import Runs
from .select import TASK_SHARES, USE
from .study import Study
from .wanted import asks_for, needed, used

if TYPE_CHECKING:
    import pyarrow as pa


def tabulate(study: Study, units: dict[str, str], first: int, last: int, runs: Runs, threads: int) -> pa.Table:
    """One row a run: its number, its parameters, what is kept of it, its error if it has one."""
    import pyarrow as pa

    columns: dict[str, Any] = {"run": pa.array(np.arange(first, last))}
    for k, v in enumerate(study.vary):
        numbers = runs.parameters[:, k]
        columns[v.title] = pa.array(numbers if v.names is None else [v.value(x) for x in numbers])
    data = {} if runs.kept else _with_derived(study, runs)
    names = _names(study, data, runs, threads)
    kept_values = runs.kept | {
        name: e.values(names, last - first) for name, e in study.expressions.items() if name not in runs.kept
    }
    bad = np.array([e != "" for e in runs.errors])
    for name in study.kept_units:
        columns[name] = pa.array(np.where(bad, np.nan, kept_values[name]))
    if study.trajectories is not None:
        for name in study.trajectories.variables:
            kept = data[name][:, :: study.trajectories.every]
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
    of = dict(study.vocabulary.variables)
    return units | {f"{n} over time": of[n] for n in (study.trajectories.variables if study.trajectories else ())}


def _with_derived(study: Study, runs: Runs) -> dict[str, np.ndarray]:
    wanted = needed(study)
    if wanted <= runs.samples.keys():
        return runs.samples
    samples = study.scenario.simulation.samples
    whole = runs.samples | {c: runs.samples.get(c, np.zeros((len(runs.errors), samples))) for c in CHANNEL_NAMES}
    whole["efficiency"] = gear_efficiency(whole, runs.ratio[:, None])
    whole["motor_power"] = whole["motor_torque"] * whole["motor_speed"]
    return {name: whole[name] for name in wanted | set(runs.samples)}


@lru_cache(maxsize=4)
def _instants(duration: float, interval: float) -> Any:
    """The coordinate of the samples; making its index takes longer than many a reduction."""
    import xarray as xr

    return xr.Coordinates({"time": _core.sample_times(duration, interval)})


def _names(study: Study, data: dict[str, np.ndarray], runs: Runs, threads: int) -> dict[str, Any]:
    """All that the study's expressions may use, over all runs of a piece."""
    import xarray as xr

    def each_run(values: np.ndarray) -> xr.DataArray:
        return xr.DataArray(values, dims="run")

    instants = _instants(study.scenario.simulation.duration, study.scenario.simulation.sample_interval)
    names: dict[str, Any] = {
        name: xr.DataArray(data[name], instants, ("run", "time")) for name in used(study) & data.keys()
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

    def of(scenario: Scenario) -> float:
        return scenario.motor.unloaded_speed / scenario.gearbox.ratio

    base = study.drive
    keys = {key for v in study.vary for key in v.all_keys}
    if not any(key.startswith("motor") or key.endswith(".ratio") or kind_of_record(key) for key in keys):
        return np.full(len(runs.errors), of(base))
    rows = zip(runs.parameters, runs.errors, strict=True)
    return np.array([math.nan if error else of(study.drive_at(row)) for row, error in rows])


def _bandwidths(study: Study, runs: Runs, amplitude: Any, threads: int) -> np.ndarray:
    """Bandwidth [Hz] of the load speed for each run, at the amplitude of its command or at the given one.

    Where it cannot be found, the run's error says why.
    """
    amplitudes = np.broadcast_to(np.nan if amplitude is None else np.asarray(amplitude, dtype=float), len(runs.errors))

    def find(k: int) -> float:
        if runs.errors[k]:
            return math.nan
        scenario = study.drive_at(runs.parameters[k])
        try:
            return bandwidth(
                scenario.drive(),
                float(amplitudes[k]) if amplitude is not None else scenario.command.amplitude or 0.0,
                mean_command=scenario.command.mean,
                mean_load_torque=scenario.load.torque.mean,
            )
        except (RuntimeError, ValueError) as error:
            runs.errors[k] = str(error)
            return math.nan

    with thread_pool(threads) as pool:
        return np.array(list(pool.map(find, range(len(runs.errors)))))
