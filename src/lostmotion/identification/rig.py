"""The rig: the scenario that a log and values of the parameters make, and its run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..errors import InputError
from ..inputs.validation import did_you_mean
from ..simulation.keys import set_values
from ..simulation.scenario import Scenario
from ..simulation.scenario_files import find_scenario, load
from ..simulation.train_scenario import TrainInitial, TrainScenario, in_long_form
from ..simulation.train_state import start_capacities
from .formulas import Formula
from .prepare import Prepared, Segment
from .shaft_angles import angle_terms
from .task import Identification, InputChannel, MeasuredChannel, Rung

FINE = 2e-3  # [s] between samples of a run, so that a jump of the torque between two of them is seen
KEPT = 4000  # scenarios that are kept ready
Values = Mapping[str, float]


@dataclass(frozen=True)
class Built:
    """A scenario as the solver takes it."""

    scenario: TrainScenario
    core: _core.Train
    names: list[str]
    """of the channels of a run"""


class Rig:
    """What a task measures, with the formulas by which logs and parameters change it.

    Parameters
    ----------
    task
        The identification.
    directory
        That file names are relative to.

    Raises
    ------
    InputError
        The scenario cannot be used, or an input or a variable is none of it.
    """

    def __init__(self, task: Identification, directory: Path) -> None:
        self.task = task
        loaded = load(find_scenario(task.scenario, directory))
        self.scenario = in_long_form(loaded) if isinstance(loaded, Scenario) else loaded
        self._base = self.scenario.model_dump()
        self._built: dict[Any, Built] = {}
        self.units = self._units()
        for name in task.inputs:
            if name not in self._signals():
                meant = did_you_mean(name, self._signals(), f"what acts on the rig is {', '.join(self._signals())}")
                raise InputError(f"key inputs.{name}: is nothing that acts on {task.scenario}; {meant}")
        for name, m in task.measured.items():
            if m.variable not in self.units:
                meant = did_you_mean(m.variable, self.units, f"its variables are {', '.join(self.units)}")
                raise InputError(
                    f"key measured.{name}.variable: {m.variable!r} is no variable of {task.scenario}; {meant}"
                )
        self._set = {key: _read(value, f"set.{key}") for key, value in task.set.items()}
        self._phases = [
            {key: _read(v, f"phases[{k}].set.{key}") for key, v in p.set.items()} for k, p in enumerate(task.phases)
        ]
        self._rungs: list[dict[str, Any]] = []
        for k, rung in enumerate(task.rungs()):
            own = {key: _read(v, f"ladder[{k}].set.{key}") for key, v in rung.set.items()}
            self._rungs.append({**(self._rungs[-1] if self._rungs else {}), **own})

    def rungs(self) -> tuple[Rung, ...]:
        """Of the task."""
        return self.task.rungs()

    def _signals(self) -> list[str]:
        return [*self.scenario.signals(), *(f"{name}_reference" for name in self.scenario.axes())]

    def _units(self) -> dict[str, str]:
        units = {str(name): str(unit) for name, unit, _ in self.scenario.core().channels()}
        kinds = {"position": "rad", "speed": "rad/s", "torque": "N*m"}
        units |= {f"{name}_angle": "rad" for name in self.scenario.shafts if angle_terms(self.scenario, name, units)}
        return units | {f"{name}_reference": kinds[c.reference.kind] for name, c in self.scenario.axes().items()}

    def changes(self, values: Mapping[str, Any], rung: int, phase: int) -> dict[str, Any]:
        """Values of the scenario by dotted key.

        Raises
        ------
        InputError
            A formula has no value.
        """
        formulas = {**self._set, **self._rungs[rung], **(self._phases[phase] if phase >= 0 else {})}
        return {key: _value(formula, values, key) for key, formula in formulas.items()}

    def built(self, changes: Mapping[str, Any]) -> Built:
        """The scenario with values by dotted key; those of the initial state are left out."""
        kept = {key: value for key, value in changes.items() if not key.startswith("initial.")}
        name = repr(kept)
        found = self._built.get(name)
        if found is None:
            data = dict(self._base)
            set_values(data, kept.items())
            scenario = TrainScenario(**data)
            core = scenario.core()
            found = Built(scenario, core, [str(channel) for channel, _, _ in core.channels()])
            if len(self._built) >= KEPT:
                self._built.clear()
            self._built[name] = found
        return found

    def scenario_at(self, log: Prepared, values: Mapping[str, Any], rung: int) -> TrainScenario:
        """The scenario of the first phase of a log, without its signals."""
        return self.built(self.changes({**log.facts, **values}, rung, log.segments[0].phase)).scenario

    def run(self, log: Prepared, values: Values, rung: int, extra: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
        """What the measured channels of a log should be, by name, and more variables of the rig, at its instants.

        Raises
        ------
        InputError
            The values make no rig.
        SolverError
            The motion has no continuation.
        """
        known = {**log.facts, **values}
        wanted = dict.fromkeys([*(m.variable for m in self.task.measured.values()), *extra])
        wanted |= dict.fromkeys([_rate(name) for name in wanted if _rate(name)])
        times: list[np.ndarray] = []
        parts: list[dict[str, np.ndarray]] = []
        state: dict[str, float] | None = None
        for segment in log.segments:
            changes = self.changes(known, rung, segment.phase)
            built = self.built(changes)
            begin, end = _ends(log, segment)
            if end <= begin:
                continue
            start, capacities = self._start(built, changes, state)
            samples = max(2, math.ceil((end - begin) / self._interval(log)) + 1)
            result = _core.run_train(
                built.core,
                self._inputs(log, built, known, begin, end),
                start,
                capacities,
                end - begin,
                (end - begin) / (samples - 1),
                samples,
                False,
                0.0,
                0,
                self._control(log, built, known, begin, end),
            )
            data = dict(zip(built.names, result["values"], strict=True))
            parts.append({name: _variable(name, built, data, samples) for name in wanted})
            times.append(np.linspace(begin, end, samples))
            state = {name: value for name, value in result["end_state"].items() if name in built.names}
        time = np.concatenate(times)
        whole = {name: np.concatenate([part[name] for part in parts]) for name in wanted}
        found = {name: self._seen(log, m, known, time, whole) for name, m in self.task.measured.items()}
        return found | {name: np.interp(log.time, time, whole[name]) for name in extra}

    def _interval(self, log: Prepared) -> float:
        return self.task.fit.sample_interval or min(log.log.interval, FINE)

    def _start(
        self, built: Built, changes: Mapping[str, Any], state: dict[str, float] | None
    ) -> tuple[dict[str, float], dict[str, float]]:
        if state is not None:
            return state, {}
        given = {key: value for key, value in changes.items() if key.startswith("initial.")}
        if not given:
            return built.scenario.start(), start_capacities(built.scenario.initial)
        data = {"initial": built.scenario.initial.model_dump()}
        set_values(data, given.items())
        initial = TrainInitial(**data["initial"])
        return built.scenario.start(initial), start_capacities(initial)

    def _points(
        self, log: Prepared, name: str, known: Mapping[str, Any], begin: float, end: float
    ) -> list[tuple[float, float, float]]:
        """(time, value, slope) of an input within a segment, from its beginning on."""
        channel: InputChannel = self.task.inputs[name]
        scale, offset, delay = (
            number(getattr(channel, k), known, f"inputs.{name}.{k}") for k in ("scale", "offset", "delay")
        )
        key = (name, scale, offset, delay, begin)
        if key in log.cache:
            return log.cache[key]  # type: ignore[no-any-return]
        time = log.time + (delay - begin)
        value = scale * log.inputs[name] + offset
        first = max(0, int(np.searchsorted(time, 0.0, side="right")) - 1)
        last = int(np.searchsorted(time, end - begin, side="left"))
        t, v = time[first : last + 1], value[first : last + 1]
        slope = np.zeros(len(t))
        if channel.interpolation == "linear" and len(t) > 1:
            slope[:-1] = np.diff(v) / np.diff(t)
        if t[0] > 0.0:
            t, v, slope = np.append(0.0, t), np.append(v[0], v), np.append(0.0, slope)
        elif t[0] < 0.0:
            v = v.copy()
            v[0] -= slope[0] * t[0]
            t = np.append(0.0, t[1:])
        if len(log.cache) > 60:
            log.cache.clear()
        points = list(zip(t.tolist(), v.tolist(), slope.tolist(), strict=True))
        log.cache[key] = points
        return points

    def _inputs(
        self, log: Prepared, built: Built, known: Mapping[str, Any], begin: float, end: float
    ) -> list[_core.Signal]:
        signals = built.scenario.signals()
        return [
            _core.Signal(self._points(log, name, known, begin, end), [])
            if name in self.task.inputs
            else signals[name].core()
            for name in built.core.input_names()
        ]

    def _control(self, log: Prepared, built: Built, known: Mapping[str, Any], begin: float, end: float) -> Any:
        control = built.scenario.control()
        for (axis, *_), name in zip(control[1], built.scenario.axes(), strict=True):
            signal = f"{name}_reference"
            if signal in self.task.inputs:
                points = self._points(log, signal, known, begin, end)
                axis.set_reference([(t, v, slope, 0.0, 0.0) for t, v, slope in points], [])
        return control

    def _seen(
        self, log: Prepared, m: MeasuredChannel, known: Mapping[str, Any], time: np.ndarray, run: dict[str, np.ndarray]
    ) -> np.ndarray:
        """A variable as its channel shows it."""
        scale, offset, delay, tau = (
            number(getattr(m, k), known, k) for k in ("scale", "offset", "delay", "filter_time")
        )
        x = run[m.variable]
        if tau > 0.0:
            x = _filtered(time, x, tau)
            slope = None
        else:
            slope = run.get(_rate(m.variable))
        return scale * _interpolated(log.time - delay, time, x, slope) + offset


def number(text: str | float, known: Mapping[str, Any], key: str) -> float:
    """The value of a formula.

    Raises
    ------
    InputError
    """
    if isinstance(text, int | float):
        return float(text)
    try:
        return float(Formula(text).value(known))
    except ValueError as problem:
        raise InputError(f"key {key}: {problem}") from None


def _variable(name: str, built: Built, data: Mapping[str, np.ndarray], samples: int) -> np.ndarray:
    """A variable of a run, or the angle of a shaft through the gears behind it."""
    if name in data:
        return data[name]
    found = np.zeros(samples)
    for variable, factor in angle_terms(built.scenario, name.removesuffix("_angle"), data).items():
        found = found + factor * data[variable]
    return found


def _ends(log: Prepared, segment: Segment) -> tuple[float, float]:
    last = len(log.time) - 1
    return float(log.time[segment.begin]), float(log.time[min(segment.end, last)])


def _rate(variable: str) -> str:
    """The variable that is the rate of an angle."""
    return f"{variable.removesuffix('_angle')}_speed" if variable.endswith("_angle") else ""


def _read(value: Any, key: str) -> Any:
    """Formulas of a value of a scenario; texts that are none stay what they are, such as ``"3 N*m"`` or a name."""
    if isinstance(value, list | tuple):
        return [_read(x, key) for x in value]
    if isinstance(value, dict):
        return {k: _read(x, f"{key}.{k}") for k, x in value.items()}
    if not isinstance(value, str):
        return value
    try:
        return Formula(value)
    except ValueError:
        return value


def _value(node: Any, values: Mapping[str, Any], key: str) -> Any:
    if isinstance(node, list):
        return [_value(x, values, key) for x in node]
    if isinstance(node, dict):
        return {k: _value(x, values, f"{key}.{k}") for k, x in node.items()}
    if not isinstance(node, Formula):
        return node
    try:
        return node.value(values)
    except ValueError as problem:
        if node.names == {node.text}:  # a word, such as the kind of a stiffness
            return node.text
        raise InputError(f"key set.{key}: {problem}") from None


def _interpolated(at: np.ndarray, t: np.ndarray, x: np.ndarray, slope: np.ndarray | None) -> np.ndarray:
    """Values between samples: cubic where the slope is known, else straight; beyond the ends they stay."""
    at = np.clip(at, t[0], t[-1])
    if slope is None:
        return np.asarray(np.interp(at, t, x))
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    h = np.maximum(t[k + 1] - t[k], 1e-300)
    s = (at - t[k]) / h
    return np.asarray(
        (1 + 2 * s) * (1 - s) ** 2 * x[k]
        + s * (1 - s) ** 2 * h * slope[k]
        + s**2 * (3 - 2 * s) * x[k + 1]
        + s**2 * (s - 1) * h * slope[k + 1]
    )


def _filtered(t: np.ndarray, x: np.ndarray, tau: float) -> np.ndarray:
    """Through a first-order low pass, straight between samples."""
    y = np.empty_like(x)
    y[0] = x[0]
    for k in range(1, len(x)):
        h = t[k] - t[k - 1]
        if h <= 0.0:
            y[k] = y[k - 1]
            continue
        a = math.exp(-h / tau)
        rate = (x[k] - x[k - 1]) / h
        y[k] = a * (y[k - 1] - x[k - 1] + rate * tau) + x[k] - rate * tau
    return y
