"""Figure of docs/control.md: the frequency response of a closed loop over amplitude."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import lostmotion as lm


def write(out: Path) -> None:
    """The page's figure into a directory."""
    response = lm.frequency_response(lm.load("position-axis"), np.geomspace(0.2, 50.0, 40).tolist(), [0.002, 0.02, 0.2])
    response.lm.plot("measured_position").savefig(out / "loop-response.png")
