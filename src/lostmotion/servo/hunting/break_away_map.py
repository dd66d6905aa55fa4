"""The map from break-away to break-away of one contact: points of it, and bounds of all its values over an interval.

A slip from the errors ``e + x d``, ``-1 <= x <= 1``, is ``sum of c_k exp(l_k t) (a_k + x b_k + r_k)`` over the modes,
with unknown ``|r_k| <= radius_k`` left by the stuck interval before it. Between two instants a function departs from
its chord by at most an eighth of the square of their distance, times the largest second derivative. The latter is
bounded by the value of each mode at the earlier instant. All bounds are widened by what floating point rounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .continuous_stuck_contact import StickSlip

CURVED = 4e-4  # of what its modes are at an instant, by which a chord may depart from a function between two instants
AFTER = 1.1  # times the end of the middle slip, within which all slips should end
FIRST = 20.0  # times that, a speed that is still shown by its derivative
LATEST = 40.0  # slowest time constants, after which a slip counts as endless
REFINED = 3  # times the end of a slip is enclosed more closely
CLOSER = 4  # times the end of a stuck interval is
PARTS = 48  # of an interval in which a slip ends
MOST = 20_000  # instants of a slip
SETTLED = 30.0  # slowest time constants of the stuck regime


@dataclass(frozen=True)
class Transients:
    """Transients of a stuck interval, by its modes: complex values within circles."""

    middle: np.ndarray
    radius: np.ndarray

    @classmethod
    def none(cls, contact: StickSlip) -> Transients:
        return cls(np.zeros(len(contact.stuck_rates), complex), np.zeros(len(contact.stuck_rates)))

    @property
    def largest(self) -> np.ndarray:
        return np.asarray(np.abs(self.middle) + self.radius)

    def anywhere(self) -> Transients:
        """The same magnitudes with any phase."""
        return Transients(0.0 * self.middle, self.largest)

    def within(self, other: Transients) -> bool:
        return bool(np.all(np.abs(self.middle - other.middle) + self.radius <= other.radius))

    def times(self, factor: float) -> Transients:
        return Transients(factor * self.middle, abs(factor) * self.radius)

    def after(self, rates: np.ndarray, first: float, last: float) -> Transients:
        """The transients after a time between two."""
        first, last = min(first, 1e6 / np.abs(rates.real).min(initial=1.0)), min(last, 1e300)
        decay = np.exp(rates * first)
        if not np.abs(rates).max(initial=0.0) * (last - first) < 1.0:
            return Transients(0.0 * self.middle, np.abs(decay) * self.largest)
        turned = np.exp(rates * 0.5 * (last - first)) * decay
        off = np.abs(decay) * 0.5 * (last - first) * np.abs(rates)
        return Transients(turned * self.middle, np.abs(decay) * self.radius + off * np.abs(self.middle))


@dataclass(frozen=True)
class SlipsFromInterval:
    """Slips from an interval of errors."""

    contact: StickSlip
    middle: np.ndarray
    half: np.ndarray
    radius: np.ndarray

    @classmethod
    def begin(cls, contact: StickSlip, low: float, high: float, left: Transients) -> SlipsFromInterval:
        """The slips from errors between two, with the transients that the stuck interval before has left."""
        middle = 0.5 * (low + high) * contact.q + contact.excess * contact.p + contact.freed @ left.middle
        radius = np.abs(contact.freed) @ left.radius
        return cls(contact, middle, 0.5 * (high - low) * contact.q, np.asarray(radius))

    @property
    def size(self) -> np.ndarray:
        """Largest magnitude of each mode."""
        return np.asarray(np.abs(self.middle) + np.abs(self.half) + self.radius)

    def values(self, rows: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest values of an output, or of several, at instants."""
        decay = np.exp(np.outer(times, self.contact.slip_rates))
        middle, half = ((decay @ (rows * part).T).real.T for part in (self.middle, self.half))
        loose = np.abs(decay) @ (np.abs(rows) * (self.radius + self.contact.rounding * self.size)).T
        spread = np.abs(half) + loose.T
        return middle - spread, middle + spread

    def between(self, rows: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest values of an output, or of several, between each instant and the next."""
        low, high = self.values(rows, times)
        bend = (
            np.exp(np.outer(times[:-1], self.contact.slip_rates.real))
            @ (np.abs(rows) * np.abs(self.contact.slip_rates) ** 2 * self.size).T
        )
        off = 0.125 * np.diff(times) ** 2 * bend.T
        return np.minimum(low[..., :-1], low[..., 1:]) - off, np.maximum(high[..., :-1], high[..., 1:]) + off

    def range_of(self, row: np.ndarray, times: np.ndarray) -> tuple[float, float]:
        low, high = self.between(row, times)
        return float(low.min()), float(high.max())

    def transients(self, times: np.ndarray) -> Transients:
        """Transients at the start of the stuck interval, if the slip ends between the first instant and the last."""
        rows = self.contact.transients
        return Transients(*self.boxes(rows, times))

    def boxes(self, rows: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Middles and radii of several complex outputs over the time between the first instant and the last."""
        low, high = self.between(np.vstack([rows, -1j * rows]), times)
        least, largest = low.min(axis=1).reshape(2, -1), high.max(axis=1).reshape(2, -1)
        least[1, ~rows.imag.any(axis=1)] = largest[1, ~rows.imag.any(axis=1)] = 0.0
        centre, off = 0.5 * (least + largest), 0.5 * (largest - least)
        return centre[0] + 1j * centre[1], np.hypot(*off)

    @property
    def latest(self) -> float:
        """Time after which a slip counts as endless [s]."""
        return float(LATEST / np.abs(self.contact.slip_rates.real).min())

    @cached_property
    def short_grid(self) -> np.ndarray:
        """Instants between which the speed departs little from its chord, until a little after the end of the middle slip."""
        return self._grid(whole=False)

    @cached_property
    def whole_grid(self) -> np.ndarray:
        """The same until a slip counts as endless."""
        return self._grid(whole=True)

    def _grid(self, *, whole: bool) -> np.ndarray:
        rates, speed = self.contact.slip_rates, self.contact.speed
        rough = np.concatenate([[0.0], np.geomspace(1e-3 / np.abs(rates).max(), self.latest, 400)])
        values = (np.exp(np.outer(rough, rates)) @ (speed * self.middle)).real
        reverses = np.flatnonzero(values < 0.0)
        if len(reverses) and not whole:
            rough, values = (x[: int(np.searchsorted(rough, AFTER * rough[reverses[0]])) + 2] for x in (rough, values))
        top, decay = np.abs(values).max(), np.exp(np.outer(rough, rates.real))
        envelope = decay @ (np.abs(speed) * (np.abs(self.middle) + np.abs(self.half)))
        bend = decay @ (np.abs(speed) * np.abs(rates) ** 2 * self.size)
        density = np.sqrt(bend / (8.0 * CURVED * np.minimum(top, envelope)))
        # At first the speed is small, and shown by its derivative.
        order = 1 if self.contact.excess > 0.0 else 2
        at_first = abs(float(((speed * rates**order) @ self.middle).real))
        early = np.cumsum(np.abs(values) > FIRST * CURVED * top) == 0
        bend = decay @ (np.abs(speed) * np.abs(rates) ** (order + 2) * self.size)
        density = np.where(early, np.maximum(density, np.sqrt(bend / (0.8 * at_first))), density)
        count = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(rough) * (density[1:] + density[:-1]))])
        steps = min(int(count[-1]) + 2, MOST)
        return np.asarray(np.interp(np.linspace(0.0, count[-1], steps + 1), count, rough))

    def creep(self) -> float:
        """Largest error that a slip without an end leaves."""
        return float(np.abs(self.contact.error) @ (self.size * np.exp(self.contact.slip_rates.real * self.latest)))

    def grid_from(self, first: float) -> np.ndarray:
        """The instants after one."""
        times = self.whole_grid
        return np.append(first, times[times > first])

    def end(self) -> tuple[float, float] | str:
        """Earliest and latest end of a slip, infinite where it creeps to zero error; else why that is not shown."""
        found = self.end_within(self.short_grid)
        return self.end_within(self.whole_grid) if isinstance(found, str) or math.isinf(found[1]) else found

    def end_within(self, times: np.ndarray) -> tuple[float, float] | str:
        """The same with these instants."""
        rates, speed = self.contact.slip_rates, self.contact.speed
        moving, *rising = self.between(np.array([speed, speed * rates, speed * rates**2]), times)[0] > 0.0
        # From 0 the speed rises as long as its first or its second derivative, times one of the same sign before, is positive.
        for positive in rising:
            moving[: int(np.argmin(positive)) if not positive.all() else len(positive)] = True
        if moving.all():
            return self.latest, math.inf
        first = int(np.argmin(moving))
        if first == 0:
            return "a slip is not shown to begin"
        stopped = np.flatnonzero(self.values(speed, times[first:])[1] < 0.0)
        if not len(stopped):
            return float(times[first]), math.inf
        begin, end = float(times[first]), float(times[first + stopped[0]])
        for _ in range(REFINED):
            inner = np.linspace(begin, end, PARTS + 1)
            moving = self.between(speed, inner)[0] > 0.0
            k = int(np.argmin(moving))
            after = np.flatnonzero(self.values(speed, inner[k:])[1] < 0.0)
            begin, end = float(inner[k]), float(inner[k + after[0]])
        return begin, end


