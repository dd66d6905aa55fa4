"""Pauses of the recorder: a log is split there, and each run behind a pause begins at the state that was measured.

What acts during a pause is not known, so no run may lead through it. Behind it the angle and the speed of the measured shaft
follow from a cubic through the first samples. They are fitted with the parameters, as two values that the log has of its own.
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...model.shaft_ratio import turns
from ...model.torsion import Rigid
from ..prepared_log import Prepared, Segment
from ..rig.measured_motion import ShownMotion, shown_motion
from ..rig.measurement_model import numbers_of
from ..rig.residuals import start_point
from ..rig.rig_scenario import Rig
from ..task.file_formulas import number
from ..task.free_parameters import FreeParameter
from ..task.identification_file import FormulaText, Identification
from .prepare import first_values_named
from .screening import PAUSE

LEAST = 10  # samples of a part
SAMPLES = 15  # of the cubic
WIDE = 10.0  # standard errors of the cubic: it may be too stiff for the motion, and the fit knows better
FILTERS = 5.0  # time constants of a filter, after which it has forgotten what was before the pause
OFFSETS = ("restart_angle", "restart_speed")  # of the state behind a pause, in standard errors


@dataclass(frozen=True)
class Restart(ShownMotion):
    """A measured channel that shows the state of a rig that moves as one shaft."""

    ratios: Mapping[str, float]  # turns of each shaft for one of the measured one
    keys: Mapping[str, Mapping[str, str]]  # keys of `initial` for speed and angle of each shaft


def split_at_pauses(rig: Rig, logs: Sequence[Prepared]) -> tuple[Rig, list[Prepared], dict[str, str]]:
    """(rig, parts of the logs, why logs are left out) without pauses.

    A rig whose state no channel shows cannot begin anew: its logs are used up to the first pause over which an input changes.
    """
    parts: list[Prepared] = []
    left_out: dict[str, str] = {}
    for log in logs:
        try:
            parts += _parts(rig, log)
        except InputError as problem:
            left_out[log.name] = str(problem)
    if logs and not parts:
        name, why = next(iter(left_out.items()))
        raise InputError(f"{name}: {why}")
    if any(segment.initial for log in parts for segment in log.segments):
        rig = copy.copy(rig)
        rig.task = _with_offsets(rig.task)
    return rig, parts, left_out


def _with_offsets(task: Identification) -> Identification:
    offset = FreeParameter(start=0.0, min=-np.inf, scale=1.0, tolerance=1.96 * WIDE)
    return task.model_copy(update={"nuisance": {**task.nuisance, **dict.fromkeys(OFFSETS, offset)}})


def _parts(rig: Rig, log: Prepared) -> list[Prepared]:
    begins = [0, *(np.flatnonzero(np.diff(log.time) > PAUSE * log.log.interval) + 1).tolist()]
    late = _late(rig.task, log)
    if len(begins) == 1 and late == 0:
        return [log]
    ends = [*begins[1:], len(log.time)]
    begins[0] = late
    known = {**log.facts, **start_point(rig.task, [log]).of(log)}
    try:
        shown = shown_by(rig, log, known)
    except InputError as problem:
        return [_up_to_first_pause(log, begins, ends, str(problem))]
    found = []
    for begin, end in zip(begins, ends, strict=True):
        part = _part(log, begin, end)
        if begin > 0:
            part = _restarted(rig, part, shown, known) if part is not None else None
        if part is not None:
            found.append(part)
    if not found:
        raise InputError(f"has fewer than {LEAST} samples between all of its pauses; record longer ones")
    lost = len(begins) - len(found)
    text = f"split at its pauses into {len(found)} parts; behind each the run begins at the state measured there"
    text += f"; {lost} more with fewer than {LEAST} samples are left out" if lost else ""
    if len(begins) > 1:
        found[0] = replace(found[0], log=found[0].log.noted(text))
    return found


def _late(task: Identification, log: Prepared) -> int:
    """The first sample at which every channel has a number whose first value a formula names."""
    wanted = first_values_named(task)
    return max((int(np.argmax(v)) for v, n in zip(log.valid, log.measured, strict=True) if n in wanted), default=0)


def shown_by(rig: Rig, log: Prepared, known: Mapping[str, Any]) -> Restart:
    """The channel that shows the state. Raises InputError: none does: why."""
    built = rig.built(rig.changes(known, 0, log.segments[0].phase))
    scenario = built.scenario
    if scenario.axes() or built.remembers:
        raise InputError("no channel shows the states of its controller")
    shown, train = shown_motion(rig), scenario.train()
    if coupling := next((key for key, _ in train.couplings()), None):
        raise InputError(f"no channel shows the state of {coupling}")
    for name, gear in train.gears.items():
        if not isinstance(gear.stiffness, Rigid):
            raise InputError(f"no channel shows the twist of gears.{name}")
    ratios = {s: n for s in train.shafts if (n := turns(train, s, shown.shaft)) is not None}
    if apart := train.shafts.keys() - ratios.keys():
        raise InputError(
            f"shaft {min(apart)} does not turn with {shown.shaft}, which the channel {shown.channel} shows"
        )
    keys = {s: {key: scenario.initial_key(key, s) for key in ("angles", "speeds")} for s in train.shafts}
    return Restart(shown.channel, shown.shaft, shown.is_speed, ratios, keys)


def _up_to_first_pause(log: Prepared, begins: list[int], ends: list[int], why: str) -> Prepared:
    """The log up to the first pause over which an input changes."""
    end = len(log.time)
    for before, after in zip(ends[:-1], begins[1:], strict=True):
        if any(x[before - 1] != x[after] for x in log.inputs.values()):
            end = before
            break
    kept = _part(log, begins[0], end)
    if kept is None:
        raise InputError(f"has a pause at {log.time[end - 1]:.4g} s, behind which it cannot be used: {why}")
    if end == len(log.time):
        return kept
    text = f"used up to its pause at {log.time[end - 1]:.4g} s: {why}, with which a run behind it would begin"
    return replace(kept, log=kept.log.noted(text))


def _part(log: Prepared, begin: int, end: int) -> Prepared | None:
    """Samples of a log as a log of their own; nothing where they are too few."""
    part = log.part(begin, end)
    return part if np.all(part.valid.sum(axis=1) >= LEAST) else None


def _restarted(rig: Rig, part: Prepared, shown: Restart, known: Mapping[str, Any]) -> Prepared | None:
    """A part that begins at the measured state, as soon as the inputs that act are those recorded behind the pause."""
    inputs = rig.task.inputs.items()
    dead = max((number(i.delay, known, f"inputs.{name}.delay") for name, i in inputs), default=0.0)
    delay = numbers_of(rig.task.measured[shown.channel], known)["delay"]
    seen = np.flatnonzero(np.isfinite(part.measured[shown.channel]))
    begin = int(np.searchsorted(part.time, max(dead, part.time[seen[0]] - delay) - 1e-9))
    if len(part.time) - begin < LEAST:
        return None
    at = part.time[begin]
    near = seen[part.time[seen] >= at + delay - 1e-9][:SAMPLES]
    if len(near) < LEAST:
        return None
    value, error = _taylor(part.time[near] - at - delay, part.measured[shown.channel][near])
    measured = {}
    for name, m in rig.task.measured.items():
        numbers = numbers_of(m, known)
        forgotten = at + 2.0 * numbers["delay"] + FILTERS * numbers["filter_time"]
        measured[name] = np.where(part.time >= forgotten, part.measured[name], np.nan)
    segments = [Segment(max(s.begin, begin), s.end, s.phase, s.initial) for s in part.segments if s.end > begin]
    segments[0] = replace(segments[0], initial=_initial(rig.task, shown, delay, value, error))
    return replace(part, measured=measured, segments=tuple(segments), begin=float(at), cache={})


def _taylor(time: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and derivatives at time 0 by the cubic of least squares, and their standard errors."""
    scale = time[-1]
    A = np.vander(time / scale, 4, increasing=True)
    found, *_ = np.linalg.lstsq(A, x, rcond=None)
    variance = np.sum((x - A @ found) ** 2) / (len(x) - 4) + (1e-9 * np.abs(x).max()) ** 2
    errors = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    factors = np.array([1.0, 1.0, 2.0, 6.0]) / scale ** np.arange(4)
    return found * factors, errors * factors


def _initial(
    task: Identification, shown: Restart, delay: float, value: np.ndarray, error: np.ndarray
) -> dict[str, FormulaText]:
    """Formulas of the state by dotted key: the state of the cubic, through the scale, the offset and the delay of the channel."""
    m = task.measured[shown.channel]

    def state(order: int, offset: FormulaText, name: str) -> str:
        read = f"({value[order].item()!r}) + ({value[order + 1].item()!r})*(({m.delay}) - ({delay!r}))"
        return f"({read} - ({offset}))/({m.scale}) + ({error[order].item()!r})*{name}/({m.scale})"

    speed = state(0, m.offset, OFFSETS[1]) if shown.is_speed else state(1, 0.0, OFFSETS[1])
    found: dict[str, FormulaText] = {
        shown.keys[shaft]["speeds"]: f"({ratio!r})*({speed})" for shaft, ratio in shown.ratios.items()
    }
    if not shown.is_speed:
        found[shown.keys[shown.shaft]["angles"]] = state(0, m.offset, OFFSETS[0])
    return found
