"""Figures of docs/servo.md, from exact runs and from the sheet of the axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from figure_files import following_error, save

import lostmotion as lm
from lostmotion.reports.figure_style import FIRST, SECOND, THIRD
from lostmotion.reports.panels import Curve, Panel
from lostmotion.units.practical import ARCMIN

# As docs/servo.md gives them: all at the motor.
KNOWN = {
    "controller.feedforward.inertia": "2.62 kg*cm^2",
    "controller.feedforward.viscous_friction": 2.35e-4,
    "controller.feedforward.friction_torque": "0.016 N*m",
}
ON_THE_LOAD = {"controller.position_encoder": {"shaft": "load", "bits": 20}, "gearbox.stiffness.backlash": "3 arcmin"}


def axes() -> dict[str, lm.Scenario]:
    """The axis of the tutorial, step by step."""
    shipped = lm.load("position-axis")
    tuned = lm.tune(shipped, rule="margins").scenario
    assert isinstance(shipped, lm.Scenario)
    assert isinstance(tuned, lm.Scenario)
    fed = tuned.replace(**KNOWN)
    return {
        "shipped": shipped,
        "tuned by margins": tuned,
        "with torque fed forward": fed,
        "hunting": fed.replace(**ON_THE_LOAD),
    }


def errors(out: Path, scenarios: dict[str, lm.Scenario]) -> None:
    """Following error over the run, before and after."""
    curves = []
    for (name, scenario), style in zip(list(scenarios.items())[:3], (THIRD, SECOND, FIRST), strict=True):
        t, error = following_error(scenario)
        curves.append(Curve(name, t, ARCMIN * error, style))
    panel = Panel("there and back: reference less angle of the load", "time [s]", "error [arcmin]", tuple(curves))
    save([panel], 1, (8.0, 3.4), out, "servo-errors")


def loops(out: Path, scenario: lm.Scenario) -> None:
    """The open speed loop in each regime."""
    rows = [row for row in lm.commission(scenario).loops if row.loop == "speed"]
    styles = (THIRD, FIRST, SECOND)
    gains = tuple(Curve(r.regime, r.frequency, np.abs(r.open_loop), s) for r, s in zip(rows, styles, strict=True))
    phases = tuple(
        Curve(r.regime, r.frequency, np.degrees(np.unwrap(np.angle(r.open_loop))), s)
        for r, s in zip(rows, styles, strict=True)
    )
    panels = [
        Panel("open speed loop: gain", "frequency [Hz]", "|L| [-]", gains, log_x=True, log_y=True),
        Panel("open speed loop: phase", "frequency [Hz]", "phase [deg]", phases, log_x=True),
    ]
    save(panels, 2, (10.0, 3.6), out, "servo-loops")


def hunting(out: Path, scenario: lm.Scenario) -> None:
    """Motor and load at rest, with the encoder on the load and a gap."""
    held = scenario.replace(**{"controller.reference": {"kind": "position", "mean": "0.9 deg"}})
    run = lm.simulate(held, duration=12.0, sample_interval=2e-3, energy=False)
    late = run["time"].to_numpy() >= 4.0
    t, ratio = run["time"].to_numpy()[late], scenario.gearbox.ratio
    load = run["load_angle"].to_numpy()[late]
    motor = (ratio * (run["load_angle"] + run["twist"])).to_numpy()[late]
    middle = float(np.mean(load))
    curves = (
        Curve("motor angle / ratio", t, ARCMIN * (motor / ratio - middle), SECOND),
        Curve("load", t, ARCMIN * (load - middle), FIRST),
    )
    save([Panel("at rest, gap of 3 arcmin", "time [s]", "angle [arcmin]", curves)], 1, (8.0, 3.2), out, "servo-hunting")


def write(out: Path) -> None:
    """All figures of the page into a directory."""
    scenarios = axes()
    errors(out, scenarios)
    loops(out, scenarios["tuned by margins"])
    hunting(out, scenarios["hunting"])
