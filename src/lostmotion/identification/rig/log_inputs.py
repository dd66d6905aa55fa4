"""Inputs in a part of a log: inputs of the train, and references of sampled controllers."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ... import _core
from ...control.axis import OPEN_LOOP, BoundController, own
from ...errors import InputError
from ...model.signals import columns, core_signal
from ..prepared_log import Prepared
from ..task.file_formulas import number
from ..task.identification_file import Identification
from .measured_motion_input import GIVEN_ACCELERATION, GIVEN_SPEED, given_speed, rates_of, speed_of
from .rig_scenario import Built
from .servo_goal_limits import shaped

NUMBERS = ("scale", "offset", "delay", "rate_limit", "acceleration_limit", "filter_time")
DELAY = NUMBERS.index("delay")
KEPT = 4  # courses of a whole log that are kept; each is also in a signal of the core


def numbers_of_input(task: Identification, name: str, known: Mapping[str, Any]) -> tuple[float, ...]:
    """Values of `NUMBERS` of an input; a limit that is left out is infinite."""
    given = [(key, getattr(task.inputs[name], key)) for key in NUMBERS]
    found = tuple(math.inf if x is None else number(x, known, f"inputs.{name}.{key}") for key, x in given)
    for key, value in zip(NUMBERS[3:], found[3:], strict=True):
        if not (value >= 0.0 if key == "filter_time" else value > 0.0):
            raise InputError(
                f"is {value:g}; it must be {'at least' if key == 'filter_time' else 'above'} 0", f"inputs.{name}.{key}"
            )
    return found


def course_of_input(
    task: Identification, log: Prepared, name: str, numbers: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray, bool, int]:
    """(instants without the delay [s], values there in SI, whether they are held, points for one sample)."""
    scale, offset, _, rate, acceleration, filter_time = numbers
    if name.endswith(GIVEN_SPEED):
        return log.time, scale * given_speed(task, log, name) + offset, False, 1
    t, v = log.time, scale * log.inputs[name] + offset
    held = task.inputs[name].interpolation != "linear"
    if math.isinf(rate) and math.isinf(acceleration) and filter_time == 0.0:
        return t, v, held, 1
    fine, course, count = shaped(t, v, held=held, rate=rate, acceleration=acceleration, filter_time=filter_time)
    return fine, course, False, count


class LogInputs:
    """The inputs of a log from one instant to another.

    known: what formulas may name, by which is settled how many samples act.
    begin, end: [s]
    """

    def __init__(self, task: Identification, log: Prepared, known: Mapping[str, Any], begin: float, end: float) -> None:
        self._task, self._log, self._begin, self._end = task, log, begin, end
        self._pieces = {name: self._samples(name, known) for name in task.inputs}

    def inputs(self, built: Built, known: Mapping[str, Any]) -> list[_core.Signal]:
        """Inputs of the train, in its order."""
        of_scenario = built.scenario.signals() if set(built.inputs) - set(self._task.inputs) else {}
        return [
            self._signal(name, known)
            if name in self._task.inputs or speed_of(name) in self._task.inputs
            else of_scenario[name].core()
            for name in built.inputs
        ]

    def given_speeds(self, known: Mapping[str, Any]) -> dict[str, float]:
        """Given speeds of shafts at `begin`."""
        given = [name for name in self._task.inputs if name.endswith(GIVEN_SPEED)]
        return {name.removesuffix(GIVEN_SPEED): float(self._points(name, known)[0, 1]) for name in given}

    def control(self, built: Built, known: Mapping[str, Any]) -> BoundController:
        """The sampled controllers with their references."""
        axes = built.scenario.axes()
        if not axes:
            return OPEN_LOOP
        control = own(built.scenario.control())
        for axis, name in zip(control[1], axes, strict=True):
            signal = built.scenario.train().variable(name, "reference")
            if signal in self._task.inputs:
                points = columns(("time", "value", "rate"), self._points(signal, known).tolist())
                axis.set({"reference": {"pieces": points}})
        return control

    def _numbers(self, name: str, known: Mapping[str, Any]) -> tuple[float, ...]:
        return numbers_of_input(self._task, name, known)

    def _samples(self, name: str, known: Mapping[str, Any]) -> tuple[int, int, bool]:
        """First and last of the values that act between begin and end, and whether the first comes late: beside a value of a
        parameter they are the same.
        """
        time = self._log.time + (self._numbers(name, known)[DELAY] - self._begin)
        first = max(0, int(np.searchsorted(time, 0.0, side="right")) - 1)
        last = int(np.searchsorted(time, self._end - self._begin, side="left"))
        return first, last + 1, bool(time[first] > 0.0)

    def _signal(self, name: str, known: Mapping[str, Any]) -> _core.Signal:
        if name.endswith(GIVEN_ACCELERATION):
            return core_signal(rates_of(self._points(speed_of(name), known)).tolist())
        key = ("signal", name, *self._numbers(name, known), *self._pieces[name], self._begin)
        return self._kept(key, lambda: core_signal(self._points(name, known).tolist()))  # type: ignore[no-any-return]

    def _points(self, name: str, known: Mapping[str, Any]) -> np.ndarray:
        """Array (points, 3) of time, value and slope of an input from `begin` on."""
        numbers = self._numbers(name, known)
        return self._kept((name, *numbers, *self._pieces[name], self._begin), lambda: self._made(name, numbers))  # type: ignore[no-any-return]

    def _made(self, name: str, numbers: tuple[float, ...]) -> np.ndarray:
        first, end, late = self._pieces[name]
        t, v, held, count = course_of_input(self._task, self._log, name, numbers)
        which = slice(first * count, (end - 1) * count + 1)
        t, v = t[which] + (numbers[DELAY] - self._begin), v[which]
        slope = np.zeros(len(t))
        if not held and len(t) > 1:
            slope[:-1] = np.diff(v) / np.diff(t)
        if late:
            t, v, slope = np.append(0.0, t), np.append(v[0], v), np.append(0.0, slope)
        else:  # from the last point before, which is one of a finer grid where the course is shaped
            last = max(0, int(np.searchsorted(t, 0.0, side="right")) - 1)
            t, v, slope = t[last:], v[last:].copy(), slope[last:]
            v[0] -= slope[0] * t[0]
            t = np.append(0.0, t[1:])
        return np.column_stack([t, v, slope])

    def _kept(self, key: Any, make: Any) -> Any:
        cache = self._log.cache
        if key not in cache:
            points = sum(len(x) for x in cache.values() if isinstance(x, np.ndarray))
            if len(cache) > 200 or points > KEPT * len(self._log.time):
                cache.clear()
            cache[key] = make()
        return cache[key]
