"""Whether a stuck contact hunts under a sampled controller: a proof by sets of states from break-away to break-away.

An encoder with steps makes three cases. If no reading is the reference, the integrator never stops, and nothing can
rest. If ``T_S = T_C`` and a reading is the reference, the errors fall step by step. It is enough that all slips from
the last few readings end at the reference. If ``T_S > T_C``, a band of errors that is mapped into itself is never left,
as with a continuous controller. A band of few readings is followed reading by reading, a wider one by intervals.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...model.shaft_ratio import turns
from ...units.practical import counted
from ..linear_regimes import Axis
from .continuous_proof import MARGIN, WIDER, Proof
from .continuous_stuck_contact import UndecidableError
from .hunting_decision import WatchedRun
from .quantised_slip_end import finish, loudest
from .sampled_stuck_contact import SampledSlip, never_rests
from .state_boxes import BoxFollower, starts

CELLS, PARTS = 4, 2  # of the angle within a step, and of the torque within the ramp of a sample
ROUNDING = 1e-9  # of an encoder step
LAST = 3  # readings next to the reference that are followed one by one
MOST, MOST_BOUNDED = 30, 80  # readings that are followed one by one, to the end or with bounds
FARTHEST = 400  # reading of a limit cycle for which that is tried
AT_REST = "slips from the smallest error may end at the reference"
BAND = 16  # cells of a band
ORBIT, KEPT = 24, 8  # slips that lead to where a band is looked for; it encloses the errors of the last ones
GROWTHS = 4  # of a band to what it is taken to
RUNS, LONGER = 3, 4  # runs of the scenario, each so many times as long as the one before
CHECKS, SAMPLES = 100, 20  # of each run, whether the contact is stuck, and samples between them
WITHOUT_REST = "no reading of the encoder is the reference, so that the integrator never stops"


def prove_sampled(contact: SampledSlip, largest: float) -> Proof:
    """Decide for all errors up to one, or for as large a part of them as the bounds allow."""
    if contact.step == 0.0:
        return _band(contact) if contact.excess > 0.0 else _share(contact, largest)
    if never_rests(contact):
        found = _band(contact, WIDER[:1]) if contact.excess > 0.0 else None
        return found if found and found.verdict == "hunts" else Proof("hunts", WITHOUT_REST, largest)
    if contact.excess == 0.0:
        return _last_readings(Readings(contact))
    found = _about_orbit(Readings(contact))
    return found if found.verdict != "not decided" or found.reason == AT_REST else _band(contact)


def end_of_slip(
    contact: SampledSlip, low: float, high: float, *, cells: int = 1, parts: int = 1, fast: float = 0.0
) -> tuple[float, float]:
    """Least and largest error after a forward slip from errors that are read as between two; with steps, as they are read then.

    Raises UndecidableError: the bounds do not hold.
    """
    ends = slips_from(contact, (-high * contact.ratio, -low * contact.ratio), cells, parts, fast)
    angles = np.concatenate([angle for _, angle in ends])
    # The first reading of the encoder is within half a step of the angle.
    return low - angles[:, 1].max() - 0.5 * contact.step, high - angles[:, 0].min() + 0.5 * contact.step


def slips_from(
    contact: SampledSlip, reading: tuple[float, float], cells: int, parts: int, fast: float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Ends of slips forward from readings between two, less the reference: the reading then, in steps, NaN if not known; the angles between
    which it is."""
    for tick, start in starts(contact, reading, cells, parts):
        flow = BoxFollower(contact, fast)
        settled = flow.follow(start, tick)
        yield settled.read, settled.angle
        for passed in flow.passed:
            angle = np.stack(finish(contact, *passed), axis=1)
            yield np.full(len(angle), math.nan), angle


