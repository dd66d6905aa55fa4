"""A quadruped in MuJoCo: ideal joints, quasi-direct-drive actuators and strain wave gears, in a trot, a squat and at rest.

Sizes and masses are those of MIT's Mini Cheetah, as printed in its control software (github.com/mit-biomimetics/Cheetah-Software
@aa89b8a, common/include/Dynamics/MiniCheetah.h), without products of inertia. Needs `pip install "lostmotion[mujoco]"`.
"""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

import lostmotion as lm

STEP = 1e-3
HEIGHT, UPPER, LOWER, FOOT = 0.25, 0.209, 0.175, 0.015  # of the hips, links, radius of a foot [m]
LEGS = {"FL": (1, 1), "FR": (1, -1), "RL": (-1, 1), "RR": (-1, -1)}  # signs of x and y
JOINTS = [f"{leg}_{joint}" for leg in LEGS for joint in ("abad", "hip", "knee")]
FIRST_PAIR = ("FL", "RR")  # of a trot, on the ground in the first half of a period
STRIDE, LIFT, PERIOD = 0.1, 0.05, 0.5  # of a trot [m, m, s]
DEPTH = 0.08  # of a squat [m]
STIFFNESS = 100.0  # of the law that holds a joint [N·m/rad]

LEG = """
  <body pos="{rotor_x} {rotor_y} 0">{rotor}</body>
  <body name="{leg}_abad" pos="{x} {y} 0"><joint name="{leg}_abad" type="hinge" axis="1 0 0"/>
    <inertial pos="0 {abad} 0" mass="0.54" diaginertia="381e-6 560e-6 444e-6"/><body pos="0 {rotor_hip} 0">{rotor}</body>
    <body name="{leg}_hip" pos="0 {hip} 0"><joint name="{leg}_hip" type="hinge" axis="0 1 0"/>
      <inertial pos="0 {centre} -0.02" mass="0.634" diaginertia="1983e-6 2103e-6 408e-6"/><body>{rotor}</body>
      <body name="{leg}_knee" pos="0 0 -{upper}"><joint name="{leg}_knee" type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 -0.061" mass="0.064" diaginertia="245e-6 248e-6 6e-6"/>
        <geom name="{leg}" type="sphere" size="{foot}" pos="0 0 -{lower}" friction="0.8"/>
      </body></body></body>"""
ROTOR = '<inertial pos="0 0 0" mass="0.055" diaginertia="33e-6 33e-6 33e-6"/>'


def mjcf() -> str:
    """The robot on a floor, without anything that describes a drive."""
    legs = "".join(
        LEG.format(
            leg=leg,
            x=0.19 * a,
            y=0.049 * b,
            rotor_x=0.125 * a,
            rotor_y=0.049 * b,
            abad=0.036 * b,
            rotor_hip=0.04 * b,
            hip=0.062 * b,
            centre=0.016 * b,
            rotor=ROTOR,
            upper=UPPER,
            lower=LOWER,
            foot=FOOT,
        )
        for leg, (a, b) in LEGS.items()
    )
    return (
        f'<mujoco><option timestep="{STEP}"/><worldbody><geom name="floor" type="plane" size="5 5 1"/>'
        f'<body name="trunk" pos="0 0 {HEIGHT + FOOT}"><freejoint name="trunk"/>'
        f'<inertial pos="0 0 0" mass="3.3" diaginertia="0.011253 0.036203 0.042673"/>{legs}</body></worldbody></mujoco>'
    )


def drive(kind: str, *, brake: float = 0.0) -> lm.Drive:
    """A drive of each joint: "ideal", "quasi-direct" or "strain wave"; a closed brake is a friction on the motor [N·m]."""
    if kind == "strain wave":
        motor, box = lm.motor("nidec-d35"), lm.gearbox("schaeffler-rt1-h-14-100")
        changes: dict[str, Any] = {}
    else:
        motor, box = lm.actuator("t-motor-ak80-6")
        changes = {"losses": lm.model.ConstantEfficiency(efficiency=1.0), "loss_range": None}
        if kind == "quasi-direct":
            # Backlash: dfki-ric-underactuated-lab.github.io/double_pendulum, hardware. The stiffness is an assumption.
            changes = {"stiffness": {"kind": "curve", "backlash": "0.15 deg", "slopes": [3000.0], "breaks": []}}
    if kind != "ideal":
        changes["hysteresis"] = lm.model.Hysteresis(efficiency=0.95)  # not printed; an assumption
    motor = motor.model_copy(update={"friction_torque": brake}) if brake else motor
    return lm.Drive(motor=motor, gearbox=box.model_copy(update=changes), load=lm.Load(inertia=1.0))


