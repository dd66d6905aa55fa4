"""Motors under field-oriented control: torque computed from currents, and error bounds of a run."""

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...control.axis import BoundController, own
from ...model.synchronous_motor import PhaseValues
from .scenario import Scenario

CURRENTS = ("direct_current", "quadrature_current")
ATTRIBUTE = "error_bound"
UNITS = {"current": "A", "torque": "N*m", "speed": "rad/s"}
FEWEST = 10  # samples of the currents in an electrical revolution, by the rule of thumb of manufacturers of drives
AGREEMENT = 1e-10  # relative, to which the passes and rounding hold currents and speeds


def oriented(scenario: Scenario) -> Iterator[tuple[str, str, PhaseValues]]:
    """Name and shaft of each motor under field-oriented control, and its winding."""
    for name, controller in scenario.axes().items():
        if controller.current.kind != "field_oriented":
            continue
        motor = scenario.train().motors[name]
        assert motor.winding is not None
        yield name, motor.shaft, motor.winding.phase_values()


def set_torques(scenario: Scenario, data: dict[str, np.ndarray]) -> None:
    """Puts the torque that belongs to the currents in place of the straight lines that the mechanics were driven by."""
    for name, _, phase in oriented(scenario):
        torque, *currents = (scenario.train().variable(name, quantity) for quantity in ("torque", *CURRENTS))
        data[torque] = phase.torque(*(data[current] for current in currents))


def coarser(control: BoundController) -> BoundController:
    """Copies of the controllers, with one exchange of torque and speed in each tick in place of two."""
    tick, axes = own(control)
    for axis in axes:
        if axis.is_oriented:
            axis.set({"field_orientation": {"parts": 1}})
    return tick, axes


def error_bound(scenario: Scenario, fine: Mapping[str, Any], coarse: Mapping[str, Any]) -> dict[str, float]:
    """Bound on the error of the motors' variables, from a run with one exchange in each tick and one with two.

    The error of the second is a sixteenth of the difference if nothing switches, and a quarter if the torque jumps.
    The bound is the difference itself, plus the remainder of the passes.
    """
    names = bounded(scenario)
    apart = {name: float(np.max(np.abs(fine[name] - coarse[name]))) for name in names}
    return bounds_of(names, {name: float(np.max(np.abs(fine[name]))) for name in names}, apart)


def bounded(scenario: Scenario) -> dict[str, str]:
    """Variables that have an error bound. The value is the variable whose largest magnitude also scales the rounding error."""
    names: dict[str, str] = {}
    train = scenario.train()
    for name, shaft, _ in oriented(scenario):
        torque, along, across = (train.variable(name, quantity) for quantity in ("torque", *CURRENTS))
        names |= {along: across, across: across, torque: torque, train.variable(shaft, "speed"): torque}
    return names


def bounds_of(names: Mapping[str, str], largest: Mapping[str, float], apart: Mapping[str, float]) -> dict[str, float]:
    """Error bounds by variable, from the largest values of the fine run and the largest differences to the coarse run."""
    return {name: apart[name] + AGREEMENT * max(largest[name], largest[other]) for name, other in names.items()}


def bound_names(scenario: Scenario) -> Iterator[tuple[str, str, str]]:
    """Names of the bounds as values of a run, with the variable that each belongs to and its unit."""
    for name in bounded(scenario):
        unit = next(unit for end, unit in UNITS.items() if name.endswith(end))
        yield f"{name}_{ATTRIBUTE}", name, unit


def bound_values(scenario: Scenario, attributes: Mapping[str, Any], samples: int) -> dict[str, np.ndarray]:
    """Error bounds of a run as arrays over its samples, read from the attributes of its result."""
    bounds = json.loads(attributes.get(ATTRIBUTE, "{}"))
    return {title: np.full(samples, bounds[name]) for title, name, _ in bound_names(scenario)}


def too_slow(scenario: Scenario, values: Mapping[str, Any]) -> str:
    """Warning of a sample time that is too long for the speed of the rotor in a run; empty if none is."""
    found = []
    for motor, shaft, phase in oriented(scenario):
        controller = scenario.axes()[motor]
        speed, time = (
            float(np.max(np.abs(values[scenario.train().variable(shaft, "speed")]))),
            controller.loop_time("current"),
        )
        turn = 2.0 * math.pi / (phase.pole_pairs * speed) if speed > 0.0 else math.inf
        if time * FEWEST > turn:
            found.append(
                f"{motor}: at {speed:.4g} rad/s the currents are sampled {turn / time:.3g} times in an electrical revolution, and below "
                f"{FEWEST} field-oriented control gets poor or unstable; take a sample time of at most {turn / FEWEST:.3g} s."
            )
    return " ".join(found)


def errors_of(result: Any) -> dict[str, float]:
    """Error bounds in the attributes of a result, by variable; empty without field-oriented control."""
    bounds: dict[str, float] = json.loads(result.attrs.get(ATTRIBUTE, "{}"))
    return bounds
