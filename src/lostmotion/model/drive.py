"""A drive: a motor, a gearbox and a load, as frozen objects in SI units; a scenario file spells them word for word."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Self

from pydantic import model_validator

from .. import _core
from ..inputs.part import Part
from .gearbox import Gearbox
from .load import Load
from .losses import LossMap
from .motor import Motor
from .torsion import Rigid


class Drive(Part):
    """Motor, gearbox and load."""

    motor: Motor
    gearbox: Gearbox
    load: Load

    def __repr__(self) -> str:
        return f"Drive({self.motor!r}, {self.gearbox!r}, {self.load!r})"

    @model_validator(mode="after")
    def _can_be_simulated(self) -> Self:
        if self.motor.rotor_inertia + self.gearbox.inertia <= 0.0:
            raise ValueError("has no inertia on the input shaft; give motor.rotor_inertia or gearbox.inertia")
        if isinstance(self.gearbox.stiffness, Rigid) and _core_drive(self).smallest_rigid_inertia() <= 0.0:
            raise ValueError(
                "jams: the gearbox is rigid and so lossy when overrunning that with this load inertia there are instants "
                "with no motion or several (the paradox of rigid friction); give gearbox.stiffness a compliance"
            )
        return self

    def core(self) -> _core.Drive:
        """The solver's drive; the last ones are kept for equal parts."""
        return _core_drive(self)


def _plain(part: Any, *names: str) -> dict[str, float]:
    return {name: value for name in names if (value := getattr(part, name)) is not None}


@lru_cache(maxsize=16)  # each keeps the regimes of its runs, a few megabytes
def _core_drive(drive: Drive) -> _core.Drive:
    m, g, b = drive.motor, drive.gearbox, drive.load
    motor, gearbox, load = _core.Motor(), _core.Gearbox(), _core.Load()
    motor.torque_source = m.kind == "torque_source"
    values = _plain(
        m,
        "rotor_inertia",
        "friction_torque",
        "rated_torque",
        "rated_speed",
        "electrical_time_constant",
        "armature_voltage_constant",
    )
    for name, value in values.items():
        setattr(motor, name, value)
    if m.voltage_limit is not None and m.rated_voltage is not None:
        motor.voltage_limit = m.voltage_limit / m.rated_voltage
    for name in ("ratio", "inertia", "viscous_friction", "rated_input_speed", "rated_output_torque"):
        setattr(gearbox, name, getattr(g, name))
    if not isinstance(g.stiffness, Rigid):
        gearbox.set_torsion_curve(g.stiffness.core())
    if g.hysteresis is not None:
        gearbox.hysteresis_efficiency = g.hysteresis.efficiency
    if isinstance(g.losses, LossMap):
        gearbox.set_loss_map(g.losses.core())
    else:
        gearbox.efficiency = g.losses.efficiency
    for name in ("inertia", "viscous_friction", "friction_torque"):
        setattr(load, name, getattr(b, name))
    return _core.Drive(motor, gearbox, load)