def robot(kind: str, *, brake: float = 0.0) -> Any:
    """The robot with drives, standing."""
    import mujoco

    one = drive(kind, brake=brake)
    made = lm.mujoco.attach(mujoco.MjModel.from_xml_string(mjcf()), dict.fromkeys(JOINTS, one))
    made.data.qpos[7:] = pose("squat", 0.0)
    made.follow(held=True)
    return made


def reach(x: float, z: float) -> tuple[float, float]:
    """Angles of hip and knee [rad] that take the foot to x and z [m] from the hip."""
    knee = -math.acos((x * x + z * z - UPPER * UPPER - LOWER * LOWER) / (2.0 * UPPER * LOWER))
    return math.atan2(-x, -z) - math.atan2(LOWER * math.sin(knee), UPPER + LOWER * math.cos(knee)), knee


def height(gait: str, t: float) -> float:
    """Reference of the trunk [m]: a squat has a period of 1 s and begins at rest; in a trot the height is constant."""
    return HEIGHT + FOOT - (0.5 * DEPTH * (1.0 - math.cos(2.0 * math.pi * t)) if gait == "squat" else 0.0)


def phase(leg: str, t: float) -> float:
    """Phase of a leg in a trot: the foot is on the ground below 0.5."""
    return (t / PERIOD + (0.0 if leg in FIRST_PAIR else 0.5)) % 1.0


def pose(gait: str, t: float) -> np.ndarray:
    """Reference of the joints [rad]."""
    angles: list[float] = []
    begin = 1.0 - math.exp(-4.0 * t * t)
    for leg in LEGS:
        x, z = 0.0, FOOT - height(gait, t)
        if gait == "trot":
            s = 2.0 * phase(leg, t)
            if s < 1.0:
                x = STRIDE * begin * (0.5 - s)
            else:
                swing = 2.0 * math.pi * (s - 1.0)
                x = STRIDE * begin * (s - 1.5 - math.sin(swing) / math.pi)
                z += 0.5 * LIFT * begin * (1.0 - math.cos(swing))
        angles += [0.0, *reach(x, z)]
    return np.array(angles)


@dataclass(frozen=True)
class Run:
    """What a robot did; the first axis is time."""

    times: np.ndarray
    poses: np.ndarray
    """positions of MuJoCo, those of trunk and joints"""
    errors: np.ndarray
    """of the joints [rad]"""
    sag: np.ndarray
    """of the trunk below its reference [m]"""
    forces: np.ndarray
    """of the ground on each foot, upwards [N]"""
    power: np.ndarray
    """of all motors on their shafts [W]"""
    loss: np.ndarray
    """of all gearboxes [W]"""


def feedforward(plan: Any, model: Any, q: np.ndarray, v: np.ndarray, standing: list[str]) -> np.ndarray:
    """Torques of the joints [N·m] that carry the robot on the feet that are on the ground; `model` has no contacts."""
    import mujoco

    plan.qpos[7:], plan.qvel[6:] = q, v
    mujoco.mj_inverse(model, plan)
    points = []
    for leg in standing:
        points.append(np.zeros((3, model.nv)))
        foot = model.geom(leg)
        mujoco.mj_jac(model, plan, points[-1], None, plan.geom_xpos[foot.id], foot.bodyid[0])
    jacobian = np.vstack(points)
    forces = np.linalg.lstsq(jacobian[:, :6].T, plan.qfrc_inverse[:6], rcond=None)[0]
    torques: np.ndarray = plan.qfrc_inverse[6:] - jacobian[:, 6:].T @ forces
    return torques


