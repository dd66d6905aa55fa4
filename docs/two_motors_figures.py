"""Figures of docs/two-motors.md: runs and studies of the scenario `two-motors-one-ring` beside closed forms."""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from figure_files import save

import lostmotion as lm
from lostmotion.reports.figure_style import FAINT, FIRST, POINTS, SECOND, THIRD
from lostmotion.reports.panels import Curve, Panel
from lostmotion.studies.runs.read_table import read_table

BASE = lm.load("two-motors-one-ring")
GEAR = BASE.gears["first_gear"]
RATIO, STIFFNESS, HALF_GAP = GEAR.ratio, GEAR.stiffness.slopes[0], 0.5 * GEAR.stiffness.backlash
LOSSY = (GEAR.losses.drive_efficiency, GEAR.losses.backdrive_efficiency)
ROTOR, RING = BASE.motors["first_motor"].rotor_inertia, BASE.shafts["ring"].inertia
FRICTION = BASE.motors["first_motor"].friction_torque
OMEGA = math.sqrt(STIFFNESS * (1.0 / (ROTOR * RATIO**2) + 2.0 / RING))  # of the vibration of the ring on both gears
PERIOD = 2.0 * math.pi / OMEGA
NAMES = ("first", "second")
ARCMIN = math.radians(1.0 / 60.0)


def ring(losses: tuple[float, float] = (1.0, 1.0), friction: float = 0.0, **changes: Any) -> lm.Scenario:
    """The ring without wind and viscous friction."""
    mesh = {"kind": "mesh_efficiency", "drive_efficiency": losses[0], "backdrive_efficiency": losses[1]}
    bare: dict[str, Any] = {"shafts.ring.viscous_friction": 0.0, "shafts.ring.torque": 0.0}
    for name in NAMES:
        bare |= {f"motors.{name}_motor.friction_torque": friction, f"gears.{name}_gear.losses": mesh}
    return BASE.replace(**(bare | changes))


# --- lost motion at the ring ---


def held(bias: float) -> lm.Scenario:
    """The ring on held motor shafts under a load torque that swings slowly; the gears are loaded against each other before."""
    twist = HALF_GAP + RATIO * bias / STIFFNESS if bias else 0.0
    data = json.loads(ring(**{"shafts.ring.inertia": 0.5, "shafts.ring.viscous_friction": 100.0}).to_json())
    data["brakes"] = {f"hold_{name}": {"shaft": name, "torque": 1e3} for name in NAMES}
    data["shafts"]["ring"]["torque"] = {"amplitude": 250.0, "frequency": 0.05}
    data["command"] = {f"hold_{name}": 1.0 for name in NAMES}
    data["initial"] = {"twists": {"first_gear": twist, "second_gear": -twist}}
    data["simulation"] = {"duration": 30.0, "sample_interval": 5e-3}
    for gear in data["gears"].values():
        gear["mesh_damping"] = 100.0
    return lm.Scenario(**data)


def lost_motion(out: Path) -> None:
    """Angle of the ring and torques of the gears over the load torque, with and without bias."""
    bias = 0.4
    loose, tight = (lm.simulate(held(b)).sel(time=slice(5.0, 30.0)) for b in (0.0, bias))
    # Towards the load torque: both gears carry it up to twice the bias, then the one whose flank still touches.
    torque = np.linspace(-250.0, 250.0, 501)
    corner = 2.0 * RATIO * bias
    angle = np.clip(torque, -corner, corner) / (2.0 * STIFFNESS)
    angle += (torque - np.clip(torque, -corner, corner)) / STIFFNESS
    curves = (
        Curve("without bias", -loose["ring_load_torque"].values, loose["ring_angle"].values / ARCMIN, SECOND),
        Curve("bias 0.4 N·m", -tight["ring_load_torque"].values, tight["ring_angle"].values / ARCMIN, FIRST),
        Curve("closed form", torque[::25], angle[::25] / ARCMIN, POINTS),
    )
    load = -tight["ring_load_torque"].values
    gears = (
        Curve("first gear", load, tight["first_gear_output_torque"].values, FIRST),
        Curve("second gear", load, tight["second_gear_output_torque"].values, SECOND),
    )
    save(
        [
            Panel("motor shafts held", "torque on the ring [N·m]", "angle of the ring [arcmin]", curves),
            Panel(
                "bias 0.4 N·m: what each gear carries",
                "torque on the ring [N·m]",
                "torque of the gear [N·m]",
                gears[:2],
            ),
        ],
        2,
        (10.0, 3.6),
        out,
        "two-motors-lost-motion",
    )


