"""Runs in which any key may vary: each is a scenario of its own. Those of plain drive trains run together in the core."""

from __future__ import annotations

import json

import numpy as np

from .. import _core
from ..errors import InputError
from ..simulation.core_runs import core_case
from ..simulation.pointing_error import pointing_errors
from ..simulation.run import run
from ..simulation.scenario import Scenario
from ..simulation.train_parts import parts_of
from ..simulation.windings import bound_values
from ..worker_threads import thread_pool
from .check import COLUMNS, check_columns
from .functions import REDUCTIONS
from .runs import Runs, spread
from .study import Study
from .wanted import asks_for, channels, checks_drives, needed, reductions


def run_each(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """Each as a run of its own, several at a time: drives, what has controllers, and trains of several parts."""
    n, samples = len(parameters), study.scenario.simulation.samples
    sampled = sorted(needed(study))
    energy, checked = asks_for(study, "energy"), checks_drives(study)
    entries = study.vocabulary.energies if energy else ()
    runs = Runs(
        parameters=parameters,
        samples={c: np.full((n, samples), np.nan) for c in sampled},
        kept={},
        energy={name: np.full(n, np.nan) for name, _ in entries},
        checks={name: [empty] * n for name, empty in COLUMNS.items()} if checked else {},
        switchings=np.zeros(n),
        errors=[""] * n,
    )

    def make(k: int) -> None:
        try:
            scenario = study.scenario_at(parameters[k])
            result = run(scenario, energy=energy)
            checks = check_columns(scenario) if checked else {}
        except (RuntimeError, ValueError) as error:
            runs.errors[k] = str(error)
            return
        bounds = bound_values(scenario, result.attrs, samples)
        values = {**result.values, **pointing_errors(scenario, result), **bounds}
        for c in sampled:
            runs.samples[c][k] = values[c]
        if energy:
            ledger = json.loads(result.attrs["energy"])
            for name, entry in entries:
                runs.energy[name][k] = ledger[entry]
        for name, value in checks.items():
            runs.checks[name][k] = value
        runs.switchings[k] = result.attrs["switching_count"]

    if threads == 1:
        for k in range(n):
            make(k)
        return runs
    with thread_pool(threads) as pool:
        list(pool.map(make, range(n)))
    return runs


def together(study: Study) -> bool:
    """Whether its runs are of trains that the core can take at once."""
    scenario = study.scenario
    return not scenario.is_drive and not scenario.axes() and len(parts_of(scenario)) == 1


def run_trains(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """Drive trains without controllers, of one part: made here, run in the core on several threads, the GIL released."""
    n = len(parameters)
    sampled, reduced = channels(study), reductions(study)
    entries = study.vocabulary.energies if asks_for(study, "energy") else ()
    trains: dict[int, Scenario] = {}
    errors = [""] * n
    for k, row in enumerate(parameters):
        try:
            trains[k] = study.scenario_at(row)
        except InputError as error:
            errors[k] = str(error)
    where = np.array(list(trains), dtype=int)
    found = _core.run_batch(
        [core_case(scenario) for scenario in trains.values()],
        fields=[],
        values=np.empty((0, 0)),
        **study.scenario.simulation.grid(),
        energies=[entry for _, entry in entries],
        channels=sampled,
        kept=[(sampled.index(variable), REDUCTIONS.index(how)) for how, variable in reduced.values()],
        threads=threads,
    )
    made, energies = found["values"], found["energies"]
    for row, text in zip(where.tolist(), found["errors"], strict=True):
        errors[row] = text
    checks = _checks_of(trains, errors) if checks_drives(study) else {}
    return Runs(
        parameters=parameters,
        samples={}
        if reduced
        else _samples(study, trains, dict(zip(sampled, made.swapaxes(0, 1), strict=True)), errors),
        kept={name: spread(made[:, k], where, n) for k, name in enumerate(reduced)},
        energy={name: spread(energies[:, k], where, n) for k, (name, _) in enumerate(entries)},
        checks=checks,
        switchings=np.nan_to_num(spread(found["switchings"], where, n)),
        errors=errors,
    )


def _checks_of(trains: dict[int, Scenario], errors: list[str]) -> dict[str, list[float | str]]:
    """The drive check of each run; where there is none, the run's error says why."""
    checks = {name: [empty] * len(errors) for name, empty in COLUMNS.items()}
    for k, scenario in trains.items():
        if errors[k]:
            continue
        try:
            found = check_columns(scenario)
        except (RuntimeError, ValueError) as error:
            errors[k] = str(error)
            continue
        for name, value in found.items():
            checks[name][k] = value
    return checks


def _samples(
    study: Study, trains: dict[int, Scenario], made: dict[str, np.ndarray], errors: list[str]
) -> dict[str, np.ndarray]:
    """The needed variables (runs x samples), what follows from the channels included."""
    wanted = sorted(needed(study))
    where = np.array(list(trains), dtype=int)
    if wanted == list(made):
        return {name: spread(values, where, len(errors)) for name, values in made.items()}
    table = study.scenario.simulation
    time = table.instants()
    out = {name: np.full((len(errors), table.samples), np.nan) for name in wanted}
    for place, (k, scenario) in enumerate(trains.items()):
        if errors[k]:
            continue
        data = {name: values[place] for name, values in made.items()}
        scenario.derive(data, time)
        for name in wanted:
            out[name][k] = data[name]
    return out
