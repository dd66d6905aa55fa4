"""Mass, length, price and lead time of a candidate of a task: sums over the data sheets of its parts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ...data_sheets.records import Sheet
from ..finding import Finding, within
from ..whole_drives import WHOLE

DAY = 86400.0  # [s]


@dataclass(frozen=True)
class Quantity:
    """One quantity of the choice."""

    key: str  # key of a record
    limit: str  # key of the task that limits it
    what: str
    unit: str  # unit of the column
    shown: tuple[str, float]  # unit in messages, and how many of the column's unit one is
    stage: bool = True  # whether the last stage of a linear axis counts
    latest: bool = False  # whether the largest of the parts counts, and not their sum


CHOICE = {
    "mass": Quantity("total_mass", "max_mass", "mass of the parts", "kg", ("kg", 1.0)),
    "length": Quantity("overall_length", "max_length", "motor and gearbox in line", "m", ("mm", 1e-3), stage=False),
    "price": Quantity("price", "max_price", "price of the parts", "1", ("", 1.0)),
    "lead_time": Quantity("lead_time", "max_lead_time", "latest delivery", "s", ("days", DAY), latest=True),
}
"""by column"""


def value_of(column: str, records: Mapping[str, Sheet]) -> tuple[float, list[str]]:
    """A quantity of the choice over the records of a candidate, by their kinds, and the kinds that lack it (the value is NaN then)."""
    quantity = CHOICE[column]
    values = {
        kind: getattr(record, quantity.key)
        for kind, record in records.items()
        if quantity.stage or kind in ("motor", "gearbox", *WHOLE)
    }
    lacking = [kind for kind, value in values.items() if value is None]
    if lacking or not values:
        return math.nan, lacking
    return (max if quantity.latest else sum)(values.values()), []


def lacks(column: str, kinds: list[str], wanted_by: str) -> str:
    """Text on records that lack a quantity that a task needs."""
    which = " and ".join(kind.replace("_", " ") for kind in kinds)
    key = CHOICE[column].key
    return f"the sheet of the {which} lacks {key}, which {wanted_by} needs; give {key} in that sheet"


def judged(column: str, value: float, limit: float) -> Finding:
    """A quantity of the choice against the limit of the task."""
    quantity = CHOICE[column]
    unit, size = quantity.shown
    found = within(column, quantity.what, value / size, limit / size, unit, f"limit {quantity.limit} of the task")
    return replace(found, value=found.value.strip())
