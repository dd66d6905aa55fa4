"""The report of a screw on the virtual test rig."""

from collections.abc import Iterable

import numpy as np

from ..data_sheets.linear_sheets import ScrewSheet
from ..test_rig.screw_measurement import ScrewReport
from ..test_rig.screw_rig import RATED
from ..test_rig.virtual_rig import LOST_MOTION_LOAD
from ..units.practical import RPM
from ..verdict import Verdict
from .figure_style import DOTS, step
from .page import Report
from .panels import Curve, Group, Panel
from .rig import agreement, compared_rows, loading_panels, rig_parts
from .written_files import table_csv

MEASURED = (
    "Deflection: the input is locked and the force on the slide goes through slow ramps. Efficiency: a flywheel keeps the screw at its speed against the force; it "
    "is the efficiency of the thread, without the drag. Drag: the deceleration of a coasting flywheel without a force. Break-away: a slow ramp of torque on the input, or of "
    "force on the slide with the input free. Pitch error: a slow turn without a force.",
    "Every run is exact, so the rig adds no error of its own: a difference between the two columns comes from the data.",
)


def panels(report: ScrewReport, sheet: ScrewSheet | None) -> list[Panel]:
    """The four panels of the page; the two without deflection of a rigid screw."""
    shares, driving, back = report.efficiency
    speeds, drag = report.drag
    travel = report.screw.travel() / (2.0 * np.pi)
    whole = shares * report.load * travel / (shares * report.load * travel / driving + report.drag_at(RATED))
    force = report.load * shares
    efficiency = [
        Curve("thread, the screw drives", force, driving, step(0, 4)),
        Curve("thread, the slide drives", force, back, step(2, 4)),
        Curve("with the drag, the screw drives", force, whole, step(3, 4)),
    ]
    running = [Curve("rig", RPM * speeds, drag, step(0, 4))]
    top = 1.2 * max(float(np.max(drag)), 0.0 if sheet is None else sheet.drag_torque) or 1.0
    if sheet is not None and sheet.efficiency is not None:
        efficiency.append(Curve("catalogue", force[-1:], np.array([sheet.efficiency]), DOTS))
    if sheet is not None and sheet.drag_torque > 0.0:
        running.append(Curve("catalogue", np.array([RPM * RATED]), np.array([sheet.drag_torque]), DOTS))
    titles, labels = (
        ("deflection, input locked", "loops under alternating force"),
        ("deflection [µm]", "axial force [N]"),
    )
    return [
        *loading_panels(report.first_loading, report.loops, titles, labels, 1e6),
        Panel("efficiency over load", "axial force [N]", "efficiency [-]", tuple(efficiency), y_range=(0.0, 1.0)),
        Panel("drag torque", "speed of the screw [rpm]", "on the screw [N·m]", tuple(running), y_range=(0.0, top)),
    ]


def summary_rows(report: ScrewReport) -> list[tuple[str, str]]:
    """Measurements of the rig without a printed value."""
    back = report.backdriving_force
    bare = "" if report.screw.drag_torque > 0.0 else ", as no drag is given"
    rows = [
        (
            f"lost motion at ±{100 * LOST_MOTION_LOAD:.0f} % of {report.load:.4g} N",
            f"{1e6 * report.lost_motion:.4g} µm",
        ),
        ("drag torque at 1000 rpm without a load", f"{report.drag_at(RATED):.4g} N·m{bare}"),
    ]
    if report.stiffness:
        rows.append(("axial stiffness", ", ".join(f"{1e-6 * k:.4g}" for k in report.stiffness) + " N/µm"))
    else:
        rows.append(("axial stiffness", "none: the screw is given as rigid"))
    rows += [
        (f"starting torque on the screw against {report.load:.4g} N", f"{report.starting_torque:.4g} N·m"),
        (
            "back-driving force with a free input",
            f"{back:.4g} N{bare}" if back is not None else "none up to three times the load: self-locking",
        ),
    ]
    if report.screw.pitch_error is not None:
        rows.append(("pitch error over a turn, peak to peak", f"{1e6 * report.pitch_error:.4g} µm"))
    return rows


def _verdict(report: ScrewReport) -> Verdict | tuple[str, ...]:
    rows = summary_rows(report)
    lines = [
        f"Lost motion {rows[0][1]} at ±{100 * LOST_MOTION_LOAD:.0f} % of {report.load:.4g} N; axial stiffness {rows[2][1]}.",
        f"Drag torque {rows[1][1]}; back-driving force {rows[4][1]}.",
    ]
    return agreement(report.comparisons, lines)


def rig_report(name: str, report: ScrewReport, sheet: ScrewSheet | None = None, notes: Iterable[str] = ()) -> Report:
    """The page of a screw on the rig."""
    caption = "Measured on the simulated screw; points: the catalogue."
    kind = f"{sheet.manufacturer} {sheet.kind.replace('_', ' ')}, " if sheet is not None else ""
    rows = ([share * report.load, eta, back] for share, eta, back in zip(*report.efficiency, strict=True))
    head = ["axial force [N]", "efficiency, the screw drives", "efficiency, the slide drives"]
    tables = {"comparison.csv": compared_rows(report.comparisons), "efficiency.csv": table_csv(head, rows)}
    if report.first_loading is not None:
        table = zip(*report.first_loading, strict=True)
        tables["deflection.csv"] = table_csv(["deflection [m]", "axial force [N]"], table)
    return Report(
        title=sheet.title if sheet is not None and sheet.title else name,
        lead=f"{kind}`{name}`, on the virtual test rig at {report.load:.4g} N.",
        verdict=_verdict(report),
        main=Group("rig", "Measurements", caption, tuple(panels(report, sheet))),
        parts=rig_parts(report.comparisons, sheet, notes, summary_rows(report), MEASURED),
        file="rig.html",
        tables=tables,
    )
