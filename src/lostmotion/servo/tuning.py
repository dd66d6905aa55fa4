"""Gains of an axis: by a named rule, by margins of its exact sampled loops, or by a search for a stated goal."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..control.filters import LowPass
from ..control.tuning import (
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
from ..inputs.arguments import checked
from ..inputs.quantities import Angle, Number
from ..inputs.validation import did_you_mean, shown
from ..simulation.scenario import Scenario
from ..units.practical import counted
from .data import frictions, inertias, lag_sum, two_inertias
from .margins import STABLE, bandwidth_of, frequencies, margins
from .motion import with_controller
from .regimes import Axis, Regime, axis_of, regimes
from .sampled import SampledLoop
from .tuned import Amperes, Tuning, aligned, conventions, differences

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
GAIN_MARGIN = 2.0  # that the rule `margins` keeps beside the phase margin
ZERO = 4.0  # K_p/J over the zero K_i/K_p of the PI controller, by `margins`
SPAN = (1e-3, 1.0)  # of J/T_lag: the gains of the speed loop that are tried
TRIED = 40
WORST_PEAK = 1.7  # of the sensitivity, that a search permits in the speed loop by default
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
    return aligned(conventions(*gains, _torque_constant(axis), slides, _amperes(axis)))


@checked
def tune(
    scenario: Scenario,
    *,
    rule: str = "identical_damping",
    damping: Number = 0.7,
    phase_margin: Angle = math.pi / 3.0,
    goal: str = "bandwidth",
    sensitivity_peak: Number = WORST_PEAK,
    feedforward: bool = False,
    motor: str | None = None,
) -> Tuning:
    """Compute gains of the speed and the position loop of an axis.

    Parameters
    ----------
    scenario : Scenario
        A scenario with a controller. Its loops, sample times, filters and encoders count; its gains do not.
    rule : str
        ``"identical_damping"``, ``"identical_radius"`` or ``"identical_real_part"``: poles of two inertias and the spring between them.
        ``"symmetrical_optimum"``: total inertia and sum of the lags. ``"suited"``: identical damping if inertias and sampling permit
        it, else the symmetrical optimum, as in `select`. ``"margins"``: the largest gain that keeps a phase margin and a gain margin
        of 2 in all regimes of the exact sampled loop. ``"search"``: an optimum of the exact sampled response. The rule suited sets
        K_v to half of the reciprocal of the speed loop's equivalent time. The others, except search, set K_v to a quarter of the
        speed loop's lowest bandwidth.
    damping : float
        Damping ratio of the poles, for identical_damping and identical_real_part.
    phase_margin : float
        Phase margin [rad], for margins.
    goal : str
        For search: ``"bandwidth"`` of the outermost loop, the lowest of all regimes, or ``"stiffness"``, the least over frequency of
        the load torque that turns the motor by 1 rad.
    sensitivity_peak : float
        For search: largest sensitivity peak of the speed loop and of the position loop in each regime.
    feedforward : bool
        Whether to feed forward the speed of the reference, and the torques of inertia, viscous and dry friction of the scenario.
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
    if goal not in GOALS:
        raise InputError(f"goal: {shown(goal)} is not known; take {' or '.join(GOALS)}")
    if not damping > 0.0:
        raise InputError(f"damping: {damping:g} must be above 0; 0.7 is usual")
    if not 0.0 < phase_margin < 0.5 * math.pi:
        raise InputError(f"phase_margin: {phase_margin:g} rad must lie between 0 and 90 degrees")
    if not sensitivity_peak > 1.0:
        raise InputError(f"sensitivity_peak: {sensitivity_peak:g} must be above 1; 1.7 is usual")
    axis = axis_of(scenario, motor)
    if axis.controller.speed is None:
        raise InputError("the controller has no speed loop to tune; add one, with any gain")
    if feedforward and axis.controller.inverse_model is not None:
        raise InputError("feedforward: the controller has an inverse_model, which adds the same torques; leave one out")
    by: dict[str, Callable[[], tuple[SpeedGains, str]]] = {
        "symmetrical_optimum": lambda: _by_lags(axis),
        "identical_damping": lambda: _by_poles(axis, lambda d: identical_damping(d, damping), f"damping {damping:g}"),
        "identical_radius": lambda: _by_poles(axis, identical_radius, "poles at the anti-resonance"),
        "identical_real_part": lambda: _by_poles(
            axis, lambda d: identical_real_part(d, damping), f"damping {damping:g}"
        ),
        "margins": lambda: _by_margins(axis, phase_margin),
    }
    if rule == "search":
        gains, why, K_v = _by_search(axis, goal, sensitivity_peak)
    elif rule == "suited":
        gains, why, K_v = _suited(axis)
    else:
        gains, why = by[rule]()
        K_v = (
            None
            if axis.controller.position is None
            else rounded(position_gain(_lowest_bandwidth(_with(axis, gains, None), "speed")))
        )
    kept = SpeedGains(_as_in_files(gains.gain), _as_in_files(gains.integral_gain), gains.filter_time)
    return _tuning(scenario, axis, rule, why, kept, K_v, feedforward)


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


