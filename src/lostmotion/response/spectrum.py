"""Periodic errors of a drive at constant speed, by the order of each shaft's revolution, with the parts that cause them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.references import PositionReference, SlideReference
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Number, Time
from ..inputs.refusal_messages import did_you_mean, shown
from ..model.angle_torques import AngleCurve, Harmonic, PositionHarmonic
from ..model.shaft_ratio import turns
from ..model.train import DriveTrain
from ..simulation.runs.pointing_error import pointed
from ..simulation.runs.run import run
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables_of_trains import angle_of_run

if TYPE_CHECKING:
    import xarray

AGAINST = ("reference", "motor")
PER_PERIOD = 32  # samples of the run in one period of the highest order
LEAST_ORDER = 64.0  # highest order per turn of the motor, where no part states a high one
ABOVE_STEPS = 2.2  # the same of microsteps, whose orders are high
INSTANTS = 1001  # at which the speed of a reference is looked at
ABOVE = 4.0  # times the highest order that a part states, up to which lines are looked for
MOST_SAMPLES = 4_000_000  # of a run
STEADY = 0.02  # by which the mean speeds of both halves of the evaluated part may differ
WHOLE = 1e-9  # of the turns of a shaft from a whole number
LEAST = 1e-3  # of the greatest amplitude, below which a line is left out
MOST_LINES = 20
NOT_STATED = "no part states this order"


@dataclass(frozen=True)
class SpectrumLine:
    """One periodic part of an error: ``amplitude * sin(order * angle + phase)`` over the angle of the motor's shaft."""

    order: float
    """periods per revolution of the motor's shaft"""
    orders: dict[str, float]
    """periods per revolution of each shaft that the motor turns"""
    amplitude: float
    """[rad], of a slide [m]"""
    phase: float
    """[rad]"""
    cause: str
    """the part whose data state this order; "not decided" with the parts where several do"""


@dataclass(frozen=True)
class Spectrum:
    """The periodic error of a shaft at constant speed."""

    against: str
    """"reference", or "motor" for the transmission error"""
    shaft: str
    """shaft with the error"""
    over: str
    """shaft of the motor, over whose angle it repeats"""
    unit: str
    """rad, of a slide m"""
    turns: dict[str, float]
    """revolutions of each shaft that were evaluated"""
    angle: np.ndarray
    """angle of the motor's shaft, equally spaced [rad]"""
    error: np.ndarray
    """without its mean and its drift [rad, m]"""
    peak_to_peak: float
    """[rad, m]"""
    lines: tuple[SpectrumLine, ...]
    """the largest first"""
    resampling_error: float
    """estimate of what the interpolation between samples of the exact solution adds [rad, m]"""

    def __str__(self) -> str:
        """The error in arcsec, of a slide in µm, and its lines as a table."""
        what = "following error" if self.against == "reference" else "transmission error"
        evaluated = ", ".join(f"{n:.6g} of {name}" for name, n in self.turns.items())
        head = f"{what} of {self.shaft}: {_practical(self.peak_to_peak, self.unit)} peak to peak over revolutions: {evaluated}"
        shafts = [name for name in self.turns if any(name in line.orders for line in self.lines)]
        rows = [("amplitude", *(f"order of {name}" for name in shafts), "cause")]
        rows += [
            (_practical(line.amplitude, self.unit), *(f"{line.orders[name]:.6g}" for name in shafts), line.cause)
            for line in self.lines
        ]
        if not self.lines:
            return f"{head}\n  no periodic part"
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]) - 1)]
        table = ["  ".join([*(f"{c:>{w}}" for c, w in zip(row, widths, strict=False)), row[-1]]) for row in rows]
        return "\n".join([head, *(f"  {line}" for line in table)])


