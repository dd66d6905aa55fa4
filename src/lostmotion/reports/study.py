"""The report of a study: statistics, distributions, correlations, Sobol indices, scatter, selection, the best designs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, need
from ..studies.runs.read_table import labelled, read_table
from ..studies.runs.run_study import study_of
from ..studies.study.study_definition import Study
from ..studies.study.vary import Vary
from ..units.practical import counted, printed
from ..verdict import Verdict
from .figure_style import PALETTE, dots
from .page import Prose, Report, Table
from .panels import Bars, Curve, Group, Histogram, Panel
from .study_selection import SelectionReport, shown_in, words
from .written_files import table_csv, write_report

if TYPE_CHECKING:
    import pyarrow as pa

BLANK = "Over all runs. A blank cell means that no run has a value."
MAX_POINTS = 5000  # of a scatter
NAMES = 12  # along an axis
POINTS = dots(PALETTE["first"], 2.5, alpha=0.5)


def statistics(table: pa.Table, study: Study, *, page: bool | None = None) -> list[list[Any]]:
    """Name, mean, standard deviation, least, 5 %, 50 %, 95 %, largest of each kept value.

    page: as a page or as the terminal shows it; left out, in SI.
    """
    rows = []
    for name in study.keep:
        label, factor = labelled(table, name), 1.0
        if page is not None:
            label, factor = shown_in(table, study, name, "" if page else name)
        x = factor * _finite(table, name)
        if len(x) == 0:
            rows.append([label, *[np.nan] * 7])
            continue
        quantiles = np.quantile(x, [0.0, 0.05, 0.5, 0.95, 1.0]).tolist()
        rows.append([label, float(x.mean()), float(x.std()), *quantiles])
    return rows


def _finite(table: pa.Table, name: str) -> np.ndarray:
    x = table[name].to_numpy()
    return np.asarray(x[np.isfinite(x)])


def _with_order(study: Study) -> list[Vary]:
    """The parameters whose values are numbers; names have no order."""
    return [v for v in study.vary if v.names is None]


def influence(table: pa.Table, study: Study) -> dict[str, dict[str, float]]:
    """Spearman's rank correlation of each kept value with each parameter that is a number."""
    from scipy.stats import spearmanr

    out: dict[str, dict[str, float]] = {}
    for name in study.keep:
        y = table[name].to_numpy()
        out[name] = {}
        for v in _with_order(study):
            x = table[v.title].to_numpy()
            good = np.isfinite(y)
            varies = good.sum() > 2 and np.ptp(x[good]) > 0.0 and np.ptp(y[good]) > 0.0
            out[name][v.title] = float(spearmanr(x[good], y[good]).statistic) if varies else 0.0
    return out


def sobol_indices(table: pa.Table, study: Study) -> dict[str, dict[str, tuple[float, float, float, float]]]:
    """First order and total of each parameter for each kept value, and the half widths of their 95 % intervals; for the design saltelli.

    Raises InputError: runs are missing or failed.
    """
    from SALib.analyze import sobol

    names = [v.title for v in study.vary]
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    out: dict[str, dict[str, Any]] = {}
    for name in study.keep:
        y = table[name].to_numpy()
        if len(y) != study.total or not np.all(np.isfinite(y)):
            raise InputError(f"Sobol indices of {name} need all {study.total} runs, without failures")
        found = sobol.analyze(problem, y, calc_second_order=True, seed=study.seed + 1)  # 0 is none
        columns = [found[x].tolist() for x in ("S1", "ST", "S1_conf", "ST_conf")]
        out[name] = dict(zip(names, zip(*columns, strict=True), strict=True))
    return out


def best_lines(directory: Path, text: str) -> list[str]:
    """The ten best runs as text, for ``COLUMN``, ``COLUMN:least`` or ``COLUMN:largest``.

    Raises InputError: there is no such column, or direction.
    """
    table = read_table(directory)
    name, colon, direction = text.rpartition(":")
    if not colon or text in table.column_names:
        name, direction = text, "least"
    if direction not in ("least", "largest"):
        raise InputError(f"--best {text}: the direction must be least or largest, as in {name}:largest")
    rows = best_runs(table, name, largest=direction == "largest").to_pylist()
    plain = ["run", *(v.title for v in study_of(directory).vary), *study_of(directory).kept_units, "switchings"]
    shown = [", ".join(f"{c} {_short(row[c])}" for c in plain) for row in rows]
    return [f"{direction.capitalize()} {labelled(table, name)}:", *(f"  {line}" for line in shown)]


def _short(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, int | float) else str(value)


