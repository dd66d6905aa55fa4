"""Drives of a batch that the general solver steps: those under controllers, and those whose load has a given motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..control.axis import OPEN_LOOP, driven
from ..control.controller import Controller
from ..errors import InputError
from ..inputs.validation import shown
from ..model.drive import Drive, DriveOfOneGear
from .scenario import Scenario


class ExactBatch:
    """The core of such a batch.

    Parameters
    ----------
    drives
        One for each.
    controllers
        One for each, or None, with the drive that it is bound to.
    given
        Whether the motion of the loads is given.
    step
        [s]
    """

    def __init__(
        self, drives: Sequence[Drive], controllers: Sequence[tuple[Drive, Controller]] | None, given: bool, step: float
    ) -> None:
        kinds: dict[Any, int] = {}
        trains, controls, kind_of = [], [], []
        bound: dict[Any, Any] = {}
        for k, drive in enumerate(drives):
            pair = None if controllers is None else controllers[k]
            key = drive, *(() if pair is None else (pair[0], id(pair[1])))
            if key not in kinds:
                kinds[key] = len(kinds)
                law = None if pair is None else driven(pair[1])
                shafts: tuple[tuple[str, ...], tuple[str, ...]] = ((), ("load",)) if given else (("load",), ())
                train = drive.train() if given else drive.named_train()
                core = train.core(shafts[0], {"motor": law}, shafts[1])
                trains.append(core)
                if pair is not None and key[1:] not in bound:
                    bound[key[1:]] = Scenario.of_any(pair[0]).with_axes({"motor": pair[1]}).control()
                controls.append(OPEN_LOOP if pair is None else bound[key[1:]])
            kind_of.append(kinds[key])
        self._core = _core.ExactBatch(trains, controls=controls, kind_of=kind_of, step=step)
        self._given, self._count, self._steps = given, len(kind_of), 0
        self._long = {short: long for long, short in DriveOfOneGear.aliases.items() if given and short}
        rows = self._core.values
        self.variables: dict[str, np.ndarray] = dict(zip(self._core.variables, rows, strict=True))
        self.variables |= {name: self.variables[long] for name, long in self._long.items() if long in self.variables}
        self.reset(None, {})

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Numbers of steps, in the order of `SimulationBatch.counts`."""
        return self._steps, 0, self._steps, 0

    @property
    def memory(self) -> int:
        """Memory [bytes], without what the solvers keep of regimes."""
        return int(self._core.memory)

    def step(self, command: np.ndarray, load_torque: np.ndarray, motion: dict[str, np.ndarray], threads: int) -> None:
        """Advance all drives; `command` is the reference where controllers act."""
        zero = np.zeros(1)
        given = {"command": command, "reference": command, "load_torque": load_torque}
        given |= {"motor_command": command, "motor_reference": command}
        self._core.step([given.get(name, zero) for name in self._core.inputs], **motion, threads=threads)
        self._steps += self._count

    def reset(self, which: np.ndarray | None, initial: Mapping[str, np.ndarray]) -> None:
        """Take drives back to t = 0."""
        states = self._core.states
        start = np.zeros((self._count, len(states) + 1))
        for name, values in initial.items():
            place = self._long.get(name, name)
            if place in states:
                start[:, states.index(place)] = values
            elif values.any():
                raise InputError(f"initial.{name}: {shown(values.max())} is no state of these drives; leave it out")
        if self._given and "load_speed" in initial:
            start[:, -1] = initial["load_speed"]
        try:
            self._core.reset(which, start)
        except ValueError as problem:
            raise InputError(f"initial: {problem}") from None

    def snapshot(self) -> Any:
        """State of all drives."""
        return self._core.snapshot()

    def restore(self, snapshot: Any) -> None:
        """Return to a snapshot."""
        self._core.restore(snapshot)
