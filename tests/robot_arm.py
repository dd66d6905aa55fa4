"""A planar arm in MuJoCo whose two joints are turned by drives, and the same as closed equations, for tests and the benchmark."""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

import lostmotion as lm

RATIO, ROTOR = 100.0, 1e-5

HINGE = """
<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body>
  <joint name="hinge" type="hinge" axis="0 0 1"/><inertial pos="0.1 0 0" mass="1" diaginertia="0.02 0.02 0.03"/>
</body></worldbody></mujoco>"""
ARM = """
<mujoco><option timestep="{step}" gravity="0 0 -9.81"/><worldbody>{world}
  <body name="upper"><joint name="shoulder" type="hinge" axis="0 -1 0"/>
    <inertial pos="0.25 0 0" mass="3" diaginertia="0.01 0.06 0.06"/>
    <body name="lower" pos="0.5 0 0"><joint name="elbow" type="hinge" axis="0 -1 0"/>
      <inertial pos="0.2 0 0" mass="2" diaginertia="0.01 0.03 0.03"/>{tip}
    </body></body>
</worldbody></mujoco>"""


def arm_model(step: float, world: str = "", tip: str = "") -> Any:
    return mujoco.MjModel.from_xml_string(ARM.format(step=step, world=world, tip=tip))


def drive(
    stiffness: float = 2e4, gap: float = 0.0, friction: float = 0.0, bearing: float = 0.0, hysteresis: float | None = None
) -> lm.Drive:
    curve = lm.model.LinearStiffness(stiffness=stiffness)
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=ROTOR, friction_torque=friction),
        gearbox=lm.Gearbox(
            ratio=RATIO,
            rated_input_speed="3000 rpm",
            rated_output_torque=100.0,
            stiffness=lm.model.TorsionCurve(slopes=(0.0, stiffness), breaks=(gap / 2,)) if gap else curve,
            hysteresis=None if hysteresis is None else lm.model.Hysteresis(efficiency=hysteresis),
            losses=lm.model.ConstantEfficiency(efficiency=1.0),
        ),
        load=lm.Load(inertia=1.0, friction_torque=bearing),
    )


def robot(step: float, one: lm.Drive, **options: Any) -> Any:
    return lm.mujoco.attach(arm_model(step), {"shoulder": one, "elbow": one}, **options)


# --- equations of the arm, written here ---
def inertia_and_bias(q: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M(q), and Coriolis and gravity torques of the arm of ARM."""
    m1, l1, c1, i1, m2, c2, i2, g = 3.0, 0.5, 0.25, 0.06, 2.0, 0.2, 0.03, 9.81
    c, s = math.cos(q[1]), math.sin(q[1])
    m22 = i2 + m2 * c2**2
    m12 = m22 + m2 * l1 * c2 * c
    m11 = i1 + m1 * c1**2 + m22 + m2 * l1**2 + 2 * m2 * l1 * c2 * c
    turning = m2 * l1 * c2 * s
    outer = m2 * c2 * g * math.cos(q[0] + q[1])
    return np.array([[m11, m12], [m12, m22]]), np.array(
        [-turning * (2 * w[0] * w[1] + w[1] ** 2) + (m1 * c1 + m2 * l1) * g * math.cos(q[0]) + outer, turning * w[0] ** 2 + outer]
    )


def gear_torque(twist: np.ndarray, stiffness: float, gap: float) -> np.ndarray:
    return stiffness * np.sign(twist) * np.maximum(np.abs(twist) - 0.5 * gap, 0.0)


def motor_torques(t: float) -> np.ndarray:
    return np.array([0.3, 0.12]) * np.sin(2.0 * math.pi * np.array([1.0, 1.7]) * t)


def reference(
    step: float, end: float, stiffness: float, gap: float = 0.0, torques: Callable[[float], np.ndarray] = motor_torques
) -> np.ndarray:
    """Angles of the joints, by DOP853 from switching to switching, with motor torques held over each step."""

    def rates(_t: float, y: np.ndarray, motor: np.ndarray, side: np.ndarray) -> np.ndarray:
        q, w, p = y[:2], y[2:4], y[4:6]
        mass, bias = inertia_and_bias(q, w)
        torque = stiffness * (p - q - 0.5 * gap * side) * (side != 0 if gap else 1.0)
        return np.concatenate([w, np.linalg.solve(mass, torque - bias), y[6:8], (motor - torque / RATIO) / (ROTOR * RATIO)])

    y = np.zeros(8)
    side = np.zeros(2)
    for k in range(round(end / step)):
        motor, t = torques((k + 0.5) * step), 0.0
        while t < step:
            events = []
            for j in range(2) if gap else ():
                for edge in (-0.5 * gap, 0.5 * gap):

                    def crosses(_t: float, y: np.ndarray, *_: Any, j: int = j, edge: float = edge) -> float:
                        return float(y[4 + j] - y[j] - edge)

                    # Into the gap from outside, or out of it.
                    crosses.terminal = True  # type: ignore[attr-defined]
                    outward = math.copysign(1.0, edge)
                    crosses.direction = -outward if side[j] == outward else outward  # type: ignore[attr-defined]
                    if side[j] in (0.0, outward):
                        events.append((crosses, j, outward))
            found = solve_ivp(
                rates, (t, step), y, method="DOP853", rtol=1e-11, atol=1e-12, args=(motor, side), events=[e for e, *_ in events] or None
            )
            y, t = found.y[:, -1], float(found.t[-1])
            if found.status == 1:
                for (_, j, outward), times in zip(events, found.t_events, strict=True):
                    if times.size:
                        side = side.copy()
                        side[j] = 0.0 if side[j] else outward
    return y[:2]


def energy(arm: Any, stiffness: float, gap: float) -> float:
    mujoco.mj_forward(arm.model, arm.data)
    mujoco.mj_energyPos(arm.model, arm.data)
    mujoco.mj_energyVel(arm.model, arm.data)
    twist = np.maximum(np.abs(arm["twist"]) - 0.5 * gap, 0.0)
    return float(sum(arm.data.energy) + (0.5 * stiffness * twist**2).sum() + (0.5 * ROTOR * arm["motor_speed"] ** 2).sum())


WALL = '<geom name="wall" type="plane" pos="0.75 0 0" zaxis="-1 0 0" size="2 2 0.1" condim="1"/>'
TIP = '<geom name="tip" type="sphere" pos="0.4 0 0" size="0.03" mass="0" condim="1"/>'


def force_on_wall(step: float, stiffness: float, gap: float) -> np.ndarray:
    """Of a tip that torques press against a wall 3 mm before it, without gravity, at t = 0.6, 0.7 ... 1 s."""
    one = drive(stiffness, gap, friction=0.002, bearing=0.5)
    model = arm_model(step, WALL, TIP)
    model.opt.gravity[:] = 0.0
    arm = lm.mujoco.attach(model, {"shoulder": one, "elbow": one})
    arm.data.qpos[:] = 0.8, -1.2
    arm.follow()
    forces = []
    for k in range(round(1.0 / step)):
        push = min(1.0, k * step / 0.3)
        arm.step([-0.07 * push, 0.06 * push])
        found = np.zeros(6)
        if arm.data.ncon:
            mujoco.mj_contactForce(arm.model, arm.data, 0, found)
        forces.append(found[0])
    every = round(0.1 / step)
    return np.array(forces)[6 * every - 1 :: every]
