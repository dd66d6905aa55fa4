"""Selection of a study: the table `[select]` of its file."""

from typing import Literal

from pydantic import Field

from ...inputs.part import Part
from ...inputs.quantities import Switch
from ...sizing.axis_task.column_bounds import Bound
from ...sizing.finding import RULES, TASK_RULES, WITHOUT_SHARE

Direction = Literal["least", "largest"]

USE = "use of "  # begins the columns of the drive check: the share of each limit that is used
SHARES = tuple(rule for rule in RULES if rule not in WITHOUT_SHARE)
"""rules of the drive check that compare a value with a limit"""
TASK_SHARES = (*SHARES, *TASK_RULES)  # the same of tasks


class Selection(Part):
    """Runs that fit the task, and the best of these."""

    objectives: dict[str, Direction] = Field(min_length=1)
    """columns, each to be least or largest; the first ranks the runs, the first two make the Pareto plot"""
    limits: dict[str, Bound] = Field(default={})  #: columns and their permissible values
    drive_check: Switch = True  #: each run must also pass the drive check

    def named(self) -> tuple[str, ...]:
        """Columns that the table names."""
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
