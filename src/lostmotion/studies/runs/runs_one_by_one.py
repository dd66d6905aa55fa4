"""Runs under sampled controllers, and of trains of several parts: each by itself."""

import json

import numpy as np

from ...interruptible_threads import thread_pool
from ...simulation.runs.pointing_error import pointing_errors
from ...simulation.runs.run import run
from ...simulation.scenario.field_oriented_motors import bound_values
from ..study.drive_check_columns import COLUMNS, check_columns
from ..study.study_definition import Study
from ..study.wanted_values import asks_for, checks_drives, needed
from .chunk_results import Runs


def run_each(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """Each as a run of its own, several at a time."""
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
