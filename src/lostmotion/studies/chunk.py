"""One chunk of a study: its runs simulated, in the core or one by one, and what is kept of them as a table."""

from __future__ import annotations

import io
import json
import math
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..errors import InputError
from ..model.torsion import Rigid
from ..response.bandwidth import bandwidth
from ..simulation.results import ENERGY, add_derived, installed_version
from ..simulation.run import core_inputs, simulate
from ..simulation.scenario import Scenario
from ..simulation.variables import CHANNEL_NAMES, VARIABLES
from .check import COLUMNS, check_columns
from .file import from_json
from .functions import REDUCTIONS
from .select import SHARES, USE
from .study import Study
from .vary import base_value

if TYPE_CHECKING:
    import pyarrow as pa

SLOPES = "gearbox.stiffness.slopes"
DERIVED = frozenset(v.name for v in VARIABLES if v.derived)
SLOW_RUNS = 20  # in a piece of those that are made one by one
MAX_NUMBERS = 2**23  # of samples that are held at once: 64 megabytes


def compute_chunk(text: str, first: int, last: int, threads: int = 1) -> bytes:
    """The runs first .. last - 1 of a study (as JSON), as the bytes of a Parquet file. What executors are given."""
    study = parsed(text)
    return as_parquet(
        text,
        [tabulate(study, text, a, b, run_piece(study, a, b, threads), threads) for a, b in pieces(study, first, last)],
    )


