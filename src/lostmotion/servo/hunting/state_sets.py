"""Sets of states under a sampled controller: propagation of boxes (`state_boxes`) and slip starts (`slip_starts`) over a sample time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from .sampled_stuck_contact import SampledSlip
from .stuck_contact import UndecidableError


@dataclass
class Sets:
    """Base of sets of states after the same sample: arrays with one row for each set.

    Each kind has `range_of(row)`: the least and largest values of an output, widened by what floating point rounds. `moved(matrix, add)`
    returns the sets after a matrix, and `widen(state, low, high)` adds an unknown to a state.
    """

    centre: np.ndarray
    mode: np.ndarray  # 1, 0 or -1: slips forward, is stuck, slips in reverse
    waited: np.ndarray  # samples for which it has been stuck
    read: np.ndarray  # last reading less that at the break-away, in steps
    came: np.ndarray  # direction of the slip that has just ended

    def __len__(self) -> int:
        return len(self.centre)

    def take(self, which: np.ndarray) -> Self:
        """Copies of some of them."""
        return type(self)(*(getattr(self, f.name)[which].copy() for f in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The sets of several parts as one."""
        parts = [part for part in parts if len(part)] or parts[:1]
        if len(parts) == 1:
            return parts[0]
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))


def propagated(contact: SampledSlip, sets: Any, slipped: Callable[[Any], list[Any]]) -> Any:
    """Sets after a tick; slipping sets go through a function of their kind."""
    sets.came[:] = 0
    still = sets.mode == 0
    if not still.any():
        return sets.joined(slipped(sets))
    stuck, moving = sets.take(still), sets.take(~still)
    after = stuck.moved(contact.stuck)
    after.waited = after.waited + 1
    parts = [after] if contact.lag == 0.0 else freed_within(contact, stuck, after)
    return sets.joined([*parts, *(slipped(moving) if len(moving) else ())])


def freed_within(contact: SampledSlip, before: Any, after: Any) -> list[Any]:
    """Sets that stay stuck over a tick, or the rest of one, and sets that break away; the torque is monotonic within a tick."""
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


def one_way(sets: Sets, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest readings, which go one way in a slip, and stay while a contact is stuck; not where it returns within a tick."""
    way, free = np.where(sets.mode != 0, sets.mode, sets.came), sets.mode * sets.came < 0
    low = np.where((way >= 0) & ~free, np.maximum(low, sets.read), low)
    return low, np.maximum(np.where((way <= 0) & ~free, np.minimum(high, sets.read), high), low)


def bend_of(contact: SampledSlip, sets: Any, noise: Callable[[np.ndarray], Any] = lambda _: 0.0) -> np.ndarray:
    """Largest amount by which the speed within a tick is below its least value at the ends; 0 where the torque is held.

    noise: largest effect of readings on an output, beside what is in the sets.
    """
    if contact.lag == 0.0:
        return np.zeros(len(sets))

    def most(row: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs(sets.range_of(row)).max(axis=0) + noise(row))

    push = (np.maximum(most(contact.held), most(contact.command)) + contact.sliding) / contact.inertia
    rate = push + abs(contact.viscous) * (most(np.eye(len(contact.held))[1]) + contact.tick * push)
    change = most(contact.command - contact.held) / (contact.lag * contact.inertia)
    return np.asarray(0.125 * contact.tick**2 * (change + abs(contact.viscous) * rate))


def need_within_limits(contact: SampledSlip, sets: Any, noise: Callable[[np.ndarray], Any] = lambda _: 0.0) -> None:
    """Refuses sets in which a limit of the controller may act. Raises UndecidableError."""
    for row, limit in contact.limited:
        if len(sets) and (np.abs(sets.range_of(row)).max(axis=0) + noise(row)).max() >= limit:
            raise UndecidableError("the limit of the controller may act")


def along(way: Any, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest values in a direction."""
    return np.minimum(way * low, way * high), np.maximum(way * low, way * high)
