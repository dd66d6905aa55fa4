"""Limit cycles under constant inputs: a run leads to their neighbourhood, Newton's method finds state and period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...model.signals import core_signal
from ...response.shooting import PERIODICITY, SAMPLES_PER_PERIOD, reason_of
from ...simulation.runs.core_runs import core_case
from ...simulation.scenario.requirements import need_free_motion
from ...simulation.scenario.scenario import Scenario
from .hunting_decision import FOREVER, NOTHING_MOVES, Outlook, Verdict, WatchedRun, frequency_of

SAMPLES = 4000  # of the run that is watched
LONGER = 40  # runs, each four times as long as the one before, or twice as long as until a contact breaks away
FEW = 100  # samples of a run whose end state alone counts
SMALL = 1e-9  # of the largest value in the run, a swing that is none where the time that a simulation can reach ends
DECAY = 0.5  # of the swing from one quarter of the run to the next, below which it dies out
GROWTH = 1e6  # of the swing over that in the shortest run
MULTIPLES = (1, 2, 3)  # of the apparent period
MAX_PERIODS = 60  # followed by the search
NEAR = 0.3  # by which the period may differ from the apparent one, relative
PART_OF = 1e-6  # by which a whole number of shorter periods may differ from one, relative
MAX_SWITCHINGS = 20_000


@dataclass(frozen=True)
class CycleSearch:
    """Result of the search."""

    verdict: Verdict
    reason: str  # why there is no limit cycle, or none was found; empty if there is one
    result: dict[str, Any] = field(default_factory=dict, repr=False)  # result of the core's search, of one point
    channels: tuple[str, ...] = ()

    @property
    def period(self) -> float:
        """[s]"""
        return float(self.result["period"][0])

    def values(self, name: str) -> np.ndarray:
        """A channel over one period."""
        return np.asarray(self.result["table"][0][self.channels.index(name)])


@dataclass(frozen=True)
class UndrivenLoop:
    """A train with constant inputs, ready to run."""

    core: _core.Train
    case: _core.Case
    constants: Sequence[_core.Signal]  # constant values that the inputs have reached
    settled: float  # from when on the inputs are constant [s]
    watched: str  # the channel whose swing is looked at
    channels: tuple[str, ...]
    scenario: Scenario

    @classmethod
    def of(cls, scenario: Scenario) -> UndrivenLoop:
        """Loop of a scenario whose inputs come to rest.

        Raises
        ------
        InputError
            One of them does not.
        """
        need_free_motion(scenario, "limit cycle")
        core = scenario.core()
        signals, constants, settled = scenario.signals(), [], 0.0
        for name in core.input_names():
            time, value, slope = signals[name].breakpoint_list()[-1]
            if signals[name].sine_list() or slope != 0.0:
                raise InputError(
                    f"{name}: never comes to rest, and a limit cycle is what a loop does by itself; leave out sines, or take "
                    "periodic_motion"
                )
            settled = max(settled, time)
            constants.append(core_signal([(0.0, value, 0.0)]))
        train, motor = scenario.train(), next(iter(scenario.continuous()), "")
        watched = train.variable(motor, "error") if motor else train.variable(list(train.shafts)[-1], "speed")
        channels = tuple(name for name, *_ in core.channels())
        return cls(core, core_case(scenario), constants, settled, watched, channels, scenario)

    def run(self, duration: float, samples: int) -> dict[str, Any]:
        """A run from the start."""
        grid: dict[str, Any] = {"duration": duration, "sample_interval": duration / samples, "samples": samples}
        return _core.run(self.case, **grid, max_switchings=MAX_SWITCHINGS)

    def outlook(self, duration: float) -> Outlook:
        """Conclusion from the state at a time after the inputs have come to rest."""
        watch = WatchedRun(self.scenario, (self.watched,))
        watch.follow(duration, FEW)
        return watch.outlook(duration / FEW)[0]

    def search(self, start: Mapping[str, float], period: float, *, threads: int = 1) -> dict[str, Any]:
        """Newton's method for state and period, from an estimate of both."""
        return _core.respond(
            self.core,
            [(self.constants, period, start)],
            samples=SAMPLES_PER_PERIOD,
            harmonics=1,
            max_periods=MAX_PERIODS,
            tolerance=PERIODICITY,
            keep_table=True,
            limit_cycle=True,
            threads=threads,
        )


