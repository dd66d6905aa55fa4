"""Permissible values of a column of a study or a task."""

from collections.abc import Iterator
from typing import Any

from pydantic import field_validator

from ...inputs.part import Part, rule
from ...simulation.scenario.units_of_keys import in_si


class Bound(Part):
    """Permissible values of a column, in its unit."""

    min: float | str | None = None
    max: float | str | None = None

    @field_validator("min", "max", mode="before")
    @classmethod
    def _no_boolean(cls, value: Any) -> Any:
        if isinstance(value, bool):
            raise ValueError(f"{str(value).lower()} is not a number")
        return value

    @rule
    def _says_something(self) -> Iterator[str]:
        if self.min is None and self.max is None:
            yield "needs min or max"

    def in_unit(self, unit: str) -> tuple[float, float]:
        """(minimum, maximum) permissible value in the unit of a column, ``"1"`` of a plain number; empty: not known, any is taken in SI.

        Raises ValueError: a value has the unit of something else.
        """
        low, high = (in_si(value, {"1": "", "": None}.get(unit, unit)) for value in (self.min, self.max))
        return (-float("inf") if low is None else float(low), float("inf") if high is None else float(high))
