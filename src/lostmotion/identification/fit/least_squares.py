"""Least squares over many logs: Levenberg-Marquardt with a robust loss, bounds, priors, and nuisances of each log."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ..prepared_log import Prepared
from ..rig.residuals import Engine, ParameterPoint
from ..task.file_formulas import number
from ..task.free_parameters import FreeParameter
from ..task.identification_file import FitOptions, free_on

NORMAL = 1.2533  # of the mean of the magnitude of normally distributed errors, to their standard deviation
SMALL = 1e-4  # relative change of the cost at which the search ends, if it comes twice in a row
LARGEST_DAMPING = 1e8


@dataclass
class Fit:
    """Result of a search."""

    point: ParameterPoint
    mae: float  # mean absolute residual, in units of the deviations if the task gives them, else SI
    cost: float  # cost of the logs that were fitted, with priors; half the sum of squares in units of the deviations
    deviations: np.ndarray  # deviations of the residuals, one for each measured channel, SI
    free: tuple[str, ...]
    iterations: int
    history: list[float] = field(default_factory=list)
    normal: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    """J'WJ of the scaled parameters, nuisances eliminated, without priors"""
    scores: list[np.ndarray] = field(default_factory=list)
    """blocks x parameters of each log: parts of the gradient, for the bootstrap"""
    correlation: float = 1.0  # number of residuals in a row that count as one independent


