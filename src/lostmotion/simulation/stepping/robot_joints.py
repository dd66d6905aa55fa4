"""Drives as the actuators of the joints of a multibody engine: what they answer to the inertia matrix and the forces of a step."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...inputs.refusal_messages import listed
from ...model.drive import Drive
from ...model.shaft_ratio import turns
from ...model.torsion import Elastic
from ...model.train import DriveTrain
from ..forms.train_tables import TrainInitial
from ..scenario.scenario import Scenario
from .simulation import Simulation
from .simulation_state import SimulationState

ROWS = {name: k for k, name in enumerate(_core.joint_rows())}

Driven = Drive | Scenario | DriveTrain


@dataclass
class JointDrive:
    """A drive that turns a joint."""

    name: str  # name of the joint
    drive: Scenario  # with the inertia of the load that the multibody engine has given it
    simulation: Simulation = field(repr=False)
    train: DriveTrain = field(repr=False)
    shaft: str  # shaft whose angle is the angle of the joint
    command: int | None  # place of the command among the inputs of the solver; None: a controller turns the motor
    command_scale: float  # from what `step` is given to the command

    @property
    def mesh_frequency(self) -> float:
        """Upper bound of the natural frequencies [rad/s] of the train: the stiffest slope of each gear between its two shafts."""
        inertia = {name: s.inertia for name, s in self.train.shafts.items()}
        for motor in self.train.motors.values():
            inertia[motor.shaft] += motor.rotor_inertia
        for gear in self.train.gears.values():
            inertia[gear.input] += gear.inertia
        rigid = [gear for gear in self.train.gears.values() if not isinstance(gear.stiffness, Elastic)]
        for gear in (*rigid, *reversed(rigid)):  # a shaft without inertia moves with its rigid neighbour
            inertia[gear.output] = inertia[gear.output] or inertia[gear.input] * gear.ratio * gear.ratio
            inertia[gear.input] = inertia[gear.input] or inertia[gear.output] / (gear.ratio * gear.ratio)
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

    @property
    def gear_loss(self) -> float:
        """Power that the friction of the gears takes now [W], w_1 (T_1 - T_2/i) of each, with the speed against its housing."""
        s, train, total = self.simulation, self.simulation._train, 0.0
        for name, gear in train.gears.items():
            speed = s[train.variable(gear.input, "speed")] - (
                s[train.variable(gear.housing, "speed")] if gear.housing else 0.0
            )
            total += speed * (
                s[train.variable(name, "input_torque")] - s[train.variable(name, "output_torque")] / gear.ratio
            )
        return total

    def ratios(self) -> dict[str, float]:
        """Speed of each shaft over the speed of the joint, all meshes stiff."""
        return {name: turns(self.train, name, self.shaft) or 0.0 for name in self.train.shafts}

    def own_torque(self, angle: float) -> float:
        """Torque [N·m] of the drive's springs and end stops and of its torques over the angle [rad] on the joint."""
        stops = self.train.shafts[self.shaft].end_stops
        total = 0.0 if stops is None else stops.torque(angle)
        for _, element in self.train.on_shafts():
            if element.shaft == self.shaft and hasattr(element, "over_angle"):
                total += element.over_angle()(angle)
        return total

    def twists_under(self, torque: float) -> tuple[dict[str, float], dict[str, float]]:
        """The twists [rad] by gear under a torque [N·m] on the joint, and the hysteresis capacities [N·m] that such a torque leaves.

        Gears hand the torque on without losses: at rest the share that each of them carries is not determined.

        Raises InputError: the train is no chain of gears.
        """
        twists: dict[str, float] = {}
        capacities: dict[str, float] = {}
        if torque == 0.0:
            return twists, capacities
        gears, ratios = self.train.gears, self.ratios()
        chain = len(gears) == len(self.train.shafts) - 1 == len({gear.output for gear in gears.values()})
        if not chain or any(gear.housing is not None for gear in gears.values()):
            raise InputError(f"joint {self.name!r}: held=True is for chains of gears; start this train without it")
        for name, gear in gears.items():
            if isinstance(gear.stiffness, Elastic):
                carried = torque / ratios[gear.output]
                twists[name] = gear.stiffness.core().twist(carried)
                if gear.hysteresis is not None:
                    capacities[name] = 0.5 * (1.0 - gear.hysteresis.efficiency) * abs(carried)
        return twists, capacities


