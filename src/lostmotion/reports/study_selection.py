"""The selection of a study as text, tables and a Pareto chart."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..sizing.axis_task.mass_and_price import CHOICE
from ..studies.runs.axis_pairs import HOLDS
from ..studies.runs.read_table import labelled, unit_of
from ..studies.selection.nearest_misses import Lacking, Miss, misses, not_judged, rules_not_judged
from ..studies.selection.ranking import NOT_RUN, Price, RankedCandidate, candidates, pareto_front, prices
from ..studies.study.drive_check_columns import ESTIMATED, NO_DATA
from ..studies.study.select_table import TASK_SHARES, USE, Selection
from ..studies.study.study_definition import Study
from ..units.practical import PRACTICAL, counted, printed
from ..verdict import Point, Verdict
from .figure_style import OTHERS, PALETTE, look
from .page import Table
from .panels import Curve, Group, Panel
from .written_files import table_csv

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure

PARETO = "Each point is a candidate; point at it to read its name and values. The list below names the numbered ones."
NEAREST = 5  # candidates that do not fit, for which a slower cycle is sought
MAX_LINES = 6  # lines of each list that are printed; the page has all
RECORDS_LACK = "Not judged, since a record lacks what a run needs:"
RULES_LACK = "Rules that are not judged:"
ALL = "on the page and in its selection.csv"
MAX_ROWS = 25  # of a table on the page
LARGE = {
    "arcmin": (math.radians(10.0), "deg", math.degrees(1.0)),
    "ms": (1.0, "s", 1.0),
}  # above which SI value, what unit


def words(name: str) -> str:
    """The name of a column as text has it: `tracking_error_peak` is the largest tracking error."""
    of = name.replace("_", " ").replace(".", " ")
    return f"largest {of.removesuffix(' peak')}" if name.endswith("_peak") else of


def shown_in(table: pa.Table, study: Study, column: str, title: str = "") -> tuple[str, float]:
    """A column in words, or by another title, with its unit, and how many of these one SI unit is: of a selection, a practical unit."""
    si, values = unit_of(table, column), np.abs(table[column].to_numpy().astype(float))
    unit, factor = PRACTICAL.get(si, (printed(si), 1.0)) if study.select is not None else (printed(si), 1.0)
    if unit in LARGE and np.nanmax(values, initial=0.0) > LARGE[unit][0]:
        unit, factor = LARGE[unit][1:]
    title = title or words(column)
    return f"{title} [{unit}]" if unit not in ("", "1") else title, factor


@dataclass(frozen=True)
class Shown:
    """A selection as text, as parts of a page, and as the text of CSV files by their names."""

    lines: list[str]
    verdict: Verdict
    parts: tuple[Table | Group, ...]
    tables: dict[str, str]


def show_selection(table: pa.Table, study: Study) -> Shown:
    """The ranking, what limits cost, why others do not fit; with two objectives the Pareto chart."""
    select = study.select
    assert select is not None
    ranked = candidates(table, study)
    costs, front = prices(ranked, select), pareto_front(ranked, select)
    objective = next(iter(select.objectives))
    header = ["limit", "excludes", "alone", "best without it", objective, "relaxed by", "gain"]
    best = [(p.best.name, p.best.values[objective]) if p.best else ("", "") for p in costs]
    rows = [[p.limit, p.excludes, p.alone, *of, p.opens, p.gain] for p, of in zip(costs, best, strict=True)]
    near = misses(study, ranked, NEAREST) if study.axis is not None else []
    unknown, rules = not_judged(ranked), rules_not_judged(ranked)
    misfits = [c for c in ranked if not c.fits and NO_DATA not in c.violated]
    told = _listed("Why the others do not fit:", [f"{c.name}: {_why(c)}" for c in misfits], ALL)
    if near:
        told = _listed("Nearest misses:", [f"{m.candidate.name}: {m}{_of_estimate(m.candidate)}" for m in near], ALL)
    lacking = [
        [f"{len(g.candidates)}, such as {g.candidates[0]}: {g.datum}" for g in found] for found in (unknown, rules)
    ]
    verdict = _verdict(table, ranked, costs, study, near)
    lines = [
        *_ranking(table, ranked, front, study),
        *_costs(table, costs, study),
        *told,
        *_listed(RECORDS_LACK, lacking[0], "on the page"),
        *_listed(RULES_LACK, lacking[1], "on the page"),
        f"Verdict: {verdict}",
    ]
    several = len(select.objectives) > 1 and any(all(map(math.isfinite, c.values.values())) for c in ranked)
    chart = [Group("pareto", "Candidates", PARETO, (pareto_panel(table, ranked, front, study),), 1)] if several else []
    return Shown(
        lines=lines,
        verdict=verdict,
        parts=(
            *chart,
            *_ranking_tables(table, ranked, front, study),
            *([_costs_table(table, costs, study)] if costs else []),
            *_miss_tables(near),
            *_misfit_tables(misfits),
            *_unknown_tables(unknown, "Not judged: data that are missing"),
            *_unknown_tables(rules, "Rules that are not judged"),
        ),
        tables={"selection.csv": _selection_csv(table, study, ranked, front), "limits.csv": table_csv(header, rows)},
    )


def _verdict(
    table: pa.Table, ranked: list[RankedCandidate], costs: list[Price], study: Study, near: list[Miss]
) -> Verdict:
    """Whether a candidate fits.

    It is a reservation if a rule or the losses of the best one are open. If none fits and some cannot be judged, it is not decided.
    """
    fitting = [c for c in ranked if c.fits]
    count = (
        f"{len(fitting)} of {counted(len(ranked), 'candidate')} {'fits' if 1 in (len(fitting), len(ranked)) else 'fit'}"
    )
    open_ones = sum(c.open for c in ranked)
    count += f", {open_ones} cannot be judged" if open_ones else ""
    lines, points = list[str](), list[Point]()
    if fitting:
        best = fitting[0]
        tightest = f"; its most used limit: {words(best.tightest)}" if best.tightest else ""
        lines.append(f"Best: {best.name}, {_with_value(table, study, best)}{tightest}.")
        if open_points := _reservations(best, fitting):
            points.append(Point("fits with a reservation", f"{count}; of the best one, {'; '.join(open_points)}"))
        points.append(Point("fits", count))
    else:
        points.append(Point("not decided" if open_ones else "does not fit", count))
    if near and not fitting:
        lines.append(f"Nearest: {near[0].candidate.name}: {near[0]}.")
        lines.append(f"The limit {words(costs[0].limit)} excludes most: {costs[0].excludes}.")
    dear = [p for p in costs if math.isfinite(p.gain) and p.gain > 0.0]
    if dear:
        p = max(dear, key=lambda price: price.gain)
        lines.append(f"Without the limit {words(p.limit)} the best would be {100.0 * p.gain:.3g} % better.")
    return Verdict.of(points, lines)


def _reservations(best: RankedCandidate, fitting: list[RankedCandidate]) -> list[str]:
    """Open points of the best candidate that fits."""
    never = set.intersection(*(set(c.not_judged.split()) for c in fitting))
    rules = best.not_judged.split()
    names = [f"{rule} (of none that fits)" if rule in never and len(fitting) > 1 else rule for rule in rules]
    out = [f"not judged: {', '.join(names)}"] if names else []
    if best.estimated and best.estimated != HOLDS:
        out.append(f"the losses are estimated and the verdict {_estimated(best)}")
    if out and (whole := next((c for c in fitting if not c.not_judged and c.estimated in ("", HOLDS)), None)):
        out.append(f"the first without a reservation is {whole.name}")
    return out


def _with_value(table: pa.Table, study: Study, candidate: RankedCandidate) -> str:
    """What candidates are ranked by, and its value for one of them, such as ``energy 32.95 J``."""
    label, factor = shown_in(table, study, objective := _objective(study))
    name, _, unit = label.removesuffix("]").partition(" [")
    return f"{name} {factor * candidate.values[objective]:.5g} {unit}".rstrip()


def _objective(study: Study) -> str:
    """What candidates are ranked by."""
    assert study.select is not None
    return next(iter(study.select.objectives))


def _ranking_tables(
    table: pa.Table, ranked: list[RankedCandidate], front: list[RankedCandidate], study: Study
) -> list[Table]:
    select = study.select
    assert select is not None
    fitting = [c for c in ranked if c.fits][:MAX_ROWS]
    if not fitting:
        return []
    numbers = {c.run: str(k) for k, c in enumerate(_in_order(front, select), 1)}
    titles, factors = _objectives(table, study)
    beside = [name for name in CHOICE if name not in select.objectives and any(name in c.choice for c in fitting)]
    titles += [_choice_title(name) for name in beside]
    last = [ESTIMATED] if any(c.estimated for c in fitting) else []
    rows = [
        [
            c.name,
            *(f"{factor * v:.5g}" for factor, v in zip(factors, c.values.values(), strict=True)),
            *(f"{c.choice[n] / CHOICE[n].shown[1]:.5g}" if n in c.choice else "" for n in beside),
            numbers.get(c.run, ""),
            words(c.tightest),
            ", ".join(map(words, c.not_judged.split())),
            *([c.estimated] if last else []),
        ]
        for c in fitting
    ]
    note = "A number in the column Pareto front is that in the chart; a blank cell means that another candidate is better in all."
    note = note if len(select.objectives) > 1 else ""
    if (count := sum(c.fits for c in ranked)) > MAX_ROWS:
        note = f"The best {MAX_ROWS} of {count}; all are in `selection.csv`. {note}".strip()
    header = ("candidate", *titles, "Pareto front", "most used limit", "not judged", *last)
    return [Table("Candidates that fit", header, rows, note)]


def _objectives(table: pa.Table, study: Study) -> tuple[list[str], list[float]]:
    """Titles of the columns of objectives with the unit that is shown, and how many of these one SI unit is."""
    assert study.select is not None
    found = {column: shown_in(table, study, column) for column in study.select.objectives}
    titles = [_better(title, study.select.objectives[column]) for column, (title, _) in found.items()]
    return titles, [factor for _, factor in found.values()]


def _better(title: str, direction: str) -> str:
    return f"{title}, {'lower' if direction == 'least' else 'higher'} is better"


def _estimated(candidate: RankedCandidate) -> str:
    text = candidate.estimated
    return text if text.startswith("holds") else f"is {text}"


def _of_estimate(candidate: RankedCandidate) -> str:
    """Remark on estimated losses, in brackets; empty where none are estimated."""
    return f" (losses estimated, the verdict {_estimated(candidate)})" if candidate.estimated else ""


def _why(candidate: RankedCandidate) -> str:
    return f"{candidate.why}{_of_estimate(candidate)}"


def _choice_title(column: str) -> str:
    unit = CHOICE[column].shown[0]
    return column.replace("_", " ") + (f" [{unit}]" if unit else "")


def _costs_table(table: pa.Table, costs: list[Price], study: Study) -> Table:
    rows, objective = [], _objective(study)
    label, factor = shown_in(table, study, objective)
    for p in costs:
        found = p.best is not None and p.alone
        best = p.best.name if p.best is not None and p.alone else "not run" if p.alone else "nothing more fits"
        value = f"{factor * p.best.values[objective]:.5g}" if p.best is not None and found else ""
        gain = (f"{100.0 * p.gain:.3g} %" if p.gain > 0.0 else "as now") if found and math.isfinite(p.gain) else ""
        rows.append([words(p.limit), str(p.excludes), str(p.alone), _share(p.opens), best, value, gain])
    header = ("limit", "excludes", "of these alone", "relaxed by", "best without it", label, "better by")
    return Table("What each limit costs", header, rows)


def _misfit_tables(out: list[RankedCandidate]) -> list[Table]:
    if not out:
        return []
    note = f"The first {MAX_ROWS} of {len(out)}; all are in `selection.csv`." if len(out) > MAX_ROWS else ""
    return [
        Table("Why the others do not fit", ("candidate", "reason"), [[c.name, _why(c)] for c in out[:MAX_ROWS]], note)
    ]


def pareto_panel(table: pa.Table, ranked: list[RankedCandidate], front: list[RankedCandidate], study: Study) -> Panel:
    """The first two objectives of all runs: those that fit, those that do not, and the front of those that fit."""
    select = study.select
    assert select is not None
    shown = {name: shown_in(table, study, name) for name in list(select.objectives)[:2]}

    def curve(label: str, found: list[RankedCandidate], style: dict[str, Any]) -> Curve:
        across, along = (factor * np.array([c.values[name] for c in found]) for name, (_, factor) in shown.items())
        return Curve(label, across, along, style, names=tuple(c.name for c in found))

    fits, fails = ([c for c in ranked if c.fits is wanted] for wanted in (True, False))
    curves = (
        curve("does not fit", fails, OTHERS),
        curve("fits", fits, {"color": PALETTE["first"], "linestyle": "none", "marker": "o", "markersize": 5}),
        replace(
            curve("Pareto front", _in_order(front, select), look(1) | {"marker": "o", "markersize": 6}),
            numbered=len(front) <= MAX_ROWS,
        ),
    )
    label = [_better(title, select.objectives[name]) for name, (title, _) in shown.items()]
    return Panel("Objectives of all candidates", label[0], label[1], tuple(c for c in curves if len(c.x)))


def _in_order(front: list[RankedCandidate], select: Selection) -> list[RankedCandidate]:
    """The Pareto front along its first objective, in which its points have their numbers."""
    first = next(iter(select.objectives))
    return sorted(front, key=lambda c: c.values[first])


def pareto_figure(table: pa.Table, ranked: list[RankedCandidate], front: list[RankedCandidate], study: Study) -> Figure:
    """The picture of `pareto_panel`."""
    from . import plots

    return plots.draw([pareto_panel(table, ranked, front, study)], 1, (6.4, 4.4))


def _selection_csv(table: pa.Table, study: Study, ranked: list[RankedCandidate], front: list[RankedCandidate]) -> str:
    """One row a run: rank, what varies, whether and why it fits, and all its numbers."""
    uses = [f"{USE}{rule}" for rule in TASK_SHARES if f"{USE}{rule}" in table.column_names]
    names = [*(v.title for v in study.vary), *study.kept_units, *uses]
    rows, on_front = [], {c.run for c in front}
    by_run = {row["run"]: row for row in table.to_pylist()}
    for rank, c in enumerate(ranked, 1):
        own = by_run[c.run]
        said = ["yes" if c.fits else "no", "yes" if c.run in on_front else "no"]
        limits = [c.tightest, " ".join(c.violated), c.why, c.not_judged, c.estimated]
        rows.append([rank, c.run, *said, *limits, *(own[name] for name in names)])
    header = ["rank", "run", "fits", "Pareto front", "tightest limit", "violated", "why", "not judged", ESTIMATED]
    return table_csv([*header, *(labelled(table, name) for name in names)], rows)


def _ranking(table: pa.Table, ranked: list[RankedCandidate], front: list[RankedCandidate], study: Study) -> list[str]:
    select = study.select
    assert select is not None
    fitting = [c for c in ranked if c.fits]
    failed = sum(NOT_RUN in c.violated for c in ranked)
    fit = "fits" if len(fitting) == 1 else "fit"
    lines = [f"Selection: {len(fitting)} of {len(ranked)} {fit}" + (f", {failed} cannot be run" if failed else "")]
    if not fitting:
        return lines
    width = max(len(c.name) for c in fitting[:MAX_LINES]) + 2
    titles, factors = _objectives(table, study)
    columns = [max(12, len(title) + 2) for title in titles]
    lines.append(" " * (width + 2) + "".join(t.rjust(w) for t, w in zip(titles, columns, strict=True)))
    on_front = {c.run for c in front}
    for c in fitting[:MAX_LINES]:
        values = "".join(
            f"{factor * v:.5g}".rjust(w) for factor, v, w in zip(factors, c.values.values(), columns, strict=True)
        )
        notes = ["Pareto front"] if len(select.objectives) > 1 and c.run in on_front else []
        notes += [f"tightest: {c.tightest}"] if c.tightest else []
        notes += [f"not judged: {c.not_judged}"] if c.not_judged else []
        notes += (
            [f"losses estimated, the verdict {'holds' if c.estimated == HOLDS else _estimated(c)}"]
            if c.estimated
            else []
        )
        lines.append(f"  {c.name.ljust(width)}{values}" + (f"  ({'; '.join(notes)})" if notes else ""))
    if len(fitting) > MAX_LINES:
        lines.append(f"  and {len(fitting) - MAX_LINES} more, {ALL}")
    return lines


def _costs(table: pa.Table, costs: list[Price], study: Study) -> list[str]:
    if not costs:
        return []
    width = max(len(p.limit) for p in costs) + 2
    lines = ["What each limit costs:", "  " + "limit".ljust(width) + "  excludes  of these alone  best without it"]
    for p in costs:
        best = "nothing more fits"
        if p.best is None and p.alone:
            best = "not run"
        if p.best is not None and p.alone:
            best = f"{p.best.name}, {_with_value(table, study, p.best)}"
            if math.isfinite(p.gain):
                best += f" ({100.0 * p.gain:.3g} % better)" if p.gain > 0.0 else " (as now)"
        if math.isfinite(p.rests):
            best += f"; the load rests at least {_share(p.rests)} beyond the window"
        if math.isfinite(p.opens):
            best += f"; {_share(p.opens)} more of the limit opens the first"
        lines.append(f"  {p.limit.ljust(width)}{p.excludes:>10}{p.alone:>16}  {best}")
    return lines


def _share(x: float) -> str:
    return (f"{100.0 * x:.0f} %" if abs(x) >= 0.1 else f"{100.0 * x:.2g} %") if math.isfinite(x) else ""


def _listed(title: str, rows: list[str], rest: str) -> list[str]:
    """Rows under their title, of many the first; `rest`: where the others are."""
    more = [f"and {len(rows) - MAX_LINES} more, {rest}"] if len(rows) > MAX_LINES else []
    return [title, *(f"  {row}" for row in (*rows[:MAX_LINES], *more))] if rows else []


def _miss_tables(near: list[Miss]) -> list[Table]:
    if not near:
        return []
    rows = [
        [miss.candidate.name, ", ".join(f"{name} {_share(x)}" for name, x in miss.lacks.items()), miss.then]
        for miss in near
    ]
    note = "Over a limit, as a share of it. A slower cycle is judged by the rules and run; moves and rests take longer alike."
    return [Table("Nearest misses", ("candidate", "over its limits by", "with a slower cycle"), rows, note)]


def _unknown_tables(groups: list[Lacking], title: str) -> list[Table]:
    if not groups:
        return []
    rows = [[str(len(g.candidates)), g.candidates[0], g.datum] for g in groups[:MAX_ROWS]]
    return [Table(title, ("candidates", "such as", "why"), rows)]
