"""Logs as the fit takes them: channels in SI, what the formulas may name, phases, and which logs are held out."""

import itertools
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...units.practical import counted
from ..prepared_log import Prepared, Segment, fact_names, facts_of
from ..readers.channel_units import channel_unit
from ..readers.log import Channel, Log
from ..task.file_formulas import Formula, names_in
from ..task.identification_file import FormulaText, Identification, InputChannel, MeasuredChannel
from .screening import screened

DEFAULT = "taken from logs.header: "  # how a note on such a value begins
NUMBER = re.compile(r"-?\d[\d.e+-]*%?")

TRANSLATED = {"m": "rad", "m/s": "rad/s", "N": "N*m"}  # of a slide, and of a shaft


def alike(note: str) -> str:
    """Part of a note that notes of other logs share: all but its numbers, and with the value of `logs.header` that it names."""
    return note if note.startswith(DEFAULT) else NUMBER.sub("#", note)


def prepared(
    task: Identification, log: Log, units: Mapping[str, str], origin: Mapping[str, str] | None = None
) -> Prepared:
    """A log of the task, screened.

    units: SI units of inputs and measured variables of the rig by name.
    origin: what formulas may name of its file, ``file`` and ``folder``, unless its header has the same key.
    """
    measured = {name: m.channel for name, m in task.measured.items()}
    inputs = {name: i.channel for name, i in task.inputs.items()}
    header = {**task.logs.header, **log.header}
    for key in sorted(task.logs.header.keys() - log.header.keys()):
        log = log.noted(f"{DEFAULT}{key} = {task.logs.header[key]!r}, which the file lacks")
    header |= {key: float(channel in log.channels) for key, channel in task.logs.channels.items()}
    absent = {
        i.channel: Channel(np.full(len(log.time), i.default))
        for i in task.inputs.values()
        if i.default is not None and i.channel not in log.channels
    }
    log = _in_si(task, replace(log, channels={**log.channels, **absent}), units)
    acting = (*inputs.values(), *_switches(task, log))
    log = screened(
        Log(log.name, log.time, log.channels, header, log.notes), measured.values(), acting, task.logs.stated
    )
    keep = log.time - log.time[0] >= task.logs.first
    if task.logs.last is not None:
        keep &= log.time - log.time[0] <= task.logs.last
    if keep.sum() < 10:
        raise InputError(
            f"lasts {log.duration:.4g} s, and logs.first and logs.last leave {keep.sum()} samples of it", where=log.name
        )
    if not keep.all():
        log = log.only(keep, f"{counted(np.sum(~keep), 'sample')} before logs.first or after logs.last are left out")
    origin = origin or {}
    for name in origin.keys() & header.keys():
        log = log.noted(f"{name} in its header counts, in place of that of its own file")
    facts = {**origin, **facts_of(log)}
    for name in (*task.parameters, *task.nuisance):
        if name in facts:
            log = log.noted(
                f"{name} is known of the log, and a parameter of the task, which counts; rename one of them"
            )

    first = task.fit.first is not None and bool(_fact(task.fit.first, facts, log, "fit.first"))
    held_out = task.logs.held_out is not None and bool(_fact(task.logs.held_out, facts, log, "logs.held_out"))
    return Prepared(
        log,
        log.time - log.time[0],
        {name: log.values(channel) for name, channel in inputs.items()},
        {name: log.values(channel) for name, channel in measured.items()},
        facts,
        _segments(task, log, facts),
        held_out,
        _weights(task, log, facts),
        first,
    )


def _in_si(task: Identification, log: Log, units: Mapping[str, str]) -> Log:
    """The log with its channels in SI; one whose unit is not known stays as it is, unless the task names it."""
    entries = [(f"inputs.{name}", i.channel, i.unit, units.get(name, "")) for name, i in task.inputs.items()]
    for name, m in task.measured.items():  # with a scale, a channel without a unit may count anything
        of_rig = "" if "scale" in m.model_fields_set else units.get(m.variable, "")
        entries.append((f"measured.{name}", m.channel, m.unit, of_rig))
    known: dict[str, tuple[float, str]] = {}
    for where, channel, written, kind in entries:
        log.values(channel)  # refuses a name that is none
        found = channel_unit(written, log.channels[channel].unit, kind, f"{log.name}: {where}")
        if known.setdefault(channel, found)[0] != found[0]:
            raise InputError(
                f"{where}: channel {channel} has another unit elsewhere in the task; give one", where=log.name
            )
    _refuse_other_kinds(task, log, known, units)
    named = _named(task)
    channels = {}
    for name, c in log.channels.items():
        if name not in known:
            with suppress(InputError):
                known[name] = channel_unit("", c.unit, "", "")
        if name not in known and named & {name, *fact_names(name)}:
            raise InputError(
                f"channel {name}: the unit {c.unit!r} is not known, and a formula names the channel; "
                f"give the channel in SI, or with a unit that is known",
                where=log.name,
            )
        factor, unit = known.get(name, (1.0, c.unit))
        channels[name] = c if factor == 1.0 and unit == c.unit else Channel(c.values * factor, unit)
    return replace(log, channels=channels)


