"""Trains of a batch that the general solver steps, each by itself."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ... import _core
from ...control.axis import OPEN_LOOP
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, listed, shown
from ..scenario.scenario import Scenario
from .batch_parameters import BatchParameters


class ExactBatch:
    """The core of such a batch.

    Parameters
    ----------
    scenarios
        One for each train.
    tuned
        Of each the scenario that its controllers are bound to.
    given
        The shaft or slide whose motion is given, if there is one.
    step
        [s]
    """

    def __init__(
        self, scenarios: Sequence[Scenario], tuned: Sequence[Scenario], given: str | None, step: float
    ) -> None:
        self._tuned = tuned
        kinds: dict[Any, int] = {}
        trains, controls, kind_of = [], [], []
        for one, base in zip(scenarios, tuned, strict=True):
            key = one, base
            if key not in kinds:
                kinds[key] = len(kinds)
                trains.append(_train_of(one, given))
                controls.append(control_of(base))
            kind_of.append(kinds[key])
        self._core = _core.ExactBatch(trains, controls=controls, kind_of=kind_of, step=step)
        self._given, self._count, self._steps = given, len(kind_of), 0
        rows = self._core.values
        self._variables: dict[str, np.ndarray] = dict(zip(self._core.variables, rows, strict=True))
        train = scenarios[0].train()
        moved = [train.variable(given, f"given_{what}") for what in ("speed", "acceleration")] if given else []
        self._speed = train.variable(given, "speed") if given else ""
        self.inputs = tuple(name for name in self._core.inputs if name not in moved)
        self.reset(None, {})

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of its variables."""
        return tuple(self._variables)

    def read(self, name: str) -> np.ndarray:
        """Values of a variable, which each step writes anew."""
        return self._variables[name]

    def change(self, parameters: BatchParameters, keys: Sequence[str], rows: np.ndarray) -> None:
        """Take over what has been written under some keys for some trains."""
        for k in rows.tolist():
            one = parameters.scenario(k)
            if not self._core.replace(k, _train_of(one, self._given), control_of(self._tuned[k])):
                raise InputError(
                    "adds or removes a part that has states; take a batch of its own", f"parameters.{keys[0]}"
                )

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Numbers of steps, in the order of `SimulationBatch.counts`."""
        return self._steps, 0, self._steps, 0

    @property
    def memory(self) -> int:
        """Memory [bytes], without what the solvers keep of regimes."""
        return int(self._core.memory)

    def step(self, values: Mapping[str, np.ndarray], motion: Mapping[str, np.ndarray], threads: int) -> None:
        """Advance all trains with these inputs."""
        zero = np.zeros(1)
        self._core.step([values.get(name, zero) for name in self._core.inputs], **motion, threads=threads)
        self._steps += self._count

    def answer(self, values: Mapping[str, np.ndarray], load: str, shaft: int, threads: int) -> np.ndarray:
        """Advance as `step` does; rows of torque, derivative and acceleration of a shaft."""
        zero, names = np.zeros(1), self._core.inputs
        inputs = [values.get(name, zero) for name in names]
        found = self._core.answer(inputs, shaft=shaft, load=names.index(load), threads=threads)
        self._steps += self._count
        return found

    def reset(self, which: np.ndarray | None, initial: Mapping[str, np.ndarray]) -> None:
        """Take trains back to t = 0."""
        states = self._core.states
        start = np.zeros((self._count, len(states) + 1))
        for name, values in initial.items():
            # Several, if several parts have that state.
            columns = [k for k, state in enumerate(states) if state == name]
            if columns:
                start[:, columns] = values[:, None]
            elif name != self._speed and values.any():
                raise InputError(f"initial.{name}: {shown(values.max())} is no state of these trains; leave it out")
        if self._speed in initial:
            start[:, -1] = initial[self._speed]
        try:
            self._core.reset(which, start)
        except ValueError as problem:
            raise InputError(f"initial: {problem}") from None

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the state at t = 0."""
        return tuple(dict.fromkeys((*self._core.states, *filter(None, [self._speed]))))

    def snapshot(self) -> Any:
        """State of all trains."""
        return self._core.snapshot()

    def restore(self, snapshot: Any) -> None:
        """Return to a snapshot."""
        self._core.restore(snapshot)


def _train_of(scenario: Scenario, shaft: str | None) -> _core.Train:
    """The solver's train; if a shaft or slide is named, its motion is given from outside."""
    if shaft is None:
        return scenario.core()
    if shaft not in scenario.train().shafts:
        known = list(scenario.train().shafts)
        raise InputError(
            f"given_motion: {shown(shaft)} is no shaft or slide; {did_you_mean(shaft, known, listed(known))}"
        )
    loaded = [name for name in scenario.loaded() if name != shaft]
    return scenario.core(loaded=loaded, given=(shaft,))


def control_of(scenario: Scenario) -> Any:
    """Its controllers, as the core takes them."""
    return scenario.control() if scenario.axes() else OPEN_LOOP
