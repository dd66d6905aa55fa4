"""Whether a loop whose inputs have come to rest swings on, rests for ever, or is not decided.

A state in which all contacts are stuck is no proof of rest: an integrator that still moves breaks a contact away.
From one frame, the time after which all sample times of the controllers repeat, to the next, stuck drive and
controllers are a map. Where it takes the state into itself, the state is an equilibrium. If its numbers are
polynomials of time of second degree, as with two integrators in series, so are the torques of the contacts.
They give the time of the break-away.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ...model.shaft_ratio import turns
from ...response.closed_loop import running_slots, set_state, state_of
from ...response.closed_response import frame_of
from ...simulation.runs.stuck_contacts import explain
from ...simulation.scenario.scenario import Scenario
from ...simulation.stepping.simulation import Simulation
from ...simulation.stepping.simulation_state import SimulationState
from ...simulation.stepping.solver_access import solver_of
from ...units.practical import practical

Verdict = Literal["hunts", "at rest", "not decided"]

FOREVER = 1e12  # [s], the longest interval of a simulation
CONSTANT = 1e-14  # of the largest magnitude of a number, by which rounding may change it over a window
STRAIGHT = 1e-6  # of a difference, by which rounding may change it
MARGIN = 1e-9  # of a capacity, within which a contact counts as about to break away
AHEAD = 1000  # windows at most by which a motion is extrapolated: rounding grows by the square
PARTS = 10  # samples of a window
SKIPS = 20  # extrapolations after one stretch
SHORT_OF = 0.9  # of the time until a contact breaks away, by which a motion is extrapolated
SAMPLES, FINEST = 1000, 4000  # of the first stretch that is watched, and of one at most
CREEP = 1e-12  # of the largest number of the state, a speed [rad/s] that is none but rounding
QUICK = 4000  # ticks that are watched for the frequency of quick swings
GROWTH = 1.5  # of the stretches that are watched
IDLE = 8  # stretches without motion after which a state that is no equilibrium is left undecided
CYCLES = 4  # in the last half of the watch
STEADY = (
    0.75  # of swing and frequency from one part of the watch to the next, below which they die out; irregular ones vary
)
CONFIRMED = 3.0  # times as long a watch confirms a swing
NOISE = 2e-9 * math.pi  # [rad], a billionth of a turn: what a shaft at rest may move by rounding
TURN = 1e-3  # [m/rad], for which a radian counts where a linear motor moves a slide
STILL = 1e-6  # of the swing of the load, below which the motor stands
NOTHING_MOVES = "the state is an equilibrium: no state of drive and controllers changes"


@dataclass(frozen=True)
class Outlook:
    """Conclusion from a state in which all contacts are stuck."""

    breaks_away: float
    """time until a contact breaks away [s]; infinite at an equilibrium, NaN where it does not follow from the state"""
    contact: str = ""  # contact that breaks away

    @property
    def rests(self) -> bool:
        """Whether nothing breaks away in any time that a simulation can reach."""
        return self.breaks_away >= FOREVER

    def describe(self) -> str:
        """When a contact breaks away; empty where that does not follow from the state."""
        if not math.isfinite(self.breaks_away):
            return ""
        return f"stuck, but an integrator breaks {self.contact} away after another {self.breaks_away:.3g} s"


UNKNOWN = Outlook(math.nan)


@dataclass(frozen=True)
class _Look:
    """The state at one instant."""

    numbers: np.ndarray
    key: tuple[int, ...]
    contacts: tuple[str, ...]
    margins: np.ndarray  # torques of each contact that free it forward, and in reverse [N·m]
    scales: np.ndarray  # capacities that these belong to [N·m]
    creep: float  # speed of contacts that slip by no more than rounding [rad/s]


class WatchedRun:
    """A scenario from the instant on at which its inputs have come to rest."""

    def __init__(self, scenario: Scenario, names: Sequence[str]) -> None:
        self.simulation = Simulation(scenario)
        self.core, control = solver_of(self.simulation)
        self.names = tuple(names)
        sampled = bool(scenario.axes())
        self.tick, ticks = frame_of(scenario) if sampled else (0.0, 0)
        self.frame = self.tick * ticks
        self._running = list(running_slots(control))
        self.noise = np.array([_noise(scenario, name) for name in self.names])
        train = scenario.train()
        self.units = ["m" if train.shaft_of(name, "angle") in scenario.slides else "rad" for name in self.names]
        self._speeds = tuple(train.variable(shaft, "speed") for shaft in train.shafts)
        self.skipped = 0.0  # time that was extrapolated, not run [s]
        self.times = np.zeros(0)
        self.rows = np.zeros((0, len(self.names)))
        self.magnitude = np.zeros(0)
        self._begin(scenario)

    # --- time ---

    def _begin(self, scenario: Scenario) -> None:
        """Advances to the middle of a tick after all inputs have come to rest."""
        signals = {name: s for name, s in scenario.signals().items() if name in self.simulation.inputs}
        points = {name: s.breakpoint_list() for name, s in signals.items()}
        settled = [points[-1][0] for points in points.values()]
        settled += [c.reference.duration for c in scenario.axes().values()]
        self.settled = max(settled, default=0.0)
        instants = sorted({p[0] for course in points.values() for p in course} | {0.0})
        for begin, end in itertools.pairwise([*instants, self._instant(self.settled)]):
            values = {
                name: (_value(course, begin, begin), _value(course, begin, end)) for name, course in points.items()
            }
            if end > self.simulation.time:
                self.simulation.advance(end - self.simulation.time, **values)
        self.inputs = {name: course[-1][1] for name, course in points.items()}

    def _instant(self, time: float) -> float:
        """The first after a time that is halfway between two ticks and a whole number of frames after the first."""
        if self.frame == 0.0:
            return time
        return math.ceil(time / self.frame) * self.frame + 0.5 * self.tick

    @property
    def elapsed(self) -> float:
        """Time since the inputs have come to rest [s]."""
        return self.simulation.time - self.settled + self.skipped

    def _advance(self, interval: float) -> None:
        """Advance by a whole number of frames, at least one."""
        if self.frame == 0.0:
            self.simulation.advance(interval, **self.inputs)
            return
        frames = max(round(interval / self.frame), 1)
        past = round((self.simulation.time - 0.5 * self.tick) / self.frame)
        end = (past + frames) * self.frame + 0.5 * self.tick
        self.simulation.advance(end - self.simulation.time, **self.inputs)

    def follow(self, duration: float, samples: int = SAMPLES) -> None:
        """Advances by a time [s], and keeps samples of the variables."""
        interval = max(duration / samples, self.frame)
        if self.frame:
            interval = math.ceil(interval / self.frame * (1.0 - 1e-9)) * self.frame
        self._record(interval, max(round(duration / interval), 1))

    def _record(self, interval: float, count: int) -> None:
        times, rows = [], []
        for k in range(count):
            self._advance(interval)
            times.append(self.elapsed)
            rows.append(self.simulation[self.names])
            if k % 10 == 0:
                self._note(self._numbers()[0])
        self.times = np.append(self.times, times)
        self.rows = np.concatenate([self.rows, rows])

    def _note(self, numbers: np.ndarray) -> None:
        self.magnitude = np.maximum(self.magnitude, np.abs(numbers)) if len(self.magnitude) else np.abs(numbers)

    # --- what follows from the state ---

    def _numbers(self) -> tuple[np.ndarray, tuple[int, ...]]:
        return state_of(self.core, self._running)

    def _look(self) -> _Look | None:
        """The state now; None where a contact slips, or a shaft without friction moves, which may reach a flank of its gap."""
        contacts = explain(self.simulation).contacts
        speeds = [abs(c.speed) for c in contacts if c.mode != 0]
        creep = max((*speeds, *np.abs(self.simulation[self._speeds])))
        if creep > CREEP * self.magnitude.max(initial=0.0):
            return None
        stuck = [c for c in contacts if c.mode == 0 and math.isfinite(c.capacity_forward)]
        numbers, key = self._numbers()
        self._note(numbers)
        margins = np.array([(c.to_free_forward, c.to_free_backward) for c in stuck]).reshape(-1, 2)
        scales = np.array([c.capacity_forward + c.capacity_backward for c in stuck])
        return _Look(numbers, key, tuple(c.name for c in stuck), margins, scales, creep)

    def window(self, about: float) -> float:
        """A time that consists of whole frames in each of its parts [s]."""
        part = about / PARTS
        return PARTS * (math.ceil(part / self.frame) * self.frame if self.frame else part)

    def looks(self, window: float) -> list[_Look] | None:
        """Four states, a window [s] apart; None where a contact slips or a law changes its segment in between."""
        found: list[_Look] = []
        for k in range(4):
            if k:
                self._record(window / PARTS, PARTS)
            look = self._look()
            if look is None or (found and look.key != found[0].key):
                return None
            found.append(look)
        return found

    def outlook(self, window: float) -> tuple[Outlook, list[_Look] | None]:
        """Conclusion from the state now and over three windows [s] from now on."""
        looks = self.looks(window)
        if looks is None:
            return UNKNOWN, None
        numbers = np.array([look.numbers for look in looks])
        steps = np.diff(numbers, axis=0)
        rounding = CONSTANT * self.magnitude + PARTS * window * max(look.creep for look in looks)
        if np.all(np.abs(steps) <= rounding) and np.all(looks[-1].margins >= MARGIN * looks[-1].scales[:, None]):
            return Outlook(math.inf), looks
        if np.any(np.abs(np.diff(steps, 2, axis=0)) > STRAIGHT * np.abs(steps).max(axis=0) + 4.0 * rounding):
            return UNKNOWN, None
        margins = np.array([look.margins for look in looks])
        times = [
            (window * _zero(margins[:, c, way], CONSTANT * looks[-1].scales[c]), name)
            for c, name in enumerate(looks[-1].contacts)
            for way in range(2)
        ]
        return Outlook(*min(times, default=(math.nan, ""))), looks

    def skip(self, outlook: Outlook, looks: list[_Look], window: float) -> bool:
        """Extrapolates the motion until shortly before a contact breaks away; False where the motion then goes on differently."""
        if self.frame == 0.0:
            self._advance(SHORT_OF * outlook.breaks_away)
            return True
        if self._running:
            return False
        windows = int(SHORT_OF * outlook.breaks_away / window)
        steps = np.diff([look.numbers for look in looks], axis=0)
        bend = steps[-1] - steps[-2]
        if np.all(np.abs(bend) <= 4.0 * CONSTANT * self.magnitude) and self._jump(looks, 0.0 * bend, windows, window):
            return True
        return self._jump(looks, bend, min(windows, AHEAD), window)

    def _jump(self, looks: list[_Look], bend: np.ndarray, windows: int, window: float) -> bool:
        """Skip so many windows, if the next one then goes as predicted."""
        kept: SimulationState = self.simulation.state
        last = looks[-1].numbers - looks[-2].numbers
        numbers = looks[-1].numbers + windows * last + 0.5 * windows * (windows + 1) * bend
        set_state(self.core, self._running, numbers)
        wanted = last + (windows + 1) * bend
        after = self.looks(window) if windows > 0 else None
        if after is not None:
            step = after[1].numbers - after[0].numbers
            bound = STRAIGHT * np.abs(wanted) + AHEAD * CONSTANT * self.magnitude
            if np.all(np.abs(step - wanted) <= bound):
                self.skipped += windows * window
                return True
        self.simulation.state = kept
        return False

    # --- what follows from the motion ---

    def part(self, begin: float, end: float) -> tuple[np.ndarray, np.ndarray]:
        """Instants and variables (sample, variable) between two shares of the elapsed time."""
        here = (self.times >= begin * self.elapsed) & (self.times <= end * self.elapsed)
        return self.times[here], self.rows[here]

    def swing(self, begin: float, end: float) -> np.ndarray:
        """Largest less least value of each variable between two shares of the elapsed time."""
        values = self.part(begin, end)[1]
        return np.ptp(values, axis=0) if len(values) else np.zeros(len(self.names))

    def rises(self) -> np.ndarray:
        """Upward crossings in the last half, of the first variable that moves [s]."""
        times, values = self.part(0.5, 1.0)
        moving = self.swing(0.5, 1.0) > self.noise
        return rises_of(times, values[:, int(np.argmax(moving))]) if moving.any() else np.zeros(0)

    def period(self) -> float:
        """Mean of the last half [s]."""
        return float(np.mean(np.diff(self.rises())))

    def quick_frequency(self, variable: int, swing: float) -> float:
        """Frequency from one sample each tick [Hz], since the samples of a long watch may be too far apart; NaN of a slower swing."""
        if self.frame == 0.0:
            return math.nan
        values = []
        for _ in range(QUICK):
            self.simulation.advance(self.tick, **self.inputs)
            values.append(self.simulation[self.names[variable]])
        frequency = frequency_of(self.tick * np.arange(QUICK), np.array(values))
        several = frequency * self.tick * QUICK >= CYCLES and np.ptp(values) >= swing
        return frequency if several else math.nan

    def swings(self) -> bool:
        """Whether the last half of the watch has several cycles that neither die out nor become ever slower."""
        before, last = self.swing(0.5, 0.75), self.swing(0.75, 1.0)
        periods = np.diff(self.rises())
        moving = last > self.noise
        if len(periods) < CYCLES or not moving.any():
            return False
        half = len(periods) // 2
        steady = STEADY * np.mean(periods[-half:]) <= np.mean(periods[:half])
        return bool(steady and np.all(last[moving] >= STEADY * before[moving]))


def _value(points: Sequence[tuple[float, ...]], begin: float, time: float) -> float:
    """Value of a signal at a time within its segment that begins at or before another."""
    t, value, slope = next(p for p in reversed(points) if p[0] <= begin)
    return value + slope * (time - t)


def _noise(scenario: Scenario, name: str) -> float:
    """Motion by rounding of the angle or position of that name [rad] or [m]: of a slide as far as its fastest shaft moves it."""
    train = scenario.train()
    slide = train.shaft_of(name, "angle")
    if slide not in scenario.slides:
        return NOISE
    per_length = [abs(turns(train, shaft, slide) or 0.0) for shaft in scenario.shafts]
    return NOISE / (max(per_length, default=0.0) or 1.0 / TURN)


def _zero(values: np.ndarray, rounding: float) -> float:
    """Number of steps after the last of four values until their parabola is 0; infinite if never."""
    value, step = values[-1], values[-1] - values[-2]
    bend = values[-1] - 2.0 * values[-2] + values[-3]
    bend = bend if abs(bend) > 8.0 * rounding else 0.0
    step = step if abs(step) > rounding or bend else 0.0
    roots = np.roots(np.array([0.5 * bend, step + 0.5 * bend, value]))
    return float(min((r.real for r in roots if abs(r.imag) == 0.0 and r.real > 0.0), default=math.inf))


def rises_of(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Instants at which the middle is crossed upward, with a hysteresis of a quarter of the swing, so that ripple does not count."""
    middle, quarter = 0.5 * (values.max() + values.min()), 0.25 * np.ptp(values)
    side = np.where(values > middle + quarter, 1, np.where(values < middle - quarter, -1, 0))
    known = np.flatnonzero(side)
    return np.asarray(time[known[1:][(side[known][1:] > 0) & (side[known][:-1] < 0)]])


