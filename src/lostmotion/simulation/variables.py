"""The one list of result variables. Everything that names a variable is made from it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Variable:
    """One result variable."""

    name: str
    symbol: str
    unit: str  # SI; "1" for pure numbers
    meaning: str
    derived: bool = False  # computed from the others, not read from the solver


# Those that are read from the solver stand in the order of its channels (core/lostmotion/simulation/reader.hpp).
VARIABLES = (
    Variable("command", "E_C", "1", "control signal, relative armature voltage"),
    Variable("load_torque", "M_Z", "N*m", "disturbance torque on the load"),
    Variable("motor_torque", "M_D", "N*m", "torque of the motor"),
    Variable("motor_speed", "w_M", "rad/s", "speed of rotor and input shaft"),
    Variable("load_speed", "w", "rad/s", "speed of the load"),
    Variable("load_angle", "phi", "rad", "angle of the load"),
    Variable("twist", "d", "rad", "torsion of the gearbox, input angle / ratio - output angle"),
    Variable("output_torque", "T_2", "N*m", "torque of the gearbox on the load"),
    Variable("input_torque", "T_1", "N*m", "torque of the gearbox on the input shaft"),
    Variable("loss_coefficient", "m_2B", "1", "torque lost in the gearbox, at the output, / rated output torque"),
    Variable("input_contact", "", "1", "input shaft: +1 or -1 slipping, 0 stuck"),
    Variable("twist_contact", "", "1", "twist: +1 or -1 slipping, 0 stuck"),
    Variable("load_contact", "", "1", "load bearing: +1 or -1 slipping, 0 stuck"),
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

CHANNELS = tuple(v for v in VARIABLES if not v.derived)
CHANNEL_NAMES = tuple(v.name for v in CHANNELS)
CONTACTS = ("input_contact", "twist_contact", "load_contact")

# Names of the five states, in the order of the solver's state vector (core/lostmotion/variables.hpp).
STATES = ("motor_torque", "motor_speed", "load_speed", "twist", "load_angle")
