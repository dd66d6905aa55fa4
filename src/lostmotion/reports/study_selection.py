"""The selection of a study as text, tables and a Pareto plot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from ..studies.select import SHARES, USE, Selection
from ..studies.selection import NOT_RUN, Candidate, Price, candidates, pareto_front, prices
from ..studies.study import Study
from ..studies.table import labelled
from .pages import save_figure, table_csv, write_text
from .panels import STYLES
from .plots import Picture, in_our_looks

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure

INK, ACCENT = STYLES["2-DOF-NL"]["color"], STYLES["2-DOF-L"]["color"]
MAX_LINES = 10  # lines of each list that are printed; selection.csv has all
MAX_NAMES = 12  # along the front of the plot


def show_selection(table: pa.Table, study: Study, view: Path) -> list[str]:
    """Writes selection.csv, limits.csv and, with two objectives, the Pareto plot; returns what to print."""
    select = study.select
    assert select is not None
    ranked = candidates(table, study)
    costs, front = prices(ranked, select), pareto_front(ranked, select)
    write_text(view / "selection.csv", _selection_csv(table, study, ranked, front))
    objective = next(iter(select.objectives))
    header = ["limit", "excludes", "alone", "best without it", objective, "gain"]
    rows = [
        [
            p.limit,
            p.excludes,
            p.alone,
            p.best.name if p.best else "",
            p.best.values[objective] if p.best else "",
            p.gain,
        ]
        for p in costs
    ]
    write_text(view / "limits.csv", table_csv(header, rows))
    if len(select.objectives) > 1:
        save_figure(pareto_figure(table, ranked, front, select), view, "pareto")
    return [*_ranking(table, ranked, front, select), *_costs(table, costs, objective), *_misfits(ranked)]


def _selection_csv(table: pa.Table, study: Study, ranked: list[Candidate], front: list[Candidate]) -> str:
    """One row a run: rank, what varies, whether and why it fits, and all its numbers."""
    uses = [f"{USE}{rule}" for rule in SHARES if f"{USE}{rule}" in table.column_names]
    names = [*(v.title for v in study.vary), *study.kept_units, *uses]
    rows, on_front = [], {c.run for c in front}
    by_run = {row["run"]: row for row in table.to_pylist()}
    for rank, c in enumerate(ranked, 1):
        own = by_run[c.run]
        said = ["yes" if c.fits else "no", "yes" if c.run in on_front else "no"]
        limits = [c.tightest, " ".join(c.violated), c.why, c.not_judged]
        rows.append([rank, c.run, *said, *limits, *(own[name] for name in names)])
    header = ["rank", "run", "fits", "Pareto front", "tightest limit", "violated", "why", "not judged"]
    return table_csv([*header, *(labelled(table, name) for name in names)], rows)


def _ranking(table: pa.Table, ranked: list[Candidate], front: list[Candidate], select: Selection) -> list[str]:
    fitting = [c for c in ranked if c.fits]
    failed = sum(NOT_RUN in c.violated for c in ranked)
    lines = [f"Selection: {len(fitting)} of {len(ranked)} fit" + (f", {failed} cannot be run" if failed else "")]
    if not fitting:
        return lines
    width = max(len(c.name) for c in fitting[:MAX_LINES]) + 2
    titles = [f"{labelled(table, column)}, {direction}" for column, direction in select.objectives.items()]
    columns = [max(12, len(title) + 2) for title in titles]
    lines.append(" " * (width + 2) + "".join(t.rjust(w) for t, w in zip(titles, columns, strict=True)))
    on_front = {c.run for c in front}
    for c in fitting[:MAX_LINES]:
        values = "".join(f"{v:.5g}".rjust(w) for v, w in zip(c.values.values(), columns, strict=True))
        notes = ["Pareto front"] if len(select.objectives) > 1 and c.run in on_front else []
        notes += [f"tightest: {c.tightest}"] if c.tightest else []
        notes += [f"not judged: {c.not_judged}"] if c.not_judged else []
        lines.append(f"  {c.name.ljust(width)}{values}" + (f"  ({'; '.join(notes)})" if notes else ""))
    if len(fitting) > MAX_LINES:
        lines.append(f"  and {len(fitting) - MAX_LINES} more, see selection.csv")
    return lines


def _costs(table: pa.Table, costs: list[Price], objective: str) -> list[str]:
    if not costs:
        return []
    width = max(len(p.limit) for p in costs) + 2
    lines = ["What each limit costs:", "  " + "limit".ljust(width) + "  excludes  of these alone  best without it"]
    for p in costs:
        best = "nothing more fits"
        if p.best is not None and p.alone:
            best = f"{p.best.name}, {labelled(table, objective)} {p.best.values[objective]:.5g}"
            if math.isfinite(p.gain):
                best += f" ({100.0 * p.gain:.1f} % better)" if p.gain > 0.0 else " (as now)"
        lines.append(f"  {p.limit.ljust(width)}{p.excludes:>10}{p.alone:>16}  {best}")
    return lines


def _misfits(ranked: list[Candidate]) -> list[str]:
    out = [c for c in ranked if not c.fits]
    lines = ["Why the others do not fit:"] if out else []
    lines += [f"  {c.name}: {c.why}" for c in out[:MAX_LINES]]
    return [*lines, f"  and {len(out) - MAX_LINES} more, see selection.csv"] if len(out) > MAX_LINES else lines


@in_our_looks
def pareto_figure(table: pa.Table, ranked: list[Candidate], front: list[Candidate], select: Selection) -> Figure:
    """The first two objectives of all runs: those that fit, those that do not, and the front of those that fit."""
    x, y = list(select.objectives)[:2]
    figure = Picture(figsize=(6.4, 4.4))
    axes = figure.add_subplot()
    groups = (
        ([c for c in ranked if not c.fits], {"marker": "x", "color": "0.6", "label": "does not fit"}),
        ([c for c in ranked if c.fits], {"marker": "o", "color": INK, "label": "fits"}),
    )
    for group, style in groups:
        axes.plot([c.values[x] for c in group], [c.values[y] for c in group], linestyle="", markersize=4, **style)
    ordered = sorted(front, key=lambda c: c.values[x])
    axes.plot([c.values[x] for c in ordered], [c.values[y] for c in ordered], color=ACCENT, label="Pareto front")
    for c in ordered[:MAX_NAMES]:
        point = (c.values[x], c.values[y])
        axes.annotate(c.name, point, textcoords="offset points", xytext=(4, 4), fontsize=6)
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + 0.25 * (high - low))  # room for the name of the last
    axes.set(
        xlabel=f"{labelled(table, x)}, {select.objectives[x]}", ylabel=f"{labelled(table, y)}, {select.objectives[y]}"
    )
    axes.legend(fontsize=8)
    return figure
