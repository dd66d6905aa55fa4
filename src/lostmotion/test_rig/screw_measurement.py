"""Measurements of one screw on the rig, beside the values of its data sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..data_sheets.linear_sheets import ScrewSheet
from ..inputs.argument_checks import checked
from ..inputs.quantities import Force
from ..model.screw import ScrewData
from ..units.practical import RPM
from .comparison import Comparison
from .screw_rig import RATED, ScrewRig
from .torsion_loop import Loop

T = TypeVar("T")

SHARES = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)  # of the load
TURNING = tuple(n / RPM for n in (30.0, 100.0, 300.0, 1000.0, 2000.0, 3000.0))  # [rad/s]
MOVING = 10.0  # [rad/s] at which the efficiency is measured
LOOPS = (1.0, 0.6, 0.3)
DEFAULT_LOAD = 1000.0  # [N] of a screw whose capacity is not known
WORK = 2 * len(SHARES) + len(TURNING) + len(LOOPS) + 6  # how often `measure_screw` reports progress


@dataclass(frozen=True)
class ScrewReport:
    """Measurements of one screw."""

    screw: ScrewData
    load: float  #: axial force that they refer to [N]
    efficiency: tuple[Any, Any, Any]
    """shares of the load, efficiency of the thread while the input drives, and while the slide does"""
    drag: tuple[Any, Any]  #: speeds of the screw [rad/s], torques without a load [N·m]
    first_loading: tuple[Any, Any] | None  #: deflection [m], force [N]; none of a rigid screw
    loops: tuple[Loop, ...]  #: deflection [m] over force [N] at falling amplitudes; none of a rigid screw
    stiffness: tuple[float, ...]  #: axial [N/m], of each segment; none of a rigid screw
    lost_motion: float  #: [m], at 3 % of the load
    pitch_error: float  #: [m], from peak to peak over a turn
    starting_torque: float  #: on the input against the load [N·m]
    backdriving_force: float | None  #: on the slide with a free input [N]; none: self-locking
    comparisons: tuple[Comparison, ...] = ()

    def drag_at(self, speed: float) -> float:
        """Drag torque [N·m] at a speed [rad/s]."""
        return float(np.interp(speed, *self.drag))


def rig_load(sheet: ScrewSheet | None) -> float:
    """The load of the rig where none is given [N]: a tenth of the dynamic capacity."""
    capacity = None if sheet is None else sheet.dynamic_capacity
    return DEFAULT_LOAD if capacity is None else 0.1 * capacity


@checked
def measure_screw(
    screw: ScrewData,
    sheet: ScrewSheet | None = None,
    *,
    load: Force | None = None,
    progress: Callable[[], None] = lambda: None,
) -> ScrewReport:
    """Measure a screw on the virtual rig: play, stiffness and lost motion, drag, efficiency, what starts it and drives it back.

    Parameters
    ----------
    screw
        Its values, such as the values of a scenario.
    sheet
        Data to compare with.
    load
        Axial force [N] that measurements refer to; left out, a tenth of the dynamic capacity of the sheet, or 1000 N.
    progress
        Called `WORK` times.

    Returns
    -------
    ScrewReport

    Raises
    ------
    InputError
        The load is not greater than 0.

    Examples
    --------
    >>> import lostmotion as lm
    >>> screw = lm.model.Screw(input="m", output="t", lead="10 mm", stiffness="200 N/um", backlash="5 um", efficiency=0.9)
    >>> report = lm.test_rig.measure_screw(screw)
    >>> [round(k / 1e6, 3) for k in report.stiffness], round(1e6 * report.lost_motion, 3)
    ([200.0], 5.3)
    """
    load = rig_load(sheet) if load is None else load
    rig = ScrewRig(screw, load=load)

    def done(measured: T) -> T:
        progress()
        return measured

    breaks = _forces_at_breaks(screw)
    report = ScrewReport(
        screw=screw,
        load=load,
        efficiency=(
            np.array(SHARES),
            np.array([done(rig.efficiency(MOVING, share)) for share in SHARES]),
            np.array([done(rig.efficiency(MOVING, -share)) for share in SHARES]),
        ),
        drag=(np.array(TURNING), np.array([done(rig.drag_torque(speed)) for speed in TURNING])),
        first_loading=done(None if rig.rigid else rig.initial_loading_curve(load)),
        loops=tuple(done(rig.loop(share * load)) for share in LOOPS if not rig.rigid),
        stiffness=tuple(done([] if rig.rigid else rig.stiffness(breaks, max(load, 1.5 * max(breaks, default=0.0))))),
        lost_motion=done(rig.lost_motion()),
        pitch_error=done(rig.pitch_error()),
        starting_torque=done(rig.starting_torque(1.0)),
        backdriving_force=done(rig.backdriving_torque()),
    )
    if sheet is None:
        return report
    return ScrewReport(**(vars(report) | {"comparisons": tuple(_compare(rig, report, sheet))}))


def _forces_at_breaks(screw: ScrewData) -> list[float]:
    """Forces at which the stiffness curve has its breaks, which say where the segments are measured."""
    curve = screw.stiffness_curve
    if curve is None or screw.preload > 0.0:
        return []
    forces, force, before = [], 0.0, 0.0
    for slope, deflection in zip(curve.slopes, curve.breaks, strict=False):
        force += slope * (deflection - before)
        forces.append(force)
        before = deflection
    return forces


def _compare(rig: ScrewRig, report: ScrewReport, sheet: ScrewSheet) -> Iterator[Comparison]:
    """Each datum of the sheet beside the same measured."""
    eta, back = report.efficiency[1][-1], report.efficiency[2][-1]
    if sheet.efficiency is not None:
        yield Comparison("efficiency at the load, the screw drives", "1", sheet.efficiency, float(eta))
    if sheet.backdriving_efficiency is not None and sheet.backdriving_efficiency > 0.0:
        yield Comparison("efficiency at the load, the slide drives", "1", sheet.backdriving_efficiency, float(back))
    if sheet.drag_torque > 0.0:
        viscous = "" if rig.screw.viscous_friction == 0.0 else "with viscous friction"
        changed = "" if rig.screw.drag_torque == sheet.drag_torque else "at another preload or drag"
        torque = rig.drag_torque(RATED)
        yield Comparison(f"drag torque at {RPM * RATED:.0f} rpm", "N·m", sheet.drag_torque, torque, viscous or changed)
    yield from _compliance(rig, report, sheet)


def _compliance(rig: ScrewRig, report: ScrewReport, sheet: ScrewSheet) -> Iterator[Comparison]:
    if not report.stiffness:
        return
    if sheet.stiffness_curve is not None:
        printed: Iterable[float] = sheet.stiffness_curve.slopes
    else:
        one = sheet.nut_stiffness if sheet.stiffness is None else sheet.stiffness
        printed = () if one is None else (one,)
    series = any(getattr(rig.screw, key) is not None for key in ("bearing_stiffness", "supported_length"))
    remark = "of the nut in series with screw and bearings" if series and sheet.stiffness is None else ""
    if not remark and sheet.nut_stiffness is not None and rig.screw.nut_stiffness != sheet.nut_stiffness:
        remark = "another stiffness or preload is given"
    for k, value in enumerate(printed):
        if k < len(report.stiffness):
            what = "axial stiffness" if sheet.stiffness_curve is None else f"axial stiffness, segment {k + 1}"
            yield Comparison(what, "N/µm", 1e-6 * value, 1e-6 * report.stiffness[k], remark)
    if sheet.backlash > 0.0:
        changed = "" if rig.screw.backlash == sheet.backlash else "another backlash is given"
        play = rig.backlash(next(iter(_forces_at_breaks(rig.screw)), report.load))
        yield Comparison("axial play", "µm", 1e6 * sheet.backlash, 1e6 * play, changed)
