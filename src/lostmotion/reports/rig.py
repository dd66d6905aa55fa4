"""The test rig's data sheet: figures, tables as CSV, and an HTML page that looks like a page of a catalogue."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..data_sheets.sheets import GearboxSheet
from ..model.parts import Rigid
from ..test_rig.rig import LOST_MOTION_LOAD, RigReport
from . import plots
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .panels import Curve, Panel
from .sheet_rows import rows_of, rows_of_part, shown

CATALOGUE_POINT: dict[str, Any] = {"color": "#d9730d", "linestyle": "none", "marker": "o", "markersize": 7}
SHADES = ("#0b3c5d", "#3a7ca5", "#7fae3f", "#b8b8b8")


def panels(report: RigReport, sheet: GearboxSheet | None) -> list[Panel]:
    """The six panels of the sheet."""
    g, table = report.gearbox, report.map
    rpm = table["input_speed"].values * 30.0 / np.pi
    load = table["load"].values
    picked = [1, 3, 5, 7]  # 5, 20, 50, 100 % of rated speed

    def line(shade: str, style: str = "-") -> dict[str, Any]:
        return {"color": shade, "linestyle": style, "linewidth": 1.5}

    def over_load(name: str, factor: float) -> list[Curve]:
        return [
            Curve(f"{rpm[k]:.0f} rpm", load, factor * table[name].values[:, k], line(shade))
            for k, shade in zip(picked, SHADES, strict=True)
        ]

    efficiency = over_load("efficiency", 1.0)
    no_load = [Curve("rig", rpm, report.no_load[1], line(SHADES[0]))]
    twist, torque = report.virgin
    torsion = [Curve("rig, first loading", 1e3 * twist, torque, line(SHADES[0]))]
    if sheet is not None:
        points = sheet.losses.all_efficiencies()
        if points:
            x, y = np.array([p.load for p in points]), np.array([p.efficiency for p in points])
            efficiency.append(Curve("catalogue", x, y, CATALOGUE_POINT))
        speeds = np.array(
            [0.0] * (sheet.losses.starting_torque is not None) + [q.input_speed for q in sheet.losses.no_load_torque]
        )
        torques = [sheet.losses.starting_torque] if sheet.losses.starting_torque is not None else []
        torques += [q.torque for q in sheet.losses.no_load_torque]
        if torques:
            no_load.append(
                Curve("catalogue (at 0: starting torque)", speeds * 30.0 / np.pi, np.array(torques), CATALOGUE_POINT)
            )
        if sheet.stiffness is not None and sheet.stiffness.torques:
            gap = 0.5 * (sheet.backlash or 0.0)
            d, T = 1e3 * (gap + np.array(sheet.stiffness.breaks())), np.array(sheet.stiffness.torques)
            torsion.append(Curve("catalogue T1, T2", d, T, CATALOGUE_POINT))
    loops = [
        Curve(f"±{loop.amplitude:.3g} N·m", 1e3 * loop.twist, loop.torque, line(shade))
        for loop, shade in zip(report.loops, SHADES, strict=False)
    ]
    across = [
        Curve(f"load {load[j]:g}", rpm, table["efficiency"].values[j], line(shade))
        for j, shade in zip((2, 4, 5, 7), SHADES[::-1], strict=True)
    ]
    return [
        Panel(
            "efficiency over load (motor drives)",
            "relative load [-]",
            "efficiency [-]",
            tuple(efficiency),
            y_range=(0.0, 1.0),
        ),
        Panel("efficiency over speed", "input speed [rpm]", "efficiency [-]", tuple(across), y_range=(0.0, 1.0)),
        Panel("torque lost", "relative load [-]", "at the input [N·m]", tuple(over_load("loss_torque", 1.0))),
        Panel("no-load running torque", "input speed [rpm]", "at the input [N·m]", tuple(no_load)),
        Panel("torsion, input locked", "twist [mrad]", "output torque [N·m]", tuple(torsion)),
        Panel(
            f"hysteresis loops (rated {g.rated_output_torque:g} N·m)",
            "twist [mrad]",
            "output torque [N·m]",
            tuple(loops),
        ),
    ]


def summary_rows(report: RigReport) -> list[tuple[str, str]]:
    """What the rig says of itself, beside the comparison."""
    back = report.backdriving_torque
    loop, g = report.loops[0], report.gearbox
    # Without their cause, what is measured is rounding.
    hysteresis = g.hysteresis is not None and g.hysteresis.efficiency < 1.0
    backlash = not isinstance(g.stiffness, Rigid) and g.stiffness.pieces()[1][0] == 0.0
    width = shown(loop.width, "rad") if hysteresis or backlash else "none: neither hysteresis nor backlash is given"
    return [
        ("starting torque at the input", f"{report.starting_torque:.4g} N·m"),
        (
            "back-driving torque at the output",
            f"{back:.4g} N·m" if back is not None else "none up to three times rated torque: self-locking",
        ),
        (f"lost motion at ±{100 * LOST_MOTION_LOAD:.0f} % of rated torque", shown(report.lost_motion, "rad")),
        ("width of the loop at zero torque, rated torque in both directions", width),
        ("energy lost in that loop", f"{loop.area:.4g} J" if hysteresis else "none: no hysteresis is given"),
    ]


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
    png = save_figure(plots.draw(drawn, 2, (10.0, 10.5)), directory, "rig")
    write_text(directory / "rig.csv", panels_csv(drawn))
    write_text(
        directory / "comparison.csv",
        table_csv(
            ["figure", "unit", "catalogue", "rig", "relative difference", "remark"],
            ([c.figure, c.unit, c.catalogue, c.rig, c.difference, c.remark] for c in report.comparisons),
        ),
    )
    table = report.map
    rows = [
        [float(mu), float(n) * 30.0 / np.pi, float(eta), float(loss)]
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
