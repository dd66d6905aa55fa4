"""Loss data of a gearbox as a data sheet prints them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from ..inputs.part import Part, rule
from ..inputs.quantities import KinematicViscosity, Limit, NotNegative, Number, Positive, Speed, Temperature, Torque
from ..model.losses import LossMap
from ..reproducible import log10, power

Efficiency = Annotated[Number, Limit(gt=0.0, le=1.0)]


class EfficiencyPoint(Part):
    """Efficiency at one speed and load."""

    input_speed: Annotated[Speed, Positive]
    load: Annotated[Number, Positive] = 1.0  #: output torque / rated output torque
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

    @rule
    def _thins(self) -> Iterator[str]:
        if self.viscosity_100 >= self.viscosity_40:
            yield f"has viscosity_100 = {self.viscosity_100} m^2/s, not below viscosity_40; oil thins when hot"

    def viscosity(self, temperature: float) -> float:
        """Kinematic viscosity [m^2/s] at a temperature [°C], by Ubbelohde and Walther (ASTM D341)."""

        def w(nu: float) -> float:
            return log10(log10(nu * 1e6 + 0.7))

        t40, t100 = log10(313.15), log10(373.15)
        slope = (w(self.viscosity_100) - w(self.viscosity_40)) / (t100 - t40)
        exponent = w(self.viscosity_40) + slope * (log10(temperature + 273.15) - t40)
        return (power(10.0, power(10.0, exponent)) - 0.7) * 1e-6


@dataclass(frozen=True)
class LossEstimate:
    """The efficiency of gearboxes of a kind at rated load and speed, where a sheet says nothing of losses."""

    efficiency: float
    lowest: float
    highest: float
    source: str

    def factors(self) -> tuple[float, float]:
        """Losses of the best and of the worst of the kind, relative to the estimate."""

        def lost(efficiency: float) -> float:
            return 1.0 / efficiency - 1.0

        return lost(self.highest) / lost(self.efficiency), lost(self.lowest) / lost(self.efficiency)


class LossData(Part):
    """Losses in the forms that data sheets print. Torques are at the input shaft unless said otherwise."""

    efficiency: tuple[EfficiencyPoint, ...] = ()  #: while the motor drives
    load_correction: tuple[tuple[Annotated[Number, Positive], Annotated[Number, Positive]], ...] = ()
    """(load, factor on the efficiency at rated load), for manufacturers who print one efficiency and a curve of factors"""
    backdrive_efficiency: tuple[EfficiencyPoint, ...] = ()  #: while the load drives
    no_load_torque: tuple[NoLoadPoint, ...] = ()
    starting_torque: Annotated[Torque, Positive] | None = None  #: at the input, breaks the unloaded gearbox loose
    starting_temperature: Temperature | None = None
    backdriving_torque: Annotated[Torque, Positive] | None = None
    """at the output, breaks the gearbox with a free input loose"""
    backdriving_temperature: Temperature | None = None
    static_efficiency: Efficiency | None = None  #: when breaking loose under load, as printed for worm gears
    temperature: Temperature = 20.0  #: temperature of all data that name no other
    lubricant: Lubricant | None = None
    static_load_factor: Annotated[Number, Positive] = 1.2
    """load-dependent loss at standstill / that in motion, where no static or back-driving datum says it"""
    table: LossMap | None = None  #: a whole loss map, which makes all others superfluous

    @rule
    def _consistent(self) -> Iterator[str]:
        names = ("efficiency", "no_load_torque", "starting_torque", "static_efficiency", "backdriving_torque")
        given = [name for name in names if getattr(self, name) not in (None, ())]
        if self.table is not None and given:
            yield f"has a table and {given[0]}; the table says all, so give one or the other"
        if self.load_correction and len([p for p in self.efficiency if p.load == 1.0]) != 1:
            yield "has a load_correction, which needs exactly one efficiency at load 1 to act on"
        for name, points in (
            ("efficiency", self.all_efficiencies()),
            ("backdrive_efficiency", self.backdrive_efficiency),
        ):
            seen = set()
            for p in points:
                if p.efficiency > 1.0:
                    yield f"has a load_correction that makes the efficiency at load {p.load} {p.efficiency:.3f}, above 1"
                key = (p.input_speed, p.load, p.temperature)
                if key in seen:
                    yield f"has {name} twice at {p.input_speed:.6g} rad/s and load {p.load}; keep one"
                seen.add(key)

    def all_efficiencies(self) -> tuple[EfficiencyPoint, ...]:
        """The efficiencies with the ones that the load correction adds."""
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
