"""The drives of a robot's joints, by what `attach` is given for each."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.controller import Controller
from ..data_sheets.actuator_sheet import ActuatorSheet
from ..data_sheets.components import actuator, gearbox
from ..data_sheets.records import catalogue
from ..errors import InputError, need
from ..inputs.arguments import checked
from ..inputs.validation import did_you_mean, shown
from ..model.drive import Drive
from ..model.load import Load
from ..model.motor import Motor
from ..model.train import DriveTrain
from ..simulation.exact_batches import controlled
from ..simulation.joint_trains import Driven
from ..simulation.scenario import Scenario
from ..simulation.shipped import shipped_scenarios
from ..simulation.sources import load_drive
from .actuated import MAX_SUBSTEPS, Actuated
from .joints import joint_id

if TYPE_CHECKING:
    import mujoco


def drive_of_joint(joint: str, given: Any, controller: Controller | None) -> Driven:
    """Return the argument of `attach` for a joint as a drive, a scenario with a controller, or a train.

    Raises
    ------
    InputError
    """
    if isinstance(given, str | Path):
        given = _named(joint, str(given))
    if isinstance(given, Scenario) and given.is_drive and given.controller is None:
        given = given.drive()
    if not isinstance(given, Drive | DriveTrain) and not (isinstance(given, Scenario) and given.is_drive):
        raise InputError(
            f"joint {joint!r}: {shown(given)} is no drive; give a Drive, a DriveTrain, a scenario, or the name of a gearbox or an actuator of the catalogue"
        )
    if controller is None:
        return given
    if not isinstance(given, Drive):
        raise InputError(
            f"joint {joint!r}: controllers are for drives; give a Drive, or a scenario with its controller"
        )
    return controlled(given, controller)


def _named(joint: str, name: str) -> Drive | Scenario:
    """Shipped scenario or scenario file by its name; an actuator of the catalogue; a gearbox, with an ideal torque source."""
    if name.endswith(".toml") or name in shipped_scenarios():
        return load_drive(name)
    record = next((record for record in catalogue() if record.name == name), None)
    if record is None:
        meant = did_you_mean(name, [record.name for record in catalogue()], "`lostmotion catalogue` lists its names")
        raise InputError(
            f"joint {joint!r}: {shown(name)} is neither a scenario nor a gearbox or an actuator of the catalogue; {meant}"
        )
    if isinstance(record, ActuatorSheet):
        motor, box = actuator(name)
        return Drive(motor=motor, gearbox=box, load=Load(inertia=1.0))
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
        name, whose controller then turns the motor; the name of an actuator of the catalogue; or that of a gearbox, which an
        ideal torque source without inertia then turns.
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
