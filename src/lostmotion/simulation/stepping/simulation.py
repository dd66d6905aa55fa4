"""A drive or a train advanced step by step: for control loops, co-simulation and learning."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from typing import Any, Self

from ... import _core
from ...control.axis import BoundController
from ...control.continuous import ContinuousController
from ...control.controller import Controller
from ...control.custom_controller import as_laws
from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.quantities import Time, argument
from ...inputs.refusal_messages import did_you_mean, shown
from ...model.couplings import FULL_COMMAND
from ...model.drive import Drive
from ...model.mass_matrix import MassMatrix
from ...model.train import DriveTrain
from ..forms.drive_tables import Initial
from ..forms.given_motion import SLIDE_UNITS, UNITS, motion_given
from ..forms.train_tables import TrainInitial
from ..scenario.field_oriented_motors import bounded, coarser
from ..scenario.requirements import need_ideal_current
from ..scenario.scenario import Scenario
from ..variables import Variable, variables_of_core
from ..variables_of_trains import only_input
from .load_answers import SimulationAnswers
from .simulation_state import SimulationState
from .step_inputs import (
    GIVE,
    MAX_INTERVAL,
    MIN_INTERVAL,
    StepInput,
    ends_of,
    masses_given,
    no_input,
    no_interval,
    parts,
)
from .step_readings import Derived
from .winding_error_bound import StepBound


class Simulation(SimulationAnswers):
    """A drive or a train that is advanced interval by interval.

    Parameters
    ----------
    drive
        A drive or a train, or a scenario, which also gives the state at t = 0, and controllers, which then turn their
        motors by themselves; its commands and load torques are not used.
    step
        The usual interval [s]; any other is possible, this one is fastest.
    initial
        State at t = 0; default: the state of the scenario, or rest.
    loaded
        Names of the shafts of a train that a load torque may act on; default: the loaded shafts of the scenario, of a train alone all.
    given
        Names of the shafts of a train whose motion `advance` is given; default: the shafts of the scenario that have a speed.
    law
        As of `simulate`.
    error_bound
        Whether to take the same simulation along with coarser exchanges between windings and mechanics, so that there is an
        `error_bound` of field-oriented control; it takes about 1.7 times as long.

    Examples
    --------
    >>> import lostmotion as lm
    >>> simulation = lm.Simulation(lm.load("paper-2dof-nl-small"))
    >>> simulation.advance("10 ms", command=0.5)
    >>> f"{simulation['load_speed']:.4g} rad/s"
    '0.28 rad/s'
    >>> simulation["load_speed", "twist"].shape
    (2,)

    Notes
    -----
    Threads may share a simulation: their steps are made one after the other. `copy.copy` gives a simulation of its own in the
    same state.
    """

    _sines: Mapping[str, tuple[float, float]] = {}
    """amplitude and frequency [Hz] of sines that act on inputs beside what `advance` gives, from t = 0 on"""

    @checked
    def __init__(
        self,
        drive: Drive | Scenario | DriveTrain,
        *,
        step: Time = 1e-3,
        initial: Initial | TrainInitial | None = None,
        loaded: Sequence[str] | None = None,
        given: Sequence[str] | None = None,
        law: Any = None,
        error_bound: bool = False,
    ) -> None:
        self._made = {
            "drive": drive,
            "step": step,
            "loaded": loaded,
            "given": given,
            "law": law,
            "error_bound": error_bound,
        }
        self._turn = threading.RLock()  # other threads wait
        self._stepping = False
        if not MIN_INTERVAL <= step <= MAX_INTERVAL:
            raise InputError(f"step {step} s must lie between {MIN_INTERVAL:g} s and {MAX_INTERVAL:g} s")
        scenario, core, self._loaded, self._given = parts(drive, loaded, given)
        need_ideal_current(scenario, "simulation step by step")
        self._drive = drive.alone() if isinstance(drive, Scenario) else drive
        self._scenario, self._train, self._core_train = scenario, scenario.train(), core
        self._initial = scenario.begin()
        self._controllers = dict(scenario.axes())
        laws = as_laws(law, self._controllers)
        self._control = self._exchanging(scenario.control(laws))
        self._bound: StepBound | None = None
        self._signals: dict[str, int] = {}  # of the controllers
        self._masses = dict(self._train.mass_matrices)
        names = core.input_names()
        self._core = self._simulation_of(core)
        self._place_inputs(names)
        channels = core.channels()
        self._channel = {name: k for k, (name, *_) in enumerate(channels)}
        self._input_units = {name: unit.removeprefix("1") for name, _, unit, _ in channels}
        # Inputs that are commands of brakes and clutches.
        self._shares = {
            self._train.variable(name, "command") for name in self._train.commanded() if name not in self._train.motors
        }
        self._variables: tuple[Variable, ...] = variables_of_core(core.variables())
        following = (v.name for v in self._variables if v.derived)
        self._derived: dict[str, Derived] = {name: self._following(k) for k, name in enumerate(following)}
        self._add_signals(scenario)
        if error_bound:
            of_windings = bounded(scenario)
            if not of_windings:
                raise InputError(
                    'error_bound: is for controllers with current.kind = "field_oriented", and there is none; leave it out'
                )
            if not all(one.repeatable for one in laws.values()):
                raise InputError(
                    "error_bound: needs a law that may be called again; give lm.control.Law(function, repeatable=True)"
                )
            self._bound = StepBound(_Coarser(drive, step=step, loaded=loaded, given=given, law=law), of_windings)
        self.reset(initial)

    def _simulation_of(self, core: _core.Train) -> _core.Simulation:
        sines = {k: self._sines[name] for k, name in enumerate(core.input_names()) if name in self._sines}
        return _core.Simulation(core, step=self._made["step"], control=self._control, sines=sines)

    def _change_masses(self, masses: Mapping[str, MassMatrix]) -> None:
        """Other mass matrices from now on; the contacts are found anew."""
        changed = {name: mass for name, mass in masses.items() if mass != self._masses[name]}
        if not changed:
            return
        core = self._core_train
        for name, mass in changed.items():
            core = core.with_mass_matrix(name, mass.matrix)
            if fault := core.check():
                raise InputError(fault[-1], where=f"mass_matrix.{name}")
        simulation = self._simulation_of(core)
        simulation.set_state(self._idle().get_state() | {"started": False})
        self._core, self._core_train, self._masses = simulation, core, self._masses | changed
        if self._bound is not None:
            self._bound.coarse._change_masses(masses)

    def _place_inputs(self, names: Sequence[str]) -> None:
        """Slots of the core for the inputs of `advance`."""
        self._inputs = len(names)
        self._motions = {  # speed and acceleration of each shaft
            name: (
                names.index(self._train.variable(name, "given_speed")),
                names.index(self._train.variable(name, "given_acceleration")),
            )
            for name in self._given
        }
        motions = {k for places in self._motions.values() for k in places}
        controlled = self._controlled()
        self._input_places = {name: k for k, name in enumerate(names) if name not in controlled and k not in motions}
        loads = {self._train.variable(shaft, "load_torque") for shaft in self._loaded}
        self._required = [name for name in self._input_places if name not in loads]
        self._only: dict[str, str] = {}  # what `advance` calls so

    def __reduce__(self) -> tuple[Any, ...]:
        """Supports copies, which go on by themselves from the present state, and pickling."""
        own = {name: value for name, value in vars(self).items() if not name.startswith("_")}  # of a subclass
        return _remade, (type(self), self._made, self._sines, self._initial, self.state), own

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        _, made, own = self.__reduce__()
        new = _remade(*made)  # a law, which may be compiled, is shared
        vars(new).update(deepcopy(own, memo))
        return new  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return f"Simulation({self._drive!r}, at {self.time:.6g} s)"

    @checked
    def reset(self, initial: Initial | TrainInitial | None = None) -> None:
        """Go back to t = 0.

        Parameters
        ----------
        initial
            A new state at t = 0; default: the state of the last start.

        Raises
        ------
        InputError
            It cannot have such a state.
        """
        with self._turn:
            self._idle()
            self._reset(self._initial if initial is None else initial.of_train())

    def _reset(self, start: TrainInitial) -> None:
        self._change_masses(self._train.mass_matrices)
        self._core.reset(self._scenario.start(start, self._given), self._scenario.capacities(start))
        self._begin_motions(start)
        self._initial = start
        if self._bound is not None:
            self._bound.coarse._reset(start)
            self._bound.forget()

    def _begin_motions(self, start: TrainInitial) -> None:
        """Set the initial speeds of shafts with a given motion."""
        if not self._motions:
            return
        state = self._core.get_state()
        for name, (speed, _) in self._motions.items():
            state["inputs"][speed] = start.speeds.get(name, 0.0)
        self._core.set_state(state)

    @property
    def error_bound(self) -> dict[str, float]:
        """Bounds of the errors of currents, torque and speed of motors under field-oriented control (SI), by the
        names of the variables. They hold at the ends of the steps since t = 0, as `simulate` gives them for a run.

        Raises
        ------
        InputError
            The simulation was made without ``error_bound=True``.
        """
        if self._bound is None:
            raise InputError("error_bound: is found where the simulation was made with error_bound=True")
        return self._bound.bounds()

    @property
    def drive(self) -> Drive | DriveTrain:
        """The drive or train that is simulated."""
        return self._drive

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what is given to `advance`."""
        return tuple(self._input_places)

    def _all_controllers(self) -> dict[str, Controller | ContinuousController]:
        return {**self._controllers, **self._scenario.continuous()}

    def _controlled(self) -> set[str]:
        return {self._train.variable(motor, "command") for motor in self._controllers}

    @property
    def time(self) -> float:
        """[s]"""
        return float(self._core.time())

    def advance(
        self,
        interval: float | str,
        command: StepInput = GIVE,
        load_torque: StepInput = 0.0,
        *,
        motion: Any = None,
        mass_matrix: Any = None,
        **inputs: StepInput,
    ) -> None:
        """Advance by an interval [s].

        Parameters
        ----------
        interval
            A number [s], or text with a unit; of NumPy and xarray too, as all numbers here.
        command, load_torque
            Where there is one command or reference, and one load torque: one value, held over the interval, or a pair of values,
            between which it runs in a straight line.
        motion
            By the name of each shaft whose motion is given a dictionary: its ``speed`` [rad/s] at the end of the interval,
            and if wanted its ``angle`` [rad], of a slide its ``position`` [m], and ``acceleration`` [rad/s²] there. On the
            way from the present values the acceleration is constant; with more than a speed it runs in up to three straight
            lines, so that the end is met. The torque that this takes is the variable ``<shaft>_drive_torque``, of a slide
            ``<slide>_drive_force``.
        mass_matrix
            By the name of a mass matrix of the train its rows [kg·m²] from now on, also in the steps that follow. The speeds stay
            as they are; what the change of the inertia does to the motion is to be given as load torques.
        inputs
            The same by the names in `inputs`, among them the references of continuous controllers, such as
            ``servo_command=0.2`` and ``table_load_torque=(0.0, 5.0)``. All commands are to be given; a load torque that is
            left out is 0.

        Raises
        ------
        InputError
            The interval is shorter than 1e-12 s or longer than 1e12 s, a value is not finite, or a name is unknown.
        SolverError
            The motion has no continuation; the message names the contact. The state stays as it was.
        """
        begin, end = self._begin_and_end(command, load_torque, inputs)
        if mass_matrix is None:
            self._step_with_motions(interval, begin, end, motion or {})
            return
        with self._turn, self._unless_refused():
            self._change_masses(masses_given(self._masses, mass_matrix))
            self._step_with_motions(interval, begin, end, motion or {})

    def _begin_and_end(
        self, command: StepInput, load_torque: StepInput, inputs: dict[str, StepInput]
    ) -> tuple[list[float], list[float]]:
        """The inputs of the core at both ends of an interval."""
        if command is not GIVE:
            inputs[self._the_only("command")] = command
        if load_torque.__class__ is not float or load_torque != 0.0:
            inputs[self._the_only("load_torque")] = load_torque
        places, begin, end = self._input_places, [0.0] * self._inputs, [0.0] * self._inputs
        for name, value in inputs.items():
            if name in self._controlled():
                raise InputError(f"{name}: a controller of the scenario turns this motor; leave it out")
            if name not in places:
                raise no_input(self._train, self.inputs, name)
            ramp = begin[places[name]], end[places[name]] = ends_of(name, value, self._input_units[name])
            if name in self._shares and max(ramp) > FULL_COMMAND:
                raise InputError(f"{name} {shown(value)} is a share, and 1 is the full torque; give at most that")
        if missing := [name for name in self._required if name not in inputs]:
            raise InputError(f"{', '.join(sorted(missing))}: missing; all commands and references are to be given")
        return begin, end

    @contextmanager
    def _unless_refused(self) -> Iterator[None]:
        """Restore the state where a step is refused."""
        before = self.state
        try:
            yield
        except (InputError, _core.SolverError):
            self.state = before
            raise

    def _step_with_motions(self, interval: Any, begin: list[float], end: list[float], motion: Any) -> None:
        """Step in parts, such that all accelerations are straight lines in each part; in one part if no motion is given."""
        if not motion and not self._motions:
            self._step(interval, begin, end)
            return
        h = argument("interval", interval, "s")
        if not MIN_INTERVAL <= h <= MAX_INTERVAL:
            raise no_interval(self.time, h)
        for name in motion:
            if name not in self._motions:
                meant = did_you_mean(name, self._motions, f"those are {', '.join(self._motions) or 'none'}")
                raise InputError(f"motion.{shown(name)}: is no shaft whose motion is given; {meant}")
        if missing := [name for name in self._motions if name not in motion]:
            raise InputError(
                f"motion.{missing[0]}: is missing; give at least its speed at the end of the interval [rad/s]"
            )
        wanted = {
            name: motion_given(name, values, SLIDE_UNITS if self._train.is_slide(name) else UNITS)
            for name, values in motion.items()
        }
        with self._turn, self._unless_refused():
            values = self._idle().read()
            courses = {}
            for name, given in wanted.items():
                to_angle = given.get("position", given.get("angle"))
                angle = 0.0 if to_angle is None else self._value(self._train.variable(name, "angle"), values)
                speed, acceleration = (self._value(f"{name}_{what}", values) for what in ("speed", "acceleration"))
                courses[name] = _core.MotionCourse(
                    to_angle=to_angle,
                    to_speed=given["speed"],
                    to_acceleration=given.get("acceleration"),
                    angle=angle,
                    speed=speed,
                    acceleration=acceleration,
                    interval=h,
                )
            times = sorted({t for course in courses.values() for t in course.times()})
            for t0, t1 in itertools.pairwise(times):
                rows = []
                for t in (t0, t1):
                    row = [a + (b - a) * (t / h) for a, b in zip(begin, end, strict=True)]
                    for name, course in courses.items():
                        speed, acceleration = self._motions[name]
                        row[speed], row[acceleration] = course.speed(t), course.acceleration(t)
                    rows.append(row)
                self._step(t1 - t0, rows[0], rows[1])

    def _the_only(self, word: str) -> str:
        """Name of the one input that `advance` calls a command or a load torque."""
        if word not in self._only:
            if word == "command" and self._controlled():
                raise InputError("command: a controller of the scenario turns the motor; leave it out")
            self._only[word] = only_input(self._train, word, self._input_places)
        return self._only[word]

    @staticmethod
    def _exchanging(control: BoundController) -> BoundController:
        """The controllers, as often as they exchange torque and speed with the mechanics."""
        return control

    def _step(self, interval: Any, begin: list[float], end: list[float], shaft: int | None = None) -> Any:
        """Advance the core. With the number of a shaft, return its inertia, mean acceleration and compliance."""
        interval = interval if type(interval) is float else argument("interval", interval, "s")
        with self._turn:
            time = self._idle().time()
            if not MIN_INTERVAL <= interval <= MAX_INTERVAL or time + interval == time:
                raise no_interval(self.time, interval)
            before = None if self._bound is None else self._bound.coarse.state
            self._stepping, answer = True, None
            try:
                if self._bound is not None:
                    self._bound.coarse._core.advance(interval, begin, end)
                if shaft is None:
                    self._core.advance(interval, begin, end)
                else:
                    answer = self._core.answer(interval, begin, end, shaft=shaft)
            except _core.SolverError:
                if self._bound is not None and before is not None:
                    self._bound.coarse.state = before
                for axis in self._control[1]:
                    axis.raise_again()  # what a law of your own has raised
                raise
            finally:
                self._stepping = False
            if self._bound is not None:
                self._bound.see(self)
        return answer

    def _idle(self) -> Any:
        """The core, which must not be read or changed by what it calls itself within a step."""
        if self._stepping:
            raise InputError("the simulation is within a step; a law has to take what it needs from its arguments")
        return self._core

    @property
    def state(self) -> SimulationState:
        """The whole state; set it to return to it, or to continue it in another simulation of the same drive."""
        with self._turn:
            values = self._idle().get_state()
            bound = None if self._bound is None else self._bound.state
        return SimulationState(
            values.pop("time"), values, self._drive, self._all_controllers(), dict(self._masses), bound
        )

    @state.setter
    def state(self, state: SimulationState) -> None:
        try:
            same = state.drive is self._drive or state.drive == self._drive
            same = same and state.controllers == self._all_controllers()
            if same and self._bound is not None and state.bound is None:
                raise InputError("the state is of a simulation without error_bound=True; make that one with it too")
            if same:
                with self._turn:
                    self._change_masses(state.mass_matrices)
                    self._idle().set_state({"time": state.time, **state.values})
                    if self._bound is not None:
                        self._bound.state = state.bound
        except (AttributeError, KeyError, TypeError):
            raise InputError(f"{shown(state)} is no state of a simulation; give what `state` returned") from None
        if not same:
            raise InputError(f"{shown(state)} is the state of another drive, with other parameters or controllers")


def _remade(kind: Any, made: Mapping[str, Any], sines: Any, initial: Any, state: SimulationState) -> Any:
    """A simulation made as another one, in its state."""
    new = kind.__new__(kind)
    new._sines = sines
    Simulation.__init__(new, **made)
    new._initial, new.state = initial, state
    return new


class _Coarser(Simulation):
    """Simulation with one exchange of torque and speed in each tick."""

    @staticmethod
    def _exchanging(control: BoundController) -> BoundController:
        return coarser(control)
