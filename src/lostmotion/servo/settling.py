"""Settling of an axis: moves repeated until their errors repeat, both ways; proof or observation that the error stays in the window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..control.references import MovesReference
from ..response.closed_response import frame_of
from .axis_runs import changed, errors_of, first_size, ran, settled
from .hunting.hunting_decision import AtRest, moving_input, rises_of
from .hunting.limit_cycle_causes import watched_at_least
from .linear_regimes import Axis

SAMPLES = 20_000  # of one cycle of the moves
MOST = 400_000  # of a run
TICKS = 1e6  # sample times of the controller, for which it is watched at most after the last move
CYCLES = (2, 4, 8)  # of the moves
ALIKE = 0.1  # of the window, by which the errors of two cycles may differ
SPREADS = (
    3.0  # of the extremes of a swing that was watched: the least distance from the window of one that stays within it
)
COARSE = 20  # times the interval between samples, at most, of a long run
SAME = 0.01  # of the window, by which the run and what was watched may differ at the end
STILL = 1e-9  # of the window: an error that changes by less does not move
LATER = 0.03  # of what was watched, from which on a swing counts that becomes ever slower
PERIODS = 20  # of an input that never rests, for which the last position is held
SHARE = 0.001  # of the longest move: the least window by default
STEPS = 4.0  # of the encoder of the position: the least window by default

AnyMoves = MovesReference[Any, Any, Any, Any, Any]
State = Literal["settled", "settled, not proved", "not settled", "not decided"]


@dataclass(frozen=True)
class Settling:
    """Settling of an axis after one move."""

    end: float
    """end of the move [s]"""
    to: float
    """position [rad], of a slide [m]"""
    state: State
    """settled where the error is proved to stay within the window; settled, not proved where it was only watched to do so in steady
    swings, or rests within a window that is finer than a step of the position's encoder; not settled where it is outside at the end of what was run"""
    time: float
    """until the error stays within the window [s]; NaN unless settled, proved or not"""
    last: bool
    """whether the position is held after the move for ever; otherwise until the next move begins"""
    reason: str = ""
    """a proof, or an observation that found nothing"""
    remaining: float = math.nan
    """error before the next move, or at the end of what was run [rad]; of a swing the largest one"""
    unseen: float = math.nan
    """the part that the encoder of the position does not measure: the twist between its shaft and the reference's shaft [rad]"""
    swing: float = 0.0
    """half of what the error swings by at the end of what was run [rad]"""

    @property
    def within(self) -> bool:
        """Whether the error is within the window from `time` on, by a proof or as far as it was watched."""
        return self.state.startswith("settled")


@dataclass(frozen=True)
class Moves:
    """Moves of a reference, repeated until their errors repeat."""

    axis: Axis
    """with the repeated moves as its reference"""
    cycles: int
    """number of cycles; 1 where an input varies by itself"""
    period: float
    """period of the repeated moves [s]"""
    apart: float
    """largest difference of the errors of the last two cycles [rad]; NaN of a single one"""
    repeats: bool
    interval: float
    """between samples [s]"""
    count: int
    """moves of a cycle"""
    note: str = ""
    """reason for moves that are not repeated; empty if they are"""

    @property
    def longest(self) -> float:
        """Time for which the axis is watched at most after the last move [s]."""
        return TICKS * self.axis.controller.sample_time

    @property
    def reference(self) -> AnyMoves:
        """The repeated moves."""
        reference = self.axis.controller.reference
        assert isinstance(reference, MovesReference)
        return reference


def default_window(axis: Axis) -> float:
    """Four steps of the position encoder at the reference's shaft, and not less than a thousandth of the longest move [rad]."""
    reference = axis.controller.reference
    moves = reference.moves if isinstance(reference, MovesReference) else ()
    steps = np.abs(np.diff([getattr(reference, "start", 0.0), *(move.to for move in moves)]))
    longest = float(steps.max(initial=0.0)) or 50.0 * first_size(axis, "position")
    return max(STEPS * axis.position_encoder[1], SHARE * longest)


# --- repeated moves ---


