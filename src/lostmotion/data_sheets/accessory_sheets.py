"""Data sheets of what belongs to a servo motor: its holding brake and its amplifier."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..inputs.quantities import (
    Current,
    Frequency,
    Inertia,
    NotNegative,
    Positive,
    Power,
    Resistance,
    Time,
    Torque,
    Voltage,
    Whole,
)
from .sheet import Record


class BrakeSheet(Record):
    """Data sheet of a holding brake on the shaft of a motor.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.data_sheets.BrakeSheet(name="my-brake", holding_torque="2 N*m").missing()
    {}
    """

    kind: Literal["holding_brake"] = "holding_brake"
    holding_torque: Annotated[Torque, Positive] | None = None  #: static, that it holds
    inertia: Annotated[Inertia, NotNegative] | None = None  #: inertia of its rotor, on the shaft of the motor
    engage_time: Annotated[Time, Positive] | None = None  #: from switching off the coil until it holds
    release_time: Annotated[Time, Positive] | None = None  #: from switching on the coil until the shaft is free
    rated_voltage: Annotated[Voltage, Positive] | None = None
    power: Annotated[Power, Positive] | None = None
    coil_resistance: Annotated[Resistance, Positive] | None = None  #: at 20 °C
    motors: tuple[str, ...] = ()  #: names of the records of motors that it is built into

    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {"holding_torque": ("holding_torque",)}

    def assumptions(self) -> tuple[str, ...]:
        """Assumptions beyond the data, one sentence each."""
        return () if self.inertia is not None else (f"The inertia of {self.name} is not given and taken as 0.",)


class AmplifierSheet(Record):
    """Data sheet of a servo amplifier. Currents are effective values.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.data_sheets.AmplifierSheet(name="my-amplifier", continuous_current="7 A", peak_current="15 A").missing()
    {}
    """

    kind: Literal["servo_amplifier"] = "servo_amplifier"
    axes: Annotated[Whole, Field(ge=1)] = 1
    continuous_current: Annotated[Current, Positive] | None = None  #: continuous current of each axis
    total_current: Annotated[Current, Positive] | None = None  #: continuous current of all axes together
    peak_current: Annotated[Current, Positive] | None = None  #: peak current of each axis
    peak_time: Annotated[Time, Positive] | None = None  #: longest time above the continuous current
    max_dc_voltage: Annotated[Voltage, Positive] | None = None  #: largest voltage of the DC bus
    mains: str = ""  #: supply of an amplifier with a rectifier of its own
    losses: Annotated[Power, Positive] | None = None
    switching_frequency: Annotated[Frequency, Positive] | None = None

    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {"continuous_current": ("continuous_current",)}
