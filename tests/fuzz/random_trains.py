"""Random trains of all elements: what joins shafts, what acts on them, laws over the angle, given motions, mass matrices."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import lostmotion as lm
from fuzz.scenario_files import check_result
from fuzz.verdict import ends, refused
from lostmotion.inputs.toml_text import toml_text

SECONDS = 3.0  # of a run until it is interrupted


def spread(random: Random, low: float, high: float) -> float:
    """A number by the logarithm."""
    return float(low * (high / low) ** random.random())


def signal(random: Random, size: float) -> dict[str, Any]:
    """A constant, a sine, or both."""
    made: dict[str, Any] = {"mean": random.uniform(-size, size)} if random.random() < 0.7 else {}
    if random.random() < 0.7:
        made |= {"amplitude": size * random.random(), "frequency": spread(random, 0.1, 50.0)}
        made |= {"phase": random.uniform(-3.0, 3.0)}
    return made


def train(random: Random) -> dict[str, Any]:
    """Tables of a scenario in the long form."""
    count = random.randint(1, 5) if random.random() < 0.9 else random.randint(6, 40)
    wide = random.random() < 0.3  # values of many orders
    low, high = (1e-8, 1e3) if wide else (1e-3, 1.0)
    names = [f"s{k}" for k in range(count)]
    made: dict[str, Any] = {"shafts": {}, "motors": {}, "command": {}}
    for name in names:
        made["shafts"][name] = shaft(random, low, high)
    for k in range(1, count):
        join(random, made, names[random.randrange(k)], names[k], f"x{k}")
    if count > 2 and random.random() < 0.2:
        join(random, made, names[0], names[-1], "closing")
    for k in range(random.randint(1, 2)):
        made["motors"][f"m{k}"] = motor(random, random.choice(names))
        made["command"][f"m{k}"] = signal(random, 1.0)
    if random.random() < 0.3:
        made["brakes"] = {"b": {"shaft": random.choice(names), "torque": spread(random, 0.1, 10.0)}}
        made["command"]["b"] = random.choice((0.0, 1.0, 0.5, {"mean": 0.5, "amplitude": 0.5, "frequency": 3.0}))
    if random.random() < 0.3:
        stiffness = {"kind": "linear", "stiffness": spread(random, 1.0, 1e4)}
        made["springs"] = {"k": {"shaft": random.choice(names), "stiffness": stiffness}}
    if random.random() < 0.3:
        made["gravity"] = {"g": {"shaft": random.choice(names), "mass": spread(random, 0.01, 10.0), "radius": 0.1}}
    if random.random() < 0.3:
        made["angle_torques"] = {"c": {"shaft": random.choice(names), **harmonic(random, spread(random, 1e-3, 1.0))}}
    if random.random() < 0.15:
        driven = random.choice(names)
        made["shafts"][driven]["speed"] = signal(random, spread(random, 0.1, 100.0))
    if count > 2 and random.random() < 0.15:
        coupled = random.sample(names, 2)
        made["mass_matrices"] = {"j": {"shafts": coupled, "matrix": matrix(random, coupled, made["shafts"])}}
    duration = spread(random, 0.02, 1.0)
    made["simulation"] = {"duration": duration, "sample_interval": duration / 100.0}
    return made


def harmonic(random: Random, amplitude: float) -> dict[str, Any]:
    return {"kind": "sine", "amplitude": amplitude, "order": random.choice((1, 2, 7)), "phase": random.uniform(-3.0, 3.0)}


def matrix(random: Random, coupled: list[str], shafts: dict[str, Any]) -> list[list[float]]:
    """Of inertias that the shafts then have no more of their own."""
    one, other = (shafts[name].pop("inertia") for name in coupled)
    beside = random.uniform(-0.9, 0.9) * (one * other) ** 0.5
    return [[one, beside], [beside, other]]


def shaft(random: Random, low: float, high: float) -> dict[str, Any]:
    made: dict[str, Any] = {"inertia": spread(random, low, high)}
    if random.random() < 0.5:
        made["friction_torque"] = spread(random, 1e-3, 1.0)
        if random.random() < 0.3:
            made["breakaway_torque"] = 1.5 * made["friction_torque"]
    if random.random() < 0.4:
        made["viscous_friction"] = spread(random, 1e-4, 1.0)
    if "friction_torque" not in made and random.random() < 0.3:
        speeds = [0.0, *sorted(spread(random, 0.1, 300.0) for _ in range(3))]
        made["friction_curve"] = {"speeds": speeds, "torques": [spread(random, 1e-3, 1.0) for _ in speeds]}
    if random.random() < 0.4:
        made["torque"] = signal(random, spread(random, 0.1, 10.0))
    return made


def motor(random: Random, on: str) -> dict[str, Any]:
    made = {"shaft": on, "rotor_inertia": spread(random, 1e-4, 1e-1), "rated_torque": spread(random, 0.1, 10.0)}
    if random.random() < 0.5:
        return made | {"kind": "torque_source"}
    made |= {"kind": "dc", "rated_speed": spread(random, 50.0, 400.0), "armature_voltage_constant": 12.6}
    return made | {"electrical_time_constant": spread(random, 1e-4, 1e-2)}


def join(random: Random, made: dict[str, Any], a: str, b: str, name: str) -> None:
    """Adds what joins two shafts."""
    between: dict[str, Any] = {"input": a, "output": b}
    match random.randrange(8):
        case 0:
            kind = random.choice(("friction", "safety"))
            made.setdefault("clutches", {})[name] = between | {"torque": spread(random, 0.1, 20.0), "kind": kind}
            if kind == "friction":
                made["command"][name] = random.choice((0.0, 0.7, 1.0))
        case 1:
            made.setdefault("freewheels", {})[name] = between
        case 2:
            made.setdefault("dampers", {})[name] = between | {"viscous_friction": spread(random, 1e-3, 10.0)}
        case _:
            made.setdefault("gears", {})[name] = between | gear(random)


def gear(random: Random) -> dict[str, Any]:
    made: dict[str, Any] = {"ratio": spread(random, 0.5, 100.0)}
    stiff = spread(random, 1e2, 1e6)
    match random.randrange(4):
        case 0:
            made["stiffness"] = {"kind": "linear", "stiffness": stiff}
        case 1 | 2:
            made["stiffness"] = {"kind": "curve", "backlash": spread(random, 1e-4, 1e-2), "slopes": [stiff]}
            if random.random() < 0.4:
                made["hysteresis"] = {"efficiency": random.uniform(0.5, 1.0)}
            elif random.random() < 0.3:
                made["transmission_error"] = harmonic(random, spread(random, 1e-5, 1e-3))
            elif random.random() < 0.2:
                fewer = {"contact_ratio": random.uniform(1.1, 1.9), "fewer_pairs": random.uniform(0.5, 0.95)}
                made["mesh_stiffness"] = {"teeth": random.choice((1, 9, 30)), **fewer}
        case 3 if random.random() < 0.3:
            backlash, restitution = spread(random, 1e-4, 1e-2), random.choice((0.0, 0.4, 0.8, 1.0))
            return made | {"stiffness": {"kind": "rigid", "backlash": backlash, "restitution": restitution}}
    if "stiffness" in made and "hysteresis" not in made and random.random() < 0.4:
        made["mesh_damping"] = spread(random, 1e-2, 1e2)
        made["damping_limited"] = "backlash" in made["stiffness"] and random.random() < 0.3
    match random.randrange(3):
        case 0:
            forward, backward = random.uniform(0.5, 1.0), random.uniform(-0.3, 0.95)
            made["losses"] = {"kind": "mesh_efficiency", "drive_efficiency": forward}
            made["losses"]["backdrive_efficiency"] = min(forward, backward)
        case 1:
            made["losses"] = {"kind": "constant_efficiency", "efficiency": random.uniform(0.5, 1.0)}
    return made


def case(random: Random, folder: Path) -> None:
    """Runs to its end, or until an interruption, with an energy balance that closes; or is refused plainly."""
    (folder / "train.toml").write_text(toml_text(train(random)))
    scenario = refused(lambda: lm.load("train.toml"), ["train.toml"])
    if scenario is None:
        return
    result = ends(lambda: refused(lambda: lm.simulate(scenario), (), lm.SolverError), SECONDS)
    if result is not None:
        check_result(result)
