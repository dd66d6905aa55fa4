"""Logs of one shaft with dry and viscous friction under a held torque, by the closed form of its motion."""

import math
from pathlib import Path

import numpy as np

RIG = """
shafts.c = { viscous_friction = 0.02, friction_torque = 0.1 }
motors.m = { shaft = "c", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 5e-3 }
simulation = { duration = "1 s", sample_interval = "5 ms" }
"""
TASK = """
scenario = "rig.toml"
[logs]
files = ["l*.csv"]
[inputs.m_command]
channel = "torque"
[measured.position]
channel = "position"
variable = "c_angle"
[set]
"shafts.c.viscous_friction" = "viscous"
"shafts.c.friction_torque" = "coulomb"
"""


def angles(torque: np.ndarray, h: float, *, coulomb: float, viscous: float = 0.02, inertia: float = 5e-3) -> np.ndarray:
    """Angle at each sample, from rest: J w' = u - b w - Tc sgn(w), whose solution between two reversals is an exponential."""
    q = w = 0.0
    found = []
    for u in torque:
        found.append(q)
        left = h
        while left > 0.0 and (w != 0.0 or abs(u) > coulomb):
            sign = math.copysign(1.0, w if w != 0.0 else u)
            end = (u - sign * coulomb) / viscous  # speed that is approached
            rate = viscous / inertia
            stop = math.log((end - w) / end) / rate if end * sign < 0.0 else math.inf
            t = min(left, stop)
            q += end * t + (w - end) * (1.0 - math.exp(-rate * t)) / rate
            w = 0.0 if t == stop else end + (w - end) * math.exp(-rate * t)
            left -= t
    return np.array(found)


def write_log(path: Path, time: np.ndarray, torque: np.ndarray, angle: np.ndarray, header: str = "") -> None:
    """A CSV file of a log."""
    rows = "\n".join(f"{t:.6g},{u:.9g},{q:.9g}" for t, u, q in zip(time, torque, angle, strict=True))
    path.write_text(f"{header}time [s],torque [N*m],position [rad]\n{rows}\n")


WEAR = Path(__file__).parents[1] / "examples" / "wear" / "logs"


def wear_logs(directory: Path = WEAR) -> None:
    """Logs of ``examples/wear``: the friction is a quarter larger from the 13th log on."""
    time = np.arange(200) / 100
    for k in range(18):
        draw = np.random.default_rng(k)
        coulomb = (0.1 if k < 12 else 0.125) * (1.0 + 0.02 * draw.standard_normal())
        viscous = 0.02 * (1.0 + 0.02 * draw.standard_normal())
        torque = np.round(0.5 * np.sin(7 * time + k) + 0.25 * np.sin(20 * time + 2 * k), 3)
        angle = angles(torque, 1e-2, coulomb=coulomb, viscous=viscous) + 1e-3 * draw.standard_normal(len(time))
        write_log(directory / f"{k + 1:02d}.csv", time, torque, np.round(angle, 5), f"# hours: {50 * k}\n")
