"""The test rig's data sheet: figures, tables as CSV, and an HTML page that looks like a page of a catalogue."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from . import plots
from .data_sheet import GearboxSheet, Record
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .parts import Gearbox
from .plots import Curve, Panel
from .quantities import unit_in_schema
from .test_rig import LOST_MOTION_LOAD, RigReport

# Practical units of data sheets: SI unit -> (unit, factor).
PRACTICAL = {
    "rad/s": ("rpm", 30.0 / np.pi),
    "rad": ("arcmin", 10800.0 / np.pi),
    "kg*m^2": ("kg·cm²", 1e4),
    "s": ("ms", 1e3),
    "H": ("mH", 1e3),
    "degC": ("°C", 1.0),
    "ohm": ("Ω", 1.0),
}
CATALOGUE_POINT: dict[str, Any] = {"color": "#d9730d", "linestyle": "none", "marker": "o", "markersize": 7}
SHADES = ("#0b3c5d", "#3a7ca5", "#7fae3f", "#b8b8b8")


def shown(value: Any, unit: str) -> str:
    """A figure in the units that data sheets use."""
    if isinstance(value, str):
        return value
    name, factor = PRACTICAL.get(unit, (unit.replace("*", "·"), 1.0))
    text = ", ".join(f"{factor * v:.5g}" for v in (value if isinstance(value, tuple) else (value,)))
    return f"{text} {name}".strip()


def rows_of(record: Record) -> list[tuple[str, str, str]]:
    """(figure, value, status of its source) of all figures of a record."""
    fields = type(record).model_json_schema()["properties"]
    out: list[tuple[str, str, str]] = []

    def add(key: str, label: str, text: str) -> None:
        source = record.source_of(key)
        out.append((label, text, source.status if source else "own figure"))

    for name in type(record).model_fields:
        value = getattr(record, name)
        if name in Record.model_fields or name == "kind" or value is None or name not in record.model_fields_set:
            continue
        label = name.replace("_", " ")
        if name == "stiffness":
            for k, slope in enumerate(value.slopes):
                upto = f" up to {value.torques[k]:g} N·m" if k < len(value.torques) else ""
                add(name, f"torsional stiffness K{k + 1}{upto}", f"{slope:.4g} N·m/rad")
            if value.scatter:
                add(name, "scatter of the stiffness", f"±{100 * value.scatter:.0f} %")
        elif name == "losses":
            _add_losses(value, add)
        else:
            add(name, label, shown(value, unit_in_schema(fields[name]) or ""))
    return out


def _add_losses(losses: Any, add: Any) -> None:
    for key in ("efficiency", "backdrive_efficiency"):
        for p in getattr(losses, key):
            where = f"{key.replace('_', ' ')} at {shown(p.input_speed, 'rad/s')}, load {p.load:g}"
            add(f"losses.{key}", where, f"{p.efficiency:g}")
    for q in losses.no_load_torque:
        at = f"no-load torque at {shown(q.input_speed, 'rad/s')}" + (
            f", {q.temperature:g} °C" if q.temperature is not None else ""
        )
        add("losses.no_load_torque", at, f"{q.torque:g} N·m")
    for load, factor in losses.load_correction:
        add("losses.load_correction", f"load correction at load {load:g}", f"{factor:g}")
    for key, unit in (("starting_torque", "N·m"), ("backdriving_torque", "N·m"), ("static_efficiency", "")):
        value = getattr(losses, key)
        if value is not None:
            add(
                f"losses.{key}",
                key.replace("_", " ").replace("backdriving", "back-driving"),
                f"{value:g} {unit}".strip(),
            )
    if losses.table is not None:
        t = losses.table
        add("losses.table", "loss map", f"{len(t.loads)} loads x {len(t.speeds)} speeds")


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
    loop = report.loops[0]
    return [
        ("starting torque at the input", f"{report.starting_torque:.4g} N·m"),
        (
            "back-driving torque at the output",
            f"{back:.4g} N·m" if back is not None else "none up to three times rated torque: self-locking",
        ),
        (f"lost motion at ±{100 * LOST_MOTION_LOAD:.0f} % of rated torque", shown(report.lost_motion, "rad")),
        ("width of the loop at zero torque, rated torque in both directions", shown(loop.width, "rad")),
        ("energy lost in that loop", f"{loop.area:.4g} J"),
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
            "rig.html.jinja",
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


def rows_of_part(g: Gearbox) -> list[tuple[str, str, str]]:
    """The figures of a gearbox that has no sheet."""
    names = (("rated_output_torque", "N*m"), ("rated_input_speed", "rad/s"), ("inertia", "kg*m^2"))
    plain = [(name.replace("_", " "), shown(getattr(g, name), unit), "own figure") for name, unit in names]
    return [("ratio", f"{g.ratio:g}", "own figure"), *plain]
