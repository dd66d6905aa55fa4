"""Runs of all logs, and how they change with the parameters: exactly, and by differences where that is not defined."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..prepared_log import Prepared
from ..task.free_parameters import FreeParameter
from ..task.identification_file import Identification, free_on
from .rig_runs import NoDerivativeError, Seen, run_logs
from .rig_scenario import Rig

STEP = 1e-2  # of a parameter's scale, in differences
TOGETHER = 32  # logs that are run at once: the scenarios of more take much memory


@dataclass(frozen=True)
class ParameterPoint:
    """Values of all parameters, and of the nuisances of each log by its name."""

    values: dict[str, float]
    nuisance: dict[str, dict[str, float]]

    def of(self, log: Prepared) -> dict[str, float]:
        """All values that the run of a log takes: parameters and nuisances."""
        return self.values | self.nuisance.get(log.name, {})


class Engine:
    """Residuals of logs against runs of the rig, and their Jacobians.

    rig: what is measured.
    threads: runs at the same time; left out, as many as there are processors.
    """

    def __init__(self, rig: Rig, threads: int | None = None) -> None:
        self.rig = rig
        self.threads = threads or os.cpu_count() or 1
        self._ahead: _Ahead | None = None
        self.by_differences: dict[str, str] = {}  # by parameter: why its derivatives are differences
        self.touching: dict[str, str] = {}
        """by log: why its derivatives are differences from some instant on, where they were last asked for"""
        self.failed: dict[str, str] = {}  # by log: why it has no run, where residuals were last asked for

    def residuals(
        self,
        logs: Sequence[Prepared],
        point: ParameterPoint,
        rung: int,
        derivatives: Mapping[str, FreeParameter] | None = None,
    ) -> list[np.ndarray]:
        """Residuals of each log, weighted, one row for each measured channel, SI; NaN if the rig has no motion,
        0 where the log has no number.

        derivatives: parameters whose `jacobians` is likely to be asked next at this point: their derivatives add a
            tenth to a run.
        """
        requests = [(log, point.of(log)) for log in logs]
        found, exact = self._exact(requests, rung, derivatives or {})
        self._ahead = _Ahead(logs, point, rung, found, exact) if derivatives else None
        rows, self.failed = _residuals(requests, found)
        return rows

    def jacobians(
        self, logs: Sequence[Prepared], point: ParameterPoint, rung: int, parameters: Mapping[str, FreeParameter]
    ) -> list[np.ndarray]:
        """Derivatives of the residuals of each log by each parameter: channels x samples x parameters.

        From an instant at which a motion only touches a condition, it has no derivative. There, and for parameters
        without a derivative, a central difference over a hundredth of the parameter's scale is taken. One on its
        bound is changed to the inner side alone.
        """
        names = list(parameters)
        requests = [(log, point.of(log)) for log in logs]
        ahead, self._ahead = self._ahead, None
        if ahead is not None and ahead.logs is logs and ahead.point is point and ahead.rung == rung:
            found, exact = ahead.found, ahead.exact
        else:
            found, exact = self._exact(requests, rung, parameters)
        out = []
        wanted: list[tuple[int, str]] = []
        for k, (log, seen) in enumerate(zip(logs, found, strict=True)):
            J = np.full((*seen.values.shape, len(names)), np.nan)
            J[..., [names.index(name) for name in exact]] = -seen.derivatives * log.weight[:, None]
            J[~log.valid] = 0.0
            out.append(J)
            self.touching.pop(log.name, None)
            if seen.error is None and seen.ends_by:
                self.touching[log.name] = seen.ends_by
            whole = seen.error is None and not seen.ends_by
            wanted += [(k, name) for name in names if not (whole and name in exact)]
        for (k, name), column in zip(wanted, self._differences(requests, wanted, rung, parameters), strict=True):
            J = out[k][..., names.index(name)]
            J[...] = np.where(np.isnan(J), np.nan_to_num(column), J)
        return out

    def _run(
        self,
        requests: Sequence[tuple[Prepared, Mapping[str, float]]],
        rung: int,
        parameters: Mapping[str, FreeParameter],
    ) -> list[Seen]:
        """Runs of some requests after the others."""
        return [
            seen
            for k in range(0, len(requests), TOGETHER)
            for seen in run_logs(self.rig, requests[k : k + TOGETHER], rung, parameters, threads=self.threads)
        ]

    def _exact(
        self,
        requests: Sequence[tuple[Prepared, Mapping[str, float]]],
        rung: int,
        parameters: Mapping[str, FreeParameter],
    ) -> tuple[list[Seen], list[str]]:
        """(runs, names of the parameters by which they have derivatives)."""
        while True:
            exact = {name: p for name, p in parameters.items() if name not in self.by_differences}
            try:
                return self._run(requests, rung, exact), list(exact)
            except NoDerivativeError as refused:
                self.by_differences[refused.name] = str(refused)

    def _differences(
        self,
        requests: Sequence[tuple[Prepared, Mapping[str, float]]],
        wanted: Sequence[tuple[int, str]],
        rung: int,
        parameters: Mapping[str, FreeParameter],
    ) -> list[np.ndarray]:
        """Differences of residuals, for (number of a log, parameter)."""
        work, widths = [], []
        for k, name in wanted:
            log, values = requests[k]
            p = parameters[name]
            h = STEP * p.step
            above, below = min(values[name] + h, p.max), max(values[name] - h, p.min)
            work += [(log, {**values, name: above}), (log, {**values, name: below})]
            widths.append(above - below)
        rows = _residuals(work, self._run(work, rung, {}))[0] if work else []
        return [(a - b) / w for a, b, w in zip(rows[::2], rows[1::2], widths, strict=True)]


@dataclass(frozen=True)
class _Ahead:
    """Runs with derivatives from which the next Jacobian may be made."""

    logs: Sequence[Prepared]
    point: ParameterPoint
    rung: int
    found: list[Seen]
    exact: list[str]  # parameters of the derivatives


def _residuals(
    requests: Sequence[tuple[Prepared, Mapping[str, float]]], found: Sequence[Seen]
) -> tuple[list[np.ndarray], dict[str, str]]:
    """Residuals of each request; and by log the reason for a missing run."""
    failed = {
        log.name: str(seen.error or "the run has no finite values")
        for (log, _), seen in zip(requests, found, strict=True)
        if seen.error is not None or not np.isfinite(seen.values).all()
    }
    rows = [
        np.where(log.valid, (np.array(list(log.measured.values())) - seen.values) * log.weight, 0.0)
        for (log, _), seen in zip(requests, found, strict=True)
    ]
    return rows, failed


def start_point(task: Identification, logs: Sequence[Prepared]) -> ParameterPoint:
    """Start values; parameters of later candidate models are off."""
    first = free_on(task, 0)
    values = {
        name: p.start if name in first or p.fixed or p.off is None else p.off for name, p in task.parameters.items()
    }
    own = {name: p.start for name, p in task.nuisance.items()}
    return ParameterPoint(values, {log.name: dict(own) for log in logs})
