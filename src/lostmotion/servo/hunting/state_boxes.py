"""Sets of states under a sampled controller with a quantised encoder, followed from break-away until all has settled.

A set is a box of unknowns: ``z = centre + G x``, every ``x`` between -1 and 1. From sample to sample it moves exactly,
as slip, stuck interval and controller are affine. Where a box contains several readings of the encoder, or both ends
and goes on, it is divided. Both parts keep what the division along the largest unknown cannot separate, so that no
state is lost. Sets that stop are collected by their reading, and go on as one box around all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from .continuous_stuck_contact import UndecidableError
from .sampled_stuck_contact import SampledSlip

UNKNOWNS = (
    3  # of a start: error, angle within the encoder step, torque within the ramp of a sample; others are added by stops
)
ROUNDING = 1e-12  # relative
BOXES = 20_000  # at most at once
TICKS = 20_000  # of a slip
GENERATIONS = 200  # of stops without settling
CELLS = 8  # of an encoder step, in which stops are collected
TOO_MANY = "a slip passes too many readings of the encoder to follow them one by one"


@dataclass
class Boxes:
    """Boxes of states after the same sample: arrays with one row for each box."""

    centre: np.ndarray
    mode: np.ndarray  # 1, 0 or -1: slips forward, is stuck, slips in reverse
    waited: np.ndarray  # samples for which it has been stuck
    read: np.ndarray  # last reading less that at the break-away, in steps
    came: np.ndarray  # direction of the slip that has just ended
    spread: np.ndarray  # (box, state, unknown)
    before: np.ndarray  # the reading before the last

    def __len__(self) -> int:
        return len(self.centre)

    def take(self, which: np.ndarray | slice) -> Boxes:
        """Copies of some of them."""
        return Boxes(*(getattr(self, f.name)[which].copy() for f in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Boxes]) -> Boxes:
        """The boxes of several parts as one."""
        parts = [part for part in parts if len(part)] or parts[:1]
        if len(parts) == 1:
            return parts[0]
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))

    @classmethod
    def around(cls, low: np.ndarray, high: np.ndarray, mode: np.ndarray, read: np.ndarray) -> Boxes:
        """Boxes between least and largest values."""
        n, none = low.shape[1], np.zeros(len(low), int)
        spread = np.zeros((len(low), n, UNKNOWNS + n))
        spread[:, np.arange(n), UNKNOWNS + np.arange(n)] = 0.5 * (high - low)
        return cls(0.5 * (low + high), mode, none, read, none.copy(), spread, read.copy())

    def range_of(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest values of an output."""
        middle = self.centre @ row
        half = np.abs(np.einsum("i,bik->bk", row, self.spread)).sum(axis=1) * (1.0 + ROUNDING)
        half = half + ROUNDING * (np.abs(self.centre) @ np.abs(row))
        return middle - half, middle + half

    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest values of all states."""
        half = np.abs(self.spread).sum(axis=2)
        return self.centre - half, self.centre + half

    def moved(self, matrix: np.ndarray, add: np.ndarray | None = None) -> Boxes:
        """Boxes of the states that a matrix makes of them."""
        centre = self.centre @ matrix.T
        return replace(
            self.take(slice(None)), centre=centre if add is None else centre + add, spread=matrix @ self.spread
        )

    def widen(self, state: int, low: np.ndarray, high: np.ndarray) -> None:
        """Add an unknown between two values to a state; unknowns that stops have added are merged before."""
        n = self.centre.shape[1]
        merged = np.abs(self.spread[:, :, UNKNOWNS:]).sum(axis=2)
        self.spread[:, :, UNKNOWNS:] = 0.0
        self.spread[:, np.arange(n), UNKNOWNS + np.arange(n)] = merged
        self.centre[:, state] += 0.5 * (low + high)
        self.spread[:, state, UNKNOWNS + state] += 0.5 * (high - low)

    def clip(self, which: np.ndarray, row: np.ndarray, bound: np.ndarray, side: np.ndarray) -> None:
        """Reduce boxes to where an output is above (1) or below (-1) a bound, as far as the largest unknown decides on it."""
        if not len(which):
            return
        centre, spread, count = self.centre[which], self.spread[which], np.arange(len(which))
        parts = np.einsum("i,bik->bk", row, spread)
        largest = np.argmax(np.abs(parts), axis=1)
        size = np.abs(parts[count, largest])
        others = (np.abs(parts).sum(axis=1) - size) * (1.0 + ROUNDING) + ROUNDING * (np.abs(centre) @ np.abs(row))
        least = np.where(size > 0.0, (side * (bound - centre @ row) - others) / np.where(size > 0.0, size, 1.0), -1.0)
        least = np.clip(least, -1.0, 1.0)
        column = spread[count, :, largest] * (side * np.sign(parts[count, largest]))[:, None]
        self.centre[which] = centre + column * (0.5 * (1.0 + least))[:, None]
        spread[count, :, largest] = column * (0.5 * (1.0 - least))[:, None]
        self.spread[which] = spread


def propagated(contact: SampledSlip, boxes: Boxes, slipped: Callable[[Boxes], list[Boxes]]) -> Boxes:
    """Boxes after a tick; slipping ones go through a function."""
    boxes.came[:] = 0
    still = boxes.mode == 0
    if not still.any():
        return Boxes.joined(slipped(boxes))
    stuck, moving = boxes.take(still), boxes.take(~still)
    after = stuck.moved(contact.stuck)
    after.waited = after.waited + 1
    parts = [after] if contact.lag == 0.0 else freed_within(contact, stuck, after)
    return Boxes.joined([*parts, *(slipped(moving) if len(moving) else ())])


def freed_within(contact: SampledSlip, before: Boxes, after: Boxes) -> list[Boxes]:
    """Boxes that stay stuck over a tick, or the rest of one, and boxes that break away; the torque is monotonic within a tick."""
    one, two = before.range_of(contact.held), after.range_of(contact.held)
    stays = (two[0] < contact.breakaway) & (two[1] > -contact.breakaway)
    parts = [after.take(stays)]
    for way in (1, -1):
        top = np.maximum(along(way, *one)[1], along(way, *two)[1])
        frees = top >= contact.breakaway
        some, speed = after.take(frees), contact.tick * np.maximum(top[frees] - contact.sliding, 0.0) / contact.inertia
        some.mode[:], some.waited[:] = way, 0
        for state, most in ((1, speed), (0, speed * contact.tick)):
            some.widen(state, *along(way, np.zeros(len(some)), most))
        parts.append(some)
    return parts


def one_way(boxes: Boxes, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest readings, which go one way in a slip, and stay while a contact is stuck; not where it returns within a tick."""
    way, free = np.where(boxes.mode != 0, boxes.mode, boxes.came), boxes.mode * boxes.came < 0
    low = np.where((way >= 0) & ~free, np.maximum(low, boxes.read), low)
    return low, np.maximum(np.where((way <= 0) & ~free, np.minimum(high, boxes.read), high), low)


