"""A six-axis arm in MuJoCo: ideal gears against strain wave gears of the catalogue, in motion and at rest.

Each motor is held to its reference by a proportional-derivative law on its own encoder, with gravity and inertia fed forward, as
in a robot. What the gears do between motor and joint no encoder sees. With an encoder on the joint and an integrator the axis hunts. Needs `pip install "lostmotion[mujoco]"`.
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np

import lostmotion as lm

STEP = 1e-3
# Joint: axis, place on the body before, mass [kg], centre of mass [m], gearbox.
LARGE, SMALL = "schaeffler-rt1-h-25-100", "schaeffler-rt1-h-14-100"
AXES = {
    "pan": ("0 0 1", "0 0 0.15", 4.0, "0 0 0.05", LARGE),
    "lift": ("0 -1 0", "0 0 0.1", 5.0, "0.2 0 0", LARGE),
    "elbow": ("0 -1 0", "0.4 0 0", 3.0, "0.15 0 0", LARGE),
    "roll": ("1 0 0", "0.3 0 0", 1.0, "0.05 0 0", SMALL),
    "bend": ("0 -1 0", "0.1 0 0", 0.8, "0.04 0 0", SMALL),
    "flange": ("1 0 0", "0.08 0 0", 0.5, "0.05 0 0", SMALL),
}
TARGET = 0.05  # of the pan joint under a position loop [rad]
POSE = np.array([0.0, 0.6, -0.9, 0.0, -0.4, 0.0])


def mjcf() -> str:
    """The arm, without anything that describes a drive."""
    text, end = "", ""
    for name, (axis, place, mass, centre, _) in AXES.items():
        size = 0.012 * mass
        text += f'<body name="{name}" pos="{place}"><joint name="{name}" type="hinge" axis="{axis}"/>'
        text += f'<inertial pos="{centre}" mass="{mass}" diaginertia="{0.4 * size} {size} {size}"/>'
        end += "</body>"
    text += '<site name="tip" pos="0.1 0 0"/>'
    return f'<mujoco><option timestep="{STEP}"/><worldbody>{text}{end}</worldbody></mujoco>'


def drive(gearbox: str, *, ideal: bool, friction: float = 0.01) -> lm.Drive:
    """A torque source with a rotor, and the gearbox, or a rigid one without friction and losses in its place."""
    box = lm.gearbox(gearbox)
    if ideal:
        rigid, free = lm.model.Rigid(), lm.model.ConstantEfficiency(efficiency=1.0)
        box = box.model_copy(update={"stiffness": rigid, "losses": free, "hysteresis": None})
    else:  # the data sheet prints no hysteresis; an assumption
        box = box.model_copy(update={"hysteresis": lm.model.Hysteresis(efficiency=0.95)})
    motor = lm.Motor(kind="torque_source", rotor_inertia=3e-5, friction_torque=0.0 if ideal else friction)
    return lm.Drive(motor=motor, gearbox=box, load=lm.Load(inertia=1.0))


def arm(**options: Any) -> Any:
    import mujoco

    drives = {name: drive(gearbox, **options) for name, (*_, gearbox) in AXES.items()}
    return lm.mujoco.attach(mujoco.MjModel.from_xml_string(mjcf()), drives)


def reference(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, speed and acceleration of the joints: a swing of 0.25 rad in each, at 0.5 Hz, which begins softly."""
    omega = np.pi
    swing = 0.25 * np.array([1.0, 0.6, -0.8, 1.0, 0.7, 1.0])
    begin = 1.0 - np.exp(-4.0 * t * t)
    rate, bend = 8.0 * t * np.exp(-4.0 * t * t), (8.0 - 64.0 * t * t) * np.exp(-4.0 * t * t)
    s, c = np.sin(omega * t), np.cos(omega * t)
    return (
        POSE + swing * begin * s,
        swing * (rate * s + begin * omega * c),
        swing * (bend * s + 2.0 * rate * omega * c - begin * omega * omega * s),
    )


def track(*, ideal: bool, duration: float = 4.0) -> tuple[np.ndarray, np.ndarray]:
    """Instants [s] and the distance of the tip from where the reference has it [m]."""
    import mujoco

    robot = arm(ideal=ideal)
    robot.data.qpos[:] = POSE
    robot.follow(held=True)
    ratios = np.array([d.gearbox.ratio for d in robot.drives.values()])
    rotors = np.array([(d.motor.rotor_inertia + d.gearbox.inertia) * d.gearbox.ratio**2 for d in robot.drives.values()])
    plan = mujoco.MjData(robot.model)  # of the reference
    stiff, damping = rotors * 60.0**2, 2.0 * rotors * 60.0
    times, errors = [], []
    for k in range(round(duration / STEP)):
        q, v, a = reference(k * STEP)
        plan.qpos[:], plan.qvel[:], plan.qacc[:] = q, v, a
        mujoco.mj_inverse(robot.model, plan)
        # The encoder of each motor, divided by the ratio.
        motor = robot["load_angle"] + (0.0 if ideal else robot["twist"])
        torque = plan.qfrc_inverse + rotors * a + stiff * (q - motor) + damping * (v - robot["motor_speed"] / ratios)
        robot.step(torque / ratios)
        q, *_ = reference((k + 1) * STEP)
        plan.qpos[:] = q
        mujoco.mj_kinematics(robot.model, plan)
        mujoco.mj_kinematics(robot.model, robot.data)
        times.append((k + 1) * STEP)
        errors.append(np.linalg.norm(plan.site("tip").xpos - robot.data.site("tip").xpos))
    return np.array(times), np.array(errors)


