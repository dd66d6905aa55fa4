"""The check of a drive train: loads and speeds of its gears, heat and current of its motors, self-locking."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..model.linear import RatedScrew
from ..model.losses import ConstantEfficiency, LossMap
from ..simulation.needs import need_no_impacts
from ..simulation.results import RunArrays
from ..simulation.run import run
from ..simulation.scenario import Scenario
from .axis_rules import HOUR, AxialLoad, missing, screw_life, screw_rules
from .duty_cycle import duty_cycle
from .finding import Finding
from .gearbox_check import input_speeds, loads, locks, loss_map
from .motor_check import command_of_run, current, heat, largest_speed, peak_torque, voltage
from .motor_run import oriented_amplitudes
from .supply import amplifier_of_a_run, bus_findings, power_in_run
from .train_axis import axis_rules

SAMPLES, MOST = 20_000, 200_000  # of a run
POINTS = 40  # samples to a period of the fastest sine that acts


def check_train(scenario: Scenario) -> tuple[Finding, ...]:
    """Check a train as `check_drive` does.

    Raises
    ------
    SolverError
        As `simulate`.
    """
    need_no_impacts(scenario, "drive check")
    table = scenario.simulation
    sines = (f for signal in scenario.signals().values() for _, f, _ in signal.sine_list())
    finest = 1.0 / (POINTS * max(sines, default=POINTS / table.duration))
    interval = min(table.sample_interval, table.duration / SAMPLES, max(finest, table.duration / MOST))
    result = run(scenario.replace(**{"simulation.sample_interval": interval}), energy=False)
    train = scenario.train()
    findings = [f for name in train.gears for f in _gear(scenario, name, result)]
    for name, screw in scenario.screws.items():
        findings += _named(name, _screw(scenario, name, screw, result))
    powers = {}
    for name in train.motors:
        judged, powers[scenario.key_in_file(scenario.key_of("motors", name))] = _motor(scenario, name, result)
        findings += judged
    findings += bus_findings(result, powers, scenario.task.supply, scenario.task.cycle)
    findings += _amplifier(scenario, result)
    if any(isinstance(g.losses, LossMap) for g in train.gears.values()):
        findings.append(loss_map(result))
    return (*findings, *axis_rules(scenario, result))


def _amplifier(scenario: Scenario, result: RunArrays) -> list[Finding]:
    """The rules of the amplifier of the one motor; not judged of several motors."""
    train = scenario.train()
    if scenario.task.amplifier is None:
        return []
    if len(train.motors) != 1:
        remark = f"one amplifier feeds one motor, and this train has {len(train.motors)}; check each axis on its own"
        return [Finding("amplifier_current", "amplifier", "not judged", "unknown", remark)]
    ((name, motor),) = train.motors.items()
    torque, speed = result[train.motor_torque_of(name)], result[f"{motor.shaft}_speed"]
    where = scenario.key_in_file(scenario.key_of("motors", name))
    return amplifier_of_a_run(result, motor, torque, speed, scenario.task, where)


def _named(name: str, findings: list[Finding]) -> list[Finding]:
    return [replace(f, what=f"{name}: {f.what}") for f in findings]


def _gear(scenario: Scenario, name: str, result: RunArrays) -> list[Finding]:
    train = scenario.train()
    gear, where = train.gears[name], scenario.key_in_file(f"{scenario.kind_of(name)}s.{name}")
    torque = train.output_torque_of(name)
    cycle = duty_cycle(
        result,
        scenario.task.cycle,
        speed=f"{gear.input}_speed",
        motor_torque=train.input_torque_of(name),
        output_torque=torque,
    )
    peak = float(abs(result[torque]).max())
    findings = _force(scenario.kind_of(name), peak) if train.is_slide(gear.output) else loads(gear, peak, cycle, where)
    if gear.rated_input_speed is not None or gear.limits is not None:
        findings += input_speeds(gear, cycle, where)
    findings = _named(name, findings)
    if train.fixed_gears() != train.gears:
        return findings  # what its load drives then has no verdict
    if not isinstance(gear.losses, ConstantEfficiency) and (torques := _load_torques(scenario, name, result)):
        findings += locks(train, name, torques)
    return findings


def _force(kind: str, peak: float) -> list[Finding]:
    """Largest force of a rack or a belt, whose ratings no table holds. A screw has rules of its own."""
    remark = f"a {kind} has no rated force here; compare with its data sheet"
    what = "output force, largest"
    return [] if kind == "screw" else [Finding("peak_output_torque", what, f"{peak:.4g} N", "unknown", remark)]


def _screw(scenario: Scenario, name: str, screw: RatedScrew, result: RunArrays) -> list[Finding]:
    """Life, static load, buckling, bending speed and ball speed of a screw, over the run, repeated without a pause."""
    train, time = scenario.train(), result.time
    force, speed = result[train.output_torque_of(name)], result[f"{train.gears[name].output}_speed"]
    load = AxialLoad(time, speed, force, scenario.task.cycle or float(time[-1] - time[0]))
    life = screw_life(load, screw)
    where = scenario.key_in_file(f"screws.{name}")
    findings = screw_rules(load, screw, None, key=where)
    if life is None:
        return [missing("screw_life", "life of the screw, L10h", f"{where}.dynamic_capacity"), *findings]
    value = "without end" if math.isinf(life) else f"{life / HOUR:.4g} h"
    remark = "no wanted life is given; a task has task.life"
    return [Finding("screw_life", "life of the screw, L10h", value, "unknown", remark), *findings]


def _load_torques(scenario: Scenario, name: str, result: RunArrays) -> list[float]:
    """The largest and the least load torque at the output of a gear, from the shafts behind it through their ratios [N·m]; its
    rated torque where there are none."""
    train = scenario.train()
    gear, share = train.gears[name], 1.0
    shaft, found = gear.output, list[float]()
    while not found:
        if shaft in scenario.loads():
            torque = result[train.load_torque_of(shaft)]
            found = [share * t for t in sorted({float(torque.max()), float(torque.min())} - {0.0})]
        behind = next((g for g in train.gears.values() if g.input == shaft), None)
        if behind is None:
            break
        shaft, share = behind.output, share / behind.ratio
    if found or gear.rated_output_torque is None:
        return found
    return [gear.rated_output_torque]


def _motor(scenario: Scenario, name: str, result: RunArrays) -> tuple[list[Finding], np.ndarray]:
    """Findings, and the power that it takes [W]."""
    train = scenario.train()
    motor, key = train.motors[name], scenario.key_of("motors", name)
    where = scenario.key_in_file(key)
    torque, speed = train.motor_torque_of(name), f"{motor.shaft}_speed"
    cycle = duty_cycle(result, scenario.task.cycle, speed=speed, motor_torque=torque, output_torque=torque)
    command, T, w = (result[key] for key in (f"{name}_command", torque, speed))
    command = command_of_run(motor, scenario.controllers.get(name), command, T, w)
    oriented = oriented_amplitudes(result, key)
    slides = train.is_slide(motor.shaft)
    findings = [
        largest_speed(motor, float(abs(w).max()), where, slides=slides),
        *peak_torque(motor, T, where, slides=slides),
        *heat(motor, cycle, scenario.task.ambient_temperature, where, slides=slides),
        voltage(motor, command, T, w, where, oriented=None if oriented is None else oriented[1]),
        current(motor, T, where),
    ]
    return _named(name, findings), power_in_run(motor, result, command, torque, speed, key)
