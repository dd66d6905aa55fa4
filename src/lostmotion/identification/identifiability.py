"""What the logs cannot tell, in words: the null directions of the scaled Jacobian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .fit import Fit, slope_of
from .formulas import names_within
from .parameters import FreeParameter
from .task import Identification

LOOSE = 1.0  # relative change, of the values in a direction, that 95 % of equally good fits stay within: beyond, it is not determined
PART = 0.25  # of the largest relative change in a direction, from which on a parameter has a part in it
WORTH = 0.02  # relative change of a value, from which on it is named as resting on another
ALIKE = 0.3  # by which relative changes of parameters of one scale may differ

# What determines a parameter, by the key of the scenario that it enters.
REMEDIES: tuple[tuple[tuple[str, ...], str], ...] = (
    (
        ("drive_efficiency", "backdrive_efficiency", "losses"),
        "give a stall torque, or a log with output torque in both directions of power flow",
    ),
    (("stiffness", "backlash", "hysteresis"), "give a slow torque ramp with the output locked"),
    (("delay", "sample_time"), "give a log with steps of the reference"),
    (("breakaway_torque", "stribeck_speed", "friction_curve"), "give slow reversals, and a log that creeps from rest"),
    (
        ("rotor_inertia", "inertia"),
        "give a log with high acceleration and a known torque, or the inertia of the data sheet",
    ),
    (
        ("gain", "limit", "rated_torque", "viscous_friction", "friction_torque"),
        "give a stall torque, a log of the motor's torque or current, or a log in which the motor is off",
    ),
    (("angle",), "give a log at rest with the motor off"),
)


@dataclass(frozen=True)
class Undetermined:
    """A direction in the space of parameters in which the logs say little."""

    changes: dict[str, float]
    """relative changes of the parameters along it, the largest 1"""
    width: float
    """relative change of the largest of them within a 95 % interval; infinite if nothing holds it"""
    text: str


def undetermined(task: Identification, fit: Fit, parameters: Mapping[str, FreeParameter]) -> list[Undetermined]:
    """Directions that the logs alone, without priors, leave wider than the values themselves."""
    names = list(parameters)
    if not names:
        return []
    # Relative changes: of a parameter near 0 its scale stands for its value.
    size = np.array([max(abs(fit.point.values[n]), parameters[n].step) for n in names])
    slopes = np.array([slope_of(parameters[n], fit.point.values[n]) for n in names])
    H = fit.normal * np.outer(size / slopes, size / slopes)
    values, vectors = np.linalg.eigh(H)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        width = 1.96 / np.sqrt(value) if value > 1e-8 * values.max() else np.inf
        largest = int(np.argmax(np.abs(vector)))
        if width * abs(vector[largest]) < LOOSE:
            continue
        changes = {
            n: float(x / vector[largest])
            for n, x in zip(names, vector, strict=True)
            if abs(x) >= PART * abs(vector[largest])
        }
        sizes = {n: float(x) for n, x in zip(names, size, strict=True)}
        found.append(
            Undetermined(changes, float(width * abs(vector[largest])), _sentence(task, changes, sizes, parameters))
        )
    return found


def resting_on(
    task: Identification, fit: Fit, parameters: Mapping[str, FreeParameter], normal: np.ndarray, name: str
) -> list[Undetermined]:
    """That the values rest on the value of a parameter that is not free, if the logs would not tell it to within its scale.

    Parameters
    ----------
    parameters
        Those that are free, and this one as the last.
    normal
        J'WJ of the scaled parameters.
    """
    names = list(parameters)
    p, given = parameters[name], fit.point.values[name]
    slopes = np.array([slope_of(q, fit.point.values[n]) for n, q in parameters.items()])
    H = normal / np.outer(slopes, slopes)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    H = H * np.outer(scale, scale)
    others = -np.linalg.lstsq(H[:-1, :-1], H[:-1, -1], rcond=1e-10)[0]
    held = float(H[-1, -1] + H[-1, :-1] @ others)
    width = 1.96 * scale[-1] / np.sqrt(held) if held > 1e-10 else np.inf
    if width < p.step:
        return []
    to = given + p.step if given + p.step <= p.max else given - p.step
    moves = dict(zip(names[:-1], others * scale[:-1] / scale[-1] * (to - given), strict=True))
    shares = {
        n: d / fit.point.values[n] for n, d in moves.items() if abs(fit.point.values[n]) > 0.1 * parameters[n].step
    }
    shares = {n: share for n, share in shares.items() if abs(share) >= WORTH}
    if not shares:
        return []
    listed = ", ".join(f"{n} {100.0 * share:+.0f} %" for n, share in sorted(shares.items(), key=lambda x: -abs(x[1])))
    text = (
        f"the values rest on {name} = {p.shown(given)}, which these logs do not tell to within {p.shown(p.step)}: with {p.shown(to)} "
        f"they would be {listed}; {_remedy(task, [name])}"
    )
    return [Undetermined({name: 1.0, **shares}, float(width / p.step), text)]


def _sentence(
    task: Identification,
    changes: Mapping[str, float],
    sizes: Mapping[str, float],
    parameters: Mapping[str, FreeParameter],
) -> str:
    names = sorted(changes, key=lambda n: -abs(changes[n]))
    remedy = _remedy(task, names)
    if len(names) == 1:
        return f"{names[0]} is not determined by these logs; {remedy}"
    a, b, *more = names
    ratio = changes[b] / changes[a]
    # Of values that are nearly the same, a sum looks like a product: what is the more alike decides.
    ratio_of_sizes = ratio * sizes[b] / sizes[a]
    nearer = abs(abs(ratio_of_sizes) - 1.0) < abs(abs(ratio) - 1.0)
    if not more and nearer and abs(abs(ratio_of_sizes) - 1.0) < ALIKE and parameters[a].unit == parameters[b].unit:
        what, sign = ("sum", "+") if ratio < 0.0 else ("difference", "-")
        return f"only the {what} {a} {sign} {b} is determined; {remedy}"
    if not more and abs(abs(ratio) - 1.0) < ALIKE:
        what = "product" if ratio < 0.0 else "ratio"
        sign = "*" if ratio < 0.0 else "/"
        return f"only the {what} {a}{sign}{b} is determined; {remedy}"
    if all(abs(changes[n] - 1.0) < ALIKE for n in names):
        return f"{', '.join(names)} have one scale in common, which is not determined, only their ratios are; {remedy}"
    moves = ", ".join(f"{n} {10.0 * changes[n]:+.0f} %" for n in names)
    return f"the logs stay the same if these change together: {moves}; {remedy}"


def _remedy(task: Identification, names: Sequence[str]) -> str:
    keys = [key for name in names for key in _keys(task, name)]
    for ends, text in REMEDIES:
        if any(end in key for key in keys for end in ends):
            return text
    return "give a value with a tolerance as a prior, or a log in which they act apart"


def _keys(task: Identification, name: str) -> list[str]:
    """Keys of the scenario, and of channels, that a parameter enters."""
    tables = [task.set, *(rung.set for rung in task.ladder), *(phase.set for phase in task.phases)]
    found = [key for table in tables for key, value in table.items() if name in names_within(value)]
    for entry in (*task.inputs.values(), *task.measured.values()):
        found += [
            key
            for key in ("delay", "scale", "offset", "filter_time")
            if name in names_within(getattr(entry, key, None))
        ]
    return found


def at_bounds(fit: Fit, parameters: Mapping[str, FreeParameter]) -> list[str]:
    """Sentences on parameters that have ended at a bound."""
    found = []
    for name, p in parameters.items():
        value = fit.point.values[name]
        for bound, word in ((p.min, "least"), (p.max, "largest")):
            if abs(value - bound) <= 1e-6 * p.step:
                found.append(
                    f"{name} is at its {word} value {bound:.6g}: the logs would have it beyond, or it has no part in them"
                )
    return found
