"""Joints of a MuJoCo model by name."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..inputs.refusal_messages import did_you_mean, listed, shown

if TYPE_CHECKING:
    import mujoco


def compiled(model: mujoco.MjSpec | mujoco.MjModel) -> mujoco.MjModel:
    """An own copy of a model, compiled. Raises InputError: MuJoCo refuses the specification."""
    import mujoco

    if not isinstance(model, mujoco.MjSpec):
        return copy.copy(model)
    try:
        return model.copy().compile()
    except ValueError as error:
        raise InputError(f"model: {' '.join(str(error).split())}") from None


def joint_id(model: mujoco.MjModel, name: str) -> int:
    """The number of a hinge or a slide. Raises InputError: the model has no such joint, or it is another."""
    import mujoco

    moved = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    found = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if found < 0:
        known = [model.joint(k).name for k in range(model.njnt) if model.jnt_type[k] in moved]
        raise InputError(
            f"joint {shown(name)}: is not in the model; {did_you_mean(name, known, f'its hinges and slides are {listed(known)}')}"
        )
    if model.jnt_type[found] not in moved:
        raise InputError(f"joint {name!r}: is neither a hinge nor a slide, which drives move")
    return int(found)


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The mass matrix where `data` is, all that follows from its positions computed anew."""
    import mujoco

    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    return mass


def is_slide(model: mujoco.MjModel, joint: int) -> bool:
    """Whether a joint moves along a line."""
    import mujoco

    return bool(model.jnt_type[joint] == int(mujoco.mjtJoint.mjJNT_SLIDE))


def actuators_of(model: mujoco.MjModel, joint: int) -> list[int]:
    """Numbers of the actuators on a joint, or on a tendon of this joint alone."""
    import mujoco

    on_joint = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))

    def moves(k: int) -> bool:
        kind, target = model.actuator_trntype[k], model.actuator_trnid[k, 0]
        if kind == int(mujoco.mjtTrn.mjTRN_TENDON) and model.tendon_num[target] == 1:
            wrap = model.tendon_adr[target]
            return bool(model.wrap_type[wrap] == int(mujoco.mjtWrap.mjWRAP_JOINT) and model.wrap_objid[wrap] == joint)
        return kind in on_joint and bool(target == joint)

    return [k for k in range(model.nactuator) if moves(k)]


def actuator_name(model: mujoco.MjModel, k: int) -> str:
    """An actuator as messages name it: by its name, or by its place among the joints of the model."""
    name = model.actuator(k).name
    return f"actuator {name!r}" if name else f"actuator without a name (number {k + 1} of {model.nactuator})"


def acts(model: mujoco.MjModel, flag: str) -> bool:
    """Whether a part of the physics, such as ``"GRAVITY"``, is not disabled by option.flag."""
    import mujoco

    return not model.opt.disableflags & int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))
