"""Many drives at once, each with its own parameters: for robot learning and domain randomisation."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...control.controller import Controller
from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.memory_limits import check_free
from ...inputs.quantities import Count, Time
from ...inputs.refusal_messages import did_you_mean, listed, shown
from ...model.drive import Drive
from ...model.train import DriveTrain
from ..forms.given_motion import check_motion
from ..runs.sensitivities import value_at
from ..scenario.requirements import need_ideal_current
from ..scenario.scenario import Scenario
from ..stepping.load_answers import LoadAnswer
from ..stepping.step_inputs import MAX_INTERVAL, MIN_INTERVAL, no_input
from ..variables_of_trains import only_input
from .batch_parameters import BatchParameters, mask_of_drives, numbers_of_drives, varied_columns
from .exact_batches import ExactBatch
from .walked_batches import WalkedBatch

TRAIN_BYTES = 150.0  # memory that a train of a batch takes at least


@dataclass(frozen=True)
class BatchState:
    """State of all drives of a batch, as `SimulationBatch.snapshot` returns it."""

    time: np.ndarray
    """time [s] of each drive since its reset"""
    core: Any = field(repr=False)


class SimulationBatch:
    """Many drives that are advanced together, step by step.

    Parameters
    ----------
    drives
        A drive, a train or a scenario for all; or one for each, with the same inputs. A scenario also gives the controllers and the
        state at t = 0; its commands and load torques are not used.
    step
        Step [s]; commands and load torques are constant over it.
    count
        Number of drives, if `drives` is one drive.
    vary
        Parameters that differ from drive to drive, by their keys in a scenario file, such as ``load.inertia`` or
        ``gearbox.stiffness.backlash``: an array in SI units with a value for each drive, or a function
        ``f(generator, count)`` that draws them.
    seed
        Seed of the generator that these functions get.
    threads
        Number of threads; default: one for each processor. Results do not depend on it.
    controllers
        A sampled controller for the one motor of all drives, or one for each, which runs at its own sample instants within the
        steps. It is tuned to the drives of `drives`, not to what varies.
    given_motion
        The shaft or slide whose motion is given to `step`, as by a multibody engine; True: the last of the train, the load of
        a drive.
    sensitivities
        Keys of parameters. The exact derivatives of the states with respect to them are carried along from the reset on,
        through all switchings, as ``NAME_sensitivity`` with a row for each key. They are for a motor, a gear and a load without
        controllers, and cost about two steps a key. After a step whose tangent cannot be proved they are NaN.

    Raises
    ------
    InputError
        A drive cannot be stepped in a batch, a key is unknown or a value is out of range.

    Examples
    --------
    >>> import lostmotion as lm
    >>> scenario = lm.load("paper-2dof-nl-small")
    >>> drive = lm.Drive(motor=scenario.motor, gearbox=scenario.gearbox, load=lm.Load(inertia=1))
    >>> batch = lm.SimulationBatch(
    ...     drive, step="1 ms", count=100, seed=1,
    ...     vary={"load.inertia": lambda generator, n: generator.uniform(0.5, 2.0, n)},
    ... )
    >>> for _ in range(100):
    ...     batch.step(command=0.1)
    >>> batch["load_angle"].shape
    (100,)

    Notes
    -----
    Each step is exact, whatever its length: `switchings` within it are located to rounding. A drive does not know of the
    others, so its results do not depend on their number, on their order or on `threads`, to the last bit. A motor, a gear and a
    load, with a sampled controller or without, are stepped by a walk that needs no tables, all others by the solver of `Simulation`.
    """

    @checked
    def __init__(
        self,
        drives: Drive | Scenario | DriveTrain | Sequence[Drive | Scenario | DriveTrain],
        step: Time,
        *,
        count: Count | None = None,
        vary: Mapping[str, Any] | None = None,
        seed: int = 0,
        threads: Count | None = None,
        controllers: Controller | Sequence[Controller] | None = None,
        given_motion: bool | str = False,
        sensitivities: Sequence[str] = (),
    ) -> None:
        if not MIN_INTERVAL <= step <= MAX_INTERVAL:
            raise InputError(f"step {step} s must lie between {MIN_INTERVAL:g} s and {MAX_INTERVAL:g} s")
        if seed < 0:
            raise InputError(f"seed: {seed} must be 0 or above")
        self._step = step
        self._threads = threads or os.cpu_count() or 1
        if isinstance(drives, Drive | Scenario | DriveTrain):
            scenarios = [_stepped(drives)]
            self._count = _count_of(count, vary or {})
        elif not drives:
            raise InputError("drives: there is none; give a Drive, or a list of them")
        elif count is not None or vary:
            raise InputError("count and vary: are for one drive; in a list each drive has its own parameters")
        else:
            scenarios = [_stepped(one) for one in drives]
            self._count = len(scenarios)
        check_free(TRAIN_BYTES * self._count, f"count: {self._count:.3g} drives", "take several batches")
        scenarios, initial = _under(controllers, scenarios, self._count), _starts(scenarios, self._count)
        columns = varied_columns(scenarios[0], vary or {}, self._count, np.random.default_rng(seed))
        last = list(scenarios[0].train().shafts)[-1]
        self._given = last if given_motion is True else given_motion or None
        self._core: ExactBatch | WalkedBatch
        self._parameters = BatchParameters(scenarios, columns, self._count)
        if self._given is None and WalkedBatch.takes(scenarios):
            self._core = WalkedBatch(scenarios, self._parameters, self._count, step)
        else:
            each = [self._parameters.scenario(k) for k in range(self._count)]
            tuned = scenarios * (self._count // len(scenarios))
            self._core = ExactBatch(each, tuned, self._given, step)
        self._train, self._time = scenarios[0].train(), np.zeros(self._count)
        if sensitivities:
            for key in sensitivities:
                value_at(scenarios[0], key)
            if isinstance(self._core, ExactBatch):
                raise InputError(
                    "sensitivities: are carried along for a motor, a gear and a load that nothing else moves; lm.simulate takes all trains"
                )
            self._core.carry_sensitivities(sensitivities, self._parameters)
        loads = {self._train.variable(shaft, "load_torque") for shaft in self._train.shafts}
        self._required = {name for name in self._core.inputs if name not in loads}
        self.reset(initial={name: value for name, value in initial.items() if name in self._core.states})

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        return f"SimulationBatch({self._count} drives, step {self._step:g} s)"

    @property
    def time(self) -> np.ndarray:
        """Time [s] of each drive since its reset."""
        return self._time.copy()

    @property
    def memory(self) -> int:
        """Memory [bytes] of the states and parameters of all drives."""
        return int(self._core.memory)

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of steps of drives since the beginning, by name.

        ``steps``: all. ``with_events``: steps that were searched for switchings. ``switchings``: the number found
        there. ``general``: steps by the solver of `Simulation`, for example of a drive whose contacts are not known
        yet.
        """
        return dict(zip(("steps", "with_events", "general", "switchings"), self._core.counts, strict=True))

    @property
    def parameters(self) -> Mapping[str, np.ndarray]:
        """Parameters of all drives, by their keys in a scenario file, as arrays that may be written between steps."""
        return self._parameters

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what is given to `step`."""
        return self._core.inputs

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the variables that ``batch[name]`` returns."""
        return self._core.variables

    @checked
    def step(
        self, command: Any = None, load_torque: Any = 0.0, *, motion: Mapping[str, Any] | None = None, **inputs: Any
    ) -> None:
        """Advance all drives by one step.

        Parameters
        ----------
        command
            Where there is one command or reference: a number, or an array with a number for each drive. Of a motor the share of the
            rated voltage, of a torque source of its rated torque, as of `simulate`; of a controller its reference: position
            [rad], speed [rad/s] or torque [N·m].
        load_torque
            Where there is one load: the torque [N·m] or force [N] that it takes, in the same way.
        motion
            With `given_motion`, at the end of the step: ``speed`` [rad/s], and if wanted ``angle`` [rad] and ``acceleration``
            [rad/s²], each a number or an array. The course within the step is the same as in `Simulation.advance`. The torque
            that this takes is the variable ``load_drive_torque``.
        inputs
            The same by the names in `inputs`, such as ``first_motor_command=0.2``. All commands are to be given; a load that
            is left out is 0.

        Raises
        ------
        InputError
            An argument has another shape, or is not finite; an input is missing or unknown; the motion is missing, or not to
            be given.
        SolverError
            The motion of a drive has no continuation. That drive stays where it was; all others are advanced.
        """
        for word, value in (("command", command), ("load_torque", load_torque)):
            if value is not None and (word == "command" or np.any(value)):
                inputs[self._the_only(word)] = value
        values, course = self._checked_inputs(inputs), self._motion_of(motion)
        self._take_parameters()
        if isinstance(self._core, ExactBatch):
            self._core.step(values, course, self._threads)
        else:
            self._core.step(values, self._threads)
        self._time += self._step

    @checked
    def answer(
        self, command: Any = None, load_torque: Any = 0.0, *, shaft: str | None = None, **inputs: Any
    ) -> LoadAnswer:
        """Advance as `step` does, and return the mean torque on the load with its derivative, as `Simulation.answer` does.

        Parameters
        ----------
        command, load_torque, inputs
            As of `step`.
        shaft
            The shaft that is the load; left out, the last one.

        Returns
        -------
        LoadAnswer
            Arrays with a number for each drive.

        Raises
        ------
        InputError
            As of `step`; the shaft has no load torque, or a mass matrix joins it to others.
        SolverError
            As of `step`.

        Examples
        --------
        >>> import lostmotion as lm
        >>> joints = lm.SimulationBatch(lm.load("catalogue-robot-joint").drive(), step="1 ms", count=2)
        >>> found = joints.answer([0.5, 0.6], 0.0)
        >>> found.torque.round(3), found.derivative.round(2)
        (array([0.345, 0.414]), array([-1.64, -1.64]))
        """
        if self._given:
            raise InputError(f"answer: the motion of {self._given} is given; use a load torque in its place")
        shafts = list(self._train.shafts)
        if (answering := shafts[-1] if shaft is None else shaft) not in shafts:
            raise InputError(
                f"shaft: {shown(answering)} is none; {did_you_mean(answering, shafts, f'those are {listed(shafts)}')}"
            )
        load = self._train.variable(answering, "load_torque")
        if load not in self.inputs or (isinstance(self._core, WalkedBatch) and answering != shafts[-1]):
            raise InputError(
                f"shaft: {shown(answering)} has no load torque among {listed(self.inputs)}; give one that has"
            )
        if command is not None:
            inputs[self._the_only("command")] = command
        if np.any(load_torque):
            inputs[load] = load_torque
        values = self._checked_inputs(inputs)
        self._take_parameters()
        if isinstance(self._core, ExactBatch):
            try:
                rows = self._core.answer(values, load, shafts.index(answering), self._threads)
            except ValueError:
                raise InputError(
                    f"shaft: a mass matrix joins {shown(answering)} to others; give one that is free"
                ) from None
        else:
            rows = self._core.answer(values, self._threads)
        self._time += self._step
        return LoadAnswer(*rows)

    def _checked_inputs(self, inputs: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Inputs by name as the core takes them."""
        values = {name: numbers_of_drives(name, value, self._count) for name, value in inputs.items()}
        for name in values:
            if name not in self.inputs:
                raise no_input(self._train, self.inputs, name)
        if missing := self._required - values.keys():
            raise InputError(f"{', '.join(sorted(missing))}: missing; all commands and references are to be given")
        return values

    def _take_parameters(self) -> None:
        """Give the core what has been written into `parameters`."""
        keys, rows = self._parameters.changes()
        if keys:
            self._core.change(self._parameters, keys, rows)

    def _the_only(self, word: str) -> str:
        """Name of the one input that `step` calls a command or a load torque."""
        if word == "load_torque" and self._given and self._required == set(self.inputs):
            raise InputError(f"load_torque: does not act on {self._given}, whose motion is given; leave it out")
        return only_input(self._train, word, self.inputs)

    def _motion_of(self, motion: Mapping[str, Any] | None) -> dict[str, np.ndarray]:
        """The given motion, checked."""
        if not self._given:
            if motion is not None:
                raise InputError("motion: is for a batch with given_motion")
            return {}
        if motion is None:
            raise InputError('motion: is missing; give the speed at the end of the step, motion={"speed": ...}')
        check_motion("motion", motion)
        return {key: numbers_of_drives(f"motion.{key}", value, self._count) for key, value in motion.items()}

    @checked
    def reset(self, which: Any = None, initial: Mapping[str, Any] | None = None) -> None:
        """Take drives back to t = 0.

        Parameters
        ----------
        which
            Array of Booleans with the drives that are meant; default all.
        initial
            States at t = 0 by the names of their variables, in SI units, each a number or an array with one for each drive;
            those left out are 0. Of a motor, a gearbox and a load they are ``motor_torque``, ``motor_speed``, ``load_speed``,
            ``twist`` and ``load_angle``.

        Raises
        ------
        InputError
            A name is unknown, an array has another shape, or a rigid gearbox is to have a speed or a twist.
        """
        mask = None if which is None else mask_of_drives(which, self._count)
        values = {}
        for name, value in (initial or {}).items():
            if name not in self._core.states:
                known = f"the states are {listed(self._core.states)}"
                raise InputError(f"initial.{name}: is no state; {did_you_mean(name, self._core.states, known)}")
            values[name] = np.broadcast_to(numbers_of_drives(f"initial.{name}", value, self._count), (self._count,))
        self._core.reset(mask, values)
        self._time[slice(None) if mask is None else mask] = 0.0

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a variable (SI), one for each drive.

        The states ``motor_speed``, ``load_speed``, ``twist`` and ``load_angle`` of a motor, a gearbox and a load are the
        memory that each step writes anew. It exports DLPack, so that ``torch.from_dlpack(batch["twist"])`` copies nothing.
        Copy it to keep it. The other variables of such drives are new arrays. ``motor_torque``, ``output_torque``,
        ``input_contact``, ``twist_contact`` and the signals of controllers cost little; the rest, such as ``efficiency``, is
        computed by the solver of `Simulation` when it is read. All variables of other trains are memory that each step
        writes anew.
        """
        if name in self._core.variables:
            return self._core.read(name)
        raise InputError(f"{shown(name)} is no variable of a batch; the variables are {listed(self._core.variables)}")

    def snapshot(self) -> BatchState:
        """State of all drives, contacts and hysteresis included; `restore` returns to it."""
        return BatchState(self._time.copy(), self._core.snapshot())

    @checked
    def restore(self, state: BatchState) -> None:
        """Return to the state of a snapshot of this batch.

        Raises
        ------
        InputError
            The snapshot belongs to another batch.
        """
        try:
            self._core.restore(state.core)
        except TypeError:
            raise InputError("state: is the snapshot of another batch; give one of this batch") from None
        self._time[:] = state.time


def _stepped(drive: Drive | Scenario | DriveTrain) -> Scenario:
    """Scenario of what is stepped. On a train alone a load torque may act on all shafts."""
    scenario = Scenario.of_any(drive)
    need_ideal_current(scenario, "batch")
    if isinstance(drive, DriveTrain):
        loads: dict[str, Any] = {
            f"shafts.{name}.torque": {} for name in scenario.tables.shafts if name not in scenario.loaded()
        }
        scenario = scenario.replace(**loads)
    if scenario.given():
        key = scenario.given_key(scenario.given()[0])
        raise InputError(f"drives: key {key} gives the motion of a shaft; leave it out, and give given_motion its name")
    return scenario


def _under(
    controllers: Controller | Sequence[Controller] | None, scenarios: list[Scenario], count: int
) -> list[Scenario]:
    """The scenarios, their one motor under the controllers that are given.

    Raises InputError: there are others than drives, or one calls functions of the user's own.
    """
    if controllers is not None:
        each = [controllers] * len(scenarios) if isinstance(controllers, Controller) else list(controllers)
        if len(each) != count and not isinstance(controllers, Controller):
            raise InputError(f"controllers: there are {len(each)} for {count} drives; give one for all, or for each")
        if any(scenario.tables.controllers for scenario in scenarios):
            raise InputError("controllers: a controller of the scenario turns the motor; leave one of them out")
        if any(len(scenario.train().motors) != 1 for scenario in scenarios):
            raise InputError("controllers: are for trains with one motor; give scenarios with controllers of their own")
        scenarios = scenarios * (len(each) // len(scenarios))
        scenarios = [
            one.with_axes(dict.fromkeys(one.train().motors, each[k % len(each)])) for k, one in enumerate(scenarios)
        ]
    if any(controller.law for scenario in scenarios for controller in scenario.axes().values()):
        raise InputError("controllers: a law of your own is for lm.Simulation; give position and speed loops")
    if len({(tuple(one.core().input_names()), tuple(one.axes())) for one in scenarios}) > 1:
        raise InputError("drives: have different inputs; take a batch for each kind")
    return scenarios


def _starts(scenarios: Sequence[Scenario], count: int) -> dict[str, Any]:
    """The state at t = 0 by name, as far as it is not rest. Raises InputError: it has a hysteresis."""
    if any(scenario.capacities() for scenario in scenarios):
        raise InputError("a batch begins without hysteresis; leave it out", "initial.hysteresis_capacity")
    starts = [scenario.start() for scenario in scenarios]
    initial = {name: np.array([start.get(name, 0.0) for start in starts]) for name in starts[0]}
    return {name: x if len(x) == count else x[0] for name, x in initial.items() if x.any()}


def _count_of(count: int | None, vary: Mapping[str, Any]) -> int:
    """Number of drives, from the arrays if it is not given."""
    sizes = {key: np.shape(value)[0] for key, value in vary.items() if not callable(value) and np.ndim(value) == 1}
    if count is None and not sizes:
        raise InputError("count: give the number of drives, or an array in vary")
    if count is None:
        count = next(iter(sizes.values()))
    for key, size in sizes.items():
        if size != count:
            raise InputError(f"vary.{key}: has {size} values for {count} drives; give one for each drive")
    return count
