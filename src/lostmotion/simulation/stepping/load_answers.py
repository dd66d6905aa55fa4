"""Answers of a simulation to a load torque, with their derivatives, and snapshots: for multibody engines."""

import math
from dataclasses import dataclass, field
from typing import Any

from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, listed, shown
from .step_inputs import GIVE, StepInput
from .step_readings import SimulationReadings
from .winding_error_bound import StepBound


@dataclass(slots=True, eq=False)
class SimulationSnapshot:
    """Copy of a state in memory, as `Simulation.snapshot` returns it. It cannot be pickled; a `SimulationState` can."""

    time: float
    """[s]"""
    core: Any = field(repr=False)
    made: Any = field(repr=False)
    masses: Any = field(repr=False)
    bound: Any = field(repr=False)


@dataclass(frozen=True)
class LoadAnswer:
    """Torque of a drive on its load over an interval, as `Simulation.answer` returns it; of a batch arrays of all drives."""

    torque: Any
    """mean torque of the drive on its load [N·m]: inertia times mean acceleration, plus mean load torque"""
    derivative: Any
    """derivative of this torque by the mean acceleration [kg·m²]; minus infinity where dry friction holds the load"""
    acceleration: Any
    """mean acceleration of the load [rad/s²]"""


class SimulationAnswers(SimulationReadings):
    """Base of simulations: answers to a load torque, and snapshots."""

    _made: dict[str, Any]
    _motions: dict[str, tuple[int, int]]
    _input_places: dict[str, int]
    _masses: dict[str, Any]
    _bound: StepBound | None

    def _begin_and_end(
        self, command: StepInput, load_torque: StepInput, inputs: dict[str, StepInput]
    ) -> tuple[list[float], list[float]]:
        raise NotImplementedError

    def _step(self, interval: Any, begin: list[float], end: list[float], shaft: int | None = None) -> Any:
        raise NotImplementedError

    def _change_masses(self, masses: Any) -> None:
        raise NotImplementedError

    def answer(
        self,
        interval: float | str,
        command: StepInput = GIVE,
        load_torque: StepInput = 0.0,
        *,
        shaft: str = "load",
        **inputs: StepInput,
    ) -> LoadAnswer:
        """Advance as `advance` does, and return the mean torque on the load with its derivative.

        A multibody engine needs both from an actuator. The derivative predicts the torque at the acceleration that the
        engine is about to find.

        interval, command, load_torque, inputs: as of `advance`.
        shaft: of a train the shaft that is the load. A load torque acts on it.

        Returns LoadAnswer: both are exact for all load torques that are shifted by a constant over the interval. The
            derivative passes through switchings. It takes the commands of controllers at sample instants within the
            interval as constant.

        Raises InputError: as of `advance`; the shaft has no load torque, its angle follows from the angle of another
            shaft, or a mass matrix joins it to others.
        Raises SolverError: as of `advance`.

        Examples
        --------
        >>> import lostmotion as lm
        >>> simulation = lm.Simulation(lm.load("catalogue-robot-joint").drive())
        >>> found = simulation.answer("1 ms", command=0.5)
        >>> f"{found.torque:.3g} N·m, {found.derivative:.3g} kg·m²"
        '0.345 N·m, -1.64 kg·m²'
        """
        if self._motions:
            raise InputError(
                f"answer: the motion of {', '.join(self._motions)} is given; use a load torque in its place"
            )
        number = self._loaded_shaft(shaft)
        begin, end = self._begin_and_end(command, load_torque, inputs)
        inertia, acceleration, compliance = self._step(interval, begin, end, number)
        load = self._input_places[self._train.variable(shaft, "load_torque")]
        torque = inertia * acceleration + 0.5 * (begin[load] + end[load])
        return LoadAnswer(torque, inertia - 1.0 / compliance if compliance > 0.0 else -math.inf, acceleration)

    def _loaded_shaft(self, shaft: str) -> int:
        """Number of the shaft of `answer`."""
        shafts = list(self._train.shafts)
        if shaft not in shafts:
            raise InputError(
                f"shaft {shown(shaft)}: is none; {did_you_mean(str(shaft), shafts, f'those are {listed(shafts)}')}"
            )
        number = shafts.index(shaft)
        if not self._core.answers(number):
            raise InputError(f"shaft {shaft!r}: has no load torque, or a mass matrix joins it to others")
        return number

    def snapshot(self) -> SimulationSnapshot:
        """Copy of the whole state in memory, which `restore` returns to to the last bit; faster than `state`."""
        with self._turn:
            core = self._idle().snapshot()
            bound = None if self._bound is None else self._bound.state
            return SimulationSnapshot(self._core.time(), core, self._made, self._masses, bound)

    def restore(self, snapshot: SimulationSnapshot) -> None:
        """Return to the state of a snapshot of this simulation.

        Raises InputError: the snapshot belongs to another simulation.
        """
        if not isinstance(snapshot, SimulationSnapshot) or snapshot.made is not self._made:
            raise InputError(f"snapshot: {shown(snapshot)} is none of this simulation; between simulations, use state")
        with self._turn:
            if snapshot.masses is not self._masses:
                self._change_masses(snapshot.masses)
            self._idle().restore(snapshot.core)
            if self._bound is not None:
                self._bound.state = snapshot.bound