@dataclass(frozen=True)
class Image:
    """Bounds of what follows from an interval of errors."""

    low: float
    high: float  # bounds of the error that is left; positive if the slip ends before it is 0
    slip: tuple[float, float]  # shortest and longest [s]
    stuck: tuple[float, float]  # shortest and longest time until it breaks away again [s]
    left: Transients  # transients that are left then, in the direction of the next slip
    reason: str = ""  # why the bounds do not hold; empty if they do

    @property
    def largest(self) -> float:
        return max(abs(self.low), abs(self.high))

    @property
    def least(self) -> float:
        """Least magnitude of the error that is left."""
        return 0.0 if self.low <= 0.0 <= self.high else min(abs(self.low), abs(self.high))

    @property
    def middle(self) -> float:
        return 0.5 * (self.low + self.high)


def image(contact: StickSlip, low: float, high: float, left: Transients) -> Image:
    """Bounds of the map over an interval of errors, with what the stuck interval before has left."""
    slips, none = SlipsFromInterval.begin(contact, low, high, left), Transients.none(contact)
    found = slips.end()
    if isinstance(found, str):
        return Image(-math.inf, math.inf, (0.0, math.inf), (0.0, math.inf), none, found)
    if found[0] == slips.latest:
        return Image(-slips.creep(), slips.creep(), found, (math.inf, math.inf), none)
    end = min(found[1], slips.latest)
    times = np.linspace(found[0], end, PARTS + 1) if math.isfinite(found[1]) else slips.grid_from(found[0])
    error, torque = slips.range_of(contact.error, times), slips.range_of(contact.torque, times)
    if math.isinf(found[1]):  # it may also creep to zero error
        error = min(error[0], -slips.creep()), max(error[1], slips.creep())
    torque = torque[0] + contact.sliding, torque[1] + contact.sliding
    after = slips.transients(times)
    reason, stuck = "", (0.0, math.inf)
    if _may_be_limited(slips, end, max(map(abs, error)), after.largest):
        reason = "the limit of the controller may act"
    elif slips.range_of(contact.held, times)[0] + contact.sliding <= -contact.breakaway:
        reason = "a slip may end by a reversal, without sticking"
    elif (free := _until_free(contact, error, torque, after)) is None:
        reason = "the transient after a slip may free the contact against its error"
    else:
        stuck, after = free, after.after(contact.stuck_rates, *free)
    if error[1] < 0.0:
        after = after.times(-1.0)
    elif error[0] < 0.0:
        after = after.anywhere()
    return Image(*error, found, stuck, after, reason)


