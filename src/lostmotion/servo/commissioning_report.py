"""The sheet of an axis: all that is looked at when it is commissioned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.implausible_values import doubt_window
from ..inputs.refusal_messages import shown
from ..simulation.scenario.scenario import Scenario
from ..units.conversion import si_value
from ..units.practical import practical
from ..verdict import Point, State, Verdict
from .axis_runs import STEPPED, Following, StepResponse, following, step_response
from .hunting.certificate import HuntingCertificate, certified, certified_in_words
from .hunting.hunting_decision import moving_input
from .hunting.limit_cycle_causes import LimitCycle, limit_cycle
from .linear_regimes import Axis, Regime, axis_of, regimes
from .linear_sampled_loop import LinearLoop
from .margins import Bandwidth, Instability, Margins, bandwidth_of, frequencies, instability, margins
from .settling import Moves, Settling, default_window, repeated, settling


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
    moves: Moves | None
    """the moves of the reference, repeated until they repeat; None without moves"""
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
    window_given: bool = False
    """whether the window was asked for, not the one by default"""

    @property
    def stable(self) -> bool:
        """Whether the complete loop is stable in each regime."""
        return not self.instabilities()

    def instabilities(self) -> list[Instability]:
        """Poles of the complete loop outside the unit circle, one for each regime that has some."""
        return list(dict.fromkeys(row.unstable for row in self.loops if row.unstable is not None))

    @property
    def verdict(self) -> Verdict:
        """Answer to all that is asked of an axis: stability, the window, hunting, limits; and what was not judged."""
        rows = dict(self._rows())
        lines = [
            f"Worst margins: {rows['worst margins']}. Following error over the run: {rows['following error']}.",
            " ".join(
                f"{what.capitalize()}: {rows[what]}." for what in ("settling", "stiffness", "at rest") if what in rows
            ),
        ]
        return Verdict.of(self._points(), lines)

    def _points(self) -> Iterator[Point]:
        stable, f = f"stable in {self._regimes()}", self.following
        if found := self.instabilities():
            yield Point("does not fit", f"unstable: {'; '.join(map(str, found))}")
        if self.window_given and self.moves is None:
            yield Point("not decided", "the window is not judged: the reference has no moves to settle after")
        if (worst := self.worst_move) is not None:
            yield Point(*self._window_point(worst))
        yield from self._rest_points()
        for name, share in f.limits.items():
            yield Point("fits with a reservation", f"{stable}, but the {name} acts in {100.0 * share:.3g} % of the run")
        yield Point("fits", stable)

    def _window_point(self, worst: Settling) -> tuple[State, str]:
        """The answer to whether the axis settles within its window."""
        stable, window = "stable" if self.stable else "unstable", _shown(self.window, self.load_unit)
        after = f"after the move to {self._place(worst.to)}"
        if worst.within:
            assert self.moves is not None
            proved = self.settling[-1].state == "settled" and self.moves.repeats
            text = f"{stable} in {self._regimes()}, and {self._worst_settling()}"
            text += "" if self.moves.repeats else f"; the moves {self.repetition()}"
            return "fits" if proved else "fits with a reservation", text
        if worst.state == "not decided":
            return (
                "not decided",
                f"{stable}, but it is not decided whether it settles within {window} {after}: {worst.reason}",
            )
        beyond = abs(worst.remaining) - self.window
        if beyond <= 0.0:
            return "does not fit", f"{stable}, but not settled within {window} {after}: {self._why(worst)}"
        text = f"{stable}, but misses the window of {window} by {_shown(beyond, self.load_unit, 2)} {after}"
        return "does not fit", f"{text}: {self._why(worst)}" if worst.last and self._swings(worst) else text

    def _rest_points(self) -> Iterator[Point]:
        """Hunting, and what is not known about it."""
        whole = None if self.limit_cycle is None else self.limit_cycle.whole
        if whole is not None and whole.cycles:
            judged = self.settling and self.settling[-1].within
            yield Point("fits with a reservation" if judged else "does not fit", f"stable, but {self.rest()}")
        elif self.certificate is not None and self.certificate.verdict == "hunts":
            yield Point(
                "fits with a reservation", f"stable, but other starts hunt: {certified_in_words(self.certificate)}"
            )
        if whole is not None and whole.verdict == "not decided":
            judged = self.settling and self.settling[-1].within
            state: State = "fits with a reservation" if judged else "not decided"
            yield Point(state, f"stable, but hunting is not decided: {whole.described()}")

    def summary(self) -> list[tuple[str, str]]:
        """The verdict on the axis, as (what, value): stability, worst margins, error, settling, stiffness, hunting."""
        return [("verdict", str(self.verdict)), *self._rows()]

    def _rows(self) -> list[tuple[str, str]]:
        found = self.instabilities()
        f = self.following
        rows = [
            ("stability", f"UNSTABLE: {'; '.join(map(str, found))}" if found else f"stable in {self._regimes()}"),
            ("worst margins", self.least_margins() or "none: no gain crosses 1"),
            ("following error", f"{TRUE}: peak {_shown(f.peak, f.unit)}, rms {_shown(f.rms, f.unit)}"),
        ]
        if self.settling:
            rows.append(("settling", self._worst_settling()))
        if self.stiffness:
            rows.append(("stiffness", self._least_stiffness()))
        rows.append(("at rest", self.rest()))
        if self.certificate is not None:
            rows.append(("certificate", certified_in_words(self.certificate)))
        return rows

    def _least_stiffness(self) -> str:
        """The least stiffness while the flanks touch, and that within the backlash."""
        open_gap = [s for s in self.stiffness if s.regime == "gap"]
        weakest = min([s for s in self.stiffness if s not in open_gap] or open_gap, key=lambda s: s.least[0])
        least, at = weakest.least
        text = f"at least {weakest.shown(least)}, at {at:.3g} Hz ({weakest.regime})"
        return (
            f"{text}; {open_gap[0].shown(open_gap[0].least[0])} within the backlash"
            if weakest.regime != "gap" and open_gap
            else text
        )

    def _regimes(self) -> str:
        names = ", ".join(self.regimes)
        count = {1: "its one regime", 2: "both regimes"}.get(len(self.regimes), f"all {len(self.regimes)} regimes")
        return f"{count} ({names})"

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
                alone = ", outer loops open" if "current" in row.loop else ""
                words.append(
                    f"{what} {scale(getattr(row.margins, key)):.3g}{unit} ({row.loop} loop, {row.regime}{alone})"
                )
        return ", ".join(words)

    def _worst_settling(self) -> str:
        """The longest time of all moves; where one does not settle, why."""
        inside = f"within {_shown(self.window, self.following.unit)}"
        worst = self.worst_move
        assert worst is not None
        if not worst.within:
            return f"{'not' if worst.state == 'not settled' else 'not decided whether'} {inside}: {self._why(worst)}"
        after = f"in at most {1e3 * worst.time:.4g} ms" if worst.time > 0.0 else "from the end of each move on"
        return f"{inside} {after}, {self._proof(self.settling[-1])}"

    @property
    def worst_move(self) -> Settling | None:
        """The move that settles last; before that one that is not decided, and one that does not settle; None without moves."""
        order = ("not decided", "not settled")
        return max(
            self.settling,
            key=lambda s: (-1, s.time) if s.within else (order.index(s.state), abs(s.remaining)),
            default=None,
        )

    def _proof(self, last: Settling) -> str:
        """Proof that the error stays within the window between moves and behind the last one, or how long it was watched."""
        if len(self.settling) == 1:
            return self._held(last)
        if last.state == "settled":
            return f"{STAYS} and after the last move ({last.reason})"
        return f"{STAYS}, {self._held(last)}"

    @staticmethod
    def _held(last: Settling) -> str:
        proved = "stays" if last.state == "settled" else "without a proof that it stays"
        return f"{proved} after the last move ({last.reason})"

    @staticmethod
    def _swings(s: Settling) -> bool:
        return s.swing > SWINGS * abs(s.remaining)

    def _why(self, s: Settling) -> str:
        """Why a move does not settle, in one sentence."""
        if s.state == "not decided":
            return s.reason
        left, twist, unit = abs(s.remaining), abs(s.unseen), self.following.unit
        when = s.reason if s.last else "when the next move begins"
        swing = f"swings by ±{_shown(s.swing, unit, 3)}"
        if self._swings(s) and s.last:
            return f"it still {swing}, {when}"
        text = f"{_shown(left, unit, 3)} left {when} (allowed {_shown(self.window, unit)})"
        stop = self._stop_before(s.to)
        if stop is not None:
            return f"{text}, as the end stop at {self._place(stop)} is in the way; move within the stops"
        if self._swings(s):
            return f"{text}, and {swing}"
        if twist > 0.5 * left:
            where = "the motor" if self.following.encoder == "motor" else f"the shaft {self.following.encoder}"
            return f"{text}, as an encoder on {where} does not see {_shown(twist, unit, 3)} of twist"
        if s.reason == "at rest":
            return f"{text}, which the loop does not remove; add an integral gain, or a finer encoder"
        return f"{text}; the loop is still removing it: raise K_v, or lengthen the dwell"

    def _stop_before(self, target: float) -> float | None:
        """The end stop of the reference's shaft that the load meets before a target [rad], of a slide [m]."""
        assert self.moves is not None
        axis = self.moves.axis
        stops = axis.train.shafts[axis.shaft].end_stops
        if stops is None or stops.lower <= target <= stops.upper:
            return None
        return stops.upper if target > stops.upper else stops.lower

    def _place(self, position: float) -> str:
        return f"{math.degrees(position):.5g} deg" if self.load_unit == "rad" else f"{1e3 * position:.5g} mm"

    def motion_rows(self) -> list[tuple[str, str]]:
        """Following, settling, stiffness and rest, as (what, value)."""
        f = self.following
        rows = [
            (f"following error over the run, {TRUE}: peak", _shown(f.peak, f.unit)),
            (f"following error over the run, {TRUE}: rms", _shown(f.rms, f.unit)),
        ]
        if self.moves is not None:
            rows.append(("moves", self.repetition()))
        for s in self.settling:
            until = self._held(s) if s.last else STAYS
            inside = f"{1e3 * s.time:.4g} ms, {until}" if s.within else f"{s.state}: {self._why(s)}"
            within = _shown(self.window, self.load_unit)
            rows.append((f"settled within {within} after the move to {self._place(s.to)}", inside))
        for k in self.stiffness:
            least, at = k.least
            rows.append((f"least stiffness against load, {k.regime}", f"{k.shown(least)} at {at:.3g} Hz"))
        return [*rows, ("at rest", self.rest())]

    def repetition(self) -> str:
        """Number of cycles of the moves, and whether they then repeat."""
        moves = self.moves
        assert moves is not None
        if moves.note:
            return moves.note
        apart = (
            f"the errors of the last two of {moves.cycles} cycles differ by {_shown(moves.apart, self.load_unit, 3)}"
        )
        return f"repeat: {apart}" if moves.repeats else f"do not repeat: {apart}"

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
        if whole.floats:
            return (
                f"the motor stands and the load still swings by ±{load}, {frequency}, undamped: it floats in the backlash; "
                "give the load a friction, or the gear a mesh_damping"
            )
        text = f"limit cycle: ±{motor} at the motor, ±{load} at the load, {frequency}"
        return f"hunts, {text}; cause: {' and '.join(cycle.causes) or 'none of ' + ', '.join(cycle.without)}"