def move(kind: str, gait: str, duration: float = 1.0) -> Run:
    """A "trot" or a "squat". Each motor is held by its own encoder; the weight and the inertia of its rotor are fed forward."""
    import mujoco

    made = robot(kind)
    one = next(iter(made.drives.values()))
    ratio, limit = one.gearbox.ratio, one.motor.limits.peak_torque
    rotor = (one.motor.rotor_inertia + one.gearbox.inertia) * ratio**2
    damping = 1.4 * math.sqrt(STIFFNESS * (rotor + 0.006))
    free = mujoco.MjModel.from_xml_string(mjcf())
    free.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    plan, feet = mujoco.MjData(free), [made.model.geom(leg).id for leg in LEGS]
    rows: list[tuple[Any, ...]] = []
    for k in range(round(duration / STEP)):
        t = k * STEP
        before, q, after = (pose(gait, max(t + d, 0.0)) for d in (-STEP, 0.0, STEP))
        v, a = (after - before) / (2.0 * STEP), (after - 2.0 * q + before) / STEP**2
        standing = [leg for leg in LEGS if gait == "squat" or phase(leg, t) < 0.5]
        motor = made["load_angle"] + (0.0 if kind == "ideal" else made["twist"])
        torque = feedforward(plan, free, q, v, standing) + rotor * np.clip(a, -100.0, 100.0)
        torque += STIFFNESS * (q - motor) + damping * (v - made["motor_speed"] / ratio)
        torque = np.clip(torque / ratio, -limit, limit)
        made.step(torque)
        force, found = np.zeros(4), np.zeros(6)
        for n, contact in enumerate(made.data.contact):
            mujoco.mj_contactForce(made.model, made.data, n, found)
            force[feet.index(max(contact.geom))] += found[0]
        angles, loss = made.data.qpos.copy(), 0.0 if kind == "ideal" else float(made.gear_loss.sum())
        sag = height(gait, t + STEP) - angles[2]
        rows.append(
            (t + STEP, angles, pose(gait, t + STEP) - angles[7:], sag, force, torque @ made["motor_speed"], loss)
        )
    return Run(*(np.array(column) for column in zip(*rows, strict=True)))


def rest(kind: str, duration: float) -> tuple[float, float]:
    """By how much [rad] the joints move after the first half of a time at rest, and the trunk [m]. Brakes hold the motors."""
    made = robot(kind, brake=1.5 if kind == "quasi-direct" else 0.1)
    poses = []
    for _ in range(round(duration / STEP)):
        made.step()
        poses.append(made.data.qpos.copy())
    moved = np.abs(np.diff(poses[len(poses) // 2 :], axis=0)).max(axis=0)
    last, middle = poses[-1], poses[len(poses) // 2]
    return float(moved[7:].max()), float(np.linalg.norm(last[:3] - middle[:3]))


def sink(duration: float, friction: float = 9.0) -> float:
    """By how much the trunk sinks [m] if MuJoCo's own friction loss [N·m] stands for closed brakes."""
    import mujoco

    held = f'type="hinge" frictionloss="{friction}" armature="0.0022"'
    model = mujoco.MjModel.from_xml_string(mjcf().replace('type="hinge"', held))
    data = mujoco.MjData(model)
    data.qpos[7:] = pose("squat", 0.0)
    for _ in range(round(duration / STEP)):
        mujoco.mj_step(model, data)
    return HEIGHT + FOOT - float(data.qpos[2])


if __name__ == "__main__":
    if importlib.util.find_spec("mujoco") is None:
        print('needs pip install "lostmotion[mujoco]"')
    else:
        for gait in ("trot", "squat"):
            for kind in ("ideal", "quasi-direct", "strain wave"):
                found = move(kind, gait, 0.5)  # a period of the trot, a squat down
                work, loss = STEP * found.power.sum(), STEP * found.loss.sum()
                print(
                    f"{gait}, {kind}: joints off by {1e3 * np.sqrt(np.mean(found.errors**2)):.1f} mrad (root mean square), "
                    f"trunk by up to {1e3 * np.abs(found.sag).max():.1f} mm; work of the motors {work:.1f} J, gear losses {loss:.1f} J"
                )
        for kind in ("quasi-direct", "strain wave"):
            joints, trunk = rest(kind, 0.5)
            print(f"brakes closed, {kind}: the joints move by {joints:g} rad, the trunk by {1e6 * trunk:.1g} um")
        print(f"friction loss of MuJoCo in place of brakes: the trunk sinks by {1e3 * sink(0.5):.0f} mm in 0.5 s")