def frequency_of(time: np.ndarray, values: np.ndarray) -> float:
    """Frequency from the upward crossings of the middle [Hz]; NaN where there are no two swings."""
    rises = rises_of(time, values)
    return float((len(rises) - 1) / (rises[-1] - rises[0])) if len(rises) > 1 else math.nan


@dataclass(frozen=True)
class AtRest:
    """Motion of an axis after its reference has come to rest."""

    verdict: Verdict
    reason: str
    """why it is at rest, or not decided"""
    watched: float = 0.0
    """time since the reference has come to rest [s]"""
    motor_amplitude: float = math.nan
    """half of what the motor's angle swings by in the last quarter of that time [rad]"""
    amplitude: float = math.nan
    """the same of the reference's shaft [rad]"""
    frequency: float = math.nan
    """[Hz]; NaN unless it hunts"""
    begin: float = 0.0
    """when the inputs have come to rest [s]"""
    extrapolated: float = 0.0
    """part of the time that was watched in which all contacts are stuck, which was not run [s]"""
    times: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
    """instants that were watched, from the end of the reference [s]"""
    angles: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
    """angle of the reference's shaft at these instants [rad]"""

    @property
    def cycles(self) -> bool:
        """Whether it hunts."""
        return self.verdict == "hunts"

    @property
    def floats(self) -> bool:
        """Whether the load alone swings, while the motor stands."""
        return self.cycles and self.motor_amplitude < STILL * self.amplitude

    def described(self) -> str:
        """Why it does not hunt, with what was watched."""
        return f"{self.reason} ({self.watched:.4g} s after the end of the reference)"