@checked
def commission(
    scenario: Scenario,
    *,
    motor: str | None = None,
    window: str | float | None = None,
    progress: Callable[[], None] = lambda: None,
) -> ServoReport:
    """Compute margins, steps, following error, settling, stiffness and limit cycles of an axis.

    Margins, bandwidths and stiffness belong to the exact linear sampled loop in each regime of the plant (segment of
    the torsion curve, twist or load stuck). The plant is propagated by the matrix exponential over a base period, with sample
    times and delays as they are. A loop with several sample times is a time-invariant system over the sample time of its
    outermost loop. Field-oriented control is linear about the steady motion of the regime. A loop is cut at the measured
    value of its controller; the loops within it are closed, those around it open. Limits, quantisation and dead zones count
    in the runs only: steps, following, settling and rest are exact simulations of the scenario. Moves are repeated, both
    ways, until they repeat. An axis has settled after a move if its error stays within the window until the next move begins.
    After the last one only rest proves that it stays there for ever; a steady swing within the window is reported as settled,
    not proved.

    Parameters
    ----------
    scenario : Scenario
        A scenario with a controller.
    motor : str, optional
        Name of the motor whose controller is examined. Default: the only one.
    window : float, optional
        Window of the settled position [rad], of a slide [m], or text such as "1 arcmin", "5 um". Default: four steps of the
        position's encoder at the reference's shaft, at least a thousandth of the longest move.
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
    >>> print(report.verdict)
    fits: stable in all 4 regimes (first stiffness, last stiffness, twist stuck, load stuck)
    """
    axis = axis_of(scenario, motor)
    asked = None if window is None else _window_of(axis, window)
    points = regimes(axis)
    loops, steps = [], []
    for name in axis.loops:
        for regime in points:
            loops.append(loop_sheet(axis, regime, name))
        if name in STEPPED:
            steps.append(step_response(axis, name))
        progress()
    followed = following(axis)
    wide = default_window(axis) if asked is None else asked
    progress()
    stiffness = tuple(_stiffness(axis, regime) for regime in points) if axis.loops[-1] == "position" else ()
    moves = repeated(axis, wide)
    if moves is not None:
        positions = [moves.reference.start, *(move.to for move in moves.reference.moves)]
        doubt_window(wide, float(np.ptp(positions)), followed.unit, "window")
    cycle = limit_cycle(axis) if moves is None else limit_cycle(moves.axis, moves.longest)
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
        moves=moves,
        settling=() if moves is None or cycle is None else tuple(settling(moves, cycle.whole, wide)),
        stiffness=stiffness,
        limit_cycle=cycle,
        certificate=certificate,
        motor_unit=axis.train.angle_unit(axis.motor_shaft),
        load_unit=axis.train.angle_unit(axis.shaft),
        window_given=window is not None,
    )