def bend_of(contact: SampledSlip, boxes: Boxes, noise: Callable[[np.ndarray], Any] = lambda _: 0.0) -> np.ndarray:
    """Largest amount by which the speed within a tick is below its least value at the ends; 0 where the torque is held.

    noise: largest effect of readings on an output, beside what is in the boxes.
    """
    if contact.lag == 0.0:
        return np.zeros(len(boxes))

    def most(row: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs(boxes.range_of(row)).max(axis=0) + noise(row))

    push = (np.maximum(most(contact.held), most(contact.command)) + contact.sliding) / contact.inertia
    rate = push + abs(contact.viscous) * (most(np.eye(len(contact.held))[1]) + contact.tick * push)
    change = most(contact.command - contact.held) / (contact.lag * contact.inertia)
    return np.asarray(0.125 * contact.tick**2 * (change + abs(contact.viscous) * rate))


def need_within_limits(contact: SampledSlip, boxes: Boxes, noise: Callable[[np.ndarray], Any] = lambda _: 0.0) -> None:
    """Refuses boxes in which a limit of the controller may act. Raises UndecidableError."""
    for row, limit in contact.limited:
        if len(boxes) and (np.abs(boxes.range_of(row)).max(axis=0) + noise(row)).max() >= limit:
            raise UndecidableError("the limit of the controller may act")