def decide(watch: WatchedRun, first: float, most: float) -> AtRest:
    """Watches the angles of motor and load until it is shown to be at rest, or to swing on.

    first: shortest time to watch [s].
    most: longest time to follow [s]; stuck intervals that are extrapolated do not count.
    """
    duration, seen, idle, outlook = first, 0.0, 0, UNKNOWN
    candidate: tuple[float, np.ndarray, float] | None = None
    while seen < most and idle < IDLE:
        before = len(watch.rows)
        watch.follow(duration, min(round(SAMPLES * duration / first), FINEST))
        idle = idle + 1 if np.all(np.ptp(watch.rows[before:], axis=0) <= watch.noise) else 0
        seen += duration
        window = watch.window(duration / 100.0)
        outlook, looks = watch.outlook(window)
        for _ in range(SKIPS):
            if looks is None or not duration < outlook.breaks_away < FOREVER or not watch.skip(outlook, looks, window):
                break
            outlook, looks = watch.outlook(window)
        if outlook.rests:
            return _decision(watch, "at rest", NOTHING_MOVES)
        if watch.swings():
            if candidate is None:
                candidate = watch.elapsed, watch.swing(0.75, 1.0), watch.period()
            elif watch.elapsed >= CONFIRMED * candidate[0]:
                swings = np.all(watch.swing(0.75, 1.0) >= STEADY * candidate[1])
                if swings and STEADY * watch.period() <= candidate[2]:
                    return _decision(watch, "hunts", "")
                candidate = None
        else:
            candidate = None
        idle = 0 if math.isfinite(outlook.breaks_away) else idle
        duration = min(GROWTH * duration, max(most - seen, first))
    return _decision(watch, "not decided", _why(watch, outlook))


