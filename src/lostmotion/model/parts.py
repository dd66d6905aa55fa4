"""The parts of a drive, as frozen objects in SI units; a scenario file spells them word for word."""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from .. import _core
from ..errors import InputError
from ..inputs.part import Part
from ..inputs.quantities import (
    Angle,
    Current,
    Inertia,
    Limit,
    NotNegative,
    Number,
    Positive,
    Resistance,
    Speed,
    Stiffness,
    Switch,
    Temperature,
    ThermalResistance,
    Time,
    Torque,
    TorqueConstant,
    ViscousFriction,
    Voltage,
    argument,
)
from ..units.practical import practical

MAX_PIECES = 100  # of a torsion curve, on each side


class MotorLimits(Part):
    """What a motor can stand. No run depends on it; the drive check compares with it."""

    continuous_torque: Annotated[Torque, Positive] | None = None
    max_speed: Annotated[Speed, Positive] | None = None
    resistance: Annotated[Resistance, Positive] | None = None
    """of the winding, at 25 °C"""
    torque_constant: Annotated[TorqueConstant, Positive] | None = None
    thermal_resistance: Annotated[ThermalResistance, Positive] | None = None
    """winding to ambient"""
    max_winding_temperature: Temperature | None = None
    max_voltage: Annotated[Voltage, Positive] | None = None
    """of the amplifier of a torque source; of a DC motor `voltage_limit` says it"""
    max_current: Annotated[Current, Positive] | None = None
    """the smaller of those of motor and amplifier"""


# Keys of `[motor]` that a torque source has no use for.
DC_KEYS = (
    "rated_speed",
    "rated_voltage",
    "electrical_time_constant",
    "armature_voltage_constant",
    "voltage_limit",
)


class Motor(Part):
    """DC motor with servo amplifier (eq. 2), or a torque source in its place."""

    kind: Literal["dc", "torque_source"] = "dc"
    """`torque_source`: the command times `rated_torque` acts on the rotor without delay"""
    rotor_inertia: Annotated[Inertia, NotNegative]
    """J_M"""
    friction_torque: Annotated[Torque, NotNegative] = 0.0
    """T_10, dry friction of the bearings"""
    rated_torque: Annotated[Torque, Positive] = 1.0
    """M_DR"""
    rated_speed: Annotated[Speed, Positive] | None = None
    """omega_DR"""
    rated_voltage: Annotated[Voltage, Positive] | None = None
    """u_ZR, that of command 1. A change over a record or a base, by `--set` or in a study is the same motor at another voltage: rated_speed and
    armature_voltage_constant follow so that stall torque and no-load speed go with the voltage, unless they are given too"""
    electrical_time_constant: Annotated[Time, Positive] | None = None
    """tau_a"""
    armature_voltage_constant: Annotated[Number, Limit(gt=1.0)] | None = None
    """k_N, stall torque / rated torque at rated voltage"""
    voltage_limit: Annotated[Voltage, Positive] | None = None
    """largest voltage of the amplifier"""
    limits: MotorLimits | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.kind == "dc":
            for key in ("rated_speed", "electrical_time_constant", "armature_voltage_constant"):
                if getattr(self, key) is None:
                    raise ValueError(f'lacks {key}, which a motor of kind "dc" needs')
        else:
            idle = [key for key in DC_KEYS if getattr(self, key) is not None]
            if idle:
                raise ValueError(
                    f"has {', '.join(idle)}, of no use to a torque_source; leave {'it' if len(idle) == 1 else 'them'} out"
                )
        if self.voltage_limit is not None:
            if self.rated_voltage is None:
                raise ValueError("has a voltage_limit, which also needs rated_voltage")
            if self.limits is not None and self.limits.max_voltage is not None:
                raise ValueError("has voltage_limit and limits.max_voltage, which say the same of a DC motor; give one")
        return self

    def __repr__(self) -> str:
        if self.rated_speed is None:
            rated = f"torque source, rated {self.rated_torque:.4g} N·m"
        else:
            rated = f"dc, {self.rated_torque:.4g} N·m at {practical(self.rated_speed, 'rad/s', 4)}"
        return f"Motor({rated}, rotor {self.rotor_inertia:.4g} kg·m²)"

    @property
    def no_load_speed(self) -> float:
        """Speed [rad/s] at command 1 without any load or friction, by (2)."""
        if self.rated_speed is None or self.armature_voltage_constant is None:
            raise InputError("a torque source has no speed of its own")
        return self.rated_speed * self.armature_voltage_constant / (self.armature_voltage_constant - 1.0)

    def at_voltage(self, voltage: float) -> Self:
        """The same DC motor where command 1 is another voltage [V].

        Stall torque M_DR k_N and no-load speed omega_DR k_N/(k_N - 1) of (2) go with the voltage; the rated torque, which is
        a matter of heat, and the time constant stay.

        Raises
        ------
        InputError
            The motor has no rated voltage, or at this voltage it does not reach its rated torque.
        """
        voltage = argument("voltage", voltage, "V")
        if self.rated_voltage is None or self.armature_voltage_constant is None:
            raise InputError("a motor needs a rated_voltage to be taken to another one; give it")
        share = voltage / self.rated_voltage
        k_N = share * self.armature_voltage_constant
        if not k_N > 1.0:
            minimum = self.rated_voltage / self.armature_voltage_constant
            raise InputError(
                f"{voltage:g} V must be above {minimum:.4g} V, at which the motor stalls under its rated torque; "
                "or give rated_speed and armature_voltage_constant too"
            )
        speed = share * self.no_load_speed * (k_N - 1.0) / k_N
        return self.model_copy(
            update={"rated_voltage": voltage, "armature_voltage_constant": k_N, "rated_speed": speed}
        )


