"""Trains of a batch that are a motor, a gear and a load: most steps are one product with a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..errors import InputError
from ..model.torsion import Rigid, TorsionCurve
from .keys import renamed
from .one_gear import drive_keys
from .scenario import Scenario

BACKLASH = "gearbox.stiffness.backlash"
KEYS = (
    *(
        key
        for key in _core.batch_fields()
        if key.startswith(("motor.", "gearbox.", "load."))
        and not key.startswith("load.torque.")
        and key != "gearbox.stiffness.slopes"
    ),
    BACKLASH,
)
"""numbers that the core changes by itself, by their keys in the short form"""


class WalkedBatch:
    """The core of such a batch.

    Parameters
    ----------
    scenarios
        One for all trains, or one for each.
    columns
        Values of what varies, by their keys, one for each train.
    count
        Number of trains.
    step
        [s]
    """

    def __init__(
        self, scenarios: Sequence[Scenario], columns: Mapping[str, np.ndarray], count: int, step: float
    ) -> None:
        first = scenarios[0]
        train, own = first.train(), {renamed(key, drive_keys(first)): column for key, column in columns.items()}
        numbers: dict[Scenario, int] = {}
        models = np.array([numbers.setdefault(one, len(numbers)) for one in scenarios])
        base, values, breaks = list(range(len(numbers))), np.zeros((len(numbers), 0)), -1
        if len(scenarios) != count:
            models = np.zeros(count, dtype=int)
        if own:
            values, breaks = _table(first, own)
            values, models = np.unique(values, axis=0, return_inverse=True)
            base = [0] * len(values)
        self._core = _core.DriveBatch(
            [_core_of(one) for one in numbers],
            base=base,
            keys=[key for key in own if key != BACKLASH],
            curve_breaks=breaks,
            values=np.ascontiguousarray(values),
            model_of=models.reshape(-1).tolist(),
            step=step,
        )
        ((motor, part),), ((gear, between),) = train.motors.items(), train.gears.items()
        torque, output = train.motor_torque_of(motor), between.output
        states = (
            torque,
            train.speed_of(part.shaft),
            train.speed_of(output),
            train.twist_of(gear),
            train.angle_of(output),
        )
        self._states = dict(zip(states, self._core.states, strict=True))
        self._computed = {
            torque: self._core.motor_torque,
            train.output_torque_of(gear): self._core.output_torque,
            train.contact_of(part.shaft): self._core.input_contact,
            train.twist_contact_of(gear): self._core.twist_contact,
        }
        self._rigid = any(isinstance(g.stiffness, Rigid) for one in numbers for g in one.train().gears.values())
        self._angle = states[-1]
        self._count = count
        self._given = train.command_of(motor), train.load_torque_of(output)
        self.inputs = self._given if first.loaded() else self._given[:1]

    @staticmethod
    def takes(scenarios: Sequence[Scenario], columns: Mapping[str, np.ndarray]) -> bool:
        """Whether the core takes these trains, and changes what varies by itself."""
        if any(scenario.axes() or scenario.continuous() for scenario in scenarios):
            return False
        if any(_core.DriveBatch.error(_core_of(scenario)) for scenario in dict.fromkeys(scenarios)):
            return False
        one = scenarios[0]
        for key, column in ((renamed(key, drive_keys(one)), column) for key, column in columns.items()):
            if key not in KEYS or (
                key.startswith("motor.") and next(iter(one.train().motors.values())).kind == "synchronous"
            ):
                return False  # of a synchronous motor the core's numbers follow from one another
            if key == BACKLASH and (
                column.min() <= 0.0 or not _plain(next(iter(one.train().gears.values())).stiffness)
            ):
                return False
        return True

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of its variables."""
        return tuple(dict.fromkeys((*self.states, *self._computed)))

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the state at t = 0."""
        return tuple(self._states)

    def read(self, name: str) -> np.ndarray:
        """Values of a variable; those of states each step writes anew."""
        computed = self._computed.get(name)
        return self._states[name] if computed is None else computed()

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Numbers of steps, in the order of `SimulationBatch.counts`."""
        return self._core.counts

    @property
    def memory(self) -> int:
        """Memory [bytes] of states, tables and parameters."""
        return int(self._core.memory)

    def step(self, values: Mapping[str, np.ndarray], threads: int) -> None:
        """Advance all trains with these inputs."""
        zero, (command, load) = np.zeros(1), self._given
        self._core.step(values.get(command, zero), values.get(load, zero), threads)

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
    return scenario.core(loaded=list(scenario.tables.shafts)[-1:], given=())


def _plain(stiffness: Any) -> bool:
    return isinstance(stiffness, TorsionCurve) and stiffness.core().odd


def _table(scenario: Scenario, columns: Mapping[str, np.ndarray]) -> tuple[np.ndarray, int]:
    """Values as the core takes them, one row for each train, and the number of breaks among them; -1: no backlash varies.

    First are those by key, then the breaks and the slopes of the torsion curve.
    """
    own, breaks = [column for key, column in columns.items() if key != BACKLASH], -1
    if BACKLASH in columns:
        ((_, gear),) = scenario.train().gears.items()
        curve, half = gear.stiffness, 0.5 * columns[BACKLASH]
        assert isinstance(curve, TorsionCurve)
        own += [half, *(half + b for b in curve.breaks), *(np.full(len(half), s) for s in (0.0, *curve.slopes))]
        breaks = 1 + len(curve.breaks)
    return np.column_stack(own), breaks
