"""Task files: what an axis has to do, and which motors and gearboxes may do it, read as a study of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import argument
from ..inputs.toml_files import read_toml
from ..inputs.validation import shown, unknown_key
from ..model.task import Task
from ..simulation.scenario import from_tables
from .axis import AxisTask
from .file import find_sheets
from .records import kind_of_record, names_that_fit
from .select import Selection
from .study import Study

TABLES = ("title", "task", "load", "controller", "motor", "gearbox", "vary", "select")
OBJECTIVES = {"energy": "least", "tracking_error_peak": "least"}
GAINS = {"position": {"gain": 1.0}, "speed": {"gain": 1.0}}  # which the rule replaces
CONTROLLER = {"sample_time": 125e-6, "encoder": {"lines": 2048}, "current": {"kind": "pi"}}
POSITION = {"sample_time": 1e-3, "feedforward": 1.0}


@checked
def load_task(path: str | Path) -> Study:
    """Read a task file.

    Its tables are those of a scenario (`[load]`, `[controller]` with its reference but without gains, `[motor]` and `[gearbox]` with
    keys beside a record), a table `[task]` (`AxisTask`), and those of a study: `[[vary]]` for motors and gearboxes, by default the
    whole catalogue, and `[select]`.

    Parameters
    ----------
    path : str or Path
        The task file (TOML).

    Returns
    -------
    Study
        The task, for `select`.

    Raises
    ------
    InputError
        The file cannot be used. The message names the file, the key, the value and the remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> type(lm.studies.load_task("examples/select-axis.toml")).__name__
    'Study'
    """
    path = Path(path)
    try:
        return task_of(read_toml(path, "a task"), path.parent)
    except InputError as error:
        text = str(error)
        raise error if text.startswith(f"{path}:") else InputError(f"{path}: {text}") from None


def task_of(tables: dict[str, Any], directory: Path = Path()) -> Study:
    """The study of the tables of a task file.

    Raises
    ------
    InputError
    """
    for key in tables:
        if key not in TABLES:
            raise InputError(f"key {key}: {unknown_key(key, TABLES)}")
    for key in ("task", "load", "controller"):
        if not isinstance(tables.get(key), dict):
            raise InputError(f"key {key}: must be a table [{key}]; add it")
    task = AxisTask(**tables["task"])
    controller = _controller(tables["controller"])
    time = argument("controller.sample_time", controller["sample_time"], "s")
    written = {
        "title": tables.get("title", ""),
        "load": tables["load"],
        "controller": controller,
        "motor": _table(tables, "motor"),
        "gearbox": _table(tables, "gearbox"),
        "task": {key: value for key, value in tables["task"].items() if key in Task.model_fields},
        "simulation": {"duration": task.cycle, "sample_interval": time},
    }
    vary = _vary(tables, directory)
    for entry in vary:
        if (
            isinstance(entry, dict)
            and kind_of_record(str(entry.get("key")))
            and "from" not in written[entry["key"].split(".")[0]]
        ):
            _first(written, entry)
    select = dict(tables.get("select", {})) if isinstance(tables.get("select", {}), dict) else tables["select"]
    if not isinstance(select, dict):
        raise InputError(f"key select: {shown(select)} must be a table, such as [select]")
    limits = {name: bound.model_dump(exclude_none=True) for name, bound in task.limits().items()}
    chosen = Selection(**{"objectives": OBJECTIVES} | select | {"limits": limits | select.get("limits", {})})
    return Study(
        title=written["title"],
        scenario=from_tables(written),
        written=written,
        vary=tuple(vary),
        axis=task,
        select=chosen,
    )


def _table(tables: dict[str, Any], key: str) -> dict[str, Any]:
    """Values of a motor or gearbox, beside its record or in full."""
    given = tables.get(key, {})
    if isinstance(given, str):
        return {"from": given}
    if not isinstance(given, dict):
        raise InputError(f"key {key}: {shown(given)} must be a table [{key}], or the name of a record")
    return dict(given)


def _controller(given: dict[str, Any]) -> dict[str, Any]:
    """A controller of which the rule gives the gains."""
    for loop, gains in (("position", ("gain",)), ("speed", ("gain", "integral_gain", "integral_time"))):
        for key in gains:
            if isinstance(given.get(loop), dict) and key in given[loop]:
                raise InputError(f"key controller.{loop}.{key}: follows from the rule for each pair; leave it out")
    out = CONTROLLER | given
    out["position"] = POSITION | given.get("position", {}) | GAINS["position"]
    out["speed"] = given.get("speed", {}) | GAINS["speed"]
    return out


def _vary(tables: dict[str, Any], directory: Path) -> list[Any]:
    """Varied values: those of the file, else all records of parts that the file does not name or write out."""
    entries = tables.get("vary")
    if entries is None:
        entries = [{"key": kind, "catalogue": {}} for kind in ("gearbox", "motor") if not _whole(tables, kind)]
    if not isinstance(entries, list):
        raise InputError(f"key vary: {shown(entries)} must be tables; write [[vary]] with double brackets")
    for entry in entries:
        find_sheets(entry, directory)
    return entries


def _whole(tables: dict[str, Any], kind: str) -> bool:
    """Whether the file names a record, or writes a part out."""
    table = _table(tables, kind)
    return "from" in table or {"motor": "rotor_inertia", "gearbox": "stiffness"}[kind] in table


def _first(written: dict[str, Any], entry: dict[str, Any]) -> None:
    """Puts the first record that can be run into the base, so that there is one."""
    kind = entry["key"].split(".")[0]
    names = entry.get("values")
    if names is None:
        try:
            names = names_that_fit(kind, entry.get("catalogue", {}))
        except ValueError as error:
            raise InputError(f"vary: {error}") from None
    problem: InputError | None = None
    for name in names:
        try:
            _part_of(kind, name, written[kind])
        except InputError as error:
            problem = problem or error
            continue
        written[kind] = {"from": name} | written[kind]
        return
    raise problem or InputError(f"vary: has no {kind}; name at least one")


def _part_of(kind: str, name: Any, beside: dict[str, Any]) -> None:
    """Sees that a record can be run.

    Raises
    ------
    InputError
    """
    from ..data_sheets.components import gearbox_table, motor_table

    (gearbox_table if kind == "gearbox" else motor_table)(name, beside)
