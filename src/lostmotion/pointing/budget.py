"""The pointing report: the error of each axis over time, and what each cause contributes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import argument
from ..inputs.refusal_messages import did_you_mean, shown
from ..interruptible_threads import thread_pool
from ..model.shaft_ratio import turns
from ..response.spectrum import Spectrum, spectrum
from ..simulation.runs.lost_steps import LostSteps, found_in
from ..simulation.runs.pointing_error import pointed, pointing_errors, pointing_names
from ..simulation.runs.results import RunArrays
from ..simulation.runs.run import run
from ..simulation.runs.sample_means import weights
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables_of_trains import angle_of_run
from .causes import CAUSES, VARIANTS, present, without
from .robustness import ROBUSTNESS, SPEEDS

QUIET = 0.05  # of the duration, for which two runs stay together after the start-up transient
PART = 0.1  # of the rms error, up to which two runs from different starts have come together
PROBABLE = 0.6744897501960817  # of a normal distribution, in standard deviations: half of all errors are smaller


@dataclass(frozen=True)
class PointingError:
    """Errors of one axis over a run [rad, of a slide m]."""

    rms: float
    peak: float
    mean: float
    probable: float  #: 0.6745 standard deviations
    measured_rms: float
    """rms of the measured direction: with a camera, target minus expected target of its tracker; else the angle of
    the load minus the angle of the encoder, or of a stepper minus the angle that its driver counts"""


@dataclass(frozen=True)
class View:
    """Share of the time in which the target is within the field of view."""

    share: float  #: share of the time
    probability: float  #: product over the axes of normal distributions of these means and deviations


Errors = Mapping[str, PointingError]  # by the motor of the axis


@dataclass(frozen=True)
class PointingBudget:
    """Pointing errors of axes with their causes."""

    scenario: Scenario
    after: float  #: [s], what is before does not count
    after_line: str  #: why errors count from then on
    time: np.ndarray  #: [s]
    errors: Mapping[str, np.ndarray]
    """reference less angle of the load [rad], or position of the slide [m], over time, by the motor of the axis"""
    measured: Mapping[str, np.ndarray]  #: error of the measured direction [rad, m] over time, as in `PointingError`
    whole: Errors  #: errors of the scenario as it is
    without: Mapping[str, Errors]  #: with one cause taken away, by its name
    alone: Mapping[str, Errors]  #: with that cause alone
    successive: Mapping[str, Errors]
    """with that cause and all before it taken away; the decreases of the mean square from line to line add up"""
    ideal: Errors  #: with none of them: what the controller itself leaves
    variants: Mapping[str, Errors]  #: with another controller
    robustness: Mapping[str, Errors]
    """at other temperatures, with wear, with losses in the controller that are wrong by a factor"""
    speeds: Mapping[float, Errors]
    """by the factor on the speed of the targets, 1 included; empty where the references are no targets with a speed"""
    pixels: Mapping[str, float]  #: angle of a pixel [rad] of the axes with a camera
    units: Mapping[str, str]  #: unit of each axis: rad, or m of a slide
    lost: tuple[LostSteps, ...]  #: steps that the steppers lose
    orders: Mapping[str, Spectrum | str]
    """error of each stepper's axis at constant speed by orders, or why there is none"""
    view: View | None = None  #: view, if a field of view is given or cameras have one
    limits: Mapping[str, float] = field(default_factory=dict)  #: largest permitted error [rad, m] of axes that have one

    def contributions(self, axis: str) -> dict[str, float]:
        """Fall of the mean square error of an axis [rad², m²] with each cause, as all are taken away one after another.

        They add up to ``whole[axis].rms**2 - ideal[axis].rms**2``; one that is negative hides another.
        """
        squares = [self.whole[axis].rms ** 2, *(found[axis].rms ** 2 for found in self.successive.values())]
        return {name: a - b for name, a, b in zip(self.successive, squares, squares[1:], strict=False)}


