"""A drive: a motor, a gearbox and a load, as frozen objects in SI units; a scenario file spells them word for word."""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import ClassVar

from .. import _core
from ..inputs.cached_values import kept
from ..inputs.named_elements import Named
from ..inputs.part import Part, rule
from .gear import Gear
from .gearbox import Gearbox
from .load import Load
from .losses import LossMap
from .motor import Motor, MotorLaw, ShaftMotor
from .shaft import Shaft
from .torsion import Rigid
from .train import DriveTrain


class DriveOfOneGear(DriveTrain):
    """The train of a drive, with the names that its variables have."""

    aliases: ClassVar[Mapping[str, str]] = dict(_core.aliases_of_drive())


class Drive(Part):
    """Motor, gearbox and load.

    Examples
    --------
    >>> import lostmotion as lm
    >>> drive = lm.Drive(motor=lm.motor("maxon-ec-i-52-606793"), gearbox=lm.gearbox("wittenstein-tp010-mf-10"), load=lm.Load(inertia=0.5))
    >>> drive.gearbox.ratio
    10.0
    """

    motor: Motor
    gearbox: Gearbox
    load: Load

    def __repr__(self) -> str:
        return f"Drive({self.motor!r}, {self.gearbox!r}, {self.load!r})"

    @rule
    def _can_be_simulated(self) -> Iterator[str]:
        if self.motor.rotor_inertia + self.gearbox.inertia <= 0.0:
            yield "has no inertia on the input shaft; give motor.rotor_inertia or gearbox.inertia"
        if isinstance(self.gearbox.stiffness, Rigid) and self._least_rigid_inertia() <= 0.0:
            yield (
                "jams: the gearbox is rigid and so lossy when overrunning that with this load inertia there are instants "
                "with no motion or several (the paradox of rigid friction); give gearbox.stiffness a compliance"
            )

    @kept
    def train(self) -> DriveTrain:
        """The same drive as a train: shafts `motor` and `load`, joined by the gear `gearbox`, and on the first the motor `motor`."""
        return DriveTrain.of_parts(
            shafts=Named({"motor": Shaft(), "load": Shaft.like(self.load)}),
            motors=Named({"motor": _motor_on_shaft(self.motor)}),
            gears=Named({"gearbox": _gear(self.gearbox)}),
        )

    @kept
    def named_train(self) -> DriveOfOneGear:
        """The same train, with the names that variables of a drive have."""
        return DriveOfOneGear.like(self.train())

    def core(self, law: MotorLaw | None = None) -> _core.Train:
        """The solver's train, its motor as a current loop may make it; the last ones are kept for equal parts."""
        return _core_drive(self, law)

    def _least_rigid_inertia(self) -> float:
        """The smallest inertia [kg·m²] of the rigidly coupled drive at its input, over all cells of a loss map.

        If it is not positive, rigid friction jams (Painlevé): there are instants with no motion or with several.
        """
        gearbox, losses = self.gearbox, self.gearbox.losses
        least = 1.0 + losses.core().least_slope_over_load() if isinstance(losses, LossMap) else 1.0 / losses.efficiency
        return self.motor.rotor_inertia + gearbox.inertia + least * self.load.inertia / (gearbox.ratio * gearbox.ratio)


@kept
def _motor_on_shaft(motor: Motor) -> ShaftMotor:
    return ShaftMotor.like(motor, shaft="motor")


@kept
def _gear(gearbox: Gearbox) -> Gear:
    return Gear.of(gearbox, input="motor", output="load")


@lru_cache(maxsize=16)  # each keeps the regimes of its runs, a few megabytes
def _core_drive(drive: Drive, law: MotorLaw | None) -> _core.Train:
    return drive.named_train().core(("load",), {"motor": law})