def along(way: Any, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest values in a direction."""
    return np.minimum(way * low, way * high), np.maximum(way * low, way * high)


@dataclass(frozen=True)
class Settled:
    """Stuck states in which all but the integrator has settled."""

    read: np.ndarray  # reading less that at the break-away, in steps
    angle: np.ndarray
    """least and largest angle of the contact's shaft, from the middle of the step of the break-away (box, 2)"""


def starts(contact: SampledSlip, reading: tuple[float, float], cells: int, parts: int) -> list[tuple[int, Boxes]]:
    """Settled states at the break-away forward for readings between two, less the reference, by the tick of a frame."""
    n, ramp, half = len(contact.held), contact.ramp, 0.5 * contact.step
    middle, off = 0.5 * (reading[0] + reading[1]), 0.5 * (reading[1] - reading[0])
    found = []
    for tick, (z, b, rises) in enumerate(zip(ramp.z, ramp.b, ramp.rises, strict=True)):
        here = []
        rise = rises if contact.lag == 0.0 else ramp.rises[(tick + 1) % contact.frame]
        inc = max(rise * reading[0], rise * reading[1])
        if inc <= 0.0 and contact.lag == 0.0:
            continue
        for k, w in np.ndindex(cells, parts):
            spread = np.zeros((n, UNKNOWNS + n))
            # With a lag it breaks away at any instant of the tick that begins here.
            torque = contact.breakaway + abs(inc) * ((w + 0.5) / parts - (1.0 if contact.lag else 0.0))
            centre = z * middle + b * torque
            spread[:, 0], spread[:, 2] = z * off, b * abs(inc) * 0.5 / parts
            centre[0], spread[0] = half * ((2 * k + 1) / cells - 1.0), 0.0
            centre[1], spread[1], spread[0, 1] = 0.0, 0.0, half / cells
            slips = np.array([0 if contact.lag else 1])
            none, read = np.zeros(1, int), np.zeros(1)
            here.append(Boxes(centre[None], slips, none, read, none, spread[None], read))
        found.append((tick, Boxes.joined(here)))
    if not found:
        raise UndecidableError("the torque does not rise to the break-away within a sample")
    return found


class BoxFollower:
    """Follows boxes until all has settled."""

    def __init__(self, contact: SampledSlip, fast: float = math.inf) -> None:
        self.contact = contact
        self.fast = fast
        self.passed: list[tuple[Boxes, int]] = []  # forward slips faster than that, with their tick
        self.settled: list[Settled] = []
        self._stopped: dict[tuple[Any, ...], tuple[np.ndarray, np.ndarray]] = {}

    def follow(self, boxes: Boxes, phase: int) -> Settled:
        """Follow states after the sample at a tick of the frame.

        Raises UndecidableError: the boxes become too many, or a limit of the controller may act.
        """
        work = [(boxes, phase)]
        for _ in range(GENERATIONS):
            for some, tick in work:
                self._until_stopped(some, tick)
            work = self._collected()
            if not work:
                found = [Settled(np.zeros(0), np.zeros((0, 2))), *self.settled]
                return Settled(*(np.concatenate([getattr(s, f.name) for s in found]) for f in fields(Settled)))
        raise UndecidableError("a slip breaks away again before the stuck interval has settled, and does not end")

    def _collected(self) -> list[tuple[Boxes, int]]:
        """One box around all that has stopped with the same readings."""
        work = []
        for tick in {key[0] for key in self._stopped}:
            here = {key: ends for key, ends in self._stopped.items() if key[0] == tick}
            low, high = (np.array([ends[k] for ends in here.values()]) for k in (0, 1))
            work.append((Boxes.around(low, high, *(np.array([key[k] for key in here]) for k in (1, 2))), tick))
        self._stopped = {}
        return work

    def _until_stopped(self, boxes: Boxes, tick: int) -> None:
        for _ in range(TICKS):
            if not len(boxes):
                return
            if len(boxes) > BOXES:
                break
            boxes = propagated(self.contact, boxes, self._slipped)
            tick = (tick + 1) % self.contact.frame
            boxes = self._sampled(boxes, tick)
            need_within_limits(self.contact, boxes)
            done = (boxes.mode == 0) & (boxes.waited >= self.contact.ramp.ticks)
            if done.any():
                one = boxes.take(done)
                angle = np.stack(one.range_of(np.eye(len(self.contact.held))[0]), axis=1)
                self.settled.append(Settled(one.read, angle))
            stopped = (boxes.came != 0) & ~done
            self._collect(boxes.take(stopped), tick)
            fast = (boxes.mode > 0) & (boxes.range_of(np.eye(len(self.contact.held))[1])[0] > self.fast) & ~stopped
            if fast.any():
                self.passed.append((boxes.take(fast), tick))
            boxes = boxes.take(~done & ~stopped & ~fast)
        raise UndecidableError(TOO_MANY)

    def _collect(self, boxes: Boxes, tick: int) -> None:
        low, high = boxes.ends()
        for k in range(len(boxes)):
            cell = math.floor(CELLS * boxes.centre[k, 0] / (self.contact.step or math.inf))
            key = (tick, int(boxes.mode[k]), float(boxes.read[k]), float(boxes.before[k]), cell)
            least, most = self._stopped.get(key, (low[k], high[k]))
            self._stopped[key] = np.minimum(least, low[k]), np.maximum(most, high[k])

    # --- between samples ---

    def _slipped(self, boxes: Boxes) -> list[Boxes]:
        """Boxes that go on slipping over a tick, and boxes that stop in it."""
        contact, way = self.contact, boxes.mode
        after = boxes.moved(contact.slip, way[:, None] * contact.push)
        speed = np.eye(len(contact.held))[1]
        last = along(way, *after.range_of(speed))
        bend = bend_of(contact, boxes)
        sure, going = last[0] > bend, last[1] > 0.0  # the speed is not below 0 at first, or it had stopped before
        unsure = np.flatnonzero(going & ~sure)
        after.clip(unsure, speed, np.zeros(len(unsure)), way[unsure])
        stops = boxes.take(slice(None))
        stops.clip(unsure, contact.slip[1], way[unsure] * (bend[unsure] - contact.push[1]), -way[unsure])
        stopped = np.flatnonzero(~sure)
        if not len(stopped):
            return [after]
        first_speed = along(way, *stops.range_of(speed))[1]
        top = np.where(last[1] <= first_speed, np.maximum(first_speed, 0.0), np.maximum(last[1], 0.0)) + bend
        return [after.take(going), *self._stopped_within(stops.take(stopped), (top * contact.tick)[stopped])]

    def _stopped_within(self, boxes: Boxes, most: np.ndarray) -> list[Boxes]:
        """Stuck from an instant of a tick on, up to which the shaft turns by no more than this."""
        way = boxes.mode
        boxes.centre[:, 1], boxes.spread[:, 1] = 0.0, 0.0
        boxes.widen(0, np.minimum(way * most, 0.0), np.maximum(way * most, 0.0))
        after = boxes.moved(self.contact.stuck)
        after.came, after.mode = way.copy(), 0 * way
        after.waited[:] = 0
        return freed_within(self.contact, boxes, after)

    # --- at a sample ---

    def _sampled(self, boxes: Boxes, tick: int) -> Boxes:
        contact = self.contact
        if contact.step == 0.0:
            after = boxes.moved(contact.linear[tick])
        else:
            matrix, column = contact.samples[tick]
            boxes, read = self._divided(boxes)
            after = boxes.moved(matrix, np.outer(read * contact.quantum, column))
            after.before, after.read = after.read, read
        return after if contact.lag > 0.0 else self._freed(after)

    def _divided(self, boxes: Boxes) -> tuple[Boxes, np.ndarray]:
        """Boxes with one reading each, in steps."""
        row = np.eye(len(self.contact.held))[0] / self.contact.step
        low, high = one_way(boxes, *(np.floor(x + 0.5) for x in boxes.range_of(row)))
        while len(several := np.flatnonzero(high > low)):
            if len(boxes) + len(several) > BOXES:
                raise UndecidableError(TOO_MANY)
            middle = np.floor(boxes.centre[several] @ row) + 0.5
            border = np.clip(middle, low[several] + 0.5, high[several] - 0.5)
            above, here = boxes.take(several), np.arange(len(several))
            above.clip(here, row, border, np.ones(len(several)))
            boxes.clip(several, row, border, -np.ones(len(several)))
            boxes = Boxes.joined([boxes, above])
            low, high = np.append(low, border + 0.5), np.append(high, high[several])
            high[several] = border - 0.5
            least, most = (np.floor(x + 0.5) for x in boxes.range_of(row))
            low, high = (
                np.where(low < high, np.clip(least, low, high), low),
                np.where(low < high, np.clip(most, low, high), high),
            )
        return boxes, low

    def _freed(self, boxes: Boxes) -> Boxes:
        """Frees contacts at the sample, where the torque follows at once."""
        contact = self.contact
        for way in (1, -1):
            low, high = along(way, *boxes.range_of(contact.held))
            may = (boxes.mode == 0) & (high >= contact.breakaway)
            must = may & (low > contact.breakaway)
            boxes.mode[must], boxes.waited[must] = way, 0
            both = np.flatnonzero(may & ~must)
            if len(both):
                freed, sides = boxes.take(both), np.full(len(both), way)
                freed.mode[:], freed.waited[:] = way, 0
                freed.clip(np.arange(len(both)), contact.held, sides * contact.breakaway, sides)
                boxes.clip(both, contact.held, sides * contact.breakaway, -sides)
                boxes = Boxes.joined([boxes, freed])
        return boxes