def find_limit_cycle(scenario: Scenario) -> CycleSearch:
    """The limit cycle that a run of a scenario leads to; where its duration does not suffice, longer runs follow."""
    loop, duration, reason, first = UndrivenLoop.of(scenario), scenario.simulation.duration, "", 0.0
    for _ in range(LONGER):
        whole = loop.settled + duration
        run = loop.run(whole, SAMPLES)
        watched = run["values"][loop.channels.index(loop.watched)]
        time = np.arange(SAMPLES) * (whole / SAMPLES)
        later = time >= loop.settled + 0.5 * duration
        x, t = watched[later], time[later]
        before, last = (float(np.ptp(part)) for part in np.array_split(x, 2))
        outlook = loop.outlook(duration)
        if outlook.rests:
            return CycleSearch(
                "at rest", f"it comes to rest: after {whole:.4g} s {loop.watched} stays at {x[-1]:.6g}; {NOTHING_MOVES}"
            )
        first = first or last
        if last > GROWTH * first or not np.isfinite(last):
            return CycleSearch(
                "not decided",
                f"it grows without bound: the linear loop is unstable, and after {whole:.4g} s nothing limits it",
            )
        if 0.0 < last < DECAY * before:
            reason = f"it dies out: in the last quarter of {whole:.4g} s it swings by {last / before:.3g} of the quarter before"
        elif np.isnan(f := frequency_of(t, x)):
            reason = f"no two swings within {0.5 * duration:.4g} s; give a longer simulation.duration"
        else:
            reason, found = _near(loop, run, 1.0 / f, whole)
            if found is not None:
                return found
        if run["switching_count"] > MAX_SWITCHINGS:
            break
        duration = max(4.0 * duration, 2.0 * outlook.breaks_away if outlook.breaks_away < FOREVER else 0.0)
        if duration > FOREVER and np.ptp(x) <= SMALL * np.abs(watched).max():
            return CycleSearch(
                "at rest",
                f"it comes to rest: each slip is smaller than the one before, and from {t[0]:.3g} to {whole:.3g} s {loop.watched} stays at {x[-1]:.6g}",
            )
        if duration > FOREVER:
            break
    return CycleSearch("not decided", f"{reason} ({outlook.describe()})" if outlook.describe() else reason)


def _near(loop: UndrivenLoop, run: dict[str, Any], apparent: float, end: float) -> tuple[str, CycleSearch | None]:
    """The limit cycle near the end of a run, or why none was found."""
    reason = ""
    for multiple in MULTIPLES:
        period = multiple * apparent
        begin = _quiet_instant(run["switchings"][:, 0], end - period, end)
        start = loop.run(begin, 1)["end_state"]
        result = loop.search(start, period)
        if reason := reason_of(result, 0):
            continue
        found = CycleSearch("hunts", "", result, loop.channels)
        swing = float(np.ptp(found.values(loop.watched)))
        watched = run["values"][loop.channels.index(loop.watched)]
        if abs(found.period / period - 1.0) < NEAR and swing > 1e-3 * float(np.ptp(watched[-SAMPLES // 8 :])):
            return "", found if multiple == 1 else _shortest(loop, found)
        reason = "Newton's method leads to rest, or to another motion"
    return f"it swings with a period of about {apparent:.4g} s, but does not repeat: {reason}", None


def _shortest(loop: UndrivenLoop, found: CycleSearch) -> CycleSearch:
    """The same motion over the shortest of its periods."""
    for parts in (2, 3, 5):
        while (shorter := _part(loop, found, parts)) is not None:
            found = shorter
    return found


def _part(loop: UndrivenLoop, found: CycleSearch, parts: int) -> CycleSearch | None:
    start = dict(zip(found.result["components"], found.result["start"][0].tolist(), strict=True))
    result = loop.search(start, found.period / parts)
    if reason_of(result, 0) or abs(result["period"][0] * parts / found.period - 1.0) >= PART_OF:
        return None
    return CycleSearch("hunts", "", result, loop.channels)


def _quiet_instant(instants: np.ndarray, begin: float, end: float) -> float:
    """The middle of the longest time between switchings, where a change of the state changes no regime."""
    within = [begin, *instants[(instants > begin) & (instants < end)], end]
    k = int(np.argmax(np.diff(within)))
    return float(0.5 * (within[k] + within[k + 1]))