@checked
def pointing_budget(
    scenario: Scenario,
    *,
    after: float | str | None = None,
    view: Mapping[str, float | str] | None = None,
    limit: Mapping[str, float | str] | None = None,
    robustness: bool = True,
    progress: Callable[[], None] | None = None,
) -> PointingBudget:
    """Compute the pointing error of axes and the contribution of each cause.

    All motions are simulated, several at a time. They are the scenario as it is, without each cause, with each cause
    alone, and with one cause after another removed. Further motions have other controllers, temperatures, wear and
    target speeds. Causes are backlash, the zone of low stiffness, hysteresis, dry friction, gear losses, encoder
    steps, delay, wind, and latency, noise and pixels of cameras. A controller with an inverse model knows the drive
    of each run, except its temperature. An axis of a stepper has no loop. Its causes are also microsteps, the sine table of
    its driver, detents and transmission errors, and `orders` has its error at constant speed.

    Parameters
    ----------
    scenario : Scenario
        One axis or several (`[controllers.MOTOR]`, or steppers with `stepping`), each with a reference of the position.
    after : float or str, optional
        Time [s] from which errors count. Default: the end of the start-up transient. To find it, the same run is made from another
        start: on the reference or, if the scenario begins on it, at rest there. Errors count after twice the time in which both
        agree to a tenth of the rms error, or as far as they do in the second half.
    view : mapping of str to float or str, optional
        Full angle of view [rad, of a slide m] of each axis, by the name of its motor. Default: the angles of view of the cameras.
    limit : mapping of str to float or str, optional
        Largest permitted error [rad, of a slide m] of an axis, by the name of its motor. The verdict compares the peak with it.
    robustness : bool
        Whether to run other temperatures, target speeds, wear, and wrong losses in the controller, too.
    progress : callable, optional
        Called after each run.

    Returns
    -------
    PointingBudget
        Errors of each axis [rad, of a slide m], contributions of the causes, and robustness.

    Raises
    ------
    InputError
        An axis has no controller with a reference of the position, or `view` or `limit` names no axis.
    SolverError
        A run has no continuation.

    Examples
    --------
    >>> import lostmotion as lm
    >>> budget = lm.pointing_budget(lm.load("tracking-loss-map"), robustness=False)
    >>> {axis: f"{1e3 * error.rms:.2g} mrad" for axis, error in budget.whole.items()}
    {'motor': '0.0019 mrad'}
    """
    loaded = scenario.long()
    given = None if after is None else argument("after", after, "s")
    _check(loaded, given or 0.0)
    result = run(loaded, energy=False)
    as_it_is = _errors(loaded, result)
    start, line = (
        _end_of_transient(loaded, as_it_is)
        if given is None
        else (given, f"errors count from {given:.4g} s on, as given")
    )
    cameras = {motor: c.camera.field for motor, c in loaded.axes().items() if c.camera is not None}
    seen = view or {motor: angle for motor, angle in cameras.items() if angle is not None}
    angles, limits = _angles(loaded, "view", seen), _angles(loaded, "limit", limit or {})
    cases = _cases(loaded, robustness=robustness)
    changed: dict[Case, Scenario] = {}
    known = {loaded: _numbers(as_it_is, start)}
    with thread_pool(os.cpu_count()) as pool:
        others = (one for one in _different(loaded, cases, changed) if one != loaded)
        for one, numbers in pool.map(lambda s: (s, _numbers(_run(s), start)), others):
            known[one] = numbers
            if progress is not None:
                progress()
    if progress is not None:
        for _ in range(len(cases) - len(known) + 1):
            progress()
    known_errors = {case: known[one] for case, one in changed.items()}
    (time, errors, measured), whole = as_it_is, known_errors["whole", ""]

    def group(kind: str) -> dict[Any, Errors]:
        return {name: value for (own, name), value in known_errors.items() if own == kind}

    causes = list(group("without"))
    ideal = known_errors["successive", causes[-1]] if causes else whole
    speeds = group("speed")
    return PointingBudget(
        scenario,
        start,
        line,
        time,
        errors,
        measured,
        whole,
        group("without"),
        group("alone"),
        group("successive"),
        ideal,
        group("variant"),
        group("robustness"),
        dict(sorted((speeds | {1.0: whole}).items())) if speeds else {},
        {m: c.camera.pixel for m, c in loaded.axes().items() if c.camera is not None and c.camera.pixel is not None},
        units_of_axes(loaded),
        found_in(loaded, result),
        {motor: _by_order(loaded, motor) for motor in steppers(loaded)},
        _in_view(time >= start, errors, angles) if angles else None,
        limits,
    )


