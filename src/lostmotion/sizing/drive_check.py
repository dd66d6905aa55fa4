"""Does the drive fit its task? Loads, speeds, resonance, dead zone, lost motion, holding, voltage, current and heat."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..inputs.arguments import checked
from ..simulation.results import RunArrays
from ..simulation.run import run
from ..simulation.scenario import Scenario
from .axis_rules import brake_of_a_run
from .duty_cycle import MIN_REST, STANDSTILL, DutyCycle, duty_cycle
from .finding import Finding, Findings
from .gearbox_check import input_speeds, loads, locks, loss_map, lost_motion
from .motion_check import dead_zone, holdings, inertia, load_torques, resonance, resonances
from .motor_check import command_of_run, current, heat, largest_speed, peak_torque, voltage
from .motor_run import oriented_amplitudes
from .supply import amplifier_of_a_run, bus_findings, power_in_run
from .train_check import check_train

POINTS = 40  # samples to a period of the fastest resonance, so that no peak is missed
SAMPLES = (2_000, 200_000)  # the fewest of a run, and the most at the finest interval
ON_BUS = 20_000  # the fewest where the energy of braking is summed, since the power jumps with the torque

MEANS = ("average_output_torque", "average_input_speed", "motor_torque", "winding_temperature")


@checked
def check_drive(scenario: Scenario) -> Findings:
    """Check a drive or a drive train against its limits and its task.

    The scenario is run. Loads, speeds, voltage, current and heat are those of that run, over the duty cycle of `task.cycle`, or with
    the motion repeated without a pause. Limits are `gearbox.limits` and `motor.limits` (records of the catalogue include theirs) and
    those of `task`. Rules without a limit are reported as unknown, and so are those that are not judged in a train.

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
    if not scenario.is_drive:
        return list(check_train(scenario))
    result = _finely_sampled(scenario)
    cycle = duty_cycle(result, scenario.task.cycle)
    g, m, task = scenario.gearbox, scenario.motor, scenario.task
    command, torque, speed = (result[name] for name in ("command", "motor_torque", "motor_speed"))
    command = command_of_run(m, scenario.controller, command, torque, speed)
    oriented = oriented_amplitudes(result, "motor")
    findings = [
        *loads(g, float(abs(result["output_torque"]).max()), cycle),
        *input_speeds(g, cycle),
        largest_speed(m, float(abs(speed).max())),
        *peak_torque(m, torque),
        *heat(m, cycle, task.ambient_temperature),
        voltage(m, command, torque, speed, oriented=None if oriented is None else oriented[1]),
        current(m, torque),
        inertia(scenario),
        *resonance(m, g, scenario.load.inertia, scenario.command),
        dead_zone(scenario, result),
        lost_motion(g, task.max_lost_motion),
        *holdings(scenario, result),
        *locks(scenario.drive().train(), "gearbox", load_torques(result) or [g.rated_output_torque]),
    ]
    powers = {"motor": power_in_run(m, result, command, "motor_torque", "motor_speed", "motor")}
    findings += bus_findings(result, powers, task.supply, task.cycle)
    findings += _accessories(scenario, result, torque, speed)
    if g.losses.kind == "map":
        findings.append(loss_map(result))
    return [_with_sinking(f, result, cycle) if f.rule in MEANS else f for f in findings]


def _accessories(scenario: Scenario, result: RunArrays, torque: np.ndarray, speed: np.ndarray) -> list[Finding]:
    """The rules of the holding brake and of the amplifier, where the task has them."""
    task, found = scenario.task, list[Finding]()
    if task.brake is not None:
        loads = load_torques(result)
        found.append(brake_of_a_run(task.brake, max(map(abs, loads), default=0.0) / abs(scenario.gearbox.ratio)))
    if task.amplifier is not None:
        found += amplifier_of_a_run(result, scenario.motor, torque, speed, task)
    return found


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
    """With the losses at one end of the range of each estimate."""
    parts = scenario.gears_by_key()
    known = {key: p.with_losses(p.loss_range[end]) for key, p in parts.items() if p.loss_range is not None}
    return scenario.with_gears(known) if known else scenario


def _with_sinking(finding: Finding, result: RunArrays, cycle: DutyCycle) -> Finding:
    """A mean, with what the load does to it where it drives the motor with command 0.

    If such a motion has not ended at the end of the run, the mean depends on the duration. It is not judged then,
    unless `task.cycle` states that all of the run repeats. Elsewhere it is a part of the cycle, and is told.
    """
    sinking, at_end = _sinking(result)
    shortest = MIN_REST * cycle.duration
    if sinking <= shortest:
        return finding
    told = f"with command 0 the load drives the motor for {sinking:.3g} s of the run"
    if cycle.holding_torque is None and cycle.period is None and at_end > shortest:
        told += ", also at its end, so that this mean depends on the duration; let the run end with the move, or give task.cycle"
        if finding.verdict == "ok":
            finding = replace(finding, verdict="unknown")
    return finding.noted(told)


def _sinking(result: RunArrays) -> tuple[float, float]:
    """Time [s] in which the load torque drives the turning motor with command 0: of the whole run, and after the last command."""
    time, command = result["time"], result["command"]
    speed = result["motor_speed"]
    driven = result["load_torque"] * speed < 0.0
    sinks = (command == 0.0) & (abs(speed) > STANDSTILL * abs(speed).max()) & driven
    lasting = np.diff(time) * (sinks[1:] & sinks[:-1])
    commanded = np.flatnonzero(command)
    last = int(commanded[-1]) if len(commanded) else 0
    return float(lasting.sum()), float(lasting[last:].sum())


def _finely_sampled(scenario: Scenario) -> RunArrays:
    """The run with samples so close that no peak is missed; of a very long one only the beginning, since long ones end in rest."""
    table = scenario.simulation
    parts = scenario.motor, scenario.gearbox, scenario.load.inertia
    excited = [f for signal in scenario.signals().values() for _, f, _ in signal.sine_list()]
    fastest = max((*excited, *(f for _, f, _ in resonances(*parts))), default=0.0)
    fewest = SAMPLES[0] if scenario.task.supply is None else ON_BUS
    fine = min(table.sample_interval, table.duration / fewest, 1.0 / (POINTS * fastest) if fastest else math.inf)
    if table.duration <= fine * SAMPLES[1]:
        return run(scenario.with_inputs(sample_interval=fine), energy=False)
    begin = run(scenario.with_inputs(duration=fine * SAMPLES[1], sample_interval=fine), energy=False)
    whole = run(scenario.with_inputs(sample_interval=table.duration / SAMPLES[1]), energy=False)
    rest = whole.time > begin.time[-1]
    values = {name: np.concatenate([begin[name], whole[name][rest]]) for name in whole.values}
    return replace(whole, time=np.concatenate([begin.time, whole.time[rest]]), values=values)
