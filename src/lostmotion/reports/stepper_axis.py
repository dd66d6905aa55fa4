"""The report of a stepper's axis, which has no loop: errors, lag of the rotor, stiffness, resonances, settling and lost steps."""

import math

import numpy as np

from ..sizing.stepper_axis import OpenLoop
from ..units.practical import charted, practical
from .figure_style import FAINT, look
from .page import Prose, Report, Table
from .panels import Curve, Group, Panel

COMPUTED = (
    "Errors, settling, reversal error and lost steps are those of an exact simulation of the scenario. With a winding the adaptive solver runs it.",
    "The error is the reference less the shaft. A move has settled from the instant at which the error stays within the window until the next move.",
    "Stiffness and resonances are those of rotor and load on two springs: the field of the motor, n T_H, and what is soft behind it. Backlash and friction do not count there.",
    "Beyond an electrical angle of 180 degrees the rotor slips to the next stable position of the field, four full steps away.",
)


def open_loop_report(name: str, title: str, found: OpenLoop) -> Report:
    """The page of a stepper's axis."""
    unit, factor = charted(found.unit, small=True)
    ends, bound = found.time[[0, -1]], factor * found.window * np.ones(2)
    error = (
        Curve("error", found.time, factor * found.error, look(0)),
        *(
            Curve(f"{sign}window", ends, way * bound, FAINT, "window" if way > 0 else "_")
            for sign, way in (("+", 1.0), ("-", -1.0))
        ),
    )
    lag = (Curve(found.motor, found.time, np.degrees(found.electrical_angle), look(0)),)
    _, *rows = found.summary()
    settled = [[str(k + 1), "not" if math.isinf(t) else f"{1e3 * t:.4g}"] for k, t in enumerate(found.settling)]
    missed = frozenset(k for k, t in enumerate(found.settling) if math.isinf(t))
    note = f"Time from the end of a move until the error stays within {practical(found.window, found.unit)}."
    return Report(
        title=title or name,
        lead=f"Axis of the stepper {found.motor} of `{name}`, which is turned without a loop.",
        verdict=found.verdict,
        main=Group(
            "open-loop",
            "Errors over time",
            "Error of the shaft, and by how much the field is before the rotor.",
            (
                Panel(f"error of {found.shaft}", "time [s]", f"reference less shaft [{unit}]", error),
                Panel("field before the rotor", "time [s]", "electrical angle [deg]", lag),
            ),
            1,
        ),
        parts=(
            Table("Axis", ("quantity", "value"), rows),
            Table("Settling", ("move", "after [ms]"), settled, note, marked=missed),
            Prose("What is computed", COMPUTED),
        ),
        file="servo.html",
    )
