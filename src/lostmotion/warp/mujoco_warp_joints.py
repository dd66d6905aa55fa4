"""Joints of the worlds of MuJoCo Warp that are turned by drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, need
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count
from ..inputs.refusal_messages import listed, shown
from ..mujoco.attaching import alone_on_joint
from ..mujoco.joints_by_name import compiled, mass_matrix
from ..simulation.batches.batch_parameters import mask_of_drives
from ..simulation.scenario.scenario import Scenario
from .drives import Drives

if TYPE_CHECKING:
    import mujoco


class Joints:
    """Drives that turn joints in all worlds of MuJoCo Warp, as `attach` returns them."""

    def __init__(
        self,
        model: mujoco.MjModel,
        m: Any,
        d: Any,
        drives: Mapping[str, Scenario],
        *,
        gains: Mapping[str, tuple[float, float]],
        samples: int,
        dtype: str,
    ) -> None:
        import warp as wp

        from . import kernel

        self._wp, self._data, self._step = wp, d, float(model.opt.timestep)
        self._worlds = d.qvel.shape[0]
        joints = {name: model.joint(name).id for name in drives}
        own = m.dof_armature.numpy()
        m.dof_armature = wp.array(
            np.ascontiguousarray(np.broadcast_to(own, (self._worlds, model.nv))), dtype=wp.float32
        )
        device = d.qvel.device
        alike: dict[tuple[Scenario, bool], list[str]] = {}
        for name, scenario in drives.items():
            alike.setdefault((scenario, name in gains), []).append(name)
        first, ends = _inertias(model), m.M_rowadr.numpy() + m.M_rownnz.numpy() - 1
        self._groups: list[_Group] = []
        self._places: dict[str, tuple[_Group, int]] = {}
        for (scenario, has_law), names in alike.items():
            numbers = [joints[name] for name in names]
            dofs = model.jnt_dofadr[numbers]
            inertias = np.repeat(first[dofs], self._worlds)
            vary = {scenario.inertia_key(list(scenario.train().shafts)[-1]): inertias}
            made = Drives(scenario, self._worlds * len(names), vary=vary, dtype=dtype, device=str(device))
            engine = kernel.engine_arrays(dtype)()
            engine.worlds, engine.n_dofs, engine.n_positions = self._worlds, model.nv, model.nq
            engine.n_masses, engine.masses = d.M.shape[1], d.M
            engine.diagonal = wp.array(ends[dofs].astype(np.int32), device=device)
            engine.samples, engine.has_law = samples, int(has_law)
            engine.dofs = wp.array(dofs.astype(np.int32), device=device)
            engine.places = wp.array(model.jnt_qposadr[numbers].astype(np.int32), device=device)
            rows = np.array(
                [np.repeat([gains.get(name, (0.0, 0.0))[k] for name in names], self._worlds) for k in (0, 1)]
            )
            engine.gains = wp.array(rows.reshape(-1).astype(dtype), device=device)
            engine.told = wp.zeros(len(kernel.TOLD) * len(made), dtype=engine.gains.dtype, device=device)
            engine.positions, engine.speeds = d.qpos, d.qvel
            engine.armatures, engine.forces = m.dof_armature, d.qfrc_applied
            group = _Group(made, engine, kernel.joint_kernel(dtype), names)
            self._groups.append(group)
            self._places |= {name: (group, k) for k, name in enumerate(names)}
        self.names = tuple(drives)
        """names of the joints, in the order of the columns of commands"""

    def before(self, commands: Any) -> None:
        """Tell MuJoCo Warp how the drives act in its next step, which ``mujoco_warp.step`` then makes.

        Parameters
        ----------
        commands
            A number for each world and joint: an array of NumPy, of the shape (worlds, joints); or by the name of a joint a number, an
            array of NumPy or an array of Warp with a number for each world, which is read as it is. Of a joint with gains the angle
            [rad] that the motor is to reach; else of a torque source the torque on the motor's shaft [N·m], of other motors
            the share of the rated voltage.

        Raises
        ------
        InputError
            A joint is unknown or lacks its command; an array has another shape.

        Notes
        -----
        Writes ``m.dof_armature``, ``d.qfrc_applied``, ``d.qpos`` and ``d.qvel`` of these joints.
        """
        for name, given in self._by_name(commands).items():
            group, k = self._places[name]
            group.command(k, given, self._worlds)
        for group in self._groups:
            group.launch(self._wp, self._step)

    def _by_name(self, commands: Any) -> dict[str, Any]:
        if isinstance(commands, Mapping):
            given = dict(commands)
        else:
            if isinstance(commands, self._wp.array):
                raise InputError(
                    "commands: is one array of Warp; give an array of Warp for each joint, by its name, or one array of NumPy"
                )
            need_shape = self._worlds, len(self.names)
            if np.shape(commands) != need_shape:
                raise InputError(f"commands: have the shape {np.shape(commands)} and need {need_shape}")
            given = dict(zip(self.names, np.transpose(commands), strict=True))
        if set(given) != set(self.names):
            raise InputError(f"commands: are for {listed(given)}, and the joints are {listed(self.names)}")
        return given

    @checked
    def reset(self, which: Any = None) -> None:
        """Put drives to rest on their joints, after the state of worlds has been changed.

        Parameters
        ----------
        which
            Array of Booleans with the worlds that are meant; default all.
        """
        mask = np.ones(self._worlds, dtype=bool) if which is None else mask_of_drives(which, self._worlds, "world")
        for group in self._groups:
            both = np.tile(mask, len(group.names))
            group.drives.reset(both)
            rows = group.engine.told.numpy().reshape(-1, len(both))
            group.engine.told.assign(np.where(both, 0.0, rows).reshape(-1).astype(rows.dtype))

    def __getitem__(self, name: str) -> Any:
        """A variable of the drives by joint, where the step began: ``motor_speed``, ``load_speed``, ``twist`` or ``output_torque``; arrays of Warp."""
        if name == "load_angle":
            raise InputError("load_angle: is that of MuJoCo; read d.qpos")
        return {joint: group.rows(group.drives[name], k, self._worlds) for joint, (group, k) in self._places.items()}

    @property
    def parameters(self) -> Mapping[str, Mapping[str, Any]]:
        """The parameters by joint and key, as arrays of Warp with a number for each world, which may be written."""
        return {
            joint: {key: group.rows(row, k, self._worlds) for key, row in group.drives.parameters.items()}
            for joint, (group, k) in self._places.items()
        }

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of steps of drives since the beginning: ``steps``, ``switchings``, and ``doubtful``, those with something that was not certain."""
        each = [group.drives.counts | {"steps": group.steps} for group in self._groups]
        return {name: sum(counts[name] for counts in each) for name in ("steps", "switchings", "doubtful")}


