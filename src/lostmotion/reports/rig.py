"""The report of the virtual test rig: the data sheet on the left, what is measured on the right."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..data_sheets.sheet import Record
from ..model.torsion import Rigid
from ..test_rig.comparison import Comparison
from ..test_rig.measurement import RigReport
from ..test_rig.torsion_loop import Loop
from ..test_rig.virtual_rig import LOST_MOTION_LOAD
from ..units.practical import ARCMIN, RPM, counted, practical
from ..verdict import Point, Verdict
from .data_sheet_rows import rows_of, rows_of_part
from .figure_style import DOTS, step
from .page import Part, Prose, Report, Table
from .panels import Curve, Group, Panel
from .written_files import table_csv

PRINTED = 0.05  # half of the last of two digits, to which data sheets print at least
MEASURED = (
    "Steady state: a flywheel keeps the input at its speed, a torque holds the load; input and output torque are read once nothing changes. Torsion: the input is "
    "locked and the load torque goes through slow ramps. Break-away: a slow ramp of torque on the input, or on the output with the input free, until the shaft turns.",
    "Every run is exact, so the rig adds no error of its own: a difference between the two columns comes from the data.",
)


def panels(report: RigReport, sheet: GearboxSheet | None) -> list[Panel]:
    """The six panels of the sheet; the four without torsion of a rigid gearbox."""
    efficiency, lost = _over_load(report, "efficiency"), _over_load(report, "loss_torque")
    rpm, no_load = RPM * report.map["input_speed"].values, report.no_load[1]
    running = [Curve("rig", rpm, no_load, step(0, 4))]
    if sheet is not None:
        efficiency += _printed_efficiency(sheet)
        running += _printed_no_load_torque(sheet)
    load, values = report.map["load"].values, report.map["efficiency"].values
    across = [Curve(f"load {load[j]:g}", rpm, values[j], step(k, 4)) for k, j in enumerate((2, 4, 5, 7))]
    relative, share, at_input = "relative load [-]", "efficiency [-]", "torque at the input [N·m]"
    titles = "torsion, input locked", f"hysteresis loops (rated {report.gearbox.rated_output_torque:g} N·m)"
    labels, printed = ("twist [arcmin]", "output torque [N·m]"), [] if sheet is None else _printed_torsion(sheet)
    return [
        Panel("efficiency over load (motor drives)", relative, share, tuple(efficiency), y_range=(0.0, 1.0)),
        Panel("efficiency over speed", "input speed [rpm]", share, tuple(across), y_range=(0.0, 1.0)),
        Panel("loss torque", relative, at_input, tuple(lost)),
        Panel("no-load running torque", "input speed [rpm]", at_input, tuple(running)),
        *loading_panels(report.initial_loading, report.loops, titles, labels, ARCMIN, printed),
    ]


def loading_panels(
    first: tuple[Any, Any] | None,
    loops: Sequence[Loop],
    titles: tuple[str, str],
    labels: tuple[str, str],
    factor: float,
    printed: Sequence[Curve] = (),
) -> list[Panel]:
    """First loading, beside the printed values, and loops; none of a rigid part. factor: from SI to the unit of the twist."""
    if first is None:
        return []
    unit = labels[1].partition("[")[2].removesuffix("]")
    loading = Curve("rig, first loading", factor * first[0], first[1], step(0, 4))
    cycles = (
        Curve(f"±{loop.amplitude:.4g} {unit}", factor * loop.twist, loop.torque, step(k, 4))
        for k, loop in enumerate(loops)
    )
    return [Panel(titles[0], *labels, (loading, *printed)), Panel(titles[1], *labels, tuple(cycles))]


def _over_load(report: RigReport, name: str) -> list[Curve]:
    """A quantity of the map over the load, at 5, 20, 50 and 100 % of rated speed."""
    rpm, load = RPM * report.map["input_speed"].values, report.map["load"].values
    return [
        Curve(f"{rpm[k]:.0f} rpm", load, report.map[name].values[:, k], step(n, 4)) for n, k in enumerate((1, 3, 5, 7))
    ]


def _printed_efficiency(sheet: GearboxSheet) -> list[Curve]:
    points = sheet.losses.all_efficiencies()
    x, y = np.array([p.load for p in points]), np.array([p.efficiency for p in points])
    return [Curve("catalogue", x, y, DOTS)] if points else []


def _printed_no_load_torque(sheet: GearboxSheet) -> list[Curve]:
    points = [(q.input_speed, q.torque) for q in sheet.losses.no_load_torque]
    if sheet.losses.starting_torque is not None:
        points.insert(0, (0.0, sheet.losses.starting_torque))
    if not points:
        return []
    speeds, torques = np.array(points).T
    return [Curve("catalogue (at 0: starting torque)", RPM * speeds, torques, DOTS)]


def _printed_torsion(sheet: GearboxSheet) -> list[Curve]:
    if sheet.stiffness is None or not sheet.stiffness.torques:
        return []
    twist = 0.5 * (sheet.backlash or 0.0) + np.array(sheet.stiffness.breaks())
    return [Curve("catalogue T1, T2", ARCMIN * twist, np.array(sheet.stiffness.torques), DOTS)]


def summary_rows(report: RigReport) -> list[tuple[str, str]]:
    """Measurements of the rig without a printed value."""
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
    backlash = g.stiffness.has_gap
    width = (
        practical(loop.width, "rad", 4) if hysteresis or backlash else "none: neither hysteresis nor backlash is given"
    )
    return [
        (f"lost motion at ±{100 * LOST_MOTION_LOAD:.0f} % of rated torque", practical(report.lost_motion, "rad", 4)),
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


# --- the page ---


def agreement(comparisons: Sequence[Comparison], lines: Iterable[str]) -> Verdict | tuple[str, ...]:
    """Whether the rig agrees with the data sheet; lines alone where no datum is to compare with."""
    if not comparisons:
        return "There is no datum of a data sheet to compare with.", *lines
    worst = max(comparisons, key=lambda c: abs(c.difference))
    measured = f"{counted(len(comparisons), 'value')} of the data sheet measured"
    largest = f"{measured}; the largest difference is {percent(worst.difference)} ({worst.quantity})"
    points = [Point("fits with a reservation", f"{c.quantity}: {c.remark}") for c in comparisons if c.remark]
    if abs(worst.difference) > PRINTED:
        points.append(Point("fits with a reservation", largest))
    more = [f"{largest}."] if points and points[0].sentence != largest else []
    return Verdict.of([*points, Point("fits", largest)], [*more, *lines])


def _verdict(report: RigReport) -> Verdict | tuple[str, ...]:
    """Agreement of rig and data sheet, torsion and locking, in words."""
    rows = dict(summary_rows(report))
    lost = next(
        (f"{what} {value}" for what, value in rows.items() if what.startswith("lost motion")), "no lost motion: rigid"
    )
    return agreement(report.comparisons, [f"{lost}; self-locking: {rows['self-locking at rated load and speed']}."])


def percent(share: float) -> str:
    """A difference as text; one that is rounding is 0 %."""
    rounded = round(100.0 * share, 1)
    return f"{rounded:+.1f} %" if rounded else "0 %"


def comparison_table(comparisons: Sequence[Comparison]) -> Table:
    """The data of the sheet beside the measurements of the rig."""
    rows = []
    for c in comparisons:
        unit = "" if c.unit == "1" else c.unit
        rows.append([c.quantity, f"{c.catalogue:.5g}", f"{c.rig:.5g}", percent(c.difference), unit, c.remark])
    marked = frozenset(k for k, c in enumerate(comparisons) if c.remark)
    head = ("quantity", "catalogue", "rig", "difference", "unit", "remark")
    note = "A blank cell means a plain number, or no remark."
    return Table("Catalogue and rig", head, rows, note, marked=marked)


def rig_parts(
    comparisons: Sequence[Comparison],
    sheet: Record | None,
    notes: Iterable[str],
    measured: Sequence[tuple[str, str]],
    how: Sequence[str],
    own: Sequence[tuple[str, str, str]] = (),
) -> tuple[Part, ...]:
    """The parts below the charts: comparison, notes, further measurements, the data sheet or the part's own data, and the method."""
    data = own if sheet is None else rows_of(sheet)
    sources, gaps = ((), ()) if sheet is None else (sheet.sources, sheet.gaps)
    return (
        comparison_table(comparisons),
        Prose("", list(notes), noted=True),
        Table("Further measurements", ("quantity", "value"), measured),
        Table("The data sheet", ("quantity", "value", "source"), data),
        Prose("Sources", [f"{s.status} ({', '.join(s.data)}): {s.text}" for s in sources]),
        Table("Missing data", ("datum", "source to look in"), [[gap.datum, gap.where] for gap in gaps]),
        Prose("Method", how),
    )


