"""Runs of a drive in which nothing but plain numbers varies: all in one call of the core, which writes them into the drive."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .. import _core
from ..errors import InputError
from ..model.torsion import Rigid
from ..simulation.core_runs import core_case
from ..simulation.results import ENERGY
from .functions import REDUCTIONS
from .runs import Runs, spread
from .study import Study
from .vary import base_value
from .wanted import asks_for, channels, checks_drives, reductions

SLOPES = "gearbox.stiffness.slopes"


@lru_cache(maxsize=1)
def _fields() -> dict[str, int]:
    return {key: k for k, key in enumerate(_core.batch_fields())}


def core_can(study: Study) -> bool:
    """Whether all that varies is a plain number of the core, and the runs are all that is wanted."""
    s = study.scenario
    if checks_drives(study) or not s.is_drive or s.controller is not None:
        return False
    rigid = isinstance(s.gearbox.stiffness, Rigid)
    for v in study.vary:
        for key in v.all_keys:
            if key not in _fields() or base_value(s, key) is None or rigid:
                return False
            if key.startswith("motor.") and s.motor.kind == "synchronous":
                return False  # numbers of the core follow from it
            if key == SLOPES and (not v.relative or s.gearbox.stiffness.preload > 0.0):  # type: ignore[union-attr]
                return False
            if key.startswith(("command.", "load.torque.")):
                signal = s.command if key.startswith("command.") else s.load.torque
                plain = not (
                    signal.sines
                    or signal.steps
                    or signal.ramps
                    or signal.chirp
                    or signal.samples
                    or getattr(signal, "wind", None)
                )
                if not plain:
                    return False
    return True


def run_in_core(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """All runs in one call, the GIL released."""
    s = study.drive
    sampled, reduced = channels(study), reductions(study)
    keys = [(key, v, k) for k, v in enumerate(study.vary) for key in v.all_keys]
    values = np.empty((len(parameters), len(keys)))
    for j, (key, v, k) in enumerate(keys):
        values[:, j] = parameters[:, k]
        if v.relative and key != SLOPES:  # of the slopes the core takes the factor
            values[:, j] *= float(base_value(s, key))
    errors = _out_of_range(study, parameters)
    where = np.flatnonzero([e == "" for e in errors])
    found = _core.run_batch(
        [core_case(s)],
        fields=[_fields()[key] for key, _, _ in keys],
        values=np.ascontiguousarray(values[where]),
        **s.simulation.grid(),
        energies=ENERGY if asks_for(study, "energy") else (),
        channels=sampled,
        kept=[(sampled.index(variable), REDUCTIONS.index(how)) for how, variable in reduced.values()],
        threads=threads,
    )
    n, made, energies = len(parameters), found["values"], found["energies"]
    for row, text in zip(where.tolist(), found["errors"], strict=True):
        errors[row] = text
    ratio = next((values[:, j] for j, (key, _, _) in enumerate(keys) if key == "gearbox.ratio"), None)
    return Runs(
        parameters=parameters,
        samples={} if reduced else {c: spread(made[:, k], where, n) for k, c in enumerate(sampled)},
        kept={name: spread(made[:, k], where, n) for k, name in enumerate(reduced)},
        energy={e: spread(energies[:, k], where, n) for k, e in enumerate(ENERGY)} if energies.shape[1] else {},
        checks={},
        switchings=np.nan_to_num(spread(found["switchings"], where, n)),
        errors=errors,
        ratio=np.full(n, s.gearbox.ratio) if ratio is None else ratio,
    )


def _out_of_range(study: Study, parameters: np.ndarray) -> list[str]:
    """For each run, why it is no valid scenario; empty if it is.

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
