"""Selection of a study: the table `[select]` of its file."""

from typing import Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from ..inputs.part import Part
from ..inputs.quantities import Switch
from ..simulation.scenario.units_of_keys import in_si
from ..sizing.finding import RULES, TASK_RULES

Direction = Literal["least", "largest"]

USE = "use of "  # begins the columns of the drive check: the share of each limit that is used
SHARES = tuple(rule for rule in RULES if rule not in ("resonance", "dead_zone", "holding", "loss_map"))
"""rules of the drive check that compare a value with a limit"""
TASK_SHARES = (*SHARES, *TASK_RULES)  # the same of tasks


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

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if self.min is None and self.max is None:
            raise ValueError("needs min or max")
        return self

    def in_unit(self, unit: str) -> tuple[float, float]:
        """(minimum, maximum) permissible value in the unit of a column, ``"1"`` of a plain number; empty: not known, any is taken in SI.

        Raises ValueError: a value has the unit of something else.
        """
        low, high = (in_si(value, {"1": "", "": None}.get(unit, unit)) for value in (self.min, self.max))
        return (-float("inf") if low is None else float(low), float("inf") if high is None else float(high))


class Selection(Part):
    """Runs that fit the task, and the best of these."""

    objectives: dict[str, Direction] = Field(min_length=1)
    """columns, each to be least or largest; the first ranks the runs, the first two make the Pareto plot"""
    limits: dict[str, Bound] = Field(default={})  #: columns and their permissible values
    drive_check: Switch = True  #: each run must also pass the drive check

    def named(self) -> tuple[str, ...]:
        """All columns that it names."""
        return (*self.objectives, *self.limits)

    def direction(self, column: str) -> float:
        """+1 where less is better, -1 where more is."""
        return 1.0 if self.objectives[column] == "least" else -1.0


def check_bounds(selection: Selection, units: dict[str, str]) -> None:
    """Sees that the limits can be read in the units of their columns. Raises ValueError."""
    for column, bound in selection.limits.items():
        try:
            low, high = bound.in_unit(units.get(column, ""))
        except ValueError as error:
            raise ValueError(f"select.limits.{column}: {error}") from None
        if low > high:
            raise ValueError(f"select.limits.{column}: min {low:g} is above max {high:g}")
