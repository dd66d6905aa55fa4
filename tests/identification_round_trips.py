"""Random servos, their logs with noise and quantisation, and how often the 95 % intervals hold the truth.

    .venv/bin/python tests/identification_round_trips.py 100

prints for each parameter how many of the intervals hold its value. The result stands in docs/verification.md.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from identification_logs import SERVO, servo_plans, servo_task
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.identification.virtual_logs import virtual_log

FREE = ("torque_constant", "armature", "coulomb_friction", "viscous_friction", "dead_time")
NOISE = 1e-3  # rad


def round_trip(seed: int) -> dict[str, bool]:
    """Whether the interval of each parameter of a random servo holds its value."""
    draw = np.random.default_rng(seed)
    truth = {
        "torque_constant": draw.uniform(1.2, 2.4),
        "resistance": 3.0,
        "armature": draw.uniform(0.006, 0.02),
        "coulomb_friction": draw.uniform(0.02, 0.12),
        "viscous_friction": draw.uniform(0.01, 0.06),
        "dead_time": draw.uniform(0.005, 0.035),
        "angle_offset": 0.0,
        "load_friction": 0.0,
    }
    with tempfile.TemporaryDirectory() as directory:
        data = servo_task(Path(directory)).model_dump()
    data["parameters"] |= {name: {"start": truth[name], "fixed": True} for name in truth if name not in FREE}
    data["set"]["initial.angles.arm"] = 0.0  # at rest, as the servo is
    data["ladder"] = [{"name": "Coulomb and viscous friction", "free": FREE}]
    data["logs"]["held_out"] = None
    data["fit"] |= {"iterations": 12, "sample_interval": 5e-3}
    rig = Rig(Identification(**data), SERVO)
    logs = []
    for k, plan in enumerate(servo_plans(4, duration=1.5, rate=50.0)):
        if k == 2:  # the drop: whether it stays or falls is no smooth function of friction
            continue
        noise = {"position": NOISE}
        measured = virtual_log(rig, replace(plan, name=f"{seed}-{k}"), truth, noise=noise, seed=1000 * seed + k)
        logs.append(prepared(rig.task, measured, rig.units))
    result = identify_logs(rig, logs, threads=1)
    return {name: result.intervals[name].low <= truth[name] <= result.intervals[name].high for name in FREE}


def main(count: int) -> None:
    held = dict.fromkeys(FREE, 0)
    for seed in range(count):
        for name, inside in round_trip(seed).items():
            held[name] += inside
        print(seed + 1, held, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
