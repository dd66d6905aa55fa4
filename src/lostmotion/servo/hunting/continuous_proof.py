"""Whether a stuck contact hunts from any error: a proof by bounds of the map from break-away to break-away.

With ``T_S = T_C`` the map is a fixed share of the error, the same for all: it is enough to bound it once. With ``T_S
> T_C`` it does not vanish with the error, so that small errors grow. If it maps a band of errors into itself, no
motion that begins in the band ever rests.
"""

import itertools
import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from .break_away_map import Image, Transients, image
from .continuous_stuck_contact import StickSlip

Certainty = Literal["hunts", "does not hunt", "not decided"]

SLIPS = 30  # after which transients are given up that do not repeat
ORBIT = 80  # slips that lead to where a band is looked for
LAST = 40  # of them, whose errors the band encloses
WIDER = (0.6, 0.3, 0.1, 0.03, 0.01, 0.002)  # by which it is larger than these, relative, the first that can be shown
GROWTHS = 4  # of a band to what it is taken to
MARGIN = 1e-3  # by which it then is larger, relative
CELLS = 48  # into which a band is divided
RANGE_CELLS = 120  # of all errors
ROUNDS = 6  # after which transients that grow are given up
HALVINGS = 30  # of the range of errors
SLACK = 1.5
NEAR = 0.02  # of its magnitude, by which the circle of a transient is larger than what follows


@dataclass(frozen=True)
class Proof:
    """Verdict for errors up to one."""

    verdict: Certainty
    reason: str  # reason of a verdict other than hunts
    largest: float  # error up to which it holds
    factor: float = math.nan  # bound of the share of its error that each slip leaves, without an excess
    band: tuple[float, float] | None = None  # magnitudes of errors, which the map takes into itself
    ranges: tuple[tuple[float, float], ...] = field(default_factory=tuple)  # magnitudes from which it is reached


def prove(contact: StickSlip, largest: float) -> Proof:
    """Decide for all errors up to one, or for as large a part of them as the bounds allow."""
    if contact.excess == 0.0:
        return _shares(contact, largest)
    return _band(contact, largest)


# --- without an excess of static friction ---


def _shares(contact: StickSlip, largest: float) -> Proof:
    error, reason = largest, ""
    for _ in range(HALVINGS):
        factor, why = _share(contact, error)
        if not why and factor < 1.0:
            return Proof("does not hunt", f"each slip leaves at most {factor:.4g} of its error", error, factor)
        reason = reason or why or f"a slip may leave {factor:.4g} of its error"
        if not why:
            break
        error *= 0.5
    return Proof("not decided", reason, 0.0)


def _share(contact: StickSlip, error: float) -> tuple[float, str]:
    """Bound of the share of its error that a slip leaves, for all errors up to one, and why there is none.

    With transients in proportion, a smaller error has the same map, and no shorter stuck interval: what holds for the largest
    error holds for all.
    """
    left, most = Transients.none(contact), 0.0
    chain: list[Transients] = []
    for _ in range(SLIPS):
        found = image(contact, error, error, left)
        if found.reason:
            return math.inf, found.reason
        most = max(most, found.largest / error)
        if math.isinf(found.stuck[0]):
            return most, ""
        after = _in_proportion(contact, found, error)
        if after is None:
            return math.inf, "the transients after a slip are not small against the error that it leaves"
        if any(after.within(before) for before in [left, *chain]):
            return most, ""
        chain.append(left)
        left = _about(after, left)
    return math.inf, "the transients grow from slip to slip"


def _about(after: Transients, before: Transients) -> Transients:
    """Transients somewhat larger than those after a slip, so that the next step may lie within them."""
    change = np.minimum(SLACK * np.abs(after.middle - before.middle), NEAR * np.abs(after.middle))
    return Transients(after.middle, SLACK * after.radius + change)


def _in_proportion(contact: StickSlip, found: Image, error: float) -> Transients | None:
    """Transients after a slip, scaled to the error from which the next slip is examined; None if they are not small."""
    if found.low > 0.0:  # it goes on in its direction; all is in proportion
        factor, off = error / found.middle, 0.5 * (found.high - found.low) / found.low
        grown = found.left.times(factor)
        return Transients(grown.middle, grown.radius * (1.0 + off) + off * np.abs(grown.middle))
    if not len(contact.stuck_rates):
        return found.left
    # A smaller error is stuck for longer, in which the transients fall by more than in proportion.
    if np.abs(contact.stuck_rates.real).min() * found.stuck[0] < 1.0:
        return None
    return found.left.anywhere().times(error / found.largest)


# --- with an excess ---


def _band(contact: StickSlip, largest: float) -> Proof:
    orbit, reason = _orbit(contact)
    if reason:
        return Proof("not decided", reason, 0.0)
    least, most = min(orbit[-LAST:]), max(orbit[-LAST:])
    for wider in WIDER:
        low, high = least * (1.0 - wider), most * (1.0 + wider)
        for _ in range(GROWTHS):
            kept, reason = _kept(contact, low, high)
            if isinstance(kept, Transients):
                ranges = _leading_to(contact, low, high, max(largest, high), kept)
                return Proof("hunts", "", max(b for _, b in ranges), band=(low, high), ranges=ranges)
            if kept is None:
                break
            low, high = min(low, (1.0 - MARGIN) * kept[0]), max(high, (1.0 + MARGIN) * kept[1])
    return Proof("not decided", reason, 0.0)