def best_runs(table: pa.Table, name: str, count: int = 10, *, largest: bool = False) -> pa.Table:
    """The rows with the least (or largest) values of a column."""
    import pyarrow as pa

    numbers = [f.name for f in table.schema if pa.types.is_floating(f.type) or pa.types.is_integer(f.type)]
    if name not in numbers:
        raise InputError(f"--best {name}: there is no such column of numbers; they are {', '.join(numbers)}")
    good = table.filter(np.isfinite(table[name].to_numpy()))
    return good.sort_by([(name, "descending" if largest else "ascending")]).slice(0, count)


# --- charts ---


def distributions(table: pa.Table, study: Study) -> Group:
    """A histogram of each kept value."""
    charts = []
    for name in study.keep:
        label, factor = shown_in(table, study, name)
        if len(x := _finite(table, name)):
            charts.append(Histogram(words(name), label, factor * x))
    return Group("distributions", "Distributions", "", tuple(charts), 3 if len(charts) % 3 == 0 else 2)


def bars(name: str, title: str, values: dict[str, dict[str, Any]], label: str, series: tuple[str, ...] = ()) -> Group:
    """Bars by parameter for each kept value, the longest on top (tornado); pairs as two bars."""
    limits = None if series else (-1.0, 1.0)
    charts = [
        Bars(words(kept), label, {p: v if isinstance(v, tuple) else (v,) for p, v in by.items()}, series, limits)
        for kept, by in values.items()
    ]
    return Group(name, title, "", tuple(charts), 3 if len(charts) % 3 == 0 else min(2, len(charts)))


def scatter(table: pa.Table, study: Study, max_columns: int = 6) -> Group:
    """Kept values over parameters, at most six of each and 5000 points; many names are no axis."""
    few = [v for v in study.vary if v.names is None or len(v.names) <= NAMES]
    keep, vary = list(study.keep)[:max_columns], few[:max_columns]
    some = table.take(np.linspace(0, table.num_rows - 1, min(table.num_rows, MAX_POINTS)).astype(int))
    charts = []
    for name in keep:
        along, factor = shown_in(table, study, name)
        for v in vary:
            x = some[v.title].to_pylist()
            places = [v.names.index(value) for value in x] if v.names is not None else x
            curve = Curve("runs", np.asarray(places, float), factor * some[name].to_numpy(), POINTS)
            across = printed(labelled(table, v.title))
            title = f"{words(name)} over {words(v.title)}"
            charts.append(Panel(title, across, along, (curve,), x_names=tuple(v.names or ())))
    return Group("scatter", "Values over parameters", "", tuple(charts), max(1, min(3, len(vary))))


# --- the page ---


def _failures(table: pa.Table) -> list[str]:
    """The reasons of runs that failed, the first five."""
    failed = [e for e in table["error"].to_pylist() if e]
    return [f"{failed.count(e)} × {e}" for e in list(dict.fromkeys(failed))[:5]]


def _counted(table: pa.Table, study: Study) -> str:
    failed = sum(bool(e) for e in table["error"].to_pylist())
    return f"{table.num_rows} of {counted(study.total, 'run')}, {failed} failed"


def _task_page(study: Study, table: pa.Table, name: str) -> Report:
    """Page of a task: its ranking alone, since the varied values are names."""
    shown = SelectionReport(table, study)
    lead = f"Selection of motor and gearbox for the task `{name}`: {_counted(table, study)}."
    return Report(study.title or name, lead, shown.verdict, shown.chart, shown.parts(), FILE, shown.files())


FILE = "study.html"
STATISTICS = ("mean", "std. dev.", "min", "5 %", "50 %", "95 %", "max")


def _study_lines(study: Study, table: pa.Table, name: str) -> list[str]:
    """Statistics, failures, Sobol indices and selection as text."""
    rows = statistics(table, study, page=False)
    lines = [study.title or name, f"  {_counted(table, study)}", *(f"    {line}" for line in _failures(table))]
    width = max(len(r[0]) for r in rows) + 2
    lines.append("  " + " " * width + "".join(h.rjust(12) for h in STATISTICS))
    lines += ["  " + r[0].ljust(width) + "".join(_short(x).rjust(12) for x in r[1:]) for r in rows]
    for kept, by_parameter in _whole_indices(table, study).items():
        shares = ", ".join(f"{p} {s:.3f} ± {a:.3f} ({t:.3f} ± {b:.3f})" for p, (s, t, a, b) in by_parameter.items())
        lines.append(f"  Sobol indices of {kept}, first order (total), 95 % intervals: {shares}")
    return lines


def _whole_indices(table: pa.Table, study: Study) -> dict[str, dict[str, tuple[float, float, float, float]]]:
    """Sobol indices of a study whose design is for them, if all of its runs are there."""
    whole = study.design == "saltelli" and table.num_rows == study.total and not _failures(table)
    return sobol_indices(table, study) if whole else {}


