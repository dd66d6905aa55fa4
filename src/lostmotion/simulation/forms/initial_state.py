"""The state of a drive train at the beginning of a run."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ... import _core
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean
from ...model.shaft_ratio import tied
from ...model.signals import Signal
from ...model.torsion import Rigid
from ...model.train import DriveTrain
from ...recorded_numbers import may_be_left_out, real, value_of
from ..variables_of_trains import angle_through

if TYPE_CHECKING:
    from .train_tables import TrainInitial

ROUNDING = 1e-12  # relative, between values that belong together


def agree(a: float, b: float) -> bool:
    """Whether two values say the same, up to rounding."""
    return abs(a - b) <= ROUNDING * max(abs(a), abs(b), 1.0)


def start_values(
    train: DriveTrain, initial: TrainInitial, core: _core.Train | None = None, driven: Collection[str] = ()
) -> dict[str, float]:
    """Values at t = 0 by the name of their result variable; what is not among them is 0.

    core: the solver's train, if there is one already.
    driven: names of the shafts whose motion is given.

    Raises InputError: a name is unknown, or values contradict each other.
    """
    stiff = [name for name, g in train.gears.items() if not isinstance(g.stiffness, Rigid) or g.stiffness.strikes]
    lossy = [name for name in stiff if (h := train.gears[name].hysteresis) is not None and h.efficiency < 1.0]
    electric = [name for name, m in train.motors.items() if m.kind not in ("torque_source", "stepper")]
    speeds, twists = tied_speeds(train, initial.of_all("speeds")), initial.of_all("twists")
    for keys, what in ((("speeds", "angles"), "shaft"), (("slide_speeds", "positions"), "slide")):
        for key in keys:
            _check(key, getattr(initial, key), train.shafts, what)
    _check("twists", initial.twists, stiff, "gear with a stiffness")
    _check("deflections", initial.deflections, stiff, "screw, rack or belt with a stiffness")
    _check("motor_torques", initial.motor_torques, electric, 'motor of kind "dc" or "synchronous"')
    _check("hysteresis_capacities", initial.hysteresis_capacities, lossy, "gear with hysteresis")
    _check("hysteresis_forces", initial.hysteresis_forces, lossy, "screw, rack or belt with hysteresis")
    if problem := (core or train.core(())).check_start([value_of(speeds.get(name, 0.0)) for name in train.shafts]):
        _refuse_contradiction(train, initial.of_all("speeds"))
        raise InputError(problem, "initial.speeds")
    _check_flanks(train, speeds, twists)
    angles = angles_at_start(train, initial.of_all("angles"), twists, driven)
    _check_end_stops(train, speeds, angles)
    values = {train.variable(name, "speed"): v for name, v in speeds.items()}
    values |= {train.variable(s, "angle"): v for s, v in angles.items()}
    values |= {train.variable(name, "twist"): v for name, v in twists.items()}
    values |= {train.variable(name, "torque"): v for name, v in initial.motor_torques.items()}
    return values


def _refuse_contradiction(train: DriveTrain, given: Mapping[str, float]) -> None:
    """Refuses two given speeds where one follows from the other through rigid parts between them."""
    for one, speed in given.items():
        there = tied_speeds(train, {one: speed})
        for other in (name for name in given if name in there and name != one):
            if agree(given[other], there[other]):
                continue
            a, wanted = (f"{x:.10g} {_speed_unit(train, other)}" for x in (given[other], there[other]))
            b = f"{speed:.10g} {_speed_unit(train, one)}"
            key = "slide_speeds" if train.is_slide(other) else "speeds"
            raise InputError(
                f"{a} does not fit {one} = {b} through what is rigid between them, which makes it {wanted}; give one of them",
                f"initial.{key}.{other}",
            )


def _speed_unit(train: DriveTrain, shaft: str) -> str:
    return "m/s" if train.is_slide(shaft) else "rad/s"


def _check_flanks(train: DriveTrain, speeds: Mapping[str, float], twists: Mapping[str, float]) -> None:
    """Refuses rigid flanks that begin beyond their backlash, or at its end with a speed into each other."""
    for name, gear in train.gears.items():
        if not isinstance(gear.stiffness, Rigid) or not gear.stiffness.strikes:
            continue
        reach, twist = 0.5 * gear.stiffness.backlash, twists.get(name, 0.0)
        housing = 0.0 if gear.housing is None else speeds.get(gear.housing, 0.0)
        speed = (speeds.get(gear.input, 0.0) - housing) / gear.ratio - (speeds.get(gear.output, 0.0) - housing)
        if abs(twist) > reach or (abs(twist) == reach and twist * speed > 0.0):
            raise InputError(
                f"the flanks begin {'beyond' if abs(twist) > reach else 'with an impact at'} the end of "
                f"their gap, {reach:g} rad; give a twist inside it",
                f"initial.twists.{name}",
            )


def _check_end_stops(train: DriveTrain, speeds: Mapping[str, float], angles: Mapping[str, float]) -> None:
    """Refuses a shaft that begins beyond its rigid stops, or at one with a speed into it."""
    for name, shaft in train.shafts.items():
        stops, angle, speed = shaft.end_stops, angles.get(name, 0.0), speeds.get(name, 0.0)
        if stops is None or stops.stiffness is not None:
            continue
        beyond = not stops.lower <= angle <= stops.upper
        if beyond or (angle == stops.lower and speed < 0.0) or (angle == stops.upper and speed > 0.0):
            what = "beyond its rigid stops" if beyond else "with an impact on its stop"
            key = f"initial.{'positions' if train.is_slide(name) else 'angles'}.{name}"
            unit = train.angle_unit(name)
            reason = f"{angle:g} {unit} is {what} at {stops.lower:g} and {stops.upper:g} {unit}; begin between them"
            raise InputError(reason, key)


def _check(key: str, given: Iterable[str], known: Iterable[str], what: str) -> None:
    known = list(known)
    for name in given:
        if name not in known:
            meant = did_you_mean(name, known, f"there are {', '.join(known)}" if known else "there is none")
            raise InputError(f"is no {what} of this train; {meant}", f"initial.{key}.{name}")


def angles_at_start(
    train: DriveTrain, given: Mapping[str, float], twists: Mapping[str, float], driven: Collection[str] = ()
) -> dict[str, float]:
    """The angles of all shafts [rad], from the given angles through the gears to the others.

    driven: names of the shafts whose motion is given, which are at 0 before others are.

    Raises InputError: two that are given contradict each other.
    """
    angles, origin = dict(given), {shaft: shaft for shaft in given}
    waiting = list(given)
    # Where none is given, a shaft of given motion is at 0, or else the last shaft of a chain.
    unreached = [*(s for s in train.shafts if s not in driven), *(s for s in reversed(train.shafts) if s in driven)]
    while waiting or unreached:
        if not waiting:
            start = unreached.pop()
            if start in angles:
                continue
            angles[start], origin[start] = 0.0, start
            waiting.append(start)
        shaft = waiting.pop(0)
        for name, gear in train.fixed_gears().items():
            if shaft not in (gear.input, gear.output):
                continue
            other = gear.output if shaft == gear.input else gear.input
            angle = real(angle_through(gear, angles[shaft], twists.get(name, 0.0), forward=shaft == gear.input))
            if other not in angles:
                angles[other], origin[other] = angle, origin[shaft]
                waiting.append(other)
            elif origin[other] != origin[shaft] and not agree(angles[other], angle):
                one, two = origin[other], origin[shaft]
                key = "positions" if train.is_slide(two) else "angles"
                a, b = (f"{given[s]} {train.angle_unit(s)}" for s in (two, one))
                raise InputError(
                    f"{a} does not fit {one} = {b} through the gear {name} and its twist; give one of them",
                    f"initial.{key}.{two}",
                )
    return angles


def given_speeds(train: DriveTrain, motions: Mapping[str, tuple[Signal[Any], Signal[Any]]]) -> dict[str, float]:
    """Speeds at t = 0 [rad/s, m/s] of shafts and slides with a given motion, and of others that rigid gears tie to them."""
    return tied_speeds(train, {name: speed.at_start() for name, (speed, _) in motions.items()})


def tied_speeds(train: DriveTrain, given: Mapping[str, float]) -> dict[str, float]:
    """Speeds [rad/s, m/s] that are given, and the speeds of other shafts and slides that rigid gears tie to them."""
    gears = train.fixed_gears().values()
    rigid = [g for g in gears if isinstance(g.stiffness, Rigid) and not g.stiffness.strikes]
    joints = [(g.input, g.output, g.ratio) for g in rigid]
    speeds = tied({name: speed for name, speed in given.items() if not may_be_left_out(speed)}, joints)
    for name, speed in given.items():
        if name not in speeds:
            speeds = tied({**speeds, name: speed}, joints)
    return speeds
