"""Figures of limit cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..units.practical import charted, printed
from . import plots
from .contours import contours
from .figure_style import INK, MUTED, SMALLEST, map_colours

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


@plots.in_our_looks
def map_figure(found: xarray.Dataset) -> Figure:
    """Amplitude and frequency of a hunting map over its two keys; white where there is no limit cycle, hatched where it is
    unstable.

    Raises InputError: the map has one key.
    """
    dims = found["amplitude"].dims
    if len(dims) != 2:
        raise InputError("this map has one key, and the figure shows two; draw its variables amplitude and frequency")
    figure = plots.Picture(figsize=(10.0, 4.0))
    x, y = found[dims[1]], found[dims[0]]
    cycles = np.isfinite(found["frequency"].values)
    amplitude, factor = _amplitude(found)
    labels = {"amplitude": amplitude, "frequency": "frequency [Hz]"}
    for axes, (name, label) in zip(figure.subplots(1, 2, sharey=True), labels.items(), strict=True):
        values = found[name].values * (factor if name == "amplitude" else 1.0)
        shown: Any = np.ma.masked_array(values, ~cycles)
        mesh = axes.pcolormesh(x.values, y.values, shown, cmap=map_colours(), shading="nearest", rasterized=True)
        unstable = np.where(cycles & ~found["stable"].values, 1.0, np.nan)
        if np.isfinite(unstable).any():
            axes.contourf(x.values, y.values, unstable, levels=[0.5, 1.5], hatches=["///"], alpha=0.0)
        plots.draw_contours(axes, contours(x.values, y.values, shown.filled(np.nan), log_x=False, log_y=False))
        axes.contour(x.values, y.values, cycles.astype(float), levels=[0.5], colors=INK, linewidths=1.0)
        axes.grid(visible=False)
        figure.colorbar(mesh, ax=axes)
        axes.set_title(label)
        axes.set_xlabel(_label(x))
    figure.axes[0].set_ylabel(_label(y))
    figure.supxlabel("White: no limit cycle. Hatched: an unstable one.", fontsize=SMALLEST, color=MUTED)
    return figure


def _amplitude(found: xarray.Dataset) -> tuple[str, float]:
    """Label of the amplitude, and the factor from SI to its unit."""
    name = found.attrs["variable"].replace("_", " ")
    if "units" not in found["amplitude"].attrs:
        return f"amplitude of {name} (SI)", 1.0
    unit, factor = charted(found["amplitude"].attrs["units"], small=True)
    return f"amplitude of {name} [{unit}]", factor


def _label(key: xarray.DataArray) -> str:
    """The last two words of a dotted key in plain text, with its unit."""
    words = " ".join(str(key.attrs["long_name"]).split(".")[-2:]).replace("_", " ")
    unit = printed(str(key.attrs.get("units", "")))
    return words if unit in ("", "1") else f"{words} [{unit}]"
