"""Periodic motions of closed loops under a sine, by shooting with the state of the controllers in the map.

The map leads over whole periods that take a whole number of sample times, from the middle of one tick to the middle
of another. The state is the state of the drive and all values that the controllers remember. A quantised encoder
makes it constant by pieces, so that its derivatives mean nothing; neither does the state of a controller at its limits. Therefore
the limit of the sequence of states is extrapolated by the method of reduced rank. The method is exact in d + 1 steps
if the map is affine on d dimensions, and converges as Newton's method does if it is smooth. Its limit is taken only
if the motion from there repeats better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..control.axis import BoundController
from ..control.controller import AnyReference, Controller
from ..control.references import PositionReference
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.simulation import Simulation
from ..simulation.stepping.solver_access import solver_of
from ..units.practical import counted
from .plant import Plant
from .windows import Window

DEPTHS = (2, 6, 12, 24)  # windows followed before the limit is extrapolated, the first times; then the last number
REPEATS = 1e-10  # largest change of a variable over a window / its magnitude, for a motion to count as periodic
POLISHED = 1e-13  # the same, where rounding ends the descent
RANK = 1e-11  # singular values below this of the largest are rounding
SETTLING = 15.0  # of the slowest time constant of the loops, before means are taken
AGREEING = 1e-3  # relative difference of two means over many periods that counts as none
MOST = 256  # windows of a motion that does not repeat, over which it is averaged at most


@dataclass(frozen=True)
class AxisSignal:
    """A variable that a controller holds from tick to tick."""

    name: str
    slot: int  # slot in the memory of all controllers
    every: int  # ticks from one value to the next; 0: it varies between the ticks
    phase: int  # tick of the first


@dataclass(frozen=True)
class Motion:
    """Motion at one point."""

    plant: np.ndarray  # variables of the drive or train over the samples, (channel, sample) of one window or more
    signals: dict[str, tuple[np.ndarray, np.ndarray]]
    """for each variable of a controller the angles of the sine at its instants [rad], and its values"""
    residual: float
    windows: int  # followed, all in all
    jumps: int  # extrapolations that were taken
    advance: float  # advance of the reported angle over a period [rad]
    spread: float  # spread of the first harmonic of the output from window to window / its mean; 0 of a periodic motion


class ClosedLoop:
    """A scenario with controllers under one sine."""

    def __init__(self, plant: Plant, source: str, amplitude: float, window: Window, law: Any) -> None:
        self.plant, self.window = plant, window
        self.simulation = _UnderSine(plant, source, amplitude, window.frequency, law)
        self.core, control = solver_of(self.simulation)
        self.constants = {name: plant.signals[name].mean for name in self.simulation.inputs}
        self.begin = 0  # tick at which the window begins
        self._running = list(running_slots(control))
        self.windows = self.jumps = 0
        self._to(0)

    def _to(self, sample: int) -> None:
        """Advances to a sample of the window."""
        w = self.window
        ticks = self.begin + (sample * w.stride + 0.5) / w.points
        self.simulation.advance(ticks * w.tick - self.simulation.time, **self.constants)

    def follow(self) -> None:
        """Advance over one window."""
        self._to(self.window.samples)
        self._next()

    def _next(self) -> None:
        self.begin += self.window.ticks
        self.windows += 1

    def record(self) -> tuple[np.ndarray, np.ndarray]:
        """Advance over one window and record the variables of the plant and the memory and signals of the controllers
        at each sample, (variable, sample)."""
        rows, slots = [], []
        windings = list(self.simulation.winding_torques())
        for sample in range(1, self.window.samples + 1):
            row = self.core.read()
            for channel, torque in windings:  # in place of the straight line that drives the mechanics
                row[channel] = torque(row)
            rows.append(row)
            slots.append([*self.core.get_state()["control"][1:], *self.core.control_signals()])
            self._to(sample)
        self._next()
        return np.array(rows).T, np.array(slots).T

    # --- state of the map ---

    def state(self) -> tuple[np.ndarray, tuple[int, ...]]:
        """The numbers that vary continuously, and the modes of the contacts with the pieces of the laws."""
        return state_of(self.core, self._running)

    def set_state(self, numbers: np.ndarray) -> None:
        """Set the state, in the present modes."""
        set_state(self.core, self._running, numbers)


def state_of(core: Any, running: list[int]) -> tuple[np.ndarray, tuple[int, ...]]:
    """The numbers of a stepped drive that vary continuously, and the modes of the contacts with the pieces of the laws.

    running: slots of the controllers that no motion restores.
    """
    now = core.get_state()
    return np.array([*now["state"], *now["memory"], *np.delete(now["control"][1:], running)]), tuple(now["regime"])


def set_state(core: Any, running: list[int], numbers: np.ndarray) -> None:
    """Set these numbers, in the present modes."""
    now = core.get_state()
    v, n, m = numbers.tolist(), len(now["state"]), len(now["state"]) + len(now["memory"])
    known = n + len(now["inputs"])  # of the course: rates, and the inputs that they belong to
    now["course"][known:] = [0.0] * (len(now["course"]) - known)
    slots = np.array(now["control"])
    slots[1:][np.delete(np.arange(len(slots) - 1), running)] = v[m:]
    core.set_state(now | {"state": v[:n], "memory": v[n:m], "control": slots.tolist()})


class _UnderSine(Simulation):
    """A plant whose references are constant but for the source, which is a sine; a load torque is an input of the simulation."""

    def __init__(self, plant: Plant, source: str, amplitude: float, frequency: float, law: Any) -> None:
        self._sines = {source: (amplitude, frequency)}
        super().__init__(under_sine(plant, source, amplitude, frequency), law=law)


def running_slots(control: BoundController) -> Iterator[int]:
    """Slots in the memory of all controllers with instants and energies of windings, which no periodic motion restores."""
    first = 0
    for axis in control[1]:
        count, running = axis.slots()
        yield from (first + slot for slot in running)
        first += count


def mean_of(reference: AnyReference) -> float:
    """Its constant part; of moves the position before them."""
    return reference.mean + (reference.start if isinstance(reference, PositionReference) else 0.0)


def under_sine(plant: Plant, source: str, amplitude: float, frequency: float) -> Scenario:
    """The scenario with references that are constant but for the source, which is a sine."""
    scenario, axes = plant.scenario, {}
    for motor, controller in scenario.axes().items():
        name = scenario.train().variable(motor, "reference")
        wave = {"amplitude": amplitude, "frequency": frequency} if name == source else {}
        mean = mean_of(controller.reference)
        reference = type(controller.reference).model_validate({"mean": mean, **wave})
        axes[motor] = controller.model_copy(update={"reference": reference})
    return scenario.with_axes(axes)


class Search:
    """Looks for the periodic motion of a closed loop, or where its encoders have steps for the mean of one that does not repeat."""

    def __init__(self, loop: ClosedLoop, signals: Sequence[AxisSignal], max_periods: int) -> None:
        self.loop, self.signals = loop, signals
        self.most = max(max_periods // loop.window.periods, 2)
        axes = loop.plant.scenario.axes().values()
        self.free = any(c.reference.kind != "position" for c in axes)
        encoders = [e for c in axes for e in (c.encoder, c.position_encoder) if e is not None]
        self.quantised = any(e.step > 0.0 for e in encoders)
        self.slowest = max(map(slowest, axes))

    def find(self) -> Motion | str:
        """The motion, or why there is none."""
        try:
            return self._averaged() if self.quantised else self._periodic()
        except _core.SolverError as error:
            return str(error)

    def _periodic(self) -> Motion | str:
        loop, best, attempt = self.loop, None, 0
        while loop.windows < self.most:
            depth = DEPTHS[min(attempt, len(DEPTHS) - 1)]
            attempt += 1
            self._approach(depth)
            first, _ = loop.record()
            second, slots = loop.record()
            residual = self.residual(first, second)
            gained = best is None or residual < 0.1 * best.residual
            if best is None or residual < best.residual:
                best = self._motion(second, slots, residual, 1)
            if best.residual <= POLISHED or (best.residual <= REPEATS and not gained):
                return best
        if best is not None and best.residual <= REPEATS:
            return best
        change = math.inf if best is None else best.residual
        periods = loop.windows * loop.window.periods
        return f"not periodic after {counted(periods, 'period')}: the variables still change by {change:.1e}"

    def _approach(self, depth: int) -> None:
        """Follows the motion for so many windows, and goes on from their limit if that repeats better."""
        loop = self.loop
        states = [loop.state()]
        for _ in range(depth):
            loop.follow()
            states.append(loop.state())
        if len({key for _, key in states}) > 1:
            return
        numbers = np.array([x for x, _ in states])
        limit = limit_of(numbers, free=self.free)
        if limit is None:
            return
        kept, begin = loop.simulation.state, loop.begin
        try:
            loop.set_state(limit)
            after = [loop.state()]
            for _ in range(2):
                loop.follow()
                after.append(loop.state())
        except _core.SolverError:
            after = []
        scale = np.abs(np.diff(numbers, axis=0)).max(axis=0)
        if after and change(np.array([x for x, _ in after]), scale, self.free) < change(numbers, scale, self.free):
            loop.jumps += 1
        else:
            loop.simulation.state, loop.begin = kept, begin

    def _averaged(self) -> Motion | str:
        """Means over ever more windows, without the first half, until two quarters agree."""
        loop, w = self.loop, self.loop.window
        plants: list[np.ndarray] = []
        slots: list[np.ndarray] = []
        count = 2 * max(2, math.ceil(SETTLING * self.slowest / (w.ticks * w.tick)))
        most = min(self.most, max(MOST, count))
        while True:
            while len(plants) < count:
                one, two = loop.record()
                plants.append(one)
                slots.append(two)
            residual = self.residual(plants[-2], plants[-1])
            if residual <= REPEATS:
                return self._motion(plants[-1], slots[-1], residual, 1)
            half = count // 2
            values = np.array([self._output(*both) for both in zip(plants[half:], slots[half:], strict=True)])
            early, late = np.split(values, [len(values) // 2])
            off = abs(early.mean() - late.mean())
            if off <= AGREEING * abs(values.mean()) or 2 * count > most:
                return self._motion(np.hstack(plants[half:]), np.hstack(slots[half:]), residual, len(values), values)
            count *= 2

    def _output(self, plant: np.ndarray, slots: np.ndarray) -> complex:
        """First harmonic of the plant's output in one window."""
        name, w = self.loop.plant.output, self.loop.window
        if name in (s.name for s in self.signals):
            angles, values = self._sampled(next(s for s in self.signals if s.name == name), slots)
        else:
            angles, values = w.angle(w.offsets), plant[self.loop.plant.channels.index(name)]
        return complex(np.mean(values * np.exp(-1j * angles)))

    def residual(self, before: np.ndarray, after: np.ndarray) -> float:
        """Largest change of a variable of the plant from window to window / its magnitude."""
        difference = after - before
        for k, name in enumerate(self.loop.plant.channels[: len(before)]):
            if self.free and name.endswith("_angle"):
                difference[k] -= difference[k, 0]  # it may advance
            elif name.endswith("_contact"):
                difference[k] = 0.0  # a mode, which jumps
        scale = np.abs(after).max(axis=1)
        worst = np.abs(difference).max(axis=1)[scale > 0.0] / scale[scale > 0.0]
        return float(worst.max(initial=0.0))

    def _sampled(self, signal: AxisSignal, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles of the sine at the instants of a controller's variable, and its values."""
        w = self.loop.window
        if signal.every == 0:
            return w.angle((np.arange(slots.shape[1]) * w.stride + 0.5) / w.points), slots[signal.slot]
        ticks = np.floor(np.arange(slots.shape[1]) * w.stride / w.points).astype(int)
        since = np.mod(ticks - signal.phase, signal.every)
        if w.stride == 1:
            new = (since == 0) & (np.arange(len(ticks)) % w.points == 0)
            return w.angle(ticks[new]), slots[signal.slot, new]
        return w.angle(ticks - since), slots[signal.slot]

    def _motion(
        self, plant: np.ndarray, slots: np.ndarray, residual: float, windows: int, values: np.ndarray | None = None
    ) -> Motion:
        loop = self.loop
        k = loop.plant.channels.index(loop.plant.angle)
        return Motion(
            plant=plant,
            signals={s.name: self._sampled(s, slots) for s in self.signals},
            residual=residual,
            windows=loop.windows,
            jumps=loop.jumps,
            advance=(loop.core.read()[k] - plant[k, 0]) / (windows * loop.window.periods),
            spread=0.0 if values is None else float(np.std(values) / abs(values.mean())),
        )


def slowest(controller: Controller) -> float:
    """The slowest time constant of its loops [s]."""
    c, times = controller, [0.0]
    if c.position is not None:
        times.append(1.0 / c.position.gain)
        times += [c.position.gain / c.position.integral_gain] if c.position.integral_gain else []
    if c.speed is not None and c.speed.k_i:
        times.append(c.speed.gain / c.speed.k_i)
    return max(times)


def change(numbers: np.ndarray, scale: np.ndarray, free: bool) -> float:
    """Change of the last state over its window, in units of a scale; for a free angle, change of the change."""
    moved = np.diff(numbers, n=2 if free else 1, axis=0)[-1]
    return float(np.max(np.abs(moved[scale > 0.0]) / scale[scale > 0.0], initial=0.0))


def limit_of(numbers: np.ndarray, *, free: bool) -> np.ndarray | None:
    """Limit of a sequence of states by reduced rank extrapolation: the affine combination of them whose change is least.

    free: an angle may advance by the same in each step: the change of the change counts.
    """
    changes = np.diff(numbers, n=2 if free else 1, axis=0)
    scale = np.abs(changes).max(axis=0)
    moving = scale > 0.0
    if not moving.any() or len(changes) < 2:
        return None
    relative = (changes[:, moving] / scale[moving]).T
    second = np.diff(relative, axis=1)
    share, *_ = np.linalg.lstsq(second, -relative[:, 0], rcond=RANK)
    limit = numbers[0] + np.diff(numbers, axis=0)[: len(share)].T @ share
    return limit if np.all(np.isfinite(limit)) else None