def _orbit(contact: StickSlip) -> tuple[list[float], str]:
    """Magnitudes of the errors of slips that follow each other, from the one that begins without error."""
    error, none = 0.0, Transients.none(contact)
    errors: list[float] = []
    for _ in range(ORBIT):
        found = image(contact, error, error, none)
        if found.reason:
            return errors, found.reason
        error = abs(found.middle)
        errors.append(error)
    return errors, ""


def _kept(contact: StickSlip, low: float, high: float) -> tuple[Transients | tuple[float, float] | None, str]:
    """(bound of the transients with which the map takes a band into itself, "").

    If there is none: (the band that contains the image, if it is known, and the reason).
    """
    left = Transients.none(contact)
    for _ in range(ROUNDS):
        images = _images(contact, low, high, left)
        if reason := next((found.reason for found in images if found.reason), ""):
            return None, reason
        least, most = min(found.least for found in images), max(found.largest for found in images)
        if not low <= least <= most <= high:
            return (least, most) if least > 0.0 else None, (
                f"no band of errors about {0.5 * (low + high):.4g} is shown to be taken into itself"
            )
        after = np.max([found.left.largest for found in images], axis=0)
        if np.all(after <= left.radius):
            return left, ""
        left = Transients(left.middle, SLACK * after)
    return None, "the transients grow from slip to slip"


def _leading_to(
    contact: StickSlip, low: float, high: float, largest: float, left: Transients
) -> tuple[tuple[float, float], ...]:
    """Ranges of errors from which the band is reached: cells that the map takes into such ones, with their transients."""
    edges = np.unique([0.0, *np.geomspace(1e-2 * low, largest, RANGE_CELLS), low, high])
    cells = list(itertools.pairwise(edges))
    inside = np.array([low <= a and b <= high for a, b in cells])
    radius = np.where(inside[:, None], left.radius, 0.0)
    images: list[Image | None] = [None] * len(cells)
    for _ in range(ROUNDS):
        for k, (a, b) in enumerate(cells):
            if images[k] is None:
                images[k] = image(contact, a, b, Transients(left.middle, radius[k]))
        found = [one for one in images if one is not None]
        led, before = _cells_that_reach(edges, found, inside), radius.copy()
        for one, here in zip(found, led, strict=True):
            if here:
                first, last = _cells_met_by(edges, one)
                grown = np.any(one.left.largest > radius[first:last], axis=1)
                radius[first:last][grown] = np.maximum(radius[first:last], SLACK * one.left.largest)[grown]
        changed = np.any(radius > before, axis=1)
        if not changed.any():
            return _joined(cells, led)
        if changed[inside].any():
            radius[inside] = radius[inside].max(axis=0)
            changed = np.any(radius > before, axis=1)
            if not _kept_with(contact, low, high, Transients(left.middle, radius[inside][0])):
                break
        images = [None if new else one for new, one in zip(changed, images, strict=True)]
    return ((low, high),)


def _cells_met_by(edges: np.ndarray, found: Image) -> tuple[int, int]:
    """Index of the first cell that an image overlaps, and the index after the last."""
    return int(np.searchsorted(edges, found.least, "right")) - 1, int(np.searchsorted(edges, found.largest, "left"))


def _kept_with(contact: StickSlip, low: float, high: float, left: Transients) -> bool:
    """Whether the map takes a band of errors into itself, with transients within the given ones."""
    return all(not i.reason and low <= i.least <= i.largest <= high for i in _images(contact, low, high, left))


def _images(contact: StickSlip, low: float, high: float, left: Transients) -> list[Image]:
    """Images of the cells of a band."""
    return [image(contact, a, b, left) for a, b in itertools.pairwise(np.linspace(low, high, CELLS + 1))]


def _cells_that_reach(edges: np.ndarray, images: list[Image], inside: np.ndarray) -> np.ndarray:
    """Cells whose errors reach the band: those inside it, and those whose image lies in cells that reach it."""
    led = inside.copy()
    while True:
        before = led.copy()
        for k, found in enumerate(images):
            if led[k] or found.reason or found.least == 0.0 or found.largest > edges[-1]:
                continue
            led[k] = bool(led[slice(*_cells_met_by(edges, found))].all())
        if np.array_equal(led, before):
            return led


def _joined(cells: list[tuple[float, float]], led: np.ndarray) -> tuple[tuple[float, float], ...]:
    out: list[tuple[float, float]] = []
    for (a, b), here in zip(cells, led, strict=True):
        if here and out and out[-1][1] == a:
            out[-1] = (out[-1][0], float(b))
        elif here:
            out.append((float(a), float(b)))
    return tuple(out)
