"""Parameters of the drives of a batch, which may be written between steps."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from ...inputs.implausible_values import trusted
from ...inputs.refusal_messages import shown
from ..runs.sensitivities import value_at
from ..scenario.scenario import Scenario


class BatchParameters(Mapping[str, np.ndarray]):
    """Parameters of the drives of a batch by their keys in a scenario file: arrays in SI units with a value for each drive.

    What is written into such an array acts from the next step on. Iteration is over the keys that have been asked
    for, and the keys of `vary`.

    Examples
    --------
    >>> import lostmotion as lm
    >>> batch = lm.SimulationBatch(lm.load("paper-2dof-nl-small").drive(), step="1 ms", count=4)
    >>> batch.parameters["load.inertia"][2:] = 3.0
    >>> batch.step(0.1)
    >>> batch.parameters["load.inertia"].tolist()
    [2.0, 2.0, 3.0, 3.0]
    """

    def __init__(self, scenarios: Sequence[Scenario], columns: Mapping[str, np.ndarray], count: int) -> None:
        self._scenarios, self._count = scenarios, count
        self._columns = {key: np.array(column) for key, column in columns.items()}
        self._known = {key: column.copy() for key, column in self._columns.items()}

    def __getitem__(self, key: str) -> np.ndarray:
        if key not in self._columns:
            values = [value_at(one, key, "parameters") for one in self._scenarios]
            self._columns[key] = np.array(values if len(values) == self._count else values * self._count)
            self._known[key] = self._columns[key].copy()
        return self._columns[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __contains__(self, key: object) -> bool:
        return key in self._columns

    def changes(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Keys and numbers of the drives that have been written since the last call.

        Raises InputError: a value is out of its range.
        """
        changed = {key: self._known[key] != column for key, column in self._columns.items()}
        keys = tuple(key for key, where in changed.items() if where.any())
        if not keys:
            return (), np.empty(0, dtype=int)
        rows = np.flatnonzero(np.any([changed[key] for key in keys], axis=0))
        check_range(self._scenarios[0], {key: self._columns[key] for key in keys})
        for key in keys:
            self._known[key][:] = self._columns[key]
        return keys, rows

    def scenario(self, k: int) -> Scenario:
        """Scenario with all that drive number `k` has now."""
        one = self._scenarios[k if len(self._scenarios) == self._count else 0]
        if not self._columns:
            return one
        with trusted():
            return one.replace(**{key: float(column[k]) for key, column in self._columns.items()})


def check_range(scenario: Scenario, columns: Mapping[str, np.ndarray]) -> None:
    """Check the least and the largest of the values of each key: the range of a number is an interval.

    Raises InputError: a value is out of its range.
    """
    with trusted():
        for pick in (np.min, np.max) if columns else ():
            scenario.replace(**{key: float(pick(column)) for key, column in columns.items()})


def varied_columns(
    scenario: Scenario, vary: Mapping[str, Any], count: int, generator: np.random.Generator
) -> dict[str, np.ndarray]:
    """Check what varies from drive to drive; values by key, each with one number for each drive.

    Raises InputError: a key is unknown, an array has another shape or a value is out of its range.
    """
    columns = {}
    for key, value in vary.items():
        value_at(scenario, key, "vary")
        column = value(generator, count) if callable(value) else value
        columns[key] = np.broadcast_to(numbers_of_drives(f"vary.{key}", column, count), (count,))
    check_range(scenario, columns)
    return columns


def numbers_of_drives(name: str, value: Any, count: int, each: str = "drive") -> np.ndarray:
    """Check one number, or an array with one for each drive, and return it as an array.

    Raises InputError: the shape is another one, or a number is not finite.
    """
    try:
        numbers = np.ascontiguousarray(value, dtype=float).reshape(-1) if np.ndim(value) < 2 else None
    except (TypeError, ValueError):
        numbers = None
    if numbers is None or len(numbers) not in (1, count) or np.iscomplexobj(value):
        raise InputError(
            f"{name}: {shown(value)} must be a number, or an array of {count} numbers, one for each {each}"
        )
    if not np.isfinite(numbers).all():
        raise InputError(f"{name}: has numbers that are not finite; give finite ones")
    return numbers


def mask_of_drives(which: Any, count: int, each: str = "drive") -> np.ndarray:
    """Check an array of Booleans, one for each drive. Raises InputError: it is something else."""
    mask = np.asarray(which)
    if mask.dtype != bool or mask.shape != (count,):
        raise InputError(f"which: {shown(which)} must be an array of {count} Booleans, one for each {each}")
    return np.ascontiguousarray(mask)