def steppers(scenario: Scenario) -> list[str]:
    """Motors of the axes without a loop."""
    return [motor for motor in pointed(scenario) if motor not in scenario.axes()]


def _by_order(scenario: Scenario, motor: str) -> Spectrum | str:
    try:
        return spectrum(scenario, motor=motor)
    except InputError as error:
        return error.problems[0].sentence()


def _end_of_transient(scenario: Scenario, as_it_is: OneRun) -> tuple[float, str]:
    """The time [s] from which on errors do not depend on how the axes start, and the line that states it."""
    if not scenario.axes():
        return 0.0, "errors count from the start, at which each stepper is aligned (--after leaves a beginning out)"
    time, first, _ = as_it_is
    second = _run(without(scenario, [_other_start(scenario)]) or scenario)[1]
    half = len(time) // 2
    end = 0.0
    for motor, error in first.items():
        apart = np.abs(error - second[motor])
        floor = max(PART * float(np.sqrt(np.mean(error[half:] ** 2))), float(apart[half:].max()))
        end = max(end, first_gap(time[:half][apart[:half] > floor], QUIET * scenario.simulation.duration))
    if end == 0.0:
        return 0.0, "errors count from the start: how the axes start makes no difference that stands out"
    # What is left of an exponential transient is squared in twice the time.
    end *= 2.0
    return end, f"errors count from {end:.4g} s on: the start-up transient before is left out (--after 0 counts it)"


def first_gap(times: np.ndarray, quiet: float) -> float:
    """The last of instants before the first gap that is as long as the time until it, and at least `quiet`; 0 without any."""
    end = 0.0
    for time in times.tolist():
        if time - end > max(end, quiet):
            break
        end = time
    return end


def _other_start(scenario: Scenario) -> Callable[[dict[str, Any]], None]:
    """The change to another start: on the reference, or at rest where the axes begin on the reference."""
    angles = dict(scenario.begin().angles)

    def change(data: dict[str, Any]) -> None:
        start: dict[str, Any] = data["initial"]
        on_reference = not start.get("on_reference")
        start |= {"angles": {} if on_reference else angles, "speeds": {}, "on_reference": on_reference}

    return change


Case = tuple[str, Any]  # what a run is for, and its name there


def _cases(scenario: Scenario, *, robustness: bool = True) -> dict[Case, Sequence[Callable[..., None]]]:
    """The runs of a budget, with what each changes."""
    causes = present(scenario, CAUSES)
    names = list(causes)
    cases: dict[Case, Sequence[Callable[..., None]]] = {("whole", ""): ()}
    for k, name in enumerate(names):
        cases["without", name] = (causes[name],)
        cases["alone", name] = [causes[other] for other in names if other != name]
        cases["successive", name] = [causes[other] for other in names[: k + 1]]
    tables: dict[str, Mapping[Any, Callable[..., None]]] = {"variant": VARIANTS}
    if robustness:
        tables |= {"robustness": ROBUSTNESS, "speed": SPEEDS}
    for kind, table in tables.items():
        for key, change in present(scenario, table).items():
            cases[kind, key] = (change,)
    return cases


def runs_of(scenario: Scenario) -> int:
    """Number of runs of a budget, without the runs that find the end of the start-up transient."""
    return len(_cases(scenario.long()))


def _check(scenario: Scenario, after: float) -> None:
    if not scenario.axes() and not pointed(scenario):
        raise InputError(
            "the scenario has no sampled controller; add [controller], or [controllers.MOTOR] for each axis; of a stepper command.stepping"
        )
    for motor, controller in scenario.axes().items():
        if controller.reference.kind != "position":
            raise InputError(
                f'{shown(controller.reference.kind)} is not what an axis points by; take "position"',
                f"controllers.{motor}.reference.kind",
            )
    if not 0.0 <= after < scenario.simulation.duration:
        raise InputError(
            f"after: {after:g} s must be from 0 to less than the duration, {scenario.simulation.duration:g} s"
        )


