"""Gains of an axis: by a named rule, by margins of its exact sampled loops, or by a search for a stated goal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
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
from ..inputs.arguments import ScenarioName, checked
from ..inputs.quantities import Angle, Number
from ..inputs.schema import follow, unit_in_schema
from ..inputs.validation import did_you_mean, shown
from ..simulation.axis_form import file_schema
from ..simulation.keys import parse_override
from ..simulation.linear_units import unit_of_slides
from ..simulation.scenario import Scenario
from ..units.practical import printed
from .data import frictions, inertias, lag_sum, two_inertias
from .margins import STABLE, bandwidth_of, frequencies, margins
from .motion import with_controller
from .regimes import Axis, Regime, axis_of, regimes
from .sampled import SampledLoop

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


@dataclass(frozen=True)
class Tuning:
    """Gains of an axis, and the scenario with these gains."""

    rule: str
    why: str
    """data of the gains, in one line"""
    scenario: Scenario
    gain: float
    """K_p of the speed loop, torque of the motor per speed of the motor [N·m·s/rad]"""
    integral_gain: float
    """K_i [N·m/rad]"""
    position_gain: float | None
    """K_v [1/s]; None without a position loop"""
    filter_time: float
    """time constant of the filter of the speed reference [s]; 0: none"""
    torque_constant: float | None
    """torque constant of the motor [N·m/A], if its data contain it; for a winding per ampere of amplitude of a phase"""
    changed: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    """old and new value [SI] of each key of the scenario that differs; None where there is none"""
    linear_motor: bool = False
    """whether the motor moves a slide: gains in [N·s/m] and [N/m]"""

    @property
    def integral_time(self) -> float:
        """T_i = K_p/K_i [s]; infinite without an integrator."""
        return self.gain / self.integral_gain if self.integral_gain else math.inf

    def conventions(self) -> list[tuple[str, str, str]]:
        """The same gains as manufacturers of drives write them: (what, value with unit, where it is written so)."""
        return _conventions(
            self.gain, self.integral_gain, self.position_gain, self.filter_time, self.torque_constant, self.linear_motor
        )

    def changes(self) -> list[tuple[str, str, str]]:
        """Changes by the tuning: (key of the scenario, old value, new value), with units.

        Examples
        --------
        >>> for key, old, new in lm.tune(lm.load("position-axis"), rule="suited").changes():
        ...     print(f"{key}: {old} -> {new}")
        controller.position.gain: 10 1/s -> 25.4241 1/s
        controller.speed.gain: 0.00829 N·m·s/rad -> 0.00829231 N·m·s/rad
        controller.speed.integral_gain: 0.1266 N·m/rad -> 0.126631 N·m/rad
        """
        units = {key: self._unit(key) for key in self.changed}
        return [(key, _value(old, units[key]), _value(new, units[key])) for key, (old, new) in self.changed.items()]

    @checked
    def write(self, path: Path, source: ScenarioName | Path, overrides: Iterable[str] = ()) -> None:
        """Write the tuned scenario as a file.

        Comments and order of the source file are kept where it can carry the new values; else the file is a new one, of
        the whole scenario. Either way it loads to `scenario`, which is checked before the file gets its name.

        Parameters
        ----------
        path
            Of the new file (.toml).
        source
            Scenario file or name that the tuned scenario was loaded from.
        overrides
            Changes with which it was loaded, as ``KEY=VALUE``.

        Raises
        ------
        InputError
            The file cannot be written; nothing is left behind.

        Examples
        --------
        >>> tuned = lm.tune(lm.load("position-axis"), rule="suited")
        >>> tuned.write("tuned.toml", "position-axis")
        >>> lm.load("tuned.toml") == tuned.scenario
        True
        """
        need("tomlkit", "Writing a tuned scenario", "control")
        from ..simulation.scenario_writer import write_changed

        if path.suffix != ".toml":
            raise InputError(f"{path}: a scenario is a TOML file; its name must end in .toml")
        values = dict(map(parse_override, overrides))
        values |= {key: _with_unit(new, self._unit(key)) for key, (_, new) in self.changed.items()}
        notes = [f" by the rule {self.rule}: {self.why}"]
        notes += [f": {key}, {old} -> {new}" for key, old, new in self.changes()]
        write_changed(path, self.scenario, source, values, notes)

    def _unit(self, key: str) -> str | None:
        """The SI unit of a key of the scenario: of a slide m and N in place of rad and N*m."""
        unit = _unit(key)
        return unit and unit_of_slides(self.scenario.model_dump(), key, unit)

    def __str__(self) -> str:
        """The gains with units, in the words of a scenario and of manufacturers."""
        return "\n".join([f"rule {self.rule}: {self.why}", *_aligned(self.conventions())])


def _conventions(
    gain: float,
    integral_gain: float,
    K_v: float | None,
    filter_time: float,
    torque_constant: float | None,
    linear_motor: bool = False,
) -> list[tuple[str, str, str]]:
    if linear_motor:
        rows = [("speed loop, gain", f"{gain:.5g} N/(m/s)", "force of the motor per speed of the motor")]
    else:
        rows = [("speed loop, gain", f"{gain:.5g} N·m/(rad/s)", "torque at the motor per speed of the motor")]
        rows.append(("", f"{gain * math.pi / 30.0:.5g} N·m/rpm", "the same per revolution in a minute"))
    if torque_constant is not None:
        amps = gain / torque_constant
        if linear_motor:
            rows.append(("", f"{amps:.5g} A/(m/s)", f"with {torque_constant:.4g} N/A"))
        else:
            rows.append(("", f"{amps:.5g} A/(rad/s)", f"with {torque_constant:.4g} N·m/A"))
            rows.append(("", f"{1e3 * amps * math.pi / 30.0:.5g} mA/rpm", "the same per revolution in a minute"))
    if integral_gain:
        time = gain / integral_gain
        rows.append(("speed loop, integral time", f"{1e3 * time:.5g} ms", "K_p/K_i, reset time T_N"))
        rows.append(("", f"{1.0 / time:.5g} 1/s", "its inverse"))
        rows.append(("", f"{integral_gain:.5g} {'N/m' if linear_motor else 'N·m/rad'}", "parallel form, K_i"))
    if filter_time:
        rows.append(("filter of the speed reference", f"{1e3 * filter_time:.5g} ms", "time constant"))
    if K_v is not None:
        rows.append(("position loop, gain", f"{K_v:.5g} 1/s", "K_v"))
        rows.append(("", f"{0.06 * K_v:.5g} (m/min)/mm", "K_v of linear axes: 1/s times 0.06"))
    return rows


def _aligned(rows: list[tuple[str, str, str]]) -> list[str]:
    return [f"{what:<30} {value:<24} {where}" for what, value, where in rows]


def drive_units(scenario: Scenario, motor: str | None = None) -> list[str]:
    """The gains of an axis as manufacturers of drives write them, as lines."""
    axis = axis_of(scenario, motor)
    speed, position = axis.controller.speed, axis.controller.position
    if speed is None:
        raise InputError("the controller has no speed loop, whose gains are asked for; add one")
    filters = [f for f in speed.reference_filters if isinstance(f, LowPass)]
    time = 1.0 / (2.0 * math.pi * filters[0].frequency) if len(filters) == 1 else 0.0
    K_v = None if position is None else position.gain
    return _aligned(
        _conventions(speed.gain, speed.k_i, K_v, time, _torque_constant(axis), axis.train.is_slide(axis.motor_shaft))
    )


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
    ), f"phase margin {degrees:.4g} degrees and gain margin {GAIN_MARGIN:g} kept in {len(points)} regimes"


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
    find(
        lambda x: -judged(x)[0],
        start,
        method="COBYLA",
        constraints=[constraint],
        options=options,
    )
    kept = [x for x, (_, spare) in known.items() if spare >= -1e-3]
    if not kept:
        raise InputError(f"sensitivity_peak: no gains were found that keep {peak:g} in all regimes; permit more")
    best = max(kept, key=lambda x: known[x][0])
    gains, K_v = tuned(np.array(best))
    return (
        gains,
        f"greatest {goal} with a peak of sensitivity of at most {peak:g} in {len(points)} regimes, {len(known)} tried",
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


def _tuning(
    scenario: Scenario,
    axis: Axis,
    rule: str,
    why: str,
    gains: SpeedGains,
    K_v: float | None,
    feedforward: bool,
) -> Tuning:
    if feedforward:
        axis = with_controller(axis, **_known(axis))
    controller = axis.controller.model_copy(update=_fields(axis, gains, K_v))
    changed = scenario.with_axes({axis.motor: controller})
    where, before = scenario.controller_key(axis.motor), scenario.axes()[axis.motor]
    differences = dict(_differences(before.model_dump(), controller.model_dump(), where))
    constant = _torque_constant(axis)
    slides = axis.train.is_slide(axis.motor_shaft)
    found = (gains.gain, gains.integral_gain, K_v, gains.filter_time, constant)
    return Tuning(rule, why, changed, *found, differences, slides)


def _differences(old: Any, new: Any, key: str) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Values that differ between nested tables, by dotted key; those that are removed first."""
    if not isinstance(old, Mapping) or not isinstance(new, Mapping):
        if old != new:
            yield key, (old, new)
        return
    for name in sorted(new, key=lambda name: new[name] is not None):
        yield from _differences(old.get(name), new[name], f"{key}.{name}")


@cache
def _unit(key: str) -> str | None:
    """The SI unit of a key of a scenario, for shafts."""
    _, nodes = follow(file_schema(), tuple(key.split(".")))
    return next((unit for node in nodes if (unit := unit_in_schema(node)) is not None), None)


def _with_unit(value: Any, unit: str | None) -> Any:
    """A value as a scenario file writes it."""
    if isinstance(value, float) and unit not in (None, "", "1"):
        return f"{value!r} {unit}"
    if isinstance(value, list | tuple):
        return [{k: v for k, v in f.items() if v is not None} if isinstance(f, Mapping) else f for f in value]
    return value


def _value(value: Any, unit: str | None) -> str:
    """A value with its unit, for readers."""
    if value is None or (isinstance(value, list | tuple) and not value):
        return "none"
    if isinstance(value, list | tuple):
        return ", ".join(" ".join(f"{k} {_value(v, None)}" for k, v in f.items() if v is not None) for f in value)
    return f"{value:.6g} {printed(unit or '')}".strip() if isinstance(value, float) else str(value)