def _window_of(axis: Axis, window: str | float) -> float:
    """Window in SI, of text in a unit of the reference's shaft."""
    unit = axis.train.angle_unit(axis.shaft)
    try:
        value = si_value(window, unit) if isinstance(window, str) else window
    except ValueError as error:
        raise InputError(f"window: {shown(window)} {error}") from None
    if not value > 0.0:
        raise InputError(f"window: {value:g} {unit} must be above 0")
    return value


def work(scenario: Scenario, motor: str | None = None) -> int:
    """Number of progress reports of `commission`."""
    return len(axis_of(scenario, motor).loops) + 2


def loop_sheet(axis: Axis, regime: Regime, loop: str) -> LoopSheet:
    """Report of one loop in one regime."""
    cut, closed = (LinearLoop(axis, regime, loop, is_cut) for is_cut in (True, False))
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
    closed = LinearLoop(axis, regime, axis.loops[-1], False)
    f = frequencies(closed)
    with np.errstate(divide="ignore"):  # a shaft that sticks is infinitely stiff
        values = 1.0 / np.abs(closed.compliance(f, axis.shaft, axis.shaft))
    return Stiffness(regime.name, axis.shaft, f, values, axis.train.is_slide(axis.shaft))


TRUE = "reference less true value"
STAYS = "stays until the next move begins"
SWINGS = 0.25  # of the error that is left: least amplitude that is reported as a swing


def decibels(factor: float) -> float:
    """20 log10; NaN where there is none."""
    return 20.0 * math.log10(factor) if factor > 0.0 else math.nan


def _shown(value: float, unit: str, digits: int = 4) -> str:
    return f"{value:.4g} {unit}" if unit in ("N·m", "N") else practical(value, unit, digits)
