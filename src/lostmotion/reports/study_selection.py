"""The selection of a study as text, tables and a Pareto chart."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..sizing.axis_task.mass_and_price import CHOICE
from ..studies.runs.candidate_rows import HOLDS
from ..studies.runs.read_table import labelled, unit_of
from ..studies.selection.nearest_misses import Lacking, Miss, misses, not_judged, rules_not_judged
from ..studies.selection.ranking import NOT_RUN, Price, RankedCandidate, candidates, pareto_front, prices
from ..studies.study.drive_check_columns import ESTIMATED, NO_DATA
from ..studies.study.select_table import TASK_SHARES, USE
from ..studies.study.study_definition import Study
from ..units.practical import PRACTICAL, counted, printed
from ..verdict import Point, Verdict
from .figure_style import OTHERS, PALETTE, dots, look
from .page import Table
from .panels import Curve, Group, Panel
from .written_files import table_csv

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure

PARETO = "Each point is a candidate; point at it to read its name and values. The list below names the numbered ones."
NUMBERED = "A number in the column Pareto front is that in the chart; a blank cell means that another candidate is better in all."
SLOWER = (
    "Over a limit, as a share of it. A slower cycle is judged by the rules and run; moves and rests take longer alike."
)
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


class SelectionReport:
    """The selection of a study: the ranking, what limits cost, and why others do not fit, as text and as parts of a page."""

    def __init__(self, table: pa.Table, study: Study, ranked: list[RankedCandidate] | None = None) -> None:
        assert study.select is not None
        self.table, self.study, self.select = table, study, study.select
        self.ranked = candidates(table, study) if ranked is None else ranked
        self.fitting = [c for c in self.ranked if c.fits]
        self.costs, self.objective = prices(self.ranked, self.select), next(iter(self.select.objectives))
        self.front = sorted(pareto_front(self.ranked, self.select), key=lambda c: c.values[self.objective])
        """the Pareto front along its first objective, in which its points have their numbers"""

    @cached_property
    def near(self) -> list[Miss]:
        """The nearest misses of a task."""
        return misses(self.study, self.ranked, NEAREST) if self.study.axis is not None else []

    @cached_property
    def lacking(self) -> dict[str, list[Lacking]]:
        """Candidates and rules that are not judged, by the title of their table."""
        lacks = {"Not judged: data that are missing": not_judged, "Rules that are not judged": rules_not_judged}
        return {title: found(self.ranked) for title, found in lacks.items()}

    @property
    def misfits(self) -> list[list[str]]:
        """Candidates that do not fit, with the reason."""
        return [[c.name, f"{c.why}{_of_estimate(c)}"] for c in self.ranked if not c.fits and NO_DATA not in c.violated]

    # --- the verdict ---

    @cached_property
    def verdict(self) -> Verdict:
        """Whether a candidate fits.

        It is a reservation if a rule or the losses of the best one are open. If none fits and some cannot be judged, it is not decided.
        """
        fitting, whole = self.fitting, len(self.ranked)
        count = f"{len(fitting)} of {counted(whole, 'candidate')} {'fits' if 1 in (len(fitting), whole) else 'fit'}"
        open_ones = sum(c.open for c in self.ranked)
        count += f", {open_ones} cannot be judged" if open_ones else ""
        lines, points = list[str](), list[Point]()
        if fitting:
            best = fitting[0]
            tightest = f"; its most used limit: {words(best.tightest)}" if best.tightest else ""
            lines.append(f"Best: {best.name}, {self._with_value(best)}{tightest}.")
            if open_points := self._reservations(best):
                points.append(Point("fits with a reservation", f"{count}; of the best one, {'; '.join(open_points)}"))
            points.append(Point("fits", count))
        else:
            points.append(Point("not decided" if open_ones else "does not fit", count))
            if self.near:
                lines.append(f"Nearest: {self.near[0].candidate.name}: {self.near[0]}.")
                lines.append(f"The limit {words(self.costs[0].limit)} excludes most: {self.costs[0].excludes}.")
        if dear := [p for p in self.costs if math.isfinite(p.gain) and p.gain > 0.0]:
            p = max(dear, key=lambda price: price.gain)
            lines.append(f"Without the limit {words(p.limit)} the best would be {100.0 * p.gain:.3g} % better.")
        return Verdict.of(points, lines)

    def _reservations(self, best: RankedCandidate) -> list[str]:
        """Open points of the best candidate that fits."""
        never = set.intersection(*(set(c.not_judged.split()) for c in self.fitting))
        rules, several = best.not_judged.split(), len(self.fitting) > 1
        names = [f"{rule} (of none that fits)" if rule in never and several else rule for rule in rules]
        out = [f"not judged: {', '.join(names)}"] if names else []
        if best.estimated and best.estimated != HOLDS:
            out.append(f"the losses are estimated and the verdict {_estimated(best)}")
        whole = next((c for c in self.fitting if not c.not_judged and c.estimated in ("", HOLDS)), None)
        return [*out, f"the first without a reservation is {whole.name}"] if out and whole else out

    def _with_value(self, candidate: RankedCandidate) -> str:
        """What candidates are ranked by, and its value for one of them, such as ``energy 32.95 J``."""
        label, factor = shown_in(self.table, self.study, self.objective)
        name, _, unit = label.removesuffix("]").partition(" [")
        return f"{name} {factor * candidate.values[self.objective]:.5g} {unit}".rstrip()

    # --- text ---

    def lines(self) -> list[str]:
        """The selection as text."""
        told = _listed("Why the others do not fit:", [f"{name}: {why}" for name, why in self.misfits], ALL)
        if self.near:
            near = [f"{m.candidate.name}: {m}{_of_estimate(m.candidate)}" for m in self.near]
            told = _listed("Nearest misses:", near, ALL)
        for title, groups in zip((RECORDS_LACK, RULES_LACK), self.lacking.values(), strict=True):
            rows = [f"{len(g.candidates)}, such as {g.candidates[0]}: {g.datum}" for g in groups]
            told += _listed(title, rows, "on the page")
        return [*self._ranking(), *self._costs(), *told, f"Verdict: {self.verdict}"]

    def _ranking(self) -> list[str]:
        fitting, shown = self.fitting, self.fitting[:MAX_LINES]
        failed = sum(NOT_RUN in c.violated for c in self.ranked)
        first = f"Selection: {len(fitting)} of {len(self.ranked)} {'fits' if len(fitting) == 1 else 'fit'}"
        lines = [first + (f", {failed} cannot be run" if failed else "")]
        if not fitting:
            return lines
        width = max(len(c.name) for c in shown) + 2
        titles, factors = self._objectives()
        columns = [max(12, len(title) + 2) for title in titles]
        lines.append(" " * (width + 2) + "".join(t.rjust(w) for t, w in zip(titles, columns, strict=True)))
        for c in shown:
            pairs = zip(factors, c.values.values(), columns, strict=True)
            values = "".join(f"{factor * v:.5g}".rjust(w) for factor, v, w in pairs)
            notes = ["Pareto front"] if len(self.select.objectives) > 1 and c in self.front else []
            notes += [f"tightest: {c.tightest}"] if c.tightest else []
            notes += [f"not judged: {c.not_judged}"] if c.not_judged else []
            holds = "holds" if c.estimated == HOLDS else _estimated(c)
            notes += [f"losses estimated, the verdict {holds}"] if c.estimated else []
            lines.append(f"  {c.name.ljust(width)}{values}" + (f"  ({'; '.join(notes)})" if notes else ""))
        more = len(fitting) - MAX_LINES
        return [*lines, *([f"  and {more} more, {ALL}"] if more > 0 else [])]

    def _costs(self) -> list[str]:
        if not self.costs:
            return []
        width = max(len(p.limit) for p in self.costs) + 2
        lines = ["What each limit costs:", "  " + "limit".ljust(width) + "  excludes  of these alone  best without it"]
        for p in self.costs:
            best = _best_without(p)
            if p.best is not None and p.alone:
                gain = f" ({_gain(p)} better)" if p.gain > 0.0 else " (as now)"
                best += f", {self._with_value(p.best)}" + (gain if math.isfinite(p.gain) else "")
            if math.isfinite(p.rests):
                best += f"; the load rests at least {_share(p.rests)} beyond the window"
            if math.isfinite(p.opens):
                best += f"; {_share(p.opens)} more of the limit opens the first"
            lines.append(f"  {p.limit.ljust(width)}{p.excludes:>10}{p.alone:>16}  {best}")
        return lines

    # --- parts of a page ---

    @property
    def chart(self) -> Group:
        """The Pareto chart; empty with one objective."""
        several = len(self.select.objectives) > 1 and any(
            all(map(math.isfinite, c.values.values())) for c in self.ranked
        )
        return Group("pareto", "Candidates", PARETO, (self.pareto_panel(),) if several else (), 1)

    def parts(self) -> list[Table]:
        """The tables of the page."""
        near = [
            [m.candidate.name, ", ".join(f"{name} {_share(x)}" for name, x in m.lacks.items()), m.then]
            for m in self.near
        ]
        tables = [
            self._ranking_table(),
            self._costs_table(),
            Table("Nearest misses", ("candidate", "over its limits by", "with a slower cycle"), near, SLOWER),
            Table("Why the others do not fit", ("candidate", "reason"), *_first_rows(self.misfits)),
        ]
        for title, groups in self.lacking.items():
            rows = [[str(len(g.candidates)), g.candidates[0], g.datum] for g in groups[:MAX_ROWS]]
            tables.append(Table(title, ("candidates", "such as", "why"), rows))
        return tables

    def _ranking_table(self) -> Table:
        fitting = self.fitting[:MAX_ROWS]
        numbers = {c.run: str(k) for k, c in enumerate(self.front, 1)}
        titles, factors = self._objectives()
        beside = [n for n in CHOICE if n not in self.select.objectives and any(n in c.choice for c in fitting)]
        for column in beside:
            unit = CHOICE[column].shown[0]
            titles.append(column.replace("_", " ") + (f" [{unit}]" if unit else ""))
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
        note = NUMBERED if len(self.select.objectives) > 1 else ""
        if (count := len(self.fitting)) > MAX_ROWS:
            note = f"The best {MAX_ROWS} of {count}; all are in `selection.csv`. {note}".strip()
        header = ("candidate", *titles, "Pareto front", "most used limit", "not judged", *last)
        return Table("Candidates that fit", header, rows, note)

    def _objectives(self) -> tuple[list[str], list[float]]:
        """Titles of the columns of objectives with the unit that is shown, and how many of these one SI unit is."""
        found = {column: shown_in(self.table, self.study, column) for column in self.select.objectives}
        titles = [self._better(title, column) for column, (title, _) in found.items()]
        return titles, [factor for _, factor in found.values()]

    def _better(self, title: str, column: str) -> str:
        return f"{title}, {'lower' if self.select.objectives[column] == 'least' else 'higher'} is better"

    def _costs_table(self) -> Table:
        label, factor = shown_in(self.table, self.study, self.objective)
        rows = []
        for p in self.costs:
            value, gain = "", ""
            if p.best is not None and p.alone:
                value = f"{factor * p.best.values[self.objective]:.5g}"
                gain = (_gain(p) if p.gain > 0.0 else "as now") if math.isfinite(p.gain) else ""
            row = [words(p.limit), str(p.excludes), str(p.alone), _share(p.opens), _best_without(p), value, gain]
            rows.append(row)
        header = ("limit", "excludes", "of these alone", "relaxed by", "best without it", label, "better by")
        return Table("What each limit costs", header, rows)

    def pareto_panel(self) -> Panel:
        """The first two objectives of all runs: those that fit, those that do not, and the front of those that fit."""
        shown = {name: shown_in(self.table, self.study, name) for name in list(self.select.objectives)[:2]}

        def curve(label: str, found: list[RankedCandidate], style: dict[str, Any], **more: Any) -> Curve:
            across, along = (factor * np.array([c.values[name] for c in found]) for name, (_, factor) in shown.items())
            return Curve(label, across, along, style, names=tuple(c.name for c in found), **more)

        line = look(1) | {"marker": "o", "markersize": 6}
        curves = (
            curve("does not fit", [c for c in self.ranked if not c.fits], OTHERS),
            curve("fits", self.fitting, dots(PALETTE["first"], 5)),
            curve("Pareto front", self.front, line, numbered=len(self.front) <= MAX_ROWS),
        )
        across, along = (self._better(title, name) for name, (title, _) in shown.items())
        return Panel("Objectives of all candidates", across, along, tuple(c for c in curves if len(c.x)))

    # --- files ---

    def files(self) -> dict[str, str]:
        """The text of CSV files by their names."""
        header = ["limit", "excludes", "alone", "best without it", self.objective, "relaxed by", "gain"]
        best = [(p.best.name, p.best.values[self.objective]) if p.best else ("", "") for p in self.costs]
        rows = [[p.limit, p.excludes, p.alone, *of, p.opens, p.gain] for p, of in zip(self.costs, best, strict=True)]
        return {"selection.csv": self._selection_csv(), "limits.csv": table_csv(header, rows)}

    def _selection_csv(self) -> str:
        """One row a run: rank, what varies, whether and why it fits, and all its numbers."""
        uses = [f"{USE}{rule}" for rule in TASK_SHARES if f"{USE}{rule}" in self.table.column_names]
        names = [*(v.title for v in self.study.vary), *self.study.kept_units, *uses]
        rows, by_run = [], {row["run"]: row for row in self.table.to_pylist()}
        for rank, c in enumerate(self.ranked, 1):
            said = ["yes" if c.fits else "no", "yes" if c in self.front else "no"]
            limits = [c.tightest, " ".join(c.violated), c.why, c.not_judged, c.estimated]
            rows.append([rank, c.run, *said, *limits, *(by_run[c.run][name] for name in names)])
        header = ["rank", "run", "fits", "Pareto front", "tightest limit", "violated", "why", "not judged", ESTIMATED]
        return table_csv([*header, *(labelled(self.table, name) for name in names)], rows)


def pareto_figure(table: pa.Table, study: Study) -> Figure:
    """The picture of the Pareto front."""
    from . import plots

    return plots.draw([SelectionReport(table, study).pareto_panel()], 1, (6.4, 4.4))


def _first_rows(rows: list[list[str]]) -> tuple[list[list[str]], str]:
    """The rows of a table that a page shows, and a note on the others."""
    note = f"The first {MAX_ROWS} of {len(rows)}; all are in `selection.csv`." if len(rows) > MAX_ROWS else ""
    return rows[:MAX_ROWS], note


def _estimated(candidate: RankedCandidate) -> str:
    text = candidate.estimated
    return text if text.startswith("holds") else f"is {text}"


def _of_estimate(candidate: RankedCandidate) -> str:
    """Remark on estimated losses, in brackets; empty where none are estimated."""
    return f" (losses estimated, the verdict {_estimated(candidate)})" if candidate.estimated else ""


def _best_without(price: Price) -> str:
    """Name of the best candidate without a limit, or why there is none."""
    if not price.alone:
        return "nothing more fits"
    return "not run" if price.best is None else price.best.name


def _gain(price: Price) -> str:
    return f"{100.0 * price.gain:.3g} %"


def _share(x: float) -> str:
    return (f"{100.0 * x:.0f} %" if abs(x) >= 0.1 else f"{100.0 * x:.2g} %") if math.isfinite(x) else ""


def _listed(title: str, rows: list[str], rest: str) -> list[str]:
    """Rows under their title, of many the first; `rest`: where the others are."""
    more = [f"and {len(rows) - MAX_LINES} more, {rest}"] if len(rows) > MAX_LINES else []
    return [title, *(f"  {row}" for row in (*rows[:MAX_LINES], *more))] if rows else []
