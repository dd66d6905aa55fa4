"""Study files, and studies as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast

from ...errors import InputError, prefixed
from ...inputs.argument_checks import checked
from ...inputs.toml_files import read_toml
from ...simulation.forms.axis_form import long_form
from ...simulation.runs.loading import load
from ...simulation.runs.result_files import FORMATS
from ...simulation.scenario.scenario_files import find_base, read_tables
from .records_that_vary import kind_of_record, names_of
from .study_definition import Study


@checked
def load_study(path: str | Path) -> Study:
    """Read a study file.

    Parameters
    ----------
    path : str or Path
        The study file (TOML). Its key `base` names the scenario file or saved result, relative to it; `set` may change its values.

    Returns
    -------
    Study
        The study, for `study`.

    Raises
    ------
    InputError
        The file cannot be used. The message names the file, the key, the value and the remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.studies.load_study("examples/tolerance.toml").runs
    256
    """
    path = Path(path)
    data = read_toml(path, "a study")
    base = data.pop("base", None)
    if not isinstance(base, str):
        raise InputError("must name the scenario file, or the saved result, that is varied", "base", where=path)
    changes = data.pop("set", {})
    if not isinstance(changes, dict):
        raise InputError(f'{path}: key set: must be a table, such as set = {{ "load.inertia" = 2 }}')
    where = find_base(base, path)
    scenario = load(where, changes)
    written = {} if where.suffix in FORMATS else read_tables(where, changes)  # a result has all values written out
    written = long_form(written) if "axis" in written else written
    with prefixed(path):
        for entry in data.get("vary", []) if isinstance(data.get("vary"), list) else []:
            find_sheets(entry, path.parent)
        return Study(scenario=cast("Any", scenario), written=written, **data)


def find_sheets(entry: Any, directory: Path) -> None:
    """Files and directories of data sheets among the values are relative to the study file."""
    if not isinstance(entry, dict) or not isinstance(entry.get("key"), str):
        return
    kind = kind_of_record(entry["key"])
    if kind is None or not isinstance(entry.get("values"), list):
        return
    try:
        entry["values"] = names_of(kind, entry["values"], directory.resolve())
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"vary: of {entry['key']}: {error}") from None


def from_json(text: str) -> Study:
    """The study that `to_json` wrote."""
    return Study(**json.loads(text))


def to_json(study: Study) -> str:
    """The study as JSON, with its base scenario."""
    return study.model_dump_json(exclude_none=True)
