"""Data sheets: what manufacturers print of gearboxes and motors, with units, sources and gaps."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ..errors import InputError
from ..inputs.part import Part
from ..inputs.quantities import (
    Angle,
    Current,
    Inductance,
    Inertia,
    KinematicViscosity,
    Limit,
    NotNegative,
    Number,
    Positive,
    Resistance,
    Speed,
    Stiffness,
    Temperature,
    ThermalResistance,
    Time,
    Torque,
    TorqueConstant,
    ViscousFriction,
    Voltage,
)
from ..model.parts import GearboxLimits, Hysteresis, LinearStiffness, LossMap, Motor, MotorLimits, TorsionCurve

Efficiency = Annotated[Number, Limit(gt=0.0, le=1.0)]
# Figures of a gearbox that `[gearbox]` has too, under the same names.
SCALARS = ("ratio", "inertia", "viscous_friction", "rated_input_speed", "rated_output_torque")


class Source(Part):
    """Where figures come from."""

    figures: tuple[str, ...]
    """keys of the record that it covers"""
    status: Literal["maker", "transcription", "inferred"]
    """read in the manufacturer's own text, in somebody's transcription of it, or concluded from other figures"""
    text: str


class Gap(Part):
    """A figure that the record lacks."""

    figure: str
    where: str
    """where one would read it"""


class EfficiencyPoint(Part):
    """Efficiency at one speed and load."""

    input_speed: Annotated[Speed, Positive]
    load: Annotated[Number, Positive] = 1.0
    """output torque / rated output torque"""
    efficiency: Efficiency
    temperature: Temperature | None = None


class NoLoadPoint(Part):
    """Torque at the input shaft that turns the unloaded gearbox."""

    input_speed: Annotated[Speed, Positive]
    torque: Annotated[Torque, NotNegative]
    temperature: Temperature | None = None


class Lubricant(Part):
    """Kinematic viscosity at two temperatures, as lubricants are specified."""

    viscosity_40: Annotated[KinematicViscosity, Positive]
    viscosity_100: Annotated[KinematicViscosity, Positive]

    @model_validator(mode="after")
    def _thins(self) -> Self:
        if self.viscosity_100 >= self.viscosity_40:
            raise ValueError(
                f"has viscosity_100 = {self.viscosity_100} m^2/s, not below viscosity_40; oil thins when hot"
            )
        return self

    def viscosity(self, temperature: float) -> float:
        """Kinematic viscosity [m^2/s] at a temperature [°C], by Ubbelohde and Walther (ASTM D341)."""

        def w(nu: float) -> float:
            return math.log10(math.log10(nu * 1e6 + 0.7))

        t40, t100 = math.log10(313.15), math.log10(373.15)
        slope = (w(self.viscosity_100) - w(self.viscosity_40)) / (t100 - t40)
        exponent = w(self.viscosity_40) + slope * (math.log10(temperature + 273.15) - t40)
        return float(10.0 ** (10.0**exponent) - 0.7) * 1e-6


class LossFigures(Part):
    """All that a data sheet may say about losses. Torques at the input shaft unless said otherwise."""

    efficiency: tuple[EfficiencyPoint, ...] = ()
    """while the motor drives"""
    load_correction: tuple[tuple[Annotated[Number, Positive], Annotated[Number, Positive]], ...] = ()
    """(load, factor on the efficiency at rated load), for manufacturers who print one efficiency and a curve of factors"""
    backdrive_efficiency: tuple[EfficiencyPoint, ...] = ()
    """while the load drives"""
    no_load_torque: tuple[NoLoadPoint, ...] = ()
    starting_torque: Annotated[Torque, Positive] | None = None
    """at the input, breaks the unloaded gearbox loose"""
    starting_temperature: Temperature | None = None
    backdriving_torque: Annotated[Torque, Positive] | None = None
    """at the output, breaks the gearbox with a free input loose"""
    backdriving_temperature: Temperature | None = None
    static_efficiency: Efficiency | None = None
    """when breaking loose under load, as printed for worm gears"""
    temperature: Temperature = 20.0
    """of all figures that name no other"""
    lubricant: Lubricant | None = None
    static_load_factor: Annotated[Number, Positive] = 1.2
    """load-dependent loss at standstill / that in motion, where no static or back-driving figure says it"""
    table: LossMap | None = None
    """a whole loss map, which makes all others superfluous"""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        figures = ("efficiency", "no_load_torque", "starting_torque", "static_efficiency", "backdriving_torque")
        given = [name for name in figures if getattr(self, name) not in (None, ())]
        if self.table is not None and given:
            raise ValueError(f"has a table and {given[0]}; the table says all, so give one or the other")
        if self.load_correction and len([p for p in self.efficiency if p.load == 1.0]) != 1:
            raise ValueError("has a load_correction, which needs exactly one efficiency at load 1 to act on")
        for name, points in (
            ("efficiency", self.all_efficiencies()),
            ("backdrive_efficiency", self.backdrive_efficiency),
        ):
            seen = set()
            for p in points:
                if p.efficiency > 1.0:
                    raise ValueError(
                        f"has a load_correction that makes the efficiency at load {p.load} {p.efficiency:.3f}, above 1"
                    )
                key = (p.input_speed, p.load, p.temperature)
                if key in seen:
                    raise ValueError(f"has {name} twice at {p.input_speed:.6g} rad/s and load {p.load}; keep one")
                seen.add(key)
        return self

    def all_efficiencies(self) -> tuple[EfficiencyPoint, ...]:
        """The efficiencies with those that the load correction adds."""
        extra = []
        for load, factor in self.load_correction:
            rated = next(p for p in self.efficiency if p.load == 1.0)
            if load != 1.0:
                extra.append(
                    EfficiencyPoint.model_construct(
                        input_speed=rated.input_speed,
                        load=load,
                        efficiency=rated.efficiency * factor,
                        temperature=rated.temperature,
                    )
                )
        return (*self.efficiency, *extra)

    @property
    def empty(self) -> bool:
        return self.table is None and not (self.efficiency or self.static_efficiency is not None)


class StiffnessFigures(Part):
    """Torsional stiffness by segments, as manufacturers print it: K1 up to torque T1, K2 up to T2, K3 beyond."""

    slopes: tuple[Annotated[Stiffness, Positive], ...] = Field(min_length=1)
    """K1, K2, ..."""
    torques: tuple[Annotated[Torque, Positive], ...] = ()
    """T1, T2, ...: one fewer"""
    scatter: Annotated[Number, NotNegative] | None = None
    """relative, from unit to unit"""

    @model_validator(mode="after")
    def _matches(self) -> Self:
        if len(self.torques) != len(self.slopes) - 1:
            raise ValueError(
                f"has {len(self.slopes)} slopes and {len(self.torques)} torques; it needs one torque fewer"
            )
        for a, b in itertools.pairwise(self.torques):
            if b <= a:
                raise ValueError(f"has torques that do not rise: {b} N*m follows {a} N*m")
        return self

    def breaks(self) -> tuple[float, ...]:
        """Twists [rad] at which the stiffness changes."""
        out, twist, previous = [], 0.0, 0.0
        for torque, slope in zip(self.torques, self.slopes, strict=False):
            twist += (torque - previous) / slope
            out.append(twist)
            previous = torque
        return tuple(out)


class Record(Part):
    """What data sheets of all kinds have."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9.-]*$")
    """lower-case letters, digits, dots and dashes"""
    maker: str = ""
    title: str = ""
    """as the manufacturer calls it"""
    note: str = ""
    """what a reader of results must know"""
    sources: tuple[Source, ...] = ()
    gaps: tuple[Gap, ...] = ()

    def figures(self) -> list[str]:
        """Dotted keys of all figures that are given."""
        plain = {*Record.model_fields, "kind"}
        out = []
        for name in self.model_fields_set - plain:
            value = getattr(self, name)
            if isinstance(value, LossFigures):
                out += [f"losses.{k}" for k in sorted(value.model_fields_set)]
            else:
                out.append(name)
        return sorted(out)

    def source_of(self, figure: str) -> Source | None:
        """The source that covers a figure."""
        for source in self.sources:
            if figure in source.figures or figure.split(".", maxsplit=1)[0] in source.figures:
                return source
        return None

    def where(self, figure: str) -> str:
        """Where one would read a figure that is missing."""
        return next((gap.where for gap in self.gaps if gap.figure == figure), "the manufacturer's data sheet")


