"""The report of a study: statistics, distributions, correlations, Sobol indices, scatter, the best designs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, need
from ..studies.engine import study_of
from ..studies.study import Study
from ..studies.table import labelled, read_table
from ..studies.vary import Vary
from .pages import save_figure, table_csv, write_text
from .panels import STYLES
from .plots import Picture, in_our_looks
from .study_selection import show_selection

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure

MAX_LABELS = 20  # names along an axis
INK, ACCENT = STYLES["2-DOF-NL"]["color"], STYLES["2-DOF-L"]["color"]


def figures_of(directory: Path) -> Path:
    """Where the figures go: not among the data, all of which readers of Parquet directories try to read."""
    whole = directory.resolve()
    return whole.with_name(f"{whole.name}-figures")


def statistics(table: pa.Table, study: Study) -> list[list[Any]]:
    """Name, mean, standard deviation, least, 5 %, 50 %, 95 %, largest of each kept value."""
    rows = []
    for name in study.keep:
        x = _finite(table, name)
        if len(x) == 0:
            rows.append([labelled(table, name), *[np.nan] * 7])
            continue
        quantiles = np.quantile(x, [0.0, 0.05, 0.5, 0.95, 1.0]).tolist()
        rows.append([labelled(table, name), float(x.mean()), float(x.std()), *quantiles])
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


def sobol_indices(table: pa.Table, study: Study) -> dict[str, dict[str, tuple[float, float]]]:
    """(first order, total) of each parameter for each kept value; for the design saltelli only.

    Raises
    ------
    InputError
        Runs are missing or failed.
    """
    from SALib.analyze import sobol

    names = [v.title for v in study.vary]
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    out = {}
    for name in study.keep:
        y = table[name].to_numpy()
        if len(y) != study.total or not np.all(np.isfinite(y)):
            raise InputError(f"Sobol indices of {name} need all {study.total} runs, without failures")
        found = sobol.analyze(problem, y, calc_second_order=True, seed=study.seed)
        out[name] = {p: (float(found["S1"][k]), float(found["ST"][k])) for k, p in enumerate(names)}
    return out


def best_lines(directory: Path, text: str) -> list[str]:
    """The ten best runs as text, for ``COLUMN``, ``COLUMN:least`` or ``COLUMN:largest``.

    Raises
    ------
    InputError
        There is no such column, or direction.
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
    return f"{value:.6g}" if isinstance(value, int | float) else str(value)


def best_runs(table: pa.Table, name: str, count: int = 10, *, largest: bool = False) -> pa.Table:
    """The rows with the least (or largest) values of a column."""
    import pyarrow as pa

    numbers = [f.name for f in table.schema if pa.types.is_floating(f.type) or pa.types.is_integer(f.type)]
    if name not in numbers:
        raise InputError(f"--best {name}: there is no such column of numbers; they are {', '.join(numbers)}")
    good = table.filter(np.isfinite(table[name].to_numpy()))
    return good.sort_by([(name, "descending" if largest else "ascending")]).slice(0, count)


