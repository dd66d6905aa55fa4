"""Random trains with rigid gears that lock themselves, and the same with ever stiffer meshes."""

import math
from typing import Any

import numpy as np


def locking_train(seed: int, number: int, stiffness: float | None = None) -> dict[str, Any]:
    """Tables of a scenario in the long form; stiffness: of all meshes in place of rigid ones, with damping."""
    random = np.random.default_rng([seed, number])

    def even(low: float, high: float) -> float:
        return float(random.uniform(low, high))

    def spread(low: float, high: float) -> float:
        return float(low * (high / low) ** random.uniform())

    count = int(random.integers(2, 6))
    made: dict[str, Any] = {"shafts": {}, "gears": {}, "clutches": {}, "motors": {}, "command": {}}
    for k in range(count):
        shaft: dict[str, Any] = {"inertia": spread(1e-4, 3.0)}
        if random.uniform() < 0.4:
            shaft["friction_torque"] = spread(1e-3, 0.5)
        if random.uniform() < 0.4:
            shaft["viscous_friction"] = spread(1e-3, 0.3)
        if k > 0 and random.uniform() < 0.7:
            load = spread(0.1, 10.0) * float(random.choice([-1, 1]))
            shaft["torque"] = {"mean": load, "steps": [{"time": even(0.05, 0.2), "height": -load * even(1.2, 5.0)}]}
            if random.uniform() < 0.3:
                shaft["torque"] |= {"amplitude": abs(load), "frequency": spread(1.0, 20.0)}
        made["shafts"][f"s{k}"] = shaft
    for k in range(1, count):
        join(made, k, random, even, spread, stiffness)
    torque = spread(0.1, 5.0)
    made["motors"]["m"] = {"shaft": "s0", "kind": "torque_source", "rotor_inertia": 0.0}
    time, share = even(0.05, 0.3), float(random.choice([1.0, 1.5, 2.0, 0.5]))
    made["command"]["m"] = {"mean": torque, "steps": [{"time": time, "height": -torque * share}]}
    if random.uniform() < 0.3:
        made["command"]["m"] |= {"amplitude": torque, "frequency": spread(1.0, 20.0)}
    if random.uniform() < 0.2:
        made["brakes"] = {"b": {"shaft": f"s{int(random.integers(0, count))}", "torque": spread(0.1, 10.0)}}
        made["command"]["b"] = {"mean": 1.0, "steps": [{"time": 0.1, "height": -1.0}]}
    made["simulation"] = {"duration": 0.5, "sample_interval": 0.005}
    return made


def join(made: dict[str, Any], k: int, random: Any, even: Any, spread: Any, stiffness: float | None) -> None:
    """Join shaft k to one before it, by a gear or a clutch."""
    a, b = int(random.integers(max(0, k - 2), k)), k
    if random.uniform() < 0.25:
        a, b = b, a
    gear: dict[str, Any] = {"input": f"s{a}", "output": f"s{b}", "ratio": spread(0.5, 50.0) * (1 if random.uniform() < 0.7 else -1)}
    kind = random.uniform()
    rigid = kind < 0.8 or k == 1
    if kind < 0.65 or k == 1:
        forward, back = even(0.3, 0.7), float(random.choice([-0.3, -0.3, -0.8, -0.05]))
        gear["losses"] = {"kind": "mesh_efficiency", "drive_efficiency": forward, "backdrive_efficiency": back}
    elif rigid:
        if random.uniform() < 0.5:
            gear["losses"] = {"kind": "mesh_efficiency", "drive_efficiency": 0.8, "backdrive_efficiency": 0.7}
    elif kind < 0.9:
        gear |= {"stiffness": {"kind": "linear", "stiffness": spread(100.0, 1e4)}, "mesh_damping": spread(0.1, 10.0)}
    else:
        made["clutches"][f"x{k}"] = {"input": f"s{a}", "output": f"s{b}", "torque": spread(0.1, 5.0)}
        made["clutches"][f"x{k}"]["kind"] = str(random.choice(["friction", "safety"]))
        if made["clutches"][f"x{k}"]["kind"] == "friction":
            made["command"][f"x{k}"] = 1.0
        return
    if rigid and stiffness is not None:
        damping = 0.6 * math.sqrt(stiffness * made["shafts"][f"s{b}"]["inertia"])
        gear |= {"stiffness": {"kind": "linear", "stiffness": stiffness}, "mesh_damping": damping}
    made["gears"][f"x{k}"] = gear
