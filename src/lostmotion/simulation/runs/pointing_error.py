"""Errors of controlled axes against their references."""

from collections.abc import Iterator

import numpy as np

from ...control.references import PositionReference, SlideReference
from ..scenario.scenario import Scenario
from ..variables_of_trains import angle_of_run
from .results import RunArrays

NAME = "pointing_error"


def pointed(scenario: Scenario) -> dict[str, tuple[PositionReference | SlideReference, str]]:
    """Position that each axis follows, and the shaft or slide that follows it, by its motor: by a loop, or by the steps of a stepper."""
    found: dict[str, tuple[PositionReference | SlideReference, str]] = {}
    last = list(scenario.train().shafts)[-1] if scenario.train().shafts else ""
    for motor, controller in scenario.axes().items():
        if isinstance(controller.reference, PositionReference | SlideReference):
            found[motor] = controller.reference, controller.shaft or last
    for motor, command in scenario.tables.command.items():
        stepping = command.stepping
        if stepping is not None and (reference := stepping.reference or stepping.travel) is not None:
            found[motor] = reference, stepping.shaft or last
    return found


def pointing_names(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Motor and name of the error, for each axis that follows a position."""
    for motor in pointed(scenario):
        yield motor, scenario.train().variable(motor, NAME)


def pointing_errors(scenario: Scenario, result: RunArrays) -> dict[str, np.ndarray]:
    """The reference less the true angle of its shaft [rad] over time, by name; with a camera the reference is where the target is.

    A stepper moves its shaft by as much as its reference moves: there the reference begins where the shaft is.
    """
    found = {}
    for motor, name in pointing_names(scenario):
        place = angle_of_run(scenario.train(), pointed(scenario)[motor][1], result)
        found[name] = target(scenario, motor, result.time, float(place[0])) - place
    return found


def target(scenario: Scenario, motor: str, time: np.ndarray, start: float) -> np.ndarray:
    """Position that an axis follows over time [rad, m]; of a stepper from where its shaft begins."""
    reference, _ = pointed(scenario)[motor]
    wanted: np.ndarray = reference.at(time)[0]
    if scenario.train().motors[motor].kind == "stepper":
        wanted = start + wanted - float(reference.at(np.zeros(1))[0][0])
    return wanted
