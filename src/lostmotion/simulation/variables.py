"""The one list of result variables. Everything that names a variable is made from it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

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
"""those of a motor, a gearbox and a load"""
CHANNEL_NAMES = tuple(v.name for v in VARIABLES if not v.derived)
STATES = tuple(_core.states())


def gear_efficiency(data: dict[str, Any], ratio: Any) -> Any:
    """Useful torque / torque fed in [-], by the direction of the load; NaN where the input shaft is at rest.

    Driving (T_2 has the sign of w_M i) it is T_2/(i T_1), overrunning i T_1/T_2; 0 where both sides feed the losses.
    """
    way = np.sign(data["motor_speed"])
    driving = data["output_torque"] * way * np.copysign(1.0, ratio)
    fed_in = np.abs(ratio) * data["input_torque"] * way
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        eta = np.where(driving >= 0.0, driving / fed_in, np.where(fed_in < 0.0, fed_in / driving, 0.0))
    return np.where(data["motor_speed"] == 0.0, np.nan, eta)
