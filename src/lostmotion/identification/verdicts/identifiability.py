"""Unidentifiable parameters in words: the null directions of the scaled Jacobian."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.csgraph import connected_components

from ..fit.least_squares import Fit, FitProblem, slope_of
from ..rig.rig_scenario import Rig
from ..task.free_parameters import FreeParameter
from .suggested_experiments import remedy_for

LOOSE = 1.0  # relative change, of the values in a direction, that 95 % of equally good fits stay within: beyond, it is not determined
PART = 0.25  # of the largest relative change in a direction, from which on a parameter has a part in it
WORTH = 0.02  # relative change of a value, from which on it is named as resting on another
ALIKE = 0.3  # by which relative changes of parameters of one scale may differ
FINITE = 0.3  # relative change of a parameter, by which a sum is told from a product
JOINT = 0.01  # coupling of relative changes of two parameters in the null directions, beyond which they are described together
OPERATORS = {"sum": " + ", "difference": " - ", "product": "*", "ratio": "/"}
SAME = 0.01  # of the change of the runs with one parameter alone, below which they are taken to stay the same
UNSEEN = 1.96  # the same in deviations of the noise


@dataclass(frozen=True)
class Undetermined:
    """A direction in the space of parameters that the logs hardly determine."""

    changes: dict[str, float]  #: relative changes of the parameters along it, the largest 1
    width: float  #: relative change of the largest of them within a 95 % interval; infinite if nothing holds it
    text: str
    directions: int = 1  #: number of directions that the text describes


def undetermined(problem: FitProblem, fit: Fit) -> list[Undetermined]:
    """Directions that the logs alone, without priors, leave wider than the values themselves."""
    parameters = problem.parameters
    names = list(parameters)
    if not names:
        return []
    # Relative changes: of a parameter near 0 its scale stands for its value.
    size = np.array([max(abs(fit.point.values[n]), parameters[n].step) for n in names])
    slopes = np.array([slope_of(parameters[n], fit.point.values[n]) for n in names])
    H = fit.normal * np.outer(size / slopes, size / slopes)
    values, vectors = np.linalg.eigh(H)
    widths = [1.96 / np.sqrt(v) if v > 1e-8 * values.max() else np.inf for v in values]
    loose = [k for k, vector in enumerate(vectors.T) if widths[k] * np.abs(vector).max() >= LOOSE]
    sizes = dict(zip(names, size.tolist(), strict=True))
    if len(loose) == 1:
        return [_one_direction(problem, fit, sizes, vectors[:, loose[0]], widths[loose[0]])]
    found = []
    for together, basis in _apart(vectors[:, loose]):
        held = np.linalg.eigvalsh(basis.T @ H @ basis).min()
        width = 1.96 / np.sqrt(held) if held > 1e-8 * values.max() else np.inf
        if basis.shape[1] == 1:
            found.append(_one_direction(problem, fit, sizes, basis[:, 0], width))
        else:
            own = {n: size for n, size, member in zip(names, size, together, strict=True) if member}
            found.append(_several_directions(problem, fit, own, basis[together], width))
    return found


def _apart(directions: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """(parameters, basis) of the subspaces of null directions that have no parameter in common.

    Any rotation of null directions among themselves is null too, so a decomposition mixes parameters that are independent.
    The projector onto all null directions does not depend on the rotation.
    """
    projector = directions @ directions.T
    _, labels = connected_components(np.abs(projector) > JOINT, directed=False)
    found = []
    for label in np.unique(labels):
        together = labels == label
        shares, vectors = np.linalg.eigh(np.where(np.outer(together, together), projector, 0.0))
        if (shares > 0.5).any():
            found.append((together, vectors[:, shares > 0.5]))
    return found


def _one_direction(
    problem: FitProblem, fit: Fit, sizes: Mapping[str, float], vector: np.ndarray, width: float
) -> Undetermined:
    largest = int(np.argmax(np.abs(vector)))
    whole = {n: float(x / vector[largest]) for n, x in zip(sizes, vector, strict=True)}
    changes = {n: x for n, x in whole.items() if abs(x) >= PART}
    if len(changes) == 1:  # of a small value and a large one, a sum takes a small relative part of the large one
        (own,) = changes
        moves = {n: abs(x) * sizes[n] / sizes[own] for n, x in whole.items() if n != own}
        changes |= {n: whole[n] for n, move in moves.items() if abs(move - 1.0) < ALIKE}
    text = _sentence(problem, fit, changes, sizes)
    return Undetermined(changes, float(width * abs(vector[largest])), text)


def _several_directions(
    problem: FitProblem, fit: Fit, sizes: Mapping[str, float], basis: np.ndarray, width: float
) -> Undetermined:
    """Sentence on several directions of the same parameters, such as the terms of a sum."""
    freedom = dict(zip(sizes, np.linalg.norm(basis, axis=1).tolist(), strict=True))
    names, determined = sorted(freedom, key=lambda n: -freedom[n]), len(freedom) - basis.shape[1]
    listed, what = ", ".join(names), ""
    if determined == 1:
        gradient = dict(zip(sizes, np.linalg.svd(basis)[0][:, -1].tolist(), strict=True))
        what = _determined_of_several(problem, fit, names, gradient, sizes) or f"one combination of {listed}"
    if determined == 0:
        text = f"{listed} are not determined by these logs"
    else:
        text = f"only {what} is determined" if what else f"only {determined} combinations of {listed} are determined"
    text = f"{text}; {remedy_for(problem.engine.rig, names)}"
    return Undetermined(freedom, width * max(freedom.values()), text, basis.shape[1])


def _determined_of_several(
    problem: FitProblem, fit: Fit, names: Sequence[str], gradient: Mapping[str, float], sizes: Mapping[str, float]
) -> str:
    """The only combination of parameters that is determined, found from pairs of them while the others stay.

    names: the one that is most free first.
    gradient: of the combination, in relative changes.
    """
    first, *others = names
    kinds = [
        _determined_of_two(problem, fit, first, n, {first: 1.0, n: -gradient[first] / gradient[n]}, sizes)
        for n in others
        if gradient[n] != 0.0
    ]
    if len(kinds) < len(others) or "" in kinds:
        return ""
    terms = ([first], list[str]())  # with the sign or the power of the first, and those with the other one
    for kind, n in zip(kinds, others, strict=True):
        terms[kind in ("difference", "ratio")].append(n)
    one, other = sorted(terms, key=len, reverse=True)
    if all(kind in ("sum", "difference") for kind in kinds):
        return f"{'' if other else 'the sum '}{' - '.join([' + '.join(one), *other])}"
    if all(kind in ("product", "ratio") for kind in kinds):
        below = "*".join(other)
        return (
            f"{'*'.join(one)}/{f'({below})' if len(other) > 1 else below}" if other else f"the product {'*'.join(one)}"
        )
    return ""


def resting_on(
    rig: Rig, fit: Fit, parameters: Mapping[str, FreeParameter], normal: np.ndarray, name: str
) -> list[Undetermined]:
    """Dependence on the value of a parameter that is not free, if the logs do not determine it to within its scale.

    parameters: the free ones, and this one as the last.
    normal: J'WJ of the scaled parameters.
    """
    names = list(parameters)
    p, given = parameters[name], fit.point.values[name]
    slopes = np.array([slope_of(q, fit.point.values[n]) for n, q in parameters.items()])
    H = normal / np.outer(slopes, slopes)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    H = H * np.outer(scale, scale)
    others = -np.linalg.lstsq(H[:-1, :-1], H[:-1, -1], rcond=1e-10)[0]
    held = float(H[-1, -1] + H[-1, :-1] @ others)
    width = 1.96 * scale[-1] / np.sqrt(held) if held > 1e-10 else np.inf
    if width < p.step:
        return []
    to = given + p.step if given + p.step <= p.max else given - p.step
    moves = dict(zip(names[:-1], others * scale[:-1] / scale[-1] * (to - given), strict=True))
    shares = {
        n: d / fit.point.values[n] for n, d in moves.items() if abs(fit.point.values[n]) > 0.1 * parameters[n].step
    }
    shares = {n: share for n, share in shares.items() if abs(share) >= WORTH}
    if not shares:
        return []
    listed = ", ".join(f"{n} {100.0 * share:+.0f} %" for n, share in sorted(shares.items(), key=lambda x: -abs(x[1])))
    text = (
        f"the values rest on {name} = {p.shown(given)}, which these logs do not tell to within {p.shown(p.step)}: with {p.shown(to)} "
        f"they would be {listed}; {remedy_for(rig, [name])}"
    )
    return [Undetermined({name: 1.0, **shares}, float(width / p.step), text)]


def _sentence(problem: FitProblem, fit: Fit, changes: Mapping[str, float], sizes: Mapping[str, float]) -> str:
    names = sorted(changes, key=lambda n: -abs(changes[n]))
    remedy = remedy_for(problem.engine.rig, names)
    if len(names) == 2 and (what := _determined_of_two(problem, fit, names[0], names[1], changes, sizes)):
        return f"only the {what} {names[0]}{OPERATORS[what]}{names[1]} is determined; {remedy}"
    if len([n for n in names if abs(changes[n]) >= PART]) == 1:
        return f"{names[0]} is not determined by these logs; {remedy_for(problem.engine.rig, names[:1])}"
    if len(names) > 2 and all(abs(changes[n] - 1.0) < ALIKE for n in names):
        return f"{', '.join(names)} have one scale in common, which is not determined, only their ratios are; {remedy}"
    moves = ", ".join(f"{n} {10.0 * changes[n]:+.0f} %" for n in names)
    return f"the logs stay the same if these change together: {moves}; {remedy}"


def _determined_of_two(
    problem: FitProblem, fit: Fit, a: str, b: str, changes: Mapping[str, float], sizes: Mapping[str, float]
) -> str:
    """The kind of combination of two parameters along whose level lines the logs stay the same; empty if it is none of four.

    The null direction is the tangent of such a line. Of values that are alike it does not tell a sum from a product, so runs at the
    end of a finite step along each line do.
    """
    relative = changes[b] / changes[a]
    absolute = relative * sizes[b] / sizes[a]
    x, y = fit.point.values[a], fit.point.values[b]
    lines: dict[str, tuple[float, Callable[[float], float]]] = {
        "sum": (-absolute, lambda d: y - d),
        "difference": (absolute, lambda d: y + d),
        "product": (-relative, lambda d: y * x / (x + d)),
        "ratio": (relative, lambda d: y * (x + d) / x),
    }
    alike = {what: line for what, (tangent, line) in lines.items() if abs(tangent - 1.0) < ALIKE and x != 0.0}
    p, q = problem.parameters[a], problem.parameters[b]
    for d in (FINITE * sizes[a] * sign / 2**k for k in range(4) for sign in (1.0, -1.0)):
        if x + d == 0.0:
            continue
        ends = {what: line(d) for what, line in alike.items()}
        if not (p.min <= x + d <= p.max and all(q.min <= end <= q.max for end in ends.values())):
            continue
        alone = _departure(problem, fit, {a: x + d})
        apart = {what: _departure(problem, fit, {a: x + d, b: end}) for what, end in ends.items()}
        best = min(apart, key=lambda what: apart[what], default="")
        return best if best and apart[best] < max(SAME * alone, min(UNSEEN, 0.2 * alone)) else ""
    return ""


def _departure(problem: FitProblem, fit: Fit, values: Mapping[str, float]) -> float:
    """Root of the summed squares of the differences, in deviations, between runs with some other values and the runs of the fit."""
    there = replace(fit.point, values=fit.point.values | dict(values))
    runs = [problem.engine.residuals(problem.logs, point, problem.rung) for point in (fit.point, there)]
    scale = fit.deviations[:, None]
    total = sum(float(np.sum(((r - s) / scale) ** 2)) for r, s in zip(*runs, strict=True))
    return float(np.sqrt(total)) if np.isfinite(total) else np.inf


def at_bounds(fit: Fit, parameters: Mapping[str, FreeParameter]) -> list[str]:
    """Sentences on parameters that have ended at a bound."""
    found = []
    for name, p in parameters.items():
        value = fit.point.values[name]
        for bound, word in ((p.min, "least"), (p.max, "largest")):
            if abs(value - bound) <= 1e-6 * p.step:
                found.append(
                    f"{name} is at its {word} value {bound:.6g}: the logs would have it beyond, or it has no part in them"
                )
    return found
