"""Ball screws, and what all linear drives (screws, racks, belts) share.

Slides enter the equations as shafts, and linear drives as gears. A slide is a shaft whose inertia is a mass [kg], whose angle is a
position [m] and whose torques are forces [N]. A screw of lead p is a gear of ratio 2 pi/p between a shaft and a
slide.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, field_validator

from ..errors import InputError
from ..inputs import core_parameters
from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Angle,
    Force,
    Inertia,
    Length,
    Limit,
    NotNegative,
    Number,
    Positive,
    Share,
    SlideStiffness,
    Speed,
    Torque,
    UpToOne,
    ViscousFriction,
    Whole,
)
from ..reproducible import arctan
from ..units.conversion import Unit
from .angle_torques import AngleCurve, ErrorCurve, ErrorHarmonic, Harmonic
from .gear import Gear
from .losses import ConstantEfficiency, MeshEfficiency, worm_efficiencies
from .notes import NO_NOTE, Note, note_is_about
from .torsion import Hysteresis, LinearStiffness, Rigid, TorsionCurve, check_segments

STEEL = 7850.0  # [kg/m^3]
ELASTIC_MODULUS = 206e9  # of steel [Pa]


class StiffnessCurve(Part):
    """Force over deflection: odd, continuous, piecewise linear, as the nut, the screw and its bearings give way together."""

    slopes: Annotated[tuple[Annotated[SlideStiffness, NotNegative], ...], Field(min_length=1, max_length=100)]
    """slopes of the segments, from deflection 0 outwards"""
    breaks: tuple[Annotated[Length, Positive], ...] = ()
    """deflections at which the slope changes; one fewer than slopes"""

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        yield from check_segments(self.slopes, self.breaks, "force")


class PitchHarmonic(core_parameters.PitchHarmonicFields, Harmonic):
    """A pitch error ``amplitude * sin(order * phi + phase)`` over the angle of the input shaft, by straight lines."""

    def gear_error(self) -> ErrorHarmonic:
        """The same as the transmission error of a gear."""
        return ErrorHarmonic(order=self.order, phase=self.phase, amplitude=self.amplitude, error=self.error)


class PitchCurve(AngleCurve):
    """A pitch error over the angle of the input shaft: straight lines through points over one period."""

    errors: tuple[Length, ...]
    """at the slide"""

    def gear_error(self) -> ErrorCurve:
        """The same as the transmission error of a gear."""
        return ErrorCurve(period=self.period, angles=self.angles, errors=self.errors)


PitchError = Annotated[PitchHarmonic | PitchCurve, Field(discriminator="kind")]


class LinearDrive(Part):
    """Base of screws, racks and belts: losses, compliance, backlash, pitch error, and the values of the input shaft."""

    efficiency: Annotated[Number, UpToOne] | None = None  #: while the input drives; left out, none is lost
    backdriving_efficiency: Annotated[Number, Limit(le=1.0)] | None = None
    """while the slide drives; 0 or less: self-locking; left out, 2 - 1/efficiency, which loses the same share of the force"""
    stiffness: Annotated[SlideStiffness, Positive] | None = None
    """axial, at the slide, of all that is in series; left out, rigid"""
    backlash: Annotated[Length, NotNegative] = 0.0  #: whole axial play at the slide
    restitution: Annotated[Number, Share] | None = None
    """speed at which rigid flanks part over that at which they strike; needed with backlash and no stiffness"""
    preload: Annotated[Force, NotNegative] = 0.0  #: removes the segments of stiffness_curve below it
    damping: Annotated[float, Unit("N*s/m"), NotNegative] = 0.0  #: at the slide, while the flanks touch
    inertia: Annotated[Inertia, NotNegative] = 0.0  #: inertia of all that turns with the input shaft
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0  #: on the input shaft
    drag_torque: Annotated[Torque, NotNegative] = 0.0  #: dry friction on the input shaft, for example by the preload
    stiffness_curve: StiffnessCurve | None = None  #: force over deflection, in place of stiffness
    hysteresis: Hysteresis | None = None
    pitch_error: PitchError | None = None
    """e over the angle of the input shaft, at the slide: deflection = input angle/ratio - position - e"""
    note: Note = NO_NOTE  #: for readers of the results: text, or by the key that it is about

    _note_is_about_a_key = field_validator("note")(classmethod(note_is_about))

    @rule
    def _compliance_is_clear(self) -> Iterator[str]:
        if self.stiffness is not None and self.stiffness_curve is not None:
            yield "has stiffness and stiffness_curve, which say the same; give one"
        if self.backdriving_efficiency is not None and self.efficiency is None:
            yield "has a backdriving_efficiency without efficiency; give both, or leave it out"
        if self.preload > 0.0 and self.stiffness_curve is None and not self._goes_slack():
            yield "has a preload, which acts on the segments of a stiffness_curve; give one, or leave it out"
        if self.preload > 0.0 and self.backlash > 0.0:
            yield "has backlash and preload; a preload removes the backlash, so give only one"
        strikes = self.restitution is not None
        if strikes and (self._stiffness() is not None or self.backlash == 0.0):
            lacks = "a stiffness" if self.backlash > 0.0 else "no backlash"
            yield f"has a restitution and {lacks}; a restitution is that of rigid flanks with backlash"
        if self._stiffness() is None:
            for key in ("backlash", "damping", "pitch_error", "hysteresis"):
                if getattr(self, key) and not (strikes and key == "backlash"):
                    remedy = ", or the restitution of its flanks, 0 to 1" if key == "backlash" else ""
                    yield f'has {key} but is rigid; give it a stiffness, such as "200 N/um"{remedy}'

    def travel(self) -> float:
        """Travel of the slide to one turn of the input shaft [m]."""
        raise NotImplementedError

    def ratio(self) -> float:
        """Angle of the input shaft to the travel of the slide [rad/m], 2 pi/travel."""
        return 2.0 * math.pi / self.travel()

    def _stiffness(self) -> float | None:
        """One stiffness [N/m], or None."""
        if self.stiffness_curve is not None:
            return self.stiffness_curve.slopes[-1]
        return self.stiffness

    def _goes_slack(self) -> bool:
        """Whether a preload keeps strands tight, rather than removing segments of a curve."""
        return False

    def _curve(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Slopes [N/m] and breaks [m] of the force over the deflection, where it is more than one line."""
        return None if self.stiffness_curve is None else (self.stiffness_curve.slopes, self.stiffness_curve.breaks)

    def _turning_inertia(self) -> float:
        return self.inertia

    def efficiencies(self) -> tuple[float, float] | None:
        """(driving, back-driving), or None without losses."""
        if self.efficiency is None:
            return None
        back = self.backdriving_efficiency
        return self.efficiency, 2.0 - 1.0 / self.efficiency if back is None else back

    def gear(self, input: str, output: str) -> Gear:
        """The gear between a shaft and a slide that has the same equations."""
        k, both = self._stiffness(), self.efficiencies()
        stiffness: TorsionCurve | LinearStiffness | Rigid = Rigid()
        if self.restitution is not None:
            stiffness = Rigid(backlash=self.backlash, restitution=self.restitution)
        if (curve := self._curve()) is not None:
            preload = 0.0 if self._goes_slack() else self.preload
            stiffness = TorsionCurve(slopes=curve[0], breaks=curve[1], backlash=self.backlash, preload=preload)
        elif k is not None and self.backlash > 0.0:
            stiffness = TorsionCurve(slopes=(k,), backlash=self.backlash)
        elif k is not None:
            stiffness = LinearStiffness(stiffness=k)
        return Gear.model_construct(
            None,
            input=input,
            output=output,
            ratio=self.ratio(),
            inertia=self._turning_inertia(),
            viscous_friction=self.viscous_friction,
            stiffness=stiffness,
            losses=ConstantEfficiency(efficiency=1.0)
            if both is None
            else MeshEfficiency(drive_efficiency=both[0], backdrive_efficiency=both[1]),
            mesh_damping=self.damping,
            hysteresis=self.hysteresis,
            transmission_error=None if self.pitch_error is None else self.pitch_error.gear_error(),
            note=str(self.note),
        )


