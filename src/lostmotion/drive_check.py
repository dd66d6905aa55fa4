"""Does the drive fit its task? Loads, speeds, resonance, dead zone, lost motion, holding and heat."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from .parts import Gearbox, Rigid
from .run import simulate
from .scenario import Scenario
from .test_rig import LOST_MOTION_LOAD, TestRig

if TYPE_CHECKING:
    import xarray

AMBIENT = 25.0  # [°C]
COPPER = 0.00393  # relative rise of a winding's resistance [1/K]
INERTIA_RATIO = 10.0  # beyond it a load is usually called hard to control
NEAR_RESONANCE = 1.5  # a command within this factor of a resonance excites it

Verdict = Literal["ok", "warning", "unknown"]
ARCMIN = 10800.0 / math.pi


@dataclass(frozen=True)
class Finding:
    """One point of the check."""

    what: str
    value: str
    verdict: Verdict
    remark: str = ""

    def __str__(self) -> str:
        mark = {"ok": "ok     ", "warning": "WARNING", "unknown": "?      "}[self.verdict]
        return f"{mark}  {self.what}: {self.value}" + (f" ({self.remark})" if self.remark else "")


def check_drive(scenario: Scenario) -> tuple[Finding, ...]:
    """Checks a drive against its scenario.

    The scenario is run once; loads, speeds and heat are those of that run. Limits come from `gearbox.limits` and
    `motor.limits`, which records of the catalogue bring along.

    Raises
    ------
    SolverError
        As `simulate`.
    """
    result = simulate(scenario)
    findings = [
        *_loads(scenario, result),
        *_speeds(scenario, result),
        _inertia(scenario),
        *_resonance(scenario),
        _dead_zone(scenario, result),
        *_gearbox(scenario.gearbox),
        _heat(scenario, result),
    ]
    if "warning" in result.attrs:
        findings.append(Finding("loss map", "used outside its data", "warning", result.attrs["warning"]))
    return tuple(findings)


def _within(what: str, value: float, limit: float | None, unit: str, name: str) -> Finding:
    if limit is None:
        return Finding(what, f"{value:.4g} {unit}", "unknown", f"the gearbox or motor names no {name}")
    share = f"{value:.4g} of {limit:.4g} {unit}"
    remark = "" if value <= limit else f"exceeds the {name} by {100.0 * (value / limit - 1.0):.0f} %"
    return Finding(what, share, "ok" if value <= limit else "warning", remark)


def _rms(values: xarray.DataArray) -> float:
    return float(np.sqrt((values**2).mean()))


def _loads(scenario: Scenario, result: xarray.Dataset) -> list[Finding]:
    g, torque = scenario.gearbox, result["output_torque"]
    limits = g.limits
    return [
        _within("output torque, rms", _rms(torque), g.rated_output_torque, "N·m", "rated output torque"),
        _within(
            "output torque, largest",
            float(abs(torque).max()),
            limits.peak_output_torque if limits else None,
            "N·m",
            "repeated peak torque",
        ),
    ]


def _speeds(scenario: Scenario, result: xarray.Dataset) -> list[Finding]:
    rpm = 30.0 / math.pi
    fastest = float(abs(result["motor_speed"]).max())
    limits = (
        ("gearbox", scenario.gearbox.limits.max_input_speed if scenario.gearbox.limits else None),
        ("motor", scenario.motor.limits.max_speed if scenario.motor.limits else None),
    )
    return [
        _within(
            f"input speed, largest, for the {part}",
            rpm * fastest,
            None if limit is None else rpm * limit,
            "rpm",
            f"largest speed of the {part}",
        )
        for part, limit in limits
    ]


def _inertia(scenario: Scenario) -> Finding:
    g = scenario.gearbox
    ratio = scenario.load.inertia / (g.ratio**2 * (scenario.motor.rotor_inertia + g.inertia))
    far = ratio > INERTIA_RATIO
    remark = f"above {INERTIA_RATIO:g} the load is hard to control from the motor side" if far else ""
    return Finding("inertia of the load / of the motor side", f"{ratio:.3g}", "warning" if far else "ok", remark)


def _resonance(scenario: Scenario) -> list[Finding]:
    g = scenario.gearbox
    J_1 = g.ratio**2 * (scenario.motor.rotor_inertia + g.inertia)
    excited = {s.frequency for s in scenario.command.sines}
    if scenario.command.frequency is not None:
        excited.add(scenario.command.frequency)
    out = []
    slopes = [] if isinstance(g.stiffness, Rigid) else [k for k in g.stiffness.pieces()[1] if k > 0.0]
    for name, k in (("softest", min(slopes, default=0.0)), ("stiffest", max(slopes, default=0.0))):
        if k == 0.0 or (name == "stiffest" and len(slopes) == 1):
            continue
        f_r = math.sqrt(k / J_1 + k / scenario.load.inertia) / (2.0 * math.pi)
        f_a = math.sqrt(k / scenario.load.inertia) / (2.0 * math.pi)
        near = [f for f in excited if f_a / NEAR_RESONANCE < f < f_r * NEAR_RESONANCE]
        value = f"{f_r:.4g} Hz, anti-resonance {f_a:.4g} Hz"
        remark = f"the command has {near[0]:g} Hz" if near else ""
        out.append(Finding(f"resonance on the {name} piece", value, "warning" if near else "ok", remark))
    return out


def _dead_zone(scenario: Scenario, result: xarray.Dataset) -> Finding:
    against = float(result["load_torque"][0])
    forward, backward = (scenario.drive().core().smallest_command(0.0, against, s) for s in (+1, -1))
    largest = float(abs(result["command"]).max())
    value = f"the load moves above a command of {forward:.4g} and below {backward:.4g}"
    moves = bool((result["motor_speed"] != 0.0).any())
    if largest == 0.0:  # the load drives
        return Finding("dead zone", value, "ok")
    if largest <= min(forward, -backward) and not moves:
        return Finding(
            "dead zone", value, "warning", f"the command never exceeds {largest:.4g}: the load does not move"
        )
    small = largest < 3.0 * max(forward, -backward)
    remark = f"a large part of the command, which reaches {largest:.4g}" if small else ""
    return Finding("dead zone", value, "warning" if small else "ok", remark)


def _gearbox(g: Gearbox) -> list[Finding]:
    if isinstance(g.stiffness, Rigid):
        return [Finding("lost motion", "none: the gearbox is rigid", "ok")]
    rig = TestRig(g)
    lost = rig.lost_motion()
    back = rig.backdriving_torque() if g.losses.kind == "map" else 0.0
    if back is None:
        holds = "self-locking up to three times rated torque, at rest and without vibration"
    elif back == 0.0:
        holds = "back-drivable without resistance of the gearbox"
    else:
        holds = f"holds {back:.4g} N·m at the output without power, then is driven back"
    share = f"{100.0 * LOST_MOTION_LOAD:.0f} %"
    return [
        Finding(f"lost motion at ±{share} of rated torque", f"{ARCMIN * lost:.3g} arcmin", "ok"),
        Finding("holding", holds, "ok", "the friction of the motor comes on top"),
    ]


def _heat(scenario: Scenario, result: xarray.Dataset) -> Finding:
    m = scenario.motor
    torque = _rms(result["motor_torque"])
    limits = m.limits
    if (
        limits is None
        or limits.resistance is None
        or limits.torque_constant is None
        or limits.thermal_resistance is None
        or limits.max_winding_temperature is None
    ):
        limit = limits.continuous_torque if limits is not None else m.rated_torque if m.kind == "dc" else None
        return _within("motor torque, rms", torque, limit, "N·m", "continuous torque")
    cold = limits.thermal_resistance * limits.resistance * (torque / limits.torque_constant) ** 2
    if cold * COPPER >= 1.0:
        return Finding("winding temperature", "thermal runaway", "warning", "the current is far too large to last")
    hot = AMBIENT + cold / (1.0 - COPPER * cold)
    reserve = limits.max_winding_temperature - hot
    value = f"{hot:.0f} °C of {limits.max_winding_temperature:.0f} °C in the long run, at {AMBIENT:.0f} °C outside"
    return Finding("winding temperature", value, "ok" if reserve >= 0.0 else "warning", f"reserve {reserve:.0f} K")
