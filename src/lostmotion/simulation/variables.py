"""The one list of result variables. Everything that names a variable is made from it."""

from collections.abc import Iterable
from dataclasses import dataclass

from .. import _core


@dataclass(frozen=True)
class Variable:
    """One result variable."""

    name: str
    symbol: str
    unit: str  # SI; "1" for pure numbers
    meaning: str
    derived: bool = False  # computed from the others, not read from the solver


def variables_of_core(rows: Iterable[tuple[str, str, str, str, bool]]) -> tuple[Variable, ...]:
    """The variables that the core names (core/lostmotion/scenario/variables.cpp)."""
    return tuple(Variable(*row) for row in rows)


VARIABLES = variables_of_core(_core.variables())
"""names for a motor, a gearbox and a load"""
