"""The data sheet of a motor, and the motor that follows from it."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from ..errors import InputError
from ..inputs.part import rule
from ..inputs.quantities import (
    Current,
    Inductance,
    Inertia,
    Limit,
    NotNegative,
    Number,
    Positive,
    Resistance,
    Speed,
    Time,
    Torque,
    TorqueConstant,
    Voltage,
    Whole,
)
from ..model.motor import SAID_BY_WINDING, Motor, MotorHeat, MotorLimits
from ..model.synchronous_motor import Winding
from .sheet import Record

# At which level the data of a record let it run, from all to little.
SYNCHRONOUS, DC_EQUIVALENT, TORQUE_SOURCE = "synchronous motor", "DC-equivalent motor", "torque source"
STEPPER = "stepper"
# What of a brushless motor with block commutation the winding of a synchronous one says in its own ways.
BLOCK_KEYS = ("rated_voltage", "torque_constant", "resistance", "inductance", "pole_pairs")
# Data of a stepper alone, and data that it shares with other motors.
STEPPER_DATA = ("steps_per_revolution", "holding_torque", "detent_torque", "resistance_phase", "inductance_phase")
SHARED_DATA = ("rotor_inertia", "rated_current", "friction_torque", "max_inertia_ratio", "max_speed")


class MotorSheet(MotorHeat, Record):
    """Data sheet of a DC motor, of a brushless one seen from its supply as a DC motor, of a synchronous one, or of a stepper."""

    kind: Literal["dc_brushed", "brushless", "synchronous", "stepper"] = "dc_brushed"
    """brushless: constants with block commutation, from terminal to terminal; synchronous: constants of `winding`"""
    rated_voltage: Annotated[Voltage, Positive] | None = None
    rotor_inertia: Annotated[Inertia, Positive] | None = None
    rated_torque: Annotated[Torque, Positive] | None = None
    """at the shaft, continuous; with armature_voltage_constant that of the field"""
    rated_speed: Annotated[Speed, Positive] | None = None
    peak_torque: Annotated[Torque, Positive] | None = None  #: at the shaft, for seconds, as in acceleration
    rated_current: Annotated[Current, Positive] | None = None
    no_load_speed: Annotated[Speed, Positive] | None = None
    no_load_current: Annotated[Current, Positive] | None = None
    stall_torque: Annotated[Torque, Positive] | None = None
    stall_current: Annotated[Current, Positive] | None = None
    torque_constant: Annotated[TorqueConstant, Positive] | None = None
    resistance: Annotated[Resistance, Positive] | None = None  #: terminal, at 25 °C
    inductance: Annotated[Inductance, Positive] | None = None
    pole_pairs: Annotated[Whole, Field(gt=0)] | None = None  #: pole pairs of a brushless motor
    winding: Winding | None = None  #: winding of a synchronous motor
    dc_voltage: Annotated[Voltage, Positive] | None = None  #: dc voltage of the amplifier of a synchronous motor
    friction_torque: Annotated[Torque, NotNegative] | None = None
    armature_voltage_constant: Annotated[Number, Limit(gt=1.0)] | None = None  #: k_N, where it is known itself
    electrical_time_constant: Annotated[Time, Positive] | None = None
    max_speed: Annotated[Speed, Positive] | None = None
    max_inertia_ratio: Annotated[Number, Positive] | None = None
    """largest inertia of the load relative to the rotor's inertia"""
    steps_per_revolution: Annotated[Number, Positive] | None = None  #: full steps of a stepper
    holding_torque: Annotated[Torque, Positive] | None = None  #: of a stepper, with rated_current in both phases
    detent_torque: Annotated[Torque, NotNegative] | None = None  #: of a stepper without current
    resistance_phase: Annotated[Resistance, Positive] | None = None  #: of a phase of a stepper
    inductance_phase: Annotated[Inductance, Positive] | None = None  #: of a phase of a stepper

    @rule
    def _fits_kind(self) -> Iterator[str]:
        given = set(self.given()) - {"total_mass", "overall_length", "price", "lead_time"}
        if self.kind == "stepper":
            if idle := sorted(given - {*STEPPER_DATA, *SHARED_DATA}):
                yield f"has {idle[0]}, which a stepper has no use for; leave it out"
            return
        if idle := sorted(given & set(STEPPER_DATA)):
            yield f'has {idle[0]}, which only a motor of kind "stepper" has; leave it out'
        if self.kind != "synchronous":
            if self.winding is not None:
                yield 'has a winding, which only a motor of kind "synchronous" has'
            if self.rated_voltage is None:
                yield "lacks rated_voltage, at which its data hold"
        elif idle := [key for key in BLOCK_KEYS if getattr(self, key) is not None]:
            own = "torque_constant_rms or torque_constant_peak" if idle[0] == "torque_constant" else "its data"
            yield f'has {idle[0]}; a motor of kind "synchronous" has [motor.winding] with {own}, and dc_voltage'

    def missing(self) -> dict[str, str]:
        """Data that a run requires and the record lacks."""
        need = {"rotor_inertia": self.rotor_inertia}
        if self.kind == "stepper":
            need |= {"steps_per_revolution": self.steps_per_revolution, "holding_torque": self.holding_torque}
        else:
            need["rated_torque"] = self.rated_torque or (self.rated_current and self.torque_constant)
        return {key: f"see {self.where(key)}" for key, value in need.items() if not value}

    def level(self) -> str | None:
        """Level of a run with these data: ``"synchronous motor"``, ``"DC-equivalent motor"``, ``"torque source"``, ``"stepper"``, or None."""
        if self.missing():
            return None
        if self.kind == "stepper":
            return STEPPER
        if self.kind == "synchronous":
            return SYNCHRONOUS if self.winding is not None and self.dc_voltage is not None else TORQUE_SOURCE
        constants = self.torque_constant is not None and self.resistance is not None
        return DC_EQUIVALENT if constants or self.armature_voltage_constant is not None else TORQUE_SOURCE

    def lacks_phases(self) -> bool:
        """Whether the heat of the phases of a stepper is not known."""
        return self.kind == "stepper" and None in (self.resistance_phase, self.rated_current)

    def _assumed(self) -> dict[str, str]:
        level, out = self.level(), {}
        if level == TORQUE_SOURCE:
            lacks = "its dc voltage is not given" if self.winding is not None else "its winding is not given"
            out["kind"] = f"{self.name} runs as a torque source, since {lacks}: voltage and current are not judged."
        if self.friction_torque is None and (self.no_load_current is None or self.torque_constant is None):
            out["friction_torque"] = f"The friction of {self.name} is not given and taken as 0."
        if level == STEPPER and self.detent_torque is None:
            out["detent_torque"] = f"The detent torque of {self.name} is not given and taken as 0."
        if level == DC_EQUIVALENT and self.electrical_time_constant is None and self.inductance is None:
            out["electrical_time_constant"] = f"The inductance of {self.name} is not given and taken as 0."
        return out

    def motor(self) -> Motor:
        """Parameters of eq. (2), or of the synchronous motor.

        The rated point and the stall torque of the sheet are kept. So no-load speed is a result; manufacturers' data are
        often not consistent with each other, and `no_load_speed_of_model` says by how much.
        """
        self._need_all()
        level = self.level()
        if level == STEPPER:
            return self._stepper()
        if level == SYNCHRONOUS:
            return self._synchronous(self.winding, self.dc_voltage, self.rated_torque, self._friction())
        if level == TORQUE_SOURCE:
            return self._torque_source()
        k_t, R = self.torque_constant, self.resistance
        M_DR, k_N, speed = self._field_torque(), self.armature_voltage_constant, self.rated_speed
        assert self.rated_voltage is not None
        if k_N is None:
            assert k_t is not None
            assert R is not None
            stall = self.stall_torque if self.stall_torque is not None else k_t * self.rated_voltage / R
            k_N = stall / M_DR
            if speed is None:
                speed = (self.rated_voltage - R * M_DR / k_t) / k_t
        tau = self.electrical_time_constant
        if tau is None:
            tau = 0.0 if self.inductance is None or R is None else self.inductance / R
        return Motor(
            rotor_inertia=self.rotor_inertia,  # type: ignore[arg-type]  # not missing
            friction_torque=self._friction(),
            rated_torque=M_DR,
            rated_speed=speed,
            rated_voltage=self.rated_voltage,
            electrical_time_constant=tau,
            armature_voltage_constant=k_N,
            limits=self._limits(M_DR, resistance=R, torque_constant=k_t),
            note=self._notes(),
        )

    def _stepper(self) -> Motor:
        data = {key: getattr(self, key) for key in ("rotor_inertia", "rated_current", *STEPPER_DATA)}
        given = {key: value for key, value in data.items() if value is not None}
        limits = MotorLimits(max_speed=self.max_speed, max_inertia_ratio=self.max_inertia_ratio)
        return Motor(
            kind="stepper",
            friction_torque=self._friction(),
            limits=None if limits == MotorLimits() else limits,
            note=self._notes(),
            **given,
        )

    def _torque_source(self) -> Motor:
        torque = self._field_torque()
        return Motor(
            kind="torque_source",
            rotor_inertia=self.rotor_inertia,  # type: ignore[arg-type]  # not missing
            friction_torque=self._friction(),
            rated_torque=torque,
            winding=self.winding,
            limits=self._limits(torque),
            note=self._notes(),
        )

    def synchronous(self) -> Motor:
        """A brushless motor with field orientation in place of block commutation, its rated voltage as the dc voltage.

        Resistance and inductance of a sheet are those between two terminals. The torque constant is the one of block
        commutation, (3 sqrt(3)/pi) p psi. The voltage is taken to be sinusoidal.

        Raises
        ------
        InputError
            The record is one of a motor with brushes, or lacks something.
        """
        if self.kind in ("dc_brushed", "stepper"):
            what = "has brushes" if self.kind == "dc_brushed" else "is a stepper"
            raise InputError(f"{self.name}: {what}, and cannot be of kind synchronous")
        self._need_all()
        if self.kind == "synchronous":
            for key in ("winding", "dc_voltage"):
                if getattr(self, key) is None:
                    raise InputError(f"lacks {key}; see {self.where(key)}", where=self.name)
            return self.motor()
        for key in ("pole_pairs", "torque_constant", "resistance", "inductance"):
            if getattr(self, key) is None:
                raise InputError(
                    f"lacks {key}, which a synchronous motor needs; see {self.where(key)}", where=self.name
                )
        winding = Winding(
            pole_pairs=self.pole_pairs,
            resistance_line_to_line=self.resistance,
            inductance_line_to_line=self.inductance,
            torque_constant_block=self.torque_constant,
        )
        return self._synchronous(winding, self.rated_voltage, self._field_torque(), self._friction())

    def _need_all(self) -> None:
        if missing := self.missing():
            key, where = next(iter(missing.items()))
            raise InputError(f"lacks {key}; {where}", where=self.name)

    def _friction(self) -> float:
        """T_10 [N·m]."""
        if self.friction_torque is not None:
            return self.friction_torque
        if self.torque_constant is None or self.no_load_current is None:
            return 0.0
        return self.torque_constant * self.no_load_current

    def _field_torque(self) -> float:
        """M_DR [N·m]: the torque of the shaft plus the friction."""
        if self.rated_torque is not None:
            return self.rated_torque + (self._friction() if self.armature_voltage_constant is None else 0.0)
        assert self.torque_constant is not None
        assert self.rated_current is not None
        return self.torque_constant * self.rated_current

    def _synchronous(
        self, winding: Winding | None, dc_voltage: float | None, torque: float | None, friction: float | None
    ) -> Motor:
        return Motor(
            kind="synchronous",
            rotor_inertia=self.rotor_inertia,  # type: ignore[arg-type]  # not missing
            friction_torque=friction,  # type: ignore[arg-type]
            rated_torque=torque,  # type: ignore[arg-type]
            winding=winding,
            dc_voltage=dc_voltage,
            limits=self._limits(torque),
            note=self._notes(),
        )

    def _limits(self, torque: float | None, **constants: float | None) -> MotorLimits:
        same = (
            key for key in MotorLimits.model_fields if key in type(self).model_fields and key not in SAID_BY_WINDING
        )
        return MotorLimits(continuous_torque=torque, **{key: getattr(self, key) for key in same}, **constants)

    def no_load_speed_of_model(self) -> float:
        """[rad/s], where the speed-torque line of eq. (2) at rated voltage meets the friction torque."""
        m = self.motor()
        assert m.armature_voltage_constant is not None
        assert m.rated_speed is not None
        k = m.armature_voltage_constant
        return m.rated_speed * (k - m.friction_torque / m.rated_torque) / (k - 1.0)