@checked
def spectrum(
    scenario: Scenario,
    *,
    against: str | None = None,
    motor: str | None = None,
    start: Time | None = None,
    max_order: Number | None = None,
) -> Spectrum:
    """Periodic error of a shaft at constant speed, by orders, with the part that causes each.

    The scenario is run as it is; its end must be at constant speed. Its samples, which are exact, are interpolated at
    equal angles of the motor's shaft by cubics through values and speeds, over whole revolutions. A cause is named if
    exactly one part has the order. Such parts are a transmission error (tooth mesh, worm or screw turn), a torque
    over the angle (cogging), gravity, and the error of an encoder.

    Parameters
    ----------
    scenario
        At constant speed from `start` to its end.
    against
        ``"reference"``: reference of a position loop less the position of its shaft; ``"motor"``: angle of the motor over the
        ratio, less the angle of the shaft, the transmission error. Left out, the reference where the axis follows a position.
    motor
        May be left out where there is one.
    start
        Instant from which on the motion is at constant speed [s]; left out, half of the run.
    max_order
        Highest order per revolution of the motor that is looked for; left out, four times the highest that a part states.

    Returns
    -------
    Spectrum
        Peak to peak, and lines with amplitude, phase and cause.

    Raises
    ------
    InputError
        The speed is not constant, or no shaft makes a whole revolution.

    Examples
    --------
    >>> import math
    >>> import lostmotion as lm
    >>> drive = lm.Scenario(
    ...     shafts={"motor": {}, "load": {"inertia": 1e-3, "torque": 0.0}},
    ...     motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 1e-3, "rated_torque": 1.0}},
    ...     gears={
    ...         "worm": {
    ...             "input": "motor",
    ...             "output": "load",
    ...             "ratio": 2,
    ...             "stiffness": {"kind": "linear", "stiffness": 1e6},
    ...             "transmission_error": {
    ...                 "kind": "sine",
    ...                 "order": 3,
    ...                 "amplitude": "1 arcmin",
    ...                 "phase": "90 deg",
    ...             },
    ...         }
    ...     },
    ...     initial={"speeds": {"motor": 1.0, "load": 0.5}},
    ...     simulation={"duration": 26.0, "sample_interval": 0.1},
    ... )
    >>> line = lm.spectrum(drive).lines[0]
    >>> print(f"order {line.order:g}, {math.degrees(line.amplitude) * 60:.3f} arcmin, {line.cause}")
    order 3, 1.000 arcmin, tooth mesh: transmission error of worm
    """
    if against is not None and against not in AGAINST:
        raise InputError(f"against: {shown(against)} is not known; take reference or motor")
    long = scenario.long()
    train = long.train()
    name = _motor(train, motor)
    over = train.motors[name].shaft
    controller = long.axes().get(name)
    followed = pointed(long).get(name)
    against = against or ("reference" if followed else "motor")
    if against == "reference" and not followed:
        raise InputError("against: this axis follows no position reference; take motor, the transmission error")
    shaft = followed[1] if followed else getattr(controller, "shaft", None) or list(train.shafts)[-1]
    ratio = turns(train, over, shaft)
    if ratio is None:
        raise InputError(f"motor: {shown(name)} does not turn the shaft {shaft} through gears; name another motor")
    sources = list(_sources(long, train, over))
    stated = max((order for _, order, _ in sources if order <= 1e5), default=0.0)
    steps = list(_steps(long, name))
    fastest = max((ABOVE_STEPS * order for _, order, _ in steps), default=0.0)
    sources += steps
    smooth = followed[0] if followed and train.motors[name].kind == "stepper" else None
    window = _window(long, train, over, start, smooth, ratio)
    fastest = min(fastest, math.pi * MOST_SAMPLES / (PER_PERIOD * abs(window[1]) * long.simulation.duration))
    highest = max(LEAST_ORDER, ABOVE * stated, fastest) if max_order is None else float(max_order)
    if not highest > 0.0:
        raise InputError(f"max_order: {highest:g} must be above 0")
    data, first = _sampled(long, over, window, highest)
    time, angle, speed = _of(data, train, over)
    _, place, rate = _of(data, train, shaft)
    error, error_rate = angle / ratio - place, speed / ratio - rate
    if against == "reference":
        assert followed is not None
        value, slope = followed[0].at(time)[:2]
        error, error_rate = value - place, slope - rate
    if smooth is not None:  # a rotor swings in its field: angles belong to its reference
        angle, speed = (ratio * x for x in smooth.at(time)[:2])
    per_turn = {n: 1.0 / r for n in train.shafts if not train.is_slide(n) and (r := turns(train, over, n)) is not None}
    direction = math.copysign(1.0, window[1])
    travelled = direction * (angle - angle[first])
    made = _whole_turns(travelled[-1] / (2.0 * math.pi), per_turn)
    wanted, found, resampling = _over_whole_turns(
        (travelled, direction * speed, time, error, error_rate), made, 2 * math.ceil(2.0 * highest * made)
    )
    wanted_angle = angle[first] + direction * wanted
    lines = _lines(found, made, per_turn, wanted_angle, direction, highest, sources, 10.0 * resampling)
    return Spectrum(
        against=against,
        shaft=shaft,
        over=over,
        unit=train.angle_unit(shaft),
        turns={n: made * abs(t) for n, t in per_turn.items()},
        angle=wanted_angle,
        error=found,
        peak_to_peak=float(np.ptp(found)),
        lines=tuple(lines),
        resampling_error=resampling,
    )