# --- the bias that is needed ---


def needed(torque: float, forward: float, sudden: bool = False) -> tuple[float, float]:
    """(bias [N·m], acceleration [rad/s2]) at which the flank just parts, for the torque of each motor without its friction."""
    if sudden:
        acceleration = 2.0 * RATIO * torque / (RING + 2.0 * ROTOR * RATIO**2)
        return RING * acceleration / RATIO, acceleration
    bias = torque / (1.0 + 2.0 * forward * ROTOR * RATIO**2 / RING)
    return bias, 2.0 * forward * RATIO * bias / RING


def found(torque: float, losses: tuple[float, float], sudden: bool) -> tuple[float, float]:
    """The same from a study: the smallest of 161 biases with which the play never opens, and the acceleration then."""
    forward, backward = losses
    friction = 0.0 if losses == (1.0, 1.0) else FRICTION
    biases = np.linspace(0.4, 2.0, 161) * torque
    balance = biases * (1.0 - forward * backward) / (1.0 + forward * backward)  # at constant speed
    mesh = RATIO * forward * (biases + balance) / STIFFNESS
    signal: dict[str, Any] = {"ramps": [{"rise": 0.1, "duration": 80 * PERIOD, "begin": 0.05}]}
    key, duration = "ramps.0.rise", 100 * PERIOD
    if sudden:
        signal, key, duration = {"steps": [{"height": 0.1, "time": 0.05}]}, "steps.0.height", 20 * PERIOD
    study = lm.studies.Study(
        scenario=ring(
            losses,
            friction,
            **{f"command.{name}_motor": signal for name in NAMES},
            **{"initial.speeds": {"first": RATIO, "second": RATIO, "ring": 1.0}},
            **{"initial.twists": {"first_gear": HALF_GAP, "second_gear": -HALF_GAP}},
            **{"simulation.duration": 0.05 + duration, "simulation.sample_interval": 2e-4},
        ),
        design="list",
        vary=[
            {"name": "bias", "key": "command.first_motor.mean", "values": (balance + friction + biases).tolist()},
            {"key": "command.second_motor.mean", "values": (balance + friction - biases).tolist()},
            {"keys": [f"command.{name}_motor.{key}" for name in NAMES], "values": (torque - balance).tolist()},
            {"key": "initial.twists.first_gear", "values": (HALF_GAP + mesh).tolist()},
            {"key": "initial.twists.second_gear", "values": (-HALF_GAP - mesh).tolist()},
        ],
        keep={"first": "least(first_gear_twist)", "second": "largest(second_gear_twist)", "end": "final(ring_speed)"},
    )
    with tempfile.TemporaryDirectory() as directory:
        rows = read_table(lm.study(study, Path(directory) / "rows")).to_pydict()
    closed = [a > HALF_GAP and b < -HALF_GAP for a, b in zip(rows["first"], rows["second"], strict=True)]
    bias = float(biases[closed.index(True)])
    return bias, needed(torque, forward, sudden)[1]


