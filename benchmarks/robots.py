"""Drives in MuJoCo beside what is written by hand: errors against closed equations, and the time of a step."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from report import Report

import robot_arm as arms

END = 0.5  # [s]
STIFFNESS = 2e4


def explicit(step: float, stiffness: float, gap: float, end: float = END) -> np.ndarray:
    """The usual model: the rotor by semi-implicit steps in NumPy, the torque of the mesh held over the step of MuJoCo."""
    model = arms.arm_model(step)
    data = mujoco.MjData(model)
    motor, speed = np.zeros(2), np.zeros(2)  # of the rotors, at the joint
    for k in range(round(end / step)):
        torque = arms.gear_torque(motor - data.qpos, stiffness, gap)
        data.qfrc_applied[:] = torque
        mujoco.mj_step(model, data)
        speed += step * (arms.motor_torques((k + 0.5) * step) - torque / arms.RATIO) / (arms.ROTOR * arms.RATIO)
        motor += step * speed
        if not np.isfinite(data.qpos).all() or np.abs(data.qpos).max() > 1e3:
            return np.full(2, np.nan)
    return np.array(data.qpos)


TWO_HINGES = """
<mujoco><option timestep="{step}" gravity="0 0 -9.81"/><worldbody>
  <body name="s1"><joint name="rotor1" type="hinge" axis="0 -1 0" armature="0.1"/><inertial pos="0 0 0" mass="1e-4" diaginertia="1e-7 1e-7 1e-7"/>
  <body name="upper"><joint name="play1" type="hinge" axis="0 -1 0" limited="true" range="{low} {high}"/>
    <inertial pos="0.25 0 0" mass="3" diaginertia="0.01 0.06 0.06"/>
    <body name="s2" pos="0.5 0 0"><joint name="rotor2" type="hinge" axis="0 -1 0" armature="0.1"/><inertial pos="0 0 0" mass="1e-4" diaginertia="1e-7 1e-7 1e-7"/>
    <body name="lower"><joint name="play2" type="hinge" axis="0 -1 0" limited="true" range="{low} {high}"/>
      <inertial pos="0.2 0 0" mass="2" diaginertia="0.01 0.03 0.03"/></body></body></body></body>
