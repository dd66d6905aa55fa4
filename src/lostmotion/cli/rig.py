"""`lostmotion rig`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .arguments import FiguresOption, ReportOption, argument, complete_on_rig, option
from .output_files import pictures_of, try_directory, writing
from .terminal import busy, progress

if TYPE_CHECKING:
    from ..data_sheets.sheet import Record
    from ..model.angle_torques import TorqueHarmonic
    from ..test_rig.comparison import Comparison
    from ..test_rig.measurement import RigReport
    from ..test_rig.screw_measurement import ScrewReport


def rig(
    name: str = argument(
        "NAME",
        "Gearbox or screw: name in the catalogue, or a file with one record (.toml).",
        default=...,
        autocompletion=complete_on_rig,
    ),
    output: ReportOption = None,
    overrides: list[str] | None = option(
        "KEY=VALUE", 'Change or add a value, e.g. --set temperature="40 degC".', "--set"
    ),
    logs: Path | None = option(
        "DIR",
        "Write logs of the rig's experiments and the file that identifies the gearbox from them, instead of the page.",
    ),
    ripple: str | None = option(
        "'ORDER TORQUE'",
        'With --logs: torque ripple of the input shaft, so many periods in one turn, e.g. --ripple "2 0.02 N*m".',
    ),
    figures: FiguresOption = None,
) -> None:
    """To see what a gearbox or screw does, beside its data sheet.

    \b
    lostmotion rig schaeffler-rt1-h-20-100
    lostmotion rig my-gearbox.toml -o rig --set loss_factor=1.3
    lostmotion rig rexroth-25x10rx3-i4 --set "supported_length=600 mm"
    lostmotion rig my-gearbox.toml --logs campaign --ripple "2 0.02 N*m"

    Prints the comparison with its data sheet; with -o, writes rig.html (one page) and the measurements as CSV. A screw is measured at a tenth of its dynamic capacity.
    """
    from ..data_sheets.linear_sheets import ScrewSheet
    from ..data_sheets.records import find

    pictures = pictures_of(figures, output)
    if ripple is not None and logs is None:
        raise InputError("--ripple: is for the logs of a campaign; give --logs DIR, too")
    if logs is not None:
        try_directory(logs)
    sheet = find(name, "gearbox", "screw")
    if isinstance(sheet, ScrewSheet) and logs is not None:
        raise InputError(f"--logs: {sheet.name} is a screw, and logs are written of gearboxes; leave --logs out")
    if logs is not None:
        _write_logs(name, sheet, overrides or (), logs, ripple)
        return
    report, notes = _measured(name, sheet, overrides or ())
    from ..reports import rig as of_gearbox
    from ..reports import screw_rig as of_screw
    from ..reports.written_files import write_report

    pages: Any = of_screw if isinstance(sheet, ScrewSheet) else of_gearbox
    page = None
    if output is not None:
        with writing(output), busy("Writing"):
            page = write_report(output, pages.rig_report(sheet.name, report, sheet, notes), pictures)
    print(sheet.title or sheet.name)
    _print_comparisons(report.comparisons)
    for what, value in pages.summary_rows(report):
        print(f"  {what}: {value}")
    for note in notes:
        print(f"  note: {note}")
    if page is None:
        print(f"All charts on a page: lostmotion rig {name} -o rig")
    else:
        print(f"Report written to {page}\nIts data, sources and gaps: lostmotion catalogue {name}")


def _measured(name: str, sheet: Record, overrides: Sequence[str]) -> tuple[RigReport | ScrewReport, tuple[str, ...]]:
    """Report of the rig, and the notes of a gearbox's loss map."""
    from ..data_sheets.gearbox_sheet import GearboxSheet
    from ..data_sheets.linear_sheets import ScrewSheet
    from ..simulation.scenario.scenario_files import gearbox_from_record, screw_from_record

    if isinstance(sheet, ScrewSheet):
        from ..model.notes import Notes
        from ..test_rig.screw_measurement import WORK, measure_screw

        screw = screw_from_record(name, overrides)
        with progress(WORK, "Measuring") as step:
            return measure_screw(screw, sheet, progress=step), tuple(Notes(screw.note).values())
    from ..test_rig.measurement import WORK, measure

    assert isinstance(sheet, GearboxSheet)
    part, notes = gearbox_from_record(name, overrides)
    with progress(WORK, "Measuring") as step:
        return measure(part, sheet, notes, step), notes


def _write_logs(name: str, sheet: Record, overrides: Sequence[str], directory: Path, ripple: str | None) -> None:
    from ..identification.virtual_campaign import write_campaign
    from ..simulation.scenario.scenario_files import gearbox_from_record

    part, _ = gearbox_from_record(name, overrides)
    title = f"{sheet.title or sheet.name}: logs of the virtual rig"
    torque = None if ripple is None else _ripple(ripple)
    with busy("Running the rig"):
        file = write_campaign(directory, part, title=title, ripple=torque)
    print(f"Logs written to {directory / 'logs'}")
    print(f"Next: lostmotion identify {file} -o identified")


def _ripple(text: str) -> TorqueHarmonic:
    from ..model.angle_torques import TorqueHarmonic

    order, _, torque = text.strip().partition(" ")
    if not order.isdigit() or not torque.strip():
        raise InputError(f'--ripple: "{text}" must be the periods in one turn and a torque, such as "2 0.02 N*m"')
    try:
        return TorqueHarmonic.model_validate({"shaft": "motor", "order": int(order), "amplitude": torque.strip()})
    except InputError as error:
        raise InputError(f'--ripple: "{text}": {error}') from None


def _print_comparisons(comparisons: Sequence[Comparison]) -> None:
    from ..reports.rig import percent

    if comparisons:
        print(f"  {'':<44} {'sheet':>10} {'rig':>10} {'difference':>12}")
    for c in comparisons:
        unit = "" if c.unit == "1" else f" [{c.unit}]"
        remark = f"  ({c.remark})" if c.remark else ""
        print(f"  {c.quantity + unit:<44} {c.catalogue:>10.4g} {c.rig:>10.4g} {percent(c.difference):>12}{remark}")