def bias_needed(out: Path) -> None:
    """Study points on the lines of the closed forms."""
    torques = np.linspace(0.05, 0.5, 6)
    looks = (FIRST, SECOND, THIRD)
    cases = {
        "slowly, no losses": ((1.0, 1.0), False),
        f"slowly, η_f = {LOSSY[0]}": (LOSSY, False),
        "slowly, η_f = 0.7": ((0.7, 0.6), False),
    }
    curves, last = [], 0.0
    for (label, (losses, sudden)), look in zip(cases.items(), looks, strict=True):
        line = np.array([needed(t, losses[0], sudden) for t in (0.0, 0.5)])
        points = np.array([found(t, losses, sudden) for t in torques])
        curves += [
            Curve(label, line[:, 1], line[:, 0], look),
            Curve("", points[:, 1], points[:, 0], POINTS, legend="_"),
        ]
        last = max(last, line[-1, 1])
    line = np.array([needed(t, 1.0, True) for t in (0.0, 0.3)])
    points = np.array([found(t, (1.0, 1.0), True) for t in torques[:3]])
    curves += [
        Curve("at once, no losses", line[:, 1], line[:, 0], FAINT),
        Curve("studies", points[:, 1], points[:, 0], POINTS),
    ]
    save(
        [
            Panel(
                "smallest bias that keeps the play closed",
                "acceleration of the ring [rad/s²]",
                "bias [N·m]",
                tuple(curves),
            )
        ],
        1,
        (6.0, 3.8),
        out,
        "two-motors-bias",
    )


# --- too small a bias ---


def after_step(bias: float, step: float) -> lm.Scenario:
    """Both motors give `step` more, all at once, at t = 0."""
    twist = HALF_GAP + RATIO * bias / STIFFNESS
    signals = {f"command.{n}_motor": sign * bias + step for n, sign in zip(NAMES, (1.0, -1.0), strict=True)}
    return ring(
        **signals,
        **{"initial.twists": {"first_gear": twist, "second_gear": -twist}},
        **{"simulation.duration": 0.04, "simulation.sample_interval": 5e-5},
    )


def opening(out: Path) -> None:
    """Torque of the gear that holds back after a step, and the instant at which its gap opens, over the bias."""
    step = 0.2
    enough = 2.0 * needed(step, 1.0)[0]  # of a sudden torque
    curves, marks = [], []
    for share, look in ((0.3, THIRD), (0.7, SECOND), (1.1, FIRST)):
        run = lm.simulate(after_step(share * enough, step))
        curves.append(
            Curve(
                f"{share:g} of the needed bias", 1e3 * run["time"].values, run["second_gear_output_torque"].values, look
            )
        )
        if share < 1.0:
            marks.append(1e3 * math.acos(1.0 - 2.0 * share) / OMEGA)
    curves.append(Curve("closed form", marks, np.zeros(len(marks)), POINTS))
    shares = np.linspace(0.05, 0.95, 10)
    instants = [lm.switchings_of(lm.simulate(after_step(s * enough, step)))["instant"].values[0] for s in shares]
    fine = np.linspace(0.0, 1.0, 201)
    drawn = (
        Curve("closed form", fine, 1e3 * np.arccos(1.0 - 2.0 * fine) / OMEGA, FIRST),
        Curve("runs", shares, 1e3 * np.array(instants), POINTS),
    )
    save(
        [
            Panel("step of 0.2 N·m", "time [ms]", "second gear at the ring [N·m]", tuple(curves)),
            Panel("opening of the gap", "bias / needed bias [-]", "time [ms]", drawn),
        ],
        2,
        (10.0, 3.6),
        out,
        "two-motors-opening",
    )


# --- what it costs ---


def slewing(bias: float, speed: float) -> lm.Scenario:
    """At constant speed, with losses."""
    forward, backward = LOSSY
    balance = bias * (1.0 - forward * backward) / (1.0 + forward * backward)
    twist = HALF_GAP + RATIO * forward * (bias + balance) / STIFFNESS
    return ring(
        LOSSY,
        FRICTION,
        **{"command.first_motor": balance + FRICTION + bias, "command.second_motor": balance + FRICTION - bias},
        **{"initial.speeds": {"first": RATIO * speed, "second": RATIO * speed, "ring": speed}},
        **{"initial.twists": {"first_gear": twist, "second_gear": -twist}},
        **{"simulation.duration": 1.0, "simulation.sample_interval": 0.01},
    )


