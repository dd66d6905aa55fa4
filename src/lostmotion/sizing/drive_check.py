"""Does the drive fit its task? Loads, speeds, resonance, dead zone, lost motion, holding, voltage, current and heat."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from .. import _core
from ..inputs.arguments import checked
from ..model.gearbox import Gearbox
from ..model.torsion import Rigid
from ..simulation.run import simulate
from ..simulation.scenario import Scenario
from ..test_rig.rig import LOST_MOTION_LOAD, TestRig
from ..units.practical import ARCMIN, RPM
from .duty_cycle import MIN_REST, STANDSTILL, DutyCycle, duty_cycle
from .holding import holding

if TYPE_CHECKING:
    import xarray

COPPER = 0.00393  # relative rise of a winding's resistance [1/K]
REFERENCE = 25.0  # temperature that the printed resistance holds for [°C]
INERTIA_RATIO = 10.0  # beyond it a load is usually called hard to control
NEAR_RESONANCE = 1.5  # a command within this factor of a resonance excites it
POINTS = 40  # samples to a period of the fastest resonance, so that no peak is missed
SAMPLES = (2_000, 200_000)  # the fewest of a run, and the most at the finest interval

MEANS = ("average_output_torque", "average_input_speed", "motor_torque", "winding_temperature")

Verdict = Literal["ok", "warning", "unknown"]

# Each rule of the check and where it comes from.
RULES = {
    "average_output_torque": "cubic mean weighted with speed: Harmonic Drive, CSF & CSG catalogue, selection procedure",
    "peak_output_torque": "repeated peak torque: Harmonic Drive, CSF & CSG catalogue, selection procedure",
    "average_input_speed": "mean speed: Harmonic Drive, CSF & CSG catalogue, selection procedure",
    "max_input_speed": "the gearbox's data sheet",
    "max_motor_speed": "the motor's data sheet",
    "motor_torque": "root mean square: maxon, Formulae Handbook, motor selection",
    "winding_temperature": "maxon, Formulae Handbook, thermal behaviour; copper 0.39 %/K",
    "voltage": "voltage equation of the motor, u = R i + k w, without inductance",
    "current": "torque / torque constant",
    "inertia_ratio": "rule of thumb of servo manufacturers: at most 10",
    "resonance": "two-mass oscillator; a command within a factor of 1.5",
    "dead_zone": "the run, and the commands that move the load from rest",
    "lost_motion": "virtual test rig; the limit is that of the task",
    "holding": "runs with command 0, from rest and from motion",
    "loss_map": "the run, and the data of gearbox.losses",
}


@dataclass(frozen=True)
class Finding:
    """One point of the check."""

    rule: str
    """key of `RULES`"""
    what: str
    value: str
    verdict: Verdict
    remark: str = ""
    use: float | None = None
    """share of the limit that is used; above 1 it is exceeded"""

    @property
    def source(self) -> str:
        """Where the rule comes from."""
        return RULES[self.rule]

    def __str__(self) -> str:
        mark = {"ok": "ok     ", "warning": "WARNING", "unknown": "?      "}[self.verdict]
        remark = f" ({self.remark})" if self.remark else ""
        return f"{mark}  {self.what}: {self.value}{remark} [{self.source}]"


@checked
def check_drive(scenario: Scenario) -> tuple[Finding, ...]:
    """Checks a drive against its scenario.

    The scenario is run; loads, speeds, voltage, current and heat are those of that run, over the duty cycle that `task.cycle`
    says, or with the motion repeated without a pause. Limits come from `gearbox.limits`, `motor.limits` (which records of the
    catalogue bring along) and `task`. What has no limit is reported as unknown.

    Raises
    ------
    InputError
        `task.cycle` does not fit the run.
    SolverError
        As `simulate`.
    """
    result = _finely_sampled(scenario)
    cycle = duty_cycle(result, scenario.task.cycle)
    findings = [
        *_loads(scenario, result, cycle),
        *_speeds(scenario, result, cycle),
        *_motor_heat(scenario, cycle),
        _voltage(scenario, result),
        _current(scenario, result),
        _inertia(scenario),
        *_resonance(scenario),
        _dead_zone(scenario, result),
        _lost_motion(scenario),
        *_holding(scenario, result),
    ]
    if scenario.gearbox.losses.kind == "map":
        findings.append(_loss_map(result))
    return tuple(_with_sinking(f, result, cycle) if f.rule in MEANS else f for f in findings)


def _with_sinking(finding: Finding, result: xarray.Dataset, cycle: DutyCycle) -> Finding:
    """A mean, with what the load does to it where it drives the motor with command 0.

    Such a motion that goes on at the end of the run has no end of its own: the mean depends on the duration, and is not judged
    where no `task.cycle` says that all of it repeats. Elsewhere it is a part of the cycle, and is told.
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
    return replace(finding, remark="; ".join(filter(None, [finding.remark, told])))


