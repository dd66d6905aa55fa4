"""Trains of a batch that are a motor, a gear and a load: a walk from event to event, which begins anew at each step.

Sampled controllers run at their sample instants, between which the walk steps.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean
from ...model.torsion import Rigid, TorsionCurve
from ..forms.set_by_dotted_key import renamed
from ..runs.sensitivities import SUFFIX
from ..scenario.one_gear import drive_keys
from ..scenario.scenario import Scenario
from .batch_parameters import BatchParameters
from .exact_batches import control_of

BACKLASH = "gearbox.stiffness.backlash"
KEYS = tuple(
    key
    for key in _core.batch_fields()
    if key.startswith(("motor.", "gearbox.", "load."))
    and not key.startswith("load.torque.")
    and key != "gearbox.stiffness.slopes"
)
"""numbers that the core changes by itself, by their keys in the short form"""


class WalkedBatch:
    """The core of such a batch.

    scenarios: one for all trains, or one for each.
    parameters: what differs from train to train, beside that.
    count: number of trains.
    step: [s]
    """

    def __init__(self, scenarios: Sequence[Scenario], parameters: BatchParameters, count: int, step: float) -> None:
        first = scenarios[0]
        train = first.train()
        numbers: dict[Scenario, int] = {}
        kinds = [numbers.setdefault(one, len(numbers)) for one in scenarios]
        self._core = _core.DriveBatch(
            [_core_of(one) for one in numbers],
            controls=[control_of(one) for one in numbers],
            kind_of=kinds if len(kinds) == count else kinds * count,
            step=step,
        )
        self._first, self._numbers = first, drive_keys(first)
        self.change(parameters, tuple(parameters), np.arange(count))
        ((motor, part),), ((gear, between),) = train.motors.items(), train.gears.items()
        torque, output = train.variable(motor, "torque"), between.output
        states = (
            torque,
            train.variable(part.shaft, "speed"),
            train.variable(output, "speed"),
            train.variable(gear, "twist"),
            train.variable(output, "angle"),
        )
        self._states = dict(zip(states, self._core.states, strict=True))
        self._computed = {
            torque: self._core.motor_torque,
            train.variable(gear, "output_torque"): self._core.output_torque,
            train.variable(part.shaft, "contact"): self._core.input_contact,
            train.variable(gear, "twist_contact"): self._core.twist_contact,
        }
        self._rigid = any(isinstance(g.stiffness, Rigid) for one in numbers for g in one.train().gears.values())
        self._angle = states[-1]
        self._count = count
        self._numbers_of_variables = {name: k for k, name in enumerate(self._core.variables)}
        load = train.variable(output, "load_torque")
        (command,) = (name for name in self._core.inputs if name != load)
        self._given = command, load
        self.inputs = tuple(name for name in self._core.inputs if name != load or first.loaded())

    @staticmethod
    def takes(scenarios: Sequence[Scenario]) -> bool:
        """Whether the core takes these trains."""
        if any(scenario.continuous() for scenario in scenarios):
            return False
        return not any(_error(scenario, scenario) for scenario in dict.fromkeys(scenarios))

    def carry_sensitivities(self, keys: Sequence[str], parameters: BatchParameters) -> None:
        """Carry along the derivatives of the states with respect to parameters.

        Raises InputError: a key is no number that the core changes by itself, a drive is without that part, or a controller
        turns the motors.
        """
        if self._first.axes():
            raise InputError(
                "sensitivities: a controller turns the motor, and what it computes has a derivative, too; lm.simulate takes it into account"
            )
        own = {key: renamed(key, self._numbers) for key in keys}
        for key, number in own.items():
            if not self._is_number_of_core(number):
                known = [one for one in (*KEYS, BACKLASH) if self._is_number_of_core(one)]
                raise InputError(
                    f"is no number that a batch differentiates by; {did_you_mean(key, known, 'lm.simulate takes every number')}",
                    f"sensitivities.{key}",
                )
            absent = parameters[key] == (1.0 if number.endswith("hysteresis.efficiency") else 0.0)
            if absent.any() and not number.endswith(("inertia", "viscous_friction")):
                raise InputError(
                    f"is {parameters[key][absent][0]:g} for drive {absent.argmax()}, which leaves the part out; give every drive the part",
                    f"sensitivities.{key}",
                )
        self._core.carry_tangents(list(own.values()))
        for place, name in enumerate(self.states):
            self._computed[name + SUFFIX] = partial(self._tangents, len(own), place)

    def _tangents(self, count: int, state: int) -> np.ndarray:
        return np.stack([self._core.tangent(k, state) for k in range(count)])

    def change(self, parameters: BatchParameters, keys: Sequence[str], rows: np.ndarray) -> None:
        """Take over what has been written under some keys for some trains."""
        own = {key: renamed(key, self._numbers) for key in keys}
        if all(self._is_number_of_core(key) for key in own.values()):
            for key, number in own.items():
                self._core.set(number, parameters[key])
            return
        for k in rows.tolist():
            one = parameters.scenario(k)
            if error := _error(one, self._first):
                raise InputError(f"{error}; such drives have a batch of their own", f"parameters.{keys[0]}")
            self._core.replace(k, _core_of(one))

    def _is_number_of_core(self, key: str) -> bool:
        """Whether the core changes this number by itself. Of a synchronous motor its numbers follow from others."""
        train = self._first.train()
        if key == BACKLASH:
            return _plain(next(iter(train.gears.values())).stiffness)
        synchronous = next(iter(train.motors.values())).kind == "synchronous"
        return key in KEYS and not (synchronous and key.startswith("motor."))

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of its variables."""
        return tuple(dict.fromkeys((*self.states, *self._computed, *self._numbers_of_variables)))

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the state at t = 0."""
        return tuple(self._states)

    def read(self, name: str) -> np.ndarray:
        """Values of a variable; each step writes anew the values of states."""
        if name in self._computed:
            return self._computed[name]()
        return self._states[name] if name in self._states else self._core.read(self._numbers_of_variables[name])

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Numbers of steps, in the order of `SimulationBatch.counts`."""
        return self._core.counts

    @property
    def memory(self) -> int:
        """Memory [bytes] of states and parameters."""
        return int(self._core.memory)

    def step(self, values: Mapping[str, np.ndarray], threads: int) -> None:
        """Advance all trains with these inputs."""
        zero, (command, load) = np.zeros(1), self._given
        self._core.step(values.get(command, zero), values.get(load, zero), threads)

    def answer(self, values: Mapping[str, np.ndarray], threads: int) -> np.ndarray:
        """Advance as `step` does; rows of torque, derivative and acceleration of the load."""
        zero, (command, load) = np.zeros(1), self._given
        return self._core.answer(values.get(command, zero), values.get(load, zero), threads)

    def reset(self, which: np.ndarray | None, initial: Mapping[str, np.ndarray]) -> None:
        """Take trains back to t = 0."""
        for name, values in initial.items():
            if self._rigid and name != self._angle and values.any():
                raise InputError(f"initial.{name}: a rigid gearbox begins at rest in a batch; give {self._angle} alone")
        zero = np.zeros(self._count)
        start = np.column_stack([initial.get(name, zero) for name in self._states]) if initial else None
        self._core.reset(which, start)

    def snapshot(self) -> Any:
        """State of all trains."""
        return self._core.snapshot()

    def restore(self, snapshot: Any) -> None:
        """Return to a snapshot."""
        self._core.restore(snapshot)


def _core_of(scenario: Scenario) -> _core.Train:
    """The solver's train, where nothing else than a load torque acts on the last shaft."""
    return scenario.core(loaded=list(scenario.train().shafts)[-1:], given=())


def _error(scenario: Scenario, tuned: Scenario) -> str:
    """The reason why the core cannot step a train, or nothing."""
    return _core.DriveBatch.error(_core_of(scenario), control_of(tuned))


def _plain(stiffness: Any) -> bool:
    return isinstance(stiffness, TorsionCurve) and stiffness.core().odd
