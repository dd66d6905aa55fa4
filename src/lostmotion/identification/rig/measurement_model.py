"""The measurement model: what the channels of a log show of a run, and how that changes with parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.signal import lfilter

from ...errors import InputError
from ..prepared_log import Prepared
from ..task.file_formulas import names_in, number
from ..task.identification_file import Identification, MeasuredChannel

FINE = 2e-3  # [s] between samples of a run behind a filter, so that a jump of the torque between two of them is seen
NUMBERS = ("scale", "offset", "delay", "filter_time")


@dataclass(frozen=True)
class Probe:
    """A variable of the rig, and the instants at which it is wanted."""

    variable: str
    at: np.ndarray  # [s], ascending, within the log


class Measuring:
    """The measured channels of a log at some values of the parameters.

    known: what formulas may name.
    rates: of angles and positions, the variables that are their rates.
    """

    def __init__(self, task: Identification, log: Prepared, known: Mapping[str, Any], rates: Mapping[str, str]) -> None:
        self._log, self._channels = log, task.measured
        self._numbers = {name: numbers_of(m, known) for name, m in task.measured.items()}
        self._interval = task.fit.sample_interval
        self._rates = rates

    @cached_property
    def _grid(self) -> np.ndarray:
        """Instants behind channels with a filter, at equal distances."""
        return _grid(self._log, self._interval)

    def probes(self) -> list[Probe]:
        """Variables that a run must record: for each channel its variable and, if it exists, its rate."""
        found = []
        for name, m in self._channels.items():
            at = self._at(name)
            found.append(Probe(m.variable, at))
            if m.variable in self._rates:
                found.append(Probe(self._rates[m.variable], at))
        return found

    def values(self, seen: Sequence[np.ndarray]) -> np.ndarray:
        """Channels x samples, from the probes."""
        return np.array([self._of(name, x, self._numbers[name]) for name, x, _ in self._each(seen)])

    def derivatives(
        self,
        seen: Sequence[np.ndarray],
        by: Sequence[np.ndarray],
        beside: Sequence[tuple[str, Callable[[MeasuredChannel], list[tuple[float, dict[str, float]]]]]],
    ) -> np.ndarray:
        """Channels x samples x parameters.

        by: of each probe parameters x instants.
        beside: of each parameter its name, and for a channel the (weight, numbers) beside its value; see `neighbours_of`.
        """
        found = []
        rows = {name: d for name, d, _ in self._each(by)}
        for name, x, rate in self._each(seen):
            m, own = self._channels[name], self._numbers[name]
            through = {**own, "offset": 0.0}
            J = self._of(name, rows[name], through)
            for p, (parameter, numbers) in enumerate(beside):
                if not any(parameter in names_in(getattr(m, key)) for key in NUMBERS):
                    continue
                for weight, there in numbers(m):
                    J[p] += weight * (self._of(name, x, {**there, "delay": own["delay"]}) - self._of(name, x, own))
                    if there["delay"] != own["delay"]:
                        J[p] -= weight * (there["delay"] - own["delay"]) * self._rate(name, x, rate, own)
            found.append(J.T)
        return np.array(found)

    def _at(self, name: str) -> np.ndarray:
        """Instants of a channel: a fine grid before a filter, else the instants at which it is read."""
        numbers = self._numbers[name]
        return self._grid if numbers["filter_time"] > 0.0 else self._read(numbers)

    def _read(self, numbers: Mapping[str, float]) -> np.ndarray:
        return np.clip(self._log.time - numbers["delay"], self._log.begin, self._log.time[-1])

    def _each(self, seen: Sequence[np.ndarray]) -> list[tuple[str, np.ndarray, np.ndarray | None]]:
        """(name, variable, its rate) of each channel."""
        left = iter(seen)
        return [
            (name, next(left), next(left) if m.variable in self._rates else None) for name, m in self._channels.items()
        ]

    def _of(self, name: str, x: np.ndarray, numbers: Mapping[str, float]) -> np.ndarray:
        if self._numbers[name]["filter_time"] > 0.0:
            x = _interpolated(self._read(numbers), self._grid, _filtered(self._grid, x, numbers["filter_time"]))
        return np.asarray(numbers["scale"] * x + numbers["offset"])

    def _rate(self, name: str, x: np.ndarray, rate: np.ndarray | None, numbers: Mapping[str, float]) -> np.ndarray:
        """Time derivative of what a channel shows."""
        at = self._read(numbers)
        inside = (at > self._log.begin) & (at < self._log.time[-1])
        if (tau := numbers["filter_time"]) > 0.0:
            slope = numbers["scale"] * _slopes(at, self._grid, _filtered(self._grid, x, tau))
        elif rate is not None:
            slope = self._of(name, rate, {**numbers, "offset": 0.0})
        else:
            slope = np.gradient(self._of(name, x, numbers), self._log.time)
        return np.where(inside, slope, 0.0)


def numbers_of(m: MeasuredChannel, known: Mapping[str, Any]) -> dict[str, float]:
    """Scale, offset, delay and filter of a channel."""
    found = {key: number(getattr(m, key), known, key) for key in NUMBERS}
    if found["scale"] == 0.0:
        raise InputError("scale is 0; it must be another number", f"measured with the channel {m.channel}")
    if found["filter_time"] < 0.0:
        raise InputError(
            f"filter_time is {found['filter_time']:g} s; it must be at least 0",
            f"measured with the channel {m.channel}",
        )
    return found


def delays_that_name(task: Identification, names: Sequence[str]) -> bool:
    """Whether the delay of a channel depends on one of the parameters."""
    return bool(names_in([m.delay for m in task.measured.values()]) & set(names))


def _grid(log: Prepared, interval: float | None) -> np.ndarray:
    span = float(log.time[-1]) - log.begin
    return np.linspace(log.begin, log.time[-1], max(2, round(span / (interval or min(log.log.interval, FINE))) + 1))


def _interpolated(at: np.ndarray, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Straight between samples at equal distances; rows x instants or instants."""
    place = np.clip((at - t[0]) / (t[1] - t[0]), 0.0, len(t) - 1.0)
    k = np.minimum(place.astype(int), len(t) - 2)
    share = place - k
    return np.asarray((1.0 - share) * x[..., k] + share * x[..., k + 1])


def _slopes(at: np.ndarray, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Slopes of the straight lines of `_interpolated`."""
    h = t[1] - t[0]
    k = np.clip(((at - t[0]) / h).astype(int), 0, len(t) - 2)
    return np.asarray((x[k + 1] - x[k]) / h)


def _filtered(t: np.ndarray, x: np.ndarray, tau: float) -> np.ndarray:
    """The output of a first-order low pass that begins at rest, linear between samples; rows x instants or instants."""
    h = t[1] - t[0]
    a = float(np.exp(-h / tau))
    share = (1.0 - a) * tau / h
    # y' = (x - y)/tau with x straight: y_k = a y_{k-1} + (share - a) x_{k-1} + (1 - share) x_k
    y, _ = lfilter([1.0 - share, share - a], [1.0, -a], x, axis=-1, zi=(share) * x[..., :1])
    return np.asarray(y)
