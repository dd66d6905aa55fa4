"""The pointing sheet: the error of each axis over time, and what each cause contributes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import argument
from ..inputs.validation import did_you_mean, shown
from ..simulation.run import simulate
from ..simulation.scenario import Scenario
from ..simulation.train_scenario import TrainScenario, in_long_form
from .causes import CAUSES, VARIANTS, present, without

PROBABLE = 0.6744897501960817  # of a normal distribution, in standard deviations: half of all errors are smaller


@dataclass(frozen=True)
class PointingError:
    """Of one axis over a run [rad]."""

    rms: float
    peak: float
    mean: float
    probable: float
    """0.6745 standard deviations"""
    measured_rms: float
    """of the direction that the encoder says, against that of the load"""


@dataclass(frozen=True)
class View:
    """How long the target is within the field of view."""

    share: float
    """of the time"""
    probability: float
    """product over the axes of normal distributions of these means and deviations"""


@dataclass(frozen=True)
class PointingBudget:
    """What pointing axes miss, and why."""

    scenario: Scenario | TrainScenario
    after: float
    """[s], what is before does not count"""
    time: np.ndarray
    """[s]"""
    errors: Mapping[str, np.ndarray]
    """reference less angle of the load [rad] over time, by the motor of the axis"""
    whole: Mapping[str, PointingError]
    """of the scenario as it is"""
    without: Mapping[str, Mapping[str, PointingError]]
    """with one cause taken away, by its name"""
    alone: Mapping[str, Mapping[str, PointingError]]
    """with that cause alone"""
    ideal: Mapping[str, PointingError]
    """with none of them: what the controller itself leaves"""
    variants: Mapping[str, Mapping[str, PointingError]]
    """with another controller"""
    view: View | None = None
    """where a field of view is given"""


@checked
def pointing_budget(
    scenario: Scenario | TrainScenario,
    *,
    after: float | str = 0.0,
    view: Mapping[str, float | str] | None = None,
    progress: Callable[[], None] | None = None,
) -> PointingBudget:
    """How far axes miss the direction that they are to follow, and what each cause contributes.

    All motions are simulated: the scenario as it is; with each of backlash, the zone of low stiffness, hysteresis, dry friction, losses of the
    gears, encoder steps and delay taken away; with each of them alone; and with other controllers. A controller with an inverse
    model knows the drive as it is in each run. A cause that the scenario does not have is left out.

    Parameters
    ----------
    scenario
        One axis or several (`[controllers.MOTOR]`), each with a reference of the position.
    after
        Time [s] from which errors count.
    view
        Whole angle of view [rad] of each axis, by the name of its motor.
    progress
        Called after each run.

    Raises
    ------
    InputError
        An axis has no controller with a reference of the position, or `view` names none.
    SolverError
    """
    loaded = in_long_form(scenario) if isinstance(scenario, Scenario) else scenario
    start = argument("after", after, "s")
    _check(loaded, start)
    angles = _view(loaded, view or {})
    time, errors, whole = _run(loaded, start)
    if progress is not None:
        progress()

    def made(changes: list[Callable[..., None]]) -> Mapping[str, PointingError]:
        changed = without(loaded, changes)
        found = whole if changed is None else _run(changed, start)[2]
        if progress is not None:
            progress()
        return found

    causes = present(loaded, CAUSES)
    return PointingBudget(
        scenario,
        start,
        time,
        errors,
        whole,
        {name: made([change]) for name, change in causes.items()},
        {name: made([c for other, c in causes.items() if other != name]) for name in causes},
        made(list(causes.values())),
        {name: made([change]) for name, change in present(loaded, VARIANTS).items()},
        _in_view(time >= start, errors, angles) if angles else None,
    )


def runs_of(scenario: Scenario | TrainScenario) -> int:
    """How many runs a budget makes."""
    loaded = in_long_form(scenario) if isinstance(scenario, Scenario) else scenario
    return 2 + 2 * len(present(loaded, CAUSES)) + len(present(loaded, VARIANTS))


def _check(scenario: TrainScenario, after: float) -> None:
    if not scenario.axes():
        raise InputError("the scenario has no controller; add [controller], or [controllers.MOTOR] for each axis")
    for motor, controller in scenario.axes().items():
        if controller.reference.kind != "position":
            raise InputError(
                f"key controllers.{motor}.reference.kind: {shown(controller.reference.kind)} is not what an axis points by; "
                'take "position"'
            )
    if not 0.0 <= after < scenario.simulation.duration:
        raise InputError(
            f"after: {after:g} s must be from 0 to less than the duration, {scenario.simulation.duration:g} s"
        )


def _view(scenario: TrainScenario, view: Mapping[str, float | str]) -> dict[str, float]:
    for motor in view:
        if motor not in scenario.axes():
            names = ", ".join(scenario.axes())
            meant = did_you_mean(motor, scenario.axes(), f"the motors with a controller are {names}")
            raise InputError(f"view: {shown(motor)} is the motor of no axis; {meant}")
    angles = {motor: argument(f"view[{motor}]", angle, "rad") for motor, angle in view.items()}
    for motor, angle in angles.items():
        if not angle > 0.0:
            raise InputError(f"view[{motor}]: {angle:g} rad must be above 0")
    return angles


def _run(scenario: TrainScenario, after: float) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, PointingError]]:
    result = simulate(scenario, energy=False)
    time = result["time"].to_numpy()
    counted = time >= after
    errors, found = {}, {}
    for motor, controller in scenario.axes().items():
        shaft = controller.shaft or list(scenario.shafts)[-1]
        angle = result[f"{shaft}_angle"].to_numpy()
        wanted = controller.reference.at(time)[0]
        error = wanted - angle
        said = result[f"{motor}_measured_position"].to_numpy() - angle
        e = error[counted]
        errors[motor] = error
        found[motor] = PointingError(
            rms=float(np.sqrt(np.mean(e**2))),
            peak=float(np.abs(e).max()),
            mean=float(e.mean()),
            probable=PROBABLE * float(e.std()),
            measured_rms=float(np.sqrt(np.mean(said[counted] ** 2))),
        )
    return time, errors, found


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
