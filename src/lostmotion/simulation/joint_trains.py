"""Drives as the actuators of the joints of a multibody engine: what they answer to the inertia matrix and the forces of a step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..control.turning import turns
from ..errors import InputError
from ..model.drive import Drive
from ..model.load import Load
from ..model.torsion import Elastic
from ..model.train import DriveTrain
from .drive_tables import Initial
from .scenario import Scenario
from .simulation_state import SimulationState
from .stepping import Simulation
from .train_tables import TrainInitial

ROWS = {name: k for k, name in enumerate(_core.joint_rows())}

Driven = Drive | Scenario | DriveTrain


@dataclass
class JointDrive:
    """A drive that turns a joint."""

    name: str
    """name of the joint"""
    drive: Driven
    """with the inertia of the load that the multibody engine has given it"""
    simulation: Simulation = field(repr=False)
    train: DriveTrain = field(repr=False)
    shaft: str
    """shaft whose angle is that of the joint"""
    command: int | None
    """place of the command among the inputs of the solver; None: a controller turns the motor"""
    command_scale: float
    """from what `step` is given to the command"""

    @property
    def mesh_frequency(self) -> float:
        """Upper bound of the natural frequencies [rad/s] of the train: the stiffest slope of each gear between its two shafts."""
        inertia = {name: s.inertia for name, s in self.train.shafts.items()}
        for motor in self.train.motors.values():
            inertia[motor.shaft] += motor.rotor_inertia
        for gear in self.train.gears.values():
            inertia[gear.input] += gear.inertia
        square = 0.0
        for gear in self.train.gears.values():
            if isinstance(gear.stiffness, Elastic):
                inner = inertia[gear.input] * gear.ratio * gear.ratio
                square += max(gear.stiffness.all_slopes()) * (1.0 / inner + 1.0 / inertia[gear.output])
        return math.sqrt(square)

    @property
    def reflected_inertia(self) -> float:
        """Inertia [kg·m²] of motors and gears as the joint feels it through stiff meshes."""
        ratios = self.ratios()
        total = 0.0
        for name in self.train.shafts:
            if name != self.shaft:
                total += self.train.inertia_of(name) * ratios[name] * ratios[name]
        for motor in self.train.motors.values():
            total += motor.rotor_inertia * ratios[motor.shaft] * ratios[motor.shaft]
        for gear in self.train.gears.values():
            total += gear.inertia * ratios[gear.input] * ratios[gear.input]
        return total

    def ratios(self) -> dict[str, float]:
        """Speed of each shaft over that of the joint, all meshes stiff."""
        return {name: turns(self.train, name, self.shaft) or 0.0 for name in self.train.shafts}


def joint_drive(name: str, drive: Driven, inertia: float, step: float) -> JointDrive:
    """A drive for a joint, with the inertia [kg·m²] of what the joint moves in place of the load's own.

    Raises
    ------
    InputError
        It is not clear which shaft the joint is.
    """
    if isinstance(drive, Scenario):
        changed: Driven = drive.replace(**{"load.inertia": inertia})
    elif isinstance(drive, Drive):
        load = drive.load
        changed = Drive(
            motor=drive.motor,
            gearbox=drive.gearbox,
            load=Load(inertia=inertia, viscous_friction=load.viscous_friction, friction_torque=load.friction_torque),
        )
    else:
        drive.refuse_coupled(drive.shafts, f"joint {name!r} gets its inertia from the robot; leave the matrix out")
        shaft = _output_of(name, drive)
        shafts = {n: s.model_copy(update={"inertia": inertia}) if n == shaft else s for n, s in drive.shafts.items()}
        changed = drive.model_copy(update={"shafts": shafts})
    if isinstance(changed, DriveTrain):
        train, shaft = changed, _output_of(name, changed)
        simulation = Simulation(changed, step=step, loaded=[shaft])
    else:
        train, shaft = changed.train(), "load"
        simulation = Simulation(changed, step=step)
    names = simulation._core_train.input_names()
    controlled = getattr(changed, "controller", None) is not None
    command, scale = None, 1.0
    if not controlled:
        if len(train.motors) != 1:
            raise InputError(f"joint {name!r}: its train has {len(train.motors)} motors; a joint is turned by one")
        (motor,) = train.motors
        command = names.index("command" if "command" in names else f"{motor}_command")
        one = train.motors[motor]
        scale = 1.0 / one.rated_torque if one.kind == "torque_source" else 1.0
    return JointDrive(name, changed, simulation, train, shaft, command, scale)


def _output_of(name: str, train: DriveTrain) -> str:
    """The shaft that gears turn and that turns none."""
    inner = {gear.input for gear in train.gears.values()}
    found = [gear.output for gear in train.gears.values() if gear.output not in inner]
    if len(set(found)) != 1:
        raise InputError(
            f"joint {name!r}: the train must have one shaft that gears turn and that turns none, and has {len(set(found))}"
        )
    return found[0]


class JointTrains:
    """Drives that turn joints which an inertia matrix joins.

    Parameters
    ----------
    drives
        One for each joint.

    Notes
    -----
    Over a substep each drive answers a constant load torque with the mean torque on its joint, its derivative and the state
    at the end, all exact. Newton's method finds the load torques that fit M a = f + tau.
    """

    def __init__(self, drives: Sequence[JointDrive]) -> None:
        self.drives = tuple(drives)
        self._core = _core.JointTrains(
            [d.simulation._core for d in self.drives],
            shafts=[list(d.train.shafts).index(d.shaft) for d in self.drives],
            commands=[-1 if d.command is None else d.command for d in self.drives],
            scales=[d.command_scale for d in self.drives],
        )
        self._values = np.zeros((len(ROWS), len(self.drives)))
        self.read()

    def __getattr__(self, name: str) -> np.ndarray:
        if name in ROWS:
            return self._values[ROWS[name]]  # type: ignore[no-any-return]
        raise AttributeError(name)

    def read(self) -> None:
        """Angles and speeds anew, after the simulations have been changed."""
        self._core.read(self._values)

    def set_commands(self, ctrl: Sequence[float]) -> None:
        """Commands of the motors; of a joint with a controller its reference."""
        self._core.set_commands(ctrl)

    def robot(self, **arrays: Any) -> _core.RobotStep:
        """Steps of a robot with the arrays of its engine."""
        return _core.RobotStep(self._core, **arrays)

    def advance(self, robot: _core.RobotStep, interval: float, substeps: int, force: np.ndarray | None = None) -> None:
        """Advance under these forces [N·m] at the middle of the interval [s]; without, by what the robot takes from its engine."""
        if force is None:
            robot.advance(self._core, interval=interval, substeps=substeps, out=self._values)
        else:
            robot.advance_under(self._core, interval=interval, substeps=substeps, force=force, out=self._values)

    def go_back(self) -> None:
        """To where the last step began."""
        self._core.go_back()
        self.read()

    @property
    def guesses(self) -> list[tuple[float, float]]:
        """By joint: load torque [N·m] and mean acceleration [rad/s²] of the last substep, where the next begins its search."""
        return list(self._core.guesses())

    @guesses.setter
    def guesses(self, guesses: Sequence[tuple[float, float]]) -> None:
        self._core.set_guesses(guesses)

    @property
    def evaluations(self) -> int:
        """Number of advances of a drive since the beginning."""
        return int(self._core.evaluations)

    @property
    def unsettled(self) -> int:
        """Substeps in which Newton's method has not come to its end."""
        return int(self._core.unsettled)

    @property
    def state(self) -> tuple[tuple[SimulationState, ...], list[tuple[float, float]]]:
        """State of all drives, with `guesses`."""
        return tuple(d.simulation.state for d in self.drives), self.guesses

    @state.setter
    def state(self, state: tuple[tuple[SimulationState, ...], list[tuple[float, float]]]) -> None:
        states, guesses = state
        for drive, one in zip(self.drives, states, strict=True):
            drive.simulation.state = one
        self.guesses = guesses
        self.read()

    def snapshot(self) -> _core.JointSnapshot:
        """Copy of the state of all drives in memory, with `guesses`."""
        return self._core.snapshot()

    def restore(self, snapshot: _core.JointSnapshot) -> None:
        """Return to a snapshot of these drives."""
        self._core.restore(snapshot)
        self.read()

    def place(self, angles: Sequence[float], speeds: Sequence[float], held: Mapping[int, float]) -> None:
        """Put the joints at angles [rad] and speeds [rad/s], all meshes at rest.

        Parameters
        ----------
        held
            By the number of a joint the torque [N·m] that its gear carries, with the hysteresis that such a torque leaves.

        Raises
        ------
        InputError
            A torque is held by a gear for which there is no twist of that torque.
        """
        for k, drive in enumerate(self.drives):
            torque = held.get(k, 0.0)
            twist, capacity = _twist_under(drive, torque) if torque else (0.0, 0.0)
            if isinstance(drive.drive, DriveTrain):
                if torque:
                    raise InputError(f"joint {drive.name!r}: held=True is for drives; start a train without it")
                ratios = drive.ratios()
                drive.simulation.reset(
                    TrainInitial(speeds={n: speeds[k] * r for n, r in ratios.items()}, angles={drive.shaft: angles[k]})
                )
            else:
                gearbox = drive.train.gears["gearbox"]
                drive.simulation.reset(
                    Initial(
                        motor_speed=gearbox.ratio * speeds[k],
                        load_speed=speeds[k],
                        load_angle=angles[k],
                        twist=twist,
                        hysteresis_capacity=capacity,
                    )
                )
        self.read()


def _twist_under(drive: JointDrive, torque: float) -> tuple[float, float]:
    """The twist [rad] of a gearbox under a torque [N·m], and the hysteresis capacity [N·m] there."""
    if isinstance(drive.drive, DriveTrain):
        return 0.0, 0.0
    gear = drive.train.gears["gearbox"]
    if not isinstance(gear.stiffness, Elastic):
        return 0.0, 0.0
    capacity = 0.0 if gear.hysteresis is None else 0.5 * (1.0 - gear.hysteresis.efficiency) * abs(torque)
    return gear.stiffness.core().twist(torque), capacity
