"""The losses of a gearbox."""

import itertools
import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator

from .. import _core
from ..inputs.breakpoints import check_apart
from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, Length, Limit, NotNegative, Number, Positive, Switch, UpToOne, Whole
from ..recorded_numbers import of_function
from ..reproducible import arctan


class ConstantEfficiency(Part):
    """T_1 = T_2/(i eta) in both directions of power flow (5b), so it creates energy while the load drives."""

    efficiency: Annotated[Number, UpToOne]
    """output power over input power, whichever side drives"""
    kind: Literal["constant_efficiency"] = "constant_efficiency"

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core of a gear with these losses."""
        return {"losses.efficiency": self.efficiency}


class LossMap(Part):
    """Loss coefficient m_2B over relative speed and signed relative load (12), linear on triangles.

    The gearbox loses m_2B times its rated torque at the output. Without load m_2B is the no-load torque, ratio T_1/T_2R. At
    an efficiency eta it is mu (1/eta - 1).

    Examples
    --------
    A map of your own, from the no-load torque [N·m] at the input and efficiencies at half and at rated load, each at rest, at
    half and at the rated speed:

    >>> import lostmotion as lm
    >>> drive = lm.load("paper-2dof-nl-large")
    >>> no_load, efficiency = (0.008, 0.010, 0.012), {0.5: (0.85, 0.84, 0.82), 1.0: (0.91, 0.90, 0.89)}
    >>> rows = [[drive.gearbox.ratio * torque / drive.gearbox.rated_output_torque for torque in no_load]]
    >>> rows += [[load * (1.0 / eta - 1.0) for eta in row] for load, row in efficiency.items()]
    >>> own = lm.model.LossMap(speeds=(0.0, 0.5, 1.0), loads=(0.0, *efficiency), values=rows, mirrored=True)
    >>> result = lm.simulate(drive.replace(**{"gearbox.losses": own}))
    >>> print(f"{lm.energy_of(result)['gear_losses']:.1f} J in the gearbox, {lm.energy_of(lm.simulate(drive))['gear_losses']:.1f} J before")
    22.8 J in the gearbox, 20.4 J before
    """

    speeds: Annotated[tuple[Annotated[Number, NotNegative], ...], Field(min_length=2)]
    """v = |w_M|/n_1R, rising from 0"""
    loads: Annotated[tuple[Number, ...], Field(min_length=2)]
    """mu = T_2 sign(w_M)/T_2R, rising; positive where the motor drives"""
    values: tuple[tuple[Annotated[Number, NotNegative], ...], ...]
    """m_2B, one row for each load, one entry for each speed"""
    mirrored: Switch = False
    """loads begin at 0 and hold for both directions of power flow"""
    kind: Literal["map"] = "map"

    @field_validator("speeds", "loads")
    @classmethod
    def _rising(cls, axis: tuple[float, ...]) -> tuple[float, ...]:
        for k, (a, b) in enumerate(itertools.pairwise(axis)):
            if b <= a:
                raise ValueError(f"must rise, but entry {k + 1} is {b} after {a}")
        check_apart(axis)
        return axis

    @rule
    def _is_a_map(self) -> Iterator[str]:
        if self.speeds[0] != 0.0:
            yield f"has speeds that begin at {self.speeds[0]}; the first must be 0, for sticking"
        if len(self.values) != len(self.loads):
            yield f"has {len(self.values)} rows of values for {len(self.loads)} loads; it needs one for each"
        for j, row in enumerate(self.values):
            if len(row) != len(self.speeds):
                yield f"has a hole: row {j} (load {self.loads[j]}) has {len(row)} values for {len(self.speeds)} speeds"
        if self.mirrored and self.loads[0] != 0.0:
            yield f"is mirrored, so its loads must begin at 0, not {self.loads[0]}; for a map of both directions set mirrored = false"
        if not self.mirrored and not self.loads[0] < 0.0 < self.loads[-1]:
            yield "covers only one direction of power flow; add loads of the other sign or set mirrored = true"

    def whole(self) -> tuple[list[float], list[float], list[list[float]]]:
        """(speeds, loads, values[load][speed]) with both signs of the load."""
        loads, values = list(self.loads), [list(row) for row in self.values]
        if self.mirrored:
            loads = [-x for x in reversed(loads[1:])] + loads
            values = list(reversed(values[1:])) + values
        return list(self.speeds), loads, values

    def scaled(self, factor: float) -> Self:
        """All losses multiplied by `factor`."""
        values = tuple(tuple(factor * x for x in row) for row in self.values)
        return self.model_copy(update={"values": values})

    def core(self) -> _core.LossMap:
        speeds, loads, values = self.whole()
        return _core.LossMap(speeds, loads, [x for row in values for x in row])

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core of a gear with these losses."""
        return {"losses": "loss_map", "loss_map": self.core()}


