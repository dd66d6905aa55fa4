"""Result variables of a simulation that is advanced step by step."""

import threading
from collections.abc import Callable, Iterator
from typing import Any, overload

import numpy as np

from ... import _core
from ...control.controller import Controller
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, shown
from ...model.synchronous_motor import PhaseValues
from ...model.train import DriveTrain
from ..scenario.field_oriented_motors import CURRENTS, oriented
from ..scenario.scenario import Scenario
from ..variables import Variable
from ..variables_of_trains import ALL_SIGNALS, WINDING_SIGNALS, axis_variables, signals_of

Derived = Callable[[list[float]], float]


class SimulationReadings:
    """Base of simulations: their result variables by name."""

    _core: Any
    _turn: threading.RLock
    _train: DriveTrain
    _core_train: _core.Train
    _loaded: tuple[str, ...]
    _given: tuple[str, ...]
    _controllers: dict[str, Controller]
    _signals: dict[str, int]  # places of the signals of controllers
    _channel: dict[str, int]
    _derived: dict[str, Derived]
    _variables: tuple[Variable, ...]

    def _idle(self) -> Any:
        raise NotImplementedError

    @property
    def loaded(self) -> tuple[str, ...]:
        """Names of the shafts of a train that a load torque may act on."""
        return self._loaded

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the shafts of a train whose motion `advance` is given."""
        return self._given

    def _add_signals(self, scenario: Scenario) -> None:
        """Add the signals of controllers, and the torque of a winding in place of the straight line that drives the mechanics."""
        if not self._controllers:
            return
        names = (*ALL_SIGNALS, *WINDING_SIGNALS)
        for k, (prefix, controller) in enumerate(scenario.by_prefix().items()):
            shown_here = set(signals_of(controller))
            self._signals |= {
                f"{prefix}{name}": k * len(names) + n for n, name in enumerate(names) if name in shown_here
            }
        train = scenario.train()
        for motor, _, phase in oriented(scenario):
            torque, *currents = (train.variable(motor, quantity) for quantity in ("torque", *CURRENTS))
            self._derived[torque] = self._torque_of(currents, phase)
            self._channel = {n: c for n, c in self._channel.items() if n != torque}
        self._variables += axis_variables(scenario.by_prefix(), scenario.sliding())

    def _torque_of(self, currents: list[str], phase: PhaseValues) -> Derived:
        def torque(values: list[float]) -> float:
            return float(phase.torque(*(self._value(current, values) for current in currents)))

        return torque

    def winding_torques(self) -> Iterator[tuple[int, Derived]]:
        """Channel of the solver's torque of each motor under field-oriented control, and the true torque from the channels."""
        channels = {v.name: k for k, v in enumerate(self._variables)}
        for name, derived in self._derived.items():
            if name.endswith("_torque") and name not in self._channel:
                yield channels[name], derived

    @overload
    def __getitem__(self, name: str) -> float: ...
    @overload
    def __getitem__(self, name: tuple[str, ...] | list[str]) -> np.ndarray: ...
    def __getitem__(self, name: str | tuple[str, ...] | list[str]) -> float | np.ndarray:
        """Value of a result variable now (SI), with the inputs at their last values; of several, as an array.

        Raises InputError: there is no such variable.
        """
        with self._turn:
            values = self._idle().read()
            if isinstance(name, tuple | list):
                return np.array([self._value(one, values) for one in name])
            return self._value(name, values)

    def _value(self, name: str, values: list[float]) -> float:
        try:
            channel = self._channel.get(name)
            if channel is None and name in self._signals:
                return float(self._core.control_signals()[self._signals[name]])
            return values[channel] if channel is not None else self._derived[name](values)
        except (KeyError, TypeError):  # unknown, or nothing that could be a name
            names = [v.name for v in self._variables]
            hint = did_you_mean(str(name), names, f"the variables are {', '.join(names)}")
            raise InputError(f"{shown(name)} is no variable; {hint}") from None

    def read(self) -> dict[str, float]:
        """All result variables (SI), by name."""
        with self._turn:
            values = self._idle().read()
            return {v.name: self._value(v.name, values) for v in self._variables}

    def _following(self, place: int) -> Derived:
        """A variable that follows from the channels, by its place among those."""
        names = [name for name, *_ in self._core_train.channels()]

        def value(values: list[float]) -> float:
            channels = np.array([[self._value(name, values)] for name in names])
            return float(self._core_train.derive(channels)[place, 0])

        return value