def one_way(part: Part, ways: dict[str, tuple[str, ...]], optional: tuple[str, ...] = ()) -> str:
    """Choice among equivalent sets of keys."""
    given = {way: [key for key in keys if getattr(part, key) is not None] for way, keys in ways.items()}
    used = [way for way, keys in given.items() if keys]
    text = ", or ".join(" and ".join(keys) for keys in ways.values())
    if not used:
        raise ValueError(f"lacks {text}; add it")
    if len(used) > 1:
        raise ValueError(f"has {given[used[0]][0]} and {given[used[1]][0]}, which say the same; give one")
    lacking = [key for key in ways[used[0]] if getattr(part, key) is None and key not in optional]
    if lacking:
        raise ValueError(f"lacks {' and '.join(lacking)}; add it, or give {text}")
    return used[0]


class ScrewData(LinearDrive):
    """A ball screw or a lead screw alone, as a data sheet has it.

    Examples
    --------
    >>> import lostmotion as lm
    >>> screw = lm.model.ScrewData(lead="10 mm", mean_diameter="25 mm", friction_coefficient=0.003)
    >>> [round(efficiency, 4) for efficiency in screw.efficiencies()]
    [0.9766, 0.9761]
    """

    lead: Annotated[Length, Positive] | None = None
    """travel to one turn"""
    pitch: Annotated[Length, Positive] | None = None
    """distance of neighbouring threads, which with the number of starts says the lead"""
    starts: Annotated[Whole, Field(ge=1, le=20)] | None = None
    """threads of the screw"""
    mean_diameter: Annotated[Length, Positive] | None = None
    """d, of the pitch circle; tan(lead angle) = lead/(pi d)"""
    friction_coefficient: Annotated[Number, NotNegative] | None = None
    """in the thread: with mean_diameter, in place of efficiency"""
    friction_angle: Annotated[Angle, NotNegative] | None = None
    """in place of friction_coefficient"""
    nut_stiffness: Annotated[SlideStiffness, Positive] | None = None
    """in series with the next ones, in place of stiffness"""
    bearing_stiffness: Annotated[SlideStiffness, Positive] | None = None
    """axial stiffness of its bearings"""
    supported_length: Annotated[Length, Positive] | None = None
    """length of the screw between bearing and nut; with both ends fixed, between both bearings, the nut in the middle"""
    core_diameter: Annotated[Length, Positive] | None = None
    """core diameter of the screw's thread root"""
    elastic_modulus: Annotated[float, Unit("Pa"), Positive] | None = None
    """default: steel, 206 GPa"""
    support: Literal["one end", "both ends"] | None = None
    """at which the screw is fixed axially: stiffness E A/L (left out, this), or 4 E A/L"""
    diameter: Annotated[Length, Positive] | None = None
    """diameter of the screw: with length, in place of inertia"""
    length: Annotated[Length, Positive] | None = None
    """length of the shaft of the screw"""
    density: Annotated[float, Unit("kg/m^3"), Positive] | None = None
    """default: steel, 7850 kg/m^3"""

    @rule
    def _is_a_screw(self) -> Iterator[str]:
        one_way(self, {"lead": ("lead",), "pitch": ("pitch", "starts")})
        friction = [key for key in ("friction_coefficient", "friction_angle") if getattr(self, key) is not None]
        if len(friction) == 2:
            yield "has friction_coefficient and friction_angle, which say the same; give one"
        if friction and self.mean_diameter is None:
            yield f"has {friction[0]} without mean_diameter, which the lead angle needs; add it"
        if friction and self.efficiency is not None:
            yield f"has efficiency and {friction[0]}, which say the same; give one"
        if self.mean_diameter is not None and not friction:
            yield "has a mean_diameter without friction_coefficient or friction_angle; add one, or leave it out"
        if friction:
            g, r = self.angles()
            if not g + r < 0.5 * math.pi:
                yield f"has a lead angle of {math.degrees(g):.4g} deg and a friction angle of {math.degrees(r):.4g} deg; their sum must be below 90 deg"
        if (self.supported_length is None) != (self.core_diameter is None):
            raise InputError(
                "one of them is missing; the stiffness of the screw needs both", "supported_length", "core_diameter"
            )
        series = [k for k in ("nut_stiffness", "bearing_stiffness", "supported_length") if getattr(self, k) is not None]
        for key in ("stiffness", "stiffness_curve"):
            if series and getattr(self, key) is not None:
                yield f"has {key} and {series[0]}, which say the same; give one"
        if self.supported_length is None:
            for key in ("support", "elastic_modulus"):
                if getattr(self, key) is not None:
                    yield f"has {key}, which belongs to supported_length and core_diameter; add them"
        if (self.diameter is None) != (self.length is None):
            raise InputError("one of them is missing; the inertia of the screw needs both", "diameter", "length")
        if self.diameter is not None and self.inertia > 0.0:
            yield "has inertia and diameter, which say the same; give one"
        if self.diameter is None and self.density is not None:
            yield "has a density, which belongs to diameter and length; add them"

    def travel(self) -> float:
        if self.lead is not None:
            return self.lead
        assert self.pitch is not None and self.starts is not None  # noqa: PT018
        return self.pitch * self.starts

    def angles(self) -> tuple[float, float]:
        """(lead angle, friction angle) [rad]."""
        assert self.mean_diameter is not None
        g = arctan(self.travel() / (math.pi * self.mean_diameter))
        r = self.friction_angle
        return g, arctan(self.friction_coefficient) if r is None else r  # type: ignore[arg-type]

    def efficiencies(self) -> tuple[float, float] | None:
        if self.mean_diameter is None:
            return super().efficiencies()
        eta_f, eta_b = worm_efficiencies(*self.angles())
        return eta_f, eta_b if self.backdriving_efficiency is None else self.backdriving_efficiency

    def _stiffness(self) -> float | None:
        parts = [k for k in (self.nut_stiffness, self.bearing_stiffness) if k is not None]
        if self.supported_length is not None and self.core_diameter is not None:
            area = 0.25 * math.pi * self.core_diameter * self.core_diameter
            fixed = 4.0 if self.support == "both ends" else 1.0
            parts.append(fixed * (self.elastic_modulus or ELASTIC_MODULUS) * area / self.supported_length)
        if not parts:
            return super()._stiffness()
        compliance = 0.0
        for k in parts:
            compliance += 1.0 / k
        return 1.0 / compliance

    def _turning_inertia(self) -> float:
        if self.diameter is None or self.length is None:
            return self.inertia
        d2 = self.diameter * self.diameter
        return math.pi / 32.0 * (self.density or STEEL) * self.length * d2 * d2


