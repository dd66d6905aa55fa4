"""Pictures of a frequency response: Bode figures, maps over amplitude and frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..errors import InputError
from . import plots
from .response import bode, maps

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def bode_figure(responses: Mapping[str, xarray.Dataset], output: str) -> Figure:
    """Gain over phase; the panels are the panels of `bode`."""
    return plots.draw(bode(responses, output), 1, (9.0, 7.5))


def maps_figure(response: xarray.Dataset, output: str) -> Figure:
    """The maps of `maps` as contours. Raises InputError: there are fewer than two amplitudes or frequencies."""
    found = maps(response, output)
    if not found:
        raise InputError(
            "maps need at least two amplitudes and two frequencies; plot() draws the response over frequency"
        )
    return plots.draw(found, 2, (10.0, 6.8))
