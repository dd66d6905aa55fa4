"""Does the drive fit its task? Loads, speeds, resonance, dead zone, lost motion, holding, voltage, current and heat."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..inputs.argument_checks import checked
from ..model.losses import LossMap
from ..model.screw import RatedScrew
from ..model.shaft_ratio import turns
from ..simulation.runs.results import RunArrays
from ..simulation.runs.run import run
from ..simulation.scenario.one_axis import OneAxis
from ..simulation.scenario.requirements import need_no_impacts
from ..simulation.scenario.scenario import Scenario
from .axis_rules import belt_rules, missing, rack_rules, screw_rules
from .duty_cycle import MIN_REST, STANDSTILL, DutyCycle, duty_cycle
from .finding import Finding, Findings, not_judged
from .gearbox_check import input_speeds, loads, locks, loss_map
from .life import HOUR, AxialLoad, screw_life
from .motion_check import end_stop, resonances
from .motor_check import command_of_run, motor_rules
from .motor_quantities import oriented_amplitudes
from .power_off import holdings
from .rules_of_one_axis import axis_rules
from .stepper_check import speed_of_stepper, stepper_rules
from .supply import amplifier_of_a_run, bus_findings, effective_current, power_in_run

POINTS = 40  # samples to a period of the fastest resonance, so that no peak is missed
SAMPLES = (2_000, 200_000)  # the fewest of a run, and the most at the finest interval
ON_BUS = 20_000  # the fewest where the energy of braking is summed, since the power jumps with the torque, or resonances are not known
OF_LINEAR_MOTORS = "the table of a linear motor has no such limit; compare with its data sheet"

MEANS = ("average_output_torque", "average_input_speed", "motor_torque", "winding_temperature")


@checked
def check_drive(scenario: Scenario) -> Findings:
    """Check a drive or a drive train against its limits and its task.

    The scenario is run. Loads, speeds, voltage, current and heat are taken from that run, over the duty cycle of
    `task.cycle`, or with the motion repeated without a pause. Limits are `gearbox.limits` and `motor.limits` (records
    of the catalogue include theirs) and the limits of `task`. Rules without a limit are reported as unknown, and so
    are rules that do not apply to this train, with the reason.

    Parameters
    ----------
    scenario : Scenario
        The drive and its motion.

    Returns
    -------
    Findings
        One finding for each rule, with its verdict, its source and the share of the limit.

    Raises
    ------
    InputError
        `task.cycle` does not fit the run.
    SolverError
        The motion has no continuation.

    Examples
    --------
    >>> import lostmotion as lm
    >>> findings = lm.check_drive(lm.load("catalogue-robot-joint"))
    >>> findings[0].rule, findings[0].verdict
    ('average_output_torque', 'ok')
    """
    findings = _findings(scenario)
    return Findings([*findings, *_over_estimates(scenario, findings)])


def _findings(scenario: Scenario) -> list[Finding]:
    need_no_impacts(scenario, "drive check")
    axis, train = OneAxis.of(scenario), scenario.train()
    result = _finely_sampled(scenario, axis)
    several = max(len(train.gears), len(train.motors)) > 1
    findings: list[Finding] = []
    powers: dict[str, np.ndarray] = {}
    for name in train.gears:
        findings += _named(name if several else "", _gear(scenario, name, result))
    for name, screw in scenario.screws.items():
        findings += _named(name if several else "", _screw(scenario, name, screw, result))
    for name in train.motors:
        judged, powers[scenario.motor_key(name)] = _motor(scenario, name, result)
        findings += _named(name if several else "", judged)
    findings += axis_rules(scenario, axis, result)
    findings += holdings(scenario, result)
    findings += bus_findings(result, powers, scenario.task.supply, scenario.task.cycle)
    findings += _amplifier(scenario, result)
    findings += [
        end_stop(shaft, result[train.variable(shaft, "end_stop_torque")], slides=train.is_slide(shaft))
        for shaft in train.shafts
        if train.shafts[shaft].end_stops is not None
    ]
    if any(isinstance(gear.losses, LossMap) for gear in train.gears.values()):
        findings.append(loss_map(result))
    return findings


def _named(name: str, findings: list[Finding]) -> list[Finding]:
    return [replace(f, what=f"{name}: {f.what}") for f in findings] if name else findings


def _amplifier(scenario: Scenario, result: RunArrays) -> list[Finding]:
    """The rules of the amplifier of the one motor; not judged of several motors."""
    train = scenario.train()
    if scenario.task.amplifier is None:
        return []
    if len(train.motors) != 1:
        remark = f"one amplifier feeds one motor, and this train has {len(train.motors)}; check each axis on its own"
        return [not_judged("amplifier_current", remark, "amplifier")]
    ((name, motor),) = train.motors.items()
    torque, speed = result[train.variable(name, "torque")], result[train.variable(motor.shaft, "speed")]
    oriented = oriented_amplitudes(scenario, result, name)
    current = effective_current(motor, torque, speed, None if oriented is None else oriented[0])
    where = scenario.motor_key(name)
    return amplifier_of_a_run(result.time, current, motor, scenario.task, where)


def _gear(scenario: Scenario, name: str, result: RunArrays) -> list[Finding]:
    train = scenario.train()
    gear, where = train.gears[name], scenario.gear_key(name)
    torque = train.variable(name, "output_torque")
    cycle = duty_cycle(
        result,
        scenario.task.cycle,
        speed=train.variable(gear.input, "speed"),
        motor_torque=train.variable(name, "input_torque"),
        output_torque=torque,
    )
    peak = float(abs(result[torque]).max())
    findings = _of_slide(scenario, name, result) if train.is_slide(gear.output) else loads(gear, peak, cycle, where)
    if gear.rated_input_speed is not None or gear.limits is not None:
        findings += input_speeds(gear, cycle, where)
    if train.fixed_gears() == train.gears:  # else what its load drives has no verdict
        findings += locks(train, name, _load_torques(scenario, name, result))
    return [_with_sinking(scenario, f, result, cycle) if f.rule in MEANS else f for f in findings]


def _of_slide(scenario: Scenario, name: str, result: RunArrays) -> list[Finding]:
    """The rules of a rack or a belt under the force of its slide [N]. A screw has rules of its own."""
    kind = scenario.kind_of(name)
    if kind == "screw":
        return []
    drive, key = getattr(scenario, f"{kind}s")[name], scenario.key_in_file(f"{kind}s.{name}")
    train = scenario.train()
    force, speed = (
        result[train.variable(*of)] for of in ((name, "output_torque"), (train.gears[name].output, "speed"))
    )
    if kind == "belt":
        return belt_rules(force, speed, drive, key=key)
    return rack_rules(float(np.abs(force).max()), drive, key=key)


def _screw(scenario: Scenario, name: str, screw: RatedScrew, result: RunArrays) -> list[Finding]:
    """Life, static load, buckling, bending speed and ball speed of a screw, over the run, repeated without a pause."""
    train, time = scenario.train(), result.time
    force, speed = (
        result[train.variable(name, "output_torque")],
        result[train.variable(train.gears[name].output, "speed")],
    )
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
            torque = result[train.variable(shaft, "load_torque")]
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
    motor, where = train.motors[name], scenario.motor_key(name)
    torque, speed = train.variable(name, "torque"), train.variable(motor.shaft, "speed")
    if motor.kind == "stepper":  # its current does not follow its torque
        judged = [
            *speed_of_stepper(motor, float(abs(result[speed]).max()), where),
            *stepper_rules(scenario, name, result),
        ]
        return judged, np.zeros_like(result.time)
    command, T, w = (result[key] for key in (train.variable(name, "command"), torque, speed))
    command = command_of_run(motor, scenario.controllers.get(name), command, T, w)
    oriented, heating = oriented_amplitudes(scenario, result, name), None
    if motor.winding is not None and oriented is not None:  # reluctance gives torque without heat
        heating = np.maximum(np.abs(T), motor.winding.phase_values().torque_constant * np.abs(oriented[0]))
    cycle = duty_cycle(
        result, scenario.task.cycle, speed=speed, motor_torque=torque, output_torque=torque, heating=heating
    )
    slides = train.is_slide(motor.shaft)
    ambient, of_phase = scenario.task.ambient_temperature, oriented is not None
    findings = motor_rules(
        motor, cycle, ambient, command, T, w, where, slides=slides, whole=of_phase, oriented=oriented
    )
    findings = [_with_sinking(scenario, f, result, cycle) if f.rule in MEANS else f for f in findings]
    if slides:
        findings = [replace(f, remark=OF_LINEAR_MOTORS) if f.verdict == "unknown" else f for f in findings]
    return findings, power_in_run(scenario, name, result, command, torque, speed)


def _over_estimates(scenario: Scenario, findings: list[Finding]) -> list[Finding]:
    """Verdicts that hold over the whole range of estimated losses; nothing if none are estimated."""
    ends = [_known_losses(scenario, end) for end in (0, 1)]
    if scenario in ends:
        return []
    others = [{(f.rule, f.what): f for f in _findings(one)} for one in ends]
    turned = []
    for finding in findings:
        least, most = (at_end.get((finding.rule, finding.what)) for at_end in others)
        if least is None or most is None or {least.verdict, most.verdict} != {finding.verdict}:
            said = ("not judged" if f is None else f.verdict for f in (least, most))
            turned.append(f"{finding.what} ({' to '.join(said)})")
    if turned:
        value = f"not decided by them: {'; '.join(turned)}"
        remark = "from the least to the largest losses of its kind; a measured or printed efficiency decides"
        return [Finding("estimated_losses", "estimated losses", value, "unknown", remark)]
    return [
        Finding(
            "estimated_losses", "estimated losses", "all verdicts hold from the least to the largest of the kind", "ok"
        )
    ]


def _known_losses(scenario: Scenario, end: int) -> Scenario:
    """The scenario with the losses at one end of the range of each estimate."""
    parts = scenario.gears_by_key()
    known = {key: p.with_losses(p.loss_range[end]) for key, p in parts.items() if p.loss_range is not None}
    return scenario.with_gears(known) if known else scenario


def _with_sinking(scenario: Scenario, finding: Finding, result: RunArrays, cycle: DutyCycle) -> Finding:
    """A mean, with what the load does to it where it drives the motor with command 0.

    If such a motion has not ended at the end of the run, the mean depends on the duration. It is not judged then,
    unless `task.cycle` states that all of the run repeats. Elsewhere it is a part of the cycle, and is told.
    """
    sinking, at_end = _sinking(scenario, result)
    shortest = MIN_REST * cycle.duration
    if sinking <= shortest:
        return finding
    told = f"with command 0 the load drives the motor for {sinking:.3g} s of the run"
    if cycle.holding_torque is None and cycle.period is None and at_end > shortest:
        told += ", also at its end, so that this mean depends on the duration; let the run end with the move, or give task.cycle"
        if finding.verdict == "ok":
            finding = replace(finding, verdict="unknown")
    return finding.noted(told)


def _sinking(scenario: Scenario, result: RunArrays) -> tuple[float, float]:
    """Time [s] in which loads drive the turning motors with commands of 0: of the whole run, and after the last command."""
    train, time = scenario.train(), result.time
    command = np.sum([abs(result[train.variable(name, "command")]) for name in train.motors], axis=0)
    speed = np.sum([abs(result[train.variable(motor.shaft, "speed")]) for motor in train.motors.values()], axis=0)
    if not train.motors or not scenario.loads():
        return 0.0, 0.0
    first = next(iter(train.motors.values())).shaft
    power = np.zeros_like(time)
    for shaft in scenario.loads():
        ratio = turns(train, shaft, first) if len(train.motors) == 1 else None
        turned = (
            result[train.variable(shaft, "speed")] if ratio is None else ratio * result[train.variable(first, "speed")]
        )
        power += result[train.variable(shaft, "load_torque")] * turned
    sinks = (command == 0.0) & (speed > STANDSTILL * speed.max()) & (power < 0.0)
    lasting = np.diff(time) * (sinks[1:] & sinks[:-1])
    commanded = np.flatnonzero(command)
    last = int(commanded[-1]) if len(commanded) else 0
    return float(lasting.sum()), float(lasting[last:].sum())


def _finely_sampled(scenario: Scenario, axis: OneAxis | str) -> RunArrays:
    """The run with samples so close that no peak is missed; of a very long one only the beginning, since long ones end in rest."""
    table = scenario.simulation
    excited = [f for signal in scenario.signals().values() for _, f, _ in signal.sine_list()]
    swings = () if isinstance(axis, str) else resonances(scenario.train().motors[axis.motor], axis.whole, axis.load)
    fastest = max((*excited, *(f for _, f, _ in swings)), default=0.0)
    fewest = ON_BUS if scenario.task.supply is not None or isinstance(axis, str) else SAMPLES[0]
    fine = min(table.sample_interval, table.duration / fewest, 1.0 / (POINTS * fastest) if fastest else math.inf)
    if table.duration <= fine * SAMPLES[1]:
        return run(scenario.with_inputs(sample_interval=fine), energy=False)
    begin = run(scenario.with_inputs(duration=fine * SAMPLES[1], sample_interval=fine), energy=False)
    whole = run(scenario.with_inputs(sample_interval=table.duration / SAMPLES[1]), energy=False)
    rest = whole.time > begin.time[-1]
    values = {name: np.concatenate([begin[name], whole[name][rest]]) for name in whole.values}
    return replace(whole, time=np.concatenate([begin.time, whole.time[rest]]), values=values)