class RatedScrew(ScrewData):
    """A ball screw or a lead screw alone, with the ratings by which its life, buckling and speed are judged.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.RatedScrew(lead="10 mm", efficiency=0.9, dynamic_capacity="20 kN").dynamic_capacity
    20000.0
    """

    dynamic_capacity: Annotated[Force, Positive] | None = None
    """C: axial load for a million turns of nominal life"""
    static_capacity: Annotated[Force, Positive] | None = None
    """C_0"""
    load_factor: Annotated[Number, Positive] = 1.0
    """f_w of the life: 1.2 to 1.5 for normal motion, more with shocks"""
    mounting: Literal["fixed-supported", "fixed-free", "supported-supported", "fixed-fixed"] = "fixed-supported"
    """mounting of the ends of the screw, for buckling and bending along supported_length"""
    ball_circle_diameter: Annotated[Length, Positive] | None = None
    """diameter of the circle of the centres of its balls"""
    max_input_speed: Annotated[Speed, Positive] | None = None
    """left out, 70 m rpm/ball_circle_diameter"""


class Placed(Part):
    """Base of what turns into a straight line, with the names of its shaft and its slide."""

    input: str  #: shaft
    output: str  #: slide


class Screw(RatedScrew, Placed):
    """A ball screw or a lead screw between a shaft and a slide.

    Examples
    --------
    >>> import lostmotion as lm
    >>> screw = lm.model.Screw(input="motor", output="table", lead="10 mm", stiffness="200 N/um", backlash="2 um")
    >>> round(screw.ratio(), 3)
    628.319
    """
