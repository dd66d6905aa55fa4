"""The sheet of a servo axis: figures, tables as CSV, and an HTML page."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..servo.commission import LoopSheet, ServoReport
from ..servo.motion import StepResponse
from . import plots
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .panels import COMMAND_STYLE, Curve, Panel

SHADES = ("#0b3c5d", "#d9730d", "#7fae3f", "#8a4f9e", "#b8b8b8")
LINES = ("-", "--", "-.", ":", "-")
DEGREES = 180.0 / math.pi
HEADER = (
    "loop",
    "regime",
    "stable",
    "-3 dB [Hz]",
    "-90 deg [Hz]",
    "with feedforward, -3 dB [Hz]",
    "gain margin [dB]",
    "gain margin at [Hz]",
    "phase margin [deg]",
    "crossover [Hz]",
    "sensitivity peak [-]",
    "sensitivity peak at [Hz]",
)


@dataclass(frozen=True)
class Drawn:
    """A picture of the report, before it is drawn."""

    name: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    size: tuple[float, float]


def loop_rows(report: ServoReport) -> list[list[str]]:
    """The table of the loops, as text; empty where a curve does not cross."""
    return [_loop_row(row) for row in report.loops]


def _loop_row(row: LoopSheet) -> list[str]:
    m, b, fed = row.margins, row.bandwidth, row.with_feedforward
    decibels = 20.0 * math.log10(m.gain_margin) if m.gain_margin > 0.0 else math.nan
    numbers = (
        b.three_decibels,
        b.ninety_degrees,
        math.nan if fed is None else fed.three_decibels,
        decibels,
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


def figures(report: ServoReport) -> list[Drawn]:
    """All pictures of the report."""
    steps = Drawn(
        "steps",
        "Step responses",
        "Each loop with those around it left out, simulated exactly.",
        tuple(map(_step_panel, report.steps)),
        (10.0, 3.2),
    )
    loops = Drawn(
        "loops",
        "Open and closed loops",
        "Exact sampled loops up to half their sampling frequencies. Left, the loop cut where its measured value enters its controller; right, closed, from reference to measured value, nothing fed forward.",
        tuple(panel for name in _loops(report) for panel in _loop_panels(report, name)),
        (10.0, 3.0 * 2 * len(_loops(report))),
    )
    motion = Drawn(
        "motion",
        "Following and stiffness",
        "The run of the scenario: reference less true value; and the load torque that turns its shaft by one radian.",
        tuple(_motion_panels(report)),
        (10.0, 3.2),
    )
    return [steps, loops, motion]


def _loops(report: ServoReport) -> list[str]:
    return list(dict.fromkeys(row.loop for row in report.loops))


def _style(k: int) -> dict[str, Any]:
    return {"color": SHADES[k % len(SHADES)], "linestyle": LINES[k % len(LINES)], "linewidth": 1.4}


def _step_panel(step: StepResponse) -> Panel:
    time = 1e3 * step.time
    curves = (
        Curve("reference", time[[0, -1]], np.ones(2), COMMAND_STYLE),
        Curve("value", time, step.value / step.size, _style(0)),
    )
    return Panel(f"{step.loop} loop, {step.size:.3g} {step.unit}", "time [ms]", "share of the step [-]", curves)


def _loop_panels(report: ServoReport, loop: str) -> list[Panel]:
    rows = [row for row in report.loops if row.loop == loop]

    def panel(title: str, label: str, y: Callable[[LoopSheet], np.ndarray], **options: Any) -> Panel:
        curves = tuple(Curve(row.regime, row.frequency, y(row), _style(k)) for k, row in enumerate(rows))
        return Panel(f"{loop} loop, {title}", "frequency [Hz]", label, curves, log_x=True, **options)

    return [
        panel("open: gain", "|L| [-]", lambda r: _seen(np.abs(r.open_loop)), log_y=True),
        panel("closed: gain", "|T| [-]", lambda r: _seen(np.abs(r.closed_loop)), log_y=True),
        panel("open: phase", "phase [deg]", lambda r: _phase(r.open_loop)),
        panel("closed: phase", "phase [deg]", lambda r: _phase(r.closed_loop)),
    ]


def _seen(gain: np.ndarray) -> np.ndarray:
    """Without what rounding makes of no gain at all."""
    return np.where(gain > 1e-9, gain, np.nan)


def _phase(response: np.ndarray) -> np.ndarray:
    return np.where(np.abs(response) > 1e-9, DEGREES * np.unwrap(np.angle(response)), np.nan)


def _motion_panels(report: ServoReport) -> Iterable[Panel]:
    f = report.following
    factor, unit = (1e3, "mrad") if f.unit == "rad" else (1.0, f.unit)
    yield Panel(
        "following error over the run",
        "time [s]",
        f"error [{unit}]",
        (Curve("error", f.time, factor * f.error, _style(0)),),
    )
    if report.stiffness:
        curves = tuple(Curve(s.regime, s.frequency, s.stiffness, _style(k)) for k, s in enumerate(report.stiffness))
        yield Panel(
            f"stiffness against load at {report.stiffness[0].shaft}",
            "frequency [Hz]",
            "[N·m/rad]",
            curves,
            log_x=True,
            log_y=True,
        )


def write_servo(directory: Path, name: str, report: ServoReport) -> Path:
    """Figures (PNG, SVG), tables (CSV) and ``servo.html`` in a directory, made if missing.

    Returns
    -------
    Path
        Of the page.
    """
    directory.mkdir(parents=True, exist_ok=True)
    embedded = []
    for drawn in figures(report):
        columns = 2 if drawn.name == "loops" else len(drawn.panels)
        png = save_figure(plots.draw(drawn.panels, columns, drawn.size), directory, drawn.name)
        write_text(directory / f"{drawn.name}.csv", panels_csv(drawn.panels))
        embedded.append(embed(png, drawn.title, drawn.caption, drawn.name))
    rows = loop_rows(report)
    write_text(directory / "margins.csv", table_csv(HEADER, rows))
    page = directory / "servo.html"
    write_text(
        page,
        render_page(
            "reports/servo.html.jinja",
            name=name,
            title=report.scenario.title or name,
            motor=report.motor,
            header=HEADER,
            rows=rows,
            regimes=report.regimes,
            steps=step_rows(report),
            motion=report.motion_rows(),
            cycle=report.limit_cycle,
            figures=embedded,
        ),
    )
    return page
