"""Files of the figures of pages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from lostmotion.reports import plots
from lostmotion.reports.panels import Panel


def save(panels: Sequence[Panel], columns: int, size: tuple[float, float], out: Path, name: str) -> None:
    """Draws panels into a file."""
    plots.draw(panels, columns, size).savefig(out / f"{name}.png", dpi=100, metadata={"Software": None})
