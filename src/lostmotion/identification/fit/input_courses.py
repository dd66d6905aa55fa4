"""Course of an input between two samples: held or linear, by the way in which its channel was recorded."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ...units.practical import printed
from ..prepared_log import Prepared
from ..rig.measured_motion_input import GIVEN_SPEED
from ..rig.residuals import ParameterPoint
from ..rig.rig_scenario import Rig
from .least_squares import Fit

Way = Literal["hold", "linear"]
WORDS: dict[Way, str] = {"hold": "held between samples", "linear": "straight lines between samples"}
FEW = 0.02  # share of samples at which a channel changes, up to which it moves in steps
REPEATED = 0.5  # share of samples equal to the one before, from which on it is a staircase
ROUGH = 1.0  # median change of the change over median change, above which each sample is a value of its own
NEARER = 1e-3  # of the error, by which one way must be better


def course_of(x: np.ndarray) -> str:
    """Course of a channel: ``constant``, ``steps``, ``staircase``, ``rough`` or ``smooth``."""
    step = np.diff(x)
    changed = np.flatnonzero(step)
    if not len(changed):
        return "constant"
    if len(changed) <= FEW * len(step):
        return "steps"
    moving = step[changed[0] : changed[-1] + 1]
    if np.mean(moving == 0.0) >= REPEATED:
        return "staircase"
    rough = np.median(np.abs(np.diff(moving))) > ROUGH * np.median(np.abs(moving))
    return "rough" if rough else "smooth"


def as_recorded(rig: Rig, logs: Sequence[Prepared]) -> tuple[Rig, dict[str, str], dict[str, Way]]:
    """(rig with a way for each input, words on the inputs that the task leaves open, the inputs that samples alone do not decide)."""
    ways: dict[str, Way] = {}
    words: dict[str, str] = {}
    undecided: dict[str, Way] = {}
    for name, channel in rig.task.inputs.items():
        if channel.interpolation is not None:
            continue
        if name.endswith(GIVEN_SPEED):
            ways[name] = "linear"
            continue
        courses = {course_of(log.inputs[name]) for log in logs}
        ways[name] = "linear" if "smooth" in courses and not courses & {"staircase", "rough"} else "hold"
        if "staircase" not in courses and courses & {"smooth", "rough"}:
            undecided[name] = ways[name]
        else:
            why = "repeats its values" if "staircase" in courses else "moves in steps"
            words[name] = f"{name}: {WORDS[ways[name]]}, since the channel {why}"
    return with_ways(rig, ways), words, undecided


def with_ways(rig: Rig, ways: dict[str, Way]) -> Rig:
    """The rig with some inputs held or in straight lines."""
    if not ways:
        return rig
    inputs = {
        n: i.model_copy(update={"interpolation": ways.get(n, i.interpolation)}) for n, i in rig.task.inputs.items()
    }
    other = copy.copy(rig)
    other.task = rig.task.model_copy(update={"inputs": inputs})
    return other


def nearer_ways(
    rig: Rig,
    logs: Sequence[Prepared],
    ways: Mapping[str, Way],
    start: ParameterPoint,
    fitted: Callable[[Rig, list[Prepared], ParameterPoint], Fit],
) -> tuple[Rig, ParameterPoint, dict[str, str]]:
    """(rig, where the search goes on, words): inputs go the other way if fits are nearer to the logs then.

    A command that its sender holds for one sample looks like one that moves on between samples: only runs tell them apart.
    """
    words: dict[str, str] = {}
    best = fitted(rig, [replace(log, cache={}) for log in logs], start)
    for name, first in ways.items():
        way: Way = first
        turned: Way = "hold" if way == "linear" else "linear"
        changed = with_ways(rig, {name: turned})
        other = fitted(changed, [replace(log, cache={}) for log in logs], start)
        errors = {way: _shown(best.mae, rig), turned: _shown(other.mae, rig)}
        if other.mae < best.mae * (1.0 - NEARER):
            rig, best, way = changed, other, turned
        words[name] = (
            f"{name}: {WORDS[way]}, since its samples do not tell, and fits have a mean absolute residual of "
            f"{errors['linear']} with straight lines and {errors['hold']} held"
        )
    return rig, best.point, words


def _shown(mae: float, rig: Rig) -> str:
    """The error of a fit with its unit: deviations of the channels if the task gives them, else the SI unit of the channels."""
    if all(deviation is not None for deviation in rig.deviations.values()):
        return f"{mae:.4g} deviations"
    units = {printed(rig.units[m.variable]) for m in rig.task.measured.values()}
    return f"{mae:.4g} {units.pop() if len(units) == 1 else 'SI units'}"
