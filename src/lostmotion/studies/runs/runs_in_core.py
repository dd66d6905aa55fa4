"""Runs of trains without sampled controllers: all in one call of the core, which writes plain numbers that vary into the train."""

from functools import lru_cache

import numpy as np

from ... import _core
from ...errors import InputError
from ...model.torsion import Rigid
from ...simulation.forms.set_by_dotted_key import renamed
from ...simulation.runs.core_runs import core_case
from ...simulation.runs.pointing_error import pointed
from ...simulation.runs.separate_trains import parts_of
from ...simulation.scenario.one_gear import drive_keys, has_one_gear
from ...simulation.scenario.scenario import Scenario
from ..expressions.functions import REDUCTIONS
from ..study.drive_check_columns import COLUMNS, check_columns
from ..study.study_definition import Study
from ..study.vary import Vary, base_value
from ..study.wanted_values import asks_for, channels, checks_drives, needed, reductions
from .chunk_results import Runs, spread

RATIO, SLOPES = "gearbox.ratio", "gearbox.stiffness.slopes"


@lru_cache(maxsize=1)
def _fields() -> dict[str, int]:
    return {key: k for k, key in enumerate(_core.batch_fields())}


def together(study: Study) -> bool:
    """Whether its runs are of trains that the core can take at once."""
    follows = study.scenario.axes() or pointed(study.scenario)
    return not follows and len(parts_of(study.scenario)) == 1


def core_can(study: Study) -> bool:
    """Whether all that varies is a plain number that the core changes by itself, and the runs are all that is wanted."""
    s = study.scenario
    if checks_drives(study) or not together(study) or not has_one_gear(s):
        return False
    ((_, motor),), ((_, gear),) = s.train().motors.items(), s.train().gears.items()
    rigid = isinstance(gear.stiffness, Rigid)
    signals = [*s.tables.command.values(), *s.loads().values()]
    for key, own, v in _keys(study):
        if own not in _fields() or base_value(s, key) is None or rigid:
            return False
        if own.startswith("motor.") and motor.kind == "synchronous":
            return False  # numbers of the core follow from it
        if own == SLOPES and (not v.relative or gear.stiffness.preload > 0.0):  # type: ignore[union-attr]
            return False
        if own.startswith(("command.", "load.torque.")):
            parts = ("sines", "steps", "ramps", "chirp", "samples", "wind")
            if any(getattr(signal, part, None) for signal in signals for part in parts):
                return False
    return True


def _keys(study: Study) -> list[tuple[str, str, Vary]]:
    """Each key that varies, as it is in the tables and as the core has it."""
    names = drive_keys(study.scenario)
    return [(key, renamed(key, names), v) for v in study.vary for key in v.all_keys]


def run_in_core(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """Simulate all runs in one call, with the GIL released."""
    n, sampled, reduced = len(parameters), channels(study), reductions(study)
    entries = study.vocabulary.energies if asks_for(study, "energy") else ()
    errors, cases, fields, values = (_by_numbers if core_can(study) else _one_by_one)(study, parameters)
    where = np.array([k for k, error in enumerate(errors) if not error], dtype=int)
    found = _core.run_batch(
        [core_case(scenario) for scenario in cases],
        fields=fields,
        values=values,
        **study.scenario.simulation.grid(),
        energies=[entry for _, entry in entries],
        channels=sampled,
        kept=[(sampled.index(variable), REDUCTIONS.index(how)) for how, variable in reduced.values()],
        threads=threads,
    )
    made, energies = found["values"], found["energies"]
    for k, text in zip(where.tolist(), found["errors"], strict=True):
        errors[k] = text
    checks = _checks_of(dict(zip(where.tolist(), cases, strict=True)), errors) if checks_drives(study) else {}
    rows = {} if reduced else {name: spread(made[:, k], where, n) for k, name in enumerate(sampled)}
    return Runs(
        parameters=parameters,
        samples=_with_derived(study, rows, parameters, errors),
        kept={name: spread(made[:, k], where, n) for k, name in enumerate(reduced)},
        energy={name: spread(energies[:, k], where, n) for k, (name, _) in enumerate(entries)},
        checks=checks,
        switchings=np.nan_to_num(spread(found["switchings"], where, n)),
        errors=errors,
    )


Wanted = tuple[list[str], list[Scenario], list[int], np.ndarray]
"""of each run why there is none; the scenarios, or the one in which numbers vary; these, and their values of each run that there is"""


def _by_numbers(study: Study, parameters: np.ndarray) -> Wanted:
    errors, keys = _out_of_range(study, parameters), _keys(study)
    there = parameters[[not error for error in errors]]
    values = np.empty((len(there), len(keys)))
    for j, (key, own, v) in enumerate(keys):
        values[:, j] = there[:, study.vary.index(v)]
        if v.relative and own != SLOPES:  # of the slopes the core takes the factor
            values[:, j] *= float(base_value(study.scenario, key))
    return errors, [study.scenario], [_fields()[own] for _, own, _ in keys], values


def _one_by_one(study: Study, parameters: np.ndarray) -> Wanted:
    scenarios, errors = [], [""] * len(parameters)
    for k, row in enumerate(parameters):
        try:
            scenarios.append(study.scenario_at(row))
        except InputError as error:
            errors[k] = str(error)
    return errors, scenarios, [], np.empty((0, 0))


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


def _with_derived(
    study: Study, rows: dict[str, np.ndarray], parameters: np.ndarray, errors: list[str]
) -> dict[str, np.ndarray]:
    """The needed variables (runs x samples), what follows from the channels included."""
    wanted = needed(study)
    if not rows or wanted <= rows.keys():
        return rows
    table = study.scenario.simulation
    time = table.instants()
    out = {name: np.full((len(errors), table.samples), np.nan) for name in wanted}
    changed = not core_can(study) or any(own == RATIO for _, own, _ in _keys(study))  # and nothing else matters
    for k, row in enumerate(parameters):
        if errors[k]:
            continue
        data = {name: values[k] for name, values in rows.items()}
        (study.scenario_at(row) if changed else study.scenario).derive(data, time)
        for name in wanted:
            out[name][k] = data[name]
    return out


def _out_of_range(study: Study, parameters: np.ndarray) -> list[str]:
    """Reason why each run is no valid scenario; empty if it is valid.

    The range of each number is an interval. So if the least and the largest value are valid, all are. A run is
    checked by itself only if they are not.
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