def pieces(study: Study, first: int, last: int) -> list[tuple[int, int]]:
    """The parts of a chunk, so that the samples of each can be held at once, and that slow ones show progress.

    Most chunks that the core can make are one piece.
    """
    needed, fast = _needed(study), _core_can(study)
    if fast and (not needed or _reductions(study)):
        return [(first, last)]
    if not needed:
        return [(a, min(a + SLOW_RUNS, last)) for a in range(first, last, SLOW_RUNS)]
    arrays = len(CHANNEL_NAMES) if needed & DERIVED else len(needed)
    size = max(1, MAX_NUMBERS // (arrays * study.scenario.simulation.samples))
    size = size if fast else min(size, SLOW_RUNS)
    return [(a, min(a + size, last)) for a in range(first, last, size)]


@lru_cache(maxsize=8)
def parsed(text: str) -> Study:
    """The study of a text; each is read once."""
    return from_json(text)


@lru_cache(maxsize=8)
def _units(text: str) -> dict[str, str]:
    """Units of the columns; empty where an expression's cannot be determined."""
    study = parsed(text)
    units = {v.title: v.unit for v in study.vary if v.names is None} | {n: e.unit for n, e in study.expressions.items()}
    units |= {f"{USE}{rule}": "1" for rule in SHARES}
    of = {v.name: v.unit for v in VARIABLES}
    return units | {f"{n} over time": of[n] for n in (study.trajectories.variables if study.trajectories else ())}


def _asks_for(study: Study, name: str) -> bool:
    return any(name in e.names for e in study.expressions.values())


def _used(study: Study) -> set[str]:
    """The result variables that its expressions use."""
    return {name for e in study.expressions.values() for name in e.variables}


def _reductions(study: Study) -> dict[str, tuple[str, str]]:
    """Reduction and variable of each column that needs samples, if they are all of that kind, so that the core can do them and
    no samples need leave it; else empty."""
    reductions = {name: e.reduction for name, e in study.expressions.items() if e.variables}
    known = {name: r for name, r in reductions.items() if r is not None}
    return known if study.trajectories is None and len(known) == len(reductions) else {}


def _needed(study: Study) -> frozenset[str]:
    """The result variables that the study uses."""
    return frozenset(_used(study) | set(study.trajectories.variables if study.trajectories else ()))


def run_piece(study: Study, first: int, last: int, threads: int) -> Runs:
    """Simulates the runs; nearly all the time goes here, most of it with the GIL released."""
    parameters, energy = study.parameters(first, last), _asks_for(study, "energy")
    channels = sorted(_sources(_needed(study)))
    if _core_can(study):
        return _in_the_core(study, parameters, channels, _reductions(study), energy, threads)
    return _one_by_one(study, parameters, channels, energy)


def tabulate(study: Study, text: str, first: int, last: int, runs: Runs, threads: int) -> pa.Table:
    """One row a run: its number, its parameters, what is kept of it, its error if it has one."""
    import pyarrow as pa

    columns: dict[str, Any] = {"run": pa.array(np.arange(first, last))}
    for k, v in enumerate(study.vary):
        numbers = runs.parameters[:, k]
        columns[v.title] = pa.array(numbers if v.names is None else [v.value(x) for x in numbers])
    data = {} if runs.kept else _derived(study, runs, _needed(study))
    names = _names(study, data, runs, threads)
    kept_values = runs.kept | {
        name: e.values(names, last - first) for name, e in study.expressions.items() if name not in runs.kept
    }
    bad = np.array([e != "" for e in runs.errors])
    for name in study.keep:
        columns[name] = pa.array(np.where(bad, np.nan, kept_values[name]))
    if study.trajectories is not None:
        for name in study.trajectories.variables:
            kept = data[name][:, :: study.trajectories.every]
            columns[f"{name} over time"] = pa.array([None if b else row for b, row in zip(bad, kept, strict=True)])
    columns |= {name: pa.array(values) for name, values in runs.checks.items()}
    columns["switchings"] = pa.array(runs.switchings.astype(np.int64))
    columns["error"] = pa.array(runs.errors)
    units = _units(text)
    fields = [pa.field(n, c.type, metadata={"units": units[n]} if units.get(n) else None) for n, c in columns.items()]
    return pa.table(columns, schema=pa.schema(fields))


def as_parquet(text: str, tables: list[pa.Table]) -> bytes:
    """The tables of a chunk as one file, with the study in its metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    about = {"lostmotion_study": text, "lostmotion_version": installed_version()}
    out = io.BytesIO()
    pq.write_table(pa.concat_tables(tables).replace_schema_metadata(about), out)
    return out.getvalue()


class Runs(SimpleNamespace):
    """Of a piece: parameters (runs x parameters), samples (variable -> runs x samples), what the core has made of them instead
    (column -> runs), energy (entry -> runs), columns of the drive check, switchings, errors, ratio (runs)."""

    parameters: np.ndarray
    samples: dict[str, np.ndarray]
    kept: dict[str, np.ndarray]
    energy: dict[str, np.ndarray]
    checks: dict[str, list[float | str]]
    switchings: np.ndarray
    errors: list[str]
    ratio: np.ndarray


def _sources(needed: frozenset[str]) -> set[str]:
    """The channels of the core that the wanted variables are made of."""
    derived = {
        "efficiency": {"output_torque", "input_torque", "motor_speed"},
        "motor_power": {"motor_torque", "motor_speed"},
    }
    return {channel for name in needed for channel in derived.get(name, {name})}


def _derived(study: Study, runs: Runs, needed: frozenset[str]) -> dict[str, np.ndarray]:
    if not needed & DERIVED:
        return runs.samples
    whole = {
        c: runs.samples.get(c, np.zeros((len(runs.errors), study.scenario.simulation.samples))) for c in CHANNEL_NAMES
    }
    add_derived(whole, runs.ratio[:, None])
    return {name: whole[name] for name in needed | set(runs.samples)}


@lru_cache(maxsize=4)
def _instants(samples: int, interval: float) -> Any:
    """The coordinate of the samples; making its index takes longer than many a reduction."""
    import xarray as xr

    return xr.Coordinates({"time": np.arange(samples) * interval})


def _names(study: Study, data: dict[str, np.ndarray], runs: Runs, threads: int) -> dict[str, Any]:
    """All that the study's expressions may use, over all runs of a piece."""
    import xarray as xr

    def each_run(values: np.ndarray) -> xr.DataArray:
        return xr.DataArray(values, dims="run")

    instants = _instants(study.scenario.simulation.samples, study.scenario.simulation.sample_interval)
    names: dict[str, Any] = {
        name: xr.DataArray(data[name], instants, ("run", "time")) for name in _used(study) & data.keys()
    }
    names["time"] = xr.DataArray(instants["time"], instants)
    if _asks_for(study, "energy"):
        names["energy"] = {k: each_run(v) for k, v in runs.energy.items()}
    if _asks_for(study, "ideal_speed"):
        names["ideal_speed"] = names["command"] * each_run(_ideal_speeds(study, runs))
    names["bandwidth"] = lambda amplitude=None: each_run(_bandwidths(study, runs, amplitude, threads))
    return names


def _ideal_speeds(study: Study, runs: Runs) -> np.ndarray:
    """Load speed [rad/s] at command 1 of a rigid drive without inertia, friction and load, for each run."""

    def of(scenario: Scenario) -> float:
        return scenario.motor.no_load_speed / scenario.gearbox.ratio

    keys = {key for v in study.vary for key in v.all_keys}
    if not any(key.startswith("motor") or key in ("gearbox.ratio", "gearbox", "gearbox.from") for key in keys):
        return np.full(len(runs.errors), of(study.scenario))
    rows = zip(runs.parameters, runs.errors, strict=True)
    return np.array([math.nan if error else of(study.scenario_at(row)) for row, error in rows])


def _bandwidths(study: Study, runs: Runs, amplitude: Any, threads: int) -> np.ndarray:
    """Bandwidth [Hz] of the load speed for each run, at the amplitude of its command or at the given one.

    Where it cannot be found, the run's error says why.
    """
    amplitudes = np.broadcast_to(np.nan if amplitude is None else np.asarray(amplitude, dtype=float), len(runs.errors))

    def find(k: int) -> float:
        if runs.errors[k]:
            return math.nan
        scenario = study.scenario_at(runs.parameters[k])
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

    with ThreadPoolExecutor(max_workers=threads) as pool:
        return np.array(list(pool.map(find, range(len(runs.errors)))))


def scenario_of_run(study: Study, run: int) -> Scenario:
    """The scenario of one run, by its number."""
    return study.scenario_at(study.parameters(run, run + 1)[0])


def _one_by_one(study: Study, parameters: np.ndarray, channels: list[str], energy: bool) -> Runs:
    """Any key may vary: each run is a scenario of its own."""
    n, samples = len(parameters), study.scenario.simulation.samples
    runs = Runs(
        parameters=parameters,
        samples={c: np.full((n, samples), np.nan) for c in channels},
        kept={},
        energy={e: np.full(n, np.nan) for e in ENERGY},
        checks={name: [empty] * n for name, empty in COLUMNS.items()} if _checks(study) else {},
        switchings=np.zeros(n),
        errors=[""] * n,
        ratio=np.full(n, study.scenario.gearbox.ratio),
    )
    for k, row in enumerate(parameters):
        try:
            scenario = study.scenario_at(row)
            result = simulate(scenario, energy=energy)
            checks = check_columns(scenario) if _checks(study) else {}
        except (RuntimeError, ValueError) as error:
            runs.errors[k] = str(error)
            continue
        for c in channels:
            runs.samples[c][k] = result[c].values
        if energy:
            for e, value in json.loads(result.attrs["energy"]).items():
                runs.energy[e][k] = value
        for name, value in checks.items():
            runs.checks[name][k] = value
        runs.switchings[k] = result.attrs["switching_count"]
        runs.ratio[k] = scenario.gearbox.ratio
    return runs


@lru_cache(maxsize=1)
def _fields() -> dict[str, int]:
    return {key: k for k, key in enumerate(_core.batch_fields())}


def _checks(study: Study) -> bool:
    """Whether each run goes through the drive check."""
    return study.select is not None and study.select.drive_check


def _core_can(study: Study) -> bool:
    """Whether all that varies is a plain number of the core, and the runs are all that is wanted."""
    if _checks(study):
        return False
    s = study.scenario
    rigid = isinstance(s.gearbox.stiffness, Rigid)
    for v in study.vary:
        for key in v.all_keys:
            if key not in _fields() or base_value(s, key) is None or rigid:
                return False
            if key == SLOPES and (not v.relative or s.gearbox.stiffness.preload > 0.0):  # type: ignore[union-attr]
                return False
            if key.startswith(("command.", "load.torque.")):
                signal = s.command if key.startswith("command.") else s.load.torque
                plain = not (signal.sines or signal.steps or signal.ramps or signal.chirp or signal.samples)
                if not plain:
                    return False
    return True


def _in_the_core(
    study: Study,
    parameters: np.ndarray,
    channels: list[str],
    reductions: dict[str, tuple[str, str]],
    energy: bool,
    threads: int,
) -> Runs:
    """All runs in one call, the GIL released."""
    s = study.scenario
    keys = [(key, v, k) for k, v in enumerate(study.vary) for key in v.all_keys]
    values = np.empty((len(parameters), len(keys)))
    for j, (key, v, k) in enumerate(keys):
        values[:, j] = parameters[:, k]
        if v.relative and key != SLOPES:  # of the slopes the core takes the factor
            values[:, j] *= float(base_value(s, key))
    errors = _out_of_range(study, parameters)
    good = np.array([e == "" for e in errors])
    made, texts, switchings, energies = _core.run_batch(
        *core_inputs(s),
        [_fields()[key] for key, _, _ in keys],
        np.ascontiguousarray(values[good]),
        s.simulation.duration,
        s.simulation.sample_interval,
        s.simulation.samples,
        energy,
        [CHANNEL_NAMES.index(c) for c in channels],
        [(channels.index(variable), REDUCTIONS.index(how)) for how, variable in reductions.values()],
        threads,
    )
    n = len(parameters)
    where = np.flatnonzero(good)
    for row, text in zip(where.tolist(), texts, strict=True):
        errors[row] = text

    def spread(x: np.ndarray) -> np.ndarray:
        if len(where) == n:
            return x
        out = np.full((n, *x.shape[1:]), np.nan)
        out[where] = x
        return out

    ratio = next((values[:, j] for j, (key, _, _) in enumerate(keys) if key == "gearbox.ratio"), None)
    return Runs(
        parameters=parameters,
        samples={} if reductions else {c: spread(made[:, k]) for k, c in enumerate(channels)},
        kept={name: spread(made[:, k]) for k, name in enumerate(reductions)},
        energy={e: spread(energies[:, k]) for k, e in enumerate(ENERGY)},
        checks={},
        switchings=np.nan_to_num(spread(switchings)),
        errors=errors,
        ratio=np.full(n, s.gearbox.ratio) if ratio is None else ratio,
    )


def _out_of_range(study: Study, parameters: np.ndarray) -> list[str]:
    """For each run, why it is no valid scenario; empty if it is.

    The range of each number is an interval, so if the least and the largest value are valid, all are; a run is looked at by
    itself only where that fails.
    """
    errors = [""] * len(parameters)
    low, high = parameters.min(axis=0), parameters.max(axis=0)
    try:
        study.scenario_at(low)
        study.scenario_at(high)
    except InputError:
        for k, row in enumerate(parameters):
            try:
                study.scenario_at(row)
            except InputError as error:
                errors[k] = str(error)
    return errors
