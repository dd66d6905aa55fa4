"""The drives of a robot's joints, by what `attach` is given for each."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..control.controller import Controller
from ..data_sheets.actuator_sheet import ActuatorSheet
from ..data_sheets.components import actuator, gearbox
from ..data_sheets.records import catalogue
from ..errors import InputError, need, prefixed
from ..inputs.argument_checks import checked
from ..inputs.refusal_messages import did_you_mean, shown
from ..model.drive import Drive
from ..model.load import Load
from ..model.motor import Motor
from ..model.train import DriveTrain
from ..simulation.runs.loading import load
from ..simulation.scenario.scenario import Scenario
from ..simulation.scenario.shipped_scenarios import shipped_scenarios
from ..simulation.stepping.robot_joints import output_of
from .driven_robot import MAX_SUBSTEPS, Actuated
from .joints_by_name import acts, compiled, joint_id
from .mjcf import JointActuator
from .overlaps import clear, without_weight

if TYPE_CHECKING:
    import mujoco


def drive_of_joint(given: Any, controller: Controller | None) -> Scenario:
    """Return the argument of `attach` for a joint as a scenario, with the controller if there is one."""
    if isinstance(given, str | Path):
        given = _named(str(given))
    if not isinstance(given, Drive | DriveTrain | Scenario):
        raise InputError(
            f"{shown(given)} is no drive; give a Drive, a DriveTrain, a scenario, or the name of a gearbox or an actuator of the catalogue"
        )
    scenario = Scenario.of_any(given)
    if controller is None:
        return scenario
    if own := list(scenario.tables.controllers):
        raise InputError(f"a controller of its own turns the motor {own[0]}; leave one of them out")
    if len(motors := scenario.train().motors) != 1:
        raise InputError(f"{len(motors) or 'no'} motors turn it, and a joint is turned by one")
    return scenario.with_axes(dict.fromkeys(motors, controller))


def alone_on_joint(
    robot: mujoco.MjModel, joint: str, given: Any, controller: Controller | None, *, replace: bool, put: bool = False
) -> Scenario:
    """The same, with what robot and drive both have taken off one of them.

    put: whether the robot is on a device already, so that nothing can be taken off it.
    """
    heavy = (robot.body_mass > 0.0) & (robot.body_gravcomp != 1.0)
    weighs = bool(robot.opt.gravity.any() and heavy.any()) and acts(robot, "GRAVITY")
    drive = without_loads(joint, given, controller, replace=replace, weighs=weighs)
    with prefixed(f"joint {joint!r}"):
        clear(robot, joint, drive, replace=replace, put=put)
    return drive


def without_loads(joint: str, given: Any, controller: Controller | None, *, replace: bool, weighs: bool) -> Scenario:
    """The drive of a joint without the loads and weights that the robot has."""
    with prefixed(f"joint {joint!r}"):
        drive = drive_of_joint(given, controller)
    output_of(joint, drive.train())  # refuses a train whose end it does not find
    with prefixed(f"joint {joint!r}"):
        return without_weight(joint, drive, replace=replace, weighs=weighs)


def _named(name: str) -> Drive | Scenario:
    """Shipped scenario or scenario file by its name; an actuator of the catalogue; a gearbox, with an ideal torque source."""
    if name.endswith(".toml") or name in shipped_scenarios():
        return load(name)
    record = next((record for record in catalogue() if record.name == name), None)
    if record is None:
        meant = did_you_mean(name, [record.name for record in catalogue()], "`lostmotion catalogue` lists its names")
        raise InputError(f"{shown(name)} is neither a scenario nor a gearbox or an actuator of the catalogue; {meant}")
    if isinstance(record, ActuatorSheet):
        motor, box = actuator(name)
        return Drive(motor=motor, gearbox=box, load=Load(inertia=1.0))
    box = gearbox(name)
    if not box.inertia > 0.0:
        raise InputError(
            f"the record {name!r} has no inertia of its input shaft; give lm.Drive(...) with a motor and its rotor_inertia"
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
        By the name of a hinge or a slide: a `Drive` or a `DriveTrain`, whose load's inertia the robot takes the place of (of several
        ends the shaft with the name of the joint is the load); a scenario or its
        name, whose controller then turns the motor; what `from_mjcf` has returned; the name of an actuator of the catalogue; or
        the name of a gearbox, which an ideal torque source without inertia then turns.
    controllers
        By the name of a joint: a controller for its drive, which acts at its own sample instants within the steps.
    replace
        Take what would count twice off. These joints lose what describes a drive in MuJoCo: armature, damping, friction loss,
        actuators and the limit of their torque, with a spring in the drive their stiffness, and with end stops in the drive their range.
        The drives lose load torques, inclinations, and gravity and torques once a turn of the joint, which the robot has.
    substeps
        Substeps of the drives within a step; left out, chosen by the natural frequency of the stiffest mesh.

    Returns
    -------
    Actuated
        At the reference pose, with nothing twisted.

    Raises
    ------
    InputError
        A joint is unknown, or neither hinge nor slide; the end of a drive moves otherwise; robot and drive both have something (see `replace`); a drive cannot be used; the timestep
        would take more than 1000 substeps; the model has parts with states of their own.
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
    robot = compiled(model)
    if not drives:
        raise InputError("drives: is empty; name at least one joint")
    for name in controllers or {}:
        if name not in drives:
            raise InputError(f"controllers: joint {shown(name)} has no drive; name it in drives")
        if isinstance(drives[name], JointActuator):
            raise InputError(
                f"controllers: joint {shown(name)} has a JointActuator, which is turned by its control; leave it out"
            )
    for what, count in (
        ("actuators with states of their own (activations)", robot.na),
        ("actuators with a delay", (robot.actuator_delay > 0.0).any()),
        ("springs that yield", robot.nplastic),
        ("plugins with states of their own", robot.npluginstate),
    ):
        if count:
            raise InputError(f"model: has {what}, which are not supported; use such without")
    if substeps is not None and not 1 <= substeps <= MAX_SUBSTEPS:
        raise InputError(f"substeps: {shown(substeps)} must lie between 1 and {MAX_SUBSTEPS}")
    made: dict[str, JointActuator] = {}
    for name, given in drives.items():
        joint_id(robot, name)
        actuator = given if isinstance(given, JointActuator) else JointActuator(given)
        drive = alone_on_joint(robot, name, actuator.drive, (controllers or {}).get(name), replace=replace)
        made[name] = dataclasses.replace(actuator, drive=drive)
    return Actuated(robot, made, substeps)