def rest(duration: float) -> float:
    """By how much the joints of the arm move [rad] while closed brakes, which are a friction of 0.5 N·m, hold its motors."""
    robot = arm(ideal=False, friction=0.5)
    robot.data.qpos[:] = POSE
    robot.follow(held=True)
    for _ in range(round(duration / STEP)):
        robot.step()
    return float(np.abs(robot.data.qpos - POSE).max())


def loop_of_the_load(added_backlash: float = 0.0) -> Any:
    """The pan axis alone, as a scenario: its position loop has an integrator and reads an encoder on the joint."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf())
    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[:] = POSE
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    inertia, rotor = float(mass[0, 0]), 3e-5
    box = lm.gearbox(LARGE, added_backlash=added_backlash)
    box = box.model_copy(update={"hysteresis": lm.model.Hysteresis(efficiency=0.95)})
    gain = 100.0 * (rotor + box.inertia + inertia / box.ratio**2)  # a speed loop of 100 rad/s
    return lm.Scenario(
        motor={"kind": "torque_source", "rotor_inertia": rotor, "friction_torque": 0.01, "rated_torque": 1.0},
        gearbox=box,
        load={"inertia": inertia},
        controller={
            "sample_time": "250 us",
            "encoder": {"lines": 2048},
            "position_encoder": {"shaft": "load", "bits": 20},
            "reference": {"kind": "position", "steps": [{"time": "0.1 s", "height": TARGET}]},
            "position": {"gain": 10.0, "integral_gain": 60.0, "sample_time": "1 ms"},
            "speed": {"gain": gain, "integral_gain": 25.0 * gain, "torque_limit": 1.0},
            "current": {"kind": "ideal"},
        },
        simulation={"duration": 4.0, "sample_interval": 1e-3},
    )


def hunt(duration: float = 8.0, added_backlash: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Instants [s] and the angle of the pan joint [rad] in the arm, with that loop; brakes hold the other motors."""
    import mujoco

    axis = loop_of_the_load(added_backlash)
    drives = {name: drive(gearbox, ideal=False, friction=0.5) for name, (*_, gearbox) in AXES.items()}
    robot = lm.mujoco.attach(mujoco.MjModel.from_xml_string(mjcf()), drives | {"pan": axis})
    robot.data.qpos[:] = POSE
    robot.follow(held=True)
    times, angles = STEP * np.arange(1, round(duration / STEP) + 1), []
    for t in times:
        robot.step({"pan": TARGET if t > 0.1 else 0.0})
        angles.append(float(robot.data.qpos[0]))
    return times, np.array(angles)


def swing(times: np.ndarray, angles: np.ndarray) -> tuple[float, float]:
    """Amplitude [rad] and frequency [Hz] of the second half of a motion."""
    last = angles[len(angles) // 2 :] - angles[len(angles) // 2 :].mean()
    rising = times[len(angles) // 2 :][1:][(last[1:] >= 0.0) & (last[:-1] < 0.0)]
    return 0.5 * float(np.ptp(last)), (len(rising) - 1) / float(rising[-1] - rising[0])


if __name__ == "__main__":
    if importlib.util.find_spec("mujoco") is None:
        print('needs pip install "lostmotion[mujoco]"')
    else:
        for ideal in (True, False):
            _, errors = track(ideal=ideal)
            print(
                f"{'ideal gears' if ideal else 'strain wave gears'}: the tip is off by up to {1e3 * errors.max():.3f} mm"
            )
        print(f"brakes closed for 2 s: moved by {rest(2.0):g} rad")
        amplitude, frequency = swing(*hunt())
        print(f"encoder on the joint: pan swings by {1e3 * amplitude:.3f} mrad at {frequency:.3f} Hz")
        axis = loop_of_the_load()
        cycle = lm.servo.limit_cycle(axis)
        print(f"the axis alone: {cycle}, {1e3 * cycle.amplitudes['load_angle']:.3f} mrad")
        print(f"certificate of the axis: {lm.hunting_certificate(axis)}")
