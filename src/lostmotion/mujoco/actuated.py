"""A robot of MuJoCo whose joints are turned by exact drives."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.controller import Controller
from ..data_sheets.components import gearbox
from ..data_sheets.records import catalogue
from ..errors import InputError, need
from ..inputs.arguments import checked
from ..inputs.validation import did_you_mean, listed, shown
from ..model.drive import Drive
from ..model.load import Load
from ..model.motor import Motor
from ..model.train import DriveTrain
from ..simulation.drive_scenario import DriveScenario
from ..simulation.exact_batches import controlled
from ..simulation.joint_trains import Driven, JointDrive, JointTrains, joint_drive
from ..simulation.shipped import shipped_scenarios
from ..simulation.sources import load_drive
from .joints import joint_id

if TYPE_CHECKING:
    import mujoco

MAX_SUBSTEPS = 1000
CONTACT_PASSES = 2
SUBSTEP_PHASE = 0.5
"""Largest natural frequency of a mesh times substep [rad]."""
STIFFEST = 1e6
"""Largest inertia of a joint that its drive holds, over its nominal one, as MuJoCo's contact solver sees it."""


@dataclass(frozen=True)
class ActuatedState:
    """The whole state of an `Actuated`: robot, drives, and what the next step predicts from."""

    mujoco: np.ndarray = field(repr=False)
    drives: Any = field(repr=False)
    course: tuple[Any, ...] = field(repr=False)


@dataclass(frozen=True)
class ActuatedSnapshot(ActuatedState):
    """Copy of a state in memory, as `Actuated.snapshot` returns it. It cannot be pickled; an `ActuatedState` can."""

    of: Actuated = field(repr=False)


