"""Compliances of gears in series, and the gear of ratio 1 that has none."""

import math
from typing import Any

from .gearbox import Gearbox
from .losses import ConstantEfficiency
from .torsion import LinearStiffness, Rigid, TorsionCurve

DIRECT = Gearbox(
    ratio=1.0,
    rated_input_speed=1.0,
    rated_output_torque=1e3,
    stiffness=Rigid(),
    losses=ConstantEfficiency(efficiency=1.0),
    note="no gearbox",
)
"""stands for a gearbox if the motor drives the stage directly; no rule judges it"""


def in_series(g: Gearbox, own: Any, ratio: float) -> TorsionCurve | LinearStiffness | Rigid:
    """Force over deflection at the slide: the deflections of both at the same force add up."""
    curves = [
        [(b / scale, k * (scale * scale)) for b, k in zip([*breaks, math.inf], slopes, strict=True)]
        for curve, scale in ((g.stiffness, ratio), (own, 1.0))
        if not isinstance(curve, Rigid)
        for breaks, slopes in [curve.pieces()]
    ]
    if not curves:
        return Rigid()
    gap = 0.0
    segments: list[list[tuple[float, float]]] = []  # of each curve: (force up to which it holds, slope)
    for curve in curves:
        force, previous = 0.0, 0.0
        found: list[tuple[float, float]] = []
        for end, slope in curve:
            if slope == 0.0 and not found:
                gap += end
                previous = end
                continue
            force += slope * (end - previous)
            found.append((force, slope))
            previous = end
        segments.append(found)
    ends = sorted({force for found in segments for force, _ in found})
    slopes, breaks, before, deflection = [], [], 0.0, 0.0
    for end in ends:
        compliance = sum(1.0 / next(k for force, k in found if force >= end) for found in segments)
        slopes.append(1.0 / compliance)
        if math.isfinite(end):
            deflection += (end - before) * compliance
            breaks.append(deflection)
            before = end
    if len(slopes) == 1 and gap == 0.0:
        return LinearStiffness(stiffness=slopes[0])
    return TorsionCurve(slopes=tuple(slopes), breaks=tuple(breaks), backlash=2.0 * gap)