class _Group:
    """Joints with the same drive."""

    def __init__(self, drives: Drives, engine: Any, kernel: Any, names: list[str]) -> None:
        self.drives, self.engine, self._kernel, self.names = drives, engine, kernel, names
        self._commands = drives._new(1)
        self.steps = 0

    def rows(self, array: Any, k: int, worlds: int) -> Any:
        return array[k * worlds : (k + 1) * worlds]

    def command(self, k: int, given: Any, worlds: int) -> None:
        place = self.rows(self._commands, k, worlds)
        found = self.drives._input(f"commands.{self.names[k]}", given, place, "world")
        if found is not place:
            self.drives._wp.copy(place, found)

    def launch(self, wp: Any, step: float) -> None:
        wp.launch(
            self._kernel,
            dim=len(self.drives),
            inputs=[self.drives._arrays, self.engine, self._commands, step],
            device=self.drives._device,
        )
        self.steps += len(self.drives)


@checked
def attach(
    model: mujoco.MjModel,
    m: Any,
    d: Any,
    drives: Mapping[str, Any],
    *,
    stiffness: Mapping[str, float] | float | None = None,
    damping: Mapping[str, float] | float = 0.0,
    samples: Count = 1,
    dtype: str = "float32",
    replace: bool = False,
) -> Joints:
    """Turn joints in all worlds of MuJoCo Warp by exact drives.

    Parameters
    ----------
    model
        The model that `m` was put from.
    m, d
        Model and data of `mujoco_warp`.
    drives
        By the name of a hinge or a slide what `lm.mujoco.attach` takes, without controllers: a drive, a scenario or its name, the name of
        an actuator or a gearbox of the catalogue. Each has one motor and one gear.
    stiffness
        Gain of the position [N·m/rad], of a slide [N/m], of a law of the motor by its own encoder, for all joints or by name; those left out
        are commanded without a law. Both gains are referred to the joint.
    damping
        Gain of the speed [N·m·s/rad], in the same way.
    samples
        Samples of this law within a step.
    dtype
        Numbers of the drives: ``"float32"`` or ``"float64"``. Where many steps are doubtful, a smaller step helps and ``"float64"`` does not.
    replace
        Whether weights, load torques and inclinations of a drive give way to those of the robot. False: they are refused.

    Returns
    -------
    Joints
        Call `before` in front of each ``mujoco_warp.step``.

    Raises
    ------
    InputError
        A joint is unknown; the model has armature, damping, friction loss or an actuator there; a drive has more
        than the walk takes; a law is for a motor that is no torque source; the integrator is Runge and Kutta's.
    MissingLibraryError
        Warp is not installed.

    Examples
    --------
    >>> import lostmotion as lm
    >>> import mujoco
    >>> import mujoco_warp
    >>> import warp
    >>> warp.config.log_level = warp.LOG_WARNING  # else it tells what it compiles
    >>> body = "<body><joint name='elbow' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/></body>"
    >>> model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> m, d = mujoco_warp.put_model(model), mujoco_warp.make_data(model, nworld=8)
    >>> joints = lm.warp.attach(model, m, d, {"elbow": "schaeffler-rt1-h-20-100"})
    >>> joints.before({"elbow": 0.2})
    >>> joints.counts["steps"]
    8

    Notes
    -----
    Before a step each drive answers a constant load torque with the mean torque on its joint and its derivative by the
    acceleration, both exact. MuJoCo Warp takes the derivative as armature and the rest as force. The drive then makes the step
    anew to the speed that was found. What it gave beyond that line acts in the next step.
    """
    for library in ("warp", "mujoco_warp"):
        need(library, "lm.warp.attach", "warp")
    import mujoco
    import mujoco_warp

    for word, value, kind in (
        ("model", model, mujoco.MjModel),
        ("m", m, mujoco_warp.Model),
        ("d", d, mujoco_warp.Data),
    ):
        if not isinstance(value, kind):
            raise InputError(f"{word}: {shown(value)} must be a {kind.__module__.partition('.')[0]}.{kind.__name__}")
    if model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_RK4):
        raise InputError("model: option integrator is RK4, which makes a step in parts; take Euler or implicitfast")
    if not drives:
        raise InputError("drives: is empty; name at least one joint")
    robot = compiled(model)
    gains = _gains(drives, stiffness, damping)
    made = {}
    for name, given in drives.items():
        scenario = alone_on_joint(robot, name, given, None, replace=replace, put=True)
        kinds = {motor.kind for motor in scenario.train().motors.values()}
        if name in gains and kinds != {"torque_source"}:
            raise InputError(
                f"stiffness: joint {name!r} has a motor of the kind {listed(kinds)}; a law asks for torques, which a torque_source gives"
            )
        made[name] = scenario
    return Joints(model, m, d, made, gains=gains, samples=samples, dtype=dtype)


def _inertias(model: mujoco.MjModel) -> np.ndarray:
    """The diagonal of the mass matrix [kg·m²] in the reference pose, for the first step."""
    import mujoco

    return np.diag(mass_matrix(model, mujoco.MjData(model))).copy()


def _gains(
    drives: Mapping[str, Any], stiffness: Mapping[str, float] | float | None, damping: Mapping[str, float] | float
) -> dict[str, tuple[float, float]]:
    """Gains of the laws by joint."""
    if stiffness is None:
        return {}
    first = stiffness if isinstance(stiffness, Mapping) else dict.fromkeys(drives, stiffness)
    second = damping if isinstance(damping, Mapping) else dict.fromkeys(first, damping)
    for word, given in (("stiffness", first), ("damping", second)):
        if unknown := [name for name in given if name not in drives]:
            raise InputError(f"{word}: joint {shown(unknown[0])} has no drive; the joints are {listed(drives)}")
        for name, value in given.items():
            if not isinstance(value, int | float) or not 0.0 <= value < np.inf:
                raise InputError(f"{word}.{name}: {shown(value)} must be a number, 0 or above")
    return {name: (float(first[name]), float(second.get(name, 0.0))) for name in first}
