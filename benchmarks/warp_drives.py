"""Steps of drives by `lm.warp.Drives`: python benchmarks/warp_drives.py [DEVICE]. On a graphics processor it takes less than four minutes."""

from __future__ import annotations

import sys
import time

import numpy as np
import warp as wp

import lostmotion as lm

COUNTS = {"cpu": (4096,)}
LARGE = (4096, 65_536, 1_048_576)
SECONDS = 2.0  # of each measurement


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
    if device != "cpu":
        print(f"largest difference from the CPU: {bits(device):.1e} rad")


if __name__ == "__main__":
    main()
