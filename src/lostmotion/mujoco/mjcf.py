"""Drives of the joints that a MuJoCo model describes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.continuous import ContinuousController
from ..errors import InputError, need, prefixed
from ..inputs.argument_checks import checked
from ..inputs.named_elements import Named
from ..inputs.quantities import Number
from ..model.drive import Drive
from ..model.gearbox import Gearbox
from ..model.load import Load
from ..model.losses import ConstantEfficiency
from ..model.motor import Motor
from ..model.springs import Spring
from ..model.torsion import LinearStiffness, Rigid
from ..model.train import DriveTrain
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.robot_joints import Driven
from .joints_by_name import acts, actuator_name, actuators_of, compiled, is_slide, joint_id

if TYPE_CHECKING:
    import mujoco

TAKEN_OVER = {
    *("gear", "gaintype", "gainprm", "biastype", "biasprm", "armature", "damping"),
    *("ctrllimited", "ctrlrange", "forcelimited", "forcerange"),
}
WITHOUT_EFFECT = {
    *("acc0", "length0", "lengthrange", "actadr", "ctrladr", "outadr", "historyadr", "history"),  # of the compiler
    *("group", "user", "ctrlspec"),
    *("trntype", "trnid"),  # by which the actuator is found; for a hinge the two kinds of joints are one
    *("dynprm", "actlimited", "actrange", "actearly"),  # of activations, which have a dyntype
}
Range = tuple[float, float]
UNLIMITED = (-math.inf, math.inf)


@dataclass(frozen=True)
class JointActuator:
    """A drive as the actuator of a joint, with the control of an actuator in MuJoCo. `from_mjcf` returns it, `attach` takes it."""

    drive: Driven  #: drive of the joint, with its controller if the actuator is a servo
    scale: float = 1.0
    """from the control to what the drive is given: the torque of its motor [N·m], or the reference of its controller [rad, rad/s]"""
    lower: float = -math.inf  #: least control; a smaller one counts as this one
    upper: float = math.inf  #: greatest control

    def given(self, control: float) -> float:
        """Command or reference of the drive for a control."""
        return self.scale * min(max(control, self.lower), self.upper)


@dataclass(frozen=True)
class _Law:
    """Force ``gain * control + bias[1] * length + bias[2] * velocity`` of an actuator."""

    gear: float
    gain: float = 1.0
    bias: tuple[float, float] = (0.0, 0.0)
    control: Range = UNLIMITED
    force: Range = UNLIMITED


@checked
def from_mjcf(
    model: mujoco.MjSpec | mujoco.MjModel, joint: str, *, ratio: Number | None = None
) -> Drive | DriveTrain | JointActuator:
    """Return the drive that a joint of a MuJoCo model describes: a rigid gear without losses, its friction on the load.

    Parameters
    ----------
    model
        With the joint and perhaps an actuator on it: a motor, or a servo of the position or the speed.
    joint
        Name of the hinge or slide. Its armature is the rotor's inertia at the joint, damping and frictionloss act on the load.
    ratio
        Of the gear, for a slide in rad/m; left out, the gear of the actuator of the joint.

    Returns
    -------
    Drive, DriveTrain or JointActuator
        A drive, for a slide or with a spring a train, whose command is the torque on the motor's shaft, if the control of the actuator is
        that. Otherwise the drive, with its controller if the actuator is a servo, and the scale and limits of its control. The load has
        1 kg·m² or 1 kg, which `attach` replaces.

    Raises
    ------
    InputError
        The joint is unknown, has no armature, has no actuator and no ratio is given, or has several actuators; an attribute
        of joint or actuator cannot be taken over.
    MissingLibraryError
        MuJoCo is not installed.

    Examples
    --------
    >>> import lostmotion as lm
    >>> import mujoco
    >>> body = "<body><joint name='elbow' armature='0.4'/><geom size='0.1'/></body>"
    >>> spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> lm.mujoco.from_mjcf(spec, "elbow", ratio=100).gearbox.ratio
    100.0
    >>> servo = spec.add_actuator(name="servo", target="elbow", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    >>> _ = servo.set_to_position(kp=30.0)
    >>> lm.mujoco.from_mjcf(spec, "elbow").drive.controllers["motor"].position.gain
    30.0
    """
    need("mujoco", "lostmotion.mujoco", "mujoco")
    model = compiled(model)
    number = joint_id(model, joint)
    with prefixed(f"joint {joint!r}"):
        return _of_joint(model, number, ratio)


def _of_joint(model: mujoco.MjModel, number: int, ratio: float | None) -> Drive | DriveTrain | JointActuator:
    dof = model.jnt_dofadr[number]
    actuators = actuators_of(model, number)
    if len(actuators) > 1:
        names = " and the ".join(actuator_name(model, k) for k in actuators)
        raise InputError(f"has the {names}; leave one of them")
    if not actuators and ratio is None:
        raise InputError("has no actuator that says the gear; give ratio=")
    law = _law(model, actuators[0]) if actuators else _Law(gear=ratio or 0.0)
    servo = law.bias != (0.0, 0.0)
    if ratio is None:
        ratio = abs(law.gear) if servo else law.gear
    if ratio == 0.0 or law.gear == 0.0:
        raise InputError("has the ratio 0; give speed of the motor / speed of the joint")
    if servo and ratio < 0.0:
        raise InputError(
            f"{ratio:g} must be above 0 for a servo, whose reference is the position or speed of the joint", "ratio"
        )
    _refuse_of_joint(model, number)
    armature, damping = float(model.dof_armature[dof]), float(model.dof_damping[dof])
    for k in actuators:
        armature += law.gear * law.gear * float(model.actuator_armature[k])
        damping += law.gear * law.gear * float(model.actuator_damping[k])
    if not armature > 0.0:
        raise InputError("has no armature, which is the inertia of the rotor; give the joint one")
    drive = Drive(
        motor=Motor(kind="torque_source", rotor_inertia=armature / (ratio * ratio)),
        gearbox=Gearbox(
            ratio=ratio,
            rated_input_speed=1.0,
            rated_output_torque=1.0,
            stiffness=Rigid(),
            losses=ConstantEfficiency(efficiency=1.0),
        ),
        load=Load(
            inertia=1.0,
            viscous_friction=damping if acts(model, "DAMPER") else 0.0,
            friction_torque=float(model.dof_frictionloss[dof]) if acts(model, "FRICTIONLOSS") else 0.0,
        ),
    )
    springs, slides = _springs(model, number), is_slide(model, number)
    train = drive.train().model_copy(update={"springs": springs})
    if slides:
        load = train.shafts["load"].model_copy(update={"domain": "translation"})
        train = train.model_copy(update={"shafts": Named({**train.shafts, "load": load})})
    if servo:
        return _servo(train, law)
    given = train if springs or slides else drive
    made = _motor(given, law, ratio)
    return given if made == JointActuator(given) else made


def _law(model: mujoco.MjModel, k: int) -> _Law:
    """The law of an actuator on a joint."""
    import mujoco

    def refuse(attribute: str, value: Any) -> InputError:
        shown = ", ".join(f"{x:g}" for x in np.ravel(np.asarray(value, float)))
        return InputError(
            f"{shown} of the {actuator_name(model, k)} is not taken over; give a motor, or a servo of position or speed, without it",
            attribute,
        )

    if not acts(model, "ACTUATION") or model.opt.disableactuator >> int(model.actuator_group[k]) & 1:
        raise refuse("disableactuator", model.actuator_group[k])
    gain, bias = model.actuator_gainprm[k], model.actuator_biasprm[k]
    kinds = int(model.actuator_gaintype[k]), int(model.actuator_biastype[k])
    fixed, affine = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE)
    if kinds[0] not in (fixed, affine) or (kinds[0] == affine and gain[1:3].any()):
        raise refuse("gaintype" if kinds[0] not in (fixed, affine) else "gainprm", kinds[0])
    if kinds[1] == int(mujoco.mjtBias.mjBIAS_NONE):
        bias = np.zeros(3)
    elif kinds[1] != int(mujoco.mjtBias.mjBIAS_AFFINE):
        raise refuse("biastype", kinds[1])
    for field, usual in _usual().items():
        value = getattr(model, f"actuator_{field}")[k]
        if np.any(value != usual):
            raise refuse(field, value)
    if bias[0] != 0.0 or bias[1] > 0.0 or bias[2] > 0.0:
        raise refuse("biasprm", bias[:3])
    if model.actuator_trntype[k] == int(mujoco.mjtTrn.mjTRN_TENDON):
        raise refuse("trntype", model.actuator_trntype[k])
    address, number = model.actuator_ctrladr[k], model.actuator_trnid[k, 0]
    gear = float(model.actuator_gear[model.actuator_outadr[k], 0])
    control = model.actuator_ctrlrange[address]
    if not (model.actuator_ctrllimited[address] and acts(model, "CLAMPCTRL")):
        control = UNLIMITED
    force = model.actuator_forcerange[k] if model.actuator_forcelimited[k] else UNLIMITED
    if model.jnt_actfrclimited[number] and gear != 0.0:
        of_joint = sorted(model.jnt_actfrcrange[number] / gear)
        force = [min(max(float(x), of_joint[0]), of_joint[1]) for x in force]
    return _Law(gear, float(gain[0]), (float(bias[1]), float(bias[2])), _range(control), _range(force))


def _range(values: Sequence[float]) -> Range:
    low, high = map(float, values)
    return low, high


@cache
def _usual() -> dict[str, Any]:
    """Values of a motor of MuJoCo for all attributes that have an effect and are not taken over."""
    import mujoco

    body = "<body><joint name='j'/><geom size='0.1'/></body>"
    plain = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{body}</worldbody><actuator><motor joint='j'/></actuator></mujoco>"
    )
    fields = {field.removeprefix("actuator_") for field in dir(plain) if field.startswith("actuator_")}
    left = sorted(fields - TAKEN_OVER - WITHOUT_EFFECT, key=lambda field: (field != "dyntype", field))
    return {field: getattr(plain, f"actuator_{field}")[0] for field in left}


def _refuse_of_joint(model: mujoco.MjModel, number: int) -> None:
    """Refuse what a joint has of its drive and is not taken over."""
    dof = model.jnt_dofadr[number]
    for key, value in (
        ("damping", model.dof_dampingpoly[dof]),
        ("stiffness", model.jnt_stiffnesspoly[number]),
        ("springyield", model.jnt_springyield[number]),
        ("actuatorgravcomp", model.jnt_actgravcomp[number] and model.ngravcomp),
    ):
        if np.any(value):
            what = "of higher order " if np.size(value) > 1 else ""
            raise InputError(f"{what}is not taken over; take it off the joint", key)


def _springs(model: mujoco.MjModel, number: int) -> Named[Spring]:
    stiffness = float(model.jnt_stiffness[number]) if acts(model, "SPRING") else 0.0
    rest = float(model.qpos_spring[model.jnt_qposadr[number]])
    if stiffness == 0.0:
        return Named({})
    return Named({"joint": Spring(shaft="load", stiffness=LinearStiffness(stiffness=stiffness), rest_angle=rest)})


def _motor(drive: Driven, law: _Law, ratio: float) -> JointActuator:
    if law.gain == 0.0:
        raise InputError("0 gives no torque; give another gain", "gainprm")
    low, high = sorted(force / law.gain for force in law.force)
    lower, upper = (min(max(control, low), high) for control in law.control)
    return JointActuator(drive, law.gain * law.gear / ratio, lower, upper)


def _servo(train: DriveTrain, law: _Law) -> JointActuator:
    """A servo: ``k_p (r - phi) - k_d w`` of the angle, or ``k_p (r - w)`` of the speed, within a limit."""
    low, high = law.force
    if low != -high or high == 0.0:
        raise InputError(
            f"{low:g} to {high:g} is not taken over; the limit of the torque of a servo must be symmetric",
            "forcerange",
            "actuatorfrcrange",
        )
    ratio = train.gears["gearbox"].ratio
    per_joint = law.gear * law.gear / ratio
    of_angle, of_speed = (-bias * per_joint for bias in law.bias)
    position = of_angle > 0.0
    loop = {"position": {"gain": of_angle, "derivative_gain": of_speed}} if position else {"speed": {"gain": of_speed}}
    limit = None if math.isinf(high) else high * abs(law.gear) / ratio
    kind = "position" if position else "speed"
    controller = ContinuousController.model_validate(
        {"kind": "continuous", "shaft": "load", "reference": {"kind": kind}, "limit": limit, **loop}
    )
    scale = law.gain / (-law.bias[0 if position else 1] * law.gear)
    return JointActuator(Scenario.of_any(train).with_axes({"motor": controller}), scale, *law.control)
