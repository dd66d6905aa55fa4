"""Selection of motor and gearbox for a task: every pair judged and run, ranked, as one table."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from ...inputs.argument_checks import checked
from ...inputs.quantities import Count
from ...sizing.axis_task.cycle_demands import COLUMNS
from ..runs.read_table import read_table, unit_of
from ..runs.run_study import study
from ..study.study_definition import Study
from .ranking import candidates, pareto_front
from .task_file import load_task

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray

MEANINGS = {
    "fits": "whether it keeps all limits",
    "front": "whether it fits and none that fits is better in one objective without being worse in another",
    "violated": "rules of the drive check or columns whose limits it violates",
    "why": "the same in words",
    "tightest": "limit of the drive check that is used most",
    "error": "why the run failed",
}


@checked
def select(
    task: Study | str | Path,
    directory: str | Path | None = None,
    *,
    threads: Count | None = None,
    executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> xarray.Dataset:
    """Try every motor with every gearbox on a task.

    A pair that the rules of the manufacturers refuse, for the motion of rigid parts that the task requires, is not run. All others
    get gains by rule and are simulated over the cycle until it repeats.

    Parameters
    ----------
    task : Study, str or Path
        Result of `load_task`, or its file.
    directory : str or Path, optional
        Directory of the rows, as for a study; called again, the selection resumes there. Default: nothing is kept.
    threads, executor, progress
        As in `study`.

    Returns
    -------
    xarray.Dataset
        Over ``pair``, the best first: the names of motor and gearbox, the columns of docs/select.md with their units, `fits`,
        `front`, `violated` and `why`. ``.to_dataframe()`` makes a table of pandas.

    Raises
    ------
    InputError
        The task cannot be read, or the directory contains something else.

    Examples
    --------
    >>> import lostmotion as lm
    >>> pairs = lm.select("examples/select-axis.toml")  # doctest: +SKIP
    >>> pairs.to_dataframe().head()  # doctest: +SKIP
    """
    what = task if isinstance(task, Study) else load_task(task)
    with TemporaryDirectory() as temporary:
        where = study(
            what,
            Path(temporary) / "rows" if directory is None else directory,
            threads=threads,
            executor=executor,
            progress=progress,
        )
        return ranked_dataset(read_table(where), what)


def ranked_dataset(table: pa.Table, what: Study) -> xarray.Dataset:
    """The rows of a task, ranked."""
    import xarray as xr

    assert what.select is not None
    ranked = candidates(table, what)
    front = {c.run for c in pareto_front(ranked, what.select)}
    place = {run: k for k, run in enumerate(table["run"].to_pylist())}
    order = np.array([place[c.run] for c in ranked], dtype=int)
    said = {
        "fits": [c.fits for c in ranked],
        "front": [c.run in front for c in ranked],
        "violated": [" ".join(c.violated) for c in ranked],
        "why": [c.why for c in ranked],
        "tightest": [c.tightest for c in ranked],
    }
    variables = {name: ("pair", np.array(values), {"long_name": MEANINGS[name]}) for name, values in said.items()}
    for name in table.column_names:
        if name in said:
            continue
        values = np.array(table[name].to_pylist())[order]
        about = {"units": unit_of(table, name), "long_name": MEANINGS.get(name) or COLUMNS.get(name, ("", ""))[1]}
        variables[name] = ("pair", values, {key: text for key, text in about.items() if text})
    found = xr.Dataset(variables, attrs={"title": what.title})
    return found.set_coords([v.title for v in what.vary])