class Actuated:
    """A robot of MuJoCo whose joints are turned by exact drives. `attach` makes it.

    Attributes
    ----------
    model, data
        The `mujoco.MjModel` and its `mujoco.MjData`. After `step` position, speed, time and `qacc` (mean over the step) are those
        at the end; poses of bodies and contacts are those of the middle of the step, and sensors are not evaluated. Call
        ``mujoco.mj_forward(model, data)`` where they are wanted at the end.
    joints
        Names of the joints with a drive, in the order of all arrays.
    substeps
        Substeps of the drives within a step of MuJoCo, chosen so that the natural frequency of the stiffest mesh times the
        substep is at most 0.5.
    """

    def __init__(self, model: mujoco.MjModel, given: Mapping[str, Driven], substeps: int | None) -> None:
        import mujoco

        self._mj = mujoco
        self._kind = mujoco.mjtState.mjSTATE_INTEGRATION
        self.model = model
        self.data = mujoco.MjData(model)
        self.joints: tuple[str, ...] = tuple(given)
        ids = [joint_id(model, name) for name in given]
        self._dofs = np.array([model.jnt_dofadr[j] for j in ids])
        self._addresses = np.array([model.jnt_qposadr[j] for j in ids])
        step = float(model.opt.timestep)
        mujoco.mj_forward(model, self.data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, self.data, mass)
        inertias = 1.0 / np.diag(np.linalg.inv(mass))[self._dofs]
        made = [
            joint_drive(name, drive, float(inertia), step)
            for (name, drive), inertia in zip(given.items(), inertias, strict=True)
        ]
        self._drives: dict[str, JointDrive] = dict(zip(self.joints, made, strict=True))
        self.substeps = _substeps(made, step) if substeps is None else substeps
        if self.substeps > MAX_SUBSTEPS:
            worst = max(made, key=lambda d: d.mesh_frequency)
            raise InputError(
                f"joint {worst.name!r}: its mesh swings at {worst.mesh_frequency / (2 * math.pi):.4g} Hz, so that the timestep of {step:g} s "
                f"would take {self.substeps} substeps; at most {MAX_SUBSTEPS} are made: shorten option.timestep"
            )
        self._trains = JointTrains(made)
        self._inertias = inertias
        # What contacts feel of a joint at the pose that MuJoCo scales its constraints with.
        model.dof_armature[self._dofs] = [d.reflected_inertia for d in made]
        mujoco.mj_setConst(model, self.data)
        model.dof_armature[self._dofs] = 0.0
        self._rows = np.repeat(np.arange(model.nv), model.M_rownnz)
        self._contact = np.zeros(model.nv)
        self._among_drives = np.ix_(self._dofs, self._dofs)
        self._turning = model.nq != model.nv  # positions of balls and free bodies are no integrals of speeds
        self._robot = self._core_robot()
        # Views of what it computes.
        self._mass: np.ndarray = self._robot.mass
        self._own: np.ndarray = self._robot.inertia
        self._mean: np.ndarray = self._robot.acceleration
        self._no_contact = np.zeros(model.nv)
        self.reset()

    def _core_robot(self) -> Any:
        m, d = self.model, self.data
        return self._trains.robot(
            *(d.qpos, d.qvel, d.qacc, d.qacc_warmstart, d.qfrc_smooth, d.M),
            *(m.M_rownnz, m.M_rowadr, m.M_colind),
            m.dof_damping.reshape(m.nv, -1)[:, 0].tolist(),
            self._dofs.tolist(),
            [k for k in range(m.nv) if k not in set(self._dofs)],
            self._addresses.tolist(),
            [] if self._turning else list(range(m.nv)),
        )

    def __repr__(self) -> str:
        return f"Actuated({listed(self.joints)}; {self.substeps} substeps, at {self.data.time:.6g} s)"

    @property
    def drives(self) -> dict[str, Driven]:
        """By joint: the drive, with the inertia of the robot in place of its load's own."""
        return {name: d.drive for name, d in self._drives.items()}

    def simulation(self, joint: str) -> Any:
        """The `lostmotion.Simulation` of a joint, to read and to explain; stepping it by itself would tear it from the robot."""
        if joint not in self._drives:
            raise InputError(
                f"joint {shown(joint)}: has no drive; {did_you_mean(joint, self.joints, f'those are {listed(self.joints)}')}"
            )
        return self._drives[joint].simulation

    def __getitem__(self, name: str) -> np.ndarray:
        """A result variable of all drives, such as ``"motor_speed"``, ``"twist"``, ``"input_contact"``, by the order of `joints`.

        Raises
        ------
        InputError
            A drive has no such variable.
        """
        return np.array([d.simulation[name] for d in self._drives.values()])

    @property
    def torque(self) -> np.ndarray:
        """Mean torque of each drive on its joint over the last step [N·m]."""
        return np.array(self._trains.torque)

    @property
    def gear_loss(self) -> np.ndarray:
        """Power that the friction of each gearbox takes now [W]: w_M (T_1 - T_2/i)."""
        ratios = np.array([d.train.gears["gearbox"].ratio for d in self._drives.values()])
        loss: np.ndarray = self["motor_speed"] * (self["input_torque"] - self["output_torque"] / ratios)
        return loss

    @property
    def counts(self) -> dict[str, int]:
        """Number of advances of drives, and of substeps in which the coupling with the robot was not solved to rounding."""
        return {"evaluations": self._trains.evaluations, "unsettled": self._trains.unsettled}

    def reset(self, keyframe: int | None = None, *, held: bool = False) -> None:
        """Go back to t = 0.

        Parameters
        ----------
        keyframe
            Number of a keyframe of the model; left out, its reference pose.
        held
            As of `follow`.
        """
        if keyframe is None:
            self._mj.mj_resetData(self.model, self.data)
        elif 0 <= keyframe < self.model.nkey:
            self._mj.mj_resetDataKeyframe(self.model, self.data, keyframe)
        else:
            raise InputError(f"keyframe {keyframe}: the model has {self.model.nkey}")
        self.follow(held=held)

    def follow(self, *, held: bool = False) -> None:
        """Take the drives to where `data` is, after it has been changed: angles and speeds, nothing twisted.

        Parameters
        ----------
        held
            Each gear is twisted by the torque that keeps its joint at rest, as after the robot has been standing for a while.
        """
        m, d = self.model, self.data
        self._mj.mj_forward(m, d)
        force = (d.qfrc_smooth + d.qfrc_constraint)[self._dofs]
        carried = {k: -float(f) for k, f in enumerate(force)} if held else {}
        self._trains.place(d.qpos[self._addresses].tolist(), d.qvel[self._dofs].tolist(), carried)
        self._trains.guesses = [(-float(f), 0.0) for f in force]
        n, zero = len(self.joints), [0.0] * m.nv
        self._robot.course = zero, zero, [0.0] * (n * n), [0.0] * n, False
        self._contact = d.qfrc_constraint.copy()

    def _away(self, k: int) -> InputError:
        q, v = self.data.qpos[self._addresses[k]], self.data.qvel[self._dofs[k]]
        return InputError(
            f"joint {self.joints[k]!r}: data has it at {q:.6g} rad, {v:.6g} rad/s, its drive at {self._trains.angle[k]:.6g} rad, "
            f"{self._trains.speed[k]:.6g} rad/s; call follow() after data has been changed"
        )

    def step(self, ctrl: Mapping[str, float] | Sequence[float] | np.ndarray | None = None) -> None:
        """Advance robot and drives by the timestep of the model.

        Parameters
        ----------
        ctrl
            One number for each joint, in the order of `joints` or by name: the torque on the motor's shaft [N·m] of a torque
            source, the command (share of the rated voltage) of a DC or synchronous motor, the reference of a controller
            (position [rad] or speed [rad/s]). Left out, zero.

        Raises
        ------
        InputError
            Another number of values, an unknown joint, or `data` was changed without `follow`.
        SolverError
            The motion of a drive has no continuation.
        """
        self._trains.set_commands(self._controls(ctrl))
        mj, m, d, robot, h = self._mj, self.model, self.data, self._robot, self.model.opt.timestep
        if (away := robot.begin(h)) >= 0:
            raise self._away(away)
        begin = d.time
        # Mass matrix and forces at the middle of the step.
        try:
            if self._turning:
                mj.mj_integratePos(m, d.qpos, robot.motion, 0.5 * h)
            d.time = begin + 0.5 * h
            mj.mj_fwdPosition(m, d)
            if d.nefc == 0:
                robot.predict_speed(h)
                self._compute_forces()
                self._trains.advance(robot, h, self.substeps)
                acceleration, self._contact = self._mean, self._no_contact
            else:
                # The mean acceleration is not smooth here, so it is found in passes and not from that of the steps before.
                acceleration = np.zeros(m.nv)
                for again in range(CONTACT_PASSES):
                    if again:
                        self._trains.go_back()
                    robot.set_speed(h, acceleration)
                    acceleration = self._solve_with_contact(h, acceleration)
        except BaseException:
            robot.restore()
            d.time = begin
            raise
        robot.integrate(h, acceleration)
        if self._turning:
            mj.mj_integratePos(m, d.qpos, robot.motion, h)
        robot.finish(acceleration)
        d.time = begin + h

    def _compute_forces(self) -> None:
        """Forces [N·m] beside those of drives and contacts."""
        self._mj.mj_fwdVelocity(self.model, self.data)
        self._mj.mj_fwdActuation(self.model, self.data)
        self._mj.mj_fwdAcceleration(self.model, self.data)

    def _solve_with_contact(self, h: float, acceleration: np.ndarray) -> np.ndarray:
        """The same with contacts, limits and equalities: MuJoCo's solver finds their forces.

        It is given the inertia matrix that they feel over the step: that of the robot, and that of the drives B =
        -dtau/da. For that the whole step is made without contact forces, and once for each drive with another torque.
        This torque is that of the contacts found before, so that B holds between both, whatever switches there. Where
        a mesh swings within the step, the mean over it is that of the position, 2 (q - q_0 - v_0 h)/h^2, which always
        follows the force.
        """
        mj, m, d, dofs = self._mj, self.model, self.data, self._dofs
        self._compute_forces()
        self._robot.take(h, acceleration)
        force = self._robot.force
        guesses = self._trains.guesses

        angle, speed = self._trains.angle.copy(), self._trains.speed.copy()

        def tried(change: np.ndarray) -> np.ndarray:
            self._trains.advance(self._robot, h, self.substeps, change)
            out = self._mean.copy()
            out[dofs] = 2.0 * (self._trains.angle - angle - h * speed) / (h * h)
            self._trains.go_back()
            self._trains.guesses = guesses
            return out

        free = tried(force)
        mobility = np.empty((dofs.size, dofs.size))
        for k, dof in enumerate(dofs):
            size, more = self._contact[dof], force.copy()
            if abs(size) < (least := 1e-3 * (1.0 + abs(force[dof]))):
                size = least
            more[dof] += size
            mobility[:, k] = (tried(more) - free)[dofs] / size
        # A joint that is held has no mobility: there the solver sees a large inertia.
        values, vectors = np.linalg.eigh(0.5 * (mobility + mobility.T))
        least_mobility = 1.0 / (STIFFEST * self._inertias.max())
        stiffness = (vectors / np.maximum(values, least_mobility)) @ vectors.T
        self._mass[self._among_drives] += stiffness - self._own
        d.M[:] = self._mass[self._rows, m.M_colind]
        mj.mj_factorM(m, d)
        d.qacc_smooth[:] = free
        d.qfrc_smooth[:] = self._mass @ free
        mj.mj_fwdConstraint(m, d)
        self._contact = d.qfrc_constraint.copy()
        self._trains.advance(self._robot, h, self.substeps, force + self._contact)
        return self._mean

    def _controls(self, ctrl: Any) -> list[float]:
        if ctrl is None:
            return [0.0] * len(self.joints)
        if isinstance(ctrl, Mapping):
            for name in ctrl:
                if name not in self._drives:
                    meant = did_you_mean(name, self.joints, f"those are {listed(self.joints)}")
                    raise InputError(f"ctrl: joint {shown(name)} has no drive; {meant}")
            ctrl = [ctrl.get(name, 0.0) for name in self.joints]
        try:
            values = [float(value) for value in ctrl]
        except (TypeError, ValueError):
            values = []
        if len(values) != len(self.joints) or not all(map(math.isfinite, values)):
            raise InputError(
                f"ctrl: {shown(ctrl)} must be {len(self.joints)} finite numbers, for {listed(self.joints)}"
            )
        return values

    @property
    def state(self) -> ActuatedState:
        """The whole state; set it to return to it. `snapshot` is faster, for this object alone."""
        return ActuatedState(self._robot_state(), self._trains.state, self._course())

    @state.setter
    def state(self, state: ActuatedState) -> None:
        self._trains.state = state.drives
        self._restore_robot(state)

    def snapshot(self) -> ActuatedSnapshot:
        """Copy of the whole state in memory, which `restore` returns to to the last bit."""
        return ActuatedSnapshot(self._robot_state(), self._trains.snapshot(), self._course(), self)

    def restore(self, snapshot: ActuatedSnapshot) -> None:
        """Return to the state of a snapshot of this object.

        Raises
        ------
        InputError
            The snapshot is that of another one.
        """
        if not isinstance(snapshot, ActuatedSnapshot) or snapshot.of is not self:
            raise InputError(f"snapshot: {shown(snapshot)} is none of this robot; between robots, use state")
        self._trains.restore(snapshot.drives)
        self._restore_robot(snapshot)

    def _robot_state(self) -> np.ndarray:
        values = np.zeros(self._mj.mj_stateSize(self.model, self._kind))
        self._mj.mj_getState(self.model, self.data, values, self._kind)
        return values

    def _course(self) -> tuple[Any, ...]:
        """Accelerations, matrices and forces that the next step predicts from; none is changed in place."""
        return self._robot.course, self._contact

    def _restore_robot(self, state: ActuatedState) -> None:
        self._mj.mj_setState(self.model, self.data, state.mujoco, self._kind)
        self._robot.course, self._contact = state.course


