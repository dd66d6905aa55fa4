"""Steps of drives by `lm.warp`, alone and in robots: python benchmarks/warp_drives.py [DEVICE].

On a graphics processor it takes less than four minutes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

import lostmotion as lm

COUNTS = {"cpu": (4096,)}
LARGE = (4096, 65_536, 1_048_576)
SECONDS = 2.0  # of each measurement
WORLDS = {"cpu": 16}
MANY_WORLDS = 4096
LIMBS = {"left_arm": 7, "right_arm": 7, "left_leg": 6, "right_leg": 6, "waist": 3}
"""hinges of a humanoid, 29 in all, with axes in turn"""


def geared() -> lm.Drive:
    """A drive with a gap, friction and an efficiency."""
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4, friction_torque=0.02),
        gearbox=lm.Gearbox(
            ratio=50,
            stiffness=lm.model.TorsionCurve(slopes=[1e4], backlash=2e-3),
            losses=lm.model.ConstantEfficiency(efficiency=0.8),
            rated_input_speed=400.0,
            rated_output_torque=50.0,
        ),
        load=lm.Load(inertia=1.0),
    )


def rate(drive: lm.Drive, count: int, dtype: str, step: float, device: str) -> tuple[float, dict[str, int]]:
    """Million steps per second, and how they were made, under commands that differ from drive to drive."""
    generator = np.random.default_rng(1)
    drives = lm.warp.Drives(drive, count=count, dtype=dtype, device=device)
    commands = [wp.array(generator.uniform(-0.3, 0.3, count).astype(dtype), device=device) for _ in range(16)]
    for command in commands:
        drives.step(command, 0.0, step)
    wp.synchronize_device(device)
    begin, made = time.perf_counter(), 0
    while (spent := time.perf_counter() - begin) < SECONDS:
        for command in commands:
            drives.step(command, 0.0, step)
        wp.synchronize_device(device)
        made += len(commands) * count
    return 1e-6 * made / spent, drives.counts


def humanoid() -> mujoco.MjModel:
    """A floating trunk with limbs of capsules, in free fall."""
    axes, limbs = ("0 1 0", "1 0 0", "0 0 1"), ""
    for limb, hinges in LIMBS.items():
        for k in range(hinges):
            link = f'<geom type="capsule" fromto="0 0 0 0 0 -.1" size=".03" mass="{1.5 - 0.15 * k}"/>'
            limbs += f'<body pos="0 0 -.1"><joint name="{limb}_{k}" axis="{axes[k % 3]}"/>{link}'
        limbs += "</body>" * hinges
    body = f'<body><freejoint/><geom type="box" size=".1 .1 .2" mass="15"/>{limbs}</body>'
    contacts = '<default><geom contype="0" conaffinity="0"/></default>'
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="0.002"/>{contacts}<worldbody>{body}</worldbody></mujoco>'
    )


def robots(device: str, *, with_drives: bool) -> float:
    """Thousand steps of worlds per second, as a CUDA graph where there is one."""
    model, worlds = humanoid(), WORLDS.get(device, MANY_WORLDS)
    names = [model.joint(k).name for k in range(1, model.njnt)]
    with wp.ScopedDevice(device):
        m, d = mjw.put_model(model), mjw.make_data(model, nworld=worlds)
        joints = lm.warp.attach(model, m, d, dict.fromkeys(names, geared()), stiffness=100.0, damping=3.0)
        targets = {name: wp.zeros(worlds, dtype=wp.float32) for name in names}

        def step() -> None:
            if with_drives:
                joints.before(targets)
            mjw.step(m, d)

        step()
        make: Callable[[], Any] = step
        if wp.get_device(device).is_cuda:
            with wp.ScopedCapture() as capture:
                step()
            make = partial(wp.capture_launch, capture.graph)
        make()
        wp.synchronize_device(device)
        begin, made = time.perf_counter(), 0
        while (spent := time.perf_counter() - begin) < SECONDS:
            make()
            wp.synchronize_device(device)
            made += worlds
    return 1e-3 * made / spent


def bits(device: str) -> float:
    """Largest difference [rad] of the load angles from those of the CPU device, in double precision after 200 steps."""
    generator = np.random.default_rng(2)
    given = generator.uniform(-0.3, 0.3, (200, 256))
    ends = []
    for where in (device, "cpu"):
        drives = lm.warp.Drives(geared(), count=256, dtype="float64", device=where)
        for row in given:
            drives.step(row)
        ends.append(drives["load_angle"].numpy())
    return float(np.abs(ends[0] - ends[1]).max())


def main() -> None:
    device = sys.argv[1] if len(sys.argv) > 1 else str(wp.get_preferred_device())
    wp.config.log_level = wp.LOG_WARNING
    print(f"{wp.get_device(device).name}: million steps per second")
    drives = {"a gap, an efficiency": geared(), "catalogue-robot-joint": lm.load("catalogue-robot-joint").drive()}
    for name, drive in drives.items():
        for dtype in ("float32", "float64"):
            for step in (1e-3, 5e-3):
                for count in COUNTS.get(device, LARGE):
                    speed, counts = rate(drive, count, dtype, step, device)
                    doubtful = counts["doubtful"] / counts["steps"]
                    print(f"{name}, {dtype}, {1e3 * step:g} ms, {count} drives: {speed:.2f}; doubtful {doubtful:.1e}")
    bare, turned = (robots(device, with_drives=with_drives) for with_drives in (False, True))
    print(f"humanoid of 29 joints, thousand steps per second: {bare:.3f} without drives, {turned:.3f} with them")
    if device != "cpu":
        print(f"largest difference from the CPU: {bits(device):.1e} rad")


if __name__ == "__main__":
    main()
