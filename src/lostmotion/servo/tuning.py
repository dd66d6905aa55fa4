"""Gains of an axis: by a named rule, by margins of its exact sampled loops, or by a search for a stated goal."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..control.filters import LowPass
from ..control.gain_rules import (
    SpeedGains,
    TwoInertias,
    identical_damping,
    identical_radius,
    identical_real_part,
    position_gain,
    suited,
    symmetrical_optimum,
)
from ..errors import InputError, need
from ..inputs.argument_checks import ScenarioName, checked
from ..inputs.quantities import Angle, Frequency, Number
from ..inputs.refusal_messages import did_you_mean, shown
from ..simulation.scenario.scenario import Scenario
from ..units.practical import counted
from .axis_runs import with_controller
from .linear_regimes import Axis, Regime, axis_of, regimes
from .linear_sampled_loop import LinearLoop
from .margins import STABLE, bandwidth_of, frequencies, margins
from .tuning_data import frictions, inertias, lag_sum, two_inertias
from .tuning_result import Amperes, Tuning, aligned, differences, load_untuned

RULES = (
    "suited",
    "symmetrical_optimum",
    "identical_damping",
    "identical_radius",
    "identical_real_part",
    "margins",
    "search",
)
GOALS = ("bandwidth", "stiffness")
SMALLER, STEPS = 0.9, 60  # share of a gain of the position loop that is tried next, and how many are
LITTLE = math.radians(30.0)  # phase margin below which a rule has a comment
ZERO = 4.0  # K_p/J over the zero K_i/K_p of the PI controller, by `margins`
SPAN = (1e-3, 1.0)  # of J/T_lag: the gains of the speed loop that are tried
TRIED = 40
OF_RULES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "damping": (0.7, ("identical_damping", "identical_real_part")),
    "phase_margin": (math.pi / 3.0, ("margins",)),
    "gain_margin": (2.0, ("margins",)),
    "bandwidth": (None, ("margins",)),
    "goal": ("bandwidth", ("search",)),
    "sensitivity_peak": (1.7, ("search",)),
}
"""default of what some rules are given, and these rules"""
EVALUATIONS = 80


def drive_units(scenario: Scenario, motor: str | None = None) -> list[str]:
    """The gains of an axis as manufacturers of drives write them, as lines."""
    axis = axis_of(scenario, motor)
    speed, position = axis.controller.speed, axis.controller.position
    if speed is None:
        raise InputError("the controller has no speed loop, whose gains are asked for; add one")
    filters = [f for f in speed.reference_filters if isinstance(f, LowPass)]
    time = 1.0 / (2.0 * math.pi * filters[0].frequency) if len(filters) == 1 else 0.0
    K_v = None if position is None else position.gain
    gains = speed.gain, speed.k_i, K_v, time
    slides = axis.train.is_slide(axis.motor_shaft)
    as_found = Tuning("", "", axis.scenario, *gains, _torque_constant(axis), {}, slides, _amperes(axis))
    return aligned(as_found.conventions())


@checked
def tune(
    scenario: Scenario | ScenarioName | Path,
    *,
    rule: str = "identical_damping",
    damping: Number | None = None,
    phase_margin: Angle | None = None,
    gain_margin: Number | None = None,
    bandwidth: Frequency | None = None,
    goal: str | None = None,
    sensitivity_peak: Number | None = None,
    feedforward: bool = False,
    motor: str | None = None,
) -> Tuning:
    """Compute gains of the speed and the position loop of an axis.

    Parameters
    ----------
    scenario : Scenario or str or Path
        A scenario with a controller. Its loops, sample times, filters and encoders count; its gains do not, and a file may leave
        them out.
    rule : str
        ``"identical_damping"``, ``"identical_radius"`` or ``"identical_real_part"``: poles of two inertias and the spring between them.
        ``"symmetrical_optimum"``: total inertia and sum of the lags. ``"suited"``: identical damping if inertias and sampling permit
        it, else the symmetrical optimum, as in `select`. ``"margins"``: the largest gain that keeps a phase and a gain
        margin in all regimes of the exact sampled loop, or the smallest that also has a bandwidth. ``"search"``: an optimum of the exact sampled response. The rule suited sets
        K_v to half of the reciprocal of the speed loop's equivalent time. The others, except search, set K_v to a quarter of the
        speed loop's lowest bandwidth.
    damping : float, optional
        For identical_damping and identical_real_part: damping ratio of the poles. Default: 0.7.
    phase_margin : float, optional
        For margins: phase margin [rad]. Default: 60 degrees.
    gain_margin : float, optional
        For margins: gain margin, a factor. Default: 2.
    bandwidth : float, optional
        For margins: bandwidth of the speed loop, at -3 dB or -90 degrees, the lowest of all regimes [Hz]. Default: as large as the
        margins permit.
    goal : str, optional
        For search: ``"bandwidth"`` (default) of the outermost loop, the lowest of all regimes, or ``"stiffness"``, the least over frequency of
        the load torque that turns the motor by 1 rad.
    sensitivity_peak : float, optional
        For search: largest sensitivity peak of the speed loop and of the position loop in each regime. Default: 1.7.
    feedforward : bool
        Whether to feed forward the speed of the reference, and the torques of inertia, viscous and dry friction of the scenario, with
        the losses of gears without load.
    motor : str, optional
        Name of the motor whose controller is tuned. Default: the only one.

    Returns
    -------
    Tuning
        The gains, and the scenario with these gains.

    Raises
    ------
    InputError
        The rule is unknown, or no gains satisfy it.

    Examples
    --------
    >>> import lostmotion as lm
    >>> tuned = lm.tune(lm.load("speed-axis"), rule="suited")
    >>> f"{tuned.scenario.controller.speed.gain:.4g} N·m/(rad/s)"
    '0.01991 N·m/(rad/s)'
    """
    if rule not in RULES:
        hint = did_you_mean(str(rule), RULES, f"take one of {', '.join(RULES)}")
        raise InputError(f"rule: {shown(rule)} is not known; {hint}")
    given: dict[str, Any] = {
        "damping": damping,
        "phase_margin": phase_margin,
        "gain_margin": gain_margin,
        "bandwidth": bandwidth,
        "goal": goal,
        "sensitivity_peak": sensitivity_peak,
    }
    asked = {key: OF_RULES[key][0] if value is None else value for key, value in given.items()}
    _check(rule, {key: value for key, value in given.items() if value is not None})
    missing: list[str] = []
    if not isinstance(scenario, Scenario):
        scenario = load_untuned(scenario, (), missing)
    axis = axis_of(scenario, motor)
    if axis.controller.speed is None:
        raise InputError("the controller has no speed loop to tune; add one, in which the gain may be missing")
    if feedforward and axis.controller.inverse_model is not None:
        raise InputError("feedforward: the controller has an inverse_model, which adds the same torques; leave one out")
    damped = f"damping {asked['damping']:g}"
    by: dict[str, Callable[[], tuple[SpeedGains, str]]] = {
        "symmetrical_optimum": lambda: _by_lags(axis),
        "identical_damping": lambda: _by_poles(axis, lambda d: identical_damping(d, asked["damping"]), damped),
        "identical_radius": lambda: _by_poles(axis, identical_radius, "poles at the anti-resonance"),
        "identical_real_part": lambda: _by_poles(axis, lambda d: identical_real_part(d, asked["damping"]), damped),
        "margins": lambda: _by_margins(axis, asked["phase_margin"], asked["gain_margin"], asked["bandwidth"]),
    }
    if rule == "search":
        gains, why, K_v = _by_search(axis, asked["goal"], asked["sensitivity_peak"])
    elif rule == "suited":
        gains, why, K_v = _suited(axis)
    else:
        gains, why = by[rule]()
        K_v = (
            None
            if axis.controller.position is None
            else rounded(position_gain(_lowest_bandwidth(_with(axis, gains, None), "speed")))
        )
    if rule == "margins" and K_v is not None:
        K_v, note = _position_by_margins(axis, gains, K_v, asked["phase_margin"], asked["gain_margin"])
        why += note
    kept = SpeedGains(_as_in_files(gains.gain), _as_in_files(gains.integral_gain), gains.filter_time)
    if rule not in ("margins", "search"):
        why = f"{why}; {_reached(_with(axis, gains, K_v))}"
    return _tuning(scenario, axis, rule, why, kept, K_v, feedforward).without(missing)


def _check(rule: str, given: Mapping[str, Any]) -> None:
    """Refuse what the rule does not take, and values out of range."""
    for key, value in given.items():
        rules = OF_RULES[key][1]
        if rule not in rules:
            raise InputError(f"the rule {rule} does not take it; leave it out, or take {' or '.join(rules)}", key)
        if key == "goal" and value not in GOALS:
            raise InputError(f"{shown(value)} is not known; take {' or '.join(GOALS)}", key)
        if key == "phase_margin" and not 0.0 < value < 0.5 * math.pi:
            hint = f'; did you mean "{value:g} deg"?' if 0.5 * math.pi < value < 90.0 else ""
            raise InputError(f"{value:g} rad must lie between 0 and 90 degrees{hint}", key)
        least = 1.0 if key in ("gain_margin", "sensitivity_peak") else 0.0
        if key != "goal" and not value > least:
            usual = "" if OF_RULES[key][0] is None else f"; {OF_RULES[key][0]:g} is usual"
            raise InputError(f"{value:g} must be above {least:g}{usual}", key)


def _as_in_files(value: float) -> float:
    """A gain to six significant digits, which a file can carry."""
    return float(f"{value:.6g}")


# --- rules ---


def _suited(axis: Axis) -> tuple[SpeedGains, str, float | None]:
    main, position = axis.main_gear(), axis.controller.position
    drive = TwoInertias(*inertias(axis), math.inf) if main is None else two_inertias(axis)
    found = suited(drive, lag_sum(axis.controller), axis.controller.loop_time("position"))
    return found.speed, f"{found.rule}, which suits this drive", None if position is None else found.position


def _by_lags(axis: Axis) -> tuple[SpeedGains, str]:
    J, lag = sum(inertias(axis)), lag_sum(axis.controller)
    return symmetrical_optimum(J, lag), f"total inertia {J:.4g} kg·m² at the motor, sum of the lags {1e3 * lag:.4g} ms"


def _by_poles(axis: Axis, rule: Callable[[Any], SpeedGains], what: str) -> tuple[SpeedGains, str]:
    d = two_inertias(axis)
    hertz = d.antiresonance / (2.0 * math.pi)
    return rule(
        d
    ), f"{what}, inertia ratio {d.inertia_ratio:.4g}, anti-resonance {hertz:.4g} Hz, secant stiffness to rated torque"


def rounded(gain: float) -> float:
    """A gain that a search found, to four significant digits.

    Eigenvalues and minima of libraries differ in their last digits from processor to processor; what is simulated with the
    gain must not.
    """
    return float(f"{gain:.4g}")


@dataclass(frozen=True)
class _Reached:
    """Least margins of some loops in all regimes."""

    phase: float  # [rad]; infinite where nothing crosses
    gain: float
    where: str  # loop and regime of the least phase margin, or of what is unstable
    stable: bool = True

    def __str__(self) -> str:
        """Text such as ``53 degrees and 8.2 dB (speed loop, first stiffness)``."""
        if not self.stable:
            return f"no stable loop ({self.where})"
        phase = "no crossover" if math.isinf(self.phase) else f"{math.degrees(self.phase):.3g} degrees"
        return phase if math.isinf(self.gain) else f"{phase} and {_decibels(self.gain)} ({self.where})"

    def spare(self, phase: float, gain: float) -> float:
        """Least reserve over two margins, as a share of them; negative if one is not kept."""
        return min(min(self.phase, math.pi) / phase - 1.0, min(self.gain / gain, 4.0) - 1.0) if self.stable else -1.0


def _decibels(factor: float) -> str:
    return f"{round(20.0 * math.log10(factor), 1):g} dB"


def _least(axis: Axis, points: list[Regime], loops: Sequence[str]) -> _Reached:
    """The least margins of these loops."""
    phases, gains = [(math.inf, "")], [math.inf]
    for regime in points:
        for loop in loops:
            m, where = margins(*_loops(axis, regime, loop)), f"{loop} loop, {regime.name}"
            if not m.stable:
                return _Reached(0.0, 0.0, where, stable=False)
            phases += [] if math.isnan(m.phase_margin) else [(m.phase_margin, where)]
            gains += [] if math.isnan(m.gain_margin) else [m.gain_margin]
    phase, where = min(phases)
    return _Reached(phase, min(gains), where)


def _reached(axis: Axis) -> str:
    """The least margins of the gains of a formula, which it does not know."""
    found = _least(axis, regimes(axis), axis.loops[axis.loops.index("speed") :])
    little = "" if found.stable and found.phase >= LITTLE else ", which is little: the rule margins keeps more"
    return f"least margins {found}{little}" if found.stable else f"unstable ({found.where}): take the rule margins"


def _by_margins(axis: Axis, phase: float, gain: float, bandwidth: float | None) -> tuple[SpeedGains, str]:
    """The greatest gain below the first one that breaks a margin, with the integral time ZERO J/K_p. With a bandwidth the smallest
    gain that reaches it."""
    from scipy.optimize import brentq

    J, points = sum(inertias(axis)), regimes(axis)

    def tuned(K_p: float) -> Axis:
        return _with(axis, SpeedGains(K_p, K_p * K_p / (ZERO * J)), None)

    def spare(K_p: float) -> float:
        return _least(tuned(K_p), points, ("speed",)).spare(phase, gain)

    tried = [float(K_p) for K_p in J / lag_sum(axis.controller) * np.geomspace(*SPAN, TRIED)]
    left = {}
    kept = None
    for K_p in tried:
        left[K_p] = spare(K_p)
        if left[K_p] > 0.0:
            kept = K_p
        elif kept is not None:
            kept = float(brentq(spare, kept, K_p, xtol=1e-6 * kept, rtol=1e-6))
            break
    what = f"{math.degrees(phase):.4g} degrees and a gain margin of {_decibels(gain)}"
    if kept is None:
        best = max(left, key=lambda K_p: left[K_p])
        worst = _least(tuned(best), points, ("speed",))
        text = f"no gain keeps {what} in {counted(len(points), 'regime')}; the best, {best:.3g}, reaches {worst}"
        raise InputError(f"{text}; ask for less, or take filters or delays out of the loop", "phase_margin")
    if bandwidth is not None:
        lacks = [_lowest_bandwidth(tuned(K_p), "speed") - bandwidth for K_p in (tried[0], kept)]
        if lacks[1] < 0.0:
            largest = f"the largest gain that keeps {what} has {bandwidth + lacks[1]:.3g} Hz"
            raise InputError(f"{bandwidth:.4g} Hz is out of reach: {largest}; ask for less", "bandwidth")
        kept = (
            tried[0]
            if lacks[0] >= 0.0
            else float(
                brentq(lambda K_p: _lowest_bandwidth(tuned(K_p), "speed") - bandwidth, tried[0], kept, rtol=1e-6)
            )
        )
    K_p = rounded(kept)
    return SpeedGains(K_p, K_p * K_p / (ZERO * J)), f"phase margin {what} kept in {counted(len(points), 'regime')}"


def _position_by_margins(axis: Axis, speed: SpeedGains, K_v: float, phase: float, gain: float) -> tuple[float, str]:
    """The gain of the position loop, or a smaller one that keeps the margins: an encoder on the load sees the resonance."""
    points = regimes(axis)
    for tried in K_v * SMALLER ** np.arange(STEPS):
        if _least(_with(axis, speed, float(tried)), points, ("position",)).spare(phase, gain) >= 0.0:
            note = "" if tried == K_v else f", K_v {tried / K_v:.2g} of its usual value for them"
            return rounded(float(tried)), note
    text = (
        f"no gain of the position loop keeps {math.degrees(phase):.4g} degrees and a gain margin of {_decibels(gain)}"
    )
    raise InputError(f"{text}; ask for less, or close the loop with the encoder of the motor", "phase_margin")


def _by_search(axis: Axis, goal: str, peak: float) -> tuple[SpeedGains, str, float | None]:
    """COBYLA over the logarithms of K_p, T_i and K_v, from gains by margins."""
    need("scipy", "The search for gains", "control")
    from scipy.optimize import minimize

    points = regimes(axis)
    cautious, _ = _by_margins(axis, math.radians(65.0), 2.0, None)
    start = np.log([cautious.gain, cautious.gain / cautious.integral_gain])
    if axis.controller.position is not None:
        start = np.append(start, math.log(position_gain(_lowest_bandwidth(_with(axis, cautious, None), "speed"))))
    known: dict[tuple[float, ...], tuple[float, float]] = {}

    def tuned(x: np.ndarray) -> tuple[SpeedGains, float | None]:
        K_p, T_i, *K_v = (rounded(float(value)) for value in np.exp(x))
        return SpeedGains(K_p, K_p / T_i), K_v[0] if K_v else None

    def judged(x: np.ndarray) -> tuple[float, float]:
        """Logarithm of the goal, and what is left of the peak of sensitivity."""
        key = tuple(x.tolist())
        if key not in known:
            known[key] = _judge(_with(axis, *tuned(x)), points, goal, peak)
        return known[key]

    constraint: Any = {"type": "ineq", "fun": lambda x: judged(x)[1]}
    options: Any = {"maxiter": EVALUATIONS, "rhobeg": 0.7, "tol": 1e-3}
    find: Any = minimize  # its stubs know only functions without constraints
    find(lambda x: -judged(x)[0], start, method="COBYLA", constraints=[constraint], options=options)
    kept = [x for x, (_, spare) in known.items() if spare >= -1e-3]
    if not kept:
        reached = max((spare for _, spare in known.values()), default=-math.inf)
        best = f"; the best reach {peak * (1.0 - reached):.4g}" if reached > -1.0 else ""
        raise InputError(
            f"no gains were found that keep {peak:g} in all regimes{best}; permit more", "sensitivity_peak"
        )
    gains, K_v = tuned(np.array(max(kept, key=lambda x: known[x][0])))
    return (
        gains,
        f"greatest {goal} with a peak of sensitivity of at most {peak:g} in {counted(len(points), 'regime')}, {len(known)} tried",
        K_v,
    )


def _judge(axis: Axis, points: list[Regime], goal: str, peak: float) -> tuple[float, float]:
    values, spare = [], []
    outer = axis.loops[-1]
    for regime in points:
        for loop in axis.loops[axis.loops.index("speed") :]:
            cut, closed = _loops(axis, regime, loop)
            largest = np.abs(np.linalg.eigvals(closed.transition)).max()
            f = frequencies(cut, closed)
            spare.append(
                1.0 - float((1.0 / np.abs(1.0 + cut.open_loop(f))).max()) / peak
                if largest < STABLE
                else -float(largest)
            )
            if loop != outer:
                continue
            if goal == "bandwidth":
                if regime.load_moves:
                    values += _three_decibels(closed, f)
            else:
                most = float(np.abs(closed.compliance(f, axis.motor_shaft, axis.shaft)).max())
                values.append(1.0 / most if most > 0.0 else math.inf)  # not where the load sticks
    least = min(values, default=0.5 / axis.controller.loop_time(outer))
    return (math.log(least) if least > 0.0 else -50.0), min(spare)


def _loops(axis: Axis, regime: Regime, loop: str) -> tuple[LinearLoop, LinearLoop]:
    return LinearLoop(axis, regime, loop, True), LinearLoop(axis, regime, loop, False)


def _three_decibels(closed: LinearLoop, f: np.ndarray) -> list[float]:
    """Bandwidth of a closed loop at -3 dB [Hz]; nothing where the measured value does not move, as behind an open gap."""
    found = bandwidth_of(f, closed.closed_loop)
    if found.resonance_peak == 0.0:
        return []
    if math.isnan(found.three_decibels):
        below = abs(closed.closed_loop(f[:1])[0]) < math.sqrt(0.5)
        return [float(f[0] if below else 0.5 / closed.sample_time)]
    return [found.three_decibels]


def _lowest_bandwidth(axis: Axis, loop: str) -> float:
    """The lower of that at -3 dB and at -90 degrees, the lowest of all regimes in which the load moves [Hz].

    While the load sticks, the speed loop turns the motor against the spring of the gear. The gain from its reference to the speed
    is then K_i/(K_i + k/i^2) at low frequencies, which is no bandwidth.

    Raises InputError: the loop is unstable in a regime.
    """
    found = []
    for regime in regimes(axis):
        closed = LinearLoop(axis, regime, loop, False)
        if np.abs(np.linalg.eigvals(closed.transition)).max() >= STABLE:
            raise InputError(
                f"rule: its gains are unstable in the regime {regime.name}, where the exact sampled loop has delays and compliance that "
                'the rule does not know; take rule = "margins"'
            )
        if not regime.load_moves:
            continue
        f = frequencies(closed)
        b = bandwidth_of(f, closed.closed_loop)
        found += [x for x in (b.three_decibels, b.ninety_degrees) if not math.isnan(x)]
        found += (
            [float(f[0])] if abs(closed.closed_loop(f[:1])[0]) < math.sqrt(0.5) else []
        )  # it falls below all of them
    return min(found, default=0.5 / axis.controller.loop_time(loop))


# --- into the scenario ---


def _fields(axis: Axis, gains: SpeedGains, K_v: float | None) -> dict[str, Any]:
    speed, position = axis.controller.speed, axis.controller.position
    assert speed is not None
    update: dict[str, Any] = {"gain": gains.gain, "integral_gain": gains.integral_gain, "integral_time": None}
    if gains.filter_time:
        corner = LowPass(kind="low_pass", frequency=_as_in_files(1.0 / (2.0 * math.pi * gains.filter_time)))
        update["reference_filters"] = (corner,)
    fields: dict[str, Any] = {"speed": speed.model_copy(update=update)}
    if position is not None and K_v is not None:
        fields["position"] = position.model_copy(update={"gain": K_v})
    return fields


def _with(axis: Axis, gains: SpeedGains, K_v: float | None) -> Axis:
    return with_controller(axis, **_fields(axis, gains, K_v))


def _known(axis: Axis) -> dict[str, Any]:
    """Feedforward values that the scenario states."""
    viscous, dry = frictions(axis)
    torques = {"inertia": sum(inertias(axis)), "viscous_friction": viscous, "friction_torque": dry}
    known = axis.controller.feedforward.model_copy(update={key: _as_in_files(x) for key, x in torques.items()})
    position = axis.controller.position
    ahead = {} if position is None else {"position": position.model_copy(update={"feedforward": 1.0})}
    return {"feedforward": known, **ahead}


def _torque_constant(axis: Axis) -> float | None:
    motor = axis.train.motors[axis.motor]
    if motor.winding is not None:
        return motor.winding.phase_values().torque_constant
    return None if motor.limits is None else motor.limits.torque_constant


def _amperes(axis: Axis) -> Amperes:
    """The amperes of that constant."""
    motor = axis.train.motors[axis.motor]
    return "peak" if motor.winding is not None else "dc" if motor.kind == "dc" else "of the data sheet"


def _tuning(
    scenario: Scenario, axis: Axis, rule: str, why: str, gains: SpeedGains, K_v: float | None, feedforward: bool
) -> Tuning:
    if feedforward:
        axis = with_controller(axis, **_known(axis))
    controller = axis.controller.model_copy(update=_fields(axis, gains, K_v))
    changed = scenario.with_axes({axis.motor: controller})
    where = scenario.key_in_file(scenario.controller_key(axis.motor))
    before = scenario.axes()[axis.motor]
    changes = dict(differences(before.model_dump(), controller.model_dump(), where))
    constant = _torque_constant(axis)
    slides = axis.train.is_slide(axis.motor_shaft)
    found = (gains.gain, gains.integral_gain, K_v, gains.filter_time, constant)
    return Tuning(rule, why, changed, *found, changes, slides, _amperes(axis))
