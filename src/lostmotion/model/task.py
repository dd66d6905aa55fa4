"""Task of a drive: the duty cycle and the requirements that the drive check compares with."""

from ..inputs import described
from .duty import Amplifier, Bus, HoldingBrake


class Task(described.TaskFields, described.TrainTaskFields):
    """Cycle, surroundings and requirements of a drive. No run depends on them; the drive check compares with them."""

    supply: Bus | None = None
    """DC bus that feeds all motors, and takes what they return"""
    amplifier: Amplifier | None = None
    """amplifier that feeds the motor, also as the name of a record; for one motor"""
    brake: HoldingBrake | None = None
    """holding brake on the motor, also as the name of a record, or "of the motor"; or on the slide, with a force"""
