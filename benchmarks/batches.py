"""Many drives at once: time, memory and error beside a plain model in NumPy and MuJoCo's two hinges."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from report import Report

import lostmotion as lm
from lostmotion import _core

STEP, COUNT, COMPARED = 1e-3, 4096, 256
RATIO, ROTOR, STIFFNESS = 50.0, 1e-4, 1e4
ANGLE, SPEED = (_core.states().index(name) for name in ("load_angle", "load_speed"))


def parameters(count: int) -> dict[str, np.ndarray]:
    generator = np.random.default_rng(1)
    ranges = {
        "gearbox.stiffness.backlash": (0.5e-3, 3e-3),
        "motor.friction_torque": (0.005, 0.03),
        "gearbox.losses.efficiency": (0.7, 0.95),
        "load.inertia": (0.3, 2.0),
    }
    return {key: generator.uniform(*of, count) for key, of in ranges.items()}


def batch(count: int, values: dict[str, np.ndarray], threads: int = 1) -> lm.SimulationBatch:
    gearbox = lm.Gearbox(
        ratio=RATIO,
        stiffness=lm.model.TorsionCurve(slopes=[STIFFNESS], backlash=1e-3),
        losses=lm.model.ConstantEfficiency(efficiency=0.8),
        rated_input_speed=400.0,
        rated_output_torque=50.0,
    )
    motor = lm.Motor(kind="torque_source", rotor_inertia=ROTOR, friction_torque=0.02)
    drive = lm.Drive(motor=motor, gearbox=gearbox, load=lm.Load(inertia=1.0, viscous_friction=2.0))
    return lm.SimulationBatch(drive, STEP, count=count, vary=values, threads=threads)


def torques(steps: int, count: int, noise: float) -> np.ndarray:
    """Torques of the motors [N·m], held over each step."""
    generator = np.random.default_rng(2)
    t = np.arange(steps)[:, None] * STEP
    amplitude, frequency, phase = (generator.uniform(*r, count) for r in ((0.05, 0.3), (0.5, 3.0), (0.0, 6.0)))
    return amplitude * np.sin(2 * np.pi * frequency * t + phase) + noise * generator.normal(size=(steps, count))


def exact(count: int, values: dict[str, np.ndarray], command: np.ndarray) -> np.ndarray:
    """Angles and speeds of the loads by `lm.Simulation`, one drive after the other."""
    out = np.empty((2, count))
    for k in range(count):
        one = lm.Simulation(drive_of(values, k), step=STEP)
        for torque in command[:, k]:
            one.advance(STEP, command=float(torque))
        out[:, k] = one["load_angle", "load_speed"]
    return out


def drive_of(values: dict[str, np.ndarray], k: int) -> lm.Drive:
    friction, efficiency = values["motor.friction_torque"][k], values["gearbox.losses.efficiency"][k]
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=ROTOR, friction_torque=float(friction)),
        gearbox=lm.Gearbox(
            ratio=RATIO,
            stiffness=lm.model.TorsionCurve(
                slopes=[STIFFNESS], backlash=float(values["gearbox.stiffness.backlash"][k])
            ),
            losses=lm.model.ConstantEfficiency(efficiency=float(efficiency)),
            rated_input_speed=400.0,
            rated_output_torque=50.0,
        ),
        load=lm.Load(inertia=float(values["load.inertia"][k]), viscous_friction=2.0),
    )


class ByHand:
    """Semi-implicit steps in NumPy; the sign of the speed is a hyperbolic tangent, as it is usually written."""

    def __init__(self, count: int, values: dict[str, np.ndarray], substeps: int, width: float) -> None:
        self.half = 0.5 * values["gearbox.stiffness.backlash"]
        self.friction = values["motor.friction_torque"]
        self.efficiency, self.inertia = values["gearbox.losses.efficiency"], values["load.inertia"]
        self.h, self.substeps, self.width = STEP / substeps, substeps, width
        self.motor, self.load, self.twist, self.angle = np.zeros((4, count))

    def step(self, torque: np.ndarray) -> None:
        for _ in range(self.substeps):
            mesh = STIFFNESS * (self.twist - np.clip(self.twist, -self.half, self.half))
            friction = self.friction * np.tanh(self.motor / self.width)
            self.motor += self.h * (torque - friction - mesh / RATIO / self.efficiency) / ROTOR
            self.load += self.h * (mesh - 2.0 * self.load) / self.inertia
            self.twist += self.h * (self.motor / RATIO - self.load)
            self.angle += self.h * self.load


TWO_HINGES = """
<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody>
  <body><joint name="rotor" type="hinge" axis="0 0 1" armature="{armature}" frictionloss="{friction}"/>
    <inertial pos="0 0 0" mass="1e-4" diaginertia="1e-7 1e-7 1e-7"/>
    <body><joint name="play" type="hinge" axis="0 0 1" limited="true" range="{low} {high}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/></body></body>
