"""The figure of docs/references.md."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from figure_files import save

import lostmotion as lm
from lostmotion.reports.figure_style import FIRST, SECOND
from lostmotion.reports.panels import Curve, Panel

DEG = 180.0 / math.pi


def write(out: Path) -> None:
    """One move with and without a limit of the jerk, into a directory."""
    move = {"to": "90 deg", "speed": "180 deg/s", "acceleration": "720 deg/s^2"}
    jerk_limited = lm.PositionReference(moves=[move], jerk="7200 deg/s^3")
    trapezoidal = lm.PositionReference(moves=[move])
    t = np.linspace(0.0, 0.95, 4001)
    limited, plain = (tuple(DEG * x for x in reference.at(t)) for reference in (jerk_limited, trapezoidal))
    labels = ("position [deg]", "speed [deg/s]", "acceleration [deg/s²]", "jerk [deg/s³]")
    panels = []
    for k, label in enumerate(labels):
        curves = [Curve("jerk-limited", t, limited[k], FIRST)]
        if k < 3:  # the jerk of the other one is a pulse of no duration
            curves.append(Curve("trapezoidal speed", t, plain[k], SECOND))
        panels.append(Panel("", "time [s]", label, tuple(curves)))
    save(panels, 2, (9.0, 5.0), out, "references-move")