</worldbody></mujoco>"""


def two_hinges(step: float, gap: float, end: float) -> np.ndarray:
    """Backlash as a second hinge with a range, which users of MuJoCo write."""
    half = np.degrees(0.5 * gap)
    model = mujoco.MjModel.from_xml_string(TWO_HINGES.format(step=step, low=-half, high=half))
    data = mujoco.MjData(model)
    for k in range(round(end / step)):
        data.qfrc_applied[[0, 2]] = arms.RATIO * arms.motor_torques((k + 0.5) * step)
        mujoco.mj_step(model, data)
    return np.array([data.qpos[0] + data.qpos[1], data.qpos[2] + data.qpos[3]])


def exact(
    step: float,
    stiffness: float,
    gap: float,
    end: float = END,
    substeps: int | None = None,
    torques: Callable[[float], np.ndarray] = arms.motor_torques,
) -> np.ndarray:
    robot = arms.robot(step, arms.drive(stiffness, gap), substeps=substeps)
    for k in range(round(end / step)):
        robot.step(torques((k + 0.5) * step))
    return np.array(robot.data.qpos)


def jump_errors(step: float) -> list[str]:
    """Errors [rad] under torques that jump at t = 0 and stay constant."""
    errors = []
    for torque in ((0.3, 0.12), (0.6, 0.2), (-0.1, 0.05), (1.0, 0.3)):
        held = np.array(torque)
        right = arms.reference(step, END, STIFFNESS, torques=lambda _t, held=held: held)  # type: ignore[misc]
        found = exact(step, STIFFNESS, 0.0, torques=lambda _t, held=held: held)  # type: ignore[misc]
        errors.append(shown(np.abs(found - right).max()))
    return errors


def energy_error(step: float, stiffness: float, gap: float) -> float:
    """Largest change of the energy [J] within 1 s of free fall."""
    robot = arms.robot(step, arms.drive(stiffness, gap))
    first, worst = arms.energy(robot, stiffness, gap), 0.0
    for _ in range(round(1.0 / step)):
        robot.step()
        worst = max(worst, abs(arms.energy(robot, stiffness, gap) - first))
    return worst


def creep(hours: float, step: float = 5e-3) -> float:
    """By how much an arm that friction holds under gravity moves [rad]."""
    robot = arms.robot(step, arms.drive(friction=0.3, bearing=0.5))
    robot.data.qpos[:] = 0.3, 0.4
    robot.follow(held=True)
    for _ in range(round(3600.0 * hours / step)):
        robot.step()
    return float(np.abs(robot.data.qpos - (0.3, 0.4)).max())


def time_of_a_joint(step: float, substeps: int) -> float:
    """Processor time [us] for each joint and step beyond that of `mj_step`."""

    def best(work: Any) -> float:
        times = []
        for _ in range(20):
            begin = time.process_time()
            for _ in range(50):
                work()
            times.append((time.process_time() - begin) / 50)
        return min(times)

    robot = arms.robot(step, arms.drive(STIFFNESS), substeps=substeps)
    model = arms.arm_model(step)
    data = mujoco.MjData(model)
    return 1e6 * (best(robot.step) - best(lambda: mujoco.mj_step(model, data))) / 2.0


def shown(error: float) -> str:
    return "unstable" if not np.isfinite(error) else f"{error:.1e}"


def section(report: Report) -> None:
    report.section(
        "Robots",
        "A planar arm of two links in MuJoCo falls and is turned by two drives (tests/robot_arm.py); errors are those of the joint angles "
        "[rad] against DOP853 at 1e-11. Times are processor time. By hand: rotors in semi-implicit steps, the torque of the mesh held over a step. The two hinges have no compliance beside their play.",
    )
    rows = []
    for step in (4e-3, 2e-3, 1e-3):
        q = arms.reference(step, END, STIFFNESS)
        found = [exact(step, STIFFNESS, 0.0), exact(step, STIFFNESS, 0.0, substeps=20), explicit(step, STIFFNESS, 0.0)]
        rows.append([f"no gap, {1e3 * step:g} ms", *(shown(np.abs(f - q).max()) for f in found), ""])
    for step, end in ((1e-3, 0.1),):
        q = arms.reference(step, end, STIFFNESS, gap=1e-3)
        found = [exact(step, STIFFNESS, 1e-3, end), exact(step, STIFFNESS, 1e-3, end, 20)]
        found += [explicit(step, STIFFNESS, 1e-3, end), two_hinges(step, 1e-3, end)]
        rows.append([f"gap of 1 mrad, {1e3 * step:g} ms, 0.1 s", *(shown(np.abs(f - q).max()) for f in found)])
    report.table(["", "lm.mujoco", "with 20 substeps", "by hand", "two hinges"], rows)
    report.table(
        ["constant torques from rest [N m]", "0.3, 0.12", "0.6, 0.2", "-0.1, 0.05", "1, 0.3"],
        [[f"lm.mujoco, {1e3 * step:g} ms", *jump_errors(step)] for step in (4e-3, 2e-3, 1e-3)],
    )
    wall = {step: arms.force_on_wall(step, 1e5, 1e-3)[-1] for step in (5e-3, 1e-4)}
    report.table(
        ["", "lm.mujoco"],
        [
            ["energy error, 1e5 N m/rad, gap of 1 mrad, 1 ms", f"{energy_error(1e-3, 1e5, 1e-3):.1e} J"],
            ["energy error, 1e6 N m/rad, gap of 1 mrad, 5 ms", f"{energy_error(5e-3, 1e6, 1e-3):.1e} J"],
            [
                "force on a wall, 1e5 N m/rad, gap of 1 mrad, 5 ms against 0.1 ms",
                f"{100 * (wall[5e-3] / wall[1e-4] - 1):+.1f} %",
            ],
            ["creep in 1 h under gravity, held by friction", f"{creep(1.0):g} rad"],
            ["time of a joint and a step beyond mj_step, 1 substep", f"{time_of_a_joint(1e-3, 1):.1f} us"],
            ["the same, 4 substeps", f"{time_of_a_joint(1e-3, 4):.1f} us"],
        ],
    )


if __name__ == "__main__":
    made = Report()
    section(made)
    print(made.text())