def _study_page(study: Study, table: pa.Table, name: str) -> Report:
    rows = statistics(table, study, page=True)
    shown = [[row[0], *("" if np.isnan(x) else f"{x:.5g}" for x in row[1:])] for row in rows]
    parts: list[Any] = [Table("Statistics", ("value", *STATISTICS), shown, BLANK)]
    ranks = influence(table, study) if _with_order(study) else {}
    parts.append(bars("tornado", "Influence of the parameters", ranks, "rank correlation [-]"))
    if indices := _whole_indices(table, study):
        shares = {kept: {p: found[:2] for p, found in by.items()} for kept, by in indices.items()}
        parts.append(bars("sobol", "Sobol indices", shares, "Sobol index [-]", ("first order", "total")))
    parts.append(scatter(table, study))
    tables = {"statistics.csv": table_csv(["value", *STATISTICS], statistics(table, study))}
    if indices:
        head = ["value", "parameter", "first order", "total", "first order, 95 % ±", "total, 95 % ±"]
        tables["sobol.csv"] = table_csv(
            head, [[kept, p, *found] for kept, by in indices.items() for p, found in by.items()]
        )
    main, verdict = distributions(table, study), _result(table, study, ranks, indices)
    if study.select is not None:  # its chart and its tables come before the spread of the values
        selected = SelectionReport(table, study)
        tables, verdict = tables | selected.files(), selected.verdict
        main, parts = selected.chart, [*selected.parts(), main, *parts]
    parts.append(Prose("Runs that failed", _failures(table), listed=True))
    lead = f"Study `{name}`: {_counted(table, study)}."
    return Report(study.title or name, lead, verdict, main, parts, FILE, tables)


def _result(
    table: pa.Table, study: Study, ranks: dict[str, dict[str, float]], indices: dict[str, Any]
) -> Verdict | tuple[str, ...]:
    """The spread of the first values, and what they depend on most."""
    lines = []
    for name in list(study.keep)[:4]:
        label, factor = shown_in(table, study, name)
        x = factor * _finite(table, name)
        if len(x) == 0:
            lines.append(f"{label}: no run has a value.")
            continue
        low, high = np.quantile(x, [0.05, 0.95])
        most = max(ranks.get(name, {}).items(), key=lambda pair: abs(pair[1]), default=None)
        depends = f"; depends most on {most[0]} (rank correlation {most[1]:+.2f})" if most and most[1] else ""
        depends = _largest_index(indices[name]) if name in indices else depends
        lines.append(f"{label}: mean {x.mean():.5g}, 90 % of the runs within {low:.5g} and {high:.5g}{depends}.")
    return f"{_counted(table, study)}.", *lines


def _largest_index(indices: dict[str, Any]) -> str:
    """The parameter with the largest total index, or the two whose intervals do not separate them."""
    shown = [(p, total, margin) for p, (_, total, _, margin) in indices.items() if np.isfinite(total)]
    first, *others = sorted(shown, key=lambda found: -found[1])[:2] or [("", 0.0, 0.0)]
    if others and first[1] - others[0][1] <= np.hypot(first[2], others[0][2]):
        names = " or ".join(f"{p} ({total:.2f} ± {margin:.2f})" for p, total, margin in (first, *others))
        return f"; depends most on {names}, total Sobol indices; these runs do not decide which"
    return f"; depends most on {first[0]} (total Sobol index {first[1]:.2f} ± {first[2]:.2f})" if first[0] else ""


def summary(directory: Path) -> tuple[list[str], Verdict | None]:
    """The lines to print of a study in a directory, and its verdict if it selects.

    Raises InputError: a library that studies need is not installed, or the directory holds no study.
    """
    need("pyarrow", "Showing a study", "study")
    study, table = study_of(directory), read_table(directory)
    lines = [study.title] if study.axis is not None else _study_lines(study, table, directory.resolve().name)
    if study.select is None:
        return lines, None
    shown = SelectionReport(table, study)
    return [*lines, *shown.lines()], shown.verdict


def write_study(directory: Path, target: Path, pictures: Sequence[str] = ()) -> Path:
    """Write ``study.html`` and tables of a study into another directory, made if missing; on request pictures.

    Returns the path of the page.

    Raises InputError: the target is the directory of the study, where readers of Parquet try to read every file.
    """
    need("scipy", "The page of a study", "study")
    if target.resolve().is_relative_to(directory.resolve()):
        raise InputError(f"{target}: is within the directory of the runs; name another one with -o")
    study, table = study_of(directory), read_table(directory)
    page = _study_page if study.axis is None else _task_page
    return write_report(target, page(study, table, directory.resolve().name), pictures)
