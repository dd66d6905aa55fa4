"""Change detection in a series of estimates, with a probability of a false alarm that holds at every length of the series.

Value k of the series is ``x_k = c_k' beta + sigma sqrt(v_k) e_k`` as long as nothing changes. It consists of a level,
the effects of known conditions, and normal errors e_k with relative variances v_k. From value j on, a change adds
``sigma a d_k``, where d is a step or a ramp. The size a has a normal prior of standard deviation s, or a half-normal
one if only one direction is of interest. The parameters beta and sigma are unknown and have the right Haar prior, the
density ``1/sigma``. The Bayes factor of "changed from j on" against "unchanged" is then the likelihood ratio of the
maximal invariant. As long as nothing changes, it is a martingale with expectation 1 for all beta and sigma
(Perez-Ortiz, Lardy, de Heide, Grunwald 2024). So by Doob's inequality

    evidence_n = mean over shapes and s of sum over j <= n of BF_j,n / N

exceeds ``1/alpha`` at some time within N values behind the baseline with probability of at most alpha.

Divide d, x and the columns c by ``sqrt(v)``, and project them onto the orthogonal complement of c. With ``q = d'd``,
``b = d'x`` and ``R = x'x`` the Bayes factor of n values and p conditions is

    BF = (1 + s^2 q)^(-1/2) (1 - s^2 b^2/((1 + s^2 q) R))^(-(n - p)/2),

times twice the posterior probability of the right sign for a half-normal prior (Student's t with n - p degrees of freedom).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..errors import need

SIZES = (1.0, 3.0, 10.0)  # prior standard deviations of a change, in those of the series
RAMPS = (1, 30, 300)  # values within which a change is complete; 1: a step
CONFIRMED = 2  # values in a row with evidence above the limit: one value that is wrong makes no alarm
POWER = 1.2816  # 90 % point of the normal distribution
CREDIBLE = 0.95  # of the instant at which a change began

Direction = Literal["up", "down", "both"]


@dataclass(frozen=True)
class Change:
    """Evidence of a change in a series, and where it began."""

    evidence: np.ndarray
    """after each value; 0 within the baseline"""
    limit: float
    """from which on the evidence is an alarm"""
    alarm: int | None
    """index of the value with which the alarm came; None without one"""
    begins: tuple[int, int, int] | None
    """index at which the change most likely began, and the 95 % credible range; None without an alarm"""
    ramp: int
    """values within which the change is most likely complete; 1 for a step"""
    deviation: float
    """standard deviation of a value of typical variance around the level of the baseline"""
    detectable: float
    """step over the last ten values that would have been found with a probability of 90 %"""


def find_change(
    x: np.ndarray,
    variances: np.ndarray,
    conditions: np.ndarray,
    baseline: int,
    *,
    direction: Direction = "both",
    false_alarms: float = 0.01,
    within: int = 1000,
) -> Change:
    """Find a change in a series.

    Parameters
    ----------
    x : array (values,)
        Values in their order in time.
    variances : array (values,)
        Relative variances of the values.
    conditions : array (values, conditions)
        Known conditions of each value; a constant is added to them.
    baseline : int
        Number of values at the beginning during which nothing changes; at least two more than conditions and constant.
    direction : {"up", "down", "both"}
        Direction of the changes that are of interest.
    false_alarms : float
        Largest probability of an alarm without a change within `within` values behind the baseline.
    within : int
        See `false_alarms`.

    Returns
    -------
    Change

    Examples
    --------
    >>> import numpy as np
    >>> from lostmotion.identification.changes import find_change
    >>> x = np.random.default_rng(0).normal(size=60)
    >>> x[40:] += 3.0
    >>> found = find_change(x, np.ones(60), np.zeros((60, 0)), 20)
    >>> found.alarm, found.begins[0], found.ramp
    (44, 40, 1)
    """
    n = len(x)
    limit = 1.0 / false_alarms
    logs, rows = _log_factors(x, variances, conditions, baseline, direction)
    evidence = np.zeros(n)
    for k in range(baseline, n):
        own = logs[k, : k - baseline + 1]
        evidence[k] = np.exp(np.minimum(own, 600.0)).mean(axis=(1, 2)).sum() / within
    above = evidence >= limit
    confirmed = [k for k in range(baseline + CONFIRMED - 1, n) if above[k - CONFIRMED + 1 : k + 1].all()]
    alarm = confirmed[0] if confirmed else None
    begins, ramp = (None, 1) if alarm is None else _began(logs[n - 1, : n - baseline], baseline)
    deviation = rows.deviation(baseline)
    return Change(evidence, limit, alarm, begins, ramp, deviation, rows.detectable(limit * within) * deviation)


def _began(logs: np.ndarray, baseline: int) -> tuple[tuple[int, int, int], int]:
    """(the most likely index of the beginning with its credible range, the most likely ramp)."""
    weights = np.exp(logs - logs.max()).sum(axis=2)
    j, shape = np.unravel_index(int(np.argmax(weights)), weights.shape)
    share = np.cumsum(weights.sum(axis=1)) / weights.sum()
    low, high = np.searchsorted(share, [0.5 * (1.0 - CREDIBLE), 0.5 * (1.0 + CREDIBLE)])
    return (baseline + int(j), baseline + int(low), baseline + int(min(high, len(share) - 1))), RAMPS[shape]


class _Rows:
    """The series and its conditions, divided by the deviations."""

    def __init__(self, x: np.ndarray, variances: np.ndarray, conditions: np.ndarray) -> None:
        scale = 1.0 / np.sqrt(variances)
        self.x = x * scale
        self.scale = scale
        self.columns = np.column_stack([np.ones(len(x)), conditions]) * scale[:, None]

    def deviation(self, count: int) -> float:
        """Deviation of the first values around their level."""
        A, x = self.columns[:count], self.x[:count]
        rest = x - A @ np.linalg.lstsq(A, x, rcond=None)[0]
        return math.sqrt(float(rest @ rest) / max(1, count - np.linalg.matrix_rank(A)))

    def detectable(self, factor: float, last: int = 10) -> float:
        """Step over the last values, in deviations, that the evidence of a step of the middle size finds with 90 %."""
        n = len(self.x)
        d = np.where(np.arange(n) >= n - last, self.scale, 0.0)
        A = self.columns
        d = d - A @ np.linalg.lstsq(A, d, rcond=None)[0]
        q = float(d @ d)
        if q <= 0.0:
            return math.inf
        s2 = SIZES[1] ** 2
        needed = math.log(factor) + math.log(len(SIZES) * len(RAMPS)) + 0.5 * math.log1p(s2 * q)
        t2 = 2.0 * needed * (1.0 + s2 * q) / (s2 * q)
        return (math.sqrt(max(t2, 0.0)) + POWER) / math.sqrt(q)


def _log_factors(
    x: np.ndarray, variances: np.ndarray, conditions: np.ndarray, baseline: int, direction: Direction
) -> tuple[np.ndarray, _Rows]:
    """Logarithms of the Bayes factors: after each value, for each beginning, shape and size."""
    need("scipy", "Detecting changes", "identify")
    from scipy.special import log_ndtr, stdtr

    rows = _Rows(x, variances, conditions)
    n, p = rows.columns.shape
    later = np.arange(n)[:, None] - np.arange(baseline, n)[None, :]  # values since the beginning
    out = np.full((n, max(0, n - baseline), len(RAMPS), len(SIZES)), -np.inf)
    inner = np.cumsum(np.einsum("ki,kj->kij", rows.columns, rows.columns), axis=0)
    along = np.cumsum(rows.columns * rows.x[:, None], axis=0)
    squares = np.cumsum(rows.x**2)
    for shape, ramp in enumerate(RAMPS):
        d = np.clip((later + 1.0) / ramp, 0.0, 1.0) * rows.scale[:, None]
        dd, dx = np.cumsum(d * d, axis=0), np.cumsum(d * rows.x[:, None], axis=0)
        dc = np.cumsum(d[:, :, None] * rows.columns[:, None, :], axis=0)
        for k in range(baseline, n):
            of = slice(0, k - baseline + 1)
            inverse = np.linalg.pinv(inner[k], hermitian=True)
            part = dc[k, of] @ inverse
            q = np.maximum(dd[k, of] - np.sum(part * dc[k, of], axis=1), 0.0)
            b = dx[k, of] - part @ along[k]
            R = max(float(squares[k] - along[k] @ inverse @ along[k]), 1e-300)
            freedom = k + 1 - p
            for size, s in enumerate(SIZES):
                shrunk = s**2 / (1.0 + s**2 * q)
                left = np.maximum(1.0 - shrunk * b**2 / R, 1e-300)
                found = -0.5 * np.log1p(s**2 * q) - 0.5 * freedom * np.log(left)
                if direction != "both":
                    t = b * np.sqrt(shrunk) / np.sqrt(R * left / freedom) * (1.0 if direction == "up" else -1.0)
                    tail = np.log(np.maximum(stdtr(freedom, t), 1e-300))
                    found = found + math.log(2.0) + np.where(t > -30.0, tail, log_ndtr(t))
                out[k, of, shape, size] = found
    return out, rows
