"""Parts that a robot and the drive of one of its joints both have, which would act twice."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..inputs.named_elements import Named
from ..model.angle_torques import PeriodicTorque
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.robot_joints import output_of
from .joints import actuator_name, actuators_of, joint_id

if TYPE_CHECKING:
    import mujoco

POINTS = 720  # Angles of a turn at which a torque is compared with a weight.
SHARE_OF_WEIGHT = 1e-3
"""Part of first order in a torque over the angle, over its largest value, above which it may be a weight."""


def without_weight(name: str, drive: Scenario, *, replace: bool, weighs: bool) -> Scenario:
    """The drive of a joint without the loads and weights on it, which the robot has.

    name: of the joint.
    replace: whether to take them off the drive.
    weighs: whether gravity acts in the robot.

    Raises InputError: the drive has such, and it is not to be replaced.
    """
    inclined = inclination_of(name, drive)
    weights = inclined or (weights_of(name, drive) if weighs else [])
    keys = [*loads_of(drive), *weights]
    if keys and not replace:
        raise InputError(
            "would count twice: load and weight of the joint come from the robot; give replace=True, or leave it out",
            *keys,
            where=f"joint {name!r}",
        )
    if not weights:
        return drive  # load torques of scenarios are not used
    if inclined:
        return drive.replace(**dict.fromkeys(inclined, 0.0))
    changed = {
        table: Named({key: part for key, part in getattr(drive, table).items() if f"{table}.{key}" not in weights})
        for table in {key.partition(".")[0] for key in weights}
    }
    return drive.model_copy(update=changed)


def loads_of(drive: Scenario) -> list[str]:
    """Keys of the load torques of a scenario."""
    train = drive.train()
    return [
        drive.input_key(train.variable(shaft, "load_torque"))
        for shaft, signal in drive.tables.loads().items()
        if signal != type(signal)()
    ]


def weights_of(name: str, drive: Scenario) -> list[str]:
    """Keys of what may be a weight on the shaft of the joint."""
    train = drive.train()
    torques = [(key, part) for key, part in train.on_shafts() if isinstance(part, PeriodicTorque)]
    shaft = output_of(name, train)
    return [key for key, part in torques if part.shaft == shaft and _turns_once(part)]  # type: ignore[attr-defined]


def inclination_of(name: str, drive: Scenario) -> list[str]:
    """Key of the inclination of the slide of a joint, whose weight is a load of the scenario."""
    shaft = output_of(name, drive.train())
    slide = drive.tables.slides.get(shaft)
    return [drive.key_in_file(f"slides.{shaft}.inclination")] if slide is not None and slide.inclination != 0.0 else []


def _turns_once(torque: PeriodicTorque) -> bool:
    """Whether a torque over the angle has a part of first order, as weights have."""
    order = getattr(torque, "order", None)
    if order is not None:
        return bool(abs(order) == 1.0)
    turns = getattr(torque, "period", 2.0 * math.pi) / (2.0 * math.pi)
    if abs(turns - round(turns)) > 1e-9 * turns or round(turns) < 1:
        return False
    curve, count = torque.core(), POINTS * round(turns)
    angles = [2.0 * math.pi * (k + 0.5) / POINTS for k in range(count)]
    values = [curve(angle) for angle in angles]
    first = sum(value * cmath.exp(1j * angle) for value, angle in zip(values, angles, strict=True))
    return bool(2.0 * abs(first) / count > SHARE_OF_WEIGHT * max(map(abs, values)))


def clear(model: mujoco.MjModel, name: str, drive: Scenario, *, replace: bool) -> None:
    """Remove MuJoCo's own description of the drive of a joint.

    Raises InputError: there is such a thing, and it is not to be replaced or cannot be.
    """
    import mujoco

    joint = joint_id(model, name)
    dof, actuators = model.jnt_dofadr[joint], actuators_of(model, joint)
    values: dict[str, list[tuple[Any, int]]] = {
        "armature": [(model.dof_armature, dof)],
        "damping": [(model.dof_damping, dof), (model.dof_dampingpoly, dof)],
        "frictionloss": [(model.dof_frictionloss, dof)],
        "actuatorfrcrange": [(model.jnt_actfrclimited, joint)],
    }
    if _has_spring(name, drive):
        values["stiffness"] = [(array, joint) for array in (model.jnt_stiffness, model.jnt_stiffnesspoly)]
    own = [key for key, places in values.items() if any((array[k] != 0).any() for array, k in places)]
    own += [f"the {actuator_name(model, k)}" for k in actuators]
    if own and not replace:
        raise InputError(
            f"joint {name!r}: has {' and '.join(own)}, which would count twice beside its drive; give replace=True, or take it off the model"
        )
    for k in actuators:
        if model.actuator_plugin[k] >= 0:
            raise InputError(
                f"joint {name!r}: the {actuator_name(model, k)} is a plugin, which would act beside its drive; take it off the model"
            )
    if model.jnt_actgravcomp[joint] and model.ngravcomp:
        raise InputError(
            f"joint {name!r}: has actuatorgravcomp, a torque of its actuators beside its drive; take gravcomp off the model"
        )
    for places in values.values():
        for array, k in places:
            array[k] = 0
    for k in actuators:  # they stay, so that the numbers of the others do
        model.actuator_gaintype[k] = int(mujoco.mjtGain.mjGAIN_FIXED)
        model.actuator_biastype[k] = int(mujoco.mjtBias.mjBIAS_NONE)
        model.actuator_forcelimited[k] = False  # whose range may lack 0
        for array in (
            model.actuator_gainprm,
            model.actuator_biasprm,
            model.actuator_armature,
            model.actuator_damping,
            model.actuator_dampingpoly,
        ):
            array[k] = 0.0


def _has_spring(name: str, drive: Scenario) -> bool:
    train = drive.train()
    shaft = output_of(name, train)
    return any(spring.shaft == shaft for spring in train.springs.values())
