"""Certificate of hunting: the map from break-away to break-away of a stuck contact, with a proof for all starting errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.quantities import argument
from ...inputs.refusal_messages import shown
from ...simulation.scenario.scenario import Scenario
from ..linear_regimes import Axis, axis_of
from .break_away_map import Image, Transients, image
from .continuous_proof import Certainty, Proof, prove
from .continuous_stuck_contact import AtRestError, StickSlip, UndecidableError, stick_slip
from .hunting_decision import moving_input
from .limit_cycle_causes import at_rest
from .limit_cycles import SAMPLES, UndrivenLoop
from .sampled_proof import map_without_steps, prove_sampled, reached_by_run
from .sampled_stuck_contact import SampledSlip, sampled_slip

if TYPE_CHECKING:
    import xarray

POINTS = 121  # of the map
SAMPLED_POINTS = 33  # of the map of a sampled controller
SHOWN = 4.0  # times the largest limit cycle, up to which it is drawn
SECANTS = 12
STEP = 1e-4  # relative, of the derivative at a fixed point
LONGER = 4  # times as long each of the runs is that lead to a stuck interval
RUNS = 4
FADED = 0.1  # of the error from the second quarter of a run to the last
SETTLED = 12.0  # slowest time constants of a stuck interval, after which its start counts as forgotten


@dataclass(frozen=True)
class FixedPoint:
    """A limit cycle of slips of equal size to and fro."""

    amplitude: float
    """error of the controller at each break-away [rad] or [m]: half of the swing of the measured position"""
    period: float
    """[s], of two slips and two stuck intervals"""
    multiplier: float
    """factor by which a deviation of the error changes over a period"""

    @property
    def stable(self) -> bool:
        """Whether neighbouring motions approach it."""
        return abs(self.multiplier) < 1.0


@dataclass(frozen=True)
class HuntingCertificate:
    """Whether one stuck contact under integral action hunts, shown for all starting errors up to a bound."""

    verdict: Certainty
    """hunts, does not hunt, or not decided"""
    reason: str
    """why it does not hunt, or what could not be shown; empty if it hunts"""
    contact: str = ""
    """contact that sticks; empty where there is no map"""
    map: xarray.Dataset | None = None
    """``image`` over ``error``: the error left after a slip that begins with an error; ``slip_time`` and ``stuck_time`` [s]; without
    the errors whose slips are more than one linear regime; of a sampled controller ``image`` about a band, without encoder steps"""
    fixed_points: tuple[FixedPoint, ...] = ()
    """limit cycles, those without stability among them; none of a sampled controller"""
    largest_error: float = math.nan
    """largest starting error for which the verdict is shown"""
    band: tuple[float, float] | None = None
    """magnitudes of errors that the map takes into themselves, of a verdict that it hunts"""
    ranges: tuple[tuple[float, float], ...] = ()
    """magnitudes of starting errors from which the band is reached"""
    factor: float = math.nan
    """bound of the share of its error that each slip leaves, of a verdict that it does not hunt; NaN where no slip begins"""
    reached: float = math.nan
    """error with which the run of the scenario first sticks until all but the integrator has settled; NaN if it was not found"""

    def __repr__(self) -> str:
        if self.verdict != "hunts":
            return f"{self.verdict}: {self.reason}"
        if self.reason:
            return f"hunts: {self.reason}"
        cycles = [
            f"{'stable' if p.stable else 'unstable'} limit cycle of {1.0 / p.period:.6g} Hz" for p in self.fixed_points
        ]
        band = "" if self.band is None else f", errors from {self.band[0]:.4g} to {self.band[1]:.4g} are never left"
        none = "a limit cycle" if self.band is not None else "no symmetric limit cycle"
        return f"hunts: {', '.join(cycles) or none}{band}"


def certified_in_words(certificate: HuntingCertificate) -> str:
    """Verdict with its reason."""
    if certificate.verdict == "not decided" and certificate.reason:
        return f"not decided: no proof from every start, rely on the simulation ({certificate.reason})"
    return certificate.verdict + (f": {certificate.reason}" if certificate.reason else "")


@checked
def hunting_certificate(
    scenario: Scenario, *, motor: str | None = None, largest_error: float | str | None = None
) -> HuntingCertificate:
    """Decide by proof whether a stuck contact under integral action hunts.

    While the contact is stuck, the integrator winds up in proportion to the error until the contact breaks away; the
    slip leaves another error. Slip and stuck interval are linear, and so the map from one error to the next follows
    exactly from their matrices. A fixed point of the map is a limit cycle. The verdict follows from bounds of the map over
    intervals of errors. *Hunts* means that it maps a band of errors without rest into itself. *Does not hunt* means
    that each slip reduces its error. The bounds are computed in floating point and widened by what that may round.

    With a sampled controller, sets of states are followed from sample to sample. They contain each angle within a step
    of the encoder, and each instant of the break-away within a sample. *Hunts* also means that no reading of the
    encoder is the reference, so that the integrator never stops.

    Parameters
    ----------
    scenario : Scenario
        With one position controller, one dry contact with a constant friction in motion, and no other contacts or
        segments. A sampled controller needs rigid gears, one encoder, and a current loop of kind ideal or first_order.
        Its inputs must come to rest.
    motor : str, optional
        Name of the motor whose sampled controller is examined. Default: the only one.
    largest_error : float or str, optional
        Largest starting error [rad] or [m] that is examined. Default: the travel of the reference.

    Returns
    -------
    HuntingCertificate
        Verdict, map, limit cycles and the errors for which the verdict is shown. What cannot be shown is *not decided*, with
        the reason.

    Raises
    ------
    InputError
        There is no position controller, there are several, or an input never comes to rest.

    Examples
    --------
    >>> import lostmotion as lm
    >>> certificate = lm.hunting_certificate(lm.load("hunting-with-static-friction"))
    >>> certificate.verdict, round(1e3 * certificate.fixed_points[0].amplitude, 3)
    ('hunts', 5.762)
    """
    train = scenario.long()
    if largest_error is not None:
        largest_error = argument("largest_error", largest_error, _unit(train))
        if not largest_error > 0.0:
            raise InputError(f"largest_error: {shown(largest_error)} must be greater than 0")
    if not train.continuous():
        if not train.axes():
            raise InputError("hunting_certificate: the scenario has no controller; add one with a position loop")
        axis = axis_of(train, motor)
        return certified(axis, lambda: at_rest(axis).verdict == "at rest", largest_error)
    loop = UndrivenLoop.of(train)
    try:
        contact = stick_slip(train)
    except UndecidableError as why:
        return HuntingCertificate("not decided", str(why))
    except AtRestError as why:
        return _at_rest(why, rests=_comes_to_rest(loop))
    (controller,) = train.continuous().values()
    largest = largest_error or _travel(value for _, value, _ in controller.reference.breakpoint_list())
    proof = prove(contact, largest)
    reached, fades = _reached(loop, contact, proof)
    points = _map(contact, proof, largest)
    found = _with_proof(proof, contact.name, reached, is_reached=fades or abs(reached) <= proof.largest)
    fixed = tuple(_fixed_points(contact, points)) if contact.excess > 0.0 else ()
    good = [(e, i) for e, i in points if not i.reason]
    columns = {
        "image": [i.middle for _, i in good],
        "slip_time": [0.5 * sum(i.slip) for _, i in good],
        "stuck_time": [0.5 * sum(i.stuck) for _, i in good],
    }
    return replace(
        found, map=_dataset(contact, [e for e, _ in good], columns, found.verdict, train), fixed_points=fixed
    )


def _with_proof(proof: Proof, contact: str, reached: float, *, is_reached: bool) -> HuntingCertificate:
    """The certificate of a proof, which decides only if the run reaches the errors for which it holds."""
    verdict, reason = proof.verdict, proof.reason
    if verdict == "does not hunt" and not is_reached:
        verdict = "not decided"
        reason = f"from errors up to {proof.largest:.4g} it does not hunt, but the run of the scenario is not seen to reach them"
    ends = proof.largest, proof.band, proof.ranges, proof.factor, reached
    return HuntingCertificate(verdict, reason, contact, None, (), *ends)


def _at_rest(why: AtRestError, *, rests: bool) -> HuntingCertificate:
    if rests:
        return HuntingCertificate("does not hunt", str(why))
    return HuntingCertificate("not decided", f"{why}, but the run of the scenario is not seen to come to rest")


def certified(axis: Axis, rests: Callable[[], bool], largest_error: float | None = None) -> HuntingCertificate:
    """Certificate of an axis with a sampled controller.

    rests: whether the run of the scenario comes to rest.

    Raises InputError: an input never comes to rest.
    """
    train, kind = axis.scenario, axis.controller.reference.kind
    if kind != "position":
        raise InputError(
            f"{kind}; the certificate is that of a position controller", f"controllers.{axis.motor}.reference.kind"
        )
    if name := moving_input(train):
        raise InputError(
            f"{name}: never comes to rest; leave out sines and last slopes, since hunting is what a loop does by itself"
        )
    try:
        contact = sampled_slip(axis)
        times = np.linspace(0.0, axis.controller.reference.duration, 2001)
        proof = prove_sampled(contact, largest_error or _travel(axis.controller.reference.at(times)[0]))
    except UndecidableError as why:
        return HuntingCertificate("not decided", str(why))
    except AtRestError as why:
        return _at_rest(why, rests=rests())
    reached = math.nan if proof.verdict == "not decided" else reached_by_run(axis, contact, proof.largest)
    found = _with_proof(proof, contact.name, reached, is_reached=abs(reached) <= proof.largest)
    return replace(found, map=_sampled_map(contact, proof, train))


def _sampled_map(contact: SampledSlip, proof: Proof, train: Scenario) -> xarray.Dataset | None:
    """Error left by a slip without the steps of the encoder, about a band; None without one."""
    if proof.band is None:
        return None
    errors = np.linspace(0.25 * proof.band[0], 1.5 * proof.band[1], SAMPLED_POINTS)
    image = map_without_steps(contact, errors)
    shown = np.isfinite(image)
    return _dataset(contact, errors[shown], {"image": image[shown]}, proof.verdict, train)


def _unit(train: Scenario) -> str:
    """Unit of the error of the only controller."""
    shafts = [c.shaft for c in train.continuous().values()] + [c.shaft for c in train.axes().values()]
    return train.train().angle_unit((shafts or [None])[0] or list(train.train().shafts)[-1])


def _travel(values: Iterable[float]) -> float:
    """Travel of a reference with these values from 0 on; 1 where it never moves."""
    return float(np.ptp([0.0, *values])) or 1.0


def _comes_to_rest(loop: UndrivenLoop) -> bool:
    duration = loop.scenario.simulation.duration
    return any(loop.outlook(duration * LONGER**k).rests for k in range(RUNS))


def _reached(loop: UndrivenLoop, contact: StickSlip, proof: Proof) -> tuple[float, bool]:
    """Error of the first settled stuck interval of the scenario's run, and whether the errors of the run fade.

    An interval for which the proof holds goes before the first one.
    """
    settling = SETTLED / np.abs(contact.stuck_rates.real).min() if len(contact.stuck_rates) else 0.0
    first = math.nan
    for k in range(RUNS):
        whole = loop.settled + loop.scenario.simulation.duration * LONGER**k
        run = loop.run(whole, SAMPLES)
        errors, times = run["values"][loop.channels.index(loop.watched)], np.arange(SAMPLES) * whole / SAMPLES
        for begin, end in _stuck(_modes(loop, contact, run["switchings"]), loop.settled, whole):
            inside = np.flatnonzero((times > begin) & (times < end))
            if end - begin > settling and len(inside):
                error = float(errors[inside[-1]])
                first = error if math.isnan(first) else first
                if abs(error) <= proof.largest:
                    return error, False
        early, late = (np.abs(part).max() for part in np.array_split(errors[times > loop.settled], 4)[1::2])
        if late <= FADED * early:
            return first, True
    return first, False


def _modes(loop: UndrivenLoop, contact: StickSlip, switchings: np.ndarray) -> np.ndarray:
    """Instant, and mode of the contact before and after it, of each switching of the contact."""
    names = loop.core.switching_columns()
    columns = [0, *(names.index(f"{contact.name}_{when}") for when in ("before", "after"))]
    found = switchings[:, columns]
    return np.asarray(found[found[:, 1] != found[:, 2]])


def _stuck(switchings: np.ndarray, settled: float, end: float) -> list[tuple[float, float]]:
    """Stuck intervals of the only contact after the inputs have come to rest."""
    found, begin = [], settled
    for time, before, after in switchings:
        if before == 0 and after != 0 and time > settled:
            found.append((max(begin, settled), float(time)))
        if after == 0:
            begin = float(time)
    if len(switchings) and switchings[-1][2] == 0:
        found.append((max(begin, settled), end))
    return found


# --- the map ---


def _map(contact: StickSlip, proof: Proof, largest: float) -> list[tuple[float, Image]]:
    """Points of the map from 0 on, up to some times its largest limit cycle."""
    top = (proof.largest or largest) if proof.band is None else SHOWN * proof.band[1]
    none = Transients.none(contact)
    return [
        (float(e), image(contact, e, e, none)) for e in np.linspace(0.0, top, POINTS) if e > 0.0 or contact.excess > 0.0
    ]


def _fixed_points(contact: StickSlip, points: list[tuple[float, Image]]) -> list[FixedPoint]:
    """Errors whose slip leaves the same error with the other sign."""
    sums = [math.nan if i.reason else i.middle + e for e, i in points]
    brackets = [k for k in np.flatnonzero(np.diff(np.sign(sums))) if sums[k] * sums[k + 1] <= 0.0]
    return [_fixed_point(contact, points[k][0], points[k + 1][0], sums[k], sums[k + 1]) for k in brackets]


def _fixed_point(contact: StickSlip, a: float, b: float, at_a: float, at_b: float) -> FixedPoint:
    """A fixed point between two errors, by secants, with the transients that one stuck interval hands to the next slip."""
    low, high, slope, left = a, b, (at_b - at_a) / (b - a), Transients.none(contact)
    for _ in range(SECANTS):
        error = min(max(b - at_b / slope, low), high)
        found = image(contact, error, error, left)
        beside = image(contact, error * (1.0 + STEP), error * (1.0 + STEP), left)
        if found.reason or beside.reason:
            break
        slope = 1.0 + (beside.middle - found.middle) / (STEP * error)
        b, at_b, left = error, found.middle + error, Transients(found.left.middle, 0.0 * found.left.radius)
    return FixedPoint(error, sum(found.slip) + sum(found.stuck), (slope - 1.0) ** 2)


def _dataset(
    contact: StickSlip | SampledSlip, errors: Any, columns: Mapping[str, Any], verdict: str, train: Scenario
) -> xarray.Dataset:
    """Points of the map as a dataset over the error at the break-away."""
    import xarray as xr

    unit = _unit(train)
    about = {
        "image": (unit, "error left after the slip"),
        "slip_time": ("s", "duration of the slip"),
        "stuck_time": ("s", "time until the contact breaks away again"),
    }
    data = {
        name: ("error", values, dict(zip(("units", "long_name"), about[name], strict=True)))
        for name, values in columns.items()
    }
    coordinates = {"error": ("error", errors, {"units": unit, "long_name": "error at the break-away"})}
    return xr.Dataset(data, coords=coordinates, attrs={"contact": contact.name, "verdict": verdict})
