"""Findings of a check, and the rules behind them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, Self, get_args

from ..errors import InputError
from ..inputs.refusal_messages import shown
from ..units.practical import ROUNDING, counted, excess, told_apart
from ..verdict import Point, Verdict
from .duty_cycle import DutyCycle

Judgement = Literal["ok", "caution", "warning", "unknown"]
"""Within the limit, beyond a rule of thumb, beyond a stated limit, or not judged."""

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
    "inertia_ratio": "the motor's data sheet, or the rule of thumb of servo manufacturers: at most 10",
    "resonance": "two-mass oscillator; a command within a factor of 1.5",
    "dead_zone": "the run, and the commands that move the load from rest",
    "lost_motion": "virtual test rig; the limit is task.max_lost_motion",
    "holding": "runs with command 0, from rest and from motion",
    "self_locking": "linear regime of the steady motion under the load: docs/self-locking.md",
    "motor_peak_torque": "the motor's data sheet",
    "estimated_losses": "the same check with the least and the largest losses of gearboxes of the kind",
    "end_stop": "the run: contact of a shaft or a slide with the end of its travel",
    "loss_map": "the run, and the data of gearbox.losses",
    "lost_steps": "the run: a rotor slips where it is two full steps off its field",
    "stepper_torque": "torque of the run with the pull-out torque of the two-phase circuit; 1.5 times it is a rule of thumb",
    "step_resonance": "sqrt(n T_H/J)/(2 pi), with the full steps of the run",
}

WITHOUT_SHARE = ("resonance", "dead_zone", "holding", "loss_map", "end_stop")  # rules that compare with no limit

# Rules that only tasks have.
TASK_RULES = {
    "gearbox_life": "L10h from the rated point, cubic or with limits.life_exponent: Harmonic Drive, CSF & CSG catalogue; ISO 281",
    "output_bearing": "the gearbox's data sheet",
    "emergency_stop": "momentary peak torque: Harmonic Drive, CSF & CSG catalogue, selection procedure; ratings of the stage",
    "holding_brake": "static torque of the brake against the load without friction: data sheets of servo motors",
    "screw_life": "L10h of the cubic mean load: ISO 3408-5; THK general catalogue, A-735",
    "screw_static": "static capacity against the largest load: THK general catalogue, A-733",
    "buckling": "half of Euler's load, 147 MPa at most: THK general catalogue, A-685",
    "critical_speed": "0.8 of the first bending speed: THK general catalogue, A-687; Rexroth R310RU3301, p. 120",
    "screw_speed": "path of the balls, 70 m rpm, or the data sheet: THK general catalogue, A-688",
    "belt_force": "pretension + circumferential force: Elatech and Mulco, timing belts, linear drives",
    "belt_teeth": "teeth in mesh, 12 at most: Elatech and Mulco, timing belts",
    "rack_force": "the rack's data sheet",
    "guide_friction": "attraction of the linear motor times friction coefficient of the guide: definition",
    "amplifier_current": "rms current over the cycle with the continuous current of the amplifier",
    "amplifier_peak": "largest current, and the longest time above the continuous one, with those of the amplifier",
    "amplifier_voltage": "the data sheet of the amplifier",
    "bus_voltage": "energy balance of the capacitors: HIWIN MM99TE07-1701, p. 118",
    "brake_resistor": "energy beyond the capacitors: HIWIN MM99TE07-1701, p. 118",
    "stability": "poles of the loops with gains by rule, as lostmotion servo finds them",
    "mass": "total_mass in the data sheets of the parts",
    "length": "overall_length in the data sheets of motor and gearbox, in line",
    "price": "price in the data sheets of the parts",
    "lead_time": "lead_time in the data sheets of the parts",
}
SOURCES = RULES | TASK_RULES
LISTED = 3  # points that are not judged, in a verdict


@dataclass(frozen=True)
class Finding:
    """One point of the check."""

    rule: str  #: key of `SOURCES`
    what: str
    value: str
    verdict: Judgement
    remark: str = ""
    use: float | None = None  #: share of the limit that is used; above 1 it is exceeded

    @property
    def source(self) -> str:
        """Source of the rule."""
        return SOURCES[self.rule]

    @property
    def sentence(self) -> str:
        """Value and remark, as verdicts have them."""
        return f"{self.what}: {self.value}" + (f" ({self.remark})" if self.remark else "")

    @property
    def in_short(self) -> str:
        """Verdict, value and remark in one line, without the source of the rule."""
        mark = {"ok": "ok", "caution": "caution", "warning": "WARNING", "unknown": "?"}[self.verdict].ljust(7)
        return f"{mark}  {self.sentence}"

    def noted(self, remark: str, **changes: Any) -> Finding:
        """The same with one more remark, and other changes."""
        return replace(self, remark="; ".join(filter(None, [self.remark, remark])), **changes)

    def __str__(self) -> str:
        return f"{self.in_short} [{self.source}]"


class Findings(tuple[Finding, ...]):
    """Findings of one check, as an immutable sequence of `Finding`.

    In a notebook it is shown as the page that `lostmotion check` writes.

    Examples
    --------
    >>> import lostmotion as lm
    >>> findings = lm.check_drive(lm.load("catalogue-robot-joint"))
    >>> {finding.verdict for finding in findings} <= {"ok", "caution", "warning", "unknown"}
    True
    >>> findings.verdict.state
    'fits with a reservation'
    """

    __slots__ = ()

    def __new__(cls, findings: Iterable[Finding] = ()) -> Self:
        kept = tuple(findings) if isinstance(findings, list | tuple | Iterator) else (findings,)
        for finding in kept:
            if not isinstance(finding, Finding):
                raise InputError(f"findings: {shown(finding)} is no Finding; give those of a check")
        return super().__new__(cls, kept)

    @property
    def verdict(self) -> Verdict:
        """Verdict of all: an exceeded limit decides, then estimated losses, then a rule of thumb, then what is not judged."""
        by = {mark: [f for f in self if f.verdict == mark] for mark in get_args(Judgement)}
        points = [Point("does not fit", f.sentence) for f in by["warning"]]
        points += [Point("not decided", f.sentence) for f in by["unknown"] if f.rule == "estimated_losses"]
        points += [Point("fits with a reservation", f.sentence) for f in by["caution"]]
        unknown = by["unknown"]
        if len(unknown) == len(self):
            why = f", such as: {unknown[0].sentence}" if unknown else ""
            points.append(Point("not decided", f"none of {counted(len(self), 'point')} is judged{why}"))
        elif unknown:
            names = "; ".join(f.what for f in unknown[:LISTED])
            more = f"; and {len(unknown) - LISTED} more" if len(unknown) > LISTED else ""
            points.append(
                Point(
                    "fits with a reservation",
                    f"{len(unknown)} of {counted(len(self), 'point')} not judged: {names}{more}",
                )
            )
        points.append(Point("fits", f"all {counted(len(self), 'point')} within the limits"))
        thumb = f"{counted(len(by['caution']), 'rule')} of thumb exceeded, " if by["caution"] else ""
        lines = [
            f"{counted(len(by['warning']), 'limit')} exceeded, {thumb}{len(by['ok'])} kept, {len(unknown)} not judged"
        ]
        if used := [f for f in self if f.use is not None and f.verdict != "caution"]:
            most = max(used, key=lambda f: f.use or 0.0)
            lines.append(f"the most used limit is {most.what}: {100.0 * (most.use or 0.0):.3g} %")
        return Verdict.of(points, lines)


def not_judged(rule: str, why: str, what: str = "") -> Finding:
    """A rule that is not judged, with the reason; `what` is the name of the rule if left out."""
    return Finding(rule, what or rule.replace("_", " "), "not judged", "unknown", why)


def within(
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
    exceeded = use > 1.0 + ROUNDING
    shown_value, shown_limit = told_apart(value, limit, exceeded)
    share = f"{shown_value} of {shown_limit} {unit}{over}"
    remark = f"exceeds the {name} by {excess(use - 1.0)}" if exceeded else ""
    return Finding(rule, what, share, "warning" if exceeded else "ok", remark, use)