def cost(out: Path) -> None:
    """Loss in the gears and heat of the motors over the bias, and a preload that follows the torque."""
    speed, biases = 0.5, np.linspace(0.05, 0.5, 10)
    lost, heat = [], []
    for bias in biases:
        run = lm.simulate(slewing(float(bias), speed))
        lost.append(sum(lm.energy_of(run)[f"{name}_gear: mesh"] for name in NAMES))
        heat.append(sum(float((run[f"{name}_motor_torque"] ** 2).mean()) for name in NAMES))
    forward, backward = LOSSY
    share = (1.0 - forward * backward) / (1.0 + forward * backward)
    fine = np.linspace(0.0, 0.5, 101)
    mesh = RATIO * forward * fine * (1.0 + share)
    gears = (
        Curve("closed form", fine, ((1.0 / forward - 1.0) + (1.0 - backward)) * mesh * speed, FIRST),
        Curve("runs", biases, lost, POINTS),
    )
    motors = (
        Curve("closed form", fine, 2.0 * (fine**2 + (share * fine + FRICTION) ** 2), FIRST),
        Curve("runs", biases, heat, POINTS),
    )
    label = "bias [N·m]"
    save(
        [
            Panel("the ring turns at 0.5 rad/s", label, "loss in both meshes [W]", gears),
            Panel("heat of the motors", label, "Σ T² of both, of rated torque² [-]", motors),
        ],
        2,
        (10.0, 3.4),
        out,
        "two-motors-cost",
    )


def preloaded(constant: float, per_torque: float, torque: float = 0.2) -> lm.Scenario:
    """A slew: accelerated by `torque` at each motor, braked by it; the bias is constant + per_torque |torque|."""
    steps = ((0.5, 1.0, 1), (1.3, -1.0, 1), (2.5, -1.0, -1), (2.95, 1.0, -1))  # begin [s], way, sign of the torque then
    signals = {}
    for name, sign in zip(NAMES, (1.0, -1.0), strict=True):
        ramps = [
            {"rise": way * torque * (1.0 + sign * direction * per_torque), "duration": 0.2, "begin": begin}
            for begin, way, direction in steps
        ]
        signals[f"command.{name}_motor"] = {"mean": sign * constant, "ramps": ramps}
    return ring(LOSSY, FRICTION, **signals, **{"simulation.duration": 3.6, "simulation.sample_interval": 1e-3})


def preload(out: Path) -> None:
    """A constant bias beside one that follows the torque, over a slew."""
    panels = []
    for title, scenario in {
        "constant bias 0.22 N·m": preloaded(0.22, 0.0),
        "bias 0.05 N·m + 0.85 |T|": preloaded(0.05, 0.85),
    }.items():
        run = lm.simulate(scenario)
        t = run["time"].values
        energy = lm.energy_of(run)
        lost = sum(energy[f"{name}_gear: mesh"] for name in NAMES)
        heat = sum(float((run[f"{name}_motor_torque"] ** 2).mean()) for name in NAMES)
        curves = (
            Curve("first gear", t, run["first_gear_output_torque"].values, FIRST),
            Curve("second gear", t, run["second_gear_output_torque"].values, SECOND),
            Curve("100 × speed of the ring", t, 100.0 * run["ring_speed"].values, FAINT),
        )
        panels.append(
            Panel(
                f"{title}: {lost:.1f} J lost, Σ T² {heat:.3f}",
                "time [s]",
                "at the ring [N·m], [0.01 rad/s]",
                curves,
                x_range=(0.3, 3.6),
                y_range=(-105.0, 140.0),
            )
        )
    save(panels, 2, (10.0, 3.8), out, "two-motors-preload")


def write(out: Path) -> None:
    """All of the page's figures into a directory."""
    lost_motion(out)
    bias_needed(out)
    opening(out)
    cost(out)
    preload(out)
