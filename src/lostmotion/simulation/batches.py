"""Many drives at once, each with its own parameters: for robot learning and domain randomisation."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..control.controller import Controller
from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.limits import check_free
from ..inputs.quantities import Count, Time
from ..inputs.validation import did_you_mean, listed, shown
from ..model.drive import Drive
from ..model.torsion import Rigid, TorsionCurve
from ..model.train import DriveTrain
from .exact_batches import ExactBatch
from .given_motion import check_motion
from .keys import renamed
from .one_gear import as_drive, drive_keys, drive_of
from .scenario import Scenario
from .stepping_parts import MAX_INTERVAL, MIN_INTERVAL
from .variables import STATES

DRIVE_BYTES = 150.0  # memory that a drive of a batch takes at least

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
"""what may differ from drive to drive, by its key in a scenario file"""
_READERS = ("motor_torque", "output_torque", "input_contact", "twist_contact")


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
        A drive, or a scenario or a train of a motor, a gearbox and a load, for all; or one for each. A scenario also gives the
        controller and the state at t = 0; its commands and load torques are not used. Drives with mesh damping in a gear with
        backlash are for `Simulation`.
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
        A sampled controller for all motors, or one for each, which runs at its own sample instants within the steps. It
        is tuned to the drives of `drives`, not to what varies.
    given_motion
        Whether the motion of the loads is given to `step`, as by a multibody engine.

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
    others, so its results do not depend on their number, on their order or on `threads`, to the last bit. Drives with
    controllers or a given motion are stepped by the solver of `Simulation`.
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
        given_motion: bool = False,
    ) -> None:
        if not MIN_INTERVAL <= step <= MAX_INTERVAL:
            raise InputError(f"step {step} s must lie between {MIN_INTERVAL:g} s and {MAX_INTERVAL:g} s")
        if seed < 0:
            raise InputError(f"seed: {seed} must be 0 or above")
        self._step = step
        self._threads = threads or os.cpu_count() or 1
        if isinstance(drives, Drive | Scenario | DriveTrain):
            one, several = drive_of(drives, "SimulationBatch"), None
            vary = {renamed(key, drive_keys(drives)): values for key, values in (vary or {}).items()}
        elif not drives:
            raise InputError("drives: there is none; give a Drive, or a list of them")
        else:
            several = [drive_of(drive, "SimulationBatch") for drive in drives]
            one = several[0]
        scenarios = [s for s in ([drives] if several is None else drives) if isinstance(s, Scenario)]
        controllers, initial = _of_scenarios(scenarios, controllers, 1 if several is None else len(several))
        if several is not None and (count is not None or vary):
            raise InputError("count and vary: are for one drive; in a list each drive has its own parameters")
        if several is None:
            self._count = _count_of(count, vary or {})
            check_free(DRIVE_BYTES * self._count, f"count: {self._count:.3g} drives", "take several batches")
        else:
            self._count = len(several)
        generator = np.random.default_rng(seed)
        self._core: Any
        self._exact: ExactBatch | None = None
        self._controlled, self._given = controllers is not None, given_motion
        if self._controlled or given_motion:
            each = several or _each_drive(one, vary or {}, self._count, generator)
            pairs = None if controllers is None else _pairs(controllers, several or [one] * self._count)
            self._exact = self._core = ExactBatch(each, pairs, given_motion, step)
            bases, self._states = each, self._exact.variables
        else:
            bases = self._tabulate([one] if several is None else several, vary or {}, generator)
            self._states = dict(zip(STATES, self._core.states, strict=True))
        self._rigid = any(isinstance(drive.gearbox.stiffness, Rigid) for drive in bases)
        self._time = np.zeros(self._count)
        if initial:
            self.reset(initial=initial)

    def _tabulate(self, drives: list[Drive], vary: Mapping[str, Any], generator: np.random.Generator) -> list[Drive]:
        """Make the core that steps by tables; the drives that differ."""
        own = _Own([], np.zeros((1, 0)), -1)
        if vary or len(drives) != self._count:
            own = _own_parameters(drives[0], vary, self._count, generator)
            bases, models, values = drives, np.zeros(self._count, dtype=int), own.values
            if own.keys or own.breaks >= 0:
                values, models = np.unique(own.values, axis=0, return_inverse=True)
            base = [0] * len(values)
        else:
            numbers: dict[Drive, int] = {}
            models = np.array([numbers.setdefault(drive, len(numbers)) for drive in drives])
            bases, base, values = list(numbers), list(range(len(numbers))), np.zeros((len(numbers), 0))
        cores = [drive.core() for drive in bases]
        for core in cores:
            if problem := _core.DriveBatch.error(core):
                raise InputError(f"drives: one {problem}; use lm.Simulation for it")
        self._core = _core.DriveBatch(
            cores,
            base=base,
            keys=own.keys,
            curve_breaks=own.breaks,
            values=np.ascontiguousarray(values),
            model_of=models.reshape(-1).tolist(),
            step=self._step,
        )
        return bases

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
        """Memory [bytes] of the states, parameters and tables of all drives, as far as the motion has met their regimes."""
        return int(self._core.memory)

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of steps of drives since the beginning, by name.

        ``steps``: all. ``with_events``: steps that were searched for switchings. ``switchings``: the number found
        there. ``general``: steps by the solver of `Simulation`, for example of a drive whose contacts are not known
        yet.
        """
        return dict(zip(("steps", "with_events", "general", "switchings"), self._core.counts, strict=True))

    @checked
    def step(self, command: Any, load_torque: Any = 0.0, *, motion: Mapping[str, Any] | None = None) -> None:
        """Advance all drives by one step.

        Parameters
        ----------
        command
            Command of the motor, as of `simulate`: share of the rated voltage, or of a torque source of its rated torque; a number, or an
            array with a number for each drive. With `controllers` their reference: position [rad], speed [rad/s] or torque [N·m].
        load_torque
            Torque [N·m] that the load takes, in the same way.
        motion
            With `given_motion`, of the loads at the end of the step: ``speed`` [rad/s], and if wanted ``angle`` [rad] and ``acceleration``
            [rad/s²], each a number or an array. The course within the step is that of `Simulation.advance`. The torque
            that this takes is the variable ``load_drive_torque``.

        Raises
        ------
        InputError
            An argument has another shape, or is not finite; the motion is missing, or not to be given.
        SolverError
            The motion of a drive has no continuation. That drive stays where it was; all others are advanced.
        """
        inputs = _numbers("command", command, self._count), _numbers("load_torque", load_torque, self._count)
        if self._exact is None:
            if motion is not None:
                raise InputError("motion: is for a batch with given_motion=True")
            self._core.step(*inputs, self._threads)
        else:
            self._exact.step(*inputs, self._motion_of(motion, inputs[1]), self._threads)
        self._time += self._step

    def _motion_of(self, motion: Mapping[str, Any] | None, load_torque: np.ndarray) -> dict[str, np.ndarray]:
        """The given motion, checked."""
        if not self._given:
            if motion is not None:
                raise InputError("motion: is for a batch with given_motion=True")
            return {}
        if motion is None:
            raise InputError('motion: is missing; give the speed at the end of the step, motion={"speed": ...}')
        if load_torque.any():
            raise InputError("load_torque: does not act on a load whose motion is given; leave it out")
        check_motion("motion", motion)
        return {key: _numbers(f"motion.{key}", value, self._count) for key, value in motion.items()}

    @checked
    def reset(self, which: Any = None, initial: Mapping[str, Any] | None = None) -> None:
        """Take drives back to t = 0.

        Parameters
        ----------
        which
            Array of Booleans with the drives that are meant; default all.
        initial
            States at t = 0 by name, each a number or an array with one for each drive; those left out are 0. The names are ``motor_torque``, ``motor_speed``,
            ``load_speed``, ``twist`` and ``load_angle``, in SI units.

        Raises
        ------
        InputError
            A name is unknown, an array has another shape, or a rigid gearbox is to have a speed or a twist.
        """
        mask = None
        if which is not None:
            mask = np.asarray(which)
            if mask.dtype != bool or mask.shape != (self._count,):
                raise InputError(
                    f"which: {shown(which)} must be an array of {self._count} Booleans, one for each drive"
                )
            mask = np.ascontiguousarray(mask)
        values = {}
        for name, value in (initial or {}).items():
            if name not in STATES:
                known = f"the states are {listed(STATES)}"
                raise InputError(f"initial.{name}: is no state; {did_you_mean(name, STATES, known)}")
            values[name] = np.broadcast_to(_numbers(f"initial.{name}", value, self._count), (self._count,))
            if self._rigid and name != "load_angle" and values[name].any():
                raise InputError(f"initial.{name}: a rigid gearbox begins at rest in a batch; give load_angle alone")
        if self._exact is not None:
            self._exact.reset(mask, values)
        else:
            zero = np.zeros(self._count)
            start = np.column_stack([values.get(name, zero) for name in STATES]) if values else None
            self._core.reset(mask, start)
        self._time[slice(None) if mask is None else mask] = 0.0

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a variable (SI), one for each drive.

        The states ``motor_speed``, ``load_speed``, ``twist`` and ``load_angle`` are the memory that each step writes anew; it
        exports DLPack, so that ``torch.from_dlpack(batch["twist"])`` copies nothing. Copy it to keep it. ``motor_torque``,
        ``output_torque``, ``input_contact`` and ``twist_contact`` are new arrays. With controllers or a given motion all
        result variables are such memory, among them what the controllers show.
        """
        if self._exact is None and name in _READERS:
            return getattr(self._core, name)()  # type: ignore[no-any-return]
        if name in self._states:
            return self._states[name]
        known = listed(dict.fromkeys((*self._states, *_READERS)))
        raise InputError(f"{shown(name)} is no variable of a batch; the variables are {known}")

    def snapshot(self) -> BatchState:
        """State of all drives, contacts and hysteresis included; `restore` returns to it."""
        return BatchState(self._time.copy(), self._core.snapshot())

    @checked
    def restore(self, state: BatchState) -> None:
        """Return to the state of a snapshot of this batch.

        Raises
        ------
        InputError
            The snapshot is that of another batch.
        """
        try:
            self._core.restore(state.core)
        except TypeError:
            raise InputError("state: is the snapshot of another batch; give one of this batch") from None
        self._time[:] = state.time


def _of_scenarios(
    scenarios: Sequence[Scenario], controllers: Controller | Sequence[Controller] | None, count: int
) -> tuple[Controller | Sequence[Controller] | None, dict[str, Any]]:
    """Controllers, and the state at t = 0 by name.

    Raises
    ------
    InputError
        Only some have one, or a state has what a batch begins without.
    """
    drives = [as_drive(scenario, "SimulationBatch") for scenario in scenarios]
    own = [drive.controller for drive in drives if drive.controller is not None]
    if own and controllers is not None:
        raise InputError("controllers: a controller of the scenario turns the motor; leave one of them out")
    if own and len(own) != count:
        raise InputError("drives: some have controllers; give all of them one")
    starts = [drive.start() for drive in drives]
    if any(drive.capacities() for drive in drives):
        raise InputError("a batch begins without hysteresis; leave it out", "initial.hysteresis_capacity")
    initial = {name: [start.get(name, 0.0) for start in starts] for name in STATES}
    moved = {name: values[0] if count == 1 else np.array(values) for name, values in initial.items() if any(values)}
    if moved and len(drives) != count:
        raise InputError("drives: some have a state at t = 0; give it by reset")
    return own[0] if len(own) == 1 and count == 1 else own or controllers, moved


@dataclass(frozen=True)
class _Own:
    """Parameters of their own, one row for each drive: by key, then the breaks and the slopes of the torsion curve."""

    keys: list[str]
    values: np.ndarray
    breaks: int
    """breaks of each torsion curve; -1: it does not vary"""


def _each_drive(drive: Drive, vary: Mapping[str, Any], count: int, generator: np.random.Generator) -> list[Drive]:
    """The drives of a batch one by one."""
    if not vary:
        return [drive] * count
    columns = _columns(drive, vary, count, generator)
    return [_changed(drive, {key: float(column[k]) for key, column in columns.items()}) for k in range(count)]


def _pairs(controllers: Controller | Sequence[Controller], drives: Sequence[Drive]) -> list[tuple[Drive, Controller]]:
    """Each controller with the drive that it is bound to.

    Raises
    ------
    InputError
        There are others than drives, or one calls functions of the user's own.
    """
    each = [controllers] * len(drives) if isinstance(controllers, Controller) else list(controllers)
    if len(each) != len(drives):
        raise InputError(f"controllers: there are {len(each)} for {len(drives)} drives; give one for all, or for each")
    for one in each:
        if one.law:
            raise InputError("controllers: a law of your own is for lm.Simulation; give position and speed loops")
    return list(zip(drives, each, strict=True))


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


def _columns(
    drive: Drive, vary: Mapping[str, Any], count: int, generator: np.random.Generator
) -> dict[str, np.ndarray]:
    """The values of what varies by key, checked."""
    columns = {}
    for key, value in vary.items():
        if key not in KEYS:
            known = f"such as {listed(KEYS[:3])}"
            raise InputError(f"vary.{key}: cannot vary in a batch; {did_you_mean(key, KEYS, known)}")
        if key.startswith("motor.") and drive.motor.kind == "synchronous":
            raise InputError(
                f"vary.{key}: the numbers of a synchronous motor follow from one another; give a list of drives"
            )
        column = value(generator, count) if callable(value) else value
        columns[key] = np.broadcast_to(_numbers(f"vary.{key}", column, count), (count,))
    for pick in (np.min, np.max):
        _changed(drive, {key: float(pick(column)) for key, column in columns.items()})
    return columns


def _own_parameters(drive: Drive, vary: Mapping[str, Any], count: int, generator: np.random.Generator) -> _Own:
    """Values of what varies, as the core takes them."""
    columns = _columns(drive, vary, count, generator)
    own = [column for key, column in columns.items() if key != BACKLASH]
    breaks = -1
    if BACKLASH in columns:
        curve = drive.gearbox.stiffness
        assert isinstance(curve, TorsionCurve)
        if columns[BACKLASH].min() <= 0.0:
            raise InputError(f"vary.{BACKLASH}: {columns[BACKLASH].min():g} rad must be above 0, for each drive")
        curve.pieces()  # both directions are the same
        half = 0.5 * columns[BACKLASH]
        own += [half, *(half + b for b in curve.breaks), *(np.full(count, s) for s in (0.0, *curve.slopes))]
        breaks = 1 + len(curve.breaks)
    table = np.column_stack(own) if own else np.zeros((1, 0))
    return _Own([key for key in columns if key != BACKLASH], table, breaks)


def _changed(drive: Drive, values: Mapping[str, float]) -> Drive:
    """The drive with other numbers.

    Raises
    ------
    InputError
        The drive does not have one of them, or its value is out of range.
    """
    parts = drive.model_dump()
    for key, value in values.items():
        *path, name = key.split(".")
        table: Any = parts
        for part in path:
            table = (table or {}).get(part)
        if not isinstance(table, dict) or table.get(name) is None:
            raise InputError(f"vary.{key}: this drive has no such number; give it in the drive first")
        table[name] = value
    return Drive(**parts)


def _numbers(name: str, value: Any, count: int) -> np.ndarray:
    """One number, or one for each drive, as the core takes them."""
    try:
        numbers = np.ascontiguousarray(value, dtype=float).reshape(-1) if np.ndim(value) < 2 else None
    except (TypeError, ValueError):
        numbers = None
    if numbers is None or len(numbers) not in (1, count) or np.iscomplexobj(value):
        raise InputError(f"{name}: {shown(value)} must be a number, or an array of {count} numbers, one for each drive")
    if not np.isfinite(numbers).all():
        raise InputError(f"{name}: has numbers that are not finite; give finite ones")
    return numbers