def _sinking(result: xarray.Dataset) -> tuple[float, float]:
    """Time [s] in which the load torque drives the turning motor with command 0: of the whole run, and after the last command."""
    time, command = result["time"].values, result["command"].values
    speed = result["motor_speed"].values
    driven = result["load_torque"].values * speed < 0.0
    sinks = (command == 0.0) & (abs(speed) > STANDSTILL * abs(speed).max()) & driven
    lasting = np.diff(time) * (sinks[1:] & sinks[:-1])
    commanded = np.flatnonzero(command)
    last = int(commanded[-1]) if len(commanded) else 0
    return float(lasting.sum()), float(lasting[last:].sum())


def _loss_map(result: xarray.Dataset) -> Finding:
    if "warning" in result.attrs:
        return Finding("loss_map", "loss map", "used outside its data", "warning", result.attrs["warning"])
    return Finding("loss_map", "loss map", "used within its data", "ok")


def _finely_sampled(scenario: Scenario) -> xarray.Dataset:
    """The run with samples so close that no peak is missed; of a very long one only the beginning, since long ones end in rest."""
    table = scenario.simulation
    fastest = max((f for _, f, _ in _resonances(scenario)), default=0.0)
    fine = min(table.sample_interval, table.duration / SAMPLES[0], 1.0 / (POINTS * fastest) if fastest else math.inf)
    if table.duration <= fine * SAMPLES[1]:
        return simulate(scenario, sample_interval=fine, energy=False)
    begin = simulate(scenario, duration=fine * SAMPLES[1], sample_interval=fine, energy=False)
    whole = simulate(scenario, sample_interval=table.duration / SAMPLES[1], energy=False)
    rest = whole.isel(time=whole["time"] > begin["time"][-1])
    import xarray as xr

    return xr.concat([begin, rest], "time", combine_attrs="override").assign_attrs(whole.attrs)


def _within(
    rule: str,
    what: str,
    value: float,
    limit: float | None,
    unit: str,
    name: str,
    *,
    key: str = "",
    cycle: DutyCycle | None = None,
) -> Finding:
    """Compares a value with its limit; `key` of the scenario would give it."""
    over = "" if cycle is None else f", {cycle}"
    if limit is None:
        return Finding(rule, what, f"{value:.4g} {unit}{over}", "unknown", f"no {name} is given: {key}")
    use = value / limit
    share = f"{value:.4g} of {limit:.4g} {unit}{over}"
    remark = "" if use <= 1.0 else f"exceeds the {name} by {100.0 * (use - 1.0):.0f} %"
    return Finding(rule, what, share, "ok" if use <= 1.0 else "warning", remark, use)


# --- gearbox ---


