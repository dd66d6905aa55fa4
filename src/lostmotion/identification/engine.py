"""Runs of all logs, and how they change with the parameters: central differences, on several threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..errors import InputError
from .parameters import FreeParameter
from .prepare import Prepared
from .rig import Rig

STEP = 1e-2  # of a parameter's scale, in differences


@dataclass(frozen=True)
class Point:
    """Values of all parameters, and of the nuisances of each log by its name."""

    values: dict[str, float]
    nuisance: dict[str, dict[str, float]]

    def of(self, log: Prepared) -> dict[str, float]:
        """All values that the run of a log takes."""
        return self.values | self.nuisance.get(log.name, {})


class Engine:
    """Residuals of logs against runs of the rig, and their Jacobians.

    Parameters
    ----------
    rig
        What is measured.
    threads
        Runs at the same time; left out, as many as there are processors.
    """

    def __init__(self, rig: Rig, threads: int | None = None) -> None:
        self.rig = rig
        self.threads = threads or os.cpu_count() or 1
        self.runs = 0
        """so far"""

    def residual(self, log: Prepared, values: Mapping[str, float], rung: int) -> np.ndarray:
        """Measured less computed, times the weights of the samples, one row for each measured channel, SI; NaN where the rig has no motion."""
        try:
            seen = self.rig.run(log, values, rung)
        except (InputError, _core.SolverError):
            return np.full((len(log.measured), len(log.time)), np.nan)
        return np.array([(log.measured[name] - seen[name]) * log.weight for name in log.measured])

    def residuals(self, logs: Sequence[Prepared], point: Point, rung: int) -> list[np.ndarray]:
        """Of each log, see `residual`."""
        return self._each([lambda log=log: self.residual(log, point.of(log), rung) for log in logs])  # type: ignore[misc]

    def jacobians(
        self, logs: Sequence[Prepared], point: Point, rung: int, parameters: Mapping[str, FreeParameter]
    ) -> list[np.ndarray]:
        """Of each log the derivative of its residuals by each parameter: channels x samples x parameters.

        A parameter on its bound is changed to the inner side alone.
        """
        work = []
        for log in logs:
            values = point.of(log)
            for name, p in parameters.items():
                h = STEP * p.step
                up, down = min(values[name] + h, p.max), max(values[name] - h, p.min)
                work += [(log, values | {name: x}) for x in (up, down)]
        found = self._each([lambda log=log, v=v: self.residual(log, v, rung) for log, v in work])  # type: ignore[misc]
        out, pairs = [], iter(zip(work, found, strict=True))
        for log in logs:
            columns = []
            for name in parameters:
                ((_, above), high), ((_, below), low) = next(pairs), next(pairs)
                column = (high - low) / (above[name] - below[name])
                columns.append(np.nan_to_num(column))
            shape = (len(log.measured), len(log.time), 0)
            out.append(np.stack(columns, axis=-1) if columns else np.zeros(shape))
        return out

    def _each(self, work: list[Callable[[], np.ndarray]]) -> list[np.ndarray]:
        self.runs += len(work)
        if self.threads == 1 or len(work) == 1:
            return [piece() for piece in work]
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(lambda piece: piece(), work))
