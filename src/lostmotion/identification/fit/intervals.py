"""Intervals of identified values: by a block bootstrap, and by the profile of the likelihood."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...errors import need
from .least_squares import Fit, FitProblem, moved, room_of, search, slope_of

RESAMPLES = 2000
CLUSTERS = 5  # logs or conditions, from which on they are drawn as wholes
LEVEL = 0.95
PART_OF_DIRECTION = 1e-4  # of the largest part: a parameter with less has none, but for rounding
CHI_SQUARE = 1.920729  # half the 95 % point of chi-square with one degree of freedom


@dataclass(frozen=True)
class Interval:
    """Interval of 95 % of a value, in SI."""

    low: float
    high: float
    method: str  #: ``bootstrap`` or ``profile``; ``bounds``, where the fit says nothing of the value
    flag: str = ""  #: why the interval may miss the value: the structure of the residuals; empty if these are noise


def bootstrap(problem: FitProblem, fit: Fit, seed: int = 0, hidden: float = 0.0) -> dict[str, Interval]:
    """Intervals from resampled blocks of the residuals, with one Gauss-Newton step for each sample.

    Segments of the gradient of half a second each are drawn with replacement. Lasting errors, such as the errors of
    an incomplete model, widen the interval. It is at least the interval of independent errors: a few blocks say little. With
    `CLUSTERS` logs or more, whole logs are drawn, too, and so are whole conditions of ``fit.leave_out``: errors that
    last through a log widen the interval. With `hidden`, weighted squares of residuals that no noise explains, it is
    wider by all that these can be the effect of. Along the directions that neither logs nor priors determine, the
    parameters go on together until one is at its bound.
    """
    names = list(problem.parameters)
    if not names:
        return {}
    H = fit.normal.copy()
    slopes = np.array([slope_of(problem.parameters[name], fit.point.values[name]) for name in names])
    for k, name in enumerate(names):
        if (deviation := problem.parameters[name].deviation) is not None:
            H[k, k] += (slopes[k] / deviation) ** 2
    blocks = np.vstack(fit.scores)
    blocks = blocks - blocks.mean(axis=0)
    values, vectors = np.linalg.eigh(H)
    weak = values < 1e-8 * max(float(values.max()), 1e-300)
    inverse = vectors[:, ~weak] @ np.diag(1.0 / values[~weak]) @ vectors[:, ~weak].T
    draw = np.random.default_rng(seed)
    steps = _drawn(blocks, draw) @ inverse * math.sqrt(len(blocks) / max(1, len(blocks) - len(names)))
    low, high = np.percentile(steps, [50.0 * (1.0 - LEVEL), 50.0 * (1.0 + LEVEL)], axis=0)
    for clusters in _clusters(problem, fit):
        ends = np.percentile(_drawn(clusters, draw) @ inverse, [50.0 * (1.0 - LEVEL), 50.0 * (1.0 + LEVEL)], axis=0)
        few = _student(len(clusters) - 1) / 1.96 * math.sqrt(len(clusters) / (len(clusters) - 1))
        low, high = np.minimum(low, few * ends[0]), np.maximum(high, few * ends[1])
    normal = 1.96 * np.sqrt(np.diag(inverse))  # of independent errors
    wider = np.sqrt(hidden * np.diag(inverse))
    low, high = np.minimum(low, -normal) - wider, np.maximum(high, normal) + wider
    if weak.any():
        room = [room_of(problem.parameters[name], fit.point.values[name]) for name in names]
        down, up = reach(vectors[:, weak], np.array(room))
        low, high = low + down, high + up
    found = {}
    for k, name in enumerate(names):
        p, value = problem.parameters[name], fit.point.values[name]
        found[name] = Interval(moved(p, value, low[k]), moved(p, value, high[k]), "bootstrap")
    return found


def _drawn(blocks: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    """Sums of as many blocks as there are, drawn with replacement: draws x parameters."""
    count = draw.multinomial(len(blocks), np.full(len(blocks), 1.0 / len(blocks)), size=RESAMPLES)
    return np.asarray(count @ blocks)


def _clusters(problem: FitProblem, fit: Fit) -> list[np.ndarray]:
    """Pieces of the gradient of whole logs, and of the logs of each condition: clusters x parameters, about their mean."""
    of_logs = np.array([score.sum(axis=0) for score in fit.scores])
    found = [of_logs]
    for key in problem.options.leave_out:
        values = [repr(log.facts.get(key)) for log in problem.logs]
        if len(values) == len(of_logs):
            found.append(np.array([of_logs[[v == value for v in values]].sum(axis=0) for value in sorted(set(values))]))
    return [c - c.mean(axis=0) for c in found if len(c) >= CLUSTERS]


def _student(freedom: int) -> float:
    """97.5 % point of Student's t."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.975))


