"""Parameters of an identification: start values, bounds, scales and priors."""

import math
from typing import Any, Self

from pydantic import model_validator

from ...inputs.part import Part
from ...inputs.quantities import Number
from ...units.conversion import si_factor, si_value


def in_unit(value: Any, unit: str, key: str = "") -> float | None:
    """A number in SI, or text with a unit of the kind of `unit`, in SI. Raises ValueError, which names the key if there is one."""
    given = f"has {key} = {value!r}" if key else repr(value)
    if value is None or (isinstance(value, int | float) and not isinstance(value, bool)):
        return None if value is None else float(value)
    if not isinstance(value, str):
        raise ValueError(f"{given}; give a number in SI, or text with a unit")
    try:
        return si_value(value, unit) * si_factor(unit)
    except ValueError as problem:
        raise ValueError(f"{given}, which {problem}") from None


class FreeParameter(Part):
    """One number that is sought. Values are in SI, or text with a unit."""

    start: Number  #: from which the search begins; with a prior, its mean
    min: Number = 0.0  #: least value
    max: Number = math.inf  #: largest value
    unit: str = ""
    """unit in which results show it, whose kind its texts have; numbers in the file are in SI all the same"""
    scale: Number | None = None
    """a change that matters; left out, a tenth of the start value, or of the range where that is 0"""
    tolerance: Number | None = None
    """with a prior: of the catalogue value `start`, within which it lies with 95 % probability; left out, there is no prior"""
    off: Number | None = None  #: value in candidate models in which it is not free; left out, the start value
    fixed: bool = False  #: stays at its start value
    logarithmic: bool = False  #: sought by its logarithm, for what is positive and known to an order of magnitude

    model_config = Part.model_config | {"allow_inf_nan": True}

    @model_validator(mode="before")
    @classmethod
    def _read_units(cls, data: Any) -> Any:
        if isinstance(data, int | float | str):
            data = {"start": data, "fixed": True}
        if not isinstance(data, dict):
            return data
        unit = str(data.get("unit", ""))
        read = dict(data)
        for key in ("start", "min", "max", "scale", "tolerance", "off"):
            if isinstance(data.get(key), str):
                if not unit:
                    raise ValueError(f'has {key} = {data[key]!r} but no unit; add unit, such as unit = "N*m"')
                read[key] = in_unit(data[key], unit, key)
        return read

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if not self.min < self.max:
            raise ValueError(f"has min = {self.min:g}, which is not below max = {self.max:g}")
        if not self.fixed and not self.min <= self.start <= self.max:
            raise ValueError(
                f"has start = {self.start:g} outside of {self.min:g} to {self.max:g}; move it, or widen the range"
            )
        for key in ("scale", "tolerance"):
            value = getattr(self, key)
            if value is not None and not value > 0.0:
                raise ValueError(f"has {key} = {value:g}; it must be positive")
        if self.logarithmic and not (self.start > 0.0 and self.min > 0.0):
            raise ValueError("is logarithmic, so start and min must be positive")
        try:
            si_factor(self.unit)
        except ValueError as problem:
            raise ValueError(f"has unit = {self.unit!r}, which {problem}") from None
        return self

    def shown(self, value: float) -> str:
        """A value [SI] in its unit, to five figures."""
        return f"{value / si_factor(self.unit):.5g}"

    @property
    def step(self) -> float:
        """A change of the value that matters."""
        if self.scale is not None:
            return self.scale
        if self.start != 0.0:
            return 0.1 * abs(self.start)
        span = self.max - self.min
        return 0.1 * span if math.isfinite(span) else 1.0

    @property
    def deviation(self) -> float | None:
        """Standard deviation of the prior."""
        return None if self.tolerance is None else self.tolerance / 1.96