def _substeps(drives: Sequence[JointDrive], step: float) -> int:
    """So many that the stiffest mesh turns by at most SUBSTEP_PHASE in each."""
    return max(1, *(math.ceil(d.mesh_frequency * step / SUBSTEP_PHASE) for d in drives))


def drive_of_joint(joint: str, given: Any, controller: Controller | None) -> Driven:
    """Return the argument of `attach` for a joint as a drive, a scenario with a controller, or a train.

    Raises
    ------
    InputError
    """
    if isinstance(given, str | Path):
        given = _named(joint, str(given))
    if isinstance(given, DriveScenario) and given.controller is None:
        given = given.drive()
    if not isinstance(given, Drive | DriveScenario | DriveTrain):
        raise InputError(
            f"joint {joint!r}: {shown(given)} is no drive; give a Drive, a DriveTrain, a scenario, or the name of a gearbox of the catalogue"
        )
    if controller is None:
        return given
    if not isinstance(given, Drive):
        raise InputError(
            f"joint {joint!r}: controllers are for drives; give a Drive, or a scenario with its controller"
        )
    return controlled(given, controller)


def _named(joint: str, name: str) -> Drive | DriveScenario:
    """Shipped scenario or scenario file by its name; for a gearbox of the catalogue a drive with an ideal torque source."""
    if name.endswith(".toml") or name in shipped_scenarios():
        return load_drive(name)
    if name not in {record.name for record in catalogue()}:
        meant = did_you_mean(name, [record.name for record in catalogue()], "`lostmotion catalogue` lists its names")
        raise InputError(
            f"joint {joint!r}: {shown(name)} is neither a scenario nor a gearbox of the catalogue; {meant}"
        )
    box = gearbox(name)
    if not box.inertia > 0.0:
        raise InputError(
            f"joint {joint!r}: the record {name!r} has no inertia of its input shaft; give lm.Drive(...) with a motor and its rotor_inertia"
        )
    motor = Motor(kind="torque_source", rotor_inertia=0.0)
    return Drive(motor=motor, gearbox=box, load=Load(inertia=1.0))


