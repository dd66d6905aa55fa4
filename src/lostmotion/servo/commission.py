"""The sheet of an axis: all that is looked at when it is commissioned."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.doubts import doubt_window
from ..inputs.quantities import Angle
from ..response.standstill import moving_input
from ..simulation.scenario import Scenario
from ..units.practical import practical
from .certificate import HuntingCertificate, certified, certified_in_words
from .margins import Bandwidth, Instability, Margins, bandwidth_of, frequencies, instability, margins
from .motion import (
    STEPPED,
    Following,
    LimitCycle,
    Settling,
    StepResponse,
    default_window,
    following,
    limit_cycle,
    settling,
    step_response,
)
from .regimes import Axis, Regime, axis_of, regimes
from .sampled import SampledLoop


@dataclass(frozen=True)
class LoopSheet:
    """One loop in one regime, linear at the samples of the loop."""

    loop: str
    regime: str
    sample_time: float
    """[s]"""
    margins: Margins
    bandwidth: Bandwidth
    """from reference to measured value, both of the reference's shaft, nothing fed forward"""
    with_feedforward: Bandwidth | None
    """bandwidth of the outermost loop, if something is fed forward"""
    frequency: np.ndarray
    """[Hz]"""
    open_loop: np.ndarray
    """L(exp(j w T))"""
    closed_loop: np.ndarray
    """closed loop as for the bandwidth"""
    unstable: Instability | None
    """pole of the complete loop outside the unit circle, if this loop alone has one"""

    @property
    def verdict(self) -> str:
        """ "yes", "NO", or "with outer loops" of a loop that is stable only with those around it closed."""
        if self.margins.stable:
            return "yes"
        return "NO" if self.unstable is not None else "with outer loops"


@dataclass(frozen=True)
class Stiffness:
    """Magnitude of M_Z/phi over frequency in one regime, all loops closed."""

    regime: str
    shaft: str
    """shaft of load torque and angle"""
    frequency: np.ndarray
    """[Hz]"""
    stiffness: np.ndarray
    """[N·m/rad], of a slide [N/m]"""
    slides: bool = False

    def shown(self, value: float) -> str:
        """A stiffness with its unit."""
        return f"{1e-6 * value:.4g} N/µm" if self.slides else f"{value:.4g} N·m/rad"

    @property
    def least(self) -> tuple[float, float]:
        """Least stiffness [N·m/rad], of a slide [N/m], and its frequency [Hz]."""
        k = int(np.argmin(self.stiffness))
        return float(self.stiffness[k]), float(self.frequency[k])


