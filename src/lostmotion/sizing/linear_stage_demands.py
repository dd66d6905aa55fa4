"""Last stage of a linear axis: a screw, a rack or a belt. Computes the requirements on the shaft that drives it, and
the gearbox that it forms together with the gearbox before it."""

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..data_sheets.linear_components import linear_table
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.gears_in_series import in_series
from ..model.losses import ConstantEfficiency, LossMap, efficiency_map
from ..model.rack_and_belt import RatedBelt, RatedRack
from ..model.screw import LinearDrive, RatedScrew
from ..model.torsion import Hysteresis, Rigid
from .required_motion import RequiredMotion

SAME = 1e-9  # relative, within which two breaks of a curve are one


Stage = RatedScrew | RatedRack | RatedBelt
STAGES: dict[str, type[RatedScrew] | type[RatedRack] | type[RatedBelt]] = {
    "screw": RatedScrew,
    "rack": RatedRack,
    "belt": RatedBelt,
}


def stage_of(kind: str, table: Mapping[str, Any]) -> Stage:
    """The stage of a table `[screw]`, `[rack]` or `[belt]`, with or without the name of a record in `from`.

    Raises InputError: the record lacks what a run needs, or a value cannot be used.
    """
    part = STAGES[kind]
    name = table.get("from")
    if name is None:
        return part(**table)
    beside = {key: value for key, value in table.items() if key != "from"}
    return part(**linear_table(kind, name, beside, kind))


def without_record(kind: str, table: Mapping[str, Any]) -> bool:
    """Whether a table has the stage in full."""
    return "from" not in table and bool(set(table) & set(STAGES[kind].model_fields))


def at_input(motion: RequiredMotion, stage: LinearDrive) -> RequiredMotion:
    """The motion of a slide, as a motion of the shaft that drives its stage: torques [N·m] with losses, drag and inertia of the stage."""
    ratio = stage.ratio()
    speed, acceleration, s = ratio * motion.speed, ratio * motion.acceleration, np.sign(motion.speed)
    forward, back = stage.efficiencies() or (1.0, 1.0)
    through = motion.torque * np.where(s * motion.torque > 0.0, 1.0 / forward, np.where(s == 0.0, 1.0, back)) / ratio
    own = stage.gear("in", "out")
    torque = through + stage.drag_torque * s + own.inertia * acceleration + own.viscous_friction * speed
    return RequiredMotion(
        motion.time,
        speed,
        acceleration,
        torque,
        motion.cycle,
        ratio * motion.position,
        motion.inertia / ratio**2 + own.inertia,
        motion.holding / ratio,
    )


def together(g: Gearbox, stage: LinearDrive) -> Gearbox:
    """A gearbox and the stage behind it as one gear between the motor and a slide, in units of translation at its output."""
    own, ratio = stage.gear("in", "out"), stage.ratio()
    forward, back = stage.efficiencies() or (1.0, 1.0)
    drag = stage.drag_torque / g.rated_output_torque
    return Gearbox(
        ratio=g.ratio * ratio,
        inertia=g.inertia + own.inertia / g.ratio**2,
        viscous_friction=g.viscous_friction + own.viscous_friction / g.ratio**2,
        rated_input_speed=g.rated_input_speed,
        rated_output_torque=g.rated_output_torque * ratio,
        stiffness=in_series(g, own.stiffness, ratio),
        mesh_damping=_damping(g, own, ratio),
        hysteresis=own.hysteresis or (None if isinstance(g.stiffness, Rigid) else _hysteresis(g.hysteresis)),
        losses=_losses(g, forward, back, drag),
        note=g.note,
    )


def _damping(g: Gearbox, own: Gear, ratio: float) -> float:
    """Damping of both at the slide [N s/m]. The forces are equal, and each is damped by its share of the deflection
    rate. So the terms c/k^2 add up to first order."""
    both = [
        (gear.mesh_damping * scale**2, gear.stiffness.pieces()[1][-1] * scale**2)
        for gear, scale in ((g, ratio), (own, 1.0))
        if not isinstance(gear.stiffness, Rigid)
    ]
    if not both:
        return 0.0
    stiffness = 1.0 / sum(1.0 / k for _, k in both)
    return sum(c / k**2 for c, k in both) * stiffness**2


def _hysteresis(found: Hysteresis | None) -> Hysteresis | None:
    return None if found is None or found.efficiency == 1.0 else found


def _losses(g: Gearbox, forward: float, back: float, drag: float) -> LossMap:
    """Loss over speed and load of both, relative to the rated torque of the gearbox, at its output.

    The load mu at the stage is mu/eta_f + d at its input while it drives, and mu eta_b + d while it is driven, with the drag d.
    """
    if isinstance(g.losses, ConstantEfficiency):
        eta = g.losses.efficiency
        speeds, loads, values = efficiency_map(eta, 2.0 - 1.0 / eta).whole()
    else:
        speeds, loads, values = g.losses.whole()

    def through(mu: float) -> float:
        return (mu / forward if mu > 0.0 else mu * back) + drag

    def before(at_input: float) -> float:
        x = at_input - drag
        return x * forward if x > 0.0 else x / back

    inside = {0.0, *(loads if back <= 0.0 else (before(x) for x in loads))}
    places = [a for a, b in itertools.pairwise([*sorted(inside), math.inf]) if b - a > SAME * loads[-1]]
    rows = []
    for mu in places:
        x = through(mu)
        lost = [float(np.interp(x, loads, [row[k] for row in values])) for k in range(len(speeds))]
        beyond = _beyond(x, loads, values)
        rows.append(tuple(x + (beyond[k] if beyond else lost[k]) - mu for k in range(len(speeds))))
    return LossMap(speeds=tuple(speeds), loads=tuple(places), values=tuple(rows))


def _beyond(x: float, loads: list[float], values: list[list[float]]) -> list[float] | None:
    """Losses outside the loads of a map, along its last segment; None inside."""
    if loads[0] <= x <= loads[-1]:
        return None
    a, b = (0, 1) if x < loads[0] else (-2, -1)
    share = (x - loads[a]) / (loads[b] - loads[a])
    return [p + share * (q - p) for p, q in zip(values[a], values[b], strict=True)]