class Readings:
    """The errors that slips from each reading of an encoder with steps leave."""

    def __init__(self, contact: SampledSlip) -> None:
        self.contact = contact
        self._left: dict[tuple[int, bool], set[int]] = {}

    def left(self, count: int, *, bounded: bool) -> set[int]:
        """Errors in steps with which the contact is stuck, once all has settled, after a slip forward from one in steps.

        bounded: whether the rest of a slip is bounded as in `finish`, once all speeds exceed what readings can take from them.

        Raises UndecidableError: the boxes become too many, or a limit of the controller may act.
        """
        key, c, found = (count, bounded), self.contact, set[int]()
        if key not in self._left:
            reading, fast = -count * c.quantum, self._loudest if bounded else math.inf
            for read, angle in slips_from(c, (reading, reading), CELLS, PARTS, fast):
                off = (0.5 - ROUNDING, 0.5 + ROUNDING)
                least, most = np.where(np.isnan(read)[:, None], np.floor(angle / c.step + off), read[:, None]).T
                for first, last in zip(least, most, strict=True):
                    found |= {count - k for k in range(int(first), int(last) + 1)}
            self._left[key] = found
        return self._left[key]

    def one(self, count: int) -> int:
        """The error in steps that one of these slips leaves, from the middle of the encoder step."""
        reading = -count * self.contact.quantum
        tick, start = next(iter(starts(self.contact, (reading, reading), 1, 1)))
        start.spread[:] = 0.0
        return count - round(float(np.mean(BoxFollower(self.contact).follow(start, tick).read)))

    @cached_property
    def _loudest(self) -> float:
        return loudest(self.contact)


def map_without_steps(contact: SampledSlip, errors: np.ndarray) -> np.ndarray:
    """Errors that slips leave with an encoder without steps; NaN where that is not shown."""
    ideal, found = replace(contact, step=0.0), np.full(len(errors), math.nan)
    for k, error in enumerate(errors):
        try:
            found[k] = np.mean(end_of_slip(ideal, error, error))
        except UndecidableError:
            continue
    return found


def _share(contact: SampledSlip, largest: float) -> Proof:
    """Proof without steps and excess, where all is in proportion to the error."""
    try:
        least, most = end_of_slip(contact, 1.0, 1.0, parts=PARTS)
    except UndecidableError as why:
        return Proof("not decided", str(why), 0.0)
    factor = max(abs(least), abs(most))
    if factor < 1.0:
        return Proof("does not hunt", f"each slip leaves at most {factor:.4g} of its error", largest, factor)
    return Proof("not decided", f"a slip may leave {factor:.4g} of its error", 0.0)


def _last_readings(slips: Readings) -> Proof:
    """Proof from as many of the readings next to the reference as can be followed."""
    found = _by_readings(slips, 1, 1)
    for high in range(2, LAST + 1):
        if found.verdict != "does not hunt" or (more := _by_readings(slips, 1, high)).verdict == "not decided":
            break
        found = more
    return found


def _by_readings(slips: Readings, low: int, high: int, *, bounded: bool = False) -> Proof:
    """Follow slips from each reading between two errors in steps, and from those between which they lead."""
    left: dict[int, set[int]] = {}
    while high - low < (MOST_BOUNDED if bounded else MOST):
        try:
            for count in range(low, high + 1):
                if count not in left:
                    left[count] = {abs(one) for one in slips.left(count, bounded=bounded)}
        except UndecidableError as why:
            return Proof("not decided", str(why), 0.0)
        reached = set().union(*left.values()) - {0}
        low, high = min(reached | {low}), max(reached | {high})
        if len(left) == high - low + 1:
            return _decided(slips.contact, left)
    return Proof("not decided", "slips from some readings of the encoder lead beyond them", 0.0)


def _decided(contact: SampledSlip, left: dict[int, set[int]]) -> Proof:
    """Verdict for readings that lead to each other or to the reference."""
    ending, lasting = {0}, set(left)
    while more := {one for one, to in left.items() if to <= ending} - ending:
        ending |= more
    while less := {one for one in lasting if not left[one] <= lasting}:
        lasting -= less
    top = (max(left) + 0.5) * contact.step
    if ending >= set(left) and min(left) == 1:
        text = f"from each reading of the encoder up to {counted(max(left), 'step')} from the reference the slips end at the reference"
        return Proof("does not hunt", text, top)
    if lasting and len(lasting) == max(lasting) - min(lasting) + 1:
        band = ((min(lasting) - 0.5) * contact.step, (max(lasting) + 0.5) * contact.step)
        return Proof("hunts", "", band[1], band=band, ranges=(band,))
    return Proof(
        "not decided", "slips from some readings of the encoder may return to them, or end at the reference", 0.0
    )