def _by_margins(axis: Axis, phase_margin: float) -> tuple[SpeedGains, str]:
    """The greatest gain below the first one that breaks a margin, with the integral time ZERO J/K_p."""
    from scipy.optimize import brentq

    J, points = sum(inertias(axis)), regimes(axis)

    def gains(K_p: float) -> SpeedGains:
        return SpeedGains(K_p, K_p * K_p / (ZERO * J))

    def spare(K_p: float) -> float:
        """Least of what is left of the margins, negative where one is not kept."""
        left = []
        tuned = _with(axis, gains(K_p), None)
        for regime in points:
            cut, closed = _loops(tuned, regime, "speed")
            m = margins(cut, closed)
            phase = math.pi if math.isnan(m.phase_margin) else m.phase_margin
            gain = math.inf if math.isnan(m.gain_margin) else m.gain_margin
            left += [phase / phase_margin - 1.0, min(gain / GAIN_MARGIN, 4.0) - 1.0] if m.stable else [-1.0]
        return min(left)

    tried = J / lag_sum(axis.controller) * np.geomspace(*SPAN, TRIED)
    kept = None
    for K_p in tried:
        if spare(float(K_p)) > 0.0:
            kept = float(K_p)
        elif kept is not None:
            kept = float(brentq(spare, kept, float(K_p), xtol=1e-6 * kept, rtol=1e-6))
            break
    if kept is None:
        raise InputError(
            f"phase_margin: no gain from {tried[0]:.3g} to {tried[-1]:.3g} N·m·s/rad keeps {math.degrees(phase_margin):.4g} degrees and "
            f"a gain margin of {GAIN_MARGIN:g} in all regimes; ask for less, or take filters or delays out of the loop"
        )
    degrees = math.degrees(phase_margin)
    return gains(
        rounded(kept)
    ), f"phase margin {degrees:.4g} degrees and gain margin {GAIN_MARGIN:g} kept in {counted(len(points), 'regime')}"


def _by_search(axis: Axis, goal: str, peak: float) -> tuple[SpeedGains, str, float | None]:
    """COBYLA over the logarithms of K_p, T_i and K_v, from gains by margins."""
    need("scipy", "The search for gains", "control")
    from scipy.optimize import minimize

    points = regimes(axis)
    cautious, _ = _by_margins(axis, math.radians(65.0))
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
        raise InputError(f"sensitivity_peak: no gains were found that keep {peak:g} in all regimes; permit more")
    best = max(kept, key=lambda x: known[x][0])
    gains, K_v = tuned(np.array(best))
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
                values.append(bandwidth_of(f, closed.closed_loop).three_decibels)
            else:
                most = float(np.abs(closed.compliance(f, axis.motor_shaft, axis.shaft)).max())
                values.append(1.0 / most if most > 0.0 else math.inf)  # not where the load sticks
    least = min(values)
    return (math.log(least) if least > 0.0 else -50.0), min(spare)


def _loops(axis: Axis, regime: Regime, loop: str) -> tuple[SampledLoop, SampledLoop]:
    return SampledLoop(axis, regime, loop, True), SampledLoop(axis, regime, loop, False)


def _lowest_bandwidth(axis: Axis, loop: str) -> float:
    """The lower of that at -3 dB and at -90 degrees, the lowest of all regimes [Hz].

    Raises
    ------
    InputError
        The loop is unstable in a regime.
    """
    found = []
    for regime in regimes(axis):
        closed = SampledLoop(axis, regime, loop, False)
        if np.abs(np.linalg.eigvals(closed.transition)).max() >= STABLE:
            raise InputError(
                f"rule: its gains are unstable in the regime {regime.name}, where the exact sampled loop has delays and compliance that "
                'the rule does not know; take rule = "margins"'
            )
        b = bandwidth_of(frequencies(closed), closed.closed_loop)
        found += [x for x in (b.three_decibels, b.ninety_degrees) if not math.isnan(x)]
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
    where, before = scenario.controller_key(axis.motor), scenario.axes()[axis.motor]
    changes = dict(differences(before.model_dump(), controller.model_dump(), where))
    constant = _torque_constant(axis)
    slides = axis.train.is_slide(axis.motor_shaft)
    found = (gains.gain, gains.integral_gain, K_v, gains.filter_time, constant)
    return Tuning(rule, why, changed, *found, changes, slides, _amperes(axis))