def compared_rows(comparisons: Sequence[Comparison]) -> str:
    """The comparison as a CSV file."""
    header = ["quantity", "unit", "catalogue", "rig", "relative difference", "remark"]
    return table_csv(header, ([c.quantity, c.unit, c.catalogue, c.rig, c.difference, c.remark] for c in comparisons))


EFFICIENCY = ("relative_load", "input_speed [rpm]", "efficiency", "loss_torque at the input [N*m]")


def rig_report(name: str, report: RigReport, sheet: GearboxSheet | None = None, notes: Iterable[str] = ()) -> Report:
    """The page of a gearbox on the rig."""
    kind = f"{sheet.manufacturer} {sheet.kind.replace('_', ' ')} gearbox, " if sheet is not None else ""
    own = rows_of_part(report.gearbox)
    caption = "Measured on the simulated gearbox; points: the catalogue."
    table = report.map
    found = table["efficiency"].values, table["loss_torque"].values
    rows = [
        [float(mu), RPM * float(n), float(eta), float(loss)]
        for mu, etas, losses in zip(table["load"].values, *found, strict=True)
        for n, eta, loss in zip(table["input_speed"].values, etas, losses, strict=True)
    ]
    return Report(
        title=sheet.title if sheet is not None and sheet.title else name,
        lead=f"{kind}`{name}`, on the virtual test rig.",
        verdict=_verdict(report),
        main=Group("rig", "Measurements", caption, tuple(panels(report, sheet))),
        parts=rig_parts(report.comparisons, sheet, notes, summary_rows(report), MEASURED, own),
        file="rig.html",
        tables={"comparison.csv": compared_rows(report.comparisons), "efficiency.csv": table_csv(EFFICIENCY, rows)},
    )
