"""Errors of runs against logs: MAE, RMSE and fit of each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..prepared_log import Prepared


@dataclass(frozen=True)
class LogError:
    """Error of one measured channel of one log."""

    log: str
    channel: str
    held_out: bool
    mae: float  #: mean absolute error, SI
    rmse: float  #: root mean square error, SI
    fit: float  #: 1 - rmse/standard deviation of what was measured: 1 is perfect
    samples: int


def log_errors(logs: Sequence[Prepared], residuals: Sequence[np.ndarray]) -> list[LogError]:
    """Errors of each log and channel from weighted residuals, without the weights; NaN of a log that has no run."""
    found = []
    for log, rows in zip(logs, residuals, strict=True):
        for (name, values), row, there in zip(log.measured.items(), rows / log.weight, log.valid, strict=True):
            measured, r = values[there], row[there]
            rmse = float(np.sqrt(np.mean(r**2)))
            spread = float(np.std(measured))
            fit = 1.0 - rmse / spread if spread > 0.0 else float("nan")
            found.append(LogError(log.name, name, log.held_out, float(np.mean(np.abs(r))), rmse, fit, len(r)))
    return found


def total(errors: Sequence[LogError], *, held_out: bool, channel: str) -> tuple[float, float]:
    """(MAE, RMSE) over all samples of some logs that have a run; NaN where there are none."""
    own = [e for e in errors if e.held_out == held_out and e.channel == channel and not np.isnan(e.mae)]
    n = sum(e.samples for e in own)
    if n == 0:
        return float("nan"), float("nan")
    return sum(e.mae * e.samples for e in own) / n, float(np.sqrt(sum(e.rmse**2 * e.samples for e in own) / n))