def _may_be_limited(slips: SlipsFromInterval, end: float, error: float, transients: np.ndarray) -> bool:
    """Whether the command may reach its limit in a slip, or in the stuck interval after it."""
    contact, times = slips.contact, slips.short_grid
    times = times if times[-1] >= end else slips.whole_grid
    low, high = slips.range_of(contact.command, np.append(times[times < end], end))
    offset = contact.command_per_torque * contact.sliding
    stuck = abs(contact.command_per_torque) * contact.breakaway + abs(contact.command_per_error) * error
    stuck += float(np.abs(contact.command_of_transients) @ transients)
    return max(abs(low + offset), abs(high + offset), stuck) >= contact.limit


def _until_free(
    contact: StickSlip, error: tuple[float, float], torque: tuple[float, float], left: Transients
) -> tuple[float, float] | None:
    """Shortest and longest time that the contact stays stuck [s]; None where it may break away against its error.

    Held is ``torque + kappa error t + sum of h_k exp(s_k t) r_k``.
    """
    if error[0] < 0.0 < error[1]:
        both = [
            _ramped(contact, (0.0, top), around, left)
            for top, around in ((error[1], torque), (-error[0], _negative(torque)))
        ]
        if any(one is None for one in both):
            return None
        return min(one[0] for one in both if one is not None), math.inf
    if error[1] <= 0.0:
        return _ramped(contact, _negative(error), _negative(torque), left.times(-1.0))
    return _ramped(contact, error, torque, left)


