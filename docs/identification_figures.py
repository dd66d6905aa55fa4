"""Figure of docs/identification-tutorial.md: measured loops of the cycloidal actuators, and those of the drives identified from other logs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from figure_files import save

import lostmotion as lm
from lostmotion.identification.rig.rig_runs import run_log
from lostmotion.reports.figure_style import MEASURED, SECOND
from lostmotion.reports.panels import Curve, Panel

EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "cycloidal"


def loops(name: str, result: lm.identification.IdentificationResult) -> list[Panel]:
    """Torque against position of the log that was held out, in a small and in a large ramp."""
    assert result.rig is not None
    (log,) = [log for log in result.logs if log.held_out]
    run = run_log(result.rig, log, result.values_for(log.name), result.chosen)["position"]
    torque, ramp = log.log.values("torque"), log.log.values("ramp")
    panels = []
    for number, what in ((2, "ramp to 4 N·m"), (101, "ramp to 25 N·m")):
        part = ramp == number
        middle = np.degrees(log.measured["position"][part].mean())
        curves = tuple(
            Curve(label, torque[part], np.degrees(x[part]) - middle, style)
            for label, x, style in (
                ("measured, held out", log.measured["position"], MEASURED),
                ("identified from other angles", run, SECOND),
            )
        )
        panels.append(Panel(f"{name}, {what}", "torque [N·m]", "position [deg]", curves))
    return panels


def write(out: Path) -> None:
    """The page's figure into a directory."""
    panels = []
    for name, file in (("baseline", "baseline.toml"), ("split pin wheel", "split-pinwheel.toml")):
        panels += loops(name, lm.identify(EXAMPLE / file))
    save(panels, 2, (10.0, 7.2), out, "cycloidal-loops")