@checked
def attach(
    model: mujoco.MjSpec | mujoco.MjModel | str | Path,
    drives: Mapping[str, Any],
    controllers: Mapping[str, Controller] | None = None,
    *,
    replace: bool = False,
    substeps: int | None = None,
) -> Actuated:
    """Turn joints of a MuJoCo model by exact drives.

    Parameters
    ----------
    model
        A `mujoco.MjSpec`, a `mujoco.MjModel`, or an MJCF file. The drives are attached to a copy.
    drives
        By the name of a hinge: a `Drive` or a `DriveTrain`, whose load's inertia the robot takes the place of; a scenario or its
        name, whose controller then turns the motor; or the name of a gearbox of the catalogue, which an ideal torque source without
        inertia then turns.
    controllers
        By the name of a hinge: a controller for its drive, which acts at its own sample instants within the steps.
    replace
        Take the armature, the damping, the friction loss and the actuators off these joints, which describe a drive in MuJoCo
        and would otherwise count twice.
    substeps
        Substeps of the drives within a step; left out, chosen by the natural frequency of the stiffest mesh.

    Returns
    -------
    Actuated
        At the reference pose, with nothing twisted.

    Raises
    ------
    InputError
        A joint is unknown, no hinge, or has an actuator, armature, damping or friction loss (see `replace`); a drive cannot be
        used; the timestep would take more than 1000 substeps; the model has actuators with states of their own.
    MissingLibraryError
        MuJoCo is not installed.

    Examples
    --------
    >>> import lostmotion as lm
    >>> import mujoco
    >>> body = "<body><joint name='elbow'/><geom size='0.1'/></body>"
    >>> spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> arm = lm.mujoco.attach(spec, {"elbow": "schaeffler-rt1-h-20-100"})
    >>> arm.step({"elbow": 0.2})
    >>> bool(arm.data.qvel[0] > 0.0)
    True
    """
    need("mujoco", "lostmotion.mujoco", "mujoco")
    import mujoco

    if isinstance(model, str | Path):
        if not Path(model).is_file():
            raise InputError(
                f"model: {shown(str(model))} is no file; give an MJCF file, a mujoco.MjSpec or a mujoco.MjModel"
            )
        try:
            model = mujoco.MjSpec.from_file(str(model))
        except ValueError as error:
            raise InputError(f"{model}: {' '.join(str(error).split())}") from None
    compiled = model.copy().compile() if isinstance(model, mujoco.MjSpec) else copy.copy(model)
    if not drives:
        raise InputError("drives: is empty; name at least one joint")
    for name in controllers or {}:
        if name not in drives:
            raise InputError(f"controllers: joint {shown(name)} has no drive; name it in drives")
    if compiled.na:
        raise InputError(
            "model: has actuators with states of their own (activations), which are not supported; use such without"
        )
    if substeps is not None and not 1 <= substeps <= MAX_SUBSTEPS:
        raise InputError(f"substeps: {shown(substeps)} must lie between 1 and {MAX_SUBSTEPS}")
    for name in drives:
        _clear(compiled, name, replace=replace)
    given = {name: drive_of_joint(name, drive, (controllers or {}).get(name)) for name, drive in drives.items()}
    return Actuated(compiled, given, substeps)


def _clear(model: mujoco.MjModel, name: str, *, replace: bool) -> None:
    """Remove MuJoCo's own description of the drive of a joint.

    Raises
    ------
    InputError
        There is such a thing, and it is not to be replaced.
    """
    import mujoco

    joint = joint_id(model, name)
    dof = model.jnt_dofadr[joint]
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    actuators = [
        k for k in range(model.nu) if model.actuator_trnid[k, 0] == joint and model.actuator_trntype[k] in kinds
    ]
    values = {
        "armature": model.dof_armature,
        "damping": model.dof_damping,
        "frictionloss": model.dof_frictionloss,
    }
    own = [key for key, array in values.items() if np.any(array[dof] != 0.0)]
    own += [f"the actuator {model.actuator(int(k)).name!r}" for k in actuators]
    if own and not replace:
        raise InputError(
            f"joint {name!r}: has {' and '.join(own)}, which would count twice beside its drive; give replace=True, or take it off the model"
        )
    for array in values.values():
        array[dof] = 0.0
    for k in actuators:  # they stay, so that the numbers of the others do
        model.actuator_gainprm[k] = 0.0
        model.actuator_biasprm[k] = 0.0
