"""Start values by linear regression of inverse dynamics, as the first stage of a fit (Gautier and Khalil 1990).

The missing torque is linear in what enters linearly through the formulas of `set`: inertia, friction, weight, offset. Its
least squares over measured motions need no run, and no start values that are near.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ..prepared_log import Prepared
from ..rig.inverse_dynamics import Stretch, missing_torque, stretches
from ..rig.measured_motion import ShownMotion, names_of_channel, shown_motion, windows
from ..rig.residuals import Engine, ParameterPoint
from ..rig.rig_scenario import Rig
from ..task.file_formulas import names_in
from ..task.free_parameters import FreeParameter

WIDTHS = (7, 15, 31, 61)  # samples of the filter; the runs say which is best
WINDOW = 2  # of the widest filters: in such windows runs are compared
LINEAR = 1e-6  # relative departure from a straight line
RANK = 1e-6  # of the largest singular value, below which a direction keeps its start
PER_PARAMETER = 3  # blocks


@dataclass(frozen=True)
class Regression:
    """Start values that the regression has replaced, and the reasons for the others."""

    found: Mapping[str, float] = field(default_factory=dict)  # start values by parameter, SI
    kept: Mapping[str, str] = field(default_factory=dict)  # why, by parameter
    why_not: str = ""  # why there is none at all

    def lines(self, parameters: Mapping[str, FreeParameter]) -> list[str]:
        """Lines of text."""
        if self.why_not:
            return [f"start values as given, without a regression of inverse dynamics: {self.why_not}"]
        found = [
            f"{name} = {p.shown(self.found[name])}{f' {p.unit}' if p.unit else ''} in place of {p.shown(p.start)}"
            for name, p in parameters.items()
            if name in self.found
        ]
        lines = [f"start values by regression of inverse dynamics: {', '.join(found)}"]
        for why in dict.fromkeys(self.kept.values()):
            lines.append(f"start values as given of {', '.join(n for n, w in self.kept.items() if w == why)}: {why}")
        return lines


def regressed(
    engine: Engine, logs: Sequence[Prepared], point: ParameterPoint, free: Mapping[str, FreeParameter]
) -> tuple[ParameterPoint, Regression]:
    """Start values of the first candidate model with its free parameters, for logs that are fitted."""
    rig = engine.rig
    try:
        shown = shown_motion(rig)
        judged = _windows_or_logs(rig, logs, point)
        best, report, error = point, Regression(), _error(engine, judged, point)
        refusal, solved = "", False
        for width in WIDTHS:
            try:
                values, kept = _solved(rig, logs, point, free, shown, width)
            except InputError as problem:
                refusal = refusal or str(problem)  # the refusal of the narrowest filter, which has the most samples
                continue
            solved = solved or bool(values)
            there = ParameterPoint({**point.values, **values}, point.nuisance)
            if values and (new := _error(engine, judged, there)) < error:
                best, report, error = there, Regression(values, kept), new
    except InputError as problem:
        return point, Regression(why_not=str(problem))
    if not report.found:
        none = "no free parameter of the first model enters the torques linearly, within its bounds and without a prior"
        report = Regression(
            why_not="the runs of the values given are nearer to the logs" if solved else refusal or none
        )
    return best, report


def _windows_or_logs(rig: Rig, logs: Sequence[Prepared], point: ParameterPoint) -> Sequence[Prepared]:
    """Data for runs: short windows if the state is measured, so that errors do not add up."""
    try:
        length = WINDOW * WIDTHS[-1] * max(log.log.interval for log in logs)
        return windows(rig, logs, point, 0, length)
    except InputError:
        return logs


def _error(engine: Engine, logs: Sequence[Prepared], point: ParameterPoint) -> float:
    """Mean absolute residual in units of the deviations."""
    units = np.array([deviation or 1.0 for deviation in engine.rig.deviations.values()])[:, None]
    rows = [np.abs(r / units).ravel() for r in engine.residuals(logs, point, 0)]
    error = float(np.mean(np.concatenate(rows)))
    return error if np.isfinite(error) else np.inf


def _solved(
    rig: Rig,
    logs: Sequence[Prepared],
    point: ParameterPoint,
    free: Mapping[str, FreeParameter],
    shown: ShownMotion,
    width: int,
) -> tuple[dict[str, float], dict[str, str]]:
    """(values found, why others are not) with one filter. Raises InputError: there is no regression."""
    balance = _Balance(rig, logs, point, shown, width)
    delays = names_in([i.delay for i in rig.task.inputs.values()])
    kept: dict[str, str] = {}
    steps: dict[str, float] = {}
    columns: dict[str, np.ndarray] = {}
    for name, p in free.items():
        if p.deviation is not None:
            kept[name] = "of a prior"
        elif name in delays or name in names_of_channel(rig, shown.channel):
            kept[name] = "of the measurement or of a delay"
        else:
            h = _step(p, point.values[name])
            column, why = balance.column(name, h, steps, columns)
            if column is None:
                kept[name] = why
            elif not np.any(column):
                kept[name] = "the torques of the logs do not depend on them"
            else:
                steps[name], columns[name] = h, column
    if balance.rows < PER_PARAMETER * max(1, len(steps)):
        raise InputError(
            f"the logs have {balance.rows} pieces of motion in one direction; they are too few, or too short"
        )
    while steps:
        names = list(steps)
        A = np.array([columns[n] for n in names]).T
        size = np.linalg.norm(A, axis=0)
        change = np.linalg.lstsq(A / size, -balance.there, rcond=RANK)[0] / size
        values = {n: point.values[n] + d * steps[n] for n, d in zip(names, change.tolist(), strict=True)}
        outside = [
            n for n in names if not free[n].min <= values[n] <= free[n].max or (free[n].logarithmic and values[n] <= 0)
        ]
        if not outside:
            return values, kept
        for n in outside:
            kept[n] = f"the regression gives {free[n].shown(values[n])} for {n}, which is out of its bounds"
            del steps[n], columns[n]
    return {}, kept


def _step(p: FreeParameter, value: float) -> float:
    """A change that stays within the bounds if made twice."""
    size = 0.4 * min(p.step, p.max - p.min)
    return size if value + 2.0 * size <= p.max else -size


class _Balance:
    """The missing torques of all blocks of some logs, at the start and beside it."""

    def __init__(
        self, rig: Rig, logs: Sequence[Prepared], point: ParameterPoint, shown: ShownMotion, width: int
    ) -> None:
        self._rig, self._point, self._shown = rig, point, shown
        self._stretches: list[Stretch] = []
        rows, refused = [], ""
        for log in logs:
            known = {**log.facts, **point.of(log)}
            for s in stretches(rig, log, known, shown, width):
                try:
                    rows.append(missing_torque(rig, s, known, 0, shown))
                    self._stretches.append(s)
                except InputError as problem:
                    refused = str(problem)
        if not rows:
            raise InputError(refused or "the logs have no piece of motion that is long enough and without a pause")
        self.there = np.concatenate(rows)
        self.rows = len(self.there)

    def _change(self, offsets: Mapping[str, float]) -> np.ndarray:
        rows = []
        for s in self._stretches:
            known = {**s.log.facts, **self._point.of(s.log)}
            known |= {name: known[name] + d for name, d in offsets.items()}
            rows.append(missing_torque(self._rig, s, known, 0, self._shown))
        return np.asarray(np.concatenate(rows) - self.there)

    def column(
        self, name: str, h: float, others: Mapping[str, float], columns: Mapping[str, np.ndarray]
    ) -> tuple[np.ndarray | None, str]:
        """(change of the missing torques with a step of a parameter, "") or (None, why it is not linear, alone or with others)."""
        try:
            one, two = self._change({name: h}), self._change({name: 2.0 * h})
            together = self._change({**others, name: h}) if others else one
            size = LINEAR * max(float(np.abs(x).max()) for x in (one, together, 1e-9 * self.there))
            if np.abs(two - 2.0 * one).max() > size:
                return None, "the torques are not linear in them"
            if np.abs(together - one - sum(columns.values())).max() <= size:
                return one, ""
            apart = [n for n in others if np.abs(self._change({n: others[n], name: h}) - one - columns[n]).max() > size]
        except InputError as problem:
            return None, f"a change of them has no torques ({problem})"
        with_them = ", ".join(apart) or "others"
        return None, f"the torques depend on their product with {with_them}, which the regression finds"