# --- the run ---


def _over_whole_turns(
    course: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], made: float, count: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """(angles, error there without its mean and its drift, largest error of the interpolation) over the last whole turns.

    Half of the samples give a second answer; a rule of fourth order at half the step errs by a fifteenth of the difference.
    """
    travelled, error = course[0], course[3]
    length = 2.0 * math.pi * made
    wanted = travelled[-1] - length + length * np.arange(count) / count
    drift = (error[-1] - float(_at(*course, wanted[:1])[0])) * np.arange(count) / count
    found = _at(*course, wanted) - drift
    t, v, time, e, rate = (x[::-2][::-1] for x in course)
    other = _at(t, v, time, e, rate, wanted) - drift
    found -= found.mean()
    return wanted, found, float(np.abs(found - (other - other.mean())).max()) / 15.0


def _motor(train: DriveTrain, motor: str | None) -> str:
    if motor is None:
        if len(train.motors) != 1:
            several = f"{len(train.motors)} motors turn it; name one of {', '.join(train.motors)}"
            raise InputError(f"motor: {several if train.motors else 'no motor turns it'}")
        motor = next(iter(train.motors))
    if motor not in train.motors:
        meant = did_you_mean(motor, train.motors, f"the motors are {', '.join(train.motors)}")
        raise InputError(f"motor: {shown(motor)} is no motor; {meant}")
    if train.is_slide(slide := train.motors[motor].shaft):
        raise InputError(
            f"motor: {shown(motor)} moves the slide {slide}, which makes no revolutions; name a motor of a shaft"
        )
    return motor


