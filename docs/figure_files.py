"""Files of the figures of pages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import lostmotion as lm
from lostmotion.reports import plots
from lostmotion.reports.panels import Panel


def following_error(scenario: lm.Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Instants of a run [s], and the reference less the angle of the load [rad]."""
    run = lm.simulate(scenario, energy=False)
    t = run["time"].to_numpy()
    return t, scenario.controller.reference.at(t)[0] - run["load_angle"].to_numpy()  # type: ignore[union-attr]


def save(panels: Sequence[Panel], columns: int, size: tuple[float, float], out: Path, name: str) -> None:
    """Draws panels into a file."""
    plots.draw(panels, columns, size).savefig(out / f"{name}.png", dpi=100, metadata={"Software": None})


def smaller(path: Path) -> None:
    """Writes a picture again with 32 colours, which takes a quarter of the space and is enough for curves."""
    Image.open(path).convert("RGB").quantize(32, dither=Image.Dither.NONE).save(path, optimize=True)
