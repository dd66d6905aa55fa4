"""By how much controlled axes miss their references."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..scenario.scenario import Scenario
from .results import RunArrays

NAME = "pointing_error"


def pointing_names(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Motor and name of the error, for each axis that follows a position."""
    for motor, controller in scenario.axes().items():
        if controller.reference.kind == "position":
            yield motor, f"{scenario.prefix(motor)}{NAME}"


def pointing_errors(scenario: Scenario, result: RunArrays) -> dict[str, np.ndarray]:
    """The reference less the true angle of its shaft [rad] over time, by name; with a camera the reference is where the target is."""
    found = {}
    for motor, name in pointing_names(scenario):
        controller = scenario.axes()[motor]
        found[name] = controller.reference.at(result.time)[0] - _angle(scenario, result, controller.shaft)
    return found


def _angle(scenario: Scenario, result: RunArrays, shaft: str | None) -> np.ndarray:
    train = scenario.train()
    name = train.angle_of(shaft or list(train.shafts)[-1])
    if name in result:
        return result[name]
    (gear,) = train.gears.values()  # of a drive, whose results have no angle of the motor
    return np.asarray(gear.ratio * (result["load_angle"] + result["twist"]))
