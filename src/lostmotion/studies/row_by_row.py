"""Runs in which any key may vary: each is a scenario of its own. Those of drive trains run together in the core."""

from __future__ import annotations

import json

import numpy as np

from .. import _core
from ..errors import InputError
from ..simulation.results import ENERGY
from ..simulation.run import simulate
from ..simulation.scenario import Scenario
from ..simulation.train_results import add_derived_of_train, core_case
from ..simulation.train_scenario import TrainScenario, need_open_loop
from .check import COLUMNS, check_columns
from .functions import REDUCTIONS
from .runs import Runs, spread
from .study import Study
from .wanted import asks_for, channels, checks_drives, needed, reductions


def run_drives(study: Study, parameters: np.ndarray) -> Runs:
    """Drives, one after the other."""
    assert isinstance(study.scenario, Scenario)
    n, samples, sampled = len(parameters), study.scenario.simulation.samples, channels(study)
    energy, checked = asks_for(study, "energy"), checks_drives(study)
    runs = Runs(
        parameters=parameters,
        samples={c: np.full((n, samples), np.nan) for c in sampled},
        kept={},
        energy={e: np.full(n, np.nan) for e in ENERGY},
        checks={name: [empty] * n for name, empty in COLUMNS.items()} if checked else {},
        switchings=np.zeros(n),
        errors=[""] * n,
        ratio=np.full(n, study.scenario.gearbox.ratio),
    )
    for k, row in enumerate(parameters):
        try:
            scenario = study.drive_at(row)
            result = simulate(scenario, energy=energy)
            checks = check_columns(scenario) if checked else {}
        except (RuntimeError, ValueError) as error:
            runs.errors[k] = str(error)
            continue
        for c in sampled:
            runs.samples[c][k] = result[c].values
        if energy:
            for e, value in json.loads(result.attrs["energy"]).items():
                runs.energy[e][k] = value
        for name, value in checks.items():
            runs.checks[name][k] = value
        runs.switchings[k] = result.attrs["switching_count"]
        runs.ratio[k] = scenario.gearbox.ratio
    return runs


def run_trains(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """Drive trains: made here, run in the core on several threads, the GIL released."""
    need_open_loop(study.scenario, "study")
    n, table = len(parameters), study.scenario.simulation
    sampled, reduced = channels(study), reductions(study)
    entries = study.vocabulary.energies if asks_for(study, "energy") else ()
    trains: dict[int, TrainScenario] = {}
    errors = [""] * n
    for k, row in enumerate(parameters):
        try:
            trains[k] = study.train_at(row)
        except InputError as error:
            errors[k] = str(error)
    where = np.array(list(trains), dtype=int)
    made, texts, switchings, energies = _core.run_trains(
        [core_case(scenario) for scenario in trains.values()],
        table.duration,
        table.sample_interval,
        table.samples,
        [entry for _, entry in entries],
        sampled,
        [(sampled.index(variable), REDUCTIONS.index(how)) for how, variable in reduced.values()],
        threads,
    )
    for row, text in zip(where.tolist(), texts, strict=True):
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
        switchings=np.nan_to_num(spread(switchings, where, n)),
        errors=errors,
        ratio=np.full(n, np.nan),
    )


def _checks_of(trains: dict[int, TrainScenario], errors: list[str]) -> dict[str, list[float | str]]:
    """The drive check of each run; where there is none, the run's error says why."""
    checks = {name: [empty] * len(errors) for name, empty in COLUMNS.items()}
    for run, scenario in trains.items():
        if errors[run]:
            continue
        try:
            found = check_columns(scenario)
        except (RuntimeError, ValueError) as error:
            errors[run] = str(error)
            continue
        for name, value in found.items():
            checks[name][run] = value
    return checks


def _samples(
    study: Study, trains: dict[int, TrainScenario], made: dict[str, np.ndarray], errors: list[str]
) -> dict[str, np.ndarray]:
    """The needed variables (runs x samples), what follows from the channels included."""
    wanted = sorted(needed(study))
    where = np.array(list(trains), dtype=int)
    if wanted == list(made):
        return {name: spread(values, where, len(errors)) for name, values in made.items()}
    table = study.scenario.simulation
    time = np.arange(table.samples) * table.sample_interval
    out = {name: np.full((len(errors), table.samples), np.nan) for name in wanted}
    for place, (run, scenario) in enumerate(trains.items()):
        if errors[run]:
            continue
        data = {name: values[place] for name, values in made.items()}
        add_derived_of_train(scenario.train(), data, time)
        for name in wanted:
            out[name][run] = data[name]
    return out