def _grid(count: int, width: float = 3.3, height: float = 2.6) -> tuple[Figure, int, int]:
    columns = min(3, count)
    rows = -(-count // columns)
    return Picture(figsize=(max(4.5, width * columns), height * rows)), rows, columns


@in_our_looks
def distributions(table: pa.Table, study: Study) -> Figure:
    """A histogram of each kept value, with its 5, 50 and 95 %."""
    figure, rows, columns = _grid(len(study.keep))
    for k, name in enumerate(study.keep):
        axes = figure.add_subplot(rows, columns, k + 1)
        x = _finite(table, name)
        if len(x):
            axes.hist(x, bins=min(60, max(5, round(len(x) ** 0.5))), color=INK)
            for q in np.quantile(x, [0.05, 0.5, 0.95]):
                axes.axvline(q, color=ACCENT, linewidth=1.2)
        axes.set(xlabel=labelled(table, name), ylabel="runs")
    return figure


@in_our_looks
def bars(values: dict[str, dict[str, Any]], label: str) -> Figure:
    """Horizontal bars by parameter for each kept value, the longest on top (tornado); pairs as two bars."""
    figure, rows, columns = _grid(len(values), 3.8, 0.7 + 0.35 * max(len(v) for v in values.values()) + 0.9)
    for k, (name, by_parameter) in enumerate(values.items()):
        axes = figure.add_subplot(rows, columns, k + 1)
        order = sorted(by_parameter, key=lambda p: abs(np.max(by_parameter[p])))
        y = np.arange(len(order))
        if order and isinstance(by_parameter[order[0]], tuple):
            axes.barh(y + 0.2, [by_parameter[p][1] for p in order], 0.4, color="0.7", label="total")
            axes.barh(y - 0.2, [by_parameter[p][0] for p in order], 0.4, color=INK, label="first order")
            axes.legend(fontsize=8)
        else:
            axes.barh(y, [by_parameter[p] for p in order], 0.7, color=INK)
            axes.axvline(0.0, color="0.3", linewidth=0.8)
            axes.set_xlim(-1.0, 1.0)
        axes.set_yticks(y, order)
        axes.set(title=name, xlabel=label)
        axes.title.set_fontsize(10)
    return figure


@in_our_looks
def scatter(table: pa.Table, study: Study, max_columns: int = 6) -> Figure:
    """Kept values over parameters, at most six of each and 5000 points."""
    keep, vary = list(study.keep)[:max_columns], study.vary[:max_columns]
    some = table.take(np.linspace(0, table.num_rows - 1, min(table.num_rows, 5000)).astype(int))
    figure = Picture(figsize=(max(4.5, 2.6 * len(vary)), 2.3 * len(keep)))
    for r, name in enumerate(keep):
        for c, v in enumerate(vary):
            axes = figure.add_subplot(len(keep), len(vary), r * len(vary) + c + 1)
            x = some[v.title].to_pylist()
            places = [v.names.index(value) for value in x] if v.names is not None else x
            axes.plot(places, some[name].to_numpy(), ".", markersize=2.5, color=INK, alpha=0.5)
            axes.tick_params(labelsize=7)
            if v.names is not None:
                few = len(v.names) <= MAX_LABELS and r == len(keep) - 1
                axes.set_xticks(range(len(v.names)), v.names if few else [""] * len(v.names), rotation=90, fontsize=6)
            else:
                axes.locator_params(axis="x", nbins=4)
            if r == len(keep) - 1:
                axes.set_xlabel(labelled(table, v.title), fontsize=8)
            if c == 0:
                axes.set_ylabel(labelled(table, name), fontsize=8)
    return figure


def _show_task(study: Study, table: pa.Table, view: Path) -> list[str]:
    """Of a task: its ranking alone, since what varies are names."""
    view.mkdir(exist_ok=True)
    return [study.title, *show_selection(table, study, view), f"selection.csv, limits.csv and pareto.png are in {view}"]


def show(directory: Path) -> list[str]:
    """Writes figures and statistics.csv into a directory beside that of the data; returns what to print."""
    need("pyarrow", "Showing a study", "study")
    need("scipy", "Showing a study", "study")
    study, table = study_of(directory), read_table(directory)
    if study.axis is not None:
        return _show_task(study, table, figures_of(directory))
    rows = statistics(table, study)
    header = ["", "mean", "std. dev.", "min", "5 %", "50 %", "95 %", "max"]
    failed = [e for e in table["error"].to_pylist() if e]
    lines = [study.title or str(directory), f"  {table.num_rows} of {study.total} runs, {len(failed)} failed"]
    lines += [f"    {failed.count(e)} x {e}" for e in list(dict.fromkeys(failed))[:5]]
    width = max(len(r[0]) for r in rows) + 2
    lines.append("  " + header[0].ljust(width) + "".join(h.rjust(12) for h in header[1:]))
    lines += ["  " + r[0].ljust(width) + "".join(f"{x:12.5g}" for x in r[1:]) for r in rows]
    view = figures_of(directory)
    view.mkdir(exist_ok=True)
    write_text(view / "statistics.csv", table_csv(["value", *header[1:]], rows))
    save_figure(distributions(table, study), view, "distributions")
    if _with_order(study):
        save_figure(bars(influence(table, study), "rank correlation [-]"), view, "tornado")
    save_figure(scatter(table, study), view, "scatter")
    if study.design == "saltelli" and table.num_rows == study.total and not failed:
        indices = sobol_indices(table, study)
        save_figure(bars(indices, "Sobol index [-]"), view, "sobol")
        for name, by_parameter in indices.items():
            shares = ", ".join(f"{p} {s1:.3f} ({st:.3f})" for p, (s1, st) in by_parameter.items())
            lines.append(f"  Sobol indices of {name}, first order (total): {shares}")
    if study.select is not None:
        lines += show_selection(table, study, view)
    lines.append(f"Figures and statistics are in {view}")
    return lines
