"""Whether residuals are noise: their size against the stated deviation, their runs, their correlation and their shape."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..fit.least_squares import FitProblem, correlation_of
from ..rig.residuals import ParameterPoint
from ..rig.rig_runs import run_logs
from ..rig.rig_scenario import Rig

LARGE = 1.5  # times the stated deviation, from which on residuals are called too large
WIDENED = 1.1  # the same, from which on structured residuals widen the intervals
CORRELATED = 0.2  # lag-one correlation, from which on residuals may have a structure
FEW_RUNS = -6.0  # standard deviations from the number of runs that independent residuals have (Wald and Wolfowitz 1940)
STEPS = 0.6  # steps of the resolution, below which it explains a structure
BINS = 12  # of equal numbers of samples, whose means are a shape
SHARE = 0.1  # of the variance of residuals, from which on a shape over a variable is named
WIDTHS = (15, 61)  # samples of the filters of derivatives
CHANCE = 1e-4  # probability of such a shape by chance, up to which it is named


@dataclass(frozen=True)
class Misfit:
    """Misfit of one measured channel, over all fitted logs."""

    channel: str
    rms: float  # rms of the residuals, SI
    ratio: float  # to the stated deviation; NaN without one
    correlation: float  # correlation of residuals of two samples in a row
    runs: int  # number of runs of residuals of one sign
    expected: float  # runs of as many independent residuals
    structured: bool
    shapes: tuple[tuple[str, float], ...] = ()
    """variables over which the residuals have a shape, and its share of their variance, the largest first"""

    @property
    def shape(self) -> str:
        """The shapes in words; empty without one."""
        return " and ".join(f"{name} ({share:.0%})" for name, share in self.shapes)

    @property
    def large(self) -> bool:
        """Whether the residuals are far above the stated deviation."""
        return self.ratio > LARGE

    def text(self, unit: str, factor: float) -> str:
        """Misfit as a sentence, with errors in a unit; one SI unit has so many of it."""
        found, rms = [], factor * self.rms
        if self.large:
            stated = f"{rms / self.ratio:.4g} {unit}".rstrip()
            found.append(f"residuals of {rms:.4g} {unit}".rstrip() + f" are {self.ratio:.3g} times the stated {stated}")
        if self.structured:
            found.append(
                f"the errors are not random, so that true values may lie outside their intervals (correlation of neighbours "
                f"{self.correlation:.2f}, {self.runs} runs of one sign instead of {self.expected:.0f})"
                + (f" and have a shape over {self.shape}" if self.shapes else "")
            )
        wider = "; the intervals are widened by what such errors can hide" if self.large else ""
        return (
            f"{self.channel}: {' and '.join(found)}: the model lacks something, or this is not the best minimum{wider}"
        )


def misfits(problem: FitProblem, residuals: Sequence[np.ndarray]) -> list[Misfit]:
    """Misfits of all measured channels."""
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


def with_shapes(
    problem: FitProblem, point: ParameterPoint, residuals: Sequence[np.ndarray], found: Sequence[Misfit]
) -> list[Misfit]:
    """Adds the variables over which structured residuals have a shape: time, and speed, angle and load of the rig."""
    if not any(m.structured for m in found):
        return list(found)
    variables = shape_variables(problem.engine.rig)
    requests = [(log, point.of(log)) for log in problem.logs]
    seen = run_logs(
        problem.engine.rig, requests, problem.rung, extra=tuple(variables.values()), threads=problem.engine.threads
    )
    courses = {"time": np.concatenate([log.time for log in problem.logs])}
    for name, variable in variables.items():
        courses[name] = np.concatenate(
            [
                run.extra.get(variable, np.full(len(log.time), np.nan))
                for log, run in zip(problem.logs, seen, strict=True)
            ]
        )
    out = []
    for k, m in enumerate(found):
        rows = [row[k] for row in problem.compared(residuals)]
        shares = dict.fromkeys(courses, 0.0)
        for r, independent in _with_derivatives(rows, m) if m.structured else ():
            for name, x in courses.items():
                shares[name] = max(shares[name], _share_over(x, r, independent))
        named = sorted(((n, share) for n, share in shares.items() if share > 0.0), key=lambda pair: -pair[1])
        out.append(replace(m, shapes=tuple(named)))
    return out


def _with_derivatives(rows: Sequence[np.ndarray], m: Misfit) -> list[tuple[np.ndarray, float]]:
    """(residuals of all logs, number of independent ones): as they are, and their first and second derivatives by filters.

    A torque that the model lacks is a function of speed, load or angle. In a residual of an angle it is summed up twice.
    """
    r = np.concatenate(rows)
    found = [(r, np.isfinite(r).sum() * (1.0 - m.correlation) / (1.0 + m.correlation))]
    for order in (1, 2):
        for width in WIDTHS:
            filtered = [_derivative(x, width, order) for x in rows]
            r = np.concatenate(filtered)
            found.append((r, np.isfinite(r).sum() / width))
    return found


def _derivative(x: np.ndarray, width: int, order: int) -> np.ndarray:
    """Derivative by samples, from local cubics; NaN where there is not a number, and near the ends."""
    from scipy.signal import savgol_filter

    there = np.isfinite(x)
    if len(x) < 3 * width or there.sum() < 0.5 * len(x):
        return np.full(len(x), np.nan)
    at = np.arange(len(x))
    found = savgol_filter(np.interp(at, at[there], x[there]), width, 3, deriv=order)
    found[~there] = np.nan
    found[: width // 2] = found[-(width // 2) :] = np.nan
    return np.asarray(found)


def shape_variables(rig: Rig) -> dict[str, str]:
    """Variables of the rig over which residuals are looked at: speed and angle of the first measured shaft, and loads of gears."""
    train, measured = rig.scenario.train(), next(iter(rig.task.measured.values())).variable
    shaft = train.shaft_of(measured, "angle", "speed")
    found = {quantity: train.variable(shaft, quantity) for quantity in ("speed", "angle")}
    for gear in train.gears:
        found["load" if len(train.gears) == 1 else f"load of {gear}"] = train.variable(gear, "output_torque")
    return {name: variable for name, variable in found.items() if variable in rig.units}


def _share_over(x: np.ndarray, r: np.ndarray, independent: float) -> float:
    """Share of the variance of residuals that the means over classes of a variable have; 0 if chance explains it.

    independent: number of independent residuals.
    """
    from scipy.stats import f

    there = np.isfinite(x) & np.isfinite(r)
    x, r = x[there], r[there]
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1))) if len(x) else np.zeros(0)
    classes = len(edges) - 1
    if classes < 2 or independent <= classes + 1:
        return 0.0
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, classes - 1)
    counts = np.maximum(np.bincount(which, minlength=classes), 1)
    means = np.bincount(which, weights=r, minlength=classes) / counts
    share = float(np.sum(counts * (means - r.mean()) ** 2) / max(np.sum((r - r.mean()) ** 2), 1e-300))
    ratio = share / (classes - 1) / max((1.0 - share) / (independent - classes), 1e-300)
    return share if share >= SHARE and f.sf(ratio, classes - 1, independent - classes) < CHANCE else 0.0


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


def explained(problem: FitProblem, residuals: Sequence[np.ndarray]) -> bool:
    """Whether all residuals are noise, of the stated deviations where there are such."""
    return not any(m.ratio > WIDENED or m.structured for m in misfits(problem, residuals))


def hidden(problem: FitProblem, residuals: Sequence[np.ndarray], found: Sequence[Misfit], correlation: float) -> float:
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
