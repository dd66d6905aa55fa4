"""Task of a drive: the duty cycle and the requirements that the drive check compares with."""

from typing import Annotated

from ..inputs.part import Part
from ..inputs.quantities import Angle, Positive, Switch, Temperature, Time
from .process_loads import Amplifier, Bus, HoldingBrake


class Task(Part):
    """Cycle, surroundings and requirements of a drive. No run depends on them; the drive check compares with them."""

    cycle: Annotated[Time, Positive] | None = None
    """period after which the motion of the run repeats, pause included; left out, it repeats without a pause"""
    ambient_temperature: Temperature = 25.0  #: temperature of the surroundings
    max_lost_motion: Annotated[Angle, Positive] | None = None
    """largest permissible lost motion at 3 % of the rated torque, total at the output"""
    hold_without_power: Switch = True
    """whether the load must stay at rest against its torque with command 0; false where a brake or a controller holds it"""
    supply: Bus | None = None  #: DC bus that feeds all motors, and takes what they return
    amplifier: Amplifier | None = None  #: amplifier that feeds the motor, also as the name of a record; for one motor
    brake: HoldingBrake | None = None
    """holding brake on the motor, also as the name of a record, or "of the motor"; or on the slide, with a force"""
