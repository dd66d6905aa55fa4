"""Data sheets of ball screws, racks, toothed belts and linear motors."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import model_validator

from ..inputs.part import Part
from ..inputs.quantities import (
    Angle,
    Force,
    Inductance,
    Length,
    LinearSpeed,
    LinearVoltageConstant,
    Mass,
    MassPerLength,
    Positive,
    Power,
    Resistance,
    Voltage,
    Whole,
)
from ..model.linear_motor import LinearMotorData
from ..model.rack_and_belt import RatedBelt, RatedRack
from ..model.screw import RatedScrew
from .sheet import Record

Alternatives = tuple[tuple[tuple[str, ...], ...], ...]
# Level of a linear motor whose winding is not known.
FORCE_SOURCE = "force source"
STIFFNESSES = (("stiffness",), ("stiffness_curve",))


def _as_it_is(sheet: Any) -> Any:
    """Replaces the checks of a part: a part has to be whole, a sheet need not be."""
    return sheet


class LinearSheet(Record):
    """Base of the data sheets of linear parts: a table of scenarios has their data under the same keys.

    A sheet is checked for units and ranges when it is read, and for what belongs together where it is used, with the
    keys beside `from`.
    """

    PART: ClassVar[type[Part]]  #: the values of the table of a scenario
    ALTERNATIVES: ClassVar[Alternatives] = ()
    """sets of keys, where each key gives the same quantity: one that is given beside `from` takes the place of the others"""
    PARTNERS: ClassVar[dict[str, tuple[str, ...]]] = {}
    """for some keys the other keys, one of which must be given too; without them they are data for nothing but the list"""
    CHOICES: ClassVar[dict[str, str]] = {}  #: values that no record can state, since they depend on the axis

    def values(self) -> dict[str, Any]:
        """Data that the table of a scenario has too."""
        names = (name for name in type(self).PART.model_fields if name in self.model_fields_set)
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def open_choices(self, values: Mapping[str, Any]) -> dict[str, str]:
        """Choices that are incomplete: none of the alternative keys has a value."""
        return {
            key: text
            for key, text in type(self).CHOICES.items()
            if key not in values and not any(other in values for other in self._replacing(key))
        }

    def _replacing(self, key: str) -> set[str]:
        """The keys that take the place of one."""
        ways = [ways for ways in type(self).ALTERNATIVES if any(key in way for way in ways)]
        return {other for each in ways for way in each if key not in way for other in way}


class ScrewSheet(LinearSheet, RatedScrew):
    """Data sheet of a ball screw, a roller screw or a lead screw.

    Examples
    --------
    >>> import lostmotion as lm
    >>> sheet = lm.data_sheets.ScrewSheet(name="my-screw", lead="10 mm", nut_stiffness="320 N/um", efficiency=0.9)
    >>> sheet.missing()
    {}
    """

    kind: Literal["ball_screw", "roller_screw", "lead_screw"] = "ball_screw"
    ball_diameter: Annotated[Length, Positive] | None = None
    nut_preload: Annotated[Force, Positive] | None = None
    """preload of the nut, at which nut_stiffness and drag_torque hold"""
    nut_mass: Annotated[Mass, Positive] | None = None

    PART: ClassVar[type[Part]] = RatedScrew
    ALTERNATIVES: ClassVar[Alternatives] = (
        (("lead",), ("pitch", "starts")),
        (("efficiency", "backdriving_efficiency"), ("friction_coefficient",), ("friction_angle",)),
        (*STIFFNESSES, ("nut_stiffness", "bearing_stiffness", "supported_length", "core_diameter")),
        (("inertia",), ("diameter", "length", "density")),
    )
    PARTNERS: ClassVar[dict[str, tuple[str, ...]]] = {
        "core_diameter": ("supported_length",),
        "diameter": ("length",),
        "mean_diameter": ("friction_coefficient", "friction_angle"),
    }
    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {
        "lead": ("lead", "pitch"),
        "efficiency": ("efficiency", "friction_coefficient", "friction_angle"),
        "nut_stiffness": ("nut_stiffness", "stiffness", "stiffness_curve"),
    }

    _compliance_is_clear = _is_a_screw = model_validator(mode="after")(_as_it_is)


class RackSheet(LinearSheet, RatedRack):
    """Data sheet of a rack, or of a rack with its pinion.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.data_sheets.RackSheet(name="my-rack", module="2 mm", rated_force="8 kN").missing()
    {}
    """

    kind: Literal["straight", "helical"] = "straight"
    pressure_angle: Annotated[Angle, Positive] | None = None
    width: Annotated[Length, Positive] | None = None  #: width of the bar, across the teeth
    height: Annotated[Length, Positive] | None = None  #: height of the bar, from its back to the tips of the teeth
    pitch_line_height: Annotated[Length, Positive] | None = None  #: from the back of the bar to the pitch line
    bar_length: Annotated[Length, Positive] | None = None
    bar_teeth: Annotated[Whole, Positive] | None = None
    bar_mass: Annotated[Mass, Positive] | None = None

    PART: ClassVar[type[Part]] = RatedRack
    ALTERNATIVES: ClassVar[Alternatives] = ((("module", "teeth", "helix_angle"), ("travel_per_turn",)), STIFFNESSES)
    CHOICES: ClassVar[dict[str, str]] = {"teeth": "of the pinion"}
    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {"module": ("module", "travel_per_turn")}

    _compliance_is_clear = _is_a_rack = model_validator(mode="after")(_as_it_is)


class BeltSheet(LinearSheet, RatedBelt):
    """Data sheet of a toothed belt.

    Examples
    --------
    >>> import lostmotion as lm
    >>> sheet = lm.data_sheets.BeltSheet(name="my-belt", pitch="5 mm", width="25 mm", rated_force="1750 N")
    >>> sheet.missing()
    {'specific_stiffness': "see the manufacturer's data sheet"}
    """

    kind: Literal["open", "endless"] = "open"
    breaking_force: Annotated[Force, Positive] | None = None
    mass_per_length: Annotated[MassPerLength, Positive] | None = None

    PART: ClassVar[type[Part]] = RatedBelt
    ALTERNATIVES: ClassVar[Alternatives] = (
        (("pulley_diameter",), ("teeth", "pitch"), ("travel_per_turn",)),
        (*STIFFNESSES, ("specific_stiffness", "free_lengths")),
    )
    CHOICES: ClassVar[dict[str, str]] = {
        "teeth": "of the pulley",
        "free_lengths": "of the strands between pulley and slide",
    }
    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {
        "pitch": ("pitch", "pulley_diameter", "travel_per_turn"),
        "specific_stiffness": ("specific_stiffness", "stiffness", "stiffness_curve"),
    }

    _compliance_is_clear = _is_a_belt = model_validator(mode="after")(_as_it_is)


class LinearMotorSheet(LinearSheet, LinearMotorData):
    """Data sheet of a linear motor or a voice coil. Currents are effective values where the motor has three phases.

    Examples
    --------
    >>> import lostmotion as lm
    >>> sheet = lm.data_sheets.LinearMotorSheet(name="my-motor", kind="ironless", rated_force="100 N", mass="0.3 kg")
    >>> sheet.values()
    {'mass': 0.3, 'rated_force': 100.0}
    """

    kind: Literal["ironcore", "ironless", "tubular", "voice_coil"] = "ironcore"
    resistance: Annotated[Resistance, Positive] | None = None  #: between two terminals, at 25 °C
    inductance: Annotated[Inductance, Positive] | None = None  #: between two terminals
    voltage_constant: Annotated[LinearVoltageConstant, Positive] | None = None
    """amplitude of the voltage between two terminals to the speed"""
    attraction_force: Annotated[Force, Positive] | None = None  #: between coils and magnets
    max_dissipation: Annotated[Power, Positive] | None = None
    dc_voltage: Annotated[Voltage, Positive] | None = None
    max_speed: Annotated[LinearSpeed, Positive] | None = None
    track_mass_per_length: Annotated[MassPerLength, Positive] | None = None

    PART: ClassVar[type[Part]] = LinearMotorData
    ALTERNATIVES: ClassVar[Alternatives] = (
        (("rated_force",), ("rated_current",)),
        (("peak_force",), ("peak_current",)),
    )
    PARTNERS: ClassVar[dict[str, tuple[str, ...]]] = {"pole_pitch": ("cogging_force",)}
    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {"rated_force": ("rated_force", "rated_current"), "mass": ("mass",)}

    def level(self) -> str | None:
        """Level of a run with these data: ``"all data"``, ``"force source"`` where voltage and heat are not known, or None."""
        winding = (self.force_constant, self.resistance, self.inductance, self.pole_pitch)
        return super().level() if self.missing() or None not in winding else FORCE_SOURCE

    def _assumed(self) -> dict[str, str]:
        if self.level() != FORCE_SOURCE:
            return {}
        lacks = "runs as a force source, since its winding is not given: voltage and heat are not judged."
        return {"force_constant": f"{self.name} {lacks}"}

    _is_a_motor = model_validator(mode="after")(_as_it_is)