@dataclass
class FitProblem:
    """Problem of a fit: the model and the logs.

    Parameters of the search are ``(value - start)/step``, or of logarithmic ones ``log(value/start)/log(1.1)``.
    """

    engine: Engine
    logs: Sequence[Prepared]
    rung: int
    parameters: Mapping[str, FreeParameter]  # free in this candidate model
    nuisance: Mapping[str, FreeParameter]
    options: FitOptions
    given: np.ndarray | None = None  # deviations of the measured channels, where the task gives them
    resolution: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def deviations(self, residuals: Sequence[np.ndarray]) -> np.ndarray:
        """Standard deviations of the channels: given ones, others from the residuals, and none below the quantisation."""
        if self.given is not None:
            return self.given
        rows = np.hstack([r for r in self.compared(residuals) if np.isfinite(r).any(axis=1).all()])
        spread = NORMAL * np.nanmean(np.abs(rows), axis=1)
        return np.asarray(np.maximum(np.maximum(spread, self.resolution / math.sqrt(12.0)), 1e-12))

    def compared(self, residuals: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Residuals with NaN where the log has no number."""
        return [np.where(log.valid, r, np.nan) for log, r in zip(self.logs, residuals, strict=True)]

    def weights(self, scaled: np.ndarray) -> np.ndarray:
        """Weights of residuals in units of their deviations: 1, and with the robust loss less beyond `outlier`."""
        if self.options.loss == "linear":
            return np.ones_like(scaled)
        size = np.maximum(np.abs(scaled), 1e-300)
        return np.asarray(np.minimum(1.0, self.options.outlier / size))

    def cost(
        self, residuals: Sequence[np.ndarray], deviations: np.ndarray, point: ParameterPoint, correlation: float
    ) -> float:
        """Loss of all residuals, and of the priors."""
        total = 0.0
        for r in residuals:
            z = np.abs(r / deviations[:, None])
            c = self.options.outlier
            if self.options.loss == "huber":
                total += float(np.sum(np.where(z <= c, 0.5 * z**2, c * (z - 0.5 * c))))
            else:
                total += 0.5 * float(np.sum(z**2))
        return total / correlation + self.prior_cost(point)

    def prior_cost(self, point: ParameterPoint) -> float:
        """Half the squares of what departs from priors."""
        total = 0.0
        for name, p in self.parameters.items():
            if p.deviation is not None:
                total += 0.5 * ((point.values[name] - p.start) / p.deviation) ** 2
        for log in self.logs:
            for name, p in self.nuisance.items():
                assert p.deviation is not None
                total += 0.5 * ((point.nuisance[log.name][name] - p.start) / p.deviation) ** 2
        return total


def slope_of(p: FreeParameter, value: float) -> float:
    """Change of the value with the scaled parameter."""
    return value * math.log(1.1) if p.logarithmic else p.step


def moved(p: FreeParameter, value: float, change: float) -> float:
    """The value after a change of the scaled parameter, within its bounds."""
    if math.isinf(change):
        return p.min if change < 0.0 else p.max
    new = value * 1.1 ** min(max(change, -500.0), 500.0) if p.logarithmic else value + p.step * change
    return min(max(new, p.min), p.max)


def room_of(p: FreeParameter, value: float) -> tuple[float, float]:
    """Changes of the scaled parameter that lead to its lower and upper bound."""
    if not p.logarithmic:
        return (p.min - value) / p.step, (p.max - value) / p.step
    low = math.log(p.min / value) / math.log(1.1) if p.min > 0.0 else -math.inf
    return low, math.log(p.max / value) / math.log(1.1)


@dataclass
class _Linear:
    """A linearised problem: H d = -g for the parameters, and what gives the nuisances of each log."""

    H: np.ndarray
    g: np.ndarray
    back: list[tuple[np.ndarray, np.ndarray, np.ndarray]]
    scores: list[np.ndarray]
    normal: np.ndarray


BLOCK = 0.5  # [s] of a block of residuals


def linearised(
    problem: FitProblem,
    point: ParameterPoint,
    residuals: Sequence[np.ndarray],
    deviations: np.ndarray,
    correlation: float,
) -> _Linear:
    """Normal equations with the nuisances of each log eliminated."""
    both = {**problem.parameters, **problem.nuisance}
    n = len(problem.parameters)
    H, g, back, scores = np.zeros((n, n)), np.zeros(n), [], []
    jacobians = problem.engine.jacobians(problem.logs, point, problem.rung, both)
    for log, r, J in zip(problem.logs, residuals, jacobians, strict=True):
        values = point.of(log)
        scale = np.array([slope_of(p, values[name]) for name, p in both.items()])
        z = r / deviations[:, None]
        w = problem.weights(z) / correlation
        A = (J * scale) / deviations[:, None, None]
        WA = A * w[..., None]
        full = np.einsum("cti,ctj->ij", A, WA)
        rates = WA * z[..., None]
        gradient = rates.sum(axis=(0, 1))
        Hpp, Hpn, Hnn = full[:n, :n], full[:n, n:], full[n:, n:].copy()
        gn = gradient[n:].copy()
        for k, (name, p) in enumerate(problem.nuisance.items()):
            assert p.deviation is not None
            Hnn[k, k] += (scale[n + k] / p.deviation) ** 2
            gn[k] += scale[n + k] * (values[name] - p.start) / p.deviation**2
        if problem.nuisance:
            inner = np.linalg.solve(Hnn, np.column_stack([Hpn.T, gn]))
            H += Hpp - Hpn @ inner[:, :n]
            g += gradient[:n] - Hpn @ inner[:, n]
            rates_p = rates[..., :n] - np.einsum("ctk,kn->ctn", rates[..., n:], inner[:, :n])
        else:
            H += Hpp
            g += gradient[:n]
            rates_p = rates
        back.append((Hnn, Hpn, gn))
        count = max(1, round(log.log.duration / BLOCK))
        pieces = np.array_split(rates_p.sum(axis=0), count)
        scores.append(np.array([piece.sum(axis=0) for piece in pieces]))
    normal = H.copy()
    for k, (name, p) in enumerate(problem.parameters.items()):
        if p.deviation is not None:
            s = slope_of(p, point.values[name])
            H[k, k] += (s / p.deviation) ** 2
            g[k] += s * (point.values[name] - p.start) / p.deviation**2
    return _Linear(H, g, back, scores, normal)


def correlation_of(residuals: Sequence[np.ndarray]) -> float:
    """Number of residuals in a row that count as one independent: (1 + rho)/(1 - rho), rho the lag-one correlation.

    NaN stands where there is no residual.
    """
    above = below = 0.0
    for r in residuals:
        centred = r - np.nanmean(r, axis=1, keepdims=True)
        above += float(np.nansum(centred[:, 1:] * centred[:, :-1]))
        below += float(np.nansum(centred**2))
    rho = min(max(above / below if below > 0.0 else 0.0, 0.0), 0.98)
    return (1.0 + rho) / (1.0 - rho)


def search(
    problem: FitProblem,
    start: ParameterPoint,
    *,
    iterations: int = 0,
    notify: Callable[[int, float], None] | None = None,
) -> Fit:
    """Levenberg-Marquardt from a point.

    iterations: 0: as the task says.
    notify: is told the iteration and the cost.
    """
    both = {**problem.parameters, **problem.nuisance}
    residuals = problem.engine.residuals(problem.logs, start, problem.rung, both)
    for name, why in problem.engine.failed.items():
        model = problem.engine.rig.rungs()[problem.rung].name
        raise InputError(
            f'{name}: has no run at the start values of "{model}": {why}; start elsewhere, or leave it out'
        )
    point, damping, history = start, 1e-3, []
    names = list(problem.parameters)
    done = small = 0
    for done in range(1, (iterations or problem.options.iterations) + 1):
        deviations, correlation = problem.deviations(residuals), correlation_of(problem.compared(residuals))
        cost = problem.cost(residuals, deviations, point, correlation)
        history.append(cost)
        if notify is not None:
            notify(done, cost)
        linear = linearised(problem, point, residuals, deviations, correlation)
        better = None
        while damping < LARGEST_DAMPING:
            candidate = _stepped(problem, point, linear, damping)
            found = problem.engine.residuals(problem.logs, candidate, problem.rung, both)
            new = problem.cost(found, deviations, candidate, correlation)
            if math.isfinite(new) and new < cost:
                better = (candidate, found, new)
                break
            damping *= 6.0
        if better is None:
            break
        moved_by = max(
            (abs(better[0].values[n] - point.values[n]) / problem.parameters[n].step for n in names), default=1.0
        )
        point, residuals = better[0], better[1]
        damping = max(damping / 10.0, 1e-9)
        small = small + 1 if cost - better[2] < SMALL * max(cost, 1e-30) else 0
        if small == 2 or moved_by < 1e-5:
            break
    deviations, correlation = problem.deviations(residuals), correlation_of(problem.compared(residuals))
    linear = linearised(problem, point, residuals, deviations, correlation)
    cost = problem.cost(residuals, deviations, point, correlation)
    unit = np.ones(1) if problem.given is None else problem.given
    mae = float(np.nanmean(np.hstack([np.abs(r / unit[:, None]).ravel() for r in problem.compared(residuals)])))
    return Fit(point, mae, cost, deviations, tuple(names), done, history, linear.normal, linear.scores, correlation)


def _stepped(problem: FitProblem, point: ParameterPoint, linear: _Linear, damping: float) -> ParameterPoint:
    """One damped step; parameters whose bound it would pass stay on it, and the others move as if they were given."""
    names, H, g = list(problem.parameters), linear.H, linear.g
    D = np.maximum(np.diag(H), 1e-12 * max(1.0, float(np.max(np.diag(H), initial=0.0))))
    held = np.zeros(len(names), dtype=bool)
    d = np.zeros(len(names))
    for _ in range(len(names) + 1):
        free = ~held
        d[:] = 0.0
        if free.any():
            A = H[np.ix_(free, free)] + damping * np.diag(D[free])
            d[free] = -np.linalg.solve(A, g[free])
        hit = np.zeros(len(names), dtype=bool)
        for k, name in enumerate(names):
            p, value = problem.parameters[name], point.values[name]
            outward = (value <= p.min and d[k] < 0.0) or (value >= p.max and d[k] > 0.0)
            hit[k] = outward and not held[k]
        if not hit.any():
            break
        held |= hit
    values = dict(point.values)
    for k, name in enumerate(names):
        values[name] = moved(problem.parameters[name], values[name], float(d[k]))
    nuisance = {}
    for log, (Hnn, Hpn, gn) in zip(problem.logs, linear.back, strict=True):
        own = dict(point.nuisance.get(log.name, {}))
        if problem.nuisance:
            e = -np.linalg.solve(Hnn, gn + Hpn.T @ d)
            for k, (name, p) in enumerate(problem.nuisance.items()):
                own[name] = moved(p, own[name], float(e[k]))
        nuisance[log.name] = own
    return ParameterPoint(values, {**point.nuisance, **nuisance})


def problem_of(engine: Engine, logs: Sequence[Prepared], rung: int) -> FitProblem:
    """Problem of fitting a candidate model to logs."""
    rig, task = engine.rig, engine.rig.task
    given = list(rig.deviations.values())
    deviations = None if None in given else np.array(given, dtype=float)
    resolution = np.array([number(m.resolution, {}, "measured.resolution") for m in task.measured.values()])
    return FitProblem(engine, logs, rung, free_on(task, rung), task.nuisance, task.fit, deviations, resolution)
