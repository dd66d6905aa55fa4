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

from ...errors import need

SIZES = (1.0, 3.0, 10.0)  # prior standard deviations of a change, relative to the series
RAMPS = (1, 30, 300)  # values within which a change is complete; 1: a step
CONFIRMED = 2  # values in a row with evidence above the limit: one value that is wrong makes no alarm
POWER = 1.2816  # 90 % point of the normal distribution
CREDIBLE = 0.95  # of the instant at which a change began, and of the present value
RECENT = 10  # values at the end; the present value is their mean if nothing changes
LARGEST = 40.0  # deviations of a step, beyond which a series is too short for finding it

Direction = Literal["up", "down", "both"]


@dataclass(frozen=True)
class Present:
    """Present value of a series, of what follows the baseline alone, with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Change:
    """Evidence of a change in a series, and where it began."""

    evidence: np.ndarray  #: after each value; 0 within the baseline
    limit: float  #: from which on the evidence is an alarm
    alarm: int | None  #: index of the value with which the alarm came; None without one
    begins: tuple[int, int, int] | None
    """index at which the change most likely began, and the 95 % credible range; None without an alarm"""
    ramp: int  #: values within which the change is most likely complete; 1 for a step
    deviation: float  #: standard deviation of a value of typical variance around the level of the baseline
    detectable: float
    """step over the last values behind the baseline, ten at most, that would have been found with a probability of 90 %; infinite if
    these are too few for any step"""
    needed: int  #: values behind the baseline from which on a step would be found
    before: float  #: level of the baseline at its mean conditions
    present: tuple[Present, ...]
    """present value at the end, and as it was without the last value; empty without a value behind the baseline"""


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
    """Find a change in a series, whose values are in their order in time.

    variances: relative, of the values.
    conditions: array (values, conditions); a constant is added to them.
    baseline: values at the beginning during which nothing changes; at least two more than conditions and constant.
    false_alarms: largest probability of an alarm without a change in as many values behind the baseline as `within`.
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
    factor = limit * within
    step = rows.detectable(factor, min(RECENT, n - baseline))
    needed = next((m for m in range(2, within + 1) if _rows_of(baseline, m).detectable(factor, m) <= LARGEST), within)
    before, present = _present(x, variances, conditions, baseline, logs, deviation)
    detectable = step * deviation if step <= LARGEST else math.inf
    return Change(evidence, limit, alarm, begins, ramp, deviation, detectable, needed, before, present)


def _present(
    x: np.ndarray, variances: np.ndarray, conditions: np.ndarray, baseline: int, logs: np.ndarray, deviation: float
) -> tuple[float, tuple[Present, ...]]:
    """(level of the baseline, present values).

    Either nothing changes behind the baseline, or a step or a ramp begins at one of the values there. Both have the same prior
    probability, and so has each beginning and shape. Each of these hypotheses has a least squares estimate of the present value with
    the deviation of the baseline. The result is the interval of their mixture.
    """
    centre = conditions[:baseline].mean(axis=0)
    rows = _Rows(x, variances, conditions - centre)
    free = baseline - np.linalg.matrix_rank(rows.columns[:baseline])
    before = float(np.linalg.lstsq(rows.columns[:baseline], rows.x[:baseline], rcond=None)[0][0])
    found = []
    for n in range(len(x), max(baseline, len(x) - CONFIRMED), -1):
        constant = np.zeros(n)
        constant[baseline:] = 1.0
        shapes, weights = [(max(baseline, n - RECENT), constant)], [1.0]
        evidence = np.exp(np.minimum(logs[n - 1, : n - baseline], 600.0)).mean(axis=2) / (n - baseline) / len(RAMPS)
        for j in range(baseline, n):
            for shape, ramp in enumerate(RAMPS):
                shapes.append((0, np.clip((np.arange(n) - j + 1.0) / ramp, 0.0, 1.0)))
                weights.append(float(evidence[j - baseline, shape]))
        estimates = np.array([_at_end(rows, *shape) for shape in shapes])
        likely = np.array(weights) / sum(weights)
        found.append(_mixture(likely, estimates[:, 0], np.maximum(estimates[:, 1] * deviation, 1e-300), int(free)))
    return before, tuple(found)


def _at_end(rows: _Rows, first: int, d: np.ndarray) -> tuple[float, float]:
    """(value at the end at the mean conditions, its deviation relative to the series) if a change has the course d.

    first: first value behind the baseline that is used; the baseline gives the effect of the conditions.
    """
    n = len(d)
    used = (np.arange(n) >= first) | (d == 0.0)
    A = np.column_stack([rows.columns[:n], d * rows.scale[:n]])[used]
    inverse = np.linalg.pinv(A.T @ A, hermitian=True)
    at = np.zeros(A.shape[1])
    at[0], at[-1] = 1.0, d[-1]
    return float(at @ inverse @ A.T @ rows.x[:n][used]), math.sqrt(max(float(at @ inverse @ at), 0.0))


def _mixture(weights: np.ndarray, values: np.ndarray, deviations: np.ndarray, freedom: int) -> Present:
    """Mean and 95 % interval of a mixture of Student's t distributions."""
    from scipy.optimize import brentq
    from scipy.special import stdtr

    def above(x: float, level: float) -> float:
        return float(weights @ stdtr(freedom, (x - values) / deviations)) - level

    reach = 1e3 * deviations.max() + np.ptp(values)
    low, high = float(values.min() - reach), float(values.max() + reach)
    ends = [float(brentq(above, low, high, (level,))) for level in (0.5 * (1.0 - CREDIBLE), 0.5 * (1.0 + CREDIBLE))]
    return Present(float(weights @ values), *ends)


def _rows_of(baseline: int, more: int) -> _Rows:
    """Series of typical values without conditions."""
    n = baseline + more
    return _Rows(np.zeros(n), np.ones(n), np.zeros((n, 0)))


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

    def detectable(self, factor: float, last: int) -> float:
        """Step over the last values, in deviations, that is found with 90 %; infinite if no step is.

        An alarm needs evidence at two values in a row. So the evidence without the last value must be above the limit already.
        The change adds ``b^2/q`` to the squares R. Therefore the evidence of a series of finite length is bounded. The other squares,
        which are a chi-square, are taken at their 90 % point as well.
        """
        from scipy.special import chdtri

        n = len(self.x) - CONFIRMED + 1
        A = self.columns[:n]
        d = np.where(np.arange(n) >= len(self.x) - last, self.scale[:n], 0.0)
        d = d - A @ np.linalg.lstsq(A, d, rcond=None)[0]
        q, freedom = float(d @ d), n - np.linalg.matrix_rank(A)
        if last < CONFIRMED or freedom < 2 or q <= 1e-9:
            return math.inf
        found = [math.inf]
        for s2 in (s**2 for s in SIZES):
            needed = math.log(factor) + math.log(len(SIZES) * len(RAMPS)) + 0.5 * math.log1p(s2 * q)
            share = -math.expm1(-2.0 * needed / freedom)
            gained = s2 / (1.0 + s2 * q) - share / q
            if gained > 0.0:
                found.append(math.sqrt(share * chdtri(freedom - 1, 0.1) / gained) / q + POWER / math.sqrt(q))
        return min(found)


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
            begins = slice(0, k - baseline + 1)
            inverse = np.linalg.pinv(inner[k], hermitian=True)
            part = dc[k, begins] @ inverse
            q = np.maximum(dd[k, begins] - np.sum(part * dc[k, begins], axis=1), 0.0)
            b = dx[k, begins] - part @ along[k]
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
                out[k, begins, shape, size] = found
    return out, rows