def _about_orbit(slips: Readings) -> Proof:
    """Proof about the readings that slips from the smallest error lead to."""
    counts = [1]
    for _ in range(ORBIT):
        try:
            counts.append(abs(slips.one(counts[-1])))
        except UndecidableError as why:
            return Proof("not decided", str(why), 0.0)
        if not counts[-1] or counts[-1] > FARTHEST:
            break
    if counts[-1] > FARTHEST:
        return Proof(
            "not decided", "its limit cycle has too many readings of the encoder to follow them one by one", 0.0
        )
    if counts[-1]:
        low, high = min(counts[-KEPT:]), max(counts[-KEPT:])
        found = _by_readings(slips, low, high, bounded=True)
        return found if found.verdict != "not decided" else _by_readings(slips, low, high)
    return _by_readings(slips, 1, max(counts)) if max(counts) <= MOST else Proof("not decided", AT_REST, 0.0)


# --- with an excess ---


def _band(contact: SampledSlip, widths: Sequence[float] = WIDER) -> Proof:
    try:
        errors = _orbit(replace(contact, step=0.0))
        fast = loudest(contact)
    except UndecidableError as why:
        return Proof("not decided", str(why), 0.0)
    least, most, reason = float(min(errors)), float(max(errors)), ""
    for wider in widths:
        low, high = least * (1.0 - wider) - contact.step, most * (1.0 + wider) + contact.step
        for _ in range(GROWTHS):
            if low <= contact.step:
                reason = "its limit cycle is near the resolution of the encoder"
                break
            try:
                after = _images(contact, low, high, fast)
            except UndecidableError as why:
                reason = str(why)
                break
            if low <= after[0] and after[1] <= high:
                return Proof("hunts", "", high, band=(low, high), ranges=((low, high),))
            reason = f"no band of errors about {0.5 * (low + high):.4g} is shown to be taken into itself"
            low, high = min(low, (1.0 - MARGIN) * after[0]), max(high, (1.0 + MARGIN) * after[1])
    return Proof("not decided", reason, 0.0)


def _images(contact: SampledSlip, low: float, high: float, fast: float) -> tuple[float, float]:
    """Least and largest magnitude of the errors after slips from a band; 0 where one may change its sign."""
    ends = []
    for a, b in itertools.pairwise(np.linspace(low, high, BAND + 1)):
        least, most = end_of_slip(contact, float(a), float(b), cells=CELLS if contact.step > 0.0 else 1, fast=fast)
        ends += [0.0] if least <= 0.0 <= most else [abs(least), abs(most)]
    return min(ends), max(ends)


def _orbit(contact: SampledSlip) -> list[float]:
    """Magnitudes of errors that follow each other without the steps of the encoder, from a slip that begins almost without error."""
    errors = [1e-3 * contact.excess / (contact.inertia * _rate(contact) ** 2)]
    for _ in range(ORBIT):
        least, most = end_of_slip(contact, errors[-1], errors[-1])
        errors.append(max(abs(0.5 * (least + most)), 1e-3 * errors[0]))
    return errors[-KEPT:]


def _rate(contact: SampledSlip) -> float:
    """Roughly the rate of the closed loop, by the torque that a step of the error makes at once [1/s]."""
    matrix, column = contact.samples[0]
    pulse = abs(float(contact.held @ matrix @ column) or float(contact.held @ column))
    return math.sqrt(pulse * abs(contact.ratio) / contact.inertia) or 1.0


# --- the run of the scenario ---


def reached_by_run(axis: Axis, contact: SampledSlip, largest: float) -> float:
    """Error of the first stuck interval of the run that is not above one, in which all has settled; NaN where none is seen."""
    name = axis.train.shaft_of(contact.name, "contact")
    angle = axis.train.variable(name, "angle")
    to = axis.controller.reference.pieces()[-1][1] * (turns(axis.train, name, axis.shaft) or 1.0)
    watch, duration = WatchedRun(axis.scenario, (angle,)), axis.scenario.simulation.duration
    window = watch.window(contact.tick * contact.ramp.ticks)
    for _ in range(RUNS):
        for _ in range(CHECKS):
            watch.follow(duration / CHECKS, SAMPLES)
            outlook, looks = watch.outlook(window)
            if looks is None:
                continue
            error = to - float(watch.simulation[(angle,)][0])
            if abs(error) <= largest:
                return error
            if math.isfinite(outlook.breaks_away):
                watch.skip(outlook, looks, window)
        duration *= LONGER
    return math.nan
