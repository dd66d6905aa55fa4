"""Figures of docs/limit-cycles.md: the scenario `hunting-with-static-friction`, its limit cycle, and maps of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from figure_files import save

import lostmotion as lm
from lostmotion.reports.figure_style import FIRST, MUTED, SECOND
from lostmotion.reports.panels import Curve, Panel
from lostmotion.simulation.forms.key_aliases import DRIVE

MRAD = 1e3
OPPOSITE: dict[str, Any] = {"color": MUTED, "linestyle": "--"}
POINT: dict[str, Any] = {"linestyle": "none", "marker": "o"}


def _curves(data: Any, name: str, label: str, factor: float, style: dict[str, Any]) -> Curve:
    return Curve(label, data["time"].to_numpy(), factor * data[name].to_numpy(), style)


def run(out: Path, scenario: lm.Scenario) -> None:
    """From the step on, with and without static friction."""
    without = scenario.replace(**{"shafts.table.breakaway_torque": None})
    both = {"static friction 8 N·m": (scenario, FIRST), "no more than in motion, 5 N·m": (without, SECOND)}
    results = {name: (lm.simulate(s, energy=False), style) for name, (s, style) in both.items()}
    errors = tuple(_curves(r, "servo_error", name, MRAD, style) for name, (r, style) in results.items())
    torques = tuple(_curves(r, "servo_torque", name, 1.0, style) for name, (r, style) in results.items())
    panels = [
        Panel("position error", "time [s]", "[mrad]", errors, y_range=(-10.0, 10.0)),
        Panel("torque of the motor", "time [s]", "[N·m]", torques),
    ]
    save(panels, 1, (9.0, 5.4), out, "hunting-run")


def certificates(out: Path, scenario: lm.Scenario) -> None:
    """The map from break-away to break-away, with and without static friction."""
    without = scenario.replace(**{"shafts.table.breakaway_torque": None})
    both = {"static friction 8 N·m": (scenario, FIRST), "no more than in motion, 5 N·m": (without, SECOND)}
    top = 20.0
    curves = [Curve("equal and opposite", np.array([0.0, top]), np.array([0.0, -top]), OPPOSITE)]
    for name, (one, style) in both.items():
        certificate = lm.hunting_certificate(one)
        assert certificate.map is not None
        curves.append(Curve(name, MRAD * certificate.map["error"], MRAD * certificate.map["image"], style))
        cycles = MRAD * np.array([point.amplitude for point in certificate.fixed_points])
        curves.append(Curve("limit cycle", cycles, -cycles, POINT | {"color": style["color"]}, "_"))
    labels = ("error at the break-away [mrad]", "error left by the slip [mrad]")
    panel = Panel("From break-away to break-away", *labels, tuple(curves), x_range=(0.0, top), y_range=(-10.0, 4.0))
    save([panel], 1, (7.0, 4.2), out, "hunting-certificate")


def maps(out: Path, scenario: lm.Scenario) -> None:
    """Over static friction and integral gain."""
    grid = {
        "controllers.servo.position.integral_gain": np.linspace(4.0, 64.0, 40),
        "shafts.table.breakaway_torque": np.linspace(5.0, 12.0, 40),
    }
    found = lm.servo.hunting_map(scenario, grid)
    found.lm.plot().savefig(out / "hunting-map.png", dpi=100, metadata={"Software": None})


def write(out: Path) -> None:
    """All figures of the page, into a directory."""
    scenario = lm.load("hunting-with-static-friction")
    assert scenario.form != DRIVE
    run(out, scenario)
    certificates(out, scenario)
    maps(out, scenario)
