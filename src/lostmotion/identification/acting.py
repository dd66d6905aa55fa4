"""What acts on the rig in a part of a log: inputs of the train, and references of sampled controllers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import _core
from ..control.axis import OPEN_LOOP, Bound
from .formulas import number
from .prepare import Prepared
from .rig import Built
from .task import Identification

NUMBERS = ("scale", "offset", "delay")
Points = list[tuple[float, float, float]]


class Acting:
    """The inputs of a log from one instant to another.

    Parameters
    ----------
    known
        What formulas may name, by which is settled how many samples act.
    begin, end
        [s]
    """

    def __init__(self, task: Identification, log: Prepared, known: Mapping[str, Any], begin: float, end: float) -> None:
        self._task, self._log, self._begin, self._end = task, log, begin, end
        self._pieces = {name: self._samples(name, known) for name in task.inputs}

    def inputs(self, built: Built, known: Mapping[str, Any]) -> list[_core.Signal]:
        """Of the train, in its order."""
        of_scenario = built.scenario.signals() if set(built.inputs) - set(self._task.inputs) else {}
        return [
            self._signal(name, known) if name in self._task.inputs else of_scenario[name].core()
            for name in built.inputs
        ]

    def control(self, built: Built, known: Mapping[str, Any]) -> Bound:
        """The sampled controllers with their references."""
        axes = built.scenario.axes()
        if not axes:
            return OPEN_LOOP
        control = built.scenario.control()
        for (axis, *_), name in zip(control[1], axes, strict=True):
            signal = f"{name}_reference"
            if signal in self._task.inputs:
                axis.set_reference([(t, v, slope, 0.0, 0.0) for t, v, slope in self._points(signal, known)], [])
        return control

    def _numbers(self, name: str, known: Mapping[str, Any]) -> tuple[float, ...]:
        channel = self._task.inputs[name]
        return tuple(number(getattr(channel, key), known, f"inputs.{name}.{key}") for key in NUMBERS)

    def _samples(self, name: str, known: Mapping[str, Any]) -> tuple[int, int, bool]:
        """First and last of those that act between begin and end, and whether the first comes late: beside a value of a
        parameter they are the same.
        """
        time = self._log.time + (self._numbers(name, known)[2] - self._begin)
        first = max(0, int(np.searchsorted(time, 0.0, side="right")) - 1)
        last = int(np.searchsorted(time, self._end - self._begin, side="left"))
        return first, last + 1, bool(time[first] > 0.0)

    def _signal(self, name: str, known: Mapping[str, Any]) -> _core.Signal:
        key = ("signal", name, *self._numbers(name, known), *self._pieces[name], self._begin)
        return self._kept(key, lambda: _core.Signal(self._points(name, known), []))  # type: ignore[no-any-return]

    def _points(self, name: str, known: Mapping[str, Any]) -> Points:
        """(time, value, slope) of an input from `begin` on."""
        numbers = self._numbers(name, known)
        return self._kept((name, *numbers, *self._pieces[name], self._begin), lambda: self._made(name, numbers))  # type: ignore[no-any-return]

    def _made(self, name: str, numbers: tuple[float, ...]) -> Points:
        scale, offset, delay = numbers
        first, end, late = self._pieces[name]
        which = slice(first, end)
        t = self._log.time[which] + (delay - self._begin)
        v = scale * self._log.inputs[name][which] + offset
        slope = np.zeros(len(t))
        if self._task.inputs[name].interpolation == "linear" and len(t) > 1:
            slope[:-1] = np.diff(v) / np.diff(t)
        if late:
            t, v, slope = np.append(0.0, t), np.append(v[0], v), np.append(0.0, slope)
        else:
            v = v.copy()
            v[0] -= slope[0] * t[0]
            t = np.append(0.0, t[1:])
        return list(zip(t.tolist(), v.tolist(), slope.tolist(), strict=True))

    def _kept(self, key: Any, make: Any) -> Any:
        cache = self._log.cache
        if key not in cache:
            if len(cache) > 200:
                cache.clear()
            cache[key] = make()
        return cache[key]
