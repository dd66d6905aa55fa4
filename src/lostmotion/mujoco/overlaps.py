"""Parts that a robot and the drive of one of its joints both have, which would act twice."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..inputs.named_elements import Named
from ..model.angle_torques import PeriodicTorque
from ..model.shaft_ratio import turns
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.robot_joints import output_of
from .joints_by_name import actuator_name, actuators_of, joint_id

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
    """
    inclined = inclinations_of(drive)
    weights = weights_of(name, drive) if weighs else []
    keys = [*loads_of(drive), *inclined, *weights]
    if keys and not replace:
        raise InputError(
            "would count twice: load and weight of the joint come from the robot; give replace=True, or leave it out",
            *keys,
        )
    if inclined:  # load torques of scenarios are not used
        drive = drive.replace(**dict.fromkeys(inclined, 0.0))
    if not weights:
        return drive
    changed = {
        table: Named({key: part for key, part in getattr(drive, table).items() if f"{table}.{key}" not in weights})
        for table in {key.partition(".")[0] for key in weights}
    }
    return drive.model_copy(update=changed)


def loads_of(drive: Scenario) -> list[str]:
    """Keys of the load torques and forces of a scenario."""
    tables = drive.tables
    loads = {f"shafts.{name}.torque": shaft.torque for name, shaft in tables.shafts.items()}
    forces = {f"slides.{name}.force": slide.force for name, slide in tables.slides.items()}
    return [
        drive.key_in_file(key)
        for key, signal in (loads | forces).items()
        if signal is not None and signal != type(signal)()
    ]


def weights_of(name: str, drive: Scenario) -> list[str]:
    """Keys of what may be a weight on the joint: on its shaft, or on one that turns with it."""
    train = drive.train()
    end, found = output_of(name, train), []
    for key, part in train.on_shafts():
        if isinstance(part, PeriodicTorque) and not train.is_slide(part.shaft):  # type: ignore[attr-defined]
            ratio = turns(train, part.shaft, end)  # type: ignore[attr-defined]
            found += [key] if ratio is not None and _turns_once(part, ratio) else []
    return found


def inclinations_of(drive: Scenario) -> list[str]:
    """Keys of the inclinations of slides, whose weights are loads of the scenario."""
    slides = drive.tables.slides
    return [
        drive.key_in_file(f"slides.{name}.inclination") for name, slide in slides.items() if slide.inclination != 0.0
    ]


def _turns_once(torque: PeriodicTorque, ratio: float) -> bool:
    """Whether a torque over the angle of a shaft has a part of first order in the angle of the joint, as weights have.

    ratio: turns of the shaft for one of the joint.
    """
    order = getattr(torque, "order", None)
    if order is not None:
        return math.isclose(abs(order * ratio), 1.0, rel_tol=1e-9)
    turned = abs(getattr(torque, "period", 2.0 * math.pi) / (2.0 * math.pi * ratio))
    if abs(turned - round(turned)) > 1e-9 * turned or round(turned) < 1:
        return False
    curve, count = torque.core(), POINTS * round(turned)
    angles = [2.0 * math.pi * (k + 0.5) / POINTS for k in range(count)]  # of the joint
    values = [curve(angle * ratio) for angle in angles]
    first = sum(value * cmath.exp(1j * angle) for value, angle in zip(values, angles, strict=True))
    return bool(2.0 * abs(first) / count > SHARE_OF_WEIGHT * max(map(abs, values)))


def clear(model: mujoco.MjModel, name: str, drive: Scenario, *, replace: bool, put: bool = False) -> None:
    """Remove MuJoCo's own description of the drive of a joint.

    put: whether the model is on a device already, where nothing can be removed.
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
    train = drive.train()
    end = output_of(name, train)
    if any(spring.shaft == end for spring in train.springs.values()):
        values["stiffness"] = [(array, joint) for array in (model.jnt_stiffness, model.jnt_stiffnesspoly)]
    if train.shafts[end].end_stops is not None:
        values["range"] = [(model.jnt_limited, joint)]
    own = [key for key, places in values.items() if any((array[k] != 0).any() for array, k in places)]
    own += [f"the {actuator_name(model, k)}" for k in actuators]
    if own and (put or not replace):
        remedy = "take it off the model before put_model" if put else "give replace=True, or take it off the model"
        raise InputError(f"has {' and '.join(own)}, which would count twice beside its drive; {remedy}")
    for k in actuators:
        if model.actuator_plugin[k] >= 0:
            raise InputError(
                f"the {actuator_name(model, k)} is a plugin, which would act beside its drive; take it off the model"
            )
    if model.jnt_actgravcomp[joint] and model.ngravcomp:
        raise InputError(
            "has actuatorgravcomp, a torque of its actuators beside its drive; take gravcomp off the model"
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
