"""Slips from one reading of an encoder, followed exactly: where they lead for each angle within the step and each instant of the break-away.

A start is two numbers: the angle ``x`` within the encoder step, and the torque ``w`` within its rise of a sample. As the
controller only knows readings, the state after any sequence of readings is ``c + g w``, and the angle has ``x`` added.
The starts with one sequence are cut out of the square by straight lines. A piece of them lies between two values of
``w`` and between two lines. Where a piece contains two readings, or both ends and goes on, it is cut in two, and no start
is lost. A radius bounds what is not affine: the angle that is left within the sample of a stop, and the break-away
within a sample.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from .quantised_slip_end import finish, loudest
from .sampled_stuck_contact import SampledSlip
from .slip_starts import ROUNDING, Pieces, kept_beside
from .state_sets import along, bend_of, freed_within, need_within_limits, one_way, propagated
from .stuck_contact import UndecidableError

PIECES = 60_000  # at most at once
WORK = 25_000_000  # pieces of all ticks together
TOO_MANY = "a slip passes too many readings of the encoder to follow them one by one"
TICKS = 6_000  # of a slip
STRIPS = 24  # of a sample, within which a torque with a lag frees the contact


class Slips:
    """Follows the slips of a loop with an encoder with steps from one reading."""

    def __init__(self, contact: SampledSlip) -> None:
        self.contact = contact
        self.n = len(contact.held)
        self.speed = np.eye(self.n)[1]
        self.work = 0
        self._left: dict[tuple[int, bool], set[int]] = {}

    def one(self, count: int) -> int:
        """The error in steps that one of these slips leaves, from the middle of the encoder step."""
        tick, start = self.starts(count)[0]
        some = start.between(np.full(len(start), 0.5), np.full(len(start), 0.5)).take(np.array([0]))
        some.below[:] = some.above[:] = 0.0
        return count - int(next(iter(self._followed(some, tick, math.inf))))

    def left(self, count: int, *, bounded: bool) -> set[int]:
        """Errors in steps with which the contact is stuck, once all has settled, after a slip forward from one in steps.

        bounded: whether the rest of a slip is bounded as in `finish`, once all speeds exceed what readings can take
            from them. It is quicker than to follow all readings to the end, and finds more errors.

        Raises UndecidableError: the pieces become too many, or a limit of the controller may act.
        """
        if (count, bounded) not in self._left:
            fast = self._loudest if bounded else math.inf
            ends = [self._followed(start, tick, fast) for tick, start in self.starts(count)]
            self._left[count, bounded] = {count - int(read) for read in set().union(*ends)}
        return self._left[count, bounded]

    @cached_property
    def _loudest(self) -> float:
        return loudest(self.contact)

    # --- starts ---

    def starts(self, count: int) -> list[tuple[int, Pieces]]:
        """Starts of the slips forward, by the tick of a frame after whose sample they are given."""
        contact, ramp, reading, found = self.contact, self.contact.ramp, -count * self.contact.quantum, []
        for tick, (z, b) in enumerate(zip(ramp.z, ramp.b, strict=True)):
            if contact.lag == 0.0:
                rise = ramp.rises[tick] * reading
                if rise > 0.0:
                    start = z * reading + b * contact.breakaway
                    found.append((tick, self._pieces(start[None], (b * rise)[None], np.array([[0.0, 1.0]]), 1)))
                continue
            rise = ramp.rises[(tick + 1) % contact.frame] * reading
            if rise > 0.0:
                found.append(((tick + 1) % contact.frame, self._freed(z * reading + b * contact.breakaway, b, rise)))
        if not found:
            raise UndecidableError("the torque does not rise to the break-away within a sample")
        return found

    def _pieces(self, centre: np.ndarray, slope: np.ndarray, strip: np.ndarray, mode: int) -> Pieces:
        k, half = len(centre), 0.5 * self.contact.step
        centre, slope = centre.copy(), slope.copy()
        centre[:, :2] = slope[:, :2] = 0.0
        none = np.zeros(k, int)
        side = np.full((k, 2), half)
        return Pieces(centre, none + mode, none, np.zeros(k), none.copy(), slope, 0.0 * centre, strip, -side, side)

    def _freed(self, start: np.ndarray, b: np.ndarray, rise: float) -> Pieces:
        """Starts after the tick in which the torque with its lag rises to the break-away: ``start + b (w - 1) rise`` before it.

        All torques are shifted by w. For w = 1 the torque is ``T_S + gap (1 - exp(-t / lag))``, and rises over a tick by
        ``rise``. It breaks away when this is above T_S by ``(1 - w) rise``. Speed and angle after the tick are integrals
        from there, whose slopes over w are products of monotonic factors.
        """
        contact = self.contact
        gap = float(contact.command @ start) - contact.breakaway  # to which the torque goes, for w = 1
        if gap <= 0.0:
            raise UndecidableError("the torque does not rise to the break-away within a sample")
        # Strips of equal time.
        fall = np.exp(-np.linspace(0.0, contact.tick, STRIPS + 1)[::-1] / contact.lag)
        edges = 1.0 - (1.0 - fall) / (1.0 - fall[0])
        left = np.linspace(0.0, contact.tick, STRIPS + 1)
        rate = gap * fall / contact.lag  # of the torque at the break-away
        speeds, angles = self._reached(gap, rise, edges, left)
        b = b * rise
        pieces = self._pieces(
            np.tile(start - b, (STRIPS, 1)), np.tile(b, (STRIPS, 1)), np.stack([edges[:-1], edges[1:]], axis=1), 1
        )
        pieces = pieces.moved(contact.stuck)
        width = np.diff(edges)
        for state, ends in ((1, speeds), (0, angles)):
            slope = np.diff(ends) / width
            pieces.slope[:, state] = slope
            pieces.centre[:, state] = ends[:-1] - slope * edges[:-1]
            pieces.radius[:, state] = 0.25 * width * self._spread(left, rate, rise, state) + ROUNDING * np.abs(ends[1:])
        return pieces

    def _spread(self, left: np.ndarray, rate: np.ndarray, rise: float, state: int) -> np.ndarray:
        """Largest less least slope over w of the speed (1) or angle (0) after the tick, in each strip; all factors are monotonic."""
        contact = self.contact
        first, second = _integrals(contact.viscous, left)
        grown = np.exp(contact.viscous * left)
        one, two = (grown, first) if state else (first, second)

        def ends(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])

        (a, b), (c, d), (e, f) = ends(one), ends(two), ends(rate)
        return np.asarray(rise * ((b / e - a / f) * contact.excess + d - c) / contact.inertia)

    def _reached(self, gap: float, rise: float, w: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Speed and angle after the tick: over the time that is left, the torque is T_S + (gap - (1 - w) rise) (1 - exp(-t / lag))."""
        from scipy.linalg import expm

        contact, found = self.contact, []
        for one, time in zip(w, left, strict=True):
            A = np.zeros((4, 4))  # angle, speed, rest of the torque to come, 1
            A[0, 1], A[1, 1], A[2, 2] = 1.0, contact.viscous, -1.0 / contact.lag
            to_come = gap - (1.0 - one) * rise
            A[1, 2], A[1, 3] = -1.0 / contact.inertia, (contact.excess + to_come) / contact.inertia
            found.append((expm(A * time) @ np.array([0.0, 0.0, to_come, 1.0]))[:2])
        angles, speeds = np.array(found).T
        return speeds, angles

    # --- until all has settled ---

    def _followed(self, pieces: Pieces, tick: int, fast: float) -> set[int]:
        contact, found = self.contact, set()
        for k in range(TICKS):
            if k or contact.lag == 0.0:
                pieces = propagated(contact, pieces, self._slipped)
                tick = (tick + 1) % contact.frame
            pieces = self._sampled(pieces, tick)
            done = self._settles(pieces, tick)
            found |= set(pieces.read[done].tolist())
            passed = (pieces.mode > 0) & (pieces.range_of(self.speed)[0] > fast)
            if passed.any():
                for least, most in zip(*finish(contact, pieces.take(passed).boxes(), tick), strict=True):
                    first, last = least / contact.step + 0.5 - ROUNDING, most / contact.step + 0.5 + ROUNDING
                    found |= set(range(math.floor(first), math.floor(last) + 1))
            pieces = pieces.take(~done & ~passed)
            if not len(pieces):
                return found
            self.work += len(pieces)
            if len(pieces) > PIECES or self.work > WORK:
                break
        raise UndecidableError(TOO_MANY)

    def _settles(self, pieces: Pieces, tick: int) -> np.ndarray:
        """Mask of the pieces that stay stuck until all but the integrator has settled."""
        contact = self.contact
        done = np.asarray((pieces.mode == 0) & (pieces.waited >= contact.ramp.ticks))
        some = np.flatnonzero((pieces.mode == 0) & (pieces.waited == 1))
        if len(some):
            rows, constants = self._torques[tick]
            here = pieces.take(some)
            ends = here.centre @ rows.T + np.outer(here.read * contact.quantum, constants)
            slopes = here.slope @ rows.T
            most = np.maximum(*(np.abs(ends + slopes * w[:, None]).max(axis=1) for w in here.strip.T))
            most += (here.radius @ np.abs(rows).T).max(axis=1)
            done[some[most < contact.breakaway * (1.0 - ROUNDING)]] = True
        return done

    @cached_property
    def _torques(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Torques at the samples of a stuck interval over the state at its beginning, and over its reading, for each tick of a frame."""
        contact, found = self.contact, []
        for tick in range(contact.frame):
            matrix, constant = np.eye(self.n), np.zeros(self.n)
            rows, constants = [], []
            for k in range(1, contact.ramp.ticks + 1):
                S, column = contact.samples[(tick + k) % contact.frame]
                for after in (contact.stuck, S):  # the torque is monotonic in between
                    matrix, constant = after @ matrix, after @ constant
                    if after is S:
                        constant = constant + column
                    rows.append(contact.held @ matrix)
                    constants.append(float(contact.held @ constant))
            found.append((np.array(rows), np.array(constants)))
        return found

    def _slipped(self, before: Pieces) -> list[Pieces]:
        """Pieces that go on slipping over a tick, and pieces that stop in it."""
        contact, way = self.contact, before.mode
        bend = bend_of(contact, before)
        after = before.moved(contact.slip, way[:, None] * contact.push)
        low = along(way, *after.range_of(self.speed))[0]
        sure = low > bend
        unsure = np.flatnonzero(~sure)
        if not len(unsure):
            return [after]
        some = after.take(unsure)
        going = some.where(self.speed, np.zeros(len(some)), some.mode)
        # The starts of the stopping pieces are the same.
        stops = before.take(unsure)
        radius = some.radius[:, 1]
        row = self.contact.slip[1]
        stops = stops.where(row, stops.mode * (bend[unsure] - contact.push[1] + radius), -stops.mode)
        return [after.take(sure), going, *self._stopped_within(stops)]

    def _stopped_within(self, pieces: Pieces) -> list[Pieces]:
        """Stuck from an instant of a tick on."""
        contact, way = self.contact, pieces.mode.copy()
        if not len(pieces):
            return []
        slow, quick = along(way, *pieces.range_of(self.speed))
        slow, quick = np.maximum(slow, 0.0), np.maximum(quick, 0.0)
        after = pieces.take(np.arange(len(pieces)))
        torque = np.stack(
            [
                *along(way, *pieces.range_of(contact.held)),
                *along(way, *(pieces.range_of(contact.held if contact.lag == 0.0 else contact.command))),
            ]
        )
        push = (torque.max(axis=0) - contact.sliding) / contact.inertia
        pull = (contact.sliding - torque.min(axis=0)) / contact.inertia + abs(contact.viscous) * quick
        top = quick + contact.tick * np.maximum(push, 0.0)
        most = top * contact.tick
        brakes = push < 0.0
        least = np.where(brakes, 0.5 * slow**2 / np.where(brakes, pull, 1.0), 0.0)
        most = np.where(brakes, np.minimum(0.5 * quick**2 / np.where(brakes, -push, 1.0), most), most)
        least = np.minimum(least, most)
        for values in (after.centre, after.slope, after.radius):
            values[:, 1] = 0.0
        after = after.moved(contact.stuck)
        after.widen(0, *along(way, least, most))
        after.came, after.mode = way, 0 * way
        after.waited[:] = 0
        return freed_within(contact, pieces, after)

    # --- at a sample ---

    def _sampled(self, pieces: Pieces, tick: int) -> Pieces:
        contact = self.contact
        matrix, column = contact.samples[tick]
        pieces = self._divided(pieces)
        pieces = pieces.moved(matrix, np.outer(pieces.read * contact.quantum, column))
        need_within_limits(contact, pieces)
        return pieces if contact.lag > 0.0 else self._freed_at(pieces)

    def _divided(self, pieces: Pieces) -> Pieces:
        """Pieces with one reading each."""
        step, out, known = self.contact.step, [], np.full(len(pieces), -math.inf)
        while True:
            least, most = pieces.angles()
            low, high = one_way(pieces, np.floor(least / step + 0.5 - ROUNDING), np.floor(most / step + 0.5 + ROUNDING))
            low = np.maximum(low, known)
            one = high <= low
            same = pieces.take(one)
            same.read = low[one]
            out.append(same)
            if one.all():
                return Pieces.joined(out)
            some, low = pieces.take(~one), low[~one]
            if len(some) + sum(map(len, out)) > PIECES:
                raise UndecidableError(TOO_MANY)
            line = (low[:, None] + 0.5) * step - some.centre[:, :1] - some.slope[:, :1] * some.strip
            slack = (some.radius[:, 0] + ROUNDING * step)[:, None]
            below, at = kept_beside(some, line + slack, 1.0)
            below.read = low[at]
            out.append(below)
            pieces, at = kept_beside(some, line - slack, -1.0)
            known = low[at] + 1.0

    def _freed_at(self, pieces: Pieces) -> Pieces:
        """Frees contacts at the sample, where the torque follows at once."""
        contact = self.contact
        for way in (1, -1):
            high = along(way, *pieces.range_of(contact.held))[1]
            may = (pieces.mode == 0) & (high >= contact.breakaway)
            if not may.any():
                continue
            some = pieces.take(may)
            sides = np.full(len(some), way)
            freed = some.where(contact.held, sides * contact.breakaway, sides)
            freed.mode[:], freed.waited[:] = way, 0
            stays = some.where(contact.held, sides * contact.breakaway, -sides)
            pieces = Pieces.joined([pieces.take(~may), freed, stays])
        return pieces


def _integrals(a: float, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integral of ``exp(a t)`` over a time, and the integral of this integral."""
    x = a * time
    small = np.abs(x) < 1e-5
    safe = np.where(small, 1.0, x)
    first = np.where(small, 1.0 + 0.5 * x, np.expm1(safe) / safe)
    second = np.where(small, 0.5 + x / 6.0, (np.expm1(safe) - safe) / safe**2)
    return first * time, second * time**2