def _decision(watch: WatchedRun, verdict: Verdict, reason: str) -> AtRest:
    swing, watched, frequency = watch.swing(0.75, 1.0), watch.elapsed, math.nan
    if verdict == "hunts":
        moving = int(np.argmax(swing > watch.noise))
        quick = watch.quick_frequency(moving, 0.5 * swing[moving])
        frequency = 1.0 / watch.period() if math.isnan(quick) else quick
    motor, load = (0.5 * swing).tolist()
    return AtRest(
        verdict, reason, watched, motor, load, frequency, watch.settled, watch.skipped, watch.times, watch.rows[:, 1]
    )


def _why(watch: WatchedRun, outlook: Outlook) -> str:
    if text := outlook.describe():
        return text
    before, last = watch.swing(0.5, 0.75), watch.swing(0.75, 1.0)
    moving = np.flatnonzero(last > watch.noise)
    if not len(moving):
        return "nothing moves by more than a billionth of a turn, but not all contacts are stuck, or the controllers still move"
    k = moving[0]
    ratio = last[k] / max(before[k], last[k] * 1e-9)
    course = "undamped" if 0.95 < ratio < 1.05 else f"{ratio:.3g} times as much as in the time before"
    moved = practical(float(last[k]), watch.units[k], 3)
    return f"{watch.names[k].replace('_', ' ')} still swings by {moved}, {course}"


def moving_input(scenario: Scenario) -> str:
    """The name of an input that never comes to rest; empty if all do."""
    signals = {name: (s.sine_list(), s.breakpoint_list()[-1][2:]) for name, s in scenario.signals().items()}
    signals |= {
        scenario.train().variable(motor, "reference"): (c.reference.sine_list(), c.reference.pieces()[-1][2:])
        for motor, c in scenario.axes().items()
    }
    return next((name for name, (sines, slopes) in signals.items() if sines or any(slopes)), "")