def _refuse_other_kinds(
    task: Identification, log: Log, known: Mapping[str, tuple[float, str]], units: Mapping[str, str]
) -> None:
    """Refuses a channel of another kind than what it acts as or is compared with, unless a factor is given."""
    both: list[tuple[str, str, str, InputChannel | MeasuredChannel]] = []
    both += [("inputs", n, n, i) for n, i in task.inputs.items() if not n.endswith("_given_speed")]
    both += [("measured", n, m.variable, m) for n, m in task.measured.items()]
    for table, name, variable, entry in both:
        unit, wanted = known[entry.channel][1], units.get(variable, "")
        if unit and wanted and unit != wanted and "scale" not in entry.model_fields_set:
            of_rig = "a multiple of the rated torque or voltage" if wanted == "1" else f"in {wanted}"
            such = 'such as 1/rated_torque of a torque, or "torque_constant" of a current'
            if TRANSLATED.get(unit, unit) == TRANSLATED.get(wanted, wanted):
                such = "such as a radius, or compare it with a slide"
            raise InputError(
                f"{table}.{name}: channel {entry.channel} is in {unit}, and {variable} is {of_rig}; give a scale that "
                f"turns one into the other, {such}",
                where=log.name,
            )


def _switches(task: Identification, log: Log) -> list[str]:
    """Channels of a log that phases and weights name."""
    formulas = (task.logs.weight, *(phase.when for phase in task.phases))
    return [name for text in formulas for name in Formula(text).names if name in log.channels]


def first_values_named(task: Identification) -> set[str]:
    """Measured channels whose first value a formula names."""
    named = _named(task)
    return {name for name, m in task.measured.items() if fact_names(m.channel)[0] in named}


def _named(task: Identification) -> frozenset[str]:
    """Names in the formulas of a task."""
    return names_in(task.model_dump(include={"set", "phases", "ladder", "logs", "measured", "inputs", "monitor"}))


def _fact(text: Any, facts: Mapping[str, Any], log: Log, key: str) -> Any:
    try:
        return Formula(text).value(facts)
    except ValueError as problem:
        raise InputError(problem, key, where=log.name) from None


def _segments(task: Identification, log: Log, facts: Mapping[str, Any]) -> tuple[Segment, ...]:
    """Phases of the rig with their intervals."""
    n = len(log.time)
    phase = np.full(n, -1)
    for k, entry in enumerate(task.phases):
        phase[_by_sample(entry.when, log, facts, f"phases[{k}].when") != 0.0] = k
    edges = [0, *(np.flatnonzero(np.diff(phase)) + 1).tolist(), n]
    return tuple(Segment(a, b, int(phase[a])) for a, b in itertools.pairwise(edges))


def _weights(task: Identification, log: Log, facts: Mapping[str, Any]) -> np.ndarray:
    found = _by_sample(task.logs.weight, log, facts, "logs.weight")
    if not np.all(found > 0.0):
        k = int(np.argmin(found))
        raise InputError(
            f"{task.logs.weight!r} is {found[k]:g} at {log.time[k]:.4g} s; it must be positive",
            "logs.weight",
            where=log.name,
        )
    return found


def _by_sample(text: FormulaText, log: Log, facts: Mapping[str, Any], key: str) -> np.ndarray:
    """A formula of the header and of channels that switch, for each sample."""
    names = [name for name in Formula(text).names if name in log.channels]
    if not names:
        return np.full(len(log.time), float(_fact(text, facts, log, key)))
    rows = np.array([log.values(name) for name in names]).T
    distinct, which = np.unique(rows, axis=0, return_inverse=True)
    if len(distinct) > 1000:
        raise InputError(
            f"{text!r} names a channel with {len(distinct)} values; name one that switches", key, where=log.name
        )
    values = [float(_fact(text, {**facts, **dict(zip(names, row, strict=True))}, log, key)) for row in distinct]
    return np.array(values)[which.ravel()]