class GearboxSheet(Record):
    """Data sheet of a gearbox."""

    kind: Literal["strain_wave", "planetary", "worm", "cycloidal", "other"]
    ratio: Annotated[Number, Positive]
    """input speed / output speed"""
    rated_output_torque: Annotated[Torque, Positive] | None = None
    rated_input_speed: Annotated[Speed, Positive] | None = None
    """at which the rated torque and the efficiency hold"""
    average_output_torque: Annotated[Torque, Positive] | None = None
    peak_output_torque: Annotated[Torque, Positive] | None = None
    """repeated, as in acceleration"""
    momentary_output_torque: Annotated[Torque, Positive] | None = None
    """in an emergency stop"""
    average_input_speed: Annotated[Speed, Positive] | None = None
    """for the mean over a duty cycle"""
    max_input_speed: Annotated[Speed, Positive] | None = None
    inertia: Annotated[Inertia, NotNegative] | None = None
    """on the input shaft"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    """on the input shaft, beside the losses"""
    stiffness: StiffnessFigures | None = None
    backlash: Annotated[Angle, NotNegative] | None = None
    """total gap at the output"""
    hysteresis_loss: Annotated[Angle, Positive] | None = None
    """width of the loop at zero torque after loading to rated torque in both directions"""
    hysteresis_efficiency: Efficiency | None = None
    """eta_H of (16), where the loop itself is known"""
    losses: LossFigures = LossFigures()

    @model_validator(mode="after")
    def _one_hysteresis(self) -> Self:
        if self.hysteresis_loss is not None and self.hysteresis_efficiency is not None:
            raise ValueError("has hysteresis_loss and hysteresis_efficiency; they say the same, so give one")
        return self

    def missing(self) -> dict[str, str]:
        """What a run needs and the record lacks: the key of `[gearbox]`, and what to look for."""
        out = {}
        if self.rated_output_torque is None:
            out["rated_output_torque"] = f"see {self.where('rated_output_torque')}"
        if self.rated_input_speed is None:
            out["rated_input_speed"] = f"see {self.where('rated_input_speed')}"
        if self.inertia is None:
            out["inertia"] = f"moment of inertia on the input shaft; see {self.where('inertia')}"
        if self.stiffness is None:
            out["stiffness"] = f"torsional stiffness; see {self.where('stiffness')}"
        if self.losses.empty:
            out["losses"] = f"an efficiency or a loss table; see {self.where('losses.efficiency')}"
        return out

    def torsion_curve(self) -> TorsionCurve:
        """The torsion curve, with the backlash as its first segment."""
        assert self.stiffness is not None
        return TorsionCurve(slopes=self.stiffness.slopes, breaks=self.stiffness.breaks(), backlash=self.backlash or 0.0)

    def hysteresis(self, curve: TorsionCurve | LinearStiffness) -> Hysteresis | None:
        """eta_H of (16), from itself or from the width of the loop.

        On the loop that turns at rated torque T_R, P = T_R - h at the turning points and h = (1 - eta_H)/2 P; it
        crosses zero torque where P = h. So the width gives h, and h gives eta_H.
        """
        if self.hysteresis_efficiency is not None:
            return Hysteresis(efficiency=self.hysteresis_efficiency)
        if self.hysteresis_loss is None:
            return None
        assert self.rated_output_torque is not None
        h = curve.core().torque(0.5 * self.hysteresis_loss)
        q = h / (self.rated_output_torque - h)
        if not 0.0 <= q < 0.5:
            raise InputError(
                f"{self.name}: has hysteresis_loss = {self.hysteresis_loss:.4g} rad, which with this stiffness means a loop of half of "
                "the rated torque or more; check both figures and their units"
            )
        return Hysteresis(efficiency=1.0 - 2.0 * q)

    def limits(self) -> GearboxLimits:
        """What the drive check compares with."""
        return GearboxLimits(
            average_output_torque=self.average_output_torque,
            peak_output_torque=self.peak_output_torque,
            momentary_output_torque=self.momentary_output_torque,
            average_input_speed=self.average_input_speed,
            max_input_speed=self.max_input_speed,
        )

    def scalars(self) -> dict[str, Any]:
        """Those keys of `[gearbox]` that are figures of the sheet."""
        return {name: getattr(self, name) for name in SCALARS if getattr(self, name) is not None}


class MotorSheet(Record):
    """Data sheet of a DC motor, or of a brushless one seen from its supply as a DC motor."""

    kind: Literal["dc_brushed", "brushless"] = "dc_brushed"
    rated_voltage: Annotated[Voltage, Positive]
    rotor_inertia: Annotated[Inertia, Positive] | None = None
    rated_torque: Annotated[Torque, Positive] | None = None
    """at the shaft, continuous; with armature_voltage_constant that of the field"""
    rated_speed: Annotated[Speed, Positive] | None = None
    rated_current: Annotated[Current, Positive] | None = None
    no_load_speed: Annotated[Speed, Positive] | None = None
    no_load_current: Annotated[Current, Positive] | None = None
    stall_torque: Annotated[Torque, Positive] | None = None
    stall_current: Annotated[Current, Positive] | None = None
    torque_constant: Annotated[TorqueConstant, Positive] | None = None
    resistance: Annotated[Resistance, Positive] | None = None
    """terminal, at 25 °C"""
    inductance: Annotated[Inductance, Positive] | None = None
    friction_torque: Annotated[Torque, NotNegative] | None = None
    armature_voltage_constant: Annotated[Number, Limit(gt=1.0)] | None = None
    """k_N, where it is known itself"""
    electrical_time_constant: Annotated[Time, Positive] | None = None
    max_speed: Annotated[Speed, Positive] | None = None
    thermal_resistance: Annotated[ThermalResistance, Positive] | None = None
    """winding to ambient, both in series"""
    max_winding_temperature: Temperature | None = None

    def missing(self) -> dict[str, str]:
        """What a run needs and the record lacks."""
        need = {
            "rotor_inertia": self.rotor_inertia,
            "torque_constant, resistance": self.armature_voltage_constant or (self.torque_constant and self.resistance),
            "rated_torque or rated_current": self.rated_torque or self.rated_current,
            "inductance": self.electrical_time_constant or self.inductance,
            "friction_torque or no_load_current": self.friction_torque is not None or self.no_load_current,
        }
        return {key: f"see {self.where(key)}" for key, value in need.items() if not value}

    def motor(self) -> Motor:
        """Parameters of eq. (2).

        The rated point and the stall torque of the sheet are kept. So no-load speed is a result; manufacturers' figures are
        often not consistent with each other, and `no_load_speed_of_model` says by how much.
        """
        missing = self.missing()
        if missing:
            key, where = next(iter(missing.items()))
            raise InputError(f"{self.name}: lacks {key}; {where}")
        k_t, R = self.torque_constant, self.resistance
        T_10 = self.friction_torque
        if T_10 is None:
            assert k_t is not None
            assert self.no_load_current is not None
            T_10 = k_t * self.no_load_current
        k_N, M_DR = self.armature_voltage_constant, self.rated_torque
        speed = self.rated_speed
        if k_N is None:
            assert k_t is not None
            assert R is not None
            if M_DR is None:
                assert self.rated_current is not None
                M_DR = k_t * self.rated_current
            else:
                M_DR += T_10
            stall = self.stall_torque if self.stall_torque is not None else k_t * self.rated_voltage / R
            k_N = stall / M_DR
            if speed is None:
                speed = (self.rated_voltage - R * M_DR / k_t) / k_t
        tau = self.electrical_time_constant
        if tau is None:
            assert self.inductance is not None
            assert R is not None
            tau = self.inductance / R
        return Motor(
            rotor_inertia=self.rotor_inertia,  # type: ignore[arg-type]  # not missing
            friction_torque=T_10,
            rated_torque=M_DR,  # type: ignore[arg-type]
            rated_speed=speed,
            rated_voltage=self.rated_voltage,
            electrical_time_constant=tau,
            armature_voltage_constant=k_N,
            limits=MotorLimits(
                continuous_torque=M_DR,
                max_speed=self.max_speed,
                resistance=R,
                torque_constant=k_t,
                thermal_resistance=self.thermal_resistance,
                max_winding_temperature=self.max_winding_temperature,
            ),
        )

    def no_load_speed_of_model(self) -> float:
        """[rad/s], where the speed-torque line of eq. (2) at rated voltage meets the friction torque."""
        m = self.motor()
        assert m.armature_voltage_constant is not None
        assert m.rated_speed is not None
        k = m.armature_voltage_constant
        return m.rated_speed * (k - m.friction_torque / m.rated_torque) / (k - 1.0)