@dataclass(frozen=True)
class ServoReport:
    """The report of one axis."""

    scenario: Scenario
    motor: str
    regimes: Mapping[str, str]
    """meaning by name"""
    loops: tuple[LoopSheet, ...]
    steps: tuple[StepResponse, ...]
    following: Following
    window: float
    """window of settling [rad]"""
    settling: tuple[Settling, ...]
    stiffness: tuple[Stiffness, ...]
    limit_cycle: LimitCycle | None
    """None without a position loop"""
    certificate: HuntingCertificate | None = None
    """proof of whether a stuck contact hunts; None without a position loop, or if an input never comes to rest"""
    motor_unit: str = "rad"
    """motor unit of the motor's angle; m of a linear motor"""
    load_unit: str = "rad"
    """load unit of the angle of the reference's shaft; m of a slide"""

    @property
    def stable(self) -> bool:
        """Whether the complete loop is stable in each regime."""
        return not self.instabilities()

    def instabilities(self) -> list[Instability]:
        """Poles of the complete loop outside the unit circle, one for each regime that has some."""
        return list(dict.fromkeys(row.unstable for row in self.loops if row.unstable is not None))

    def summary(self) -> list[tuple[str, str]]:
        """The verdict on the axis, as (what, value): stability, worst margins, error, settling, stiffness, hunting."""
        found = self.instabilities()
        f = self.following
        rows = [
            ("verdict", f"UNSTABLE: {'; '.join(map(str, found))}" if found else f"stable in {self._regimes()}"),
            ("worst margins", self.least_margins() or "none: no gain crosses 1"),
            ("following error", f"peak {_shown(f.peak, f.unit)}, rms {_shown(f.rms, f.unit)}"),
        ]
        if self.settling:
            rows.append(("settling", self._worst_settling()))
        if self.stiffness:
            weakest = min(self.stiffness, key=lambda s: s.least[0])
            least, at = weakest.least
            rows.append(("stiffness", f"at least {weakest.shown(least)}, at {at:.3g} Hz ({weakest.regime})"))
        rows.append(("at rest", self.rest()))
        if self.certificate is not None:
            rows.append(("certificate", certified_in_words(self.certificate)))
        return rows

    def _regimes(self) -> str:
        names = ", ".join(self.regimes)
        return f"its one regime ({names})" if len(self.regimes) == 1 else f"all {len(self.regimes)} regimes ({names})"

    def least_margins(self) -> str:
        """The least margins of all loops and regimes; empty where no loop has one."""
        words = []
        for what, key, scale, unit in (
            ("phase", "phase_margin", math.degrees, "°"),
            ("gain", "gain_margin", decibels, " dB"),
        ):
            known = [row for row in self.loops if math.isfinite(getattr(row.margins, key))]
            if known:
                row = min(known, key=lambda r: getattr(r.margins, key))
                words.append(f"{what} {scale(getattr(row.margins, key)):.3g}{unit} ({row.loop} loop, {row.regime})")
        return ", ".join(words)

    def _worst_settling(self) -> str:
        """The longest time of all moves; where one does not settle, why."""
        inside = f"within {_shown(self.window, self.following.unit)}"
        never = [s for s in self.settling if math.isnan(s.time)]
        if not never:
            return f"{inside} in at most {1e3 * max(s.time for s in self.settling):.4g} ms"
        worst = max(never, key=lambda s: abs(s.remaining))
        return f"not {inside}: {self._why(worst)}"

    def _why(self, s: Settling) -> str:
        """Why a move does not settle, in one sentence."""
        left, twist = abs(s.remaining), abs(s.unseen)
        if math.isnan(left):
            return "the run ends with the move"
        text = f"the error is still {_shown(left, self.following.unit, 3)} before the next move or the end"
        if left <= self.window:
            return f"it leaves the window again; {text}"
        if twist > 0.5 * left:
            where = "the motor" if self.following.encoder == "motor" else f"the shaft {self.following.encoder}"
            return f"{text}, as an encoder on {where} does not see {_shown(twist, self.following.unit, 3)} of static twist under load"
        return f"{text}, which the loop measures and is still removing; raise its gains, or allow more time"

    def _place(self, position: float) -> str:
        return f"{math.degrees(position):.5g} deg" if self.load_unit == "rad" else f"{1e3 * position:.5g} mm"

    def motion_rows(self) -> list[tuple[str, str]]:
        """Following, settling, stiffness and rest, as (what, value)."""
        f = self.following
        rows = [
            ("following error over the run, peak", _shown(f.peak, f.unit)),
            ("following error over the run, rms", _shown(f.rms, f.unit)),
        ]
        for s in self.settling:
            inside = f"{1e3 * s.time:.4g} ms" if not math.isnan(s.time) else f"not: {self._why(s)}"
            within = _shown(self.window, self.load_unit)
            rows.append((f"settled within {within} after the move to {self._place(s.to)}", inside))
        for k in self.stiffness:
            least, at = k.least
            rows.append((f"least stiffness against load, {k.regime}", f"{k.shown(least)} at {at:.3g} Hz"))
        return [*rows, ("at rest", self.rest())]

    def rest(self) -> str:
        """Behaviour of the axis at rest, in one line."""
        cycle = self.limit_cycle
        if cycle is None:
            return "not examined: the axis has no position loop"
        whole = cycle.whole
        if not whole.cycles:
            return f"{'no limit cycle' if whole.verdict == 'at rest' else whole.verdict}: {whole.described()}"
        frequency = "irregular" if math.isnan(whole.frequency) else f"{whole.frequency:.4g} Hz"
        motor, load = _shown(whole.motor_amplitude, self.motor_unit), _shown(whole.amplitude, self.load_unit)
        text = f"limit cycle: ±{motor} at the motor, ±{load} at the load, {frequency}"
        return f"hunts, {text}; cause: {' and '.join(cycle.causes) or 'none of ' + ', '.join(cycle.without)}"


