"""A rigid pendulum as an FMU of its own, which pythonfmu makes: a multibody tool that has a drive in its joint."""

from math import sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

INERTIA, WEIGHT = 2.0, 15.0  # about the joint [kg m2]; m g l [N m]
PARTS = 20  # of a communication step


class Pendulum(Fmi2Slave):  # type: ignore[misc]
    def __init__(self, **given: object) -> None:
        super().__init__(**given)
        self.torque = self.angle = self.speed = self.acceleration = 0.0
        self.register_variable(Real("torque", causality=Fmi2Causality.input, start=0.0))  # that it gives to the drive
        for name in ("angle", "speed", "acceleration"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, _time: float, interval: float) -> bool:
        h = interval / PARTS
        for _ in range(PARTS):  # velocity Verlet, the torque held
            half = self.speed + h / 2.0 * self._rate()
            self.angle += h * half
            self.speed = half + h / 2.0 * self._rate()
        self.acceleration = self._rate()
        return True

    def _rate(self) -> float:
        return (-WEIGHT * sin(self.angle) - self.torque) / INERTIA