def _angles(scenario: Scenario, name: str, given: Mapping[str, float | str]) -> dict[str, float]:
    """Angles or lengths above 0 of axes, which the argument of this name gives."""
    for motor in given:
        if motor not in pointed(scenario):
            names = ", ".join(pointed(scenario))
            meant = did_you_mean(motor, pointed(scenario), f"the motors with a controller are {names}")
            raise InputError(f"{name}: {shown(motor)} is the motor of no axis; {meant}")
    units = units_of_axes(scenario)
    angles = {motor: argument(f"{name}[{motor}]", angle, units[motor]) for motor, angle in given.items()}
    for motor, angle in angles.items():
        if not angle > 0.0:
            raise InputError(f"{name}[{motor}]: {angle:g} {units[motor]} must be above 0")
    return angles


def units_of_axes(scenario: Scenario) -> dict[str, str]:
    """Unit of the position that each axis follows, by its motor."""
    return {motor: scenario.train().angle_unit(shaft) for motor, (_, shaft) in pointed(scenario).items()}


OneRun = tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]
"""instants, errors of the true and of the measured direction by axis"""


def _different(
    scenario: Scenario, cases: Mapping[Case, Sequence[Callable[..., None]]], changed: dict[Case, Scenario]
) -> Iterator[Scenario]:
    """The scenarios of the cases, each once: different changes may leave the same. Enters in `changed` which case has which."""
    seen = set()
    for case, changes in cases.items():
        changed[case] = one = (without(scenario, list(changes)) if changes else None) or scenario
        if one not in seen:
            seen.add(one)
            yield one


def _run(scenario: Scenario) -> OneRun:
    return _errors(scenario, run(scenario, energy=False))


def _errors(scenario: Scenario, result: RunArrays) -> OneRun:
    found, measured, train = {}, {}, scenario.train()
    true = pointing_errors(scenario, result)
    for motor, name in pointing_names(scenario):
        found[motor] = error = true[name]
        if motor not in scenario.axes():  # a driver counts the steps of its field
            shaft = pointed(scenario)[motor][1]
            ratio = turns(train, train.motors[motor].shaft, shaft)
            assert ratio is not None
            counted = result[train.variable(motor, "command")] / ratio
            place = angle_of_run(train, shaft, result)
            measured[motor] = place - place[0] - (counted - counted[0])
            continue
        controller = scenario.axes()[motor]
        target = controller.reference.at(result.time)[0]
        # The load is at the reference less its error.
        truth, said = (
            (target - error, "measured_position") if controller.camera is None else (target, "position_reference")
        )
        measured[motor] = truth - result[f"{motor}_{said}"]
    return result.time, found, measured


def _numbers(found: OneRun, after: float) -> Errors:
    time, errors, measured = found
    counted = time >= after
    mean, numbers = partial(np.average, weights=weights(time[counted])), {}
    for motor, error in errors.items():
        e = error[counted]
        numbers[motor] = PointingError(
            rms=math.sqrt(mean(e**2)),
            peak=float(np.abs(e).max()),
            mean=float(mean(e)),
            probable=PROBABLE * math.sqrt(mean((e - mean(e)) ** 2)),
            measured_rms=math.sqrt(mean(measured[motor][counted] ** 2)),
        )
    return numbers


def _in_view(counted: np.ndarray, errors: Mapping[str, np.ndarray], angles: Mapping[str, float]) -> View:
    inside = np.ones(np.count_nonzero(counted), bool)
    probability = 1.0
    for motor, angle in angles.items():
        e = errors[motor][counted]
        inside &= np.abs(e) < 0.5 * angle
        sigma, mean = max(float(e.std()), 1e-300), float(e.mean())
        ends = ((0.5 * angle - mean) / sigma, (0.5 * angle + mean) / sigma)
        probability *= sum(0.5 * (1.0 + math.erf(end / math.sqrt(2.0))) for end in ends) - 1.0
    return View(float(inside.mean()), probability)
