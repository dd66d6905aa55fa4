"""Runs of the rig over logs, with their exact derivatives by parameters, many at once.

A log of several phases is run phase by phase; the state and its derivatives go on from one to the next.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...simulation.runs.sensitivities import CENTRAL, ONE_SIDED, run_cases
from ..prepared_log import Prepared, Segment
from ..task.file_formulas import names_in, number
from ..task.free_parameters import FreeParameter
from ..task.identification_file import Identification
from .log_inputs import NUMBERS, LogInputs
from .measured_motion_input import GIVEN_SPEED
from .measurement_model import Measuring, Probe, delays_that_name, numbers_of
from .rig_scenario import Built, Rig

STEP = 2.0**-24  # of a value or its scale: the step and the rounding of a difference over it are some 1e-8 of the value
STEP_OF_CONTROLLERS = (
    2.0**-11
)  # with the differences of fourth order of `sensitivities`, which see the limits of controllers

_SIGNALS = re.compile(
    r"(command|shafts\.[^.]+\.torque|slides\.[^.]+\.force|controllers(\.[^.]+(\.reference)?)?)(\..*)?"
)
Values = Mapping[str, float]


@dataclass
class Seen:
    """Computed values of the measured channels of a log."""

    values: np.ndarray  # channels x samples, SI
    derivatives: np.ndarray  # channels x samples x parameters; NaN from where the motion is not smooth
    extra: dict[str, np.ndarray] = field(default_factory=dict)  # further variables at the samples
    ends_by: str = ""  # why the derivatives end
    error: Exception | None = None  # why there is no run; then there are no values


class NoDerivativeError(Exception):
    """A parameter by which there is no exact derivative."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(why)
        self.name = name


def run_logs(
    rig: Rig,
    requests: Sequence[tuple[Prepared, Values]],
    rung: int,
    parameters: Mapping[str, FreeParameter] | None = None,
    *,
    extra: tuple[str, ...] = (),
    threads: int = 1,
) -> list[Seen]:
    """Runs of logs, each with values of all parameters.

    parameters: by which there are derivatives.
    extra: further variables of the rig that are shown.
    """
    by = dict(parameters or {})
    courses = [_Course(rig, log, values, rung, by, extra) for log, values in requests]
    for part in range(max((len(log.segments) for log, _ in requests), default=0)):
        waiting = [c for c in courses if c.begin(part)]
        for channels in dict.fromkeys(c.channels for c in waiting):
            alike = [c for c in waiting if c.channels == channels]
            order = {id(c.train): k for k, c in reversed(list(enumerate(alike)))}
            alike.sort(key=lambda c: order[id(c.train)])  # runs of one train one after the other
            try:
                rows = run_cases([c.case for c in alike], list(channels), threads, signals=False)
            except InputError as problem:
                if not by:
                    raise
                first = problem.problems[0]
                raise NoDerivativeError(next(iter(first.keys or by)), first.reason) from None
            for course, row in zip(alike, rows, strict=True):
                course.take(row)
    return [c.seen() for c in courses]


