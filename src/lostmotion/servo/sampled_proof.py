"""Whether a stuck contact hunts under a sampled controller: a proof by sets of states from break-away to break-away.

An encoder with steps makes three cases. If no reading is the reference, the integrator never stops, and nothing can
rest. If ``T_S = T_C`` and a reading is the reference, the errors fall step by step. It is enough that each slip from
the last few readings ends nearer to the reference. If ``T_S > T_C``, a band of errors that is mapped into itself is
never left, as with a continuous controller.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from ..control.turning import turns
from ..response.hunting_proof import MARGIN, WIDER, Proof
from ..response.standstill import Watch
from ..response.stick_slip import UndecidableError
from .regimes import Axis
from .sampled_slip import SampledSlip, never_rests
from .slip_boxes import Flow, starts
from .slip_noise import finish, loudest

CELLS, PARTS = 4, 2  # of the angle within a step, and of the torque within the ramp of a sample
LAST = 3  # readings next to the reference that are followed one by one
FEW = 12  # readings of a limit cycle that are followed one by one
BAND = 16  # cells of a band
ORBIT, KEPT = 24, 8  # slips that lead to where a band is looked for, and of which it encloses the errors
GROWTHS = 4  # of a band to what it is taken to
RUNS, LONGER = 3, 4  # runs of the scenario, each so many times as long as the one before
CHECKS, SAMPLES = 100, 20  # of each run, whether the contact is stuck, and samples between them
WITHOUT_REST = "no reading of the encoder is the reference, so that the integrator never stops"


def prove_sampled(of: SampledSlip, largest: float) -> Proof:
    """Decide for all errors up to one, or for as large a part of them as the bounds allow."""
    if of.excess > 0.0:
        found = _band(of)
    elif of.step == 0.0:
        found = _share(of, largest)
    else:
        found = Proof("not decided", "", 0.0) if never_rests(of) else _by_readings(of, LAST)
    if found.verdict != "hunts" and never_rests(of):
        return Proof("hunts", WITHOUT_REST, largest)
    return found


def end_of_slip(
    of: SampledSlip, low: float, high: float, *, cells: int = 1, parts: int = 1, fast: float = 0.0
) -> tuple[float, float]:
    """Least and largest error after a forward slip from errors that are read as between two; with steps, as they are read then.

    Raises
    ------
    UndecidableError
        The bounds do not hold.
    """
    reading = (-high * of.ratio, -low * of.ratio)
    least, most = math.inf, -math.inf
    for tick, start in starts(of, reading, cells, parts):
        flow = Flow(of, fast)
        settled = flow.follow(start, tick)
        angles = [settled.angle] + [np.stack(finish(of, *passed), axis=1) for passed in flow.passed]
        for angle in angles:
            if len(angle):
                # The first reading of the encoder is within half a step of the angle.
                least, most = min(least, low - angle[:, 1].max()), max(most, high - angle[:, 0].min())
    return least - 0.5 * of.step, most + 0.5 * of.step


def map_without_steps(of: SampledSlip, errors: np.ndarray) -> np.ndarray:
    """Errors that slips leave with an encoder without steps; NaN where that is not shown."""
    ideal, found = replace(of, step=0.0), np.full(len(errors), math.nan)
    for k, error in enumerate(errors):
        try:
            found[k] = np.mean(end_of_slip(ideal, error, error))
        except UndecidableError:
            continue
    return found


def _share(of: SampledSlip, largest: float) -> Proof:
    """Without steps and excess, all is in proportion to the error."""
    try:
        least, most = end_of_slip(of, 1.0, 1.0, parts=PARTS)
    except UndecidableError as why:
        return Proof("not decided", str(why), 0.0)
    factor = max(abs(least), abs(most))
    if factor < 1.0:
        return Proof("does not hunt", f"each slip leaves at most {factor:.4g} of its error", largest, factor)
    return Proof("not decided", f"a slip may leave {factor:.4g} of its error", 0.0)


def _by_readings(of: SampledSlip, most: int) -> Proof:
    """Follow slips from each reading next to the reference: to which readings they lead, and whether all lead to the reference."""
    left: dict[int, set[int]] = {}
    found = Proof("not decided", "", 0.0)
    reason = "slips from the last readings of the encoder lead beyond them"
    for count in range(1, most + 1):
        try:
            left[count] = {abs(one) for one in _left(of, count)}
        except UndecidableError as why:
            reason = str(why)
            break
        if all(one in left or one == 0 for to in left.values() for one in to):
            found, reason = _decided(of, left), "slips from the last readings of the encoder may return to them"
    return replace(found, reason=found.reason or reason) if found.verdict != "hunts" else found


def _decided(of: SampledSlip, left: dict[int, set[int]]) -> Proof:
    """Verdict for readings that lead to each other or to the reference."""
    ending, lasting = {0}, set(left)
    while more := {one for one, to in left.items() if to <= ending} - ending:
        ending |= more
    while less := {one for one in lasting if not left[one] <= lasting}:
        lasting -= less
    top = (max(left) + 0.5) * of.step
    if ending >= set(left):
        text = f"from each reading of the encoder up to {max(left)} steps from the reference the slips end at the reference"
        return Proof("does not hunt", text, top)
    if lasting:
        band = ((min(lasting) - 0.5) * of.step, (max(lasting) + 0.5) * of.step)
        return Proof("hunts", "", band[1], band=band, ranges=(band,))
    return Proof("not decided", "", 0.0)


def _left(of: SampledSlip, count: int) -> set[int]:
    """Errors that are left by slips from one, in steps."""
    error, found = count * of.quantum, set()
    for tick, boxes in starts(of, (-error, -error), CELLS, PARTS):
        found |= {count - int(read) for read in Flow(of).follow(boxes, tick).read}
    return found


# --- with an excess ---


def _band(of: SampledSlip) -> Proof:
    try:
        errors = _orbit(replace(of, step=0.0))
        fast = loudest(of)
    except UndecidableError as why:
        return Proof("not decided", str(why), 0.0)
    least, most, reason = float(min(errors)), float(max(errors)), ""
    for wider in WIDER:
        low, high = least * (1.0 - wider) - of.step, most * (1.0 + wider) + of.step
        for _ in range(GROWTHS):
            if low <= of.step:
                reason = "its limit cycle is near the resolution of the encoder"
                break
            try:
                after = _images(of, low, high, fast)
            except UndecidableError as why:
                reason = str(why)
                break
            if low <= after[0] and after[1] <= high:
                return Proof("hunts", "", high, band=(low, high), ranges=((low, high),))
            reason = f"no band of errors about {0.5 * (low + high):.4g} is shown to be taken into itself"
            low, high = min(low, (1.0 - MARGIN) * after[0]), max(high, (1.0 + MARGIN) * after[1])
    count = math.ceil(1.5 * most / of.step) + 1 if of.step > 0.0 else FEW + 1
    return Proof("not decided", reason, 0.0) if count > FEW or never_rests(of) else _by_readings(of, count)


def _images(of: SampledSlip, low: float, high: float, fast: float) -> tuple[float, float]:
    """Least and largest magnitude of the errors after slips from a band; 0 where one may change its sign."""
    ends = []
    for a, b in itertools.pairwise(np.linspace(low, high, BAND + 1)):
        least, most = end_of_slip(of, float(a), float(b), cells=CELLS if of.step > 0.0 else 1, fast=fast)
        ends += [0.0] if least <= 0.0 <= most else [abs(least), abs(most)]
    return min(ends), max(ends)


def _orbit(of: SampledSlip) -> list[float]:
    """Magnitudes of errors that follow each other without the steps of the encoder, from a slip that begins almost without error."""
    errors = [1e-3 * of.excess / (of.inertia * _rate(of) ** 2)]
    for _ in range(ORBIT):
        least, most = end_of_slip(of, errors[-1], errors[-1])
        errors.append(max(abs(0.5 * (least + most)), 1e-3 * errors[0]))
    return errors[-KEPT:]


def _rate(of: SampledSlip) -> float:
    """Roughly the rate of the closed loop, by the torque that a step of the error makes at once [1/s]."""
    matrix, column = of.samples[0]
    pulse = abs(float(of.held @ matrix @ column) or float(of.held @ column))
    return math.sqrt(pulse * abs(of.ratio) / of.inertia) or 1.0


# --- the run of the scenario ---


def reached_by_run(axis: Axis, of: SampledSlip, largest: float) -> float:
    """Error of the first stuck interval of the run that is not above one, in which all has settled; NaN where none is seen."""
    name = of.contact.removesuffix("_contact")
    angle = axis.train.angle_of(name)
    to = axis.controller.reference.pieces()[-1][1] * (turns(axis.train, name, axis.shaft) or 1.0)
    watch, duration = Watch(axis.scenario, (angle,)), axis.scenario.simulation.duration
    window = watch.window(of.tick * of.ramp.ticks)
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
