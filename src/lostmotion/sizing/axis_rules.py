"""Rules that tasks add to the rules of the drive check: each compares a demand of the cycle with a datum of a part.

A rule whose datum is missing gives the verdict "unknown" with the key that would give it, and never passes.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..model.gearbox import Gearbox
from ..model.motor import Motor
from ..model.process_loads import HoldingBrake
from ..model.rack_and_belt import RatedBelt, RatedRack
from ..model.screw import RatedScrew
from ..units.practical import ROUNDING, RPM, excess, share_of_limit, told_apart
from .belt_ratings import FULL_MESH, INCH, SOURCE, of_profile, tooth_shares, widths, working_tension
from .catalogue_formulas import belt_force, buckling_force, compression_force, critical_speed, dn_speed, tooth_forces
from .finding import Finding, Judgement, not_judged, within
from .life import HOUR, AxialLoad, axial_load, life_of_gearbox, screw_life
from .linear_stage_demands import Stage
from .required_motion import InputDemand, RequiredMotion

BRAKE = "torque that the holding brake carries"
SLIDE_BRAKE = "force that the brake of the slide carries"
STATIC = "static capacity of the screw"
BUCKLING = "load at which the screw may buckle"


def least(rule: str, what: str, value: float, wanted: float, unit: str, name: str) -> Finding:
    """Compares a value with the least one that is wanted; `use` is their quotient, above 1 where the value is too small."""
    if math.isinf(value):
        return Finding(rule, what, f"without end of {wanted:.4g} {unit} wanted", "ok", "", 0.0)
    use = math.inf if value <= 0.0 else wanted / value
    short = use > 1.0 + ROUNDING
    remark = f"is {excess(1.0 - value / wanted)} short of the {name}" if short else ""
    shown_value, shown_wanted = told_apart(value, wanted, short)
    text = f"{shown_value} of {shown_wanted} {unit} wanted"
    return Finding(rule, what, text, "warning" if short else "ok", remark, use)


def missing(rule: str, what: str, key: str) -> Finding:
    """A rule that cannot be judged."""
    return not_judged(rule, f"{key} is missing", what)


def against(rule: str, what: str, value: float, limit: float | None, unit: str, name: str, key: str) -> Finding:
    """Compares a value with a limit; not judged without the limit, which `key` would give."""
    return missing(rule, what, key) if limit is None else within(rule, what, value, limit, unit, name)


def gearbox_life(demand: InputDemand, wanted: float) -> Finding:
    """L10h of a gearbox in its cycle against the wanted life [s]."""
    what, life = "life of the gearbox, L10h", life_of_gearbox(demand)
    if life is None:
        return missing("gearbox_life", what, "gearbox.limits.rated_life")
    return least("gearbox_life", what, life / HOUR, wanted / HOUR, "h", "wanted life")


def output_bearing(g: Gearbox, radial: float | None, axial: float | None) -> list[Finding]:
    """Radial and axial force on the output bearing [N] against the limits of the data sheet. Source: the data sheet."""
    limits = g.limits
    found = []
    for name, force in (("radial", radial), ("axial", axial)):
        if force is None:
            continue
        limit = None if limits is None else getattr(limits, f"max_{name}_force")
        what, key = f"{name} force on the output bearing", f"gearbox.limits.max_{name}_force"
        found.append(against("output_bearing", what, force, limit, "N", f"{name} force of the gearbox", key))
    return found


def stopping_torque(motion: RequiredMotion, deceleration: float, more: float = 0.0) -> float:
    """Torque [N·m], of a slide force [N], that stops the load at a rate from anywhere in the cycle: |T_hold - sgn(w) J a|.

    `more` is inertia that moves with the load. The friction of the load, which helps, is left out.
    """
    moving = motion.speed != 0.0
    stop = motion.holding - np.sign(motion.speed) * (motion.inertia + more) * deceleration
    return float(np.abs(stop[moving]).max(initial=0.0))


def emergency_stop(motion: RequiredMotion, g: Gearbox, deceleration: float) -> Finding:
    """Torque at the gearbox output in an emergency stop. Source: Harmonic Drive, selection procedure: momentary peak torque."""
    peak, what = stopping_torque(motion, deceleration), "output torque in an emergency stop"
    limit = g.limits and (g.limits.momentary_output_torque or g.limits.peak_output_torque)
    name, key = "momentary torque of the gearbox", "gearbox.limits.momentary_output_torque"
    return against("emergency_stop", what, peak, limit or None, "N·m", name, key)


def stage_stop(motion: RequiredMotion, stage: Stage, deceleration: float) -> list[Finding]:
    """Force on the stage in an emergency stop of its slide, with the ratings for the largest force of the cycle."""
    force, rule = stopping_torque(motion, deceleration), "emergency_stop"

    def judged(word: str, limit: float | None, name: str, key: str) -> Finding:
        return against(rule, f"{word} in an emergency stop", force, limit, "N", name, key)

    if isinstance(stage, RatedRack):
        return [judged("force along the rack", stage.peak_force or stage.rated_force, *_of_rack(stage))]
    if isinstance(stage, RatedBelt):
        what, name = "force of the belt with pretension, in an emergency stop", "force of the belt in operation"
        strained = belt_force(force, stage.pretension)
        return [against(rule, what, strained, stage.rated_force, "N", name, "belt.rated_force")]
    found = [judged("axial load of the screw", stage.static_capacity, STATIC, "screw.static_capacity")]
    if stage.core_diameter is not None and stage.supported_length is not None:
        found.append(judged("axial load of the screw against buckling,", _buckling(stage), BUCKLING, ""))
    return found


def motor_stop(motion: RequiredMotion, motor: Motor, deceleration: float) -> Finding:
    """Force of a linear motor in an emergency stop, of the slide with its coils, with its peak force."""
    force = stopping_torque(motion, deceleration, motor.rotor_inertia)
    limit = None if motor.limits is None else motor.limits.peak_torque
    name, key = "peak force of the motor", "linear_motor.peak_force"
    return against("emergency_stop", "force of the motor in an emergency stop", force, limit, "N", name, key)


def _of_rack(rack: RatedRack) -> tuple[str, str]:
    return f"{'peak' if rack.peak_force else 'rated'} force of the rack", "rack.rated_force"


def _buckling(screw: RatedScrew) -> float:
    """Largest axial load of a screw [N]."""
    assert screw.core_diameter is not None
    assert screw.supported_length is not None
    longest = buckling_force(screw.core_diameter, screw.supported_length, screw.mounting)
    return min(longest, compression_force(screw.core_diameter))


def without_part(rule: str, part: str, key: str) -> Finding:
    """A demand of a task that nothing of a candidate can be compared with."""
    return not_judged(rule, f"the candidate has no {part}, which {key} is of; leave it out, or judge it apart")


def holding_brake(demand: InputDemand, brake: HoldingBrake | None, slide: RequiredMotion | None = None) -> Finding:
    """Static torque of a brake on the motor against the largest holding torque of the cycle, max |T_hold|/i, without friction.

    The force of a brake on the slide is compared with the largest holding force.
    Source: data sheets of servo motors; friction of gearbox and load, which may vanish by vibration, is not counted.
    """
    if slide is not None and (demand.motion is slide or (brake is not None and brake.force is not None)):
        force = float(np.abs(slide.holding).max())
        return held_by(None if brake is None else brake.force, SLIDE_BRAKE, force, "N", "force")
    need = float(np.abs(demand.motion.holding).max()) / abs(demand.gearbox.ratio)
    return held_by(None if brake is None else brake.torque, BRAKE, need, "N·m", "torque")


def held_by(limit: float | None, what: str, need: float, unit: str, word: str) -> Finding:
    """A holding torque or force against the torque or force of a brake."""
    told = what if limit is not None else f"{what}: {need:.4g} {unit}"
    return against("holding_brake", told, need, limit, unit, f"{word} of the brake", f"task.brake.{word}")


def brake_of_a_run(brake: HoldingBrake, need: float) -> Finding:
    """Static torque of a brake against the largest load torque of a run at the motor [N·m], without friction."""
    found = held_by(brake.torque, BRAKE, need, "N·m", "torque")
    if brake.torque is None or brake.inertia == 0.0:
        return found
    told = f"its inertia of {brake.inertia:.4g} kg·m² is not in the run; add it to motor.rotor_inertia"
    return found.noted(told)


def stage_rules(motion: RequiredMotion, stage: Stage, wanted_life: float | None) -> list[Finding]:
    """The rules of the stage of a linear axis for the motion of its slide."""
    if isinstance(stage, RatedScrew):
        return screw_rules(axial_load(motion), stage, wanted_life)
    if isinstance(stage, RatedBelt):
        return belt_rules(motion.torque, motion.speed, stage)
    return rack_rules(float(np.abs(motion.torque).max()), stage)


def screw_rules(load: AxialLoad, screw: RatedScrew, wanted_life: float | None, *, key: str = "screw") -> list[Finding]:
    """Life, static load, buckling, bending speed and ball speed of a screw. Sources: `catalogue_formulas` and `TASK_RULES`.

    wanted_life: [s]; None: the life is not judged.
    key: table of the screw, for what is missing.
    """
    turning = 2.0 * math.pi / screw.travel()
    peak = float(np.abs(load.force).max())
    fastest = turning * float(np.abs(load.speed).max())
    found = []
    if wanted_life is not None:
        what, life = "life of the screw, L10h", screw_life(load, screw)
        if life is None:
            found.append(missing("screw_life", what, f"{key}.dynamic_capacity"))
        else:
            found.append(least("screw_life", what, life / HOUR, wanted_life / HOUR, "h", "wanted life"))
    what = "axial load of the screw, largest"
    found.append(against("screw_static", what, peak, screw.static_capacity, "N", STATIC, f"{key}.static_capacity"))
    what = "axial load of the screw against buckling"
    if screw.core_diameter is None or screw.supported_length is None:
        lacks = f"{key}.{'core_diameter' if screw.core_diameter is None else 'supported_length'}"
        found += [
            missing("buckling", what, lacks),
            missing("critical_speed", "speed of the screw against bending", lacks),
        ]
    else:
        d, length = screw.core_diameter, screw.supported_length
        found.append(within("buckling", what, peak, _buckling(screw), "N", BUCKLING))
        limit = critical_speed(d, length, screw.mounting)
        what, name = "speed of the screw against bending", "critical speed"
        found.append(within("critical_speed", what, RPM * fastest, RPM * limit, "rpm", name))
    speed = screw.max_input_speed
    if speed is None and screw.ball_circle_diameter is not None:
        speed = dn_speed(screw.ball_circle_diameter)
    what, name = "speed of the screw against the speed of its balls", "largest speed of the screw"
    lacks, most = f"{key}.max_input_speed or {key}.ball_circle_diameter", None if speed is None else RPM * speed
    return [*found, against("screw_speed", what, RPM * fastest, most, "rpm", name, lacks)]


def belt_rules(force: np.ndarray, speed: np.ndarray, belt: RatedBelt, *, key: str = "belt") -> list[Finding]:
    """Tension of a belt and the load of its teeth under the force of its slide over its speed [N, m/s].

    Ratings that its table does not give come from its profile and width. Sources: `catalogue_formulas.belt_force`,
    `catalogue_formulas.tooth_forces` and `belt_ratings`.

    key: table of the belt, for what is missing.
    """
    rated, in_mesh = of_profile(belt), belt.meshing()
    force, rpm = np.abs(force), RPM * 2.0 * math.pi / belt.travel() * np.abs(speed)
    peak, shares = float(force.max()), tooth_shares(belt.profile, rpm)
    what, name = "force of the belt, with pretension", "force of the belt in operation"
    strained = belt_force(peak, belt.pretension)
    tension_found = _rating("belt_force", what, strained, rated.rated_force, name, _needed(belt, "rated_force", key))
    what, name = "circumferential force on the teeth of the belt", "force of the teeth in mesh"
    if rated.tooth_force is None and (tension := working_tension(belt)) is not None:
        return [tension_found, _worked(what, peak, tension, belt)]
    lacks = f"{key}.teeth_in_mesh" if rated.tooth_force else _needed(belt, "tooth_force", key)
    if rated.tooth_force is None or in_mesh is None:
        return [tension_found, _rating("belt_teeth", what, peak, None, name, lacks)]
    limit = tooth_forces(rated.tooth_force, in_mesh)
    if shares is None:
        found = _rating("belt_teeth", what, peak, limit, name, lacks)
        return [
            tension_found,
            found.noted(f"tooth_force holds at standstill; the largest speed is {rpm.max():.0f} rpm"),
        ]
    k = int(np.argmax(force / shares))
    found = _rating("belt_teeth", what, float(force[k]), limit * float(shares[k]), name, lacks)
    return [tension_found, found.noted(f"at {rpm[k]:.0f} rpm of its pulley")]


def _rating(rule: str, what: str, force: float, limit: float | None, name: str, key: str) -> Finding:
    """A force [N] with its rating; where that is missing the force itself."""
    found = against(rule, what, force, limit, "N", name, key)
    return found if limit is not None else replace(found, value=f"{force:.4g} N")


def _needed(belt: RatedBelt, rating: str, key: str) -> str:
    """Keys that would give a rating of a belt."""
    if not belt.profile or belt.width is None:
        return f"{key}.{rating}, or {key}.{'width' if belt.profile else 'profile'},"
    printed = ", ".join(f"{1e3 * width:g}" for width in widths(belt))
    there = (
        f"sheets of {belt.profile} are {printed} mm wide"
        if printed
        else f"no sheet of {belt.profile} with this pitch is at hand"
    )
    return f"{key}.{rating} ({there})"


def _worked(what: str, peak: float, tension: float, belt: RatedBelt) -> Finding:
    """Circumferential force with the allowable working tension of a profile, which holds for an inch and full mesh."""
    found = within("belt_teeth", what, peak, tension, "N", f"working tension of {belt.profile} ({SOURCE})")
    assert belt.width is not None
    doubts = []
    if belt.width < INCH:
        doubts.append("belts narrower than 1 inch carry less by an amount that the source does not print")
    if (in_mesh := belt.meshing()) is None or in_mesh < FULL_MESH:
        doubts.append(f"it holds for {FULL_MESH} teeth in mesh and more")
    if found.verdict != "ok" or not doubts:
        return found
    return found.noted("; ".join(doubts), verdict="unknown")


def rack_rules(peak: float, rack: RatedRack, *, key: str = "rack") -> list[Finding]:
    """Largest force along a rack [N] against its peak force, or else its rated one. Source: the data sheet."""
    name, lacks = _of_rack(rack)
    lacks = lacks.replace("rack.", f"{key}.", 1)
    limit = rack.peak_force or rack.rated_force
    return [_rating("rack_force", "force along the rack, largest", peak, limit, name, lacks)]


def derated(findings: list[Finding], share: float) -> list[Finding]:
    """Findings of a motor that has this share of its continuous torque left. Source: `formulas.derating`."""
    if share == 1.0:
        return findings
    return [
        _tightened(f, 1.0 / share if share > 0.0 else math.inf, f"derated to {100.0 * share:.0f} %")
        if f.rule == "motor_torque" and f.use is not None
        else f
        for f in findings
    ]


def with_safety(findings: list[Finding], factors: Mapping[str, float]) -> list[Finding]:
    """Findings under the safety factors of a task: the share of a limit that is used is multiplied by the factor of its rule."""
    return [
        _tightened(f, factors[f.rule], f"with the safety factor {factors[f.rule]:g}")
        if f.rule in factors and f.use is not None
        else f
        for f in findings
    ]


def _tightened(finding: Finding, factor: float, why: str) -> Finding:
    assert finding.use is not None
    use = finding.use * factor
    exceeded = use > 1.0 + ROUNDING
    verdict: Judgement = "warning" if exceeded else finding.verdict
    return finding.noted(f"{why}: {share_of_limit(use)} of the limit", use=use, verdict=verdict)