def joint_drive(name: str, drive: Driven, inertia: float, step: float, *, slides: bool = False) -> JointDrive:
    """A drive for a joint, with the inertia [kg·m²] or mass [kg] of what the joint moves in place of the load's own.

    slides: whether the joint moves along a line.

    Raises InputError: it is not clear which shaft the joint is, or the joint turns and the shaft slides, or the other way; another
        inertia than the robot's moves with it; an element needs a command that `step` does not give.
    """
    scenario = Scenario.of_any(drive)
    train = scenario.train()
    shaft = output_of(name, train)
    if train.is_slide(shaft) != slides:
        joint, part = ("slide", "slide") if slides else ("hinge", "shaft that turns")
        raise InputError(f"joint {name!r}: is a {joint}, and the train ends at {shaft!r}; it needs a {part} there")
    _check_commands(name, scenario)
    if mass := next((key for key, mass in train.mass_matrices.items() if shaft in mass.shafts), None):
        raise InputError(
            f"joint {name!r}: mass_matrices.{mass} has the inertia of {shaft!r}, which comes from the robot; leave it out"
        )
    changed = scenario.with_inertia(shaft, inertia)
    simulation = Simulation(changed, step=step, loaded=None if changed.loaded() == [shaft] else [shaft])
    if not _core.turns_joint(simulation._core, list(changed.train().shafts).index(shaft)):
        raise InputError(
            f"joint {name!r}: the angle of {shaft!r} does not follow from those that the train keeps; make it the last of its shafts"
        )
    command, scale = _command(changed, simulation._core_train.input_names())
    return JointDrive(name, changed, simulation, changed.train(), shaft, command, scale)


def _command(scenario: Scenario, inputs: Sequence[str]) -> tuple[int | None, float]:
    """Place of the command of the only motor among the inputs of the solver, None for a sampled controller, and from what `step` is
    given to it."""
    train = scenario.train()
    ((name, motor),) = train.motors.items()
    if scenario.axes():
        return None, 1.0
    if scenario.continuous():
        return inputs.index(train.variable(name, "reference")), 1.0
    command = train.variable(name, "command")
    return inputs.index(command), 1.0 / motor.rated_torque if motor.kind == "torque_source" else 1.0


def _check_commands(name: str, scenario: Scenario) -> None:
    """Refuse what `step` cannot command: all but one motor, or the reference of its controller."""
    train = scenario.train()
    if len(train.motors) != 1:
        raise InputError(f"joint {name!r}: {len(train.motors) or 'no'} motors turn it, and a joint is turned by one")
    for key in train.switched().values():
        raise InputError(f"joint {name!r}: {key} needs a command, and step gives one to the motor alone; leave it out")
    if given := scenario.given():
        raise InputError(f"joint {name!r}: {scenario.given_key(given[0])} gives a motion, which the robot has")
    for motor, controller in scenario.continuous().items():
        if "reference_rate" in controller.system().signals:
            raise InputError(
                f"joint {name!r}: controllers.{motor} takes the rate of its reference, which step holds; give derivative_weight = 0"
            )


def output_of(name: str, train: DriveTrain) -> str:
    """The end of the train, which moves no other shaft: the shaft of a joint; of several the one with the name of the joint."""
    joined = [(gear.input, gear.output) for gear in train.gears.values()]
    joined += [(one, other) for one, other, _ in train.held_together()]
    inner, turned = (
        {one for one, _ in joined},
        {other for _, other in joined} | {m.shaft for m in train.motors.values()},
    )
    ends = [shaft for shaft in train.shafts if shaft in turned and shaft not in inner]
    found = [shaft for shaft in ends if shaft == name] or ends
    if len(found) != 1:
        raise InputError(
            f"joint {name!r}: the train ends at {listed(ends) or 'no shaft'}; call the shaft of the joint {name!r}"
        )
    return found[0]


class JointTrains:
    """Drives that turn joints which an inertia matrix joins.

    drives: one for each joint.

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
        """Return to the beginning of the last step."""
        self._core.go_back()
        self.read()

    @property
    def guesses(self) -> list[tuple[float, float]]:
        """Load torque [N·m] and mean acceleration [rad/s²] of the last substep, by joint; the next search begins there."""
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

        held: by the number of a joint the torque [N·m] that keeps it at rest, which its gear and its own springs give,
            with the hysteresis that such a torque leaves.

        Raises InputError: a train that is no chain of gears is held.
        """
        for k, drive in enumerate(self.drives):
            carried = held[k] - drive.own_torque(angles[k]) if k in held else 0.0
            twists, capacities = drive.twists_under(carried)
            ratios, slide = drive.ratios(), drive.train.is_slide
            state: dict[str, Any] = {
                "speeds": {n: speeds[k] * r for n, r in ratios.items() if not slide(n)},
                "slide_speeds": {n: speeds[k] * r for n, r in ratios.items() if slide(n)},
                "positions" if slide(drive.shaft) else "angles": {drive.shaft: angles[k]},
            }
            drive.simulation.reset(TrainInitial(**state, twists=twists, hysteresis_capacities=capacities))
        self.read()