</worldbody></mujoco>"""


def two_hinges(values: dict[str, np.ndarray], command: np.ndarray, k: int) -> tuple[float, float]:
    """Angle of the load [rad], and the time of a step [s]. The efficiency has no place in it but in the torque."""
    half = float(np.degrees(0.5 * values["gearbox.stiffness.backlash"][k]))
    efficiency, inertia = (float(values[key][k]) for key in ("gearbox.losses.efficiency", "load.inertia"))
    text = TWO_HINGES.format(
        step=STEP,
        armature=ROTOR * RATIO**2,
        friction=float(values["motor.friction_torque"][k]) * RATIO,
        low=-half,
        high=half,
        inertia=inertia / efficiency,
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    begin = time.process_time()
    for torque in command[:, k]:
        data.qfrc_applied[:] = torque * RATIO, -2.0 * (data.qvel[0] + data.qvel[1]) / efficiency
        data.qfrc_applied[0] += data.qfrc_applied[1]
        mujoco.mj_step(model, data)
    return float(data.qpos[0] + data.qpos[1]), (time.process_time() - begin) / len(command)


def step_time(step: Callable[[np.ndarray], Any], command: np.ndarray) -> float:
    """Processor time [us] of a step of one drive: the best of five parts."""
    times = []
    for part in np.array_split(command, 5):
        begin = time.process_time()
        for torque in part:
            step(torque)
        times.append((time.process_time() - begin) / part.size)
    return 1e6 * min(times)


def under_controllers() -> list[str]:
    """The row of drives whose controllers move them to targets of their own within 1 s."""
    axis = lm.load("position-axis")
    assert axis.controller is not None
    generator = np.random.default_rng(3)
    targets, inertias = generator.uniform(-0.02, 0.02, COMPARED), generator.uniform(0.6, 1.4, COMPARED)
    drives = [
        axis.drive().model_copy(update={"load": lm.Load(inertia=axis.load.inertia * float(i), friction_torque=0.2)})
        for i in inertias
    ]
    many = lm.SimulationBatch(drives, STEP, controllers=axis.controller, threads=1)
    spent = step_time(many.step, np.tile(targets, (1000, 1)))
    errors = np.zeros(2)
    for k, (drive, target) in enumerate(zip(drives, targets, strict=True)):
        hold = axis.controller.model_copy(update={"reference": lm.PositionReference(mean=float(target))})
        alone = lm.Simulation(lm.Scenario.of_any(drive).with_axes({"motor": hold}), step=STEP)
        for _ in range(1000):
            alone.advance(STEP)
        found = np.array([many[name][k] - alone[name] for name in ("load_angle", "load_speed")])
        errors = np.maximum(errors, np.abs(found))
    shown = [f"{errors[0]:.1e} rad", f"{errors[1]:.1e} rad/s"]
    memory = f"{many.memory / COMPARED / 1000:.1f} kB"
    return ["lm.SimulationBatch, position loops of 8 kHz", f"{1 / spent:.2f}", *shown, memory, f"{COMPARED} drives"]


USUAL = 512  # drives
STEPS = (1e-3, 2e-3, 5e-3)  # [s]


def random_commands(report: Report) -> None:
    """Rates under commands that are drawn anew for each step, as those of a policy that explores."""
    report.add(
        "",
        f"{USUAL} drives under commands of uniform distribution up to an amplitude, drawn anew for each drive and step: thousands of steps per second "
        "of processor time on one core, best of five parts after 100 steps, and switchings of a drive in a step. Own parameters: inertia and friction within 20 %.",
        "",
    )
    rows = []
    for name in ("catalogue-robot-joint", "paper-2dof-nl-small"):
        for own in (False, True):
            rows += [[name, "own" if own else "equal", f"{a:g}", *random_rates(name, a, own)] for a in (0.05, 0.3, 1.0)]
    steps = [f"{1e3 * step:g} ms" for step in STEPS]
    head = [f"{word} {step}" for step in steps for word in ("k steps/s,", "switchings,")]
    report.table(["drive", "parameters", "amplitude", *head], rows)


def random_rates(name: str, amplitude: float, own: bool) -> list[str]:
    """Rate and switchings for each length of the steps."""
    drive, generator, cells = lm.load(name).drive(), np.random.default_rng(4), []
    spread = generator.uniform(0.8, 1.2, (2, USUAL))
    vary = {
        "load.inertia": drive.load.inertia * spread[0],
        "motor.friction_torque": drive.motor.friction_torque * spread[1],
    }
    for step in STEPS:
        many = lm.SimulationBatch(drive, step, count=USUAL, vary=vary if own else {}, threads=1)
        for command in generator.uniform(-amplitude, amplitude, (100, USUAL)):
            many.step(command)
        before = many.counts
        spent = step_time(many.step, generator.uniform(-amplitude, amplitude, (50, USUAL)))
        changes = {key: many.counts[key] - before[key] for key in ("steps", "switchings")}
        cells += [f"{1e3 / spent:.0f}", f"{changes['switchings'] / changes['steps']:.1f}"]
    return cells


def section(report: Report) -> None:
    report.section(
        "Drive batches",
        f"{COUNT} drives with a gap, friction and an efficiency of their own, torque sources, 1 ms, on one core (processor time). Errors: after 1 s, of the load, largest of {COMPARED} "
        "drives, against `lm.Simulation`. By hand: semi-implicit steps in NumPy. MuJoCo: the gap as a second hinge with a range; errors are those of 16 drives.",
    )
    values = parameters(COUNT)
    rows = []
    few = {key: v[:COMPARED] for key, v in values.items()}
    command = torques(1000, COMPARED, 0.0)
    reference = exact(COMPARED, few, command)

    def errors(angle: np.ndarray, speed: np.ndarray | None = None) -> list[str]:
        n = len(angle)
        found = [f"{np.abs(angle - reference[0, :n]).max():.1e} rad"]
        return [*found, "" if speed is None else f"{np.abs(speed - reference[1, :n]).max():.1e} rad/s"]

    for name, noise in (("smooth torques", 0.0), ("torques with noise of 0.02 N m", 0.02)):
        many = batch(COUNT, values)
        given = torques(1300, COUNT, noise)
        for torque in given[:300]:
            many.step(torque)
        before = many.counts
        spent = step_time(many.step, given[300:])
        events = (many.counts["switchings"] - before["switchings"]) / (many.counts["steps"] - before["steps"])
        general = (many.counts["general"] - before["general"]) / (many.counts["steps"] - before["steps"])
        shown = ["", ""]
        if noise == 0.0:
            compared = batch(COMPARED, few)
            for torque in command:
                compared.step(torque)
            shown = errors(compared["load_angle"], compared["load_speed"])
        rows.append(
            [
                f"lm.SimulationBatch, {name}",
                f"{1 / spent:.1f}",
                *shown,
                f"{many.memory / COUNT / 1000:.1f} kB",
                f"{100 * events:.1f} % with switchings, {100 * general:.2g} % by the general solver",
            ]
        )
    for substeps, width in ((1, 0.5), (10, 0.05)):  # a narrower one needs shorter steps
        with np.errstate(all="ignore"):
            hand, timed = (ByHand(n, v, substeps, width) for n, v in ((COMPARED, few), (COUNT, values)))
            for torque in command:
                hand.step(torque)
            spent = step_time(timed.step, torques(100, COUNT, 0.0))
        rows.append(
            [
                f"by hand, {substeps} to a step, friction over {width:g} rad/s",
                f"{1 / spent:.1f}",
                *errors(hand.angle, hand.load),
                "",
                "",
            ]
        )
    rows.append(under_controllers())
    pairs = [two_hinges(few, command, k) for k in range(16)]
    rows.append(
        [
            "two hinges of MuJoCo",
            f"{1e-6 / np.median([t for _, t in pairs]):.1f}",
            *errors(np.array([a for a, _ in pairs])),
            "",
            "steps called from Python",
        ]
    )
    report.table(["", "M steps/s", "error of the angle", "error of the speed", "memory of a drive", ""], rows)
    random_commands(report)
    threads = os.cpu_count() or 1
    shared = batch(COUNT, values, threads)
    given = torques(300, COUNT, 0.0)
    begin = time.process_time()
    for torque in given:
        shared.step(torque)
    spent = (time.process_time() - begin) / 300
    report.add(
        "",
        f"With {threads} threads, first steps included, a step of all {COUNT} drives takes {1e3 * spent:.1f} ms of processor time.",
        "",
    )


if __name__ == "__main__":
    made = Report()
    section(made)
    print(made.text())
