"""The test rig's data sheet: figures, tables as CSV, and an HTML page that looks like a page of a catalogue."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..model.torsion import Rigid
from ..test_rig.measurement import RigReport
from ..test_rig.rig import LOST_MOTION_LOAD
from ..units.practical import RPM, practical
from . import plots
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .panels import Curve, Panel
from .sheet_rows import rows_of, rows_of_part

CATALOGUE_POINT: dict[str, Any] = {"color": "#d9730d", "linestyle": "none", "marker": "o", "markersize": 7}
SHADES = ("#0b3c5d", "#3a7ca5", "#7fae3f", "#b8b8b8")


def panels(report: RigReport, sheet: GearboxSheet | None) -> list[Panel]:
    """The six panels of the sheet; the four without torsion of a rigid gearbox."""
    efficiency, lost = _over_load(report, "efficiency"), _over_load(report, "loss_torque")
    rpm, no_load = RPM * report.map["input_speed"].values, report.no_load[1]
    running = [Curve("rig", rpm, no_load, _line(SHADES[0]))]
    if sheet is not None:
        efficiency += _printed_efficiency(sheet)
        running += _printed_no_load_torque(sheet)
    load, values = report.map["load"].values, report.map["efficiency"].values
    across = [
        Curve(f"load {load[j]:g}", rpm, values[j], _line(shade))
        for j, shade in zip((2, 4, 5, 7), SHADES[::-1], strict=True)
    ]
    relative, share, at_input = "relative load [-]", "efficiency [-]", "at the input [N·m]"
    return [
        Panel("efficiency over load (motor drives)", relative, share, tuple(efficiency), y_range=(0.0, 1.0)),
        Panel("efficiency over speed", "input speed [rpm]", share, tuple(across), y_range=(0.0, 1.0)),
        Panel("torque lost", relative, at_input, tuple(lost)),
        Panel("no-load running torque", "input speed [rpm]", at_input, tuple(running)),
        *_torsion_panels(report, sheet),
    ]


def _torsion_panels(report: RigReport, sheet: GearboxSheet | None) -> list[Panel]:
    """First loading and loops; none of a rigid gearbox."""
    if report.initial_loading is None:
        return []
    twist, torque = report.initial_loading
    torsion = [Curve("rig, first loading", 1e3 * twist, torque, _line(SHADES[0]))]
    if sheet is not None:
        torsion += _printed_torsion(sheet)
    loops = [
        Curve(f"±{loop.amplitude:.3g} N·m", 1e3 * loop.twist, loop.torque, _line(shade))
        for loop, shade in zip(report.loops, SHADES, strict=False)
    ]
    angle, output, rated = "twist [mrad]", "output torque [N·m]", report.gearbox.rated_output_torque
    return [
        Panel("torsion, input locked", angle, output, tuple(torsion)),
        Panel(f"hysteresis loops (rated {rated:g} N·m)", angle, output, tuple(loops)),
    ]


def _line(shade: str) -> dict[str, Any]:
    return {"color": shade, "linestyle": "-", "linewidth": 1.5}


def _over_load(report: RigReport, name: str) -> list[Curve]:
    """A quantity of the map over the load, at 5, 20, 50 and 100 % of rated speed."""
    rpm, load = RPM * report.map["input_speed"].values, report.map["load"].values
    return [
        Curve(f"{rpm[k]:.0f} rpm", load, report.map[name].values[:, k], _line(shade))
        for k, shade in zip((1, 3, 5, 7), SHADES, strict=True)
    ]


def _printed_efficiency(sheet: GearboxSheet) -> list[Curve]:
    points = sheet.losses.all_efficiencies()
    x, y = np.array([p.load for p in points]), np.array([p.efficiency for p in points])
    return [Curve("catalogue", x, y, CATALOGUE_POINT)] if points else []


def _printed_no_load_torque(sheet: GearboxSheet) -> list[Curve]:
    points = [(q.input_speed, q.torque) for q in sheet.losses.no_load_torque]
    if sheet.losses.starting_torque is not None:
        points.insert(0, (0.0, sheet.losses.starting_torque))
    if not points:
        return []
    speeds, torques = np.array(points).T
    return [Curve("catalogue (at 0: starting torque)", RPM * speeds, torques, CATALOGUE_POINT)]


def _printed_torsion(sheet: GearboxSheet) -> list[Curve]:
    if sheet.stiffness is None or not sheet.stiffness.torques:
        return []
    twist = 0.5 * (sheet.backlash or 0.0) + np.array(sheet.stiffness.breaks())
    return [Curve("catalogue T1, T2", 1e3 * twist, np.array(sheet.stiffness.torques), CATALOGUE_POINT)]


def summary_rows(report: RigReport) -> list[tuple[str, str]]:
    """What the rig says of itself, beside the comparison."""
    back = report.backdriving_torque
    return [
        ("starting torque at the input", f"{report.starting_torque:.4g} N·m"),
        (
            "back-driving torque at the output",
            f"{back:.4g} N·m" if back is not None else "none up to three times rated torque: self-locking",
        ),
        *_overrunning_rows(report),
        *_torsion_rows(report),
    ]


def _torsion_rows(report: RigReport) -> list[tuple[str, str]]:
    """Lost motion and what is read off the largest loop."""
    g = report.gearbox
    if isinstance(g.stiffness, Rigid):
        return [("stiffness, lost motion and hysteresis", "none: the gearbox is given as rigid, without any twist")]
    loop = report.loops[0]
    # Without their cause, what is measured is rounding.
    hysteresis = g.hysteresis is not None and g.hysteresis.efficiency < 1.0
    backlash = g.stiffness.pieces()[1][0] == 0.0
    width = practical(loop.width, "rad") if hysteresis or backlash else "none: neither hysteresis nor backlash is given"
    return [
        (f"lost motion at ±{100 * LOST_MOTION_LOAD:.0f} % of rated torque", practical(report.lost_motion, "rad")),
        ("width of the loop at zero torque, rated torque in both directions", width),
        ("energy lost in that loop", f"{loop.area:.4g} J" if hysteresis else "none: no hysteresis is given"),
    ]


def _overrunning_rows(report: RigReport) -> list[tuple[str, str]]:
    """Whether the gearbox locks, and what lowering its rated load takes."""
    at, ratio = report.overrunning, report.overrunning.critical_inertia_ratio
    rows = [("self-locking at rated load and speed", str(at))]
    if at.holds:
        rows.append(("input torque that breaks the rated load loose downward", f"more than {at.input_torque:.4g} N·m"))
    if at.slope < 0.0:
        motion = (
            f"unstable without damping where the load's inertia exceeds {ratio:.3g} i² times that on the input shaft"
        )
        rows.append(("lowering of the rated load at rated speed", motion))
    return rows


def write_sheet(
    directory: Path, name: str, report: RigReport, sheet: GearboxSheet | None, notes: Iterable[str] = ()
) -> Path:
    """Figures (PNG, SVG), tables (CSV) and ``rig.html`` in a directory, made if missing.

    Returns
    -------
    Path
        Of the page.
    """
    directory.mkdir(parents=True, exist_ok=True)
    drawn = panels(report, sheet)
    png = save_figure(plots.draw(drawn, 2, (10.0, 1.75 * len(drawn))), directory, "rig")
    write_text(directory / "rig.csv", panels_csv(drawn))
    write_text(
        directory / "comparison.csv",
        table_csv(
            ["quantity", "unit", "catalogue", "rig", "relative difference", "remark"],
            ([c.quantity, c.unit, c.catalogue, c.rig, c.difference, c.remark] for c in report.comparisons),
        ),
    )
    table = report.map
    rows = [
        [float(mu), RPM * float(n), float(eta), float(loss)]
        for mu, etas, losses in zip(
            table["load"].values, table["efficiency"].values, table["loss_torque"].values, strict=True
        )
        for n, eta, loss in zip(table["input_speed"].values, etas, losses, strict=True)
    ]
    write_text(
        directory / "efficiency.csv",
        table_csv(["relative_load", "input_speed [rpm]", "efficiency", "loss_torque at the input [N*m]"], rows),
    )
    page = directory / "rig.html"
    write_text(
        page,
        render_page(
            "reports/rig.html.jinja",
            name=name,
            sheet=sheet,
            rows=rows_of(sheet) if sheet is not None else rows_of_part(report.gearbox),
            summary=summary_rows(report),
            comparisons=report.comparisons,
            notes=list(notes),
            figure=embed(
                png, f"Rig measurements of {name}", "Measured on the simulated gearbox; points: the catalogue.", "rig"
            ),
        ),
    )
    return page