def efficiency_map(eta_f: float, eta_b: float) -> LossMap:
    """An efficiency for each direction of power flow as a loss map: the same losses at all loads and speeds."""
    overrunning, driving = 1.0 - eta_b, 1.0 / eta_f - 1.0
    values = ((overrunning, overrunning), (0.0, 0.0), (driving, driving))
    return LossMap(speeds=(0.0, 1.0), loads=(-1.0, 0.0, 1.0), values=values)


def worm_efficiencies(lead_angle: float, friction_angle: float) -> tuple[float, float]:
    """(eta_f, eta_b) of a worm or a screw."""
    driving, overrunning = (
        of_function(
            f"worm_{name}", lambda *angles, k=k: _core.worm_efficiencies(*angles)[k], lead_angle, friction_angle
        )
        for k, name in enumerate(("driving", "overrunning"))
    )
    return driving, overrunning


class TwoEfficiencies(Part):
    """Losses with an efficiency for each direction of power flow."""

    def efficiencies(self) -> tuple[float, float]:
        """(eta_f, eta_b)."""
        raise NotImplementedError

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core of a gear with these losses."""
        return {"efficiencies": dict(zip(("driving", "overrunning"), self.efficiencies(), strict=True))}


class MeshEfficiency(TwoEfficiencies):
    """An efficiency for each direction of power flow, as printed for worm gears. Only in drive trains."""

    drive_efficiency: Annotated[Number, UpToOne]
    """eta_f, while the input drives"""
    backdrive_efficiency: Annotated[Number, Limit(le=1.0)]
    """eta_b, while the output drives; 0 or less: self-locking"""
    kind: Literal["mesh_efficiency"] = "mesh_efficiency"

    def efficiencies(self) -> tuple[float, float]:
        """(eta_f, eta_b)."""
        return self.drive_efficiency, self.backdrive_efficiency


class WormMesh(TwoEfficiencies):
    """A worm and its wheel with friction: eta_f = tan g/tan(g + r), eta_b = tan(g - r)/tan g. Only in drive trains.

    The lead angle g is given, or follows from module, number of starts and reference diameter of the worm. The
    friction angle r is given, or follows from the coefficient of friction. It is self-locking where g < r.
    """

    lead_angle: Annotated[Angle, Positive] | None = None
    """g, at the reference diameter"""
    module: Annotated[Length, Positive] | None = None
    """axial module m"""
    starts: Annotated[Whole, Field(ge=1, le=20)] | None = None
    """threads z of the worm"""
    diameter: Annotated[Length, Positive] | None = None
    """reference diameter d of the worm; tan g = m z/d"""
    friction_angle: Annotated[Angle, NotNegative] | None = None
    """r"""
    friction_coefficient: Annotated[Number, NotNegative] | None = None
    """in the mesh; r is its arc tangent"""
    kind: Literal["worm"] = "worm"

    @rule
    def _is_a_worm(self) -> Iterator[str]:
        geometry = ("module", "starts", "diameter")
        given = [key for key in geometry if getattr(self, key) is not None]
        if self.lead_angle is not None and given:
            yield f"has lead_angle and {', '.join(given)}, which say the same; give one or the other"
        if self.lead_angle is None and len(given) < len(geometry):
            lacking = ", ".join(key for key in geometry if key not in given)
            yield f"lacks {lacking if given else 'lead_angle, or module, starts and diameter'}; add it"
        if (self.friction_angle is None) == (self.friction_coefficient is None):
            says = "lacks" if self.friction_angle is None else "has both"
            yield f"{says} friction_angle and friction_coefficient; give one of them"
        g, r = self.angles()
        if not g + r < 0.5 * math.pi:
            yield (
                f"has a lead angle of {math.degrees(g):.4g} deg and a friction angle of {math.degrees(r):.4g} deg; "
                "their sum must be below 90 deg, or nothing could drive it"
            )

    def angles(self) -> tuple[float, float]:
        """(lead angle, friction angle) [rad]."""
        g, r = self.lead_angle, self.friction_angle
        if g is None:
            g = arctan(self.module * self.starts / self.diameter)  # type: ignore[operator]
        if r is None:
            r = arctan(self.friction_coefficient)  # type: ignore[arg-type]
        return g, r

    def efficiencies(self) -> tuple[float, float]:
        """(eta_f, eta_b)."""
        return worm_efficiencies(*self.angles())