def _loads(scenario: Scenario, result: xarray.Dataset, cycle: DutyCycle) -> list[Finding]:
    g = scenario.gearbox
    peak = float(abs(result["output_torque"]).max())
    average = g.limits.average_output_torque if g.limits else None
    name = "rated output torque" if average is None else "average output torque"
    return [
        _within(
            "average_output_torque",
            "output torque, cubic mean",
            cycle.mean_output_torque(),
            average or g.rated_output_torque,
            "N·m",
            name,
            cycle=cycle,
        ),
        _with_momentary(
            _within(
                "peak_output_torque",
                "output torque, largest",
                peak,
                g.limits.peak_output_torque if g.limits else None,
                "N·m",
                "repeated peak torque of the gearbox",
                key="gearbox.limits.peak_output_torque",
            ),
            peak,
            g.limits.momentary_output_torque if g.limits else None,
        ),
    ]


def _with_momentary(finding: Finding, torque: float, momentary: float | None) -> Finding:
    """Beyond, or without, a repeated peak torque: what the limit for emergency stops says."""
    if momentary is None or finding.verdict == "ok":
        return finding
    if torque > momentary:
        remark = f"even the momentary torque of the gearbox, {momentary:.4g} N·m, is exceeded"
        return replace(finding, verdict="warning", remark="; ".join(filter(None, [finding.remark, remark])))
    remark = f"in an emergency stop the gearbox stands {momentary:.4g} N·m"
    return replace(finding, remark="; ".join(filter(None, [finding.remark, remark])))


def _speeds(scenario: Scenario, result: xarray.Dataset, cycle: DutyCycle) -> list[Finding]:
    g, m = scenario.gearbox, scenario.motor
    average = g.limits.average_input_speed if g.limits else None
    fastest = RPM * float(abs(result["motor_speed"]).max())
    limits_of_speed = (
        ("max_input_speed", "gearbox", "max_input_speed", g.limits.max_input_speed if g.limits else None),
        ("max_motor_speed", "motor", "max_speed", m.limits.max_speed if m.limits else None),
    )
    return [
        _within(
            "average_input_speed",
            "input speed, mean",
            RPM * cycle.mean_input_speed(),
            RPM * (average or g.rated_input_speed),
            "rpm",
            "rated input speed" if average is None else "average input speed",
            cycle=cycle,
        ),
        *(
            _within(
                rule,
                f"input speed, largest, for the {part}",
                fastest,
                None if limit is None else RPM * limit,
                "rpm",
                f"largest speed of the {part}",
                key=f"{part}.limits.{key}",
            )
            for rule, part, key, limit in limits_of_speed
        ),
    ]


def _lost_motion(scenario: Scenario) -> Finding:
    g, limit = scenario.gearbox, scenario.task.max_lost_motion
    lost = 0.0 if isinstance(g.stiffness, Rigid) else TestRig(g).lost_motion()
    what = f"lost motion at ±{100.0 * LOST_MOTION_LOAD:.0f} % of rated torque"
    maximum = None if limit is None else ARCMIN * limit
    return _within(
        "lost_motion", what, ARCMIN * lost, maximum, "arcmin", "limit of the task", key="task.max_lost_motion"
    )


def _holding(scenario: Scenario, result: xarray.Dataset) -> list[Finding]:
    loads = {float(v) for v in (result["load_torque"].max(), result["load_torque"].min())} - {0.0}
    if not loads:
        return [
            Finding("holding", "holding with command 0", "no load torque acts", "ok", _static_holding(scenario.gearbox))
        ]
    return [_held(scenario, load, float(abs(result["load_speed"]).max())) for load in sorted(loads)]


