"""Motion of an axis after its reference has come to rest: limit cycles and their causes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from ...inputs.part import Part
from ...model.couplings import Commanded
from ...model.gear import Gear
from ...model.linear_train import LinearElements
from ...model.screw import LinearDrive
from ...model.torsion import TorsionCurve
from ...response.closed_loop import slowest
from ...simulation.scenario.scenario import Scenario
from ..axis_runs import changed, first_size, pole_named, step_duration, with_controller
from ..linear_regimes import Axis
from .hunting_decision import AtRest, WatchedRun, decide, moving_input

PART = 0.5  # of the amplitude, below which leaving something out takes a limit cycle away
REST = 10.0  # of the slowest time constants of the loops, for which an axis is watched at least
MOST_TICKS = 4e6  # for which it is watched at most
PATIENCE = 4.0  # times as long as the whole axis, for which one without a possible cause is watched
FINEST_BITS = 40  # of an encoder


@dataclass(frozen=True)
class LimitCycle:
    """The axis under a constant reference, and with each possible cause of a limit cycle left out."""

    whole: AtRest
    without: Mapping[str, AtRest]
    """by what is left out: backlash, dry friction, encoder resolution; if none of them alone is a cause, two of them"""

    @property
    def causes(self) -> list[str]:
        """Causes without which there is no limit cycle, or less than half of the amplitude."""
        if not self.whole.cycles:
            return []
        size = attrgetter("amplitude" if self.whole.floats else "motor_amplitude")
        return [name for name, rest in self.without.items() if size(rest) < PART * size(self.whole)]


def limit_cycle(axis: Axis, most: float = math.inf) -> LimitCycle | None:
    """Limit cycle of an axis with a position loop, watched for a time [s] at most; None for others."""
    if axis.controller.position is None:
        return None
    whole = at_rest(axis, most)
    if not whole.cycles:
        return LimitCycle(whole, {})
    most = PATIENCE * whole.watched
    single = {name: at_rest(other, most) for name, other in _left_out(axis, 1)}
    found = LimitCycle(whole, single)
    if found.causes:
        return found
    return LimitCycle(whole, single | {name: at_rest(other, most) for name, other in _left_out(axis, 2)})


def _left_out(axis: Axis, count: int) -> Iterator[tuple[str, Axis]]:
    """The axis without so many of the possible causes of a limit cycle, by their names."""
    changes: dict[str, Callable[[Axis], Axis | None]] = {
        "backlash": lambda a: _with(a, without_backlash(a.scenario)),
        "dry friction": lambda a: _with(a, without_friction(a.scenario)),
        "encoder resolution": without_steps,
    }
    for names in itertools.combinations(changes, count):
        other: Axis | None = axis
        for name in names:
            other = None if other is None else changes[name](other)
        if other is not None:
            yield " with ".join(names), other


def _with(axis: Axis, scenario: Scenario | None) -> Axis | None:
    return None if scenario is None else Axis(scenario, axis.motor)


def at_rest(axis: Axis, most: float = math.inf) -> AtRest:
    """The motion after the end of the reference; after a small step of the position where the reference never rests, or never moves.

    most: longest time to follow [s].
    """
    c, reference = axis.controller, axis.controller.reference
    assert c.position is not None
    start = axis.scenario.begin().of_all("angles").get(axis.shaft, 0.0)
    at_start = reference.duration == 0.0 and float(reference.at(0.0)[0]) == start
    if at_start or reference.sine_list() or any(reference.pieces()[-1][2:]):
        axis = with_controller(axis, reference={"kind": "position", "mean": start + first_size(axis, "position")})
    if name := moving_input(axis.scenario):
        return AtRest("not decided", f"{name} never comes to rest")
    first = max(watched_at_least(axis), axis.scenario.simulation.duration)
    with pole_named(axis):
        watch = WatchedRun(
            axis.scenario, (axis.train.variable(axis.motor_shaft, "angle"), axis.train.variable(axis.shaft, "angle"))
        )
        return decide(watch, first, min(most, max(MOST_TICKS * c.sample_time, 4.0 * first)))


def watched_at_least(axis: Axis) -> float:
    """Time for which an axis is watched at least, with its reference at rest [s]."""
    return max(REST * slowest(axis.controller), 4.0 * step_duration(axis, "position"))


def without(scenario: Scenario, values_of: Callable[[Any], dict[str, Any]]) -> Scenario | None:
    """The scenario with other values of elements, shafts and slides; None where that changes nothing."""
    new: dict[str, dict[str, Part]] = {}
    for table in ("shafts", "slides", *LinearElements.model_fields):
        elements = getattr(scenario, table)
        other = {name: e.model_copy(update=values) for name, e in elements.items() if (values := values_of(e))}
        if other:
            new[table] = {**elements, **other}
    return changed(scenario, **new) if new else None


def without_backlash(scenario: Scenario) -> Scenario | None:
    """The scenario with all gaps closed; None where there are none."""

    def closed(element: Any) -> dict[str, Any]:
        if isinstance(element, LinearDrive):
            return {"backlash": 0.0, "restitution": None} if element.backlash > 0.0 else {}
        stiffness = element.stiffness if isinstance(element, Gear) else None
        return {"stiffness": stiffness.closed()} if isinstance(stiffness, TorsionCurve) and stiffness.has_gap else {}

    return without(scenario, closed)


def without_friction(scenario: Scenario) -> Scenario | None:
    """The scenario without dry friction and hysteresis; None where there are none."""
    none = dict.fromkeys(("friction_torque", "friction_force", "drag_torque"), 0.0) | dict.fromkeys(
        ("breakaway_torque", "breakaway_force", "stribeck_speed", "friction_curve", "friction_error", "hysteresis")
    )

    def smooth(element: Any) -> dict[str, Any]:
        keys = () if isinstance(element, Commanded) else none.keys() & type(element).model_fields.keys()
        return {key: none[key] for key in keys if getattr(element, key) != none[key]}

    return without(scenario, smooth)


def without_steps(axis: Axis) -> Axis | None:
    """The axis with encoders without steps; None where they have none."""
    fields = {}
    for key in ("encoder", "position_encoder"):
        encoder = getattr(axis.controller, key)
        if encoder is not None and encoder.step > 0.0:
            none: dict[str, Any] = {
                "lines": None,
                "bits": None,
                "grating_period": None,
                "resolution": None,
                "ideal": True,
                "error_periods": encoder.error_periods or encoder.lines,
            }
            if encoder.grating_period is not None and encoder.error > 0.0:  # which has that period
                none = {"bits": FINEST_BITS}
            fields[key] = encoder.model_copy(update=none)
    return with_controller(axis, **fields) if fields else None
