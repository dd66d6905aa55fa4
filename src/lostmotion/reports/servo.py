"""The report of a servo axis: margins, bandwidths, steps, following, stiffness, limit cycle."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..servo.axis_runs import StepResponse
from ..servo.commissioning_report import TRUE, LoopSheet, ServoReport, decibels
from ..servo.hunting.limit_cycle_causes import LimitCycle
from ..units.practical import charted
from .certificate import certificate_parts
from .figure_style import FAINT, look
from .page import Prose, Report, Table
from .panels import Curve, Group, Mark, Panel
from .written_files import table_csv

DEGREES = 180.0 / math.pi
LEAD = 2.0  # [deg] of a phase from which on it begins a turn below
HEADER = (
    "loop",
    "regime",
    "stable",
    "closed loop -3 dB at [Hz]",
    "closed loop -90 deg at [Hz]",
    "with feedforward, -3 dB at [Hz]",
    "gain margin [dB]",
    "gain margin at [Hz]",
    "phase margin [deg]",
    "crossover [Hz]",
    "sensitivity peak [-]",
    "sensitivity peak at [Hz]",
)
COMPUTED = (
    "Margins, bandwidths and stiffness are those of the linear sampled loop in one regime of the plant, without approximation: the plant by the matrix exponential "
    "over a base tick, the controller as it computes, sample times and delays as they are. Over the sample time of a loop, the faster loops within it make one "
    "time-invariant system, whose frequency response at the samples is shown.",
    "A loop is cut where its measured value enters its controller; loops within it are closed, those around it open. While the motor's own shaft sticks no loop is "
    "closed: its gain is 0.",
    "Limits, encoder steps and dead zones do not count there. They do in the runs: steps, following error, settling and rest are exact simulations of the scenario.",
)


# --- tables ---


def loop_rows(report: ServoReport) -> list[list[str]]:
    """The table of the loops, as text; empty where a curve does not cross."""
    return [_loop_row(row) for row in report.loops]


def _loop_row(row: LoopSheet) -> list[str]:
    m, b, fed = row.margins, row.bandwidth, row.with_feedforward
    numbers = (
        b.three_decibels,
        b.ninety_degrees,
        math.nan if fed is None else fed.three_decibels,
        decibels(m.gain_margin),
        m.gain_margin_frequency,
    )
    more = (DEGREES * m.phase_margin, m.crossover, m.sensitivity_peak, m.sensitivity_peak_frequency)
    return [row.loop, row.regime, row.verdict, *(_text(x) for x in (*numbers, *more))]


def _text(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.4g}"


def step_rows(report: ServoReport) -> list[tuple[str, str]]:
    """Steps, as (what, value)."""
    return [(f"step of the {step.loop} loop", _step_text(step)) for step in report.steps]


def _step_text(step: StepResponse) -> str:
    times = {"rise (10 to 90 %)": step.rise_time, "within 2 % after": step.settling_time}
    parts = [
        f"{what} {1e3 * t:.4g} ms" if not math.isnan(t) else f"{what}: not within the run" for what, t in times.items()
    ]
    size = f"{step.size:.4g} {step.unit}, {'limits act on it' if step.limited else 'no limit acts'}"
    return f"{size}: {', '.join(parts)}, overshoot {100.0 * step.overshoot:.3g} %"


def _cycle_table(report: ServoReport, cycle: LimitCycle) -> Table:
    """The limit cycle, and its remainder without each possible cause."""
    motor, load = (charted(unit, small=True) for unit in (report.motor_unit, report.load_unit))
    rows, shown = [], {"nothing": cycle.whole, **cycle.without} if cycle.without else {}
    for what, rest in shown.items():
        numbers = (motor[1] * rest.motor_amplitude, load[1] * rest.amplitude, rest.frequency)
        rows.append([what, *(map(_text, numbers) if rest.cycles else ("none", "none", ""))])
    header = ("left out", f"amplitude at the motor [{motor[0]}]", f"at the load [{load[0]}]", "frequency [Hz]")
    return Table("Causes of the limit cycle", header, rows)


# --- figures ---


def _loops(report: ServoReport) -> list[str]:
    return list(dict.fromkeys(row.loop for row in report.loops))


def _step_panel(step: StepResponse) -> Panel:
    time = 1e3 * step.time
    curves = (
        Curve("reference", time[[0, -1]], np.ones(2), FAINT),
        Curve("value", time, step.value / step.size, look(0)),
    )
    return Panel(f"{step.loop} loop, {step.size:.3g} {step.unit}", "time [ms]", "share of the step [-]", curves)


def _panel(
    report: ServoReport,
    loop: str,
    title: str,
    label: str,
    y: Callable[[LoopSheet], np.ndarray],
    told: Callable[[LoopSheet], str] | None = None,
    **options: Any,
) -> Panel:
    rows = [row for row in report.loops if row.loop == loop]
    legends = [", ".join(filter(None, (row.regime, told(row) if told else ""))) for row in rows]
    curves = tuple(
        Curve(row.regime, row.frequency, y(row), look(k), legend)
        for k, (row, legend) in enumerate(zip(rows, legends, strict=True))
    )
    return Panel(f"{loop} loop, {title}", "frequency [Hz]", label, curves, log_x=True, **options)


def _open_panels(report: ServoReport, loop: str) -> tuple[Panel, Panel]:
    """Gain and phase of the loop that is cut, with margins and crossovers, whose values are in the legends."""
    rows = [row for row in report.loops if row.loop == loop]
    at_gain, at_phase = [], []
    for k, row in enumerate(rows):
        m = row.margins
        if math.isfinite(m.crossover):
            at_gain.append(Mark(m.crossover, 0.0, "", look(k)))
            # At the crossover the loop is -exp(j margin) or its conjugate; its side follows from its neighbours.
            side = np.interp(m.crossover, row.frequency, np.imag(-row.open_loop))
            margin = math.copysign(DEGREES * m.phase_margin, side)
            drawn = np.interp(m.crossover, row.frequency, _phase(row.open_loop))
            turns = 360.0 * round((drawn - (margin - 180.0)) / 360.0)  # of the curve, which does not wrap
            at_phase.append(Mark(m.crossover, margin - 180.0 + turns, "", look(k), to=turns - 180.0))
        if m.gain_margin > 0.0 and math.isfinite(m.gain_margin):
            at_gain.append(Mark(m.gain_margin_frequency, -decibels(m.gain_margin), "", look(k), to=0.0))
    gain = _panel(
        report,
        loop,
        "open: gain",
        "|L| [dB]",
        lambda r: _gain(r.open_loop),
        _gain_told,
        marks=tuple(at_gain),
        level=0.0,
    )
    phase = _phase_panel(
        report, loop, "open", lambda r: r.open_loop, told=_phase_told, marks=tuple(at_phase), level=-180.0
    )
    return gain, phase


def _gain_told(row: LoopSheet) -> str:
    crossover, margin = row.margins.crossover, decibels(row.margins.gain_margin)
    crosses = f"crosses at {crossover:.3g} Hz" if math.isfinite(crossover) else ""
    return ", ".join(filter(None, (crosses, f"margin {margin:.3g} dB" if math.isfinite(margin) else "")))


def _phase_told(row: LoopSheet) -> str:
    margin = DEGREES * row.margins.phase_margin
    return f"margin {margin:.3g}°" if math.isfinite(margin) else ""


def _closed_panels(report: ServoReport, loop: str) -> tuple[Panel, Panel]:
    """Gain and phase of the closed loop, with the line of its bandwidth."""
    gain = _panel(report, loop, "closed: gain", "|T| [dB]", lambda r: _gain(r.closed_loop), level=-3.0)
    return gain, _phase_panel(report, loop, "closed", lambda r: r.closed_loop)


def _phase_panel(
    report: ServoReport, loop: str, which: str, response: Callable[[LoopSheet], np.ndarray], **options: Any
) -> Panel:
    return _panel(report, loop, f"{which}: phase", "phase [deg]", lambda r: _phase(response(r)), **options)


def _gain(response: np.ndarray) -> np.ndarray:
    """The gain in dB; a gain that is rounding alone is left out."""
    magnitude = np.abs(response)
    return np.where(magnitude > 1e-9, 20.0 * np.log10(np.maximum(magnitude, 1e-9)), np.nan)


def _phase(response: np.ndarray) -> np.ndarray:
    """Phase in degrees without jumps, from between -360 and 0 on; a gain that is rounding alone has none."""
    there = np.abs(response) > 1e-9
    phase = np.full(len(response), np.nan)
    found = DEGREES * np.unwrap(np.angle(response[there]))
    if len(found):
        phase[there] = found - 360.0 * math.ceil((found[0] - LEAD) / 360.0)
    return phase


def _motion_panels(report: ServoReport) -> Iterable[Panel]:
    f = report.following
    unit, factor = charted(f.unit, small=True)
    shown, of_shown = charted(f.unit)
    named = {"rad": "position", "rad/s": "speed", "m": "position", "m/s": "speed", "N": "force"}
    quantity = named.get(f.unit, "torque")
    both = (
        Curve("reference", f.time, of_shown * f.reference, look(1)),
        Curve("true value", f.time, of_shown * (f.reference - f.error), look(0)),
    )
    yield Panel(f"{quantity} over the run", "time [s]", f"{quantity} [{shown}]", both)
    error = Curve("error", f.time, factor * f.error, look(0))
    yield Panel(f"following error over the run, {TRUE}", "time [s]", f"error [{unit}]", (error,))


def _stiffness_group(report: ServoReport) -> Group:
    slides = bool(report.stiffness) and report.stiffness[0].slides
    unit, factor = ("N/µm", 1e-6) if slides else ("N·m/rad", 1.0)
    what = "force that moves its slide by one micrometre" if slides else "torque that turns its shaft by one radian"
    curves = tuple(Curve(s.regime, s.frequency, factor * s.stiffness, look(k)) for k, s in enumerate(report.stiffness))
    panels = tuple(
        Panel(f"stiffness at {s.shaft}", "frequency [Hz]", f"stiffness [{unit}]", curves, log_x=True, log_y=True)
        for s in report.stiffness[:1]
    )
    return Group("stiffness", "Stiffness", f"The load {what}.", panels, 1)


def _loop_groups(report: ServoReport) -> tuple[Group, Group]:
    """Loops in two groups: the outermost loop with the run, then all others."""
    *inner, outer = _loops(report)
    main = Group(
        "axis",
        f"The {outer} loop, and the run",
        "Above, the loop cut where its measured value enters its controller, with crossovers, gain and phase margins; below, the run of the scenario. "
        "Drag over a chart to zoom, double-click to see all of it.",
        (*_open_panels(report, outer), *_motion_panels(report)),
    )
    others = [p for loop in inner for p in (*_open_panels(report, loop), *_closed_panels(report, loop))]
    caption = (
        "Exact sampled loops up to half their sampling frequencies. Open, the loop cut where its measured value enters its controller; closed, from reference to "
        "measured value, nothing fed forward."
    )
    return main, Group("loops", "Open and closed loops", caption, (*_closed_panels(report, outer), *others))


# --- the page ---


def servo_report(name: str, report: ServoReport) -> Report:
    """The page of an axis."""
    rows = loop_rows(report)
    wrong = frozenset(k for k, row in enumerate(rows) if row[2] == "NO")
    steps_and_motion = [list(row) for row in [*step_rows(report), *report.motion_rows()]]
    cycle = report.limit_cycle
    main, loops = _loop_groups(report)
    blank = "A blank cell means that a curve does not cross below half the sampling frequency."
    steps = Group(
        "steps",
        "Step responses",
        "Each loop with those around it left out, simulated exactly.",
        tuple(map(_step_panel, report.steps)),
        len(report.steps),
    )
    return Report(
        title=report.scenario.title or name,
        lead=f"Commissioning report of the servo axis of `{report.motor}` in `{name}`.",
        verdict=report.verdict,
        main=main,
        parts=(
            Table("Loops", HEADER, rows, blank, marked=wrong),
            Table("Regimes", ("regime", "what it is"), [list(pair) for pair in report.regimes.items()]),
            Table("Steps and motion", ("quantity", "value"), steps_and_motion),
            *([] if cycle is None else [_cycle_table(report, cycle)]),
            *([] if report.certificate is None else certificate_parts(report.certificate)),
            loops,
            steps,
            _stiffness_group(report),
            Prose("What is computed", COMPUTED),
        ),
        file="servo.html",
        tables={"margins.csv": table_csv(HEADER, rows)},
    )
