"""Motors: parameters and ratings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import field_validator

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.core_parameters import MotorFields, ShaftMotorFields
from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Current,
    Number,
    Positive,
    Resistance,
    Speed,
    Temperature,
    ThermalResistance,
    Time,
    Torque,
    TorqueConstant,
    Voltage,
)
from ..reproducible import total
from ..units.practical import practical
from .notes import NO_NOTE, Note, note_is_about
from .synchronous_motor import PhaseValues, Winding

MotorLaw = tuple[tuple[str, Any], ...]  # fields of a motor that a current loop replaces


class MotorHeat(Part):
    """Thermal data of a motor."""

    thermal_resistance: Annotated[ThermalResistance, Positive] | None = None
    """winding to ambient, in place of its two parts"""
    thermal_resistance_winding_case: Annotated[ThermalResistance, Positive] | None = None  #: winding to case
    thermal_resistance_case_ambient: Annotated[ThermalResistance, Positive] | None = None  #: case to ambient
    thermal_time_constant_winding: Annotated[Time, Positive] | None = None
    """time constant of the winding against a case of constant temperature"""
    thermal_time_constant_motor: Annotated[Time, Positive] | None = None
    """time constant of the case against the ambient"""
    max_winding_temperature: Temperature | None = None  #: largest temperature of the winding


class MotorLimits(MotorHeat):
    """Limits of a motor. No run depends on them; the drive check compares with them."""

    continuous_torque: Annotated[Torque, Positive] | None = None
    """torque that it may give at all times"""
    peak_torque: Annotated[Torque, Positive] | None = None
    """for seconds, as in acceleration"""
    max_speed: Annotated[Speed, Positive] | None = None
    """largest speed"""
    resistance: Annotated[Resistance, Positive] | None = None
    """resistance of the winding, at 25 °C"""
    torque_constant: Annotated[TorqueConstant, Positive] | None = None
    """torque to one ampere of the armature; with one to an ampere rms of a phase only currents are judged rightly: voltage and heat
    are R I + k w and R I^2 of a DC motor, and values of a phase require a `winding`"""
    max_voltage: Annotated[Voltage, Positive] | None = None
    """voltage limit of the amplifier of a torque source, for R I + k w with resistance and torque_constant; a DC motor has
    `voltage_limit`"""
    max_current: Annotated[Current, Positive] | None = None
    """smaller limit of motor and amplifier, in the amperes of torque_constant"""
    max_inertia_ratio: Annotated[Number, Positive] | None = None
    """largest inertia of the load, gearbox included, at the motor relative to the rotor's inertia"""

    @rule
    def _one_resistance(self) -> Iterator[str]:
        if self.thermal_resistance is not None and self.thermal_parts is not None:
            yield "has thermal_resistance and both of its parts, which say the same; leave it out"

    @property
    def thermal_parts(self) -> tuple[float, float] | None:
        """Thermal resistances from winding to case and from case to ambient [K/W]."""
        parts = self.thermal_resistance_winding_case, self.thermal_resistance_case_ambient
        return None if None in parts else parts  # type: ignore[return-value]

    @property
    def winding_to_ambient(self) -> float | None:
        """Thermal resistance [K/W]."""
        return self.thermal_resistance if self.thermal_parts is None else total(self.thermal_parts)


# Keys of `[motor]` that only a DC motor has.
DC_KEYS = (
    "rated_speed",
    "rated_voltage",
    "electrical_time_constant",
    "armature_voltage_constant",
    "voltage_limit",
    "stall_torque",
    "no_load_speed",
    "stall_current",
    "no_load_current",
)
# Keys that only a stepper has.
STEPPER_KEYS = (
    "steps_per_revolution",
    "holding_torque",
    "detent_torque",
    "torque_error",
    "standstill_current",
    "rated_current",
    "resistance_phase",
    "inductance_phase",
    "supply_voltage",
)
# Share of the holding torque, for 16 straight lines in a quarter of a period: microsteps up to 1/16 do not end at a corner.
USUAL_TORQUE_ERROR = 8.04e-4
LEAST_TORQUE_ERROR = 2e-8  # share of the holding torque; less takes more straight lines than the core has room for
LARGEST_TORQUE_ERROR = 0.05  # the same: of a quarter of a period in two lines
# Keys of a DC motor known by its line from stall to no load, in place of its rated point.
LINE_KEYS = ("stall_torque", "no_load_speed")
CURRENT_KEYS = ("stall_current", "no_load_current")
POINT_KEYS = ("rated_speed", "armature_voltage_constant")
# Keys of `motor.limits` that the winding of a synchronous motor says.
SAID_BY_WINDING = ("resistance", "torque_constant", "max_current")


