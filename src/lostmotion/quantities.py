"""Types of the fields of parts: SI numbers that may be written as strings with a unit."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from .units import Unit

Number = Annotated[float, Unit("")]
Torque = Annotated[float, Unit("N*m")]
Inertia = Annotated[float, Unit("kg*m^2")]
Speed = Annotated[float, Unit("rad/s")]
Angle = Annotated[float, Unit("rad")]
Time = Annotated[float, Unit("s")]
Frequency = Annotated[float, Unit("Hz")]
Voltage = Annotated[float, Unit("V")]
Stiffness = Annotated[float, Unit("N*m/rad")]
ViscousFriction = Annotated[float, Unit("N*m*s/rad")]

Positive = Field(gt=0)
NotNegative = Field(ge=0)


class Part(BaseModel):
    """Immutable; unknown keys, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)
