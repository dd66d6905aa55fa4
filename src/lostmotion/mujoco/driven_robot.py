"""A robot of MuJoCo whose joints are turned by exact drives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..inputs.refusal_messages import did_you_mean, listed, shown
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.robot_joints import JointDrive, JointTrains, joint_drive
from .joints_by_name import acts, is_slide, joint_id, mass_matrix
from .mjcf import JointActuator

if TYPE_CHECKING:
    import mujoco

MAX_SUBSTEPS = 1000
CONTACT_PASSES = 5  # Most solutions of MuJoCo's contact solver in a substep.
SETTLED = 1e-6
"""Largest difference between the speeds [rad/s] at the end of a substep that solver and drives find, over 1 plus the speed."""
SUBSTEP_PHASE = 0.5  # Largest natural frequency of a mesh times substep [rad].
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

    robot: Actuated = field(repr=False)


class Actuated:
    """A robot of MuJoCo whose joints are turned by exact drives. `attach` makes it.

    Attributes
    ----------
    model, data
        The `mujoco.MjModel` and its `mujoco.MjData`. After `step` position, speed, time and `qacc` (mean over the step) are those
        at the end; poses of bodies and contacts are from the middle of the last substep, and sensors are not evaluated. Call
        ``mujoco.mj_forward(model, data)`` where they are wanted at the end.
    joints
        Names of the joints with a drive, in the order of all arrays.
    substeps
        Substeps of the drives within a step of MuJoCo, chosen so that the natural frequency of the stiffest mesh times the
        substep is at most 0.5.
    """

    def __init__(self, model: mujoco.MjModel, given: Mapping[str, JointActuator], substeps: int | None) -> None:
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
        mujoco.mj_setConst(model, self.data)  # the inertia of simple bodies has the armature that was taken off
        inertias = 1.0 / np.diag(np.linalg.inv(mass_matrix(model, self.data)))[self._dofs]
        made = [
            joint_drive(name, actuator.drive, float(inertia), step, slides=is_slide(model, joint))
            for (name, actuator), joint, inertia in zip(given.items(), ids, inertias, strict=True)
        ]
        self._actuators = tuple(given.values())
        self._drives: dict[str, JointDrive] = dict(zip(self.joints, made, strict=True))
        # So many that the stiffest mesh turns by at most SUBSTEP_PHASE in each.
        phases = (d.mesh_frequency * step / SUBSTEP_PHASE for d in made)
        self.substeps = max(1, *map(math.ceil, phases)) if substeps is None else substeps
        if self.substeps > MAX_SUBSTEPS:
            worst = max(made, key=lambda d: d.mesh_frequency)
            raise InputError(
                f"joint {worst.name!r}: its mesh swings at {worst.mesh_frequency / (2 * math.pi):.4g} Hz, so that the timestep of {step:g} s "
                f"would take {self.substeps} substeps; at most {MAX_SUBSTEPS} are made: shorten option.timestep"
            )
        self._trains = JointTrains(made)
        self._inertias = inertias
        # What contacts feel of a joint at the pose that MuJoCo scales its constraints with.
        own = model.dof_M0.copy()  # from which MuJoCo takes the inertia of simple bodies
        model.dof_armature[self._dofs] = [d.reflected_inertia for d in made]
        mujoco.mj_setConst(model, self.data)
        model.dof_armature[self._dofs], model.dof_M0[:] = 0.0, own
        self._rows = np.repeat(np.arange(model.nv), model.M_rownnz)
        self._contact = np.zeros(model.nv)
        self._torque = np.zeros(len(ids))
        self._unsettled = 0
        self._dual = model.opt.solver == mujoco.mjtSolver.mjSOL_PGS or model.opt.noslip_iterations > 0
        self._turning = model.nq != model.nv  # positions of balls and free bodies are no integrals of speeds
        self._robot = self._core_robot()
        # Views of what it computes.
        self._mass: np.ndarray = self._robot.mass
        self._force: np.ndarray = self._robot.force
        self._mean: np.ndarray = self._robot.acceleration
        self._no_contact = np.zeros(model.nv)
        self.reset()

    def _core_robot(self) -> Any:
        m, d = self.model, self.data
        return self._trains.robot(
            position=d.qpos,
            speed=d.qvel,
            acceleration=d.qacc,
            warmstart=d.qacc_warmstart,
            force=d.qfrc_smooth,
            matrix=d.M,
            row_length=m.M_rownnz,
            row_begin=m.M_rowadr,
            column=m.M_colind,
            damping=(m.dof_damping if acts(m, "DAMPER") else np.zeros(m.nv)).tolist(),
            trained=self._dofs.tolist(),
            others=[k for k in range(m.nv) if k not in set(self._dofs)],
            place=self._addresses.tolist(),
            place_of_speed=[] if self._turning else list(range(m.nv)),
        )

    def __repr__(self) -> str:
        return f"Actuated({listed(self.joints)}; {self.substeps} substeps, at {self.data.time:.6g} s)"

    @property
    def drives(self) -> dict[str, Scenario]:
        """The drive of each joint, with the inertia of the robot in place of the load's own."""
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
        """Mean torque [N·m] of each drive on its hinge, or force [N] on its slide, over the last step."""
        return self._torque.copy()

    @property
    def gear_loss(self) -> np.ndarray:
        """Power that the friction of the gears of each drive takes now [W]: of each gear w_1 (T_1 - T_2/i)."""
        return np.array([d.gear_loss for d in self._drives.values()])

    @property
    def counts(self) -> dict[str, int]:
        """Number of advances of drives, and of substeps in which the coupling with the robot was not solved to rounding."""
        return {"evaluations": self._trains.evaluations, "unsettled": self._trains.unsettled + self._unsettled}

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
        still = {"acceleration": zero, "before": zero, "inertia": [0.0] * (n * n), "force": [0.0] * n, "smooth": False}
        self._robot.course = still
        self._contact = d.qfrc_constraint.copy()

    def _away(self, k: int) -> InputError:
        q, v = self.data.qpos[self._addresses[k]], self.data.qvel[self._dofs[k]]
        drive = self._drives[self.joints[k]]
        unit = "m" if drive.train.is_slide(drive.shaft) else "rad"
        return InputError(
            f"joint {self.joints[k]!r}: data has it at {q:.6g} {unit}, {v:.6g} {unit}/s, its drive at {self._trains.angle[k]:.6g} {unit}, "
            f"{self._trains.speed[k]:.6g} {unit}/s; call follow() after data has been changed"
        )

    def step(self, ctrl: Mapping[str, float] | Sequence[float] | np.ndarray | None = None) -> None:
        """Advance robot and drives by the timestep of the model.

        Parameters
        ----------
        ctrl
            One number for each joint, in the order of `joints` or by name: the torque on the motor's shaft [N·m] of a torque
            source, the command (share of the rated voltage) of a DC or synchronous motor, the reference of a controller
            (position [rad] or speed [rad/s]), the control in MuJoCo of a `JointActuator`. Left out, zero.

        Raises
        ------
        InputError
            Another number of values, an unknown joint, `data` was changed without `follow`, or holds a value that is not a number.
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
            if d.nefc == 0 and not self._contact.any():
                robot.predict_speed(h)
                self._compute_forces()
                self._trains.advance(robot, h, self.substeps)
                acceleration, place, self._torque = self._mean, None, self._trains.torque.copy()
            else:
                robot.restore()
                acceleration, place = self._advance_in_contact(h)
        except BaseException:
            robot.restore()
            d.time = begin
            self._check_numbers()
            raise
        robot.integrate(h, acceleration)
        if place is not None:
            d.qpos[:] = place
        elif self._turning:
            mj.mj_integratePos(m, d.qpos, robot.motion, h)
        robot.finish(acceleration)
        d.time = begin + h

    def _check_numbers(self) -> None:
        for name in ("qpos", "qvel", "qfrc_applied", "xfrc_applied"):
            values = getattr(self.data, name).ravel()
            if (wrong := np.flatnonzero(~np.isfinite(values))).size:
                raise InputError(
                    f"data.{name}: value {wrong[0]} is {values[wrong[0]]}; give finite numbers, then follow()"
                )

    def _compute_forces(self) -> None:
        """Forces [N·m] other than the torques of drives and the forces of contacts."""
        self._mj.mj_fwdVelocity(self.model, self.data)
        self._mj.mj_fwdActuation(self.model, self.data)
        self._mj.mj_fwdAcceleration(self.model, self.data)

    def _advance_in_contact(self, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Advance the drives over a step with contacts, limits or equalities; mean acceleration, and positions at the end.

        Poses, contacts and their forces are found anew for each substep of the drives.
        """
        substep, torque = h / self.substeps, np.zeros(self._dofs.size)
        q, first = self.data.qpos.copy(), self.data.qvel.copy()
        v, contact, begin = first, self._contact, self._trains.snapshot()
        try:
            for _ in range(self.substeps):
                end = v + substep * self._substep_in_contact(substep, q, v)
                end[self._dofs] = self._trains.speed
                self._mj.mj_integratePos(self.model, q, 0.5 * (v + end), substep)
                q[self._addresses] = self._trains.angle
                v = end
                torque += self._trains.torque
        except BaseException:
            self._trains.restore(begin)
            self._contact = contact
            raise
        self._torque = torque / self.substeps
        return (v - first) / h, q

    def _substep_in_contact(self, h: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Advance the drives over a substep from positions and speeds; the mean acceleration of all joints.

        MuJoCo's solver finds the forces of the contacts. It is given the inertia matrix that they feel over the substep:
        the robot's matrix, and B = -dtau/da of each drive under the forces found before. Where something switches, this
        is repeated until the drives move as the solver predicts.
        """
        mj, m, d, dofs = self._mj, self.model, self.data, self._dofs
        d.qpos[:], d.qvel[:] = q, v
        mj.mj_integratePos(m, d.qpos, v, 0.5 * h)
        mj.mj_fwdPosition(m, d)
        self._compute_forces()
        self._robot.take(h, self._no_contact)
        contact = self._contact if d.nefc else self._no_contact
        self._trains.advance(self._robot, h, 1, self._force + contact)
        for _ in range(CONTACT_PASSES if d.nefc else 0):
            # A joint that is held has no compliance: there the solver sees a large inertia.
            compliance = np.maximum(self._trains.compliance, 1.0 / (STIFFEST * self._inertias.max()))
            mass = self._mass.copy()
            mass[dofs, dofs] += 1.0 / compliance - self._inertias
            d.M[:] = mass[self._rows, m.M_colind]
            mj.mj_factorM(m, d)
            if self._dual:  # solvers that take the inertia matrix in the space of the contacts
                mj.mj_projectConstraint(m, d)
            d.qfrc_smooth[:] = mass @ self._mean - contact
            mj.mj_solveM(m, d, d.qacc_smooth[None], d.qfrc_smooth[None])
            d.qacc_warmstart[:] = self._mean
            mj.mj_fwdConstraint(m, d)
            contact = d.qfrc_constraint.copy()
            self._trains.go_back()
            self._trains.advance(self._robot, h, 1, self._force + contact)
            if np.abs(self._mean - d.qacc).max() * h <= SETTLED * (1.0 + np.abs(v).max()):
                break
        else:
            self._unsettled += d.nefc > 0
        self._contact = contact
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
        return [actuator.given(value) for actuator, value in zip(self._actuators, values, strict=True)]

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
            The snapshot is from another robot.
        """
        if not isinstance(snapshot, ActuatedSnapshot) or snapshot.robot is not self:
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
