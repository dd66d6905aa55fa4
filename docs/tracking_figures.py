"""Figures of docs/tracking.md, from exact runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from figure_files import following_error, save

import lostmotion as lm
from lostmotion.reports.figure_style import FAINT, FIRST, SECOND, THIRD
from lostmotion.reports.panels import Curve, Panel

FREQUENCY = 0.25
PEAK_SPEEDS = np.geomspace(0.002, 2.0, 13)
# Of each controller what its inverse model knows.
MODELS: dict[str, tuple[dict[str, Any] | None, dict[str, Any]]] = {
    "no feedforward of torque": (None, FAINT),
    "constant efficiency of 0.9": ({"efficiency": 0.9}, SECOND),
    "loss map": ({}, FIRST),
    "adaptive, from 0.6 of the losses": (
        {"loss_factor": 0.6, "loss_adaptation": {"rate": 500.0}, "min_speed": 0.05},
        THIRD,
    ),
}


def axis(peak_speed: float, model: dict[str, Any] | None) -> lm.Scenario:
    """The axis of the shipped scenarios on a sine, from its lower end, with ideal encoders."""
    shipped = lm.load("tracking-loss-map")
    assert isinstance(shipped, lm.Scenario)
    assert shipped.controller is not None
    controller = shipped.controller.model_dump(exclude_none=True)
    amplitude = peak_speed / (2.0 * np.pi * FREQUENCY)
    controller["reference"] = {
        "kind": "position",
        "amplitude": amplitude,
        "frequency": FREQUENCY,
        "phase": -0.5 * np.pi,
    }
    controller["encoder"], controller["position_encoder"] = {"ideal": True}, {"ideal": True, "shaft": "load"}
    del controller["speed"]["torque_limit"], controller["inverse_model"]
    if model is not None:
        controller["inverse_model"] = model
    start = {"initial.load_angle": -amplitude, "initial.load_speed": 0.0, "initial.motor_speed": 0.0}
    return shipped.replace(controller=controller, **{"simulation.duration": 20.0}, **start)


def peak_error(scenario: lm.Scenario, after: float) -> float:
    """Of the load [rad]."""
    t, error = following_error(scenario)
    return float(np.abs(error)[t > after].max())


def over_amplitude(out: Path) -> None:
    """The claim: how the peak error depends on how fast the axis moves."""
    curves = tuple(
        Curve(name, PEAK_SPEEDS, np.array([1e3 * peak_error(axis(w, model), 12.0) for w in PEAK_SPEEDS]), style)
        for name, (model, style) in MODELS.items()
    )
    panel = Panel(
        "sine of 0.25 Hz: peak error of the load", "peak speed of the load [rad/s]", "error [mrad]", curves,
        log_x=True, log_y=True,
    )  # fmt: skip
    save([panel], 1, (8.0, 4.0), out, "tracking-amplitude")


def fly_by(out: Path) -> None:
    """The shipped scenarios."""
    names = {"tracking-constant-efficiency": SECOND, "tracking-loss-map": FIRST, "tracking-adaptive": THIRD}
    errors, factors = [], []
    for name, style in names.items():
        scenario = lm.load(name)
        run = lm.simulate(scenario, energy=False)
        t = run["time"].to_numpy()
        error = scenario.controller.reference.at(t)[0] - run["load_angle"].to_numpy()  # type: ignore[union-attr]
        label = name.removeprefix("tracking-").replace("-", " ")
        errors.append(Curve(label, t, 1e3 * error, style))
        if name != "tracking-constant-efficiency":
            factors.append(Curve(label, t, run["model_loss_factor"].to_numpy(), style))
    panels = [
        Panel("elevation of a fly-by: reference less load", "time [s]", "error [mrad]", tuple(errors)),
        Panel("factor on the losses in the controller", "time [s]", "factor [-]", tuple(factors)),
    ]
    save(panels, 2, (10.0, 3.6), out, "tracking-fly-by")


def by_camera(out: Path) -> None:
    """The camera's fly-by over time, and what its latency costs with and without prediction."""
    shipped = lm.load("tracking-camera")
    known = lm.load("tracking-loss-map")
    late = {"controller.tracker.prediction": False}
    ways = {
        "target known": (known, FAINT),
        "camera, predicted": (shipped, FIRST),
        "camera, not predicted": (shipped.replace(**late), SECOND),
    }
    errors = []
    for label, (scenario, style) in ways.items():
        t, error = following_error(scenario)
        errors.append(Curve(label, t[t > SETTLED], 1e3 * error[t > SETTLED], style))
    latencies = np.array([0.0, 0.02, 0.04, 0.06, 0.08, 0.1])
    over = []
    for label, changes, style in (("predicted", {}, FIRST), ("not predicted", late, SECOND)):
        rms = [_rms(shipped.replace(**changes, **{"controller.camera.latency": x})) for x in latencies.tolist()]
        over.append(Curve(label, 1e3 * latencies, 1e3 * np.array(rms), style))
    panels = [
        Panel("elevation of a fly-by: target less load", "time [s]", "error [mrad]", tuple(errors)),
        Panel("rms error after 2 s", "latency of the camera [ms]", "error [mrad]", tuple(over)),
    ]
    save(panels, 2, (10.0, 3.6), out, "tracking-camera")


SETTLED = 2.0  # s, after which the tracker has found the target


def _rms(scenario: Any) -> float:
    t, error = following_error(scenario)
    return float(np.sqrt(np.mean(error[t > SETTLED] ** 2)))


def write(out: Path) -> None:
    """All figures of the page into a directory."""
    over_amplitude(out)
    fly_by(out)
    by_camera(out)