def _held(scenario: Scenario, load_torque: float, speed: float) -> Finding:
    what = f"holding {load_torque:.4g} N·m with command 0"
    try:
        found = holding(scenario, load_torque, speed)
    except _core.SolverError as error:
        return Finding("holding", what, "cannot be determined", "unknown", str(error))
    if found.holds:
        value = f"the load stays at rest, and comes to rest if the power fails at {abs(found.begin):.3g} rad/s"
        return Finding("holding", what, value, "ok")
    if found.from_rest != 0.0:
        value = f"the load torque drives the load {_at(found.from_rest)}"
    else:
        value = f"at rest only: if the power fails at {abs(found.begin):.3g} rad/s, the load goes on {_at(found.from_motion)}"
    if not scenario.task.hold_without_power:
        return Finding("holding", what, value, "ok", "not required by the task")
    remedy = "it needs a brake or a motor under control; then set task.hold_without_power = false"
    return Finding("holding", what, value, "warning", f"{remedy}; {_static_holding(scenario.gearbox)}")


def _at(speed: float) -> str:
    return f"at {speed:.3g} rad/s" if math.isfinite(speed) else "ever faster"


def _static_holding(g: Gearbox) -> str:
    """What the gearbox alone holds at rest."""
    back = TestRig(g).backdriving_torque() if g.losses.kind == "map" and not isinstance(g.stiffness, Rigid) else 0.0
    if back is None:
        return "the gearbox alone holds more than three times rated torque at rest"
    return f"the gearbox alone holds {back:.4g} N·m at rest"


# --- motor ---


def _motor_heat(scenario: Scenario, cycle: DutyCycle) -> list[Finding]:
    m, limits = scenario.motor, scenario.motor.limits
    torque = cycle.rms_motor_torque()
    continuous = limits.continuous_torque if limits is not None else m.rated_torque if m.kind == "dc" else None
    name = "continuous torque of the motor"
    key = "motor.limits.continuous_torque"
    findings = [_within("motor_torque", "motor torque, rms", torque, continuous, "N·m", name, key=key, cycle=cycle)]
    if (
        limits is None
        or limits.resistance is None
        or limits.torque_constant is None
        or limits.thermal_resistance is None
        or limits.max_winding_temperature is None
    ):
        return findings
    ambient, permissible = scenario.task.ambient_temperature, limits.max_winding_temperature
    what = "winding temperature"
    # dT = R_th R(T) I², R(T) = R (1 + a (ambient + dT - 25 °C))
    cold = limits.thermal_resistance * limits.resistance * (torque / limits.torque_constant) ** 2
    if cold * COPPER >= 1.0:
        remark = "the current is far too large to last"
        return [
            *findings,
            Finding("winding_temperature", what, f"thermal runaway, {cycle}", "warning", remark, math.inf),
        ]
    rise = cold * (1.0 + COPPER * (ambient - REFERENCE)) / (1.0 - COPPER * cold)
    value = f"{ambient + rise:.0f} of {permissible:.0f} °C in the long run at {ambient:.0f} °C ambient, {cycle}"
    use = rise / (permissible - ambient) if permissible > ambient else math.inf
    remark = f"reserve {permissible - ambient - rise:.0f} K"
    verdict: Verdict = "ok" if use <= 1.0 else "warning"
    return [*findings, Finding("winding_temperature", what, value, verdict, remark, use)]


def _voltage(scenario: Scenario, result: xarray.Dataset) -> Finding:
    m, limits = scenario.motor, scenario.motor.limits
    if m.kind == "dc":
        if m.rated_voltage is None:
            return Finding("voltage", "voltage, largest", "not known", "unknown", "motor.rated_voltage is missing")
        peak = m.rated_voltage * float(abs(result["command"]).max())
        limit = m.voltage_limit or (limits.max_voltage if limits else None)
    elif limits is not None and limits.resistance is not None and limits.torque_constant is not None:
        current = result["motor_torque"] / limits.torque_constant
        emf = limits.torque_constant * result["motor_speed"]
        peak = float(abs(limits.resistance * current + emf).max())
        limit = limits.max_voltage
    else:
        missing = "motor.limits.resistance and motor.limits.torque_constant are missing"
        return Finding("voltage", "voltage, largest", "not known", "unknown", missing)
    key = "motor.voltage_limit" if m.kind == "dc" else "motor.limits.max_voltage"
    return _within("voltage", "voltage, largest", peak, limit, "V", "limit of the amplifier", key=key)