def _negative(pair: tuple[float, float]) -> tuple[float, float]:
    return -pair[1], -pair[0]


def _ramped(
    contact: StickSlip, error: tuple[float, float], torque: tuple[float, float], left: Transients
) -> tuple[float, float] | None:
    """The same of errors that are not negative."""
    middle, radius = contact.held_of_transients * left.middle, np.abs(contact.held_of_transients) * left.radius
    slopes = contact.ramp * error[0], contact.ramp * error[1]

    def held(times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Least and largest torque at instants, the curvature between them, and what has not settled at the last."""
        size = np.exp(np.outer(times, contact.stuck_rates.real))
        swing, loose = (np.exp(np.outer(times, contact.stuck_rates)) @ middle).real, size @ radius
        bend = (
            0.125 * np.diff(times) ** 2 * (size[:-1] @ (np.abs(contact.stuck_rates) ** 2 * (np.abs(middle) + radius)))
        )
        low, high = torque[0] + slopes[0] * times + swing - loose, torque[1] + slopes[1] * times + swing + loose
        return low, high, bend, float(size[-1] @ (np.abs(middle) + radius))

    times = _settling(contact.stuck_rates)
    low, high, bend, rest = held(times)
    over = np.flatnonzero(np.maximum(high[:-1], high[1:]) + bend >= contact.breakaway)
    certain = np.flatnonzero(low >= contact.breakaway)
    back = np.flatnonzero(np.minimum(low[:-1], low[1:]) - bend <= -contact.breakaway)
    if len(back) and (not len(certain) or back[0] <= certain[0]):
        return None
    if torque[0] + slopes[0] * times[-1] - rest <= -contact.breakaway or (error[0] == 0.0 and len(over)):
        return None
    settled = (contact.breakaway - torque[1] - rest) / slopes[1] if slopes[1] > 0.0 else math.inf
    first = float(times[over[0]]) if len(over) else max(settled, float(times[-1]))
    settled = (contact.breakaway - torque[0] + rest) / slopes[0] if slopes[0] > 0.0 else math.inf
    last = float(times[certain[0]]) if len(certain) else settled
    for _ in range(CLOSER if len(over) and len(certain) else 0):
        if not first < last:
            break
        times = np.linspace(first, last, PARTS + 1)
        low, high, bend, _ = held(times)
        over = np.flatnonzero(np.maximum(high[:-1], high[1:]) + bend >= contact.breakaway)
        certain = np.flatnonzero(low >= contact.breakaway)
        first = float(times[over[0]]) if len(over) else first
        last = float(times[certain[0]]) if len(certain) else last
    return first, last


def _settling(rates: np.ndarray) -> np.ndarray:
    """Instants until all transients have settled."""
    if not len(rates):
        return np.array([0.0, 0.0])
    slow, fast = np.abs(rates.real).min(), np.abs(rates).max()
    early = np.linspace(0.0, 8.0 / fast, 200)
    count = min(400 + int(20.0 * fast / slow), 4000)
    return np.append(early, np.geomspace(early[-1], max(SETTLED / slow, 2.0 * early[-1]), count)[1:])