class TorsionCurve(Part):
    """Torque against twist (eq. 14): odd, continuous, piecewise linear.

    `backlash` (total gap at the output) and `preload` change the given segments: a gap of half the backlash comes
    before the first, or the segments below the preload torque drop out, as where two flanks are pressed together.
    """

    kind: Literal["curve"] = "curve"
    slopes: tuple[Annotated[Stiffness, NotNegative], ...] = Field(min_length=1, max_length=MAX_PIECES)
    """of the segments, from twist 0 outwards"""
    breaks: tuple[Annotated[Angle, Positive], ...] = ()
    """breakpoints: twists at which the slope changes; one fewer than slopes"""
    backlash: Annotated[Angle, NotNegative] = 0.0
    preload: Annotated[Torque, NotNegative] = 0.0

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        if len(self.breaks) != len(self.slopes) - 1:
            raise ValueError(f"has {len(self.slopes)} slopes and {len(self.breaks)} breaks; it needs one break fewer")
        for k, (a, b) in enumerate(itertools.pairwise(self.breaks)):
            if b <= a:
                raise ValueError(f"breaks must rise, but breaks[{k + 1}] = {b} follows {a}")
        if self.slopes[-1] <= 0.0:
            raise ValueError("ends with slope 0; the last segment must carry torque")
        if self.backlash > 0.0 and self.preload > 0.0:
            raise ValueError("has backlash and preload; a preload removes the backlash, so give only one")
        return self

    def pieces(self) -> tuple[list[float], list[float]]:
        """(breaks [rad], slopes [N·m/rad]) with backlash and preload worked in."""
        breaks, slopes = list(self.breaks), list(self.slopes)
        if self.backlash > 0.0:
            gap = 0.5 * self.backlash
            return [gap, *(gap + b for b in breaks)], [0.0, *slopes]
        if self.preload > 0.0:
            torque, previous = 0.0, 0.0
            for k, b in enumerate([*breaks, math.inf]):
                rise = slopes[k] * (b - previous)
                if torque + rise >= self.preload:
                    start = previous + (self.preload - torque) / slopes[k] if slopes[k] > 0.0 else b
                    return [x - start for x in breaks[k:] if x > start], slopes[k if b > start else k + 1 :]
                torque, previous = torque + rise, b
        return breaks, slopes

    def core(self) -> _core.TorsionCurve:
        return _core.TorsionCurve(*self.pieces())

    def torque(self, twist: float) -> float:
        """P(d) [N·m] at the twist [rad]."""
        return self.core().torque(argument("twist", twist, "rad"))


class LinearStiffness(Part):
    """One stiffness for all twists (5a)."""

    kind: Literal["linear"] = "linear"
    stiffness: Annotated[Stiffness, Positive]

    def pieces(self) -> tuple[list[float], list[float]]:
        """(breaks [rad], slopes [N·m/rad]): no break, one slope."""
        return [], [self.stiffness]

    def core(self) -> _core.TorsionCurve:
        return _core.TorsionCurve(*self.pieces())


class Rigid(Part):
    """No twist at all (7)."""

    kind: Literal["rigid"] = "rigid"


class Hysteresis(Part):
    """Turning-point hysteresis (16)."""

    efficiency: Annotated[Number, Limit(gt=0.0, le=1.0)]
    """eta_H, average efficiency of the hysteresis process; 1: none"""


class ConstantEfficiency(Part):
    """T_1 = T_2/(i eta) in both directions of power flow (5b), so it creates energy while the load drives."""

    kind: Literal["constant_efficiency"] = "constant_efficiency"
    efficiency: Annotated[Number, Limit(gt=0.0, le=1.0)]


