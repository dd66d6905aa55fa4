"""Measurements of one gearbox on the rig."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..inputs.argument_checks import checked
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.self_locking import Overrunning, overrunning
from .comparison import Comparison, compare
from .torsion_loop import Loop
from .virtual_rig import TestRig

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")


@dataclass(frozen=True)
class RigReport:
    """Measurements of one gearbox."""

    gearbox: Gearbox
    map: xarray.Dataset  #: efficiency and loss torque, motor driving
    no_load: tuple[Any, Any]  #: input speeds [rad/s], torques [N·m]
    initial_loading: tuple[Any, Any] | None
    """twist [rad], torque [N·m] of the first loading; none of a rigid gearbox, which has no twist"""
    loops: tuple[Loop, ...]  #: at falling amplitudes, the largest at rated torque; none of a rigid gearbox
    starting_torque: float
    backdriving_torque: float | None
    lost_motion: float
    overrunning: Overrunning  #: at rated load and speed: whether it locks, by its losses
    comparisons: tuple[Comparison, ...] = field(default=())


# What the rig measures beside its comparisons: parts of rated speed, and relative loads.
SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
LOADS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5)
LOOPS = (1.0, 0.6, 0.3)
WORK = len(LOADS) + len(LOOPS) + 6  # how often `measure` reports progress


@checked
def measure(
    gearbox: Gearbox | Gear,
    sheet: GearboxSheet | None = None,
    notes: Iterable[str] = (),
    progress: Callable[[], None] = lambda: None,
) -> RigReport:
    """Measure all data of a gearbox that data sheets print.

    Parameters
    ----------
    gearbox : Gearbox or Gear
        The gearbox on the rig.
    sheet : GearboxSheet, optional
        Data to compare with.
    notes : iterable of str
        Notes from building the loss map; a contradiction among the data is added to them.
    progress : callable
        Called `WORK` times.

    Returns
    -------
    RigReport
        Measured values beside the values of the data sheet, and the curves.

    Raises
    ------
    InputError
        The gearbox cannot be measured. The message states the reason.

    Examples
    --------
    >>> import lostmotion as lm
    >>> report = lm.test_rig.measure(lm.gearbox("wittenstein-tp010-mf-10"))
    >>> f"{report.starting_torque:.3g} N·m"
    '0.64 N·m'
    """
    rig = TestRig(gearbox)
    gearbox = rig.gearbox
    T_2R, n_1R = gearbox.rated_output_torque, gearbox.rated_input_speed
    speeds = n_1R * np.array(SPEEDS)

    def done(measured: T) -> T:
        progress()
        return measured

    return RigReport(
        gearbox=gearbox,
        map=rig.efficiency_map(speeds, LOADS, progress),
        no_load=(speeds, done(np.array([rig.no_load_torque(n) for n in speeds]))),
        initial_loading=done(None if rig.rigid else rig.initial_loading_curve(1.2 * T_2R)),
        loops=tuple(done(rig.loop(share * T_2R)) for share in LOOPS if not rig.rigid),
        starting_torque=done(rig.starting_torque()),
        backdriving_torque=done(rig.backdriving_torque()),
        lost_motion=done(rig.lost_motion()),
        overrunning=overrunning(rig.gearbox),
        comparisons=done(() if sheet is None else tuple(compare(rig, sheet, tuple(notes)))),
    )
