"""Drives that are one record: an actuator, and a linear motor as a motor and a gearbox of ratio 1 in units of translation."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

from ..data_sheets.components import actuator
from ..data_sheets.linear_components import linear_table
from ..data_sheets.linear_sheets import FORCE_SOURCE, LinearMotorSheet
from ..data_sheets.records import find
from ..inputs.quantities import Length, Positive
from ..model.gearbox import Gearbox
from ..model.gears_in_series import DIRECT
from ..model.linear_motor import LinearMotorData
from ..model.motor import Motor, MotorLimits
from ..model.synchronous_motor import Winding

LINEAR = ("linear_motor",)  # kinds of records that move a slide themselves
WHOLE = (*LINEAR, "actuator")  # kinds of records that need no gearbox and no stage
BESIDE: dict[str, tuple[str, ...]] = {
    "actuator": ("rotor_inertia", "efficiency"),
    "linear_motor": ("mass", "rated_force", "peak_force", "force_constant", "friction_force"),
}
"""keys of a task beside such a record"""


class LinearWinding(Winding):
    """Winding of a linear motor, as for a rotary one, to 1 m of travel in place of 1 rad.

    With the pole pitch tau the electrical angle is pi x/tau, so that pi/tau stands for the pole pairs.
    """

    pole_pitch: Annotated[Length, Positive]  #: half of a magnetic period

    def _check_poles(self) -> None:
        """It has a pitch in place of poles."""

    def _pairs(self) -> float:
        return math.pi / self.pole_pitch


def whole_drive(kind: str, name: str, beside: Mapping[str, Any], guide_friction: float) -> tuple[Motor, Gearbox]:
    """Motor and gearbox of a record of one of the kinds `WHOLE`.

    beside: values of the task that replace the record's values.
    guide_friction: friction coefficient of the guide of a slide, on which the attraction of a linear motor acts.

    Raises InputError: the record lacks what a run needs.
    """
    if kind == "actuator":
        return actuator(name, **beside)
    sheet = find(name, kind)
    assert isinstance(sheet, LinearMotorSheet)
    data = LinearMotorData(**linear_table(kind, name, beside, kind))
    return force_source(sheet, data, guide_friction), DIRECT


def force_source(sheet: LinearMotorSheet, data: LinearMotorData, guide_friction: float) -> Motor:
    """The source of force that stands for a linear motor: mass for inertia [kg], force for torque [N].

    With force constant, resistance, inductance and pole pitch it has a winding, so that voltage, current and heat are known.
    """
    rated, peak = data.forces()
    limits: dict[str, Any] = {
        "continuous_torque": rated,
        "peak_torque": peak if math.isfinite(peak) else None,
        "max_speed": sheet.max_speed,
    }
    winding = None
    if sheet.level() == FORCE_SOURCE:
        limits |= {"torque_constant": data.force_constant, "max_current": sheet.peak_current}
    else:
        assert sheet.pole_pitch is not None
        winding = LinearWinding(
            pole_pitch=sheet.pole_pitch,
            resistance_line_to_line=sheet.resistance,
            inductance_line_to_line=sheet.inductance,
            torque_constant_rms=data.force_constant,
            max_current_rms=sheet.peak_current,
        )
    return Motor(
        kind="torque_source",
        rotor_inertia=data.mass,
        friction_torque=data.friction_force + guide_friction * (sheet.attraction_force or 0.0),
        rated_torque=rated,
        winding=winding,
        dc_voltage=None if winding is None else sheet.dc_voltage,
        limits=MotorLimits(**limits),
        note=str(sheet.note),
    )