class Motor(MotorFields):
    """DC motor with servo amplifier (eq. 2), synchronous motor with ideal field orientation, or a torque source in
    its place.

    Examples
    --------
    >>> import lostmotion as lm
    >>> motor = lm.Motor(kind="torque_source", rotor_inertia="1 kg*cm^2", rated_torque="1 N*m")
    >>> f"{motor.rotor_inertia:g} kg·m²"
    '0.0001 kg·m²'
    """

    rated_voltage: Annotated[Voltage, Positive] | None = None
    """u_ZR, the voltage of command 1. A change over a record or a base, by `--set` or in a study is the same motor at another voltage: rated_speed and armature_voltage_constant follow so that stall torque and no-load speed go with the voltage, unless they are given too"""
    stall_torque: Annotated[Torque, Positive] | None = None
    """at rated voltage, with no_load_speed in place of rated_speed and armature_voltage_constant; what the shaft gives, if the currents are stated"""
    no_load_speed: Annotated[Speed, Positive] | None = None
    """at rated voltage without load; without friction too, unless the currents are stated"""
    stall_current: Annotated[Current, Positive] | None = None
    """at rated voltage, with no_load_current"""
    no_load_current: Annotated[Current, Positive] | None = None
    """I_0: the friction of the motor is stall_torque I_0/(I_S - I_0), in place of friction_torque"""
    voltage_limit: Annotated[Voltage, Positive] | None = None
    """largest voltage of the amplifier"""
    dc_voltage: Annotated[Voltage, Positive] | None = None
    """dc voltage of the amplifier that feeds a synchronous motor"""
    kind: Literal["dc", "torque_source", "synchronous", "stepper"] = "dc"
    """`torque_source`: the command times `rated_torque` acts on the rotor without delay; `synchronous`: command 1 is the largest
    voltage that the amplifier can give, dc_voltage/sqrt(3), amplitude of a phase; `stepper`: hybrid stepper, whose command is
    the angle
    of its field"""
    winding: Winding | None = None
    """winding of a synchronous motor, or of one that is modelled as a torque source, for its current and its heat"""
    limits: MotorLimits | None = None
    note: Note = NO_NOTE
    """for readers of the results, such as that the friction is not printed: text, or by the key that it is about"""

    _note_is_about_a_key = field_validator("note")(classmethod(note_is_about))

    @rule
    def _complete(self) -> Iterator[str]:
        yield from self._check_stepper()
        if self.kind == "dc":
            yield from self._check_line()
            self._take_rated_point()
            for key in ("rated_speed", "electrical_time_constant", "armature_voltage_constant"):
                if getattr(self, key) is None:
                    yield f'lacks {key}, which a motor of kind "dc" needs; or give stall_torque and no_load_speed'
        else:
            what = {"torque_source": "torque_source", "stepper": "stepper"}.get(self.kind, "synchronous motor")
            self._refuse(DC_KEYS, f"of no use to a {what}")
        if self.kind == "synchronous":
            for key in ("winding", "dc_voltage"):
                if getattr(self, key) is None:
                    yield f'lacks {key}, which a motor of kind "synchronous" needs'
            if "rated_torque" not in self.model_fields_set:
                yield 'lacks rated_torque, which a motor of kind "synchronous" needs'
        if self.winding is not None:
            yield from self._check_synchronous(self.winding.phase_values())
        elif self.dc_voltage is not None:
            yield "has a dc_voltage, which only a winding needs; give motor.winding too, or leave it out"
        if self.voltage_limit is not None:
            if self.rated_voltage is None:
                yield "has a voltage_limit, which also needs rated_voltage"
            if self.limits is not None and self.limits.max_voltage is not None:
                yield "has voltage_limit and limits.max_voltage, which say the same of a DC motor; give one"

    def _check_stepper(self) -> Iterator[str]:
        """A stepper has its own keys."""
        if self.kind != "stepper":
            self._refuse(STEPPER_KEYS, 'which only a motor of kind "stepper" has')
            return
        for key in ("steps_per_revolution", "holding_torque"):
            if getattr(self, key) is None:
                yield f'lacks {key}, which a motor of kind "stepper" needs'
        assert self.steps_per_revolution is not None
        assert self.holding_torque is not None
        if self.steps_per_revolution % 4.0 != 0.0:
            yield f"has steps_per_revolution = {self.steps_per_revolution:g}, which must be a multiple of 4: two phases make four steps in a period of the field"
        if self.supply_voltage is not None:
            for key in ("rated_current", "resistance_phase", "inductance_phase"):
                if getattr(self, key) is None:
                    yield f"lacks {key}, which its supply_voltage needs; leave supply_voltage out for an ideal current"
        if self.rated_torque != type(self).model_fields["rated_torque"].default:
            yield "has rated_torque, of no use to a stepper; give holding_torque"
        if self.detent_torque is not None and self.detent_torque >= self.holding_torque:
            yield f"has detent_torque = {self.detent_torque:g} N*m, which must be below its holding_torque, {self.holding_torque:g} N*m"
        if self.torque_error is not None:
            share = self.torque_error / self.holding_torque
            if not LEAST_TORQUE_ERROR <= share <= LARGEST_TORQUE_ERROR:
                yield f"has torque_error = {self.torque_error:g} N*m, which must be {LEAST_TORQUE_ERROR:g} to {LARGEST_TORQUE_ERROR:g} of its holding_torque"

    def _check_line(self) -> Iterator[str]:
        """Stall torque and no-load speed come together, in place of a rated point; so do the currents."""
        for one, other in (LINE_KEYS, LINE_KEYS[::-1], CURRENT_KEYS, CURRENT_KEYS[::-1]):
            if getattr(self, one) is not None and getattr(self, other) is None:
                yield f"has {one} without {other}; give both"
        if self.stall_torque is None:
            if self.stall_current is not None:
                yield "has stall_current and no_load_current, which belong to stall_torque and no_load_speed; give these"
            return
        self._refuse(POINT_KEYS, "which stall_torque and no_load_speed say")
        if "rated_torque" in self.model_fields_set and self.rated_torque >= self.stall_torque:
            yield f"has a rated_torque of {self.rated_torque:g} N*m, which must be below its stall_torque of {self.stall_torque:g} N*m"
        if self.stall_current is not None and self.no_load_current is not None:
            if self.no_load_current >= self.stall_current:
                yield f"has a no_load_current of {self.no_load_current:g} A, which must be below its stall_current of {self.stall_current:g} A"
            if "friction_torque" in self.model_fields_set:
                yield "has friction_torque and no_load_current, which say the same; give one of them"

    def _take_rated_point(self) -> None:
        """The rated point of (2) in place of stall torque and no-load speed, which are another way to write it.

        Without a rated torque it is the middle of the line. With the currents, the friction T is part of the line:
        k_M I_0 = T and k_M I_S = M_S + T, and the speed without friction is w_0/(1 - I_0/I_S).
        """
        if self.stall_torque is None or self.no_load_speed is None:
            return
        stall, speed, friction = self.stall_torque, self.no_load_speed, self.friction_torque
        if self.stall_current is not None and self.no_load_current is not None:
            friction = stall * self.no_load_current / (self.stall_current - self.no_load_current)
            stall += friction
            speed /= 1.0 - self.no_load_current / self.stall_current
        torque = self.rated_torque if "rated_torque" in self.model_fields_set else 0.5 * stall
        k_N = stall / torque
        point = {
            "rated_torque": torque,
            "friction_torque": friction,
            "armature_voltage_constant": k_N,
            "rated_speed": speed * (k_N - 1.0) / k_N,
            "electrical_time_constant": self.electrical_time_constant or 0.0,
        }
        line = (*LINE_KEYS, *CURRENT_KEYS)
        self.__dict__.update(point | dict.fromkeys(line))
        self.model_fields_set.update(point)
        self.model_fields_set.difference_update(line)

    def _refuse(self, keys: tuple[str, ...], why: str) -> None:
        idle = [key for key in keys if getattr(self, key) is not None]
        if idle:
            raise ValueError(f"has {', '.join(idle)}, {why}; leave {'it' if len(idle) == 1 else 'them'} out")

    def _check_synchronous(self, phase: PhaseValues) -> Iterator[str]:
        """Refuse keys that exclude a winding."""
        if self.kind == "dc":
            yield 'has a winding, which only a motor of kind "synchronous" or "torque_source" can have'
        if self.limits is not None:
            for key in (*SAID_BY_WINDING, "max_voltage"):
                if getattr(self.limits, key) is not None:
                    says = "dc_voltage" if key == "max_voltage" else "the winding"
                    yield f"has limits.{key}, which {says} says; leave it out"
        if self.kind == "synchronous":
            voltage = phase.resistance * self.rated_torque / phase.torque_constant
            if voltage >= self.phase_voltage:
                yield f"stalls under its rated torque: that takes {math.sqrt(3.0) * voltage:.4g} V of dc_voltage, and {self.dc_voltage:g} V are given"

    def __repr__(self) -> str:
        if self.kind == "stepper":
            rated = f"stepper, {self.steps_per_revolution:g} steps, {self.holding_torque:.4g} N·m"
        elif self.kind == "torque_source":
            rated = f"torque source, rated {self.rated_torque:.4g} N·m"
        else:
            speed = self.as_dc().rated_speed
            assert speed is not None
            rated = f"{self.kind}, {self.rated_torque:.4g} N·m at {practical(speed, 'rad/s', 4)}"
        return f"{type(self).__name__}({rated}, rotor {self.rotor_inertia:.4g} kg·m²)"

    @property
    def full_step(self) -> float:
        """Full step of a stepper [rad]."""
        assert self.steps_per_revolution is not None
        return 2.0 * math.pi / self.steps_per_revolution

    @property
    def phase_voltage(self) -> float:
        """Largest amplitude of a phase that the amplifier can give [V]."""
        assert self.dc_voltage is not None
        return self.dc_voltage / math.sqrt(3.0)

    def as_dc(self) -> Self:
        """The DC motor of (2) that a synchronous motor with ideal field orientation is; any other motor as it is.

        Command 1 is the voltage u_dc/sqrt(3) that the amplifier ends at. The voltage of the decoupling, which has no part in the
        torque, is not limited: `motor_current` and the drive check show where it would be too much.
        """
        if self.kind != "synchronous":
            return self
        assert self.winding is not None
        voltage = self.phase_voltage
        tau_a, k_N, speed = self.winding.phase_values().direct_current(voltage, self.rated_torque)
        return self.model_copy(
            update={
                "kind": "dc",
                "rated_voltage": voltage,
                "voltage_limit": voltage,
                "rated_speed": speed,
                "electrical_time_constant": tau_a,
                "armature_voltage_constant": k_N,
                "winding": None,
                "dc_voltage": None,
            }
        )

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core of a motor that is not synchronous, in SI units, without the fields that are None."""
        fields = super().core_fields() | {"kind": self.kind, "command_limit": self.command_limit}
        if self.kind == "stepper" and self.torque_error is None:
            assert self.holding_torque is not None
            fields["torque_error"] = USUAL_TORQUE_ERROR * self.holding_torque
        return fields

    def copper_loss(self) -> tuple[float, float] | None:
        """Heat of the winding to a torque squared [W/(N·m)²], and the temperature [°C] that it holds at; None if it is not known."""
        if self.winding is not None:
            return self.winding.phase_values().copper_loss, self.winding.resistance_temperature
        limits = self.limits
        if limits is None or limits.resistance is None or limits.torque_constant is None:
            return None
        return limits.resistance / (limits.torque_constant * limits.torque_constant), 25.0

    def held_loss(self) -> float | None:
        """Heat of both phases of a stepper at its rated current, 2 R I² [W]; None if it is not known."""
        if self.resistance_phase is None or self.rated_current is None:
            return None
        return 2.0 * self.resistance_phase * self.rated_current * self.rated_current

    @property
    def unloaded_speed(self) -> float:
        """Speed [rad/s] at command 1 without any load or friction, by (2)."""
        dc = self.as_dc()
        if dc.rated_speed is None or dc.armature_voltage_constant is None:
            raise InputError("a torque source has no speed of its own")
        return dc.rated_speed * dc.armature_voltage_constant / (dc.armature_voltage_constant - 1.0)

    @property
    def command_limit(self) -> float | None:
        """|E_C| that the amplifier can follow; None without a limit."""
        if self.kind == "synchronous":
            return 1.0
        if self.voltage_limit is None or self.rated_voltage is None:
            return None
        return self.voltage_limit / self.rated_voltage

    def torque_line(self) -> tuple[float, float] | None:
        """Largest torque [N·m] at standstill and its fall with the speed [N·m·s/rad], at the largest voltage of the amplifier.

        None where no voltage is stated that a run keeps to.
        """
        if self.winding is not None and self.dc_voltage is not None:
            phase = self.winding.phase_values()
            per_volt = phase.torque_constant / phase.resistance
            return per_volt * self.phase_voltage, per_volt * phase.voltage_constant
        if self.kind != "dc" or self.command_limit is None:
            return None
        k_N, w_R = self.armature_voltage_constant, self.rated_speed
        assert k_N is not None and w_R is not None  # noqa: PT018
        return self.rated_torque * k_N * self.command_limit, self.rated_torque * (k_N - 1.0) / w_R

    @property
    def largest_torque(self) -> float:
        """Torque [N·m] that the largest current of the winding makes with i_d = 0; infinite where none is stated."""
        current = None if self.winding is None else self.winding.max_current
        if current is None or self.winding is None:
            return math.inf
        return self.winding.phase_values().torque_constant * math.sqrt(2.0) * current

    @checked
    def at_voltage(self, voltage: Voltage) -> Self:
        """The same DC motor where command 1 is another voltage [V].

        Stall torque M_DR k_N and no-load speed omega_DR k_N/(k_N - 1) of (2) are proportional to the voltage. The
        rated torque, which heat limits, and the time constant stay.

        Raises
        ------
        InputError
            The motor has no rated voltage, or at this voltage it does not reach its rated torque.
        """
        if self.kind == "synchronous":
            raise InputError(
                "a synchronous motor has its voltage from dc_voltage; change that, as with model_copy(update={'dc_voltage': 560})"
            )
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
        speed = share * self.unloaded_speed * (k_N - 1.0) / k_N
        return self.model_copy(
            update={"rated_voltage": voltage, "armature_voltage_constant": k_N, "rated_speed": speed}
        )


class ShaftMotor(ShaftMotorFields, Motor):
    """A motor on a shaft of a drive train.

    Examples
    --------
    >>> import lostmotion as lm
    >>> motor = lm.ShaftMotor(shaft="motor", kind="torque_source", rotor_inertia="1 kg*cm^2", rated_torque="1 N*m")
    >>> motor.shaft
    'motor'
    """

    shaft: str
    """shaft that the motor turns"""

    @property
    def largest_torque(self) -> float:
        """The smaller of torque_limit and of what the largest current makes [N·m]."""
        largest = super().largest_torque
        return largest if self.torque_limit is None else min(largest, self.torque_limit)

    def without_torque_limits(self) -> Self:
        """The same motor without torque_limit and largest current."""
        none = {"max_current_rms": None, "max_current_peak": None}
        winding = None if self.winding is None else self.winding.model_copy(update=none)
        return self.model_copy(update={"torque_limit": None, "winding": winding})

    @rule
    def _limit_fits_kind(self) -> Iterator[str]:
        if self.torque_limit is not None and self.kind != "torque_source":
            yield f'has a torque_limit, which a motor of kind "{self.kind}" does not; give {"voltage_limit" if self.kind == "dc" else "dc_voltage"}, or the kind "torque_source"'
