"""Runs of a study that fit the task, the best of them, and the price of each limit."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...sizing.axis_task.mass_and_price import CHOICE
from ...units.practical import practical, share_of_limit, told_apart
from ..runs.read_table import unit_of
from ..study.drive_check_columns import BETWEEN, ESTIMATED, MISSING, NO_DATA, UNSTABLE
from ..study.records_that_vary import shown_name
from ..study.select_table import TASK_SHARES, USE, Selection
from ..study.study_definition import Study

if TYPE_CHECKING:
    import pyarrow as pa

WINDOW = "settling_window"
"""stands for the limit of a settling time that has no end: by how much the load rests beyond the window"""
NOT_RUN = "cannot be run"  # stands among the limits of a run that has failed


@dataclass(frozen=True)
class RankedCandidate:
    """One run of a study that selects."""

    run: int
    name: str  # varied values as text
    violated: tuple[str, ...]  # rules of the drive check, columns with a limit, or `NOT_RUN`
    why: str
    not_judged: str  # rules of the drive check that have no limit to compare with
    values: dict[str, float]  # values of the objectives
    tightest: str = ""  # the rule of the drive check whose limit is used most, and its share
    ran: bool = True  # whether it was run: of a task, runs that the rules refuse are not
    estimated: str = ""  # verdict over the range of losses, if the gearbox of a task has estimated ones
    choice: dict[str, float] = field(default_factory=dict)
    """mass, length, price and lead time of the pair of a task, as far as they are known"""
    missing: tuple[str, ...] = ()
    """rules of a task that are not judged, each with the datum that is missing, or what its records lack for a run"""
    over: dict[str, float] = field(default_factory=dict)
    """by limit: by how much it is exceeded, as a share of the limit, where that is a number"""

    @property
    def fits(self) -> bool:
        """Whether it keeps all limits."""
        return not self.violated

    @property
    def open(self) -> bool:
        """Whether it cannot be judged: data are missing, its run has failed, or its loop with gains by rule is unstable."""
        return NOT_RUN in self.violated or NO_DATA in self.violated or self.why.startswith(UNSTABLE)


@dataclass(frozen=True)
class Price:
    """Price of one limit."""

    limit: str
    excludes: int  # runs that violate it
    alone: int  # runs that violate it and nothing else
    best: RankedCandidate | None  # the best that would fit without it
    opens: float
    """by how much, as a share of the limit, the limit would have to be relaxed so that one more candidate fits; NaN where it is not known"""
    gain: float
    """by how much the first objective would then be better, as a share of its value now; NaN where there is no such value"""
    rests: float = math.nan
    """least distance of a resting load beyond the settling window, as a share of the window; NaN if a load settles"""


def candidates(table: pa.Table, study: Study) -> list[RankedCandidate]:
    """Rank the runs of a study that selects. Runs that fit come first, then runs that violate one limit, two, ...,
    each from the best to the worst. Runs that failed come last.
    """
    select = study.select
    if select is None:
        raise ValueError("this study does not select; give it a table [select]")
    bounds = {column: b.in_unit(unit_of(table, column)) for column, b in select.limits.items()}
    found = [_candidate(row, study, select, bounds) for row in table.to_pylist()]
    return sorted(found, key=lambda c: (NOT_RUN in c.violated, len(c.violated), _rank(c, select), c.run))


def _rank(candidate: RankedCandidate, select: Selection) -> tuple[float, ...]:
    values = (select.direction(column) * value for column, value in candidate.values.items())
    return tuple(math.inf if math.isnan(v) else v for v in values)


def _candidate(
    row: dict[str, Any], study: Study, select: Selection, bounds: dict[str, tuple[float, float]]
) -> RankedCandidate:
    values = {column: float(row[column]) for column in select.objectives}
    name = _name(row, study)
    choice = {column: float(row[column]) for column in CHOICE if math.isfinite(row.get(column, math.nan))}
    if row["error"]:
        return RankedCandidate(row["run"], name, (NOT_RUN,), row["error"], "", values)
    violated, why = row.get("violated", "").split(), [row["why"]] if row.get("why") else []
    over = {rule: use - 1.0 for rule in violated if math.isfinite(use := row.get(f"{USE}{rule}", math.nan))}
    missing = tuple(filter(None, row.get(MISSING, "").split(BETWEEN)))
    ran, tightest = study.axis is None or not math.isnan(row["cycles"]), ""  # a task refuses some before any run
    if ran:
        for column, bound in bounds.items():
            if bound[0] <= row[column] <= bound[1]:
                continue
            found, excess = _beyond(column, row, bound, study)
            violated.append(column)
            why.append(found)
            over |= excess
        for column in (column for column, value in values.items() if math.isnan(value)):
            violated.append(column)
            why.append(f"{column} has no value")
        uses = {rule: use for rule in TASK_SHARES if math.isfinite(use := row.get(f"{USE}{rule}", math.nan))}
        uses = {rule: use for rule, use in uses.items() if use <= 1.0 or rule in violated}  # else a recommendation
        critical = max(uses, key=lambda rule: uses[rule], default="")
        tightest = f"{critical} {share_of_limit(uses[critical])}" if critical else ""
    return RankedCandidate(
        run=row["run"],
        name=name,
        violated=tuple(violated),
        why="; ".join(why),
        not_judged=row.get("not judged", ""),
        values=values,
        tightest=tightest,
        ran=ran,
        estimated=row.get(ESTIMATED, ""),
        choice=choice,
        missing=missing,
        over=over,
    )


def _name(row: dict[str, Any], study: Study) -> str:
    """Varied values of a run as text."""
    shown = [
        shown_name(row[v.title]) if v.names is not None else f"{v.title} {row[v.title]:.6g}"
        for v in study.vary
        if v.names is not None or math.isfinite(row[v.title])
    ]
    return ", ".join(filter(None, shown)) or "motor and gearbox of the task"


def _beyond(column: str, row: dict[str, Any], bound: tuple[float, float], study: Study) -> tuple[str, dict[str, float]]:
    """Why a value is beyond its limits, and by how much, as a share of the limit."""
    value, limit = row[column], bound[1] if row[column] > bound[1] else bound[0]
    if column == "settling_time" and value == math.inf:
        assert study.axis is not None
        window, unit = study.axis.settling_window, study.kept_units["rest_error"]
        assert window is not None
        rests, wide = (practical(x, unit, 4) for x in (row["rest_error"], window))
        why = f"settling_time: the load does not settle before the next move; it rests {rests} off, with a window of {wide}"
        return why, {WINDOW: row["rest_error"] / window - 1.0}
    unit = study.kept_units.get(column, "") if study.axis is not None else ""
    found, most = told_apart(value, limit, show=lambda x, digits: practical(x, unit, digits), digits=6)
    why = f"{column} {found} is {'above' if value > bound[1] else 'below'} {most}"
    return why, _excess(column, value, *bound)


def _excess(column: str, value: float, low: float, high: float) -> dict[str, float]:
    """Distance of a value beyond its bounds, as a share of the violated bound."""
    bound = high if value > high else low
    share = abs(value - bound) / abs(bound) if bound != 0.0 else math.inf
    return {column: share} if math.isfinite(share) else {}


def prices(ranked: list[RankedCandidate], select: Selection) -> list[Price]:
    """Price of each limit that some run violates, the most critical first.

    ranked: from `candidates`.
    """
    objective = next(iter(select.objectives))
    best = next((c for c in ranked if c.fits), None)
    limits = dict.fromkeys(limit for c in ranked for limit in c.violated if limit != NOT_RUN)
    out = []
    for limit in limits:
        alone = [c for c in ranked if set(c.violated) == {limit}]
        known = [c for c in alone if c.ran and not math.isnan(c.values[objective])]
        without = min(known + ([best] if best else []), key=lambda c: _rank(c, select), default=None)
        gain = math.nan
        if best is not None and without is not None and best.values[objective] != 0.0:
            better = select.direction(objective) * (best.values[objective] - without.values[objective])
            gain = better / abs(best.values[objective])
        excluded = sum(limit in c.violated for c in ranked)
        opens = min((c.over.get(limit, math.nan) for c in alone), default=math.nan)
        rests = [c.over.get(WINDOW, math.nan) for c in alone] if limit == "settling_time" else []
        least = min(rests) if rests and not any(map(math.isnan, rests)) else math.nan
        out.append(Price(limit, excluded, len(alone), without, opens, gain, least))
    return sorted(out, key=lambda p: -p.excludes)


def pareto_front(ranked: list[RankedCandidate], select: Selection) -> list[RankedCandidate]:
    """Runs that fit, such that no other fitting run is better in one objective without being worse in another."""
    fitting = [c for c in ranked if c.fits]
    ranks = np.array([_rank(c, select) for c in fitting]).reshape(len(fitting), len(select.objectives))
    better = [(ranks <= rank).all(axis=1) & (ranks < rank).any(axis=1) for rank in ranks]
    return [c for c, others in zip(fitting, better, strict=True) if not others.any()]
