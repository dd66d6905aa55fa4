"""The check of a gearbox: loads, speeds, lost motion, self-locking, range of the losses."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from ..model.gearbox import Gearbox, GearboxLimits, Transmission
from ..model.self_locking import self_locking
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from ..test_rig.virtual_rig import LOST_MOTION_LOAD, TestRig
from ..units.practical import ARCMIN, RPM
from .duty_cycle import DutyCycle
from .finding import Finding, within

if TYPE_CHECKING:
    from ..simulation.runs.results import RunArrays


def loads(g: Transmission, peak: float, cycle: DutyCycle, where: str = "gearbox") -> list[Finding]:
    """Mean and largest output torque, `peak` [N·m] being the latter. where: the table of the gearbox."""
    limits = g.limits or GearboxLimits()
    name = f"{'rated' if limits.average_output_torque is None else 'average'} output torque"
    most, key = limits.average_output_torque or g.rated_output_torque, f"{where}.rated_output_torque"
    what, mean = "output torque, cubic mean", cycle.mean_output_torque
    found = [within("average_output_torque", what, mean, most, "N·m", name, key=key, cycle=cycle)]
    what, key = "output torque, largest", f"{where}.limits.peak_output_torque"
    name = "repeated peak torque of the gearbox"
    largest = within("peak_output_torque", what, peak, limits.peak_output_torque, "N·m", name, key=key)
    return [*found, _with_momentary(largest, peak, limits.momentary_output_torque)]


def _with_momentary(finding: Finding, torque: float, momentary: float | None) -> Finding:
    """Adds the limit for emergency stops, where a repeated peak torque is exceeded or missing."""
    if momentary is None or finding.verdict == "ok":
        return finding
    if torque > momentary:
        remark = f"even the momentary torque of the gearbox, {momentary:.4g} N·m, is exceeded"
        return finding.noted(remark, verdict="warning")
    return finding.noted(f"in an emergency stop the gearbox stands {momentary:.4g} N·m")


def input_speeds(g: Transmission, cycle: DutyCycle, where: str = "gearbox") -> list[Finding]:
    """Mean and largest speed of the input."""
    limits = g.limits or GearboxLimits()
    average, largest = limits.average_input_speed or g.rated_input_speed, limits.max_input_speed
    return [
        within(
            "average_input_speed",
            "input speed, mean",
            RPM * cycle.mean_input_speed,
            average and RPM * average,
            "rpm",
            "average input speed" if limits.average_input_speed else "rated input speed",
            key=f"{where}.rated_input_speed",
            cycle=cycle,
        ),
        within(
            "max_input_speed",
            "input speed, largest, for the gearbox",
            RPM * cycle.peak_input_speed,
            largest and RPM * largest,
            "rpm",
            "largest speed of the gearbox",
            key=f"{where}.limits.max_input_speed",
        ),
    ]


def locks(train: DriveTrain, gear: str, torques: Collection[float]) -> list[Finding]:
    """The verdict on a gear that locks or whose motion under its load is unstable, for each load torque [N·m] at its output."""
    verdicts = [self_locking(train, gear, torque) for torque in torques]
    return [
        Finding(
            "self_locking",
            f"lowering {v.overrunning.load_torque:.4g} {'N' if v.moves_slide else 'N·m'} on {v.gear}",
            v.brief,
            "ok" if v.lowering == "smooth" else "warning",
            v.remedy,
        )
        for v in verdicts
        if v.notable
    ]


def lost_motion(g: Gearbox, limit: float | None, *, slides: bool = False) -> Finding:
    """limit: of the task [rad], of a slide [m]. What is taken as rigid has none, which says nothing of what is built."""
    what = f"lost motion at ±{100.0 * LOST_MOTION_LOAD:.0f} % of rated torque"
    if isinstance(g.stiffness, Rigid):
        why = f"{'the axis' if slides else 'the gearbox'} is taken as rigid, without backlash; give a stiffness"
        return Finding("lost_motion", what, "not known", "unknown", why)
    lost = TestRig(g).lost_motion()
    factor, unit = (1e6, "um") if slides else (ARCMIN, "arcmin")
    maximum = None if limit is None else factor * limit
    return within("lost_motion", what, factor * lost, maximum, unit, "limit of the task", key="task.max_lost_motion")


def loss_map(result: RunArrays) -> Finding:
    """Whether the run left the data of a loss map."""
    if "warning" in result.attrs:
        return Finding("loss_map", "loss map", "used outside its data", "caution", result.attrs["warning"])
    return Finding("loss_map", "loss map", "used within its data", "ok")
