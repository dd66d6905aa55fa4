"""The logs of a task: the usable logs, and the reasons why the others are not usable."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean
from ..prepared_log import Prepared
from ..readers.log_files import find_logs, read_log
from ..rig.measurement_model import numbers_of
from ..rig.residuals import start_point
from ..rig.rig_scenario import Rig
from ..task.file_formulas import Formula, names_in
from ..task.identification_file import Identification
from .prepare import prepared

MANY = 12  # values of what a condition names, up to which they are listed


def gathered(rig: Rig, directory: Path) -> tuple[list[Prepared], dict[str, str]]:
    """(the usable logs of a task, screened; reasons by name why the others cannot be used)."""
    task = rig.task
    paths = find_logs(task.logs.files, directory, task.logs.source)
    names = dict(zip(paths, distinct_names(paths), strict=True))
    logs: list[Prepared] = []
    left_out: dict[str, str] = {}
    for path, name in names.items():
        try:
            read = read_log(path, time=task.logs.time, decimal=task.logs.decimal)
            origin = {"file": path.name, "folder": path.resolve().parent.name}
            logs.append(prepared(task, replace(read, name=name), rig.units, origin))
        except InputError as problem:
            left_out[name] = problem.reason
    known = frozenset().union(*(log.facts for log in logs))
    for log in logs:
        if why := _unlike(rig, log, known):
            left_out[log.name] = why
    logs = [log for log in logs if log.name not in left_out]
    if len(left_out) >= max(1, len(logs)):
        name, why = next(iter(left_out.items()))
        more = f" (the first of {len(left_out)} of {len(paths)} logs that cannot be used)" if len(left_out) > 1 else ""
        raise InputError(f"{name}: {why}{more}")
    _refuse_conditions(rig, logs)
    refuse_leave_out(task, logs)
    return logs, {name: left_out[name] for name in names.values() if name in left_out}


def _refuse_conditions(rig: Rig, logs: Sequence[Prepared]) -> None:
    """A condition that no log meets."""
    task = rig.task
    conditions = [("logs.held_out", task.logs.held_out, [log for log in logs if log.held_out])]
    conditions.append(("fit.first", task.fit.first, [log for log in logs if log.first and not log.held_out]))
    for key, text, met in conditions:
        if text is None or met:
            continue
        named = [n for n in sorted(Formula(text).names) if len({log.facts[n] for log in logs}) < MANY]
        there = "; ".join(
            f"{n} is {', '.join(f'{v:g}' if isinstance(v, float) else str(v) for v in sorted({log.facts[n] for log in logs}, key=str))}"
            for n in named
        )
        where = f", where {there}" if there else ""
        raise InputError(f"{text!r} holds for none of the logs{where}; change the condition, or leave the key out", key)


def distinct_names(paths: list[Path]) -> list[str]:
    """Names of files; duplicate names come with the directories that tell them apart."""
    names = [path.name for path in paths]
    depth = 1
    while len(set(names)) < len(names) and depth < max(len(path.parts) for path in paths):
        depth += 1
        twice = {name for name in names if names.count(name) > 1}
        names = ["/".join(p.parts[-depth:]) if n in twice else n for p, n in zip(paths, names, strict=True)]
    return names


def _unlike(rig: Rig, log: Prepared, known: frozenset[str]) -> str:
    """Why the rig cannot be made with the header of a log; empty if it can.

    known: what the headers of all logs have.
    """
    own = {name: p.start for name, p in rig.task.nuisance.items()}
    values: dict[str, Any] = {**log.facts, **start_point(rig.task, []).values, **own}
    phases = range(-1, len(rig.task.phases))
    try:
        for channel in rig.task.measured.values():
            numbers_of(channel, values)
        for rung in range(len(rig.rungs())):
            for phase in phases:
                if lacking := _lacking(rig.formulas(rung, phase), values, known):
                    return lacking
                changes = rig.changes(values, rung, phase)
                if rung == 0:
                    rig.start(log, rig.built(changes), changes)
    except InputError as problem:
        return str(problem)
    return ""


def _lacking(formulas: Mapping[str, Any], values: Mapping[str, Any], known: frozenset[str]) -> str:
    """Header entries that a log lacks and others have."""
    for key, formula in formulas.items():
        for name in sorted(names_in(formula)):
            if name not in values and name in known:
                return f"has no {name}, which key set.{key} names; add it to the file, or give it with logs.header"
    return ""


def refuse_leave_out(task: Identification, logs: Sequence[Prepared]) -> None:
    """Refuse a key of ``fit.leave_out`` that does not divide the fitted logs."""
    train = [log for log in logs if not log.held_out]
    for key in task.fit.leave_out:
        lacking = [log.name for log in train if key not in log.facts]
        if lacking:
            known = sorted(set().union(*(log.facts for log in train)))
            meant = did_you_mean(key, known, "give it with logs.header")
            raise InputError(f"{lacking[0]} has no {key!r} in its header; {meant}", "fit.leave_out")
        values = {log.facts[key] for log in train}
        if len(values) < 2:
            only = ", ".join(map(str, values))
            raise InputError(f"{key!r} is {only} in all fitted logs; leave it out of the list", "fit.leave_out")
