"""The one list of result variables. Everything that names a variable is made from it."""

from __future__ import annotations

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


# Those that are read from the core are named by its own table (core/lostmotion/simulation/channels.hpp).
CHANNELS = tuple(Variable(*row) for row in _core.channels())
VARIABLES = (
    *CHANNELS,
    Variable(
        "efficiency",
        "eta",
        "1",
        "useful torque / torque fed in, by the direction of the load; "
        "0 where both sides feed the losses, undefined at standstill",
        derived=True,
    ),
    Variable("motor_power", "p", "W", "mechanical power of the motor", derived=True),
)

CHANNEL_NAMES = tuple(v.name for v in CHANNELS)
CONTACTS = tuple(name for name in CHANNEL_NAMES if name.endswith("_contact"))
STATES = tuple(_core.states())
