"""Whether residuals are those of noise: their size against the stated deviation, their runs and their correlation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .fit import Problem, correlation_of

LARGE = 1.5  # times the stated deviation, from which on residuals are called too large
WIDENED = 1.1  # the same, from which on structured residuals widen the intervals
CORRELATED = 0.2  # lag-one correlation, from which on residuals may have a structure
FEW_RUNS = -6.0  # standard deviations from the number of runs that independent residuals have (Wald and Wolfowitz 1940)
STEPS = 0.6  # steps of the resolution, below which it explains a structure


@dataclass(frozen=True)
class Misfit:
    """Of one measured channel, over all logs that were fitted."""

    channel: str
    rms: float
    """of the residuals, SI"""
    ratio: float
    """to the stated deviation; NaN without one"""
    correlation: float
    """of residuals of two samples in a row"""
    runs: int
    """of residuals of one sign"""
    expected: float
    """runs of as many independent residuals"""
    structured: bool

    @property
    def large(self) -> bool:
        """Whether the residuals are far above the stated deviation."""
        return self.ratio > LARGE

    def text(self, unit: str) -> str:
        """As a sentence."""
        found = []
        if self.large:
            stated = f"{self.rms / self.ratio:.4g} {unit}".rstrip()
            found.append(
                f"residuals of {self.rms:.4g} {unit}".rstrip() + f" are {self.ratio:.3g} times the stated {stated}"
            )
        if self.structured:
            found.append(
                f"residuals are no noise (correlation of neighbours {self.correlation:.2f}, {self.runs} runs of one sign "
                f"instead of {self.expected:.0f})"
            )
        wider = "; the intervals are widened by what such errors can hide" if self.large else ""
        return (
            f"{self.channel}: {' and '.join(found)}: the model lacks something, or this is not the best minimum{wider}"
        )


def misfits(problem: Problem, residuals: Sequence[np.ndarray]) -> list[Misfit]:
    """Of each measured channel."""
    compared = problem.compared(residuals)
    found = []
    for k, name in enumerate(problem.engine.rig.task.measured):
        rows = [r[k] for r in compared]
        rms = math.sqrt(np.nanmean(np.concatenate(rows) ** 2))
        ratio = math.nan if problem.given is None else rms / float(problem.given[k])
        c = correlation_of([row[None] for row in rows])
        rho = (c - 1.0) / (c + 1.0)
        runs, expected, z = _runs(rows)
        quantised = rms < STEPS * problem.resolution[k]
        structured = rho > CORRELATED and z < FEW_RUNS and not quantised
        found.append(Misfit(name, rms, ratio, rho, runs, expected, structured))
    return found


def _runs(rows: Sequence[np.ndarray]) -> tuple[int, float, float]:
    """(runs of one sign, as many as expected, departure in standard deviations)."""
    runs, expected, variance = 0, 0.0, 0.0
    for row in rows:
        above = (x := row[np.isfinite(row)]) > np.median(x)
        n, p = len(above), float(np.sum(above))
        if n < 2 or not 0.0 < p < n:
            continue
        mean = 1.0 + 2.0 * p * (n - p) / n
        runs += 1 + int(np.sum(above[1:] != above[:-1]))
        expected += mean
        variance += (mean - 1.0) * (mean - 2.0) / (n - 1.0)
    return runs, expected, (runs - expected) / math.sqrt(variance) if variance > 0.0 else 0.0


def explained(problem: Problem, residuals: Sequence[np.ndarray]) -> bool:
    """Whether all residuals are noise, of the stated deviations where there are such."""
    return not any(m.ratio > WIDENED or m.structured for m in misfits(problem, residuals))


def hidden(problem: Problem, residuals: Sequence[np.ndarray], found: Sequence[Misfit], correlation: float) -> float:
    """Bound of the weighted squares by which runs of the right values may differ from those found; 0 where noise explains the residuals.

    A change d of what the channels show moves the values by (J'WJ)^-1 J'W d, each by at most sqrt(((J'WJ)^-1)_kk d'Wd) (Cauchy and
    Schwarz). A model that lacks something leaves residuals r at the right values too, so d may be 2 r.
    """
    total = 0.0
    for k, m in enumerate(found):
        if m.ratio > (WIDENED if m.structured else LARGE):
            assert problem.given is not None
            z = np.concatenate([r[k] for r in residuals]) / problem.given[k]
            total += float(np.sum(problem.weights(z) * z**2)) / correlation * (1.0 - 1.0 / m.ratio**2)
    return 4.0 * total