def repeated(axis: Axis, window: float) -> Moves | None:
    """The axis with its moves repeated until their errors differ by a tenth of the window at most; None without moves.

    Moves that end elsewhere than they begin are made backward too, so that each stretch is travelled both ways. Behind the moves the
    last position of the reference is held.
    """
    reference = axis.controller.reference
    if not isinstance(reference, MovesReference) or not reference.moves:
        return None
    tick, ticks = frame_of(axis.scenario)
    if name := _varying(axis):
        end = reference.intervals()[-1][1]
        interval = max(math.ceil(end / SAMPLES / tick), 1) * tick
        note = f"not repeated, as {name} varies over time"
        return Moves(_following(axis, reference), 1, end, math.nan, True, interval, len(reference.moves), note)
    there = _resolved(reference)
    back = [] if there[-1]["to"] == reference.start else _backward(reference.start, there)
    cycle = [*there, *back]
    for k in {len(there) - 1, len(cycle) - 1}:
        cycle[k] = {**cycle[k], "dwell": cycle[k]["dwell"] or watched_at_least(axis)}
    needed = _with_moves(reference, cycle).duration - reference.begin
    count = max(math.ceil(needed / SAMPLES / tick), 1)
    count = count if count == 1 else math.ceil(count / ticks) * ticks
    period = math.ceil(needed / tick / max(count, ticks) - 1e-9) * max(count, ticks) * tick
    cycle[-1] = {**cycle[-1], "dwell": cycle[-1]["dwell"] + period - needed}
    for cycles in CYCLES:
        longer = _following(axis, _with_moves(reference, [*cycle * cycles, *(there if back else [])]))
        apart = _apart(longer, cycles, period, count * tick)
        if apart <= ALIKE * window:
            break
    return Moves(longer, cycles, period, apart, apart <= ALIKE * window, count * tick, len(cycle))


def _with_moves(reference: AnyMoves, moves: Sequence[dict[str, float]]) -> AnyMoves:
    kind = type(reference.moves[0])
    return reference.model_copy(update={"moves": tuple(kind(**move) for move in moves)})


def _following(axis: Axis, new: AnyMoves) -> Axis:
    """The axis with another reference, which all controllers follow that have the same one; the duration of its run is none of its own."""
    scenario, reference = axis.scenario, axis.controller.reference
    table = scenario.simulation.model_copy(update={"duration": watched_at_least(axis)})
    controllers = {
        name: c.model_copy(update={"reference": new}) if c.reference == reference else c
        for name, c in scenario.axes().items()
    }
    controllers = {**scenario.controllers, **controllers}
    return Axis(changed(scenario, controllers=controllers, simulation=table), axis.motor)


def _resolved(reference: AnyMoves) -> list[dict[str, float]]:
    """The moves with all that is given beside them."""
    keys = ("speed", "acceleration", "jerk", "dwell", "law")
    moves: tuple[Any, ...] = reference.moves
    own = [{"to": move.to, "duration": move.duration} for move in moves]
    return [given | {key: reference._of(move, key) for key in keys} for given, move in zip(own, moves, strict=True)]


def _backward(start: float, there: Sequence[dict[str, float]]) -> list[dict[str, float]]:
    """The same stretches in reverse, each within its own limits."""
    ends = [{"to": start, "dwell": there[-1]["dwell"]}, *there[:-1]]
    pairs = zip(reversed(there), reversed(ends), strict=True)
    return [{**move, "to": end["to"], "dwell": end["dwell"]} for move, end in pairs]


def _varying(axis: Axis) -> str:
    """Name of an input beside the moves that varies over time; empty if there is none."""
    reference = axis.controller.reference
    if reference.sine_list():
        return axis.train.variable(axis.motor, "reference")
    for name, c in axis.scenario.axes().items():
        if c.reference != reference and (c.reference.duration > 0.0 or c.reference.sine_list()):
            return axis.train.variable(name, "reference")
    driven = {axis.train.variable(name, "command") for name in axis.scenario.axes()}
    for name, signal in axis.scenario.signals().items():
        points = signal.breakpoint_list()
        if name not in driven and (signal.sine_list() or len(points) > 1 or any(points[-1][2:])):
            return name
    return ""


def _apart(axis: Axis, cycles: int, period: float, interval: float) -> float:
    """Largest difference of the errors of the last two cycles."""
    reference = axis.controller.reference
    begin = reference.intervals()[0][0]  # type: ignore[union-attr]
    end = math.ceil(begin / interval) * interval + cycles * period
    error = errors_of(axis, ran(axis, duration=end, sample_interval=interval))[0]
    n = round(period / interval)
    return float(np.abs(error[-n:] - error[-2 * n : -n]).max())


# --- settling ---


