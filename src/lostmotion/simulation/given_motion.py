"""The motion of a shaft over a step of a simulation: from where it is to what is given for the end, without a jump of its speed."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ..inputs.quantities import argument
from ..inputs.validation import did_you_mean, shown

UNITS = {"angle": "rad", "speed": "rad/s", "acceleration": "rad/s^2"}


@dataclass(frozen=True)
class Course:
    """Accelerations in straight lines between instants of a step, and the speed at its begin."""

    times: tuple[float, ...]
    """[s] from its begin on"""
    accelerations: tuple[float, ...]
    """[rad/s²] there"""
    speed: float
    """[rad/s]"""

    def acceleration_at(self, time: float) -> float:
        k = min(bisect_right(self.times, time), len(self.times) - 1)
        (t0, t1), (a0, a1) = self.times[k - 1 : k + 1], self.accelerations[k - 1 : k + 1]
        return a1 if time == t1 else a0 + (a1 - a0) * (time - t0) / (t1 - t0)

    def speed_at(self, time: float) -> float:
        speed, before = self.speed, 0.0
        for t in (*(t for t in self.times[1:] if t < time), time):
            speed += 0.5 * (self.acceleration_at(before) + self.acceleration_at(t)) * (t - before)
            before = t
        return speed


def motion_given(name: str, values: Any) -> dict[str, float]:
    """Given motion at the end of a step, in SI.

    Raises
    ------
    InputError
        There is no speed among it, or something else.
    """
    if not isinstance(values, Mapping):
        raise InputError(
            f'motion.{name}: {shown(values)} must name what is given, such as {{"speed": 2.0, "acceleration": 0.0}}'
        )
    for key in values:
        if key not in UNITS:
            raise InputError(
                f"motion.{name}.{key}: is not known; {did_you_mean(key, UNITS, f'there are {list(UNITS)}')}"
            )
    if "speed" not in values:
        raise InputError(f"motion.{name}.speed: is missing; give the speed at the end of the interval [rad/s]")
    return {key: argument(f"motion.{name}.{key}", value, UNITS[key]) for key, value in values.items()}


def course_to(given: Mapping[str, float], angle: float, speed: float, acceleration: float, h: float) -> Course:
    """From an angle, a speed and an acceleration to those that are given, within a time h.

    Without an angle and an acceleration the acceleration is constant; with an angle alone it is one straight line, which begins
    where it has to; with an acceleration alone it is two lines, from the one before on, with both three.
    """
    rise = given["speed"] - speed
    if "angle" in given:
        beyond = given["angle"] - angle - speed * h  # of where the speed alone would lead
    if "acceleration" not in given:
        if "angle" not in given:
            return Course((0.0, h), (rise / h, rise / h), speed)
        begin = 6.0 * beyond / (h * h) - 2.0 * rise / h
        return Course((0.0, h), (begin, 2.0 * rise / h - begin), speed)
    end = given["acceleration"]
    if "angle" not in given:
        middle = 2.0 * rise / h - 0.5 * (acceleration + end)
        return Course((0.0, 0.5 * h, h), (acceleration, middle, end), speed)
    third = h / 3.0
    # Of lines between a0, a1, a2, a3 the integral is (a0/2 + a1 + a2 + a3/2) h/3, the double one (4/3 a0 + 2 a1 + a2 + a3/6) h^2/9.
    once = rise / third - 0.5 * (acceleration + end)
    twice = beyond / (third * third) - 4.0 / 3.0 * acceleration - end / 6.0
    return Course((0.0, third, 2.0 * third, h), (acceleration, twice - once, 2.0 * once - twice, end), speed)