def _of(data: xarray.Dataset, train: DriveTrain, shaft: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, angle and speed of a shaft, or position and speed of a slide."""
    return data["time"].values, angle_of_run(train, shaft, data), data[train.variable(shaft, "speed")].values


def _window(
    long: Scenario,
    train: DriveTrain,
    over: str,
    start: float | None,
    smooth: PositionReference | SlideReference | None,
    ratio: float,
) -> tuple[float, float]:
    """Begin of the evaluated part [s], and the speed of the motor in it [rad/s]; refused where that is not constant.

    smooth: reference of a stepper, whose speed replaces the rotor's speed.
    """
    duration = long.simulation.duration
    begin = 0.5 * duration if start is None else start
    if not 0.0 <= begin < duration:
        raise InputError(f"start: {begin:g} s must lie between 0 and the end of the run, {duration:g} s")
    if smooth is None:
        time, angle, speed = _of(run(long, energy=False).dataset(), train, over)
    else:
        time = np.linspace(0.0, duration, INSTANTS) * (1.0 - WHOLE)  # a reference may end with the run
        angle, speed = (ratio * x for x in smooth.at(time)[:2])
    middle = 0.5 * (begin + duration)
    at = np.interp([begin, middle, duration], time, angle)
    halves = np.diff(at) / (middle - begin)
    inside = speed[time >= begin]
    if halves.sum() == 0.0 or abs(halves[1] - halves[0]) > STEADY * abs(halves).max() or np.ptp(np.sign(inside)) != 0.0:
        raise InputError(
            f"start: the speed of {over} is not constant from {begin:g} s to {duration:g} s; begin later by start, end the run at constant "
            "speed by simulation.duration, or give a constant command or reference"
        )
    return begin, float(halves.mean())


def _sampled(long: Scenario, over: str, window: tuple[float, float], highest: float) -> tuple[xarray.Dataset, int]:
    """The run, with samples dense enough for the highest order; and the index of the first that is evaluated."""
    begin, speed = window
    duration = long.simulation.duration
    interval = 2.0 * math.pi / (PER_PERIOD * highest * abs(speed))
    count = max(64, math.ceil(duration / interval))
    if count > MOST_SAMPLES:
        raise InputError(
            f"max_order: orders up to {highest:g} of {over} need {count:.3g} samples of this run, and {MOST_SAMPLES:g} are possible; take a "
            "lower max_order, or a shorter simulation.duration"
        )
    table = long.simulation.model_copy(update={"sample_interval": duration / count})
    data = run(long.model_copy(update={"simulation": table}), energy=False).dataset()
    return data, int(np.searchsorted(data["time"].values, begin))


def _whole_turns(available: float, per_turn: dict[str, float]) -> float:
    """Turns of the motor in which as many shafts as possible make whole revolutions, as many of these as there are."""
    best: tuple[int, float] | None = None
    for base in sorted({abs(t) for t in per_turn.values()}):
        for n in range(math.floor(available * base * (1.0 + WHOLE)), 0, -1):
            made = n / base
            counts = [made * abs(t) for t in per_turn.values()]
            whole = sum(abs(c - round(c)) < WHOLE * max(1.0, c) and round(c) > 0 for c in counts)
            if best is None or whole > best[0]:
                best = (whole, made)
            if whole == len(counts) or n < math.floor(available * base) - 1000:
                break
    if best is None:
        raise InputError(
            f"start: the motor makes {available:.3g} revolutions in the evaluated part, and a whole one is needed; take a longer "
            "simulation.duration, or an earlier start"
        )
    return best[1]


def _at(
    angle: np.ndarray, speed: np.ndarray, time: np.ndarray, value: np.ndarray, rate: np.ndarray, wanted: np.ndarray
) -> np.ndarray:
    """A value at given angles: the instant where the cubic of the angle through its samples and speeds has them, the cubic there."""
    k = np.clip(np.searchsorted(angle, wanted, side="right") - 1, 0, len(angle) - 2)
    h = time[k + 1] - time[k]
    share = (wanted - angle[k]) / (angle[k + 1] - angle[k])
    for _ in range(4):  # Newton's method; the speed is nearly constant in an interval
        there, slope = _cubic(share, h, angle[k], angle[k + 1], speed[k], speed[k + 1])
        share = share - (there - wanted) / slope
    return _cubic(share, h, value[k], value[k + 1], rate[k], rate[k + 1])[0]


def _cubic(s: Any, h: Any, a: Any, b: Any, rate_a: Any, rate_b: Any) -> tuple[np.ndarray, np.ndarray]:
    """Hermite's cubic at a share of an interval, and its derivative by the share."""
    d, p, q = b - a, h * rate_a, h * rate_b
    c2, c3 = 3.0 * d - 2.0 * p - q, p + q - 2.0 * d
    return a + s * (p + s * (c2 + s * c3)), p + s * (2.0 * c2 + 3.0 * s * c3)


# --- lines and causes ---


def _lines(
    error: np.ndarray,
    made: float,
    per_turn: dict[str, float],
    angle: np.ndarray,
    direction: float,
    highest: float,
    sources: list[tuple[str, float, bool]],
    floor: float,
) -> Iterator[SpectrumLine]:
    """Lines of the error, the largest first."""
    values = 2.0 * np.fft.rfft(error) / len(error)
    sizes = np.abs(values)
    sizes[0] = 0.0
    sizes[math.floor(highest * made) + 1 :] = 0.0
    least = max(LEAST * float(sizes.max()), floor)
    for k in np.argsort(sizes)[::-1][:MOST_LINES]:
        if sizes[k] <= least:
            return
        order = k / made
        # Re(c exp(j order s)) over the travelled s = direction (angle - first) as a sine over the angle.
        phase = float(np.angle(values[k])) * direction + 0.5 * math.pi - order * float(angle[0])
        yield SpectrumLine(
            order=float(order),
            orders={name: float(order / abs(t)) for name, t in per_turn.items()},
            amplitude=float(sizes[k]),
            phase=math.remainder(phase, 2.0 * math.pi),
            cause=_cause(order, 0.5 / made, sources),
        )


def _cause(order: float, width: float, sources: list[tuple[str, float, bool]]) -> str:
    """The one part that states an order; of several all."""
    exact = [name for name, own, _ in sources if abs(order - own) < width]
    multiples = [
        name
        for name, own, curve in sources
        if curve and own > 0.0 and round(order / own) > 1 and abs(order - own * round(order / own)) < width
    ]
    named = list(dict.fromkeys(exact + multiples))
    if len(named) == 1:
        return named[0]
    return f"not decided: {' or '.join(named)}" if named else NOT_STATED


def _steps(long: Scenario, motor: str) -> Iterator[tuple[str, float, bool]]:
    """The same of a stepper: its microsteps, and what repeats with each full step."""
    m, command = long.train().motors[motor], long.tables.command.get(motor)
    if m.kind != "stepper" or command is None or command.stepping is None:
        return
    assert m.steps_per_revolution is not None
    full, stepping = m.steps_per_revolution, command.stepping
    yield f"microsteps of {motor}", full * stepping.microsteps, True
    if stepping.table_error > 0.0 and stepping.microsteps > 1:
        yield f"sine table of the driver of {motor}", full, False
    if m.detent_torque:
        yield f"detents of {motor}", full, False
        yield f"detents of {motor}", 2.0 * full, False


def _sources(long: Scenario, train: DriveTrain, over: str) -> Iterator[tuple[str, float, bool]]:
    """Name, order per turn of the motor, and presence of multiples, for each part that states a period."""

    def source_of(shaft: str, order: float) -> float:
        ratio = turns(train, over, shaft)
        return 0.0 if ratio is None else order / abs(ratio)

    for name, gear in train.gears.items():
        if gear.transmission_error is not None:
            order, curve = _order(gear.transmission_error)
            slide = train.is_slide(gear.output)
            kind = ("screw turn" if slide else "worm turn") if order == 1.0 else "tooth mesh"
            yield f"{kind}: transmission error of {name}", source_of(gear.input, order), curve
        if gear.mesh_stiffness is not None:
            yield f"tooth mesh: mesh stiffness of {name}", source_of(gear.input, gear.mesh_stiffness.teeth), True
    driven = {motor.shaft for motor in train.motors.values()}
    for name, torque in train.angle_torques.items():
        order, curve = _order(torque)
        kind = "cogging" if torque.shaft in driven else "torque over the angle"
        yield f"{kind}: {name} on {torque.shaft}", source_of(torque.shaft, order), curve
    for name, mass in train.gravity.items():
        yield f"gravity: {name} on {mass.shaft}", source_of(mass.shaft, 1.0), False
    for name, controller in long.axes().items():
        for key in ("encoder", "position_encoder"):
            encoder = getattr(controller, key, None)
            if encoder is None or not encoder.error:
                continue
            shaft = encoder.shaft or train.motors[name].shaft
            per_turn = encoder.error_periods or encoder.lines
            if per_turn is None:  # of a linear scale, whose coordinate is a length
                per_turn = 2.0 * math.pi / encoder.grating_period
            yield f"encoder error: {key} of {name} on {shaft}", source_of(shaft, per_turn), False


def _order(law: Any) -> tuple[float, bool]:
    """Periods per turn, and whether there are multiples."""
    if isinstance(law, Harmonic):
        return float(law.order), False
    assert isinstance(law, AngleCurve | PositionHarmonic)
    return 2.0 * math.pi / law.period, isinstance(law, AngleCurve)


def _practical(value: float, unit: str) -> str:
    if unit == "m":
        return f"{1e6 * value:.4g} µm"
    return f"{math.degrees(value) * 3600.0:.4g} arcsec"