@checked
def commission(
    scenario: Scenario,
    *,
    motor: str | None = None,
    window: Angle | None = None,
    progress: Callable[[], None] = lambda: None,
) -> ServoReport:
    """Compute margins, steps, following error, settling, stiffness and limit cycles of an axis.

    Margins, bandwidths and stiffness are those of the exact linear sampled loop in each regime of the plant (segment of the torsion
    curve, twist or load stuck). The plant is propagated by the matrix exponential over a base period, with sample times and delays
    as they are. A loop with several sample times is a time-invariant system over that of its outermost loop. Field-oriented control
    is linear about the steady motion of the regime. A loop is cut at the measured value of its controller; the loops within it are
    closed, those around it open. Limits, quantisation and dead zones count in the runs only: steps, following, settling and rest are
    exact simulations of the scenario.

    Parameters
    ----------
    scenario : Scenario
        A scenario with a controller.
    motor : str, optional
        Name of the motor whose controller is examined. Default: the only one.
    window : float, optional
        Window of the settled position [rad]. Default: four encoder steps at the reference's shaft, at least a thousandth of the
        reference's range.
    progress : callable
        Called `work(scenario)` times.

    Returns
    -------
    ServoReport
        The report. `ServoReport.summary` returns the verdict; notebooks show the page.

    Raises
    ------
    InputError
        There is no controller, its sample times do not nest, or the window is not above 0.
    SolverError
        A run has no continuation.

    Examples
    --------
    >>> import lostmotion as lm
    >>> report = lm.commission(lm.load("speed-axis"))
    >>> report.summary()[0]
    ('verdict', 'stable in all 4 regimes (first stiffness, last stiffness, twist stuck, load stuck)')
    """
    axis = axis_of(scenario, motor)
    if window is not None and not window > 0.0:
        raise InputError(f"window: {window:g} {axis.measured['position'][1]} must be above 0")
    points = regimes(axis)
    loops, steps = [], []
    for name in axis.loops:
        for regime in points:
            loops.append(loop_sheet(axis, regime, name))
        if name in STEPPED:
            steps.append(step_response(axis, name))
        progress()
    followed = following(axis)
    wide = default_window(axis) if window is None else window
    if window is not None:
        doubt_window(window, float(np.ptp(followed.reference)), followed.unit, "window")
    progress()
    stiffness = tuple(_stiffness(axis, regime) for regime in points) if axis.loops[-1] == "position" else ()
    cycle = limit_cycle(axis)
    progress()
    certificate = None
    if cycle is not None and not moving_input(axis.scenario) and not scenario.continuous():
        certificate = certified(axis, lambda: cycle.whole.verdict == "at rest")
    return ServoReport(
        scenario=scenario,
        motor=axis.motor,
        regimes={regime.name: regime.meaning for regime in points},
        loops=tuple(loops),
        steps=tuple(steps),
        following=followed,
        window=wide,
        settling=tuple(settling(axis, followed, wide)),
        stiffness=stiffness,
        limit_cycle=cycle,
        certificate=certificate,
        motor_unit=axis.train.angle_unit(axis.motor_shaft),
        load_unit=axis.train.angle_unit(axis.shaft),
    )


def work(scenario: Scenario, motor: str | None = None) -> int:
    """Number of progress reports of `commission`."""
    return len(axis_of(scenario, motor).loops) + 2


def loop_sheet(axis: Axis, regime: Regime, loop: str) -> LoopSheet:
    """Report of one loop in one regime."""
    cut, closed = (SampledLoop(axis, regime, loop, is_cut) for is_cut in (True, False))
    f = frequencies(cut, closed)
    fed = None
    c = axis.controller
    ahead = (
        c.position.feedforward if c.position is not None else 0.0,
        c.feedforward.inertia,
        c.feedforward.viscous_friction,
    )
    if loop == c.reference.kind and any(ahead):
        fed = bandwidth_of(f, partial(closed.closed_loop, feedforward=True))
    own = margins(cut, closed)
    return LoopSheet(
        loop,
        regime.name,
        closed.sample_time,
        own,
        bandwidth_of(f, closed.closed_loop),
        fed,
        f,
        cut.open_loop(f),
        closed.closed_loop(f),
        None if own.stable else instability(axis, regime),
    )


def _stiffness(axis: Axis, regime: Regime) -> Stiffness:
    closed = SampledLoop(axis, regime, axis.loops[-1], False)
    f = frequencies(closed)
    with np.errstate(divide="ignore"):  # a shaft that sticks is infinitely stiff
        values = 1.0 / np.abs(closed.compliance(f, axis.shaft, axis.shaft))
    return Stiffness(regime.name, axis.shaft, f, values, axis.train.is_slide(axis.shaft))


def decibels(factor: float) -> float:
    """20 log10; NaN where there is none."""
    return 20.0 * math.log10(factor) if factor > 0.0 else math.nan


def _shown(value: float, unit: str, digits: int = 4) -> str:
    return f"{value:.4g} {unit}" if unit in ("N·m", "N") else practical(value, unit, digits)
