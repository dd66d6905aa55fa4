"""The page of a monitor: trends with intervals, the evidence of changes, and the values that each log determines."""

import math
from typing import Any

import numpy as np

from ..identification.monitor.monitor import MonitorResult
from ..identification.monitor.trends import RESIDUAL, Watched
from ..identification.task.free_parameters import in_unit
from ..units.conversion import si_factor
from ..units.practical import printed
from .figure_style import FAINT, PALETTE, dots
from .page import Prose, Report, Table
from .panels import Curve, Group, Panel
from .written_files import table_csv

VALUES, BEGIN = dots(PALETTE["first"], 5.0), dots(PALETTE["second"], 9.0)
INTERVAL: dict[str, Any] = {"color": PALETTE["first"], "linestyle": "-", "linewidth": 1.2, "alpha": 0.6}
LIMIT: dict[str, Any] = {"color": PALETTE["second"], "linestyle": "--", "linewidth": 1.5}
EVIDENCE: dict[str, Any] = {"color": PALETTE["first"], "linestyle": "-", "linewidth": 1.6}
LEAST = 1e-4  # evidence, below which it is not drawn
LOGS = ("log", "order", "residual", "determined values", "reason for leaving it out")
VALUES_OF_LOGS = ("log", "place", "residual", "parameter", "value", "low", "high", "told")
WATCHED = ("value", "baseline", "now", "from", "to", "unit", "change", "limit")


def monitor_report(name: str, result: MonitorResult) -> Report:
    """The page of a monitor."""
    watched = list(result.watched.values())
    marked = frozenset(k for k, w in enumerate(watched) if w.alarm)
    rows = [[e.log, f"{e.at:g}", f"{e.residual:.3g}", ", ".join(sorted(e.told)) or "none", e.why] for e in result.logs]
    unused = frozenset(k for k, e in enumerate(result.logs) if e.why)
    table = [_row(result, w) for w in watched]
    left_out = [list(pair) for pair in result.left_out.items()]
    return Report(
        title=result.task.title or name,
        lead=f"{result.lines()[0]}.",
        verdict=result.verdict,
        main=Group("trends", "Trends", TRENDS, tuple(_trend(result, w) for w in watched)),
        parts=(
            Table("Watched values", WATCHED, table, BLANK, marked),
            Prose("Findings", [w.text for w in watched], listed=True),
            Group(
                "evidence",
                "Evidence of a change",
                EVIDENCES,
                tuple(_evidence(result, w) for w in watched if w.change is not None),
            ),
            Table("Logs", LOGS, rows, TELLS, unused),
            Table("Logs that are left out", ("log", "reason"), left_out),
        ),
        file="monitor.html",
        tables={"values.csv": table_csv(VALUES_OF_LOGS, _values(result)), "watched.csv": table_csv(WATCHED, table)},
    )


BLANK = "A blank cell means that too few logs of the baseline determine the value, or that it has no unit."
TRENDS = "Estimate of each log with its 95 % interval. Dashed: limits. The large point is the log at which a change most likely began."
EVIDENCES = (
    "Bayes factor of a change, averaged over its beginning, its size and its shape. An alarm is evidence above the line with two logs "
    "in a row; the line is the reciprocal of the permitted probability of a false alarm."
)
TELLS = (
    "A log determines a value if the interval from this log alone is narrower than half of the value. Other logs are left out of its trend. "
    "Residuals are relative to those of the baseline. A blank reason means that the log is used."
)


def _row(result: MonitorResult, w: Watched) -> list[str]:
    """A watched value as text."""
    p = result.task.parameters.get(w.name)

    def shown(value: float) -> str:
        return f"{value:.4g}" if p is None else p.shown(value)

    unit = printed(w.unit)
    if w.level is None or w.change is None:
        return [w.name, "", "", "", "", unit, "not decided", "not decided"]
    change = "none" if math.isfinite(w.change.detectable) else "not decided"
    if w.begins is not None:
        change = f"since {result.logs[w.begins].log}"
    limit = {True: "beyond", False: "within", None: "not decided"}[w.beyond]
    if p is None or w.name not in result.task.monitor.watch or not _limits(result, w):
        limit = "none given"
    return [w.name, shown(w.before), shown(w.now), shown(w.level.low), shown(w.level.high), unit, change, limit]


def _values(result: MonitorResult) -> list[list[str]]:
    """Estimates of all logs, SI."""
    return [
        [
            e.log,
            f"{e.at:g}",
            f"{e.residual:.6g}",
            name,
            f"{value:.9g}",
            f"{e.intervals[name].low:.9g}",
            f"{e.intervals[name].high:.9g}",
            "yes" if name in e.told else "no",
        ]
        for e in result.logs
        for name, value in e.values.items()
    ]


def _limits(result: MonitorResult, w: Watched) -> list[float]:
    """Limits of a watched value in its unit."""
    watch = result.task.monitor.watch.get(w.name)
    found = [] if watch is None else [in_unit(x, w.unit, w.name) for x in (watch.min, watch.max)]
    return [x / si_factor(w.unit) for x in found if x is not None]


def _trend(result: MonitorResult, w: Watched) -> Panel:
    place = result.task.monitor.order or "log"
    logs = [result.logs[k] for k in w.logs]
    at = np.array([e.at for e in logs])
    if w.name == RESIDUAL:
        y = np.array([e.residual for e in logs])
        curves = [Curve("residual", at, y, VALUES)]
        label = "residual [baseline = 1]"
    else:
        unit = si_factor(w.unit)
        y = np.array([e.values[w.name] for e in logs]) / unit
        intervals = [e.intervals[w.name] for e in logs]
        ends = np.array([[i.low / unit, i.high / unit, math.nan] for i in intervals]).ravel()
        curves = [Curve("value", at, y, VALUES), Curve("interval", np.repeat(at, 3), ends, INTERVAL, "95 %")]
        label = f"{w.name} [{printed(w.unit) or '-'}]"
    first, last = min(e.at for e in result.logs), max(e.at for e in result.logs)
    span = np.array([first, last]) + 0.02 * (last - first) * np.array([-1.0, 1.0])
    curves += [Curve(f"limit {x:g}", span, np.full(2, x), LIMIT) for x in _limits(result, w)]
    if w.begins is not None:
        k = w.logs.index(w.begins)
        curves.append(Curve(f"change since {result.logs[w.begins].log}", at[[k]], y[[k]], BEGIN))
    x_range = (float(span[0]), float(span[1])) if last > first else None
    return Panel(w.name, place, label, tuple(curves), x_range=x_range)


def _evidence(result: MonitorResult, w: Watched) -> Panel:
    assert w.change is not None
    at = np.array([result.logs[k].at for k in w.logs])
    curves = (
        Curve("evidence", at, np.maximum(w.change.evidence, LEAST), EVIDENCE),
        Curve("alarm", at[[0, -1]], np.full(2, w.change.limit), FAINT),
    )
    return Panel(w.name, result.task.monitor.order or "log", "evidence [-]", curves, log_y=True)
