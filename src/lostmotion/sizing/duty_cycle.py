"""The duty cycle of a run, and the means over it by which gearboxes and motors are sized.

Rest before and after the motion is not part of the task, so that no mean depends on its duration. The motion is taken
to repeat without a pause, or after `task.cycle`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.references import MovesReference
from ..errors import InputError

if TYPE_CHECKING:
    import xarray

    from ..simulation.runs.results import RunArrays

AnyMoves = MovesReference[Any, Any, Any, Any, Any]
STANDSTILL = 1e-3  # below this share of its largest speed the motor is taken to be at rest
MIN_REST = 0.01  # of the time in motion; a shorter standstill is no rest
STEADY = 0.01  # of the largest motor torque, within which it does not change at rest


def integral(time: np.ndarray, values: np.ndarray) -> float:
    """Integral of values over instants [s], straight between these."""
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(time)))


def stretches(values: np.ndarray, inside: np.ndarray) -> list[float]:
    """Sum of values over each stretch that is inside; the cycle repeats, so that a stretch may span its end."""
    pairs = itertools.groupby(zip(values.tolist(), inside.tolist(), strict=True), key=lambda pair: pair[1])
    each = [sum(value for value, _ in group) if within else 0.0 for within, group in pairs]
    if len(each) > 1 and each[0] > 0.0 and each[-1] > 0.0:
        each[0] += each.pop()
    return [total for total in each if total > 0.0]


Rest = tuple[float, float, slice]  # rest after a move: direction and end [s] of the move, and the samples of the rest


def rests_of(reference: AnyMoves, time: np.ndarray, count: int | None = None) -> list[Rest]:
    """Rests after the last so many moves of a reference, or after all, over instants [s]."""
    intervals, positions = reference.intervals(), [reference.start, *(move.to for move in reference.moves)]
    ends = [*(begin for begin, _ in intervals[1:]), time[-1]]
    found = []
    for k in range(0 if count is None else len(intervals) - count, len(intervals)):
        end, step = intervals[k][1], positions[k + 1] - positions[k]
        first, behind = np.searchsorted(time, end), np.searchsorted(time, ends[k], side="right")
        if first < behind and step != 0.0:
            found.append((math.copysign(1.0, step), end, slice(int(first), int(behind))))
    return found


def after_moves(rests: Sequence[Rest], time: np.ndarray, error: np.ndarray, window: float) -> tuple[list[float], float]:
    """Time from the end of each move until its error stays within the window [s], infinite where it does not; and the reversal error: at
    rest after moves forward less after moves backward, magnitude, NaN where moves go one way."""
    settling, ends = [], {1.0: list[float](), -1.0: list[float]()}
    for direction, end, rest in rests:
        outside = np.flatnonzero(np.abs(error[rest]) > window)
        stays = rest.start + (outside[-1] + 1 if len(outside) else 0)
        settling.append(0.0 if not len(outside) else float(time[stays] - end) if stays < rest.stop else math.inf)
        ends[direction].append(float(error[rest][-1]))
    both = ends[1.0] and ends[-1.0]
    return settling, abs(float(np.mean(ends[1.0]) - np.mean(ends[-1.0]))) if both else math.nan


@dataclass(frozen=True)
class DutyCycle:
    """The repeated cycle."""

    time: np.ndarray  # instants of the motion [s]
    input_speed: np.ndarray  # magnitude at these instants [rad/s]
    output_torque: np.ndarray  # [N·m]
    motor_torque: np.ndarray  # [N·m]
    holding_torque: float | None
    """holding torque of the motor, at rest after the motion [N·m]; None: the run ends in motion"""
    period: float | None  # `task.cycle` [s]; None: no pause

    def __str__(self) -> str:
        if not self.moves:
            return "at rest throughout"
        motion = f"the motion of {self.duration:.4g} s repeated"
        return f"{motion} every {self.period:.4g} s" if self.period is not None else f"{motion} without a pause"

    @property
    def moves(self) -> bool:
        """Whether the motor turns at all."""
        return bool(self.input_speed.any())

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def peak_input_speed(self) -> float:
        """Largest magnitude [rad/s]."""
        return float(self.input_speed.max())

    @cached_property
    def mean_input_speed(self) -> float:
        """Mean of the magnitude over the cycle, pause included [rad/s]."""
        return integral(self.time, self.input_speed) / (self.period or self.duration)

    @cached_property
    def mean_output_torque(self) -> float:
        """Cubic mean of the magnitude, weighted with the input speed [N·m]; 0 where nothing turns."""
        turned = integral(self.time, self.input_speed)
        work = integral(self.time, self.input_speed * np.abs(self.output_torque) ** 3)
        return float((work / turned) ** (1.0 / 3.0)) if turned > 0.0 else 0.0

    @property
    def held_longer(self) -> bool:
        """Whether holding takes more torque than the motion, and nothing says for how long."""
        square = integral(self.time, self.motor_torque**2)
        return self.period is None and (self.holding_torque or 0.0) ** 2 * self.duration >= square

    def repeated_torque(self) -> tuple[np.ndarray, np.ndarray]:
        """Instants [s] and torque of the motor [N·m] of one cycle, the pause included."""
        if self.period is None or self.period <= self.duration * (1.0 + 1e-9):
            return self.time, self.motor_torque
        held = self.holding_torque or 0.0
        pause = [self.time[-1], self.time[0] + self.period]
        return np.append(self.time, pause), np.append(self.motor_torque, [held, held])

    @cached_property
    def rms_motor_torque(self) -> float:
        """Root mean square over the cycle [N·m].

        In the pause the motor holds what it held at the end of the run. Without `task.cycle` no pause is known, and the larger
        of motion and holding is taken, which is an upper bound for any pause.
        """
        square = integral(self.time, self.motor_torque**2)
        held = (self.holding_torque or 0.0) ** 2
        if self.period is not None:
            return float(np.sqrt((square + (self.period - self.duration) * held) / self.period))
        return float(np.sqrt(max(square / self.duration, held)))


def duty_cycle(
    result: xarray.Dataset | RunArrays,
    period: float | None,
    *,
    speed: str = "motor_speed",
    motor_torque: str = "motor_torque",
    output_torque: str = "output_torque",
    heating: np.ndarray | None = None,
) -> DutyCycle:
    """The duty cycle of a run.

    A standstill at its beginning or end is rest if it is no mere reversal of the motion. That is, it is not too
    short, and the torque of the motor does not change.

    result: of `simulate`.
    period: `task.cycle` [s].
    speed, motor_torque, output_torque: variables of the result: the input shaft, what turns it, what leaves at the output.
    heating: torque of the motor over the result that heats as its current does [N·m]; left out, its torque.

    Raises InputError: the motion does not fit into the period, or is not at its end where a pause would begin.
    """
    time, torque = np.asarray(result["time"]), np.asarray(result[motor_torque])
    fast = np.abs(np.asarray(result[speed]))
    turning = np.flatnonzero(fast > STANDSTILL * fast.max())
    first, last = (turning[0], turning[-1]) if len(turning) else (0, len(fast) - 1)
    shortest = MIN_REST * (time[last] - time[first])
    steady = STEADY * np.abs(torque).max()
    before, after = first // 2 + 1, (last + len(fast)) // 2  # halves of the standstills, those far from the motion
    waits = time[first] - time[0] > shortest and np.ptp(torque[:before]) <= steady
    rests = not len(turning) or (time[-1] - time[last] > shortest and np.ptp(torque[after:]) <= steady)
    torque = torque if heating is None else heating
    part = slice(max(first - 1, 0) if waits else 0, last + 2 if rests else len(fast))
    found = DutyCycle(
        time[part],
        fast[part],
        np.asarray(result[output_torque])[part],
        torque[part],
        float(torque[-1]) if rests else None,
        period,
    )
    if period is None or not found.moves:
        return found
    if period < found.duration * (1.0 - 1e-9):
        raise InputError(
            f"{period:.6g} s is shorter than the motion of {found.duration:.6g} s; it is the period after which the "
            "motion repeats, pause included",
            "task.cycle",
        )
    if not rests and period > found.duration * (1.0 + 1e-9):
        raise InputError(
            f"{period:.6g} s leaves a pause after the {found.duration:.6g} s of the run, but the motor still turns at "
            "its end; lengthen simulation.duration until it rests, or leave task.cycle out",
            "task.cycle",
        )
    return found