def settling(moves: Moves, rest: AtRest, window: float) -> list[Settling]:
    """Settling after each move of the last cycle, and after the last move, behind which the position is held.

    rest: what follows the last move.
    """
    seen = _seen(moves, rest, window)
    held = len(moves.reference.moves) - 1
    found = []
    for k in range(max(held - moves.count + 1, 0), held):
        earlier = range(k, -1, -moves.count)[: 1 if moves.repeats else 2]
        several = [s for j in earlier if (s := _before_the_next(moves, j, seen, window)) is not None]
        found += [max(several, key=_badness)] if several else []
    last = _held(moves, rest, seen, window)
    if not moves.repeats and last.within and held >= moves.count:
        before = _before_the_next(moves, held - moves.count, seen, window)
        last = (
            last
            if before is None or math.isnan(before.time)
            else max(last, replace(last, time=before.time), key=_badness)
        )
    return [*found, last]


def _badness(s: Settling) -> tuple[bool, float]:
    return not s.within, s.time if s.within else abs(s.remaining)


@dataclass(frozen=True)
class _Seen:
    """Run of the repeated moves and of what follows, as long as that was watched."""

    time: np.ndarray
    error: np.ndarray
    unseen: np.ndarray
    watched: tuple[np.ndarray, np.ndarray] | None = (
        None  # instants and error of the watch, if it rests elsewhere than the run ends
    )

    def during(self, begin: float, end: float = math.inf) -> np.ndarray:
        """Indices of the samples between two instants."""
        return np.flatnonzero((self.time >= begin) & (self.time <= end))


def _seen(moves: Moves, rest: AtRest, window: float) -> _Seen:
    moving = moving_input(moves.axis.scenario)
    end = _patience(moves) if moving else rest.begin + rest.watched - rest.extrapolated
    every = min(max(math.ceil(end / moves.interval / MOST), 1), COARSE)
    data = ran(moves.axis, duration=min(end, MOST * every * moves.interval), sample_interval=every * moves.interval)
    time, (error, unseen) = data["time"], errors_of(moves.axis, data)
    instants, watched = rest.begin + rest.times, moves.reference.moves[-1].to - rest.angles
    later = instants > time[-1]
    if rest.verdict == "at rest":
        k = max(int(np.argmax(later)) if later.any() else len(later), 1) - 1
        if abs(watched[k] - np.interp(instants[k], time, error)) > SAME * window:
            return _Seen(time, error, unseen, (instants, watched))
    error, unseen = np.append(error, watched[later]), np.append(unseen, np.full(int(later.sum()), unseen[-1]))
    return _Seen(np.append(time, instants[later]), error, unseen)


def _patience(moves: Moves) -> float:
    """Time until which the last position is held where an input never rests [s]."""
    scenario = moves.axis.scenario
    of_inputs = [sine for signal in scenario.signals().values() for sine in signal.sine_list()]
    of_inputs += [sine for c in scenario.axes().values() for sine in c.reference.sine_list()]
    slowest = min((frequency for _, frequency, _ in of_inputs if frequency > 0.0), default=math.inf)
    return moves.reference.intervals()[-1][1] + max(watched_at_least(moves.axis), PERIODS / slowest)


def _before_the_next(moves: Moves, k: int, seen: _Seen, window: float) -> Settling | None:
    """Whether the error is within the window until the next move begins; None where that begins at once."""
    spans, to = moves.reference.intervals(), moves.reference.moves[k].to
    (_, end), (until, _) = spans[k : k + 2]
    during = seen.during(end, until)
    if until <= end + moves.interval or not len(during):
        return None
    error = seen.error[during]
    time = _after(end, seen.time[during], error, window)
    state: State = "not settled" if math.isnan(time) else "settled"
    swing = _swing(seen.time[during], error)
    return Settling(end, to, state, time, False, "", float(error[-1]), float(seen.unseen[during[-1]]), swing)


def _after(end: float, time: np.ndarray, error: np.ndarray, window: float) -> float:
    """Time from the end of a move until the error stays within the window, without the rounding of the instants [s]."""
    return round(settled(time, error, window) + float(time[0]) - end, 9)


def _from(time: np.ndarray, share: float) -> int:
    """Index of the first sample from a share of the time on."""
    return int(np.searchsorted(time, time[0] + share * (time[-1] - time[0])))


def _swing(time: np.ndarray, error: np.ndarray, begin: float = 0.5) -> float:
    """Half of what an error swings by from a share of its course on; 0 where it moves one way."""
    first = _from(time, begin)
    late = error[first:]
    turns_around = any(len(rises_of(time[first:], way * late)) for way in (1.0, -1.0))
    return 0.5 * float(np.ptp(late)) if turns_around else 0.0


