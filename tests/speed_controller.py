"""A position and speed loop as an FMU of its own, which pythonfmu makes: the laws of docs/control.md, written anew."""

from math import cos, pi, sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

AMPLITUDE, FREQUENCY = 0.2, 1.0  # of the load [rad, Hz]
RATIO, POSITION_GAIN, SPEED_GAIN, INTEGRAL_GAIN = 90.0, 10.0, 8.29e-3, 0.1266
TORQUE_LIMIT, RATED_TORQUE, SAMPLE_TIME = 0.4, 0.521, 125e-6


class SpeedController(Fmi2Slave):  # type: ignore[misc]
    def __init__(self, **given: object) -> None:
        super().__init__(**given)
        self.load_angle = self.twist = self.command = 0.0
        self.integral = self.position_before = 0.0
        for name in ("load_angle", "twist"):
            self.register_variable(Real(name, causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("command", causality=Fmi2Causality.output))

    def do_step(self, time: float, _interval: float) -> bool:
        phase = 2.0 * pi * FREQUENCY * time
        reference = AMPLITUDE * sin(phase)
        reference_speed = 2.0 * pi * FREQUENCY * AMPLITUDE * cos(phase)
        position = self.load_angle + self.twist  # of the motor, over the ratio
        speed = RATIO * (position - self.position_before) / SAMPLE_TIME
        self.position_before = position
        wanted = RATIO * (POSITION_GAIN * (reference - position) + reference_speed)
        free = SPEED_GAIN * (wanted - speed) + self.integral
        torque = min(max(free, -TORQUE_LIMIT), TORQUE_LIMIT)
        self.integral += SAMPLE_TIME * INTEGRAL_GAIN / SPEED_GAIN * (torque - self.integral)
        self.command = torque / RATED_TORQUE
        return True