def run_log(rig: Rig, log: Prepared, values: Values, rung: int, extra: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
    """Computed values of the measured channels of a log, by name, and more variables of the rig, at its instants."""
    (seen,) = run_logs(rig, [(log, values)], rung, extra=extra)
    if seen.error is not None:
        raise seen.error
    return {**dict(zip(rig.task.measured, seen.values, strict=True)), **seen.extra}


class _Course:
    """One log on its way through its phases."""

    def __init__(
        self,
        rig: Rig,
        log: Prepared,
        values: Values,
        rung: int,
        by: Mapping[str, FreeParameter],
        extra: tuple[str, ...],
    ) -> None:
        self._rig, self._log, self._values, self._rung, self._by = rig, log, values, rung, by
        self._known: dict[str, Any] = {**log.facts, **values}
        self._state: dict[str, float] | None = None
        self._state_by: dict[str, np.ndarray] = {}
        self._ends_by = ""
        self._smooth = True
        self._error: Exception | None = None
        self.channels: tuple[str, ...] = ()
        self.case: Any = None
        self.train: Any = None
        try:
            rates = rig.rates if delays_that_name(rig.task, list(by)) else {}
            self._measuring = Measuring(rig.task, log, self._known, rates)
            probes = self._measuring.probes()
        except InputError as error:
            self._error, probes = error, []
        self._count = len(probes)
        self._probes = [*probes, *(Probe(name, np.maximum(log.time, log.begin)) for name in extra)]
        self._extra = extra
        self._rows: list[list[np.ndarray]] = [[] for _ in self._probes]
        self._rows_by: list[list[np.ndarray]] = [[] for _ in self._probes]

    def begin(self, part: int) -> bool:
        """Whether there is something to run in a part of the log; then `case` is that."""
        if self._error is not None or part >= len(self._log.segments):
            return False
        segment = self._log.segments[part]
        begin, end = _ends(self._log, segment)
        last = part == len(self._log.segments) - 1
        self._within = [(p.at >= begin) & ((p.at < end) | (last & (p.at <= end))) for p in self._probes]
        if end <= begin:
            self._within = [np.zeros(len(p.at), dtype=bool) for p in self._probes]
            return False
        try:
            self._make_case(segment, begin, end)
        except InputError as error:
            self._error = error
            return False
        return True

    def _make_case(self, segment: Segment, begin: float, end: float) -> None:
        rig = self._rig
        if segment.initial is not None:
            self._state, self._state_by, self._smooth = None, {}, True
        changes = _begun(rig.changes(self._known, self._rung, segment.phase), segment, self._known)
        built = rig.built(changes)
        acting = LogInputs(rig.task, self._log, self._known, begin, end)
        start, capacities = rig.start(self._log, built, changes) if self._state is None else (self._state, {})
        if self._state is None:
            start = rig.driven(start, built, acting.given_speeds(self._known))
        self._at = np.unique(
            np.concatenate([*(p.at[w] - begin for p, w in zip(self._probes, self._within, strict=True)), [end - begin]])
        )
        self._begin = begin
        self._terms = [built.terms(p.variable) for p in self._probes]
        self._terms_by = [[dict.fromkeys(terms, 0.0) for _ in self._by] for terms in self._terms]
        shown = [name for terms in self._terms for name in terms]
        self.channels = tuple(dict.fromkeys([*shown, *(built.smooth if len(self._log.segments) > 1 else ())]))
        variations = []
        if self._smooth:
            variations = [
                (name, self._beside(name, p, changes, built, acting, segment)) for name, p in self._by.items()
            ]
        self.train = built.core
        inputs = acting.inputs(built, self._known)
        self.case = _core.SensitiveRun(
            _core.Case(built.core, inputs=inputs, start=start, hysteresis_capacities=capacities),
            variations=variations,
            control=acting.control(built, self._known),
            duration=end - begin,
            sample_interval=float(f"{self._log.log.interval:.1g}"),
            instants=self._at.tolist(),
        )

    def _beside(
        self, name: str, p: FreeParameter, changes: Mapping[str, Any], built: Built, acting: LogInputs, segment: Segment
    ) -> list[Any]:
        """Values of the core that differ beside the value of a parameter."""
        rig, task, phase = self._rig, self._rig.task, segment.phase
        keys = rig.keys_of(name, self._rung, phase)
        of_rig = [key for key in keys if not key.startswith("initial.")]
        acts = {i for i, c in task.inputs.items() if any(name in names_in(getattr(c, k)) for k in NUMBERS)}
        axes = {built.scenario.train().variable(a, "reference") for a in built.scenario.axes()}
        _refuse_held_delay(task, name, acts & axes)
        of_control = bool(axes) and (bool(acts & axes) or any(key.startswith("controllers") for key in of_rig))
        moved = self._state_by.get(name)
        own_start = any(name in names_in(formula) for formula in (segment.initial or {}).values())
        other_start = self._state is None and (own_start or len(keys) > len(of_rig) or rig.sets_start(built, of_rig))
        other_start |= self._state is None and any(i.endswith(GIVEN_SPEED) for i in acts)
        other_inputs = bool(acts - axes) or any(_SIGNALS.fullmatch(key) for key in of_rig)
        if not (keys or acts or own_start or moved is not None):
            return []
        out = []
        for offset, weight in stencil(self._values[name], p, long=bool(axes)):
            known = {**self._known, name: self._values[name] + offset}
            try:
                there = _begun({**changes, **rig.changes(known, self._rung, phase, keys)}, segment, known)
                at = rig.built(there) if of_rig else built
            except InputError as error:
                raise NoDerivativeError(name, f"beside its value: {error}") from None
            self._note_terms(list(self._by).index(name), at, weight)
            start: tuple[dict[str, float], dict[str, float]] | None = None
            if moved is not None:
                assert self._state is not None
                start = ({s: v + offset * d for (s, v), d in zip(self._state.items(), moved, strict=True)}, {})
            elif other_start:
                own, capacities = rig.start(self._log, at, there)
                start = rig.driven(own, at, acting.given_speeds(known)), capacities
            differs = {
                "train": at.core if of_rig else None,
                "inputs": acting.inputs(at, known) if other_inputs else None,
                "start": start,
                "control": acting.control(at, known) if of_control else None,
            }
            out.append({"offset": offset, "weight": weight, **differs})
        return out

    def _note_terms(self, parameter: int, at: Built, weight: float) -> None:
        """Differences of factors of sums of channels beside the value of a parameter, such as the ratio of a gear."""
        for probe, terms, by in zip(self._probes, self._terms, self._terms_by, strict=True):
            if terms.keys() != {probe.variable}:
                for name, factor in at.terms(probe.variable).items():
                    by[parameter][name] += weight * (factor - terms[name])

    def take(self, row: Any) -> None:
        """Result of the core for `case`."""
        if row.error:
            self._error = _core.SolverError(row.error)
            return
        derivatives = row.derivatives
        if row.ends_by:
            self._smooth = False
            self._ends_by = self._ends_by or f"{row.ends_by}, {self._begin + row.ends_at:.3g} s"
        if len(derivatives) < len(self._by):
            derivatives = np.full((len(self._by), *row.values.shape), np.nan)
        place = {name: k for k, name in enumerate(self.channels)}
        for k, (probe, within) in enumerate(zip(self._probes, self._within, strict=True)):
            at = np.searchsorted(self._at, probe.at[within] - self._begin)
            values, by = np.zeros(len(at)), np.zeros((len(self._by), len(at)))
            for name, factor in self._terms[k].items():
                own = row.values[place[name]][at]
                values = values + factor * own
                by = by + factor * derivatives[:, place[name]][:, at]
                by += np.outer([terms[name] for terms in self._terms_by[k]], own)
            self._rows[k].append(values)
            self._rows_by[k].append(by)
        if len(self._log.segments) > 1:
            self._state = {name: value for name, value in row.end_state.items() if name in place}
            if self._smooth:
                rows = [place[name] for name in self._state]
                self._state_by = {name: derivatives[p][rows, -1] for p, name in enumerate(self._by)}

    def seen(self) -> Seen:
        """Computed values of the whole log."""
        if self._error is not None:
            shape = (len(self._log.measured), len(self._log.time))
            return Seen(np.full(shape, np.nan), np.full((*shape, len(self._by)), np.nan), error=self._error)
        rows = [np.concatenate(r) for r in self._rows]
        by = [np.concatenate(r, axis=1) for r in self._rows_by]
        n = self._count
        values = self._measuring.values(rows[:n])
        beside = [(name, lambda m, name=name: self._numbers_beside(m, name)) for name in self._by]
        derivatives = (
            self._measuring.derivatives(rows[:n], by[:n], beside) if self._by else np.zeros((*values.shape, 0))
        )
        return Seen(values, derivatives, dict(zip(self._extra, rows[n:], strict=True)), self._ends_by)

    def _numbers_beside(self, m: Any, name: str) -> list[tuple[float, dict[str, float]]]:
        """(weight, numbers of a channel) beside the value of a parameter."""
        return [
            (weight, numbers_of(m, {**self._known, name: self._values[name] + offset}))
            for offset, weight in stencil(self._values[name], self._by[name])
        ]


def stencil(value: float, p: FreeParameter, *, long: bool = False) -> list[tuple[float, float]]:
    """(offset, weight) of values beside one, within its bounds: df/dp = sum of weight (f - f at the value)."""
    size = max(abs(value), p.step)
    if not long:
        h = STEP * size if value + STEP * size <= p.max else -STEP * size
        return [(h, 1.0 / h)]
    h = STEP_OF_CONTROLLERS * size
    if p.min <= value - 2.0 * h and value + 2.0 * h <= p.max:
        return [(k * h, w / h) for k, w in CENTRAL]
    h = h if value + 4.0 * h <= p.max else -h
    return [(k * h, w / h) for k, w in ONE_SIDED]


def _refuse_held_delay(task: Identification, name: str, references: set[str]) -> None:
    """A reference that is held and comes later is the same at a tick of the controller, or another one altogether."""
    for i in sorted(references):
        channel = task.inputs[i]
        if channel.interpolation != "linear" and name in names_in(channel.delay):
            raise NoDerivativeError(
                name, f"delays {i}, which is held between samples and read by a sampled controller at its ticks"
            )


def _begun(changes: Mapping[str, Any], segment: Segment, known: Mapping[str, Any]) -> dict[str, Any]:
    """Starts from the measured state at which a segment begins, in place of the rig's initial state."""
    if segment.initial is None:
        return dict(changes)
    own = {
        k: v
        for k, v in changes.items()
        if not k.startswith(("initial.angles", "initial.speeds", "initial.positions", "initial.slide_speeds"))
    }
    return {**own, **{key: number(formula, known, key) for key, formula in segment.initial.items()}}


def _ends(log: Prepared, segment: Segment) -> tuple[float, float]:
    last = len(log.time) - 1
    return float(log.time[segment.begin]), float(log.time[min(segment.end, last)])
