"""Measurements of the rig beside the values of the data sheet."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..units.practical import ARCMIN, RPM
from .virtual_rig import TestRig


@dataclass(frozen=True)
class Comparison:
    """One datum of the data sheet beside the rig's."""

    quantity: str
    unit: str
    catalogue: float
    rig: float
    remark: str = ""

    @property
    def difference(self) -> float:
        """Relative."""
        return self.rig / self.catalogue - 1.0


def compare(rig: TestRig, sheet: GearboxSheet, notes: tuple[str, ...]) -> Iterable[Comparison]:
    """Each datum of the sheet beside the same measured."""
    contradiction = "contradicts the no-load torque; see note" if any("Contradiction" in n for n in notes) else ""
    losses = sheet.losses

    def here(temperature: float | None) -> bool:
        """Whether a datum is of the temperature that the gearbox was made for."""
        return temperature in (None, losses.temperature)

    for p in filter(lambda p: here(p.temperature), losses.all_efficiencies()):
        what = f"efficiency at {RPM * p.input_speed:.0f} rpm, load {p.load:g}"
        yield Comparison(what, "1", p.efficiency, rig.efficiency(p.input_speed, p.load), contradiction)
    for p in filter(lambda p: here(p.temperature), losses.backdrive_efficiency):
        what = f"back-drive efficiency at {RPM * p.input_speed:.0f} rpm, load {p.load:g}"
        yield Comparison(what, "1", p.efficiency, rig.efficiency(p.input_speed, -p.load), contradiction)
    for q in filter(lambda q: here(q.temperature), losses.no_load_torque):
        what = f"no-load torque at {RPM * q.input_speed:.0f} rpm"
        yield Comparison(what, "N·m", q.torque, rig.no_load_torque(q.input_speed))
    if losses.starting_torque is not None and here(losses.starting_temperature):
        yield Comparison("starting torque", "N·m", losses.starting_torque, rig.starting_torque())
    if losses.backdriving_torque is not None and here(losses.backdriving_temperature):
        yield Comparison("back-driving torque", "N·m", losses.backdriving_torque, rig.backdriving_torque() or np.inf)
    if losses.static_efficiency is not None:
        eta = rig.gearbox.rated_output_torque / (rig.gearbox.ratio * rig.starting_torque(1.0))
        yield Comparison("static efficiency at rated load", "1", losses.static_efficiency, eta)
    if sheet.stiffness is not None:
        torques = sheet.stiffness.torques
        up_to = max(1.5 * (torques[-1] if torques else 0.0), rig.gearbox.rated_output_torque)
        measured = rig.stiffness(torques, up_to)
        for k, (printed, value) in enumerate(zip(sheet.stiffness.slopes, measured, strict=True)):
            yield Comparison(f"torsional stiffness K{k + 1}", "N·m/rad", printed, value)
    if sheet.backlash:
        first = sheet.stiffness.torques[0] if sheet.stiffness and sheet.stiffness.torques else 0.0
        value = rig.backlash(first or 0.5 * rig.gearbox.rated_output_torque)
        yield Comparison("backlash", "arcmin", ARCMIN * sheet.backlash, ARCMIN * value)
    if sheet.hysteresis_loss is not None:
        value = rig.loop(rig.gearbox.rated_output_torque).width
        yield Comparison("hysteresis loss", "arcmin", ARCMIN * sheet.hysteresis_loss, ARCMIN * value)
