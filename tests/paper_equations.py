"""The printed equations (1) to (4) and (12) to (16) of 2-DOF-NL, stepped through time with printed data and the stand-in of the loss
table in its formula: slow, of first order, and without any code of the package."""

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

RATIO, RATED_TORQUE, RATED_SPEED = 90.0, 51.6, 3630.0 * 2.0 * math.pi / 60.0
INPUT_INERTIA, LOAD_INERTIA = 80e-7 + 67e-7, 2.0
K_20 = 0.65 * 26.5e3
INPUT_DAMPING = 2.0 * 0.02 * math.sqrt(K_20 / (RATIO**2 * 0.9 * INPUT_INERTIA)) * INPUT_INERTIA
LOAD_DAMPING = 2.0 * 0.02 * math.sqrt(K_20 / LOAD_INERTIA) * LOAD_INERTIA
SPEEDS = (0.0, 0.01, 0.1, 0.3, 0.6, 1.0, 1.5)
NO_LOAD = (0.020, *(0.018 + 0.032 * v**0.7 for v in SPEEDS[1:]))
PER_LOAD = (0.06, *(0.05 + 0.02 * v for v in SPEEDS[1:]))


def loss(load: float, speed: float) -> float:
    """M_2B [N·m]: linear in the load, between speeds linear too."""
    v, mu = abs(speed) / RATED_SPEED, abs(load) / RATED_TORQUE
    k = min(bisect_right(SPEEDS, v), len(SPEEDS) - 1)
    share = (v - SPEEDS[k - 1]) / (SPEEDS[k] - SPEEDS[k - 1])
    low, high = (NO_LOAD[j] + PER_LOAD[j] * mu for j in (k - 1, k))
    return RATED_TORQUE * (low + share * (high - low))


def spring(twist: float) -> float:
    """(14), with the sign of the twist."""
    d = abs(twist)
    soft, middle = 2.65e3 * min(d, 0.6e-3), 21.2e3 * min(max(d - 0.6e-3, 0.0), 2.4e-3)
    return math.copysign(soft + middle + 26.5e3 * max(d - 3e-3, 0.0), twist)


@dataclass
class Drive:
    """States, and the two dry contacts by projection on rest."""

    step: float
    torque: float = 0.0  # m_D
    motor_speed: float = 0.0
    load_speed: float = 0.0
    twist: float = 0.0
    capacity: float = 0.0  # of the hysteresis [N·m]
    way: int = 0  # of the twist; 0: stuck

    def speeds(self, output_torque: float) -> tuple[float, float]:
        """After a step."""
        w = self.motor_speed
        friction = 0.016 + loss(output_torque, w) / RATIO
        free = w + self.step / INPUT_INERTIA * (0.521 * self.torque - INPUT_DAMPING * w - output_torque / RATIO)
        brake = self.step / INPUT_INERTIA * friction
        moved = math.copysign(max(abs(free) - brake, 0.0), free)
        load = self.load_speed + self.step / LOAD_INERTIA * (output_torque - LOAD_DAMPING * self.load_speed)
        return moved, load

    def rate(self, output_torque: float) -> float:
        moved, load = self.speeds(output_torque)
        return moved / RATIO - load

    def output_torque(self) -> float:
        """(15), (16)."""
        elastic = spring(self.twist)
        if self.way and self.rate(elastic + self.way * self.capacity) * self.way > 0.0:
            return elastic + self.way * self.capacity
        if self.way:
            self.capacity = 0.5 * (1.0 - 0.93) * abs(elastic)
        high, low = elastic + self.capacity, elastic - self.capacity
        fast, slow = self.rate(high), self.rate(low)
        self.way = 1 if fast > 0.0 else -1 if slow < 0.0 else 0
        if self.way:
            return high if self.way > 0 else low
        return elastic if slow == fast else low + (high - low) * slow / (slow - fast)

    def advance(self, command: float) -> tuple[float, float, float, float]:
        """T_1, T_2 and both speeds after a step."""
        target = 3.1169 * command - 2.1169 * self.motor_speed / 345.6
        self.torque += (target - self.torque) * -math.expm1(-self.step / 0.1286e-3)
        output = self.output_torque()
        motor, self.load_speed = self.speeds(output)
        self.motor_speed = motor
        self.twist += self.step * (motor / RATIO - self.load_speed)
        lost = math.copysign(loss(output, motor), motor) if motor else 0.0
        return (output + lost) / RATIO, output, motor, self.load_speed


def run(amplitude: float, duration: float, step: float) -> np.ndarray:
    """Rows T_1, T_2, motor and load speed over time, from rest under a sine of 1 Hz."""
    drive = Drive(step)
    commands = amplitude * np.sin(2.0 * np.pi * step * np.arange(1, round(duration / step) + 1))
    return np.array([drive.advance(command) for command in commands.tolist()]).T