class LossMap(Part):
    """Loss coefficient m_2B over relative speed and signed relative load (12), linear on triangles."""

    kind: Literal["map"] = "map"
    speeds: tuple[Annotated[Number, NotNegative], ...] = Field(min_length=2)
    """v = |w_M|/n_1R, rising from 0"""
    loads: tuple[Number, ...] = Field(min_length=2)
    """mu = T_2 sign(w_M)/T_2R, rising; positive where the motor drives"""
    values: tuple[tuple[Annotated[Number, NotNegative], ...], ...]
    """m_2B, one row for each load, one entry for each speed"""
    mirrored: Switch = False
    """loads begin at 0 and hold for both directions of power flow"""

    @field_validator("speeds", "loads")
    @classmethod
    def _rising(cls, axis: tuple[float, ...]) -> tuple[float, ...]:
        for k, (a, b) in enumerate(itertools.pairwise(axis)):
            if b <= a:
                raise ValueError(f"must rise, but entry {k + 1} is {b} after {a}")
        return axis

    @model_validator(mode="after")
    def _is_a_map(self) -> Self:
        if self.speeds[0] != 0.0:
            raise ValueError(f"has speeds that begin at {self.speeds[0]}; the first must be 0, for sticking")
        if len(self.values) != len(self.loads):
            raise ValueError(
                f"has {len(self.values)} rows of values for {len(self.loads)} loads; it needs one for each"
            )
        for j, row in enumerate(self.values):
            if len(row) != len(self.speeds):
                raise ValueError(
                    f"has a hole: row {j} (load {self.loads[j]}) has {len(row)} values for {len(self.speeds)} speeds"
                )
        if self.mirrored and self.loads[0] != 0.0:
            raise ValueError(f"is mirrored, so its loads must begin at 0, not {self.loads[0]}")
        if not self.mirrored and not self.loads[0] < 0.0 < self.loads[-1]:
            raise ValueError(
                "covers only one direction of power flow; add loads of the other sign or set mirrored = true"
            )
        return self

    def whole(self) -> tuple[list[float], list[float], list[list[float]]]:
        """(speeds, loads, values[load][speed]) with both signs of the load."""
        loads, values = list(self.loads), [list(row) for row in self.values]
        if self.mirrored:
            loads = [-x for x in reversed(loads[1:])] + loads
            values = list(reversed(values[1:])) + values
        return list(self.speeds), loads, values

    def core(self) -> _core.LossMap:
        speeds, loads, values = self.whole()
        return _core.LossMap(speeds, loads, [x for row in values for x in row])


class GearboxLimits(Part):
    """What a gearbox can stand. No run depends on it; the drive check compares with it."""

    average_output_torque: Annotated[Torque, Positive] | None = None
    peak_output_torque: Annotated[Torque, Positive] | None = None
    """repeated, as in acceleration"""
    momentary_output_torque: Annotated[Torque, Positive] | None = None
    """in an emergency stop"""
    average_input_speed: Annotated[Speed, Positive] | None = None
    """for the mean over a duty cycle; left out, the rated speed stands in for it"""
    max_input_speed: Annotated[Speed, Positive] | None = None


class Gearbox(Part):
    """A compliance and a loss law, each chosen freely."""

    ratio: Annotated[Number, Positive]
    """i_C, input speed / output speed"""
    inertia: Annotated[Inertia, NotNegative] = 0.0
    """J_R, on the input shaft"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    """b_MR, on the input shaft"""
    rated_input_speed: Annotated[Speed, Positive]
    """n_1R"""
    rated_output_torque: Annotated[Torque, Positive]
    """T_2R"""
    stiffness: Annotated[TorsionCurve | LinearStiffness | Rigid, Field(discriminator="kind")]
    hysteresis: Hysteresis | None = None
    losses: Annotated[ConstantEfficiency | LossMap, Field(discriminator="kind")]
    limits: GearboxLimits | None = None
    note: str = ""
    """what a reader of the results must know, such as that a loss table is a stand-in"""

    def __repr__(self) -> str:
        laws = f"stiffness {self.stiffness.kind}, losses {self.losses.kind}"
        rated = f"{self.rated_output_torque:.4g} N·m at {practical(self.rated_input_speed, 'rad/s', 4)}"
        return f"Gearbox({self.ratio:g}:1, {rated}, {laws})"

    @model_validator(mode="after")
    def _hysteresis_needs_compliance(self) -> Self:
        if self.hysteresis is not None and self.hysteresis.efficiency < 1.0 and isinstance(self.stiffness, Rigid):
            raise ValueError("has hysteresis but is rigid; leave hysteresis out or give it a stiffness")
        return self


class Load(Part):
    """The driven body (3b)."""

    def __repr__(self) -> str:
        return f"Load({self.inertia:.4g} kg·m²)"

    inertia: Annotated[Inertia, Positive]
    """J_Z"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    """b_ZR"""
    friction_torque: Annotated[Torque, NotNegative] = 0.0
    """dry friction of the bearing"""


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