def _current(scenario: Scenario, result: xarray.Dataset) -> Finding:
    limits = scenario.motor.limits
    if limits is None or limits.torque_constant is None:
        missing = "motor.limits.torque_constant is missing"
        return Finding("current", "current, largest", "not known", "unknown", missing)
    peak = float(abs(result["motor_torque"]).max()) / limits.torque_constant
    name, key = "limit of motor and amplifier", "motor.limits.max_current"
    return _within("current", "current, largest", peak, limits.max_current, "A", name, key=key)


# --- motion ---


def _inertia(scenario: Scenario) -> Finding:
    g = scenario.gearbox
    ratio = scenario.load.inertia / (g.ratio**2 * (scenario.motor.rotor_inertia + g.inertia))
    far = ratio > INERTIA_RATIO
    remark = f"above {INERTIA_RATIO:g} the load is hard to control from the motor side" if far else ""
    return Finding(
        "inertia_ratio",
        "inertia of the load / of the motor side",
        f"{ratio:.3g}",
        "warning" if far else "ok",
        remark,
        ratio / INERTIA_RATIO,
    )


def _resonances(scenario: Scenario) -> list[tuple[str, float, float]]:
    """(segment, resonance, anti-resonance) [Hz] of the softest and the stiffest segment of the torsion curve."""
    g = scenario.gearbox
    J_1 = g.ratio**2 * (scenario.motor.rotor_inertia + g.inertia)
    slopes = [] if isinstance(g.stiffness, Rigid) else [k for k in g.stiffness.pieces()[1] if k > 0.0]
    pieces = {"softest": min(slopes, default=0.0), "stiffest": max(slopes, default=0.0)}
    return [
        (
            name,
            math.sqrt(k / J_1 + k / scenario.load.inertia) / (2.0 * math.pi),
            math.sqrt(k / scenario.load.inertia) / (2.0 * math.pi),
        )
        for name, k in pieces.items()
        if k > 0.0 and not (name == "stiffest" and len(slopes) == 1)
    ]


def _resonance(scenario: Scenario) -> list[Finding]:
    excited = {s.frequency for s in scenario.command.sines}
    if scenario.command.frequency is not None:
        excited.add(scenario.command.frequency)
    out = []
    for name, f_r, f_a in _resonances(scenario):
        near = [f for f in excited if f_a / NEAR_RESONANCE < f < f_r * NEAR_RESONANCE]
        value = f"{f_r:.4g} Hz, anti-resonance {f_a:.4g} Hz"
        remark = f"the command has {near[0]:g} Hz" if near else ""
        verdict: Verdict = "warning" if near else "ok"
        out.append(Finding("resonance", f"resonance on the {name} segment", value, verdict, remark))
    return out


def _dead_zone(scenario: Scenario, result: xarray.Dataset) -> Finding:
    against = float(result["load_torque"][0])
    forward, backward = (scenario.drive().core().smallest_command(0.0, against, s) for s in (+1, -1))
    peak = float(abs(result["command"]).max())
    value = f"the load moves above a command of {forward:.4g} and below {backward:.4g}"
    moves = bool((result["motor_speed"] != 0.0).any())
    if peak == 0.0:
        return Finding("dead_zone", "dead zone", value, "ok", "the command is 0 throughout")
    if peak <= min(forward, -backward) and not moves:
        remark = f"the command never exceeds {peak:.4g}: the load does not move"
        return Finding("dead_zone", "dead zone", value, "warning", remark)
    small = peak < 3.0 * max(forward, -backward)
    remark = f"a large part of the command, which reaches {peak:.4g}" if small else ""
    return Finding("dead_zone", "dead zone", value, "warning" if small else "ok", remark)