def _held(moves: Moves, rest: AtRest, seen: _Seen, window: float) -> Settling:
    """Whether the error stays within the window for ever. Where rounding decides between two motions, the worse one counts."""
    after = seen.during(moves.reference.intervals()[-1][1])
    courses = [(seen.time[after], seen.error[after]), *([] if seen.watched is None else [seen.watched])]
    return max((_kept(moves, rest, seen, course, window) for course in courses), key=_badness)


def _kept(moves: Moves, rest: AtRest, seen: _Seen, course: tuple[np.ndarray, np.ndarray], window: float) -> Settling:
    """Whether the error of one course stays within the window for ever."""
    end, to = moves.reference.intervals()[-1][1], moves.reference.moves[-1].to
    time, error = course
    rests = rest.verdict == "at rest" and (seen.watched is None or course is seen.watched)
    late = error[_from(time, 0.75) :]
    worst = float(error[-1] if rests else late[np.abs(late).argmax()])
    within = _after(end, time, error, window)
    goes_on = rest.verdict == "not decided" and abs(_limit(time, error)) > window
    goes_on = goes_on and bool(np.abs(error[_from(time, LATER) :]).max() > window)  # as far as its flanks let it
    state: State = "not settled"
    if abs(worst) > window or goes_on or math.isnan(within):
        reason = "at rest" if rests else f"{rest.watched or float(time[-1]) - end:.3g} s after the moves"
    else:
        state, reason = _within(moves, rest, course, window, one=seen.watched is None)
    within = within if state.startswith("settled") else math.nan
    swing = 0.0 if rests else _swing(time, error, LATER)
    return Settling(end, to, state, within, True, reason, worst, float(seen.unseen[-1]), swing)


def _limit(time: np.ndarray, error: np.ndarray) -> float:
    """Limit of an error that moves one way, if its changes go on to grow or shrink as in the last two eighths of its course.

    A load that floats through its backlash without friction is within the window for ever longer times, at an ever lower speed.
    """
    first = _from(time, 0.75)
    late = error[first:]
    a, b, c = np.interp([time[first], 0.5 * (time[first] + time[-1]), time[-1]], time, error).tolist()
    one_way = np.all(np.diff(late) >= 0.0) or np.all(np.diff(late) <= 0.0)
    if not one_way or b in (a, c):
        return float(c)
    share = (c - b) / (b - a)
    return float(c + (c - b) * share / (1.0 - share)) if share < 1.0 else math.copysign(math.inf, c - b)


def _within(
    moves: Moves, rest: AtRest, course: tuple[np.ndarray, np.ndarray], window: float, *, one: bool
) -> tuple[State, str]:
    """Whether an error that was seen to remain within the window stays there, and the reason.

    Rest is a proof, if the encoder of the position resolves the window: where an axis rests within a step depends on how it came there.
    A steady swing is none: a quantised loop may be chaotic, and its state never repeats.
    """
    if rest.verdict == "at rest":
        if not one:
            return (
                "settled, not proved",
                "rounding decides between two motions, both of which were watched to stay within",
            )
        if window < moves.axis.position_encoder[1]:
            return (
                "settled, not proved",
                "at rest, by chance: the window is finer than a step of the position's encoder",
            )
        return "settled", "at rest"
    (time, error), name = course, moving_input(moves.axis.scenario)
    watched = f"watched for {rest.watched or time[-1] - moves.reference.intervals()[-1][1]:.3g} s, in which it"
    if np.ptp(error[_from(time, 0.5) :]) <= STILL * window:
        return "settled, not proved", f"{watched} does not move{f'; {rest.reason}' if rest.reason else ''}"
    if _swings_within(time, error, window):
        return "settled, not proved", f"{watched} swings steadily{f' under {name}' if name else ''}"
    if name:
        return "not decided", f"{name} never comes to rest, and the error does not repeat"
    why = rest.reason if rest.verdict == "not decided" else f"{rest.verdict} near the edge of the window"
    return "not decided", f"within the window {rest.watched:.3g} s after the moves, but not proved to stay there: {why}"


def _swings_within(time: np.ndarray, error: np.ndarray, window: float) -> bool:
    """Whether least and largest error of each part of the last half are as good as the same, and far enough from the window."""
    edges = np.linspace(0.5 * (time[0] + time[-1]), time[-1], PERIODS // 2 + 1)
    parts = np.split(error, np.searchsorted(time, edges[:-1]))[1:]
    ends = np.array([(part.min(), part.max()) for part in parts if len(part)])
    return bool(np.abs(ends).max() + SPREADS * np.ptp(ends, axis=0).max() <= window)