def widest(a: Interval, b: Interval) -> Interval:
    """The interval from the lower of two lower ends to the higher of two higher ones."""
    return replace(a, low=min(a.low, b.low), high=max(a.high, b.high))


def reach(directions: np.ndarray, room: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reach of each parameter, down and up, if all move along some of the directions within their room.

    directions: array (parameters, directions), of scaled parameters.
    room: array (parameters, 2) of the changes that lead to the lower and upper bound; infinite where there is none.
    """
    need("scipy", "Intervals of what logs do not determine", "identify")
    from scipy.optimize import linprog

    none = np.abs(directions) < PART_OF_DIRECTION * np.abs(directions).max(axis=0)
    directions = np.where(none, 0.0, directions)
    sides = np.vstack([directions, -directions])
    limits = np.concatenate([room[:, 1], -room[:, 0]])
    some = np.isfinite(limits)
    ends = np.zeros((2, len(room)))
    for k, row in enumerate(directions):
        if not row.any():
            continue
        for end, sign in enumerate((-1.0, 1.0)):
            best = linprog(
                -sign * row, A_ub=sides[some] if some.any() else None, b_ub=limits[some], bounds=(None, None)
            )
            ends[end, k] = sign * (math.inf if best.fun is None else -best.fun)
    return ends[0], ends[1]


def profile(problem: FitProblem, fit: Fit, name: str, points: int = 3) -> tuple[Interval, list[tuple[float, float]]]:
    """Interval between the values at which the loss, with all other parameters fitted again, has risen as much as at the ends of a 95 % interval.

    Returns tuple: the interval, and (value, rise of the loss) of the points that were fitted.
    """
    p, value = problem.parameters[name], fit.point.values[name]
    names = list(problem.parameters)
    k = names.index(name)
    width = math.sqrt(max(np.linalg.pinv(fit.normal)[k, k], 1e-12))
    others = {n: q for n, q in problem.parameters.items() if n != name}
    rest = replace(problem, parameters=others, given=fit.deviations)
    found = [(value, 0.0)]
    ends = []
    for sign in (-1.0, 1.0):
        reach, last = 2.0 * width, (0.0, 0.0)
        end = p.min if sign < 0.0 else p.max
        for _ in range(points):
            there = moved(p, value, sign * reach)
            start = replace(fit.point, values=fit.point.values | {name: there})
            again = search(rest, start, iterations=3)
            residuals = problem.engine.residuals(problem.logs, again.point, problem.rung)
            before = problem.engine.residuals(problem.logs, fit.point, problem.rung)
            rise = problem.cost(residuals, fit.deviations, again.point, fit.correlation) - problem.cost(
                before, fit.deviations, fit.point, fit.correlation
            )
            found.append((there, rise))
            if rise >= CHI_SQUARE:
                a, b = math.sqrt(max(last[1], 0.0)), math.sqrt(rise)
                share = (math.sqrt(CHI_SQUARE) - a) / max(b - a, 1e-12)
                end = moved(p, value, sign * (last[0] + share * (reach - last[0])))
                break
            if there in (p.min, p.max):
                break
            last, reach = (reach, rise), 2.0 * reach
        ends.append(end)
    return Interval(ends[0], ends[1], "profile"), sorted(found)
