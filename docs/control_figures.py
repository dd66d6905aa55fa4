"""Figure of docs/control.md: the frequency response of a closed loop over amplitude."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import lostmotion as lm
from lostmotion.reports.response_figures import bode_figure


def write(out: Path) -> None:
    """The page's figure into a directory."""
    response = lm.frequency_response(lm.load("position-axis"), np.geomspace(0.2, 50.0, 40).tolist(), [0.002, 0.02, 0.2])
    bode_figure({"position-axis": response}, "measured_position").savefig(out / "loop-response.png")
