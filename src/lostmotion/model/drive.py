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


PARAMETERS = tuple(key for key, _ in _core.parameters())
"""those that are plain numbers, as the core and a scenario file name them"""


def _number(drive: Drive, key: str) -> float | None:
    """The value of a parameter; None if the drive has no such law, or leaves the value out."""
    value: Any = drive
    for name in key.split("."):
        value = getattr(value, name, None)
    return None if value is None else float(value)


@lru_cache(maxsize=16)  # each keeps the regimes of its runs, a few megabytes
def _core_drive(drive: Drive) -> _core.Drive:
    g = drive.gearbox
    return _core.Drive(
        {key: value for key in PARAMETERS if (value := _number(drive, key)) is not None},
        torque_source=drive.motor.kind == "torque_source",
        torsion_curve=None if isinstance(g.stiffness, Rigid) else g.stiffness.core(),
        loss_map=g.losses.core() if isinstance(g.losses, LossMap) else None,
    )
